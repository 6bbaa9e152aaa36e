//! A stamped transform: between which frames it is, and the rigid motion that it says.

use dataset::Quaternion;
use kinematics::Pose;

use crate::value::Value;

/// Parent and child of a stamped transform, without the slash of older names.
pub(crate) fn frames(transform: &Value) -> Option<(&str, &str)> {
    let of = |path| transform.text(path).map(|frame| frame.trim_start_matches('/'));
    Some((of("header.frame_id")?, of("child_frame_id")?))
}

/// A rigid motion in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rigid {
    rotation: [[f64; 3]; 3],
    translation_m: [f64; 3],
}

impl Rigid {
    pub(crate) const IDENTITY: Self =
        Self { rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], translation_m: [0.0; 3] };

    /// Of a transform; none of a quaternion without direction.
    pub(crate) fn of(transform: &Value) -> Option<Self> {
        let number = |of: &str, axis: &str| transform.number(&format!("transform.{of}.{axis}"));
        let mut translation_m = [0.0; 3];
        for (value, axis) in translation_m.iter_mut().zip(["x", "y", "z"]) {
            *value = number("translation", axis).filter(|value| value.is_finite())?;
        }
        let mut q = [0.0; 4];
        for (value, axis) in q.iter_mut().zip(["x", "y", "z", "w"]) {
            *value = number("rotation", axis)?;
        }
        let rotation = Quaternion::new(q)?.matrix();
        Some(Self { rotation, translation_m })
    }

    fn turned(&self, v: [f64; 3]) -> [f64; 3] {
        self.rotation.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
    }

    /// This motion after `inner`.
    pub(crate) fn after(&self, inner: &Self) -> Self {
        let columns = [0, 1, 2].map(|k| self.turned(inner.rotation.map(|row| row[k])));
        let moved = self.turned(inner.translation_m);
        Self {
            rotation: [0, 1, 2].map(|row| [0, 1, 2].map(|k| columns[k][row])),
            translation_m: [0, 1, 2].map(|row| moved[row] + self.translation_m[row]),
        }
    }

    /// The motion back.
    pub(crate) fn inverse(&self) -> Self {
        let back = Self {
            rotation: [0, 1, 2].map(|row| [0, 1, 2].map(|column| self.rotation[column][row])),
            translation_m: [0.0; 3],
        };
        let translation_m = back.turned(self.translation_m).map(|value_m| -value_m);
        Self { translation_m, ..back }
    }

    /// What of it is in the plane.
    pub(crate) fn pose(&self) -> Pose {
        let Self { rotation, translation_m } = self;
        Pose::new(translation_m[0], translation_m[1], rotation[1][0].atan2(rotation[0][0]))
    }

    /// Cosine of the angle between the two z axes.
    pub(crate) const fn upright(&self) -> f64 {
        self.rotation[2][2]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_and_back_is_where_one_was() {
        // A third of a turn about (1, 1, 1): x becomes y, y becomes z.
        let rotation = Quaternion::new([0.5; 4]).expect("a rotation").matrix();
        let motion = Rigid { rotation, translation_m: [1.0, 2.0, 3.0] };
        for there_and_back in [motion.after(&motion.inverse()), motion.inverse().after(&motion)] {
            let off =
                |row: usize, column: usize| there_and_back.rotation[row][column] - f64::from(u8::from(row == column));
            // Rounding of some products of numbers below 4.
            assert!((0..9).all(|place| off(place / 3, place % 3).abs() < 1e-14), "{there_and_back:?}");
            assert!(there_and_back.translation_m.iter().all(|value_m| value_m.abs() < 1e-14), "{there_and_back:?}");
        }
        assert!(motion.upright().abs() < 1e-14 && motion.inverse() != motion);
    }
}
