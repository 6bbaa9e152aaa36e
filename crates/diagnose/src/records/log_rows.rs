//! What the records show before any model: outlying rows, and clocks that do not count the same time.
//!
//! A wheel that turns steadily before and after a row turned as fast in between. The speeds of two rows
//! before an increment and of two after it have the range R; the next row is left out, as it may give back
//! what was outlying. If the increment were as uncertain as these four, it would be 20 R off with
//! probability 1.6e-5: P(R < r) ≈ 4 r³ ∫φ⁴ = 0.13 r³ for four normal variables.

use std::collections::BTreeMap;

use dataset::{Dataset, Odometry, Run, RunSpans, WheelLog, median};
use estimation::stamp_jitter_s;
use statrs::distribution::{DiscreteCDF, Poisson};

use crate::checks::check::{Check, TestResult};
use crate::settings::RECORDS;

/// The spans of runs, by session and run.
#[derive(Debug, Clone, Default)]
pub(crate) struct Spans(BTreeMap<(usize, usize), RunSpans>);

impl Spans {
    /// Adds a run, or a part of one.
    pub(crate) fn add(&mut self, run: (usize, usize), spans: RunSpans) {
        let known = self.0.entry(run).or_default();
        *known = known.with(spans);
    }

    /// Whether log and measurements span about the same time, by the median over the runs of the ratio of
    /// spans.
    pub(crate) fn test(&self) -> Option<TestResult> {
        let ratio = |of: &RunSpans| of.comparable_s().map(|[logged_s, measured_s]| logged_s / measured_s);
        let statistic = median(self.0.values().filter_map(ratio))?;
        let passes = (RECORDS.max_clock_ratio.recip()..RECORDS.max_clock_ratio).contains(&statistic);
        // No scatter makes a clock thirty times as fast: the p-value is 0 or 1.
        Some(TestResult { check: Check::LogSpans, statistic, p_value: f64::from(u8::from(passes)), passes })
    }
}

/// Tests the spans of all runs.
pub(crate) fn check_spans(datasets: &[Dataset]) -> Option<TestResult> {
    let mut spans = Spans::default();
    for (session, dataset) in datasets.iter().enumerate() {
        for (position, run) in dataset.runs.iter().enumerate() {
            spans.add((session, position), RunSpans::of(run));
        }
    }
    spans.test()
}

/// Number of increments of a log, and of outlying ones.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Rows {
    all: usize,
    outlying: usize,
}

impl std::ops::Add for Rows {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { all: self.all + other.all, outlying: self.outlying + other.outlying }
    }
}

impl Rows {
    /// Of the counts of a run; none for robots that report none.
    pub(crate) fn of(run: &Run) -> Self {
        let Odometry { t_s, wheels: WheelLog::Ticks(ticks), .. } = &run.odometry else { return Self::default() };
        if !run.info.continuous {
            return Self::default();
        }
        let of = ticks.as_ref().map(|column| of_column(t_s, column));
        of.left + of.right
    }

    /// Tests whether more of them are outlying than chance makes; `None` where there are none.
    pub(crate) fn test(&self) -> Option<TestResult> {
        let expected = Poisson::new(RECORDS.outlying_row_probability * self.all as f64).ok()?;
        let p_value = self.outlying.checked_sub(1).map_or(1.0, |fewer| expected.sf(fewer as u64));
        let statistic = self.outlying as f64;
        Some(TestResult { check: Check::LogRows, statistic, p_value, passes: p_value >= RECORDS.log_rows_level })
    }
}

/// Tests the counts of all runs; `None` for robots that report none.
pub(crate) fn check_rows(datasets: &[Dataset]) -> Option<TestResult> {
    let runs = datasets.iter().flat_map(|dataset| &dataset.runs);
    runs.map(Rows::of).fold(Rows::default(), |sum, rows| sum + rows).test()
}

/// Whether a run's log has outlying rows: turns over them are none of the robot.
pub(crate) fn has_outlying_rows(run: &Run) -> bool {
    Rows::of(run).outlying > 0
}

