//! Rows of rates that say nothing of the wheels, or too little: zeros where no message came, speeds that wrap
//! at the end of their numbers, and values that are cut to whole steps toward zero. They are restored for the
//! checks that follow. Rates that were recorded may have been read as the counts that they are made of: rows
//! are examined as rates in any log.

use std::mem::take;

use dataset::{quantile, quantum_of_angles};

use crate::clock::model::Clock;
use crate::problem::{Problem, Severity, probability};
use crate::record_fault::{Place, RecordFault};
use crate::run_log::RunLog;
use crate::session_check::SessionCheck;
use crate::settings::CHECKS;
use crate::windows::Reading;

/// Two columns of each run, of rates or of increments; a row's are those of the interval that ends there.
type Columns = [Vec<f64>; 2];

/// Whether rows are restored on average alone, so that parts of the log do not compare.
pub(crate) fn found(check: &mut SessionCheck) -> bool {
    let m_per_rad = check.m_per_rad();
    // Speed and yaw rate, in metres of a wheel.
    let to_twist = |[left, right]: [f64; 2]| {
        let (left_m_s, right_m_s) = (left * m_per_rad.left, right * m_per_rad.right);
        [0.5 * (left_m_s + right_m_s), 0.5 * (right_m_s - left_m_s)]
    };
    let to_wheels = |[v, by]: [f64; 2]| [(v - by) / m_per_rad.left, (v + by) / m_per_rad.right];
    let same = |rates: [f64; 2]| rates;
    let (rates, increments) = (true, false);
    let of_wheels = |is_rates| Recorded { is_rates, to: &same, back: &same };
    let of_twist = |is_rates| Recorded { is_rates, to: &to_twist, back: &to_wheels };
    restore(check, zeros_filled, of_wheels(rates), |rows, from, share, Better { gain, .. }| {
        let severity = if share > CHECKS.max_rounded_share { Severity::Error } else { Severity::Warning };
        // What a robot cannot do so often needs little of an instrument.
        let is_certain = gain > CHECKS.min_gain || (rows >= CHECKS.min_rows && gain > 0.0);
        is_certain.then_some((RecordFault::ZeroRates { from, rows, share }, severity))
    });
    let wraps = |rows: usize, from: Place, _: f64, better: Better| {
        (better.gain > CHECKS.min_gain).then_some((RecordFault::RatesWrap { from, rows }, Severity::Error))
    };
    if !restore(check, unwrapped, of_wheels(rates), wraps) {
        restore(check, unwrapped, of_twist(rates), wraps);
    }
    let cut = |_: usize, _: Place, share: f64, better: Better| {
        // Of values that are rounded to the nearest step, half of it may gain by chance.
        let is_decisive = better.gain > CHECKS.min_gain && better.ratio < CHECKS.max_cut_ratio;
        is_decisive.then_some((RecordFault::RatesCut { share }, Severity::Error))
    };
    // A counter loses nothing from row to row.
    check.runs.iter().any(|run| run.count_rad == 0.0)
        && [of_twist(increments), of_wheels(increments), of_twist(rates), of_wheels(rates)]
            .into_iter()
            .any(|recorded| restore(check, with_halves, recorded, cut))
}

/// By how many nats restored rows explain the motion better, and the ratio of what they leave of it.
#[derive(Debug, Clone, Copy)]
struct Better {
    gain: f64,
    ratio: f64,
}

/// From rates or increments of both wheels to what was recorded, or back.
type Change<'a> = &'a dyn Fn([f64; 2]) -> [f64; 2];

/// Whether columns are rates or increments, and how they are found and undone.
#[derive(Clone, Copy)]
struct Recorded<'a> {
    is_rates: bool,
    to: Change<'a>,
    back: Change<'a>,
}

