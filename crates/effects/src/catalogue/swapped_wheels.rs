//! `swapped_wheels`: the left counter is logged as the right one and the right one as the left.
//!
//! Model: the two columns change places.
//! Signature: every turn has the other sense. A gross fault, tried before any fit: the records without it
//! have the columns changed back.
//! Observability: any turn.
//! Alias: `reversed_wheel` of both on turns alone.
//! Reference: two plugs that fit each other.

use dataset::{Dataset, WheelLog};
use kinematics::{Twist, Wheels};
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
if (swapped != 0.0) {
    const double other_counts = left_counts;
    left_counts = right_counts;
    right_counts = other_counts;
}",
    correct: |size, raw| {
        let Wheels { left, right } = raw.counts;
        if size("swapped") == 0.0 { raw } else { RawInterval { counts: Wheels { left: right, right: left }, ..raw } }
    },
    counter_bits: None,
});

/// Columns that have changed places.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SwappedWheels {
    /// Have they?
    pub swapped: bool,
}

impl PhysicalEffect for SwappedWheels {
    fn check(&self) -> Result<(), EffectError> {
        Ok(())
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        self.swapped.then(|| Box::new(State) as Box<dyn Forward>)
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Records(corrections)
    }

    fn description() -> Description {
        Description {
            record_fault: RecordFault { leaves_a_trace: false, ..RecordFault::WITH_A_TRACE },
            benchmark: Benchmark::of_fault(|_, _| vec![("swapped", 1.0)]),
            on_board: ON_BOARD,
            ..Description::of("the left and the right counter are exchanged")
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        Some(Self { swapped: value_of(values, "swapped")? != 0.0 })
    }
}

struct State;

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { readout: true, ..Hooks::NONE }
    }

    fn readout(&mut self, readout: &mut Readout) {
        let Wheels { left, right } = readout.ticks;
        readout.ticks = Wheels { left: right, right: left };
    }
}

fn corrections(dataset: &Dataset) -> Vec<RecordCorrection> {
    let changed = |wheels: &mut WheelLog| match wheels {
        WheelLog::Ticks(Wheels { left, right }) => std::mem::swap(left, right),
        WheelLog::Angles(Wheels { left, right }) | WheelLog::Speeds(Wheels { left, right }) => {
            std::mem::swap(left, right);
        }
        WheelLog::Twist { .. } => {}
    };
    let turned =
        |twist: Twist| by_wheels(&dataset.robot, twist, |Wheels { left, right }| Wheels { left: right, right: left });
    vec![RecordCorrection {
        values: vec![("swapped", 1.0)],
        sentence: "the left and the right counter are swapped".to_owned(),
        visible_in_log: false,
        mistakes: 1,
        records: rewrite_wheels(dataset, changed, turned),
    }]
}
