//! What tests of several modules share: sessions of a robot, scenarios, and numbers that are held to a file.

use std::f64::consts::TAU;
use std::path::Path;

use dataset::{
    Dataset, NominalRobot, Odometry, Protocol, ProtocolSettings, Provenance, Run, RunInfo, TruthNoise, TruthSample,
    WheelLog,
};
use estimation::{FitSettings, ModelFit};
use kinematics::{Increment, Pose, Wheels};

use crate::candidates::candidate::Candidate;
use crate::fits::augmented_model::{AugmentedModel, refit};
use crate::records::record_faults::sessions;

#[path = "../../estimation/src/tests/golden_numbers.rs"]
mod golden_numbers;

#[path = "../../preflight/src/clock/driven_runs.rs"]
pub(crate) mod driven_runs;

/// Refuses numbers that are not those of a file of `tests/golden/`, which YAIR_UPDATE_DOCS=1 writes anew.
#[track_caller]
pub(crate) fn assert_unmoved(name: &str, text: &str) {
    golden_numbers::assert_unmoved(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(name), text);
}

pub(crate) const MOTION_CAPTURE: &str = include_str!("../../../scenarios/motion-capture.toml");
pub(crate) const PAPER: &str = include_str!("../../../scenarios/paper.toml");

/// A robot whose angles are logged, with wheels of 160 mm so far apart.
pub(crate) const fn robot(wheel_separation_m: f64) -> NominalRobot {
    NominalRobot {
        left_wheel_diameter_m: 0.16,
        right_wheel_diameter_m: 0.16,
        wheel_separation_m,
        ticks_per_rev: None,
        counter_bits: None,
    }
}

/// Its runs, of which nothing else is known.
pub(crate) fn dataset_of(wheel_separation_m: f64, runs: Vec<Run>) -> Dataset {
    Dataset {
        provenance: Provenance::default(),
        robot: robot(wheel_separation_m),
        truth_noise: TruthNoise::default(),
        points: Vec::new(),
        runs,
    }
}

/// What each wheel drives in a row of a kind of path, metres: two starts and stops, at 0.3 and at 0.15 m/s.
fn tread_m(protocol: Protocol, row: u32) -> Wheels<f64> {
    let (half, at) = (row / 100, row % 100);
    let share = (f64::from(at) / 5.0).min(f64::from(90_u32.saturating_sub(at)) / 5.0).clamp(0.0, 1.0);
    let m = share * if half == 0 { 0.03 } else { -0.015 };
    match protocol {
        Protocol::Spin => Wheels { left: -m, right: m },
        Protocol::SquareCcw => Wheels { left: 0.7 * m, right: m },
        Protocol::SquareCw => Wheels { left: m, right: 0.8 * m },
        _ => Wheels::both(m),
    }
}

/// A session of eight runs of 20 s, two of each kind of path, seen twice a second to a millimetre. Both
/// wheels lose so much of a metre for each metre a second that they drive.
pub(crate) fn session(number: u32, slip_s_m: f64) -> Dataset {
    let row_s = 0.1;
    let kinds = [Protocol::Straight, Protocol::Spin, Protocol::SquareCcw, Protocol::SquareCw];
    let run = |run: u32| {
        let protocol = kinds[(run % 4) as usize];
        let (mut pose, mut angles) = (Pose::new(0.2, 0.1, f64::from(run)), Wheels::both(vec![0.0]));
        let mut truth = Vec::new();
        for row in 0..=200_u32 {
            if row > 0 {
                let tread = tread_m(protocol, row - 1);
                let ground = tread.map(|m| 1.01 * m * (1.0 - slip_s_m * (m / row_s).abs()));
                pose = pose * Increment::from_travel(ground, 0.366).arc();
                angles = angles.zip_with(tread, |mut all: Vec<f64>, m| {
                    all.push(all[all.len() - 1] + m / 0.08);
                    all
                });
            }
            if row.is_multiple_of(5) {
                let error = |axis: f64| {
                    // Evenly spread over [−1, 1) in the end.
                    let k = f64::from(row) + 211.0 * f64::from(run) + 1699.0 * f64::from(number);
                    1e-3 * ((12.9898 * k + 78.233 * axis).sin() * 43_758.545).fract()
                };
                truth.push(TruthSample::new(
                    row_s * f64::from(row),
                    pose.x_m + error(1.0),
                    pose.y_m + error(2.0),
                    Some(pose.theta_rad + error(3.0)),
                ));
            }
        }
        let settings = match protocol {
            Protocol::Straight => ProtocolSettings { length_m: Some(2.0), ..ProtocolSettings::default() },
            Protocol::Spin => ProtocolSettings { turn_rad: Some(TAU), ..ProtocolSettings::default() },
            _ => ProtocolSettings { side_m: Some(1.0), ..ProtocolSettings::default() },
        };
        let info = RunInfo { id: format!("run-{run}"), protocol: Some(protocol), settings, ..RunInfo::default() };
        let t_s = (0..=200).map(|row| row_s * f64::from(row)).collect();
        Run {
            info,
            odometry: Odometry { t_s, wheels: WheelLog::Angles(angles), ..Odometry::default() },
            truth,
            ..Run::default()
        }
    };
    let provenance = Provenance { name: Some(format!("day {number}")), ..Provenance::default() };
    Dataset { provenance, ..dataset_of(0.363, (0..8).map(run).collect()) }
}

pub(crate) fn fitted(datasets: &[Dataset]) -> ModelFit<'_> {
    FitSettings::GEOMETRY_ONLY.fit(&sessions(datasets)).expect("poses determine a drive")
}

/// An effect at its first variant.
pub(crate) const fn effect(id: &'static str) -> Candidate {
    Candidate::Effect { id, variant: 0, at: None }
}

/// A base fit with effects of the catalogue.
pub(crate) fn with_effects<'a>(base: &ModelFit<'a>, ids: &[&'static str]) -> AugmentedModel<'a> {
    let candidates = ids.iter().copied().map(effect).collect();
    refit(base, &AugmentedModel::base(base), candidates).expect("it converges")
}
