//! Counters of finite width: unwrapping them when the width is known, suspecting them when it is not.
//!
//! A counter of `n` bits jumps by 2ⁿ when it passes its end. As long as no true increment reaches 2ⁿ⁻¹, the
//! increment modulo 2ⁿ in [−2ⁿ⁻¹, 2ⁿ⁻¹) is the true one.

use kinematics::Side;

use crate::record::{Dataset, WheelLog};
use crate::settings::{COUNTERS, USUAL_COUNTER_BITS};
use crate::warning::Warning;

/// Widths for which [`unwrap`] is defined: one bit has no sign, and 64 need no help.
pub(crate) const ACCEPTED_BITS: std::ops::RangeInclusive<u8> = 2..=63;

/// An increment modulo 2^bits, in [−2^(bits−1), 2^(bits−1)).
fn wrapped(increment: i64, bits: u8) -> i64 {
    let unused = 64 - u32::from(bits);
    increment.wrapping_shl(unused).wrapping_shr(unused)
}

/// Adds multiples of 2^bits so that every increment lies in [−2^(bits−1), 2^(bits−1)). The first value stays.
pub(crate) fn unwrap(ticks: &mut [i64], bits: u8) {
    let Some(&first) = ticks.first() else { return };
    let (mut previous, mut total) = (first, first);
    for tick in &mut ticks[1..] {
        total = total.wrapping_add(wrapped(tick.wrapping_sub(previous), bits));
        previous = *tick;
        *tick = total;
    }
}

/// The width, 8, 16, 24 or 32 bits, of the counter whose wrapping these cumulative counts show, if they show
/// one.
///
/// They do when they span less than 2ⁿ counts, some increment exceeds 2ⁿ⁻¹, such increments are at most half
/// of all, and unwrapping makes the largest increment at least four times smaller, and at most ten times as
/// large as those beside it. Two rows alone show nothing: a run that was read at its ends only may have made
/// any number of counts.
#[must_use]
pub fn suspected_wrap(ticks: &[i64]) -> Option<u8> {
    width_of_jumps(ticks).filter(|bits| jumps_are_usual_steps(ticks, *bits) && spike(ticks).is_none())
}

/// The row at which a counter leaves its place, as far as a wrap would, and comes back in the next row, if
/// there is one such row.
///
/// A counter that wraps to and fro does so too, but by increments that, unwrapped, are like its others. So
/// the row counts only where no width of counter makes both leaps as small as the others.
#[must_use]
pub fn suspected_spike(ticks: &[i64]) -> Option<usize> {
    spike(ticks).filter(|_| width_of_jumps(ticks).is_some())
}

fn width_of_jumps(ticks: &[i64]) -> Option<u8> {
    let span = ticks.iter().max()?.abs_diff(*ticks.iter().min()?);
    let increments = || ticks.windows(2).map(|pair| pair[1].wrapping_sub(pair[0]));
    let largest = increments().map(i64::unsigned_abs).max()?;
    let shrinkage = COUNTERS.min_unwrapped_shrinkage;
    USUAL_COUNTER_BITS.into_iter().find(|&bits| {
        let half_turn = 1_u64 << (bits - 1);
        if span >= 2 * half_turn || largest <= half_turn {
            return false;
        }
        let jumps = increments().filter(|increment| increment.unsigned_abs() > half_turn).count();
        let unwrapped = increments().map(|increment| wrapped(increment, bits).unsigned_abs()).max();
        2 * jumps < ticks.len() && unwrapped.is_some_and(|unwrapped| shrinkage * unwrapped <= largest)
    })
}

/// Whether the jumps of a counter of some width are, unwrapped, like the increments beside them.
fn jumps_are_usual_steps(ticks: &[i64], bits: u8) -> bool {
    let (beside, most) = (COUNTERS.steps_beside_jump, COUNTERS.max_unwrapped_ratio);
    let increment = |row: usize| ticks[row + 1].wrapping_sub(ticks[row]);
    let rows = ticks.len().saturating_sub(1);
    let step = |row: usize| wrapped(increment(row), bits).unsigned_abs();
    (0..rows).filter(|&row| increment(row).unsigned_abs() > 1 << (bits - 1)).all(|jump| {
        let near = jump.saturating_sub(beside)..rows.min(jump + beside + 1);
        let usual = near.filter(|&row| row != jump).map(step).max().unwrap_or(0);
        step(jump) <= most.saturating_mul(usual)
    })
}

fn spike(ticks: &[i64]) -> Option<usize> {
    // Columns may be as large as the memory: nothing is collected.
    let increment = |row: usize| ticks[row + 1].wrapping_sub(ticks[row]);
    let rows = ticks.len().checked_sub(1)?;
    let at = (0..rows).max_by_key(|&row| increment(row).unsigned_abs())?;
    // The largest is the leap away or the leap back.
    let away = [Some(at), at.checked_sub(1)]
        .into_iter()
        .flatten()
        .find(|&away| away + 1 < rows && increment(away).signum() * increment(away + 1).signum() < 0)?;
    let others = (0..rows).filter(|row| *row != away && *row != away + 1);
    let usual = others.map(|row| increment(row).unsigned_abs()).max()?.max(1);
    let leaps = [increment(away), increment(away + 1)];
    let is_leap = leaps.iter().all(|leap| leap.unsigned_abs() > COUNTERS.min_spike_ratio.saturating_mul(usual));
    // Twice: the row's own motion is in one of both leaps, and a row may be lost.
    let wraps = |bits: &u8| {
        let is_one = |leap: &i64| leap.unsigned_abs() < 1 << bits;
        leaps.iter().all(|leap| is_one(leap) && wrapped(*leap, *bits).unsigned_abs() <= usual.saturating_mul(2))
    };
    (is_leap && !USUAL_COUNTER_BITS.iter().any(wraps)).then_some(away + 1)
}

