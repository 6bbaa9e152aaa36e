//! Tables, and the cells that they are made of.

/// A table.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Table {
    /// What it shows.
    pub caption: String,
    /// Its headings.
    pub headings: Vec<String>,
    /// Its rows.
    pub rows: Vec<Vec<Cell>>,
}

/// Rows of a table that are written; more make a page that no issue takes.
const MAX_ROWS: usize = 200;

impl Table {
    /// A table without rows yet.
    #[must_use]
    pub fn new(caption: &str, headings: &[&str]) -> Self {
        let headings = headings.iter().map(|heading| (*heading).to_owned()).collect();
        Self { caption: caption.to_owned(), headings, rows: Vec::new() }
    }

    /// Adds a row.
    pub fn row(&mut self, cells: impl IntoIterator<Item = Cell>) {
        self.rows.push(cells.into_iter().collect());
    }

    pub(crate) fn shown(&self) -> &[Vec<Cell>] {
        &self.rows[..self.rows.len().min(MAX_ROWS)]
    }

    pub(crate) fn left_out(&self) -> usize {
        self.rows.len().saturating_sub(MAX_ROWS)
    }

    /// Whether a column holds numbers, which stand at its right edge.
    pub(crate) fn is_numeric(&self, column: &usize) -> bool {
        let mut cells = self.rows.iter().filter_map(|row| row.get(*column)).peekable();
        cells.peek().is_some() && cells.all(|cell| matches!(cell, Cell::Number(_)))
    }
}

/// A cell of a table.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// Words.
    Text(String),
    /// A name that commands and files use.
    Id(String),
    /// A number with what is known of it.
    Number(String),
}

impl Cell {
    /// Words.
    pub fn text(text: impl Into<String>) -> Self {
        Self::Text(text.into())
    }

    /// A name that commands and files use.
    pub fn id(text: impl Into<String>) -> Self {
        Self::Id(text.into())
    }

    /// A number.
    pub fn number(text: impl Into<String>) -> Self {
        Self::Number(text.into())
    }
}
