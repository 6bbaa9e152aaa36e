//! `truth_lever_arm`: the point that the outside instrument takes for the robot is not the centre of its
//! axle.
//!
//! Model: seen pose = true pose ⊕ ℓ with ℓ = (ℓ_x, ℓ_y) in the body's frame.
//! Signature: e_dx = −ℓ_y ω, e_dy = ℓ_x ω in increments.
//! Observability: turns; a robot that only drives straight shows nothing, since where it starts is not known
//! beforehand.
//! Alias: `lateral_skid` at one speed.
//! Reference: Censi et al. 2013, the sensor's place on the robot.

use kinematics::Pose;
use model_term::{Measurement, ModelTerm, TermParameter};
use serde::{Deserialize, Serialize};

use crate::description::{Description, Extrinsic, Statement, Summary};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, PoseReading};
use crate::hypothesis::{Hypothesis, Variant, value_of};
use crate::on_board::OnBoard;

/// What it is, in one line.
const MEANING: &str = "the instrument's marker is off the axle's centre";

/// Where the instrument's point is on the robot.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TruthLeverArm {
    /// Ahead of the axle, metres.
    pub lever_x_m: f64,
    /// To the left of the centre, metres.
    pub lever_y_m: f64,
}

impl PhysicalEffect for TruthLeverArm {
    fn check(&self) -> Result<(), EffectError> {
        let values = [("lever_x_m", self.lever_x_m), ("lever_y_m", self.lever_y_m)];
        EffectError::unless_finite("truth_lever_arm", values)
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
                let ahead = values.with_direction("lever_x_m", 1e3, "mm", "ahead", "behind");
                let aside = values.with_direction("lever_y_m", 1e3, "mm", "to the left", "to the right");
                Statement::of(MEANING, format!("{ahead} and {aside}"))
            }),
            extrinsic: Some(Extrinsic::Position),
            on_board: OnBoard::OfInstrument,
            ..Description::of(MEANING)
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        Some(Self { lever_x_m: value_of(values, "lever_x_m")?, lever_y_m: value_of(values, "lever_y_m")? })
    }
}

struct State {
    effect: TruthLeverArm,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { instrument: true, ..Hooks::NONE }
    }

    fn instrument(&mut self, reading: &mut PoseReading) {
        let body_from_point = Pose::new(self.effect.lever_x_m, self.effect.lever_y_m, 0.0);
        reading.world_from_body = reading.world_from_body * body_from_point;
    }
}

#[derive(Clone)]
struct Term;

impl ModelTerm for Term {
    /// Plausible: centimetres (a rule of thumb).
    fn parameters(&self) -> &'static [TermParameter] {
        &[
            TermParameter { name: "lever_x_m", unit: "m", prior_sigma: 0.05 },
            TermParameter { name: "lever_y_m", unit: "m", prior_sigma: 0.05 },
        ]
    }

    fn measurement(&mut self, _look: &Measurement<'_>, gradient: &mut [Pose]) {
        gradient[0].x_m = 1.0;
        gradient[1].y_m = 1.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn the_point_turns_with_the_robot() {
        let mut state = State { effect: TruthLeverArm { lever_x_m: 0.1, lever_y_m: 0.02 } };
        let mut reading = PoseReading { t_s: 0.0, world_from_body: Pose::new(1.0, 2.0, FRAC_PI_2) };
        state.instrument(&mut reading);
        let seen = reading.world_from_body;
        assert!((seen.x_m - 0.98).abs() < 1e-15 && (seen.y_m - 2.1).abs() < 1e-15, "{seen:?}");
        assert_eq!(seen.theta_rad, FRAC_PI_2);
    }
}
