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
/// Counts that what both wheels show, over a row or a gap, may be off by as they are rounded: one of each.
const MAX_ROUNDING: f64 = 2.0;
/// Rows to either side of a gap that say how fast the wheels turned: their rounding is a third of a row's.
const ROWS_AROUND: usize = 3;
/// Where so many times as many gaps lost counts as did not, all did: those that did not are mistakes.
const ALL_LOST_RATIO: usize = 4;
/// With so many gaps that lost counts, the log itself shows the fault.
const MIN_VISIBLE_FAULTS: usize = 3;
/// Share of the gaps that are taken for such that lost their counts and did not, at the most: four times what
/// logs show whose counters go on.
const MAX_MISJUDGED_SHARE: f64 = 0.1;
/// Share of the pairs of successive measurements that gaps may spoil for the rest to be enough.
const MAX_SPOILED_PAIRS: f64 = 0.5;

/// What the gaps of some runs say.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Missing {
    /// Gaps over which a moving robot lost counts.
    lost: usize,
    /// Gaps over which it did not.
    kept: usize,
    /// The numbers of the rows are not certain.
    uncertain: bool,
    /// Rows wait for each other: a gap may be one that was held up.
    is_bunched: bool,
}

/// What gaps did that are too short to tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ShortGaps {
    /// They lost their counts, as nearly all did that tell.
    Lost,
    /// Some did and some did not: what is likelier counts, but nothing can be compared across them.
    Either,
    /// They may be no gaps at all: what they show counts, but nothing can be compared across them.
    Unknown,
    /// They kept them.
    AsTheyAre,
}

impl Missing {
    /// Whether more gaps lost their counts than are misjudged.
    fn some_lost(&self) -> bool {
        self.lost as f64 > MAX_MISJUDGED_SHARE * (self.lost + self.kept) as f64
    }

    /// Whether the log itself shows the fault.
    fn is_visible(&self) -> bool {
        self.lost >= MIN_VISIBLE_FAULTS && self.some_lost() && !self.uncertain
    }

