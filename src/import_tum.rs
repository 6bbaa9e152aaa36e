//! `yair import tum TRUTH... --wheels FILE... | --odometry FILE... --out DIR`

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use dataset::import::csv::{TumMotion, read_tum};

use crate::import_csv::{self, ReadingArguments};
use crate::terminal::{Failure, Terminal};

/// TUM trajectories (t x y z qx qy qz qw) of an outside instrument, with the robot's wheels or odometry
///
/// A trajectory has no wheels: --wheels names files that hold them, in any columns that `yair import csv`
/// finds, or --odometry trajectories of the robot's own dead reckoning, whose twists from pose to pose are
/// taken. Several files are a run each; as many trajectories of either kind belong together in the order in
/// which they are given. Poses that are tilted by more than 10 degrees are remarked, from 45 degrees on
/// they are refused. All flags of columns, units and writing are for the files of --wheels; --length-unit
/// and --time-unit are for the trajectories too.
#[derive(Args)]
#[group(id = "motion", required = true, multiple = false, args = ["wheels", "odometry"])]
pub(crate) struct Arguments {
    /// Trajectories of the instrument.
    #[arg(required = true, value_name = "TRUTH")]
    truths: Vec<PathBuf>,
    /// File of the wheels, or of twists, as `yair import csv` reads it; may be given several times.
    #[arg(long, value_name = "FILE")]
    wheels: Vec<PathBuf>,
    /// Trajectory of the robot's own dead reckoning; may be given several times.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["map", "runs_by", "wheel_unit", "rates", "delimiter", "decimal", "header"])]
    odometry: Vec<PathBuf>,
    /// Folder for the dataset.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Replace a dataset that is already there.
    #[arg(long)]
    force: bool,

    #[command(flatten)]
    reading: ReadingArguments,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    let Arguments { truths, wheels, odometry, out, force, reading } = arguments;
    let motion = if odometry.is_empty() { TumMotion::Wheels(wheels) } else { TumMotion::Odometry(odometry) };
    let sources = [&truths[..], wheels, odometry].concat();
    let found = reading.identified(read_tum(truths, motion, &reading.options(terminal)?));
    import_csv::write("tum", &sources, found, out, *force, terminal)
}
