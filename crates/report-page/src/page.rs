//! The page's text: templates filled, hashes computed, its size bounded.

use askama::Template;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use crate::chart::Chart;
use crate::content_policy::{SCRIPTS, STYLE, policy};
use crate::error::PageError;
use crate::error_picture::ErrorPicture;
use crate::path_picture::{Drawn, PathPicture};
use crate::report::{Block, Report};
use crate::table::{Cell, Table};

/// The largest page: what trackers of issues take as an attachment without asking.
const MAX_BYTES: usize = 2_000_000;

#[derive(Template)]
#[template(path = "page.html")]
struct Page<'r> {
    report: &'r Report,
    policy: String,
    style: &'static str,
    scripts: [&'static str; 3],
}

#[derive(Template)]
#[template(path = "table.html")]
struct TableView<'t> {
    table: &'t Table,
}

#[derive(Template)]
#[template(path = "picture.html")]
struct PictureView<'p> {
    kind: &'static str,
    title: &'p str,
    caption: &'p str,
    share: &'p str,
    description: &'p str,
    json: &'p str,
    table: &'p Table,
}

#[derive(Template)]
#[template(path = "block.html")]
struct BlockView<'b> {
    block: &'b Block,
}

/// A table as it stands in a page.
fn table(table: &Table) -> askama::Result<String> {
    TableView { table }.render()
}

/// A part of a section as it stands in a page.
fn block(block: &Block) -> askama::Result<String> {
    BlockView { block }.render()
}

/// A chart as it stands in a page.
fn chart(chart: &Chart) -> askama::Result<String> {
    PictureView {
        kind: "chart",
        title: &chart.title,
        caption: &chart.caption,
        share: "",
        description: &chart.description(),
        json: &chart.json(),
        table: &chart.table(),
    }
    .render()
}

/// Paths as they stand in a page.
fn paths(picture: &PathPicture) -> askama::Result<String> {
    runs("path", &picture.title, &picture.caption, &picture.description(), &picture.drawn())
}

/// Errors along runs as they stand in a page.
fn errors(picture: &ErrorPicture) -> askama::Result<String> {
    runs("errors", &picture.title, &picture.caption, &picture.description(), &picture.drawn())
}

/// A picture of runs that may be thinned.
fn runs(kind: &'static str, title: &str, caption: &str, description: &str, drawn: &Drawn) -> askama::Result<String> {
    let Drawn { share, json, table } = drawn;
    PictureView { kind, title, caption, share, description, json, table }.render()
}

/// A picture that is there already, as a source of an image.
fn data_uri(svg: &str) -> String {
    format!("data:image/svg+xml;base64,{}", STANDARD.encode(svg))
}

impl Report {
    /// The page.
    ///
    /// # Errors
    /// [`PageError`] when a template fails or the page is larger than 2 MB.
    pub fn render(&self) -> Result<String, PageError> {
        let text = Page { report: self, policy: policy(), style: STYLE, scripts: SCRIPTS }.render()?;
        if text.len() > MAX_BYTES {
            return Err(PageError::TooLarge { bytes: text.len(), limit: MAX_BYTES });
        }
        Ok(text)
    }
}

#[cfg(test)]
mod tests;
