//! Any CSV file with times, wheels and poses: its way of writing, columns, units and runs are found, and
//! everything that was decided is told. What cannot be told from the files is asked for, never invented.
//!
//! The order of work, a file each: `sheet` how a file is written → `columns` which column is what → `log` its
//! cells → `sources` which file has the wheels and which the poses → `times` the unit of time → `runs` →
//! `units` by which wheels and poses tell of one motion → `assemble`.

mod angles;
mod assemble;
mod columns;
mod drive;
mod gyro;
mod log;
mod mocap;
mod motions;
mod options;
mod runs;
mod sheet;
mod sources;
mod tape;
mod text;
mod times;
mod took;
mod tum;
mod units;

use std::path::PathBuf;

pub use motions::{MotionOptions, read_motions};
pub use options::{FileRole, MapEntry, Options, Rates, RobotGiven, Tape};
pub use sheet::Writing;
pub use text::{Decimal, Delimiter};
pub use took::{Basis, Confidence, Took, TookColumn, TookFile};
pub use tum::{TumMotion, read_tum};

use crate::column_names::Quantity;
use crate::error::DatasetError;
use crate::imported::Imported;
use crate::protocols::recognise_protocols;
use crate::record::{Dataset, NominalRobot, Provenance, TruthNoise};
use crate::unit::Unit;
use columns::Roles;
use drive::{Drive, WheelUnits};
use log::Log;
use runs::{Part, RawRun};
use sheet::Sheet;
use text::EXACT_SCALE;
use times::KnownMotion;
use units::Units;

/// A dataset from CSV files, and what was taken for what.
#[derive(Debug, Clone, PartialEq)]
pub struct FromCsv {
    /// The dataset.
    pub imported: Imported,
    /// What was decided.
    pub took: Took,
    /// To be added to the instants of the truth, seconds: `[corrections] truth_shift_s`.
    pub truth_shift_s: Option<f64>,
}

/// Reads files of one robot and one session as a dataset; which of them has the wheels and which the poses is
/// found where one reading is possible. Further files are those that `options` name.
///
/// # Errors
/// [`DatasetError`] of the first fault; [`DatasetError::Undecided`] where two readings are nearly as likely,
/// [`DatasetError::RobotNotGiven`] where the robot's own numbers are missing.
pub fn read(files: &[PathBuf], options: &Options) -> Result<FromCsv, DatasetError> {
    let given = sources::given(files, options)?;
    let stem = given.first().and_then(|(file, _)| file.file_stem());
    let name = stem.unwrap_or_default().to_string_lossy().into_owned();
    let mut parts = parts(&given, options)?;
    let remarks = sources::settle(&mut parts)?;
    dataset(parts, name, remarks, options)
}

/// The files, their columns known.
fn parts(files: &[(PathBuf, FileRole)], options: &Options) -> Result<Vec<Part>, DatasetError> {
    let (mut sheets, mut remarks) = (Vec::with_capacity(files.len()), Vec::with_capacity(files.len()));
    for (file, role) in files {
        let text = text::read(file)?;
        let (text, remark) = match mocap::table(file, &text, options.body.as_deref())? {
            Some((table, remark)) => (table, Some(remark)),
            None => (text, None),
        };
        sheets.push((Sheet::of(file, text, options.writing)?, *role));
        remarks.push(remark);
    }
    columns::refuse_unknown_columns(&sheets, options)?;
    let mut parts = Vec::with_capacity(sheets.len());
    for ((sheet, role), remark) in sheets.into_iter().zip(remarks) {
        let mut roles = columns::roles(&sheet, role, options)?;
        roles.remarks.extend(remark);
        let log = Log::read(&sheet, &roles)?;
        parts.push(Part { sheet, roles, log, shift_ps: 0 });
    }
    Ok(parts)
}

