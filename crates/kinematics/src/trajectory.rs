//! Dead reckoning over the rows of a log: every pose, some of them, the last, or each with its covariance.
//!
//! The bits are those of [`DeadReckoning::update`] row by row; `whole_log.rs` finds them by blocks.

use crate::dead_reckoning::{CompensatedSum, GROUP, heading_rad};
use crate::elementary::{Elementary, Formula, by_lanes};
use crate::whole_log::{self, Every, Last, Rows};
use crate::{Count, DeadReckoning, InstructionSet, Odometry, OdometryCovariance, Pose, WheelNoise, Wheels};

impl Odometry {
    /// The pose at every row of a log, the first being the start pose.
    ///
    /// Cost: docs/performance.md; 24 bytes a row.
    ///
    /// # Panics
    /// When the two columns differ in length: they are columns of one table.
    #[must_use]
    pub fn trajectory<C: Count>(&self, start: Pose, counts: Wheels<&[C]>) -> Vec<Pose> {
        let mut poses = vec![start; counts.left.len()];
        self.trajectory_into(start, counts, &mut poses);
        poses
    }

    /// [`Self::trajectory`] into poses that are there.
    ///
    /// # Panics
    /// When the two columns and `poses` differ in length.
    pub fn trajectory_into<C: Count>(&self, start: Pose, counts: Wheels<&[C]>, poses: &mut [Pose]) {
        self.trajectory_into_by(InstructionSet::widest(), start, counts, poses);
    }

    /// [`Self::trajectory_into`] by a given instruction set: the same bits, at another speed.
    ///
    /// # Panics
    /// As [`Self::trajectory_into`].
    pub fn trajectory_into_by<C: Count>(
        &self,
        set: InstructionSet,
        start: Pose,
        counts: Wheels<&[C]>,
        poses: &mut [Pose],
    ) {
        assert_eq!(counts.left.len(), poses.len(), "one pose a row");
        let Some((state, steps)) = self.first_row(start, counts) else { return };
        if let Some((first, later)) = poses.split_first_mut() {
            *first = start;
            whole_log::walk(set, state, steps, Every(later));
        }
    }

    /// The pose at the last row of a log; the start pose for an empty one.
    ///
    /// # Panics
    /// When the two columns differ in length.
    #[must_use]
    pub fn final_pose<C: Count>(&self, start: Pose, counts: Wheels<&[C]>) -> Pose {
        let Some((state, steps)) = self.first_row(start, counts) else { return start };
        whole_log::walk(InstructionSet::widest(), state, steps, Last).world_from_body()
    }

    /// [`Self::final_pose`] of W logs side by side: `counts` row by row, cumulative, of every lane.
    #[inline(always)]
    #[must_use]
    pub fn final_poses<const W: usize>(
        &self,
        start: Pose,
        counts: impl Iterator<Item = Wheels<[f64; W]>>,
    ) -> [Pose; W] {
        let mut step = LogStep {
            odometry: self,
            rad_per_count: self.rad_per_count(),
            start_theta_rad: start.theta_rad,
            first: Wheels::both([0.0; W]),
            before: Wheels::both([0.0; W]),
            now: Wheels::both([0.0; W]),
            theta_rad: [start.theta_rad; W],
        };
        let mut places = [[start.x_m, start.y_m].map(CompensatedSum::at); W];
        let mut moved_m = [[0.0; W]; 2];
        for (row, counts) in counts.enumerate() {
            if row == 0 {
                (step.first, step.before) = (counts, counts);
                continue;
            }
            step.now = counts;
            let [dx_m, dy_m, theta_rad] = by_lanes(&step);
            for lane in 0..W {
                moved_m[0][lane] += dx_m[lane];
                moved_m[1][lane] += dy_m[lane];
            }
            (step.before, step.theta_rad) = (counts, theta_rad);
            if row % GROUP == 0 {
                for (lane, place) in places.iter_mut().enumerate() {
                    for (place, moved_m) in place.iter_mut().zip(&mut moved_m) {
                        place.moved_m = std::mem::take(&mut moved_m[lane]);
                        place.drop_anchor();
                    }
                }
            }
        }
        let pose = |lane: usize| {
            let [x, y] = &places[lane];
            Pose::new(x.after_m(moved_m[0][lane]), y.after_m(moved_m[1][lane]), step.theta_rad[lane])
        };
        std::array::from_fn(pose)
    }

