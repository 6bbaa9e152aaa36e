//! Dead reckoning from cumulative wheel counts, online; `trajectory.rs` gives the same bits over a whole log.
//!
//! Position follows eq. (3), `x += ΔS cos(θ+Δθ/2)`, with the arc as the chord ([`Rule::Midpoint`], the paper)
//! or the exact chord `ΔS·sinc(Δθ/2)` ([`Rule::ExactArc`]). Heading is *not* summed: it is a function of the
//! counts since the start, `θ = θ₀ + (C_R N_R − C_L N_L)/B`, so ten million steps leave no rounding drift in
//! it and steps do not wait for each other. Displacements are summed from nothing over 64 steps at a time,
//! and what the sum of these sums drops is carried along: the place's error does not grow with the number of
//! steps either. `whole_log.rs` does the same with columns.

use crate::elementary::{Branching, Elementary};
use crate::trig::SHIFTER;
use crate::{Pose, Wheels};

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
    /// Does [`Self::column_since`] convert by bits, which gives nonsense beyond its range?
    const CONVERTS_BY_BITS: bool = false;

    /// `self − earlier` as a real number. Integers subtract before they convert, so large counters lose
    /// nothing.
    fn since(self, earlier: Self) -> f64;

    /// [`Self::since`] of a whole column, and whether the differences of these numbers are the steps between
    /// the readings, exactly.
    #[inline(always)]
    fn column_since(column: &[Self], earlier: impl Fn(usize) -> Self, since: &mut [f64]) -> bool {
        for (k, (since, count)) in since.iter_mut().zip(column).enumerate() {
            *since = count.since(earlier(k));
        }
        false
    }
}

impl Count for i32 {
    #[inline(always)]
    fn since(self, earlier: Self) -> f64 {
        f64::from(self) - f64::from(earlier)
    }

    #[inline(always)]
    fn column_since(column: &[Self], earlier: impl Fn(usize) -> Self, since: &mut [f64]) -> bool {
        for (k, (since, count)) in since.iter_mut().zip(column).enumerate() {
            *since = count.since(earlier(k));
        }
        true
    }
}

impl Count for i64 {
    const CONVERTS_BY_BITS: bool = true;

    // 2^53 counts are 10^10 km of wheel travel.
    #[inline(always)]
    fn since(self, earlier: Self) -> f64 {
        self.wrapping_sub(earlier) as f64
    }

    /// Before AVX-512 no vector instruction makes doubles of 64-bit integers: the integer is added to the
    /// bits of 1.5·2⁵², and 1.5·2⁵² taken away.
    #[inline(always)]
    fn column_since(column: &[Self], earlier: impl Fn(usize) -> Self, since: &mut [f64]) -> bool {
        let mut beyond = 0;
        for (k, (since, count)) in since.iter_mut().zip(column).enumerate() {
            let shifted = SHIFTER.to_bits().wrapping_add_signed(count.wrapping_sub(earlier(k)));
            *since = f64::from_bits(shifted) - SHIFTER;
            // Sign and exponent differ where the number is not within ±2⁵¹.
            beyond |= shifted ^ SHIFTER.to_bits();
        }
        beyond >> 52 == 0
    }
}

impl Count for f64 {
    #[inline(always)]
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
    /// Turn for a count of each wheel, radians.
    #[inline(always)]
    pub(crate) fn rad_per_count(&self) -> Wheels<f64> {
        self.m_per_count.map(|m_per_count| m_per_count / self.wheel_separation_m)
    }

    /// Displacement along x and y over a step of some counts, by the headings before it and after it, metres
    /// and radians (paper, eq. 1 to 3).
    #[inline(always)]
    pub(crate) fn displacement_m<E: Elementary>(
        &self,
        elementary: &E,
        steps: Wheels<f64>,
        [before_rad, after_rad]: [f64; 2],
    ) -> [f64; 2] {
        let distance_m = 0.5 * (self.m_per_count.right * steps.right + self.m_per_count.left * steps.left);
        let half_turn_rad = 0.5 * (after_rad - before_rad);
        let chord_m = match self.rule {
            Rule::Midpoint => distance_m,
            Rule::ExactArc => distance_m * elementary.step_sinc(half_turn_rad),
        };
        elementary.along(before_rad + half_turn_rad, chord_m)
    }

    /// Starts online dead reckoning at a pose and the counters' readings there.
    #[must_use]
    pub fn start<C: Count>(&self, world_from_body: Pose, counts: Wheels<C>) -> DeadReckoning<C> {
        DeadReckoning {
            rad_per_count: self.rad_per_count(),
            odometry: *self,
            start_theta_rad: world_from_body.theta_rad,
            start_counts: counts,
            counts,
            position: [CompensatedSum::at(world_from_body.x_m), CompensatedSum::at(world_from_body.y_m)],
            steps: 0,
            world_from_body,
        }
    }
}

/// Heading for the counts since the start: θ₀ + (C_R N_R − C_L N_L)/B, written so that only what the wheels
/// differ by is rounded. The product of each wheel's own counts after 100 km is 3·10⁵ rad, whose last place
/// is 6·10⁻¹¹ rad.
#[inline(always)]
pub(crate) fn heading_rad(start_rad: f64, rad_per_count: Wheels<f64>, left: f64, right: f64) -> f64 {
    start_rad + (rad_per_count.right * (right - left) + (rad_per_count.right - rad_per_count.left) * left)
}

