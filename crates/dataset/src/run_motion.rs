//! How a run moved by the stated robot, from row to row.

use kinematics::{DriveGeometry, Increment, Pose, Wheels};

use crate::counter::unwrap;
use crate::record::{NominalRobot, Odometry, WheelLog};
use crate::settings::OPPOSITE_WHEELS;

/// The motion over the interval that ends at each row but the first; `None` where the robot is none, or
/// counts have no resolution.
pub(crate) fn increments(odometry: &Odometry, robot: &NominalRobot) -> Option<Vec<Increment>> {
    let geometry = robot.geometry().ok()?;
    let dt_s = || odometry.t_s.windows(2).map(|pair| pair[1] - pair[0]);
    Some(match &odometry.wheels {
        WheelLog::Ticks(ticks) => {
            let m_per_count = geometry.m_per_count(robot.ticks_per_rev?).ok()?;
            let mut ticks = ticks.clone();
            if let Some(bits) = robot.counter_bits {
                [&mut ticks.left, &mut ticks.right].into_iter().for_each(|column| unwrap(column, bits));
            }
            let moved = |pair: &[i64]| pair[1].wrapping_sub(pair[0]) as f64;
            of_travel(&geometry, ticks.left.windows(2).map(moved), ticks.right.windows(2).map(moved), m_per_count)
        }
        WheelLog::Angles(angles) => {
            let moved = |pair: &[f64]| pair[1] - pair[0];
            let m_per_rad = geometry.m_per_rad();
            of_travel(&geometry, angles.left.windows(2).map(moved), angles.right.windows(2).map(moved), m_per_rad)
        }
        WheelLog::Speeds(speeds) => {
            let moved = |column: &[f64]| {
                column.iter().skip(1).zip(dt_s()).map(|(speed, dt_s)| speed * dt_s).collect::<Vec<f64>>()
            };
            let (left, right) = (moved(&speeds.left), moved(&speeds.right));
            of_travel(&geometry, left.into_iter(), right.into_iter(), Wheels::both(1.0))
        }
        WheelLog::Twist { v_mps, omega_radps } => {
            let rates = v_mps.iter().zip(omega_radps).skip(1).zip(dt_s());
            let increment = |((v_mps, omega_radps), dt_s): ((&f64, &f64), f64)| Increment {
                distance_m: v_mps * dt_s,
                turn_rad: omega_radps * dt_s,
            };
            rates.map(increment).collect()
        }
    })
}

fn of_travel(
    geometry: &DriveGeometry,
    left: impl Iterator<Item = f64>,
    right: impl Iterator<Item = f64>,
    m_per_unit: Wheels<f64>,
) -> Vec<Increment> {
    let travel_m = |(left, right)| Wheels { left, right }.zip_with(m_per_unit, |moved, m| moved * m);
    left.zip(right).map(|pair| geometry.increment(travel_m(pair))).collect()
}

/// The straight distance between the places at two instants, metres.
pub(crate) fn chord_m(odometry: &Odometry, robot: &NominalRobot, from_s: f64, to_s: f64) -> Option<f64> {
    let increments = increments(odometry, robot)?;
    let is_between = |t_s: f64| t_s > from_s && t_s <= to_s;
    let between = odometry.t_s.iter().skip(1).zip(increments).filter(|(t_s, _)| is_between(**t_s));
    let pose = between.fold(Pose::IDENTITY, |pose, (_, increment)| pose * increment.arc());
    Some(pose.x_m.hypot(pose.y_m))
}

/// How a run moved as a whole, by its nominal geometry.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct RunMotion {
    /// Signed path of the centre, metres.
    pub(crate) distance_m: f64,
    /// Net turn, radians.
    pub(crate) turn_rad: f64,
    /// Length of the path, forward and backward, metres.
    pub(crate) path_m: f64,
    /// From the smallest heading to the largest, radians.
    pub(crate) heading_range_rad: f64,
    /// How far the heading departs from one that grows evenly with the distance, radians.
    pub(crate) uneven_rad: f64,
    /// Sum of the turns' sizes, radians.
    pub(crate) turning_rad: f64,
    /// The part of it during which the wheels went in opposite directions, radians.
    pub(crate) on_the_spot_rad: f64,
}

impl RunMotion {
    /// `None` where the robot is none.
    pub(crate) fn of(odometry: &Odometry, robot: &NominalRobot) -> Option<Self> {
        let half_base_m = 0.5 * robot.wheel_separation_m;
        let increments = increments(odometry, robot)?;
        let mut motion = Self::default();
        let mut course = Vec::with_capacity(increments.len());
        for Increment { distance_m, turn_rad } in increments {
            motion.distance_m += distance_m;
            motion.turn_rad += turn_rad;
            motion.turning_rad += turn_rad.abs();
            motion.path_m += distance_m.abs();
            course.push((motion.distance_m, motion.turn_rad));
            if turn_rad.abs() * half_base_m > OPPOSITE_WHEELS * distance_m.abs() {
                motion.on_the_spot_rad += turn_rad.abs();
            }
        }
        let (mut lowest_rad, mut highest_rad) = (0.0_f64, 0.0_f64);
        let rad_per_m = motion.turn_rad / motion.distance_m;
        for (distance_m, turn_rad) in course {
            (lowest_rad, highest_rad) = (lowest_rad.min(turn_rad), highest_rad.max(turn_rad));
            motion.uneven_rad = motion.uneven_rad.max((turn_rad - rad_per_m * distance_m).abs());
        }
        motion.heading_range_rad = highest_rad - lowest_rad;
        Some(motion)
    }
}
