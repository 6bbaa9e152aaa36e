//! Dead reckoning as one writes it down: a step at a time, sine and cosine from the C library, sums in plain
//! doubles.

use kinematics::{Odometry, Pose, Rule, Wheels};

/// sin(x)/x with the C library's sine.
fn sinc(x: f64) -> f64 {
    if x.abs() < 1e-4 { 1.0 - x * x / 6.0 } else { x.sin() / x }
}

#[inline(always)]
fn step(odometry: &Odometry, pose: &mut Pose, before: Wheels<i64>, now: Wheels<i64>) {
    let left_m = odometry.m_per_count.left * (now.left - before.left) as f64;
    let right_m = odometry.m_per_count.right * (now.right - before.right) as f64;
    let half_rad = 0.5 * (right_m - left_m) / odometry.wheel_separation_m;
    let mut chord_m = 0.5 * (left_m + right_m);
    if odometry.rule == Rule::ExactArc {
        chord_m *= sinc(half_rad);
    }
    let (sin, cos) = (pose.theta_rad + half_rad).sin_cos();
    pose.x_m += chord_m * cos;
    pose.y_m += chord_m * sin;
    pose.theta_rad += 2.0 * half_rad;
}

/// Every pose of a log.
#[inline(never)]
pub(crate) fn trajectory(odometry: &Odometry, start: Pose, counts: Wheels<&[i64]>, poses: &mut [Pose]) {
    let mut pose = start;
    let mut before = Wheels { left: counts.left[0], right: counts.right[0] };
    for ((&left, &right), out) in counts.left.iter().zip(counts.right).zip(poses) {
        let now = Wheels { left, right };
        step(odometry, &mut pose, before, now);
        *out = pose;
        before = now;
    }
}
