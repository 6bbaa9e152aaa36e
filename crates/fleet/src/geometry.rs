//! A robot's geometry as one session determines it.

use calib::{Calibration, Covariance, Parameter};
use dataset::{Number, Positive, checked};
use kinematics::DriveGeometry;
use serde::{Deserialize, Serialize};

/// The parameters of a geometry, in the order of every array here: left diameter, right diameter, separation.
pub const GEOMETRY: [Parameter; 3] = Parameter::LENGTHS;

/// Left diameter, right diameter and separation, metres.
pub(crate) fn geometry_m(geometry: &DriveGeometry) -> [f64; 3] {
    let diameter_m = geometry.wheel_diameter_m();
    [diameter_m.left, diameter_m.right, geometry.wheel_separation_m()]
}

/// A calibrated geometry with its covariance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GeometryEstimate {
    /// Left diameter, right diameter and separation, metres; `None` where the runs do not determine it.
    #[serde(deserialize_with = "checked::<[Option<Positive>; 3], _>")]
    pub value_m: [Option<f64>; 3],
    /// Their covariance, m²; `None` where the runs show no scatter. Rows of what is not determined mean
    /// nothing.
    #[serde(default, deserialize_with = "checked::<Option<[[Number; 3]; 3]>, _>")]
    pub covariance_m2: Option<[[f64; 3]; 3]>,
    /// What the runs do not determine.
    pub not_observable: Vec<Undetermined>,
}

/// A parameter that the runs do not determine.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Undetermined {
    /// Its key.
    pub parameter: String,
    /// Why, and what would show it.
    pub why: String,
}

impl GeometryEstimate {
    /// The geometry of a calibration; `determined` says which of the parameters the runs determine.
    #[must_use]
    pub fn of(calibration: &Calibration, determined: impl Fn(Parameter) -> bool) -> Self {
        let geometry_m = geometry_m(&calibration.geometry);
        let value = |row: usize| Some(geometry_m[row]).filter(|_| determined(GEOMETRY[row]));
        let rows = |of: &Covariance| [0, 1, 2].map(|row| [0, 1, 2].map(|column| of[(row, column)]));
        let undetermined = calibration.not_observable.iter();
        Self {
            value_m: [0, 1, 2].map(value),
            covariance_m2: calibration.covariance.as_ref().map(rows),
            not_observable: undetermined
                .map(|blind| Undetermined { parameter: blind.parameter.key().to_owned(), why: blind.why.to_string() })
                .collect(),
        }
    }

    /// One standard deviation of a parameter, metres; `None` where there is none.
    #[must_use]
    pub fn sigma_m(&self, row: usize) -> Option<f64> {
        self.value_m[row]?;
        Some(self.covariance_m2?[row][row].sqrt()).filter(|sigma_m| sigma_m.is_finite() && *sigma_m > 0.0)
    }
}
