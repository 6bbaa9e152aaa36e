//! `robot_displaced`: at some instants the robot is pushed, or its wheels turn without the floor.
//!
//! Model: at instants of a Poisson process of rate r the robot moves for `duration_s` as its wheels do not
//! say: by N(0, distance_m²) along each axis of the room and N(0, turn_rad²) in heading, steadily. One at a
//! time.
//! Signature: between two measurements the robot moves, or fails to move, by more than wheels that roll can
//! miss.
//! Observability: displacements beyond what the wheels can have missed; nothing is compared across them.
//! Alias: `truth_jump`, where the instrument may have jumped instead; a wheel that is lifted, a collision and
//! a push are one effect.
//! Reference: Thrun, Burgard & Fox 2005, ch. 8 (the kidnapped robot).

use serde::{Deserialize, Serialize};

use crate::description::{Description, Excitation};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, Step};
use crate::hypothesis::{Hypothesis, value_of};
use crate::on_board::OnBoard;
use crate::stream::Stream;

/// Motion that no wheel makes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotDisplaced {
    /// Mean number of displacements a second.
    pub rate_hz: f64,
    /// How long each takes, seconds.
    pub duration_s: f64,
    /// Standard deviation of a displacement along each axis of the room, metres.
    pub distance_m: f64,
    /// Standard deviation of a displacement in heading, radians.
    pub turn_rad: f64,
}

impl PhysicalEffect for RobotDisplaced {
    fn check(&self) -> Result<(), EffectError> {
        let id = "robot_displaced";
        for (parameter, value) in
            [("rate_hz", self.rate_hz), ("distance_m", self.distance_m), ("turn_rad", self.turn_rad)]
        {
            EffectError::unless(value.is_finite() && value >= 0.0, id, parameter, value, "0 or more")?;
        }
        let duration_s = self.duration_s;
        EffectError::unless(duration_s.is_finite() && duration_s > 0.0, id, "duration_s", duration_s, "more than 0")
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { effect: *self, stream: None, until_s: 0.0, rates: [0.0; 3] }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::UnknownMotion { is_of_instrument: false }
    }

    fn description() -> Description {
        Description {
            excitation: Excitation::Conditions(
                "drive where nothing touches the robot and its wheels stay on the floor",
            ),
            on_board: OnBoard::Never("the counts show nothing of it"),
            ..Description::of("the robot is pushed, or its wheels turn without the floor")
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        Some(Self {
            rate_hz: value_of(values, "rate_hz")?,
            duration_s: value_of(values, "duration_s")?,
            distance_m: value_of(values, "distance_m")?,
            turn_rad: value_of(values, "turn_rad")?,
        })
    }
}

struct State {
    effect: RobotDisplaced,
    stream: Option<Stream>,
    /// End of the displacement that goes on.
    until_s: f64,
    /// Its rates: in the room, m/s, and in heading, rad/s.
    rates: [f64; 3],
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { seed_run: true, floor: true, ..Hooks::NONE }
    }

    fn seed_run(&mut self, stream: Stream) {
        *self = Self { effect: self.effect, stream: Some(stream), until_s: 0.0, rates: [0.0; 3] };
    }

    fn floor(&mut self, step: &mut Step) {
        let Some(stream) = &mut self.stream else { return };
        let RobotDisplaced { rate_hz, duration_s, distance_m, turn_rad } = self.effect;
        if step.t_s >= self.until_s && stream.uniform() < -(-rate_hz * step.dt_s).exp_m1() {
            self.until_s = step.t_s + duration_s;
            self.rates = [distance_m, distance_m, turn_rad].map(|sigma| sigma * stream.normal() / duration_s);
        }
        if step.t_s < self.until_s {
            let for_s = step.dt_s.min(self.until_s - step.t_s);
            let [x_m_s, y_m_s, rad_s] = self.rates;
            step.creep_m[0] += x_m_s * for_s;
            step.creep_m[1] += y_m_s * for_s;
            step.extra_turn_rad += rad_s * for_s;
        }
    }

    fn needs_stepping(&self) -> Option<&'static str> {
        Some("it begins at an instant within a motion")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::specimen_step;
    use crate::{Address, StreamName};

    #[test]
    fn displacements_add_up_to_their_variance() {
        let effect = RobotDisplaced { rate_hz: 0.2, duration_s: 0.4, distance_m: 0.1, turn_rad: 0.2 };
        let mut state = effect.forward().expect("acts on the floor");
        state.seed_run(Address { seed: 5, point: 0, trial: 0, run: 0 }.stream(StreamName::new("test")));
        // Displacements are apart by five seconds on average, and stop where they began.
        let mut all: Vec<[f64; 3]> = Vec::new();
        let mut is_moving = false;
        for k in 0..400_000 {
            let mut step = Step { t_s: 0.01 * f64::from(k), dt_s: 0.01, ..specimen_step() };
            state.floor(&mut step);
            let moved = [step.creep_m[0], step.creep_m[1], step.extra_turn_rad];
            if moved != [0.0; 3] {
                match all.last_mut().filter(|_| is_moving) {
                    Some(sum) => sum.iter_mut().zip(moved).for_each(|(sum, moved)| *sum += moved),
                    None => all.push(moved),
                }
            }
            is_moving = moved != [0.0; 3];
        }
        let n = all.len() as f64;
        // One in 5.4 s; Poisson at five standard deviations, variances too.
        let expected = 4000.0 / 5.4;
        assert!((n - expected).abs() < 5.0 * f64::sqrt(expected), "{n}");
        for (axis, sigma) in [0.1, 0.1, 0.2].into_iter().enumerate() {
            let variance = all.iter().map(|of| of[axis] * of[axis]).sum::<f64>() / n;
            assert!((variance / (sigma * sigma) - 1.0).abs() < 5.0 * (2.0 / n).sqrt(), "{axis}: {variance}");
        }
    }
}
