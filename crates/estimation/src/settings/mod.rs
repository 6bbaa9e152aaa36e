//! Every tolerance, threshold, limit and prior of the estimator: unit, meaning and source.
//!
//! The last sentence of a constant says where its value is from. `Derived:` follows from what is said.
//! `Budgeted:` is a share of an error, of time or of memory that is allowed. `Tuned:` is found by trial, on
//! what it says. `Convention:` is customary. `Published:` names author, year and equation.

mod driving;
mod map;
mod nuisances;
mod partial;
mod poses_between_rows;
mod recorded_rates;
mod start_headings;
mod thinning;
mod wheel_rates;

pub(crate) use driving::{CRUISE_QUANTILE, RISE_QUANTILE, RISE_SPEED_RATIOS};
pub(crate) use map::{
    GOLDEN_ANGLE_RAD, MAP_CELLS_PER_LENGTH, MAP_WAVES, MAX_MAP_CELLS, MAX_MAP_FUNCTIONS, MAX_MAP_REMAINDER,
};
pub(crate) use nuisances::{
    BLOCKS_PER_RUN, FOLDS, MAX_END_GROWTH_RATIO, MIN_HELD_OUT_GAIN_SIGMA, MIN_OUTLIER_REDUCTION, MIN_RUNS_TO_HOLD_OUT,
    MIN_THINNING_REDUCTION,
};
pub(crate) use partial::{
    BIAS_WALK_RADPS, GYRO_BIAS_SIGMA_RADPS, GYRO_SCALE_SIGMA, GYRO_WINDOW_S, LIDAR_PLACE_SIGMA_M, MAX_SEPARATION_SHARE,
    MIN_DISTANCE_M, MIN_GYRO_NOISE_RAD_PER_SQRT_S, MIN_STANDING_PAIRS, PARTIAL_OUTLIER_CHI_SQUARE,
    START_HEADING_SIGMA_RAD, START_POSITION_SIGMA_M, WALL_DIRECTION_SIGMA_RAD, WALL_OFFSET_SIGMA_M,
    WALL_START_DIRECTIONS, WALL_START_STEPS,
};
pub(crate) use poses_between_rows::{MAX_INTERPOLATED_VARIANCE_RATIO, MAX_SHARED_VARIANCE_RATIO, MIN_POSES_NEAR_ROWS};
pub(crate) use recorded_rates::{MAX_SHARED_RATES, MIN_COUNT_STEPS};
pub(crate) use start_headings::{
    DRIVE_PRIOR_SIGMA, DRIVE_STEP, DRIVE_STEPS, HEADING_STEP_TOLERANCE_RAD, MAX_WINDOW_SEPARATIONS,
    MIN_SENSOR_POSITION_CHI_SQUARE, MIN_WINDOW_POSITIONS, SENSOR_POSITION_STARTS, SENSOR_POSITION_STEPS,
    SENSOR_POSITION_TOLERANCE, START_HEADING_BASELINE_M, START_HEADING_PRECISION,
};
pub(crate) use thinning::{MIN_MEASUREMENTS_PER_RUN, SPACING_SLACK, THINNING_FACTOR, THINNING_PHASES};
pub(crate) use wheel_rates::{
    MAX_ROW_RATE_NOISE, MAX_ROW_SPREAD, MIN_PACKET_ROW_SHARE, MIN_ROW_SHARE, RATE_NOISE_FRACTION,
    RATE_ROUNDING_FRACTION, RATE_WINDOWS, ROWS_OF_STRETCH,
};

// Numbers of arithmetic.

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

// Noise: priors of the standard deviations, and their bounds.

/// Centre of the prior of a wheel's noise, m/√m.
/// Derived: geometric middle of 0.1 and 5 mm/√m, which Chong & Kleeman 1997 and the paper span.
pub(crate) const WHEEL_PRIOR_SIGMA: f64 = 7e-4;

/// Centre of the prior of the turn noise, rad/√rad.
/// Tuned: by hand; no record of what on.
pub(crate) const TURN_PRIOR_SIGMA: f64 = 1e-3;

/// Centre of the prior of a measured coordinate's standard deviation, metres, where the dataset states none.
/// Convention: instruments err by tenths of a millimetre to centimetres.
pub(crate) const POSITION_PRIOR_SIGMA_M: f64 = 1e-3;

