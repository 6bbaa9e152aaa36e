//! Any CSV file with times, wheels and poses: its way of writing, columns, units and runs are found, and
//! everything that was decided is told. What cannot be told from the files is asked for, never invented.
//!
//! The order of work, a file each: `sheet` how a file is written → `columns` which column is what →
//! `times` the unit of time → `runs` → `units` by which wheels and poses tell of one motion → `assemble`.

mod assemble;
mod columns;
mod options;
mod runs;
mod sheet;
mod text;
mod times;
mod took;
mod tum;
mod units;

use std::path::PathBuf;

pub use options::{MapEntry, Options, Rates, RobotGiven};
pub use sheet::Writing;
pub use text::{Decimal, Delimiter};
pub use took::{Basis, Confidence, Took, TookColumn, TookFile};
pub use tum::{TumMotion, read_tum};

use crate::column_names::Quantity;
use crate::error::DatasetError;
use crate::imported::Imported;
use crate::record::{Dataset, NominalRobot, Provenance, TruthNoise};
use crate::unit::Unit;
use columns::{Log, Roles};
use runs::{Part, RawRun};
use sheet::Sheet;
use times::KnownMotion;
use units::{Drive, Units, WheelUnits};

/// A dataset from CSV files, and what was taken for what.
#[derive(Debug, Clone, PartialEq)]
pub struct FromCsv {
    /// The dataset.
    pub imported: Imported,
    /// What was decided.
    pub took: Took,
}

/// Reads files of one robot and one session as a dataset.
///
/// # Errors
/// [`DatasetError`] of the first fault; [`DatasetError::Undecided`] where two readings are nearly as likely,
/// [`DatasetError::RobotNotGiven`] where the robot's own numbers are missing.
pub fn read(files: &[PathBuf], options: &Options) -> Result<FromCsv, DatasetError> {
    let name = files[0].file_stem().unwrap_or_default().to_string_lossy().into_owned();
    dataset(parts(files, options)?, name, Vec::new(), options)
}

/// The files, their columns known.
fn parts(files: &[PathBuf], options: &Options) -> Result<Vec<Part>, DatasetError> {
    let sheets = files.iter().map(|file| Sheet::open(file, options.writing)).collect::<Result<Vec<_>, _>>()?;
    columns::refuse_unknown_columns(&sheets, options)?;
    let mut parts = Vec::with_capacity(sheets.len());
    for sheet in sheets {
        let roles = columns::roles(&sheet, options)?;
        let log = Log::read(&sheet, &roles)?;
        parts.push(Part { sheet, roles, log });
    }
    Ok(parts)
}

/// The dataset of files whose columns are known; `remarks` are told besides those that are made here.
fn dataset(
    mut parts: Vec<Part>,
    name: String,
    remarks: Vec<String>,
    options: &Options,
) -> Result<FromCsv, DatasetError> {
    refuse_halves(&parts)?;
    let (robot, drive) = robot(&parts, options)?;
    let time_units = settle_times(&mut parts, options, &drive)?;
    let (raw, runs_by) = runs::runs(&parts, options)?;
    let units = settle_units(&parts, &raw, options, &drive)?;

    let session_start = raw.iter().map(|run| run.start).min().filter(|_| raw.len() > 1);
    let runs = raw
        .iter()
        .zip(&units)
        .map(|(raw, units)| assemble::run(&parts, raw, units, &drive, session_start))
        .collect::<Result<Vec<_>, _>>()?;
    let mut took = tell(&parts, &raw, &units, &time_units, runs_by, options);
    took.remarks.splice(0..0, remarks);
    let provenance = Provenance { name: Some(name.clone()), ..Provenance::default() };
    let mut dataset = Dataset { provenance, robot, truth_noise: TruthNoise::default(), points: Vec::new(), runs };
    dataset.carry_wheel_angles();
    let warnings = crate::counter::wrap_warnings(&dataset);
    Ok(FromCsv { imported: Imported { name, dataset, warnings }, took })
}

