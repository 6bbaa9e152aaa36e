//! `time_unit`: times in milliseconds or microseconds are written as if they were seconds.
//!
//! Model: stamp = factor × t.
//! Signature: the log lasts a thousand times as long as what was seen of it. A gross fault, tried before any
//! fit: the records without it have the times of the log, or those of the instrument, divided.
//! Observability: the record itself.
//! Alias: none.
//! Reference: what importers meet; ROS headers in nanoseconds, Arduino's millis() and micros().

use dataset::{Dataset, Odometry, Run, RunSpans, WheelLog, median};
use serde::{Deserialize, Serialize};

use crate::benchmark::Benchmark;
use crate::description::Description;
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, SampleClock};
use crate::hypothesis::{Hypothesis, RecordCorrection, value_of};
use crate::on_board::{Correction, OnBoard, RawInterval};
use crate::settings;

/// Factors between units of time that people use.
const FACTORS: [f64; 6] = [1e3, 1e6, 1e9, 1e-3, 1e-6, 1e-9];

/// What a robot's own odometry does first.
const ON_BOARD: OnBoard = OnBoard::Constant(Correction {
    statements: "dt_s /= factor;",
    correct: |size, raw| RawInterval { dt_s: raw.dt_s / size("factor"), ..raw },
    counter_bits: None,
});

/// The log's unit of time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TimeUnit {
    /// Units in a second: 1000 for milliseconds.
    pub factor: f64,
}

impl PhysicalEffect for TimeUnit {
    fn check(&self) -> Result<(), EffectError> {
        EffectError::unless_positive("time_unit", [("factor", self.factor)])
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { effect: *self }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Records(corrections)
    }

    fn description() -> Description {
        Description {
            benchmark: Benchmark::of_fault(|_, stream| vec![("factor", [1e3, 1e6][stream.below(2)])]),
            on_board: ON_BOARD,
            ..Description::of("times are written in another unit than seconds")
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        Some(Self { factor: value_of(values, "factor")? })
    }
}

struct State {
    effect: TimeUnit,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { clock: true, ..Hooks::NONE }
    }

    fn clock(&mut self, sample: &mut SampleClock) {
        sample.stamp_s *= self.effect.factor;
    }
}

/// The log's span over that of the measurements, by the middle run.
fn span_ratio(dataset: &Dataset) -> Option<f64> {
    let ratio = |run: &Run| {
        let [logged_s, measured_s] = RunSpans::of(run).comparable_s()?;
        Some(logged_s / measured_s)
    };
    median(dataset.runs.iter().filter_map(ratio))
}

/// How far, in logarithms, the robot's mean speed by its log is from a usual robot's.
fn off_typical(dataset: &Dataset) -> f64 {
    let session = dataset.session();
    let (mut distance_m, mut time_s) = (0.0, 0.0);
    for run in &session.runs {
        let Odometry { t_s, wheels, .. } = &run.run().odometry;
        if matches!(wheels, WheelLog::Speeds(_) | WheelLog::Twist { .. }) {
            // Speeds are logged: the same whatever the unit of time.
            return 0.0;
        }
        distance_m += run.rolled_m(session.robot);
        time_s += t_s.last().zip(t_s.first()).map_or(0.0, |(last, first)| last - first);
    }
    if distance_m > 0.0 && time_s > 0.0 {
        (distance_m / time_s / settings::FACTORS.usual_speed_m_s).ln().abs()
    } else {
        0.0
    }
}

fn corrections(dataset: &Dataset) -> Vec<RecordCorrection> {
    let Some(ratio) = span_ratio(dataset) else { return Vec::new() };
    let most = settings::FACTORS.max_span_ratio;
    let near = |factor: &f64| ratio / factor < most && factor / ratio < most;
    let Some(factor) = FACTORS.into_iter().find(near) else { return Vec::new() };
    let (mut log, mut measurements) = (dataset.clone(), dataset.clone());
    for run in &mut log.runs {
        run.odometry.t_s.iter_mut().for_each(|t_s| *t_s /= factor);
        run.gyro.iter_mut().for_each(|of| of.t_s /= factor);
    }
    for run in &mut measurements.runs {
        run.map_measurement_times(|t_s| *t_s *= factor);
    }
    let mut forms = [(log, factor, "the log's"), (measurements, factor.recip(), "the instrument's")];
    // Which of the two is in seconds, the ratio does not say; the speed does.
    forms.sort_by(|a, b| off_typical(&a.0).total_cmp(&off_typical(&b.0)));
    forms
        .into_iter()
        .map(|(records, factor, whose)| RecordCorrection {
            values: vec![("factor", factor)],
            sentence: format!("{whose} times are off by a factor of {factor:e}"),
            visible_in_log: true,
            mistakes: 1,
            records,
        })
        .collect()
}
