//! `yair simulate SCENARIO [--trial N] [--point P] [--method M] --out DIR`

use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use atomic_file::{StagedFile, WorkFolder, remove_leftovers};
use clap::Args;
use dataset::{Dataset, DatasetError, Existing, Writer};
use effects::Address;
use scenario::Scenario;
use serde::Serialize;
use sim_yair::Simulation;

use crate::new_folders::NewFolders;
use crate::session_identity::SessionIdentity;
use crate::terminal::{Failure, Terminal};

/// Simulate a scenario once: writes a dataset to DIR, and the hidden truth to DIR.truth.json.
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
    /// Which point of the sweep's design to take, counted from 1; without it the scenario as written.
    #[arg(long, value_name = "P")]
    point: Option<u32>,
    /// Drive what this method drives, where the sweep gives it protocols of its own.
    #[arg(long, value_name = "M")]
    method: Option<String>,
    /// Replace a dataset that is already there.
    #[arg(long)]
    force: bool,

    #[command(flatten)]
    identity: SessionIdentity,
}

#[derive(Serialize)]
struct Document {
    scenario: String,
    seed: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    point: Option<u32>,
    trial: u64,
    dataset: String,
    truth: String,
    runs: usize,
    odometry_rows: usize,
    truth_rows: usize,
    point_rows: usize,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    let scenario = Scenario::read(&arguments.scenario)?;
    let seed = arguments.seed.unwrap_or(scenario.seed);
    let mut simulation = simulate(arguments, &scenario, seed)?;
    arguments.identity.state_in(&mut simulation.dataset.provenance);
    // The truth waits in a temporary file until the dataset stands: both are written or none.
    let truth = truth_path(&arguments.out)?;
    if truth.is_dir() || (truth.exists() && !arguments.force) {
        let why = "already exists; nothing was written: choose another folder, or give --force to replace a file";
        return Err(format!("{}: {why}", truth.display()).into());
    }
    create_parents(&truth)?;
    let waiting = staged(&truth, &serde_json::to_vec_pretty(&simulation.truth)?)?;
    write_dataset(&simulation.dataset, &arguments.out, arguments.force)?;
    waiting.persist(&truth).map_err(|error| format!("{}: {error}", truth.display()))?;

    let runs = &simulation.dataset.runs;
    let document = Document {
        scenario: scenario.name,
        seed,
        point: arguments.point,
        trial: arguments.trial,
        dataset: arguments.out.display().to_string(),
        truth: truth.display().to_string(),
        runs: runs.len(),
        odometry_rows: runs.iter().map(|run| run.odometry.t_s.len()).sum(),
        truth_rows: runs.iter().map(|run| run.truth.len()).sum(),
        point_rows: runs.iter().map(|run| run.point_readings.len()).sum(),
    };
    terminal.note(&format!(
        "{} runs, {} odometry rows, {} truth rows, {} point readings in {}\nhidden truth in {}",
        document.runs,
        document.odometry_rows,
        document.truth_rows,
        document.point_rows,
        document.dataset,
        document.truth
    ))?;
    terminal.document(&document)?;
    Ok(ExitCode::SUCCESS)
}

/// The trial that is asked for: of the scenario as written, or of a point of its sweep.
fn simulate(arguments: &Arguments, scenario: &Scenario, seed: u64) -> Result<Simulation, Failure> {
    let file = arguments.scenario.display();
    let (mut point, mut at) = (0, None);
    if let Some(number) = arguments.point {
        let sweep = scenario.sweep.as_ref().ok_or_else(|| format!("{file}: no [sweep], and so no points"))?;
        // Sampled designs depend on the seed.
        let seeded = Scenario { seed, ..scenario.clone() };
        let mut points = sweep.points(&seeded, &file.to_string())?;
        let count = points.len();
        let index = (number as usize).checked_sub(1).filter(|index| *index < count);
        let index = index.ok_or_else(|| format!("{file}: there is no point {number}; the design has 1 to {count}"))?;
        (point, at) = (number - 1, Some(points.swap_remove(index).scenario));
    }
    let scenario = at.as_ref().unwrap_or(scenario);
    let programs = match &arguments.method {
        Some(method) => {
            if calib::method(method).is_none() {
                let known: Vec<_> = calib::METHODS.iter().map(|method| method.name()).collect();
                return Err(format!("unknown method \"{method}\"; known: {}", known.join(", ")).into());
            }
            scenario.programs_for(method).map_err(|no_fit| format!("{file}: {method} cannot be used: {no_fit}"))?
        }
        None => scenario.programs(),
    };
    let first_run = Address { seed, point, trial: arguments.trial, run: 0 };
    Ok(sim_yair::simulate_programs(scenario, &programs, first_run)?)
}

/// Writes a dataset; where one stands in the way, says how it is replaced.
pub(crate) fn write_dataset(dataset: &Dataset, dir: &Path, force: bool) -> Result<(), Failure> {
    dataset::write(dataset, dir, existing(force)).map_err(|error| say_how_to_replace(error, force))
}