fn of_column(t_s: &[f64], ticks: &[i64]) -> Rows {
    let mut rows = Rows::default();
    // Counts of a row are as uncertain as the stamps at both of its ends make them.
    let apart_s = std::f64::consts::SQRT_2 * stamp_jitter_s(t_s);
    let rates: Vec<(f64, f64)> = t_s
        .windows(2)
        .zip(ticks.windows(2))
        .map(|(t_s, ticks)| (t_s[1] - t_s[0], (ticks[1] - ticks[0]) as f64))
        .map(|(dt_s, counts)| (dt_s, counts / dt_s))
        .collect();
    for (first, window) in rates.windows(6).enumerate() {
        let (dt_s, rate) = window[2];
        let around = [window[0].1, window[1].1, window[4].1, window[5].1];
        let mean = around.iter().sum::<f64>() / 4.0;
        let (least, most) =
            around.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), rate| (a.min(*rate), b.max(*rate)));
        rows.all += 1;
        let uncertain = ((most - least) * dt_s).max(RECORDS.count_rounding).max(mean.abs() * apart_s);
        let is_standing = rate.abs() < RECORDS.standstill_rate_ratio * mean.abs() || mean == 0.0;
        let is_outlying = !is_standing && ((rate - mean) * dt_s).abs() > RECORDS.outlying_row_ranges * uncertain;
        if is_outlying && !recurs(&rates, first + 2, mean) {
            rows.outlying += 1;
        }
    }
    rows
}

/// Is an increment as far off a mean rate as another one nearby is? A wheel whose speed has a ripple of four
/// or five rows goes off alike each time, and rows two and three away are all of another phase. The next
/// increment gives back what was outlying.
fn recurs(rates: &[(f64, f64)], row: usize, mean: f64) -> bool {
    let off = rates[row].1 - mean;
    let before = row.saturating_sub(RECORDS.recurrence_rows)..row;
    let after = row + 2..(row + RECORDS.recurrence_rows + 2).min(rates.len());
    before.chain(after).any(|other| (rates[other].1 - mean) * off.signum() > 0.5 * off.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A robot that starts, cruises, stops for two rows, goes on, slows down, in rows of 20 ms that jitter.
    fn column(jitter_s: f64) -> (Vec<f64>, Vec<i64>) {
        let stamp_s = |row: i32| 0.02 * f64::from(row) + jitter_s * (2.4 * f64::from(row)).sin();
        let speed = |t_s: f64| {
            let stopped = (3.0..3.04).contains(&t_s);
            if stopped { 0.0 } else { 30_000.0 * (t_s - 0.5).clamp(0.0, 1.0).min((7.0 - t_s).clamp(0.0, 1.0)) }
        };
        let (mut distance, mut last_s) = (0.0, 0.0);
        let row = |row| {
            let t_s = stamp_s(row);
            distance += speed(0.5 * (t_s + last_s)) * (t_s - last_s);
            last_s = t_s;
            let counts = f64::round(distance) as i64;
            (t_s, counts)
        };
        (0..400).map(row).unzip()
    }

    #[test]
    fn a_sound_log_has_no_outlying_rows() {
        for jitter_s in [0.0, 1e-3, 5e-3, 9e-3] {
            let (t_s, ticks) = column(jitter_s);
            assert_eq!(of_column(&t_s, &ticks), Rows { all: 394, outlying: 0 }, "{jitter_s}");
        }
    }

    #[test]
    fn a_ripple_of_some_rows_is_no_outlying_row() {
        let t_s: Vec<f64> = (0..400).map(|row| 0.05 * f64::from(row)).collect();
        for pattern in [&[1481, 1482, 1527, 1510][..], &[1481, 1481, 1540, 1482, 1481], &[1500, 1620]] {
            let mut sum = 0;
            let mut counted = |row: usize| {
                sum += pattern[row % pattern.len()];
                sum
            };
            let mut ticks: Vec<i64> = (0..400).map(&mut counted).collect();
            assert_eq!(of_column(&t_s, &ticks).outlying, 0, "{pattern:?}");
            if pattern.len() > 2 {
                // On a row in which the ripple is alike around it.
                let row = (0..pattern.len()).find(|row| pattern[*row] > 1520).expect("a peak") + 40 * pattern.len();
                ticks[row] += 4096;
                assert_eq!(of_column(&t_s, &ticks).outlying, 1, "{pattern:?}");
            }
        }
    }

    #[test]
    fn rows_that_are_torn_or_lost_with_their_counts_are_outlying() {
        let (t_s, sound) = column(0.0);
        let mut torn = sound.clone();
        [100, 130, 200].into_iter().for_each(|row: usize| torn[row] += 256);
        assert_eq!(of_column(&t_s, &torn).outlying, 3);
        let (mut t_s, mut lost) = (t_s, sound);
        for row in [220, 130, 100] {
            let counts = lost[row] - lost[row - 1];
            lost[row..].iter_mut().for_each(|count| *count -= counts);
            t_s.remove(row);
            lost.remove(row);
        }
        assert_eq!(of_column(&t_s, &lost).outlying, 3);
        // Counters that went on over the gap are where they should be.
        let (mut t_s, mut sound) = column(0.0);
        for row in [220, 130, 100] {
            t_s.remove(row);
            sound.remove(row);
        }
        assert_eq!(of_column(&t_s, &sound).outlying, 0);
    }
}
