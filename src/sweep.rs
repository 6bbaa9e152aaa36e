//! `yair sweep SCENARIO [--trials N] [--jobs J] [--out DIR]`

use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use bench::{EstimatorResult, SweepPlan, SweepResult};
use clap::Args;
use scenario::Scenario;

use crate::terminal::{Failure, Terminal, table};

/// Monte-Carlo: bias, standard deviation and RMSE of every method over the levels of a scenario.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Scenario file (TOML) with a [sweep] section; see scenarios/.
    scenario: PathBuf,
    /// Trials at every point, in place of the scenario's.
    #[arg(long, value_name = "N")]
    trials: Option<u64>,
    /// Threads; 0 = one a core. The result does not depend on it.
    #[arg(long, value_name = "J", default_value_t = 0, value_parser = clap::value_parser!(u16).range(0..=MOST_JOBS))]
    jobs: u16,
    /// Seed of every random draw, in place of the scenario's.
    #[arg(long)]
    seed: Option<u64>,
    /// Write sweep.json and sweep.csv into this folder.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// More threads than any machine of ours has cores; a typing error beyond.
const MOST_JOBS: i64 = 1024;

/// More than a year of any scenario; a typing error beyond, whose bookkeeping alone would not fit into memory.
const MOST_TRIALS: u64 = 100_000_000;

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    let scenario = Scenario::read(&arguments.scenario)?;
    let file = arguments.scenario.display();
    let trials = arguments.trials.or(scenario.sweep.as_ref().map(|sweep| sweep.trials));
    if let Some(trials) = trials.filter(|trials| *trials > MOST_TRIALS) {
        return Err(format!("{file}: {trials} trials at each point; expected at most {MOST_TRIALS}").into());
    }
    let plan =
        SweepPlan::new(&scenario, arguments.trials, arguments.seed).map_err(|error| format!("{file}: {error}"))?;
    if let Some(out) = &arguments.out {
        can_be_written(out)?;
    }
    let bar = terminal.progress(plan.total_trials(), "trials");
    let started = Instant::now();
    let result = plan.run(usize::from(arguments.jobs), &|trials| bar.inc(trials))?;
    bar.finish_and_clear();
    let elapsed_s = started.elapsed().as_secs_f64();
    if let Some(out) = &arguments.out {
        bench::write_results(&result, out)?;
    }
    show(&result, terminal)?;
    terminal.remark(&format!("{} trials in {elapsed_s:.1} s", plan.total_trials()));
    terminal.document(&result)?;
    Ok(ExitCode::SUCCESS)
}

/// Fails before the trials are run, not after, when the results could not be written. Leaves nothing behind.
fn can_be_written(out: &Path) -> Result<(), Failure> {
    let failed = |error: io::Error| format!("{}: cannot write results there: {}", out.display(), error.kind());
    if out.exists() {
        tempfile::tempfile_in(out).map_err(failed)?;
        return Ok(());
    }
    let made = out.ancestors().filter(|folder| !folder.as_os_str().is_empty() && !folder.exists());
    let made: Vec<&Path> = made.collect();
    std::fs::create_dir_all(out).map_err(failed)?;
    let probed = tempfile::tempfile_in(out).map_err(failed);
    for folder in made {
        // Only what is still empty goes.
        let _ = std::fs::remove_dir(folder);
    }
    probed.map(drop).map_err(Failure::from)
}

/// A parameter as the paper writes it.
fn symbol(parameter: &str) -> &str {
    match parameter {
        "left_m_per_tick" => "C_L",
        "right_m_per_tick" => "C_R",
        "wheel_separation_m" => "B",
        other => other,
    }
}

fn show(result: &SweepResult, terminal: &Terminal) -> Result<(), Failure> {
    terminal.say(&format!(
        "{}: seed {}, {} trials at each of {} points; errors in per cent of the true value, each ± its Monte-Carlo standard error",
        result.scenario,
        result.seed,
        result.trials,
        result.points.len()
    ))?;
    let axes: Vec<&str> =
        result.points.first().map_or(Vec::new(), |point| point.levels.keys().map(String::as_str).collect());
    for (number, axis) in axes.iter().enumerate() {
        terminal.say(&format!("  axis {}: {axis}", number + 1))?;
    }
    let numbers: Vec<String> = (1..=axes.len()).map(|number| format!("axis {number}")).collect();
    let headers: Vec<&str> =
        numbers.iter().map(String::as_str).chain(["method", "", "bias %", "std %", "RMSE %", "cover"]).collect();
    let mut table = table(&headers, axes.len() + 2);
    let mut blind = false;
    for point in &result.points {
        // A level or a method is printed where it begins, so that the eye finds the blocks.
        let mut levels: Vec<String> = point.levels.values().map(ToString::to_string).collect();
        let mut method = "";
        for estimator in &point.estimators {
            let percent = |pair: Option<(f64, f64)>| {
                pair.map_or_else(
                    || "–".to_owned(),
                    |(value, error)| percent(value / estimator.truth, error / estimator.truth),
                )
            };
            let mark = if estimator.common_scale_observable { "" } else { "*" };
            blind |= !estimator.common_scale_observable;
            let name = if estimator.method == method { "" } else { &estimator.method };
            method = &estimator.method;
            table.add_row(levels.iter().cloned().chain([
                name.to_owned(),
                format!("{}{mark}", symbol(&estimator.parameter)),
                percent(estimator.bias.zip(estimator.bias_mcse)),
                percent(estimator.std()),
                percent(estimator.rmse.zip(estimator.rmse_mcse)),
                coverage(estimator),
            ]));
            levels.iter_mut().for_each(String::clear);
        }
    }
    terminal.say(&table.to_string())?;
    if blind {
        terminal.say("* cannot see the scale common to both wheels: its bias is the scale that was not measured")?;
    }
    Ok(())
}

/// `value ± error` in per cent, to the error's first digit: no digit is printed that the trials do not carry.
fn percent(value: f64, error: f64) -> String {
    let error = 100.0 * error;
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let decimals = if error > 0.0 { (-error.log10().floor()).clamp(0.0, 7.0) as usize } else { 4 };
    format!("{:.decimals$} ± {error:.decimals$}", 100.0 * value)
}

fn coverage(estimator: &EstimatorResult) -> String {
    estimator.coverage.map_or_else(|| "–".to_owned(), |coverage| format!("{:.1}%", 100.0 * coverage))
}
