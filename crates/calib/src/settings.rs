//! Every tolerance, threshold, limit and prior of the calibration methods: unit, meaning and source.
//!
//! The last sentence of a constant says where its value is from. `Derived:` follows from what is said.
//! `Budgeted:` is a share of an error, of time or of memory that is allowed. `Tuned:` is found by trial, on
//! what it says. `Convention:` is customary. `Published:` names author, year and equation.

use std::f64::consts::{FRAC_PI_2, PI};

// All methods.

/// Instants that differ by less, seconds, are the same: files round times.
/// Budgeted: the rounding of a file's times; at 10 m/s it is 10 nm.
pub(crate) const TIME_TOLERANCE_S: f64 = 1e-9;

/// Share of a run's distance whose positions say where it starts, and how it is turned there, where headings
/// were not measured.
/// Convention: a tenth.
pub(crate) const START_SHARE: f64 = 0.1;

/// Least number of positions that do so.
/// Convention: one more than a line needs.
pub(crate) const MIN_START_POSITIONS: usize = 3;

/// Largest size of a calibration file, bytes.
/// Budgeted: a thousand times the size of such a file; anything larger is another file.
pub(crate) const MAX_FILE_BYTES: u64 = 1 << 20;

/// Places that differ by less, metres, are the same.
/// Budgeted: rounding over 10⁷ rows at 100 m from the origin adds up to 0.1 µm.
pub(crate) const SAME_PLACE_M: f64 = 1e-6;

/// Ratio of a wheel's diameter to its nominal value, or the inverse, beyond which a remark is made.
/// Convention: wheels are known to a few per cent.
pub(crate) const MAX_PLAUSIBLE_DIAMETER_RATIO: f64 = 1.3;

/// Ratio of a calibrated wheel's diameter to that which an evaluated dataset states, or the inverse, beyond
/// which the calibration may be of another robot.
/// Convention: wheels are known to a few per cent; a correction of a tenth is rare.
pub(crate) const MAX_EVALUATED_DIAMETER_RATIO: f64 = 1.1;

/// As for wheels, of the wheel separation.
/// Convention: effective separations of robots that do not skid are within some per cent of nominal.
pub(crate) const MAX_EVALUATED_SEPARATION_RATIO: f64 = 1.25;

/// Ratio of the wheel separation to its nominal value, or the inverse, beyond which it is no correction.
/// Convention: skid steering makes the effective separation 1.5 to 2.5 times as large, 4 at the most.
pub(crate) const MAX_PLAUSIBLE_SEPARATION_RATIO: f64 = 4.0;

/// Ratio of a length to its nominal value, or the inverse, beyond which it is remarked.
/// Convention: rulers are good to a tenth; only skidding, or another formula, makes more of a separation.
pub(crate) const MAX_UNREMARKED_RATIO: f64 = 1.25;

/// Radians. Turning of all runs below which they hardly turn.
/// Convention: half a turn.
pub(crate) const MIN_TURNING_RAD: f64 = 3.0;

/// Metres. Distance of all runs below which they only turn on the spot.
/// Convention: two wheel separations of a small robot.
pub(crate) const MIN_DISTANCE_M: f64 = 0.5;

/// Share of the turning that goes the other way, below which all turns go one way.
/// Budgeted: steering on the way is a twentieth.
pub(crate) const MAX_OTHER_WAY: f64 = 0.05;

/// Rows of datasets to which `check` fits the drive, at the most.
/// Budgeted: some seconds of two cores.
pub(crate) const MAX_CHECKED_ROWS: usize = 200_000;

/// Runs of datasets to which `check` fits the drive, at the most.
/// Budgeted: as for rows; a fit of many short runs takes as long.
pub(crate) const MAX_CHECKED_RUNS: usize = 2_000;

/// Metres. An instrument that a fit of the evaluated runs finds nearer to the drive's centre is at it.
/// Convention: a tag is mounted to two centimetres by eye; evo and published drifts take it to be at the
/// centre.
pub(crate) const MIN_LEVER_M: f64 = 0.02;

