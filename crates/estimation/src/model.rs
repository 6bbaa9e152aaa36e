//! The mean parameters: the three geometry parameters, the instrument's extrinsics and latency, and the
//! values of further terms.

use std::collections::BTreeMap;

use kinematics::{DriveGeometry, Increment, Pose, Twist, Wheels};
use nalgebra::DVector;

use crate::wheel_angles::WheelInterval;

/// A mean parameter, in the order of the columns of every normal equation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Column {
    /// Relative change of the left wheel's diameter.
    LeftWheel,
    /// Relative change of the right wheel's diameter.
    RightWheel,
    /// Relative change of the wheel separation.
    Separation,
    /// Position of the instrument ahead of the drive's centre, metres.
    SensorX,
    /// Its position to the left, metres.
    SensorY,
    /// Its heading on the robot, radians.
    SensorTheta,
    /// Latency of the measurements' time stamps, seconds.
    Latency,
    /// Relative scale of a gyroscope: it shows (1 + scale) times the turn.
    GyroScale,
    /// A parameter of a further term, by its index among all of them.
    Term(usize),
}

impl Column {
    /// The columns that every pass carries, before those of further terms.
    pub const BASE: [Self; 8] = [
        Self::LeftWheel,
        Self::RightWheel,
        Self::Separation,
        Self::SensorX,
        Self::SensorY,
        Self::SensorTheta,
        Self::Latency,
        Self::GyroScale,
    ];

    /// The drive's geometry parameters.
    pub const GEOMETRY: [Self; 3] = [Self::LeftWheel, Self::RightWheel, Self::Separation];

    /// The instrument's extrinsics.
    pub const EXTRINSICS: [Self; 3] = [Self::SensorX, Self::SensorY, Self::SensorTheta];

    /// Its index in a normal equation.
    #[must_use]
    pub const fn index(self) -> usize {
        match self {
            Self::LeftWheel => 0,
            Self::RightWheel => 1,
            Self::Separation => 2,
            Self::SensorX => 3,
            Self::SensorY => 4,
            Self::SensorTheta => 5,
            Self::Latency => 6,
            Self::GyroScale => 7,
            Self::Term(number) => Self::BASE.len() + number,
        }
    }
}

/// Extrinsics and latency of an instrument.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instrument {
    /// Its frame on the robot.
    pub body_from_sensor: Pose,
    /// Latency of its measurements' time stamps, seconds.
    pub latency_s: f64,
}

/// Which groups of runs have extrinsics and latency of their own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Grouping {
    /// Each session.
    Session,
    /// Each run.
    Run,
}

impl Grouping {
    /// The group of a run: its session, and the run itself where each run is a group.
    #[must_use]
    pub const fn group(self, run: (usize, usize)) -> (usize, usize) {
        match self {
            Self::Session => (run.0, 0),
            Self::Run => run,
        }
    }
}

/// The columns that each group has for itself, and their values.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupExtrinsics {
    /// The groups.
    pub grouping: Grouping,
    /// Its own columns, of extrinsics and latency.
    pub columns: Vec<Column>,
    /// The instruments found, by group.
    pub of: BTreeMap<(usize, usize), Instrument>,
}

impl GroupExtrinsics {
    /// Values common to all, to start from.
    #[must_use]
    pub fn new(grouping: Grouping, columns: Vec<Column>) -> Self {
        Self { grouping, columns, of: BTreeMap::new() }
    }
}

/// Values of the mean parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// Travel of each wheel for a radian, metres.
    pub m_per_rad: Wheels<f64>,
    /// Distance between the wheel contacts, metres.
    pub separation_m: f64,
    /// The instrument's frame on the robot, where it is common to all.
    pub body_from_sensor: Pose,
    /// Latency of the measurements' time stamps, seconds, where it is common to all.
    pub latency_s: f64,
    /// Relative scale of the gyroscope.
    pub gyro_scale: f64,
    /// Instruments that sessions or runs have for themselves.
    pub own: Option<GroupExtrinsics>,
    /// Values of the further terms' parameters, in their units.
    pub term_values: Vec<f64>,
}

