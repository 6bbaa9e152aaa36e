//! `create3`: parameters of the `diffdrive_controller` of iRobot's Create 3, and what a node that reads its
//! ticks needs.
//!
//! The robot's own `wheel_base`, `wheels_radius` and `wheels_encoder_resolution` are read only: calibrated
//! values take effect in the controller of its description (`irobot_create_control/config/control.yaml`), or
//! in a node that computes odometry from `/wheel_ticks`.
//! Reference: github.com/iRobotEducation/create3_sim, and the parameters in create3_docs.

use std::f64::consts::PI;

use crate::comment::{decimal, wrapped};
use crate::error::ExportError;
use crate::format::ros2_yaml::of_node;
use crate::options::Options;
use crate::robot::CalibratedRobot;

/// Decimals of the travel of a tick, metres: of 0.44 mm.
const DECIMALS: usize = 12;

pub(super) fn render(robot: &CalibratedRobot, options: &Options) -> Result<String, ExportError> {
    let controller = options.controller.as_deref().unwrap_or("diffdrive_controller");
    let mut text = of_node(robot, options, "create3", &["/**", controller, "ros__parameters"])?;
    text.push_str(&wrapped(
        "#",
        "The robot's own wheel_base, wheels_radius and wheels_encoder_resolution are read only, and so is its odom.",
    ));
    if let Some(ticks_per_rev) = robot.ticks_per_rev {
        let travel_m = robot.wheel_diameter.map(|length| decimal(PI * length.value_m / ticks_per_rev, DECIMALS));
        text.push_str(&wrapped(
            "#",
            &format!("A node that reads /wheel_ticks: {} m a tick left, {} m right.", travel_m.left, travel_m.right),
        ));
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::specimen;

    #[test]
    fn ticks_have_the_travel_of_each_wheel() {
        let text = render(&specimen(), &Options::default()).expect("has all");
        assert!(
            text.contains("\n/**:\n  diffdrive_controller:\n    ros__parameters:\n      wheel_separation: 0.4  #"),
            "{text}"
        );
        // π · 0.202 m / 10000 and π · 0.198 m / 10000.
        assert!(
            text.contains("# A node that reads /wheel_ticks: 0.000063460172 m a tick left, 0.000062203535 m right."),
            "{text}"
        );
    }
}
