//! Angular rates of both wheels at the rows of a log, and the rounding of their counts.
//!
//! A row's own rounding stands in its counts, and so in every residual that they predict. A rate made of the
//! same row has it too, and the product of both is not zero on average: terms in speed and acceleration, and
//! latencies, are then biased by several standard deviations (errors in variables; Fuller 1987). A rate from
//! as many rows before as after, weighted alike, does not have it. Rates are slopes of local regressions over
//! 2m + 1 rows, m as small as it may be: the smallest at which their noise is below a tenth of the signal's
//! variance, and that of the rounding below a hundredth, unless a wider one blurs more than it averages out
//! (Savitzky & Golay 1964; Lepski 1990).

use dataset::median;
use kinematics::Wheels;

use crate::quantum::variance_of_rounding;
use crate::settings::{COMMON, WHEEL_RATES};

/// Rates at the rows of a run.
#[derive(Debug, Clone)]
pub(crate) struct WheelRates {
    /// At each row, rad/s.
    pub(crate) at_rows_rad_s: Wheels<Vec<f64>>,
    /// Radians that a count stands for; 0 where angles are not rounded.
    pub(crate) quantum_rad: Wheels<f64>,
    /// How they are found.
    pub(crate) window: RateWindow,
    /// First rows of the stretches without a gap, in order.
    starts: Vec<usize>,
    /// Rows between which and the one before a count came, in order.
    counted: Vec<usize>,
    /// Time that a robot which sets off gently takes for a count, seconds; `None` where there are no counts.
    count_s: Option<f64>,
}

/// How the rates at the rows of a run are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct RateWindow {
    /// Rows before a row, and as many after.
    pub(crate) rows: usize,
    /// An interval's own counts say its rates.
    pub(crate) row_by_row: bool,
}

impl WheelRates {
    /// The rates of a run, whose stamps are so late against a regular beat. `quantum_rad` is what a count
    /// stands for, where counts were recorded.
    pub(crate) fn of(
        t_s: &[f64],
        late_s: &[f64],
        turn_rad: &Wheels<Vec<f64>>,
        quantum_rad: Wheels<f64>,
        separation_m: f64,
        m_per_rad: Wheels<f64>,
        continuous: bool,
    ) -> Self {
        let wrong_share = 1.0 - share_of_true_stamps(t_s, turn_rad);
        let jitter_s = wrong_share * stamp_jitter_s(t_s);
        let row_s = median(t_s.windows(2).map(|pair| pair[1] - pair[0])).unwrap_or(0.0);
        // Where stamps jitter, rows that came together are no fast wheels: the beat says when rows were due.
        // Stamps that counts follow are true however they jitter.
        let due_s: Vec<f64>;
        let (mut t_s, mut came_together) = (t_s, false);
        if jitter_s > COMMON.max_exact_jitter * row_s {
            due_s = due(t_s, late_s, wrong_share);
            t_s = &due_s;
        }
        let apart_s: Vec<f64>;
        if continuous && wrong_share > 0.0 {
            apart_s = apart(t_s, least_row_s(t_s, turn_rad, quantum_rad), wrong_share);
            came_together = apart_s != t_s;
            t_s = &apart_s;
        }
        let pieces = pieces(t_s, continuous);
        let stretch_s = median(t_s.windows(2).map(|pair| pair[1] - pair[0])).unwrap_or(0.0);
        let m_per_rad = [m_per_rad.left, m_per_rad.right];
        let turns = [&turn_rad.left, &turn_rad.right];
        let quanta = [quantum_rad.left, quantum_rad.right];
        // Variance of a row's angle over the speed at its stamp: rounding, and speed times the stamp's error.
        let mean_square = [0, 1].map(|side| mean_square_rate(t_s, turns[side]));
        let variance = [0, 1].map(|side| variance_of_rounding(quanta[side]) + mean_square[side] * jitter_s * jitter_s);
        let row_by_row = stretch_s > 0.0
            && !came_together
            && [0, 1].iter().all(|&side| {
                2.0 * variance[side] / (stretch_s * stretch_s) <= WHEEL_RATES.max_row_rate_noise * mean_square[side]
            });
        let of_window = |half: usize| turns.map(|turn_rad| slopes(t_s, turn_rad, &pieces, half));
        let over_window = |variance: [f64; 2], half: usize| {
            let half = half as f64;
            let squares = half * (half + 1.0) * (2.0 * half + 1.0) / 3.0 * stretch_s * stretch_s;
            variance.map(|variance| variance / squares)
        };
        let noise = |half: usize| over_window(variance, half);
        let rounding = quanta.map(variance_of_rounding);
        let mut rates = of_window(WHEEL_RATES.rate_windows[0]);
        let mut half_rows = WHEEL_RATES.rate_windows[0];
        for pair in WHEEL_RATES.rate_windows.windows(2) {
            let [now, wider] = [noise(pair[0]), noise(pair[1])];
            let is_below = |noise, fraction| is_below_signal(&rates, noise, fraction, separation_m, m_per_rad);
            let is_enough = is_below(now, WHEEL_RATES.rate_noise_fraction)
                && is_below(over_window(rounding, pair[0]), WHEEL_RATES.rate_rounding_fraction);
            if is_enough || variance == [0.0; 2] {
                break;
            }
            let next = of_window(pair[1]);
            let blurs = [0, 1].iter().any(|&side| {
                let moved = mean(rates[side].iter().zip(&next[side]).map(|(a, b)| (a - b).powi(2)));
                moved - (now[side] - wider[side]) > now[side]
            });
            if blurs {
                break;
            }
            (rates, half_rows) = (next, pair[1]);
        }
        let [left, right] = rates;
        let window = RateWindow { rows: half_rows, row_by_row };
        let starts = pieces.iter().map(|piece| piece.start).collect();
        let came = |row: &usize| turns.iter().any(|turn_rad| turn_rad[*row] != turn_rad[row - 1]);
        let is_rounded = quanta.iter().any(|quantum| *quantum > 0.0);
        let counted = if is_rounded { (1..t_s.len()).filter(came).collect() } else { Vec::new() };
        let count_m = [0, 1].map(|side| quanta[side] * m_per_rad[side]).into_iter().fold(0.0, f64::max);
        let count_s = is_rounded.then(|| (2.0 * count_m / COMMON.gentle_acceleration_m_s2).sqrt());
        Self { at_rows_rad_s: Wheels { left, right }, window, quantum_rad, starts, counted, count_s }
    }

