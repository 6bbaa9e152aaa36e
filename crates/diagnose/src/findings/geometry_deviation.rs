//! A ratio of the calibrated geometry that is not that of the described robot.

use effects::GeometryRatio;

use crate::settings::RECORDS;

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
        self.of == GeometryRatio::Separation && (1.0..=RECORDS.max_skid_steered_separation).contains(&self.ratio)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_robot_that_skids_in_turns_has_a_wider_separation_and_nothing_else() {
        let is = |of, ratio| GeometryDeviation { of, ratio, sigma: 0.01 }.is_of_skid_steering();
        assert!(is(GeometryRatio::Separation, 1.3));
        assert!(!is(GeometryRatio::Separation, 0.8) && !is(GeometryRatio::Separation, 50.0));
        assert!(!is(GeometryRatio::Wheels, 1.3) && !is(GeometryRatio::RightOverLeft, 1.3));
    }
}
