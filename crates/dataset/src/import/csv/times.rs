//! The unit of a sheet's times: by name, by the size of an epoch, by the steps, and by the speed at which the
//! robot would have gone.

use super::columns::Roles;
use super::log::Log;
use super::options::Options;
use super::sheet::Sheet;
use super::text::EXACT_SCALE;
use super::took::{Basis, Confidence};
use crate::column_names::Quantity;
use crate::error::DatasetError;
use crate::order_statistics::median;
use crate::unit::Unit;

/// Steps of a log: from what the fastest microcontrollers log to one row in five seconds.
const STEPS_S: std::ops::RangeInclusive<f64> = 0.0005..=5.0;

/// Mean speed of a wheeled robot while it moves: from a creeping one to twice the speed of warehouse robots.
const SPEEDS_M_S: std::ops::RangeInclusive<f64> = 0.01..=10.0;

/// Seconds since 1970 from 2001 on, until 2128: no log of a robot has so many seconds, nor so few
/// nanoseconds.
const EPOCH_S: std::ops::Range<f64> = 1e9..5e9;

/// How many times longer than the odometry a truth may be.
const SPAN_RATIO: f64 = 3.0;

/// What is known of a log besides its stamps.
#[derive(Debug, Clone, Default)]
pub(super) struct KnownMotion {
    /// How far the wheels went in one unit of time while they moved, metres, in each unit that they may be
    /// in, the usual first; none of rates.
    pub(super) speeds_m_per_unit: Vec<f64>,
    /// How long the odometry is that this truth belongs to, seconds.
    pub(super) odometry_s: Option<f64>,
}

pub(super) const fn per_second(unit: Unit) -> i128 {
    match unit {
        Unit::Ms => 1_000,
        Unit::Us => 1_000_000,
        Unit::Ns => 1_000_000_000,
        _ => 1,
    }
}

/// Brings the stamps to picoseconds, in integers.
pub(super) fn to_picoseconds(log: &mut Log, unit: Unit) {
    log.time.iter_mut().for_each(|stamp| *stamp /= per_second(unit));
}

/// Seconds between two stamps of picoseconds.
pub(super) fn seconds(from: i128, to: i128) -> f64 {
    let (mut difference, mut scale) = (to - from, EXACT_SCALE);
    // Smaller integers are exact doubles for longer, and their quotient is the double nearest to the decimal.
    while difference != 0 && difference % 1000 == 0 && scale > 1.0 {
        (difference, scale) = (difference / 1000, scale / 1000.0);
    }
    difference as f64 / scale
}