    fn short_gaps(&self) -> ShortGaps {
        if !self.some_lost() {
            ShortGaps::AsTheyAre
        } else if self.uncertain || self.is_bunched {
            // Where numbers of rows are wrong, or a row was held up, one that does not tell may be none.
            ShortGaps::Unknown
        } else if self.lost > ALL_LOST_RATIO * self.kept {
            ShortGaps::Lost
        } else {
            ShortGaps::Either
        }
    }
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

/// A gap of some rows.
#[derive(Debug, Clone, Copy)]
struct Gap {
    /// The row before it.
    row: usize,
    /// Rows that are missing.
    missing: f64,
    /// Counts that it lacks of those due at the speed of the rows before and after it together: exactly so
    /// where the acceleration is constant; the row after it shows less.
    lacks: Wheels<f64>,
    /// Whether they were lost; `None` where its counts do not tell.
    is_lost: Option<bool>,
    /// Whether it shows less than halfway between one row's counts and those of all its rows.
    likely_lost: bool,
}

/// A row beside a gap.
#[derive(Debug, Clone, Copy)]
struct Beside {
    counts: Wheels<f64>,
    length_s: f64,
}

/// Whether the counts of a gap of so many rows were lost, by what both wheels show over it and what each
/// shows in the row before it and in that after it: `None` where that does not tell, and what is likelier.
///
/// Speeds in the gap lie between those beside it; where a wheel started, stopped or turned round, it may have
/// stood. If counts were lost, the gap shows one row's at such a speed, if not, those of all its rows. Where
/// stamps jitter, rows may be of the same length or as long as they say.
fn is_lost(rows: f64, length_s: f64, shown: f64, beside: [Beside; 2]) -> (Option<bool>, bool) {
    let row_s = length_s / rows;
    let as_long_as_said = beside.map(|row| row.counts.map(|counts| counts * row_s / row.length_s));
    // Counts of a row at the least and at the greatest speed.
    let range = |[before, after]: [Wheels<f64>; 2]| {
        Side::BOTH.into_iter().fold((0.0, 0.0), |(least, most), side| {
            let [before, after] = [before[side], after[side]];
            let of_side = if before * after > 0.0 { before.abs().min(after.abs()) } else { 0.0 };
            (least + of_side, most + before.abs().max(after.abs()))
        })
    };
    let (evenly, said) = (range(beside.map(|row| row.counts)), range(as_long_as_said));
    let (least, most) = (f64::min(evenly.0, said.0), f64::max(evenly.1, said.1));
    let [can_be_kept, can_be_lost] = [
        shown + MAX_ROUNDING >= rows * (least - MAX_ROUNDING),
        shown - MAX_ROUNDING <= most + MAX_ROUNDING,
    ];
    let likely_lost = shown < 0.25 * (1.0 + rows) * (least + most);
    let is_lost = match (can_be_kept, can_be_lost) {
        (true, true) => None,
        (false, false) => Some(likely_lost),
        (_, lost) => Some(lost),
    };
    (is_lost, likely_lost)
}

/// The gaps of a run over which its wheels turned, and what they say of missing rows.
fn gaps(run: &Run) -> (Vec<Gap>, Missing) {
    let mut missing = Missing::default();
    let Odometry { t_s, wheels: WheelLog::Ticks(ticks), .. } = &run.odometry else { return (Vec::new(), missing) };
    let Some((rows, uncertain)) = rows_after(t_s) else { return (Vec::new(), missing) };
    missing.uncertain = uncertain;
    missing.is_bunched = t_s.sampling_period().is_some_and(|period| period.is_bunched);
    let shown =
        ticks.as_ref().map(|column| column.windows(2).map(|pair| (pair[1] - pair[0]) as f64).collect::<Vec<_>>());
    let is_row = |k: &usize| rows[*k] == 1.0;
    let mut found = Vec::new();
    for (k, &of_gap) in rows.iter().enumerate().filter(|(_, of_gap)| **of_gap > 1.0) {
        let before: Vec<usize> = (0..k).rev().filter(is_row).take(ROWS_AROUND).collect();
        let after: Vec<usize> = (k + 1..rows.len()).filter(is_row).take(ROWS_AROUND).collect();
        let of_each = match before.len().min(after.len()) {
            0 => ROWS_AROUND,
            of_each => of_each,
        };
        let sides = [&before[..of_each.min(before.len())], &after[..of_each.min(after.len())]];
        let around: Vec<usize> = sides.concat();
        let time_s: f64 = around.iter().map(|near| t_s[near + 1] - t_s[*near]).sum();
        let counts_of = |rows: &[usize]| {
            Wheels::from_sides(|side| rows.iter().map(|near| shown[side][*near]).sum::<f64>())
        };
        // Counts of the gap at the speed around it, and of a row to either side of it.
        let due = counts_of(&around).map(|counts| match time_s > 0.0 {
            true => counts / time_s * (t_s[k + 1] - t_s[k]),
            false => 0.0,
        });
        let shown_of_both = shown.left[k].abs() + shown.right[k].abs();
        if due == Wheels::both(0.0) && shown_of_both == 0.0 {
            continue;
        }
        let beside = |row: &usize| Beside {
            counts: Wheels::from_sides(|side| shown[side][*row]),
            length_s: t_s[row + 1] - t_s[*row],
        };
        let (is_lost, likely_lost) = match (before.first(), after.first()) {
            (Some(before), Some(after)) => {
                is_lost(of_gap, t_s[k + 1] - t_s[k], shown_of_both, [before, after].map(beside))
            }
            _ => (None, false),
        };
        match is_lost {
            Some(true) => missing.lost += 1,
            Some(false) => missing.kept += 1,
            None => {}
        }
        let lacks = Wheels::from_sides(|side| due[side] - shown[side][k]);
        found.push(Gap { row: k, missing: of_gap.round() - 1.0, lacks, is_lost, likely_lost });
    }
    (found, missing)
}

/// Carries the counts of gaps on that lost them, and says how many rows were missing. At low speeds no gap
/// tells, and counts that stayed lost there alone would be an effect of starts and stops.
fn fill(run: &mut Run, gaps: &[Gap], short: ShortGaps) -> f64 {
    let WheelLog::Ticks(ticks) = &mut run.odometry.wheels else { return 0.0 };
    let (mut lost, mut spans, mut missing) = (Wheels::both(0.0), Vec::new(), 0.0);
    let mut next = gaps.iter().peekable();
    for k in 0..ticks.left.len().saturating_sub(1) {
        if let Some(gap) = next.next_if(|gap| gap.row == k) {
            let untold = match short {
                ShortGaps::Lost => true,
                ShortGaps::Either => gap.likely_lost,
                ShortGaps::Unknown | ShortGaps::AsTheyAre => false,
            };
            if gap.is_lost.unwrap_or(untold) {
                lost = lost.zip_with(gap.lacks, |lost, lacks| lost + lacks);
                missing += gap.missing;
            }
            if short == ShortGaps::Lost || gap.is_lost.unwrap_or(short != ShortGaps::AsTheyAre) {
                spans.push(UnknownMotion { from_s: run.odometry.t_s[k], to_s: run.odometry.t_s[k + 1] });
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
    let of_runs: Vec<(Vec<Gap>, Missing)> = dataset.runs.iter().map(gaps).collect();
    let mut missing = Missing::default();
    for (_, of_run) in &of_runs {
        missing.lost += of_run.lost;
        missing.kept += of_run.kept;
        missing.uncertain |= of_run.uncertain;
        missing.is_bunched |= of_run.is_bunched;
    }
    if missing.lost == 0 {
        return Vec::new();
    }
    let mut records = dataset.clone();
    let short = missing.short_gaps();
    let (mut missing_rows, mut rows) = (0.0, 0.0);
    for (run, (gaps, _)) in records.runs.iter_mut().zip(&of_runs) {
        missing_rows += fill(run, gaps, short);
        rows += run.odometry.t_s.len() as f64;
    }
    if spoiled_pairs(&records.runs) > MAX_SPOILED_PAIRS {
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
        assert_eq!((fill(&mut as_most, &gaps, ShortGaps::Lost), fill(&mut alone, &gaps, ShortGaps::AsTheyAre)), (2.0, 1.0));
        assert_eq!(as_most.odometry.wheels, WheelLog::Ticks(Wheels { left: whole.clone(), right: whole.clone() }));
        assert!(as_most.is_motion_unknown(0.96, 1.04) && !alone.is_motion_unknown(0.96, 1.04));
        let WheelLog::Ticks(ticks) = &alone.odometry.wheels else { panic!("counts") };
        assert_eq!(whole.last().copied().zip(ticks.left.last().copied()).map(|(of, is)| of - is), Some(1));
    }

    /// Where some gaps lost their counts and some did not, as where a link loses rows and a counter increments:
    /// the log shows the fault however many did not.
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
        assert!(missing.is_visible());
    }
}
