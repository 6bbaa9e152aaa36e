//! `dropped_samples`: rows are missing, and with them what the wheels did meanwhile.
//!
//! Model: a row is lost with some probability; where the log adds up increments, the counts since the row
//! before are lost with it.
//! Signature: gaps in time over which a moving robot seems to crawl. A gross fault, tried before any fit: the
//! records without it have the counts of each gap carried on from the rows around it. That is rough: where
//! measurements are dense enough to spare those across gaps, nothing is compared across them.
//! Observability: gaps while the robot moves.
//! Alias: `missed_counts`.
//! Reference: serial links without acknowledgement, full queues.

use dataset::{Dataset, Odometry, Run, Timestamps, UnknownMotion, WheelLog};
use kinematics::{Side, Wheels};
use serde::{Deserialize, Serialize};

use crate::benchmark::Benchmark;
use crate::description::{Description, RecordFault};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, Readout};
use crate::hypothesis::{Hypothesis, RecordCorrection, median, value_of};
use crate::on_board::OnBoard;
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
        Some(Box::new(State { effect: *self, stream: None, last: None, lost: Wheels::both(0) }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Records(corrections)
    }

    fn description() -> Description {
        Description {
            record_fault: RecordFault { is_restored_roughly: true, ..RecordFault::WITH_A_TRACE },
            benchmark: Benchmark::of_fault(|_, stream| vec![("probability", stream.uniform_in(0.01, 0.05))]),
            on_board: OnBoard::Never("what the wheels did in a missing interval, later readings and an instrument say alone"),
            ..Description::of("rows are missing, and with them what the wheels did meanwhile")
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        Some(Self { probability: value_of(values, "probability")? })
    }
}

struct State {
    effect: DroppedSamples,
    stream: Option<Stream>,
    last: Option<Wheels<i64>>,
    lost: Wheels<i64>,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { seed_run: true, readout: true, ..Hooks::NONE }
    }

    fn seed_run(&mut self, stream: Stream) {
        *self = Self { effect: self.effect, stream: Some(stream), last: None, lost: Wheels::both(0) };
    }

    fn readout(&mut self, readout: &mut Readout) {
        let Some(stream) = &mut self.stream else { return };
        let (counts, uniform) = (readout.ticks, stream.uniform());
        if let Some(last) = self.last
            && uniform < self.effect.probability
        {
            readout.written = false;
            let since = counts.zip_with(last, |counts, last| counts - last);
            self.lost = self.lost.zip_with(since, |lost, since| lost + since);
        }
        self.last = Some(counts);
        readout.ticks = counts.zip_with(self.lost, |counts, lost| counts - lost);
    }
}

/// Where rows are too few to have a beat: an interval longer than the usual one by this factor is nearer to
/// two of them. It may be a gap, or a pause of the log, and the counts tell.
const GAP_RATIO: f64 = 1.5;
/// What the rows that are missing in a gap counted, by the speed around it, counts of both wheels; with fewer
/// the rounding of the rows around it does not let them be missed.
const MIN_MISSED_COUNTS: f64 = 6.0;
/// Rows to either side of a gap that say how fast the wheels turned: their rounding is a third of a row's.
const ROWS_AROUND: usize = 3;
/// With so many gaps that lost counts, and as few that did not, the log itself shows the fault.
const MIN_VISIBLE_FAULTS: usize = 3;
/// Share of the pairs of successive measurements that gaps may spoil for the rest to be enough.
const MAX_SPOILED_PAIRS: f64 = 0.5;

/// What was missing of some runs.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Missing {
    rows: f64,
    /// Gaps over which a moving robot lost counts.
    lost: usize,
    /// Gaps over which it did not.
    kept: usize,
    /// The numbers of the rows are not certain.
    uncertain: bool,
}

