//! `quantization`: the log keeps whole ticks, each of several counts.
//!
//! Model: tick = ⌊count / n⌋. A noise model, never a finding.
//! Signature: an error of variance Δ²/12 a pose, so that increments have a lag-1 correlation of −½.
//! Observability: the record itself.
//! Alias: white noise of the instrument.
//! Reference: Navarro et al.: a pulse of about 1 mm is a number of the controller's counts; Sheppard 1898 for
//! Δ²/12.

use model_term::Interval;
use serde::{Deserialize, Serialize};

use crate::description::Description;
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, LaneForm, Readout};
use crate::hypothesis::{Hypothesis, value_of};
use crate::on_board::{Code, IntervalScatter, OnBoard, Scatter, ScatterModel};

/// What a robot's own odometry adds to its covariance: ticks that are so many counts are off by less than
/// one, uniformly, and whole counts are as good as exact beside them.
const ON_BOARD: OnBoard = OnBoard::CovarianceOnly(Scatter {
    of: "rounding of the present readings and of the first",
    code: Code::of(
        "\
const double share = (1.0 - 1.0 / (counts_per_tick * counts_per_tick)) / 12.0;
left_reading_var_m2 += share * left_count_m * left_count_m;
right_reading_var_m2 += share * right_count_m * right_count_m;",
    ),
    model: |size| Box::new(Rounding { share: (1.0 - size("counts_per_tick").powi(-2)) / 12.0 }),
});

/// Of readings, the variance over the square of a tick.
struct Rounding {
    share: f64,
}

impl ScatterModel for Rounding {
    fn after(&mut self, interval: &Interval<'_>, scatter: &mut IntervalScatter) {
        let var_m2 = interval.count_m.map(|count_m| self.share * count_m * count_m);
        scatter.reading_var_m2 = scatter.reading_var_m2.zip_with(var_m2, |sum, var_m2| sum + var_m2);
    }
}

/// Coarseness of the record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Quantization {
    /// Controller counts in one recorded tick (the paper's pulse).
    pub counts_per_tick: u32,
}

impl PhysicalEffect for Quantization {
    fn check(&self) -> Result<(), EffectError> {
        let n = self.counts_per_tick;
        EffectError::unless(n >= 1, "quantization", "counts_per_tick", f64::from(n), "1 or more")
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { effect: *self }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Silent
    }

    fn description() -> Description {
        Description { on_board: ON_BOARD, ..Description::of("the log keeps whole ticks of several counts each") }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        Some(Self { counts_per_tick: value_of(values, "counts_per_tick")? as u32 })
    }
}

struct State {
    effect: Quantization,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { readout: true, ..Hooks::NONE }
    }

    fn readout(&mut self, readout: &mut Readout) {
        readout.ticks = readout.ticks.map(|counts| counts.div_euclid(i64::from(self.effect.counts_per_tick)));
    }

    fn lane_form(&self) -> Option<LaneForm> {
        Some(LaneForm::Ticks { counts: self.effect.counts_per_tick })
    }

    fn counts_per_tick(&self) -> Option<u32> {
        Some(self.effect.counts_per_tick)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kinematics::Wheels;

    #[test]
    fn ticks_are_floors_on_both_sides_of_zero() {
        let mut state = State { effect: Quantization { counts_per_tick: 80 } };
        let ticks = Wheels { left: 159, right: -1 };
        let mut readout = Readout { ticks, m_per_count: Wheels::both(1e-5), written: true };
        state.readout(&mut readout);
        assert_eq!(readout.ticks, Wheels { left: 1, right: -1 });
    }
}
