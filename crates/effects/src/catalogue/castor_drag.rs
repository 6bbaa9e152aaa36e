//! `castor_drag`: a rolling castor resists, and in a bend its drag turns the robot back.
//!
//! Model: the drag of a castor L behind the axle points against its own motion, at an angle δ to the robot's,
//! sin δ = Lω/√(v² + L²ω²); the drive wheels creep under its moment: e_dθ = −q sin δ per metre of tread.
//! Signature: a turn deficit that depends on the radius.
//! Observability: bends of different radii beside spins.
//! Alias: `wheelbase` (q L in wide bends, q b/2 in spins), `turn_rate_wheelbase`.
//! Reference: rolling resistance with creep in proportion to force; a rule of thumb without figures.

use kinematics::{Increment, Pose, Wheels};
use model_term::{Interval, ModelTerm, TermParameter};
use serde::{Deserialize, Serialize};

use crate::benchmark::Benchmark;
use crate::description::{Description, Statement, Summary};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, Step};
use crate::hypothesis::{Hypothesis, Variant, value_of};
use crate::on_board::OnBoard;

/// What it is, in one line.
const MEANING: &str = "the castor resists rolling sideways";

/// The mean term in C, for a robot's own odometry.
const ON_BOARD: &str = "\
const double aside_m = castor_behind_m * turn_rad;
const double rolled_m = sqrt(aside_m * aside_m + distance_m * distance_m);
if (rolled_m > 0.0) {
    turn_change_rad -= drag_rad_m * 0.5 * (fabs(left_m) + fabs(right_m)) * aside_m / rolled_m;
}";

/// Places of the castor that are tried, metres behind the axle.
const CASTOR_BEHIND_M: [f64; 4] = [0.1, 0.2, 0.4, 0.8];

/// Drag of a castor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CastorDrag {
    /// Turn lost per metre of tread when the castor rolls sideways (q), rad/m.
    pub drag_rad_m: f64,
    /// Where the castor is (L), metres behind the axle.
    pub castor_behind_m: f64,
}

impl PhysicalEffect for CastorDrag {
    fn check(&self) -> Result<(), EffectError> {
        EffectError::unless_negative("castor_drag", [("drag_rad_m", self.drag_rad_m)])?;
        EffectError::unless_positive("castor_drag", [("castor_behind_m", self.castor_behind_m)])
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { effect: *self }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Terms(Variant::along("castor_behind_m", &CASTOR_BEHIND_M, |castor_behind_m| {
            Box::new(Term { castor_behind_m })
        }))
    }

    fn description() -> Description {
        Description {
            summary: Summary::WithSize(|values| {
                let lost = values.shown("drag_rad_m", 1e3, "mrad");
                Statement::of(MEANING, format!("{lost} of turn lost for each metre rolled sideways"))
            }),
            benchmark: Benchmark::of_mean_at(|_, _, stream| vec![("castor_behind_m", stream.uniform_in(0.1, 0.4))]),
            on_board: OnBoard::Static(ON_BOARD),
            ..Description::of(MEANING)
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        Some(Self {
            drag_rad_m: value_of(values, "drag_rad_m")?,
            castor_behind_m: value_of(values, "castor_behind_m")?,
        })
    }
}

struct State {
    effect: CastorDrag,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { floor: true, ..Hooks::NONE }
    }

    fn floor(&mut self, step: &mut Step) {
        let Wheels { left, right } = step.travel_m;
        let aside_m = self.effect.castor_behind_m * (right - left) / step.wheel_separation_m;
        let rolled_m = aside_m.hypot(0.5 * (left + right));
        if rolled_m > 0.0 {
            let tread_m = 0.5 * (left.abs() + right.abs());
            step.extra_turn_rad -= self.effect.drag_rad_m * tread_m * aside_m / rolled_m;
        }
    }
}

#[derive(Clone)]
struct Term {
    castor_behind_m: f64,
}

impl ModelTerm for Term {
    /// Plausible: 3 % of a spin on wheels 0.4 m apart; the catalogue has no figure.
    fn parameters(&self) -> &'static [TermParameter] {
        &[TermParameter { name: "drag_rad_m", unit: "rad/m", prior_sigma: 0.15 }]
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        let Increment { distance_m, turn_rad } = interval.smooth_increment();
        let angle_rad = (self.castor_behind_m * turn_rad).atan2(distance_m.abs());
        let travel_m = interval.smooth_travel_m();
        let tread_m = 0.5 * (travel_m.left.abs() + travel_m.right.abs());
        gradient[0].theta_rad = -tread_m * angle_rad.sin();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::specimen_step;

    #[test]
    fn spins_lose_by_half_the_wheelbase_and_wide_bends_by_the_castors_distance() {
        let lost = |left: f64, right: f64| {
            let mut step = specimen_step();
            step.travel_m = Wheels { left, right };
            State { effect: CastorDrag { drag_rad_m: 0.1, castor_behind_m: 0.25 } }.floor(&mut step);
            step.extra_turn_rad
        };
        assert!((lost(-0.1, 0.1) + 0.1 * 0.1).abs() < 1e-16, "sin δ = 1 over 0.1 m of tread");
        assert!((lost(0.1, -0.1) - 0.1 * 0.1).abs() < 1e-16);
        // A bend of 363 m, forward and backward: sin δ = 0.25/363 to parts in 1e6.
        for sense in [-1.0, 1.0] {
            let turn_rad = lost(sense - 0.0005, sense + 0.0005);
            assert!((turn_rad / (-0.1 * 0.25 * 0.001 / 0.363) - 1.0).abs() < 1e-6, "{turn_rad}");
        }
        assert_eq!([lost(1.0, 1.0), lost(0.0, 0.0)], [0.0; 2]);
    }
}
