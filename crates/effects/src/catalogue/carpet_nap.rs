//! `carpet_nap`: the pile of a carpet leans one way and takes the wheels with it.
//!
//! Model: a drift in the room in proportion to the distance |Δs|, and a turn towards the nap's direction θ₀,
//! ∝ sin(θ − θ₀) |Δs|.
//! Signature: constant direction in the room, at any speed.
//! Observability: the same path at several headings; two speeds against `floor_slope`.
//! Alias: `floor_slope` that goes with the distance, exactly.
//! Reference: users' reports, mm/m to cm/m; a rule of thumb.

use kinematics::{Pose, sin_cos, sinc};
use model_term::{Interval, ModelTerm, TermParameter};
use serde::{Deserialize, Serialize};

use crate::description::{Description, Summary};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, Step};
use crate::hypothesis::{Hypothesis, Variant, in_room, value_of};
use crate::on_board::{Code, Input, OnBoard};

/// The mean term in C, for a robot's own odometry.
const ON_BOARD: OnBoard = OnBoard::Input {
    input: Input::RoomHeading,
    code: Code::of(
        "\
const double driven_m = fabs(distance_m);
const double c = cos(room_heading_rad + 0.5 * turn_rad), d = sin(room_heading_rad + 0.5 * turn_rad);
left_change_m += driven_m * (c * drift_x + d * drift_y);
right_change_m += driven_m * (c * drift_x + d * drift_y);
across_m += driven_m * (c * drift_y - d * drift_x);
turn_change_rad += driven_m * (yaw_sin_rad_m * d + yaw_cos_rad_m * c);",
    ),
};

/// Pull of a carpet.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CarpetNap {
    /// Drift along the room's x per metre of distance.
    pub drift_x: f64,
    /// Drift along the room's y per metre of distance.
    pub drift_y: f64,
    /// Turn per metre of distance in proportion to sin θ, rad/m.
    pub yaw_sin_rad_m: f64,
    /// Turn per metre of distance in proportion to cos θ, rad/m.
    pub yaw_cos_rad_m: f64,
}

impl PhysicalEffect for CarpetNap {
    fn check(&self) -> Result<(), EffectError> {
        let yaw = [("yaw_sin_rad_m", self.yaw_sin_rad_m), ("yaw_cos_rad_m", self.yaw_cos_rad_m)];
        EffectError::unless_finite("carpet_nap", yaw)?;
        EffectError::unless_finite("carpet_nap", [("drift_x", self.drift_x), ("drift_y", self.drift_y)])
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { effect: *self }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Terms(Variant::plain(Term))
    }

    fn description() -> Description {
        Description {
            summary: Summary::Meaning,
            on_board: ON_BOARD,
            ..Description::of(
                "the floor's pile takes the wheels with it: a drift in one direction of the room, in proportion to the distance driven",
            )
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        Some(Self {
            drift_x: value_of(values, "drift_x")?,
            drift_y: value_of(values, "drift_y")?,
            yaw_sin_rad_m: value_of(values, "yaw_sin_rad_m")?,
            yaw_cos_rad_m: value_of(values, "yaw_cos_rad_m")?,
        })
    }
}

struct State {
    effect: CarpetNap,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { floor: true, ..Hooks::NONE }
    }

    fn floor(&mut self, step: &mut Step) {
        let CarpetNap { drift_x, drift_y, yaw_sin_rad_m, yaw_cos_rad_m } = self.effect;
        let distance_m = 0.5 * (step.travel_m.left + step.travel_m.right).abs();
        let half_rad = 0.5 * (step.travel_m.right - step.travel_m.left) / step.wheel_separation_m;
        let (sin, cos) = (step.world_from_body.theta_rad + half_rad).sin_cos();
        step.creep_m[0] += drift_x * distance_m;
        step.creep_m[1] += drift_y * distance_m;
        step.extra_turn_rad += (yaw_sin_rad_m * sin + yaw_cos_rad_m * cos) * sinc(half_rad) * distance_m;
    }

    fn needs_stepping(&self) -> Option<&'static str> {
        (self.effect.yaw_sin_rad_m != 0.0 || self.effect.yaw_cos_rad_m != 0.0)
            .then_some("its turn bends the path while it drives")
    }
}

#[derive(Clone)]
struct Term;

impl ModelTerm for Term {
    /// Plausible: 1 cm/m, the upper end of what users report, and half a degree a metre.
    fn parameters(&self) -> &'static [TermParameter] {
        &[
            TermParameter { name: "drift_x", unit: "1", prior_sigma: 0.01 },
            TermParameter { name: "drift_y", unit: "1", prior_sigma: 0.01 },
            TermParameter { name: "yaw_sin_rad_m", unit: "rad/m", prior_sigma: 0.01 },
            TermParameter { name: "yaw_cos_rad_m", unit: "rad/m", prior_sigma: 0.01 },
        ]
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        let increment = interval.smooth_increment();
        let distance_m = increment.distance_m.abs();
        let heading_rad = interval.world_from_body.theta_rad + 0.5 * increment.turn_rad;
        gradient[0] = in_room(interval, [distance_m, 0.0]);
        gradient[1] = in_room(interval, [0.0, distance_m]);
        let (sin, cos) = sin_cos(heading_rad);
        gradient[2].theta_rad = distance_m * sin;
        gradient[3].theta_rad = distance_m * cos;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::specimen_step;
    use kinematics::Wheels;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn the_nap_pulls_the_same_way_at_every_heading_and_turns_by_it() {
        let effect = CarpetNap { drift_x: 0.002, drift_y: -0.001, yaw_sin_rad_m: 0.03, yaw_cos_rad_m: 0.0 };
        for (heading_rad, turn_rad) in [(0.0, 0.0), (FRAC_PI_2, 0.03), (-FRAC_PI_2, -0.03)] {
            let mut step = specimen_step();
            step.world_from_body.theta_rad = heading_rad;
            step.travel_m = Wheels::both(-1.0);
            State { effect }.floor(&mut step);
            assert_eq!(step.creep_m, [0.002, -0.001]);
            assert!((step.extra_turn_rad - turn_rad).abs() < 1e-17);
        }
    }
}