    /// The poses at some rows of a log, nothing else being stored: `rows` count from 0 and do not fall.
    ///
    /// # Panics
    /// When the two columns differ in length, or a row is not among theirs or below the one before it.
    #[must_use]
    pub fn poses_at<C: Count>(&self, start: Pose, counts: Wheels<&[C]>, rows: &[usize]) -> Vec<Pose> {
        assert!(rows.is_sorted(), "rows in their order");
        assert!(rows.last().is_none_or(|last| *last < counts.left.len()), "rows of the log");
        let mut poses = vec![start; rows.iter().take_while(|row| **row == 0).count()];
        if let Some((state, steps)) = self.first_row(start, counts) {
            let rows = &rows[poses.len()..];
            whole_log::walk(InstructionSet::widest(), state, steps, Rows::new(rows, &mut poses));
        }
        poses
    }

    /// Calls `visit` with pose and covariance at every row of a log in order, storing nothing: each step an
    /// exact arc ([`OdometryCovariance::propagate`]) of wheels whose travel carries `noise`.
    ///
    /// # Panics
    /// When the two columns differ in length.
    pub fn for_each_pose_with_covariance<C: Count>(
        &self,
        start: Pose,
        covariance: OdometryCovariance,
        counts: Wheels<&[C]>,
        noise: &WheelNoise,
        mut visit: impl FnMut(Pose, &OdometryCovariance),
    ) {
        let (mut covariance, mut before) = (covariance, None);
        let mut rows = counts.left.iter().zip(counts.right);
        self.for_each_pose(start, counts, |pose| {
            let now = rows.next().map(|(&left, &right)| Wheels { left, right });
            if let (Some((from, before)), Some(now)) = (before, now) {
                let steps: Wheels<f64> = now.zip_with(before, C::since);
                let travel_m = steps.zip_with(self.m_per_count, |counts, m_per_count| counts * m_per_count);
                covariance.propagate(from, travel_m, self.wheel_separation_m, noise);
            }
            before = now.map(|now| (pose, now));
            visit(pose, &covariance);
        });
    }

    /// Calls `visit` with the pose at every row of a log in order, storing nothing.
    ///
    /// # Panics
    /// When the two columns differ in length.
    pub fn for_each_pose<C: Count>(&self, start: Pose, counts: Wheels<&[C]>, mut visit: impl FnMut(Pose)) {
        let Some((mut state, steps)) = self.first_row(start, counts) else { return };
        visit(start);
        if steps.left.len() < whole_log::MIN_STEPS_FOR_A_BLOCK {
            for (&left, &right) in steps.left.iter().zip(steps.right) {
                visit(state.update(Wheels { left, right }));
            }
            return;
        }
        // By blocks of a length at which the copy of the poses stays in the nearest cache.
        let mut poses = [start; whole_log::BLOCK];
        for (left, right) in steps.left.chunks(whole_log::BLOCK).zip(steps.right.chunks(whole_log::BLOCK)) {
            let poses = &mut poses[..left.len()];
            state = whole_log::walk(InstructionSet::widest(), state, Wheels { left, right }, Every(poses));
            poses.iter().copied().for_each(&mut visit);
        }
    }

    /// Dead reckoning at the first row of a log, and the rows that follow; `None` for an empty one.
    fn first_row<'a, C: Count>(
        &self,
        start: Pose,
        counts: Wheels<&'a [C]>,
    ) -> Option<(DeadReckoning<C>, Wheels<&'a [C]>)> {
        assert_eq!(counts.left.len(), counts.right.len(), "left and right counts are columns of one table");
        let ((left, later_left), (right, later_right)) = (counts.left.split_first()?, counts.right.split_first()?);
        Some((
            self.start(start, Wheels { left: *left, right: *right }),
            Wheels { left: later_left, right: later_right },
        ))
    }
}

/// A step of dead reckoning in lanes.
struct LogStep<'o, const W: usize> {
    odometry: &'o Odometry,
    rad_per_count: Wheels<f64>,
    start_theta_rad: f64,
    first: Wheels<[f64; W]>,
    before: Wheels<[f64; W]>,
    now: Wheels<[f64; W]>,
    theta_rad: [f64; W],
}

