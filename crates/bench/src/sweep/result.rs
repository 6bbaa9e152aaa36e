//! The result of a sweep, as `yair sweep --json` prints it and as files hold it.

use std::collections::BTreeMap;

use dataset::{NotNegative, Number, Positive, Share, checked};
use scenario::Level;
use serde::{Deserialize, Serialize};

/// A sweep's result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SweepResult {
    /// The scenario's name.
    pub scenario: String,
    /// Seed of every draw.
    pub seed: u64,
    /// Trials at each point; with a precision, at most.
    pub trials: u64,
    /// Largest Monte-Carlo error that was asked for.
    #[serde(default, deserialize_with = "checked::<Option<Share>, _>", skip_serializing_if = "Option::is_none")]
    pub precision: Option<f64>,
    /// Point by point, in the order of the design.
    pub points: Vec<PointResult>,
}

/// One point of the design.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PointResult {
    /// Level on each axis.
    pub levels: BTreeMap<String, Level>,
    /// Trials driven.
    pub trials: u64,
    /// Is every Monte-Carlo error at most [`SweepResult::precision`]?
    #[serde(skip_serializing_if = "Option::is_none")]
    pub precise: Option<bool>,
    /// What each method's protocol costs.
    pub costs: Vec<MethodCost>,
    /// Each method's account of each parameter.
    pub estimators: Vec<EstimatorResult>,
    /// Odometry under each method's calibration on the validation path; empty when the scenario states none.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub drift: Vec<DriftResult>,
}

/// What a method's protocol costs a person and a robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MethodCost {
    /// The method.
    pub method: String,
    /// Runs driven.
    pub runs: u64,
    /// Driving and handling.
    #[serde(deserialize_with = "checked::<NotNegative, _>")]
    pub minutes: f64,
    /// Mean travel of the wheels.
    #[serde(deserialize_with = "checked::<NotNegative, _>")]
    pub metres: f64,
}

/// A share of trials.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Coverage {
    /// The share.
    #[serde(deserialize_with = "checked::<Share, _>")]
    pub share: f64,
    /// Its Monte-Carlo standard error.
    #[serde(deserialize_with = "checked::<NotNegative, _>")]
    pub mcse: f64,
    /// Lower 95 % bound (Clopper & Pearson 1934).
    #[serde(default, deserialize_with = "checked::<Option<Share>, _>")]
    pub low: Option<f64>,
    /// Upper 95 % bound.
    #[serde(default, deserialize_with = "checked::<Option<Share>, _>")]
    pub high: Option<f64>,
}

/// An error that a share of the trials stays below.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Quantile {
    /// The share.
    #[serde(deserialize_with = "checked::<Share, _>")]
    pub share: f64,
    /// The error, in the parameter's unit.
    #[serde(deserialize_with = "checked::<Number, _>")]
    pub error: f64,
    /// Its Monte-Carlo standard error (Woodruff 1952).
    #[serde(deserialize_with = "checked::<NotNegative, _>")]
    pub mcse: f64,
}

/// How one method did on one parameter. `null` where no trial succeeded.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EstimatorResult {
    /// The method.
    pub method: String,
    /// The parameter's key.
    pub parameter: String,
    /// Its true value, SI.
    #[serde(deserialize_with = "checked::<Positive, _>")]
    pub truth: f64,
    /// Mean error.
    #[serde(default, deserialize_with = "checked::<Option<Number>, _>")]
    pub bias: Option<f64>,
    /// Monte-Carlo standard error of the bias.
    #[serde(default, deserialize_with = "checked::<Option<NotNegative>, _>")]
    pub bias_mcse: Option<f64>,
    /// Variance of the error.
    #[serde(default, deserialize_with = "checked::<Option<NotNegative>, _>")]
    pub variance: Option<f64>,
    /// Monte-Carlo standard error of the variance.
    #[serde(default, deserialize_with = "checked::<Option<NotNegative>, _>")]
    pub variance_mcse: Option<f64>,
    /// Root of the mean squared error.
    #[serde(default, deserialize_with = "checked::<Option<NotNegative>, _>")]
    pub rmse: Option<f64>,
    /// Monte-Carlo standard error of the RMSE.
    #[serde(default, deserialize_with = "checked::<Option<NotNegative>, _>")]
    pub rmse_mcse: Option<f64>,
    /// The errors that 5 %, half and 95 % of the trials stay below.
    pub quantiles: Vec<Quantile>,
    /// Share of the 95 % intervals (±1.96 sigma) that hold the truth.
    #[serde(default, deserialize_with = "checked::<Option<Share>, _>")]
    pub coverage: Option<f64>,
    /// The same with its errors.
    pub coverage_95: Option<Coverage>,
    /// Share of the one-sigma intervals that hold the truth; 68.27 % when sigma is right.
    pub coverage_68: Option<Coverage>,
    /// Trials in which the method gave no value.
    pub failures: u64,
    /// Why the method could not be used at this point at all.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub not_applicable: Option<String>,
    /// False when the method cannot see the scale common to both wheels: its bias is then that scale's.
    pub common_scale_observable: bool,
    /// Square root of the Cramér–Rao bound: no unbiased method's standard deviation is smaller on this
    /// protocol. Where the common scale is not observable it is the bound for a known mean diameter.
    #[serde(default, deserialize_with = "checked::<Option<NotNegative>, _>")]
    pub cramer_rao_sigma: Option<f64>,
    /// RMSE² over the Cramér–Rao bound.
    #[serde(default, deserialize_with = "checked::<Option<NotNegative>, _>")]
    pub cramer_rao_ratio: Option<f64>,
    /// Monte-Carlo standard error of that ratio.
    #[serde(default, deserialize_with = "checked::<Option<NotNegative>, _>")]
    pub cramer_rao_ratio_mcse: Option<f64>,
    /// Why there is no ratio.
    pub cramer_rao_why_null: Option<String>,
}

impl EstimatorResult {
    /// Standard deviation of the error with its Monte-Carlo standard error.
    #[must_use]
    pub fn std(&self) -> Option<(f64, f64)> {
        let (variance, mcse) = (self.variance?, self.variance_mcse?);
        let std = variance.sqrt();
        Some((std, if std > 0.0 { mcse / (2.0 * std) } else { 0.0 }))
    }
}

/// How far odometry drifts on the validation path when it believes a method's calibration. Systematic effects
/// act on it as on the protocols, random ones do not.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DriftResult {
    /// The method.
    pub method: String,
    /// Mean over trials, per cent of the path's length.
    #[serde(default, deserialize_with = "checked::<Option<NotNegative>, _>")]
    pub mean_percent: Option<f64>,
    /// Its Monte-Carlo standard error.
    #[serde(default, deserialize_with = "checked::<Option<NotNegative>, _>")]
    pub mean_percent_mcse: Option<f64>,
    /// Root of the mean square.
    #[serde(default, deserialize_with = "checked::<Option<NotNegative>, _>")]
    pub rms_percent: Option<f64>,
    /// Its Monte-Carlo standard error.
    #[serde(default, deserialize_with = "checked::<Option<NotNegative>, _>")]
    pub rms_percent_mcse: Option<f64>,
}
