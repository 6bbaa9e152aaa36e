//! Mean rates over intervals from rates at instants.

use crate::order_statistics::median;
use crate::settings::ROUNDED_RATES;

/// Mean rates over the intervals that end at `rows`; NaN where they are not known: before the first rate,
/// after the last, and across a step of more than 3.5 median steps between two. The first row ends no
/// interval.
///
/// `rates` are instants and rates in the order of time, linear in between; `seconds` is the time from one
/// instant to another.
pub fn interval_means<T: Copy + PartialOrd>(rates: &[(T, f64)], rows: &[T], seconds: impl Fn(T, T) -> f64) -> Vec<f64> {
    let steps_s = || rates.windows(2).map(|pair| seconds(pair[0].0, pair[1].0));
    let longest_s = median(steps_s()).map_or(0.0, |median_s| ROUNDED_RATES.max_bridged_steps * median_s);
    // The angle up to each rate, and how many holes are before it.
    let mut before: Vec<(f64, usize)> = vec![(0.0, 0)];
    for (pair, step_s) in rates.windows(2).zip(steps_s()) {
        let (angle_rad, holes) = before[before.len() - 1];
        let mean_rad_s = 0.5 * (pair[0].1 + pair[1].1);
        before.push((angle_rad + mean_rad_s * step_s, holes + usize::from(step_s > longest_s)));
    }
    // Angle and holes at an instant between the first and the last rate. In a hole there is none.
    let at = |time: T| -> Option<(f64, usize)> {
        let next = rates.partition_point(|(of, _)| *of < time);
        if rates.get(next).is_some_and(|(of, _)| *of == time) {
            return Some(before[next]);
        }
        let (from, to) = (rates.get(next.checked_sub(1)?)?, rates.get(next)?);
        let ((angle_rad, holes), step_s) = (before[next - 1], seconds(from.0, to.0));
        if before[next].1 != holes {
            return None;
        }
        let since_s = seconds(from.0, time);
        let rate_rad_s = from.1 + (to.1 - from.1) * since_s / step_s;
        Some((angle_rad + 0.5 * (from.1 + rate_rad_s) * since_s, holes))
    };
    let mean = |pair: &[T]| {
        let ((from_rad, holes), (to_rad, holes_after)) = (at(pair[0])?, at(pair[1])?);
        (holes == holes_after).then(|| (to_rad - from_rad) / seconds(pair[0], pair[1]))
    };
    let first = rows.iter().take(1).map(|_| f64::NAN);
    first.chain(rows.windows(2).map(|pair| mean(pair).unwrap_or(f64::NAN))).collect()
}
