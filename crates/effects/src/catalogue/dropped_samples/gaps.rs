//! Gaps of a log's rows, and whether the counts of the missing rows were lost with them: gap by gap where the
//! rows beside it tell, by all of the others together where they do not.

use std::ops::Range;

use dataset::{Odometry, Run, Timestamps, WheelLog, median};
use kinematics::{Side, Wheels};

use crate::settings::GAPS;

/// Variance of a difference of two counts that are each rounded, counts².
const ROUNDING_VARIANCE: f64 = 1.0 / 6.0;

/// What the gaps of some runs say.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Missing {
    /// Gaps over which a moving robot lost counts.
    pub(super) lost: usize,
    /// Gaps over which it did not.
    pub(super) kept: usize,
    /// The numbers of the rows are not certain.
    pub(super) uncertain: bool,
    /// Rows wait for each other: a gap may be one that was held up.
    pub(super) is_bunched: bool,
    /// What the gaps that need not tell say together.
    pub(super) lost_share: LostShare,
}

/// Sums over gaps that need not tell by themselves: of what counts each lacks, x, over those of its missing
/// rows, m, the share of these that were lost is its slope, with a standard error of no model.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct LostShare {
    gaps: usize,
    mm: f64,
    mx: f64,
    /// Of m² times x², xm and m².
    scatter: [f64; 3],
}

impl LostShare {
    fn add(&mut self, missing: f64, lacks: f64) {
        let mm = missing * missing;
        self.gaps += 1;
        self.mm += mm;
        self.mx += missing * lacks;
        for (sum, of) in self.scatter.iter_mut().zip([lacks * lacks, missing * lacks, mm]) {
            *sum += mm * of;
        }
    }

    fn join(&mut self, other: &Self) {
        self.gaps += other.gaps;
        self.mm += other.mm;
        self.mx += other.mx;
        for (sum, of) in self.scatter.iter_mut().zip(other.scatter) {
            *sum += of;
        }
    }

    /// Whether they lost their counts; `None` where they are too few to tell, or some did and some did not.
    fn are_lost(&self) -> Option<bool> {
        if self.gaps < GAPS.min_wheels_together || self.mm <= 0.0 {
            return None;
        }
        let share = self.mx / self.mm;
        let [xx, xm, mm] = self.scatter;
        let sigma = (xx - 2.0 * share * xm + share * share * mm).max(0.0).sqrt() / self.mm;
        let is_near = |of: f64| (share - of).abs() + GAPS.together_sigmas * sigma < 0.5;
        if is_near(1.0) {
            Some(true)
        } else if is_near(0.0) {
            Some(false)
        } else {
            None
        }
    }
}

/// What gaps did that are too short to tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ShortGaps {
    /// They lost their counts, as they say together or as nearly all did that tell.
    Lost,
    /// Some did and some did not: what is likelier counts, but nothing can be compared across them.
    Either,
    /// They may be no gaps at all: what they show counts, but nothing can be compared across them.
    Unknown,
    /// They kept them.
    AsTheyAre,
}

impl Missing {
    pub(super) fn join(&mut self, other: &Self) {
        self.lost += other.lost;
        self.kept += other.kept;
        self.uncertain |= other.uncertain;
        self.is_bunched |= other.is_bunched;
        self.lost_share.join(&other.lost_share);
    }

    /// Whether gaps that need not tell lost their counts by what they say together, and those that tell do
    /// not deny it.
    fn all_lost_together(&self) -> bool {
        self.lost_share.are_lost() == Some(true) && self.lost >= self.kept
    }

    /// Whether more gaps lost their counts than are misjudged.
    fn some_lost(&self) -> bool {
        self.lost as f64 > GAPS.max_misjudged_share * (self.lost + self.kept) as f64
    }

    /// Whether the log itself shows the fault.
    pub(super) fn is_visible(&self) -> bool {
        let by_some = self.lost >= GAPS.min_visible_gaps && self.some_lost();
        (by_some || self.all_lost_together()) && !self.uncertain
    }

