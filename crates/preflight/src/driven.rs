//! How a robot was driven, by its stated lengths: what a person can check against what was done.

use dataset::Session;
use kinematics::Wheels;

use crate::run_log::{RunLog, m_per_rad};
use crate::settings::CHECKS;
use crate::windows::{Reading, windows};

/// Turns, distance and speed of all runs.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Driven {
    /// Turns to the left, radians.
    pub left_rad: f64,
    /// Turns to the right, radians.
    pub right_rad: f64,
    /// Distance, forward and backward, metres.
    pub distance_m: f64,
    /// How much of it was driven straight, metres.
    pub straight_m: f64,
    /// The largest speed for half a second, m/s.
    pub fastest_m_s: f64,
    /// Did an instrument see the robot often enough to compare its motion with that of the wheels?
    pub is_followed: bool,
}

impl Driven {
    /// Of all runs of one robot's sessions.
    #[must_use]
    pub fn of(sessions: &[Session<'_>]) -> Self {
        let mut sum = Self::default();
        for session in sessions {
            let runs: Vec<RunLog> = session.runs.iter().filter_map(|run| RunLog::of(run, session.robot)).collect();
            let m_per_rad = m_per_rad(session.robot);
            runs.iter().for_each(|run| sum.add(run, session.robot.wheel_separation_m, m_per_rad));
            sum.is_followed |= windows(&runs, Reading::AS_IS, CHECKS.max_windows).0.len() >= CHECKS.min_windows;
        }
        sum
    }

    /// Adds a run. A turn is reversed where the heading comes back by `min_reversal_rad`: less is steering.
    pub(crate) fn add(&mut self, run: &RunLog, separation_m: f64, m_per_rad: Wheels<f64>) {
        let rolled_m = |row: usize| Wheels {
            left: m_per_rad.left * run.wheels.left[row],
            right: m_per_rad.right * run.wheels.right[row],
        };
        let heading_rad = |row: usize| {
            let rolled = rolled_m(row);
            (rolled.right - rolled.left) / separation_m
        };
        let Some(last) = run.t_s.len().checked_sub(1) else { return };
        // The heading where the last turn was reversed, and the farthest since.
        let (mut from_rad, mut farthest_rad) = (heading_rad(0), heading_rad(0));
        let mut window = 0;
        for row in 1..=last {
            let now_rad = heading_rad(row);
            if (now_rad - from_rad).abs() > (farthest_rad - from_rad).abs() {
                farthest_rad = now_rad;
            } else if (now_rad - farthest_rad).abs() > CHECKS.min_reversal_rad {
                self.turn(farthest_rad - from_rad);
                (from_rad, farthest_rad) = (farthest_rad, now_rad);
            }
            let length_s = run.t_s[row] - run.t_s[window];
            if length_s >= CHECKS.window_s || row == last {
                let by = rolled_m(row).zip_with(rolled_m(window), |now, before| now - before);
                let distance_m = 0.5 * (by.left + by.right).abs();
                let turned_rad = ((by.right - by.left) / separation_m).abs();
                self.distance_m += distance_m;
                if turned_rad * separation_m <= CHECKS.max_straight_curvature * distance_m {
                    self.straight_m += distance_m;
                }
                if length_s >= CHECKS.window_s {
                    self.fastest_m_s = self.fastest_m_s.max(distance_m / length_s);
                }
                window = row;
            }
        }
        self.turn(farthest_rad - from_rad);
    }

    fn turn(&mut self, by_rad: f64) {
        if by_rad > 0.0 { self.left_rad += by_rad } else { self.right_rad -= by_rad }
    }

    /// In words, behind "the runs".
    #[must_use]
    pub fn sentence(&self) -> String {
        let Self { left_rad, right_rad, distance_m, straight_m, fastest_m_s, .. } = self;
        format!(
            "turn by {left_rad:.1} rad to the left and {right_rad:.1} rad to the right and drive {distance_m:.1} m, \
             {straight_m:.1} m of it straight, at up to {fastest_m_s:.2} m/s, by the stated robot"
        )
    }
}
