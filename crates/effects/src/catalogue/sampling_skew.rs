//! `sampling_skew`: the right counter is read a little later than the left one.
//!
//! Model: a row stamped t holds the left count at t and the right count at t + δ. Signature: e_dθ = δ a/b, nothing at constant speed or at rest.
//! Observability: speed changes on straights. Alias: `slip_acceleration` of one wheel.
//! Reference: two HCTL-1100 that share no sampling: δ up to one sample time, 0.06 to 2 ms.

use serde::{Deserialize, Serialize};

use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, SampleClock};
use crate::hypothesis::Hypothesis;

/// Delay of the right reading.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SamplingSkew {
    /// How much later the right counter is read, seconds.
    pub right_delay_s: f64,
}

impl PhysicalEffect for SamplingSkew {
    fn check(&self) -> Result<(), EffectError> {
        let holds = self.right_delay_s.is_finite() && self.right_delay_s >= 0.0;
        EffectError::unless(holds, "sampling_skew", "right_delay_s", self.right_delay_s, "0 or more")
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { size: *self }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Silent
    }
}

struct State {
    size: SamplingSkew,
}

impl Forward for State {
    fn clock(&mut self, sample: &mut SampleClock) {
        sample.read_s.right += self.size.right_delay_s;
    }
}
