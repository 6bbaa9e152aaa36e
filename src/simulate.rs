//! `yair simulate SCENARIO --out DIR`

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use dataset::Existing;
use scenario::Scenario;
use serde::Serialize;

use crate::terminal::{Failure, Terminal};

/// Run a scenario's protocols once; the dataset goes to DIR, the hidden truth beside it to DIR.truth.json.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Scenario file (TOML); see scenarios/.
    scenario: PathBuf,
    /// Folder for the dataset; it must not exist or be empty.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Seed of every random draw, in place of the scenario's.
    #[arg(long)]
    seed: Option<u64>,
    /// Which trial of the seed to run.
    #[arg(long, default_value_t = 0)]
    trial: u64,
    /// Replace a dataset that is already there.
    #[arg(long)]
    force: bool,
}

#[derive(Serialize)]
struct Document {
    scenario: String,
    seed: u64,
    trial: u64,
    dataset: PathBuf,
    truth: PathBuf,
    runs: usize,
    odometry_rows: usize,
    truth_rows: usize,
    point_rows: usize,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    let scenario = Scenario::read(&arguments.scenario)?;
    let seed = arguments.seed.unwrap_or(scenario.seed);
    let simulation = sim_yair::simulate(&scenario, seed, arguments.trial)?;
    let existing = if arguments.force { Existing::ReplaceDataset } else { Existing::Refuse };
    dataset::write(&simulation.dataset, &arguments.out, existing)?;
    let truth = truth_path(&arguments.out);
    write_whole(&truth, &serde_json::to_vec_pretty(&simulation.truth)?)?;

    let runs = &simulation.dataset.runs;
    let document = Document {
        scenario: scenario.name,
        seed,
        trial: arguments.trial,
        dataset: arguments.out.clone(),
        truth,
        runs: runs.len(),
        odometry_rows: runs.iter().map(|run| run.odometry.t_s.len()).sum(),
        truth_rows: runs.iter().map(|run| run.truth.len()).sum(),
        point_rows: runs.iter().map(|run| run.point_readings.len()).sum(),
    };
    terminal.say(&format!(
        "{} runs, {} odometry rows, {} truth rows, {} point readings in {}\nhidden truth in {}",
        document.runs,
        document.odometry_rows,
        document.truth_rows,
        document.point_rows,
        document.dataset.display(),
        document.truth.display()
    ))?;
    terminal.document(&document)?;
    Ok(ExitCode::SUCCESS)
}

/// `DIR.truth.json`, the dataset folder's sibling.
fn truth_path(out: &Path) -> PathBuf {
    let mut name = out.components().as_path().as_os_str().to_owned();
    name.push(".truth.json");
    PathBuf::from(name)
}

/// Writes a file in one piece.
pub(crate) fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let failed = |error: std::io::Error| format!("{}: {error}", path.display());
    let mut file = tempfile::NamedTempFile::new_in(folder).map_err(failed)?;
    std::io::Write::write_all(&mut file, bytes).map_err(failed)?;
    file.persist(path).map_err(|error| failed(error.error))?;
    Ok(())
}
