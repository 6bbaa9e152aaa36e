//! A run by its nominal odometry, for what needs the motion between two near instants.

use dataset::{NominalRobot, RunView};
use kinematics::{Pose, Rule, wrap_to_pi};

/// Poses at the rows of a run, with headings that are not wrapped.
#[derive(Debug, Clone, Default)]
pub(crate) struct NominalPath {
    t_s: Vec<f64>,
    poses: Vec<Pose>,
}

impl NominalPath {
    pub(crate) fn of(run: &RunView<'_>, robot: &NominalRobot) -> Self {
        let mut path = Self::default();
        let Ok(geometry) = robot.geometry() else { return path };
        run.dead_reckon(robot, &geometry, Rule::Midpoint, Pose::IDENTITY, |t_s, pose| {
            let before_rad = path.poses.last().map_or(0.0, |last: &Pose| last.theta_rad);
            let theta_rad = before_rad + wrap_to_pi(pose.theta_rad - before_rad);
            path.t_s.push(t_s);
            path.poses.push(Pose { theta_rad, ..pose });
        });
        path
    }

    /// The pose at an instant of the log; between two rows each coordinate is linear.
    pub(crate) fn at(&self, t_s: f64) -> Option<Pose> {
        let next = self.t_s.partition_point(|row_s| *row_s <= t_s);
        let before = next.checked_sub(1)?;
        let from = self.poses[before];
        let Some(to) = self.poses.get(next) else { return (self.t_s[before] == t_s).then_some(from) };
        let share = (t_s - self.t_s[before]) / (self.t_s[next] - self.t_s[before]);
        let between = |a: f64, b: f64| a + share * (b - a);
        Some(Pose {
            x_m: between(from.x_m, to.x_m),
            y_m: between(from.y_m, to.y_m),
            theta_rad: between(from.theta_rad, to.theta_rad),
        })
    }

    /// Metres that the drive's centre moves between two instants, and radians that it turns, both ways alike.
    pub(crate) fn moved(&self, from_s: f64, to_s: f64) -> Option<(f64, f64)> {
        let mut before = self.at(from_s)?;
        let rows = self.t_s.partition_point(|row_s| *row_s <= from_s)..self.t_s.partition_point(|row_s| *row_s < to_s);
        let (mut moved_m, mut turned_rad) = (0.0, 0.0);
        for next in self.poses[rows].iter().copied().chain([self.at(to_s)?]) {
            moved_m += before.position().distance_m(next.position());
            turned_rad += (next.theta_rad - before.theta_rad).abs();
            before = next;
        }
        Some((moved_m, turned_rad))
    }
}
