//! `yair check DATASET...`, and the same before other subcommands.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::ExitCode;

use calib::Names;
use clap::Args;
use dataset::Dataset;
use preflight::{Preflight, Problem, Severity};
use serde::Serialize;

use crate::terminal::{Failure, Terminal, read_datasets, table};

/// What is wrong with a log, or would make a calibration wrong, before anything is fitted.
///
/// Exits with 1 when a problem is an error. docs/check.md says what is checked.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Datasets; several are one robot's sessions. A folder of datasets stands for all of them.
    #[arg(required = true, value_name = "DATASET")]
    datasets: Vec<PathBuf>,
}

#[derive(Serialize)]
struct Document<'a> {
    dataset: Names,
    ok: bool,
    problems: &'a [Problem],
    determined: &'a BTreeMap<&'static str, bool>,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    let datasets = read_datasets(&arguments.datasets, terminal)?;
    let found = preflight::check(&datasets);
    show(&found, terminal)?;
    let names = Names::of(datasets.iter().filter_map(|dataset| dataset.provenance.name.clone()).collect());
    terminal.document(&Document {
        dataset: names,
        ok: found.is_ok(),
        problems: &found.problems,
        determined: &found.determined,
    })?;
    Ok(if found.is_ok() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn show(found: &Preflight, terminal: &Terminal) -> Result<(), Failure> {
    if found.problems.is_empty() {
        terminal.say("no problem found")?;
    } else {
        let mut rows = table(&["severity", "problem", "probability"], 2);
        for problem in &found.problems {
            rows.add_row([word(problem).to_owned(), problem.id.to_owned(), format!("{:.3}", problem.probability)]);
        }
        terminal.say(&rows.to_string())?;
    }
    for problem in &found.problems {
        terminal.say(&format!("{}: {}", problem.id, problem.sentence))?;
        if let Some(fix) = &problem.fix {
            terminal.say(&format!("  mended by: {fix}"))?;
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
    Ok(())
}

const fn word(problem: &Problem) -> &'static str {
    match problem.severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
        Severity::Hint => "hint",
    }
}

/// Checks datasets before another subcommand and passes on what is no hint; gives what was found.
pub(crate) fn before(datasets: &[Dataset], terminal: &Terminal) -> Preflight {
    let found = preflight::check(datasets);
    for problem in found.problems.iter().filter(|problem| problem.severity != Severity::Hint) {
        terminal.remark(&line(problem));
    }
    found
}

/// A problem in one line.
fn line(problem: &Problem) -> String {
    let fix = problem.fix.as_ref().map_or_else(String::new, |fix| format!(" ({fix})"));
    format!("{}: {}: {}{fix}", word(problem), problem.id, problem.sentence)
}

/// Refuses datasets with an error, in the words of the worst.
pub(crate) fn refuse(datasets: &[Dataset], terminal: &Terminal) -> Result<Preflight, Failure> {
    let found = preflight::check(datasets);
    let mut errors = found.problems.iter().filter(|problem| problem.severity == Severity::Error);
    if let Some(first) = errors.next() {
        let more = errors.count();
        let more = match more {
            0 => String::new(),
            1 => "; yair check names another".to_owned(),
            _ => format!("; yair check names {more} more"),
        };
        let fix = first.fix.as_ref().map_or_else(String::new, |fix| format!(" ({fix} in dataset.toml)"));
        let fix = fix.replace(" (--force in dataset.toml)", "");
        return Err(format!("{}: {}{fix}{more}; --force calibrates all the same", first.id, first.sentence).into());
    }
    for problem in found.problems.iter().filter(|problem| problem.severity == Severity::Warning) {
        terminal.remark(&line(problem));
    }
    Ok(found)
}
