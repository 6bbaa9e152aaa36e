//! `yair check DATASET...`, and the same before other subcommands.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use calib::Names;
use clap::Args;
use dataset::{Blocks, Dataset};
use preflight::{NOT_DETERMINED, Preflight, Problem, Severity, WouldDetermine};
use serde::Serialize;

use crate::case_bundle::{self, Session, severity};
use crate::terminal::{Failure, Terminal, advance, datasets_at, folder_name, read_datasets, table};

/// Examine a log before it is fitted: what is wrong with it, and how to fix it.
///
/// Exits with 1 when a problem is an error. docs/check.md says what is checked.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Datasets; several are one robot's sessions. A folder of datasets means all of them.
    #[arg(required = true, value_name = "DATASET")]
    datasets: Vec<PathBuf>,
    /// Write a small file to send: the log without names, dates and origin, thinned to 200 kB or less if it
    /// keeps the same problems, with versions and what the check said. `yair replay-case FILE` checks it
    /// again. Look into it before you send it. A log that `import` or `check` cannot read has no bundle: send
    /// the message, the command and the first twenty lines of each file instead.
    #[arg(long, value_name = "FILE")]
    bundle: Option<PathBuf>,
}

#[derive(Serialize)]
struct Document<'a> {
    dataset: Names,
    ok: bool,
    problems: &'a [Problem],
    determined: &'a BTreeMap<&'static str, bool>,
    would_determine: &'a [WouldDetermine],
    #[serde(skip_serializing_if = "Option::is_none")]
    bundle: Option<Written>,
}

