//! Runs as a bag: one MCAP file with truth, paths by dead reckoning, wheels and transforms.
//!
//! Runs are laid one after the other, since a run's times count from its own start: the first row of the
//! first run is at [`FIRST_STAMP_S`], and each later run begins [`RUN_GAP_S`] after the one before has
//! ended. Every message is stamped in its header, and received when it is stamped. All poses are in one
//! frame, the instrument's: dead reckoning starts where the instrument first saw the robot.

use dataset::TruthSample;
use kinematics::{Pose, Wheels, sin_cos, wrap_to_pi};
use serde::Serialize;

use crate::error::RosBagError;
use crate::known_types::KnownTypes;
use crate::mcap_writer::McapWriter;
use crate::messages::{self, BodyTwist, Header, IMU, JOINT_STATE, ODOMETRY, PATH, POSE_STAMPED, TF_MESSAGE};

/// Stamp of the first row, seconds. A stamp of zero is none in ROS.
pub const FIRST_STAMP_S: i64 = 1;
/// From the end of a run to the start of the next, seconds: longer than a robot stands within a run, so that
/// `yair import ros2 --cut` cuts between the runs alone.
pub const RUN_GAP_S: i64 = 10;

/// The frame of all poses.
pub const WORLD_FRAME: &str = "map";
/// The frame that the instrument saw.
pub const TRUTH_FRAME: &str = "truth";
/// The frame of the gyroscope; its z is up.
pub const GYRO_FRAME: &str = "imu_link";
/// Beginning of the frames that dead reckoning moves; the path's name follows.
pub const BODY_FRAME: &str = "base_link_";

/// A path by dead reckoning.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedPath {
    /// The last part of its topics: letters, digits and underscores.
    pub name: String,
    /// Seconds from the run's start, and pose of the drive's centre.
    pub poses: Vec<(f64, Pose)>,
    /// Covariance of x, y and heading at each pose, row by row, m² and rad²; none where it is not known.
    pub covariances: Option<Vec<[f64; 9]>>,
}

/// What the wheels did, row by row.
#[derive(Debug, Clone, PartialEq)]
pub enum RecordedWheels {
    /// Cumulative angles, radians.
    Angles(Wheels<Vec<f64>>),
    /// Angular speeds over the interval that ends at a row, rad/s.
    AngularSpeeds(Wheels<Vec<f64>>),
}

/// What a gyroscope measured, at instants of its own.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RecordedGyro {
    /// Seconds from the run's start, and yaw rate of that instant, rad/s.
    pub yaw_rates_rad_s: Vec<(f64, f64)>,
    /// Variance of a rate, (rad/s)²; 0 says unknown, −1 that none was measured.
    pub variance_rad2_s2: f64,
}

/// One run.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedRun<'a> {
    /// What the instrument saw.
    pub truth: &'a [TruthSample],
    /// Seconds from the run's start of the wheels' rows.
    pub rows_s: &'a [f64],
    /// The wheels, where their angles or angular speeds are known.
    pub wheels: Option<RecordedWheels>,
    /// The gyroscope, where its rates of instants are known: a dataset has means over intervals.
    pub gyro: Option<RecordedGyro>,
    /// Dead reckoning.
    pub paths: Vec<RecordedPath>,
}

/// One topic of the bag.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct RecordedTopic {
    /// Its name.
    pub topic: String,
    /// Its type.
    #[serde(rename = "type")]
    pub type_name: &'static str,
    /// Its messages.
    pub messages: u64,
}

/// A message before it is written.
struct Waiting {
    stamp_ns: i64,
    channel: usize,
    bytes: Vec<u8>,
}

/// Writes runs as a bag.
pub struct Recorder {
    writer: McapWriter,
    topics: Vec<(u16, RecordedTopic)>,
    next_ns: i64,
}

impl Default for Recorder {
    /// A bag without messages.
    fn default() -> Self {
        let writer = McapWriter::new("ros2", concat!("yair ", env!("CARGO_PKG_VERSION")));
        Self { writer, topics: Vec::new(), next_ns: FIRST_STAMP_S * 1_000_000_000 }
    }
}

