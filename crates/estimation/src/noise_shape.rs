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

#[cfg(test)]
mod tests {
    use super::*;

    /// Position and heading correlate, in no direction of the room alone.
    const SHAPE: NoiseShape = NoiseShape { elements: [6.0, 1.5, 0.5, 2.0, -0.25, 3.0] };

    /// Roundings of matrices of elements of about one.
    const ROUNDING: f64 = 1e-12;

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() < ROUNDING
    }

    #[test]
    fn a_stated_covariance_is_taken_over_its_reference() {
        let stated = PoseCovariance::stated([8e-4, 2e-4, 3e-4, 4e-4, -1e-4, 9e-4]).expect("possible").expect("stated");
        let found = NoiseShape::of(&stated, [0.02, 0.03], [7.0, 11.0]).elements;
        // Over 4e-4 m², 6e-4 m rad and 9e-4 rad².
        let on_paper = [2.0, 0.5, 0.5, 1.0, -1.0 / 6.0, 1.0];
        assert!(found.iter().zip(on_paper).all(|(found, on_paper)| close(*found, on_paper)), "{found:?}");
        // What is not stated has its factors.
        let heading = PoseCovariance::stated([0.0, 0.0, 0.0, 0.0, 0.0, 9e-4]).expect("possible").expect("stated");
        assert_eq!(NoiseShape::of(&heading, [0.02, 0.03], [7.0, 11.0]).as_factors(), Some([7.0, 1.0]));
        let position = PoseCovariance::stated([8e-4, 0.0, 0.0, 4e-4, 0.0, 0.0]).expect("possible").expect("stated");
        let found = NoiseShape::of(&position, [0.02, 0.03], [7.0, 11.0]).elements;
        assert!(close(found[0], 2.0) && close(found[3], 1.0) && found[5] == 11.0, "{found:?}");
    }

    #[test]
    fn factors_tell_all_of_a_circle_without_correlations() {
        let of = |elements: [f64; 6]| NoiseShape { elements }.as_factors();
        assert_eq!(of([4.0, 0.0, 0.0, 4.0, 0.0, 9.0]), Some([4.0, 9.0]));
        for ellipse in [
            [4.0, 0.0, 0.0, 5.0, 0.0, 9.0],
            [4.0, 0.1, 0.0, 4.0, 0.0, 9.0],
            [4.0, 0.0, 0.1, 4.0, 0.0, 9.0],
            [4.0, 0.0, 0.0, 4.0, 0.1, 9.0],
        ] {
            assert_eq!(of(ellipse), None, "{ellipse:?}");
        }
    }

    #[test]
    fn least_factors_are_the_short_axis_and_the_heading_given_the_position() {
        assert_eq!(NoiseShape::independent([4.0, 9.0]).least_factors(), [4.0, 9.0]);
        // Of 6, 2 and 1.5 the eigenvalues are 6.5 and 1.5: 4 ± √(2² + 1.5²).
        let [position, heading] = SHAPE.least_factors();
        assert!(close(position, 1.5), "{position}");
        // 3 less bᵀ P⁻¹ b, with b = (0.5, −0.25) and P⁻¹ = ((2, −1.5), (−1.5, 6))/9.75.
        let given = (0.5 * 0.5 * 2.0 + 2.0 * 0.5 * 0.25 * 1.5 + 0.25 * 0.25 * 6.0) / 9.75;
        assert!(close(heading, 3.0 - given), "{heading} {given}");
        // The other axis is short. Rejects the variance along x or y.
        let [position, _] = NoiseShape { elements: [2.0, -1.5, 0.0, 6.0, 0.0, 1.0] }.least_factors();
        assert!(close(position, 1.5), "{position}");
        // Positions that are known in one direction: no inverse, and the heading's own variance.
        let line = NoiseShape { elements: [1.0, 1.0, 0.0, 1.0, 0.0, 5.0] }.least_factors();
        assert_eq!(line, [0.0, 5.0]);
    }

    #[test]
    fn a_covariance_has_the_units_of_its_coordinates() {
        let r = SHAPE.covariance([4.0, 9.0]);
        let on_paper = Matrix3::new(24.0, 6.0, 3.0, 6.0, 8.0, -1.5, 3.0, -1.5, 27.0);
        assert!((r - on_paper).amax() < ROUNDING, "{r}");
    }

    #[test]
    fn derivatives_are_those_of_the_covariance() {
        let variance = [4.0_f64, 9.0];
        let analytic = SHAPE.covariance_by(variance);
        for k in 0..2 {
            let at = |by: f64| {
                let mut moved = variance;
                moved[k] *= by.exp();
                SHAPE.covariance(moved)
            };
            let numeric = (at(1e-4) - at(-1e-4)) / 2e-4;
            // Central differences leave h²/6 of the third derivative, 27, and rounding of 1e-12.
            assert!((numeric - analytic[k]).amax() < 1e-6, "{k}: {numeric} {}", analytic[k]);
        }
    }

    #[test]
    fn a_start_has_its_errors_moved_by_the_lever() {
        let (variance, lever) = ([4.0, 9.0], Vector3::new(0.5, -2.0, 1.0));
        let [covariance, by_position, by_heading] = SHAPE.at_start(variance, lever);
        // An error (x, y, θ) moves the pose by (x + θ/2, y − 2 θ, θ).
        let moved = Matrix3::new(1.0, 0.0, 0.5, 0.0, 1.0, -2.0, 0.0, 0.0, 1.0);
        let of = |noise: Matrix3<f64>| moved * noise * moved.transpose();
        let [position, heading] = SHAPE.covariance_by(variance);
        assert!((covariance - of(SHAPE.covariance(variance))).amax() < ROUNDING, "{covariance}");
        assert!((by_position - of(position)).amax() < ROUNDING && (by_heading - of(heading)).amax() < ROUNDING);
    }

    #[test]
    fn errors_have_the_covariance() {
        // Of unit draws along each axis: the sum of e eᵀ is L Lᵀ.
        let draws = [Vector3::x(), Vector3::y(), Vector3::z()];
        let sum = draws.into_iter().fold(Matrix3::zeros(), |sum, draw| {
            let errors = SHAPE.errors([4.0, 9.0], draw);
            sum + errors * errors.transpose()
        });
        assert!((sum - SHAPE.covariance([4.0, 9.0])).amax() < ROUNDING, "{sum}");
    }

    #[test]
    fn errors_of_instants_go_along_the_path() {
        assert_eq!(CorrelatedErrors::of(None, [1.0, 1.0], Vector3::zeros()), None);
        // A second at 1 m/s in the direction (0.6, 0.8), turning by 0.5 rad/s.
        let by_instant = Vector3::new(0.6, 0.8, 0.5);
        let plain = CorrelatedErrors::of(None, [2.0, 3.0], by_instant).expect("instants err");
        let on_paper = Matrix3::new(8.36, 0.48, 0.3, 0.48, 8.64, 0.4, 0.3, 0.4, 27.25);
        assert!((plain.covariance([4.0, 9.0]) - on_paper).amax() < ROUNDING, "{}", plain.covariance([4.0, 9.0]));
        // They have no part in what the instrument's own variances do.
        let own = NoiseShape::independent([2.0, 3.0]).covariance_by([4.0, 9.0]);
        assert_eq!(plain.covariance_by([4.0, 9.0]), own);
        let stated = CorrelatedErrors::of(Some(SHAPE), [2.0, 3.0], Vector3::zeros()).expect("a row states it");
        assert_eq!(stated.covariance([4.0, 9.0]), SHAPE.covariance([4.0, 9.0]));
    }

    #[test]
    fn whitened_components_are_independent_and_keep_their_meaning() {
        let (sin, cos) = 0.7_f64.sin_cos();
        let axes = [Vector3::new(cos, sin, 0.0), Vector3::new(-sin, cos, 0.0), Vector3::z()];
        let errors = CorrelatedErrors::of(Some(SHAPE), [1.0; 2], Vector3::new(0.3, -0.4, 0.2)).expect("correlated");
        let r = errors.covariance([4.0, 9.0]);
        let Whitened { axes: found, variance } = errors.whitened(axes, [4.0, 9.0]);
        for (row, column) in (0..9).map(|k| (k / 3, k % 3)) {
            let covariance = found[row].dot(&(r * found[column]));
            let on_paper = if row == column { variance[row] } else { 0.0 };
            // Elements of up to 30.
            assert!((covariance - on_paper).abs() < 1e-11, "{row} {column}: {covariance} {on_paper}");
            // L is unit lower triangular in the robot's frame: a component has itself once, and none behind.
            let share = found[row].dot(&axes[column]);
            assert!(row > column || (share - f64::from(u8::from(row == column))).abs() < ROUNDING, "{row} {column}");
        }
        // The product of the variances is the determinant.
        assert!((variance.iter().product::<f64>() / r.determinant() - 1.0).abs() < ROUNDING);
    }
}
