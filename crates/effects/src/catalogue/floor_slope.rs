//! `floor_slope`: on a floor that is not level a robot creeps down the fall line.
//!
//! Model: a vector in the room per second of motion, or per metre of tread.
//! Signature: e turns with −θ: its direction in the room is constant.
//! Observability: the same path at two headings; time and distance at two speeds.
//! Alias: `carpet_nap` (same heading at two speeds), exactly where the creep goes with the distance.
//! Reference: tyre creep in proportion to side force: weight times slope over stiffness, 0.04 to 0.1 % per
//! degree.

use kinematics::Pose;
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
const double tread_m = 0.5 * (fabs(left_m) + fabs(right_m)), moving_s = tread_m > 0.0 ? dt_s : 0.0;
const double x_m = creep_x_m_s * moving_s + slide_x * tread_m, y_m = creep_y_m_s * moving_s + slide_y * tread_m;
const double c = cos(room_heading_rad + 0.5 * turn_rad), d = sin(room_heading_rad + 0.5 * turn_rad);
left_change_m += c * x_m + d * y_m;
right_change_m += c * x_m + d * y_m;
across_m += c * y_m - d * x_m;",
    ),
};

/// Creep down a slope.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FloorSlope {
    /// Along the room's x per second in motion, m/s.
    pub creep_x_m_s: f64,
    /// Along the room's y per second in motion, m/s.
    pub creep_y_m_s: f64,
    /// Along the room's x per metre of tread.
    pub slide_x: f64,
    /// Along the room's y per metre of tread.
    pub slide_y: f64,
}

impl PhysicalEffect for FloorSlope {
    fn check(&self) -> Result<(), EffectError> {
        let creep = [("creep_x_m_s", self.creep_x_m_s), ("creep_y_m_s", self.creep_y_m_s)];
        EffectError::unless_finite("floor_slope", creep)?;
        EffectError::unless_finite("floor_slope", [("slide_x", self.slide_x), ("slide_y", self.slide_y)])
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { effect: *self }))
    }

    fn hypothesis() -> Hypothesis {
        let by = |with_distance| Variant { fixed: Vec::new(), term: Box::new(Term { with_distance }), at: None };
        Hypothesis::Terms(vec![by(false), by(true)])
    }

    fn description() -> Description {
        Description {
            summary: Summary::Meaning,
            on_board: ON_BOARD,
            ..Description::of("the floor slopes: the robot creeps in one direction of the room, whatever its heading")
        }
    }

    /// Creep with time or with the distance, by which of them is named.
    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        let pair = |x, y| value_of(values, x).zip(value_of(values, y));
        let (creep, slide) = (pair("creep_x_m_s", "creep_y_m_s"), pair("slide_x", "slide_y"));
        let ((creep_x_m_s, creep_y_m_s), (slide_x, slide_y)) = match (creep, slide) {
            (None, None) => return None,
            (creep, slide) => (creep.unwrap_or_default(), slide.unwrap_or_default()),
        };
        Some(Self { creep_x_m_s, creep_y_m_s, slide_x, slide_y })
    }
}

struct State {
    effect: FloorSlope,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { floor: true, ..Hooks::NONE }
    }

    fn floor(&mut self, step: &mut Step) {
        let FloorSlope { creep_x_m_s, creep_y_m_s, slide_x, slide_y } = self.effect;
        // At rest friction holds the wheels.
        let tread_m = 0.5 * (step.travel_m.left.abs() + step.travel_m.right.abs());
        let moving_s = if tread_m > 0.0 { step.dt_s } else { 0.0 };
        step.creep_m[0] += creep_x_m_s * moving_s + slide_x * tread_m;
        step.creep_m[1] += creep_y_m_s * moving_s + slide_y * tread_m;
    }

    /// Through the time that ramps take.
    fn depends_on_speed(&self) -> bool {
        self.effect.creep_x_m_s != 0.0 || self.effect.creep_y_m_s != 0.0
    }
}

#[derive(Clone)]
struct Term {
    /// With the distance, or else with the time.
    with_distance: bool,
}

impl ModelTerm for Term {
    /// Plausible: 0.1 % a degree on a floor one degree off, at 0.5 m/s.
    fn parameters(&self) -> &'static [TermParameter] {
        if self.with_distance {
            &[
                TermParameter { name: "slide_x", unit: "1", prior_sigma: 1e-3 },
                TermParameter { name: "slide_y", unit: "1", prior_sigma: 1e-3 },
            ]
        } else {
            &[
                TermParameter { name: "creep_x_m_s", unit: "m/s", prior_sigma: 5e-4 },
                TermParameter { name: "creep_y_m_s", unit: "m/s", prior_sigma: 5e-4 },
            ]
        }
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        let travel_m = interval.smooth_travel_m();
        let tread_m = 0.5 * (travel_m.left.abs() + travel_m.right.abs());
        let amount = match self.with_distance {
            true => tread_m,
            false if tread_m > 0.0 => interval.dt_s,
            false => 0.0,
        };
        gradient[0] = in_room(interval, [amount, 0.0]);
        gradient[1] = in_room(interval, [0.0, amount]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::specimen_step;
    use kinematics::Wheels;

    #[test]
    fn a_robot_at_rest_stays_and_a_moving_one_creeps_whichever_way_it_drives() {
        let effect = FloorSlope { creep_x_m_s: 1e-3, creep_y_m_s: 0.0, slide_x: 0.0, slide_y: -2e-3 };
        let creep_m = |travel_m: f64| {
            let mut step = specimen_step();
            step.travel_m = Wheels::both(travel_m);
            State { effect }.floor(&mut step);
            step.creep_m
        };
        assert_eq!(creep_m(0.0), [0.0, 0.0]);
        assert_eq!(creep_m(5e-4), [1e-3 * 1e-3, -2e-3 * 5e-4]);
        assert_eq!(creep_m(-5e-4), creep_m(5e-4));
    }
}
