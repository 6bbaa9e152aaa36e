//! `turn_slip`: a robot whose wheels cannot steer skids in turns, and its contacts lose travel meanwhile.
//!
//! Model: with u = (r + l)/(|r| + |l|) of the contacts' travels r and l, a turn takes s|r − l|u/2 of the
//! distance: sb/2 for each radian. What skidding takes of the turn itself is in `wheelbase` as far as it is a
//! share of it, and in `turn_rate_wheelbase` as far as it grows with the rate.
//! Signature: e_dx = −s(b/2)|ω| where the robot goes ahead, + where it backs up: even in ω.
//! Observability: straights beside bends; spins say nothing.
//! Alias: `wheel_scale` where the robot always bends alike; `lateral_skid` and `truth_lever_arm` in bends to
//! one side.
//! Reference: Mandow, Martínez et al. 2007, Experimental kinematics for wheeled skid-steer mobile robots:
//! treads turn about centres outside of the robot, and lose travel; Rabiee & Biswas 2019, A friction-based
//! kinematic model for skid-steer wheeled mobile robots: outer wheels slip back and inner ones ahead.
//! Friction that is the same in every turn makes s the same; the form is a rule of thumb.

use kinematics::{Pose, Wheels};
use model_term::{Interval, ModelTerm, TermParameter};
use serde::{Deserialize, Serialize};

use crate::benchmark::{Benchmark, Needs};
use crate::description::{Description, Statement, Summary};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, Step};
use crate::hypothesis::{Hypothesis, Variant, value_of};
use crate::on_board::OnBoard;

/// What it is, in one line.
const MEANING: &str = "skidding in turns shortens the distance driven";

/// The mean term in C, for a robot's own odometry.
const ON_BOARD: &str = "\
const double tread_m = fabs(left_m) + fabs(right_m);
if (tread_m > 0.0) {
    const double lost_m = lost_share * 0.5 * fabs(right_m - left_m) * (left_m + right_m) / tread_m;
    left_change_m -= lost_m;
    right_change_m -= lost_m;
}";

/// Distance lost in turns.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TurnSlip {
    /// Share of half the difference of the wheels' travels by which the robot gets less far (s).
    pub lost_share: f64,
}

impl PhysicalEffect for TurnSlip {
    fn check(&self) -> Result<(), EffectError> {
        EffectError::unless_negative("turn_slip", [("lost_share", self.lost_share)])
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
                let lost = values.shown("lost_share", 100.0, "%");
                Statement::of(MEANING, format!("{lost} of half the difference between the wheels' travel"))
            }),
            // Its robots roll on two wheels and a castor.
            benchmark: Benchmark { needs: Needs { others: true, ..Needs::NONE }, ..Benchmark::OF_MEAN },
            on_board: OnBoard::Static(ON_BOARD),
            ..Description::of(MEANING)
        }
    }

    /// Skidding takes travel and gives none: found negative it is something else.
    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        let lost_share = value_of(values, "lost_share")?;
        (lost_share >= 0.0).then_some(Self { lost_share })
    }
}

struct State {
    effect: TurnSlip,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { floor: true, ..Hooks::NONE }
    }

    fn floor(&mut self, step: &mut Step) {
        let Wheels { left, right } = step.travel_m;
        let tread_m = left.abs() + right.abs();
        if tread_m > 0.0 {
            let lost_m = self.effect.lost_share * 0.5 * (right - left).abs() * (left + right) / tread_m;
            step.travel_m = step.travel_m.map(|travel_m| travel_m - lost_m);
        }
    }

    fn needs_stepping(&self) -> Option<&'static str> {
        Some("the ratio of the wheels' travels changes within the ramps of a motion")
    }
}

#[derive(Clone)]
struct Term;

impl ModelTerm for Term {
    /// Plausible: 10 %; a Warthog, whose wheels act 1.9 m apart, loses 0.05 to 0.1 m/rad.
    fn parameters(&self) -> &'static [TermParameter] {
        &[TermParameter { name: "lost_share", unit: "1", prior_sigma: 0.1 }]
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        let Wheels { left, right } = interval.smooth_travel_m();
        let rolled_m = left.abs() + right.abs();
        if rolled_m > 0.0 {
            let per_share_m = 0.5 * (right - left).abs() / rolled_m * (left + right);
            gradient[0] = interval.change(Wheels::both(-per_share_m));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::specimen_step;

    #[test]
    fn bends_lose_distance_either_way_round_and_straights_and_spins_do_not() {
        let lost_m = |left: f64, right: f64| {
            let mut step = specimen_step();
            step.travel_m = Wheels { left, right };
            State { effect: TurnSlip { lost_share: 0.05 } }.floor(&mut step);
            assert!((step.travel_m.right - step.travel_m.left - (right - left)).abs() < 1e-15, "the turn stays");
            0.5 * (left + right) - 0.5 * (step.travel_m.left + step.travel_m.right)
        };
        for (left, right) in [(0.1, 0.1), (0.0, 0.0), (-0.1, 0.1)] {
            assert!(lost_m(left, right).abs() < 1e-16);
        }
        for (ahead, turn) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            let lost_m = lost_m(ahead - 0.1 * turn, ahead + 0.1 * turn);
            assert!((lost_m - ahead * 0.05 * 0.1).abs() < 1e-12, "{lost_m}");
        }
    }
}