/// Centre of the prior of a measured heading's standard deviation, radians, where the dataset states none.
/// Tuned: by hand; no record of what on.
pub(crate) const HEADING_PRIOR_SIGMA_RAD: f64 = 3e-3;

/// Standard deviation of ln σ under the prior where nothing is stated: a factor of e² either way.
/// Budgeted: the prior is worth less than one run of data, and separates what endpoints alone cannot.
pub(crate) const NOISE_PRIOR_LOG_SIGMA: f64 = 2.0;

/// Standard deviation of ln σ where the dataset states σ: a factor of two either way.
/// Convention: instruments are sold by their best.
pub(crate) const STATED_NOISE_LOG_SIGMA: f64 = 0.7;

/// Smallest standard deviation of any noise: m/√m, rad/√rad, m, rad.
/// Convention: no instrument, and no wheel, is better than a micrometre and a microradian.
pub(crate) const MIN_NOISE_SIGMA: f64 = 1e-6;

/// Standard deviation of ln σ of a noise that is fixed.
/// Budgeted: one per cent of it.
pub(crate) const FIXED_NOISE_LOG_SIGMA: f64 = 0.01;

// The instrument: what its groups may differ by, and when it counts as turned.

/// Prior standard deviation of a group's sensor position about the common one, metres.
/// Convention: a marker that is taken off and put back sits elsewhere by less than a hand's breadth.
pub(crate) const EXTRINSICS_PRIOR_SIGMA_M: f64 = 0.05;

/// Prior standard deviation of a group's sensor heading about the common one, radians.
/// Convention: a marker is put back with a turn that one does not see.
pub(crate) const EXTRINSICS_PRIOR_SIGMA_RAD: f64 = 0.1;

/// Prior standard deviation of a group's latency about the common one, seconds.
/// Convention: clocks are set to a tenth of a second.
pub(crate) const LATENCY_PRIOR_SIGMA_S: f64 = 0.1;

/// A group's column is observable when its posterior standard deviation is below this share of the prior one.
/// Tuned: by hand; no record of what on.
pub(crate) const MAX_POSTERIOR_TO_PRIOR_SIGMA: f64 = 0.5;

/// Relative. A stated length that is farther from what the windows of motion show is not where a fit starts.
/// Budgeted: from a quarter away, which is as far as rulers and tyres go, steps end in the same minimum
/// (tests/command/misdeclared.rs).
pub(crate) const MIN_START_DEVIATION: f64 = 0.22;

/// Seconds. A clock that is seen to be farther off is taken off the stamps before the fit, and its rest is
/// fitted.
/// Budgeted: the fit of a latency from 0 ends at a smaller one (tests/command/bad_logs.rs).
pub(crate) const MIN_START_CLOCK_S: f64 = 0.05;

/// Sensor heading, radians, beyond which the extrinsics are free from the first fit on.
/// Less may be an error of a short log.
/// Tuned: by hand; no record of what on.
pub(crate) const ROTATED_SENSOR_RAD: f64 = 0.2;

/// The same where windows of motion determine the drive.
/// Tuned: on a tag turned by 3 to 10° and up to 150 ms late (tests/command/moved_instrument.rs): without its
/// heading, the first fit did not converge.
pub(crate) const TURNED_SENSOR_RAD: f64 = 0.05;

/// Ratio of chord to distance below which a motion has no direction for the sensor's heading.
/// Tuned: by hand; no record of what on.
pub(crate) const MIN_CHORD_RATIO: f64 = 0.3;

// The log's stretches.

/// Length of a row, over the median, from which on it is a gap: no rate is taken across it.
/// Budgeted: one lost row is bridged.
pub(crate) const GAP_RATIO: f64 = 2.5;

/// Longest row within which the wheels' rates change steadily, seconds.
/// Budgeted: robots speed up and stop in some tenths of a second; within a longer row they may do both.
pub(crate) const MAX_STEADY_ROW_S: f64 = 0.3;

/// Steps of an angle below this, radians, are rounding of the file's numbers and no counts.
/// Budgeted: files with six decimals round by half of 1e-6, and a step twice.
pub(crate) const QUANTUM_TOLERANCE: f64 = 3e-6;

/// Counts of angles below this, radians, are as good as exact.
/// Budgeted: 200 000 counts a turn; on a wheel of 80 mm, 2.5 µm.
pub(crate) const MIN_QUANTUM_RAD: f64 = 3e-5;