/// The unit of a log's stamps.
pub(super) fn unit_of_time(
    sheet: &Sheet,
    roles: &Roles,
    log: &Log,
    options: &Options,
    known: &KnownMotion,
) -> Result<(Unit, Basis), DatasetError> {
    let chosen = &roles.of[&Quantity::Time];
    if log.is_dated {
        return Ok((Unit::S, Basis::new(Confidence::Certain, "dates with a time of day")));
    }
    if roles.has(Quantity::Nanoseconds) {
        return Ok((Unit::S, Basis::new(Confidence::Certain, "seconds with nanoseconds in a column of their own")));
    }
    if let Some(unit) = chosen.unit.filter(|_| chosen.unit_basis.confidence == Confidence::Given) {
        return Ok((unit, chosen.unit_basis.clone()));
    }
    if let Some(unit) = options.time_unit {
        return Ok((unit, Basis::new(Confidence::Given, "--time-unit")));
    }
    if let Some(unit) = chosen.unit {
        return Ok((unit, chosen.unit_basis.clone()));
    }
    let raw = |stamp: i128| stamp as f64 / EXACT_SCALE;
    let in_s = |value: f64, unit: Unit| value / per_second(unit) as f64;
    let first = log.time.first().copied().map_or(0.0, raw);
    if let Some(unit) = Unit::TIMES.into_iter().find(|unit| EPOCH_S.contains(&in_s(first, *unit))) {
        return Ok((unit, Basis::new(Confidence::Certain, format!("a date in {} since 1970", unit.name()))));
    }
    let steps = log
        .time
        .windows(2)
        .enumerate()
        .filter(|(row, pair)| pair[1] > pair[0] && log.run_of(*row) == log.run_of(row + 1))
        .map(|(_, pair)| raw(pair[1] - pair[0]));
    let Some(step) = median(steps) else {
        return Err(undecided(sheet, "s, ms, us or ns", "with one row it cannot be seen"));
    };
    let span = log.time.iter().max().zip(log.time.iter().min()).map_or(0.0, |(last, first)| raw(last - first));
    if let Some(odometry_s) = known.odometry_s {
        let agrees = |unit: &Unit| (1.0 / SPAN_RATIO..=SPAN_RATIO).contains(&(in_s(span, *unit) / odometry_s));
        if let Some(unit) = Unit::TIMES.into_iter().find(agrees) {
            let why = format!("as long as the odometry, {:.3} s", in_s(span, unit));
            return Ok((unit, Basis::new(Confidence::Likely, why)));
        }
    }
    let by_step: Vec<Unit> = Unit::TIMES.into_iter().filter(|unit| STEPS_S.contains(&in_s(step, *unit))).collect();
    let at = |speed: Option<&f64>, unit: Unit| speed.map(|speed| speed * per_second(unit) as f64);
    let by_speed = |of: Option<&f64>| -> Vec<Unit> {
        let is_plausible = |unit: &Unit| at(of, *unit).is_none_or(|speed| SPEEDS_M_S.contains(&speed));
        by_step.iter().copied().filter(is_plausible).collect()
    };
    let usual = known.speeds_m_per_unit.first();
    // Counts that are none of a counter may be those since the row before.
    let others = || known.speeds_m_per_unit.iter().skip(1).map(|of| (Some(of), by_speed(Some(of))));
    let (of, left) = match by_speed(usual) {
        left if left.is_empty() => others().find(|(_, left)| !left.is_empty()).unwrap_or((usual, left)),
        left => (usual, left),
    };
    let speed = |unit: Unit| at(of, unit);
    match left[..] {
        [unit] => {
            let at = speed(unit).map_or(String::new(), |speed| format!(", wheels at {speed:.2} m/s"));
            Ok((unit, Basis::new(Confidence::Likely, format!("rows {:.4} s apart{at}", in_s(step, unit)))))
        }
        [] => {
            let of = speed(Unit::S).map_or(String::new(), |speed| format!(", in seconds wheels at {speed:.3e} m/s"));
            Err(undecided(sheet, "s, ms, us or ns", &format!("rows are {step} apart{of}: none is usual")))
        }
        _ => {
            let names: Vec<_> =
                left.iter().map(|unit| format!("{} (rows {} s apart)", unit.name(), in_s(step, *unit))).collect();
            Err(undecided(sheet, &names.join(" or "), ""))
        }
    }
}

fn undecided(sheet: &Sheet, readings: &str, why: &str) -> DatasetError {
    let why = if why.is_empty() { String::new() } else { format!(" ({why})") };
    DatasetError::Undecided {
        file: sheet.file.clone(),
        what: format!("the unit of time{why}"),
        readings: readings.to_owned(),
        flag: "--time-unit s or --time-unit ms".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_are_the_doubles_nearest_to_the_decimals() {
        let ps = |text: &str| super::super::text::Decimal::Point.exact(text).expect("a number");
        for text in ["0.05", "0.1", "123.456789", "86400.000001", "0"] {
            let expected: f64 = text.parse().expect("a number");
            assert_eq!(seconds(0, ps(text)), expected);
            // The same digits behind the stamp of a date.
            assert_eq!(seconds(ps("1700000000"), ps("1700000000") + ps(text)), expected);
        }
    }
}
