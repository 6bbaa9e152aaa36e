//! Poses of an outside instrument from messages.

use dataset::{CovarianceScale, Dataset, PoseCovariance, Quaternion, TruthSigma};

use crate::error::RosBagError;
use crate::frame_chain::{FrameChain, Placed};
use crate::static_frames::StaticFrames;
use crate::topics::{TRANSFORMS, Topic};
use crate::transform;
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

/// Places of [`PoseCovariance::COLUMNS`] in a covariance of 6 × 6: those of x, y and the yaw.
const COVARIANCE_PLACES: [usize; 6] = [0, 1, 5, 7, 11, 35];

/// How poses are read from a topic's messages.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum TruthReader {
    Pose {
        position: &'static str,
        orientation: &'static str,
        covariance: Option<&'static str>,
    },
    Transforms {
        parent: String,
        child: String,
    },
    /// Read once all of the bag is known.
    Chain(FrameChain),
}

/// One pose in the plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TruthReading {
    pub(crate) x_m: f64,
    pub(crate) y_m: f64,
    pub(crate) theta_rad: Option<f64>,
    /// Angle between the robot's vertical and the room's, radians.
    pub(crate) tilt_rad: f64,
    /// What the message says of its precision: standard deviations, and the covariance where it is possible.
    pub(crate) precision: TruthSigma,
    /// Why its covariance is none.
    pub(crate) impossible: Option<&'static str>,
}

impl TruthReader {
    /// `mounted` are the transforms of `/tf_static`.
    pub(crate) fn new(
        topic: &Topic,
        frames: Option<&(String, String)>,
        mounted: &StaticFrames,
    ) -> Result<Self, RosBagError> {
        let refuse = |why: String| topic.unusable(why);
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
                let chain = FrameChain::find(&parent, &child, &topic.frames, mounted);
                let fixed: Vec<String> = mounted.all().map(|(parent, child, _)| format!("{parent},{child}")).collect();
                let fixed = if fixed.is_empty() { "none".to_owned() } else { fixed.join(" ") };
                let frames = || format!("there are {}, and by /tf_static {fixed}", listed.join(" "));
                return chain.map(Self::Chain).map_err(|why| refuse(format!("{why}; {}", frames())));
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
                let between = |transform: &&Value| transform::frames(transform) == Some((parent, child));
                let of = message.list("transforms").iter().filter(between);
                of.map(|transform| {
                    Ok((transform, pose(transform, "transform.translation", "transform.rotation", None)?))
                })
                .collect()
            }
            Self::Chain(_) => Ok(Vec::new()),
        }
    }

    /// The chain of transforms, where the poses are such.
    pub(crate) const fn chain(&self) -> Option<&FrameChain> {
        if let Self::Chain(chain) = self { Some(chain) } else { None }
    }

    /// What is read, for the user.
    pub(crate) fn describe(&self) -> String {
        match self {
            Self::Pose { position, orientation, .. } => format!("{position} and {orientation}"),
            Self::Transforms { parent, child } => format!("{parent} to {child}"),
            Self::Chain(chain) => chain.describe(),
        }
    }
}

impl TruthReading {
    /// Of a chain of transforms, which state no precision.
    pub(crate) const fn of_chain(placed: &Placed) -> Self {
        let Placed { pose, tilt_rad, .. } = placed;
        Self {
            x_m: pose.x_m,
            y_m: pose.y_m,
            theta_rad: Some(pose.theta_rad),
            tilt_rad: *tilt_rad,
            precision: TruthSigma::UNKNOWN,
            impossible: None,
        }
    }
}

fn pose(message: &Value, position: &str, orientation: &str, covariance: Option<&str>) -> Result<TruthReading, String> {
    let number = |at: &str, name: &str| {
        message.number(&format!("{at}.{name}")).ok_or_else(|| format!("no number at \"{at}.{name}\""))
    };
    let [x, y, z, w] =
        [number(orientation, "x")?, number(orientation, "y")?, number(orientation, "z")?, number(orientation, "w")?];
    let orientation = Quaternion::new([x, y, z, w]);
    let element = |place: usize| covariance.and_then(|at| message.list(at).get(place)?.number(""));
    let (precision, impossible) = precision(COVARIANCE_PLACES.map(|place| element(place).unwrap_or(0.0)));
    Ok(TruthReading {
        x_m: number(position, "x")?,
        y_m: number(position, "y")?,
        theta_rad: orientation.map(Quaternion::yaw_rad),
        tilt_rad: orientation.map_or(0.0, Quaternion::tilt_rad),
        precision,
        impossible,
    })
}

