//! The regular beat behind the stamps of a log, and how late each stamp is against it.
//!
//! Drivers read encoders by a timer and stamp them when a scheduler, a bus or a receiver gets to it. Rows
//! have numbers on the beat: one more from row to row, more where rows were lost, none where a row came by
//! itself. A lost row shifts all later stamps against the count of rows for good; a late one shifts itself,
//! and what waited behind it. Times over numbers then have a local line, as a clock need not keep one beat
//! all day, and a stamp is late by what it is above it.

use crate::settings::{BEAT_LINE_ROWS, BEAT_ROUNDS, BEAT_SHIFT_ROWS, MIN_BEAT_ROWS, MIN_ODD_GAP, MIN_SHIFT};

/// How late each stamp is, seconds; 0 where rows are too few to have a beat.
#[must_use]
pub fn lateness_s(t_s: &[f64]) -> Vec<f64> {
    let rows = t_s.len();
    if rows < MIN_BEAT_ROWS {
        return vec![0.0; rows];
    }
    let mut numbers: Vec<f64> = (0..rows).map(|row| row as f64).collect();
    let mut period_s = 0.0;
    for _ in 0..BEAT_ROUNDS {
        let Some(found_s) = period(t_s, &numbers) else { return vec![0.0; rows] };
        period_s = found_s;
        numbers = renumbered(t_s, period_s);
    }
    let half = BEAT_LINE_ROWS;
    // Sums of a window slide along; numbers and times count from the window's first row for precision.
    let mut late_s = Vec::with_capacity(rows);
    let mut sums = Sums::default();
    let (mut from, mut to) = (0, 0);
    for row in 0..rows {
        while to < rows.min(row + half + 1) {
            sums.add(numbers[to], t_s[to] - period_s * numbers[to], 1.0);
            to += 1;
        }
        while from + half < row {
            sums.add(numbers[from], t_s[from] - period_s * numbers[from], -1.0);
            from += 1;
        }
        late_s.push(t_s[row] - period_s * numbers[row] - sums.line_at(numbers[row]));
    }
    late_s
}

/// The time between two beats, seconds: the middle one of all spans of several rows.
fn period(t_s: &[f64], numbers: &[f64]) -> Option<f64> {
    let span = MIN_BEAT_ROWS / 2;
    let of = |(t_s, numbers): (&[f64], &[f64])| (t_s[span] - t_s[0]) / (numbers[span] - numbers[0]).max(1.0);
    let mut periods_s: Vec<f64> = t_s.windows(span + 1).zip(numbers.windows(span + 1)).map(of).collect();
    let middle = periods_s.len() / 2;
    Some(*periods_s.select_nth_unstable_by(middle, f64::total_cmp).1).filter(|period_s| *period_s > 0.0)
}

/// The number of each row on the beat.
fn renumbered(t_s: &[f64], period_s: f64) -> Vec<f64> {
    let mut numbers = vec![0.0];
    for row in 1..t_s.len() {
        let gap = (t_s[row] - t_s[row - 1]) / period_s;
        let next = numbers[row - 1] + 1.0;
        // Lateness is never below that of the promptest rows: these before and after say what the gap holds.
        let lost = if (gap - 1.0).abs() > MIN_ODD_GAP {
            let before = row.saturating_sub(BEAT_SHIFT_ROWS)..row;
            let after = row..(row + BEAT_SHIFT_ROWS).min(t_s.len());
            let promptest = |of: f64, promptest: f64| f64::min(of, promptest);
            let before = before.map(|of| t_s[of] / period_s - numbers[of]).fold(f64::INFINITY, promptest);
            let after = after.map(|of| t_s[of] / period_s - next - (of - row) as f64).fold(f64::INFINITY, promptest);
            // More than half of a beat, by what the promptest of normal stamps differ.
            let shift = after - before;
            if shift.abs() > MIN_SHIFT && shift * (gap - 1.0) > 0.0 { shift.round() } else { 0.0 }
        } else {
            0.0
        };
        numbers.push(next + lost);
    }
    numbers
}

