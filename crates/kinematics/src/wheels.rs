//! One value for each of the two wheels, distinguished by name and never by position.

use std::ops::{Index, IndexMut};

/// Which wheel, seen from behind the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Side {
    /// The wheel at +y.
    Left,
    /// The wheel at −y.
    Right,
}

impl Side {
    /// Both sides, left first.
    pub const BOTH: [Self; 2] = [Self::Left, Self::Right];

    /// `"left"` or `"right"`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Right => "right",
        }
    }
}

/// A value for the left wheel and one for the right.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Wheels<T> {
    /// The left wheel's.
    pub left: T,
    /// The right wheel's.
    pub right: T,
}

impl<T> Wheels<T> {
    /// The same value for both wheels.
    pub fn both(value: T) -> Self
    where
        T: Clone,
    {
        Self { left: value.clone(), right: value }
    }

    /// Builds each wheel's value from its side.
    pub fn from_sides(mut value: impl FnMut(Side) -> T) -> Self {
        Self { left: value(Side::Left), right: value(Side::Right) }
    }

    /// Applies `f` to each wheel's value.
    #[inline(always)]
    pub fn map<U>(self, mut f: impl FnMut(T) -> U) -> Wheels<U> {
        Wheels { left: f(self.left), right: f(self.right) }
    }

    /// Combines two pairs wheel by wheel.
    #[inline(always)]
    pub fn zip_with<U, V>(self, other: Wheels<U>, mut f: impl FnMut(T, U) -> V) -> Wheels<V> {
        Wheels { left: f(self.left, other.left), right: f(self.right, other.right) }
    }

    /// Borrows both values.
    pub const fn as_ref(&self) -> Wheels<&T> {
        Wheels { left: &self.left, right: &self.right }
    }
}

impl<T> Index<Side> for Wheels<T> {
    type Output = T;

    fn index(&self, side: Side) -> &T {
        match side {
            Side::Left => &self.left,
            Side::Right => &self.right,
        }
    }
}

impl<T> IndexMut<Side> for Wheels<T> {
    fn index_mut(&mut self, side: Side) -> &mut T {
        match side {
            Side::Left => &mut self.left,
            Side::Right => &mut self.right,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_accessor_keeps_left_left() {
        let wheels = Wheels { left: 1, right: 2 };
        assert_eq!(wheels[Side::Left], 1);
        assert_eq!(wheels[Side::Right], 2);
        assert_eq!(wheels.map(|n| n * 10), Wheels { left: 10, right: 20 });
        assert_eq!(wheels.zip_with(Wheels { left: 5, right: 7 }, |a, b| b - a), Wheels { left: 4, right: 5 });
        assert_eq!(Wheels::from_sides(Side::name), Wheels { left: "left", right: "right" });
    }
}
