//! The information of one measurement beyond all before it.

use nalgebra::Matrix3;

/// The innovation of one measurement, linear in the geometry, in the frame of the run's true start pose.
/// Poses are ordered x, y, θ (m, m, rad).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearizedInnovation {
    /// When, seconds from the run's start.
    pub t_s: f64,
    /// Slope of the predicted pose in the left diameter, the right diameter and the wheel separation
    /// (columns), all in metres.
    pub slope: Matrix3<f64>,
    /// Covariance of the measured pose minus the predicted one.
    pub covariance: Matrix3<f64>,
    /// The inverse of [`Self::covariance`].
    pub precision: Matrix3<f64>,
}

impl LinearizedInnovation {
    /// Hᵀ S⁻¹ H, 1/m².
    #[must_use]
    pub fn information(&self) -> Matrix3<f64> {
        self.slope.transpose() * self.precision * self.slope
    }
}
