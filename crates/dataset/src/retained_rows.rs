//! Some of a log's rows, in all columns alike, and some of the instrument's.

use kinematics::Wheels;

use crate::record::{Odometry, Run, WheelLog};

fn retain<T>(column: &mut Vec<T>, keep: &[bool]) {
    let mut kept = keep.iter();
    column.retain(|_| kept.next().is_none_or(|kept| *kept));
}

impl Run {
    /// Leaves the poses of the instrument out that are not to be kept. `keep` is as long as [`Self::truth`].
    pub fn retain_truth(&mut self, keep: &[bool]) {
        retain(&mut self.truth, keep);
        self.truth_sigma.iter_mut().for_each(|sigmas| retain(sigmas, keep));
    }
}

impl Odometry {
    /// Leaves the rows out that are not to be kept. Of cumulative wheels nothing of the motion is lost with
    /// them. `keep` is as long as [`Self::t_s`].
    pub fn retain_rows(&mut self, keep: &[bool]) {
        retain(&mut self.t_s, keep);
        match &mut self.wheels {
            WheelLog::Ticks(Wheels { left, right }) => {
                [left, right].into_iter().for_each(|column| retain(column, keep));
            }
            WheelLog::Angles(Wheels { left, right })
            | WheelLog::Speeds(Wheels { left, right })
            | WheelLog::Twist { v_mps: left, omega_radps: right } => {
                [left, right].into_iter().for_each(|column| retain(column, keep));
            }
        }
        self.extra.values_mut().for_each(|column| retain(column, keep));
    }
}
