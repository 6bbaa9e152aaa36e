//! `time_unit`: times in milliseconds or microseconds are written as if they were seconds.
//!
//! Model: stamp = factor × t. Signature: the log lasts a thousand times as long as what was seen of it. A gross fault, tried before any fit: the records
//! without it have the times of the log, or those of the instrument, divided. Observability: the record itself. Alias: none.
//! Reference: what importers meet; ROS headers in nanoseconds, Arduino's millis() and micros().

use dataset::{Dataset, Run};
use serde::{Deserialize, Serialize};

use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, SampleClock};
use crate::hypothesis::{Hypothesis, Rewriting, median, size};

/// Factors between units of time that people use.
const FACTORS: [f64; 6] = [1e3, 1e6, 1e9, 1e-3, 1e-6, 1e-9];

/// How far from a factor a ratio of two spans may be: looks need not begin and end with the log.
const WITHIN: f64 = 4.0;

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
        Some(Box::new(State { size: *self }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Records(rewritings)
    }

    fn of_sizes(sizes: &[(&str, f64)]) -> Option<Self> {
        Some(Self { factor: size(sizes, "factor")? })
    }
}

struct State {
    size: TimeUnit,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { clock: true, ..Hooks::NONE }
    }

    fn clock(&mut self, sample: &mut SampleClock) {
        sample.stamp_s *= self.size.factor;
    }
}

/// The instants of whatever saw the robot from outside.
fn seen_s(run: &Run) -> impl Iterator<Item = f64> {
    let ends = run.displacements.iter().flat_map(|seen| [seen.t0_s, seen.t1_s]);
    let poses = run.truth.iter().map(|sample| sample.t_s);
    let points = run.point_readings.iter().map(|reading| reading.t_s);
    poses.chain(points).chain(ends).chain(run.wheel_reference.iter().map(|speed| speed.t_s))
}

/// The log's span over that of the looks, by the middle run.
fn ratio_of_spans(dataset: &Dataset) -> Option<f64> {
    let ratio = |run: &Run| {
        let logged_s = run.odometry.t_s.last()? - run.odometry.t_s.first()?;
        let (first_s, last_s) =
            seen_s(run).fold((f64::INFINITY, f64::NEG_INFINITY), |(first, last), t_s| (first.min(t_s), last.max(t_s)));
        (logged_s > 0.0 && last_s > first_s).then(|| logged_s / (last_s - first_s))
    };
    median(dataset.runs.iter().filter_map(ratio).collect())
}

fn rewritings(dataset: &Dataset) -> Vec<Rewriting> {
    let Some(ratio) = ratio_of_spans(dataset) else { return Vec::new() };
    let near = |factor: &f64| ratio / factor < WITHIN && factor / ratio < WITHIN;
    let Some(factor) = FACTORS.into_iter().find(near) else { return Vec::new() };
    // Which of the two is in seconds, the ratio does not say.
    let (mut log, mut looks) = (dataset.clone(), dataset.clone());
    for run in &mut log.runs {
        run.odometry.t_s.iter_mut().for_each(|t_s| *t_s /= factor);
    }
    for run in &mut looks.runs {
        run.truth.iter_mut().for_each(|sample| sample.t_s *= factor);
        run.point_readings.iter_mut().for_each(|reading| reading.t_s *= factor);
        run.wheel_reference.iter_mut().for_each(|speed| speed.t_s *= factor);
        for seen in &mut run.displacements {
            (seen.t0_s, seen.t1_s) = (seen.t0_s * factor, seen.t1_s * factor);
        }
    }
    [(log, factor, "the log's"), (looks, factor.recip(), "the instrument's")]
        .into_iter()
        .map(|(records, factor, whose)| Rewriting {
            sizes: vec![("factor", factor)],
            sentence: format!("{whose} times are off by a factor of {factor:e}"),
            records,
        })
        .collect()
}
