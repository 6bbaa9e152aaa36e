//! `yair import csv FILE... --out DIR`

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use clap::builder::TypedValueParser;
use dataset::import::csv::{
    self, Confidence, Decimal, Delimiter, FromCsv, MapEntry, Options, Rates, Tape, Took, TookFile, Writing,
};
use dataset::{DatasetError, Unit, WheelLog};
use serde::Serialize;

use crate::import_robot::{RobotArguments, named, positive, rates, with_command_line};
use crate::simulate::write_shifted_dataset;
use crate::terminal::{Failure, Terminal, table};

/// CSV files of times, wheels and poses, whatever their columns are called: what they are is found and shown
///
/// One file may hold all, or odometry and truth have a file each; several files of odometry are a run each.
/// Which file is which is found where one reading is possible; --wheels and --truth say it. Delimiter,
/// decimal mark, columns, units and runs are found and shown with the reason and the flag that changes each.
/// Where two readings are nearly as likely, nothing is written and the flag that settles it is named. The
/// robot's own numbers are in no log: --robot with its controllers.yaml or URDF, or --wheel and --base, and
/// --ticks-per-rev for counted wheels.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Files of one robot and one session; with --wheels those of the poses, with --truth those of the
    /// wheels.
    #[arg(required_unless_present = "wheels", value_name = "FILE")]
    files: Vec<PathBuf>,
    /// File that is read for its wheels alone; may be given several times, a run each.
    #[arg(long, value_name = "FILE", help_heading = "Files")]
    wheels: Vec<PathBuf>,
    /// File that is read for its poses alone; may be given several times, in the order of the wheels'. With
    /// `none` poses are left out: a gyroscope or a tape takes their place.
    #[arg(long, value_name = "FILE|none", help_heading = "Files")]
    truth: Vec<PathBuf>,
    /// The body that is the robot, where a table of motion capture (Motive, Vicon) has several.
    #[arg(long, value_name = "NAME", help_heading = "Files")]
    body: Option<String>,
    /// Straight distance from the robot's first place to its last, metres, of one push by hand from
    /// standstill to standstill; or a file of run,t0,t1,metres by the log's clock.
    #[arg(long, value_name = "METRES|FILE", help_heading = "Files")]
    tape: Option<String>,
    /// How far the clock of the poses is ahead of that of the wheels, seconds: poses are stamped so much too
    /// late. Rows stay as they are; the dataset's [corrections] undo it.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = finite, help_heading = "Clocks")]
    pose_offset: Option<f64>,
    /// Estimate that offset by the motion, as `yair check` does; files of wholly different clocks are taken
    /// to begin at about the same time.
    #[arg(long, conflicts_with = "pose_offset", help_heading = "Clocks")]
    sync: bool,
    /// Folder for the dataset.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Replace a dataset that is already there.
    #[arg(long)]
    force: bool,

    #[command(flatten)]
    reading: ReadingArguments,
}

/// How files of no format are read.
#[derive(Args)]
pub(crate) struct ReadingArguments {
    /// Which column is what: t, nanosec, left, right, v, omega, gyro, x, y, theta, qx, qy, qz, qw or run; a
    /// column by its name or its number from 1, its unit in brackets if need be. From `wheels:t=1` or
    /// `truth:t=1` on the entries hold for the files of --wheels or --truth alone.
    #[arg(long, value_name = "t=stamp,left=enc_l[deg],…", value_delimiter = ',', help_heading = "Columns")]
    map: Vec<MapEntry>,
    /// The column that says to which run a row belongs.
    #[arg(long, value_name = "COLUMN", help_heading = "Columns")]
    runs_by: Option<String>,
    /// Cut runs where the robot stands still, or the log has a gap, for longer than that.
    #[arg(long, value_name = "SECONDS", value_parser = positive, help_heading = "Columns")]
    cut: Option<f64>,

    #[command(flatten)]
    robot: RobotArguments,

    /// Unit of all times.
    #[arg(long, value_name = "UNIT", value_parser = units(&Unit::TIMES), help_heading = "Units")]
    time_unit: Option<Unit>,
    /// Unit of positions.
    #[arg(long, value_name = "UNIT", value_parser = units(&Unit::LENGTHS), help_heading = "Units")]
    length_unit: Option<Unit>,
    /// Unit of headings.
    #[arg(long, value_name = "UNIT", value_parser = units(&Unit::ANGLES), help_heading = "Units")]
    angle_unit: Option<Unit>,
    /// Unit of both wheels: counts, angles or speeds; ticks/row, rad/row and m/row are what a wheel moved
    /// since the row before.
    #[arg(long, value_name = "UNIT", value_parser = units(&Unit::WHEELS), help_heading = "Units")]
    wheel_unit: Option<Unit>,
    /// Whether a row's speed is the mean over the interval that ends there, or that of the instant.
    #[arg(long, value_name = "WHICH", value_parser = rates(), help_heading = "Units")]
    rates: Option<Rates>,

