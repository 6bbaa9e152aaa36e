//! What stands in a row: its columns, its stamp, and values in whole steps.

use crate::draws::Draws;
use crate::robot::{Records, Stamps};

impl Records {
    /// The columns of a table.
    pub(crate) const fn columns(self) -> &'static str {
        match self {
            Self::Counts => "left_ticks,right_ticks",
            Self::Angles { .. } => "left_rad,right_rad",
            Self::Speeds { .. } => "left_mps,right_mps",
            Self::Twists { .. } => "v_mps,omega_radps",
        }
    }
}

impl Stamps {
    /// The stamp of what is of this time; the next one is later.
    pub(crate) fn of(self, true_s: f64, draws: &mut Draws) -> f64 {
        match self {
            Self::Exact => true_s,
            Self::Jitter(sigma_s) => true_s + sigma_s * draws.normal(),
            Self::Received(mean_s) => true_s - mean_s * (1.0 - draws.uniform()).ln(),
            Self::RoundedTo(step_s) => (true_s / step_s).round() * step_s,
        }
    }
}

/// A value in whole steps; as it is without.
pub(crate) fn in_steps_of(step: f64, value: f64) -> f64 {
    if step > 0.0 { (value / step).round() * step } else { value }
}