impl Recorder {
    /// Adds a run.
    ///
    /// # Errors
    /// [`RosBagError::TooManyTopics`].
    pub fn push(&mut self, run: &RecordedRun<'_>) -> Result<(), RosBagError> {
        let instants = || {
            let truth = run.truth.iter().map(|sample| sample.t_s);
            truth.chain(run.rows_s.iter().copied())
        };
        let Some(first_s) = instants().reduce(f64::min) else { return Ok(()) };
        let begin_ns = self.next_ns;
        let stamp_ns = |t_s: f64| begin_ns + ((t_s - first_s) * 1e9).round() as i64;
        let mut waiting = Vec::new();
        self.push_truth(run.truth, stamp_ns, &mut waiting)?;
        self.push_wheels(run, stamp_ns, &mut waiting)?;
        self.push_gyro(run, stamp_ns, &mut waiting)?;
        for path in &run.paths {
            self.push_path(path, stamp_ns, &mut waiting)?;
        }
        // In the order of time; of one instant in the order of the topics.
        waiting.sort_by_key(|message: &Waiting| (message.stamp_ns, message.channel));
        for Waiting { stamp_ns, channel, bytes } in &waiting {
            let (channel_id, topic) = &mut self.topics[*channel];
            let time = u64::try_from(*stamp_ns).unwrap_or_default();
            self.writer.push(*channel_id, topic.messages as u32, time, bytes);
            topic.messages += 1;
        }
        let last_ns = waiting.last().map_or(begin_ns, |message| message.stamp_ns);
        self.next_ns = last_ns + RUN_GAP_S * 1_000_000_000;
        Ok(())
    }

    /// The bytes of the bag, and its topics.
    #[must_use]
    pub fn finish(self) -> (Vec<u8>, Vec<RecordedTopic>) {
        (self.writer.finish(), self.topics.into_iter().map(|(_, topic)| topic).collect())
    }

    /// The place of a topic, which is made where it is new.
    fn channel(&mut self, topic: &str, type_name: &'static str) -> Result<usize, RosBagError> {
        if let Some(index) = self.topics.iter().position(|(_, known)| known.topic == topic) {
            return Ok(index);
        }
        let definition = KnownTypes::default().definition(type_name).unwrap_or_default();
        let schema = self.writer.add_schema(type_name, "ros2msg", &definition);
        // Recorders of ROS note the quality of service; none was asked for here.
        let metadata = [("offered_qos_profiles", "")];
        let id = schema.and_then(|schema| self.writer.add_channel(schema, topic, "cdr", &metadata));
        let id = id.ok_or(RosBagError::TooManyTopics)?;
        self.topics.push((id, RecordedTopic { topic: topic.to_owned(), type_name, messages: 0 }));
        Ok(self.topics.len() - 1)
    }

    /// Positions without a heading are left out where others have one; where none has, headings are 0.
    fn push_truth(
        &mut self,
        truth: &[TruthSample],
        stamp_ns: impl Fn(f64) -> i64,
        waiting: &mut Vec<Waiting>,
    ) -> Result<(), RosBagError> {
        let has_heading = truth.iter().any(|sample| sample.theta_rad().is_some());
        let pose = |sample: &TruthSample| {
            let theta_rad = if has_heading { sample.theta_rad()? } else { 0.0 };
            Some((stamp_ns(sample.t_s), Pose::new(sample.x_m, sample.y_m, theta_rad)))
        };
        let poses: Vec<(i64, Pose)> = truth.iter().filter_map(pose).collect();
        let Some((first_ns, _)) = poses.first() else { return Ok(()) };
        let (stamped, transforms) = (self.channel("/truth", POSE_STAMPED)?, self.channel("/tf", TF_MESSAGE)?);
        let whole = self.channel("/path/truth", PATH)?;
        for (stamp_ns, pose) in &poses {
            let (stamp_ns, header) = (*stamp_ns, Header { stamp_ns: *stamp_ns, frame: WORLD_FRAME });
            waiting.push(Waiting { stamp_ns, channel: stamped, bytes: messages::pose_stamped(header, *pose) });
            let bytes = messages::transform(header, TRUTH_FRAME, *pose);
            waiting.push(Waiting { stamp_ns, channel: transforms, bytes });
        }
        let header = Header { stamp_ns: *first_ns, frame: WORLD_FRAME };
        waiting.push(Waiting { stamp_ns: *first_ns, channel: whole, bytes: messages::path(header, &poses) });
        Ok(())
    }