    /// Delimiter between two fields.
    #[arg(long, value_name = "WHICH", value_parser = delimiters(), help_heading = "Writing")]
    delimiter: Option<Delimiter>,
    /// Decimal mark.
    #[arg(long, value_name = "WHICH", value_parser = decimals(), help_heading = "Writing")]
    decimal: Option<Decimal>,
    /// Whether there is a header.
    #[arg(long, value_name = "yes|no", value_parser = yes_or_no(), help_heading = "Writing")]
    header: Option<bool>,
}

fn units(units: &[Unit]) -> impl TypedValueParser<Value = Unit> + use<> {
    named(units, Unit::name)
}

fn delimiters() -> impl TypedValueParser<Value = Delimiter> {
    named(&Delimiter::ALL, Delimiter::name)
}

fn decimals() -> impl TypedValueParser<Value = Decimal> {
    named(&Decimal::ALL, Decimal::name)
}

fn yes_or_no() -> impl TypedValueParser<Value = bool> {
    named(&[true, false], |yes| if yes { "yes" } else { "no" })
}

#[derive(Serialize)]
struct Document<'a> {
    format: &'static str,
    source: String,
    datasets: [Written; 1],
    took: &'a Took,
}

#[derive(Serialize)]
struct Written {
    dataset: String,
    runs: usize,
    odometry_rows: usize,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    let found = csv::read(&arguments.files, &arguments.options(terminal)?);
    let mut found = arguments.reading.identified(found);
    if arguments.sync
        && let Ok(found) = &mut found
    {
        synchronise(found);
    }
    let Arguments { files, wheels, truth, out, force, .. } = arguments;
    write("csv", &[&files[..], wheels, truth].concat(), found, out, *force, terminal)
}

/// Estimates how far the poses' clock is ahead, beside what is known of it already.
fn synchronise(found: &mut FromCsv) {
    let shifted_s = found.truth_shift_s.unwrap_or(0.0);
    let mut dataset = found.imported.dataset.clone();
    for sample in dataset.runs.iter_mut().flat_map(|run| &mut run.truth) {
        sample.t_s += shifted_s;
    }
    // Who reads the dataset unwraps its counters, and what is compared here is not read yet.
    if let Some(bits) = dataset.robot.counter_bits {
        for run in &mut dataset.runs {
            if let WheelLog::Ticks(ticks) = &mut run.odometry.wheels {
                [&mut ticks.left, &mut ticks.right].into_iter().for_each(|column| unwrap(column, bits));
            }
        }
    }
    let problems = preflight::check(&[dataset]).problems;
    let offset = problems.iter().find(|problem| problem.id == "clock_offset");
    let of_fix =
        |fix: &str| fix.rsplit_once("truth_shift_s = ").and_then(|(_, shift)| shift.trim().parse::<f64>().ok());
    let shift_s = offset.and_then(|problem| of_fix(problem.fix.as_deref()?));
    let sentence = match (shift_s, offset) {
        (Some(_), Some(problem)) => problem.sentence.clone(),
        _ => "no offset is found that matters".to_owned(),
    };
    if let Some(total_s) = shift_s.map(|shift_s| shifted_s + shift_s).or(found.truth_shift_s) {
        found.truth_shift_s = Some(total_s);
        found.took.remarks.push(format!("--sync: {sentence}; the poses' clock is taken as {:.3} s ahead", -total_s));
    } else {
        found.took.remarks.push(format!("--sync: {sentence}"));
    }
}

/// Counts of a counter of so many bits, its steps the nearest to none.
fn unwrap(ticks: &mut [i64], bits: u8) {
    let unused = 64 - u32::from(bits);
    let Some(&first) = ticks.first() else { return };
    let (mut before, mut total) = (first, first);
    for tick in &mut ticks[1..] {
        total = total.wrapping_add(tick.wrapping_sub(before).wrapping_shl(unused).wrapping_shr(unused));
        before = *tick;
        *tick = total;
    }
}

impl Arguments {
    fn options(&self, terminal: &Terminal) -> Result<Options, Failure> {
        let is_none = |file: &PathBuf| file.as_os_str() == "none";
        let without_truth = self.truth.iter().any(is_none);
        if without_truth && self.truth.len() > 1 {
            return Err("--truth none excludes a file of poses: give one or the other".into());
        }
        let tape = self.tape.as_ref().map(|tape| match tape.trim().parse::<f64>() {
            Ok(distance_m) => Tape::Metres(distance_m),
            Err(_) => Tape::File(PathBuf::from(tape)),
        });
        Ok(Options {
            wheel_files: self.wheels.clone(),
            truth_files: self.truth.iter().filter(|file| !is_none(file)).cloned().collect(),
            without_truth,
            pose_offset_s: self.pose_offset,
            aligns_starts: self.sync,
            tape,
            body: self.body.clone(),
            ..self.reading.options(terminal)?
        })
    }
}

