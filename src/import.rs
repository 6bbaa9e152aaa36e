//! `yair import FORMAT SOURCE --out DIR`

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use clap::builder::PossibleValuesParser;
use dataset::import::{IMPORTERS, Source, importer};
use dataset::{Loaded, read_ahead};
use serde::Serialize;

use crate::simulate::begin_dataset;
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
    source: String,
    datasets: Vec<Imported>,
}

#[derive(Serialize)]
struct Imported {
    dataset: String,
    runs: usize,
    odometry_rows: usize,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    let importer = importer(&arguments.format).ok_or("no such format")?;
    let sources = (importer.open)(&arguments.source)?;
    let dirs = folders(arguments, &sources)?;
    let was_there = arguments.out.exists();
    let datasets = write(sources, dirs, arguments.force, terminal).inspect_err(|_| {
        // Nothing of a failed import stays, not even the folder that was to hold its sessions.
        if !was_there {
            let _ = std::fs::remove_dir(&arguments.out);
        }
    })?;
    terminal.document(&Document {
        format: arguments.format.clone(),
        source: arguments.source.display().to_string(),
        datasets,
    })?;
    Ok(ExitCode::SUCCESS)
}

/// Writes all datasets, a run at a time, before the first is put into its place.
fn write(sources: Vec<Source>, dirs: Vec<PathBuf>, force: bool, terminal: &Terminal) -> Result<Vec<Imported>, Failure> {
    let mut written = Vec::with_capacity(sources.len());
    for (source, dir) in sources.into_iter().zip(dirs) {
        let mut writer = begin_dataset(source.header, &dir, force)?;
        let (mut runs, mut odometry_rows) = (0, 0);
        let name = source.name;
        read_ahead(source.runs, |loaded| {
            let Loaded { dataset, warnings } = loaded?;
            for warning in &warnings {
                terminal.remark(&format!("warning: {name}: {warning}"));
            }
            for run in &dataset.runs {
                writer.push(run)?;
                runs += 1;
                odometry_rows += run.odometry.t_s.len();
            }
            Ok::<(), Failure>(())
        })?;
        written.push((writer, dir, runs, odometry_rows));
    }
    let mut datasets = Vec::with_capacity(written.len());
    for (writer, dir, runs, odometry_rows) in written {
        writer.finish()?;
        terminal.say(&format!("{runs} runs, {odometry_rows} odometry rows in {}", dir.display()))?;
        datasets.push(Imported { dataset: dir.display().to_string(), runs, odometry_rows });
    }
    Ok(datasets)
}

/// A folder for each session. Refuses before the first is written, so that an import is done as a whole.
fn folders(arguments: &Arguments, sessions: &[Source]) -> Result<Vec<PathBuf>, Failure> {
    let [_, _, ..] = sessions else { return Ok(vec![arguments.out.clone()]) };
    let dirs: Vec<PathBuf> = sessions.iter().map(|session| arguments.out.join(&session.name)).collect();
    for (position, dir) in dirs.iter().enumerate() {
        if dirs[..position].contains(dir) {
            let why = "two sessions of the source have this name; nothing was written: import them one by one";
            return Err(format!("{}: {why}", dir.display()).into());
        }
        let taken = dir.read_dir().map_or_else(|_| dir.exists(), |mut entries| entries.next().is_some());
        if taken && !arguments.force {
            let why = "already exists and is not empty; nothing was written: choose another folder, or give --force";
            return Err(format!("{}: {why}", dir.display()).into());
        }
    }
    Ok(dirs)
}
