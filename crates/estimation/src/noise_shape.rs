//! Covariances that rows of the truth state: correlated errors of one measured pose.
//!
//! A row's covariance is that of the instrument's errors but for one scale of position and one of heading,
//! which are estimated: R = S F S with S = diag(σ, σ, σ_θ) and F the stated covariance relative to a
//! reference. Rows without correlations are two factors, and the filter takes their components one by one.
//! Here R = L D Lᵀ in the robot's frame, L unit lower triangular, makes independent components of correlated
//! ones: L⁻¹ times the error has the variances D. Components keep their order and their meaning: along the
//! robot, across given along, heading given both (Bierman 1977).
//!
//! L depends on σ/σ_θ where positions and headings correlate; [`crate::noise_score`] takes whole
//! measurements.

use dataset::PoseCovariance;
use nalgebra::{Matrix3, Vector3};

/// The covariance of a measurement's errors in the room, over that of a measurement that states none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct NoiseShape {
    elements: [f64; 6],
}

/// A measurement as independent components.
pub(crate) struct Whitened {
    /// What each component is of the error in the room.
    pub(crate) axes: [Vector3<f64>; 3],
    /// Its variance.
    pub(crate) variance: [f64; 3],
}

impl NoiseShape {
    /// Of independent components, by factors of the variances of position and heading.
    pub(crate) const fn independent([xy, theta]: [f64; 2]) -> Self {
        Self { elements: [xy, 0.0, 0.0, xy, 0.0, theta] }
    }

    /// Of a stated covariance, relative to standard deviations of position, metres, and heading, radians. A
    /// part that it does not state has the variance factor in `otherwise`.
    pub(crate) fn of(stated: &PoseCovariance, reference: [f64; 2], otherwise: [f64; 2]) -> Self {
        let [xx, xy, xt, yy, yt, tt] = stated.elements();
        let [of_xy, of_theta] = [reference[0] * reference[0], reference[1] * reference[1]];
        let mixed = reference[0] * reference[1];
        let [xx, yy] = if xx > 0.0 { [xx / of_xy, yy / of_xy] } else { [otherwise[0]; 2] };
        let tt = if tt > 0.0 { tt / of_theta } else { otherwise[1] };
        Self { elements: [xx, xy / of_xy, xt / mixed, yy, yt / mixed, tt] }
    }

    /// Factors of the variances of position and heading, where they tell all.
    pub(crate) fn as_factors(&self) -> Option<[f64; 2]> {
        let [xx, xy, xt, yy, yt, tt] = self.elements;
        (xx == yy && [xy, xt, yt] == [0.0; 3]).then_some([xx, tt])
    }

    /// Lower bounds of the factors of both variances, in any direction and given all other components: the
    /// smaller eigenvalue of the position's part, and the heading's variance given the position.
    pub(crate) fn least_factors(&self) -> [f64; 2] {
        let f = self.covariance([1.0; 2]);
        let [mean, half_difference] = [0.5 * (f[(0, 0)] + f[(1, 1)]), 0.5 * (f[(0, 0)] - f[(1, 1)])];
        let heading = f.try_inverse().map_or(f[(2, 2)], |inverse| 1.0 / inverse[(2, 2)]);
        [mean - half_difference.hypot(f[(0, 1)]), heading]
    }

    /// R in the room for variances of position and heading.
    pub(crate) fn covariance(&self, [xy, theta]: [f64; 2]) -> Matrix3<f64> {
        let mixed = (xy * theta).sqrt();
        let [f_xx, f_xy, f_xt, f_yy, f_yt, f_tt] = self.elements;
        let (xt, yt) = (f_xt * mixed, f_yt * mixed);
        Matrix3::new(f_xx * xy, f_xy * xy, xt, f_xy * xy, f_yy * xy, yt, xt, yt, f_tt * theta)
    }

    /// ∂R/∂ln of both variances.
    pub(crate) fn covariance_by(&self, variance: [f64; 2]) -> [Matrix3<f64>; 2] {
        let r = self.covariance(variance);
        let (half, whole) = ((0.5 * r[(0, 2)], 0.5 * r[(1, 2)]), r[(2, 2)]);
        let mixed = Matrix3::new(0.0, 0.0, half.0, 0.0, 0.0, half.1, half.0, half.1, 0.0);
        let position = Matrix3::new(r[(0, 0)], r[(0, 1)], 0.0, r[(1, 0)], r[(1, 1)], 0.0, 0.0, 0.0, 0.0);
        [position + mixed, mixed + Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, whole))]
    }

    /// The covariance of a pose that starts at such a measurement, and its derivatives by the logarithms of
    /// both variances; `lever` is how the pose moves as the measured heading turns.
    pub(crate) fn at_start(&self, variance: [f64; 2], lever: Vector3<f64>) -> [Matrix3<f64>; 3] {
        let mut by_error = Matrix3::identity();
        by_error.set_column(2, &lever);
        let [position, heading] = self.covariance_by(variance);
        [self.covariance(variance), position, heading].map(|noise| by_error * noise * by_error.transpose())
    }

    /// Errors of a measurement in the room, from three independent numbers of variance 1.
    pub(crate) fn errors(&self, variance: [f64; 2], draws: Vector3<f64>) -> Vector3<f64> {
        self.covariance(variance).cholesky().map_or_else(Vector3::zeros, |root| root.l() * draws)
    }
}

/// Errors of a measurement whose components correlate: by what its row states, or because its instant is
/// known with an error, which moves it along the path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CorrelatedErrors {
    shape: NoiseShape,
    /// One standard deviation of the instant times the velocity of the instrument in the room: metres,
    /// radians.
    by_instant: Vector3<f64>,
}

impl CorrelatedErrors {
    /// Of a measurement with a stated covariance, or with factors of both variances; `None` where its
    /// components are independent.
    pub(crate) fn of(stated: Option<NoiseShape>, factors: [f64; 2], by_instant: Vector3<f64>) -> Option<Self> {
        let shape = match stated {
            None if by_instant == Vector3::zeros() => return None,
            of_row => of_row.unwrap_or_else(|| NoiseShape::independent(factors)),
        };
        Some(Self { shape, by_instant })
    }

    /// R in the room for variances of position and heading.
    pub(crate) fn covariance(&self, variance: [f64; 2]) -> Matrix3<f64> {
        self.shape.covariance(variance) + self.by_instant * self.by_instant.transpose()
    }

    /// ∂R/∂ln of both variances.
    pub(crate) fn covariance_by(&self, variance: [f64; 2]) -> [Matrix3<f64>; 2] {
        self.shape.covariance_by(variance)
    }

    /// The components of a measurement by a robot that heads along the first of `axes`.
    pub(crate) fn whitened(&self, axes: [Vector3<f64>; 3], variance: [f64; 2]) -> Whitened {
        let r = self.covariance(variance);
        let of = |a: &Vector3<f64>, b: &Vector3<f64>| a.dot(&(r * b));
        let [along, mut across, mut heading] = axes;
        let d_along = of(&along, &along);
        across -= along * (of(&across, &along) / d_along);
        let d_across = of(&across, &across);
        heading -= along * (of(&heading, &along) / d_along) + across * (of(&heading, &across) / d_across);
        Whitened { variance: [d_along, d_across, of(&heading, &heading)], axes: [along, across, heading] }
    }
}
