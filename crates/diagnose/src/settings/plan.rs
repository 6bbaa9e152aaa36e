//! The next experiment.

/// Seconds. Time to place the robot for a run, where nothing is known of it.
/// Tuned: by hand; no record of what on.
pub const HANDLING_S: f64 = 20.0;

/// Minutes. Time for the next experiment, where none is stated.
/// Convention: ten minutes.
pub const MINUTES: f64 = 10.0;

/// Number. Instants of a run at which a prediction is made.
/// Tuned: by hand; no record of what on.
pub(crate) const PREDICTION_INSTANTS: usize = 12;

rules::settings! {
    Plan
    /// m/s. Speed where the log has none.
    /// Convention: that of the shipped YAIR robot.
    default_speed_m_s: f64 = 0.25,
    /// m/s². Acceleration of a wheel where nothing is known of it.
    /// Convention: that of the shipped YAIR robot.
    default_acceleration_m_s2: f64 = 0.5,
    /// Wheel separations. Margin to each wall: the robot's own width and a hand's breadth.
    /// Tuned: by hand; no record of what on.
    clearance_separations: f64 = 1.5,
    /// Number. Variants of an effect that are planned for; what excites one mostly excites its neighbours.
    /// Tuned: by hand; no record of what on.
    max_planned_variants: usize = 3,
    /// Detectable effects. Value of a factor e in the precision of one geometry parameter.
    /// Tuned: by hand; no record of what on.
    geometry_precision_value: f64 = 0.3,
    /// Ratio of values per minute. A new manoeuvre must be worth this much more than another run of those
    /// planned.
    /// Tuned: by hand; no record of what on.
    new_manoeuvre_ratio: f64 = 1.3,
    /// Detectable effects. Least value of a pair of runs.
    /// Tuned: by hand; no record of what on.
    min_coverage_gain: f64 = 0.01,
    /// Relative. A geometry parameter with a larger standard deviation is not determined by a plan.
    /// Tuned: by hand; no record of what on.
    undetermined_geometry_sigma: f64 = 0.02,
    /// Number. Manoeuvres of a plan that a person can keep track of.
    /// Tuned: by hand; no record of what on.
    max_manoeuvres: usize = 6,
    /// Metres, radians, and their square-root rates. Least noise that a plan assumes.
    /// Convention: a micrometre and a microradian.
    min_noise_sigma: f64 = 1e-6,
    /// Standard deviations. An effect whose plausible size is less significant is not excited at all.
    /// Tuned: by hand; no record of what on.
    min_planned_sigmas: f64 = 1e-3,
    /// Fractions of the largest manoeuvre that fits the floor.
    /// Tuned: by hand; no record of what on.
    size_fractions: [f64; 2] = [1.0, 0.5],
    /// Fractions of the top speed.
    /// Tuned: by hand; no record of what on.
    speed_fractions: [f64; 3] = [1.0, 0.5, 0.25],
    /// Revolutions of a spin.
    /// Tuned: by hand; no record of what on.
    spin_revolutions: [f64; 2] = [1.0, 3.0],
    /// Metres. Shorter motions are lost in the noise of the measurements.
    /// Tuned: by hand; no record of what on.
    min_manoeuvre_length_m: f64 = 0.2,
    /// Seconds. Standstill before and after a planned run; without it, effects of starting would be
    /// discriminated better than in any real log.
    /// Tuned: by hand; no record of what on.
    standstill_s: f64 = 0.5,
    /// Ratio of times. Two manoeuvres must save the rest against one.
    /// Tuned: by hand; no record of what on.
    two_manoeuvres_time_ratio: f64 = 0.8,
    /// Number. Pairs of runs of one manoeuvre that anybody drives.
    /// Tuned: by hand; no record of what on.
    max_run_pairs: u32 = 50,
    /// Number. Phases of the wheels at the start over which predictions are averaged.
    /// Tuned: by hand; no record of what on.
    wheel_phases: usize = 4,
    /// Standard deviations. A smaller difference does not show in a single kind of measurement.
    /// Tuned: by hand; no record of what on.
    single_measurement_sigmas: f64 = 2.0,
    /// Standard deviations of the parameter. Step of the numerical derivative of a prediction.
    /// Tuned: by hand; no record of what on.
    derivative_step_sigmas: f64 = 0.1,
    /// Relative. Prior standard deviation of the geometry parameters.
    /// Tuned: by hand; no record of what on.
    geometry_prior_sigma: f64 = 0.05,
    /// Metres. Prior standard deviation of the position of the instrument on the robot.
    /// Tuned: by hand; no record of what on.
    lever_prior_sigma_m: f64 = 0.2,
    /// Seconds. Prior standard deviation of the instrument's latency.
    /// Tuned: by hand; no record of what on.
    latency_prior_sigma_s: f64 = 0.2,
    /// Number. Prior standard deviation of a gyroscope's relative scale.
    /// Published: the tolerance of 3 % in data sheets of consumer gyroscopes (MPU-6050).
    gyro_scale_prior_sigma: f64 = 0.03,
    /// Number. Steps of the search for the design point over a quarter of a circle.
    /// Tuned: by hand; no record of what on.
    design_point_steps: u32 = 32,
}
