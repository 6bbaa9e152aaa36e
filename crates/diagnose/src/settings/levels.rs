//! Levels and margins that several stages share.

/// Probability. Family-wise false-positive rate of all residual tests.
/// Budgeted: a twentieth of the 5 % of false positives of a diagnosis: what fails has no name.
pub const CHECKS_LEVEL: f64 = 0.0025;

rules::settings! {
    Levels
    /// Probability. Family-wise false-positive rate of the search for a sparse term.
    /// Budgeted: a twentieth of the 5 % of false positives of a diagnosis.
    sparse_term_level: f64 = 0.0025,
    /// Probability. Family-wise false-positive rate of the scan over the catalogue.
    /// Budgeted: a quarter of the 5 % of false positives of a diagnosis.
    scan_level: f64 = 0.0125,
    /// Number. Largest number of catalogued effects in the mean model.
    /// Tuned: by hand; no record of what on.
    max_effects: usize = 3,
    /// Probability. Level of the cluster-robust test over runs, for an effect that is significant over the
    /// measurements.
    /// Convention: 5 %, two-sided.
    cluster_robust_level: f64 = 0.05,
    /// Probability. Level at which turns scatter more than the wheels explain; any other error of the model
    /// makes turns differ from run to run too.
    /// Tuned: by hand; no record of what on.
    turn_scatter_level: f64 = 1e-7,
    /// Number. Fewer runs do not tell how runs differ; to be held out, they are cut into blocks.
    /// Tuned: by hand; no record of what on.
    min_runs: usize = 6,
    /// Standard deviations. Square root of the noncentrality at the detection limit: power 0.9 at a two-sided
    /// level of 1e-3.
    /// Derived: Φ⁻¹(0.9) + Φ⁻¹(1 − 1e-3/2) = 1.28 + 3.29.
    detection_sqrt_lambda: f64 = 4.57,
    /// Natural logarithm of odds. Causes within this of the most probable one are not discriminated.
    /// Derived: ln 20, odds of one in twenty.
    min_log_odds_margin: f64 = 3.0,
    /// Fraction of the log-likelihood gain by which the form of a hypothesis may err.
    /// Derived: the square of a relative error of a tenth in form.
    model_mismatch_fraction: f64 = 0.01,
    /// Standard deviations, multiplicity corrected. A finding below this is of low significance.
    /// Tuned: on the blind benchmark.
    low_significance_sigmas: f64 = 4.5,
    /// Standard deviations. Two-sided 95 % quantile of a normal variable.
    /// Derived: Φ⁻¹(0.975).
    normal_quantile_95: f64 = 1.96,
    /// Number. Degrees of freedom that Student's quantile is asked for at the most: with more it is the
    /// normal one to 2e-5.
    /// Budgeted: from 10⁶ on the library's search for it errs by more.
    max_student_freedom: f64 = 1e5,
    /// Standard deviations. One-sided 95 % quantile of a normal variable.
    /// Derived: Φ⁻¹(0.95).
    normal_quantile_one_sided_95: f64 = 1.645,
    /// Radians. Prior standard deviation of the heading of the instrument on the robot.
    /// Tuned: by hand; no record of what on.
    sensor_heading_prior_sigma_rad: f64 = 0.3,
    /// Probability. Below this the standard normal quantile is taken from the statistic, not from the
    /// p-value.
    /// Derived: some decades above the smallest normal double, 2e-308.
    min_quantile_p_value: f64 = 1e-290,
}