/// Says what is wrong with rows, if the instrument's motion shows it, and restores them. Of the restored rows
/// `say` is told their number, the first, their share of those in which the robot drives, and by how much
/// better the wheels then explain the motion.
fn restore(
    check: &mut SessionCheck,
    restored: fn(&mut [Columns]) -> Vec<(usize, usize)>,
    recorded: Recorded<'_>,
    say: impl Fn(usize, Place, f64, Better) -> Option<(RecordFault, Severity)>,
) -> bool {
    let mut columns: Vec<Columns> = check.runs.iter().map(|run| columns_of(run, recorded)).collect();
    let mut rows = restored(&mut columns);
    rows.sort_unstable();
    rows.dedup();
    let Some(&(run, row)) = rows.first() else { return false };
    let sound = take(&mut check.runs);
    check.runs = sound.iter().zip(&columns).map(|(run, columns)| with_columns(run, columns, recorded)).collect();
    let then = check.explained(Reading::AS_IS, Clock::default());
    let restored = std::mem::replace(&mut check.runs, sound);
    let better = match (check.explained(Reading::AS_IS, Clock::default()), then) {
        (Some(as_is), Some(then)) => Better { gain: then.gain_over(&as_is), ratio: then.ratio_to(&as_is) },
        _ => return false,
    };
    let drives = columns.iter().map(|[a, b]| a.iter().zip(b).filter(|(a, b)| **a != 0.0 || **b != 0.0).count());
    let share = rows.len() as f64 / drives.sum::<usize>().max(1) as f64;
    // A row's rates are of the interval that ends there, and the first row has none.
    let first = &check.runs[run];
    let from = Place { run: first.id.clone(), t_s: first.t_s[row + 1], row: row + 2 };
    let Some((kind, severity)) = say(rows.len(), from, share, better) else { return false };
    check.problems.push(Problem::record(kind, severity, None, probability(better.gain.max(CHECKS.min_gain))));
    check.runs = restored;
    true
}

fn columns_of(run: &RunLog, recorded: Recorded<'_>) -> Columns {
    let both = |row: usize| {
        let divisor = if recorded.is_rates { run.t_s[row + 1] - run.t_s[row] } else { 1.0 };
        (recorded.to)([&run.wheels.left, &run.wheels.right].map(|angles| (angles[row + 1] - angles[row]) / divisor))
    };
    let rows: Vec<[f64; 2]> = (0..run.t_s.len().saturating_sub(1)).map(both).collect();
    [0, 1].map(|number| rows.iter().map(|of| of[number]).collect())
}

fn with_columns(run: &RunLog, columns: &Columns, recorded: Recorded<'_>) -> RunLog {
    let mut run = run.clone();
    for (row, (first, second)) in columns[0].iter().zip(&columns[1]).enumerate() {
        let times = if recorded.is_rates { run.t_s[row + 1] - run.t_s[row] } else { 1.0 };
        let [left, right] = (recorded.back)([*first, *second]);
        run.wheels.left[row + 1] = run.wheels.left[row] + left * times;
        run.wheels.right[row + 1] = run.wheels.right[row] + right * times;
    }
    run
}

/// Fills rows of zeros between two rows at speeds that the robot does not reach from standing in so few rows;
/// runs and rows.
fn zeros_filled(runs: &mut [Columns]) -> Vec<(usize, usize)> {
    // What a speed usually changes by at the most from row to row, and no less than its least value, which is
    // one count of a coarse encoder.
    let most = [0, 1].map(|number: usize| {
        let columns = || runs.iter().map(|columns| &columns[number]);
        let steps = columns().flat_map(|column| column.windows(2)).filter(|pair| pair[0] != 0.0 && pair[1] != 0.0);
        let usual = quantile(steps.map(|pair| (pair[1] - pair[0]).abs()), CHECKS.usual_step_quantile).unwrap_or(0.0);
        let sizes = columns().flatten().filter(|of| **of != 0.0).map(|of| of.abs());
        usual.max(sizes.fold(f64::INFINITY, f64::min))
    });
    let mut filled = Vec::new();
    for (run, columns) in runs.iter_mut().enumerate() {
        let count = columns[0].len();
        let mut row = 1;
        while row + 1 < count {
            let is_zero = |row: usize| columns[0][row] == 0.0 && columns[1][row] == 0.0;
            let end = (row..count).find(|at| !is_zero(*at)).unwrap_or(count);
            let steps = (end - row + 1) as f64;
            let is_impossible = |number: usize| {
                let (before, after) = (columns[number][row - 1], columns[number][end]);
                before * after > 0.0 && before.abs() + after.abs() > 2.0 * steps * most[number]
            };
            if (row + 1..count).contains(&end) && (is_impossible(0) || is_impossible(1)) {
                for column in columns.iter_mut() {
                    let (before, after) = (column[row - 1], column[end]);
                    (row..end).for_each(|at| {
                        column[at] = before + (after - before) * (at - row + 1) as f64 / steps;
                    });
                }
                filled.extend((row..end).map(|at| (run, at)));
            }
            row = end + 1;
        }
    }
    filled
}