/// The precision that the elements of a covariance state; a part without positive variances is unknown. Where
/// covariances are impossible the variances count alone.
fn precision([xx, xy, xt, yy, yt, tt]: [f64; 6]) -> (TruthSigma, Option<&'static str>) {
    let sigma = |variance: f64| Some(variance.sqrt()).filter(|sigma| sigma.is_finite() && *sigma > 0.0);
    let (has_position, has_heading) = (sigma(xx).is_some() && sigma(yy).is_some(), sigma(tt).is_some());
    let sigma_xy_m = if has_position { sigma(0.5 * (xx + yy)) } else { None };
    let [part_xx, part_xy, part_yy] = if has_position { [xx, xy, yy] } else { [0.0; 3] };
    let [part_xt, part_yt] = if has_position && has_heading { [xt, yt] } else { [0.0; 2] };
    let part_tt = if has_heading { tt } else { 0.0 };
    let stated = PoseCovariance::stated([part_xx, part_xy, part_xt, part_yy, part_yt, part_tt]);
    let covariance = stated.ok().flatten();
    (TruthSigma { sigma_xy_m, sigma_theta_rad: sigma(tt), covariance }, stated.err())
}

/// The precision of each row; `None` where no message states one. Where standard deviations tell all of each,
/// they are given; else the covariances are.
pub(crate) fn precisions<'a>(
    readings: impl Iterator<Item = &'a TruthReading> + Clone,
    has_heading: bool,
) -> Option<Vec<TruthSigma>> {
    let of = |reading: &TruthReading| {
        let TruthSigma { sigma_xy_m, sigma_theta_rad, covariance } = reading.precision;
        let has_heading = has_heading && reading.theta_rad.is_some();
        let covariance = covariance.and_then(|of| if has_heading { Some(of) } else { of.of_position() });
        TruthSigma { sigma_xy_m, sigma_theta_rad: sigma_theta_rad.filter(|_| has_heading), covariance }
    };
    let is_plain = |of: TruthSigma| of.covariance.is_none_or(|covariance| covariance.as_sigmas().is_some());
    let are_plain = readings.clone().map(of).all(is_plain);
    let shown = |of: TruthSigma| match of.covariance {
        Some(_) if !are_plain => TruthSigma { covariance: of.covariance, ..TruthSigma::UNKNOWN },
        _ => TruthSigma { covariance: None, ..of },
    };
    let rows: Vec<TruthSigma> = readings.map(of).map(shown).collect();
    rows.iter().any(|row| *row != TruthSigma::UNKNOWN).then_some(rows)
}

/// Takes the covariances of a filter for known up to one factor, and says so; nothing where it states none.
pub(crate) fn scale_covariances(dataset: &mut Dataset, topic: &str) -> Option<String> {
    dataset.runs.iter().find(|run| run.truth_sigma.is_some())?;
    dataset.truth_noise.covariance_scale = CovarianceScale::Common;
    Some(format!(
        "topic {topic}: covariances of a filter are relative weights; one factor of them is estimated (covariance_scale = \"common\" under [truth])"
    ))
}

