//! `yair import ros2 BAG --out DIR`

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use dataset::import::csv::Rates;
use ros_bag::{FromBag, Listing, OpenBag, Options, RosBagError, Took, TookTopic, WheelFields, WheelQuantity};
use serde::Serialize;

use crate::import_robot::{RobotArguments, Stated, named, positive, rates, with_command_line};
use crate::simulate::write_dataset;
use crate::terminal::{Failure, Terminal, table};

/// A bag of ROS 2 or ROS 1: a folder of rosbag2, or one .mcap, .db3 or .bag file
///
/// Two topics become a dataset: the robot's wheels and the poses of an outside instrument; with an Imu, its
/// yaw rates too. Without such poses the straight walls that a lidar sees take their place: spin in front of
/// one. --list shows what a bag holds and what to type. Known types of wheels: JointState and
/// DynamicJointState (joints by name), SensorState of turtlebot3 and kobuki, WheelTicks and WheelVels of the
/// Create 3, and the twists of Odometry and TwistStamped; any other by --left-field, --right-field and --as.
/// Of poses: PoseStamped, PoseWithCovarianceStamped, TransformStamped, Odometry of an instrument, and
/// TFMessage with --truth-frames. Types of ROS 1 have the names that ROS 2 gives them. What
/// /robot_description says of the wheels needs no flag.
#[derive(Args)]
pub(crate) struct Arguments {
    /// Folder with metadata.yaml, or one .mcap, .mcap.zstd, .db3 or .bag file.
    bag: PathBuf,
    /// Folder for the dataset.
    #[arg(long, value_name = "DIR", required_unless_present = "list")]
    out: Option<PathBuf>,
    /// Replace a dataset that is already there.
    #[arg(long)]
    force: bool,
    /// Show the topics and what to type; write nothing.
    #[arg(long)]
    list: bool,

    /// Topic of the wheels; or, where each wheel has its own, both as LEFT_TOPIC[.field],RIGHT_TOPIC[.field]:
    /// the right wheel is then taken at the left wheel's instants.
    #[arg(long, value_name = "TOPIC[,TOPIC]", help_heading = "Topics")]
    wheels: Option<String>,
    /// Topic of the poses of an outside instrument; none where the wheels and a gyro are all there is: then
    /// neither poses nor scans are taken without their flags.
    #[arg(long, value_name = "TOPIC", help_heading = "Topics")]
    truth: Option<String>,
    /// Topic of a lidar's scans (LaserScan), in place of poses or with them: its straight walls become
    /// wall.csv. Taken by itself where it is the only one and the bag has no poses of an instrument. Where
    /// the lidar is on the robot is estimated, starting from /tf_static.
    #[arg(long, value_name = "TOPIC", help_heading = "Topics")]
    scan: Option<String>,
    /// Topic of a gyroscope (Imu), if the bag's only one is not meant: its rates about the z axis of its
    /// frame, which is taken as up, become the column gyro_radps, their mean over the interval that ends at a
    /// row. none leaves the gyro out.
    #[arg(long, value_name = "TOPIC", help_heading = "Topics")]
    gyro: Option<String>,
    /// Which transform is the robot's pose, where --truth is a topic of transforms: one of it, or the chain
    /// of them and of those of /tf_static between the two frames. Where the wheels' own odometry is in the
    /// chain, as in map to odom to base_link, only the corrections of the map are poses.
    #[arg(long, value_name = "PARENT,CHILD", value_parser = frames, help_heading = "Topics")]
    truth_frames: Option<(String, String)>,
    /// Definition of a message type that the bag itself does not define, as PACKAGE/msg/TYPE.msg or
    /// PACKAGE/TYPE=FILE; may be given several times. Usual types are known.
    #[arg(long = "msg", value_name = "FILE", help_heading = "Topics")]
    definitions: Vec<PathBuf>,
    /// Cut runs where the robot stands still, or the log has a gap, for longer than that.
    #[arg(long, value_name = "SECONDS", value_parser = positive, help_heading = "Topics")]
    cut: Option<f64>,

