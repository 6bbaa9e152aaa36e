//! What `--list` shows.

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::bag::Bag;
use crate::choice::{gyro_rank, scan_rank, suggested, truth_rank, wheels_rank};
use crate::error::RosBagError;
use crate::topics::{Survey, Topic};
use crate::wheel_pair::COUNT_TYPES;
use crate::wheels::{WHEEL_TYPES, WheelQuantity, has_joints};

/// One topic.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ListedTopic {
    /// Its name.
    pub topic: String,
    /// Its type.
    #[serde(rename = "type")]
    pub type_name: String,
    /// Its messages.
    pub messages: u64,
    /// Messages a second; none of a single one.
    pub rate_hz: Option<f64>,
    /// From the first to the last message, seconds.
    pub span_s: f64,
    /// `wheels`, `truth`, `gyro` or `scan`, where it may be one of them.
    pub may_be: Option<&'static str>,
    /// Names of its joints.
    pub joints: Vec<String>,
    /// Its transforms, parent and child.
    pub frames: Vec<[String; 2]>,
    /// Paths of numbers in its first message, at most a dozen.
    pub numbers: Vec<String>,
}

/// What a bag holds, and what to do with it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Listing {
    /// Topics by name.
    pub topics: Vec<ListedTopic>,
    /// The most plausible topic of wheels; two with a comma where each wheel has its own.
    pub wheels: Option<String>,
    /// The most plausible topic of poses.
    pub truth: Option<String>,
    /// The most plausible topic of a gyroscope.
    pub gyro: Option<String>,
    /// The first topic of scans of a lidar.
    pub scan: Option<String>,
    /// Flags that these topics need besides.
    pub flags: Vec<String>,
    /// Whether the wheels are counted, so that the counts of a turn are needed.
    pub is_counted: bool,
    /// The topic of the robot's description, where the bag has it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub robot_description: Option<String>,
    /// What could not be read.
    pub warnings: Vec<String>,
}

/// Lists a bag's topics; `definitions` are files of types that it does not define ([`crate::Options`]).
///
/// # Errors
/// [`RosBagError`] where there is no bag, or not one message in it.
pub fn list(path: &Path, definitions: &[PathBuf]) -> Result<Listing, RosBagError> {
    let survey = Survey::of(&Bag::open(path, definitions)?)?;
    let (mut wheels, mut truth) = (suggested(&survey, wheels_rank), suggested(&survey, truth_rank));
    let mut flags = Vec::new();
    if wheels.is_none()
        && let Some((topic, left, right)) = survey.topics.values().find_map(numbers_of_wheels)
    {
        wheels = Some(topic);
        flags.push(format!("--left-field {left} --right-field {right} --as WHICH"));
    }
    if truth.is_none()
        && let Some((topic, [parent, child])) = survey.topics.values().find_map(transform_of_instrument)
    {
        truth = Some(topic);
        flags.push(format!("--truth-frames {parent},{child}"));
    }
    let counts = |topic: &Topic| {
        WHEEL_TYPES.iter().any(|(of, _, _, quantity, _)| *of == topic.type_name && *quantity == WheelQuantity::Ticks)
    };
    let pair = if wheels.is_none() { pair_of_wheels(&survey) } else { None };
    let is_pair_counted = pair.is_some_and(|(left, _)| COUNT_TYPES.contains(&&left.type_name[..]));
    if pair.is_some() && !is_pair_counted {
        flags.push("--as WHICH".to_owned());
    }
    Ok(Listing {
        is_counted: wheels.is_some_and(counts) || is_pair_counted,
        wheels: wheels
            .map(|topic| topic.name.clone())
            .or_else(|| pair.map(|(left, right)| format!("{},{}", left.name, right.name))),
        truth: truth.map(|topic| topic.name.clone()),
        gyro: suggested(&survey, gyro_rank).map(|topic| topic.name.clone()),
        scan: suggested(&survey, scan_rank).map(|topic| topic.name.clone()),
        flags,
        robot_description: survey.description.as_ref().map(|(topic, _)| topic.clone()),
        topics: survey.topics.values().map(listed).collect(),
        warnings: survey.losses,
    })
}

/// Numbers named after the two sides, in a type that is not known.
fn numbers_of_wheels(topic: &Topic) -> Option<(&Topic, &str, &str)> {
    let named = |side: &str| {
        let of: Vec<&String> = topic.numbers.iter().filter(|path| path.to_lowercase().contains(side)).collect();
        if let [path] = of[..] { Some(path.as_str()) } else { None }
    };
    let is_read = topic.count > 1 && !has_joints(&topic.type_name) && !topic.name.contains("cmd");
    Some((topic, named("left")?, named("right")?)).filter(|_| is_read)
}

/// Two topics of one number each, whose names differ by the side alone.
fn pair_of_wheels(survey: &Survey) -> Option<(&Topic, &Topic)> {
    let is_side = |topic: &&Topic| topic.count > 1 && topic.numbers.len() == 1 && !topic.name.contains("cmd");
    let mut pairs = survey.topics.values().filter(is_side).filter_map(|left| {
        let right = survey.topics.get(&left.name.replace("left", "right")).filter(is_side)?;
        (left.name != right.name && left.type_name == right.type_name).then_some((left, right))
    });
    match (pairs.next(), pairs.next()) {
        (Some(pair), None) => Some(pair),
        _ => None,
    }
}

/// The one transform to the robot's base that is neither odometry's nor a map's, which localisation
/// publishes.
fn transform_of_instrument(topic: &Topic) -> Option<(&Topic, [&str; 2])> {
    let own = ["odom", "map", "base"];
    let is_instrument = |(parent, child): &&(String, String)| {
        child.contains("base") && !own.iter().any(|part| parent.to_lowercase().contains(part))
    };
    let of: Vec<&(String, String)> = topic.frames.keys().filter(is_instrument).collect();
    if let [(parent, child)] = of[..] { Some((topic, [parent, child])) } else { None }
}

fn listed(topic: &Topic) -> ListedTopic {
    let span_s = topic.span_s();
    let rate_hz = (topic.count > 1 && span_s > 0.0).then(|| (topic.count - 1) as f64 / span_s);
    let ranks = [
        ("wheels", wheels_rank(topic)),
        ("truth", truth_rank(topic)),
        ("gyro", gyro_rank(topic)),
        ("scan", scan_rank(topic)),
    ];
    let may_be = ranks.into_iter().find(|(_, rank)| rank.is_some()).map(|(what, _)| what);
    ListedTopic {
        topic: topic.name.clone(),
        type_name: topic.type_name.clone(),
        messages: topic.count,
        rate_hz,
        span_s,
        may_be,
        joints: topic.joints.iter().cloned().collect(),
        numbers: topic.numbers.clone(),
        frames: topic.frames.keys().map(|(parent, child)| [parent.clone(), child.clone()]).collect(),
    }
}