/// Adds the half of a step to values that are whole ones, away from zero: what is cut from them on average.
/// The rows that gain by it.
fn with_halves(runs: &mut [Columns]) -> Vec<(usize, usize)> {
    let mut rows = Vec::new();
    for number in 0..2 {
        let first = || runs.iter().flat_map(|columns| &columns[number]).filter(|of| **of != 0.0).take(CHECKS.step_rows);
        let sums = first().scan(0.0, |sum, value| {
            *sum += value;
            Some(*sum)
        });
        let step = quantum_of_angles(&sums.collect::<Vec<f64>>());
        let mean = first().map(|value| value.abs()).sum::<f64>() / first().count() as f64;
        for (run, columns) in runs.iter_mut().enumerate().filter(|_| step > CHECKS.min_cut_share * mean) {
            for (row, value) in columns[number].iter_mut().enumerate().filter(|(_, value)| **value != 0.0) {
                *value += 0.5 * step.copysign(*value);
                rows.push((run, row));
            }
        }
    }
    rows
}

/// Goes on beyond the ends of a symmetric range where a column leaps from near one end to near the other;
/// runs and rows beyond.
fn unwrapped(runs: &mut [Columns]) -> Vec<(usize, usize)> {
    let mut rows = Vec::new();
    for number in 0..2 {
        let all = || runs.iter().flat_map(|columns| &columns[number]);
        let (low, high) = all().fold((0.0_f64, 0.0_f64), |(low, high), of| (low.min(*of), high.max(*of)));
        let range = high - low;
        if (high + low).abs() > (1.0 - CHECKS.min_wrap_share) * range {
            continue;
        }
        for (run, columns) in runs.iter_mut().enumerate() {
            let (mut turns, mut before) = (0.0, 0.0);
            let beyond = columns[number].iter().map(|value| {
                let step = value - before;
                before = *value;
                turns -= if step.abs() > CHECKS.min_wrap_share * range { step.signum() } else { 0.0 };
                turns
            });
            let beyond: Vec<f64> = beyond.collect();
            // A wheel that is reversed leaps too, and does not come back.
            if beyond.last().is_none_or(|turns| *turns != 0.0) {
                continue;
            }
            for (row, turns) in beyond.into_iter().enumerate().filter(|(_, turns)| *turns != 0.0) {
                columns[number][row] += turns * range;
                rows.push((run, row));
            }
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A robot that speeds up to 0.5 and stops, by rows.
    fn driven() -> Vec<f64> {
        (0..200).map(|row| (0.02 * f64::from(row.min(199 - row))).min(0.5)).collect()
    }

    #[test]
    fn zeros_at_speed_are_filled_and_a_robot_that_stops_is_not() {
        let mut zeros = [[driven(), driven()]];
        for row in [100, 101, 150] {
            zeros[0].iter_mut().for_each(|column| column[row] = 0.0);
        }
        assert_eq!(zeros_filled(&mut zeros), [(0, 100), (0, 101), (0, 150)]);
        assert_eq!(zeros[0][0], driven());
        // One that stops and goes on, and counts of a coarse encoder. Rejects every zero between speeds.
        let twice = [driven(), driven()].concat();
        let coarse: Vec<f64> = (0..200).map(|row| f64::from(u8::from(row % 3 == 0))).collect();
        for sound in [twice, coarse] {
            assert!(zeros_filled(&mut [[sound.clone(), sound]]).is_empty());
        }
    }

    #[test]
    fn speeds_that_wrap_go_on_and_a_wheel_that_is_reversed_does_not() {
        let wrapped: Vec<f64> = driven().iter().map(|of| if *of > 0.4 { of - 0.8 } else { *of }).collect();
        let mut runs = [[wrapped, vec![0.0; 200]]];
        assert!(!unwrapped(&mut runs).is_empty());
        let off = runs[0][0].iter().zip(driven()).map(|(found, is)| (found - is).abs()).fold(0.0, f64::max);
        // The range is known to a step of the speed.
        assert!(off < 0.021, "{off}");
        let reversed: Vec<f64> =
            driven().iter().enumerate().map(|(row, of)| if row > 100 { -of } else { *of }).collect();
        assert!(unwrapped(&mut [[reversed, vec![0.0; 200]]]).is_empty());
    }
}
