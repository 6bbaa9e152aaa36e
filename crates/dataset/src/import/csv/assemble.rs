//! The dataset from the rows of the runs, in SI units.

use kinematics::Wheels;

use super::drive::{Drive, WheelUnits};
use super::options::Rates;
use super::runs::{Part, RawRun};
use super::times::seconds;
use super::units::Units;
use crate::column_names::Quantity;
use crate::error::DatasetError;
use crate::partial::GyroSample;
use crate::record::{Odometry, Run, RunInfo, TruthSample, WheelLog};
use crate::unit::Unit;

/// Largest count that a double holds exactly.
const LARGEST_COUNT: f64 = 9_007_199_254_740_992.0;

/// One run of the dataset; `session_start` is the first run's start, where there are several.
pub(super) fn run(
    parts: &[Part],
    raw: &RawRun,
    units: &Units,
    drive: &Drive,
    session_start: Option<i128>,
) -> Result<Run, DatasetError> {
    let part = &parts[raw.part];
    let t_s: Vec<f64> = raw.rows.iter().map(|&row| seconds(raw.start, part.log.time[row])).collect();
    let wheels = wheel_log(part, raw, units.wheels, drive)?;
    let truth_part = &parts[raw.truth_part];
    let mut truth = Vec::with_capacity(raw.truth_rows.len());
    if let Some(pose) = &truth_part.log.pose {
        for &row in &raw.truth_rows {
            let theta_rad = Some(units.angle.to_si(pose.theta[row])).filter(|theta_rad| theta_rad.is_finite());
            let (x_m, y_m) = (units.length.to_si(pose.x[row]), units.length.to_si(pose.y[row]));
            truth.push(TruthSample::new(
                seconds(raw.start, truth_part.log.time[row] + truth_part.shift_ps),
                x_m,
                y_m,
                theta_rad,
            ));
        }
    }
    let mut gyro = Vec::new();
    if let (Some((unit, _)), Some((part, rows))) = (&units.gyro, &raw.gyro)
        && let Some(rates) = &parts[*part].log.gyro
    {
        let part = &parts[*part];
        let sample = |&row: &usize| GyroSample {
            t_s: seconds(raw.start, part.log.time[row]),
            omega_radps: unit.to_si(rates[row]),
        };
        gyro.extend(rows.iter().map(sample));
    }
    let start_s = session_start.map(|session| seconds(session, raw.start));
    let info = RunInfo { id: raw.id.clone(), start_s, ..RunInfo::default() };
    Ok(Run {
        info,
        odometry: Odometry { t_s: t_s.into(), wheels, ..Odometry::default() },
        truth,
        gyro,
        ..Run::default()
    })
}

/// The wheels of a run in a unit.
fn wheel_log(part: &Part, raw: &RawRun, units: WheelUnits, drive: &Drive) -> Result<WheelLog, DatasetError> {
    Ok(match (units, &part.log.wheels) {
        (WheelUnits::Wheels(Unit::TicksPerRow), Some(columns)) => {
            WheelLog::Ticks(counts(part, raw, columns)?.map(|steps| sums(steps, i64::wrapping_add)))
        }
        (WheelUnits::Wheels(unit @ (Unit::RadPerRow | Unit::MPerRow)), Some([left, right])) => {
            let angle = |m_per_rad: f64, column: &Vec<f64>| {
                let scale = if unit == Unit::MPerRow { 1.0 / m_per_rad } else { 1.0 };
                sums(raw.rows.iter().map(|&row| column[row] * scale).collect(), |sum, step| sum + step)
            };
            WheelLog::Angles(drive.geometry.m_per_rad().zip_with(Wheels { left, right }, angle))
        }
        (WheelUnits::Wheels(Unit::Ticks), Some(columns)) => WheelLog::Ticks(counts(part, raw, columns)?),
        (WheelUnits::Wheels(unit), Some(columns)) if unit.is_rate() => {
            let m = drive.m_per_unit(unit).unwrap_or(Wheels::both(1.0));
            let [left, right] = columns.each_ref().map(|column| rates(raw, column, drive.rates));
            // Of contacts the unit's own quotient: the bits of the text in metres a second.
            let scaled = |column: Vec<f64>, m: f64| {
                let in_m_s = |value: f64| if unit.is_of_contact() { unit.to_si(value) } else { value * m };
                column.into_iter().map(in_m_s).collect()
            };
            WheelLog::Speeds(Wheels { left: scaled(left, m.left), right: scaled(right, m.right) })
        }
        (WheelUnits::Wheels(unit), Some([left, right])) => {
            let angle = |m_per_rad: f64, column: &Vec<f64>| {
                let of = |&row: &usize| {
                    let value = unit.to_si(column[row]);
                    if Unit::LENGTHS.contains(&unit) { value / m_per_rad } else { value }
                };
                raw.rows.iter().map(of).collect()
            };
            WheelLog::Angles(drive.geometry.m_per_rad().zip_with(Wheels { left, right }, angle))
        }
        (WheelUnits::Twist([speed, yaw_rate]), Some([v, omega])) => {
            let si = |column: &[f64], unit: Unit| {
                rates(raw, column, drive.rates).into_iter().map(|value| unit.to_si(value)).collect()
            };
            WheelLog::Twist { v_mps: si(v, speed), omega_radps: si(omega, yaw_rate) }
        }
        (_, None) => WheelLog::default(),
    })
}

/// The counts of both wheels.
fn counts(part: &Part, raw: &RawRun, [left, right]: &[Vec<f64>; 2]) -> Result<Wheels<Vec<i64>>, DatasetError> {
    let counts = |side: Quantity, column: &[f64]| -> Result<Vec<i64>, DatasetError> {
        let count = |&row: &usize| {
            let value = column[row];
            if value.fract() == 0.0 && value.abs() <= LARGEST_COUNT {
                return Ok(value as i64);
            }
            let column = part.sheet.names[part.roles.of[&side].index].clone();
            let (file, line) = (part.sheet.file.clone(), part.log.lines[row]);
            Err(DatasetError::NotACount { file, line, column, found: value.to_string() })
        };
        raw.rows.iter().map(count).collect()
    };
    Ok(Wheels { left: counts(Quantity::Left, left)?, right: counts(Quantity::Right, right)? })
}

/// Sums of what was moved row by row, from nothing at the first row.
fn sums<T: Copy + Default>(steps: Vec<T>, add: impl Fn(T, T) -> T) -> Vec<T> {
    let mut sum = T::default();
    let sum_at = |(index, step): (usize, T)| {
        if index > 0 {
            sum = add(sum, step);
        }
        sum
    };
    steps.into_iter().enumerate().map(sum_at).collect()
}

/// Means over the intervals that end at each row.
fn rates(raw: &RawRun, column: &[f64], rates: Rates) -> Vec<f64> {
    let mean = |index: usize| match (rates, index.checked_sub(1)) {
        (Rates::Instantaneous, Some(before)) => 0.5 * (column[raw.rows[before]] + column[raw.rows[index]]),
        _ => column[raw.rows[index]],
    };
    (0..raw.rows.len()).map(mean).collect()
}
