//! Why a scenario has no bound.

use kinematics::GeometryError;

/// Why a scenario has no bound.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NoBound {
    /// An effect's scatter is none that a whole motion has.
    #[error("effect {id} has no closed bound: {why}")]
    Effect {
        /// The effect.
        id: &'static str,
        /// Why.
        why: &'static str,
    },
    /// The true geometry is not physical.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// Nothing measures the robot.
    #[error("no instrument sees the robot")]
    NoInstrument,
    /// A tachometer measures the wheels, and the bound takes measurements of the pose alone.
    #[error("a tachometer's wheel speeds are no pose measurement: leave the instrument out for a bound")]
    WheelSpeeds,
    /// Partial measurements beside poses have no bound here.
    #[error("a gyro, a tape measure, walls or revisits with whole poses have no closed bound here")]
    PartialMeasurements,
    /// Readings of a wall are of a lidar somewhere on the robot.
    #[error(
        "the place of the lidar on the robot is unknown, for which there is no closed bound here: set lever_x_m, lever_y_m and lever_theta_rad to 0"
    )]
    UnknownLever,
    /// Errors of poses in a map resemble each other.
    #[error("poses of slam have correlated errors, for which there is no closed bound here")]
    CorrelatedErrors,
    /// The floor grid reads fewer than two distinct points.
    #[error("the robot's marked points give no heading: two of them must differ")]
    NoHeading,
    /// The grid rounds coarser than its readings err.
    #[error(
        "readings that err by {reading_sigma_m} m are rounded to {resolution_m} m: such roundings are not independent; a bound takes an error of a third of the rounding"
    )]
    RoundedReadings {
        /// Standard deviation of a reading before it is rounded, metres.
        reading_sigma_m: f64,
        /// What it is rounded to, metres.
        resolution_m: f64,
    },
    /// A reading tells something without error.
    #[error(
        "the measurement at {t_s} s has a direction without any error: the bound is zero; give the instrument or the wheels some noise"
    )]
    NoError {
        /// When, seconds from the run's start.
        t_s: f64,
    },
}
