//! `turtlebot3`: parameters of `turtlebot3_node`, which has one radius for both wheels.
//!
//! Reference: turtlebot3_bringup/param/burger.yaml (github.com/ROBOTIS-GIT/turtlebot3).

use std::fmt::Write;

use crate::comment::{decimal, digits, limits, mm, origin, plus_minus_mm, wrapped};
use crate::error::ExportError;
use crate::format::ros2_yaml::key;
use crate::options::Options;
use crate::robot::CalibratedRobot;

/// Decimals of lengths, metres.
const DECIMALS: usize = 9;

pub(super) fn render(robot: &CalibratedRobot, options: &Options) -> Result<String, ExportError> {
    let radius_m = 0.5 * robot.mean_diameter_m();
    let separation = &robot.wheel_separation;
    let instead =
        |nominal_m: Option<f64>| nominal_m.map_or_else(String::new, |of| format!(", instead of {} mm", mm(of)));
    let nominal_radius_m = robot.wheel_diameter.left.nominal_m.map(|of| 0.5 * of);
    // Wheels of radii r_R and r_L turn the robot by (r_R − r_L)/(r b) for each metre that it goes.
    let (left_m, right_m) = (robot.wheel_diameter.left.value_m, robot.wheel_diameter.right.value_m);
    let turn_deg_m = ((right_m - left_m) / robot.mean_diameter_m() / separation.value_m).to_degrees();
    let mut text = origin("#", "turtlebot3", robot);
    text.push_str(&wrapped(
        "#",
        "Replace these two in burger.yaml or waffle.yaml. OpenCR's firmware has lengths of its own for cmd_vel.",
    ));
    let node = options.controller.as_deref().unwrap_or("turtlebot3_node");
    let _ = writeln!(text, "/**:\n  {}:\n    ros__parameters:\n      wheels:", key(node));
    let _ = writeln!(
        text,
        "        separation: {}  # m, {}{}",
        decimal(separation.value_m, DECIMALS),
        plus_minus_mm(separation),
        instead(separation.nominal_m)
    );
    let _ = writeln!(
        text,
        "        radius: {}  # m, geometric mean of both wheels{}",
        decimal(radius_m, DECIMALS),
        instead(nominal_radius_m)
    );
    text.push_str(&wrapped(
        "#",
        &format!(
            "What these parameters cannot express: the wheels differ, {} mm left and {} mm right in radius. Odometry \
             with one radius misses {} degrees of turn for each metre.",
            mm(0.5 * left_m),
            mm(0.5 * right_m),
            if turn_deg_m < 0.0 { format!("-{}", digits(-turn_deg_m)) } else { digits(turn_deg_m) }
        ),
    ));
    text.push_str(&limits("#", robot, false));
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::specimen;

    #[test]
    fn regress_text_of_a_small_calibration() {
        let text = render(&specimen(), &Options::default()).expect("has all");
        // √(0.101 · 0.099) m, to the nanometre; (0.198 − 0.202)/0.19999/0.408 rad/m.
        assert_eq!(
            text,
            "# By `yair export turtlebot3` from robot.toml (joint).\n\
             # Replace these two in burger.yaml or waffle.yaml. OpenCR's firmware has lengths of its own for\n\
             #  cmd_vel.\n\
             /**:\n  turtlebot3_node:\n    ros__parameters:\n      wheels:\n\
             \u{20}       separation: 0.408  # m, ± 0.20 mm, instead of 400.000 mm\n\
             \u{20}       radius: 0.099995  # m, geometric mean of both wheels, instead of 100.000 mm\n\
             # What these parameters cannot express: the wheels differ, 101.000 mm left and 99.000 mm right in\n\
             #  radius. Odometry with one radius misses -2.8 degrees of turn for each metre.\n"
        );
    }
}
