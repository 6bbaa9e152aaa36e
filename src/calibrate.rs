//! `yair calibrate DATASET... [--method M] [--out FILE]`, and `--online`

mod follow;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use calib::methods::joint::{Joint, LargeCalibrationError};
use calib::{
    CalibError, Calibration, CalibrationReport, METHODS, Method, MethodReport, Names, TrainedOn, nominal_value,
};
use clap::Args;
use clap::builder::PossibleValuesParser;
use dataset::{Blocks, NominalRobot, Session, Warning};
use estimation::Column;
use estimation::{OneStep, RISE_95, is_large, refuse_wrapped_counters};

use crate::check;
use crate::html_report::{CalibrationPage, refuse_file};
use crate::log::blocks_at;
use crate::simulate::write_whole;
use crate::terminal::{Failure, Terminal, advance, cell, datasets_at, read_datasets, table};

/// Calibrate a robot: wheel diameters and wheel separation from its sessions.
#[derive(Args)]
#[command(after_help = methods())]
pub(crate) struct Arguments {
    /// Datasets; several are one robot's sessions, calibrated together. A folder of datasets means all
    /// of them.
    #[arg(required = true, value_name = "DATASET")]
    datasets: Vec<PathBuf>,
    /// Method, or `all` for each one that applies.
    #[arg(long, default_value = "joint", value_parser = PossibleValuesParser::new(METHODS.iter().map(|method| method.name()).chain([ALL])))]
    method: String,
    /// Find the 95 % interval of each parameter of `joint` from the likelihood's own rise, which need not be
    /// symmetric.
    #[arg(long, conflicts_with = "online")]
    profile: bool,
    /// Follow the parameters through the logs as the robot would on line, a measurement after the other, and
    /// say when they have settled.
    #[arg(long, conflicts_with_all = ["method", "out"])]
    online: bool,
    /// Write the calibration to a file that `yair evaluate --calibration` takes. Another
    /// calibration there is replaced, any other file is kept.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Folder for report.html: the parameters, the path and the drift of every run, before and after. A
    /// report.html there is replaced.
    #[arg(long, value_name = "DIR", conflicts_with = "online")]
    out_dir: Option<PathBuf>,
    /// Calibrate although `yair check` finds an error or the result cannot be the stated robot, give values
    /// that the data do not determine.
    #[arg(long)]
    force: bool,
}

const ALL: &str = "all";

fn methods() -> String {
    let lines: Vec<_> = METHODS.iter().map(|method| format!("  {:16} {}", method.name(), method.about())).collect();
    format!("Methods:\n{}", lines.join("\n"))
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    if let Some(out) = &arguments.out {
        refuse_other_file(out)?;
    }
    refuse_file(arguments.out_dir.as_deref())?;
    let joint = Joint::DEFAULT.name();
    let chosen: Vec<&dyn Method> =
        METHODS.iter().copied().filter(|method| arguments.method == ALL || method.name() == arguments.method).collect();
    let has_joint = chosen.iter().any(|method| method.name() == joint);
    let large =
        if has_joint && !arguments.online && !arguments.profile { large_datasets(&arguments.datasets)? } else { None };
    // What is large is held for the methods that can do nothing else.
    let datasets =
        if large.is_some() && chosen.len() == 1 { Vec::new() } else { read_datasets(&arguments.datasets, terminal)? };
    let sessions: Vec<Session<'_>> = datasets.iter().map(dataset::Dataset::session).collect();
    match (datasets.is_empty(), arguments.force) {
        (true, true) => check::before_reading(&datasets_at(&arguments.datasets)?, terminal),
        (true, false) => check::refuse_before_reading(&datasets_at(&arguments.datasets)?, terminal)?,
        (false, true) => check::before(&datasets, terminal),
        (false, false) => check::refuse(&datasets, terminal)?,
    }
    refuse_wrapped_counters(&sessions)?;
    if arguments.online {
        return follow::run(&sessions, terminal);
    }
    let headers: Vec<&dataset::Dataset> = match &large {
        Some(large) => large.iter().map(Blocks::header).collect(),
        None => datasets.iter().collect(),
    };
    let names = Names::of(headers.iter().filter_map(|header| header.provenance.name.clone()).collect());
    let robot = headers[0].robot;
    let runs = match &large {
        Some(large) => large.iter().map(|blocks| blocks.infos().len()).sum(),
        None => sessions.iter().map(|session| session.runs.len()).sum(),
    };
    let mut large = large;
    let mut outcomes = Vec::with_capacity(chosen.len());
    let bar = terminal.stages("calibrate");
    let methods = chosen.len() as f64;
    for (number, method) in chosen.into_iter().enumerate() {
        advance(&bar, method.name(), number as f64 / methods);
        let outcome = match &mut large {
            Some(large) if method.name() == joint => calibrate_large(large, &arguments.datasets, terminal)?,
            _ => method.calibrate(&sessions),
        };
        outcomes.push((method.name(), outcome));
    }
    bar.finish_and_clear();
    let mut report = CalibrationReport {
        dataset: names,
        trained_on: sessions.iter().map(TrainedOn::of).collect(),
        methods: outcomes.iter().map(|(name, outcome)| MethodReport::new(name, outcome, &robot)).collect(),
    };
    if arguments.profile {
        add_profiles(&mut report, &sessions)?;
    }
    if !arguments.force {
        report.methods.iter_mut().for_each(|method| method.withhold_undetermined(method.method == joint));
    }
    // One method asked for by name and not applicable is a failure; the JSON still says so in its place.
    let refused = outcomes.iter().find_map(|(_, outcome)| outcome.as_ref().err());
    let nothing_found = outcomes.iter().all(|(_, outcome)| outcome.is_err());
    if let (true, Some(refused)) = (nothing_found, refused) {
        terminal.document(&report)?;
        return Err(refused.to_string().into());
    }
    if let (false, [only]) = (arguments.force, &report.methods[..])
        && let Some(why) = why_no_result(only)
    {
        terminal.document(&report)?;
        return Err(format!("{why}; --force gives the numbers all the same").into());
    }
    if let Some(out) = &arguments.out {
        write_whole(out, report.to_toml()?.as_bytes())?;
        terminal.remark(&format!("calibration in {}", out.display()));
    }
    if let Some(out) = &arguments.out_dir {
        CalibrationPage { report: &report, robot: &robot, datasets: &datasets }.write(out)?;
        terminal.remark(&format!("report.html in {}", out.display()));
    }
    show(&report, &robot, runs, terminal)?;
    terminal.document(&report)?;
    Ok(ExitCode::SUCCESS)
}

