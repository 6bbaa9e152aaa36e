//! What `import csv` and `import ros2` ask of the robot, and how they ask for it.

use std::path::{Path, PathBuf};

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use dataset::import::csv::{Rates, RobotGiven};
use dataset::{DatasetError, NominalRobot};
use kinematics::Wheels;
use serde::Deserialize;

use crate::session_identity::SessionIdentity;
use crate::terminal::Failure;

/// The robot's own numbers, which stand in no log.
#[derive(Args)]
pub(crate) struct RobotArguments {
    /// Nominal wheel diameter, metres; two with a comma are left and right.
    #[arg(long, value_name = "METRES", value_parser = diameters, help_heading = "Robot")]
    wheel: Option<Wheels<f64>>,
    /// Nominal distance between the wheel contacts, metres.
    #[arg(long, value_name = "METRES", value_parser = base, help_heading = "Robot")]
    base: Option<f64>,
    /// Counts for one turn of the wheel, after decoding and gears; need not be whole.
    #[arg(long, value_name = "COUNTS", value_parser = positive, help_heading = "Robot")]
    ticks_per_rev: Option<f64>,
    /// Width of the counters, where they wrap.
    #[arg(long, value_name = "BITS", value_parser = clap::value_parser!(u8).range(2..=63), help_heading = "Robot")]
    counter_bits: Option<u8>,
    /// A dataset.toml, or a file with its [robot], instead of the four.
    #[arg(long, value_name = "FILE", help_heading = "Robot")]
    robot: Option<PathBuf>,

    #[command(flatten)]
    pub(crate) identity: SessionIdentity,
}

impl RobotArguments {
    /// What was given, by flags or by a file.
    pub(crate) fn given(&self) -> Result<RobotGiven, Failure> {
        let robot = self.robot.as_ref().map(|file| read_robot(file)).transpose()?;
        let diameter =
            |robot: NominalRobot| Wheels { left: robot.left_wheel_diameter_m, right: robot.right_wheel_diameter_m };
        Ok(RobotGiven {
            wheel_diameter_m: self.wheel.or(robot.map(diameter)),
            wheel_separation_m: self.base.or(robot.map(|robot| robot.wheel_separation_m)),
            ticks_per_rev: self.ticks_per_rev.or(robot.and_then(|robot| robot.ticks_per_rev)),
            counter_bits: self.counter_bits.or(robot.and_then(|robot| robot.counter_bits)),
        })
    }
}

/// Largest wheel or base that is taken for metres: beyond it, millimetres are meant.
const LARGEST_M: f64 = 10.0;

pub(crate) fn positive(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(number) if number.is_finite() && number > 0.0 => Ok(number),
        _ => Err("expected a positive number".to_owned()),
    }
}

fn base(text: &str) -> Result<f64, String> {
    match positive(text)? {
        length_m if length_m < LARGEST_M => Ok(length_m),
        length => Err(format!("{length} m is no robot's; metres are expected: {} for millimetres", length / 1e3)),
    }
}

fn diameters(text: &str) -> Result<Wheels<f64>, String> {
    match text.split_once(',') {
        Some((left, right)) => Ok(Wheels { left: base(left)?, right: base(right)? }),
        None => base(text).map(Wheels::both),
    }
}

/// A value of a fixed list, by its name.
pub(crate) fn named<T: Copy + Send + Sync + 'static>(
    all: &[T],
    name: fn(T) -> &'static str,
) -> impl TypedValueParser<Value = T> + use<T> {
    let all = all.to_vec();
    PossibleValuesParser::new(all.iter().map(|value| name(*value)).collect::<Vec<_>>())
        .try_map(move |text| all.iter().copied().find(|value| name(*value) == text).ok_or("no such value"))
}

pub(crate) fn rates() -> impl TypedValueParser<Value = Rates> {
    named(&[Rates::IntervalEnd, Rates::Instantaneous], Rates::name)
}

/// Longest file of --robot, bytes: that of a dataset.toml.
const MAX_ROBOT_BYTES: u64 = 4 << 20;

/// The robot of a dataset.toml.
fn read_robot(file: &Path) -> Result<NominalRobot, Failure> {
    #[derive(Deserialize)]
    struct WithRobot {
        robot: toml::Table,
    }
    let no_robot = |error: toml::de::Error| format!("{}: no [robot] of a dataset: {}", file.display(), error.message());
    let bytes = atomic_file::read_at_most(file, MAX_ROBOT_BYTES);
    let text = bytes.and_then(|bytes| String::from_utf8(bytes).map_err(std::io::Error::other));
    let text = text.map_err(|error| format!("{}: {error}", file.display()))?;
    let WithRobot { mut robot } = toml::from_str(&text).map_err(no_robot)?;
    // Robots of one kind may share the file: --robot-id says which one this is.
    robot.remove("id");
    Ok(robot.try_into().map_err(no_robot)?)
}

/// What is missing, as the command line to type; none of another error.
pub(crate) fn with_command_line(error: &DatasetError) -> Option<Failure> {
    let DatasetError::RobotNotGiven { flags, .. } = error else { return None };
    let quoted = |argument: String| {
        if argument.contains([' ', '[', '*', ';', '|']) { format!("'{argument}'") } else { argument }
    };
    let typed: Vec<String> = std::env::args().skip(1).map(quoted).collect();
    Some(format!("{error}, like this: yair {} {flags}", typed.join(" ")).into())
}