/// The dataset of files whose columns are known; `remarks` are told besides those that are made here.
fn dataset(
    mut parts: Vec<Part>,
    name: String,
    mut remarks: Vec<String>,
    options: &Options,
) -> Result<FromCsv, DatasetError> {
    remarks.extend(refuse_halves(&parts, options)?);
    let (robot, drive) = robot(&parts, options)?;
    let time_units = settle_times(&mut parts, options, &drive)?;
    let shift_s = shift_poses(&mut parts, options)?;
    let (raw, runs_by) = runs::runs(&parts, options, &mut remarks)?;
    let units = settle_units(&parts, &raw, options, &drive)?;

    let session_start = raw.iter().map(|run| run.start).min().filter(|_| raw.len() > 1);
    let mut runs = raw
        .iter()
        .zip(&units)
        .map(|(raw, units)| assemble::run(&parts, raw, units, &drive, session_start))
        .collect::<Result<Vec<_>, _>>()?;
    if let Some(tape) = &options.tape {
        tape::add(tape, &parts, &raw, time_units[raw[0].part].0, &mut runs, &robot, &mut remarks)?;
    }
    let mut took = tell(&parts, &raw, &units, &time_units, runs_by, options);
    took.remarks.splice(0..0, remarks);
    let provenance = Provenance { name: Some(name.clone()), ..Provenance::default() };
    let mut dataset = Dataset { provenance, robot, truth_noise: TruthNoise::default(), points: Vec::new(), runs };
    recognise_protocols(&mut dataset);
    dataset.carry_wheel_angles();
    let warnings = crate::counter::wrap_warnings(&dataset);
    Ok(FromCsv { imported: Imported { name, dataset, warnings }, took, truth_shift_s: shift_s })
}

/// Wheels must be there, and an instrument; what a user should read where it sees no poses.
fn refuse_halves(parts: &[Part], options: &Options) -> Result<Option<String>, DatasetError> {
    let sheet = &parts[0].sheet;
    let columns = || columns::listed(&sheet.names);
    if !parts.iter().any(|part| part.roles.has_wheels()) {
        let message = format!(
            "no columns of wheels, left and right or v and omega; the columns are: {}; say which with --map left=COLUMN,right=COLUMN, or give the odometry's file too",
            columns()
        );
        return Err(sheet.foreign_header(message));
    }
    if parts.iter().any(|part| part.roles.has_pose()) {
        return Ok(None);
    }
    let instruments = match (parts.iter().any(|part| part.roles.has_gyro()), options.tape.is_some()) {
        (false, false) => {
            let message = format!(
                "no poses of an outside instrument; the robot's own odometry does not count; the columns are: {}; say which with --map x=COLUMN,y=COLUMN, or give the truth's file too, by --truth FILE; without poses a gyroscope (--map gyro=COLUMN) or a tape (--tape) is needed",
                columns()
            );
            return Err(sheet.foreign_header(message));
        }
        (true, false) => "a gyroscope alone: it determines the wheel separation relative to the wheels, and no length",
        (false, true) => "a tape alone: it determines the wheel diameters, and not the wheel separation",
        (true, true) => "a gyroscope and a tape",
    };
    Ok(Some(format!("no file has poses of an outside instrument; the measurements are those of {instruments}")))
}

/// The robot as its owner describes it.
fn robot(parts: &[Part], options: &Options) -> Result<(NominalRobot, Drive), DatasetError> {
    let given = options.robot;
    let with_wheels = parts.iter().find(|part| part.roles.has_wheels()).unwrap_or(&parts[0]);
    let (candidates, _) = drive::wheel_candidates(with_wheels, options);
    let are_counts = |units: &WheelUnits| matches!(units.of_wheels(), Some(Unit::Ticks | Unit::TicksPerRow));
    let counted = candidates.iter().all(are_counts);
    let names = || {
        let named = |(quantity, chosen): (&Quantity, &columns::Chosen)| {
            format!("{} is {}", quantity.key(), with_wheels.sheet.names[chosen.index])
        };
        with_wheels.roles.of.iter().map(named).collect::<Vec<_>>().join(", ")
    };
    let (robot, geometry) = given.nominal(counted, &with_wheels.sheet.file, names)?;
    let rates = options.rates.unwrap_or(Rates::IntervalEnd);
    Ok((robot, Drive { geometry, ticks_per_rev: given.ticks_per_rev, counter_bits: given.counter_bits, rates }))
}