    fn push_wheels(
        &mut self,
        run: &RecordedRun<'_>,
        stamp_ns: impl Fn(f64) -> i64,
        waiting: &mut Vec<Waiting>,
    ) -> Result<(), RosBagError> {
        let Some(wheels) = &run.wheels else { return Ok(()) };
        let channel = self.channel("/joint_states", JOINT_STATE)?;
        let at = |both: &Wheels<Vec<f64>>, row: usize| Wheels { left: both.left[row], right: both.right[row] };
        for (row, t_s) in run.rows_s.iter().enumerate() {
            let stamp_ns = stamp_ns(*t_s);
            let header = Header { stamp_ns, frame: "" };
            let bytes = match wheels {
                RecordedWheels::Angles(angles) => messages::joint_state(header, Some(at(angles, row)), None),
                RecordedWheels::AngularSpeeds(speeds) => messages::joint_state(header, None, Some(at(speeds, row))),
            };
            waiting.push(Waiting { stamp_ns, channel, bytes });
        }
        Ok(())
    }

    fn push_gyro(
        &mut self,
        run: &RecordedRun<'_>,
        stamp_ns: impl Fn(f64) -> i64,
        waiting: &mut Vec<Waiting>,
    ) -> Result<(), RosBagError> {
        let Some(gyro) = &run.gyro else { return Ok(()) };
        let channel = self.channel("/imu", IMU)?;
        for (t_s, yaw_rate_rad_s) in &gyro.yaw_rates_rad_s {
            let stamp_ns = stamp_ns(*t_s);
            let header = Header { stamp_ns, frame: GYRO_FRAME };
            let bytes = messages::imu(header, *yaw_rate_rad_s, gyro.variance_rad2_s2);
            waiting.push(Waiting { stamp_ns, channel, bytes });
        }
        Ok(())
    }

    fn push_path(
        &mut self,
        path: &RecordedPath,
        stamp_ns: impl Fn(f64) -> i64,
        waiting: &mut Vec<Waiting>,
    ) -> Result<(), RosBagError> {
        let Some((first_s, _)) = path.poses.first() else { return Ok(()) };
        let odometry = self.channel(&format!("/odom/{}", path.name), ODOMETRY)?;
        let transforms = self.channel("/tf", TF_MESSAGE)?;
        let whole = self.channel(&format!("/path/{}", path.name), PATH)?;
        let child = format!("{BODY_FRAME}{}", path.name);
        let poses: Vec<(i64, Pose)> = path.poses.iter().map(|(t_s, pose)| (stamp_ns(*t_s), *pose)).collect();
        for (row, (stamp_ns, pose)) in poses.iter().enumerate() {
            let (stamp_ns, header) = (*stamp_ns, Header { stamp_ns: *stamp_ns, frame: WORLD_FRAME });
            let before = row.checked_sub(1).map(|before| path.poses[before]);
            let twist = before.map_or(BodyTwist::default(), |before| twist(before, path.poses[row]));
            let covariance = path.covariances.as_ref().and_then(|all| all.get(row).copied());
            let bytes = messages::odometry(header, &child, *pose, covariance, twist);
            waiting.push(Waiting { stamp_ns, channel: odometry, bytes });
            let bytes = messages::transform(header, &child, *pose);
            waiting.push(Waiting { stamp_ns, channel: transforms, bytes });
        }
        let first_ns = stamp_ns(*first_s);
        let header = Header { stamp_ns: first_ns, frame: WORLD_FRAME };
        waiting.push(Waiting { stamp_ns: first_ns, channel: whole, bytes: messages::path(header, &poses) });
        Ok(())
    }
}

