//! Some of a log's rows, in all columns alike.

use kinematics::Wheels;

use crate::record::{Odometry, WheelLog};

impl Odometry {
    /// Leaves the rows out that are not to be kept. Of cumulative wheels nothing of the motion is lost with
    /// them. `keep` is as long as [`Self::t_s`].
    pub fn retain_rows(&mut self, keep: &[bool]) {
        fn retain<T>(column: &mut Vec<T>, keep: &[bool]) {
            let mut kept = keep.iter();
            column.retain(|_| kept.next().is_none_or(|kept| *kept));
        }
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