/// What stamps jitter by, as a share of a row, up to which rates go by them.
/// Budgeted: a rate over three rows is then off by 2 %.
pub(crate) const MAX_EXACT_JITTER: f64 = 0.05;

/// Seconds that stamps jitter by where a file rounds them, at the most.
/// Budgeted: milliseconds are off by 0.29 ms.
pub(crate) const MAX_ROUNDING_S: f64 = 5e-4;

/// Share of a row that stamps jitter by at the least for a log to have a beat that they are late against:
/// rows of a slow log jitter by much less than 5 %, and displace the robot by more than an instrument errs.
/// Convention: that of the sampling period.
pub(crate) const MIN_BEAT_JITTER: f64 = 0.02;

/// Steps that must be there before angles are taken for counts.
/// Budgeted: chance does not put 98 of 100 on a grid.
pub(crate) const MIN_GRID_STEPS: usize = 100;

/// Share of steps that are multiples of the smallest one, from which on angles are counts.
/// Budgeted: chance has a tenth of them within a twentieth.
pub(crate) const MIN_GRID_FRACTION: f64 = 0.98;

/// Variance that rounding adds to a pose, over that of a measurement, from which on distributions of tests
/// are found by simulation.
/// Budgeted: below it, a statistic's variance is off by a twentieth of its excess at
/// the most.
pub(crate) const MIN_RESIMULATED_VARIANCE_RATIO: f64 = 0.05;

/// Acceleration, m/s², by which a robot that stands between two counts may set off or stop.
/// Budgeted: gentle for a robot; a count of 4 mm then takes 0.2 s, one of 0.01 mm 10 ms.
pub(crate) const GENTLE_ACCELERATION_M_S2: f64 = 0.2;

/// Rows to either side in which wheels change their speed as much as in a row.
/// Budgeted: a mean square of eleven is known to two fifths.
pub(crate) const ROWS_OF_CHANGE: usize = 5;

/// Variance that rounding adds to a pose, over that of a measurement, below which it is left out.
/// Budgeted: it changes a standard deviation by 0.05 %.
pub(crate) const MIN_ROUNDING_VARIANCE_RATIO: f64 = 1e-3;

/// Farthest extrapolation beyond a log's first or last row, as a share of the interval there.
/// Derived: beyond half an interval another row would have been written.
pub(crate) const MAX_EXTRAPOLATION: f64 = 0.5;

/// Window before a measurement, seconds, in which a change of speed counts for it.
/// Tuned: by hand; no record of what on.
pub(crate) const SPEED_CHANGE_WINDOW_S: f64 = 0.5;

/// Change of a wheel's speed that counts, as a share of the fastest in the segment.
/// Tuned: by hand; no record of what on.
pub(crate) const SPEED_CHANGE_RATIO: f64 = 0.2;

/// Motion against the direction of travel, metres, that counts as a reversal.
/// Tuned: by hand; above the counts of a standstill.
pub(crate) const REVERSAL_M: f64 = 1e-3;

// Outliers.

/// Squared Mahalanobis distance of a measurement's innovation above which it is an outlier.
/// Derived: χ² with three degrees of freedom at 1 − 1e-5.
pub(crate) const OUTLIER_CHI_SQUARE: f64 = 25.9;

/// Score of the noise of instants, in standard deviations, above which it is fitted.
/// Budgeted: one sound log in 30,000.
pub(crate) const MIN_TIMING_NOISE_SIGMAS: f64 = 4.0;

/// Steps of that noise at the most, and its change, as a share of it, below which it has converged.
/// Budgeted: a twentieth of a variance, a fortieth of a standard deviation, decides nothing.
pub(crate) const MAX_TIMING_NOISE_STEPS: usize = 5;
/// As said above.
/// Budgeted: as said above.
pub(crate) const TIMING_NOISE_TOLERANCE: f64 = 0.05;

/// Outliers in a row after which the filter restarts at the measurement: then the filter is wrong.
/// Tuned: by hand; no record of what on.
pub(crate) const RESTART_AFTER_OUTLIERS: u32 = 2;