/// The mean twist between two poses, by the midpoint rule.
fn twist(from: (f64, Pose), to: (f64, Pose)) -> BodyTwist {
    let (moved, dt_s) = (from.1.to(to.1), to.0 - from.0);
    let turn_rad = wrap_to_pi(moved.theta_rad);
    let (sin, cos) = sin_cos(0.5 * turn_rad);
    if dt_s > 0.0 {
        BodyTwist { speed_m_s: (cos * moved.x_m + sin * moved.y_m) / dt_s, yaw_rate_rad_s: turn_rad / dt_s }
    } else {
        BodyTwist::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::{FromBag, Options};
    use crate::open_bag::import;
    use dataset::WheelLog;
    use dataset::import::csv::RobotGiven;

    fn bag(runs: &[RecordedRun<'_>]) -> (Vec<RecordedTopic>, tempfile::TempDir) {
        let mut recorder = Recorder::default();
        for run in runs {
            recorder.push(run).expect("written");
        }
        let (bytes, topics) = recorder.finish();
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("a.mcap"), bytes).expect("written");
        (topics, folder)
    }

    fn options(wheels: Option<&str>) -> Options {
        Options {
            wheels: wheels.map(str::to_owned),
            cut_s: Some(5.0),
            robot: RobotGiven {
                wheel_diameter_m: Some(Wheels::both(0.15)),
                wheel_separation_m: Some(0.3),
                ..RobotGiven::default()
            },
            ..Options::default()
        }
    }

    #[test]
    fn a_bag_reads_back_as_the_runs_that_it_was_written_of() {
        let rows_s: Vec<f64> = (0..20).map(|row| 0.1 * f64::from(row)).collect();
        let angles: Vec<f64> = rows_s.iter().map(|t_s| 3.0 * t_s).collect();
        let truth: Vec<TruthSample> =
            rows_s.iter().step_by(2).map(|t_s| TruthSample::new(*t_s, 0.25 * t_s, 1.0, Some(0.125 * t_s))).collect();
        let poses: Vec<(f64, Pose)> =
            rows_s.iter().map(|t_s| (*t_s, Pose::new(0.25 * t_s, 1.0, 0.125 * t_s))).collect();
        let path = RecordedPath { name: "nominal".to_owned(), poses, covariances: None };
        let wheels = Wheels { left: angles.clone(), right: angles.iter().map(|angle| -angle).collect() };
        let run = RecordedRun {
            truth: &truth,
            rows_s: &rows_s,
            wheels: Some(RecordedWheels::Angles(wheels.clone())),
            gyro: None,
            paths: vec![path],
        };
        let (topics, folder) = bag(&[run.clone(), run]);
        let counts: Vec<(&str, u64)> = topics.iter().map(|of| (&of.topic[..], of.messages)).collect();
        let all = [
            ("/truth", 20),
            ("/tf", 60),
            ("/path/truth", 2),
            ("/joint_states", 40),
            ("/odom/nominal", 40),
            ("/path/nominal", 2),
        ];
        assert_eq!(counts, all);
        let FromBag { dataset, warnings, .. } = import(folder.path(), &options(None)).expect("a dataset");
        assert_eq!((dataset.runs.len(), warnings), (2, Vec::new()));
        for run in &dataset.runs {
            assert_eq!(run.odometry.wheels, WheelLog::Angles(wheels.clone()));
            // Stamps are whole nanoseconds.
            let close = run.odometry.t_s.iter().zip(&rows_s).all(|(found_s, t_s)| (found_s - t_s).abs() < 1e-9);
            assert!(close && run.truth.len() == truth.len(), "{:?}", run.odometry.t_s);
            for (found, written) in run.truth.iter().zip(&truth) {
                assert_eq!((found.x_m, found.y_m), (written.x_m, written.y_m));
                // A heading goes through the half-angle and back.
                let theta_rad = |of: &TruthSample| of.theta_rad().expect("a heading");
                assert!((theta_rad(found) - theta_rad(written)).abs() < 1e-15);
            }
        }
        // 0.25 m/s ahead at 0.125 rad/s, as the poses say.
        let by_twist = import(folder.path(), &options(Some("/odom/nominal"))).expect("a dataset").dataset;
        let WheelLog::Twist { omega_radps, .. } = &by_twist.runs[1].odometry.wheels else { panic!("twists") };
        assert!(omega_radps[1..].iter().all(|rate| (rate - 0.125).abs() < 1e-12), "{omega_radps:?}");
    }

    #[test]
    fn positions_without_headings_stay_positions() {
        let truth = [(0.0, 0.0, 0.0), (1.0, 1.0, 0.5), (2.0, 2.0, 1.0)];
        let without = truth.map(|(t_s, x_m, y_m)| TruthSample::new(t_s, x_m, y_m, None));
        let rows_s = [0.0, 1.0, 2.0];
        let speeds = Wheels::both(vec![0.0, 13.0, 13.0]);
        let run = |truth| RecordedRun {
            truth,
            rows_s: &rows_s,
            wheels: Some(RecordedWheels::AngularSpeeds(speeds.clone())),
            gyro: None,
            paths: Vec::new(),
        };
        let (_, folder) = bag(&[run(&without)]);
        let dataset = import(folder.path(), &options(None)).expect("a dataset").dataset;
        assert!(dataset.runs[0].truth.iter().all(|sample| sample.theta_rad().is_none()));
        assert!(matches!(dataset.runs[0].odometry.wheels, WheelLog::Speeds(_)));
        let mut mixed = without;
        mixed[1] = TruthSample::new(1.0, 1.0, 0.5, Some(0.3));
        let (topics, _folder) = bag(&[run(&mixed)]);
        assert_eq!(topics[0].messages, 1, "those without a heading are left out beside one that has it");
    }
}
