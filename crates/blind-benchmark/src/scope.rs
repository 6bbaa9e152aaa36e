//! Which cases of a campaign are driven.

/// Which cases of a campaign are driven, and how far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scope {
    /// All of them, with planned runs and gains.
    Whole,
    /// Nulls, the single effects of every second block, and what is said of them: all that a baseline guards.
    Guarded,
    /// Single effects of the mean at ten to a hundred of their detection limits, whatever the number; no
    /// gains and no planned runs.
    Large,
}
