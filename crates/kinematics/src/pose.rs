//! Poses and points in the plane: the group SE(2) with its whole turns kept.

use std::ops::Mul;

use crate::elementary::{Branching, Elementary};
use crate::trig::sin_cos;

/// A point in some frame, metres.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Point {
    /// Along the frame's x axis.
    pub x_m: f64,
    /// Along the frame's y axis.
    pub y_m: f64,
}

impl Point {
    /// A point from its coordinates, metres.
    #[must_use]
    pub const fn new(x_m: f64, y_m: f64) -> Self {
        Self { x_m, y_m }
    }

    /// Distance to another point of the same frame, metres, from 1e-150 to 1e150.
    #[inline]
    #[must_use]
    pub fn distance_m(self, other: Self) -> f64 {
        let (x_m, y_m) = (self.x_m - other.x_m, self.y_m - other.y_m);
        (x_m * x_m + y_m * y_m).sqrt()
    }
}

/// A planar rigid transform `a_from_b`: where frame `b` stands in frame `a`.
///
/// `theta_rad` is *not* wrapped: a robot that has spun twice is at 4π, because whole turns carry information
/// about the wheelbase. Use [`crate::wrap_to_pi`] to compare directions.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Pose {
    /// Position of b's origin along a's x axis, metres.
    pub x_m: f64,
    /// Position of b's origin along a's y axis, metres.
    pub y_m: f64,
    /// Heading of b's x axis in a, radians, counter-clockwise, whole turns counted.
    pub theta_rad: f64,
}

impl Pose {
    /// The two frames coincide.
    pub const IDENTITY: Self = Self { x_m: 0.0, y_m: 0.0, theta_rad: 0.0 };

    /// A pose from position (metres) and heading (radians).
    #[must_use]
    pub const fn new(x_m: f64, y_m: f64, theta_rad: f64) -> Self {
        Self { x_m, y_m, theta_rad }
    }

    /// b's origin in a.
    #[must_use]
    pub const fn position(self) -> Point {
        Point { x_m: self.x_m, y_m: self.y_m }
    }

    /// `b_from_a`.
    #[inline]
    #[must_use]
    pub fn inverse(self) -> Self {
        Frame::from(self).inverse().pose()
    }

    /// `b_from_c` where `self` is `a_from_b` and `a_from_c` is given: the second pose seen from the first.
    #[inline]
    #[must_use]
    pub fn to(self, a_from_c: Self) -> Self {
        Frame::from(self).inverse() * a_from_c
    }
}

impl Mul for Pose {
    type Output = Self;

    /// `a_from_b * b_from_c = a_from_c`.
    #[inline]
    fn mul(self, b_from_c: Self) -> Self {
        Frame::from(self) * b_from_c
    }
}

impl Mul<Point> for Pose {
    type Output = Point;

    /// A point of b, seen from a.
    #[inline]
    fn mul(self, point_in_b: Point) -> Point {
        Frame::from(self) * point_in_b
    }
}

/// A rotation of the plane, by the sine and cosine of its angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rotation {
    /// Sine of the angle.
    pub sin: f64,
    /// Its cosine.
    pub cos: f64,
}

impl Rotation {
    /// By an angle.
    #[inline(always)]
    #[must_use]
    pub fn by(angle_rad: f64) -> Self {
        let (sin, cos) = sin_cos(angle_rad);
        Self { sin, cos }
    }
}

/// A pose `a_from_b` with the sine and cosine of its heading at hand: several products from the left cost one
/// sine and cosine, and give the same bits as
/// [`Pose`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    a_from_b: Pose,
    sin: f64,
    cos: f64,
}

impl Frame {
    /// A pose whose heading's sine and cosine are known.
    #[inline]
    pub(crate) const fn with_heading(a_from_b: Pose, Rotation { sin, cos }: Rotation) -> Self {
        Self { a_from_b, sin, cos }
    }

    /// A pose as a frame, by given elementary functions.
    #[inline(always)]
    #[must_use]
    pub fn by(elementary: &impl Elementary, a_from_b: Pose) -> Self {
        let (sin, cos) = elementary.sin_cos(a_from_b.theta_rad);
        Self { a_from_b, sin, cos }
    }

    /// The pose's x, y and heading, and sine and cosine of that: as [`Self::from_numbers`] takes them.
    #[inline(always)]
    #[must_use]
    pub const fn numbers(self) -> [f64; 5] {
        let Self { a_from_b: Pose { x_m, y_m, theta_rad }, sin, cos } = self;
        [x_m, y_m, theta_rad, sin, cos]
    }

