//! Times contenders in turn and holds the ratios of their times against a baseline.

mod gate;
mod race;

pub use gate::{Baseline, Gate, GateError};
pub use race::{Contender, Race, Ratio};
