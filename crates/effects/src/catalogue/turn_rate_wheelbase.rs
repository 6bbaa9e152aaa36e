//! `turn_rate_wheelbase`: the faster a robot turns, the farther apart its wheels seem to touch.
//!
//! Model: b_eff = b (1 + β|ω|).
//! Signature: e_dθ = −β ω|ω|.
//! Observability: turns at two yaw rates.
//! Alias: `load_transfer` (0.98 on circles), `slip_speed` in spins, `castor_drag`; `wheelbase` at one yaw
//! rate.
//! Reference: a rule of thumb, 0.1 to 3 %; users report a wheel separation multiplier that depends on the yaw
//! rate.

use kinematics::Pose;
use model_term::{Interval, ModelTerm, TermParameter};
use serde::{Deserialize, Serialize};

use crate::benchmark::{Benchmark, FloorForm, contact_twist};
use crate::description::{Description, Statement, Summary};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, Step};
use crate::hypothesis::{Hypothesis, Variant, value_of};
use crate::on_board::OnBoard;

/// What it is, in one line.
const MEANING: &str = "the faster the robot turns, the farther apart its wheels act";

/// The mean term in C, for a robot's own odometry.
const ON_BOARD: &str = "\
turn_change_rad -= beta_s * turn_rad * fabs(omega_rad_s);";

/// Wheelbase that grows with the yaw rate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TurnRateWheelbase {
    /// Relative growth per rad/s (β), seconds.
    pub beta_s: f64,
}

impl PhysicalEffect for TurnRateWheelbase {
    fn check(&self) -> Result<(), EffectError> {
        EffectError::unless_finite("turn_rate_wheelbase", [("beta_s", self.beta_s)])
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
                let nearer = "the faster the robot turns, the nearer together its wheels act";
                let what = values.by_sign("beta_s", MEANING, nearer);
                Statement::of(what, format!("{} for each rad/s", values.magnitude("beta_s", 100.0, "%")))
            }),
            benchmark: Benchmark::OF_MEAN.with_form(
                "a wheelbase that grows with the square of the yaw rate",
                |values, robot| {
                    // The same at the yaw rate of a spin at cruise speed.
                    let beta_s = value_of(values, "beta_s").unwrap_or(0.0);
                    let at_rad_s = 2.0 * robot.cruise_speed_m_s / robot.wheel_separation_m;
                    FloorForm::boxed(move |step| {
                        let (_, omega_rad_s) = contact_twist(step);
                        step.wheel_separation_m *= 1.0 + beta_s * omega_rad_s.powi(2) / at_rad_s;
                    })
                },
            ),
            on_board: OnBoard::Static(ON_BOARD),
            ..Description::of(MEANING)
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        Some(Self { beta_s: value_of(values, "beta_s")? })
    }
}

struct State {
    effect: TurnRateWheelbase,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { floor: true, ..Hooks::NONE }
    }

    fn floor(&mut self, step: &mut Step) {
        let speed_m_s = step.contact_speed_m_s();
        let omega_rad_s = (speed_m_s.right - speed_m_s.left) / step.wheel_separation_m;
        step.wheel_separation_m *= 1.0 + self.effect.beta_s * omega_rad_s.abs();
    }

    fn depends_on_speed(&self) -> bool {
        self.effect.beta_s != 0.0
    }
}

#[derive(Clone)]
struct Term;

impl ModelTerm for Term {
    /// Plausible: 3 % at 1 rad/s, the upper end of the rule of thumb.
    fn parameters(&self) -> &'static [TermParameter] {
        &[TermParameter { name: "beta_s", unit: "s", prior_sigma: 0.03 }]
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        if interval.dt_s > 0.0 {
            let turn_rad = interval.smooth_increment().turn_rad;
            gradient[0].theta_rad = -turn_rad * turn_rad.abs() / interval.dt_s;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::specimen_step;

    #[test]
    fn both_senses_of_turning_widen_alike() {
        let mut state = State { effect: TurnRateWheelbase { beta_s: 0.02 } };
        for sense in [-1.0, 1.0] {
            let mut step = specimen_step();
            let before_m = step.wheel_separation_m;
            step.rate_rad_s.right = sense * 0.5 * before_m / 0.08;
            state.floor(&mut step);
            assert!((step.wheel_separation_m / before_m - (1.0 + 0.02 * 0.5)).abs() < 1e-15);
        }
    }
}
