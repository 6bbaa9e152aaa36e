//! Limits of what a scenario may state.

/// Most runs of one scenario, over all protocols: each is kept in memory.
pub(crate) const MAX_RUNS: u64 = 100_000;

/// Bounds of robots that drive on floors and of their rooms, wide enough for any of them: they keep a slip of
/// the pen from running for days.
pub(crate) const LENGTHS_M: std::ops::RangeInclusive<f64> = 1e-3..=1e4;
