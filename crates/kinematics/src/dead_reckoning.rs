//! Dead reckoning from cumulative wheel counts, online and over a whole log, to the same bits.
//!
//! Position follows eq. (3), `x += ΔS cos(θ+Δθ/2)`, with the arc as the chord ([`Rule::Midpoint`], the paper) or the exact
//! chord `ΔS·sinc(Δθ/2)` ([`Rule::ExactArc`]). Heading is *not* summed: it is a function of the counts since the start,
//! `θ = θ₀ + (C_R N_R − C_L N_L)/B`, so ten million steps leave no rounding drift in it and steps do not wait for each other.

use crate::trig::sin_cos;
use crate::{Pose, Wheels, sinc};

/// How one step's wheel travel becomes a displacement.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Rule {
    /// The paper's eq. (3): the arc length taken as the chord.
    #[default]
    Midpoint,
    /// The exact chord of the arc: midpoint × sinc(Δθ/2).
    ExactArc,
}

/// A cumulative wheel reading: integer counts or a real angle.
pub trait Count: Copy + Send + Sync {
    /// `self − earlier` as a real number. Integers subtract before they convert, so large counters lose nothing.
    fn since(self, earlier: Self) -> f64;
}

impl Count for i32 {
    fn since(self, earlier: Self) -> f64 {
        f64::from(self) - f64::from(earlier)
    }
}

impl Count for i64 {
    #[allow(clippy::cast_precision_loss)] // 2^53 counts are 10^10 km of wheel travel
    fn since(self, earlier: Self) -> f64 {
        self.wrapping_sub(earlier) as f64
    }
}

impl Count for f64 {
    fn since(self, earlier: Self) -> f64 {
        self - earlier
    }
}

/// What turns counts into motion: metres per count (or per radian) of each wheel and the wheel separation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Odometry {
    /// Metres of travel per count of each wheel (`C` in the paper).
    pub m_per_count: Wheels<f64>,
    /// Distance between the wheel contacts, metres.
    pub wheel_separation_m: f64,
    /// Chord rule.
    pub rule: Rule,
}

impl Odometry {
    /// Starts online dead reckoning at a pose and the counters' readings there.
    #[must_use]
    pub fn start<C: Count>(&self, world_from_body: Pose, counts: Wheels<C>) -> DeadReckoning<C> {
        DeadReckoning {
            rad_per_count: self.m_per_count.map(|m_per_count| m_per_count / self.wheel_separation_m),
            odometry: *self,
            start_theta_rad: world_from_body.theta_rad,
            start_counts: counts,
            counts,
            world_from_body,
        }
    }

    /// The pose at every row of a log, the first being the start pose.
    ///
    /// Cost: one sine and cosine a row; 24 bytes a row.
    ///
    /// # Panics
    /// When the two columns differ in length: they are columns of one table.
    #[must_use]
    pub fn trajectory<C: Count>(&self, start: Pose, counts: Wheels<&[C]>) -> Vec<Pose> {
        let mut poses = Vec::with_capacity(counts.left.len());
        self.for_each_pose(start, counts, |pose| poses.push(pose));
        poses
    }

    /// The pose at the last row of a log; the start pose for an empty one.
    ///
    /// # Panics
    /// When the two columns differ in length.
    #[must_use]
    pub fn final_pose<C: Count>(&self, start: Pose, counts: Wheels<&[C]>) -> Pose {
        let mut last = start;
        self.for_each_pose(start, counts, |pose| last = pose);
        last
    }

    /// Calls `visit` with the pose at every row of a log in order, storing nothing.
    ///
    /// # Panics
    /// When the two columns differ in length.
    pub fn for_each_pose<C: Count>(&self, start: Pose, counts: Wheels<&[C]>, mut visit: impl FnMut(Pose)) {
        assert_eq!(counts.left.len(), counts.right.len(), "left and right counts are columns of one table");
        let (Some(&left), Some(&right)) = (counts.left.first(), counts.right.first()) else { return };
        let mut state = self.start(start, Wheels { left, right });
        visit(start);
        for (&left, &right) in counts.left.iter().zip(counts.right).skip(1) {
            visit(state.update(Wheels { left, right }));
        }
    }
}

/// Online dead reckoning: feed it cumulative counts, read the pose.
#[derive(Debug, Clone, Copy)]
pub struct DeadReckoning<C> {
    odometry: Odometry,
    rad_per_count: Wheels<f64>,
    start_theta_rad: f64,
    start_counts: Wheels<C>,
    counts: Wheels<C>,
    world_from_body: Pose,
}

impl<C: Count> DeadReckoning<C> {
    /// Where the robot believes it is.
    #[must_use]
    pub const fn world_from_body(&self) -> Pose {
        self.world_from_body
    }

