//! `counter_wrap`: the log keeps only the low bits of the counter.
//!
//! Model: two's complement of `bits` bits. Signature: single jumps of 2^bits. A gross fault, tried before any fit.
//! Observability: the record itself. Reference: the HCTL-1100's position register has 24 bits; microcontroller timers have 8, 16 or 32.

use serde::{Deserialize, Serialize};

use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Readout};
use crate::hypothesis::Hypothesis;

/// Width of the recorded counter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CounterWrap {
    /// Bits kept.
    pub bits: u32,
}

impl PhysicalEffect for CounterWrap {
    fn check(&self) -> Result<(), EffectError> {
        let holds = [8, 16, 24, 32].contains(&self.bits);
        EffectError::unless(holds, "counter_wrap", "bits", f64::from(self.bits), "8, 16, 24 or 32")
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { size: *self }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Silent
    }
}

struct State {
    size: CounterWrap,
}

impl Forward for State {
    fn readout(&mut self, readout: &mut Readout) {
        let unused = 64 - self.size.bits;
        readout.ticks = readout.ticks.map(|ticks| (ticks << unused) >> unused);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kinematics::Wheels;

    #[test]
    fn the_low_bits_are_kept_with_their_sign() {
        let mut state = State { size: CounterWrap { bits: 24 } };
        let mut readout = Readout { ticks: Wheels { left: (1 << 23) - 1, right: 1 << 23 } };
        state.readout(&mut readout);
        assert_eq!(readout.ticks, Wheels { left: (1 << 23) - 1, right: -(1 << 23) });
    }
}