fn finite(text: &str) -> Result<f64, String> {
    let number = text.trim().parse::<f64>().ok().filter(|number| number.is_finite());
    number.ok_or_else(|| "expected a number".to_owned())
}

/// Shows what was taken for what, and writes the dataset.
pub(crate) fn write(
    format: &'static str,
    sources: &[PathBuf],
    found: Result<FromCsv, DatasetError>,
    out: &Path,
    force: bool,
    terminal: &Terminal,
) -> Result<ExitCode, Failure> {
    let FromCsv { imported, took, truth_shift_s } =
        found.map_err(|error| with_command_line(&error).unwrap_or_else(|| error.into()))?;
    show(&took, terminal)?;
    for warning in &imported.warnings {
        terminal.remark(&format!("warning: {warning}"));
    }
    for remark in &took.remarks {
        terminal.remark(&format!("warning: {remark}"));
    }
    let dataset = &imported.dataset;
    write_shifted_dataset(dataset, out, force, truth_shift_s)?;
    let written = Written {
        dataset: out.display().to_string(),
        runs: dataset.runs.len(),
        odometry_rows: dataset.runs.iter().map(|run| run.odometry.t_s.len()).sum(),
    };
    let Written { dataset: out, runs, odometry_rows } = &written;
    terminal.note(&format!("{runs} runs, {odometry_rows} odometry rows in {out}"))?;
    let sources: Vec<String> = sources.iter().map(|file| file.display().to_string()).collect();
    terminal.document(&Document { format, source: sources.join(" "), datasets: [written], took: &took })?;
    Ok(ExitCode::SUCCESS)
}

impl ReadingArguments {
    /// States in what was read which robot it is of and when it was recorded, as far as was given.
    pub(crate) fn identified(&self, found: Result<FromCsv, DatasetError>) -> Result<FromCsv, DatasetError> {
        let mut found = found?;
        self.robot.identity.state_in(&mut found.imported.dataset.provenance);
        Ok(found)
    }

    pub(crate) fn options(&self, terminal: &Terminal) -> Result<Options, Failure> {
        let stated = self.robot.stated()?;
        stated.show(terminal)?;
        Ok(Options {
            writing: Writing { delimiter: self.delimiter, decimal: self.decimal, header: self.header },
            map: MapEntry::in_sequence(&self.map),
            time_unit: self.time_unit,
            length_unit: self.length_unit,
            angle_unit: self.angle_unit,
            wheel_unit: self.wheel_unit,
            rates: self.rates,
            runs_by: self.runs_by.clone(),
            cut_s: self.cut,
            robot: stated.given,
            ..Options::default()
        })
    }
}

/// What was taken for what.
fn show(took: &Took, terminal: &Terminal) -> Result<(), Failure> {
    for file in &took.files {
        let TookFile { file, delimiter, decimal, header_line, rows, columns, left_out } = file;
        let header = header_line.map_or_else(|| "no header".to_owned(), |line| format!("header in line {line}"));
        terminal.note(&format!("{file}: {rows} rows, {header}, delimiter {delimiter}, decimal {decimal}"))?;
        let mut lines = table(&["as", "column", "unit", "first rows", "unit: how sure, and why", "changed by"], 6);
        for column in columns {
            let why = match column.unit_by.confidence {
                _ if column.unit_by.why.is_empty() => String::new(),
                confidence => format!("{}: {}", confidence.name(), column.unit_by.why),
            };
            let name = if header_line.is_some() { column.column.clone() } else { format!("number {}", column.number) };
            let name = if column.chosen.confidence == Confidence::Given { format!("{name} (given)") } else { name };
            lines.add_row([column.quantity, &name, column.unit, &column.first.join("  "), &why, column.flag]);
        }
        terminal.note(&lines.to_string())?;
        if !left_out.is_empty() {
            terminal.note(&format!("left out: {}", left_out.join(", ")))?;
        }
    }
    if let Some(rates) = &took.rates {
        terminal.note(&format!("a row's speed: {}, {} (--rates)", rates.why, rates.confidence.name()))?;
    }
    terminal.note(&format!("runs: {} (--runs-by, --cut)", took.runs_by))?;
    // Columns that a format fixes are changed by nothing.
    if took.files.iter().flat_map(|file| &file.columns).any(|column| column.chosen.confidence != Confidence::Certain) {
        terminal.note("a column is changed by --map, with its unit if need be: --map t=stamp,left=enc_l[deg]")?;
    }
    Ok(())
}
