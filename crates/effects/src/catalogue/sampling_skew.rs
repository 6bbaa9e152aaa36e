//! `sampling_skew`: the right counter is read a little later than the left one.
//!
//! Model: a row stamped t holds the left count at t and the right count at t + δ.
//! Signature: e_dθ = δ a/b, nothing at constant speed or at rest.
//! Observability: speed changes on straights.
//! Alias: `slip_acceleration` of one wheel.
//! Reference: two HCTL-1100 that share no sampling: δ up to one sample time, 0.06 to 2 ms.

use kinematics::{Pose, Wheels};
use model_term::{Interval, ModelTerm, TermParameter};
use serde::{Deserialize, Serialize};

use crate::description::{Description, Statement, Summary};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, SampleClock};
use crate::hypothesis::{Hypothesis, Variant, value_of};
use crate::on_board::{Code, OnBoard};

/// What it is, in one line.
const MEANING: &str = "the right counter is read later than the left one";

/// The mean term in C, for a robot's own odometry.
const ON_BOARD: OnBoard = OnBoard::State {
    of: "the right wheel's speed in the interval before",
    lag: "half an interval, as speeds are means of intervals that are past; off by the delay times the change of speed in half an interval while it changes",
    code: Code::of("right_change_m -= right_delay_s * (right_end_m_s - right_start_m_s);"),
};

/// Delay of the right reading.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SamplingSkew {
    /// How much later the right counter is read, seconds; negative when it is the earlier one.
    pub right_delay_s: f64,
}

impl PhysicalEffect for SamplingSkew {
    fn check(&self) -> Result<(), EffectError> {
        EffectError::unless_finite("sampling_skew", [("right_delay_s", self.right_delay_s)])
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { effect: *self }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Terms(Variant::plain(Term))
    }

    fn description() -> Description {
        Description {
            summary: Summary::WithSize(|values| {
                let left = "the left counter is read later than the right one";
                let what = values.by_sign("right_delay_s", MEANING, left);
                Statement::of(what, format!("by {}", values.magnitude("right_delay_s", 1e3, "ms")))
            }),
            on_board: ON_BOARD,
            ..Description::of(MEANING)
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        Some(Self { right_delay_s: value_of(values, "right_delay_s")? })
    }
}

struct State {
    effect: SamplingSkew,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { clock: true, ..Hooks::NONE }
    }

    fn clock(&mut self, sample: &mut SampleClock) {
        sample.read_s.right += self.effect.right_delay_s;
    }
}

#[derive(Clone)]
struct Term;

impl ModelTerm for Term {
    /// Plausible: 10 ms, two controllers that are asked one after the other over a bus.
    fn parameters(&self) -> &'static [TermParameter] {
        &[TermParameter { name: "right_delay_s", unit: "s", prior_sigma: 1e-2 }]
    }

    /// Of the right wheel's counts, its delay times the speed gained came too early.
    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        let gained_m_s = interval.speed_change_m_s().right;
        gradient[0] = interval.change(Wheels { left: 0.0, right: -gained_m_s });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_right_reading_is_late() {
        let mut sample = SampleClock { stamp_s: 1.0, read_s: Wheels::both(1.0) };
        State { effect: SamplingSkew { right_delay_s: 0.5 } }.clock(&mut sample);
        assert_eq!(sample, SampleClock { stamp_s: 1.0, read_s: Wheels { left: 1.0, right: 1.5 } });
    }
}
