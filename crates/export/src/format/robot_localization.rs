//! `robot-localization`: what an EKF of robot_localization should take of wheel odometry, and the covariance
//! that the odometry's messages need.
//!
//! The filter reads covariances from the messages alone, so that they belong into the node that publishes
//! them: 36 numbers, row by row, of x, y, z, roll, pitch and yaw. The filter takes the twist: the pose of
//! dead reckoning has an error that grows without bound.
//! Reference: robot_localization's documentation, "Configuring" and "Preparing Your Data";
//! `geometry_msgs/TwistWithCovariance`.

use std::fmt::Write;

use crate::comment::{decimal, digits, limits, origin, variance, wrapped};
use crate::error::ExportError;
use crate::format::ros2_yaml::{key, twist_variances};
use crate::options::Options;
use crate::robot::CalibratedRobot;
use crate::settings::UNMEASURED_VARIANCE;

pub(super) fn render(robot: &CalibratedRobot, options: &Options) -> Result<String, ExportError> {
    let noise = robot.noise.ok_or_else(|| ExportError::NoNoise { place: robot.place.clone() })?;
    let [ahead, aside, yaw] = twist_variances(noise, robot.wheel_separation.value_m, options);
    let unmeasured = UNMEASURED_VARIANCE;
    let diagonal = [ahead, aside, unmeasured, unmeasured, unmeasured, yaw];
    let mut text = origin("#", "robot-localization", robot);
    text.push_str(&wrapped(
        "#",
        "The filter takes the speeds of the wheels and no pose: name the topic of your odometry in odom0. A robot on \
         two wheels does not move sideways, which it is told by a vy of 0.",
    ));
    let _ = writeln!(text, "{}:", key(options.controller.as_deref().unwrap_or("ekf_filter_node")));
    text.push_str(
        "  ros__parameters:\n    two_d_mode: true\n    odom0_differential: false\n    odom0_relative: false\n    \
         # x, y, z; roll, pitch, yaw; their speeds: vx, vy and vyaw; accelerations.\n    \
         odom0_config: [false, false, false,\n                   false, false, false,\n                   \
         true,  true,  false,\n                   false, false, true,\n                   false, false, false]\n",
    );
    text.push_str(&wrapped(
        "#",
        &format!(
            "twist.covariance of the messages of odom0, which the node that publishes them fills in, row by row: from \
             the fitted noise of the wheels, {} mm/√m, over one interval at {} Hz, {} m/s straight on; it grows in \
             proportion to speed and rate.",
            digits(1e3 * noise.wheel_sigma_m_per_sqrt_m),
            decimal(options.rate_hz, 3),
            decimal(options.speed_m_s, 3)
        ),
    ));
    for (row, of_row) in diagonal.iter().enumerate() {
        let line: Vec<String> = (0..diagonal.len())
            .map(|column| if row == column { variance(*of_row) } else { "0.0".to_owned() })
            .collect();
        let (start, end) = (if row == 0 { "[" } else { " " }, if row + 1 == diagonal.len() { "]" } else { "," });
        let _ = writeln!(text, "#   {start}{}{end}", line.join(", "));
    }
    text.push_str(&limits("#", robot, false));
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::specimen;

    #[test]
    fn the_covariance_has_36_entries_and_the_state_15() {
        let text = render(&specimen(), &Options::default()).expect("has a noise");
        let (_, block) = text.split_once("#   [").expect("a block");
        let block = block.split(']').next().expect("an end").replace('#', " ");
        let numbers: Vec<f64> = block.split(',').map(|number| number.trim().parse().expect("a number")).collect();
        assert_eq!(numbers.len(), 36, "{text}");
        // ½ k² v f and 2 k² v f/b², as in the diagonal of ros2-yaml.
        let of = |row: usize, column: usize| numbers[6 * row + column];
        assert_eq!((of(0, 0), of(1, 1), of(5, 5), of(2, 2), of(0, 5)), (6.25e-6, 6.25e-6, 1.5e-4, 1e6, 0.0));
        let (_, config) = text.split_once("odom0_config: [").expect("a state");
        let config: Vec<bool> =
            config.split(']').next().expect("an end").split(',').map(|of| of.trim() == "true").collect();
        let taken: Vec<usize> = (0..config.len()).filter(|index| config[*index]).collect();
        assert_eq!((config.len(), taken), (15, vec![6, 7, 11]));
        let mut robot = specimen();
        robot.noise = None;
        assert!(matches!(render(&robot, &Options::default()), Err(ExportError::NoNoise { .. })));
    }
}
