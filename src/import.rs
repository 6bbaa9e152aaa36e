//! `yair import FORMAT SOURCE --out DIR`

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use clap::builder::PossibleValuesParser;
use dataset::Existing;
use dataset::import::{IMPORTERS, importer};
use serde::Serialize;

use crate::terminal::{Failure, Terminal};

/// Other people's logs into datasets.
#[derive(Args)]
#[command(after_help = formats())]
pub(crate) struct Arguments {
    /// Format of the source.
    #[arg(value_parser = PossibleValuesParser::new(IMPORTERS.iter().map(|importer| importer.name)))]
    format: String,
    /// File or folder to import.
    source: PathBuf,
    /// Folder for the dataset; a source of several sessions gets one folder a session inside it.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Replace datasets that are already there.
    #[arg(long)]
    force: bool,
}

fn formats() -> String {
    let lines: Vec<_> = IMPORTERS.iter().map(|importer| format!("  {:10} {}", importer.name, importer.about)).collect();
    format!("Formats:\n{}", lines.join("\n"))
}

#[derive(Serialize)]
struct Document {
    format: String,
    source: PathBuf,
    datasets: Vec<Imported>,
}

#[derive(Serialize)]
struct Imported {
    dataset: PathBuf,
    runs: usize,
    odometry_rows: usize,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    let importer = importer(&arguments.format).ok_or("no such format")?;
    let sessions = (importer.read)(&arguments.source)?;
    let existing = if arguments.force { Existing::ReplaceDataset } else { Existing::Refuse };
    let several = sessions.len() > 1;
    let mut datasets = Vec::with_capacity(sessions.len());
    for session in &sessions {
        for warning in &session.warnings {
            terminal.remark(&format!("warning: {}: {warning}", session.name));
        }
        let dir = if several { arguments.out.join(&session.name) } else { arguments.out.clone() };
        dataset::write(&session.dataset, &dir, existing)?;
        let runs = &session.dataset.runs;
        let odometry_rows = runs.iter().map(|run| run.odometry.t_s.len()).sum();
        terminal.say(&format!("{} runs, {odometry_rows} odometry rows in {}", runs.len(), dir.display()))?;
        datasets.push(Imported { dataset: dir, runs: runs.len(), odometry_rows });
    }
    terminal.document(&Document { format: arguments.format.clone(), source: arguments.source.clone(), datasets })?;
    Ok(ExitCode::SUCCESS)
}