    /// Joint of the left wheel.
    #[arg(long, value_name = "NAME", requires = "right_joint", help_heading = "Wheels")]
    left_joint: Option<String>,
    /// Joint of the right wheel.
    #[arg(long, value_name = "NAME", requires = "left_joint", help_heading = "Wheels")]
    right_joint: Option<String>,
    /// Number of the left wheel in a message of any type, such as encoders.left or data[0]; the forward speed
    /// of a twist.
    #[arg(long, value_name = "PATH", requires_all = ["right_field", "quantity"], help_heading = "Wheels")]
    left_field: Option<String>,
    /// Number of the right wheel; the yaw rate of a twist.
    #[arg(long, value_name = "PATH", requires_all = ["left_field", "quantity"], help_heading = "Wheels")]
    right_field: Option<String>,
    /// What the wheels' numbers are, where --left-field or two topics name them: counts, angles, angular
    /// speeds, contact speeds in m/s, or speed and yaw rate.
    #[arg(
        id = "quantity",
        long = "as",
        value_name = "WHICH",
        value_parser = named(&WheelQuantity::ALL, WheelQuantity::name),
        help_heading = "Wheels"
    )]
    quantity: Option<WheelQuantity>,
    /// Whether a speed is the mean over the interval that ends there, or that of the instant.
    #[arg(long, value_name = "WHICH", value_parser = rates(), help_heading = "Wheels")]
    rates: Option<Rates>,

    #[command(flatten)]
    robot: RobotArguments,
}

fn frames(text: &str) -> Result<(String, String), String> {
    match text.split_once(',').map(|(parent, child)| (parent.trim(), child.trim())) {
        Some((parent, child)) if !parent.is_empty() && !child.is_empty() => Ok((parent.to_owned(), child.to_owned())),
        _ => Err("expected two frames with a comma, such as map,base_link".to_owned()),
    }
}

/// Of a gyro beside poses with headings.
const GYRO_BESIDE_POSES: &str =
    "the gyro is in the column gyro_radps; calibrate, check and diagnose use the poses and leave it out";

/// Of a gyro that nobody named, beside poses without headings or walls.
const GYRO_UNASKED: &str = "  also using the gyro; to ignore it, give --gyro none";

#[derive(Serialize)]
struct Document<'a> {
    format: &'static str,
    source: String,
    datasets: [Written; 1],
    took: &'a Took,
    warnings: &'a [String],
}

#[derive(Serialize)]
struct Written {
    dataset: String,
    runs: usize,
    odometry_rows: usize,
    truth_rows: usize,
    wall_rows: usize,
}

#[derive(Serialize)]
struct Listed<'a> {
    format: &'static str,
    source: String,
    #[serde(flatten)]
    listing: &'a Listing,
    command: Option<String>,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    match &arguments.out {
        Some(out) if !arguments.list => import(arguments, out, terminal)?,
        _ => list(arguments, terminal)?,
    }
    Ok(ExitCode::SUCCESS)
}

fn import(arguments: &Arguments, out: &Path, terminal: &Terminal) -> Result<(), Failure> {
    let open = OpenBag::open(&arguments.bag, &arguments.definitions)?;
    let stated = arguments.robot.stated_beside(open.robot_description())?;
    stated.show(terminal)?;
    let as_question = |error: RosBagError| match &error {
        RosBagError::Dataset(missing) => with_command_line(missing).unwrap_or_else(|| error.into()),
        _ => error.into(),
    };
    let FromBag { mut dataset, took, warnings } = open.import(&arguments.options(stated)).map_err(as_question)?;
    arguments.robot.identity.state_in(&mut dataset.provenance);
    let topics = [
        ("wheels", "--wheels", Some(&took.wheels)),
        ("truth", "--truth", took.truth.as_ref()),
        ("scan", "--scan", took.scan.as_ref()),
        ("gyro", "--gyro", took.gyro.as_ref()),
    ];
    for (what, flag, topic) in topics {
        let Some(topic) = topic else { continue };
        let TookTopic { topic, type_name, what: of, quantity, rows, times } = topic;
        terminal.note(&format!("{what}: {topic} ({type_name}), {of}, {quantity}, {rows} rows by {times} ({flag})"))?;
    }
    let has_headings = dataset.runs.iter().flat_map(|run| run.truth.iter()).any(|pose| pose.theta_rad().is_some());
    match (&took.gyro, &arguments.gyro) {
        (Some(_), _) if has_headings => terminal.note(GYRO_BESIDE_POSES)?,
        (Some(_), None) if took.truth.is_some() || took.scan.is_some() => terminal.note(GYRO_UNASKED)?,
        _ => {}
    }
    for warning in &warnings {
        terminal.remark(&format!("warning: {warning}"));
    }
    write_dataset(&dataset, out, arguments.force)?;
    let written = Written {
        dataset: out.display().to_string(),
        runs: dataset.runs.len(),
        odometry_rows: dataset.runs.iter().map(|run| run.odometry.t_s.len()).sum(),
        truth_rows: dataset.runs.iter().map(|run| run.truth.len()).sum(),
        wall_rows: dataset.runs.iter().map(|run| run.walls.len()).sum(),
    };
    let Written { dataset: out, runs, odometry_rows, truth_rows, wall_rows } = &written;
    let walls = if took.scan.is_some() { format!(", {wall_rows} readings of walls") } else { String::new() };
    terminal.note(&format!("{runs} runs, {odometry_rows} odometry rows, {truth_rows} truth rows{walls} in {out}"))?;
    terminal.document(&Document {
        format: "ros2",
        source: arguments.bag.display().to_string(),
        datasets: [written],
        took: &took,
        warnings: &warnings,
    })
}