/// Radians. An instrument that is turned by less looks ahead.
/// Convention: as for its place, a degree by eye.
pub(crate) const MIN_YAW_RAD: f64 = 0.02;

/// Standard deviations by which instruments of two sessions differ for certain.
/// Convention: one pair in 400 by chance.
pub(crate) const MIN_MOVED_SIGMAS: f64 = 3.0;

/// Standard deviations by which distance lost in turns is seen.
/// Convention: 95 %.
pub(crate) const MIN_TURN_LOSS_SIGMAS: f64 = 2.0;

/// Least component of a unit direction in relative left wheel, right wheel and separation that is the common
/// scale.
/// Tuned: by hand; about half of 1/√3, which each has where all three grow alike.
pub(crate) const MIN_COMMON_SCALE_COMPONENT: f64 = 0.3;

/// Turn of a spin, radians, below which it determines no wheelbase, as its sign is not sure.
/// Tuned: by hand; no record of what on.
pub(crate) const MIN_SPIN_RAD: f64 = 0.5;

// Outliers (`robust.rs`).

/// Standard deviation of a normal variable over its median absolute deviation.
/// Derived: 1/Φ⁻¹(3/4).
pub(crate) const MAD_TO_SIGMA: f64 = 1.482_602_218_505_602;

/// Robust standard deviations from the median beyond which a value is an outlier.
/// Published: Iglewicz & Hoaglin 1993; a normal value exceeds it about once in 2000.
pub(crate) const MAD_CUT: f64 = 3.5;

/// Fewest values of which any may be an outlier.
/// Tuned: by hand; no record of what on.
pub(crate) const MIN_VALUES_FOR_OUTLIERS: usize = 5;

// `direct`.

/// Distance of a mark from the axle's line, metres, beyond which (6) does not hold.
/// Budgeted: a turn of 2° shifts the chord by 0.003 mm.
pub(crate) const MAX_MARK_OFFSET_M: f64 = 5e-3;

// `ivanjko`.

/// Most rounds of the two steps.
/// Budgeted: ten times the handful that they take.
pub(crate) const IVANJKO_MAX_ROUNDS: u32 = 50;

/// Relative change of a parameter in a round below which the steps have converged.
/// Budgeted: four orders above rounding.
pub(crate) const IVANJKO_TOLERANCE: f64 = 1e-12;

// `circular`.

/// Turn of an arc between two readings, radians, at least: a quarter turn.
/// Budgeted: rounding and a wrong wheelbase may take a tenth off it.
pub(crate) const MIN_ARC_RAD: f64 = 1.4;

/// |sin Θ/2| of an arc at least.
/// Derived: turns of 60° to 300°; an arc that nearly closes determines no radius.
pub(crate) const MIN_ARC_SINE: f64 = 0.5;

/// Difference of the wheels' ratio between the halves of an arc, as a share of it, at most.
/// Budgeted: twice the rounding of a coarse counter, 1 mm on 100 mm of the inner wheel.
pub(crate) const MAX_RATIO_CHANGE: f64 = 0.02;

/// Most steps of Gauss–Newton.
/// Budgeted: ten times the three that it takes.
pub(crate) const CIRCULAR_MAX_STEPS: u32 = 30;

/// Relative step of a parameter below which Gauss–Newton has converged.
/// Budgeted: three orders above rounding.
pub(crate) const CIRCULAR_TOLERANCE: f64 = 1e-13;

// `linear`.

/// 1 − |cosine| of the angle between two regressors below which they are collinear.
/// Derived: the wheels' turns differ by less than 1.4 % of themselves over all runs.
pub(crate) const COLLINEARITY_TOLERANCE: f64 = 1e-4;

/// Distance of a path's end from its start, as a share of the wheels' distance, below which it is closed.
/// Tuned: by hand; no record of what on.
pub(crate) const CLOSED_PATH_RATIO: f64 = 0.05;

