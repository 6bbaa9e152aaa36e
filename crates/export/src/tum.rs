//! `tum`: poses as the TUM RGB-D benchmark has them, for evo and its like: `t x y z qx qy qz qw`, a pose a
//! line, without a header.

use std::fmt::Write;

use dataset::TruthSample;
use kinematics::{Pose, sin_cos};

/// Poses with their times, seconds.
#[must_use]
pub fn tum(poses: impl IntoIterator<Item = (f64, Pose)>) -> String {
    let mut text = String::new();
    for (t_s, Pose { x_m, y_m, theta_rad }) in poses {
        let (qz, qw) = sin_cos(0.5 * theta_rad);
        let _ = writeln!(text, "{t_s} {x_m} {y_m} 0 0 0 {qz} {qw}");
    }
    text
}

/// What the instrument measured of a run, as it measured it: no extrinsics are taken out. A sample without a
/// heading has that of the identity; the number of these is given beside the text.
#[must_use]
pub fn tum_of_truth(truth: &[TruthSample]) -> (String, usize) {
    let without = truth.iter().filter(|sample| sample.theta_rad().is_none()).count();
    let pose =
        |sample: &TruthSample| (sample.t_s, Pose::new(sample.x_m, sample.y_m, sample.theta_rad().unwrap_or_default()));
    (tum(truth.iter().map(pose)), without)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_is_a_line_of_eight_numbers_and_a_missing_heading_is_counted() {
        let truth = [TruthSample::new(0.5, 1.0, -2.0, Some(0.0)), TruthSample::new(1.0, 1.5, -2.0, None)];
        assert_eq!(tum_of_truth(&truth), ("0.5 1 -2 0 0 0 0 1\n1 1.5 -2 0 0 0 0 1\n".to_owned(), 1));
        let half = tum([(2.0, Pose::new(0.0, 0.0, std::f64::consts::PI))]);
        let last: Vec<f64> = half.split_whitespace().skip(6).map(|word| word.parse().expect("a number")).collect();
        assert!((last[0] - 1.0).abs() < 1e-15 && last[1].abs() < 1e-15, "{half}");
    }
}
