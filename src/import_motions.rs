//! `yair import motions ODOMETRY TRUTH --out DIR`

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use dataset::Unit;
use dataset::import::csv::{MotionOptions, read_motions};

use crate::import_csv;
use crate::import_robot::{RobotArguments, named, positive};
use crate::terminal::{Failure, Terminal};

/// Pairs of relative motions (dx dy dtheta a row) by the robot's odometry and by scan matching
///
/// Row by row both files say how the robot moved since the row before, in its own frame then: ahead, to the
/// left, and the turn. A fourth column before them is the time at which the motion ends; without it a row is
/// a --period. The odometry becomes the wheel angles of the stated robot, --wheel and --base: what is
/// calibrated are these, and the dataset's truth are displacements.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Motions by the robot's own odometry.
    odometry: PathBuf,
    /// Motions by the instrument, in as many rows.
    truth: PathBuf,
    /// Folder for the dataset.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Replace a dataset that is already there.
    #[arg(long)]
    force: bool,
    /// Time of a row where no column says it, seconds.
    #[arg(long, value_name = "SECONDS", value_parser = positive, default_value = "1")]
    period: f64,
    /// Unit of dx and dy.
    #[arg(long, value_name = "UNIT", value_parser = named(&Unit::LENGTHS, Unit::name), default_value = "m")]
    length_unit: Unit,
    /// Unit of dtheta.
    #[arg(long, value_name = "UNIT", value_parser = named(&Unit::ANGLES, Unit::name), default_value = "rad")]
    angle_unit: Unit,

    #[command(flatten)]
    robot: RobotArguments,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    let Arguments { odometry, truth, out, force, period, length_unit, angle_unit, robot } = arguments;
    let (length_unit, angle_unit) = (*length_unit, *angle_unit);
    let stated = robot.stated()?;
    stated.show(terminal)?;
    let options = MotionOptions { robot: stated.given, period_s: *period, length_unit, angle_unit };
    let found = read_motions(odometry, truth, &options).map(|mut found| {
        robot.identity.state_in(&mut found.imported.dataset.provenance);
        found
    });
    import_csv::write("motions", &[odometry.clone(), truth.clone()], found, out, *force, terminal)
}
