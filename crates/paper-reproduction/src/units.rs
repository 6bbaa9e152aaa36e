//! The paper's units: millimetres and pulses.

/// Controller counts in one of the paper's pulses, as the shipped scenario has them.
pub(crate) const COUNTS_PER_PULSE: f64 = 80.0;

pub(crate) const MM_PER_M: f64 = 1e3;