impl Model {
    /// The values of the terms up to the last that has one: terms that are only tested are many, and have the
    /// value zero.
    pub(crate) fn sized_terms(&self) -> &[f64] {
        let sized = self.term_values.iter().rposition(|size| *size != 0.0).map_or(0, |last| last + 1);
        &self.term_values[..sized]
    }

    /// A drive whose instrument is at its centre and without latency, with further terms at zero.
    #[must_use]
    pub fn of(geometry: &DriveGeometry, term_parameters: usize) -> Self {
        Self {
            m_per_rad: geometry.m_per_rad(),
            separation_m: geometry.wheel_separation_m(),
            body_from_sensor: Pose::IDENTITY,
            latency_s: 0.0,
            gyro_scale: 0.0,
            own: None,
            term_values: vec![0.0; term_parameters],
        }
    }

    pub(crate) const fn common_instrument(&self) -> Instrument {
        Instrument { body_from_sensor: self.body_from_sensor, latency_s: self.latency_s }
    }

    /// Motion of the drive's centre when the wheels turn by this much.
    #[inline]
    #[must_use]
    pub fn increment(&self, wheel_rad: Wheels<f64>) -> Increment {
        let travel_m = self.m_per_rad.zip_with(wheel_rad, |m_per_rad, rad| m_per_rad * rad);
        Increment::from_travel(travel_m, self.separation_m)
    }

    /// Velocity of the drive's centre at rates of the wheels.
    #[inline(always)]
    pub(crate) fn twist(&self, rate_rad_s: Wheels<f64>) -> Twist {
        let Increment { distance_m, turn_rad } = self.increment(rate_rad_s);
        Twist { v_m_s: distance_m, omega_rad_s: turn_rad }
    }

    /// How far the centre goes across the middle heading of an interval because its wheels do not turn
    /// evenly, metres ([`WheelInterval::chord_area_rad2`]). A row of 0.1 s in which a robot at 0.3 m/s begins
    /// to turn by 2.5 rad/s² goes 0.06 mm aside, each such row the same way.
    #[inline(always)]
    pub(crate) fn across_m(&self, interval: &WheelInterval) -> f64 {
        self.m_per_rad.left * self.m_per_rad.right / self.separation_m * interval.chord_area_rad2
    }

    /// The instrument of a run: session and run in the order given.
    #[must_use]
    pub fn instrument(&self, run: (usize, usize)) -> Instrument {
        let common = self.common_instrument();
        let Some(own) = &self.own else { return common };
        let Some(of_group) = own.of.get(&own.grouping.group(run)) else { return common };
        let of = |column: Column| if own.columns.contains(&column) { of_group } else { &common };
        let x_m = of(Column::SensorX).body_from_sensor.x_m;
        let y_m = of(Column::SensorY).body_from_sensor.y_m;
        let theta_rad = of(Column::SensorTheta).body_from_sensor.theta_rad;
        Instrument { body_from_sensor: Pose { x_m, y_m, theta_rad }, latency_s: of(Column::Latency).latency_s }
    }

    /// Moves the columns that a group has for itself.
    pub(crate) fn advance_own(&mut self, group: (usize, usize), by: &DVector<f64>) {
        let common = self.common_instrument();
        let Some(own) = &mut self.own else { return };
        let Instrument { body_from_sensor, latency_s } = own.of.entry(group).or_insert(common);
        for (column, by) in own.columns.iter().zip(by.iter()) {
            match column {
                Column::SensorX => body_from_sensor.x_m += by,
                Column::SensorY => body_from_sensor.y_m += by,
                Column::SensorTheta => body_from_sensor.theta_rad += by,
                _ => *latency_s += by,
            }
        }
    }

    /// Moves one parameter by a step of its column.
    pub fn advance(&mut self, column: Column, by: f64) {
        match column {
            Column::LeftWheel => self.m_per_rad.left *= by.exp(),
            Column::RightWheel => self.m_per_rad.right *= by.exp(),
            Column::Separation => self.separation_m *= by.exp(),
            Column::SensorX => self.body_from_sensor.x_m += by,
            Column::SensorY => self.body_from_sensor.y_m += by,
            Column::SensorTheta => self.body_from_sensor.theta_rad += by,
            Column::Latency => self.latency_s += by,
            Column::GyroScale => self.gyro_scale += by,
            Column::Term(number) => self.term_values[number] += by,
        }
    }
}