    /// Takes new cumulative counts and returns the new pose (paper, eq. 1 to 3).
    pub fn update(&mut self, counts: Wheels<C>) -> Pose {
        let m_per_count = self.odometry.m_per_count;
        let distance_m = 0.5
            * (m_per_count.right * counts.right.since(self.counts.right)
                + m_per_count.left * counts.left.since(self.counts.left));
        let theta_rad = self.start_theta_rad
            + (self.rad_per_count.right * counts.right.since(self.start_counts.right)
                - self.rad_per_count.left * counts.left.since(self.start_counts.left));
        let half_turn_rad = 0.5 * (theta_rad - self.world_from_body.theta_rad);
        let chord_m = match self.odometry.rule {
            Rule::Midpoint => distance_m,
            Rule::ExactArc => distance_m * sinc(half_turn_rad),
        };
        let (sin, cos) = sin_cos(self.world_from_body.theta_rad + half_turn_rad);
        self.world_from_body.x_m += chord_m * cos;
        self.world_from_body.y_m += chord_m * sin;
        self.world_from_body.theta_rad = theta_rad;
        self.counts = counts;
        self.world_from_body
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::DriveGeometry;
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

        #[test]
        fn exact_arcs_equal_the_product_of_group_elements(steps in prop::collection::vec((-900_i64..900, -900_i64..900), 1..40)) {
            let odometry = yair(Rule::ExactArc);
            let geometry = DriveGeometry::new(Wheels::both(0.16), 0.363).expect("valid");
            let mut state = odometry.start(Pose::IDENTITY, Wheels::both(0_i64));
            let (mut counts, mut product) = (Wheels::both(0_i64), Pose::IDENTITY);
            for (l, r) in steps {
                counts = Wheels { left: counts.left + l, right: counts.right + r };
                #[allow(clippy::cast_precision_loss)]
                let travel_m = Wheels { left: 1.0334e-3 * l as f64, right: 1.0322e-3 * r as f64 };
                product = product * geometry.increment(travel_m).arc();
                let pose = state.update(counts);
                // 40 steps under 1 m: rounding of headings up to 200 rad, times metres.
                prop_assert!(pose.position().distance_m(product.position()) < 1e-11);
                prop_assert!((pose.theta_rad - product.theta_rad).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn paper_eq_3_is_the_midpoint_rule() {
        let odometry = yair(Rule::Midpoint);
        let mut state = odometry.start(Pose::new(0.1, 0.2, 0.3), Wheels::both(0_i32));
        let pose = state.update(Wheels { left: 100, right: 120 });
        let (s_left, s_right) = (0.10334, 0.123864);
        let (distance_m, turn_rad) = ((s_left + s_right) / 2.0, (s_right - s_left) / 0.363_f64);
        assert!((pose.x_m - (0.1 + distance_m * (0.3 + turn_rad / 2.0).cos())).abs() < 1e-16);
        assert!((pose.y_m - (0.2 + distance_m * (0.3 + turn_rad / 2.0).sin())).abs() < 1e-16);
        assert!((pose.theta_rad - (0.3 + turn_rad)).abs() < 1e-15);
    }

    #[test]
    fn heading_does_not_drift_with_the_number_of_steps() {
        // A million steps of 3 and 4 counts: the summed heading would carry ~1e6 roundings, the cumulative one carries one.
        let odometry = yair(Rule::ExactArc);
        let n = 1_000_000_i64;
        let mut state = odometry.start(Pose::IDENTITY, Wheels::both(0_i64));
        let mut summed_rad = 0.0;
        for k in 1..=n {
            state.update(Wheels { left: 3 * k, right: 4 * k });
            summed_rad += (4.0 * 1.0322e-3 - 3.0 * 1.0334e-3) / 0.363;
        }
        #[allow(clippy::cast_precision_loss)]
        let exact_rad = n as f64 * (4.0 * 1.0322e-3 - 3.0 * 1.0334e-3) / 0.363;
        let error = (state.world_from_body().theta_rad - exact_rad).abs();
        assert!(error <= 8.0 * f64::EPSILON * exact_rad, "{error}");
        assert!(
            (summed_rad - exact_rad).abs() > 100.0 * error.max(f64::EPSILON * exact_rad),
            "the summed form does drift"
        );
    }

    #[test]
    fn an_empty_log_ends_where_it_starts() {
        let odometry = yair(Rule::Midpoint);
        let start = Pose::new(1.0, 2.0, 3.0);
        assert_eq!(odometry.final_pose::<i64>(start, Wheels { left: &[], right: &[] }), start);
        assert!(odometry.trajectory::<i64>(start, Wheels { left: &[], right: &[] }).is_empty());
    }
}
