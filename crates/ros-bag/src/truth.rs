//! Poses of an outside instrument from messages.

use crate::error::RosBagError;
use crate::topics::{self, TRANSFORMS, Topic};
use crate::value::Value;

/// Types that hold a pose: type, position, orientation, covariance.
///
/// Reference: the definitions in geometry_msgs and nav_msgs; a covariance is row by row of x, y, z, and the
/// rotations about these.
pub(crate) const TRUTH_TYPES: [(&str, &str, &str, Option<&str>); 4] = [
    ("geometry_msgs/msg/PoseStamped", "pose.position", "pose.orientation", None),
    (
        "geometry_msgs/msg/PoseWithCovarianceStamped",
        "pose.pose.position",
        "pose.pose.orientation",
        Some("pose.covariance"),
    ),
    ("nav_msgs/msg/Odometry", "pose.pose.position", "pose.pose.orientation", Some("pose.covariance")),
    ("geometry_msgs/msg/TransformStamped", "transform.translation", "transform.rotation", None),
];

/// Places of xx, yy and that of the yaw in a covariance of 6 × 6.
const COVARIANCE_XX: usize = 0;
const COVARIANCE_YY: usize = 7;
const COVARIANCE_YAW: usize = 35;

/// Shortest quaternion that has a direction; messages that were never filled have one of length 0, rounded
/// ones of some 1 ± 1e-3.
const MIN_QUATERNION_NORM: f64 = 0.5;

/// How poses are read from a topic's messages.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum TruthReader {
    Pose { position: &'static str, orientation: &'static str, covariance: Option<&'static str> },
    Transforms { parent: String, child: String },
}

/// One pose in the plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TruthReading {
    pub(crate) x_m: f64,
    pub(crate) y_m: f64,
    pub(crate) theta_rad: Option<f64>,
    /// Angle between the robot's vertical and the room's, radians.
    pub(crate) tilt_rad: f64,
    /// One standard deviation of each position coordinate, where the message says one.
    pub(crate) sigma_xy_m: Option<f64>,
    pub(crate) sigma_theta_rad: Option<f64>,
}

impl TruthReader {
    pub(crate) fn new(topic: &Topic, frames: Option<&(String, String)>) -> Result<Self, RosBagError> {
        let refuse = |why: String| {
            let (topic, type_name) = (topic.name.clone(), topic.type_name.clone());
            RosBagError::Unusable { topic, type_name, why }
        };
        if topic.type_name == TRANSFORMS {
            let listed: Vec<String> = topic.frames.keys().map(|(parent, child)| format!("{parent},{child}")).collect();
            let Some((parent, child)) = frames else {
                let why = format!(
                    "it holds transforms between frames; say --truth-frames PARENT,CHILD, one of {}",
                    listed.join(" ")
                );
                return Err(refuse(why));
            };
            let slashless = |frame: &str| frame.trim_start_matches('/').to_owned();
            let (parent, child) = (slashless(parent), slashless(child));
            if !topic.frames.contains_key(&(parent.clone(), child.clone())) {
                let why = format!(
                    "no transform from {parent} directly to {child}; there are {}; transforms are not chained, since odometry is mostly among them",
                    listed.join(" ")
                );
                return Err(refuse(why));
            }
            return Ok(Self::Transforms { parent, child });
        }
        let known = TRUTH_TYPES.iter().find(|(of, ..)| *of == topic.type_name);
        let Some((_, position, orientation, covariance)) = known else {
            let types: Vec<&str> = TRUTH_TYPES.iter().map(|(of, ..)| *of).chain([TRANSFORMS]).collect();
            return Err(refuse(format!("no type of poses; expected one of {}", types.join(", "))));
        };
        Ok(Self::Pose { position, orientation, covariance: *covariance })
    }

    /// The poses of a message, each with the value in which its header is.
    pub(crate) fn read<'a>(&self, message: &'a Value) -> Result<Vec<(&'a Value, TruthReading)>, String> {
        match self {
            Self::Pose { position, orientation, covariance } => {
                let reading = pose(message, position, orientation, *covariance)?;
                Ok(vec![(message, reading)])
            }
            Self::Transforms { parent, child } => {
                let between = |transform: &&Value| topics::frames(transform) == Some((parent, child));
                let of = message.list("transforms").iter().filter(between);
                of.map(|transform| {
                    Ok((transform, pose(transform, "transform.translation", "transform.rotation", None)?))
                })
                .collect()
            }
        }
    }

    /// What is read, for the user.
    pub(crate) fn describe(&self) -> String {
        match self {
            Self::Pose { position, orientation, .. } => format!("{position} and {orientation}"),
            Self::Transforms { parent, child } => format!("{parent} to {child}"),
        }
    }
}