    /// Comes no count in a part of a row's interval, nor within the time that a robot which sets off gently
    /// takes for one?
    pub(crate) fn stands(&self, rows_s: &[f64], [from_s, to_s]: [f64; 2], row: usize) -> bool {
        let Some(count_s) = self.count_s else { return false };
        let next = self.counted.partition_point(|counted| *counted <= row);
        let before = next.checked_sub(1).map_or(f64::NEG_INFINITY, |at| rows_s[self.counted[at]]);
        let after = self.counted.get(next).map_or(f64::INFINITY, |counted| rows_s[counted - 1]);
        before <= from_s - count_s && after >= to_s + count_s
    }

    /// Do the wheels' rates change steadily between a row and the next? Not over a gap, nor over rows that
    /// are longer than it takes a robot to speed up.
    pub(crate) fn are_joined(&self, t_s: &[f64], row: usize) -> bool {
        let is_short = t_s.get(row + 1).is_some_and(|next_s| next_s - t_s[row] <= COMMON.max_steady_row_s);
        is_short && self.starts.binary_search(&(row + 1)).is_err()
    }

    /// The same of a row that is not the first and of both of its neighbours.
    pub(crate) fn are_joined_around(&self, t_s: &[f64], row: usize) -> bool {
        (row - 1..=row + 1).all(|row| self.are_joined(t_s, row))
    }

    /// Rates at a row.
    pub(crate) fn at_row(&self, row: usize) -> Wheels<f64> {
        Wheels { left: self.at_rows_rad_s.left[row], right: self.at_rows_rad_s.right[row] }
    }
}

/// Is the noise of the rates of the centre and of the turn below a fraction of their own variance?
fn is_below_signal(
    rates: &[Vec<f64>; 2],
    noise: [f64; 2],
    fraction: f64,
    separation_m: f64,
    m_per_rad: [f64; 2],
) -> bool {
    let of = |weights: [f64; 2]| {
        let noise: f64 = (0..2).map(|side| (weights[side] * m_per_rad[side]).powi(2) * noise[side]).sum();
        let speed = |row: usize| (0..2).map(|side| weights[side] * m_per_rad[side] * rates[side][row]).sum::<f64>();
        let rows = rates[0].len();
        let middle = mean((0..rows).map(speed));
        let variance = mean((0..rows).map(|row| (speed(row) - middle).powi(2)));
        noise <= fraction * (variance - noise)
    };
    of([0.5, 0.5]) && of([-1.0 / separation_m, 1.0 / separation_m])
}

