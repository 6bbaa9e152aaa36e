//! The noise of what was simulated, as the likelihood of who knows it has it.

use estimation::Noise;

use super::conditions::Conditions;
use super::instrument::{InstrumentModel, TruthKind};

/// The true noise: of the wheels, and of the measured positions and headings.
///
/// Rounded counts put the dead-reckoned pose off by half of what both wheels' counts are, and by their
/// difference over the wheelbase. With q/√12 for each wheel that is J diag(q²/12) Jᵀ: q²/24 along the robot
/// and q²/(6 b²) in heading; a displacement has it at both ends. It is taken as white errors of the
/// measurements, the along part in both coordinates. That is a first form: rounding lasts while a count
/// stands, and on straights at an even speed it is neither uniform nor white. Errors of stamps, of variance
/// τ², are so too: τ² by the mean square of the speed, half of it in each coordinate, and of the yaw rate.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TrueNoise {
    wheel_var_per_m: f64,
    measurement_var: [f64; 2],
    rounding_var: [f64; 2],
}

/// Rounding below this share of all of the variance is none.
const MIN_ROUNDING_SHARE: f64 = 0.02;

/// The noise of a robot whose counts say nearly all of a turn.
const MIN_VAR: f64 = 1e-16;

impl TrueNoise {
    pub(crate) fn of(
        conditions: &Conditions,
        instrument_model: &InstrumentModel,
        [speed_m2_s2, yaw_rate_rad2_s2]: [f64; 2],
    ) -> Self {
        let stamps_s2 = conditions.stamp_sigma_s().powi(2);
        let [xy, theta] = instrument_model.variances();
        let ends = if instrument_model.kind == TruthKind::Relative { 2.0 } else { 1.0 };
        let tick_m2 = conditions.tick_m().powi(2);
        Self {
            wheel_var_per_m: conditions.wheel_sigma_m_per_sqrt_m.powi(2),
            measurement_var: [xy + 0.5 * ends * stamps_s2 * speed_m2_s2, theta + ends * stamps_s2 * yaw_rate_rad2_s2],
            rounding_var: [tick_m2 / 24.0, tick_m2 / (6.0 * conditions.wheel_separation_m.powi(2))]
                .map(|variance| ends * variance),
        }
    }

    /// The same with counts that are not rounded.
    pub(crate) fn without_rounding(self) -> Self {
        Self { rounding_var: [0.0; 2], ..self }
    }

    /// Whether rounding matters beside the other errors.
    pub(crate) fn has_rounding(self) -> bool {
        self.rounding_var
            .iter()
            .zip(self.measurement_var)
            .any(|(rounding, other)| *rounding > MIN_ROUNDING_SHARE * other)
    }

    /// Standard deviation of the heading's rounding over that of its measurements.
    pub(crate) fn heading_rounding_ratio(self) -> f64 {
        (self.rounding_var[1] / self.measurement_var[1]).sqrt()
    }

    pub(crate) fn noise(self) -> Noise {
        let [xy, theta]: [f64; 2] = std::array::from_fn(|k| self.measurement_var[k] + self.rounding_var[k]);
        Noise {
            variance: [self.wheel_var_per_m, MIN_VAR, xy, theta].map(|variance| variance.max(MIN_VAR)),
            timing_s2: 0.0,
        }
    }
}
