//! What importers ask of the robot, and how they ask for it: flags, files of the robot, and the description
//! in a bag.

use std::path::{Path, PathBuf};

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use dataset::import::csv::{Rates, RobotGiven};
use dataset::{DatasetError, NominalRobot};
use kinematics::Wheels;
use robot_files::Robot;
use serde::Deserialize;

use crate::session_identity::SessionIdentity;
use crate::terminal::{Failure, Terminal};

/// The robot's own numbers, which are in no log.
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
    /// A file of the robot in place of these: the YAML of its controller, its URDF, a dataset.toml, or what
    /// yair export writes. Flags come before it.
    #[arg(long, value_name = "FILE", help_heading = "Robot")]
    robot: Option<PathBuf>,
    /// Which controller of the file, where it has several.
    #[arg(long, value_name = "NAME", requires = "robot", help_heading = "Robot")]
    controller: Option<String>,

    #[command(flatten)]
    pub(crate) identity: SessionIdentity,
}

/// A robot by flags and files, and where its numbers are from.
#[derive(Default)]
pub(crate) struct Stated {
    pub(crate) given: RobotGiven,
    /// Joints of the wheels.
    pub(crate) joints: Option<Wheels<String>>,
    /// What was read from where, in one line.
    pub(crate) source: Option<String>,
    pub(crate) remarks: Vec<String>,
}

impl Stated {
    /// Shows what was read from where.
    pub(crate) fn show(&self, terminal: &Terminal) -> Result<(), Failure> {
        for remark in &self.remarks {
            terminal.remark(&format!("warning: {remark}"));
        }
        self.source.iter().try_for_each(|source| terminal.note(&format!("robot: {source} (--robot)")))
    }

    /// What a file says, where nothing was said before.
    fn complete(&mut self, place: &str, robot: Robot) {
        let part = if robot.part.is_empty() { String::new() } else { format!(" ({})", robot.part) };
        let place = format!("{place}{part}");
        self.given.ticks_per_rev = self.given.ticks_per_rev.or(robot.ticks_per_rev);
        let diameter_m = robot.diameter_m(self.given.ticks_per_rev);
        if robot.m_per_tick.is_some() && diameter_m.is_none() {
            let why = "it has the travel of a count and no diameter: --ticks-per-rev COUNTS makes one of it";
            self.remarks.push(format!("{place}: {why}"));
        }
        self.remarks.extend(robot.remarks.iter().map(|remark| format!("{place}: {remark}")));
        let mm = |length_m: f64| format!("{:.3} mm", 1e3 * length_m);
        let wheels = diameter_m.map(|wheels_m| match wheels_m.left == wheels_m.right {
            true => format!("wheels {}", mm(wheels_m.left)),
            false => format!("wheels {} left and {} right", mm(wheels_m.left), mm(wheels_m.right)),
        });
        let separation = robot.wheel_separation_m.map(|separation_m| format!("{} apart", mm(separation_m)));
        let counts = robot.ticks_per_rev.map(|counts| format!("{counts} counts a turn"));
        let joints = robot.joints.as_ref().map(|joints| format!("joints {} and {}", joints.left, joints.right));
        let all: Vec<String> = [wheels, separation, counts, joints].into_iter().flatten().collect();
        self.source = Some(format!("{}, by {place}", all.join(", ")));
        self.given.wheel_diameter_m = self.given.wheel_diameter_m.or(diameter_m);
        self.given.wheel_separation_m = self.given.wheel_separation_m.or(robot.wheel_separation_m);
        self.joints = self.joints.take().or(robot.joints);
    }
}

