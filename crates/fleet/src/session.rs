//! What one session shows of its robot, as it is kept.

use dataset::{NominalRobot, NotNegative, Number, Share, Timestamp, checked};
use serde::{Deserialize, Serialize};

use crate::excess_drift::ExcessDrift;
use crate::geometry::GeometryEstimate;

/// What was found in one dataset.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SessionResult {
    /// The robot's id, where the dataset states it.
    pub robot_id: Option<String>,
    /// When it was recorded, where the dataset states it.
    pub recorded: Option<Timestamp>,
    /// What the robot was configured with.
    pub nominal: NominalRobot,
    /// The kind of path that it drives ([`calib::path_kind`]).
    pub path_kind: String,
    /// How many runs it has.
    pub runs: usize,
    /// Drift on these runs.
    pub drift_percent: SessionDrift,
    /// The calibrated geometry.
    pub geometry: GeometryEstimate,
    /// Predicted excess drift of the configured geometry over the calibrated one, or why there is none.
    pub excess_drift: Result<ExcessDrift, String>,
    /// What a diagnosis found; `None` where none was asked for.
    pub findings: Option<Vec<SessionFinding>>,
    /// Remarks on the log, in order.
    pub remarks: Vec<String>,
}

/// 100 · sum of the final position errors / sum of the lengths, on the session's own runs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SessionDrift {
    /// Under the configured parameters, per cent.
    #[serde(default, deserialize_with = "checked::<Option<NotNegative>, _>")]
    pub nominal: Option<f64>,
    /// Under the session's own calibration, per cent: fitted to the same runs, and so too small for others.
    #[serde(default, deserialize_with = "checked::<Option<NotNegative>, _>")]
    pub calibrated: Option<f64>,
    /// Why something is null.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub why_null: Option<String>,
}

/// A finding of `yair diagnose`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SessionFinding {
    /// The most probable cause.
    pub id: String,
    /// All causes that these data do not discriminate.
    pub names: Vec<String>,
    /// Its probability.
    #[serde(deserialize_with = "checked::<Share, _>")]
    pub probability: f64,
    /// Standard normal quantile of its p-value.
    #[serde(deserialize_with = "checked::<Number, _>")]
    pub z: f64,
    /// In a sentence.
    pub sentence: String,
}
