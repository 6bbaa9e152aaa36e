//! `torn_read`: a count of several bytes is read while it changes.
//!
//! Model: with some probability one counter of a row is off by ± one step of the byte that was torn: 2⁸ or
//! 2¹⁶.
//! Signature: a jump in one sample that is undone in the next. A gross fault, tried before any fit: the
//! records without it have such samples put back.
//! Observability: the record itself.
//! Alias: none.
//! Reference: the HCTL-1100's position is three bytes; a counter of 16 or 32 bits behind an 8-bit bus is
//! alike.

use dataset::{Dataset, WheelLog, median};
use kinematics::{Side, Wheels};
use serde::{Deserialize, Serialize};

use crate::benchmark::Benchmark;
use crate::description::Description;
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, Readout};
use crate::hypothesis::{Hypothesis, RecordCorrection, median_of_few, value_of};
use crate::on_board::OnBoard;
use crate::settings::{COUNTER_FAULTS, NEIGHBOUR_ROWS};
use crate::stream::Stream;

/// Steps of torn bytes, counts.
const TORN_STEPS_COUNTS: [i64; 2] = [1 << 8, 1 << 16];

/// Torn reads.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TornRead {
    /// Probability that a counter is torn in a row.
    pub probability: f64,
    /// By how much it is then off, counts: 256 or 65536.
    pub jump_counts: u32,
}

impl PhysicalEffect for TornRead {
    fn check(&self) -> Result<(), EffectError> {
        let (id, probability) = ("torn_read", self.probability);
        EffectError::unless((0.0..=1.0).contains(&probability), id, "probability", probability, "from 0 to 1")?;
        let holds = TORN_STEPS_COUNTS.contains(&i64::from(self.jump_counts));
        EffectError::unless(holds, id, "jump_counts", f64::from(self.jump_counts), "256 or 65536")
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { effect: *self, stream: None }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Records(corrections)
    }

    fn description() -> Description {
        Description {
            benchmark: Benchmark::of_fault(|_, stream| {
                vec![
                    ("probability", stream.uniform_in(0.005, 0.02)),
                    ("jump_counts", [256.0, 65_536.0][stream.below(2)]),
                ]
            }),
            on_board: OnBoard::Never("what is torn shows in the readings after it alone"),
            ..Description::of("a count of several bytes is read while it changes")
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        let jump_counts = value_of(values, "jump_counts")? as u32;
        Some(Self { probability: value_of(values, "probability")?, jump_counts })
    }
}

struct State {
    effect: TornRead,
    stream: Option<Stream>,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { seed_run: true, readout: true, ..Hooks::NONE }
    }

    fn seed_run(&mut self, stream: Stream) {
        self.stream = Some(stream);
    }

    fn readout(&mut self, readout: &mut Readout) {
        let Some(stream) = &mut self.stream else { return };
        for side in Side::BOTH {
            let (uniform, sense) = (stream.uniform(), stream.uniform());
            if uniform < self.effect.probability {
                let jump = i64::from(self.effect.jump_counts);
                readout.ticks[side] += if sense < 0.5 { jump } else { -jump };
            }
        }
    }
}

