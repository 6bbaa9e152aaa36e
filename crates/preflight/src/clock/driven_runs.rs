//! Runs of the tests whose clocks are off.

use dataset::{Dataset, NominalRobot, Odometry, Provenance, Run, RunInfo, TruthNoise, TruthSample, WheelLog};
use kinematics::{Increment, Pose, Wheels};

/// Runs of twenty seconds that speed up, slow down and turn, whose poses are of so long before their
/// stamps.
pub(crate) fn driven(offsets_s: &[f64]) -> Dataset {
    let wheels_at =
        |t_s: f64| Wheels { left: 4.0 * t_s - 2.0 * (0.9 * t_s).cos(), right: 4.0 * t_s + 1.5 * (1.3 * t_s).sin() };
    let path: Vec<Pose> = (1..=2600)
        .scan(Pose::IDENTITY, |pose, step| {
            let [a, b] = [step - 1, step].map(|step| wheels_at(0.01 * f64::from(step)));
            let travel_m = b.zip_with(a, |b, a| 0.08 * (b - a));
            *pose = *pose * Increment::from_travel(travel_m, 0.36).arc();
            Some(*pose)
        })
        .collect();
    let run = |(number, offset_s): (usize, &f64)| {
        let t_s: Vec<f64> = (0..=1000).map(|row| 0.02 * f64::from(row)).collect();
        let angles = Wheels {
            left: t_s.iter().map(|t_s| wheels_at(t_s + 3.0).left).collect(),
            right: t_s.iter().map(|t_s| wheels_at(t_s + 3.0).right).collect(),
        };
        let truth = (0..=200).map(|k| {
            let stamp_s = 0.1 * f64::from(k);
            let pose = path[((stamp_s + 3.0 - offset_s) / 0.01).round() as usize - 1];
            TruthSample::new(stamp_s, pose.x_m, pose.y_m, Some(pose.theta_rad))
        });
        Run {
            info: RunInfo { id: format!("run-{number}"), continuous: true, ..RunInfo::default() },
            odometry: Odometry { t_s: t_s.clone().into(), wheels: WheelLog::Angles(angles), ..Odometry::default() },
            truth: truth.collect(),
            ..Run::default()
        }
    };
    let robot = NominalRobot {
        left_wheel_diameter_m: 0.16,
        right_wheel_diameter_m: 0.16,
        wheel_separation_m: 0.36,
        ticks_per_rev: None,
        counter_bits: None,
    };
    let (provenance, truth_noise) = (Provenance::default(), TruthNoise::default());
    Dataset {
        provenance,
        robot,
        truth_noise,
        points: Vec::new(),
        runs: offsets_s.iter().enumerate().map(run).collect(),
    }
}
