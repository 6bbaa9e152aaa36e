//! What a diagnosis estimated and a simulated robot does not say: the instrument, and the effects' mean terms
//! as they were fitted.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Estimates behind a scenario that a diagnosis wrote.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Estimated {
    /// Where the instrument is on the robot, ahead of the drive's centre, metres.
    pub sensor_x_m: f64,
    /// The same to the left, metres.
    pub sensor_y_m: f64,
    /// How it is turned on the robot, radians.
    pub sensor_theta_rad: f64,
    /// How much later than it is true a measurement is stamped, seconds.
    pub latency_s: f64,
    /// The mean terms of the effects.
    #[serde(default, rename = "term", skip_serializing_if = "Vec::is_empty")]
    pub terms: Vec<EstimatedTerm>,
}

/// The mean term of an effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EstimatedTerm {
    /// The effect's id.
    pub kind: String,
    /// Its parameters by name, as findings have them, and what was held.
    pub values: BTreeMap<String, f64>,
}