/// Puts back the samples of a column that are outlying jumps, and says how many these were. Increments that
/// are usually an eighth of a jump out of line with their neighbours, and jumps that are not undone, are none
/// of this fault.
fn mend(t_s: &[f64], ticks: &mut [i64], jump: i64) -> Restored {
    let (step, as_read) = (jump as f64, ticks.to_vec());
    let increment = |k: usize| (ticks[k + 1] - ticks[k]) as f64;
    let last = ticks.len().saturating_sub(1);
    let out_of_line = |k: usize| {
        let near = k.saturating_sub(NEIGHBOUR_ROWS)..(k + NEIGHBOUR_ROWS + 1).min(last);
        let rates = near.map(|near| increment(near) / (t_s[near + 1] - t_s[near]));
        let rate = median_of_few::<{ 2 * NEIGHBOUR_ROWS + 1 }>(rates).unwrap_or(0.0);
        increment(k) - rate * (t_s[k + 1] - t_s[k])
    };
    let all: Vec<f64> = (0..last).map(out_of_line).collect();
    // Of rows in motion: a wheel that stands is in line whatever the log is like.
    let usual = median(all.iter().map(|off| off.abs()).filter(|off| *off > 0.0)).unwrap_or(0.0);
    if usual > step / 8.0 {
        return Restored::default();
    }
    let jumps: Vec<f64> = all
        .iter()
        .map(|off| {
            let jumps = (off / step).round();
            if (off - jumps * step).abs() < step / 4.0 { jumps } else { 0.0 }
        })
        .collect();
    let mut restored = 0;
    let mut misses = Vec::new();
    let (mut at, mut used, mut first_used) = (0, 0, false);
    while at < last {
        // A wheel that starts or stops is out of line as well, but what a tear does is undone a row or two
        // later.
        let Some(back) = undone(&jumps[at..]) else {
            at += 1;
            continue;
        };
        // A wheel that speeds up and slows down again is out of line to one side and then to the other, and
        // goes smoothly.
        let jumps = &jumps[at..=at + back];
        if !smooths(ticks, at, jumps, jump) {
            at += 1;
            continue;
        }
        first_used |= at == 0;
        misses.extend(all[at..].iter().zip(jumps).map(|(off, jumps)| (off - jumps * step).abs()));
        restored += put_back(&mut ticks[at + 1..], jumps, jump);
        at += back + 1;
        used = at;
    }
    // A byte that is torn leaves just its step; what jumps by about as much is something else.
    if median(misses)
        .is_some_and(|miss| miss > COUNTER_FAULTS.max_miss_ratio * usual.max(COUNTER_FAULTS.min_miss_counts))
    {
        ticks.copy_from_slice(&as_read);
        return Restored::default();
    }
    // Of a log that has torn samples, the first and the last may be torn too; nothing comes before or after
    // to undo them.
    if restored > 0 {
        let ends = [(0, -jumps[0], !first_used), (last, jumps[last - 1], used < last)];
        // A wheel that starts or stops there is on the line through the two increments beside, and not where
        // a tear of its own puts it.
        let rate = |k: usize| (ticks[k + 1] - ticks[k]) as f64 / (t_s[k + 1] - t_s[k]);
        let off_line = |own: usize, next: usize, further: usize| {
            (rate(own) - 2.0 * rate(next) + rate(further)) * (t_s[own + 1] - t_s[own])
        };
        let off_lines = if last < 3 { [0.0; 2] } else { [-off_line(0, 1, 2), off_line(last - 1, last - 2, last - 3)] };
        for ((row, outlying, free), off_line) in ends.into_iter().zip(off_lines) {
            if free && outlying.abs() == 1.0 && (off_line - outlying * step).abs() < step / 4.0 {
                let off = outlying as i64;
                ticks[row] -= off * jump;
                restored += 1;
            }
        }
    }
    Restored { samples: restored, clear: if usual < step / COUNTER_FAULTS.clear_jump_ratio { restored } else { 0 } }
}

/// Samples put back.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Restored {
    samples: usize,
    /// Those of columns in which nothing else looks like a jump.
    clear: usize,
}

/// Takes the sum of the jumps so far off each count, and says how many were outlying.
fn put_back(ticks: &mut [i64], jumps: &[f64], jump: i64) -> usize {
    let (mut outlying, mut restored) = (0.0, 0);
    for (count, jumps) in ticks.iter_mut().zip(jumps) {
        outlying += jumps;
        let off = outlying as i64;
        *count -= off * jump;
        restored += usize::from(off != 0);
    }
    restored
}

/// Whether counts go more smoothly without jumps from one row on: a tear bends them by four jumps, of which
/// two are gone where another tear is beside it, and what is none is bent by as many.
fn smooths(ticks: &[i64], at: usize, jumps: &[f64], jump: i64) -> bool {
    let from = at.saturating_sub(1);
    let near = &ticks[from..(at + jumps.len() + 2).min(ticks.len())];
    let roughness = |ticks: &[i64]| -> i64 { ticks.windows(3).map(|of| (of[2] - 2 * of[1] + of[0]).abs()).sum() };
    let mut restored = near.to_vec();
    put_back(&mut restored[at + 1 - from..], jumps, jump);
    roughness(near) - roughness(&restored) >= jump
}

