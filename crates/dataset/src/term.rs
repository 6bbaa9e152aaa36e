//! A term of the measurement model: what an unmodelled effect adds to the odometry, as a function of recorded quantities.
//!
//! The trait lives here, below both the calibrators, whose likelihood consumes terms, and the effects, which implement them. A term sees what was
//! recorded and the robot's nominal values; it cannot see what a simulator hid.

use kinematics::{Increment, Pose, Wheels};

/// One interval between two recorded rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Length, seconds.
    pub dt_s: f64,
    /// Travel of each wheel by its counts and the geometry in force, metres.
    pub travel_m: Wheels<f64>,
    /// Distance between the wheels in force, metres.
    pub wheel_separation_m: f64,
}

impl Interval {
    /// Motion of the drive's centre by the counts.
    #[must_use]
    pub fn increment(&self) -> Increment {
        Increment::from_travel(self.travel_m, self.wheel_separation_m)
    }
}

/// A parameter of a term.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TermParameter {
    /// Its name, with the unit's suffix; the same as in the effect's forward face where the two mean the same.
    pub name: &'static str,
    /// Its unit, for people.
    pub unit: &'static str,
}

/// A mean term: the body-frame increment that the effect adds in an interval, linear in its parameters.
///
/// State along the run (a castor's angle, a backlash) is kept by the implementor; [`Self::restart`] forgets it.
pub trait ModelTerm: Send {
    /// The parameters in the order of the gradient.
    fn parameters(&self) -> &'static [TermParameter];

    /// A run begins.
    fn restart(&mut self) {}

    /// Derivative of the interval's body-frame increment (x, y, θ) by each parameter, at zero size; `gradient` is as long as
    /// [`Self::parameters`].
    fn gradient(&mut self, interval: &Interval, gradient: &mut [Pose]);
}
