//! `yair fleet DIR... [--out DIR] [--jobs N] [--csv FILE] [--html FILE] [--calibrate-only] [--fdr RATE]`

mod csv_table;
mod document;
mod session;
mod store;
mod table;

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use ::fleet::{DEFAULT_FALSE_DISCOVERY_RATE, Failed, Fleet, FleetSession, SessionResult};
use clap::Args;

use crate::html_report;
use crate::simulate::write_whole;
use crate::terminal::{Failure, INTERRUPTED, Terminal, is_dataset, refuse_doubles};
use store::SessionStore;

/// Watch many robots: drift, parameters, findings, changes, and which robot to service first.
///
/// Datasets with the same `[robot] id` are sessions of one robot, in the order of `recorded`; a dataset
/// without an id is a robot of its own. A dataset that fails is listed and stops no other; the exit code is
/// then 1. docs/fleet.md explains the columns.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Datasets, or folders of datasets, which are searched two levels deep: DIR/ROBOT/SESSION.
    #[arg(required = true, value_name = "DIR")]
    dirs: Vec<PathBuf>,
    /// Folder that keeps what was found in every dataset, by the hash of its files, the options and the
    /// version: the next call computes only what is new.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Datasets that are worked on at once, each in memory as a whole; 0 = one a core. The result does not
    /// depend on it.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u16).range(0..=MAX_JOBS))]
    jobs: u16,
    /// Write a row for each session into this file, which is replaced.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write the page of the fleet into this file, which is replaced.
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Calibrate without a diagnosis: no findings, in a fraction of the time.
    #[arg(long)]
    calibrate_only: bool,
    /// False-discovery rate: the expected share of false ones among the changes called significant, and among
    /// the robots called to drift in excess.
    #[arg(long, value_name = "RATE", default_value_t = DEFAULT_FALSE_DISCOVERY_RATE, value_parser = rate)]
    fdr: f64,
}

/// More threads than any machine of ours has cores; a typing error beyond.
const MAX_JOBS: i64 = 1024;

/// Folders between a given one and its datasets, at most.
const MAX_DEPTH: usize = 2;

fn rate(text: &str) -> Result<f64, String> {
    let value = text.trim().parse::<f64>().ok();
    value.filter(|value| (1e-6..=0.5).contains(value)).ok_or_else(|| "expected a rate from 0.000001 to 0.5".to_owned())
}

/// What became of a dataset.
enum Outcome {
    Computed(Box<SessionResult>),
    Reused(Box<SessionResult>),
    Failed(String),
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    for file in arguments.csv.iter().chain(&arguments.html) {
        refuse_no_file(file)?;
    }
    let datasets = datasets_of(&arguments.dirs)?;
    // Until the results stand.
    let store = arguments.out.as_deref().map(SessionStore::open).transpose()?;
    if let Some(why) = store.as_ref().and_then(SessionStore::why_not_locked) {
        terminal.remark(&format!("warning: {why}"));
    }
    let Some(outcomes) = outcomes(&datasets, arguments, store.as_ref(), terminal)? else {
        let goes_on = if store.is_some() { "; the same command goes on" } else { "" };
        terminal.remark(&format!("stopped{goes_on}"));
        return Ok(ExitCode::from(INTERRUPTED));
    };
    let (mut sessions, mut failed) = (Vec::new(), Vec::new());
    let (mut computed, mut reused) = (0, 0);
    let mut same: BTreeMap<String, String> = BTreeMap::new();
    for (path, (key, outcome)) in datasets.iter().zip(outcomes) {
        let dataset = path.display().to_string();
        let result = match outcome {
            Outcome::Failed(error) => {
                failed.push(Failed { dataset, error });
                continue;
            }
            Outcome::Computed(result) => {
                computed += 1;
                *result
            }
            Outcome::Reused(result) => {
                reused += 1;
                *result
            }
        };
        // The same runs twice are no two sessions.
        if let Some(first) = same.get(&key) {
            failed.push(Failed { dataset, error: format!("its files are those of {first}; give each session once") });
            continue;
        }
        same.insert(key, dataset.clone());
        for remark in &result.remarks {
            terminal.remark(&format!("warning: {dataset}: {remark}"));
        }
        sessions.push(FleetSession { dataset, result });
    }
    let fleet = Fleet::of(sessions, failed, arguments.fdr);
    for robot in &fleet.robots {
        for warning in &robot.warnings {
            terminal.remark(&format!("warning: robot {}: {warning}", robot.id));
        }
    }
    if let Some(file) = &arguments.csv {
        write_whole(file, &csv_table::of(&fleet)?)?;
        terminal.remark(&format!("a row for each session in {}", file.display()));
    }
    if let Some(file) = &arguments.html {
        html_report::write_fleet(&fleet, file)?;
        terminal.remark(&format!("the page of the fleet in {}", file.display()));
    }
    table::show(&fleet, terminal)?;
    terminal.remark(&format!("{computed} datasets computed, {reused} reused"));
    terminal.document(&document::Document::of(&fleet, computed, reused))?;
    match fleet.failed.len() {
        0 => Ok(ExitCode::SUCCESS),
        count => {
            let first = &fleet.failed[0];
            let what = format!("{count} of {} datasets failed", datasets.len());
            terminal.remark(&format!(
                "error: {what}, the others are complete; the first is {}: {}",
                first.dataset, first.error
            ));
            Ok(ExitCode::FAILURE)
        }
    }
}

