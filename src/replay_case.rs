//! `yair replay-case FILE...`

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use serde::Serialize;

use crate::case_bundle::{self, ids, list, severity};
use crate::terminal::{Failure, Terminal, advance, table};

/// Check bundles of `yair check --bundle` again, and compare with what their check said.
///
/// Exits with 0 where every bundle has the same problems as when it was made, else with 1.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Bundles, or folders of them.
    #[arg(required = true, value_name = "FILE|DIR")]
    cases: Vec<PathBuf>,
}

#[derive(Serialize)]
struct Document {
    ok: bool,
    cases: Vec<Replayed>,
}

#[derive(Serialize)]
struct Replayed {
    case: String,
    /// The version that made it.
    yair: String,
    same: bool,
    /// Severity by id.
    recorded: BTreeMap<String, String>,
    found: BTreeMap<String, String>,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    let files = files(&arguments.cases)?;
    let bar = terminal.stages("replay");
    let mut cases = Vec::with_capacity(files.len());
    for (number, file) in files.iter().enumerate() {
        advance(&bar, "bundles", number as f64 / files.len() as f64);
        cases.push(replayed(file)?);
    }
    bar.finish_and_clear();
    for case in &cases {
        show(case, terminal)?;
    }
    let ok = cases.iter().all(|case| case.same);
    terminal.document(&Document { ok, cases })?;
    Ok(if ok { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// The bundles that paths name, those of a folder by name.
fn files(paths: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut files = Vec::new();
    for path in paths {
        if !path.is_dir() {
            files.push(path.clone());
            continue;
        }
        let unreadable = |error| format!("{}: {error}", path.display());
        let mut inside = Vec::new();
        for entry in path.read_dir().map_err(unreadable)? {
            inside.push(entry.map_err(unreadable)?.path());
        }
        inside.retain(|file| file.extension().is_some_and(|ending| ending == "zip"));
        if inside.is_empty() {
            return Err(format!("{}: the folder has no bundle (*.zip)", path.display()).into());
        }
        inside.sort();
        files.extend(inside);
    }
    Ok(files)
}

fn replayed(file: &Path) -> Result<Replayed, Failure> {
    let (case, datasets) = case_bundle::read(file)?;
    let now = calib::check_and_fit(&datasets);
    // The worst of an id comes first.
    let mut found = BTreeMap::new();
    for problem in &now.problems {
        found.entry(problem.id.to_owned()).or_insert_with(|| severity(problem.severity).to_owned());
    }
    let mut recorded = BTreeMap::new();
    for problem in case.problems {
        recorded.entry(problem.id).or_insert(problem.severity);
    }
    let same = recorded.keys().map(String::as_str).collect::<BTreeSet<_>>() == ids(&now);
    Ok(Replayed { case: file.display().to_string(), yair: case.yair, same, recorded, found })
}

fn show(case: &Replayed, terminal: &Terminal) -> Result<(), Failure> {
    let word = if case.same { "the same problems" } else { "OTHER PROBLEMS" };
    terminal.say(&format!("{}: {word} as with yair {}", case.case, case.yair))?;
    let all: BTreeSet<&str> = case.recorded.keys().chain(case.found.keys()).map(String::as_str).collect();
    if all.is_empty() {
        return terminal.say(&format!("  {}", list(&all)));
    }
    let mut rows = table(&["problem", "recorded", "found now"], 3);
    let cell = |of: &BTreeMap<String, String>, id: &str| of.get(id).map_or("–", String::as_str).to_owned();
    for id in all {
        rows.add_row([id.to_owned(), cell(&case.recorded, id), cell(&case.found, id)]);
    }
    terminal.say(&rows.to_string())
}