fn pose(message: &Value, position: &str, orientation: &str, covariance: Option<&str>) -> Result<TruthReading, String> {
    let number = |at: &str, name: &str| {
        message.number(&format!("{at}.{name}")).ok_or_else(|| format!("no number at \"{at}.{name}\""))
    };
    let [x, y, z, w] =
        [number(orientation, "x")?, number(orientation, "y")?, number(orientation, "z")?, number(orientation, "w")?];
    let (theta_rad, tilt_rad) = heading_and_tilt(x, y, z, w).map_or((None, 0.0), |(theta, tilt)| (Some(theta), tilt));
    let variance = |place: usize| covariance.and_then(|at| message.list(at).get(place)?.number(""));
    let sigma = |variance: f64| Some(variance.sqrt()).filter(|sigma| sigma.is_finite() && *sigma > 0.0);
    let both = variance(COVARIANCE_XX).zip(variance(COVARIANCE_YY)).filter(|(xx, yy)| *xx > 0.0 && *yy > 0.0);
    Ok(TruthReading {
        x_m: number(position, "x")?,
        y_m: number(position, "y")?,
        theta_rad,
        tilt_rad,
        sigma_xy_m: both.and_then(|(xx, yy)| sigma(0.5 * (xx + yy))),
        sigma_theta_rad: variance(COVARIANCE_YAW).and_then(sigma),
    })
}

/// Yaw, and the angle of the body's z axis to the room's; none of a quaternion without direction.
fn heading_and_tilt(x: f64, y: f64, z: f64, w: f64) -> Option<(f64, f64)> {
    let norm = (x * x + y * y + z * z + w * w).sqrt();
    if !(norm.is_finite() && norm >= MIN_QUATERNION_NORM) {
        return None;
    }
    let [x, y, z, w] = [x, y, z, w].map(|part| part / norm);
    let yaw_rad = (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z));
    let tilt_rad = (1.0 - 2.0 * (x * x + y * y)).clamp(-1.0, 1.0).acos();
    Some((yaw_rad, tilt_rad))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quaternion_is_a_heading_and_a_tilt() {
        // Rounding of a handful of operations on numbers of size 1.
        let close = |found: f64, expected: f64| (found - expected).abs() < 1e-12;
        for yaw in [-3.0, -0.5, 0.0, 1.0, 3.1_f64] {
            let (found, tilt) =
                heading_and_tilt(0.0, 0.0, 2.0 * (yaw / 2.0).sin(), 2.0 * (yaw / 2.0).cos()).expect("a heading");
            assert!(close(found, yaw) && tilt == 0.0, "{yaw} {found} {tilt}");
        }
        let half = 0.1_f64;
        let (yaw, tilt) = heading_and_tilt(half.sin(), 0.0, 0.0, half.cos()).expect("a heading");
        assert!(close(yaw, 0.0) && close(tilt, 0.2), "{yaw} {tilt}");
        assert_eq!(heading_and_tilt(0.0, 0.0, 0.0, 0.0), None);
        assert_eq!(heading_and_tilt(f64::NAN, 0.0, 0.0, 1.0), None);
    }

    #[test]
    fn positive_variances_are_sigmas_and_others_are_unknown() {
        let numbers = |names: &str, values: &[f64]| {
            let of = |(name, value): (char, &f64)| (name.to_string(), Value::Float(*value));
            Value::Message(names.chars().zip(values).map(of).collect())
        };
        let read = |xx: f64, yy: f64, yaw: f64| {
            let mut covariance = vec![Value::Float(0.0); 36];
            (covariance[0], covariance[7], covariance[35]) = (Value::Float(xx), Value::Float(yy), Value::Float(yaw));
            let pose = Value::Message(vec![
                ("position".to_owned(), numbers("xyz", &[1.0, 2.0, 3.0])),
                ("orientation".to_owned(), numbers("xyzw", &[0.0, 0.0, 0.0, 1.0])),
            ]);
            let with_covariance =
                Value::Message(vec![("pose".to_owned(), pose), ("covariance".to_owned(), Value::List(covariance))]);
            let message = Value::Message(vec![("pose".to_owned(), with_covariance)]);
            let type_name = "geometry_msgs/msg/PoseWithCovarianceStamped".to_owned();
            let reader = TruthReader::new(&Topic { type_name, ..Topic::default() }, None).expect("a known type");
            let readings = reader.read(&message).expect("a pose");
            assert_eq!((readings[0].1.x_m, readings[0].1.y_m), (1.0, 2.0));
            (readings[0].1.sigma_xy_m, readings[0].1.sigma_theta_rad)
        };
        assert_eq!(read(3.0, 5.0, 0.25), (Some(2.0), Some(0.5)));
        assert_eq!(read(3.0, 0.0, -1.0), (None, None));
        assert_eq!(read(f64::NAN, 1.0, f64::INFINITY), (None, None));
    }
}