/// How many displacements are summed from nothing before they are added to the place.
pub(crate) const GROUP: usize = 64;

/// One coordinate of the robot's place, metres: where the group of steps began, what its sum dropped, and the
/// group's own sum.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CompensatedSum {
    pub(crate) anchor_m: f64,
    pub(crate) dropped_m: f64,
    pub(crate) moved_m: f64,
}

impl CompensatedSum {
    pub(crate) const fn at(anchor_m: f64) -> Self {
        Self { anchor_m, dropped_m: 0.0, moved_m: 0.0 }
    }

    #[inline(always)]
    pub(crate) fn now_m(&self) -> f64 {
        self.after_m(self.moved_m)
    }

    /// Where a sum of displacements since the anchor leads.
    #[inline(always)]
    pub(crate) fn after_m(&self, moved_m: f64) -> f64 {
        self.anchor_m + (self.dropped_m + moved_m)
    }

    /// Ends a group: its sum goes to the anchor, and what the addition drops is kept (Knuth's two-sum).
    #[inline(always)]
    pub(crate) fn drop_anchor(&mut self) {
        let moved_m = self.dropped_m + self.moved_m;
        let sum_m = self.anchor_m + moved_m;
        let of_moved_m = sum_m - self.anchor_m;
        self.dropped_m = (self.anchor_m - (sum_m - of_moved_m)) + (moved_m - of_moved_m);
        self.anchor_m = sum_m;
        self.moved_m = 0.0;
    }
}

/// Online dead reckoning: feed it cumulative counts, read the pose of the drive's centre in the frame of the
/// start pose. Counts are cumulative readings, not differences; a row may be left out, and costs the bend in
/// it.
#[derive(Debug, Clone, Copy)]
pub struct DeadReckoning<C> {
    pub(crate) odometry: Odometry,
    pub(crate) rad_per_count: Wheels<f64>,
    pub(crate) start_theta_rad: f64,
    pub(crate) start_counts: Wheels<C>,
    pub(crate) counts: Wheels<C>,
    pub(crate) position: [CompensatedSum; 2],
    /// In the group that is not at its end.
    pub(crate) steps: usize,
    pub(crate) world_from_body: Pose,
}

impl<C: Count> DeadReckoning<C> {
    /// Where the robot believes it is.
    #[must_use]
    pub const fn world_from_body(&self) -> Pose {
        self.world_from_body
    }

    /// Takes new cumulative counts and returns the new pose (paper, eq. 1 to 3).
    #[inline(always)]
    pub fn update(&mut self, counts: Wheels<C>) -> Pose {
        let steps = counts.zip_with(self.counts, C::since);
        let since = counts.zip_with(self.start_counts, C::since);
        let theta_rad = heading_rad(self.start_theta_rad, self.rad_per_count, since.left, since.right);
        let [dx_m, dy_m] = self.odometry.displacement_m(&Branching, steps, [self.world_from_body.theta_rad, theta_rad]);
        let [x, y] = &mut self.position;
        x.moved_m += dx_m;
        y.moved_m += dy_m;
        self.world_from_body = Pose::new(x.now_m(), y.now_m(), theta_rad);
        self.steps += 1;
        if self.steps == GROUP {
            x.drop_anchor();
            y.drop_anchor();
            self.steps = 0;
        }
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
        fn exact_arcs_equal_the_product_of_group_elements(steps in prop::collection::vec((-900_i64..900, -900_i64..900), 1..40)) {
            let odometry = yair(Rule::ExactArc);
            let geometry = DriveGeometry::new(Wheels::both(0.16), 0.363).expect("valid");
            let mut state = odometry.start(Pose::IDENTITY, Wheels::both(0_i64));
            let (mut counts, mut product) = (Wheels::both(0_i64), Pose::IDENTITY);
            for (l, r) in steps {
                counts = Wheels { left: counts.left + l, right: counts.right + r };
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
        // A million steps of 3 and 4 counts: the summed heading would carry ~1e6 roundings, the cumulative
        // one carries one.
        let odometry = yair(Rule::ExactArc);
        let n = 1_000_000_i64;
        let mut state = odometry.start(Pose::IDENTITY, Wheels::both(0_i64));
        let mut summed_rad = 0.0;
        for k in 1..=n {
            state.update(Wheels { left: 3 * k, right: 4 * k });
            summed_rad += (4.0 * 1.0322e-3 - 3.0 * 1.0334e-3) / 0.363;
        }
        let exact_rad = n as f64 * (4.0 * 1.0322e-3 - 3.0 * 1.0334e-3) / 0.363;
        let error = (state.world_from_body().theta_rad - exact_rad).abs();
        assert!(error <= 8.0 * f64::EPSILON * exact_rad, "{error}");
        assert!(
            (summed_rad - exact_rad).abs() > 100.0 * error.max(f64::EPSILON * exact_rad),
            "the summed form does drift"
        );
    }
}
