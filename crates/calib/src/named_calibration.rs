//! The values of a calibration as dead reckoning takes them, and whether they are of a robot.

use std::collections::BTreeMap;

use dataset::NominalRobot;
use kinematics::{DriveGeometry, Pose, Wheels};

use crate::estimate::{GroupInstrument, Parameter, is_implausible, is_off};
use crate::settings::{MAX_EVALUATED_DIAMETER_RATIO, MAX_EVALUATED_SEPARATION_RATIO};

/// A named set of values for dead reckoning.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedCalibration {
    /// The name that tables show.
    pub name: String,
    /// Values by key.
    pub values: BTreeMap<String, f64>,
    /// Instruments of the sessions that it was found on, where these have their own.
    pub own_instruments: Vec<GroupInstrument>,
}

impl NamedCalibration {
    /// Values by their keys, of an instrument that is the same in all sessions.
    #[must_use]
    pub const fn new(name: String, values: BTreeMap<String, f64>) -> Self {
        Self { name, values, own_instruments: Vec::new() }
    }

    /// The same with the instrument of a session, by its name, where sessions have their own: a session that
    /// it was not found on has none that is known.
    #[must_use]
    pub fn in_session(mut self, session: &str) -> Self {
        if let Some(own) = self.own_instruments.iter().find(|own| own.of == session) {
            let own = [own.sensor_x_m, own.sensor_y_m, own.sensor_theta_rad, own.latency_s];
            let own = Parameter::INSTRUMENT.into_iter().zip(own);
            self.values.extend(own.filter_map(|(of, value)| Some((of.key().to_owned(), value?))));
        } else if !self.own_instruments.is_empty() {
            self.values.retain(|key, _| !Parameter::INSTRUMENT.iter().any(|of| of.key() == key));
        }
        self
    }

    /// The drive for a robot: missing values stay nominal; a diameter missing beside a travel per tick
    /// follows from it.
    #[must_use]
    pub fn geometry(&self, robot: &NominalRobot, nominal: DriveGeometry) -> Option<DriveGeometry> {
        let value = |parameter: Parameter| self.values.get(parameter.key()).copied();
        let diameter_m = |diameter: Parameter, per_tick: Parameter, nominal_m: f64| {
            let from_ticks = || Some(value(per_tick)? * robot.ticks_per_rev? / std::f64::consts::PI);
            value(diameter).or_else(from_ticks).unwrap_or(nominal_m)
        };
        let nominal_m = nominal.wheel_diameter_m();
        let diameter_m = Wheels {
            left: diameter_m(Parameter::LeftWheelDiameter, Parameter::LeftPerTick, nominal_m.left),
            right: diameter_m(Parameter::RightWheelDiameter, Parameter::RightPerTick, nominal_m.right),
        };
        DriveGeometry::new(diameter_m, value(Parameter::WheelSeparation).unwrap_or(nominal.wheel_separation_m())).ok()
    }

    /// The value that is no correction of a robot's nominal one, for people; `None` where all may be.
    #[must_use]
    pub fn implausible_for(&self, robot: &NominalRobot) -> Option<String> {
        let (parameter, found_m, nominal_m) = self.first_length(robot, is_implausible)?;
        Some(format!("{} is {found_m:.4} where the dataset states {nominal_m:.4}", parameter.key()))
    }

    /// The value that is far from a robot's nominal one, though it may be a correction of it, for people.
    #[must_use]
    pub fn other_robot(&self, robot: &NominalRobot) -> Option<String> {
        let most = [MAX_EVALUATED_DIAMETER_RATIO, MAX_EVALUATED_SEPARATION_RATIO];
        let (parameter, found_m, nominal_m) =
            self.first_length(robot, |parameter, ratio| is_off(parameter, ratio, most))?;
        Some(format!(
            "{} is {:.2} mm where the dataset states {:.2} mm",
            parameter.key(),
            1e3 * found_m,
            1e3 * nominal_m
        ))
    }

    /// The first length whose ratio to the nominal one is so, with both.
    fn first_length(
        &self,
        robot: &NominalRobot,
        is_so: impl Fn(Parameter, f64) -> bool,
    ) -> Option<(Parameter, f64, f64)> {
        let found = self.geometry(robot, robot.geometry().ok()?)?;
        let lengths = [
            (Parameter::LeftWheelDiameter, found.wheel_diameter_m().left, robot.left_wheel_diameter_m),
            (Parameter::RightWheelDiameter, found.wheel_diameter_m().right, robot.right_wheel_diameter_m),
            (Parameter::WheelSeparation, found.wheel_separation_m(), robot.wheel_separation_m),
        ];
        lengths.into_iter().find(|(parameter, found_m, nominal_m)| is_so(*parameter, found_m / nominal_m))
    }

    /// Latency of the outside instrument's time stamps, seconds; 0 unless the calibration has it.
    #[must_use]
    pub fn latency_s(&self) -> f64 {
        self.values.get(Parameter::Latency.key()).copied().unwrap_or(0.0)
    }

    /// The outside instrument's frame on the robot; the identity unless the calibration has extrinsics.
    #[must_use]
    pub fn body_from_sensor(&self) -> Pose {
        let [x_m, y_m, theta_rad] =
            Parameter::EXTRINSICS.map(|parameter| self.values.get(parameter.key()).copied().unwrap_or(0.0));
        Pose::new(x_m, y_m, theta_rad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROBOT: NominalRobot = NominalRobot {
        left_wheel_diameter_m: 0.08,
        right_wheel_diameter_m: 0.09,
        wheel_separation_m: 0.2,
        ticks_per_rev: Some(1000.0),
        counter_bits: None,
    };

    #[test]
    fn what_a_calibration_does_not_say_stays_nominal() {
        let robot = ROBOT;
        let calibration = NamedCalibration::new("x".to_owned(), [("left_m_per_tick".to_owned(), 3e-4)].into());
        let geometry = calibration.geometry(&robot, robot.geometry().expect("valid")).expect("valid");
        assert_eq!(geometry.wheel_diameter_m().left, 0.3 / std::f64::consts::PI);
        assert_eq!(geometry.wheel_diameter_m().right, 0.09);
        assert_eq!(geometry.wheel_separation_m(), 0.2);
    }

    #[test]
    fn values_far_from_the_nominal_ones_are_of_another_robot_and_farther_ones_of_none() {
        let said = |key: &str, value: f64| {
            let values = BTreeMap::from([(key.to_owned(), value)]);
            let found = NamedCalibration::new("x".to_owned(), values);
            (found.other_robot(&ROBOT).is_some(), found.implausible_for(&ROBOT).is_some())
        };
        for (key, nominal_m, limits) in [
            ("left_wheel_diameter_m", 0.08, [MAX_EVALUATED_DIAMETER_RATIO, 1.3]),
            ("right_wheel_diameter_m", 0.09, [MAX_EVALUATED_DIAMETER_RATIO, 1.3]),
            ("wheel_separation_m", 0.2, [MAX_EVALUATED_SEPARATION_RATIO, 4.0]),
        ] {
            let at = |ratio: f64| [said(key, nominal_m * ratio), said(key, nominal_m / ratio)];
            assert_eq!(at(0.99 * limits[0]), [(false, false); 2], "{key}");
            assert_eq!(at(1.01 * limits[0]), [(true, false); 2], "{key}");
            assert_eq!(at(1.01 * limits[1]), [(true, true); 2], "{key}");
        }
    }
}