/// Share of the measured numbers that is fitted, from which on it is taken to take up a part of the scatter.
/// Budgeted: of ten numbers a parameter the noise is known to a quarter, and a twentieth is left out.
pub(crate) const MIN_RESTRICTED_SHARE: f64 = 0.1;

// Whiteness; thinning has a file of its own.

/// Autocorrelation of the innovations, standard errors, below which they count as white.
/// Derived: two-sided level of 1 % over three components together, Φ⁻¹(1 − 0.01/6).
pub const WHITENESS_Z: f64 = 2.935;

/// Largest lag, measurements, of the autocorrelation of displacements.
/// Tuned: by hand; no record of what on.
pub(crate) const MAX_AUTOCORRELATION_LAG: i32 = 5;

/// Weight of a pair of displacements for each further measurement between them.
/// Derived: autocorrelation that is worth finding lasts for about three displacements, e^(−1/3).
pub(crate) const AUTOCORRELATION_DECAY: f64 = 0.7;

// Observability and covariance.

/// Relative standard deviation of a direction of the geometry parameters above which it is unobservable.
/// Convention: nominal values are better known than this.
pub(crate) const MAX_OBSERVABLE_SIGMA: f64 = 0.03;

/// Relative. A model no farther from nominal along an unobservable direction is at nominal there.
/// Derived: a hundredth of a thousandth of what a direction is unobservable by.
pub(crate) const MAX_NOMINAL_DEVIATION: f64 = 3e-7;

/// How many runs the inverse information counts as beside those that show the scatter, beyond the parameters.
/// Tuned: 1 and 3 on logs that share no code with the simulator (tests/diagnosis, seeds 720 to 743) and on
/// `scenarios/ci.toml`. With 1 lengths of 7, 10 and 21 runs are off by 0.9 to 1.2 standard deviations, root
/// mean square (0.9 to 1.2 with 3), and the 95 % interval of the wheel separation of ten runs covers it in 84
/// % (78 % with 3, 70 % by the information alone).
pub(crate) const INFORMATION_WEIGHT_RUNS: f64 = 1.0;

// Gauss–Newton and Fisher scoring.

/// Median of χ² with one degree of freedom: scales the noise to the median of the squared innovations.
/// Derived: Φ⁻¹(3/4)².
pub(crate) const CHI_SQUARE_1_MEDIAN: f64 = 0.454_936;

/// Squared step of the mean over its variance below which it has converged.
/// Budgeted: 1e-4 of a standard deviation, which no printed value shows.
pub(crate) const MEAN_STEP_TOLERANCE: f64 = 1e-8;

/// Step of a variance, as a share of it, below which the noise has converged.
/// Budgeted: 5e-5 of a standard deviation of the noise, which no printed value shows.
pub(crate) const NOISE_STEP_TOLERANCE: f64 = 1e-4;

/// Squared step of the mean over its variance below which models may be compared by their likelihoods.
/// Budgeted: the log-likelihood changes by half of it.
pub(crate) const MEAN_COST_TOLERANCE: f64 = 1e-4;

/// Squared step of the noise over its variance below which models may be compared by their likelihoods.
/// Budgeted: the log-likelihood changes by half of it, 0.005.
pub(crate) const NOISE_COST_TOLERANCE: f64 = 1e-2;

/// Most steps of a fit.
/// Tuned: by hand; no record of what on.
pub(crate) const MAX_FIT_STEPS: usize = 60;

/// Steps after the smallest one at which a fit that is compared ends as it is.
/// Tuned: of 3717 fits of the blind benchmark 28 would have converged later; an eighth of all steps is saved.
pub(crate) const MAX_STEPS_WITHOUT_PROGRESS: usize = 20;

/// Fewest steps without the outlier gate, by which the noise is scaled before outliers are rejected.
/// Tuned: by hand; no record of what on.
pub(crate) const MIN_UNGATED_STEPS: usize = 3;

/// Most steps without the outlier gate, and most of a pass that start headings follow.
/// Tuned: by hand; no record of what on.
pub(crate) const MAX_UNGATED_STEPS: usize = 20;

/// Squared step of the mean over its variance below which the outlier gate may be closed.
/// Convention: one standard deviation.
pub(crate) const GATING_STEP: f64 = 1.0;

/// Factor, and its inverse, by which a step without the gate may scale the variances.
/// Tuned: by hand; no record of what on.
pub(crate) const MAX_NOISE_SCALING: f64 = 1e6;

