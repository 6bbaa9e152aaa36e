//! Every tolerance, threshold, limit and prior of the estimator: unit, meaning and source.
//!
//! The last sentence of a constant says where its value is from. `Derived:` follows from what is said.
//! `Budgeted:` is a share of an error, of time or of memory that is allowed. `Tuned:` is found by trial, on
//! what it says. `Convention:` is customary. `Published:` names author, year and equation.

pub mod driving;
pub mod map;
pub mod nuisances;
pub mod partial;
pub mod poses_between_rows;
pub mod recorded_rates;
pub mod start_headings;
pub mod thinning;
pub mod wheel_rates;

pub(crate) use partial::{START_HEADING_SIGMA_RAD, START_POSITION_SIGMA_M};
pub(crate) use start_headings::DRIVE_PRIOR_SIGMA;

/// Instants that differ by less, seconds, are the same: files round times.
/// Budgeted: the rounding of a file's times; at 10 m/s it is 10 nm.
pub(crate) const TIME_TOLERANCE_S: f64 = 1e-9;

/// Relative tolerance of a step's length when intervals are joined up to a longest step.
/// Budgeted: above the rounding of a sum of intervals, far below one of them.
pub(crate) const STEP_LENGTH_TOLERANCE: f64 = 1e-9;

/// Share of each diagonal element that is added before an information matrix is inverted.
/// Budgeted: above rounding; it changes a standard deviation by 5e-13 of itself.
pub const RIDGE: f64 = 1e-12;

/// Eigenvalue of H Hᵀ, for fixed directions H, below which a direction is free; others have 0 or at least 1.
/// Budgeted: anything between rounding and 1 separates them.
pub(crate) const FREE_EIGENVALUE: f64 = 1e-9;

/// Bound of a running product of variances, and by its inverse: beyond, its logarithm is taken.
/// Derived: the next factor, of 1e-100 at the least, keeps the product above the smallest double, 2e-308.
pub(crate) const MIN_VARIANCE_PRODUCT: f64 = 1e-200;

/// Intervals, or cached propagations, of a phase from which on runs are filtered in parallel.
/// Budgeted: they take about a millisecond, far more than handing them to threads.
pub(crate) const MIN_PARALLEL_WORK: usize = 4096;

/// Prior standard deviation of a group's latency about the common one, seconds.
/// Convention: clocks are set to a tenth of a second.
pub(crate) const LATENCY_PRIOR_SIGMA_S: f64 = 0.1;

/// Autocorrelation of the innovations, standard errors, below which they count as white.
/// Derived: two-sided level of 1 % over three components together, Φ⁻¹(1 − 0.01/6).
pub const WHITENESS_Z: f64 = 2.935;

/// Rise of the cost at the ends of a 95 % profile interval.
/// Derived: half of χ² with one degree of freedom at 95 %.
pub const RISE_95: f64 = 1.920_729;

/// Rows of odometry and measurements together beyond which a dataset is large.
/// Budgeted: a whole fit of as many takes a hundred passes, and half a kilobyte a row.
pub const LARGE_ROWS: usize = 500_000;

