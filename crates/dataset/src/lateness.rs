//! How late rows are stamped, against the beat of the rows around them.

use crate::settings::TIME_BASE;

/// Whether no neighbour has a row's number; numbers do not fall.
pub(crate) fn is_alone(numbers: &[i64], row: usize) -> bool {
    let number = Some(&numbers[row]);
    row.checked_sub(1).is_none_or(|before| numbers.get(before) != number) && numbers.get(row + 1) != number
}

/// How late each stamp is against the line through the rows around it that are alone of their ticks: one that
/// came by itself is on no line. Through all of them where hardly any is alone.
pub(crate) fn lateness(t_s: &[f64], numbers: &[i64], period_s: f64) -> Vec<f64> {
    let (rows, line_rows) = (t_s.len(), TIME_BASE.line_rows);
    // Sums of a window slide along; times over numbers stay small for precision.
    let mut sums = Sums::default();
    let (mut from, mut to) = (0, 0);
    let number_of = |row: usize| numbers[row] as f64;
    let rest_s = |row: usize| t_s[row] - period_s * numbers[row] as f64;
    let most_are = (0..rows).filter(|row| is_alone(numbers, *row)).count() * 2 > rows;
    let weight = |row: usize| if is_alone(numbers, row) || !most_are { 1.0 } else { 0.0 };
    let late = |row: usize| {
        while to < rows.min(row + line_rows + 1) {
            sums.add(number_of(to), rest_s(to), weight(to));
            to += 1;
        }
        while from + line_rows < row {
            sums.add(number_of(from), rest_s(from), -weight(from));
            from += 1;
        }
        rest_s(row) - sums.line_at(number_of(row))
    };
    (0..rows).map(late).collect()
}

/// The lateness of each tick's row, the nearest of several; 0 of the others, which came by themselves.
pub(crate) fn lateness_of_ticks(numbers: &[i64], late_s: &[f64]) -> Vec<f64> {
    let mut of_ticks_s = vec![0.0; late_s.len()];
    let mut first = 0;
    for of_tick in numbers.chunk_by(|number, next| number == next) {
        let rows = first..first + of_tick.len();
        first = rows.end;
        if let Some(nearest) = rows.min_by(|a, b| late_s[*a].abs().total_cmp(&late_s[*b].abs())) {
            of_ticks_s[nearest] = late_s[nearest];
        }
    }
    of_ticks_s
}

/// Sums of a line through points.
#[derive(Default)]
pub(crate) struct Sums {
    count: f64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
}

impl Sums {
    pub(crate) fn add(&mut self, x: f64, y: f64, times: f64) {
        self.count += times;
        self.x += times * x;
        self.y += times * y;
        self.xx += times * x * x;
        self.xy += times * x * y;
    }

    /// The line at a point; the mean where it has no slope.
    pub(crate) fn line_at(&self, x: f64) -> f64 {
        let (mean_x, mean_y) = (self.x / self.count, self.y / self.count);
        let square = self.xx - self.count * mean_x * mean_x;
        let slope = if square > 0.5 * self.count { (self.xy - self.count * mean_x * mean_y) / square } else { 0.0 };
        mean_y + slope * (x - mean_x)
    }
}