/// As [`write_dataset`], of a dataset whose instrument's instants are shifted as it is read.
pub(crate) fn write_shifted_dataset(
    dataset: &Dataset,
    dir: &Path,
    force: bool,
    truth_shift_s: Option<f64>,
) -> Result<(), Failure> {
    dataset::write_with_shift(dataset, dir, existing(force), truth_shift_s)
        .map_err(|error| say_how_to_replace(error, force))
}

/// Begins a dataset that is written a run at a time; where one stands in the way, says how it is replaced.
pub(crate) fn begin_dataset(header: Dataset, dir: &Path, force: bool) -> Result<Writer, Failure> {
    Writer::create(header, dir, existing(force)).map_err(|error| say_how_to_replace(error, force))
}

const fn existing(force: bool) -> Existing {
    if force { Existing::ReplaceDataset } else { Existing::Refuse }
}

fn say_how_to_replace(error: DatasetError, force: bool) -> Failure {
    match error {
        DatasetError::AlreadyExists { .. } if !force => format!("{error}; --force replaces a dataset").into(),
        other => other.into(),
    }
}

/// `DIR.truth.json`, the dataset folder's sibling, also where DIR is `.` or ends in `..`.
fn truth_path(out: &Path) -> Result<PathBuf, Failure> {
    let out = if out.file_name().is_some() {
        out.components().as_path().to_owned()
    } else {
        out.canonicalize().map_err(|error| format!("{}: {error}", out.display()))?
    };
    let mut name = out.into_os_string();
    name.push(".truth.json");
    Ok(PathBuf::from(name))
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn create_parents(path: &Path) -> Result<(), Failure> {
    let folder = folder_of(path);
    atomic_file::create_all(folder).map_err(|error| format!("{}: {error}", folder.display()).into())
}

/// Refuses a link in the place of a folder of results.
pub(crate) fn refuse_link(out: &Path) -> Result<(), Failure> {
    atomic_file::refuse_link(out).map_err(|error| format!("{}: {error}", out.display()).into())
}

/// Refuses a folder that has something in it, unless `force` says to write into it.
pub(crate) fn refuse_filled(out: &Path, force: bool) -> Result<(), Failure> {
    refuse_link(out)?;
    remove_leftovers(out);
    let taken = out.read_dir().map_or_else(|_| out.exists(), |mut entries| entries.next().is_some());
    if taken && (!force || !out.is_dir()) {
        let why = "already exists and is not an empty folder; nothing was written: choose another folder, or give --force to write into it";
        return Err(format!("{}: {why}", out.display()).into());
    }
    Ok(())
}

/// Writes a folder in one piece: `write` fills another one, which then takes the name. One that has files
/// already is written into file by file, where `force` says so: another process may have filled it since
/// [`refuse_filled`] looked.
pub(crate) fn write_folder<T>(
    out: &Path,
    force: bool,
    write: impl FnOnce(&Path) -> Result<T, Failure>,
) -> Result<T, Failure> {
    let failed = |error: io::Error| format!("{}: {error}", out.display());
    let _new = NewFolders::to(out);
    refuse_link(out)?;
    // The folder itself where `out` ends in `..`, as only that can be renamed.
    let target = out.canonicalize().unwrap_or_else(|_| out.to_owned());
    let is_there = target.is_dir();
    if target.exists() && (!is_there || target.read_dir().map_err(failed)?.next().is_some()) {
        refuse_filled(out, force)?;
        atomic_file::create_all(out).map_err(failed)?;
        return write(out);
    }
    let folder = folder_of(&target);
    atomic_file::create_all(folder).map_err(failed)?;
    // The temporary folder's random name would tell the user nothing: only the kind of the error is shown.
    let work = WorkFolder::beside(folder).map_err(|error| format!("{}: {}", out.display(), error.kind()))?;
    // A file is named by the place that it is to have.
    let named = |error: Failure| {
        let (made, out) = (work.made().display().to_string(), out.display().to_string());
        Failure::from(error.to_string().replace(&made, &out))
    };
    let written = write(work.made()).map_err(named)?;
    if is_there {
        std::fs::remove_dir(&target).map_err(failed)?;
    }
    work.rename_to(&target).map_err(failed)?;
    Ok(written)
}

/// Writes a file in one piece.
pub(crate) fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    staged(path, bytes)?.persist(path).map_err(|error| format!("{}: {error}", path.display()))?;
    Ok(())
}

/// A temporary file beside `path`, with the permissions of any other file of the user, that is to become
/// `path`.
fn staged(path: &Path, bytes: &[u8]) -> Result<StagedFile, Failure> {
    let folder = folder_of(path);
    if !folder.is_dir() {
        return Err(format!("{}: there is no folder {}", path.display(), folder.display()).into());
    }
    // The temporary file's random name would tell the user nothing: only the kind of the error is shown.
    let failed = |error: io::Error| format!("{}: {}", path.display(), error.kind());
    remove_leftovers(folder);
    Ok(atomic_file::stage(path, bytes).map_err(failed)?)
}
