//! Levels and margins that several stages of the diagnosis share: value, unit, meaning, and where each is from.

/// Family-wise rate of false positives of all checks.
pub(crate) const CHECKS_LEVEL: f64 = 0.01;

/// Rate of false positives of the search for a sparse term.
pub(crate) const UNLISTED_LEVEL: f64 = 0.005;

/// Family-wise rate of false positives of the scan over the catalogue: with the checks' and that of terms without a name, 5 %.
pub(crate) const SCAN_LEVEL: f64 = 0.05 - CHECKS_LEVEL - UNLISTED_LEVEL;

/// Most effects that are sought.
pub(crate) const MAX_EFFECTS: usize = 3;

/// Chance at which a size that is none passes for one over the runs, once it has passed over the measurements.
pub(crate) const RUNS_LEVEL: f64 = 0.05;

/// That of turns that scatter: whatever the model lacks makes turns differ from run to run, so that they must do so beyond any doubt.
pub(crate) const TURNS_LEVEL: f64 = 1e-7;

/// Fewer runs say nothing of how runs differ; to be held out, they are cut into blocks.
pub(crate) const MIN_RUNS: usize = 6;

/// √λ for power 0.9 at a two-sided level of 1e-3.
pub(crate) const DETECTION_SQRT_LAMBDA: f64 = 4.57;

/// Names within this of the best, in log chance of the data, cannot be told apart: one in twenty.
pub(crate) const MIN_LOG_ODDS_MARGIN: f64 = 3.0;

/// A hypothesis describes its effect to a tenth of its size or so, and errs by the square of that in what it explains.
pub(crate) const MODEL_MISMATCH_FRACTION: f64 = 0.01;

/// What stands out by less than so many standard deviations, after its own trials, may be an accident of the whole catalogue's, or the shadow of something else.
pub(crate) const LOW_SIGNIFICANCE: f64 = 4.5;
