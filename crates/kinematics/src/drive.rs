//! The differential drive: from wheel travel to the robot's motion and back (paper, eq. 1 and 2).

use std::f64::consts::PI;

use crate::elementary::{Branching, Elementary};
use crate::trig::sin_cos;
use crate::{Frame, Pose, Rotation, Wheels};

/// Why a drive geometry or a count scale is not one.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GeometryError {
    /// A length or a scale that must be positive and finite is not.
    #[error("{quantity} {}; it must be positive and finite", if value.is_finite() { format!("is {value}") } else { "has no finite value".to_owned() })]
    NotPositive {
        /// Which quantity, with its unit suffix.
        quantity: &'static str,
        /// The offending value.
        value: f64,
    },
}

fn positive(quantity: &'static str, value: f64) -> Result<f64, GeometryError> {
    if value.is_finite() && value > 0.0 { Ok(value) } else { Err(GeometryError::NotPositive { quantity, value }) }
}

/// Wheel diameters and separation of a differential drive, nominal or effective.
///
/// All are positive and finite, metres: a diameter is that of rolling (travel of a turn over π), the
/// separation that which makes turns right (travel right minus left, over the turn), which no ruler measures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveGeometry {
    wheel_diameter_m: Wheels<f64>,
    wheel_separation_m: f64,
}

impl DriveGeometry {
    /// A drive from its two rolling diameters and the distance between its wheel contacts, metres.
    ///
    /// # Errors
    /// [`GeometryError::NotPositive`] when a length is not positive and finite.
    pub fn new(wheel_diameter_m: Wheels<f64>, wheel_separation_m: f64) -> Result<Self, GeometryError> {
        Ok(Self {
            wheel_diameter_m: Wheels {
                left: positive("left_wheel_diameter_m", wheel_diameter_m.left)?,
                right: positive("right_wheel_diameter_m", wheel_diameter_m.right)?,
            },
            wheel_separation_m: positive("wheel_separation_m", wheel_separation_m)?,
        })
    }

    /// Rolling diameters, metres.
    #[must_use]
    pub const fn wheel_diameter_m(&self) -> Wheels<f64> {
        self.wheel_diameter_m
    }

    /// Distance between the wheel contacts, metres (`d` nominal, `B` effective in the paper).
    #[must_use]
    pub const fn wheel_separation_m(&self) -> f64 {
        self.wheel_separation_m
    }

    /// Travel for one radian of wheel turn, metres.
    #[inline]
    #[must_use]
    pub fn m_per_rad(&self) -> Wheels<f64> {
        self.wheel_diameter_m.map(|diameter_m| diameter_m / 2.0)
    }

    /// Travel for one count, metres: the paper's odometric sensitivity `C = 2πr/n`.
    ///
    /// # Errors
    /// [`GeometryError::NotPositive`] when `counts_per_rev` is not positive and finite.
    pub fn m_per_count(&self, counts_per_rev: f64) -> Result<Wheels<f64>, GeometryError> {
        let counts_per_rev = positive("counts_per_rev", counts_per_rev)?;
        Ok(self.wheel_diameter_m.map(|diameter_m| PI * diameter_m / counts_per_rev))
    }

    /// The robot's motion for given wheel travels in metres (paper, eq. 1 and 2).
    #[inline]
    #[must_use]
    pub fn increment(&self, travel_m: Wheels<f64>) -> Increment {
        Increment::from_travel(travel_m, self.wheel_separation_m)
    }

    /// The wheel travels in metres that make a given motion: the inverse of [`Self::increment`].
    #[must_use]
    pub fn travel_m(&self, increment: Increment) -> Wheels<f64> {
        let half_m = 0.5 * self.wheel_separation_m * increment.turn_rad;
        Wheels { left: increment.distance_m - half_m, right: increment.distance_m + half_m }
    }

    /// The robot's twist for given wheel contact speeds, m/s.
    #[must_use]
    pub fn twist(&self, speed_m_s: Wheels<f64>) -> Twist {
        let rate = self.increment(speed_m_s);
        Twist { v_m_s: rate.distance_m, omega_rad_s: rate.turn_rad }
    }