/// After how many rows what begins with a jump of one step is back in line; `None` when it does not begin so,
/// or is not back in time.
fn undone(jumps: &[f64]) -> Option<usize> {
    let mut outlying = *jumps.first()?;
    if outlying.abs() != 1.0 {
        return None;
    }
    for (rows, jumps) in jumps.iter().enumerate().skip(1).take(COUNTER_FAULTS.max_fault_rows) {
        outlying += jumps;
        if outlying == 0.0 {
            return Some(rows);
        }
        if outlying.abs() > 1.0 {
            break;
        }
    }
    None
}

fn corrections(dataset: &Dataset) -> Vec<RecordCorrection> {
    let without = |jump: i64| {
        let (mut restored, mut clear, mut samples) = (0, 0, 0);
        let mut records = dataset.clone();
        for run in &mut records.runs {
            if let WheelLog::Ticks(Wheels { left, right }) = &mut run.odometry.wheels {
                samples += left.len() + right.len();
                for column in [left, right] {
                    let found = mend(&run.odometry.t_s, column, jump);
                    restored += found.samples;
                    clear += found.clear;
                }
            }
        }
        (restored > 0).then(|| RecordCorrection {
            values: vec![("probability", restored as f64 / samples as f64), ("jump_counts", jump as f64)],
            sentence: format!("{restored} counts were torn while they were read, off by {jump}"),
            visible_in_log: clear >= COUNTER_FAULTS.min_visible_faults,
            mistakes: 1,
            records,
        })
    };
    TORN_STEPS_COUNTS.into_iter().filter_map(without).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jumps_of_about_a_byte_s_step_are_no_torn_byte() {
        let t_s: Vec<f64> = (0..1500).map(|row| 0.02 * f64::from(row)).collect();
        let whole: Vec<i64> = (0..1500).map(|row| 46 * row).collect();
        let rows = [1100, 1150, 1200, 1250, 1300, 1350, 1400, 1450];
        let mended = |jump: fn(i64) -> i64| {
            let mut ticks = whole.clone();
            rows.into_iter().for_each(|row: usize| ticks[row] += jump(ticks[row]));
            (mend(&t_s, &mut ticks, 1 << 16), ticks)
        };
        let (restored, ticks) = mended(|_| 1 << 16);
        assert_eq!((restored.samples, restored.clear, ticks), (8, 8, whole.clone()));
        // Counts of 50,600 to 66,700 that read zero, within a quarter of 2¹⁶. Rejects that quarter alone.
        let (restored, ticks) = mended(|count| -count);
        assert_eq!(restored, Restored::default());
        assert!(rows.into_iter().all(|row: usize| ticks[row] == 0), "they stay as they were read");
    }

    /// A robot that mostly stands, and whose speed ripples by a hundred counts a row where it drives: some
    /// ripple is like a torn byte that is undone at once.
    #[test]
    fn regress_what_rows_in_motion_are_out_of_line_by_is_not_told_by_standing_ones() {
        let t_s: Vec<f64> = (0..900).map(|row| 0.1 * f64::from(row)).collect();
        let speed = |row: usize| match row % 60 {
            9 => 5043,
            10 => 5525,
            driving @ 0..20 => [5300, 5400, 5210, 5350][driving % 4],
            _ => 0,
        };
        let mut ticks: Vec<i64> = vec![0];
        (0..899).for_each(|row| ticks.push(ticks[row] + speed(row)));
        let as_read = ticks.clone();
        assert_eq!(mend(&t_s, &mut ticks, 256), Restored::default());
        assert_eq!(ticks, as_read);
        // One that stands as long, and drives evenly.
        let mut ticks: Vec<i64> = vec![0];
        (0..899).for_each(|row| ticks.push(ticks[row] + if row % 60 < 20 { 400 } else { 0 }));
        let whole = ticks.clone();
        [10, 130, 250].into_iter().for_each(|row: usize| ticks[row] += 256);
        assert_eq!((mend(&t_s, &mut ticks, 256).samples, ticks), (3, whole));
    }
}