/// Rows from each row to the next: more than one where rows are missing between them. By the beat, as stamps
/// may jitter, and whether that is uncertain; by time where there is none. One that came by itself is none.
fn rows_after(t_s: &Timestamps) -> Option<(Vec<f64>, bool)> {
    if let Some(period) = t_s.sampling_period() {
        // Where some numbers of rows are wrong, the log alone shows nothing.
        let uncertain = !period.is_certain();
        return Some((period.numbers.windows(2).map(|pair| (pair[1] - pair[0]) as f64).collect(), uncertain));
    }
    let lengths_s: Vec<f64> = t_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let usual_s = median(lengths_s.clone()).filter(|usual_s| *usual_s > 0.0)?;
    let rows = |length_s: &f64| match length_s / usual_s {
        ratio if ratio > GAP_RATIO => ratio,
        ratio if ratio * GAP_RATIO < 1.0 => 0.0,
        _ => 1.0,
    };
    Some((lengths_s.iter().map(rows).collect(), false))
}

/// Share of the pairs of successive measurements of some runs whose motion the counts leave open.
fn spoiled_pairs(runs: &[Run]) -> f64 {
    let (mut spoiled, mut pairs) = (0.0, 0.0);
    for run in runs {
        let poses = run.truth.windows(2).map(|pair| (pair[0].t_s, pair[1].t_s));
        let displacements = run.displacements.iter().map(|displacement| (displacement.t0_s, displacement.t1_s));
        for (from_s, to_s) in poses.chain(displacements) {
            pairs += 1.0;
            spoiled += f64::from(u8::from(run.is_motion_unknown(from_s, to_s)));
        }
    }
    if pairs > 0.0 { spoiled / pairs } else { 1.0 }
}

/// Carries the counts of every gap on, and says what was missing.
///
/// Over a gap the wheels turn at the speed of the rows before and after it together, exactly so where the
/// acceleration is constant; the row after it shows less.
fn fill(run: &mut Run) -> Missing {
    let mut missing = Missing::default();
    let Odometry { t_s, wheels: WheelLog::Ticks(ticks), .. } = &mut run.odometry else { return missing };
    let Some((rows, uncertain)) = rows_after(t_s) else { return missing };
    missing.uncertain = uncertain;
    let shown =
        ticks.as_ref().map(|column| column.windows(2).map(|pair| (pair[1] - pair[0]) as f64).collect::<Vec<_>>());
    let is_row = |k: &usize| rows[*k] == 1.0;
    let mut lost = Wheels::both(0.0);
    let mut spans = Vec::new();
    for (k, &of_gap) in rows.iter().enumerate() {
        if of_gap > 1.0 {
            let before: Vec<usize> = (0..k).rev().filter(is_row).take(ROWS_AROUND).collect();
            let after: Vec<usize> = (k + 1..rows.len()).filter(is_row).take(ROWS_AROUND).collect();
            let of_each = match before.len().min(after.len()) {
                0 => ROWS_AROUND,
                of_each => of_each,
            };
            let around: Vec<usize> = before.into_iter().take(of_each).chain(after.into_iter().take(of_each)).collect();
            let time_s: f64 = around.iter().map(|near| t_s[near + 1] - t_s[*near]).sum();
            let counts = Wheels::from_sides(|side| around.iter().map(|near| shown[side][*near]).sum::<f64>());
            // Counts of a row around it, and of the gap at their speed.
            let of_row = counts.map(|counts| counts / (around.len() as f64).max(1.0));
            let due = counts.map(|counts| if time_s > 0.0 { counts / time_s * (t_s[k + 1] - t_s[k]) } else { 0.0 });
            let [row_of_both, shown_of_both] =
                [of_row.left.abs() + of_row.right.abs(), shown.left[k].abs() + shown.right[k].abs()];
            // Half of the missing rows' counts lie between what a single row shows and what all of them do.
            let is_lost = shown_of_both < 0.5 * (1.0 + of_gap) * row_of_both;
            if (of_gap - 1.0) * row_of_both < MIN_MISSED_COUNTS {
                // Neither tells.
            } else if is_lost {
                for side in Side::BOTH {
                    lost[side] += due[side] - shown[side][k];
                }
                spans.push(UnknownMotion { from_s: t_s[k], to_s: t_s[k + 1] });
                missing.lost += 1;
                missing.rows += of_gap.round() - 1.0;
            } else {
                missing.kept += 1;
            }
        }
        for side in Side::BOTH {
            ticks[side][k + 1] += lost[side].round() as i64;
        }
    }
    run.add_unknown_motion(spans);
    missing
}

