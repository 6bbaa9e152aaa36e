//! `yair calibrate DATASET... [--method M] [--out FILE]`, and `--online`

mod follow;

use std::path::PathBuf;
use std::process::ExitCode;

use calib::{CalibrationReport, METHODS, Method, MethodReport, Names, refuse_wrapped_counters};
use clap::Args;
use clap::builder::PossibleValuesParser;
use dataset::{NominalRobot, Session};

use crate::simulate::write_whole;
use crate::terminal::{Failure, Terminal, cell, read_datasets, table};

/// Calibrate one robot from its sessions.
#[derive(Args)]
#[command(after_help = methods())]
pub(crate) struct Arguments {
    /// Datasets; several are one robot's sessions, calibrated together.
    #[arg(required = true, value_name = "DATASET")]
    datasets: Vec<PathBuf>,
    /// Method, or `all` for each one that applies.
    #[arg(long, default_value = "joint", value_parser = PossibleValuesParser::new(METHODS.iter().map(|method| method.name()).chain([ALL])))]
    method: String,
    /// Follow the parameters through the logs as the robot would on line, a look after the other, and say when they have settled.
    #[arg(long, conflicts_with_all = ["method", "out"])]
    online: bool,
    /// Write the calibration to a file that `yair evaluate --calibration` takes.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

const ALL: &str = "all";

fn methods() -> String {
    let lines: Vec<_> = METHODS.iter().map(|method| format!("  {:16} {}", method.name(), method.about())).collect();
    format!("Methods:\n{}", lines.join("\n"))
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    let datasets = read_datasets(&arguments.datasets, terminal)?;
    let sessions: Vec<Session<'_>> = datasets.iter().map(dataset::Dataset::session).collect();
    refuse_wrapped_counters(&sessions)?;
    if arguments.online {
        return follow::run(&sessions, terminal);
    }
    let chosen: Vec<&dyn Method> =
        METHODS.iter().copied().filter(|method| arguments.method == ALL || method.name() == arguments.method).collect();
    let outcomes: Vec<_> = chosen.iter().map(|method| (method.name(), method.calibrate(&sessions))).collect();
    let report = CalibrationReport {
        dataset: Names::of(sessions.iter().map(|session| session.name.to_owned()).collect()),
        methods: outcomes.iter().map(|(name, outcome)| MethodReport::new(name, outcome, sessions[0].robot)).collect(),
    };
    // One method asked for by name and not applicable is a failure; the JSON still says so in its place.
    let refused = outcomes.iter().find_map(|(_, outcome)| outcome.as_ref().err());
    let nothing_found = outcomes.iter().all(|(_, outcome)| outcome.is_err());
    if let (true, Some(refused)) = (nothing_found, refused) {
        terminal.document(&report)?;
        return Err(refused.to_string().into());
    }
    if let Some(out) = &arguments.out {
        write_whole(out, report.to_toml()?.as_bytes())?;
        terminal.remark(&format!("calibration in {}", out.display()));
    }
    show(&report, &sessions, terminal)?;
    terminal.document(&report)?;
    Ok(ExitCode::SUCCESS)
}

fn show(report: &CalibrationReport, sessions: &[Session<'_>], terminal: &Terminal) -> Result<(), Failure> {
    let robot = sessions[0].robot;
    let runs: usize = sessions.iter().map(|session| session.runs.len()).sum();
    let mut table = table(&["method", "parameter", "nominal", "value", "sigma", "unit"], 2);
    for method in &report.methods {
        for (key, value) in &method.parameters {
            let (scale, unit) = if key.ends_with("_rad") { (180.0 / std::f64::consts::PI, "deg") } else { (1e3, "mm") };
            let decimals = decimals(value.sigma.map(|sigma| scale * sigma));
            table.add_row([
                method.method.clone(),
                key.clone(),
                cell(nominal(robot, key), scale, decimals),
                cell(Some(value.value), scale, decimals),
                cell(value.sigma, scale, decimals),
                unit.to_owned(),
            ]);
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
        for rejected in &method.runs_rejected {
            terminal.say(&format!("  rejected {}: {}", rejected.run, rejected.why))?;
        }
        for warning in &method.warnings {
            terminal.remark(&format!("warning: {name}: {warning}"));
        }
        for blind in &method.not_observable {
            terminal.say(&format!("  cannot tell {}: {}", blind.parameter, blind.why))?;
        }
    }
    Ok(())
}

/// What the robot believes of a parameter.
fn nominal(robot: &NominalRobot, key: &str) -> Option<f64> {
    let per_tick = |diameter_m: f64| Some(std::f64::consts::PI * diameter_m / robot.ticks_per_rev?);
    match key {
        "left_wheel_diameter_m" => Some(robot.left_wheel_diameter_m),
        "right_wheel_diameter_m" => Some(robot.right_wheel_diameter_m),
        "wheel_separation_m" => Some(robot.wheel_separation_m),
        "left_m_per_tick" => per_tick(robot.left_wheel_diameter_m),
        "right_m_per_tick" => per_tick(robot.right_wheel_diameter_m),
        _ => None,
    }
}

/// Decimals that show two digits of sigma, six where there is none.
fn decimals(sigma: Option<f64>) -> usize {
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    sigma.filter(|sigma| *sigma > 0.0).map_or(6, |sigma| (1.0 - sigma.log10().floor()).clamp(0.0, 9.0) as usize)
}