/// Relative step of central differences of the paths by the result of step 1.
/// Derived: truncation of order h², 1e-8, of a smooth function.
pub(crate) const DIFFERENCE_STEP: f64 = 1e-4;

// `tachometer`.

/// Turn of a wheel, radians, below which a run determines nothing: its end is interpolated between two rows.
/// Tuned: by hand; no record of what on.
pub(crate) const MIN_WHEEL_TURN_RAD: f64 = 1.0;

/// Time between rows of the log, in intervals of the reference, at most.
/// Tuned: by hand; no record of what on.
pub(crate) const MAX_ROW_INTERVAL_RATIO: f64 = 2.0;

// `censi`.

/// Rounds of trimming.
/// Published: Censi, Franchi, Marchionni & Oriolo 2013, their program.
pub(crate) const TRIMMING_ROUNDS: u32 = 4;

/// Share of the displacements that each round drops, by position and by heading.
/// Published: Censi, Franchi, Marchionni & Oriolo 2013, their program.
pub(crate) const TRIMMED_SHARE: f64 = 0.01;

/// Distance of the nominal robot, metres, after which the next of two poses makes a displacement.
/// Tuned: by hand; no record of what on.
pub(crate) const DISPLACEMENT_DISTANCE_M: f64 = 1.5;

/// Turn of the nominal robot, radians, after which the next of two poses makes a displacement: three
/// quarters.
/// Tuned: by hand; no record of what on.
pub(crate) const DISPLACEMENT_TURN_RAD: f64 = 3.0 * FRAC_PI_2;

/// Condition of normal equations, with their diagonal scaled to one, beyond which nothing is solved.
/// Derived: roundings of 1e-16 leave four digits of the solution.
pub(crate) const MAX_NORMAL_CONDITION: f64 = 1e12;

/// Ratio of the extreme eigenvalues of Σ Φ Φᵀ beyond which the wheels' turns are of one proportion.
/// Published: Censi, Franchi, Marchionni & Oriolo 2013, their program's "not very exciting data".
pub(crate) const MAX_TURN_CONDITION: f64 = 75.0;

/// Ratio of the extreme eigenvalues for separation and sensor position beyond which they are unobservable.
/// Derived: a position that is known a hundred times worse than the separation is of little use.
pub(crate) const MAX_POSITION_CONDITION: f64 = 1e4;

/// Ratio of the costs of the two stationary solutions below which the sensor's heading is unobservable.
/// Tuned: by hand; no record of what on.
pub(crate) const MIN_COST_RATIO: f64 = 4.0;

/// Component of the strong direction of the wheels' turns, off (1, 1) or (1, −1), that still is straight or a
/// spin.
/// Derived: an eighth of a right angle, √2 sin(π/16), rounded up.
pub(crate) const MAX_PROPORTION_OFFSET: f64 = 0.3;

/// Smallest standard deviation of a displacement, metres and radians.
/// Budgeted: a picometre is rounding.
pub(crate) const MIN_DISPLACEMENT_SIGMA: f64 = 1e-12;

// `segments`.

/// Length of a segment by the nominal robot, metres.
/// Published: Sousa, Petry, Costa et al. 2022 (OptiOdom), their program.
pub(crate) const SEGMENT_M: f64 = 0.5;

/// Weight of a heading error, metres a radian, beside a position error.
/// Derived: the length of a segment, over which the heading error makes a position error.
pub(crate) const HEADING_WEIGHT_M: f64 = 0.5;

/// Sensitivity of the path to a relative change of the geometry, over that of the best direction, at least.
/// Tuned: by hand; no record of what on.
pub(crate) const MIN_SENSITIVITY: f64 = 1e-3;

// `augmented_kalman`.

/// Prior standard deviation of the factors on diameters and separation.
/// Tuned: by hand; no record of what on.
pub(crate) const FACTOR_PRIOR_SIGMA: f64 = 0.05;

