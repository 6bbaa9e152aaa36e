//! How a run without measured poses is compared with its instrument, which saw positions or motions only.
//!
//! Positions have no heading: the path is laid on those of its first tenth, by least squares, and the robot
//! has the dead-reckoned headings. Motions have no place: they are chained from where the path has the robot
//! at the first of them, and over what none of them saw by the path itself.

use dataset::{RunView, fit_rigid};
use kinematics::{Point, Pose};

use crate::named_calibration::NamedCalibration;
use crate::settings::{MIN_START_POSITIONS, START_SHARE, TIME_TOLERANCE_S};
use crate::starts_by::StartsBy;
use crate::trajectory::{Trajectory, at};

impl Trajectory {
    /// The same, where no pose was measured, beside positions or motions; unchanged where there are neither.
    pub(crate) fn beside_parts_of_poses(self, run: &RunView<'_>, calibration: Option<&NamedCalibration>) -> Self {
        let body_from_sensor = calibration.map_or(Pose::IDENTITY, NamedCalibration::body_from_sensor);
        let latency_s = calibration.map_or(0.0, NamedCalibration::latency_s);
        if !self.measured.is_empty() || self.log.is_empty() {
            self
        } else if !run.run().truth.is_empty() {
            self.beside_positions(run, body_from_sensor, latency_s)
        } else if run.run().displacements.is_empty() {
            self
        } else {
            self.beside_motions(run, body_from_sensor, latency_s)
        }
    }

    fn beside_positions(self, run: &RunView<'_>, body_from_sensor: Pose, latency_s: f64) -> Self {
        let mut row = 0;
        let seen: Vec<(f64, Pose, Point)> = run
            .run()
            .truth
            .iter()
            .filter_map(|sample| {
                let t_s = sample.t_s - latency_s;
                Some((t_s, at(&self.log, t_s, &mut row)?, Point::new(sample.x_m, sample.y_m)))
            })
            .collect();
        let first = self.log.iter().scan((0.0, self.log[0].1), |(rolled_m, before), (t_s, pose)| {
            *rolled_m += before.position().distance_m(pose.position());
            *before = *pose;
            (*rolled_m <= START_SHARE * self.length_m).then_some(*t_s)
        });
        let until_s = first.last().unwrap_or(f64::NEG_INFINITY);
        let count = seen.iter().take_while(|(t_s, ..)| *t_s <= until_s).count().max(MIN_START_POSITIONS);
        let start: Vec<(Point, Point)> = seen
            .iter()
            .take(count)
            .map(|(_, pose, position)| ((*pose * body_from_sensor).position(), *position))
            .collect();
        let Some(moved) = fit_rigid(start.iter().copied()) else {
            return Self {
                moved: Err("the robot does not move in the first tenth of its positions, which have no headings"),
                ..self
            };
        };
        let of_body = |(t_s, pose, position): (f64, Pose, Point)| {
            let there = (moved * pose * body_from_sensor).position();
            let robot = moved * pose;
            (
                t_s,
                Pose::new(robot.x_m + position.x_m - there.x_m, robot.y_m + position.y_m - there.y_m, robot.theta_rad),
            )
        };
        let measured = seen.into_iter().map(of_body).collect();
        Self { measured, moved: Ok(moved), starts_by: Some(StartsBy::FirstTenth), ..self }
    }

    fn beside_motions(self, run: &RunView<'_>, body_from_sensor: Pose, latency_s: f64) -> Self {
        let mut row = 0;
        let mut measured: Vec<(f64, Pose)> = Vec::new();
        let mut before: Option<(f64, Pose)> = None;
        for motion in &run.run().displacements {
            let [t0_s, t1_s] = [motion.t0_s - latency_s, motion.t1_s - latency_s];
            // One that begins before the last has ended says the same twice.
            if before.is_some_and(|(t_s, _)| t0_s < t_s - TIME_TOLERANCE_S) {
                continue;
            }
            let (Some(there), Some(after)) = (at(&self.log, t0_s, &mut row), at(&self.log, t1_s, &mut row)) else {
                continue;
            };
            let chained = match (before, measured.last()) {
                (Some((_, unseen_from)), Some((_, last))) => *last * unseen_from.to(there),
                _ => {
                    measured.push((t0_s, there));
                    there
                }
            };
            let by = Pose::new(motion.dx_m, motion.dy_m, motion.dtheta_rad);
            measured.push((t1_s, chained * body_from_sensor * by * body_from_sensor.inverse()));
            before = Some((t1_s, after));
        }
        let moved = if measured.is_empty() {
            Err("the displacements do not overlap the odometry in time")
        } else {
            Ok(Pose::IDENTITY)
        };
        Self { measured, moved, starts_by: Some(StartsBy::Chain), ..self }
    }
}
