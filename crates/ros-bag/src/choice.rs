//! Which topics are the wheels and the poses of an outside instrument, where nobody says.

use crate::error::RosBagError;
use crate::gyro;
use crate::laser_scan::LASER_SCAN;
use crate::topics::{Survey, TRANSFORMS, Topic};
use crate::truth::TRUTH_TYPES;
use crate::wheels::{WHEEL_TYPES, WheelQuantity, has_joints, wheel_joints};

/// Parts of the names that topics of outside instruments have.
const INSTRUMENTS: [&str; 11] = [
    "truth",
    "mocap",
    "motion_capture",
    "vicon",
    "optitrack",
    "vrpn",
    "qualisys",
    "natnet",
    "phasespace",
    "tracker",
    "total_station",
];
/// Parts of the names that poses have which the robot computes from its own odometry, or is to drive to.
const OWN_POSES: [&str; 13] =
    ["odom", "amcl", "ekf", "ukf", "filtered", "fused", "slam", "goal", "initial", "target", "setpoint", "plan", "cmd"];

/// What is said in place of a topic where none is to be taken; a topic of that name is `/none`.
pub(crate) const NONE: &str = "none";

/// How good a candidate a topic is, best first; none where it is no candidate.
type Rank = Option<u8>;

fn contains(topic: &Topic, parts: &[&str]) -> bool {
    let name = topic.name.to_lowercase();
    parts.iter().any(|part| name.contains(part))
}

/// Counted wheels and joints come before speeds that were computed from them.
pub(crate) fn wheels_rank(topic: &Topic) -> Rank {
    if topic.count < 2 || contains(topic, &INSTRUMENTS) || contains(topic, &["cmd"]) {
        return None;
    }
    if has_joints(&topic.type_name) {
        return wheel_joints(topic).map(|_| 0);
    }
    let (_, _, _, quantity, _) = WHEEL_TYPES.iter().find(|(of, ..)| *of == topic.type_name)?;
    Some(match quantity {
        WheelQuantity::Ticks | WheelQuantity::Angles => 0,
        WheelQuantity::AngularSpeeds | WheelQuantity::Speeds => 1,
        WheelQuantity::Twist => 2,
    })
}

/// Poses that are no odometry; those named after an instrument first.
pub(crate) fn truth_rank(topic: &Topic) -> Rank {
    if topic.count < 2 || !TRUTH_TYPES.iter().any(|(of, ..)| *of == topic.type_name) {
        return None;
    }
    if contains(topic, &INSTRUMENTS) {
        return Some(0);
    }
    let is_own = contains(topic, &OWN_POSES) || topic.type_name == "nav_msgs/msg/Odometry";
    (!is_own).then_some(1)
}

/// Rates of a gyroscope on the robot; those after their driver's bias was taken out come before raw ones.
pub(crate) fn gyro_rank(topic: &Topic) -> Rank {
    let is_gyro = topic.count > 1 && topic.type_name == gyro::IMU && !contains(topic, &INSTRUMENTS);
    is_gyro.then(|| u8::from(contains(topic, &["raw"])))
}

/// Scans of a lidar on the robot.
pub(crate) fn scan_rank(topic: &Topic) -> Rank {
    (topic.count > 1 && topic.type_name == LASER_SCAN).then_some(0)
}

/// Are these poses, which the user named, likely the robot's own odometry, or what was fused from it?
pub(crate) fn is_own_estimate(topic: &Topic, frames: Option<&(String, String)>) -> bool {
    if topic.type_name == TRANSFORMS {
        return frames.is_some_and(|(parent, _)| parent.to_lowercase().contains("odom"));
    }
    truth_rank(topic).is_none()
}

/// The candidates of the best rank.
fn best(survey: &Survey, rank: fn(&Topic) -> Rank) -> Vec<&Topic> {
    let least = survey.topics.values().filter_map(rank).min();
    survey.topics.values().filter(|topic| rank(topic).is_some() && rank(topic) == least).collect()
}

/// The only topic of the best rank, for a suggestion.
pub(crate) fn suggested(survey: &Survey, rank: fn(&Topic) -> Rank) -> Option<&Topic> {
    best(survey, rank).first().copied()
}

