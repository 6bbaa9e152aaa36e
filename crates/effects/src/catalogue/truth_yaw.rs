//! `truth_yaw`: the outside instrument's frame is turned on the robot.
//!
//! Model: seen heading = true heading + ℓ_θ.
//! Signature: e_dy = −ℓ_θ v: the robot seems to drive a little sideways.
//! Observability: any straight path, forward or backward.
//! Alias: equal toe of both wheels is the same thing, on every path: no data discriminates them;
//! `lateral_skid` at one yaw rate.
//! Reference: Censi et al. 2013, the sensor's orientation on the robot.

use kinematics::Pose;
use model_term::{Measurement, ModelTerm, TermParameter};
use serde::{Deserialize, Serialize};

use crate::description::{Description, Extrinsic, Statement, Summary};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, PoseReading};
use crate::hypothesis::{Hypothesis, Variant, value_of};
use crate::on_board::OnBoard;

/// What it is, in one line.
const MEANING: &str = "the instrument is mounted at an angle";

/// Turn of the instrument's frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TruthYaw {
    /// From the robot's heading to the seen one, radians, counter-clockwise.
    pub yaw_rad: f64,
}

impl PhysicalEffect for TruthYaw {
    fn check(&self) -> Result<(), EffectError> {
        EffectError::unless_finite("truth_yaw", [("yaw_rad", self.yaw_rad)])
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
                let degrees = 180.0 / std::f64::consts::PI;
                let turned = values.with_direction("yaw_rad", degrees, "°", "to the left", "to the right");
                Statement::of(MEANING, format!("{turned} (or toe of both wheels)"))
            }),
            extrinsic: Some(Extrinsic::Heading),
            on_board: OnBoard::OfInstrument,
            ..Description::of(MEANING)
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        Some(Self { yaw_rad: value_of(values, "yaw_rad")? })
    }
}

struct State {
    effect: TruthYaw,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { instrument: true, ..Hooks::NONE }
    }

    fn instrument(&mut self, reading: &mut PoseReading) {
        reading.world_from_body.theta_rad += self.effect.yaw_rad;
    }
}

#[derive(Clone)]
struct Term;

impl ModelTerm for Term {
    /// Plausible: 2°, the upper end of what mounting by eye leaves.
    fn parameters(&self) -> &'static [TermParameter] {
        &[TermParameter { name: "yaw_rad", unit: "rad", prior_sigma: 0.035 }]
    }

    fn measurement(&mut self, _look: &Measurement<'_>, gradient: &mut [Pose]) {
        gradient[0].theta_rad = 1.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_heading_is_seen_turned() {
        let mut state = State { effect: TruthYaw { yaw_rad: -0.02 } };
        let mut reading = PoseReading { t_s: 1.0, world_from_body: Pose::new(1.0, 2.0, 0.5) };
        state.instrument(&mut reading);
        assert_eq!(reading.world_from_body, Pose::new(1.0, 2.0, 0.48));
    }
}
