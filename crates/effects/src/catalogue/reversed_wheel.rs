//! `reversed_wheel`: a counter counts down when its wheel rolls forward.
//!
//! Model: that column's sign is wrong.
//! Signature: of one wheel, straights look like spins and spins like straights; of both, everything runs
//! backward. A gross fault, tried before any fit: the records without it have the sign restored.
//! Observability: any motion.
//! Alias: `swapped_wheels` on turns alone.
//! Reference: the two channels of a quadrature encoder exchanged, or a motor mounted the other way round.

use dataset::{Dataset, WheelLog};
use kinematics::{Side, Wheels};
use serde::{Deserialize, Serialize};

use crate::benchmark::Benchmark;
use crate::description::{Description, RecordFault};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, Readout};
use crate::hypothesis::{Hypothesis, RecordCorrection, by_wheels, rewrite_wheels, value_of};
use crate::on_board::{Correction, OnBoard, RawInterval};

/// What a robot's own odometry does first.
const ON_BOARD: OnBoard = OnBoard::Constant(Correction {
    statements: "\
left_counts *= 1.0 - 2.0 * left;
right_counts *= 1.0 - 2.0 * right;",
    correct: |size, raw| {
        let sign = Wheels { left: 1.0 - 2.0 * size("left"), right: 1.0 - 2.0 * size("right") };
        RawInterval { counts: raw.counts.zip_with(sign, |counts, sign| counts * sign), ..raw }
    },
    counter_bits: None,
});

/// Counters that run the other way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReversedWheel {
    /// Does the left one?
    #[serde(default)]
    pub left: bool,
    /// Does the right one?
    #[serde(default)]
    pub right: bool,
}

impl PhysicalEffect for ReversedWheel {
    fn check(&self) -> Result<(), EffectError> {
        Ok(())
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { effect: *self }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Records(corrections)
    }

    fn description() -> Description {
        Description {
            record_fault: RecordFault { leaves_a_trace: false, ..RecordFault::WITH_A_TRACE },
            benchmark: Benchmark::of_fault(|faulty, _| {
                vec![("left", f64::from(u8::from(faulty.left))), ("right", f64::from(u8::from(faulty.right)))]
            }),
            on_board: ON_BOARD,
            ..Description::of("a counter counts down when its wheel rolls forward")
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        Some(Self { left: value_of(values, "left")? != 0.0, right: value_of(values, "right")? != 0.0 })
    }
}

struct State {
    effect: ReversedWheel,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { readout: true, ..Hooks::NONE }
    }

    fn readout(&mut self, readout: &mut Readout) {
        if self.effect.left {
            readout.ticks.left = -readout.ticks.left;
        }
        if self.effect.right {
            readout.ticks.right = -readout.ticks.right;
        }
    }
}

fn corrections(dataset: &Dataset) -> Vec<RecordCorrection> {
    let forms = [
        (Wheels { left: true, right: false }, "the left counter runs backward"),
        (Wheels { left: false, right: true }, "the right counter runs backward"),
        (Wheels { left: true, right: true }, "both counters run backward"),
    ];
    let without = |(reversed, sentence): (Wheels<bool>, &str)| {
        let sign = reversed.map(|reversed| if reversed { -1.0 } else { 1.0 });
        let turned = |wheels: &mut WheelLog| {
            for side in Side::BOTH.into_iter().filter(|side| reversed[*side]) {
                match wheels {
                    WheelLog::Ticks(columns) => columns[side].iter_mut().for_each(|ticks| *ticks = -*ticks),
                    WheelLog::Angles(columns) | WheelLog::Speeds(columns) => {
                        columns[side].iter_mut().for_each(|turn| *turn = -*turn);
                    }
                    WheelLog::Twist { .. } => {}
                }
            }
        };
        let twist = |twist| by_wheels(&dataset.robot, twist, |speed_m_s| speed_m_s.zip_with(sign, |v, sign| sign * v));
        let flag = |reversed: bool| f64::from(u8::from(reversed));
        RecordCorrection {
            values: vec![("left", flag(reversed.left)), ("right", flag(reversed.right))],
            sentence: sentence.to_owned(),
            visible_in_log: false,
            mistakes: u32::from(reversed.left) + u32::from(reversed.right),
            records: rewrite_wheels(dataset, turned, twist),
        }
    };
    forms.map(without).into()
}
