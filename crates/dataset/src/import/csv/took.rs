//! What was taken for what: shown to the user before anything is believed.

use serde::Serialize;

/// How sure a decision is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Confidence {
    /// The user said so.
    Given,
    /// Written in the file.
    Certain,
    /// By evidence.
    Likely,
    /// A convention; nothing in the file could tell.
    Assumed,
}

impl Confidence {
    /// The word for people.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Given => "given",
            Self::Certain => "certain",
            Self::Likely => "likely",
            Self::Assumed => "assumed",
        }
    }
}

/// Why something was decided as it was.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Basis {
    /// How sure it is.
    pub confidence: Confidence,
    /// By what.
    pub why: String,
}

impl Basis {
    pub(super) fn new(confidence: Confidence, why: impl Into<String>) -> Self {
        Self { confidence, why: why.into() }
    }
}

/// One column that was taken.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct TookColumn {
    /// The key that `--map` uses.
    pub quantity: &'static str,
    /// Its name, or its number where there is no header.
    pub column: String,
    /// From 1.
    pub number: usize,
    /// The unit that its values were taken in.
    pub unit: &'static str,
    /// Its first cells as they are written.
    pub first: Vec<String>,
    /// Why this column.
    pub chosen: Basis,
    /// Why this unit.
    pub unit_by: Basis,
    /// What changes the unit; `--map` changes the column.
    pub flag: &'static str,
}

/// One file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct TookFile {
    /// As it was given.
    pub file: String,
    /// Between fields.
    pub delimiter: &'static str,
    /// In numbers.
    pub decimal: &'static str,
    /// Line of the header, from 1.
    pub header_line: Option<u64>,
    /// Rows below it.
    pub rows: usize,
    /// What was taken.
    pub columns: Vec<TookColumn>,
    /// Names of columns that were not.
    pub left_out: Vec<String>,
}

/// Everything that was decided.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Took {
    /// The files.
    pub files: Vec<TookFile>,
    /// What makes the runs.
    pub runs_by: String,
    /// For speeds: what a row's value holds for.
    pub rates: Option<Basis>,
    /// Further sentences that a user should read.
    pub remarks: Vec<String>,
}
