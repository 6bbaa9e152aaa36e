//! `yair import csv FILE... --out DIR`

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use clap::builder::TypedValueParser;
use dataset::import::csv::{
    self, Confidence, Decimal, Delimiter, FromCsv, MapEntry, Options, Rates, Took, TookFile, Writing,
};
use dataset::{DatasetError, Unit};
use serde::Serialize;

use crate::import_robot::{RobotArguments, named, positive, rates, with_command_line};
use crate::simulate::write_dataset;
use crate::terminal::{Failure, Terminal, table};

/// CSV files of times, wheels and poses, whatever their columns are called: what they are is found and shown
///
/// One file may hold all, or odometry and truth have a file each; several files of odometry are a run each.
/// Delimiter, decimal mark, columns, units and runs are found and shown with the reason and the flag that
/// changes each. Where two readings are nearly as likely, nothing is written and the flag that settles it is
/// named. The robot's own numbers stand in no log: --wheel and --base, and --ticks-per-rev for counted
/// wheels.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Files of one robot and one session.
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
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
    /// Which column is what: t, left, right, v, omega, x, y, theta, qx, qy, qz, qw or run; a column by its
    /// name or its number from 1, its unit in brackets if need be.
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
    /// Unit of both wheels: counts, angles or speeds.
    #[arg(long, value_name = "UNIT", value_parser = units(&Unit::WHEELS), help_heading = "Units")]
    wheel_unit: Option<Unit>,
    /// Whether a row's speed is the mean over the interval that ends there, or that of the instant.
    #[arg(long, value_name = "WHICH", value_parser = rates(), help_heading = "Units")]
    rates: Option<Rates>,

    /// What stands between two fields.
    #[arg(long, value_name = "WHICH", value_parser = delimiters(), help_heading = "Writing")]
    delimiter: Option<Delimiter>,
    /// What stands between whole and fraction.
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
    let found = csv::read(&arguments.files, &arguments.reading.options()?);
    let found = arguments.reading.identified(found);
    write("csv", &arguments.files, found, &arguments.out, arguments.force, terminal)
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
    let FromCsv { imported, took } =
        found.map_err(|error| with_command_line(&error).unwrap_or_else(|| error.into()))?;
    show(&took, terminal)?;
    for warning in &imported.warnings {
        terminal.remark(&format!("warning: {warning}"));
    }
    for remark in &took.remarks {
        terminal.remark(&format!("warning: {remark}"));
    }
    let dataset = &imported.dataset;
    write_dataset(dataset, out, force)?;
    let written = Written {
        dataset: out.display().to_string(),
        runs: dataset.runs.len(),
        odometry_rows: dataset.runs.iter().map(|run| run.odometry.t_s.len()).sum(),
    };
    let Written { dataset: out, runs, odometry_rows } = &written;
    terminal.say(&format!("{runs} runs, {odometry_rows} odometry rows in {out}"))?;
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

    pub(crate) fn options(&self) -> Result<Options, Failure> {
        Ok(Options {
            writing: Writing { delimiter: self.delimiter, decimal: self.decimal, header: self.header },
            map: self.map.clone(),
            time_unit: self.time_unit,
            length_unit: self.length_unit,
            angle_unit: self.angle_unit,
            wheel_unit: self.wheel_unit,
            rates: self.rates,
            runs_by: self.runs_by.clone(),
            cut_s: self.cut,
            robot: self.robot.given()?,
        })
    }
}

/// What was taken for what.
fn show(took: &Took, terminal: &Terminal) -> Result<(), Failure> {
    for file in &took.files {
        let TookFile { file, delimiter, decimal, header_line, rows, columns, left_out } = file;
        let header = header_line.map_or_else(|| "no header".to_owned(), |line| format!("header in line {line}"));
        terminal.say(&format!("{file}: {rows} rows, {header}, delimiter {delimiter}, decimal {decimal}"))?;
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
        terminal.say(&lines.to_string())?;
        if !left_out.is_empty() {
            terminal.say(&format!("left out: {}", left_out.join(", ")))?;
        }
    }
    if let Some(rates) = &took.rates {
        terminal.say(&format!("a row's speed: {}, {} (--rates)", rates.why, rates.confidence.name()))?;
    }
    terminal.say(&format!("runs: {} (--runs-by, --cut)", took.runs_by))?;
    // Columns that a format fixes are changed by nothing.
    if took.files.iter().flat_map(|file| &file.columns).any(|column| column.chosen.confidence != Confidence::Certain) {
        terminal.say("a column is changed by --map, with its unit if need be: --map t=stamp,left=enc_l[deg]")?;
    }
    Ok(())
}
