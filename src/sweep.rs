//! `yair sweep SCENARIO [--trials N] [--precision P] [--jobs J] [--shard I/N|auto] [--resume] [--rows]
//! [--out DIR] [--summary] [--check BASELINE [--update]]`

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use bench::{AccuracyCheck, Campaign, MAX_TRIALS, Outcome, Shard, SweepOptions, SweepPlan, SweepResult};
use clap::Args;
use scenario::Scenario;
use serde::Serialize;

use crate::html_report::write_sweep;
use crate::new_folders::NewFolders;
use crate::shard::{ShardChoice, locked};
use crate::terminal::{Failure, INTERRUPTED, Terminal, table};
use crate::{sweep_summary, sweep_table};

/// Sweep a scenario by Monte Carlo: bias, spread, coverage and efficiency of every method.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Scenario file (TOML) with a [sweep] section; see scenarios/.
    scenario: PathBuf,
    /// Trials at every point, in place of the scenario's; with --precision, at most so many.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(2..=MAX_TRIALS))]
    trials: Option<u64>,
    /// Run every point until all its Monte-Carlo errors are below this: 1% or 0.01.
    #[arg(long, value_name = "P", value_parser = precision)]
    precision: Option<f64>,
    /// Threads; 0 = one a core. The result does not depend on it.
    #[arg(long, value_name = "J", default_value_t = 0, value_parser = clap::value_parser!(u16).range(0..=MAX_JOBS))]
    jobs: u16,
    /// Seed of every random draw, in place of the scenario's.
    #[arg(long)]
    seed: Option<u64>,
    /// Run part I of N only; `yair merge` puts the parts together. auto: the part that YAIR_SHARD, a Slurm
    /// array, or an indexed Job of Kubernetes with YAIR_SHARDS names.
    #[arg(long, value_name = "I/N|auto", requires = "out")]
    shard: Option<ShardChoice>,
    /// Go on with the interrupted sweep in the folder of --out.
    #[arg(long, requires = "out")]
    resume: bool,
    /// Keep every trial's estimates: trials.parquet in the folder of --out. Needs a build with the feature
    /// parquet.
    #[arg(long, requires = "out")]
    rows: bool,
    /// Write report.html, sweep.json, sweep.csv and a picture into this folder.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print a row a method and a column a point: RMSE and, with a validation path, drift.
    #[arg(long)]
    summary: bool,
    /// Compare with a stored sweep; exit 3 when any number has moved.
    #[arg(long, value_name = "BASELINE", conflicts_with = "shard")]
    check: Option<PathBuf>,
    /// Write the baseline of --check anew and show what moved.
    #[arg(long, requires = "check")]
    update: bool,
}

/// More threads than any machine of ours has cores; a typing error beyond.
const MAX_JOBS: i64 = 1024;

/// Exit code when accuracy has moved, as of `yair evaluate --max-drift`.
const MOVED: u8 = 3;

/// A sweep's document with what a check adds.
#[derive(Serialize)]
struct Document<'a> {
    #[serde(flatten)]
    result: &'a SweepResult,
    #[serde(skip_serializing_if = "Option::is_none")]
    check: Option<&'a AccuracyCheck>,
}