impl RobotArguments {
    /// What was given, by flags or by a file.
    pub(crate) fn stated(&self) -> Result<Stated, Failure> {
        let Self { wheel, base, ticks_per_rev, counter_bits, .. } = *self;
        let given = RobotGiven { wheel_diameter_m: wheel, wheel_separation_m: base, ticks_per_rev, counter_bits };
        let mut stated = Stated { given, ..Stated::default() };
        let Some(file) = &self.robot else { return Ok(stated) };
        if file.extension().is_some_and(|ending| ending == "toml") {
            let robot = read_robot(file)?;
            let diameter_m = Wheels { left: robot.left_wheel_diameter_m, right: robot.right_wheel_diameter_m };
            stated.given.counter_bits = counter_bits.or(robot.counter_bits);
            stated.given.ticks_per_rev = ticks_per_rev.or(robot.ticks_per_rev);
            stated.given.wheel_diameter_m = wheel.or(Some(diameter_m));
            stated.given.wheel_separation_m = base.or(Some(robot.wheel_separation_m));
            return Ok(stated);
        }
        let place = file.display().to_string();
        let robot = Robot::read(&place, &read_text(file)?, self.controller.as_deref());
        stated.complete(&place, robot.map_err(|error| format!("{place}: {error}"))?);
        Ok(stated)
    }

    /// As [`Self::stated`], with what a bag's robot description says of what is still open. A description
    /// that says other lengths than a file is remarked.
    pub(crate) fn stated_beside(&self, description: Option<(&str, &str)>) -> Result<Stated, Failure> {
        let mut stated = self.stated()?;
        let Some((topic, text)) = description else { return Ok(stated) };
        let RobotGiven { wheel_diameter_m, wheel_separation_m, .. } = stated.given;
        match Robot::read("robot.urdf", text, None) {
            Err(why) if wheel_diameter_m.is_none() || wheel_separation_m.is_none() => {
                stated.remarks.push(format!("{topic}: {why}"));
            }
            Err(_) => {}
            Ok(robot) if self.robot.is_some() => {
                let mean = |wheels_m: Wheels<f64>| (wheels_m.left * wheels_m.right).sqrt();
                let pairs = [
                    ("the wheels' diameter", wheel_diameter_m.map(mean), robot.wheel_diameter_m.map(mean)),
                    ("the wheel separation", wheel_separation_m, robot.wheel_separation_m),
                ];
                for (what, by_file, by_topic) in pairs {
                    let Some((by_file, by_topic)) = by_file.zip(by_topic) else { continue };
                    if (by_file / by_topic).ln().abs() > MAX_DESCRIPTIONS_DIFFER.ln_1p() {
                        stated.remarks.push(format!(
                            "{what} is {:.1} mm by --robot and {:.1} mm by {topic} of the bag, {:.2} times as much",
                            1e3 * by_file,
                            1e3 * by_topic,
                            by_topic / by_file
                        ));
                    }
                }
            }
            Ok(robot) => {
                if wheel_diameter_m.is_none() || wheel_separation_m.is_none() {
                    stated.complete(&format!("{topic} of the bag"), robot);
                } else {
                    stated.joints = robot.joints;
                }
            }
        }
        Ok(stated)
    }
}

/// Share. A robot's files differ by more where one of them is wrong: an effective separation of skid steering
/// is up to twice the drawn one, and is worth the remark too.
const MAX_DESCRIPTIONS_DIFFER: f64 = 0.1;

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

/// The text of a robot's file.
pub(crate) fn read_text(file: &Path) -> Result<String, Failure> {
    let bytes = atomic_file::read_at_most(file, MAX_ROBOT_BYTES);
    let text = bytes.and_then(|bytes| String::from_utf8(bytes).map_err(std::io::Error::other));
    Ok(text.map_err(|error| format!("{}: {error}", file.display()))?)
}

/// The robot of a dataset.toml.
fn read_robot(file: &Path) -> Result<NominalRobot, Failure> {
    #[derive(Deserialize)]
    struct WithRobot {
        robot: toml::Table,
    }
    let no_robot = |error: toml::de::Error| format!("{}: no [robot] of a dataset: {}", file.display(), error.message());
    let WithRobot { mut robot } = toml::from_str(&read_text(file)?).map_err(no_robot)?;
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
    let or = "or --robot FILE with the robot's controllers.yaml, URDF or dataset.toml";
    Some(format!("{error}, {or}, like this: yair {} {flags}", typed.join(" ")).into())
}
