//! A motion made ready to drive: what it tells the wheels, and how the closed form turns the shafts for it.

use effects::Command;
use kinematics::{DriveGeometry, Increment};
use motion_programs::Motion;
use scenario::Robot;

use crate::actuator::{RateSegment, RateSegments};

/// A motion with what follows from the robot's nominal values alone.
#[derive(Debug, Clone)]
pub(crate) enum PlannedMotion {
    /// The instruments read.
    Measure,
    /// Standing still.
    Pause { duration_s: f64 },
    /// Driving.
    Go {
        command: Command,
        /// How the closed form turns the shafts, where no effect has a say in it.
        segments: Option<Vec<RateSegment>>,
    },
}

impl PlannedMotion {
    /// A motion by the robot's nominal geometry; `segments` tells how the closed form would drive a command.
    pub(crate) fn new(
        motion: &Motion,
        robot: &Robot,
        nominal_geometry: &DriveGeometry,
        segments: impl Fn(&Command) -> Option<RateSegments>,
    ) -> Self {
        let cruise_m_s = robot.cruise_speed_m_s;
        let (increment, speed_m_s) = match *motion {
            Motion::Measure => return Self::Measure,
            Motion::Pause { duration_s } => return Self::Pause { duration_s },
            Motion::Straight { length_m } => (Increment { distance_m: length_m, turn_rad: 0.0 }, cruise_m_s),
            Motion::Spin { turn_rad } => (Increment { distance_m: 0.0, turn_rad }, cruise_m_s),
            Motion::SpinAt { turn_rad, speed_m_s } => (Increment { distance_m: 0.0, turn_rad }, speed_m_s),
            Motion::Arc { radius_m, turn_rad } => {
                (Increment { distance_m: radius_m * turn_rad.abs(), turn_rad }, cruise_m_s)
            }
        };
        let command = command(robot, nominal_geometry, increment, speed_m_s);
        Self::Go { command, segments: segments(&command).map(|segments| segments.as_slice().to_vec()) }
    }
}

/// What the wheels are told for a motion whose faster wheel has a speed, m/s: whole counts by the nominal
/// geometry, both wheels done at the same time.
fn command(robot: &Robot, nominal_geometry: &DriveGeometry, increment: Increment, speed_m_s: f64) -> Command {
    let travel_m = nominal_geometry.travel_m(increment);
    let counts_per_rad = robot.encoder.counts_per_wheel_turn() / std::f64::consts::TAU;
    let m_per_count = nominal_geometry.m_per_rad().map(|m_per_rad| m_per_rad / counts_per_rad);
    let travel_counts = travel_m.zip_with(m_per_count, |travel_m, m_per_count| (travel_m / m_per_count).round());
    let longest = travel_counts.left.abs().max(travel_counts.right.abs()).max(1.0);
    let speed_counts_s =
        travel_counts.zip_with(m_per_count, |counts, m_per_count| speed_m_s / m_per_count * (counts.abs() / longest));
    Command { travel_counts, speed_counts_s }
}
