//! `quantization`: the log keeps whole ticks, each of several counts.
//!
//! Model: tick = ⌊count / n⌋. A noise model, never a finding.
//! Signature: an error of variance Δ²/12 a pose, so that increments have a lag-1 correlation of −½.
//! Observability: the record itself.
//! Alias: white noise of the instrument.
//! Reference: Navarro et al.: a pulse of about 1 mm is a number of the controller's counts; Sheppard 1898 for
//! Δ²/12.

use serde::{Deserialize, Serialize};

use crate::description::Description;
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, Readout};
use crate::hypothesis::{Hypothesis, value_of};

/// Coarseness of the record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Quantization {
    /// Controller counts in one recorded tick (the paper's pulse).
    pub counts_per_tick: u32,
}

impl PhysicalEffect for Quantization {
    fn check(&self) -> Result<(), EffectError> {
        let n = self.counts_per_tick;
        EffectError::unless(n >= 1, "quantization", "counts_per_tick", f64::from(n), "1 or more")
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { effect: *self }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Silent
    }

    fn description() -> Description {
        Description::of("the log keeps whole ticks of several counts each")
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        Some(Self { counts_per_tick: value_of(values, "counts_per_tick")? as u32 })
    }
}

struct State {
    effect: Quantization,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { readout: true, ..Hooks::NONE }
    }

    fn readout(&mut self, readout: &mut Readout) {
        readout.ticks = readout.ticks.map(|counts| counts.div_euclid(i64::from(self.effect.counts_per_tick)));
    }

    fn counts_per_tick(&self) -> Option<u32> {
        Some(self.effect.counts_per_tick)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kinematics::Wheels;

    #[test]
    fn ticks_are_floors_on_both_sides_of_zero() {
        let mut state = State { effect: Quantization { counts_per_tick: 80 } };
        let ticks = Wheels { left: 159, right: -1 };
        let mut readout = Readout { ticks, m_per_count: Wheels::both(1e-5), written: true };
        state.readout(&mut readout);
        assert_eq!(readout.ticks, Wheels { left: 1, right: -1 });
    }
}
