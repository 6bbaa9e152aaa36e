//! Limits of what a scenario may state.

use crate::error::ScenarioError;

/// Most runs of one scenario, over all protocols: each is kept in memory.
pub(crate) const MAX_RUNS: u64 = 100_000;

/// Bounds of robots that drive on floors and of their rooms, wide enough for any of them: they keep a slip of
/// the pen from running for days.
pub(crate) const LENGTHS_M: std::ops::RangeInclusive<f64> = 1e-3..=1e4;

/// Refuses values that are outside of their ranges.
#[derive(Clone, Copy)]
pub(crate) struct Ranges<'a> {
    /// The file.
    pub(crate) location: &'a str,
    /// How all keys begin.
    pub(crate) prefix: &'a str,
}

impl Ranges<'_> {
    pub(crate) fn range(self, key: &str, value: f64, holds: bool, must_be: &'static str) -> Result<(), ScenarioError> {
        if holds {
            return Ok(());
        }
        let (location, key) = (self.location.to_owned(), format!("{}{key}", self.prefix));
        Err(ScenarioError::OutOfRange { location, key, value, must_be })
    }

    pub(crate) fn positive(self, key: &str, value: f64) -> Result<(), ScenarioError> {
        self.range(key, value, value.is_finite() && value > 0.0, "positive")
    }

    pub(crate) fn not_negative(self, key: &str, value: f64) -> Result<(), ScenarioError> {
        self.range(key, value, value.is_finite() && value >= 0.0, "0 or more")
    }

    pub(crate) fn finite(self, key: &str, value: f64) -> Result<(), ScenarioError> {
        self.range(key, value, value.is_finite(), "finite")
    }

    pub(crate) fn length(self, key: &str, value: f64) -> Result<(), ScenarioError> {
        self.range(key, value, LENGTHS_M.contains(&value), "from 0.001 to 10000 m")
    }

    pub(crate) fn interval(self, key: &str, value: f64) -> Result<(), ScenarioError> {
        self.range(key, value, (1e-5..=1e3).contains(&value), "from 0.00001 to 1000 s")
    }
}