/// Finds the unit of every file's times and brings them to picoseconds: odometry first, as it tells more.
fn settle_times(parts: &mut [Part], options: &Options, drive: &Drive) -> Result<Vec<(Unit, Basis)>, DatasetError> {
    let mut units: Vec<Option<(Unit, Basis)>> = vec![None; parts.len()];
    let mut odometry_s: Vec<f64> = Vec::new();
    let order = (0..parts.len()).filter(|&part| parts[part].roles.has_wheels());
    let order: Vec<usize> = order.chain((0..parts.len()).filter(|&part| !parts[part].roles.has_wheels())).collect();
    let truths = parts.iter().filter(|part| !part.roles.has_wheels() && part.roles.has_pose()).count();
    let mut truth = 0;
    for number in order {
        let Part { sheet, roles, log, .. } = &parts[number];
        let mut known = KnownMotion::default();
        if roles.has_wheels() {
            let candidates = drive::wheel_candidates(&parts[number], options).0;
            let speeds = candidates.iter().map(|units| drive::speed_m_per_unit(&parts[number], *units, drive));
            known.speeds_m_per_unit = speeds.collect::<Option<Vec<f64>>>().unwrap_or_default();
        } else {
            let paired = odometry_s.get(truth).copied().filter(|_| truths == odometry_s.len());
            known.odometry_s = paired.or_else(|| (odometry_s.len() == 1).then(|| odometry_s[0]));
            truth += usize::from(roles.has_pose());
        }
        let (unit, basis) = times::unit_of_time(sheet, roles, log, options, &known)?;
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

/// Brings the poses to the clock of the wheels where the user says how far theirs is ahead; the rows are
/// written as they are, and the shift beside them. Poses in the file of the wheels stay: there it is small.
fn shift_poses(parts: &mut [Part], options: &Options) -> Result<Option<f64>, DatasetError> {
    /// As far as [`EXACT_SCALE`] of seconds are times: a century.
    const MAX_OFFSET_S: f64 = 5e9;
    let Some(offset_s) =
        options.pose_offset_s.or_else(|| options.aligns_starts.then(|| starts_apart_s(parts)).flatten())
    else {
        return Ok(None);
    };
    if !parts.iter().any(|part| part.roles.has_pose()) || offset_s.is_nan() || offset_s.abs() > MAX_OFFSET_S {
        let message = format!("--pose-offset {offset_s}: there are no poses, or this is no offset of clocks");
        return Err(parts[0].sheet.foreign(1, message));
    }
    for part in parts.iter_mut().filter(|part| part.roles.has_pose() && !part.roles.has_wheels()) {
        part.shift_ps = (offset_s * EXACT_SCALE).round() as i128;
        part.log.time.iter_mut().for_each(|stamp| *stamp -= part.shift_ps);
    }
    Ok(Some(-offset_s))
}

/// How much later the first poses begin than the first wheels, seconds, where their times do not meet.
fn starts_apart_s(parts: &[Part]) -> Option<f64> {
    let span = |is_meant: fn(&Roles) -> bool| {
        let times = || parts.iter().filter(|part| is_meant(&part.roles)).flat_map(|part| part.log.time.iter().copied());
        times().min().zip(times().max())
    };
    let (wheels, poses) = (span(Roles::has_wheels)?, span(Roles::has_pose)?);
    let meet = poses.0 <= wheels.1 && wheels.0 <= poses.1;
    (!meet).then(|| times::seconds(wheels.0, poses.0))
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
        let has_gyro = |run: &RawRun| run.gyro.as_ref().is_some_and(|(part, _)| *part == number);
        let run = raw.iter().position(|run| run.part == number || run.truth_part == number || has_gyro(run));
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
    let of_roles = parts.iter().flat_map(|part| part.roles.remarks.iter().cloned());
    let mut remarks: Vec<String> = of_roles.chain(units.iter().flat_map(|units| units.remarks.clone())).collect();
    remarks.dedup();
    Took { files: files.collect(), runs_by, rates, remarks }
}

/// The unit in which a column was taken.
fn unit_of(quantity: Quantity, roles: &Roles, time: &(Unit, Basis), units: Option<&Units>) -> (Unit, Basis) {
    let none = (Unit::Text, Basis::new(Confidence::Certain, ""));
    let Some(units) = units else { return none };
    match quantity {
        Quantity::Time => time.clone(),
        Quantity::Nanoseconds => (Unit::Ns, Basis::new(Confidence::Certain, "with whole seconds")),
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
        Quantity::Gyro => units.gyro.clone().unwrap_or(none),
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
