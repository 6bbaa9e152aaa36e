//! What driving costs: time and travel of motion programs, by the robot's nominal values.
//!
//! The wheel that goes farther drives a trapezoid of speed, at most v at an acceleration a: s metres take
//! s/v + v/a, or 2 √(s/a) where s < v²/a leaves no room for the top. Travel is the mean of both wheels'
//! absolute travels, b|θ|/2 for a spin of the base b by θ: turning on the spot wears tyres and empties
//! batteries too, although the centre does not move.

use crate::program::{Motion, MotionProgram};

/// How fast a robot gets done what it is told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveLimits {
    /// Nominal distance between the wheel contacts, metres.
    pub wheel_separation_m: f64,
    /// Speed of the faster wheel's contact, m/s.
    pub cruise_speed_m_s: f64,
    /// Acceleration and deceleration of the faster wheel's contact, m/s².
    pub acceleration_m_s2: f64,
    /// What a person needs for each run, to place the robot and to read where it stands, seconds.
    pub handling_s: f64,
}

/// What some runs cost, in the units of a budget.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Cost {
    /// Driving and handling, minutes.
    pub minutes: f64,
    /// Mean of both wheels' absolute travels, metres.
    pub metres: f64,
}

impl Cost {
    const fn time(time_s: f64) -> Self {
        Self { minutes: time_s / 60.0, metres: 0.0 }
    }

    fn plus(self, other: Self) -> Self {
        Self { minutes: self.minutes + other.minutes, metres: self.metres + other.metres }
    }
}

impl std::iter::Sum for Cost {
    fn sum<I: Iterator<Item = Self>>(costs: I) -> Self {
        costs.fold(Self::default(), Self::plus)
    }
}

impl DriveLimits {
    /// What one run costs.
    #[must_use]
    pub fn cost(&self, program: &MotionProgram) -> Cost {
        program.motions.iter().map(|motion| self.motion(*motion)).sum::<Cost>().plus(Cost::time(self.handling_s))
    }

    fn motion(&self, motion: Motion) -> Cost {
        let (distance_m, turn_rad) = match motion {
            Motion::SpinAt { turn_rad, speed_m_s } => {
                return Self { cruise_speed_m_s: speed_m_s, ..*self }.motion(Motion::Spin { turn_rad });
            }
            Motion::Straight { length_m } => (length_m, 0.0),
            Motion::Spin { turn_rad } => (0.0, turn_rad),
            Motion::Arc { radius_m, turn_rad } => (radius_m * turn_rad.abs(), turn_rad),
            Motion::Pause { duration_s } => return Cost::time(duration_s),
            // A person's reading is part of the handling, and an instrument's takes no time.
            Motion::Measure => return Cost::default(),
        };
        let half_m = 0.5 * self.wheel_separation_m * turn_rad;
        let (left_m, right_m) = ((distance_m - half_m).abs(), (distance_m + half_m).abs());
        Cost { metres: 0.5 * (left_m + right_m), ..Cost::time(self.trapezoid_s(left_m.max(right_m))) }
    }

    fn trapezoid_s(&self, travel_m: f64) -> f64 {
        let (speed, acceleration) = (self.cruise_speed_m_s, self.acceleration_m_s2);
        if travel_m * acceleration < speed * speed {
            2.0 * (travel_m / acceleration).sqrt()
        } else {
            travel_m / speed + speed / acceleration
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::program::Schedule;
    use std::f64::consts::{FRAC_PI_2, TAU};

    /// v²/a = 0.125 m, so that half a metre has a top and a tenth has none.
    fn drive_limits() -> DriveLimits {
        DriveLimits { wheel_separation_m: 0.4, cruise_speed_m_s: 0.25, acceleration_m_s2: 0.5, handling_s: 0.0 }
    }

    fn close(found: Cost, time_s: f64, metres: f64) {
        // A few roundings of numbers near 100: 1e-13; a factor or a term forgotten is 1e-2 at least.
        let error = (60.0 * found.minutes - time_s).abs().max((found.metres - metres).abs());
        assert!(error < 1e-12, "{found:?}, not {time_s} s and {metres} m");
    }

    #[test]
    fn a_motion_takes_its_trapezoid_and_the_wheels_travel() {
        close(drive_limits().motion(Motion::Straight { length_m: -0.5 }), 2.0 + 0.5, 0.5);
        close(drive_limits().motion(Motion::Straight { length_m: 0.02 }), 2.0 * 0.2, 0.02);
        // A turn on the spot: 0.2 m of wheel a radian.
        close(drive_limits().motion(Motion::Spin { turn_rad: -5.0 }), 4.0 + 0.5, 1.0);
        // The same at half of the speed.
        close(drive_limits().motion(Motion::SpinAt { turn_rad: 5.0, speed_m_s: 0.125 }), 8.0 + 0.25, 1.0);
        // The inner wheel turns about its own contact: the outer one goes twice as far as the centre.
        close(drive_limits().motion(Motion::Arc { radius_m: 0.2, turn_rad: -5.0 }), 8.0 + 0.5, 1.0);
        // Inside the contact the inner wheel goes backward: its travel counts all the same.
        close(drive_limits().motion(Motion::Arc { radius_m: 0.1, turn_rad: 5.0 }), 6.0 + 0.5, 1.0);
        close(drive_limits().motion(Motion::Pause { duration_s: 3.0 }), 3.0, 0.0);
        assert_eq!(drive_limits().motion(Motion::Measure), Cost::default());
    }

    #[test]
    fn both_branches_of_the_trapezoid_meet() {
        let at = |travel_m: f64| drive_limits().trapezoid_s(travel_m);
        // The slope there is 1/v = 4 s/m: 1e-9 m on either side are 4e-9 s.
        assert!((at(0.125) - 1.0).abs() < 1e-15);
        assert!((at(0.125 - 1e-9) - 1.0).abs() < 5e-9 && (at(0.125 + 1e-9) - 1.0).abs() < 5e-9);
    }

    #[test]
    fn every_run_is_handled_once_and_costs_add_up() {
        let drive_limits = DriveLimits { handling_s: 30.0, ..drive_limits() };
        let squares = Schedule::Squares { side_m: 1.0, runs_each_way: 1 }.programs();
        let turn = 0.2 * FRAC_PI_2;
        let (time_s, metres) = (4.0 * (4.5 + turn / 0.25 + 0.5) + 30.0, 4.0 * (1.0 + turn));
        close(drive_limits.cost(&squares[0]), time_s, metres);
        close(squares.iter().map(|program| drive_limits.cost(program)).sum(), 2.0 * time_s, 2.0 * metres);
        let spin = &Schedule::Spins { turn_rad: TAU, runs: 1 }.programs()[0];
        close(drive_limits.cost(spin), 0.2 * TAU / 0.25 + 0.5 + 30.0, 0.2 * TAU);
    }
}
