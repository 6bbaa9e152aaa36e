//! Start headings that are not measured.

/// Standard deviation of a stated length, relative, where windows alone tell how the drive is.
/// Convention: a few per cent.
pub(crate) const DRIVE_PRIOR_SIGMA: f64 = 0.05;

rules::settings! {
    StartHeadings
    /// Distance from the start, metres, over which a start heading that is not measured is found.
    /// Derived: a centimetre of error over half a metre is a degree.
    start_heading_baseline_m: f64 = 0.5,
    /// Step of a start heading, radians, below which it has converged.
    /// Budgeted: headings follow a step to first order, so that the square of it, 1e-12 rad, is left.
    heading_step_tolerance_rad: f64 = 1e-6,
    /// Information on a start heading that is not measured, 1/rad², below which it hardly moves.
    /// Derived: of positions that say as little, errors bend the likelihood by three times the root of the
    /// information I at the most, and a step by I + 2 or more does not overshoot then.
    start_heading_precision: f64 = 2.0,
    /// Fewest positions of a window whose rotation is found.
    /// Derived: two and a rotation tell nothing of the instrument's position; one more than three.
    min_window_positions: usize = 4,
    /// Longest way of such a window, in wheel separations.
    /// Derived: wheels that are off by 1 % against each other bend it by 0.2 rad, which is linear yet.
    max_window_separations: f64 = 20.0,
    /// Gain in squared standard deviations of a position from which on the instrument stands elsewhere than
    /// at the centre before the first fit.
    /// Derived: 10 standard errors; below it a spin's heading hardly depends on the position, which stays at
    /// the centre.
    min_sensor_position_chi_square: f64 = 100.0,
    /// Directions from the centre at which the search for the instrument's position starts.
    /// Derived: one is within half of an eighth of a turn.
    sensor_position_starts: u32 = 8,
    /// Most steps of the search from a start.
    /// Budgeted: Newton's steps double the digits; a step takes a microsecond a window.
    sensor_position_steps: usize = 200,
    /// Relative step that ends the search.
    /// Budgeted: the fit that follows starts there.
    sensor_position_tolerance: f64 = 1e-6,
    /// Relative change of a length by which paths are differentiated.
    /// Budgeted: 1e-4 of a path's curvature, 1e-12 of its rounding.
    drive_step: f64 = 1e-4,
    /// How often paths are found anew with a corrected drive.
    /// Derived: a drive that is off by 5 % leaves its square, then the square of that.
    drive_steps: u32 = 2,
}
