//! A partial measurement: a scalar, and what it is a function of.

use kinematics::Wheels;

/// Where the robot stood at an instant that a measurement is of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Place {
    /// Number of intervals of the segment before it.
    pub(crate) after: usize,
    /// Variances of the wheels' turns beyond rounding, where it lies within a row, rad².
    pub(crate) interpolated_rad2: Wheels<f64>,
}

/// What an observation is a function of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Quantity {
    /// A coordinate of the pose at the end seen from that at the start: 0 ahead, 1 to the left, 2 the turn.
    Displacement(usize),
    /// The straight distance between both places.
    Distance,
    /// The distance from a wall, by its index.
    WallDistance(usize),
    /// The heading along a wall, by its index.
    WallHeading(usize),
    /// The turn between both places by a gyroscope, with its bias over this time.
    GyroTurn {
        /// Length of the window, seconds.
        dt_s: f64,
    },
    /// A measured pose, by its segment of the records and its index there; value and variance are its own.
    MeasuredPose { segment: usize, measurement: usize },
}

impl Quantity {
    /// Does an instrument see it from where the robot is at one instant? What an effect adds to the poses of
    /// such an instrument it adds to this.
    pub(crate) const fn is_of_an_instant(self) -> bool {
        matches!(self, Self::WallDistance(_) | Self::WallHeading(_))
    }
}

/// A scalar that was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Observation {
    /// Indices of its places; equal where it is of one instant, or the robot stood.
    pub(crate) from: usize,
    pub(crate) to: usize,
    /// When it was, or ended, seconds from the run's start.
    pub(crate) t_s: f64,
    pub(crate) quantity: Quantity,
    pub(crate) value: f64,
    pub(crate) variance: f64,
}
