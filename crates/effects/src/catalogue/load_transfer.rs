//! `load_transfer`: in a bend the outer tyre carries more and is pressed flatter than the inner one.
//!
//! Model: ΔN = m v ω h/b moves from the inner to the outer wheel and Δr/r = −ΔN/(k r): r_R = r (1 − c v ω),
//! r_L = r (1 + c v ω).
//! Signature: e_dθ = −2c v²ω/b.
//! Observability: bends at two speeds; nothing in spins and on straights.
//! Alias: `turn_rate_wheelbase` (0.98 on circles).
//! Reference: the balance of moments of a rigid body on springs; 0.2 % at v ω = 0.5 m/s² for a soft tyre.

use kinematics::{Increment, Pose, Wheels};
use model_term::{Interval, ModelTerm, TermParameter};
use serde::{Deserialize, Serialize};

use crate::description::{Description, Statement, Summary};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, Step};
use crate::hypothesis::{Hypothesis, Variant, value_of};
use crate::on_board::OnBoard;

/// What it is, in one line.
const MEANING: &str = "in bends the outer tyre is pressed flatter";

/// The mean term in C, for a robot's own odometry.
const ON_BOARD: &str = "\
left_change_m += compression_s2_m * v_m_s * omega_rad_s * left_m;
right_change_m -= compression_s2_m * v_m_s * omega_rad_s * right_m;";

/// Compression of the tyres by side force.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoadTransfer {
    /// Relative loss of the outer wheel's radius per m/s² of centripetal acceleration (c), s²/m.
    pub compression_s2_m: f64,
}

impl PhysicalEffect for LoadTransfer {
    fn check(&self) -> Result<(), EffectError> {
        EffectError::unless_finite("load_transfer", [("compression_s2_m", self.compression_s2_m)])
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
                let what = values.by_sign("compression_s2_m", MEANING, "in bends the inner tyre is pressed flatter");
                let differ = values.magnitude("compression_s2_m", 100.0, "%");
                Statement::of(what, format!("radii differ by {differ} for each m/s² of side acceleration"))
            }),
            on_board: OnBoard::Static(ON_BOARD),
            ..Description::of(MEANING)
        }
    }

    /// The tyre that carries more is pressed flatter: found negative it is something else.
    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        let compression_s2_m = value_of(values, "compression_s2_m")?;
        (compression_s2_m >= 0.0).then_some(Self { compression_s2_m })
    }
}

struct State {
    effect: LoadTransfer,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { wheel: true, ..Hooks::NONE }
    }

    fn wheel(&mut self, step: &mut Step) {
        let Wheels { left, right } = step.contact_speed_m_s();
        let centripetal_m_s2 = 0.5 * (left + right) * (right - left) / step.wheel_separation_m;
        let pressed = self.effect.compression_s2_m * centripetal_m_s2;
        step.radius_m.left *= 1.0 + pressed;
        step.radius_m.right *= 1.0 - pressed;
    }

    fn depends_on_speed(&self) -> bool {
        self.effect.compression_s2_m != 0.0
    }
}

#[derive(Clone)]
struct Term;

impl ModelTerm for Term {
    /// Plausible: 0.2 % at 0.5 m/s², derived for a soft tyre.
    fn parameters(&self) -> &'static [TermParameter] {
        &[TermParameter { name: "compression_s2_m", unit: "s²/m", prior_sigma: 0.004 }]
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        let twist = Increment::from_travel(interval.speed_m_s, interval.wheel_separation_m);
        let centripetal_m_s2 = twist.distance_m * twist.turn_rad;
        let Wheels { left, right } = interval.smooth_travel_m();
        gradient[0] = interval.change(Wheels { left: left * centripetal_m_s2, right: -right * centripetal_m_s2 });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::specimen_step;

    #[test]
    fn the_outer_wheel_is_pressed_and_straights_and_spins_press_none() {
        let radius_m = |left_m_s: f64, right_m_s: f64| {
            let mut step = specimen_step();
            step.rate_rad_s = Wheels { left: left_m_s, right: right_m_s }.map(|speed_m_s| speed_m_s / 0.08);
            State { effect: LoadTransfer { compression_s2_m: 0.004 } }.wheel(&mut step);
            step.radius_m
        };
        let curvature = radius_m(0.3, 0.5);
        // v ω = 0.4 · 0.2/0.363 m/s².
        assert!((curvature.right / 0.08 - (1.0 - 0.004 * 0.08 / 0.363)).abs() < 1e-15);
        assert!((curvature.left / 0.08 - (1.0 + 0.004 * 0.08 / 0.363)).abs() < 1e-15);
        assert_eq!([radius_m(0.4, 0.4), radius_m(-0.4, 0.4)], [specimen_step().radius_m; 2]);
    }
}
