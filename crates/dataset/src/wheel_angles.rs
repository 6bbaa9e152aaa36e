//! Wheel angles that go on where counters begin anew: most robots set their counters to zero at the start of
//! a log, and most people write a log a run.
//!
//! A wheel keeps its angle between two runs that follow each other, so that what depends on the angle (an
//! eccentric wheel) has one phase in all of them. A counter that reads at the start of a run what it read at
//! the start of the run before, though the wheels turned since, was set back: the angle goes on from the end
//! of the run before. A counter that went on says the angle by itself, also where the robot was driven
//! between the logs.

use kinematics::Wheels;

use crate::record::{Dataset, NominalRobot, Run, WheelLog};
use crate::settings::COUNTERS;

/// Follows the counters from run to run, in the order of the session.
#[derive(Debug, Clone, Default)]
pub(crate) struct AngleCarrier {
    /// What the counters read at the start and at the end of the run before, radians.
    before: Option<[Wheels<f64>; 2]>,
    /// What the angles are ahead of the readings by.
    ahead_rad: Wheels<f64>,
}

impl AngleCarrier {
    /// Sets what a run's wheels are ahead of its counters by.
    pub(crate) fn carry_into(&mut self, run: &mut Run, robot: &NominalRobot) {
        let Some(ends @ [start, _]) = readings_rad(&run.odometry.wheels, robot) else { return };
        if let Some([before_start, before_end]) = self.before {
            let is_near = |reading: Wheels<f64>| {
                let apart = start.zip_with(reading, |start, reading| (start - reading).abs());
                apart.left.max(apart.right) <= COUNTERS.same_start_rad
            };
            if is_near(before_end) {
                // They went on; what they were set back by before still counts.
            } else if is_near(before_start) {
                let turned = before_end.zip_with(before_start, |end, start| end - start);
                self.ahead_rad = self.ahead_rad.zip_with(turned, |ahead, turned| ahead + turned);
            } else {
                self.ahead_rad = Wheels::both(0.0);
            }
        }
        self.before = Some(ends);
        run.wheels_ahead_rad = self.ahead_rad;
    }
}

impl Dataset {
    /// Sets what each run's wheels are ahead of its counters by ([`Run::wheels_ahead_rad`]). Readers and
    /// importers do so; a dataset that is made of runs by hand may need it.
    pub fn carry_wheel_angles(&mut self) {
        let mut carrier = AngleCarrier::default();
        let Self { runs, robot, .. } = self;
        runs.iter_mut().for_each(|run| carrier.carry_into(run, robot));
    }
}

/// What the counters read at a log's first row and at its last, radians; `None` without counters.
fn readings_rad(wheels: &WheelLog, robot: &NominalRobot) -> Option<[Wheels<f64>; 2]> {
    fn ends<T: Copy>(columns: &Wheels<Vec<T>>, rad: impl Fn(T) -> f64) -> Option<[Wheels<f64>; 2]> {
        let first = Wheels { left: *columns.left.first()?, right: *columns.right.first()? };
        let last = Wheels { left: *columns.left.last()?, right: *columns.right.last()? };
        Some([first.map(&rad), last.map(&rad)])
    }
    match wheels {
        WheelLog::Ticks(ticks) => {
            let rad_per_tick = std::f64::consts::TAU / robot.ticks_per_rev?;
            ends(ticks, |count| count as f64 * rad_per_tick)
        }
        WheelLog::Angles(angles) => ends(angles, |angle_rad| angle_rad),
        WheelLog::Speeds(_) | WheelLog::Twist { .. } => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Odometry;

    fn dataset(runs: &[[[i64; 2]; 2]]) -> Dataset {
        let run = |[left, right]: &[[i64; 2]; 2]| Run {
            odometry: Odometry {
                t_s: vec![0.0, 1.0].into(),
                wheels: WheelLog::Ticks(Wheels { left: left.to_vec(), right: right.to_vec() }),
                ..Odometry::default()
            },
            ..Run::default()
        };
        let robot = NominalRobot {
            left_wheel_diameter_m: 0.16,
            right_wheel_diameter_m: 0.16,
            wheel_separation_m: 0.363,
            ticks_per_rev: Some(1000.0),
            counter_bits: None,
        };
        let mut dataset = Dataset {
            provenance: crate::Provenance::default(),
            robot,
            truth_noise: crate::TruthNoise::default(),
            points: Vec::new(),
            runs: runs.iter().map(run).collect(),
        };
        dataset.carry_wheel_angles();
        dataset
    }

    fn ahead_counts(runs: &[[[i64; 2]; 2]]) -> Vec<[i64; 2]> {
        let counts = |rad: f64| (rad * 1000.0 / std::f64::consts::TAU).round() as i64;
        let of = |run: &Run| [counts(run.wheels_ahead_rad.left), counts(run.wheels_ahead_rad.right)];
        dataset(runs).runs.iter().map(of).collect()
    }

    #[test]
    fn angles_go_on_where_counters_are_set_back() {
        // Rows of a log may begin some counts after the counter was set to zero.
        let zeroed = ahead_counts(&[[[0, 700], [0, 650]], [[3, 900], [0, 903]], [[0, 10], [2, -20]], [[0, 5], [0, 5]]]);
        assert_eq!(zeroed, [[0, 0], [700, 650], [1597, 1553], [1607, 1531]]);
    }

    #[test]
    fn counters_that_go_on_say_the_angle_by_themselves() {
        assert_eq!(ahead_counts(&[[[0, 700], [0, 650]], [[700, 900], [650, 80]]]), [[0, 0]; 2]);
        // The robot was driven between the logs.
        assert_eq!(ahead_counts(&[[[0, 700], [0, 650]], [[5000, 5100], [650, 80]]]), [[0, 0]; 2]);
        // Set back once, and on from there.
        let once = ahead_counts(&[[[0, 700], [0, 650]], [[0, 900], [0, 800]], [[900, 950], [800, 850]]]);
        assert_eq!(once, [[0, 0], [700, 650], [700, 650]]);
        // A robot that did not move says nothing of its counters.
        assert_eq!(ahead_counts(&[[[0, 0], [0, 0]], [[0, 5], [0, 5]]]), [[0, 0]; 2]);
    }
}
