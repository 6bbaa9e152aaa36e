//! Innovations: what measurements differ from the filter's prediction by.

use nalgebra::Vector3;

/// One whitened component of a measurement's innovation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InnovationComponent {
    /// Which segment.
    pub segment: usize,
    /// Which measurement of the segment.
    pub measurement: usize,
    /// 0 along the robot, 1 across, 2 heading.
    pub component: usize,
    /// Over its standard deviation.
    pub z: f64,
    /// That standard deviation: metres, or radians of a heading.
    pub sigma: f64,
}

/// Innovation of a whole measurement, in the room.
pub(crate) struct Innovation {
    /// What was measured less what was expected.
    pub(crate) error: Vector3<f64>,
    /// How the measured pose moves as the robot turns.
    pub(crate) by_heading: Vector3<f64>,
    /// How it moves as the instant moves that the measurement is of.
    pub(crate) by_latency: Vector3<f64>,
}
