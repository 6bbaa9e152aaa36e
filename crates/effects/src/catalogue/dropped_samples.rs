//! `dropped_samples`: rows are missing, and with them what the wheels did meanwhile.
//!
//! Model: a row is lost with some probability; where the log adds up increments, the counts since the row
//! before are lost with it.
//! Signature: gaps in time over which a moving robot seems to crawl. A gross fault, tried before any fit: the
//! records without it have the counts of each gap carried on from the rows around it, with the variance that
//! these leave. Across a gap that may have lost its counts or not nothing is compared, where measurements are
//! dense enough to spare those.
//! Observability: gaps while the robot moves.
//! Alias: `missed_counts`.
//! Reference: serial links without acknowledgement, full queues.

use dataset::{Dataset, RestoredMotion, Run, UnknownMotion, WheelLog};
use kinematics::{Side, Wheels};
use serde::{Deserialize, Serialize};

mod gaps;

use self::gaps::{Gap, Missing, ShortGaps, gaps};
use crate::benchmark::Benchmark;
use crate::description::{Description, RecordFault};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, Readout};
use crate::hypothesis::{Hypothesis, RecordCorrection, value_of};
use crate::on_board::OnBoard;
use crate::settings::GAPS;
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
            on_board: OnBoard::Never(
                "what the wheels did in a missing interval, later readings and an instrument say alone",
            ),
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

/// Carries the counts of gaps on that lost them, and says how many rows were missing. At low speeds no gap
/// tells, and counts that stayed lost there alone would be an effect of starts and stops.
fn fill(run: &mut Run, gaps: &[Gap], short: ShortGaps) -> f64 {
    let WheelLog::Ticks(ticks) = &mut run.odometry.wheels else { return 0.0 };
    let (mut lost, mut spans, mut restored, mut missing) = (Wheels::both(0.0), Vec::new(), Vec::new(), 0.0);
    let mut next = gaps.iter().peekable();
    for k in 0..ticks.left.len().saturating_sub(1) {
        if let Some(gap) = next.next_if(|gap| gap.row == k) {
            let untold = match short {
                ShortGaps::Lost => true,
                ShortGaps::Either => gap.judgement.likely_lost,
                ShortGaps::Unknown | ShortGaps::AsTheyAre => false,
            };
            let is_lost = gap.judgement.is_lost.unwrap_or(untold);
            if is_lost {
                lost = lost.zip_with(gap.lacks, |lost, lacks| lost + lacks);
                missing += gap.missing;
            }
            let (from_s, to_s) = (run.odometry.t_s[k], run.odometry.t_s[k + 1]);
            // Where all gaps lost their counts, one that seems not to have is a mistake.
            let is_told = match gap.judgement.is_lost {
                Some(is_lost) => is_lost || short != ShortGaps::Lost,
                None => matches!(short, ShortGaps::Lost | ShortGaps::AsTheyAre),
            };
            let is_restored = gap.variance_counts2.left.is_finite() && gap.variance_counts2.right.is_finite();
            if !is_told || (is_lost && !is_restored) {
                spans.push(UnknownMotion { from_s, to_s });
            } else if is_lost {
                restored.push(RestoredMotion { from_s, to_s, variance_counts2: gap.variance_counts2 });
            }
        }
        for side in Side::BOTH {
            ticks[side][k + 1] += lost[side].round() as i64;
        }
    }
    run.add_unknown_motion(spans);
    run.restored_motion = restored;
    missing
}

fn corrections(dataset: &Dataset) -> Vec<RecordCorrection> {
    let of_runs: Vec<(Vec<Gap>, Missing)> = dataset.runs.iter().map(gaps).collect();
    let mut missing = Missing::default();
    for (_, of_run) in &of_runs {
        missing.join(of_run);
    }
    let short = missing.short_gaps();
    if missing.lost == 0 && short != ShortGaps::Lost {
        return Vec::new();
    }
    let mut records = dataset.clone();
    let (mut missing_rows, mut rows) = (0.0, 0.0);
    for (run, (gaps, _)) in records.runs.iter_mut().zip(&of_runs) {
        missing_rows += fill(run, gaps, short);
        rows += run.odometry.t_s.len() as f64;
    }
    if spoiled_pairs(&records.runs) > GAPS.max_spoiled_pairs {
        for (run, recorded) in records.runs.iter_mut().zip(&dataset.runs) {
            run.unknown_motion.clone_from(&recorded.unknown_motion);
        }
    }
    vec![RecordCorrection {
        values: vec![("probability", missing_rows / (missing_rows + rows))],
        sentence: format!("{missing_rows} rows are missing, and their counts with them"),
        visible_in_log: missing.is_visible(),
        mistakes: 1,
        records,
    }]
}

