//! A figure: the description of what is drawn.

use crate::error::ReportError;
use crate::font::Font;
use crate::panel::Panel;

/// The width of every figure in SVG pixels; its height follows from its panels.
pub const WIDTH_PX: f64 = 900.0;
/// With more columns the labels of a figure of [`WIDTH_PX`] would fill it.
pub const MAX_COLUMNS: usize = 3;

/// Panels in a grid under a title, with a caption.
///
/// ```
/// use report::{Axis, Figure, Marks, Panel, Scale, Series};
///
/// let (effort, bias_mm) = (vec![1.0, 3.0, 10.0], vec![2.1, 1.2, 0.4]);
/// let points = effort.iter().copied().zip(bias_mm).collect();
/// let runs = Axis::dimensionless("runs").scale(Scale::Log);
/// let panel = Panel::new("Bias", runs, Axis::new("bias of the track", "mm"))
///     .series(Series::new("umbmark", Marks::Points { points, y_error: Some(vec![0.5, 0.3, 0.2]) }))
///     .series(Series::new("no bias", Marks::HorizontalLine { y: 0.0 }));
/// let figure = Figure::new("More runs, less bias").caption("scenario paper.toml, seed 7").panel(panel);
/// assert!(figure.to_svg()?.contains("bias of the track (mm)"));
/// # Ok::<(), report::ReportError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[must_use]
pub struct Figure {
    pub(crate) title: String,
    pub(crate) caption: String,
    pub(crate) columns: usize,
    pub(crate) panels: Vec<Panel>,
}

impl Figure {
    /// Its panels in order, for other drawings of the same.
    pub fn panels(&self) -> &[Panel] {
        &self.panels
    }

    /// The text under it.
    #[must_use]
    pub fn caption_text(&self) -> &str {
        &self.caption
    }

    /// A figure without panels yet, in one column.
    pub fn new(title: &str) -> Self {
        Self { title: title.to_owned(), caption: String::new(), columns: 1, panels: Vec::new() }
    }

    /// The text below the panels: what makes the figure reproducible, say scenario, seed and number of
    /// trials.
    pub fn caption(mut self, caption: &str) -> Self {
        caption.clone_into(&mut self.caption);
        self
    }

    /// Panels beside each other, 1 to [`MAX_COLUMNS`].
    pub fn columns(mut self, columns: usize) -> Self {
        self.columns = columns;
        self
    }

    /// Adds a panel, row by row.
    pub fn panel(mut self, panel: Panel) -> Self {
        self.panels.push(panel);
        self
    }

    /// Whether all of it can be drawn, and in this font.
    pub(crate) fn check(&self, font: &Font) -> Result<(), ReportError> {
        let figure = || self.title.clone();
        if self.panels.is_empty() {
            return Err(ReportError::NoPanels { figure: figure() });
        }
        if !(1..=MAX_COLUMNS).contains(&self.columns) {
            return Err(ReportError::Columns { figure: figure(), columns: self.columns, most: MAX_COLUMNS });
        }
        for panel in &self.panels {
            panel.check(&self.title)?;
        }
        let of_panel = |panel: &Panel| {
            let texts = [&panel.title, &panel.x.label, &panel.y.label].map(Clone::clone);
            texts.into_iter().chain(panel.series.iter().map(|series| series.name.clone())).collect::<Vec<_>>()
        };
        let texts = [self.title.clone(), self.caption.clone()].into_iter().chain(self.panels.iter().flat_map(of_panel));
        for text in texts {
            if let Some(character) = font.missing(&text) {
                return Err(ReportError::NoGlyph { figure: figure(), text, character });
            }
        }
        Ok(())
    }
}
