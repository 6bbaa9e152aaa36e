//! `yair import FORMAT SOURCE --out DIR`

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{ArgMatches, Args, Command, FromArgMatches, Subcommand};
use dataset::import::{IMPORTERS, Importer, Source, importer};
use dataset::{Loaded, read_ahead};
use serde::Serialize;

use crate::session_identity::SessionIdentity;
use crate::simulate::begin_dataset;
use crate::terminal::{Failure, Terminal};
use crate::{import_csv, import_motions, import_ros2, import_tum};

/// Import a log: a table, a ROS bag, a trajectory, pairs of motions, or a public dataset.
#[derive(Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    format: Format,
}

/// What is imported: a format of the table, a file of no format, or a bag.
enum Format {
    Known(&'static Importer, Plain),
    Csv(Box<import_csv::Arguments>),
    Ros2(Box<import_ros2::Arguments>),
    Tum(Box<import_tum::Arguments>),
    Motions(Box<import_motions::Arguments>),
}

/// What every format of the table takes.
#[derive(Args)]
struct Plain {
    /// File or folder to import.
    source: PathBuf,
    /// Folder for the dataset; a source of several sessions gets one folder a session inside it.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Replace datasets that are already there.
    #[arg(long)]
    force: bool,

    #[command(flatten)]
    identity: SessionIdentity,
}

/// The name of the format that is none.
const CSV: &str = "csv";
/// Bags, of ROS 1 too.
const ROS2: &str = "ros2";
const ROS1: &str = "ros1";
/// Trajectories, with wheels from another file.
const TUM: &str = "tum";
/// Relative motions in pairs.
const MOTIONS: &str = "motions";

impl FromArgMatches for Format {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let missing = || clap::Error::new(clap::error::ErrorKind::MissingSubcommand);
        let (name, matches) = matches.subcommand().ok_or_else(missing)?;
        match importer(name) {
            Some(importer) => Ok(Self::Known(importer, Plain::from_arg_matches(matches)?)),
            None if name == ROS2 => Ok(Self::Ros2(Box::new(import_ros2::Arguments::from_arg_matches(matches)?))),
            None if name == TUM => Ok(Self::Tum(Box::new(import_tum::Arguments::from_arg_matches(matches)?))),
            None if name == MOTIONS => {
                Ok(Self::Motions(Box::new(import_motions::Arguments::from_arg_matches(matches)?)))
            }
            None => Ok(Self::Csv(Box::new(import_csv::Arguments::from_arg_matches(matches)?))),
        }
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl Subcommand for Format {
    fn augment_subcommands(command: Command) -> Command {
        let csv = import_csv::Arguments::augment_args(Command::new(CSV));
        let ros2 = import_ros2::Arguments::augment_args(Command::new(ROS2).visible_alias(ROS1));
        let tum = import_tum::Arguments::augment_args(Command::new(TUM));
        let motions = import_motions::Arguments::augment_args(Command::new(MOTIONS));
        let known =
            IMPORTERS.iter().map(|importer| Plain::augment_args(Command::new(importer.name)).about(importer.about));
        command
            .subcommand(csv)
            .subcommand(ros2)
            .subcommand(tum)
            .subcommand(motions)
            .subcommands(known)
            .subcommand_required(true)
            .subcommand_value_name("FORMAT")
    }

    fn augment_subcommands_for_update(command: Command) -> Command {
        Self::augment_subcommands(command)
    }

    fn has_subcommand(name: &str) -> bool {
        [CSV, ROS2, ROS1, TUM, MOTIONS].contains(&name) || importer(name).is_some()
    }
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
    match &arguments.format {
        Format::Known(importer, arguments) => run_known(importer, arguments, terminal),
        Format::Csv(arguments) => import_csv::run(arguments, terminal),
        Format::Ros2(arguments) => import_ros2::run(arguments, terminal),
        Format::Tum(arguments) => import_tum::run(arguments, terminal),
        Format::Motions(arguments) => import_motions::run(arguments, terminal),
    }
}

fn run_known(importer: &Importer, arguments: &Plain, terminal: &Terminal) -> Result<ExitCode, Failure> {
    let sources = (importer.open)(&arguments.source)?;
    let dirs = folders(arguments, &sources)?;
    let was_there = arguments.out.exists();
    let datasets = write(sources, dirs, arguments, terminal).inspect_err(|_| {
        // Nothing of a failed import stays, not even the folder that was to hold its sessions.
        if !was_there {
            let _ = std::fs::remove_dir(&arguments.out);
        }
    })?;
    terminal.document(&Document {
        format: importer.name.to_owned(),
        source: arguments.source.display().to_string(),
        datasets,
    })?;
    Ok(ExitCode::SUCCESS)
}

/// Writes all datasets, a run at a time, before the first is put into its place.
fn write(
    sources: Vec<Source>,
    dirs: Vec<PathBuf>,
    arguments: &Plain,
    terminal: &Terminal,
) -> Result<Vec<Imported>, Failure> {
    let mut written = Vec::with_capacity(sources.len());
    for (source, dir) in sources.into_iter().zip(dirs) {
        let mut header = source.header;
        arguments.identity.state_in(&mut header.provenance);
        let mut writer = begin_dataset(header, &dir, arguments.force)?;
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
        terminal.note(&format!("{runs} runs, {odometry_rows} odometry rows in {}", dir.display()))?;
        datasets.push(Imported { dataset: dir.display().to_string(), runs, odometry_rows });
    }
    Ok(datasets)
}

/// A folder for each session. Refuses before the first is written, so that an import is done as a whole.
fn folders(arguments: &Plain, sessions: &[Source]) -> Result<Vec<PathBuf>, Failure> {
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