    /// A frame by its [`Self::numbers`].
    #[inline(always)]
    #[must_use]
    pub const fn from_numbers([x_m, y_m, theta_rad, sin, cos]: [f64; 5]) -> Self {
        Self { a_from_b: Pose::new(x_m, y_m, theta_rad), sin, cos }
    }

    /// The pose at another place, m.
    #[inline]
    #[must_use]
    pub const fn moved_by(mut self, x_m: f64, y_m: f64) -> Self {
        self.a_from_b.x_m += x_m;
        self.a_from_b.y_m += y_m;
        self
    }

    /// The pose itself.
    #[inline(always)]
    #[must_use]
    pub const fn pose(&self) -> Pose {
        self.a_from_b
    }

    /// `b_from_a`.
    #[inline(always)]
    #[must_use]
    pub fn inverse(self) -> Self {
        let Self { a_from_b: Pose { x_m, y_m, theta_rad }, sin, cos } = self;
        Self { a_from_b: Pose::new(-cos * x_m - sin * y_m, sin * x_m - cos * y_m, -theta_rad), sin: -sin, cos }
    }
}

impl From<Pose> for Frame {
    #[inline]
    fn from(a_from_b: Pose) -> Self {
        Self::by(&Branching, a_from_b)
    }
}

impl Mul for Frame {
    type Output = Self;

    /// `a_from_b * b_from_c = a_from_c`, sine and cosine by the addition theorem: each product adds a
    /// rounding of 2e-16 rad to them, where the product with a
    /// [`Pose`] adds none and costs a sine and cosine.
    #[inline(always)]
    fn mul(self, b_from_c: Self) -> Self {
        Self {
            a_from_b: self * b_from_c.a_from_b,
            sin: self.sin * b_from_c.cos + self.cos * b_from_c.sin,
            cos: self.cos * b_from_c.cos - self.sin * b_from_c.sin,
        }
    }
}

impl Mul<Pose> for Frame {
    type Output = Pose;

    /// `a_from_b * b_from_c = a_from_c`.
    #[inline(always)]
    fn mul(self, b_from_c: Pose) -> Pose {
        let position = self * b_from_c.position();
        Pose::new(position.x_m, position.y_m, self.a_from_b.theta_rad + b_from_c.theta_rad)
    }
}

impl Mul<Point> for Frame {
    type Output = Point;

    /// A point of b, seen from a.
    #[inline(always)]
    fn mul(self, point_in_b: Point) -> Point {
        Point {
            x_m: self.a_from_b.x_m + self.cos * point_in_b.x_m - self.sin * point_in_b.y_m,
            y_m: self.a_from_b.y_m + self.sin * point_in_b.x_m + self.cos * point_in_b.y_m,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn poses() -> impl Strategy<Value = Pose> {
        (-10.0..10.0, -10.0..10.0, -9.0..9.0).prop_map(|(x, y, theta)| Pose::new(x, y, theta))
    }

    fn assert_close(a: Pose, b: Pose) {
        // Coordinates up to 30 m through three rotations: a few dozen roundings of 30·ε.
        let tolerance = 1e-12;
        assert!(
            (a.x_m - b.x_m).abs() < tolerance
                && (a.y_m - b.y_m).abs() < tolerance
                && (a.theta_rad - b.theta_rad).abs() < tolerance,
            "{a:?} != {b:?}"
        );
    }

    proptest! {
        #[test]
        fn poses_form_a_group(a in poses(), b in poses(), c in poses()) {
            assert_close((a * b) * c, a * (b * c));
            assert_close(a * a.inverse(), Pose::IDENTITY);
            assert_close(a * Pose::IDENTITY, a);
            assert_close(a * a.to(b), b);
        }

        #[test]
        fn a_point_goes_through_a_product_as_through_its_factors(a in poses(), b in poses(), x in -5.0..5.0, y in -5.0..5.0) {
            let point = Point::new(x, y);
            prop_assert!(((a * b) * point).distance_m(a * (b * point)) < 1e-12);
        }
    }

    #[test]
    fn whole_turns_are_kept() {
        let turn = Pose::new(0.0, 0.0, 2.0 * std::f64::consts::TAU);
        assert_eq!((turn * turn).theta_rad, 4.0 * std::f64::consts::TAU);
    }

    #[test]
    fn the_left_wheel_of_a_robot_facing_north_is_in_the_west() {
        let world_from_body = Pose::new(1.0, 2.0, std::f64::consts::FRAC_PI_2);
        let wheel = world_from_body * Point::new(0.0, 0.2);
        assert!(wheel.distance_m(Point::new(0.8, 2.0)) < 1e-15);
    }
}
