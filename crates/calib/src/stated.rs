//! What a robot states of the parameters that calibration estimates.

use dataset::NominalRobot;

use crate::estimate::Parameter;

/// What a robot states of a parameter.
#[must_use]
pub fn nominal_value(robot: &NominalRobot, key: &str) -> Option<f64> {
    let per_tick = |diameter_m: f64| Some(std::f64::consts::PI * diameter_m / robot.ticks_per_rev?);
    let is = |parameter: Parameter| key == parameter.key();
    match () {
        () if is(Parameter::LeftWheelDiameter) => Some(robot.left_wheel_diameter_m),
        () if is(Parameter::RightWheelDiameter) => Some(robot.right_wheel_diameter_m),
        () if is(Parameter::WheelSeparation) => Some(robot.wheel_separation_m),
        () if is(Parameter::LeftPerTick) => per_tick(robot.left_wheel_diameter_m),
        () if is(Parameter::RightPerTick) => per_tick(robot.right_wheel_diameter_m),
        () => None,
    }
}
