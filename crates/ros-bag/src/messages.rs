//! The messages that are written: their fields in the order of their definitions (`known_types.rs`).

use kinematics::{Pose, Wheels, sin_cos};

use crate::cdr_writer::CdrWriter;

/// Square metres or radians. Variance of what wheels do not measure: height, roll, pitch.
/// Convention: that of ROS drivers for "unknown"; a filter in the plane ignores it.
const UNMEASURED_VARIANCE: f64 = 1e6;

/// Names of the wheels' joints.
pub(crate) const JOINTS: Wheels<&str> = Wheels { left: "wheel_left_joint", right: "wheel_right_joint" };

pub(crate) const POSE_STAMPED: &str = "geometry_msgs/msg/PoseStamped";
pub(crate) const ODOMETRY: &str = "nav_msgs/msg/Odometry";
pub(crate) const PATH: &str = "nav_msgs/msg/Path";
pub(crate) const TF_MESSAGE: &str = "tf2_msgs/msg/TFMessage";
pub(crate) const IMU: &str = crate::gyro::IMU;
pub(crate) const JOINT_STATE: &str = "sensor_msgs/msg/JointState";

/// When and in which frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Header<'a> {
    pub(crate) stamp_ns: i64,
    pub(crate) frame: &'a str,
}

/// How fast a body moves over the interval that ends at its stamp.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct BodyTwist {
    pub(crate) speed_m_s: f64,
    pub(crate) yaw_rate_rad_s: f64,
}

impl CdrWriter {
    fn header(&mut self, header: Header<'_>) {
        let (sec, nanosec) = (header.stamp_ns.div_euclid(1_000_000_000), header.stamp_ns.rem_euclid(1_000_000_000));
        // Until 2038, as ROS 2 has it; stamps here begin at 1 s.
        self.int32(i32::try_from(sec).unwrap_or(i32::MAX));
        self.uint32(nanosec as u32);
        self.text(header.frame);
    }

    fn xyz(&mut self, x: f64, y: f64, z: f64) {
        [x, y, z].into_iter().for_each(|value| self.float64(value));
    }

    fn pose(&mut self, pose: Pose) {
        self.xyz(pose.x_m, pose.y_m, 0.0);
        let (sin, cos) = sin_cos(0.5 * pose.theta_rad);
        self.xyz(0.0, 0.0, sin);
        self.float64(cos);
    }
}

fn message(fields: impl FnOnce(&mut CdrWriter)) -> Vec<u8> {
    let mut writer = CdrWriter::new();
    fields(&mut writer);
    writer.into_bytes()
}

pub(crate) fn pose_stamped(header: Header<'_>, pose: Pose) -> Vec<u8> {
    message(|writer| {
        writer.header(header);
        writer.pose(pose);
    })
}

pub(crate) fn path(header: Header<'_>, poses: &[(i64, Pose)]) -> Vec<u8> {
    message(|writer| {
        writer.header(header);
        writer.length(poses.len());
        for (stamp_ns, pose) in poses {
            writer.header(Header { stamp_ns: *stamp_ns, ..header });
            writer.pose(*pose);
        }
    })
}

pub(crate) fn transform(header: Header<'_>, child: &str, pose: Pose) -> Vec<u8> {
    message(|writer| {
        writer.length(1);
        writer.header(header);
        writer.text(child);
        writer.pose(pose);
    })
}

/// `covariance` is of x, y and heading, row by row; all zeros say that it is not known.
pub(crate) fn odometry(
    header: Header<'_>,
    child: &str,
    pose: Pose,
    covariance: Option<[f64; 9]>,
    twist: BodyTwist,
) -> Vec<u8> {
    /// Where x, y and heading stand among the six.
    const PLANE: [usize; 3] = [0, 1, 5];
    message(|writer| {
        writer.header(header);
        writer.text(child);
        writer.pose(pose);
        let mut all = [0.0; 36];
        if let Some(covariance) = covariance {
            for index in 2..5 {
                all[7 * index] = UNMEASURED_VARIANCE;
            }
            for (index, value) in covariance.into_iter().enumerate() {
                all[6 * PLANE[index / 3] + PLANE[index % 3]] = value;
            }
        }
        all.into_iter().for_each(|value| writer.float64(value));
        writer.xyz(twist.speed_m_s, 0.0, 0.0);
        writer.xyz(0.0, 0.0, twist.yaw_rate_rad_s);
        [0.0; 36].into_iter().for_each(|value| writer.float64(value));
    })
}

