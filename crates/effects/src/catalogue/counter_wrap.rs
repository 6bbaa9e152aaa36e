//! `counter_wrap`: the log keeps only the low bits of the counter.
//!
//! Model: two's complement of `bits` bits.
//! Signature: single jumps of 2^bits. A gross fault, tried before any fit: the records without it have the
//! jumps taken out.
//! Observability: the record itself.
//! Alias: none.
//! Reference: the HCTL-1100's position register has 24 bits; microcontroller timers have 8, 16 or 32.

use dataset::{Dataset, WheelLog, suspected_wrap};
use serde::{Deserialize, Serialize};

use crate::benchmark::Benchmark;
use crate::description::Description;
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, Readout};
use crate::hypothesis::{Hypothesis, RecordCorrection, rewrite_wheels, value_of};
use crate::on_board::{Correction, OnBoard};

/// A robot's own odometry takes counts the nearer way round: all it needs is the counters' width.
const ON_BOARD: OnBoard =
    OnBoard::Constant(Correction { statements: "", correct: |_, raw| raw, counter_bits: Some("bits") });

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
        Some(Box::new(State { effect: *self }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Records(corrections)
    }

    fn description() -> Description {
        Description {
            benchmark: Benchmark::of_fault(|_, _| vec![("bits", 16.0)]),
            on_board: ON_BOARD,
            ..Description::of("the log keeps only the low bits of the counters")
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        Some(Self { bits: value_of(values, "bits")? as u32 })
    }
}

struct State {
    effect: CounterWrap,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { readout: true, ..Hooks::NONE }
    }

    fn readout(&mut self, readout: &mut Readout) {
        let unused = 64 - self.effect.bits;
        readout.ticks = readout.ticks.map(|ticks| (ticks << unused) >> unused);
    }
}

/// The counts unwrapped, for each width whose wrapping some run's counts show.
fn corrections(dataset: &Dataset) -> Vec<RecordCorrection> {
    let mut shown: Vec<u8> = Vec::new();
    for run in &dataset.runs {
        if let WheelLog::Ticks(ticks) = &run.odometry.wheels {
            shown.extend([&ticks.left, &ticks.right].into_iter().filter_map(|column| suspected_wrap(column)));
        }
    }
    shown.sort_unstable();
    shown.dedup();
    let without = |bits: u8| RecordCorrection {
        values: vec![("bits", f64::from(bits))],
        sentence: format!("the log keeps {bits} bits of the counters, which wrap"),
        visible_in_log: true,
        mistakes: 1,
        records: rewrite_wheels(
            dataset,
            |wheels| {
                if let WheelLog::Ticks(ticks) = wheels {
                    unwrap(&mut ticks.left, bits);
                    unwrap(&mut ticks.right, bits);
                }
            },
            |twist| twist,
        ),
    };
    shown.into_iter().map(without).collect()
}

/// Takes whole turns of the counter out of every increment, to the nearest.
fn unwrap(ticks: &mut [i64], bits: u8) {
    let (turn, mut turns) = (1_i64 << bits, 0);
    for k in 1..ticks.len() {
        ticks[k] += turns;
        let jumped = (ticks[k] - ticks[k - 1] + turn / 2).div_euclid(turn) * turn;
        ticks[k] -= jumped;
        turns -= jumped;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kinematics::Wheels;

    #[test]
    fn the_low_bits_are_kept_with_their_sign() {
        let mut state = State { effect: CounterWrap { bits: 24 } };
        let ticks = Wheels { left: (1 << 23) - 1, right: 1 << 23 };
        let mut readout = Readout { ticks, m_per_count: Wheels::both(1e-5), written: true };
        state.readout(&mut readout);
        assert_eq!(readout.ticks, Wheels { left: (1 << 23) - 1, right: -(1 << 23) });
    }
    #[test]
    fn unwrapping_gives_the_counts_back() {
        let counted: Vec<i64> = (0..2000).map(|k| if k < 1000 { 120 * k } else { 120_000 - 70 * (k - 1000) }).collect();
        let mut shown: Vec<i64> = counted.iter().map(|&count| (count << 48) >> 48).collect();
        unwrap(&mut shown, 16);
        assert!(shown == counted);
    }
}