/// Warnings of all wheels that show a wrap; none when the width is known, as they have been unwrapped then.
pub fn wrap_warnings(dataset: &Dataset) -> Vec<Warning> {
    if dataset.robot.counter_bits.is_some() {
        return Vec::new();
    }
    let mut warnings = Vec::new();
    for run in &dataset.runs {
        let WheelLog::Ticks(ticks) = &run.odometry.wheels else { continue };
        for side in Side::BOTH {
            if let Some(row) = suspected_spike(&ticks[side]) {
                warnings.push(Warning::CounterSpike {
                    run: run.info.id.clone(),
                    side,
                    row: row + 1,
                    t_s: run.odometry.t_s[row],
                    ticks: ticks[side][row],
                });
            } else if let Some(bits) = suspected_wrap(&ticks[side]) {
                warnings.push(Warning::CounterWraps { run: run.info.id.clone(), side, bits });
            }
        }
    }
    warnings
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// What a counter of `bits` bits shows, signed or from 0.
    fn shown(ticks: &[i64], bits: u8, signed: bool) -> Vec<i64> {
        ticks.iter().map(|&tick| if signed { wrapped(tick, bits) } else { tick.rem_euclid(1 << bits) }).collect()
    }

    #[test]
    fn increments_stay_in_the_half_open_interval() {
        assert_eq!(wrapped(32_767, 16), 32_767);
        assert_eq!(wrapped(32_768, 16), -32_768);
        assert_eq!(wrapped(-32_769, 16), 32_767);
        assert_eq!(wrapped(-5, 63), -5);
        let mut ticks = [i64::MAX, i64::MIN, 3];
        unwrap(&mut ticks, 16);
        assert_eq!(ticks, [i64::MAX, i64::MIN, i64::MIN + 3]);
        unwrap(&mut [], 16);
    }

    proptest! {
        #[test]
        fn unwrapping_undoes_the_counter(steps in prop::collection::vec(-2000_i64..2000, 1..200), bits in 12_u8..40, signed: bool) {
            let ticks: Vec<i64> = steps.iter().scan(0, |total, step| { *total += step; Some(*total) }).collect();
            let mut seen = shown(&ticks, bits, signed);
            let offset = ticks[0] - seen[0];
            unwrap(&mut seen, bits);
            prop_assert!(seen.iter().zip(&ticks).all(|(seen, tick)| seen + offset == *tick));
        }

        #[test]
        fn a_drive_through_the_counters_end_is_suspected_and_its_unwrapped_self_is_not(
            step in 1_i64..30, uneven: bool, backward: bool, signed: bool, width in 0_usize..4,
        ) {
            let bits = USUAL_COUNTER_BITS[width];
            // Uneven steps still go one way: a wheel that rattles on the counter's end wraps at every row.
            let jitter = if uneven { step / 3 } else { 0 };
            let sign = if backward { -1 } else { 1 };
            // Passes 0 and half a turn of the counter, so that it wraps whether it is signed or not.
            let ticks: Vec<i64> = [-(1_i64 << (bits - 1)), 0, 1_i64 << (bits - 1)].into_iter()
                .flat_map(|around| (-3..3).map(move |k| sign * (around + k * step + jitter * (k & 1)))).collect();
            // The jumps between the three stretches are this test's; each stretch by itself is what a robot
            // logs.
            for stretch in ticks.chunks(6) {
                let seen = shown(stretch, bits, signed);
                let wraps = seen.windows(2).any(|pair| (pair[1] - pair[0]).unsigned_abs() > 1 << (bits - 1));
                prop_assert_eq!(suspected_wrap(&seen), wraps.then_some(bits));
                prop_assert_eq!(suspected_wrap(stretch), None);
            }
        }
    }

    #[test]
    fn a_reading_that_is_back_in_the_next_row_is_a_spike_and_no_wrap() {
        let mut ticks: Vec<i64> = (0..50).map(|k| 120 * k).collect();
        assert_eq!(suspected_spike(&ticks), None);
        ticks[20] = 4_000_000_000;
        assert_eq!((suspected_spike(&ticks), suspected_wrap(&ticks)), (Some(20), None));
        ticks[20] = -4_000_000_000;
        assert_eq!((suspected_spike(&ticks), suspected_wrap(&ticks)), (Some(20), None));
        // To and fro over the end of 16 bits: both leaps are usual increments, unwrapped.
        let rattles = [65_530, 65_534, 3, 65_531, 65_529];
        assert_eq!((suspected_spike(&rattles), suspected_wrap(&rattles)), (None, Some(16)));
    }

    #[test]
    fn large_steps_alone_are_no_wrap() {
        assert_eq!(suspected_wrap(&[]), None);
        assert_eq!(suspected_wrap(&[7]), None);
        // Read at the ends only.
        assert_eq!(suspected_wrap(&[0, 65_530]), None);
        // A straight out and back, three readings.
        assert_eq!(suspected_wrap(&[0, 40_000, 0]), None);
        // One step of 40000 among small ones would unwrap to −25536: not four times smaller.
        assert_eq!(suspected_wrap(&[0, 10, 20, 40_020, 40_030]), None);
        // Wider than the counter.
        assert_eq!(suspected_wrap(&[0, 10, 70_000, 4_470, 4_480]), None);
        assert_eq!(suspected_wrap(&[65_500, 65_520, 4, 24]), Some(16));
        // Set to 0 at 62000: unwrapped, a leap of 3556 is left among steps of 20.
        assert_eq!(suspected_wrap(&[62_000, 62_020, 40, 60]), None);
        assert_eq!(suspected_wrap(&[62_000, 62_020, 40, 620]), Some(16));
    }
}