    /// The wheel contact speeds in m/s that make a given twist.
    #[must_use]
    pub fn wheel_speed_m_s(&self, twist: Twist) -> Wheels<f64> {
        self.travel_m(Increment { distance_m: twist.v_m_s, turn_rad: twist.omega_rad_s })
    }
}

/// Planar twist of the drive's centre in its own frame; a differential drive has no lateral speed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Twist {
    /// Forward speed, m/s.
    pub v_m_s: f64,
    /// Yaw rate, rad/s, counter-clockwise.
    pub omega_rad_s: f64,
}

impl Twist {
    /// The mean twist of a motion in the body's frame over some seconds, along and in heading; that of rest
    /// over none.
    #[inline]
    #[must_use]
    pub fn of_motion(motion: Pose, over_s: f64) -> Self {
        if over_s > 0.0 {
            Self { v_m_s: motion.x_m / over_s, omega_rad_s: motion.theta_rad / over_s }
        } else {
            Self::default()
        }
    }
}

/// A motion of constant curvature: arc length of the centre, metres, positive ahead, and turn, radians,
/// counter-clockwise (paper, eq. 1 and 2).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Increment {
    /// Arc length of the centre, metres, negative backward (`ΔS`).
    pub distance_m: f64,
    /// Turn, radians, counter-clockwise (`Δθ`).
    pub turn_rad: f64,
}

impl Increment {
    /// Motion for wheel travels over a separation, metres (paper, eq. 1 and 2).
    #[inline(always)]
    #[must_use]
    pub fn from_travel(travel_m: Wheels<f64>, wheel_separation_m: f64) -> Self {
        Self {
            distance_m: 0.5 * (travel_m.right + travel_m.left),
            // By the inverse, which is worked out while the travels still are.
            turn_rad: (travel_m.right - travel_m.left) * (1.0 / wheel_separation_m),
        }
    }

    /// `before_from_after` along the exact circular arc.
    #[inline]
    #[must_use]
    pub fn arc(self) -> Pose {
        self.chord(&Branching).0
    }

    /// `before_from_after` along the exact circular arc, its end displaced in the frame of the chord: ahead
    /// along it and to its left, metres.
    #[inline]
    #[must_use]
    pub fn perturbed_arc(self, along_m: f64, across_m: f64) -> Frame {
        self.perturbed_arc_by(&Branching, along_m, across_m)
    }

    /// [`Self::perturbed_arc`] by given elementary functions.
    #[inline(always)]
    #[must_use]
    pub fn perturbed_arc_by<E: Elementary>(self, elementary: &E, along_m: f64, across_m: f64) -> Frame {
        let (mut before_from_after, (sin, cos)) = self.chord(elementary);
        before_from_after.x_m += cos * along_m - sin * across_m;
        before_from_after.y_m += sin * along_m + cos * across_m;
        // The whole turn's from the half's: 2·sin·cos, 1 − 2·sin².
        Frame::with_heading(before_from_after, Rotation { sin: 2.0 * sin * cos, cos: 1.0 - 2.0 * sin * sin })
    }

    /// The arc's end, and sine and cosine of half its turn.
    #[inline(always)]
    fn chord<E: Elementary>(self, elementary: &E) -> (Pose, (f64, f64)) {
        let half_rad = 0.5 * self.turn_rad;
        let (sin, cos) = elementary.sin_cos(half_rad);
        let chord_m = self.distance_m * E::sinc_given_sine(half_rad, sin);
        (Pose::new(chord_m * cos, chord_m * sin, self.turn_rad), (sin, cos))
    }