/// Datasets that `joint` calibrates part by part; `None` where they are calibrated as a whole.
pub(crate) fn large_datasets(paths: &[PathBuf]) -> Result<Option<Vec<Blocks>>, Failure> {
    Ok(blocks_at(paths)?.filter(|blocks| is_large(blocks)))
}

/// `joint` on large datasets; what was noticed of them is said.
fn calibrate_large(
    datasets: &mut [Blocks],
    paths: &[PathBuf],
    terminal: &Terminal,
) -> Result<Result<Calibration, CalibError>, Failure> {
    let paths = datasets_at(paths)?;
    let remark = |number: usize, warning: &Warning| {
        terminal.remark(&format!("warning: {}: {warning}", paths[number].display()));
    };
    for (number, blocks) in datasets.iter().enumerate() {
        blocks.warnings().iter().for_each(|warning| remark(number, warning));
    }
    match Joint::DEFAULT.calibrate_large(datasets, remark) {
        Ok(found) => Ok(Ok(found)),
        Err(LargeCalibrationError::Calib(error)) => Ok(Err(error)),
        Err(error) => Err(error.into()),
    }
}

/// Profile intervals of what `joint` fits, in the report's own parameters.
fn add_profiles(report: &mut CalibrationReport, sessions: &[Session<'_>]) -> Result<(), Failure> {
    let joint =
        report.methods.iter_mut().find(|method| method.method == Joint::DEFAULT.name() && method.error.is_none());
    let Some(joint) = joint else {
        return Err("--profile needs the method joint (or all), and that it applies".to_owned().into());
    };
    let found = Joint::DEFAULT.settings.fit(sessions).map_err(|error| error.to_string())?;
    for (column, keys) in [
        (Column::LeftWheel, &["left_wheel_diameter_m", "left_m_per_tick"][..]),
        (Column::RightWheel, &["right_wheel_diameter_m", "right_m_per_tick"]),
        (Column::Separation, &["wheel_separation_m"]),
        (Column::SensorX, &["sensor_x_m"]),
        (Column::SensorY, &["sensor_y_m"]),
        (Column::SensorTheta, &["sensor_theta_rad"]),
    ] {
        let present = keys.iter().any(|key| joint.parameters.contains_key(*key));
        if !present || !found.columns.contains(&column) {
            continue;
        }
        let (low, high) = found.profile(column, RISE_95).map_err(|error| error.to_string())?;
        for key in keys {
            if let Some(value) = joint.parameters.get_mut(*key)
                && let Some(found) = value.value
            {
                // The steps of the geometry are relative, those of the mounting are added.
                let at = |by: f64| {
                    if Column::GEOMETRY.contains(&column) { found * by.exp() } else { found + by }
                };
                value.interval_95 = Some([at(low), at(high)]);
            }
        }
    }
    Ok(())
}

fn show(report: &CalibrationReport, robot: &NominalRobot, runs: usize, terminal: &Terminal) -> Result<(), Failure> {
    let profiled =
        report.methods.iter().flat_map(|method| method.parameters.values()).any(|value| value.interval_95.is_some());
    let mut headers = vec!["method", "parameter", "nominal", "value", "ratio", "sigma", "unit"];
    if profiled {
        headers.splice(6..6, ["95 % from", "to"]);
    }
    let mut table = table(&headers, 2);
    for method in &report.methods {
        for (key, value) in &method.parameters {
            let (scale, unit) = match () {
                () if key.ends_with("_rad") => (180.0 / std::f64::consts::PI, "deg"),
                () if key.ends_with("_s") => (1e3, "ms"),
                () => (1e3, "mm"),
            };
            let decimals = decimals(value.sigma.map(|sigma| scale * sigma));
            let mut row = vec![
                method.method.clone(),
                key.clone(),
                cell(nominal_value(robot, key), scale, decimals),
                value.value.map_or_else(|| "not determined".to_owned(), |found| cell(Some(found), scale, decimals)),
                cell(value.ratio_to_nominal, 1.0, ratio_decimals(value.sigma.zip(value.value))),
                cell(value.sigma, scale, decimals),
            ];
            if profiled {
                row.extend([0, 1].map(|end| cell(value.interval_95.map(|interval| interval[end]), scale, decimals)));
            }
            row.push(unit.to_owned());
            table.add_row(row);
        }
    }
    terminal.say(&table.to_string())?;
    for method in &report.methods {
        let name = &method.method;
        if let Some(error) = &method.error {
            terminal.say(&error.clone())?;
            continue;
        }
        let rejected = method.runs_rejected.len();
        terminal.say(&format!("{name}: {} of {runs} runs used, {rejected} values rejected", method.runs_used))?;
        if let Some(OneStep { measurements, first_measurements, .. }) = method.one_step {
            terminal
                .say(&format!("  {first_measurements} measurements fitted, then one step over all {measurements}"))?;
        }
        for rejected in &method.runs_rejected {
            terminal.say(&format!("  rejected {}: {}", rejected.run, rejected.why))?;
        }
        if let Some(noise) = method.noise.filter(|noise| noise.is_assumed) {
            let wheel_mm = 1e3 * noise.wheel_sigma_m_per_sqrt_m;
            terminal.say(&format!(
                "  the measurements are no more than what is fitted to them and show no scatter: sigma is that of \
                 wheels that err by {wheel_mm:.1} mm/√m, as is usual; more runs would show theirs"
            ))?;
        }
        for warning in &method.warnings {
            terminal.remark(&format!("warning: {name}: {warning}"));
        }
        for remark in &method.remarks {
            terminal.remark(&format!("warning: {name}: {remark}"));
        }
        if let Some(latency_s) = method.parameters.get("latency_s").and_then(|latency| latency.value) {
            let late = if latency_s < 0.0 { "early" } else { "late" };
            terminal.say(&format!("  the poses are {:.1} ms {late} against the log", 1e3 * latency_s.abs()))?;
        }
        for blind in &method.not_observable {
            terminal.say(&format!("  not determined: {}: {}", blind.parameter, blind.why))?;
        }
    }
    Ok(())
}

/// Refuses to replace what is no calibration.
fn refuse_other_file(out: &Path) -> Result<(), Failure> {
    if out.exists() && CalibrationReport::read(out).is_err() {
        let why = "already exists and is no calibration file; nothing was written: choose another name";
        return Err(format!("{}: {why}", out.display()).into());
    }
    Ok(())
}

/// Why the only method asked for gives no result that a robot should use.
pub(crate) fn why_no_result(method: &MethodReport) -> Option<String> {
    let name = &method.method;
    let rejected = method.runs_rejected.first();
    if method.runs_used == 0 {
        let why = rejected.map_or_else(String::new, |rejected| format!(": run {}: {}", rejected.run, rejected.why));
        return Some(format!("{name}: no run was used{why}; yair check says what is wrong with them"));
    }
    if !method.determines_anything() {
        let mut reasons: Vec<&str> = method.not_observable.iter().map(|blind| blind.why.as_str()).collect();
        reasons.dedup();
        return Some(format!("{name}: these runs determine no parameter by itself: {}", reasons.join("; ")));
    }
    if !method.converged {
        let why = "the fit did not converge, so that its numbers are no result; yair check says what is wrong";
        return Some(format!("{name}: {why}"));
    }
    if let Some(warning) = method.warnings.first() {
        return Some(format!("{name}: the result is no correction of the stated robot: {warning}"));
    }
    None
}

/// Decimals that show two digits of sigma, six where there is none.
fn decimals(sigma: Option<f64>) -> usize {
    sigma.filter(|sigma| *sigma > 0.0).map_or(6, |sigma| (1.0 - sigma.log10().floor()).clamp(0.0, 9.0) as usize)
}

/// Decimals of a ratio that show two digits of its standard deviation.
fn ratio_decimals(sigma_and_value: Option<(f64, f64)>) -> usize {
    sigma_and_value.map_or(4, |(sigma, value)| decimals(Some(sigma / value.abs())).clamp(3, 6))
}
