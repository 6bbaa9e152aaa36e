//! Whole logs: the bits of dead reckoning one step at a time, by every instruction set, and close to the
//! truth after 10⁷ steps.

use kinematics::{Count, InstructionSet, Odometry, OdometryCovariance, Pose, Rule, WheelNoise, Wheels, sinc};
use nalgebra::Matrix3;

fn odometry(rule: Rule) -> Odometry {
    Odometry { m_per_count: Wheels { left: 1.0334e-3, right: 1.0322e-3 }, wheel_separation_m: 0.363, rule }
}

/// Numbers without a pattern: the high bits of a Weyl sequence put through a multiplication.
fn number(k: u64, below: u64) -> i64 {
    let word = k.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    (((word ^ (word >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 33) % below).cast_signed()
}

/// A robot that drives on and measurements around: steps of 0 to 20 counts.
fn wandering(rows: usize) -> Wheels<Vec<i64>> {
    let column = |seed: u64| {
        (0..rows as u64)
            .scan(-123_i64, |sum, k| {
                *sum += number(k / 700 * 2 + seed, 11) + number(2 * k + seed, 11);
                Some(*sum)
            })
            .collect()
    };
    Wheels { left: column(0), right: column(1) }
}

fn bits(pose: Pose) -> [u64; 3] {
    [pose.x_m, pose.y_m, pose.theta_rad].map(f64::to_bits)
}

const START: Pose = Pose::new(1.0, -2.0, 0.3);

/// All ways through a log give what one step after the other gives.
fn agree<C: Count>(counts: &Wheels<Vec<C>>, what: &str) {
    let columns = Wheels { left: &counts.left[..], right: &counts.right[..] };
    let rows = counts.left.len();
    for odometry in [Rule::Midpoint, Rule::ExactArc].map(odometry) {
        let mut one_by_one = Vec::with_capacity(rows);
        if rows > 0 {
            let mut state = odometry.start(START, Wheels { left: counts.left[0], right: counts.right[0] });
            one_by_one.push(bits(START));
            for k in 1..rows {
                one_by_one.push(bits(state.update(Wheels { left: counts.left[k], right: counts.right[k] })));
            }
        }
        for set in InstructionSet::available() {
            let mut poses = vec![Pose::IDENTITY; rows];
            odometry.trajectory_into_by(set, START, columns, &mut poses);
            for (k, (pose, expected)) in poses.iter().zip(&one_by_one).enumerate() {
                assert_eq!(bits(*pose), *expected, "{what}, {rows} rows, row {k}, {}", set.name());
            }
        }
        let mut visited = Vec::new();
        odometry.for_each_pose(START, columns, |pose| visited.push(bits(pose)));
        assert_eq!(visited, one_by_one, "{what}");
        let last = one_by_one.last().copied().unwrap_or(bits(START));
        assert_eq!(bits(odometry.final_pose(START, columns)), last, "{what}");
        let some: Vec<usize> = [0, 0, 1, 2, 63, 64, 65, 255, 256, 257, 257, 600, 999]
            .into_iter()
            .filter(|row| *row < rows)
            .chain((rows > 1).then(|| rows - 1))
            .collect::<std::collections::BTreeSet<_>>()
            .into_iter()
            .flat_map(|row| [row, row])
            .collect();
        let at: Vec<_> = odometry.poses_at(START, columns, &some).into_iter().map(bits).collect();
        assert_eq!(at, some.iter().map(|row| one_by_one[*row]).collect::<Vec<_>>(), "{what}");
    }
}

#[test]
fn every_instruction_set_gives_the_bits_of_one_step_after_the_other() {
    for rows in [0, 1, 2, 23, 24, 25, 26, 64, 65, 66, 255, 256, 257, 258, 280, 281, 282, 1000, 2048] {
        agree(&wandering(rows), "counts of 64 bits");
    }
    let counts = wandering(1500);
    agree(&counts.as_ref().map(|column| column.iter().map(|count| *count as i32).collect::<Vec<_>>()), "of 32 bits");
    agree(
        &counts.as_ref().map(|column| column.iter().map(|count| 0.7123 * *count as f64).collect::<Vec<_>>()),
        "angles",
    );
}

/// Blocks that the loops are not made for: a step of half a radian and more, headings of 10⁶ rad, counters
/// that jump by 2⁵² or wrap, and no number at all.
#[test]
fn what_is_beyond_the_loops_range_goes_one_by_one() {
    let with = |row: usize, jump: i64| {
        let mut counts = wandering(1200);
        counts.right[row..].iter_mut().for_each(|count| *count = count.wrapping_add(jump));
        counts
    };
    for (jump, what) in [
        (200, "0.6 rad in a step"),
        (600, "1.7 rad"),
        (1 << 30, "2^30 counts"),
        (1 << 52, "2^52"),
        (i64::MAX, "wrapped"),
    ] {
        for row in [1, 300, 700] {
            agree(&with(row, jump), what);
        }
    }
    let mut angles = wandering(900).map(|column| column.iter().map(|count| *count as f64).collect::<Vec<_>>());
    angles.left[500] = f64::NAN;
    let columns = Wheels { left: &angles.left[..], right: &angles.right[..] };
    let poses = odometry(Rule::ExactArc).trajectory(START, columns);
    assert!(poses[..500].iter().all(|pose| pose.x_m.is_finite()) && poses[500..].iter().all(|pose| pose.x_m.is_nan()));
}

/// x + y exactly (Knuth), and x·y exactly (by one fused rounding).
fn two_sum(x: f64, y: f64) -> (f64, f64) {
    let sum = x + y;
    let of_y = sum - x;
    (sum, (x - (sum - of_y)) + (y - of_y))
}

fn two_product(x: f64, y: f64) -> (f64, f64) {
    let product = x * y;
    (product, x.mul_add(y, -product))
}

/// A sum of some 32 digits.
#[derive(Clone, Copy, Default)]
struct Sum(f64, f64);

impl Sum {
    fn add(&mut self, (high, low): (f64, f64)) {
        let (sum, dropped) = two_sum(self.0, high);
        (self.0, self.1) = two_sum(sum, dropped + self.1 + low);
    }
}

/// Ten million steps over 100 km of distance, against headings and sums of 32 digits with the C library's
/// sine of the leading 16 and its slope for the rest: what that leaves is 10⁷ independent roundings of a
/// centimetre, 1e-2·1e-16·√1e7 = 3e-15 m. Ours rounds each displacement likewise; headings of up to 900 rad
/// are rounded to 6e-14, which adds 1e-2·6e-14·√1e7 = 2e-12 m, and twice that before it is over; the place
/// rounds once. Seen: 6e-12. The plain loop, which sums in doubles, fails; so did headings by each wheel's
/// own product, by 2e-10 m.
#[test]
fn ten_million_steps_end_within_1e_11_metres_of_the_truth() {
    let counts = wandering(10_000_001);
    let columns = Wheels { left: &counts.left[..], right: &counts.right[..] };
    for odometry in [Rule::Midpoint, Rule::ExactArc].map(odometry) {
        let Odometry { m_per_count, wheel_separation_m, rule } = odometry;
        let rad_per_count = m_per_count.map(|m_per_count| m_per_count / wheel_separation_m);
        let (mut x_m, mut y_m, mut plain) = (Sum::default(), Sum::default(), (START.x_m, START.y_m));
        x_m.add((START.x_m, 0.0));
        y_m.add((START.y_m, 0.0));
        let heading = |row: usize| {
            let mut heading = Sum::default();
            heading.add((START.theta_rad, 0.0));
            heading.add(two_product(rad_per_count.right, counts.right[row].since(counts.right[0])));
            heading.add(two_product(-rad_per_count.left, counts.left[row].since(counts.left[0])));
            heading
        };
        let (mut before, mut largest_m, mut plain_m) = (heading(0), 0.0_f64, 0.0_f64);
        let poses = odometry.trajectory(START, columns);
        #[allow(clippy::needless_range_loop)] // one row of several columns
        for row in 1..counts.left.len() {
            let now = heading(row);
            let half_rad = 0.5 * ((now.0 - before.0) + (now.1 - before.1));
            let mut chord_rad = before;
            chord_rad.add((half_rad, 0.0));
            let distance_m = 0.5
                * (m_per_count.right * counts.right[row].since(counts.right[row - 1])
                    + m_per_count.left * counts.left[row].since(counts.left[row - 1]));
            let chord_m = if rule == Rule::ExactArc { distance_m * sinc(half_rad) } else { distance_m };
            let (sin, cos) = chord_rad.0.sin_cos();
            let (cos, sin) = (cos - chord_rad.1 * sin, sin + chord_rad.1 * cos);
            x_m.add(two_product(chord_m, cos));
            y_m.add(two_product(chord_m, sin));
            plain = (plain.0 + chord_m * cos, plain.1 + chord_m * sin);
            let pose = poses[row];
            let error_m = (pose.x_m - x_m.0 - x_m.1).abs().max((pose.y_m - y_m.0 - y_m.1).abs());
            largest_m = largest_m.max(error_m);
            plain_m = plain_m.max((plain.0 - x_m.0 - x_m.1).abs().max((plain.1 - y_m.0 - y_m.1).abs()));
            before = now;
        }
        assert!(largest_m < 1e-11, "{rule:?}: {largest_m:e} m");
        assert!(plain_m > 1e-11, "the plain loop: {plain_m:e} m");
    }
}

/// Bits of a log of 5000 rows, folded. They move when the arithmetic does.
#[test]
fn golden_bits_of_a_whole_log() {
    let counts = wandering(5000);
    let columns = Wheels { left: &counts.left[..], right: &counts.right[..] };
    let digest = [Rule::Midpoint, Rule::ExactArc].map(|rule| {
        let poses = odometry(rule).trajectory(START, columns);
        poses
            .iter()
            .flat_map(|pose| bits(*pose))
            .fold(0_u64, |digest, bits| (digest ^ bits).wrapping_mul(0x0000_0100_0000_01b3))
    });
    assert_eq!(digest.map(|digest| format!("{digest:016x}")), ["62ca77eb2efb2938", "512d524fccb51619"]);
}

/// Covariance along a log is that of its steps one by one, and of one long step where the robot keeps its
/// curvature (to the rounding of 400 products).
#[test]
fn covariance_along_a_log() {
    let column = |step: i64| -> Vec<i64> { (0..=400).map(|k| k * step).collect() };
    let counts = Wheels { left: column(9), right: column(11) };
    let columns = Wheels { left: &counts.left[..], right: &counts.right[..] };
    let odometry = odometry(Rule::ExactArc);
    let noise = WheelNoise { sigma_m_per_sqrt_m: Wheels { left: 1e-3, right: 1.7e-3 } };
    let before = OdometryCovariance::starting_at(Matrix3::identity() * 1e-6);
    let (mut rows, mut along) = (Vec::new(), before);
    odometry.for_each_pose_with_covariance(START, before, columns, &noise, |pose, covariance| {
        rows.push(bits(pose));
        along = *covariance;
    });
    assert_eq!(rows, odometry.trajectory(START, columns).into_iter().map(bits).collect::<Vec<_>>());
    let mut whole = before;
    let travel_m = Wheels { left: 3600.0 * odometry.m_per_count.left, right: 4400.0 * odometry.m_per_count.right };
    whole.propagate(START, travel_m, odometry.wheel_separation_m, &noise);
    let apart = (along.matrix() - whole.matrix()).norm() / whole.matrix().norm();
    assert!(apart < 1e-10, "{apart:e}");
}
