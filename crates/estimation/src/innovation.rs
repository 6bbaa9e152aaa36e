//! Innovations: what measurements differ from the filter's prediction by.

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