impl<const W: usize> Formula<3> for LogStep<'_, W> {
    /// Displacement along x and y, and the new heading: the arithmetic of [`DeadReckoning::update`].
    #[inline(always)]
    fn of<E: Elementary>(&self, lane: usize, elementary: &E) -> [f64; 3] {
        let at = |wheels: &Wheels<[f64; W]>| Wheels { left: wheels.left[lane], right: wheels.right[lane] };
        let (first, before, now) = (at(&self.first), at(&self.before), at(&self.now));
        let steps = Wheels { left: now.left - before.left, right: now.right - before.right };
        let (left, right) = (now.left - first.left, now.right - first.right);
        let theta_rad = heading_rad(self.start_theta_rad, self.rad_per_count, left, right);
        let [dx_m, dy_m] = self.odometry.displacement_m(elementary, steps, [self.theta_rad[lane], theta_rad]);
        [dx_m, dy_m, theta_rad]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rule;
    use proptest::prelude::*;

    fn yair(rule: Rule) -> Odometry {
        Odometry { m_per_count: Wheels { left: 1.0334e-3, right: 1.0322e-3 }, wheel_separation_m: 0.363, rule }
    }

    proptest! {
        #[test]
        fn online_and_whole_log_agree_to_the_bit(steps in prop::collection::vec((-40_i64..90, -40_i64..90), 1..200), exact: bool) {
            let odometry = yair(if exact { Rule::ExactArc } else { Rule::Midpoint });
            let (mut left, mut right) = (vec![7_i64], vec![-3_i64]);
            for (l, r) in &steps {
                left.push(left[left.len() - 1] + l);
                right.push(right[right.len() - 1] + r);
            }
            let start = Pose::new(1.0, -2.0, 0.3);
            let whole = odometry.trajectory(start, Wheels { left: &left[..], right: &right[..] });
            let mut online = odometry.start(start, Wheels { left: left[0], right: right[0] });
            prop_assert_eq!(whole[0], start);
            for k in 1..left.len() {
                prop_assert_eq!(online.update(Wheels { left: left[k], right: right[k] }), whole[k]);
            }
            prop_assert_eq!(odometry.final_pose(start, Wheels { left: &left[..], right: &right[..] }), whole[left.len() - 1]);
        }
    }

    /// Logs of three hundred rows that differ from lane to lane, past four groups of sums. Rejects, as was
    /// tried: groups that end a row late, and sums that go on from the group before.
    #[test]
    fn logs_side_by_side_end_where_each_ends_by_itself() {
        let start = Pose::new(0.3, -0.2, 0.1);
        let count = |lane: usize, row: usize, wheel: i64| {
            let (lane, row) = (lane as i64, row as i64);
            5 + lane + row * (40 + 7 * wheel) + (row * row * (3 + lane) + wheel * lane) % 50
        };
        let column = |lane, wheel| (0..300).map(move |row| count(lane, row, wheel)).collect::<Vec<_>>();
        let of_row = |row| {
            let wheel = |wheel| std::array::from_fn(|lane| count(lane, row, wheel) as f64);
            Wheels { left: wheel(0), right: wheel(1) }
        };
        for rule in [Rule::Midpoint, Rule::ExactArc] {
            let odometry = yair(rule);
            let found: [Pose; 4] = odometry.final_poses(start, (0..300).map(of_row));
            for (lane, found) in found.into_iter().enumerate() {
                let (left, right) = (column(lane, 0), column(lane, 1));
                let alone = odometry.final_pose(start, Wheels { left: &left[..], right: &right[..] });
                assert_eq!(found, alone, "{rule:?} {lane}");
            }
            assert_eq!(odometry.final_poses(start, std::iter::empty()), [start; 4]);
        }
    }

    #[test]
    fn an_empty_log_ends_where_it_starts() {
        let odometry = yair(Rule::Midpoint);
        let start = Pose::new(1.0, 2.0, 3.0);
        assert_eq!(odometry.final_pose::<i64>(start, Wheels { left: &[], right: &[] }), start);
        assert!(odometry.trajectory::<i64>(start, Wheels { left: &[], right: &[] }).is_empty());
    }
}
