//! Numbers of partial measurements: gyroscopes, tape measures and walls.

/// Standard deviation of the position at the start of a run with partial measurements beside poses, before
/// any pose is taken, metres.
/// Budgeted: a thousand times that of instruments, so that nothing is said of it, and far from where the
/// rounding of numbers shows in millimetres.
pub(crate) const START_POSITION_SIGMA_M: f64 = 10.0;

/// The same of the heading, radians.
/// Budgeted: as above; a heading that is not measured starts where the poses' own fit has it.
pub(crate) const START_HEADING_SIGMA_RAD: f64 = 1.0;

rules::settings! {
    Partial
    /// Longest stretch over which a gyroscope's rates are summed into one turn, seconds. Its noise is white,
    /// so that the sum loses nothing but changes of speed within it.
    /// Budgeted: shorter than a robot's motions, which last for seconds.
    gyro_window_s: f64 = 1.0,
    /// Standard deviation of a gyroscope's bias at the start of a run, rad/s.
    /// Budgeted: beyond what any robot turns at, so that the bias counts as unknown however many runs there
    /// are.
    gyro_bias_sigma_radps: f64 = 10.0,
    /// Standard deviation of a gyroscope's relative scale of which nothing is stated: one that turns the
    /// other way is a fault of wheels or mounting, and none of scale.
    /// Budgeted: twice the tenth that data sheets allow consumer sensors, and far too loose to determine a
    /// wheelbase.
    gyro_scale_sigma: f64 = 0.2,
    /// Random walk of a gyroscope's bias that nothing is stated of, rad/s per √s.
    /// Convention: a bias that strays by 0.01 °/s in a minute, as those of consumer sensors do.
    bias_walk_radps: f64 = 2e-5,
    /// Least angle random walk of a gyroscope, rad/√s, where it is taken from the log.
    /// Convention: a hundredth of a tactical gyroscope's; a log of constant rates has none.
    min_gyro_noise_rad_per_sqrt_s: f64 = 1e-7,
    /// Pairs of rows at standstill from which the noise of a gyroscope is taken.
    /// Budgeted: its standard deviation is then known to 1/√(2·50), a tenth.
    min_standing_pairs: usize = 50,
    /// Standard deviation of a wall's direction before it is seen, radians.
    /// Budgeted: all directions.
    wall_direction_sigma_rad: f64 = 10.0,
    /// Standard deviation of a wall's distance from a run's start before it is seen, metres.
    /// Budgeted: rooms of any size.
    wall_offset_sigma_m: f64 = 1000.0,
    /// Number of directions from which a wall is sought that only distances speak of.
    /// Budgeted: 15° apart, within the basin of the nearest.
    wall_start_directions: u32 = 24,
    /// Number of Gauss–Newton steps from each of these directions.
    /// Budgeted: from 15° off to 1e-6 of the nearest minimum.
    wall_start_steps: usize = 10,
    /// Distance below which the direction between two places is not known, metres.
    /// Budgeted: far below what a tape measure shows.
    min_distance_m: f64 = 1e-6,
    /// Standard deviation of a lidar's place on the robot before it is seen, metres.
    /// Budgeted: robots of any size.
    lidar_place_sigma_m: f64 = 10.0,
    /// Squared innovation of a partial measurement over its variance above which it is an outlier.
    /// Derived: χ² with one degree of freedom at 1 − 1e-5, as that of poses.
    partial_outlier_chi_square: f64 = 19.5,
    /// Share of the separation that lies in the directions which are not determined, from which on it is open
    /// whatever the wheels are.
    /// Budgeted: near 1, where it lies in them whole; spins leave a third.
    max_separation_share: f64 = 0.9,
}
