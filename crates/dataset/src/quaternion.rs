//! Orientations of other formats, whose scalar stands last.

use crate::settings::QUATERNION_LENGTH;

/// A rotation in space as a unit quaternion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quaternion {
    x: f64,
    y: f64,
    z: f64,
    w: f64,
}

impl Quaternion {
    /// The rotation of x, y, z and the scalar w; `None` of what is none: a component that is no finite
    /// number, or a length that rounding does not explain, as of messages that were never filled.
    #[must_use]
    pub fn new(parts: [f64; 4]) -> Option<Self> {
        // Squares that overflow make a length that is too large, and NaN is in no range.
        let length = Self::length(parts);
        let [x, y, z, w] = parts.map(|part| part / length);
        QUATERNION_LENGTH.contains(&length).then_some(Self { x, y, z, w })
    }

    /// The length, which is 1 but for rounding.
    #[must_use]
    pub fn length(parts: [f64; 4]) -> f64 {
        parts.iter().map(|part| part * part).sum::<f64>().sqrt()
    }

    /// The heading in the plane, radians: the rotation about z, of z-y-x Euler angles.
    #[must_use]
    pub fn yaw_rad(self) -> f64 {
        let Self { x, y, z, w } = self;
        (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z))
    }

    /// The angle between the body's z axis and the room's, radians.
    #[must_use]
    pub fn tilt_rad(self) -> f64 {
        (1.0 - 2.0 * (self.x * self.x + self.y * self.y)).clamp(-1.0, 1.0).acos()
    }

    /// The matrix that turns vectors of the body into the room.
    #[must_use]
    pub fn matrix(self) -> [[f64; 3]; 3] {
        let Self { x, y, z, w } = self;
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quaternion_is_a_heading_a_tilt_and_a_matrix() {
        // Rounding of a handful of operations on numbers of size 1.
        let close = |found: f64, expected: f64| (found - expected).abs() < 1e-12;
        for yaw_rad in [-3.0, -0.5, 0.0, 1.0, 3.1_f64] {
            let (sin, cos) = (0.5 * yaw_rad).sin_cos();
            let found = Quaternion::new([0.0, 0.0, 1.5 * sin, 1.5 * cos]).expect("a rotation");
            assert!(close(found.yaw_rad(), yaw_rad) && found.tilt_rad() == 0.0, "{yaw_rad} {found:?}");
            let [[xx, xy, _], [yx, ..], [.., zz]] = found.matrix();
            assert!(close(xx, yaw_rad.cos()) && close(yx, yaw_rad.sin()) && close(xy, -yx) && close(zz, 1.0));
        }
        let found = Quaternion::new([0.1_f64.sin(), 0.0, 0.0, 0.1_f64.cos()]).expect("a rotation");
        assert!(close(found.yaw_rad(), 0.0) && close(found.tilt_rad(), 0.2), "{found:?}");
    }

    #[test]
    fn what_is_no_rotation_has_no_heading() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e200, -1e200, 1e154, 1e308, 3.0] {
            for place in 0..4 {
                let mut parts = [0.0, 0.0, 0.25_f64.sin(), 0.25_f64.cos()];
                parts[place] = bad;
                assert_eq!(Quaternion::new(parts), None, "{bad} at {place}");
            }
        }
        assert_eq!(Quaternion::new([0.0; 4]), None);
        assert_eq!(Quaternion::new([1e-200; 4]), None);
    }
}
