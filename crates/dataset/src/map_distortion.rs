//! What is known of the map in which an instrument's poses are.

/// Errors of a map that return with the place: at each place the same, and over a distance d with the
/// correlation e^{−d²/2ℓ²}. `[truth]` of `dataset.toml`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapDistortion {
    /// Standard deviation along each axis, metres.
    pub sigma_xy_m: f64,
    /// Standard deviation of the heading, radians.
    pub sigma_theta_rad: f64,
    /// Correlation length ℓ, metres.
    pub length_m: f64,
}