impl Arguments {
    fn options(&self, stated: Stated) -> Options {
        Options {
            wheels: self.wheels.clone(),
            truth: self.truth.clone(),
            scan: self.scan.clone(),
            gyro: self.gyro.clone(),
            definitions: self.definitions.clone(),
            fields: WheelFields {
                left_joint: self.left_joint.clone(),
                right_joint: self.right_joint.clone(),
                left_field: self.left_field.clone(),
                right_field: self.right_field.clone(),
                quantity: self.quantity,
            },
            truth_frames: self.truth_frames.clone(),
            rates: self.rates,
            cut_s: self.cut,
            known_wheels: stated.joints,
            robot: stated.given,
        }
    }
}

fn list(arguments: &Arguments, terminal: &Terminal) -> Result<(), Failure> {
    let listing = ros_bag::list(&arguments.bag, &arguments.definitions)?;
    for warning in &listing.warnings {
        terminal.remark(&format!("warning: {warning}"));
    }
    let mut lines = table(&["topic", "type", "messages", "Hz", "s", "may be"], 2);
    for topic in &listing.topics {
        let rate = topic.rate_hz.map_or_else(|| "–".to_owned(), |rate_hz| format!("{rate_hz:.1}"));
        let row = [
            topic.topic.clone(),
            topic.type_name.clone(),
            topic.messages.to_string(),
            rate,
            format!("{:.1}", topic.span_s),
            topic.may_be.unwrap_or_default().to_owned(),
        ];
        lines.add_row(row);
    }
    terminal.say(&lines.to_string())?;
    for topic in &listing.topics {
        if !topic.joints.is_empty() {
            terminal.say(&format!("joints of {}: {}", topic.topic, topic.joints.join(", ")))?;
        }
        if !topic.frames.is_empty() {
            let frames: Vec<String> = topic.frames.iter().map(|pair| pair.join(",")).collect();
            terminal.say(&format!("frames of {}: {}", topic.topic, frames.join(" ")))?;
        }
    }
    let command = command(arguments, &listing);
    if let Some(command) = &command {
        terminal.say(&format!("to import it: {command}"))?;
    }
    let has_no_reference = listing.truth.is_none() && listing.scan.is_none();
    let missing = [
        (listing.wheels.is_none(), "wheels of a known type"),
        (has_no_reference && listing.gyro.is_none(), "poses of an instrument"),
    ];
    for (_, what) in missing.iter().filter(|(is_missing, _)| *is_missing) {
        terminal.say(&format!("no topic is plainly one of {what}; --help says how to name any other"))?;
    }
    terminal.document(&Listed {
        format: "ros2",
        source: arguments.bag.display().to_string(),
        listing: &listing,
        command,
    })
}

/// The command line that imports the most plausible topics.
fn command(arguments: &Arguments, listing: &Listing) -> Option<String> {
    let has_reference = listing.truth.is_some() || listing.scan.is_some() || listing.gyro.is_some();
    if listing.wheels.is_none() && !has_reference {
        return None;
    }
    let quoted = |name: &str| if name.contains(' ') { format!("'{name}'") } else { name.to_owned() };
    let topic = |topic: &Option<String>| topic.as_deref().map_or_else(|| "TOPIC".to_owned(), quoted);
    let flags: String = listing.flags.iter().map(|flag| format!(" {flag}")).collect();
    let gyro = listing.gyro.as_deref().map(|topic| format!(" --gyro {}", quoted(topic))).unwrap_or_default();
    let reference = match (&listing.truth, &listing.scan) {
        (None, Some(scan)) => format!("--scan {}", quoted(scan)),
        (None, None) if listing.gyro.is_some() => "--truth none".to_owned(),
        (truth, _) => format!("--truth {}", topic(truth)),
    };
    let ticks = if listing.is_counted { " --ticks-per-rev COUNTS" } else { "" };
    let robot = match listing.robot_description {
        Some(_) => "",
        None => " --wheel DIAMETER_M --base SEPARATION_M",
    };
    Some(format!(
        "yair import ros2 {} --out DIR --wheels {} {reference}{gyro}{flags}{robot}{ticks}",
        quoted(&arguments.bag.display().to_string()),
        topic(&listing.wheels),
    ))
}
