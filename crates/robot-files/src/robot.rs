//! What a file says of a robot's wheels, and what no robot has.

use std::f64::consts::PI;

use kinematics::Wheels;

use crate::error::RobotFileError;

/// Metres. From here on a length is no robot's: millimetres are meant.
const MAX_LENGTH_M: f64 = 10.0;

/// A robot by one of its files: what its own odometry goes by, multipliers included.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Robot {
    /// Diameters of the wheels, metres.
    pub wheel_diameter_m: Option<Wheels<f64>>,
    /// Distance between the wheels, metres.
    pub wheel_separation_m: Option<f64>,
    /// The diameter before multipliers, metres, of a controller that has these.
    pub unscaled_diameter_m: Option<f64>,
    /// The separation before its multiplier, metres.
    pub unscaled_separation_m: Option<f64>,
    /// Counts of a wheel turn.
    pub ticks_per_rev: Option<f64>,
    /// Travel of a count, metres, where the file has it in place of a diameter.
    pub m_per_tick: Option<Wheels<f64>>,
    /// Joints of the wheels.
    pub joints: Option<Wheels<String>>,
    /// The controller, or `URDF`; empty where a file has no name for it.
    pub part: String,
    /// What is no error but should be known, one line each.
    pub remarks: Vec<String>,
}

impl Robot {
    /// The diameters, by the travel of a count where the file has that.
    #[must_use]
    pub fn diameter_m(&self, ticks_per_rev: Option<f64>) -> Option<Wheels<f64>> {
        let of_counts = || Some(self.m_per_tick?.map(|travel_m| travel_m * ticks_per_rev.unwrap_or(f64::NAN) / PI));
        self.wheel_diameter_m.or_else(|| ticks_per_rev.and_then(|_| of_counts()))
    }

    /// Refuses lengths that no robot has.
    ///
    /// # Errors
    /// [`RobotFileError::NotMetres`].
    pub(crate) fn checked(mut self) -> Result<Self, RobotFileError> {
        let wheels = self.wheel_diameter_m.map(|Wheels { left, right }| [left, right]);
        let lengths = wheels.into_iter().flatten().map(|length_m| ("wheel diameter", length_m));
        for (key, value) in lengths.chain(self.wheel_separation_m.map(|length_m| ("wheel separation", length_m))) {
            if !(value > 0.0 && value < MAX_LENGTH_M) {
                return Err(RobotFileError::NotMetres { key: key.to_owned(), value });
            }
        }
        if let (Some(Wheels { left, right }), Some(separation_m)) = (self.wheel_diameter_m, self.wheel_separation_m)
            && left.max(right) >= separation_m
        {
            self.remarks.push(format!(
                "the wheels are {:.0} mm in diameter and only {:.0} mm apart: is the radius a diameter?",
                1e3 * left.max(right),
                1e3 * separation_m
            ));
        }
        Ok(self)
    }
}
