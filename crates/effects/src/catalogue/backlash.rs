//! `backlash`: play between the encoder's axis and the wheel.
//!
//! Model: the play operator: the wheel rests until the shaft has crossed the gap, then follows at its edge. Signature: each reversal of a wheel loses
//! the whole gap of travel. Observability: reversals of one wheel; a corner turned on the spot reverses one wheel. Alias: `castor_kick`.
//! Reference: the play operator, Krasnosel'skii & Pokrovskii 1983.

use kinematics::{Side, Wheels};
use serde::{Deserialize, Serialize};

use crate::effect::{EffectError, PhysicalEffect, Which};
use crate::forward::{Forward, Step};
use crate::hypothesis::Hypothesis;
use crate::stream::Stream;

/// Play of one wheel or of both.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Backlash {
    /// Which wheels have play.
    pub wheel: Which,
    /// Whole width of the gap, radians at the wheel: what a reversal loses.
    pub gap_rad: f64,
}

impl PhysicalEffect for Backlash {
    fn check(&self) -> Result<(), EffectError> {
        let holds = self.gap_rad.is_finite() && self.gap_rad >= 0.0;
        EffectError::unless(holds, "backlash", "gap_rad", self.gap_rad, "0 or more")
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { size: *self, lead_rad: Wheels::both(0.0) }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Silent
    }
}

struct State {
    size: Backlash,
    /// How far the shaft is ahead of the wheel, within ± half of the gap.
    lead_rad: Wheels<f64>,
}

impl Forward for State {
    fn start_run(&mut self, mut stream: Stream) {
        // Where in its gap the wheel was left, nobody knows.
        let half_gap_rad = 0.5 * self.size.gap_rad;
        self.lead_rad = Wheels::from_sides(|_| stream.uniform_about_zero(half_gap_rad));
    }

    fn wheel(&mut self, step: &mut Step) {
        let half_gap_rad = 0.5 * self.size.gap_rad;
        for side in Side::BOTH {
            if self.size.wheel.includes(side) {
                let lead_rad = self.lead_rad[side] + step.wheel_rad[side];
                self.lead_rad[side] = lead_rad.clamp(-half_gap_rad, half_gap_rad);
                step.wheel_rad[side] = lead_rad - self.lead_rad[side];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::specimen_step;

    #[test]
    fn a_reversal_loses_the_gap_and_only_on_its_wheel() {
        let mut state = State { size: Backlash { wheel: Which::Left, gap_rad: 0.02 }, lead_rad: Wheels::both(0.01) };
        let mut turn = |shaft_rad| {
            let mut step = specimen_step();
            step.wheel_rad = Wheels::both(shaft_rad);
            state.wheel(&mut step);
            step.wheel_rad
        };
        assert_eq!(turn(1.0).left, 1.0);
        let back = turn(-1.0);
        assert!((back.left + 0.98).abs() < 1e-15, "{back:?}");
        assert_eq!(back.right, -1.0);
        assert_eq!(turn(-1.0).left, -1.0);
        // In small steps the same gap is lost: the wheel rests first.
        let sum: f64 = (0..1000).map(|_| turn(1e-3).left).sum();
        assert!((sum - 0.98).abs() < 1e-12, "{sum}");
    }
}