fn corrections(dataset: &Dataset) -> Vec<RecordCorrection> {
    let mut records = dataset.clone();
    let (mut missing, mut rows) = (Missing::default(), 0.0);
    for run in &mut records.runs {
        let of_run = fill(run);
        missing.rows += of_run.rows;
        missing.lost += of_run.lost;
        missing.kept += of_run.kept;
        missing.uncertain |= of_run.uncertain;
        let written = run.odometry.t_s.len() as f64;
        rows += written;
    }
    if missing.lost == 0 {
        return Vec::new();
    }
    if spoiled_pairs(&records.runs) > MAX_SPOILED_PAIRS {
        for (run, recorded) in records.runs.iter_mut().zip(&dataset.runs) {
            run.unknown_motion.clone_from(&recorded.unknown_motion);
        }
    }
    vec![RecordCorrection {
        values: vec![("probability", missing.rows / (missing.rows + rows))],
        sentence: format!("{} rows are missing, and their counts with them", missing.rows),
        visible_in_log: missing.lost >= MIN_VISIBLE_FAULTS && missing.lost > missing.kept && !missing.uncertain,
        mistakes: 1,
        records,
    }]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A robot that speeds up, cruises, and slows down, with rows that jitter and counts that are true at
    /// their stamps.
    fn odometry(missing: &[usize], with_counts: bool) -> (Odometry, Vec<i64>) {
        let stamp_s = |row: usize| 0.05 * row as f64 + 0.006 * (2.4 * row as f64).sin();
        let counted = |t_s: f64| {
            let ramp_s = t_s.clamp(0.0, 1.0);
            (5000.0 * (0.5 * ramp_s * ramp_s + (t_s - 1.0).max(0.0))).round() as i64
        };
        let (mut t_s, mut column, mut whole, mut lost, mut last) = (Vec::new(), Vec::new(), Vec::new(), 0, 0);
        for row in 0..80 {
            let count = counted(stamp_s(row));
            if missing.contains(&row) {
                lost += if with_counts { count - last } else { 0 };
            } else {
                t_s.push(stamp_s(row));
                column.push(count - lost);
                whole.push(count);
            }
            last = count;
        }
        let wheels = WheelLog::Ticks(Wheels { left: column.clone(), right: column });
        (Odometry { t_s: t_s.into(), wheels, ..Odometry::default() }, whole)
    }

    #[test]
    fn counts_of_lost_rows_are_carried_on_through_ramps_and_jitter() {
        let (record, whole) = odometry(&[9, 30, 31, 50], true);
        let mut run = Run { odometry: record, ..Run::default() };
        let missing = fill(&mut run);
        assert_eq!((missing.rows, missing.lost, missing.kept), (4.0, 3, 0));
        let spans = run.unknown_motion.len();
        assert!(spans == 3 && run.is_motion_unknown(0.4, 0.5) && !run.is_motion_unknown(0.6, 1.0), "{spans}");
        let WheelLog::Ticks(ticks) = &run.odometry.wheels else { panic!("counts") };
        for (restored, counted) in ticks.left.iter().zip(&whole) {
            // 250 counts a row at full speed; a corner of the ramp bends the speed by 12 counts a row at the
            // most.
            assert!((restored - counted).abs() <= 12, "{restored} for {counted}");
        }
    }

    #[test]
    fn a_gap_over_which_the_counters_went_on_is_left_alone() {
        let (record, whole) = odometry(&[9, 30, 31, 50], false);
        let mut run = Run { odometry: record, ..Run::default() };
        assert_eq!(fill(&mut run).lost, 0);
        assert_eq!(run.odometry.wheels, WheelLog::Ticks(Wheels { left: whole.clone(), right: whole }));
    }
}
