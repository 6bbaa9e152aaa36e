//! What a page is made of: typed, and free of HTML.

use crate::bars::Bars;
use crate::chart::Chart;
use crate::error_picture::ErrorPicture;
use crate::path_picture::PathPicture;
use crate::sketch::Sketch;
use crate::table::Table;

/// A whole page.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// The command, such as `yair diagnose`.
    pub command: String,
    /// What it was run on.
    pub subject: String,
    /// How the answer is to be taken.
    pub tone: Tone,
    /// The answer in a plain sentence.
    pub headline: String,
    /// What it means for the robot's odometry.
    pub lead: String,
    /// The quantity that decides, before and after; the first thing that a reader sees.
    pub bars: Option<Bars>,
    /// The few facts that a reader needs next.
    pub tiles: Vec<Tile>,
    /// The sections in order.
    pub sections: Vec<Section>,
    /// Sections that are closed at first.
    pub appendix: Vec<Section>,
    /// How the page was made.
    pub made_by: MadeBy,
}

/// How an answer is to be taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tone {
    /// Something was found.
    Found,
    /// Something was found whose cause is not certain.
    Uncertain,
    /// Nothing is wrong, as far as the data show.
    Fine,
    /// Numbers without a judgement.
    Neutral,
}

impl Tone {
    /// The name of its class in the style sheet.
    pub(crate) const fn class(self) -> &'static str {
        match self {
            Self::Found => "found",
            Self::Uncertain => "uncertain",
            Self::Fine => "fine",
            Self::Neutral => "neutral",
        }
    }

    /// In words, so that no colour has to be seen.
    pub(crate) const fn words(self) -> &'static str {
        match self {
            Self::Found => "Cause found",
            Self::Uncertain => "Cause not certain",
            Self::Fine => "Nothing found",
            Self::Neutral => "Result",
        }
    }
}

/// A fact of the first screen.
#[derive(Debug, Clone, PartialEq)]
pub struct Tile {
    /// The question that it answers.
    pub label: String,
    /// The answer.
    pub value: String,
    /// What is to be known beside it.
    pub note: String,
    /// The id of the section that tells more; none where it is empty.
    pub section: String,
}

/// A section of the page.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    /// Its anchor.
    pub id: &'static str,
    /// Its heading.
    pub title: String,
    /// What stands in it.
    pub blocks: Vec<Block>,
}

impl Section {
    /// A section without content yet.
    #[must_use]
    pub fn new(id: &'static str, title: &str) -> Self {
        Self { id, title: title.to_owned(), blocks: Vec::new() }
    }

    /// Adds a block.
    #[must_use]
    pub fn with(mut self, block: Block) -> Self {
        self.blocks.push(block);
        self
    }

    /// Adds a paragraph.
    #[must_use]
    pub fn text(self, text: impl Into<String>) -> Self {
        self.with(Block::Text(text.into()))
    }
}

/// A part of a section.
#[derive(Debug, Clone, PartialEq)]
pub enum Block {
    /// A paragraph.
    Text(String),
    /// A paragraph that must not be missed.
    Warning(String),
    /// A list.
    List(Vec<String>),
    /// Text to be copied: what it is, and the text.
    Code(String, String),
    /// A table.
    Table(Table),
    /// The robot's path.
    Path(PathPicture),
    /// Errors along each run.
    Errors(ErrorPicture),
    /// Points and lines over an axis.
    Chart(Chart),
    /// Charts beside each other where there is room.
    Charts(Vec<Chart>),
    /// Manoeuvres.
    Sketches(Vec<Sketch>),
    /// What opens when its label is chosen.
    Folded(String, Vec<Block>),
    /// A picture that is there already: a text for who does not see it, and the whole SVG file.
    Svg(String, String),
}

/// How a page was made.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MadeBy {
    /// The program's version.
    pub version: String,
    /// The command line as it was typed.
    pub command_line: String,
    /// The datasets, with how much is in each.
    pub datasets: Vec<String>,
}