    pub(super) fn short_gaps(&self) -> ShortGaps {
        if self.all_lost_together() {
            ShortGaps::Lost
        } else if self.lost_share.are_lost() == Some(false) || !self.some_lost() {
            ShortGaps::AsTheyAre
        } else if self.uncertain || self.is_bunched {
            // Where numbers of rows are wrong, or a row was held up, one that does not tell may be none.
            ShortGaps::Unknown
        } else if self.lost > GAPS.all_lost_ratio * self.kept {
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
    let gap_ratio = GAPS.gap_ratio;
    let rows = |length_s: &f64| match length_s / usual_s {
        ratio if ratio > gap_ratio => ratio,
        ratio if ratio * gap_ratio < 1.0 => 0.0,
        _ => 1.0,
    };
    Some((lengths_s.iter().map(rows).collect(), false))
}

/// A gap of some rows.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gap {
    /// The row before it.
    pub(super) row: usize,
    /// Rows that are missing.
    pub(super) missing: f64,
    /// Counts that it lacks of those due at the speed of the rows before and after it together: exactly so
    /// where the acceleration is constant; the row after it shows less.
    pub(super) lacks: Wheels<f64>,
    /// Variance of that, counts².
    pub(super) variance_counts2: Wheels<f64>,
    pub(super) judgement: GapJudgement,
}

/// A row beside a gap.
#[derive(Debug, Clone, Copy)]
struct Beside {
    counts: Wheels<f64>,
    length_s: f64,
}

/// What a gap says of its counts.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct GapJudgement {
    /// Whether they were lost; `None` where they do not tell.
    pub(super) is_lost: Option<bool>,
    /// Whether it shows less than halfway between one row's counts and those of all its rows.
    pub(super) likely_lost: bool,
    /// Whether it tells whatever it shows. All others are judged together: those alone that happen to show
    /// nothing clear would be a choice by what is asked.
    can_tell: bool,
}

/// Whether the counts of a gap of so many rows were lost, by what both wheels show over it and what each
/// shows in the row before it and in that after it: `None` where that does not tell, and what is likelier.
///
/// Speeds in the gap lie between those beside it; where a wheel started, stopped or turned round, it may have
/// stood. If counts were lost, the gap shows one row's at such a speed, if not, those of all its rows. Where
/// stamps jitter, rows may be of the same length or as long as they say.
fn judged(rows: f64, length_s: f64, shown: f64, beside: [Beside; 2]) -> GapJudgement {
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
    // What the gap shows at the least where it kept its counts, and at the most where it lost them.
    let rounding = GAPS.max_rounding_counts;
    let least_kept = rows * (least - rounding) - rounding;
    let most_lost = most + 2.0 * rounding;
    let likely_lost = shown < 0.25 * (1.0 + rows) * (least + most);
    let is_lost = match (shown >= least_kept, shown <= most_lost) {
        (true, true) => None,
        (false, false) => Some(likely_lost),
        (_, lost) => Some(lost),
    };
    GapJudgement { is_lost, likely_lost, can_tell: least_kept > most_lost }
}

/// Variance of what is due over a gap of so many rows of a length, counts², by the rates of the rows before
/// it and after it, those next to it first. They scatter from row to row, in the gap as beside it, and it may
/// have gone at any between those next to it; what their counts' rounding adds to both is taken off, as over
/// several rows it is that of the first and the last alone.
fn variance_of_due(rates: &[Vec<f64>; 2], rows: f64, row_s: f64) -> f64 {
    let [Some(before), Some(after)] = [rates[0].first(), rates[1].first()] else { return f64::INFINITY };
    let (mut squares, mut freedom, mut count) = (0.0, 0.0, 0.0);
    for side in rates {
        let mean = side.iter().sum::<f64>() / side.len() as f64;
        squares += side.iter().map(|rate| (rate - mean).powi(2)).sum::<f64>();
        freedom += side.len() as f64 - 1.0;
        count += side.len() as f64;
    }
    let of_row = if freedom > 0.0 { squares / freedom * row_s * row_s - ROUNDING_VARIANCE } else { 0.0 };
    let between = (row_s * (after - before)).powi(2) - 2.0 * ROUNDING_VARIANCE;
    let of_rounding = ROUNDING_VARIANCE * (1.0 + 2.0 * rows * rows / (count * count));
    rows * of_row.max(0.0) * (1.0 + rows / count) + rows * rows * between.max(0.0) / 12.0 + of_rounding
}