fn choose<'a>(
    survey: &'a Survey,
    bag: &std::path::Path,
    rank: fn(&Topic) -> Rank,
    flag: &str,
    none: impl FnOnce() -> String,
) -> Result<&'a Topic, RosBagError> {
    let undecided = |why, flag| RosBagError::Undecided { bag: bag.to_owned(), why, flag };
    match best(survey, rank)[..] {
        [topic] => Ok(topic),
        [] => Err(undecided(none(), format!("{flag} TOPIC"))),
        ref several => {
            let named: Vec<String> = several.iter().map(|topic| format!("{flag} {}", topic.name)).collect();
            let what = match flag {
                "--wheels" => "wheels",
                "--scan" => "lidar, and none has poses of an outside instrument",
                _ => "poses of the instrument",
            };
            Err(undecided(format!("{} topics may be the {what}", several.len()), named.join(" or ")))
        }
    }
}

/// The topic of the wheels.
pub(crate) fn wheels<'a>(survey: &'a Survey, bag: &std::path::Path) -> Result<&'a Topic, RosBagError> {
    choose(survey, bag, wheels_rank, "--wheels", || {
        "no topic has wheels of a known type; any other is read with --left-field PATH --right-field PATH --as ticks, rad, radps, mps or twist"
            .to_owned()
    })
}

/// The topic of the gyroscope, if there is one, and what is to be known of it otherwise.
pub(crate) fn gyro(survey: &Survey) -> (Option<&Topic>, Option<String>) {
    match best(survey, gyro_rank)[..] {
        [topic] => (Some(topic), None),
        [] => (None, None),
        ref several => {
            let named: Vec<String> = several.iter().map(|topic| format!("--gyro {}", topic.name)).collect();
            let why =
                format!("{} topics may be the gyroscope; none was taken; say {}", several.len(), named.join(" or "));
            (None, Some(why))
        }
    }
}

/// Wheels alone are compared with nothing; `open` says why no gyroscope was taken.
pub(crate) fn nothing_beside_the_wheels(bag: &std::path::Path, open: Option<String>) -> RosBagError {
    let (why, flag) = (
        open.unwrap_or_else(|| "neither poses, nor scans, nor a gyro are taken with the wheels".to_owned()),
        "--truth TOPIC, --scan TOPIC or --gyro TOPIC".to_owned(),
    );
    RosBagError::Undecided { bag: bag.to_owned(), why, flag }
}

/// The topic that `--gyro` names.
pub(crate) fn named_gyro<'a>(survey: &'a Survey, topic: &str) -> Result<&'a Topic, RosBagError> {
    let topic = survey.named("--gyro", topic)?;
    if topic.type_name == gyro::IMU {
        return Ok(topic);
    }
    let why = format!("no type of a gyroscope; expected {}", gyro::IMU);
    Err(topic.unusable(why))
}

/// What the robot is compared with: poses, scans that show walls, or both.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reference<'a> {
    pub(crate) truth: Option<&'a Topic>,
    pub(crate) scan: Option<&'a Topic>,
}

/// The topics of the reference, of which a user may have named either. Without a name scans are taken where
/// no topic has poses; where the user says [`NONE`] for the poses, nothing is taken unasked.
pub(crate) fn reference<'a>(
    survey: &'a Survey,
    bag: &std::path::Path,
    [named_truth, named_scan]: [Option<&str>; 2],
) -> Result<Reference<'a>, RosBagError> {
    let named = |flag, topic: Option<&str>| topic.map(|topic| survey.named(flag, topic)).transpose();
    let is_none = named_truth == Some(NONE);
    let named_truth = named("--truth", named_truth.filter(|_| !is_none))?;
    let scan = named("--scan", named_scan)?;
    if let Some(topic) = scan.filter(|topic| topic.type_name != LASER_SCAN) {
        let why = format!("no type of scans; expected {LASER_SCAN}");
        return Err(topic.unusable(why));
    }
    if named_truth.is_some() || is_none {
        return Ok(Reference { truth: named_truth, scan });
    }
    let has_poses = survey.topics.values().any(|topic| truth_rank(topic).is_some());
    let has_scans = survey.topics.values().any(|topic| scan_rank(topic).is_some());
    if !has_poses && scan.is_none() && has_scans {
        return Ok(Reference { truth: None, scan: Some(choose(survey, bag, scan_rank, "--scan", String::new)?) });
    }
    let truth = if has_poses || scan.is_none() { Some(truth(survey, bag)?) } else { None };
    Ok(Reference { truth, scan })
}

