//! The unit of a gyroscope's rates, where no name says it: that in which it turns as the wheels do.

use super::runs::{Part, RawRun};
use super::times::seconds;
use super::took::{Basis, Confidence};
use crate::column_names::Quantity;
use crate::error::DatasetError;
use crate::interval_means::interval_means;
use crate::unit::Unit;

/// Units of a gyroscope's rates.
const UNITS: [Unit; 2] = [Unit::RadPerS, Unit::DegPerS];

/// A gyroscope turns as the wheels do within this factor: skid steers turn half to a third of what their
/// wheels say, and the units are 57 apart.
const MAX_TURN_RATIO: f64 = 5.0;

/// Mean square of the wheels' yaw rates from which on they tell, rad²/s²: of a robot that turns at 0.1 rad/s
/// in a hundredth of the time.
const MIN_MEAN_SQUARE: f64 = 1e-4;

/// Turns the other way from this correlation with the wheels on.
const REVERSED: f64 = -0.5;

/// Decides the unit; `turns_rad` are the turns of each run's wheels over the intervals that end at its rows.
/// With `None` a remark says why the rates are left out.
///
/// # Errors
/// [`DatasetError::Undecided`] or [`DatasetError::Foreign`] where there is no other instrument: `is_needed`.
pub(super) fn unit(
    parts: &[Part],
    runs: &[RawRun],
    turns_rad: &[Vec<f64>],
    is_needed: bool,
    remarks: &mut Vec<String>,
) -> Result<Option<(Unit, Basis)>, DatasetError> {
    let Some((part, _)) = runs.iter().find_map(|run| run.gyro.as_ref()) else { return Ok(None) };
    let part = &parts[*part];
    let chosen = &part.roles.of[&Quantity::Gyro];
    let name = &part.sheet.names[chosen.index];
    // Sums of squares and the product of rates by the gyroscope and by the wheels.
    let (mut gyro2, mut wheels2, mut product, mut count) = (0.0, 0.0, 0.0, 0.0);
    for (run, turns_rad) in runs.iter().zip(turns_rad) {
        let Some((part, rows)) = &run.gyro else { continue };
        let Some(column) = &parts[*part].log.gyro else { continue };
        let (time, of_rows) = (&parts[*part].log.time, &parts[run.part].log.time);
        let rates: Vec<(i128, f64)> = rows.iter().map(|&row| (time[row], column[row])).collect();
        let rows: Vec<i128> = run.rows.iter().map(|&row| of_rows[row]).collect();
        let means = interval_means(&rates, &rows, seconds);
        for ((pair, mean), turn_rad) in rows.windows(2).zip(&means[1..]).zip(&turns_rad[1..]) {
            let by_wheels = turn_rad / seconds(pair[0], pair[1]);
            if mean.is_finite() && by_wheels.is_finite() {
                gyro2 += mean * mean;
                wheels2 += by_wheels * by_wheels;
                product += mean * by_wheels;
                count += 1.0;
            }
        }
    }
    let is_telling = count > 0.0 && wheels2 / count >= MIN_MEAN_SQUARE && gyro2 > 0.0;
    let correlation = product / (gyro2 * wheels2).sqrt();
    if is_telling && correlation < REVERSED {
        let message = format!(
            "column {name} turns against the wheels (correlation {correlation:.2}): its z axis points down, or left and right are exchanged"
        );
        return refused(part, message, is_needed, remarks);
    }
    if let Some(unit) = chosen.unit {
        return Ok(Some((unit, chosen.unit_basis.clone())));
    }
    let ratio = |unit: Unit| (unit.to_si(1.0).powi(2) * gyro2 / wheels2).sqrt();
    let fits = |unit: &Unit| (1.0 / MAX_TURN_RATIO..=MAX_TURN_RATIO).contains(&ratio(*unit));
    if let Some(unit) = UNITS.into_iter().find(|unit| is_telling && fits(unit)) {
        let why = format!("turns {:.3} times as fast as the wheels by the stated robot", ratio(unit));
        return Ok(Some((unit, Basis::new(Confidence::Likely, why))));
    }
    let why = if is_telling {
        format!("in rad/s it turns {:.3} times as fast as the wheels by the stated robot", ratio(Unit::RadPerS))
    } else {
        "the robot hardly turns".to_owned()
    };
    let flags = UNITS.map(|unit| format!("--map gyro={name}[{}]", unit.name())).join(" or ");
    refused(part, format!("the unit of column {name} may be rad/s or deg/s ({why}); say {flags}"), is_needed, remarks)
}

/// An error of what is needed; else the rates are left out with a remark.
fn refused(
    part: &Part,
    message: String,
    is_needed: bool,
    remarks: &mut Vec<String>,
) -> Result<Option<(Unit, Basis)>, DatasetError> {
    if is_needed {
        return Err(part.sheet.foreign_header(message));
    }
    remarks.push(format!("{}: {message}; the gyroscope is left out", part.sheet.file.display()));
    Ok(None)
}
