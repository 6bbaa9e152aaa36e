//! `truth_jump`: at some instants the outside instrument's frame moves, and stays moved.
//!
//! Model: at instants of a Poisson process of rate r the room's frame as the instrument sees it is displaced
//! by N(0, jump_m²) along each of its axes, and turned by N(0, jump_rad²) about the robot; displacements add
//! up.
//! Signature: a step in the measured path, between two measurements, that the next ones keep.
//! Observability: steps beyond what the wheels can have missed; nothing is compared across them.
//! Alias: `robot_displaced`, where a robot can have moved as far between two measurements.
//! Reference: Cadena et al. 2016 (loop closures of simultaneous localization and mapping); a camera that is
//! knocked, a marker that is swapped for another.

use kinematics::Pose;
use serde::{Deserialize, Serialize};

use crate::description::{Description, Excitation};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, PoseReading};
use crate::hypothesis::{Hypothesis, value_of};
use crate::on_board::OnBoard;
use crate::stream::Stream;

/// Steps of the outside instrument's frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TruthJump {
    /// Mean number of steps a second.
    pub rate_hz: f64,
    /// Standard deviation of a step along each axis, metres.
    pub jump_m: f64,
    /// Standard deviation of a step in heading, radians.
    pub jump_rad: f64,
}

impl PhysicalEffect for TruthJump {
    fn check(&self) -> Result<(), EffectError> {
        for (parameter, value) in [("rate_hz", self.rate_hz), ("jump_m", self.jump_m), ("jump_rad", self.jump_rad)] {
            EffectError::unless(value.is_finite() && value >= 0.0, "truth_jump", parameter, value, "0 or more")?;
        }
        Ok(())
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { effect: *self, stream: None, last_s: None, frame: Pose::IDENTITY }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::UnknownMotion { is_of_instrument: true }
    }

    fn description() -> Description {
        Description {
            excitation: Excitation::Conditions("watch the instrument where its pose jumps, or use another one"),
            on_board: OnBoard::OfInstrument,
            ..Description::of("the instrument's frame jumps, and the poses after it are displaced")
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        let (jump_m, jump_rad) = (value_of(values, "jump_m")?, value_of(values, "jump_rad")?);
        Some(Self { rate_hz: value_of(values, "rate_hz")?, jump_m, jump_rad })
    }
}

struct State {
    effect: TruthJump,
    stream: Option<Stream>,
    /// The measurement before.
    last_s: Option<f64>,
    /// Where the instrument's frame has gone.
    frame: Pose,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { seed_run: true, instrument: true, ..Hooks::NONE }
    }

    fn seed_run(&mut self, stream: Stream) {
        *self = Self { effect: self.effect, stream: Some(stream), last_s: None, frame: Pose::IDENTITY };
    }

    fn instrument(&mut self, reading: &mut PoseReading) {
        let Some(stream) = &mut self.stream else { return };
        let (uniform, jump) = (stream.uniform(), [stream.normal(), stream.normal(), stream.normal()]);
        let since_s = self.last_s.map_or(0.0, |last_s| reading.t_s - last_s);
        self.last_s = Some(reading.t_s);
        let seen = self.frame * reading.world_from_body;
        let jumps = uniform < -(-self.effect.rate_hz * since_s).exp_m1();
        if jumps {
            let TruthJump { jump_m, jump_rad, .. } = self.effect;
            let moved = Pose::new(
                seen.x_m + jump_m * jump[0],
                seen.y_m + jump_m * jump[1],
                seen.theta_rad + jump_rad * jump[2],
            );
            self.frame = moved * reading.world_from_body.inverse();
        }
        let seen = self.frame * reading.world_from_body;
        // Without a step no bit changes.
        if self.frame != Pose::IDENTITY {
            reading.world_from_body = seen;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Address, StreamName};

    #[test]
    fn steps_stay_and_come_as_often_as_stated() {
        let effect = TruthJump { rate_hz: 0.5, jump_m: 0.1, jump_rad: 0.0 };
        let mut state = effect.forward().expect("acts on measurements");
        state.seed_run(Address { seed: 4, point: 0, trial: 0, run: 0 }.stream(StreamName::new("test")));
        let n = 20_000;
        let mut steps = Vec::new();
        let mut last_m = [0.0; 2];
        for k in 0..n {
            let mut reading = PoseReading { t_s: 0.1 * f64::from(k), world_from_body: Pose::IDENTITY };
            state.instrument(&mut reading);
            let now_m = [reading.world_from_body.x_m, reading.world_from_body.y_m];
            let step_m = [now_m[0] - last_m[0], now_m[1] - last_m[1]];
            steps.extend(step_m.into_iter().filter(|step_m| *step_m != 0.0));
            last_m = now_m;
        }
        // 1000 steps of two axes; Poisson and χ² at five standard deviations.
        let (count, variance) =
            (steps.len() as f64 / 2.0, steps.iter().map(|m| m * m).sum::<f64>() / steps.len() as f64);
        let expected = f64::from(n) * -(-0.05_f64).exp_m1();
        assert!((count - expected).abs() < 5.0 * expected.sqrt(), "{count} for {expected}");
        assert!((variance / 0.01 - 1.0).abs() < 5.0 * (2.0 / (2.0 * count)).sqrt(), "{variance}");
    }
}