/// A bundle that was written.
#[derive(Serialize)]
struct Written {
    file: String,
    bytes: usize,
    runs: usize,
    odometry_rows: usize,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    if let Some(file) = &arguments.bundle {
        refuse_existing(file)?;
    }
    let datasets = read_datasets(&arguments.datasets, terminal).map_err(|error| match &arguments.bundle {
        Some(_) => format!("{error}; no bundle is written of a log that cannot be read: send this message").into(),
        None => error,
    })?;
    let bar = terminal.stages("check");
    advance(&bar, "what is wrong with the logs, and what they determine", 0.0);
    let found = calib::check_and_fit(&datasets);
    bar.finish_and_clear();
    show(&found, terminal)?;
    let bundle = match &arguments.bundle {
        Some(file) => Some(write_bundle(file, arguments, &datasets, &found, terminal)?),
        None => None,
    };
    let names = Names::of(datasets.iter().filter_map(|dataset| dataset.provenance.name.clone()).collect());
    terminal.document(&Document {
        dataset: names,
        ok: found.is_ok(),
        problems: &found.problems,
        determined: &found.determined,
        would_determine: &found.would_determine,
        bundle,
    })?;
    Ok(if found.is_ok() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn refuse_existing(file: &Path) -> Result<(), Failure> {
    if file.symlink_metadata().is_ok() {
        return Err(format!("{}: already exists; choose another name for the bundle", file.display()).into());
    }
    Ok(())
}

fn write_bundle(
    file: &Path,
    arguments: &Arguments,
    datasets: &[Dataset],
    found: &Preflight,
    terminal: &Terminal,
) -> Result<Written, Failure> {
    let folders = datasets_at(&arguments.datasets)?;
    let sessions = datasets.iter().zip(&folders).map(|(dataset, folder)| Session::of(dataset, folder)).collect();
    let flags = if terminal.json { " --json" } else { "" };
    let command = format!("yair check LOG{flags} --bundle FILE");
    let bar = terminal.stages("bundle");
    let bundle = case_bundle::bundle(datasets, found, sessions, &command, &mut |done| {
        advance(&bar, "the smallest part with the same problems", done);
    });
    bar.finish_and_clear();
    let bundle = bundle?;
    refuse_existing(file)?;
    atomic_file::write_whole(file, &bundle.bytes).map_err(|error| format!("{}: {error}", file.display()))?;
    let (log, kept, kilobytes) = (bundle.case.log, bundle.case.kept, bundle.bytes.len().div_ceil(1000));
    let rows = format!("{} of {} runs, {} of {} rows", kept.runs, log.runs, kept.odometry_rows, log.odometry_rows);
    terminal.note(&format!("bundle: {rows}, {kilobytes} kB in {}; it has the same problems", file.display()))?;
    if !bundle.is_small() {
        terminal
            .remark("the bundle has more than 200 kB: no smaller part of the log that was tried has the same problems");
    }
    let bytes = bundle.bytes.len();
    Ok(Written { file: file.display().to_string(), bytes, runs: kept.runs, odometry_rows: kept.odometry_rows })
}

fn checked(datasets: &[Dataset], terminal: &Terminal) -> Preflight {
    let bar = terminal.stages("check");
    advance(&bar, "what is wrong with the logs", 0.0);
    let found = preflight::check(datasets);
    bar.finish_and_clear();
    found
}

fn show(found: &Preflight, terminal: &Terminal) -> Result<(), Failure> {
    if found.problems.is_empty() {
        terminal.say("no problem found")?;
    } else {
        let mut rows = table(&["severity", "problem", "probability"], 2);
        for problem in &found.problems {
            rows.add_row([
                severity(problem.severity).to_owned(),
                problem.id.to_owned(),
                format!("{:.3}", problem.probability),
            ]);
        }
        terminal.say_by_severity(&rows.to_string())?;
    }
    for problem in &found.problems {
        terminal.say(&format!("{}: {}", problem.id, problem.sentence))?;
        if let Some(fix) = &problem.fix {
            terminal.say(&format!("  fix: {fix}"))?;
        }
    }
    let of = |wanted: bool| {
        let names: Vec<&str> =
            found.determined.iter().filter(|(_, is)| **is == wanted).map(|(name, _)| *name).collect();
        if names.is_empty() { "none".to_owned() } else { names.join(", ") }
    };
    terminal.say(&format!("determined by these runs: {}", of(true)))?;
    if found.determined.values().any(|is| !is) {
        terminal.say(&format!("not determined: {}", of(false)))?;
    }
    for open in &found.would_determine {
        terminal.say(&format!("  {}", open.sentence))?;
    }
    Ok(())
}

/// Checks datasets before another subcommand and passes on what is no hint.
pub(crate) fn before(datasets: &[Dataset], terminal: &Terminal) {
    let found = checked(datasets, terminal);
    // What is determined is for the fit to say.
    let said = |problem: &&Problem| problem.severity != Severity::Hint && problem.id != NOT_DETERMINED;
    for problem in found.problems.iter().filter(said) {
        terminal.remark(&line(problem));
    }
}

/// Rows of odometry that are checked of datasets which are read piece by piece: a million takes a second and
/// 100 MB.
const MAX_CHECKED_ROWS: usize = 1 << 20;

/// The datasets as far as so many rows go, each run from its start, and whether that is all of them;
/// `None` where they cannot be read, which whoever works with them tells.
pub(crate) fn beginnings(paths: &[PathBuf], most_rows: usize) -> Option<(Vec<Dataset>, bool)> {
    let (mut left, mut all) = (most_rows, true);
    let mut datasets = Vec::with_capacity(paths.len());
    for path in paths {
        let Some(mut blocks) = Blocks::open(path).ok()? else {
            // The rows of its runs are mixed: it is held as a whole in any case.
            datasets.push(dataset::read(path).ok()?.dataset);
            continue;
        };
        let mut dataset = blocks.header().clone();
        dataset.provenance.name.get_or_insert_with(|| folder_name(path));
        for run in 0..blocks.infos().len() {
            let whole = blocks.rows(run) <= left;
            let count = if whole { blocks.blocks(run) } else { left / Blocks::ROWS };
            if count > 0 {
                dataset.runs.append(&mut blocks.read(run, 0..count).ok()?.dataset.runs);
            }
            left -= if whole { blocks.rows(run) } else { left };
            all &= whole;
        }
        datasets.push(dataset);
    }
    Some((datasets, all))
}

/// As [`before`], for datasets that may be larger than the memory.
pub(crate) fn before_reading(paths: &[PathBuf], terminal: &Terminal) {
    if let Some((datasets, all)) = beginnings(paths, MAX_CHECKED_ROWS) {
        before(&datasets, terminal);
        say_how_far(all, terminal);
    }
}

/// As [`refuse`], for datasets that may be larger than the memory.
pub(crate) fn refuse_before_reading(paths: &[PathBuf], terminal: &Terminal) -> Result<(), Failure> {
    if let Some((datasets, all)) = beginnings(paths, MAX_CHECKED_ROWS) {
        refuse(&datasets, terminal)?;
        say_how_far(all, terminal);
    }
    Ok(())
}

fn say_how_far(all: bool, terminal: &Terminal) {
    if !all {
        let what = "checked for problems as far as the first million rows go; yair check reads all";
        terminal.remark(&format!("the datasets are large: they were {what}"));
    }
}

/// A problem in one line.
fn line(problem: &Problem) -> String {
    format!("{}: {}", severity(problem.severity), text(problem))
}

/// What a problem is, without how bad.
fn text(problem: &Problem) -> String {
    let fix = problem.fix.as_ref().map_or_else(String::new, |fix| format!(" ({fix})"));
    format!("{}: {}{fix}", problem.id, problem.sentence)
}

/// Refuses datasets with an error, in the words of the worst.
pub(crate) fn refuse(datasets: &[Dataset], terminal: &Terminal) -> Result<(), Failure> {
    let found = checked(datasets, terminal);
    if let Some(why) = why_refused(&found) {
        return Err(format!("{why}; --force calibrates all the same").into());
    }
    warnings(&found).for_each(|warning| terminal.remark(&format!("warning: {warning}")));
    Ok(())
}

/// What should be known of datasets that are not refused, a line each.
pub(crate) fn warnings(found: &Preflight) -> impl Iterator<Item = String> {
    let said = |problem: &&Problem| problem.severity == Severity::Warning && problem.id != NOT_DETERMINED;
    found.problems.iter().filter(said).map(text)
}

/// Why datasets are refused, in the words of the worst error.
pub(crate) fn why_refused(found: &Preflight) -> Option<String> {
    let mut errors = found.problems.iter().filter(|problem| problem.severity == Severity::Error);
    let first = errors.next()?;
    let more = match errors.count() {
        0 => String::new(),
        1 => "; yair check names another".to_owned(),
        more => format!("; yair check names {more} more"),
    };
    let fix = first.fix.as_ref().map_or_else(String::new, |fix| format!(" ({fix} in dataset.toml)"));
    let fix = fix.replace(" (--force in dataset.toml)", "");
    Some(format!("{}: {}{fix}{more}", first.id, first.sentence))
}
