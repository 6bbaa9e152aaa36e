//! `missed_counts`: a counter that cannot follow fast edges loses the ones above some rate.
//!
//! Model: of the counts above the hinge speed a share is lost: counted speed = h + (1−share)(|v_w|−h) for |v_w| > h. Signature: a one-sided hinge
//! in |v_w| of that wheel; the robot goes farther than it counts. Observability: speeds on both sides of the hinge. Alias: `slip_speed` of the other sign.
//! Reference: the HCTL-1100's input filter (a state must stand three clocks); interrupt-driven counters behave alike.

use kinematics::Side;
use serde::{Deserialize, Serialize};

use crate::effect::{EffectError, PhysicalEffect, Which};
use crate::forward::{Forward, Step};
use crate::hypothesis::Hypothesis;

/// Counts lost above a speed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MissedCounts {
    /// Whose counter.
    pub wheel: Which,
    /// Contact speed above which counts are lost, m/s.
    pub hinge_speed_m_s: f64,
    /// Share of the counts above the hinge that is lost.
    pub lost_share: f64,
}

impl PhysicalEffect for MissedCounts {
    fn check(&self) -> Result<(), EffectError> {
        let id = "missed_counts";
        let hinge = self.hinge_speed_m_s;
        EffectError::unless(hinge.is_finite() && hinge >= 0.0, id, "hinge_speed_m_s", hinge, "0 or more")?;
        EffectError::unless((0.0..1.0).contains(&self.lost_share), id, "lost_share", self.lost_share, "in [0, 1)")
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { size: *self }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Silent
    }
}

struct State {
    size: MissedCounts,
}

impl Forward for State {
    fn encoder(&mut self, step: &mut Step) {
        let speed_m_s = step.contact_speed_m_s();
        for side in Side::BOTH {
            let speed_m_s = speed_m_s[side].abs();
            if self.size.wheel.includes(side) && speed_m_s > self.size.hinge_speed_m_s {
                step.encoder_rad[side] *= 1.0 - self.size.lost_share * (1.0 - self.size.hinge_speed_m_s / speed_m_s);
            }
        }
    }

    fn depends_on_speed(&self) -> bool {
        self.size.lost_share != 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::specimen_step;

    #[test]
    fn nothing_is_lost_below_the_hinge_and_a_share_above() {
        let mut state = State { size: MissedCounts { wheel: Which::Right, hinge_speed_m_s: 0.2, lost_share: 0.01 } };
        let mut seen = |speed_m_s: f64| {
            let mut step = specimen_step();
            step.rate_rad_s = kinematics::Wheels::both(speed_m_s / 0.08);
            step.encoder_rad = kinematics::Wheels::both(1.0);
            state.encoder(&mut step);
            step.encoder_rad
        };
        assert_eq!(seen(0.2).right, 1.0);
        assert_eq!(seen(-0.4).left, 1.0);
        assert!((seen(-0.4).right - (1.0 - 0.01 * 0.5)).abs() < 1e-15);
    }
}
