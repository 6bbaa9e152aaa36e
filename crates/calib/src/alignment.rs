//! Alignment of an estimated path to a reference before absolute errors are taken.
//!
//! Umeyama's least squares without scale (1991, eq. 34 to 42), in closed form for the plane: the rotation is
//! the two-argument arctangent of Σ cross and Σ dot product of the centred positions. Where both paths lie in
//! one plane this is what `evo_ape -a` computes in SE(3), but for two cases in which it is not: then there is
//! a reason instead.

use kinematics::{Pose, sin_cos};
use serde::{Serialize, Serializer};

use crate::settings::MIN_SINGULAR_VALUE_M2;

/// What is done to the estimate before absolute errors are taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Alignment {
    /// Nothing: dead reckoning starts where the instrument first saw the robot.
    #[default]
    None,
    /// The rigid motion of the plane under which the positions fit best.
    Se2,
}

impl Alignment {
    /// What the flag may say.
    pub const ALL: [Self; 2] = [Self::None, Self::Se2];

    /// The name that the flag and JSON use.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Se2 => "se2",
        }
    }

    /// Takes the estimate to the reference, or says why nothing does.
    pub(crate) fn reference_from_estimate(
        self,
        reference: &[Pose],
        estimate: &[Pose],
    ) -> Result<Option<Pose>, &'static str> {
        match self {
            Self::None => Ok(None),
            Self::Se2 => umeyama(reference, estimate).map(Some),
        }
    }
}

impl Serialize for Alignment {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

fn mean(poses: &[Pose]) -> (f64, f64) {
    let sum = poses.iter().fold((0.0, 0.0), |(x_m, y_m), pose| (x_m + pose.x_m, y_m + pose.y_m));
    (sum.0 / poses.len() as f64, sum.1 / poses.len() as f64)
}

fn umeyama(reference: &[Pose], estimate: &[Pose]) -> Result<Pose, &'static str> {
    let ((x_m, y_m), (from_x_m, from_y_m)) = (mean(reference), mean(estimate));
    // The covariance of the positions, reference by estimate (eq. 38).
    let (mut xx, mut xy, mut yx, mut yy) = (0.0, 0.0, 0.0, 0.0);
    for (to, from) in reference.iter().zip(estimate) {
        let (to_x_m, to_y_m) = (to.x_m - x_m, to.y_m - y_m);
        let (from_x_m, from_y_m) = (from.x_m - from_x_m, from.y_m - from_y_m);
        xx += to_x_m * from_x_m;
        xy += to_x_m * from_y_m;
        yx += to_y_m * from_x_m;
        yy += to_y_m * from_y_m;
    }
    let [xx, xy, yx, yy] = [xx, xy, yx, yy].map(|sum| sum / reference.len() as f64);
    // Singular values of the 2 × 2 matrix: half the sum and half the difference of two lengths.
    let (proper_m2, mirrored_m2) = ((xx + yy).hypot(yx - xy), (xx - yy).hypot(yx + xy));
    let smallest_m2 = 0.5 * (proper_m2 - mirrored_m2).abs();
    if smallest_m2.is_nan() || smallest_m2 <= MIN_SINGULAR_VALUE_M2 {
        return Err("the positions lie on a line: in space it may turn about itself, so that evo has no alignment");
    }
    if mirrored_m2 > proper_m2 {
        return Err("one path is the other's mirror image: evo's alignment in space would turn the plane over");
    }
    let theta_rad = (yx - xy).atan2(xx + yy);
    let (sin, cos) = sin_cos(theta_rad);
    Ok(Pose::new(x_m - (cos * from_x_m - sin * from_y_m), y_m - (sin * from_x_m + cos * from_y_m), theta_rad))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    fn at(points: &[(f64, f64)]) -> Vec<Pose> {
        points.iter().map(|(x_m, y_m)| Pose::new(*x_m, *y_m, 0.0)).collect()
    }

    #[test]
    fn a_moved_triangle_comes_back_by_the_motion_that_moved_it() {
        // A quarter turn, then one metre ahead: (x, y) → (1 − y, x).
        let (estimate, reference) =
            (at(&[(0.0, 0.0), (1.0, 0.0), (0.0, 2.0)]), at(&[(1.0, 0.0), (1.0, 1.0), (-1.0, 0.0)]));
        let found = umeyama(&reference, &estimate).expect("a motion");
        let close = |a: f64, b: f64| (a - b).abs() < 1e-15;
        assert!(close(found.theta_rad, FRAC_PI_2) && close(found.x_m, 1.0) && close(found.y_m, 0.0), "{found:?}");
        let alignment = Alignment::Se2.reference_from_estimate(&reference, &estimate);
        assert_eq!(alignment, Ok(Some(found)));
        assert_eq!(Alignment::None.reference_from_estimate(&reference, &estimate), Ok(None));
    }

    #[test]
    fn a_line_a_point_and_a_mirror_image_have_none() {
        let line = at(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)]);
        assert!(umeyama(&line, &line).is_err_and(|why| why.contains("on a line")));
        let point = at(&[(1.0, 1.0), (1.0, 1.0)]);
        assert!(umeyama(&point, &point).is_err_and(|why| why.contains("on a line")));
        let triangle = at(&[(0.0, 0.0), (1.0, 0.0), (0.0, 2.0)]);
        let mirrored = at(&[(0.0, 0.0), (1.0, 0.0), (0.0, -2.0)]);
        assert!(umeyama(&triangle, &mirrored).is_err_and(|why| why.contains("mirror")));
        // A path that bends by a millimetre has a rank.
        let bent = at(&[(0.0, 0.0), (1.0, 0.001), (2.0, 0.0)]);
        assert!(umeyama(&bent, &bent).is_ok());
    }
}
