//! A ratio of the calibrated geometry that is not that of the described robot.

use effects::GeometryRatio;

use crate::settings::records::MAX_SKID_STEERED_SEPARATION;

/// A ratio of the geometry that is farther from its stated value than any robot of that description.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct GeometryDeviation {
    pub(crate) of: GeometryRatio,
    /// Calibrated over stated.
    pub(crate) ratio: f64,
    pub(crate) sigma: f64,
}

impl GeometryDeviation {
    /// How certain it is.
    pub(crate) fn chi_square(&self) -> f64 {
        (self.ratio.ln() * self.ratio / self.sigma).powi(2)
    }

    /// Whether a robot whose wheels skid in turns has it: its effective separation is larger than the
    /// wheels'.
    pub(crate) fn is_of_skid_steering(&self) -> bool {
        self.of == GeometryRatio::Separation && (1.0..=MAX_SKID_STEERED_SEPARATION).contains(&self.ratio)
    }
}
