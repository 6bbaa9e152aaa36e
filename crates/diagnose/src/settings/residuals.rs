//! Tests of the residuals, noise effects, large errors, and binned residuals.

/// Fractions of the time between two measurements. Instants of a jump.
/// Derived: the middles of three equal parts.
pub(crate) const JUMP_TIME_FRACTIONS: [f64; 3] = [1.0 / 6.0, 0.5, 5.0 / 6.0];

/// Number. Turns of a run that have a score of their own; the next ones share those of the first.
/// Derived: 32 scores tell a variance to a quarter of itself.
pub(crate) const TURNS_PER_RUN: usize = 32;

rules::settings! {
    Residuals
    /// Number. Simulations that give the distribution of a test where encoders are coarse.
    /// Budgeted: an inflation
    /// is known to a third, and a p-value of 1e-4 by Student's t needs z = 4.7 in place of 3.7.
    resimulations: u64 = 20,
    /// Standard deviations. Where simulated runs are less significant, they count as this: the likelihood
    /// ratio of a variance at its boundary is 0 and its p-value 1 every other time, which is no scatter of
    /// the upper tail.
    /// Derived: a normal variable cut there has a mean of 0.08 and a standard deviation of 0.87.
    lowest_simulated_z: f64 = -1.0,
    /// Probability. Tests with a smaller p-value by formula are judged by simulation where encoders are
    /// coarse.
    /// Budgeted: what has a larger one fails no test at 1 %.
    resimulated_level: f64 = 0.01,
    /// Number. Poses of a robot that stands which say whether the instrument's errors last.
    /// Derived: the lag-one coefficient of so many is known to 0.18.
    min_poses_at_rest: usize = 30,
    /// How many rates of decay errors at rest are compared with, each half of the one before.
    /// Derived: the slowest lasts a hundred times as long as the autocorrelation of the residuals says at
    /// least.
    decays_at_rest: i32 = 8,
    /// Number. Poses of a standstill that are compared with each other; a longer one counts as several.
    /// Budgeted: a correlation of so many is factored in a millisecond.
    max_poses_of_standstill: usize = 128,
    /// Seconds before and after a pose in which no wheel turns, for the robot to stand.
    /// Budgeted: what an instrument is late by, or lags, in published logs.
    rest_margin_s: f64 = 0.3,
    /// Log odds for white errors of a robot that stands over ones as autocorrelated as those of its drives.
    /// Convention: strong evidence, 20 to 1.
    white_at_rest_log_odds: f64 = 3.0,
    /// Number. Lags of the whiteness test.
    /// Tuned: by hand; no record of what on.
    whiteness_lags: usize = 5,
    /// Probability. A measurement of a right model is an outlier.
    /// Derived: tail of χ² with three degrees of freedom above the outlier gate at 25.9.
    outlier_probability: f64 = 1e-5,
    /// Probability. An outlier is persistent if the measurement after it has a smaller p-value.
    /// Tuned: by hand; no record of what on.
    after_outlier_level: f64 = 0.01,
    /// Fraction of a measurement's variance. Where the motion within rows has more, neither size nor tails
    /// are tested.
    /// Derived: what has a tenth of a variance has a hundredth of its kurtosis.
    max_within_row_share: f64 = 0.1,
    /// Standard deviations. Larger innovations are of the tail whose persistence is tested.
    /// Tuned: by hand; no record of what on.
    tail_innovation_sigmas: f64 = 3.0,
    /// Standard errors. Level at which the innovations after large ones are persistent or reverting.
    /// Convention: 1 %, two-sided, of a normal variable.
    persistence_sigmas: f64 = 2.6,
    /// Ratio of Mahalanobis distances. Two displacements cancel if together they are off by less than this
    /// share of the outlier.
    /// Derived: an outlier is off by 5 standard deviations at the least, the sum of two right ones by √2.
    cancellation_ratio: f64 = 0.5,
    /// Number. Fewer innovations are not tested for whiteness.
    /// Tuned: by hand; no record of what on.
    min_whiteness_innovations: f64 = 20.0,
    /// Number. A lag with fewer pairs is not tested.
    /// Tuned: by hand; no record of what on.
    min_whiteness_pairs: f64 = 10.0,
    /// Number. Kurtosis above which tails are heavy.
    /// Derived: that of a normal variable.
    normal_kurtosis: f64 = 3.0,
    /// Number. The tails of fewer innovations are not tested.
    /// Tuned: by hand; no record of what on.
    min_kurtosis_innovations: f64 = 50.0,
    /// Probability. Family-wise level at which outliers are a noise effect.
    /// Tuned: by hand; no record of what on.
    noise_effect_level: f64 = 1e-3,
    /// Probability. Level of dependence on something recorded where tails are heavy: a few large errors make
    /// the test of dependence fail.
    /// Tuned: by hand; no record of what on.
    dependence_beyond_tails_level: f64 = 1e-6,
    /// Fraction of the measurements. With more outliers the model errs, not the measurements.
    /// Tuned: by hand; no record of what on.
    max_outlier_fraction: f64 = 0.2,
    /// Ratio. Least number of isolated outliers for each persistent one where the instrument errs.
    /// Tuned: by hand; no record of what on.
    isolated_to_persistent_ratio: usize = 3,
    /// Standard deviations. A larger innovation is a large error.
    /// Tuned: by hand; no record of what on.
    large_innovation_sigmas: f64 = 3.5,
    /// Measurements. Large innovations no farther apart are one error: a filter that followed it comes back.
    /// Tuned: by hand; no record of what on.
    max_error_gap: usize = 3,
    /// Number. Large errors that are attributed, the largest first.
    /// Tuned: by hand; no record of what on.
    max_large_errors: usize = 24,
    /// Number. Large errors in one pass.
    /// Tuned: by hand; no record of what on.
    errors_per_pass: usize = 4,
    /// Probability. A large error has another cause than the others.
    /// Tuned: by hand; no record of what on.
    other_cause_probability: f64 = 0.05,
    /// Fraction. Share of the errors of sticking or sliding wheels that are at starts and stops.
    /// Tuned: by hand; no record of what on.
    ramp_error_fraction: f64 = 0.9,
    /// Seconds. A measurement this near to an instant is at it.
    /// Tuned: by hand; no record of what on.
    instant_tolerance_s: f64 = 1e-6,
    /// Metres and radians. Scales of a measurement's error over which the likelihood is averaged.
    /// Convention: half decades from a millimetre to a metre.
    measurement_error_scales: [f64; 7] = [1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0],
    /// Number. Bins of a continuous covariate.
    /// Tuned: by hand; no record of what on.
    bins: usize = 12,
    /// Number. A bin with fewer residuals has no standard error.
    /// Tuned: by hand; no record of what on.
    min_residuals_per_bin: usize = 8,
    /// Fraction of the covariate's span. Bins are no narrower: closer ones overlap in a picture.
    /// Tuned: by hand; no record of what on.
    min_bin_width: f64 = 0.025,
    /// Relative. Values of a covariate that differ by less are one level.
    /// Tuned: by hand; no record of what on.
    covariate_tolerance: f64 = 1e-6,
    /// Fraction of a turn's largest rate. Below it the turn is over.
    /// Convention: a tenth; between two motions in one sense wheels stand for less than a row.
    turn_ends_at: f64 = 0.1,
    /// Fraction of the largest rate of the turn before. Above it the next turn begins.
    /// Convention: twice where one ends.
    turn_begins_at: f64 = 0.2,
}
