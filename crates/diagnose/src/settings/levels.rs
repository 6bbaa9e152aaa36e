//! Levels and margins that several stages share.

/// Probability. Family-wise false-positive rate of all residual tests.
/// Budgeted: a twentieth of the 5 % of false positives of a diagnosis: what fails has no name.
pub const CHECKS_LEVEL: f64 = 0.0025;

/// Probability. Family-wise false-positive rate of the search for a sparse term.
/// Budgeted: a twentieth of the 5 % of false positives of a diagnosis.
pub(crate) const SPARSE_TERM_LEVEL: f64 = 0.0025;

/// Probability. Family-wise false-positive rate of the scan over the catalogue.
/// Budgeted: a quarter of the 5 % of false positives of a diagnosis.
pub(crate) const SCAN_LEVEL: f64 = 0.0125;

/// Number. Largest number of catalogued effects in the mean model.
/// Tuned: by hand; no record of what on.
pub(crate) const MAX_EFFECTS: usize = 3;

/// Probability. Level of the cluster-robust test over runs, for an effect that is significant over the
/// measurements.
/// Convention: 5 %, two-sided.
pub(crate) const CLUSTER_ROBUST_LEVEL: f64 = 0.05;

/// Probability. Level at which turns scatter more than the wheels explain; any other error of the model makes
/// turns differ from run to run too.
/// Tuned: by hand; no record of what on.
pub(crate) const TURN_SCATTER_LEVEL: f64 = 1e-7;

/// Number. Fewer runs do not tell how runs differ; to be held out, they are cut into blocks.
/// Tuned: by hand; no record of what on.
pub(crate) const MIN_RUNS: usize = 6;

/// Standard deviations. Square root of the noncentrality at the detection limit: power 0.9 at a two-sided
/// level of 1e-3.
/// Derived: Φ⁻¹(0.9) + Φ⁻¹(1 − 1e-3/2) = 1.28 + 3.29.
pub(crate) const DETECTION_SQRT_LAMBDA: f64 = 4.57;

/// Natural logarithm of odds. Causes within this of the most probable one are not discriminated.
/// Derived: ln 20, odds of one in twenty.
pub(crate) const MIN_LOG_ODDS_MARGIN: f64 = 3.0;

/// Fraction of the log-likelihood gain by which the form of a hypothesis may err.
/// Derived: the square of a relative error of a tenth in form.
pub(crate) const MODEL_MISMATCH_FRACTION: f64 = 0.01;

/// Standard deviations, multiplicity corrected. A finding below this is of low significance.
/// Tuned: on the blind benchmark.
pub(crate) const LOW_SIGNIFICANCE_SIGMAS: f64 = 4.5;

/// Standard deviations. Two-sided 95 % quantile of a normal variable.
/// Derived: Φ⁻¹(0.975).
pub(crate) const NORMAL_QUANTILE_95: f64 = 1.96;

/// Number. Degrees of freedom that Student's quantile is asked for at the most: with more it is the normal
/// one to 2e-5.
/// Budgeted: from 10⁶ on the library's search for it errs by more.
pub(crate) const MAX_STUDENT_FREEDOM: f64 = 1e5;

/// Standard deviations. One-sided 95 % quantile of a normal variable.
/// Derived: Φ⁻¹(0.95).
pub(crate) const NORMAL_QUANTILE_ONE_SIDED_95: f64 = 1.645;

/// Radians. Prior standard deviation of the heading of the instrument on the robot.
/// Tuned: by hand; no record of what on.
pub(crate) const SENSOR_HEADING_PRIOR_SIGMA_RAD: f64 = 0.3;

/// Probability. Below this the standard normal quantile is taken from the statistic, not from the p-value.
/// Derived: some decades above the smallest normal double, 2e-308.
pub(crate) const MIN_QUANTILE_P_VALUE: f64 = 1e-290;