/// Datasets in or below these folders, as `yair fleet` finds them, of which the folder of its `--out` keeps
/// no result yet: what other machines may be given to compute. A dataset that cannot be read is among them.
///
/// # Errors
/// A message that names the folder: it is not there, it has no dataset, or another process writes into `out`.
pub fn datasets_to_compute(dirs: &[PathBuf], out: &Path, calibrate_only: bool) -> Result<Vec<PathBuf>, String> {
    let datasets = datasets_of(dirs).map_err(|failure| failure.to_string())?;
    let store = SessionStore::open(out).map_err(|failure| failure.to_string())?;
    let is_kept = |path: &PathBuf| store::key(path, calibrate_only).is_ok_and(|key| store.read(&key).is_some());
    Ok(datasets.into_iter().filter(|path| !is_kept(path)).collect())
}

/// Refuses a place for a file before anything is computed.
fn refuse_no_file(file: &Path) -> Result<(), Failure> {
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if file.is_dir() {
        return Err(format!("{}: it is a folder, where a file belongs; choose another name", file.display()).into());
    }
    if !folder.is_dir() {
        return Err(format!("{}: there is no folder {}; make it first", file.display(), folder.display()).into());
    }
    Ok(())
}

/// The datasets of all folders, by name.
fn datasets_of(dirs: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut all = Vec::new();
    for dir in dirs {
        if !dir.is_dir() {
            return Err(format!("{}: there is no such folder", dir.display()).into());
        }
        let found = datasets_below(dir, MAX_DEPTH);
        if found.is_empty() {
            let why = "no dataset there or up to two folders below; a dataset is a folder with dataset.toml";
            return Err(format!("{}: {why}", dir.display()).into());
        }
        all.extend(found);
    }
    refuse_doubles(&all)?;
    Ok(all)
}

/// A dataset, or those in its folders. A folder that cannot be listed stands for itself, and fails by itself.
fn datasets_below(path: &Path, depth: usize) -> Vec<PathBuf> {
    if is_dataset(path) {
        return vec![path.to_owned()];
    }
    let (Some(depth), true) = (depth.checked_sub(1), path.is_dir()) else { return Vec::new() };
    let Ok(entries) = std::fs::read_dir(path) else { return vec![path.to_owned()] };
    let mut inside: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    inside.sort();
    inside.iter().flat_map(|path| datasets_below(path, depth)).collect()
}

/// What became of every dataset, in their order, with the hash of its files; `None` where the command is
/// stopped.
///
/// Every worker holds one dataset at a time. It fits on threads of its own, so that no worker begins another
/// dataset while it waits.
fn outcomes(
    datasets: &[PathBuf],
    arguments: &Arguments,
    store: Option<&SessionStore>,
    terminal: &Terminal,
) -> Result<Option<Vec<(String, Outcome)>>, Failure> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let jobs = if arguments.jobs == 0 { cores } else { arguments.jobs.into() };
    let workers = jobs.min(datasets.len());
    let pools = (0..workers).map(|_| rayon::ThreadPoolBuilder::new().num_threads(cores.div_ceil(workers)).build());
    let pools = pools.collect::<Result<Vec<_>, _>>()?;
    let stop = terminal.stop_flag(false);
    let bar = terminal.progress(datasets.len() as u64, "datasets");
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<(usize, String, Outcome)>> = Mutex::default();
    let work = || {
        while !stop.load(Ordering::Relaxed) {
            let number = next.fetch_add(1, Ordering::Relaxed);
            let Some(path) = datasets.get(number) else { break };
            let (key, outcome) = outcome(path, arguments.calibrate_only, store);
            done.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push((number, key, outcome));
            bar.inc(1);
        }
    };
    std::thread::scope(|scope| {
        for pool in &pools {
            scope.spawn(|| pool.install(work));
        }
    });
    bar.finish_and_clear();
    let mut done = done.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    done.sort_by_key(|(number, ..)| *number);
    let all = done.len() == datasets.len();
    Ok(all.then(|| done.into_iter().map(|(_, key, outcome)| (key, outcome)).collect()))
}

/// What becomes of a dataset: what is kept of it, or what is found now and then kept.
fn outcome(path: &Path, calibrate_only: bool, store: Option<&SessionStore>) -> (String, Outcome) {
    let key = match store::key(path, calibrate_only) {
        Ok(key) => key,
        Err(why) => return (String::new(), Outcome::Failed(why)),
    };
    if let Some(result) = store.and_then(|store| store.read(&key)) {
        return (key, Outcome::Reused(Box::new(result)));
    }
    // One robot's odd log is to stop no other, whatever it meets.
    let found = catch_unwind(AssertUnwindSafe(|| session::analyse(path, calibrate_only))).unwrap_or_else(|_| {
        Err("an error of the program itself, which yair diagnose shows too; please report it".to_owned())
    });
    // What is kept under a key is what was found in these bytes.
    let found = found.and_then(|result| match store::key(path, calibrate_only) {
        Ok(now) if now == key => Ok(result),
        _ => Err(format!("{}: it was changed while it was read; call again when nobody writes there", path.display())),
    });
    let outcome = match found {
        Ok(result) => match store.map_or(Ok(()), |store| store.write(&key, &result)) {
            Ok(()) => Outcome::Computed(Box::new(result)),
            Err(why) => Outcome::Failed(why),
        },
        Err(why) => Outcome::Failed(why),
    };
    (key, outcome)
}