/// Slope of a local regression at each row, over as many rows before as after, up to `half`, and none beyond
/// the piece of the log; at the piece's ends, over as many rows as are to one side.
pub(crate) fn slopes(t_s: &[f64], turn_rad: &[f64], pieces: &[std::ops::Range<usize>], half: usize) -> Vec<f64> {
    let mut slopes = vec![0.0; t_s.len()];
    for piece in pieces {
        let last = piece.end - 1;
        for row in piece.clone() {
            let own = half.min(row - piece.start).min(last - row);
            let rows = if piece.len() == 1 {
                // Alone between two gaps.
                row.saturating_sub(1)..(row + 2).min(t_s.len())
            } else if own > 0 {
                row - own..row + own + 1
            } else if row == piece.start {
                row..(row + half + 1).min(piece.end)
            } else {
                row.saturating_sub(half).max(piece.start)..row + 1
            };
            slopes[row] = slope(&t_s[rows.clone()], &turn_rad[rows]);
        }
    }
    slopes
}

/// Slope of the regression of angles on times; 0 of a single one.
fn slope(t_s: &[f64], turn_rad: &[f64]) -> f64 {
    if let (&[from_s, _, to_s], &[from, _, to]) = (t_s, turn_rad) {
        // The most frequent window, whose middle has no weight where rows are even.
        return if to_s > from_s { (to - from) / (to_s - from_s) } else { 0.0 };
    }
    let count = t_s.len() as f64;
    let (middle_s, middle_rad) = (t_s.iter().sum::<f64>() / count, turn_rad.iter().sum::<f64>() / count);
    let (products, squares) = t_s.iter().zip(turn_rad).fold((0.0, 0.0), |(products, squares), (t_s, turn_rad)| {
        let since_s = t_s - middle_s;
        (products + since_s * (turn_rad - middle_rad), squares + since_s * since_s)
    });
    if squares > 0.0 { products / squares } else { 0.0 }
}

/// When rows were due, by how late their stamps are and which share of that is an error: never before a row
/// that came earlier, as rows that came by themselves share a number on the beat with their neighbours.
fn due(t_s: &[f64], late_s: &[f64], wrong_share: f64) -> Vec<f64> {
    let mut latest_s = f64::NEG_INFINITY;
    let mut next = |(t_s, late_s): (&f64, &f64)| {
        latest_s = f64::max(latest_s, t_s - wrong_share * late_s);
        latest_s
    };
    t_s.iter().zip(late_s).map(&mut next).collect()
}

/// Rows that were read one after the other and stamped together, as after a pause of the receiver: no row was
/// read after its stamp, nor nearer to the next than the least row. `wrong_share` is as in [`due`].
fn apart(t_s: &[f64], least_row_s: impl Fn(usize) -> f64, wrong_share: f64) -> Vec<f64> {
    let (mut apart_s, mut next_s) = (t_s.to_vec(), f64::INFINITY);
    for (row, at_s) in apart_s.iter_mut().enumerate().rev() {
        let latest_s = next_s - least_row_s(row);
        next_s = at_s.min(latest_s);
        if latest_s < *at_s {
            *at_s -= wrong_share * (*at_s - latest_s);
        }
    }
    apart_s
}