/// Sums of a line through points.
#[derive(Default)]
struct Sums {
    count: f64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
}

impl Sums {
    fn add(&mut self, x: f64, y: f64, times: f64) {
        self.count += times;
        self.x += times * x;
        self.y += times * y;
        self.xx += times * x * x;
        self.xy += times * x * y;
    }

    /// The line at a point; the mean where it has no slope.
    fn line_at(&self, x: f64) -> f64 {
        let (mean_x, mean_y) = (self.x / self.count, self.y / self.count);
        let square = self.xx - self.count * mean_x * mean_x;
        let slope = if square > 0.5 * self.count { (self.xy - self.count * mean_x * mean_y) / square } else { 0.0 };
        mean_y + slope * (x - mean_x)
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    const PERIOD_S: f64 = 0.01;

    /// Root mean square of what lateness is off from what it was, its mean apart, from row 50 on.
    fn off_s(stamps: &[(f64, f64)]) -> f64 {
        let t_s: Vec<f64> = stamps.iter().map(|(t_s, _)| *t_s).collect();
        let found = lateness_s(&t_s);
        let off: Vec<f64> = found.iter().zip(stamps).map(|(found, (_, late_s))| found - late_s).collect();
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        (off.iter().map(|off| (off - mean).powi(2)).sum::<f64>() / off.len() as f64).sqrt()
    }

    /// Rows of which some are lost, late by draws; in order.
    fn stamps(rows: u32, lost: f64, mut late_s: impl FnMut(&mut Xoshiro256PlusPlus) -> f64) -> Vec<(f64, f64)> {
        let mut draws = Xoshiro256PlusPlus::seed_from_u64(7);
        let (mut before_s, mut all) = (f64::NEG_INFINITY, Vec::new());
        for row in 0..rows {
            let due_s = PERIOD_S * f64::from(row);
            let stamp_s = f64::max(due_s + late_s(&mut draws), before_s + 1e-4);
            if draws.random::<f64>() >= lost {
                all.push((stamp_s, stamp_s - due_s));
                before_s = stamp_s;
            }
        }
        all
    }

    #[test]
    fn a_normal_jitter_is_found_row_by_row() {
        let normal = |draws: &mut Xoshiro256PlusPlus| -> f64 {
            let z: f64 = StandardNormal.sample(draws);
            2e-3 * z
        };
        // The line through 500 rows is off by 2 ms/√500 on average, by twice that at the ends of a run.
        // Rejects a beat that rows farther off than 0.45 of it miss: 2.4 % of rows are off by 5 ms and more.
        assert!(off_s(&stamps(3000, 0.0, normal)) < 2e-4, "{}", off_s(&stamps(3000, 0.0, normal)));
        assert!(off_s(&stamps(3000, 0.03, |_| 0.0)) < 1e-9, "rows that are lost are not late");
        assert!(off_s(&stamps(3000, 0.0, |_| 0.0)) < 1e-12);
    }

    #[test]
    fn rows_that_were_received_late_are_no_lost_ones() {
        for mean_s in [2e-3, 5e-3] {
            let delayed = move |draws: &mut Xoshiro256PlusPlus| -mean_s * (1.0 - draws.random::<f64>()).ln();
            let found = off_s(&stamps(3000, 0.0, delayed));
            // As above, of delays that are alike for some rows.
            assert!(found < 0.2 * mean_s, "{mean_s}: {found}");
        }
    }

    #[test]
    fn a_clock_that_drifts_is_not_late() {
        // 500 ppm from end to end of half a minute, steadily: a quarter of a period.
        let t_s: Vec<f64> =
            (0..3000).map(|row| PERIOD_S * f64::from(row)).map(|t_s| t_s + 2.5e-4 * t_s * t_s / 30.0).collect();
        assert!(lateness_s(&t_s).iter().all(|late_s| late_s.abs() < 2e-4));
        assert_eq!(lateness_s(&[0.0, 0.1, 0.3]), [0.0; 3]);
    }
}