    /// `before_from_after` by the paper's midpoint rule (eq. 3): the arc length taken for the chord.
    #[must_use]
    pub fn midpoint(self) -> Pose {
        let (sin, cos) = sin_cos(0.5 * self.turn_rad);
        Pose::new(self.distance_m * cos, self.distance_m * sin, self.turn_rad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn yair() -> DriveGeometry {
        DriveGeometry::new(Wheels::both(0.160), 0.363).expect("valid")
    }

    #[test]
    fn paper_eq_1_and_2_give_centre_arc_and_turn() {
        let increment = yair().increment(Wheels { left: 0.1, right: 0.3 });
        assert!((increment.distance_m - 0.2).abs() < 1e-16);
        assert!((increment.turn_rad - 0.2 / 0.363).abs() < 1e-16);
    }

    #[test]
    fn sensitivity_is_the_circumference_over_the_counts_of_a_turn() {
        // 160 mm wheels and 1 mm a pulse mean 502.65 pulses a turn (docs/paper.md, pulses of a turn).
        let m_per_count = yair().m_per_count(502.654_824_574_366_9).expect("valid");
        assert!((m_per_count.left - 1e-3).abs() < 1e-17);
        // ... and 500 pulses a turn give 1.0053 mm.
        let m_per_count = yair().m_per_count(500.0).expect("valid");
        assert_eq!((m_per_count.right * 1e7).round() / 1e4, 1.0053);
    }

    #[test]
    fn a_geometry_of_nonsense_is_refused_by_name() {
        let error = DriveGeometry::new(Wheels { left: 0.16, right: -0.16 }, 0.363).expect_err("negative");
        assert_eq!(error, GeometryError::NotPositive { quantity: "right_wheel_diameter_m", value: -0.16 });
        assert!(DriveGeometry::new(Wheels::both(0.16), f64::NAN).is_err());
        assert!(yair().m_per_count(0.0).is_err());
    }

    proptest! {
        #[test]
        fn travel_and_increment_are_inverse(distance_m in -5.0..5.0, turn_rad in -20.0..20.0) {
            let increment = Increment { distance_m, turn_rad };
            let back = yair().increment(yair().travel_m(increment));
            // Cancellation of metres over 0.363 m: a few ε·5/0.363.
            prop_assert!((back.distance_m - distance_m).abs() < 1e-14);
            prop_assert!((back.turn_rad - turn_rad).abs() < 2e-14);
        }

        #[test]
        fn an_arc_is_the_sum_of_its_parts(distance_m in -2.0..2.0, turn_rad in -9.0..9.0, share in 0.0..1.0) {
            let part = |share: f64| Increment { distance_m: share * distance_m, turn_rad: share * turn_rad }.arc();
            let whole = part(1.0);
            let parts = part(share) * part(1.0 - share);
            prop_assert!(whole.position().distance_m(parts.position()) < 1e-14);
            prop_assert!((whole.theta_rad - parts.theta_rad).abs() < 1e-14);
        }
    }

    #[test]
    fn the_straight_line_is_the_limit_of_the_arc() {
        for turn_rad in [0.0, 1e-12, 1e-4, 2e-4, 2.1e-4] {
            let arc = Increment { distance_m: 3.0, turn_rad }.arc();
            // Sagitta of a 3 m arc: s·θ/2; the chord falls short by s·θ²/24.
            assert!((arc.y_m - 1.5 * turn_rad).abs() < 3.0 * turn_rad.powi(3) + 1e-15);
            assert!((arc.x_m - 3.0).abs() < 3.0 * turn_rad * turn_rad / 5.0 + 1e-15);
        }
    }

    #[test]
    fn a_quarter_circle_ends_at_one_radius_ahead_and_one_aside() {
        let radius_m = 0.375;
        let arc = Increment { distance_m: radius_m * PI / 2.0, turn_rad: PI / 2.0 }.arc();
        assert!((arc.x_m - radius_m).abs() < 1e-15 && (arc.y_m - radius_m).abs() < 1e-15);
        // The midpoint rule takes the arc for the chord: 11 % too long here. It is a rule for short steps.
        let midpoint = Increment { distance_m: radius_m * PI / 2.0, turn_rad: PI / 2.0 }.midpoint();
        assert!((midpoint.x_m / arc.x_m - PI / 4.0 / (PI / 4.0).sin()).abs() < 1e-15);
    }
}