/// Angles or angular speeds of both wheels; none leaves the list empty.
pub(crate) fn joint_state(
    header: Header<'_>,
    angles_rad: Option<Wheels<f64>>,
    speeds_rad_s: Option<Wheels<f64>>,
) -> Vec<u8> {
    message(|writer| {
        writer.header(header);
        writer.length(2);
        writer.text(JOINTS.left);
        writer.text(JOINTS.right);
        for values in [angles_rad, speeds_rad_s, None] {
            writer.float64s(&values.map(|both| vec![both.left, both.right]).unwrap_or_default());
        }
    })
}

/// A gyroscope's yaw rate; orientation and acceleration are said to be unknown, as REP 145 has it.
/// `variance_rad2_s2` is that of the rate: 0 unknown, −1 not measured.
pub(crate) fn imu(header: Header<'_>, yaw_rate_rad_s: f64, variance_rad2_s2: f64) -> Vec<u8> {
    message(|writer| {
        writer.header(header);
        let covariance = |writer: &mut CdrWriter, first: f64| {
            writer.float64(first);
            [0.0; 8].into_iter().for_each(|value| writer.float64(value));
        };
        [0.0, 0.0, 0.0, 1.0].into_iter().for_each(|value| writer.float64(value));
        covariance(writer, -1.0);
        writer.xyz(0.0, 0.0, yaw_rate_rad_s);
        covariance(writer, variance_rad2_s2);
        writer.xyz(0.0, 0.0, 0.0);
        covariance(writer, -1.0);
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cdr::decode;
    use crate::definition::Definitions;
    use crate::known_types::KnownTypes;
    use crate::value::Value;
    use std::f64::consts::FRAC_PI_2;

    fn read(name: &str, bytes: &[u8]) -> Value {
        let text = KnownTypes::default().definition(name).expect("known");
        let definitions = Definitions::parse(name, &text).expect("a definition");
        decode(&definitions, bytes).expect("a message")
    }

    const HEADER: Header<'static> = Header { stamp_ns: 5_000_000_007, frame: "map" };

    #[test]
    fn every_message_is_what_its_definition_says() {
        let pose = Pose::new(1.0, -2.0, FRAC_PI_2);
        let value = read(POSE_STAMPED, &pose_stamped(HEADER, pose));
        assert_eq!((value.integer("header.stamp.sec"), value.integer("header.stamp.nanosec")), (Some(5), Some(7)));
        assert_eq!((value.text("header.frame_id"), value.number("pose.position.y")), (Some("map"), Some(-2.0)));
        // sin 45°, to a rounding.
        assert!((value.number("pose.orientation.z").expect("a part") - 0.5_f64.sqrt()).abs() < 1e-15);

        let value = read(PATH, &path(HEADER, &[(6, Pose::IDENTITY), (8, pose)]));
        assert_eq!(value.integer("poses[1].header.stamp.nanosec"), Some(8));
        assert_eq!(value.number("poses[1].pose.position.x"), Some(1.0));

        let value = read(TF_MESSAGE, &transform(HEADER, "base", pose));
        assert_eq!(value.text("transforms[0].child_frame_id"), Some("base"));
        assert_eq!(value.number("transforms[0].transform.translation.y"), Some(-2.0));

        let twist = BodyTwist { speed_m_s: 0.5, yaw_rate_rad_s: -0.25 };
        let covariance = [1.0, 2.0, 3.0, 2.0, 5.0, 6.0, 3.0, 6.0, 9.0];
        let value = read(ODOMETRY, &odometry(HEADER, "base", pose, Some(covariance), twist));
        let at = |index: usize| value.number(&format!("pose.covariance[{index}]"));
        assert_eq!([0, 1, 5, 6, 7, 11, 30, 31, 35].map(at), covariance.map(Some));
        assert_eq!([14, 21, 28, 2].map(at), [Some(1e6), Some(1e6), Some(1e6), Some(0.0)]);
        assert_eq!(value.number("twist.twist.linear.x"), Some(0.5));
        assert_eq!(value.number("twist.twist.angular.z"), Some(-0.25));
        let unknown = read(ODOMETRY, &odometry(HEADER, "base", pose, None, twist));
        assert_eq!(unknown.number("pose.covariance[35]"), Some(0.0));

        let reading = |variance| crate::gyro::read(&read(IMU, &imu(HEADER, -0.75, variance)));
        assert_eq!(reading(0.0).expect("a rate").yaw_rate_rad_s, -0.75);
        assert!(reading(-1.0).expect_err("none").contains("no rate"));

        let value = read(JOINT_STATE, &joint_state(HEADER, Some(Wheels { left: 3.0, right: 4.0 }), None));
        assert_eq!((value.text("name[1]"), value.number("position[1]")), (Some(JOINTS.right), Some(4.0)));
        assert_eq!((value.list("velocity").len(), value.list("effort").len()), (0, 0));
    }
}
