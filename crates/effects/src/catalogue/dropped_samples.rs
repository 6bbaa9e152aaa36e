//! `dropped_samples`: rows are missing, and with them what the wheels did meanwhile.
//!
//! Model: a row is lost with some probability; where the log adds up increments, the counts since the row before are lost with it. Signature: gaps in time
//! over which a moving robot seems to crawl. A gross fault, tried before any fit: the records without it have the counts of each gap carried on from the
//! rows around it. Observability: gaps while the robot moves. Alias: `missed_counts`. Reference: serial links without acknowledgement, full queues.

use dataset::{Dataset, Odometry, WheelLog};
use kinematics::{Side, Wheels};
use serde::{Deserialize, Serialize};

use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, Readout};
use crate::hypothesis::{Hypothesis, Rewriting, median, size};
use crate::stream::Stream;

/// Rows lost with their counts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DroppedSamples {
    /// Probability that a row is lost; the first of a run never is.
    pub probability: f64,
}

impl PhysicalEffect for DroppedSamples {
    fn check(&self) -> Result<(), EffectError> {
        let probability = self.probability;
        let holds = (0.0..1.0).contains(&probability);
        EffectError::unless(holds, "dropped_samples", "probability", probability, "in [0, 1)")
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { size: *self, stream: None, last: None, lost: Wheels::both(0) }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Records(rewritings)
    }

    fn of_sizes(sizes: &[(&str, f64)]) -> Option<Self> {
        Some(Self { probability: size(sizes, "probability")? })
    }
}

struct State {
    size: DroppedSamples,
    stream: Option<Stream>,
    last: Option<Wheels<i64>>,
    lost: Wheels<i64>,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { start_run: true, readout: true, ..Hooks::NONE }
    }

    fn start_run(&mut self, stream: Stream) {
        *self = Self { size: self.size, stream: Some(stream), last: None, lost: Wheels::both(0) };
    }

    fn readout(&mut self, readout: &mut Readout) {
        let Some(stream) = &mut self.stream else { return };
        let (counts, chance) = (readout.ticks, stream.uniform());
        if let Some(last) = self.last
            && chance < self.size.probability
        {
            readout.written = false;
            let since = counts.zip_with(last, |counts, last| counts - last);
            self.lost = self.lost.zip_with(since, |lost, since| lost + since);
        }
        self.last = Some(counts);
        readout.ticks = counts.zip_with(self.lost, |counts, lost| counts - lost);
    }
}

/// An interval longer than the usual one by this factor is a gap.
const GAP: f64 = 1.5;

/// Carries the counts of every gap on, and says how many rows were missing.
fn fill(odometry: &mut Odometry) -> f64 {
    let Odometry { t_s, wheels: WheelLog::Ticks(ticks), .. } = odometry else { return 0.0 };
    let lengths_s: Vec<f64> = t_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let Some(usual_s) = median(lengths_s.clone()) else { return 0.0 };
    let mut missing = 0.0;
    for side in Side::BOTH {
        let column = &mut ticks[side];
        let shown: Vec<i64> = column.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let mut lost = 0;
        for (k, &length_s) in lengths_s.iter().enumerate() {
            if length_s > GAP * usual_s {
                let rows = (length_s / usual_s).round() - 1.0;
                // The row after a gap shows its own interval; the ones that are lost were, on average, like it and the one before them.
                #[allow(clippy::cast_precision_loss)]
                let around = 0.5 * (shown[k] + shown[k.saturating_sub(1)]) as f64;
                #[allow(clippy::cast_possible_truncation)] // far under 2⁶³ counts
                let in_gap = (rows * around).round() as i64;
                lost += in_gap;
                missing += 0.5 * rows;
            }
            column[k + 1] += lost;
        }
    }
    missing
}

fn rewritings(dataset: &Dataset) -> Vec<Rewriting> {
    let mut records = dataset.clone();
    let (mut missing, mut rows) = (0.0, 0.0);
    for run in &mut records.runs {
        missing += fill(&mut run.odometry);
        #[allow(clippy::cast_precision_loss)]
        let of_run = run.odometry.t_s.len() as f64;
        rows += of_run;
    }
    if missing == 0.0 {
        return Vec::new();
    }
    vec![Rewriting {
        sizes: vec![("probability", missing / (missing + rows))],
        sentence: format!("{missing} rows are missing, and their counts with them"),
        records,
    }]
}