/// Whether a gap is of a row that was received late, with as many rows on its heels as it is too long by: by
/// their numbers some near it came by themselves, but each shows a whole row's counts.
fn holds_rows_up(gap: usize, rows: &[f64], shown: &Wheels<Vec<f64>>) -> bool {
    let counts = |row: usize| shown.left[row].abs() + shown.right[row].abs();
    let are_whole = |near: &Range<usize>| {
        let most = near.clone().map(counts).fold(0.0, f64::max);
        near.clone().all(|row| counts(row) >= GAPS.min_whole_row * most)
    };
    let is_even = |near: &Range<usize>| rows[near.clone()].iter().sum::<f64>() <= near.len() as f64;
    let held_up_rows = GAPS.held_up_rows;
    let ends = gap + 1..=(gap + 1 + held_up_rows).min(rows.len());
    let mut near = ends.flat_map(|end| (gap.saturating_sub(held_up_rows)..=gap).rev().map(move |first| first..end));
    near.any(|near| is_even(&near) && are_whole(&near))
}

/// The gaps of a run over which its wheels turned, and what they say of missing rows.
pub(super) fn gaps(run: &Run) -> (Vec<Gap>, Missing) {
    let (mut missing, rows_around) = (Missing::default(), GAPS.rows_around);
    let Odometry { t_s, wheels: WheelLog::Ticks(ticks), .. } = &run.odometry else { return (Vec::new(), missing) };
    let Some((rows, uncertain)) = rows_after(t_s) else { return (Vec::new(), missing) };
    missing.uncertain = uncertain;
    missing.is_bunched = t_s.sampling_period().is_some_and(|period| period.is_bunched);
    let shown =
        ticks.as_ref().map(|column| column.windows(2).map(|pair| (pair[1] - pair[0]) as f64).collect::<Vec<_>>());
    let is_row = |k: &usize| rows[*k] == 1.0;
    let mut found = Vec::new();
    for (k, &of_gap) in rows.iter().enumerate().filter(|(_, of_gap)| **of_gap > 1.0) {
        let before: Vec<usize> = (0..k).rev().filter(is_row).take(rows_around).collect();
        let after: Vec<usize> = (k + 1..rows.len()).filter(is_row).take(rows_around).collect();
        let of_each = match before.len().min(after.len()) {
            0 => rows_around,
            of_each => of_each,
        };
        let sides = [&before[..of_each.min(before.len())], &after[..of_each.min(after.len())]];
        let around: Vec<usize> = sides.concat();
        let time_s: f64 = around.iter().map(|near| t_s[near + 1] - t_s[*near]).sum();
        let counts_of =
            |rows: &[usize]| Wheels::from_sides(|side| rows.iter().map(|near| shown[side][*near]).sum::<f64>());
        // Counts of the gap at the speed around it, and of a row to either side of it.
        let due = counts_of(&around).map(|counts| match time_s > 0.0 {
            true => counts / time_s * (t_s[k + 1] - t_s[k]),
            false => 0.0,
        });
        let shown_of_both = shown.left[k].abs() + shown.right[k].abs();
        if due == Wheels::both(0.0) && shown_of_both == 0.0 {
            continue;
        }
        if holds_rows_up(k, &rows, &shown) {
            continue;
        }
        let beside = |row: &usize| Beside {
            counts: Wheels::from_sides(|side| shown[side][*row]),
            length_s: t_s[row + 1] - t_s[*row],
        };
        let judgement = match (before.first(), after.first()) {
            (Some(before), Some(after)) => {
                judged(of_gap, t_s[k + 1] - t_s[k], shown_of_both, [before, after].map(beside))
            }
            _ => GapJudgement::default(),
        };
        let lacks = Wheels::from_sides(|side| due[side] - shown[side][k]);
        match judgement.is_lost {
            Some(true) => missing.lost += 1,
            Some(false) => missing.kept += 1,
            None => {}
        }
        if !judgement.can_tell {
            for side in Side::BOTH {
                missing.lost_share.add(due[side] * (of_gap - 1.0) / of_gap, lacks[side]);
            }
        }
        let variance_counts2 = Wheels::from_sides(|side| {
            let rates = sides.map(|rows| -> Vec<f64> {
                rows.iter().map(|row| shown[side][*row] / (t_s[row + 1] - t_s[*row])).collect()
            });
            variance_of_due(&rates, of_gap, (t_s[k + 1] - t_s[k]) / of_gap)
        });
        found.push(Gap { row: k, missing: of_gap.round() - 1.0, lacks, variance_counts2, judgement });
    }
    (found, missing)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_due_over_a_gap_varies_as_the_rows_beside_it_do() {
        let of = |before: [f64; 3], after: [f64; 3], rows: f64| {
            variance_of_due(&[before.to_vec(), after.to_vec()], rows, 0.1)
        };
        // Ten counts in each row: rounding alone, of both ends, and of both sides' three rows over two.
        let rounding = (1.0 + 8.0 / 36.0) / 6.0;
        assert!((of([100.0; 3], [100.0; 3], 2.0) - rounding).abs() < 1e-12);
        // What whole counts scatter by is no more than that.
        assert!((of([100.0, 110.0, 100.0], [100.0, 100.0, 110.0], 2.0) - rounding).abs() < 0.5);
        // From 10 to 20 counts a row: anything between over two rows, 20²/12.
        let ramp = of([100.0; 3], [200.0; 3], 2.0);
        assert!((ramp - rounding - 4.0 * (100.0 - 1.0 / 3.0) / 12.0).abs() < 1e-9, "{ramp}");
        // Rows of 10, 15 and 5 counts: a variance of 25 over four degrees of freedom.
        let rough = of([100.0, 150.0, 50.0], [100.0, 150.0, 50.0], 2.0);
        assert!((rough - rounding - 2.0 * (25.0 - 1.0 / 6.0) * (1.0 + 2.0 / 6.0)).abs() < 1e-9, "{rough}");
        // Nothing on one side says nothing.
        assert!(variance_of_due(&[vec![100.0], Vec::new()], 2.0, 0.1).is_infinite());
    }

    /// Less than two counts a row: no gap that lost them tells by itself, and all do together.
    #[test]
    fn short_gaps_tell_together_what_none_tells_alone() {
        let run = |loses: fn(usize) -> bool| {
            let (mut t_s, mut column, mut lost) = (Vec::new(), Vec::new(), 0);
            for row in 0..600 {
                // Whose rounding is another one at each gap.
                let counted = |row: usize| (1.7317 * row as f64).floor() as i64;
                if row % 20 == 10 {
                    lost += if loses(row) { counted(row) - counted(row - 1) } else { 0 };
                    continue;
                }
                t_s.push(0.05 * row as f64);
                column.push(counted(row) - lost);
            }
            let wheels = WheelLog::Ticks(Wheels { left: column.clone(), right: column });
            gaps(&Run { odometry: Odometry { t_s: t_s.into(), wheels, ..Odometry::default() }, ..Run::default() }).1
        };
        let (all, none, half) = (run(|_| true), run(|_| false), run(|row| row % 40 == 10));
        assert_eq!([all, none, half].map(|of| of.lost), [0; 3]);
        assert_eq!([all, none, half].map(|of| of.lost_share.gaps), [60; 3], "both wheels of 30 gaps");
        assert_eq!([all, none, half].map(|of| of.lost_share.are_lost()), [Some(true), Some(false), None]);
        assert_eq!(all.short_gaps(), ShortGaps::Lost);
        assert_eq!(none.short_gaps(), ShortGaps::AsTheyAre);
        assert!(all.is_visible() && !none.is_visible() && !half.is_visible());
    }

    /// One of the rows is received 45 ms late, and the next one at once behind it; another is lost with its
    /// counts, and a third one with a row of its own behind it, a third of a row after it.
    #[test]
    fn regress_a_row_that_holds_up_the_next_is_no_lost_one() {
        let (mut t_s, mut ticks, mut count) = (vec![], vec![], 0);
        for row in 0..200 {
            count += 40;
            if row == 100 || row == 150 {
                count -= 40;
                continue;
            }
            let late_s = if row == 50 { 0.045 } else { 0.0 };
            let at_s = 0.03 * f64::from(row) + 1e-3 * f64::from(row * row % 7);
            t_s.push(f64::max(at_s + late_s, t_s.last().map_or(0.0, |before: &f64| before + 1e-4)));
            ticks.push(count);
            if row == 151 {
                t_s.push(at_s + 0.01);
                ticks.push(count + 13);
            }
        }
        let wheels = WheelLog::Ticks(Wheels { left: ticks.clone(), right: ticks });
        let run = Run { odometry: Odometry { t_s: t_s.into(), wheels, ..Odometry::default() }, ..Run::default() };
        let (gaps, missing) = gaps(&run);
        assert_eq!((missing.lost, missing.kept, gaps.len()), (2, 0, 2), "{gaps:?}");
        assert!(gaps.iter().all(|gap| gap.row > 90), "{gaps:?}");
    }
}
