//! `slip_acceleration`: a tyre transmits force by slipping a little, so the ground speed lags behind the
//! wheel's.
//!
//! Model: δv_w = −κ a_w.
//! Signature: e_dx ∝ a; zero net over a symmetric start and stop.
//! Observability: speed changes seen from outside.
//! Alias: `truth_latency`, exactly: equal κ on both wheels is a time shift.
//! Reference: tyre slip stiffness; κ = v/(C_s g) with C_s = 20 to 40 gives 1 to 10 ms.

use kinematics::Pose;
use model_term::{Interval, ModelTerm, TermParameter};
use serde::{Deserialize, Serialize};

use crate::benchmark::{Benchmark, FloorForm};
use crate::description::{Description, Statement, Summary};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, Step};
use crate::hypothesis::{Hypothesis, Variant, value_of};
use crate::on_board::{Code, OnBoard};

/// What it is, in one line.
const MEANING: &str = "the ground speed lags behind the wheels'";

/// The mean term in C, for a robot's own odometry.
const ON_BOARD: OnBoard = OnBoard::State {
    of: "the wheels' speeds in the interval before",
    lag: "half an interval: a speed is the mean of its interval, and none from the rows after it; off by κ times the change of speed in half an interval while it changes, by nothing once it is steady",
    code: Code::of(
        "\
left_change_m -= kappa_s * (left_end_m_s - left_start_m_s);
right_change_m -= kappa_s * (right_end_m_s - right_start_m_s);",
    ),
};

/// Slip in proportion to acceleration.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SlipAcceleration {
    /// Lost speed per acceleration (κ), seconds.
    pub kappa_s: f64,
}

impl PhysicalEffect for SlipAcceleration {
    fn check(&self) -> Result<(), EffectError> {
        EffectError::unless(self.kappa_s.is_finite(), "slip_acceleration", "kappa_s", self.kappa_s, "finite")
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
                let what = values.by_sign("kappa_s", MEANING, "the ground speed is ahead of the wheels'");
                Statement::of(what, format!("by {}", values.magnitude("kappa_s", 1e3, "ms")))
            }),
            benchmark: Benchmark::OF_MEAN.with_form(
                "slip that saturates, as tanh of the acceleration",
                |values, robot| {
                    let (kappa_s, knee_m_s2) =
                        (value_of(values, "kappa_s").unwrap_or(0.0), 0.7 * robot.acceleration_m_s2);
                    FloorForm::boxed(move |step| {
                        let acceleration = step.contact_acceleration_m_s2();
                        let lost_m = |a: f64| kappa_s * knee_m_s2 * (a / knee_m_s2).tanh() * step.dt_s;
                        step.travel_m = step.travel_m.zip_with(acceleration, |travel_m, a| travel_m - lost_m(a));
                    })
                },
            ),
            is_delay: true,
            on_board: ON_BOARD,
            ..Description::of(MEANING)
        }
    }

    /// The ground lags behind the wheel, and does not lead: found negative it is something else.
    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        let kappa_s = value_of(values, "kappa_s")?;
        (kappa_s >= 0.0).then_some(Self { kappa_s })
    }
}

struct State {
    effect: SlipAcceleration,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { floor: true, ..Hooks::NONE }
    }

    fn floor(&mut self, step: &mut Step) {
        let lost_m = step.contact_acceleration_m_s2().map(|a_m_s2| self.effect.kappa_s * a_m_s2 * step.dt_s);
        step.travel_m = step.travel_m.zip_with(lost_m, |travel_m, lost_m| travel_m - lost_m);
    }

    fn needs_stepping(&self) -> Option<&'static str> {
        Some("the closed form starts and stops at once")
    }
}

#[derive(Clone)]
struct Term;

impl ModelTerm for Term {
    /// Plausible: 10 ms, the upper end of what slip stiffness gives.
    fn parameters(&self) -> &'static [TermParameter] {
        &[TermParameter { name: "kappa_s", unit: "s", prior_sigma: 0.01 }]
    }

    /// The change of the speeds: summed over a start and a stop it is nothing, exactly.
    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        gradient[0] = interval.change(interval.speed_change_m_s().map(|gained_m_s| -gained_m_s));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::specimen_step;

    #[test]
    fn a_symmetric_start_and_stop_leaves_nothing() {
        let mut state = State { effect: SlipAcceleration { kappa_s: 5e-3 } };
        let mut lost_m = Vec::new();
        for acceleration_rad_s2 in [10.0, 0.0, -10.0] {
            let mut step = specimen_step();
            step.acceleration_rad_s2.right = acceleration_rad_s2;
            state.floor(&mut step);
            lost_m.push(specimen_step().travel_m.right - step.travel_m.right);
        }
        assert!((lost_m[0] - 5e-3 * 10.0 * 0.08 * specimen_step().dt_s).abs() < 1e-17);
        assert_eq!(lost_m.iter().sum::<f64>(), 0.0);
    }
}