/// Largest step of the logarithm of a geometry parameter.
/// Convention: a drive that a step makes half or twice as large is none.
pub(crate) const MAX_GEOMETRY_STEP: f64 = 0.5;

/// Largest step of the logarithm of a variance.
/// Tuned: by hand; no record of what on.
pub(crate) const MAX_NOISE_STEP: f64 = 1.5;

/// Factor of a variance's step after it changed its sign.
/// Convention: halving.
pub(crate) const STEP_DECREASE: f64 = 0.5;

/// Factor of a variance's step after it kept its sign, up to the whole step.
/// Tuned: by hand; no record of what on.
pub(crate) const STEP_INCREASE: f64 = 1.3;

/// Squared step of the mean over its variance beyond which a fit has left its basin: ten standard deviations.
/// Tuned: by hand; no record of what on.
pub(crate) const LEFT_BASIN_STEP: f64 = 100.0;

/// Damping of a Gauss–Newton step, as a share of each direction's information.
/// Budgeted: it keeps steps finite, slows them by 1e-7, and moves no minimum.
pub(crate) const RELATIVE_DAMPING: f64 = 1e-7;

/// Damping of a Gauss–Newton step where nothing is known of a direction.
/// Budgeted: a standard deviation of 3e4, far beyond any parameter.
pub(crate) const ABSOLUTE_DAMPING: f64 = 1e-9;

// Cached propagation.

/// Intervals of a phase in all from which on propagations are cached.
/// Budgeted: about ten milliseconds of a pass.
pub(crate) const MIN_CACHED_INTERVALS: usize = 100_000;

/// Intervals of a propagation, on average, from which on propagations without terms are cached.
/// Budgeted: integrating them then takes longer than all else in a pass. With terms, single intervals do.
pub(crate) const MIN_INTERVALS_PER_CACHED_PROPAGATION: usize = 3;

/// Squared step of the mean over its variance below which cached propagations serve the next step.
/// Budgeted: within one standard deviation propagations follow the model to first order.
pub(crate) const CACHED_STEP: f64 = 1.0;

/// Squared distance of the model, over its variance, from that of cached propagations, at which they are
/// final.
/// Tuned: on long logs; at a distance of 0.02 integrating anew made a step of 5e-8.
pub(crate) const REUSE_TOLERANCE: f64 = 0.1;

/// Squared step over its variance that ends a fit whose cached propagations, integrated anew, confirm it.
/// Budgeted: the next step would be smaller by orders.
pub(crate) const CONFIRMING_STEP_TOLERANCE: f64 = 1e-4;

// Anderson acceleration.

/// Differences of steps that Anderson's mixing uses.
/// Tuned: by hand; no record of what on.
pub(crate) const ANDERSON_DEPTH: usize = 3;

/// Largest ratio of a mixed step's length to that of the proposed one.
/// Tuned: by hand; no record of what on.
pub(crate) const MAX_ANDERSON_STEP_RATIO: f64 = 10.0;

/// Squared step of the mean over its variance below which steps are those of a linear map, and are mixed.
/// Tuned: by hand; no record of what on.
pub(crate) const ANDERSON_MEAN_STEP: f64 = 1.0;

/// Step of the logarithm of a variance below which steps are those of a linear map, and are mixed.
/// Tuned: by hand; the logarithm of a variance that is far too large falls by 1 a step.
pub(crate) const ANDERSON_NOISE_STEP: f64 = 0.3;

/// Squared step of the mean over its variance beyond which mixing has diverged.
/// Tuned: by hand; no record of what on.
pub(crate) const ANDERSON_DIVERGED_MEAN_STEP: f64 = 10.0;

/// Step of the logarithm of a variance beyond which mixing has diverged.
/// Tuned: by hand; no record of what on.
pub(crate) const ANDERSON_DIVERGED_NOISE_STEP: f64 = 0.9;

/// Divergences after which a fit goes on without mixing.
/// Tuned: by hand; no record of what on.
pub(crate) const MAX_ANDERSON_DIVERGENCES: u32 = 2;

/// Singular values of the differences' products, as a share of the largest diagonal, that count as zero.
/// Budgeted: five orders above rounding.
pub(crate) const ANDERSON_SINGULAR_VALUE: f64 = 1e-10;

// Decimated records.

