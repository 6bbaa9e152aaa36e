//! report.html: what was found, as one page that loads nothing. Here results become sections; the crate
//! `report-page` makes the page of them.

mod calibration;
mod campaign;
mod diagnosis;
mod diagnosis_details;
mod drift;
mod driven;
mod first_screen;
mod fleet;
mod markdown;
mod next_drive;
mod paths;
mod residuals;
mod sweep_charts;
mod words;

pub(crate) use calibration::{CalibrationPage, EvaluationPage, write_comparison};
pub(crate) use campaign::{write_plan, write_reproduction, write_sweep};
pub(crate) use diagnosis::{DiagnosisPage, drift_percents};
pub(crate) use fleet::write_fleet;
use paths::{Under, UnderCalibrations};

use std::path::Path;

use dataset::Dataset;
use report_page::{MadeBy, Report};

use crate::command_line;
use crate::new_folders::NewFolders;
use crate::simulate::{refuse_link, write_whole};
use crate::terminal::Failure;

/// The file's name in every folder.
const FILE: &str = "report.html";

/// Refuses what is no folder, before anything is computed.
pub(crate) fn refuse_file(out: Option<&Path>) -> Result<(), Failure> {
    out.map_or(Ok(()), refuse_link)?;
    match out.filter(|out| out.exists() && !out.is_dir()) {
        Some(file) => {
            Err(format!("{}: it is a file, where a folder belongs; choose another name", file.display()).into())
        }
        None => Ok(()),
    }
}

/// Writes the page into a folder, which is made where it is not there.
fn write(report: &Report, out: &Path) -> Result<(), Failure> {
    let _new = NewFolders::to(out);
    atomic_file::create_folder(out).map_err(|error| format!("{}: {error}", out.display()))?;
    write_whole(&out.join(FILE), report.render()?.as_bytes())
}

/// How this page is made: the command line as it was typed.
fn made_by(datasets: Vec<String>) -> MadeBy {
    let quoted = |argument: String| {
        let is_plain = |c: char| c.is_alphanumeric() || "-_./,=:+@%".contains(c);
        if !argument.is_empty() && argument.chars().all(is_plain) {
            argument
        } else {
            format!("'{}'", argument.replace('\'', "'\\''"))
        }
    };
    let arguments = command_line::typed().into_iter().map(quoted);
    let command_line = std::iter::once("yair".to_owned()).chain(arguments).collect::<Vec<_>>().join(" ");
    MadeBy { version: env!("CARGO_PKG_VERSION").to_owned(), command_line, datasets }
}

/// Names of so many sessions stand on the first screen; more would fill it.
const MAX_NAMES: usize = 3;

/// What a page is about.
fn subject(datasets: &[Dataset]) -> String {
    let names: Vec<&str> = datasets.iter().filter_map(|dataset| dataset.provenance.name.as_deref()).collect();
    if names.len() > MAX_NAMES { format!("{} sessions", names.len()) } else { names.join(", ") }
}

/// What is in the datasets.
fn contents(datasets: &[Dataset]) -> Vec<String> {
    let of = |dataset: &Dataset| {
        let rows: usize = dataset.runs.iter().map(|run| run.odometry.t_s.len()).sum();
        let truth: usize = dataset.runs.iter().map(|run| run.truth.len()).sum();
        let name = dataset.provenance.name.as_deref().unwrap_or("dataset");
        format!("{name}: {} runs, {rows} odometry rows, {truth} truth rows", dataset.runs.len())
    };
    datasets.iter().map(of).collect()
}