/// First guess of a wheel's noise, m/√m.
/// Tuned: by hand; no record of what on.
pub(crate) const WHEEL_SIGMA_GUESS: f64 = 1e-3;

/// First guess of the standard deviation of a measured coordinate, metres, where none is stated.
/// Tuned: by hand; no record of what on.
pub(crate) const POSITION_SIGMA_GUESS_M: f64 = 1e-3;

/// First guess of the standard deviation of a measured heading, radians, where none is stated.
/// Tuned: by hand; no record of what on.
pub(crate) const HEADING_SIGMA_GUESS_RAD: f64 = 2e-3;

/// Distance of the nominal robot between measurements, metres.
/// Tuned: by hand; no record of what on.
pub(crate) const MEASUREMENT_SPACING_M: f64 = 1.0;

/// Turn of the nominal robot between measurements, radians.
/// Tuned: by hand; no record of what on.
pub(crate) const MEASUREMENT_SPACING_RAD: f64 = PI;

/// Change of a factor in a pass, in its standard deviation, below which the passes have converged.
/// Budgeted: a hundredth of a standard deviation.
pub(crate) const PASS_TOLERANCE: f64 = 0.01;

/// Change of the logarithm of a variance in a pass below which the passes have converged.
/// Derived: twice that of a factor: the logarithm of a variance is twice that of a standard deviation.
pub(crate) const PASS_NOISE_TOLERANCE: f64 = 2.0 * PASS_TOLERANCE;

/// Most passes.
/// Tuned: by hand; no record of what on.
pub(crate) const MAX_PASSES: u32 = 60;

/// Posterior over prior standard deviation of a factor beyond which it is unobservable.
/// Tuned: by hand; no record of what on.
pub(crate) const MAX_POSTERIOR_TO_PRIOR_SIGMA: f64 = 0.3;

/// Weight of the first guess of a variance, in measurements.
/// Convention: that of a single measurement.
pub(crate) const NOISE_PRIOR_MEASUREMENTS: f64 = 1.0;

/// Factor, and its inverse, by which a variance may differ from its first guess.
/// Budgeted: wide enough for any robot; it keeps variances positive.
pub(crate) const MAX_NOISE_FACTOR: f64 = 1e6;

/// Largest step of the logarithm of a variance.
/// Tuned: by hand; no record of what on.
pub(crate) const MAX_NOISE_STEP: f64 = 2.0;

/// Standard deviation of a factor at which it may count as settled.
/// Budgeted: a part in five hundred, 0.7° a turn.
pub(crate) const SETTLED_FACTOR_SIGMA: f64 = 2e-3;

/// Move of a factor over the later half of the measurements, standard deviations, at which it may count as
/// settled.
/// Derived: one of 5000 constant robots exceeds it by chance.
pub(crate) const SETTLED_MOVE_SIGMA: f64 = 4.0;

/// Square metres. Smallest singular value of the positions' covariance from which on there is an alignment.
/// Published: evo 1.38, evo/core/geometry.py: the machine epsilon of a double.
pub(crate) const MIN_SINGULAR_VALUE_M2: f64 = f64::EPSILON;

/// Ratio. Difference from the step, over the step, up to which a pair of all pairs counts.
/// Published: evo 1.38, `rel_delta_tol` of evo/core/metrics.py.
pub(crate) const DELTA_TOLERANCE: f64 = 0.1;

/// Most pairs of one run.
/// Budgeted: 160 MB.
pub(crate) const MAX_PAIRS: usize = 10_000_000;

/// Relative. Standard deviation of stated lengths.
/// Convention: wheels and their separation are measured to a per cent.
pub(crate) const STATED_LENGTH_SIGMA: f64 = 0.01;

/// Length of the part of an unobservable direction along the separation, or the wheels' ratio, above which it
/// is named after that.
/// Convention: within 26° of it.
pub(crate) const MIN_NAMED_COMPONENT: f64 = 0.9;