/// Wheels and poses must both be there.
fn refuse_halves(parts: &[Part]) -> Result<(), DatasetError> {
    let file = parts[0].sheet.file.clone();
    let line = parts[0].sheet.header_line.unwrap_or(1);
    let columns = || columns::listed(&parts[0].sheet.names);
    if !parts.iter().any(|part| part.roles.has_wheels()) {
        let message = format!(
            "no columns of wheels, left and right or v and omega; the columns are: {}; say which with --map left=COLUMN,right=COLUMN, or give the odometry's file too",
            columns()
        );
        return Err(DatasetError::Foreign { file, line, message });
    }
    if !parts.iter().any(|part| part.roles.has_pose()) {
        let message = format!(
            "no poses of an outside instrument; the robot's own odometry is none; the columns are: {}; say which with --map x=COLUMN,y=COLUMN, or give the truth's file too",
            columns()
        );
        return Err(DatasetError::Foreign { file, line, message });
    }
    Ok(())
}

/// The robot as its owner describes it.
fn robot(parts: &[Part], options: &Options) -> Result<(NominalRobot, Drive), DatasetError> {
    let given = options.robot;
    let with_wheels = parts.iter().find(|part| part.roles.has_wheels()).unwrap_or(&parts[0]);
    let (candidates, _) = units::wheel_candidates(with_wheels, options);
    let counted = candidates == [WheelUnits::Wheels(Unit::Ticks)];
    let names = || {
        let named = |(quantity, chosen): (&Quantity, &columns::Chosen)| {
            format!("{} is {}", quantity.key(), with_wheels.sheet.names[chosen.index])
        };
        with_wheels.roles.of.iter().map(named).collect::<Vec<_>>().join(", ")
    };
    let (robot, geometry) = given.nominal(counted, &with_wheels.sheet.file, names)?;
    let rates = options.rates.unwrap_or(Rates::IntervalEnd);
    Ok((robot, Drive { geometry, ticks_per_rev: given.ticks_per_rev, rates }))
}

/// Finds the unit of every file's times and brings them to picoseconds: odometry first, as it tells more.
fn settle_times(parts: &mut [Part], options: &Options, drive: &Drive) -> Result<Vec<(Unit, Basis)>, DatasetError> {
    let mut units: Vec<Option<(Unit, Basis)>> = vec![None; parts.len()];
    let mut odometry_s: Vec<f64> = Vec::new();
    let order = (0..parts.len()).filter(|&part| parts[part].roles.has_wheels());
    let order: Vec<usize> = order.chain((0..parts.len()).filter(|&part| !parts[part].roles.has_wheels())).collect();
    let truths = parts.iter().filter(|part| !part.roles.has_wheels()).count();
    let mut truth = 0;
    for number in order {
        let Part { sheet, roles, log } = &parts[number];
        let mut known = KnownMotion::default();
        if roles.has_wheels() {
            if let [units] = units::wheel_candidates(&parts[number], options).0[..] {
                known.speed_m_per_unit = units::speed_m_per_unit(&parts[number], units, drive);
            }
        } else {
            let paired = odometry_s.get(truth).copied().filter(|_| truths == odometry_s.len());
            known.odometry_s = paired.or_else(|| (odometry_s.len() == 1).then(|| odometry_s[0]));
            truth += 1;
        }
        let (unit, basis) = times::unit_of_time(sheet, roles, log, options, known)?;
        times::to_picoseconds(&mut parts[number].log, unit);
        let log = &parts[number].log;
        if parts[number].roles.has_wheels() {
            let ends = log.time.iter().min().zip(log.time.iter().max());
            odometry_s.push(ends.map_or(0.0, |(&first, &last)| times::seconds(first, last)));
        }
        units[number] = Some((unit, basis));
    }
    Ok(units.into_iter().flatten().collect())
}