#[cfg(test)]
mod tests {
    use dataset::Odometry;

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
        let (gaps, missing) = gaps(&run);
        assert_eq!((missing.lost, missing.kept), (3, 0));
        assert_eq!(fill(&mut run, &gaps, ShortGaps::Lost), 4.0);
        let WheelLog::Ticks(ticks) = &run.odometry.wheels else { panic!("counts") };
        assert!(run.unknown_motion.is_empty() && run.restored_motion.len() == 3);
        for span in &run.restored_motion {
            let row = run.odometry.t_s.partition_point(|t_s| *t_s < span.to_s);
            let turned = |counts: &[i64]| counts[row] - counts[row - 1];
            let off = (turned(&ticks.left) - turned(&whole)) as f64;
            let sigma = span.variance_counts2.left.sqrt();
            // On the ramp the robot may have gone on at any speed of the rows beside the gap, which differ by
            // 37 counts a row; at full speed nothing but rounding and a little jitter is left.
            assert!(off.abs() < 3.0 * sigma && sigma < if span.to_s < 1.0 { 30.0 } else { 3.0 }, "{off} {sigma}");
        }
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
        let (gaps, missing) = gaps(&run);
        assert_eq!((missing.lost, missing.kept), (0, 3));
        fill(&mut run, &gaps, ShortGaps::AsTheyAre);
        assert_eq!(run.odometry.wheels, WheelLog::Ticks(Wheels { left: whole.clone(), right: whole }));
    }

    /// One count a row, of which no gap tells: what it lost is what those lost that tell.
    #[test]
    fn regress_a_gap_at_low_speed_is_as_those_are_that_tell() {
        let counted = |row: usize| if row < 40 { row as i64 } else { 40 + 20 * (row as i64 - 40) };
        let (mut t_s, mut column, mut whole, mut lost) = (Vec::new(), Vec::new(), Vec::new(), 0);
        for row in 0..80 {
            if row == 20 || row == 60 {
                lost += counted(row) - counted(row - 1);
                continue;
            }
            t_s.push(0.05 * row as f64);
            column.push(counted(row) - lost);
            whole.push(counted(row));
        }
        let wheels = WheelLog::Ticks(Wheels { left: column.clone(), right: column });
        let run = Run { odometry: Odometry { t_s: t_s.into(), wheels, ..Odometry::default() }, ..Run::default() };
        let (gaps, missing) = gaps(&run);
        assert_eq!((gaps.len(), missing.lost, missing.kept), (2, 1, 0));
        let (mut as_most, mut alone) = (run.clone(), run.clone());
        assert_eq!(
            (fill(&mut as_most, &gaps, ShortGaps::Lost), fill(&mut alone, &gaps, ShortGaps::AsTheyAre)),
            (2.0, 1.0)
        );
        assert_eq!(as_most.odometry.wheels, WheelLog::Ticks(Wheels { left: whole.clone(), right: whole.clone() }));
        assert!(as_most.unknown_motion.is_empty() && alone.unknown_motion.is_empty());
        assert_eq!([as_most.restored_motion.len(), alone.restored_motion.len()], [2, 1]);
        let WheelLog::Ticks(ticks) = &alone.odometry.wheels else { panic!("counts") };
        assert_eq!(whole.last().copied().zip(ticks.left.last().copied()).map(|(of, is)| of - is), Some(1));
    }

    /// Where some gaps lost their counts and some did not: the log shows the fault however many did not.
    #[test]
    fn regress_gaps_of_both_kinds_leave_open_what_a_short_one_did() {
        // Ten counts a row from the second second on, one before.
        let counted = |row: usize| if row < 40 { row as i64 } else { 40 + 10 * (row as i64 - 40) };
        let (mut t_s, mut column, mut lost) = (Vec::new(), Vec::new(), 0);
        for row in 0..200 {
            let is_missing = row == 20 || (row > 40 && row % 20 == 10);
            if is_missing {
                lost += if row % 40 == 10 { counted(row) - counted(row - 1) } else { 0 };
                continue;
            }
            t_s.push(0.05 * row as f64);
            column.push(counted(row) - lost);
        }
        let wheels = WheelLog::Ticks(Wheels { left: column.clone(), right: column });
        let run = Run { odometry: Odometry { t_s: t_s.into(), wheels, ..Odometry::default() }, ..Run::default() };
        let (gaps, missing) = gaps(&run);
        assert_eq!((gaps.len(), missing.lost, missing.kept), (9, 4, 4));
        assert_eq!(missing.short_gaps(), ShortGaps::Either);
        let mut restored = run.clone();
        assert_eq!(fill(&mut restored, &gaps, ShortGaps::Either), 4.0);
        assert!(restored.is_motion_unknown(0.96, 1.04), "the short gap");
        assert!(!restored.is_motion_unknown(3.46, 3.54), "one that kept its counts");
        assert!(!restored.is_motion_unknown(2.46, 2.54) && restored.restored_motion.len() == 4, "those that lost them");
        assert!(missing.is_visible());
    }
}