/// The topic of the poses.
fn truth<'a>(survey: &'a Survey, bag: &std::path::Path) -> Result<&'a Topic, RosBagError> {
    let found = choose(survey, bag, truth_rank, "--truth", || {
        let is_pose =
            |topic: &&Topic| topic.type_name == TRANSFORMS || TRUTH_TYPES.iter().any(|(of, ..)| *of == topic.type_name);
        let own: Vec<&str> = survey.topics.values().filter(is_pose).map(|topic| &topic.name[..]).collect();
        let what = "no topic has poses of an outside instrument";
        match own[..] {
            [] => what.to_owned(),
            _ => format!("{what}; {} may be the robot's own estimate", own.join(", ")),
        }
    });
    found.map_err(|error| match (error, best(survey, gyro_rank).first()) {
        (RosBagError::Undecided { bag, why, flag }, Some(gyro)) if flag == "--truth TOPIC" => {
            let flag = format!("{flag}, or --truth {NONE} for the wheels and the gyro {} alone", gyro.name);
            RosBagError::Undecided { bag, why, flag }
        }
        (error, _) => error,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn topic(name: &str, type_name: &str) -> Topic {
        Topic { name: name.to_owned(), type_name: type_name.to_owned(), count: 100, ..Topic::default() }
    }

    fn survey(topics: &[Topic]) -> Survey {
        let topics = topics.iter().map(|topic| (topic.name.clone(), topic.clone())).collect();
        Survey { topics, ..Survey::default() }
    }

    #[test]
    fn the_robots_own_estimate_is_no_truth_and_counts_come_before_twists() {
        let pose = "geometry_msgs/msg/PoseStamped";
        let odometry = "nav_msgs/msg/Odometry";
        let joints = Topic {
            joints: ["left_wheel", "right_wheel"].map(str::to_owned).into(),
            ..topic("/joint_states", "sensor_msgs/msg/JointState")
        };
        let bag = std::path::Path::new("bag");
        let all = [joints, topic("/odom", odometry), topic("/goal_pose", pose), topic("/robot/pose", pose)];
        let with_joints = survey(&all);
        assert_eq!(wheels(&with_joints, bag).expect("one").name, "/joint_states");
        assert_eq!(truth(&with_joints, bag).expect("one").name, "/robot/pose");
        let without = survey(&all[1..3]);
        assert_eq!(wheels(&without, bag).expect("one").name, "/odom");
        let refused = truth(&without, bag).expect_err("none").to_string();
        assert!(refused.contains("/goal_pose, /odom may be the robot's own estimate; say --truth TOPIC"), "{refused}");
        // A gyroscope may be all that there is, and then is taken alone; nothing else is then.
        let imu = topic("/imu", gyro::IMU);
        let with_gyro = survey(&[all[1].clone(), imu]);
        let refused = truth(&with_gyro, bag).expect_err("none").to_string();
        assert!(refused.contains("or --truth none for the wheels and the gyro /imu alone"), "{refused}");
        let scans = survey(&[topic("/scan", LASER_SCAN), topic("/robot/pose", pose)]);
        let found = reference(&scans, bag, [Some(NONE), None]).expect("nothing");
        assert!(found.truth.is_none() && found.scan.is_none());
        let found = reference(&scans, bag, [Some(NONE), Some("/scan")]).expect("walls alone");
        assert!(found.truth.is_none() && found.scan.is_some_and(|topic| topic.name == "/scan"));
        let is_own: Vec<bool> = all[1..].iter().map(|topic| is_own_estimate(topic, None)).collect();
        assert_eq!(is_own, [true, true, false]);
        let two = survey(&[topic("/a/pose", pose), topic("/b/pose", pose)]);
        let refused = truth(&two, bag).expect_err("two").to_string();
        assert!(refused.contains("say --truth /a/pose or --truth /b/pose"), "{refused}");
        let mocap = survey(&[topic("/a/pose", pose), topic("/mocap/robot", odometry)]);
        assert_eq!(truth(&mocap, bag).expect("one").name, "/mocap/robot");
    }
}
