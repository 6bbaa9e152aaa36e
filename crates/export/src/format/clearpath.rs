//! `clearpath`: parameters of `platform_velocity_controller` for Clearpath's robot.yaml.
//!
//! The node is a `diff_drive_controller`. Its file `control.yaml` is generated; robot.yaml keeps what is
//! changed of it under `platform: extras: ros_parameters`. With --into either file is edited.
//! Reference: clearpath_config's `extras.py`, clearpath_control/config (github.com/clearpathrobotics).

use crate::error::ExportError;
use crate::format::ros2_yaml::of_node;
use crate::options::Options;
use crate::robot::CalibratedRobot;

pub(super) fn render(robot: &CalibratedRobot, options: &Options) -> Result<String, ExportError> {
    let controller = options.controller.as_deref().unwrap_or("platform_velocity_controller");
    of_node(robot, options, "clearpath", &["platform", "extras", "ros_parameters", controller])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::specimen;

    #[test]
    fn parameters_stand_where_robot_yaml_has_them() {
        let text = render(&specimen(), &Options::default()).expect("has all");
        let place = "\nplatform:\n  extras:\n    ros_parameters:\n      platform_velocity_controller:\n        wheel_separation: 0.4  #";
        assert!(text.contains(place), "{text}");
        let covariance = "\n        pose_covariance_diagonal: [";
        assert!(text.contains(covariance) && text.contains("\n        #  Twist: over one"), "{text}");
    }
}