/// The units of every run; runs of files with the same columns share them.
fn settle_units(parts: &[Part], raw: &[RawRun], options: &Options, drive: &Drive) -> Result<Vec<Units>, DatasetError> {
    let layout = |run: &RawRun| (&parts[run.part].sheet.names, &parts[run.truth_part].sheet.names);
    let mut known: Vec<(usize, Units)> = Vec::new();
    let mut of_runs = Vec::with_capacity(raw.len());
    for (number, run) in raw.iter().enumerate() {
        let same = known.iter().find(|(first, _)| layout(&raw[*first]) == layout(run));
        let units = match same {
            Some((_, units)) => units.clone(),
            None => {
                let alike: Vec<RawRun> = raw.iter().filter(|other| layout(other) == layout(run)).cloned().collect();
                let units = units::units(parts, &alike, options, drive)?;
                known.push((number, units.clone()));
                units
            }
        };
        of_runs.push(units);
    }
    Ok(of_runs)
}

/// What was decided, for the user.
fn tell(
    parts: &[Part],
    raw: &[RawRun],
    units: &[Units],
    time_units: &[(Unit, Basis)],
    runs_by: String,
    options: &Options,
) -> Took {
    let of_part = |number: usize| {
        let run = raw.iter().position(|run| run.part == number || run.truth_part == number);
        run.map(|run| &units[run])
    };
    let files = parts.iter().enumerate().map(|(number, part)| {
        let columns = part.roles.of.iter().map(|(quantity, chosen)| {
            let (unit, unit_by) = unit_of(*quantity, &part.roles, &time_units[number], of_part(number));
            TookColumn {
                quantity: quantity.key(),
                column: part.sheet.names[chosen.index].clone(),
                number: chosen.index + 1,
                unit: unit.name(),
                first: part.sheet.first_cells(chosen.index),
                chosen: chosen.basis.clone(),
                unit_by,
                flag: flags(*quantity),
            }
        });
        TookFile {
            file: part.sheet.file.display().to_string(),
            delimiter: part.sheet.delimiter.name(),
            decimal: part.sheet.decimal.name(),
            header_line: part.sheet.header_line,
            rows: part.log.lines.len(),
            columns: columns.collect(),
            left_out: part.roles.left_out.clone(),
        }
    });
    let has_rates = units.iter().any(|units| match units.wheels {
        WheelUnits::Wheels(unit) => unit.is_rate(),
        WheelUnits::Twist(_) => true,
    });
    let rates = has_rates.then(|| match options.rates {
        Some(rates) => Basis::new(Confidence::Given, rates.name()),
        None => Basis::new(Confidence::Assumed, Rates::IntervalEnd.name()),
    });
    let mut remarks: Vec<String> = units.iter().filter_map(|units| units.remark.clone()).collect();
    remarks.dedup();
    Took { files: files.collect(), runs_by, rates, remarks }
}

/// The unit in which a column was taken.
fn unit_of(quantity: Quantity, roles: &Roles, time: &(Unit, Basis), units: Option<&Units>) -> (Unit, Basis) {
    let none = (Unit::Text, Basis::new(Confidence::Certain, ""));
    let Some(units) = units else { return none };
    match quantity {
        Quantity::Time => time.clone(),
        Quantity::Left | Quantity::Right | Quantity::Speed | Quantity::YawRate => {
            let unit = match units.wheels {
                WheelUnits::Wheels(unit) => unit,
                WheelUnits::Twist([speed, yaw_rate]) => {
                    if quantity == Quantity::Speed {
                        speed
                    } else {
                        yaw_rate
                    }
                }
            };
            (unit, units.wheels_by.clone())
        }
        Quantity::X | Quantity::Y => (units.length, units.length_by.clone()),
        Quantity::Heading => (units.angle, units.angle_by.clone()),
        Quantity::Qx | Quantity::Qy | Quantity::Qz | Quantity::Qw if roles.has(Quantity::Qw) => {
            (Unit::One, Basis::new(Confidence::Certain, "a quaternion"))
        }
        _ => none,
    }
}

/// The flag that changes a unit.
const fn flags(quantity: Quantity) -> &'static str {
    match quantity {
        Quantity::Run => "--runs-by",
        Quantity::Time => "--time-unit",
        Quantity::Left | Quantity::Right => "--wheel-unit",
        Quantity::X | Quantity::Y => "--length-unit",
        Quantity::Heading => "--angle-unit",
        _ => "--map",
    }
}
