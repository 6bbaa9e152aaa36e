//! The regular beat behind the irregular stamps of a log.

/// Rows from which a beat is found: the line through so many is off by a twentieth of what stamps jitter by,
/// a beat.
const MIN_ROWS: usize = 24;
/// Rows after which a row counts for the beat by a part e less: a log's clock need not keep one beat all day.
const FORGETTING_ROWS: f64 = 500.0;
/// Stamps that jitter by a third of the beat make a gap of one beat as long as this many, and no longer; with
/// a row lost in it, hardly one as short.
const MAX_ONE_PERIOD: f64 = 1.7;
/// Nor as short as this: such a row came by itself, at a standstill.
const MIN_ONE_PERIOD: f64 = 0.3;
/// A row that is farther from its beat than this share of it has missed it.
const MISSED_PHASE: f64 = 0.45;
/// After so many in a row the log keeps another beat.
const MAX_MISSED: u32 = 3;

/// The beat of a run's rows: a line through their times over the numbers of their beats.
#[derive(Debug, Clone, Default)]
pub(crate) struct SamplingPeriodEstimator {
    /// Times of the rows from which the beat is yet to be found.
    first_s: Vec<f64>,
    /// Of the rows of the beat: weight, means of number and time, and sums of squares and products about
    /// them.
    rows: f64,
    mean: [f64; 2],
    square: f64,
    product: f64,
    /// The number of the last.
    last: f64,
    /// Rows since the last that kept to the beat.
    missed: u32,
    /// How late the last row was by its beat, or the last before it that had one; 0 before any had.
    pub(crate) late_s: f64,
}

impl SamplingPeriodEstimator {
    /// When beat 0 is and the time between two beats, where that is known.
    fn line(&self) -> Option<(f64, f64)> {
        (self.square > 0.0).then(|| {
            let between_s = self.product / self.square;
            (self.mean[1] - between_s * self.mean[0], between_s)
        })
    }

    /// Takes a row of the beat, by Welford's recursion.
    fn add(&mut self, sampling_period: f64, time_s: f64) {
        self.last = sampling_period;
        let keeps = 1.0 - 1.0 / FORGETTING_ROWS;
        self.rows = keeps * self.rows + 1.0;
        let off = [sampling_period - self.mean[0], time_s - self.mean[1]];
        for (mean, off) in self.mean.iter_mut().zip(off) {
            *mean += off / self.rows;
        }
        self.square = keeps * self.square + off[0] * (sampling_period - self.mean[0]);
        self.product = keeps * self.product + off[0] * (time_s - self.mean[1]);
    }

    /// Takes a row before anything is known of the beat. Once there are enough of them, their gaps are so
    /// many times the middle one.
    fn warm_up(&mut self, from_s: f64, row_s: f64) {
        if self.first_s.is_empty() {
            self.first_s.push(from_s);
        }
        self.first_s.push(row_s);
        if self.first_s.len() <= MIN_ROWS {
            return;
        }
        let rows_s = std::mem::take(&mut self.first_s);
        let mut gaps_s: Vec<f64> = rows_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        gaps_s.sort_by(f64::total_cmp);
        let between_s = gaps_s[gaps_s.len() / 2];
        let (mut sampling_period, mut last_s) = (0.0, rows_s[0]);
        self.add(sampling_period, last_s);
        for &row_s in &rows_s[1..] {
            let gap = (row_s - last_s) / between_s;
            if gap > MIN_ONE_PERIOD {
                sampling_period += if gap < MAX_ONE_PERIOD { 1.0 } else { gap.round() };
                last_s = row_s;
                self.add(sampling_period, row_s);
            }
        }
        self.late_s = self.line().map_or(0.0, |(zero_s, between_s)| last_s - zero_s - sampling_period * between_s);
    }

    /// Takes the row that ends an interval: how late it is.
    pub(crate) fn next_row(&mut self, from_s: f64, row_s: f64) {
        let Some((zero_s, between_s)) = self.line() else {
            self.warm_up(from_s, row_s);
            return;
        };
        let sampling_period = ((row_s - zero_s) / between_s).round();
        if sampling_period <= self.last {
            return; // It came by itself, at a standstill.
        }
        let late_s = row_s - zero_s - sampling_period * between_s;
        if late_s.abs() > MISSED_PHASE * between_s {
            self.missed += 1;
            if self.missed >= MAX_MISSED {
                *self = Self { late_s: self.late_s, ..Self::default() };
            }
            return;
        }
        self.missed = 0;
        self.late_s = late_s;
        self.add(sampling_period, row_s);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Address, StreamName};

    #[test]
    fn a_jitter_of_a_third_of_the_beat_is_late_and_early_alike() {
        let (between_s, jitter_s, rows) = (0.025, 0.008, 2000_u32);
        for seed in 0..50 {
            let mut stream = Address { seed, point: 0, trial: 0, run: 0 }.stream(StreamName::new("test"));
            let mut stamp_s = |row: u32| between_s * f64::from(row) + stream.uniform_about_zero(jitter_s);
            let mut sampling_period = SamplingPeriodEstimator::default();
            let (mut before_s, mut square) = (stamp_s(0), 0.0);
            for row in 1..rows {
                let row_s = stamp_s(row).max(before_s + 1e-3);
                sampling_period.next_row(before_s, row_s);
                square += sampling_period.late_s * sampling_period.late_s;
                // Never later than a row can be: 8 ms either way, and what the line through the first rows
                // does not know of the beat.
                assert!(sampling_period.late_s.abs() < between_s, "seed {seed} row {row}: {}", sampling_period.late_s);
                before_s = row_s;
            }
            // A uniform error.
            let expected = jitter_s * jitter_s / 3.0;
            let seen = square / f64::from(rows);
            assert!((0.8..1.2).contains(&(seen / expected)), "seed {seed}: {}", seen / expected);
        }
    }
}