/// The least time from the reading of a row to that of the next: a share of the usual one, by the median of
/// the rows around. Where most rows are stamped together with others, as in packets, the usual one is the
/// mean over rows in which the wheels turn on: pauses in which they stand say nothing of the rows beside
/// them.
fn least_row_s<'t>(
    t_s: &'t [f64],
    turn_rad: &Wheels<Vec<f64>>,
    quantum_rad: Wheels<f64>,
) -> impl Fn(usize) -> f64 + 't {
    let lengths_s: Vec<f64> = t_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let turns_on = |row: &usize| {
        let turned =
            |turn_rad: &[f64], quantum_rad: f64| (turn_rad[row + 1] - turn_rad[*row]).abs() > 2.0 * quantum_rad;
        turned(&turn_rad.left, quantum_rad.left) || turned(&turn_rad.right, quantum_rad.right)
    };
    let mean_s = mean((0..lengths_s.len()).filter(turns_on).map(|row| lengths_s[row]));
    let in_packets = mean_s > WHEEL_RATES.max_row_spread * median(lengths_s.iter().copied()).unwrap_or(0.0);
    // Medians of stretches: rates of rows may differ along a log.
    let medians_s: Vec<f64> = lengths_s
        .chunks(WHEEL_RATES.rows_of_stretch)
        .map(|stretch| median(stretch.iter().copied()).unwrap_or(0.0))
        .collect();
    move |row| {
        if in_packets {
            return WHEEL_RATES.min_packet_row_share * mean_s;
        }
        WHEEL_RATES.min_row_share
            * medians_s.get(row.min(t_s.len().saturating_sub(2)) / WHEEL_RATES.rows_of_stretch).copied().unwrap_or(0.0)
    }
}

/// Share of what stamps jitter by that is true, 0 to 1: a row that was read late has turned on by as much.
/// Slope of second differences of the turns on those of the stamps times the rate around them.
fn share_of_true_stamps(t_s: &[f64], turn_rad: &Wheels<Vec<f64>>) -> f64 {
    let (mut products, mut squares) = (0.0, 0.0);
    for turn_rad in [&turn_rad.left, &turn_rad.right] {
        for (t_s, turn_rad) in t_s.windows(3).zip(turn_rad.windows(3)) {
            let (&[from_s, at_s, to_s], &[from, at, to]) = (t_s, turn_rad) else { continue };
            if to_s > from_s {
                let due_rad = (to - from) / (to_s - from_s) * (to_s - 2.0 * at_s + from_s);
                products += due_rad * (to - 2.0 * at + from);
                squares += due_rad * due_rad;
            }
        }
    }
    if squares > 0.0 { (products / squares).clamp(0.0, 1.0) } else { 0.0 }
}

/// Stretches of rows without a gap; in a log with gaps each row stands alone.
pub(crate) fn pieces(t_s: &[f64], continuous: bool) -> Vec<std::ops::Range<usize>> {
    let longest_s = if continuous {
        COMMON.gap_ratio * median(t_s.windows(2).map(|pair| pair[1] - pair[0])).unwrap_or(f64::INFINITY)
    } else {
        0.0
    };
    let mut start = 0;
    t_s.chunk_by(|a, b| b - a <= longest_s)
        .map(|piece| {
            let of = start..start + piece.len();
            start = of.end;
            of
        })
        .collect()
}

/// Do a log's stamps jitter by more than what numbers in a file are rounded by?
pub(crate) fn are_inexact(t_s: &[f64]) -> bool {
    let row_s = median(t_s.windows(2).map(|pair| pair[1] - pair[0])).unwrap_or(0.0);
    let of_a_file_s = COMMON.max_rounding_s.max(COMMON.min_beat_jitter * row_s);
    stamp_jitter_s(t_s) > of_a_file_s.min(COMMON.max_exact_jitter * row_s)
}

/// Standard deviation of the errors of a log's stamps, seconds: of second differences, which even rows do not
/// have, by their median, so that lost rows do not count.
#[must_use]
pub fn stamp_jitter_s(t_s: &[f64]) -> f64 {
    let second = |three: &[f64]| (three[2] - 2.0 * three[1] + three[0]).abs();
    median(t_s.windows(3).map(second)).unwrap_or(0.0) / (0.674_49 * 6_f64.sqrt())
}

fn mean_square_rate(t_s: &[f64], turn_rad: &[f64]) -> f64 {
    let pairs = t_s.windows(2).zip(turn_rad.windows(2));
    let (squares, time_s) = pairs.fold((0.0, 0.0), |(squares, time_s), (t_s, turn_rad)| {
        let (passed_s, turned_rad) = (t_s[1] - t_s[0], turn_rad[1] - turn_rad[0]);
        if passed_s > 0.0 {
            (squares + turned_rad * turned_rad / passed_s, time_s + passed_s)
        } else {
            (squares, time_s)
        }
    });
    if time_s > 0.0 { squares / time_s } else { 0.0 }
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0_f64), |(sum, count), value| (sum + value, count + 1.0));
    sum / count.max(1.0)
}

#[cfg(test)]
mod tests;