rules::settings! {
    Common
    // Numbers of arithmetic.
    // Noise: priors of the standard deviations, and their bounds.
    /// Centre of the prior of a wheel's noise, m/√m.
    /// Derived: geometric middle of 0.1 and 5 mm/√m, which Chong & Kleeman 1997 and the paper span.
    wheel_prior_sigma: f64 = 7e-4,
    /// Centre of the prior of the turn noise, rad/√rad.
    /// Tuned: by hand; no record of what on.
    turn_prior_sigma: f64 = 1e-3,
    /// Centre of the prior of a measured coordinate's standard deviation, metres, where the dataset states
    /// none.
    /// Convention: instruments err by tenths of a millimetre to centimetres.
    position_prior_sigma_m: f64 = 1e-3,
    /// Centre of the prior of a measured heading's standard deviation, radians, where the dataset states
    /// none.
    /// Tuned: by hand; no record of what on.
    heading_prior_sigma_rad: f64 = 3e-3,
    /// Standard deviation of ln σ under the prior where nothing is stated: a factor of e² either way.
    /// Budgeted: the prior is worth less than one run of data, and separates what endpoints alone cannot.
    noise_prior_log_sigma: f64 = 2.0,
    /// Standard deviation of ln σ where the dataset states σ: a factor of two either way.
    /// Convention: instruments are sold by their best.
    stated_noise_log_sigma: f64 = 0.7,
    /// Smallest standard deviation of any noise: m/√m, rad/√rad, m, rad.
    /// Convention: no instrument, and no wheel, is better than a micrometre and a microradian.
    min_noise_sigma: f64 = 1e-6,
    /// Standard deviation of ln σ of a noise that is fixed.
    /// Budgeted: one per cent of it.
    fixed_noise_log_sigma: f64 = 0.01,
    // The instrument: what its groups may differ by, and when it counts as turned.
    /// Prior standard deviation of a group's sensor position about the common one, metres.
    /// Convention: a marker that is taken off and put back sits elsewhere by less than a hand's breadth.
    extrinsics_prior_sigma_m: f64 = 0.05,
    /// Prior standard deviation of a group's sensor heading about the common one, radians.
    /// Convention: a marker is put back with a turn that one does not see.
    extrinsics_prior_sigma_rad: f64 = 0.1,
    /// A group's column is observable when its posterior standard deviation is below this share of the prior
    /// one.
    /// Tuned: by hand; no record of what on.
    max_posterior_to_prior_sigma: f64 = 0.5,
    /// Relative. A stated length that is farther from what the windows of motion show is not where a fit
    /// starts.
    /// Budgeted: from a quarter away, which is as far as rulers and tyres go, steps end in the same minimum
    /// (tests/command/misdeclared.rs).
    min_start_deviation: f64 = 0.22,
    /// Seconds. A clock that is seen to be farther off is taken off the stamps before the fit, and its rest
    /// is fitted.
    /// Budgeted: the fit of a latency from 0 ends at a smaller one (tests/command/bad_logs.rs).
    min_start_clock_s: f64 = 0.05,
    /// m/√m. Noise of recorded speeds from which on its bias is taken off.
    /// Budgeted: 1 mm/√m with poses of a millimetre ten times a second biases a separation by some 1e-4.
    min_rate_noise: f64 = 1e-3,
    /// Sensor heading, radians, beyond which the extrinsics are free from the first fit on.
    /// Less may be an error of a short log.
    /// Tuned: by hand; no record of what on.
    rotated_sensor_rad: f64 = 0.2,
    /// The same where windows of motion determine the drive.
    /// Tuned: on a tag turned by 3 to 10° and up to 150 ms late (tests/command/moved_instrument.rs): without
    /// its heading, the first fit did not converge.
    turned_sensor_rad: f64 = 0.05,
    /// Ratio of chord to distance below which a motion has no direction for the sensor's heading.
    /// Tuned: by hand; no record of what on.
    min_chord_ratio: f64 = 0.3,
    // The log's stretches.
    /// Length of a row, over the median, from which on it is a gap: no rate is taken across it.
    /// Budgeted: one lost row is bridged.
    gap_ratio: f64 = 2.5,
    /// Longest row within which the wheels' rates change steadily, seconds.
    /// Budgeted: robots speed up and stop in some tenths of a second; within a longer row they may do both.
    max_steady_row_s: f64 = 0.3,
    /// What stamps jitter by, as a share of a row, up to which rates go by them.
    /// Budgeted: a rate over three rows is then off by 2 %.
    max_exact_jitter: f64 = 0.05,
    /// Seconds that stamps jitter by where a file rounds them, at the most.
    /// Budgeted: milliseconds are off by 0.29 ms.
    max_rounding_s: f64 = 5e-4,
    /// Share of a row that stamps jitter by at the least for a log to have a beat that they are late against:
    /// rows of a slow log jitter by much less than 5 %, and displace the robot by more than an instrument
    /// errs.
    /// Convention: that of the sampling period.
    min_beat_jitter: f64 = 0.02,
    /// Variance that rounding adds to a pose, over that of a measurement, from which on distributions of
    /// tests are found by simulation.
    /// Budgeted: below it, a statistic's variance is off by a twentieth of its excess at
    /// the most.
    min_resimulated_variance_ratio: f64 = 0.05,
    /// Acceleration, m/s², by which a robot that stands between two counts may set off or stop.
    /// Budgeted: gentle for a robot; a count of 4 mm then takes 0.2 s, one of 0.01 mm 10 ms.
    gentle_acceleration_m_s2: f64 = 0.2,
    /// Rows to either side in which wheels change their speed as much as in a row.
    /// Budgeted: a mean square of eleven is known to two fifths.
    rows_of_change: usize = 5,
    /// Variance that rounding adds to a pose, over that of a measurement, below which it is left out.
    /// Budgeted: it changes a standard deviation by 0.05 %.
    min_rounding_variance_ratio: f64 = 1e-3,
    /// Farthest extrapolation beyond a log's first or last row, as a share of the interval there.
    /// Derived: beyond half an interval another row would have been written.
    max_extrapolation: f64 = 0.5,
    /// Window before a measurement, seconds, in which a change of speed counts for it.
    /// Tuned: by hand; no record of what on.
    speed_change_window_s: f64 = 0.5,
    /// Change of a wheel's speed that counts, as a share of the fastest in the segment.
    /// Tuned: by hand; no record of what on.
    speed_change_ratio: f64 = 0.2,
    /// Motion against the direction of travel, metres, that counts as a reversal.
    /// Tuned: by hand; above the counts of a standstill.
    reversal_m: f64 = 1e-3,
    // Outliers.
    /// Squared Mahalanobis distance of a measurement's innovation above which it is an outlier.
    /// Derived: χ² with three degrees of freedom at 1 − 1e-5.
    outlier_chi_square: f64 = 25.9,
    /// Score of the noise of instants, in standard deviations, above which it is fitted.
    /// Budgeted: one sound log in 30,000.
    min_timing_noise_sigmas: f64 = 4.0,
    /// Steps of that noise at the most, and its change, as a share of it, below which it has converged.
    /// Budgeted: a twentieth of a variance, a fortieth of a standard deviation, decides nothing.
    max_timing_noise_steps: usize = 5,
    /// As said above.
    /// Budgeted: as said above.
    timing_noise_tolerance: f64 = 0.05,
    /// Outliers in a row after which the filter restarts at the measurement: then the filter is wrong.
    /// Tuned: by hand; no record of what on.
    restart_after_outliers: u32 = 2,
    /// Share of the measured numbers that is fitted, from which on it is taken to take up a part of the
    /// scatter.
    /// Budgeted: of ten numbers a parameter the noise is known to a quarter, and a twentieth is left out.
    min_restricted_share: f64 = 0.1,
    // Whiteness; thinning has a file of its own.
    /// Largest lag, measurements, of the autocorrelation of displacements.
    /// Tuned: by hand; no record of what on.
    max_autocorrelation_lag: i32 = 5,
    /// Weight of a pair of displacements for each further measurement between them.
    /// Derived: autocorrelation that is worth finding lasts for about three displacements, e^(−1/3).
    autocorrelation_decay: f64 = 0.7,
    // Observability and covariance.
    /// Relative standard deviation of a direction of the geometry parameters above which it is unobservable.
    /// Convention: nominal values are better known than this.
    max_observable_sigma: f64 = 0.03,
    /// Relative. A model no farther from nominal along an unobservable direction is at nominal there.
    /// Derived: a hundredth of a thousandth of what a direction is unobservable by.
    max_nominal_deviation: f64 = 3e-7,
    /// How many runs the inverse information counts as beside those that show the scatter, beyond the
    /// parameters.
    /// Tuned: 1 and 3 on logs that share no code with the simulator (tests/diagnosis, seeds 720 to 743) and
    /// on `scenarios/ci.toml`. With 1 lengths of 7, 10 and 21 runs are off by 0.9 to 1.2 standard deviations,
    /// root mean square (0.9 to 1.2 with 3), and the 95 % interval of the wheel separation of ten runs covers
    /// it in 84 % (78 % with 3, 70 % by the information alone).
    information_weight_runs: f64 = 1.0,
    // Gauss–Newton and Fisher scoring.
    /// Median of χ² with one degree of freedom: scales the noise to the median of the squared innovations.
    /// Derived: Φ⁻¹(3/4)².
    chi_square_1_median: f64 = 0.454_936,
    /// Squared step of the mean over its variance below which it has converged.
    /// Budgeted: 1e-4 of a standard deviation, which no printed value shows.
    mean_step_tolerance: f64 = 1e-8,
    /// Step of a variance, as a share of it, below which the noise has converged.
    /// Budgeted: 5e-5 of a standard deviation of the noise, which no printed value shows.
    noise_step_tolerance: f64 = 1e-4,
    /// Squared step of the mean over its variance below which models may be compared by their likelihoods.
    /// Budgeted: the log-likelihood changes by half of it.
    mean_cost_tolerance: f64 = 1e-4,
    /// Squared step of the noise over its variance below which models may be compared by their likelihoods.
    /// Budgeted: the log-likelihood changes by half of it, 0.005.
    noise_cost_tolerance: f64 = 1e-2,
    /// Most steps of a fit.
    /// Tuned: by hand; no record of what on.
    max_fit_steps: usize = 60,
    /// Steps after the smallest one at which a fit that is compared ends as it is.
    /// Tuned: of 3717 fits of the blind benchmark 28 would have converged later; an eighth of all steps is
    /// saved.
    max_steps_without_progress: usize = 20,
    /// Fewest steps without the outlier gate, by which the noise is scaled before outliers are rejected.
    /// Tuned: by hand; no record of what on.
    min_ungated_steps: usize = 3,
    /// Most steps without the outlier gate, and most of a pass that start headings follow.
    /// Tuned: by hand; no record of what on.
    max_ungated_steps: usize = 20,
    /// Squared step of the mean over its variance below which the outlier gate may be closed.
    /// Convention: one standard deviation.
    gating_step: f64 = 1.0,
    /// Factor, and its inverse, by which a step without the gate may scale the variances.
    /// Tuned: by hand; no record of what on.
    max_noise_scaling: f64 = 1e6,
    /// Largest step of the logarithm of a geometry parameter.
    /// Convention: a drive that a step makes half or twice as large is none.
    max_geometry_step: f64 = 0.5,
    /// Largest step of the logarithm of a variance.
    /// Tuned: by hand; no record of what on.
    max_noise_step: f64 = 1.5,
    /// Factor of a variance's step after it changed its sign.
    /// Convention: halving.
    step_decrease: f64 = 0.5,
    /// Factor of a variance's step after it kept its sign, up to the whole step.
    /// Tuned: by hand; no record of what on.
    step_increase: f64 = 1.3,
    /// Squared step of the mean over its variance beyond which a fit has left its basin: ten standard
    /// deviations.
    /// Tuned: by hand; no record of what on.
    left_basin_step: f64 = 100.0,
    /// Damping of a Gauss–Newton step, as a share of each direction's information.
    /// Budgeted: it keeps steps finite, slows them by 1e-7, and moves no minimum.
    relative_damping: f64 = 1e-7,
    /// Damping of a Gauss–Newton step where nothing is known of a direction.
    /// Budgeted: a standard deviation of 3e4, far beyond any parameter.
    absolute_damping: f64 = 1e-9,
    // Cached propagation.
    /// Intervals of a phase in all from which on propagations are cached.
    /// Budgeted: about ten milliseconds of a pass.
    min_cached_intervals: usize = 100_000,
    /// Intervals of a propagation, on average, from which on propagations without terms are cached.
    /// Budgeted: integrating them then takes longer than all else in a pass. With terms, single intervals do.
    min_intervals_per_cached_propagation: usize = 3,
    /// Squared step of the mean over its variance below which cached propagations serve the next step.
    /// Budgeted: within one standard deviation propagations follow the model to first order.
    cached_step: f64 = 1.0,
    /// Squared distance of the model, over its variance, from that of cached propagations, at which they are
    /// final.
    /// Tuned: on long logs; at a distance of 0.02 integrating anew made a step of 5e-8.
    reuse_tolerance: f64 = 0.1,
    /// Squared step over its variance that ends a fit whose cached propagations, integrated anew, confirm it.
    /// Budgeted: the next step would be smaller by orders.
    confirming_step_tolerance: f64 = 1e-4,
    // Anderson acceleration.
    /// Differences of steps that Anderson's mixing uses.
    /// Tuned: by hand; no record of what on.
    anderson_depth: usize = 3,
    /// Largest ratio of a mixed step's length to that of the proposed one.
    /// Tuned: by hand; no record of what on.
    max_anderson_step_ratio: f64 = 10.0,
    /// Squared step of the mean over its variance below which steps are those of a linear map, and are mixed.
    /// Tuned: by hand; no record of what on.
    anderson_mean_step: f64 = 1.0,
    /// Step of the logarithm of a variance below which steps are those of a linear map, and are mixed.
    /// Tuned: by hand; the logarithm of a variance that is far too large falls by 1 a step.
    anderson_noise_step: f64 = 0.3,
    /// Squared step of the mean over its variance beyond which mixing has diverged.
    /// Tuned: by hand; no record of what on.
    anderson_diverged_mean_step: f64 = 10.0,
    /// Step of the logarithm of a variance beyond which mixing has diverged.
    /// Tuned: by hand; no record of what on.
    anderson_diverged_noise_step: f64 = 0.9,
    /// Divergences after which a fit goes on without mixing.
    /// Tuned: by hand; no record of what on.
    max_anderson_divergences: u32 = 2,
    /// Singular values of the differences' products, as a share of the largest diagonal, that count as zero.
    /// Budgeted: five orders above rounding.
    anderson_singular_value: f64 = 1e-10,
    // Decimated records.
    /// Factor by which decimation must reduce the intervals to be worth it.
    /// Tuned: by hand; no record of what on.
    min_decimation: usize = 2,
    /// Noncentrality Σδ², for innovations moved by δ standard deviations, below which decimated records
    /// serve.
    /// Budgeted: less than one measurement varies by chance.
    max_decimation_noncentrality: f64 = 1.0,
    // Profile likelihood.
    /// Relative error of the rise at which an end of an interval is found.
    /// Budgeted: a thousandth of the distance from the estimate.
    profile_rise_tolerance: f64 = 2e-3,
    /// Most steps to an end of an interval.
    /// Tuned: by hand; no record of what on.
    max_profile_steps: u32 = 30,
    /// Smallest rise that a step is judged by, as a share of the rise that is sought.
    /// Derived: steps outwards are by no more than a factor of two, the root of its inverse.
    min_profile_rise: f64 = 0.25,
    // One-step estimation of large datasets.
    /// Rows for each measurement beyond which large datasets are fitted as a whole.
    /// Budgeted: subsamples of the rows would hold too few measurements.
    max_rows_per_measurement: usize = 500,
    /// Measurements of the subsamples together.
    /// Derived: they determine a variance to 0.3 %, and an autocorrelation to 0.4 %.
    subsample_measurements: usize = 1 << 16,
    /// Most rows of the subsamples together, where measurements are few.
    /// Budgeted: a quarter of a gigabyte, at half a kilobyte a row.
    max_subsample_rows: usize = 1 << 19,
    /// Contiguous subsamples that the preliminary fit is made of.
    /// Derived: enough to be held out; more would be too short to be thinned, and to determine the geometry.
    subsamples: usize = 8,
    /// Step of a variance, as a share of it, at which the preliminary fit ends before whiteness is judged.
    /// Tuned: by hand; no record of what on.
    preliminary_noise_tolerance: f64 = 5e-2,
    /// Step of a variance, as a share of it, at which the fit of the subsamples ends.
    /// Budgeted: a third of what the subsamples determine a variance to.
    subsample_noise_tolerance: f64 = 1e-3,
    /// Fewest blocks of a part that is held at a time.
    /// Tuned: by hand; no record of what on.
    min_part_blocks: usize = 32,
    /// Fewest measurements of a part that is held at a time.
    /// Budgeted: at its cut a part loses one of them, 0.1 %.
    min_part_measurements: usize = 1000,
    /// Fewest thinned measurements of a part that is held at a time.
    /// Budgeted: at its cut a part loses one of them, 2 %.
    min_part_propagations: usize = 50,
    /// Most threads over the parts.
    /// Budgeted: each holds the memory of a part.
    max_part_threads: usize = 4,
    /// Squared step of a relative length or a heading over its standard deviation, at which one step is
    /// enough.
    /// Budgeted: the step errs by its square, a twentieth of a standard deviation.
    one_step_tolerance: f64 = 0.05,
    /// Most scoring steps over everything.
    /// Tuned: by hand; no record of what on.
    max_scoring_steps: usize = 5,
    /// Length of the part of a unit direction that must lie in the unobservable space for the space to be
    /// named after it.
    /// Convention: within 8° of the space.
    min_named_direction: f64 = 0.99,
    /// Length of what must be left of a unit direction beside those that the unobservable space is named
    /// after.
    /// Convention: more than 18° off them.
    min_own_direction: f64 = 0.3,
}

rules::rooms! {
    common: Common as COMMON,
    driving: driving::Driving as DRIVING,
    map: map::Map as MAP,
    nuisances: nuisances::Nuisances as NUISANCES,
    partial: partial::Partial as PARTIAL,
    poses_between_rows: poses_between_rows::PosesBetweenRows as POSES_BETWEEN_ROWS,
    recorded_rates: recorded_rates::RecordedRates as RECORDED_RATES,
    start_headings: start_headings::StartHeadings as START_HEADINGS,
    thinning: thinning::Spacing as THINNING,
    wheel_rates: wheel_rates::WheelRates as WHEEL_RATES,
}