fn precision(text: &str) -> Result<f64, String> {
    let (number, scale) = text.strip_suffix('%').map_or((text, 1.0), |number| (number, 0.01));
    let value = number.trim().parse::<f64>().ok().map(|number| number * scale);
    // Below a hundredth of a per cent every point would need a thousand million trials.
    value
        .filter(|value| (1e-4..=0.5).contains(value))
        .ok_or_else(|| "expected 0.01% to 50%, as in 1% or 0.01".to_owned())
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    let scenario = Scenario::read(&arguments.scenario)?;
    let file = arguments.scenario.display();
    let options = SweepOptions { trials: arguments.trials, seed: arguments.seed, precision: arguments.precision };
    let plan = SweepPlan::new(&scenario, options).map_err(|error| format!("{file}: {error}"))?;
    // Whatever can go wrong at the end is looked at before the trials.
    let baseline = match &arguments.check {
        Some(path) if !arguments.update || path.exists() => Some(bench::read_baseline(path)?),
        _ => None,
    };
    let shard = arguments.shard.map_or(Ok(Shard::WHOLE), |shard| shard.resolved(terminal))?;
    let _new = arguments.out.as_deref().map(NewFolders::to);
    // Until the results stand.
    let _lock = match &arguments.out {
        Some(out) => {
            bench::can_be_written(out, arguments.rows)?;
            Some(locked(out, terminal)?)
        }
        None => None,
    };
    // Without a folder there is nothing to go on with: Ctrl-C ends at once.
    let stop = terminal.stop_flag(arguments.out.is_some());
    let bar = terminal.progress(0, "trials");
    let started = Instant::now();
    let outcome = plan.campaign(&Campaign {
        jobs: arguments.jobs.into(),
        folder: arguments.out.as_deref(),
        resume: arguments.resume,
        shard,
        rows: arguments.rows,
        stop: &stop,
        progress: &|progress| {
            bar.set_length(progress.planned);
            bar.set_position(progress.done);
        },
    })?;
    bar.finish_and_clear();
    let elapsed_s = started.elapsed().as_secs_f64();
    let out = arguments.out.as_deref();
    match outcome {
        Outcome::Stopped(progress) => {
            let goes_on = if out.is_some() { "; the same command with --resume goes on" } else { "" };
            terminal.remark(&format!("stopped after {} of {} trials{goes_on}", progress.done, progress.planned));
            Ok(ExitCode::from(INTERRUPTED))
        }
        Outcome::Shard => {
            let out = out.unwrap_or(Path::new("."));
            terminal.remark(&format!(
                "shard {shard} is in {} after {elapsed_s:.1} s; yair merge combines the shards",
                out.display()
            ));
            Ok(ExitCode::SUCCESS)
        }
        Outcome::Whole(result) => {
            if let Some(out) = out {
                bench::write_results(&plan, &result, arguments.rows, out)?;
                write_sweep(&result, out)?;
            }
            if arguments.summary {
                sweep_summary::show(&result, terminal)?;
            } else {
                sweep_table::show(&result, terminal)?;
            }
            let trials: u64 = result.points.iter().map(|point| point.trials).sum();
            terminal.remark(&format!("{trials} trials in {elapsed_s:.1} s"));
            let check = match (&arguments.check, baseline) {
                (Some(path), Some(baseline)) => Some(bench::compare(&result, &baseline, &path.display().to_string())),
                _ => None,
            };
            conclude(arguments, terminal, &result, check)
        }
    }
}

/// Says what the comparison with the baseline gave, and writes the baseline anew where that is asked for.
fn conclude(
    arguments: &Arguments,
    terminal: &Terminal,
    result: &SweepResult,
    check: Option<Result<AccuracyCheck, bench::BenchError>>,
) -> Result<ExitCode, Failure> {
    // A baseline for other points can be replaced, not compared with.
    let check = match check {
        Some(Err(error)) if arguments.update => {
            terminal.remark(&error.to_string());
            None
        }
        check => check.transpose()?,
    };
    terminal.document(&Document { result, check: check.as_ref() })?;
    if let Some(check) = &check {
        show_check(check, arguments.update, terminal)?;
    }
    if let Some(path) = arguments.check.as_ref().filter(|_| arguments.update) {
        let mut bytes = serde_json::to_vec_pretty(result)?;
        bytes.push(b'\n');
        if let Some(folder) = path.parent() {
            atomic_file::create_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
        }
        atomic_file::write_whole(path, &bytes).map_err(|error| format!("{}: {error}", path.display()))?;
        terminal.remark(&format!("baseline {} is written", path.display()));
        return Ok(ExitCode::SUCCESS);
    }
    let moved = check.is_some_and(|check| !check.moved.is_empty());
    Ok(if moved { ExitCode::from(MOVED) } else { ExitCode::SUCCESS })
}

/// A z for people.
fn shown_z(z: f64, decimals: usize) -> String {
    if z.is_finite() { format!("{z:.decimals$}") } else { "no number".to_owned() }
}

/// Most lines that a person reads of what changed.
const MAX_SHOWN: usize = 20;

fn show_check(check: &AccuracyCheck, update: bool, terminal: &Terminal) -> Result<(), Failure> {
    terminal.say(&format!(
        "accuracy: {} numbers compared, {} moved beyond |z| = {:.2} (one false positive in {:.0} comparisons); largest |z| = {}",
        check.compared,
        check.moved.len(),
        check.z_limit,
        1.0 / check.false_alarm_budget,
        shown_z(check.largest_z, 2)
    ))?;
    let shown = if update { &check.changed } else { &check.moved };
    if shown.is_empty() {
        return Ok(());
    }
    let mut rows = table(&["point", "method", "", "number", "was", "is", "z"], 4);
    for number in shown.iter().take(MAX_SHOWN) {
        rows.add_row([
            number.point.clone(),
            number.method.clone(),
            sweep_table::symbol(&number.parameter).to_owned(),
            number.statistic.to_owned(),
            format!("{:.4e}", number.was),
            format!("{:.4e}", number.is),
            shown_z(number.z, 1),
        ]);
    }
    terminal.say(&rows.to_string())?;
    if shown.len() > MAX_SHOWN {
        terminal.say(&format!("and {} more", shown.len() - MAX_SHOWN))?;
    }
    Ok(())
}