/// Factor by which decimation must reduce the intervals to be worth it.
/// Tuned: by hand; no record of what on.
pub(crate) const MIN_DECIMATION: usize = 2;

/// Noncentrality Σδ², for innovations moved by δ standard deviations, below which decimated records serve.
/// Budgeted: less than one measurement varies by chance.
pub(crate) const MAX_DECIMATION_NONCENTRALITY: f64 = 1.0;

// Profile likelihood.

/// Rise of the cost at the ends of a 95 % profile interval.
/// Derived: half of χ² with one degree of freedom at 95 %.
pub const RISE_95: f64 = 1.920_729;

/// Relative error of the rise at which an end of an interval is found.
/// Budgeted: a thousandth of the distance from the estimate.
pub(crate) const PROFILE_RISE_TOLERANCE: f64 = 2e-3;

/// Most steps to an end of an interval.
/// Tuned: by hand; no record of what on.
pub(crate) const MAX_PROFILE_STEPS: u32 = 30;

/// Smallest rise that a step is judged by, as a share of the rise that is sought.
/// Derived: steps outwards are by no more than a factor of two, the root of its inverse.
pub(crate) const MIN_PROFILE_RISE: f64 = 0.25;

// One-step estimation of large datasets.

/// Rows of odometry and measurements together beyond which a dataset is large.
/// Budgeted: a whole fit of as many takes a hundred passes, and half a kilobyte a row.
pub const LARGE_ROWS: usize = 500_000;

/// Rows for each measurement beyond which large datasets are fitted as a whole.
/// Budgeted: subsamples of the rows would hold too few measurements.
pub(crate) const MAX_ROWS_PER_MEASUREMENT: usize = 500;

/// Measurements of the subsamples together.
/// Derived: they determine a variance to 0.3 %, and an autocorrelation to 0.4 %.
pub(crate) const SUBSAMPLE_MEASUREMENTS: usize = 1 << 16;

/// Most rows of the subsamples together, where measurements are few.
/// Budgeted: a quarter of a gigabyte, at half a kilobyte a row.
pub(crate) const MAX_SUBSAMPLE_ROWS: usize = 1 << 19;

/// Contiguous subsamples that the preliminary fit is made of.
/// Derived: enough to be held out; more would be too short to be thinned, and to determine the geometry.
pub(crate) const SUBSAMPLES: usize = 8;

/// Step of a variance, as a share of it, at which the preliminary fit ends before whiteness is judged.
/// Tuned: by hand; no record of what on.
pub(crate) const PRELIMINARY_NOISE_TOLERANCE: f64 = 5e-2;

/// Step of a variance, as a share of it, at which the fit of the subsamples ends.
/// Budgeted: a third of what the subsamples determine a variance to.
pub(crate) const SUBSAMPLE_NOISE_TOLERANCE: f64 = 1e-3;

/// Fewest blocks of a part that is held at a time.
/// Tuned: by hand; no record of what on.
pub(crate) const MIN_PART_BLOCKS: usize = 32;

/// Fewest measurements of a part that is held at a time.
/// Budgeted: at its cut a part loses one of them, 0.1 %.
pub(crate) const MIN_PART_MEASUREMENTS: usize = 1000;

/// Fewest thinned measurements of a part that is held at a time.
/// Budgeted: at its cut a part loses one of them, 2 %.
pub(crate) const MIN_PART_PROPAGATIONS: usize = 50;

/// Most threads over the parts.
/// Budgeted: each holds the memory of a part.
pub(crate) const MAX_PART_THREADS: usize = 4;

/// Squared step of a relative length or a heading over its standard deviation, at which one step is enough.
/// Budgeted: the step errs by its square, a twentieth of a standard deviation.
pub(crate) const ONE_STEP_TOLERANCE: f64 = 0.05;

/// Most scoring steps over everything.
/// Tuned: by hand; no record of what on.
pub(crate) const MAX_SCORING_STEPS: usize = 5;

/// Length of the part of a unit direction that must lie in the unobservable space for the space to be named
/// after it.
/// Convention: within 8° of the space.
pub(crate) const MIN_NAMED_DIRECTION: f64 = 0.99;

/// Length of what must be left of a unit direction beside those that the unobservable space is named after.
/// Convention: more than 18° off them.
pub(crate) const MIN_OWN_DIRECTION: f64 = 0.3;