/// What is doubtful of the covariances, for the user.
pub(crate) fn doubt_of_covariances(readings: &[TruthReading]) -> Option<String> {
    let why = readings.iter().find_map(|reading| reading.impossible)?;
    let count = readings.iter().filter(|reading| reading.impossible.is_some()).count();
    Some(format!("{count} of {} covariances cannot be: {why}; of these the variances count alone", readings.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The pose of a message with a covariance whose elements at these places are not zero.
    fn read_with(elements: &[(usize, f64)]) -> TruthReading {
        let numbers = |names: &str, values: &[f64]| {
            let of = |(name, value): (char, &f64)| (name.to_string(), Value::Float(*value));
            Value::Message(names.chars().zip(values).map(of).collect())
        };
        let mut covariance = vec![Value::Float(0.0); 36];
        elements.iter().for_each(|(place, value)| covariance[*place] = Value::Float(*value));
        let pose = Value::Message(vec![
            ("position".to_owned(), numbers("xyz", &[1.0, 2.0, 3.0])),
            ("orientation".to_owned(), numbers("xyzw", &[0.0, 0.0, 0.0, 1.0])),
        ]);
        let with_covariance =
            Value::Message(vec![("pose".to_owned(), pose), ("covariance".to_owned(), Value::List(covariance))]);
        let message = Value::Message(vec![("pose".to_owned(), with_covariance)]);
        let type_name = "geometry_msgs/msg/PoseWithCovarianceStamped".to_owned();
        let reader = TruthReader::new(&Topic { type_name, ..Topic::default() }, None, &StaticFrames::default())
            .expect("a known type");
        reader.read(&message).expect("a pose")[0].1
    }

    #[test]
    fn positive_variances_are_sigmas_and_others_are_unknown() {
        let read = |xx: f64, yy: f64, yaw: f64| {
            let reading = read_with(&[(0, xx), (7, yy), (35, yaw)]);
            assert_eq!((reading.x_m, reading.y_m), (1.0, 2.0));
            (reading.precision.sigma_xy_m, reading.precision.sigma_theta_rad)
        };
        assert_eq!(read(3.0, 5.0, 0.25), (Some(2.0), Some(0.5)));
        assert_eq!(read(3.0, 0.0, -1.0), (None, None));
        assert_eq!(read(f64::NAN, 1.0, f64::INFINITY), (None, None));
    }

    #[test]
    fn covariances_of_a_filter_are_known_up_to_one_factor_where_it_states_some() {
        let run = |truth_sigma| dataset::Run { truth_sigma, ..dataset::Run::default() };
        let mut log = Dataset {
            provenance: dataset::Provenance::default(),
            robot: dataset::NominalRobot {
                left_wheel_diameter_m: 0.1,
                right_wheel_diameter_m: 0.1,
                wheel_separation_m: 0.3,
                ticks_per_rev: None,
                counter_bits: None,
            },
            truth_noise: dataset::TruthNoise::default(),
            points: Vec::new(),
            runs: vec![run(None)],
        };
        assert_eq!(scale_covariances(&mut log, "/amcl_pose"), None);
        assert_eq!(log.truth_noise.covariance_scale, CovarianceScale::Separate);
        // One run of several is enough.
        log.runs.push(run(Some(vec![TruthSigma { sigma_xy_m: Some(0.1), ..TruthSigma::UNKNOWN }])));
        let said = scale_covariances(&mut log, "/amcl_pose").expect("stated");
        assert!(said.contains("topic /amcl_pose") && said.contains("covariance_scale = \"common\""), "{said}");
        assert_eq!(log.truth_noise.covariance_scale, CovarianceScale::Common);
    }

    #[test]
    fn covariances_are_kept_where_standard_deviations_do_not_tell_them() {
        let reading = |elements: [f64; 6]| {
            let (precision, impossible) = precision(elements);
            TruthReading { x_m: 0.0, y_m: 0.0, theta_rad: Some(0.0), tilt_rad: 0.0, precision, impossible }
        };
        // Row by row of x, y, z and the rotations about these.
        let upper = [(0, 4.0), (1, 1.0), (5, 0.5), (7, 3.0), (11, 0.25), (35, 1.0)];
        let read = read_with(&[&upper[..], &[(6, 1.0), (30, 0.5), (31, 0.25)]].concat());
        let found = read.precision.covariance.map(|of| of.elements());
        assert_eq!(found, Some([4.0, 1.0, 0.5, 3.0, 0.25, 1.0]));
        let plain = reading([4.0, 0.0, 0.0, 4.0, 0.0, 0.25]);
        let correlated = reading([4.0, 1.0, 0.5, 3.0, 0.0, 0.25]);
        let nothing = reading([0.0; 6]);
        let sigmas = TruthSigma { sigma_xy_m: Some(2.0), sigma_theta_rad: Some(0.5), covariance: None };
        let of = |readings: &[&TruthReading], has_heading| precisions(readings.iter().copied(), has_heading);
        assert_eq!(of(&[&plain, &nothing], true), Some(vec![sigmas, TruthSigma::UNKNOWN]));
        assert_eq!(of(&[&nothing], true), None);
        let full = of(&[&plain, &correlated, &nothing], true).expect("two are stated");
        let elements: Vec<_> = full.iter().map(|row| row.covariance.map(|of| of.elements())).collect();
        let expected = [Some([4.0, 0.0, 0.0, 4.0, 0.0, 0.25]), Some([4.0, 1.0, 0.5, 3.0, 0.0, 0.25]), None];
        assert_eq!(elements, expected);
        let position = of(&[&correlated], false).expect("a position")[0].covariance.expect("correlated");
        assert_eq!(position.elements(), [4.0, 1.0, 0.0, 3.0, 0.0, 0.0]);
        // A correlation of 2: the variances alone, and a word of it.
        let impossible = reading([1.0, 2.0, 0.0, 1.0, 0.0, 0.25]);
        let alone = TruthSigma { sigma_xy_m: Some(1.0), sigma_theta_rad: Some(0.5), covariance: None };
        assert_eq!(of(&[&impossible], true), Some(vec![alone]));
        let doubt = doubt_of_covariances(&[plain, impossible]).expect("one is impossible");
        assert!(doubt.starts_with("1 of 2 covariances cannot be: it is not positive definite"), "{doubt}");
    }
}
