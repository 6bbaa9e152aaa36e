//! Covariance along a dead-reckoned path: what the noise of the wheels since its first pose adds up to.
//!
//! The wheels' travel of a step is that of the path itself, and carries k² per metre (Chong & Kleeman 1997);
//! the heading carries κ² per radian turned besides, as in the likelihood. To first order in both.

use kinematics::{OdometryCovariance, Pose, WheelNoise, Wheels, sin_cos};

use crate::estimate::OdometryNoise;

/// Covariance of x, y and heading at every pose of a path, row by row: m², m·rad and rad², world axes.
#[must_use]
pub fn path_covariances(poses: &[(f64, Pose)], wheel_separation_m: f64, noise: &OdometryNoise) -> Vec<[f64; 9]> {
    let wheel_noise = WheelNoise { sigma_m_per_sqrt_m: Wheels::both(noise.wheel_sigma_m_per_sqrt_m) };
    let turn_var_rad = noise.turn_sigma_rad_per_sqrt_rad.powi(2);
    let mut covariance = OdometryCovariance::default();
    let mut all = Vec::with_capacity(poses.len());
    let mut before = None;
    for (_, pose) in poses {
        if let Some(from) = before {
            let moved = Pose::to(from, *pose);
            let turn_rad = moved.theta_rad;
            let (sin, cos) = sin_cos(0.5 * turn_rad);
            let ahead_m = cos * moved.x_m + sin * moved.y_m;
            let half_m = 0.5 * turn_rad * wheel_separation_m;
            let travel_m = Wheels { left: ahead_m - half_m, right: ahead_m + half_m };
            covariance.propagate(from, travel_m, wheel_separation_m, &wheel_noise);
            let mut matrix = *covariance.matrix();
            matrix[(2, 2)] += turn_var_rad * turn_rad.abs();
            covariance = OdometryCovariance::starting_at(matrix);
        }
        before = Some(*pose);
        let matrix = covariance.matrix();
        all.push(std::array::from_fn(|index| matrix[(index / 3, index % 3)]));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_and_a_spin_have_their_closed_forms() {
        let noise =
            OdometryNoise { wheel_sigma_m_per_sqrt_m: 1e-3, turn_sigma_rad_per_sqrt_rad: 2e-3, is_assumed: false };
        let straight: Vec<(f64, Pose)> =
            (0..=10).map(|k| (f64::from(k), Pose::new(0.1 * f64::from(k), 0.0, 0.0))).collect();
        let end = path_covariances(&straight, 0.4, &noise)[10];
        // After a metre: k²/2 ahead, 2 k²/b² of the heading, a third of it across and half of it between.
        let heading = 2.0 * 1e-6 / 0.16;
        let expected = [5e-7, 0.0, 0.0, 0.0, heading / 3.0, heading / 2.0, 0.0, heading / 2.0, heading];
        // A few roundings of 1e-5 over ten steps.
        assert!(end.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-19), "{end:?}");
        let spin: Vec<(f64, Pose)> =
            (0..=20).map(|k| (f64::from(k), Pose::new(0.0, 0.0, 0.1 * f64::from(k)))).collect();
        let end = path_covariances(&spin, 0.4, &noise)[20];
        // Each wheel rolls 0.4 m in 2 rad: 2 k² 0.4/b², and κ² 2 rad.
        assert!((end[8] - (2.0 * 1e-6 * 0.4 / 0.16 + 4e-6 * 2.0)).abs() < 1e-18, "{end:?}");
        assert_eq!(path_covariances(&straight, 0.4, &noise)[0], [0.0; 9]);
    }
}
