//! `yair import csv FILE... --out DIR`

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use dataset::import::csv::{
    self, Confidence, Decimal, Delimiter, FromCsv, MapEntry, Options, Rates, RobotGiven, Took, TookFile, Writing,
};
use dataset::{DatasetError, NominalRobot, Unit};
use kinematics::Wheels;
use serde::{Deserialize, Serialize};

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

    /// Nominal wheel diameter, metres; two with a comma are left and right.
    #[arg(long, value_name = "METRES", value_parser = diameters, help_heading = "Robot")]
    wheel: Option<Wheels<f64>>,
    /// Nominal distance between the wheel contacts, metres.
    #[arg(long, value_name = "METRES", value_parser = base, help_heading = "Robot")]
    base: Option<f64>,
    /// Counts for one turn of the wheel, after decoding and gears; need not be whole.
    #[arg(long, value_name = "COUNTS", value_parser = positive, help_heading = "Robot")]
    ticks_per_rev: Option<f64>,
    /// Width of the counters, where they wrap.
    #[arg(long, value_name = "BITS", value_parser = clap::value_parser!(u8).range(2..=63), help_heading = "Robot")]
    counter_bits: Option<u8>,
    /// A dataset.toml, or a file with its [robot], instead of the four.
    #[arg(long, value_name = "FILE", help_heading = "Robot")]
    robot: Option<PathBuf>,

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

/// Largest wheel or base that is taken for metres: beyond it, millimetres are meant.
const LARGEST_M: f64 = 10.0;

fn positive(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(number) if number.is_finite() && number > 0.0 => Ok(number),
        _ => Err("expected a positive number".to_owned()),
    }
}

fn base(text: &str) -> Result<f64, String> {
    match positive(text)? {
        length_m if length_m < LARGEST_M => Ok(length_m),
        length => Err(format!("{length} m is no robot's; metres are expected: {} for millimetres", length / 1e3)),
    }
}

fn diameters(text: &str) -> Result<Wheels<f64>, String> {
    match text.split_once(',') {
        Some((left, right)) => Ok(Wheels { left: base(left)?, right: base(right)? }),
        None => base(text).map(Wheels::both),
    }
}

/// A value of a fixed list, by its name.
fn named<T: Copy + Send + Sync + 'static>(
    all: &[T],
    name: fn(T) -> &'static str,
) -> impl TypedValueParser<Value = T> + use<T> {
    let all = all.to_vec();
    PossibleValuesParser::new(all.iter().map(|value| name(*value)).collect::<Vec<_>>())
        .try_map(move |text| all.iter().copied().find(|value| name(*value) == text).ok_or("no such value"))
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

fn rates() -> impl TypedValueParser<Value = Rates> {
    named(&[Rates::IntervalEnd, Rates::Instantaneous], Rates::name)
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
    let FromCsv { imported, took } = csv::read(&arguments.files, &arguments.options()?).map_err(with_command_line)?;
    show(&took, terminal)?;
    for warning in &imported.warnings {
        terminal.remark(&format!("warning: {warning}"));
    }
    for remark in &took.remarks {
        terminal.remark(&format!("warning: {remark}"));
    }
    let dataset = &imported.dataset;
    write_dataset(dataset, &arguments.out, arguments.force)?;
    let written = Written {
        dataset: arguments.out.display().to_string(),
        runs: dataset.runs.len(),
        odometry_rows: dataset.runs.iter().map(|run| run.odometry.t_s.len()).sum(),
    };
    let Written { dataset: out, runs, odometry_rows } = &written;
    terminal.say(&format!("{runs} runs, {odometry_rows} odometry rows in {out}"))?;
    let sources: Vec<String> = arguments.files.iter().map(|file| file.display().to_string()).collect();
    terminal.document(&Document { format: "csv", source: sources.join(" "), datasets: [written], took: &took })?;
    Ok(ExitCode::SUCCESS)
}

impl Arguments {
    fn options(&self) -> Result<Options, Failure> {
        let robot = self.robot.as_ref().map(|file| read_robot(file)).transpose()?;
        let diameter =
            |robot: NominalRobot| Wheels { left: robot.left_wheel_diameter_m, right: robot.right_wheel_diameter_m };
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
            robot: RobotGiven {
                wheel_diameter_m: self.wheel.or(robot.map(diameter)),
                wheel_separation_m: self.base.or(robot.map(|robot| robot.wheel_separation_m)),
                ticks_per_rev: self.ticks_per_rev.or(robot.and_then(|robot| robot.ticks_per_rev)),
                counter_bits: self.counter_bits.or(robot.and_then(|robot| robot.counter_bits)),
            },
        })
    }
}

/// The robot of a dataset.toml.
fn read_robot(file: &PathBuf) -> Result<NominalRobot, Failure> {
    #[derive(Deserialize)]
    struct WithRobot {
        robot: NominalRobot,
    }
    let text = std::fs::read_to_string(file).map_err(|error| format!("{}: {error}", file.display()))?;
    let with_robot: WithRobot = toml::from_str(&text)
        .map_err(|error| format!("{}: no [robot] of a dataset: {}", file.display(), error.message()))?;
    Ok(with_robot.robot)
}

/// What is missing, as the command line to type.
fn with_command_line(error: DatasetError) -> Failure {
    let DatasetError::RobotNotGiven { flags, .. } = &error else { return error.into() };
    let quoted = |argument: String| {
        if argument.contains([' ', '[', '*', ';', '|']) { format!("'{argument}'") } else { argument }
    };
    let typed: Vec<String> = std::env::args().skip(1).map(quoted).collect();
    format!("{error}, like this: yair {} {flags}", typed.join(" ")).into()
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
    terminal.say("a column is changed by --map, with its unit if need be: --map t=stamp,left=enc_l[deg]")
}
