//! Large datasets: one step over everything from the fit of pieces is the fit of everything, and the command
//! says that it was taken.

use std::f64::consts::TAU;
use std::path::Path;

use crate::support::document;
use calib::methods::joint::Joint;
use calib::{Calibration, Method, Parameter};
use dataset::{
    Blocks, Dataset, Existing, NominalRobot, Odometry, Provenance, Run, RunInfo, TruthNoise, TruthSample, WheelLog,
    write,
};
use estimation::is_large;
use kinematics::{Increment, Pose, Wheels};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;

const RUNS: usize = 24;
const ROWS: usize = 12_000;
const M_PER_RAD: Wheels<f64> = Wheels { left: 0.0424, right: 0.04265 };
const SEPARATION_M: f64 = 0.2065;
const WHEEL_SIGMA: f64 = 4e-4;
const MEASUREMENT_SIGMA_M: f64 = 5e-4;
const MEASUREMENT_SIGMA_RAD: f64 = 1e-3;

/// A row and a measurement every 50 ms, other speeds every ten seconds, more to the left than to the right;
/// the model of `joint` to the letter, the instrument `ahead_m` of the drive's centre.
fn run(seed: u64, ahead_m: f64) -> Run {
    let mut chance = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut normal = move |sigma: f64| sigma * chance.sample::<f64, _>(StandardNormal);
    let mut speeds = Xoshiro256PlusPlus::seed_from_u64(1000 + seed);
    let (mut pose, mut speed, mut angle) = (Pose::IDENTITY, Wheels::both(0.0), Wheels::both(0.0));
    let mut odometry = Odometry { wheels: WheelLog::Angles(Wheels::default()), ..Odometry::default() };
    let mut truth = Vec::new();
    for row in 0..ROWS {
        if row % 200 == 0 {
            speed = Wheels { left: speeds.random_range(-0.1..0.4), right: speeds.random_range(0.0..0.5) };
        }
        let t_s = 0.05 * row as f64;
        odometry.t_s.push(t_s);
        if let WheelLog::Angles(angles) = &mut odometry.wheels {
            angles.left.push(angle.left);
            angles.right.push(angle.right);
        }
        let seen = pose * Pose::new(ahead_m, 0.0, 0.0);
        let (x_m, y_m) = (seen.x_m + normal(MEASUREMENT_SIGMA_M), seen.y_m + normal(MEASUREMENT_SIGMA_M));
        truth.push(TruthSample::new(t_s, x_m, y_m, Some(seen.theta_rad + normal(MEASUREMENT_SIGMA_RAD))));
        angle = angle.zip_with(speed, |angle, turned| angle + turned);
        let travel_m = M_PER_RAD
            .zip_with(speed, |m_per_rad, rad| m_per_rad * rad)
            .map(|travel_m| travel_m + normal(WHEEL_SIGMA * travel_m.abs().sqrt()));
        pose = pose * Increment::from_travel(travel_m, SEPARATION_M).arc();
    }
    Run { info: RunInfo { id: format!("run-{seed}"), ..RunInfo::default() }, odometry, truth, ..Run::default() }
}

fn dataset(ahead_m: f64) -> Dataset {
    Dataset {
        provenance: Provenance { name: Some("large".to_owned()), ..Provenance::default() },
        robot: NominalRobot {
            left_wheel_diameter_m: 0.085,
            right_wheel_diameter_m: 0.085,
            wheel_separation_m: 0.205,
            ticks_per_rev: Some(TAU),
            counter_bits: None,
        },
        truth_noise: TruthNoise::default(),
        points: Vec::new(),
        runs: (0..RUNS as u64).map(|seed| run(seed, ahead_m)).collect(),
    }
}

fn in_one_step(dir: &Path) -> Calibration {
    let mut blocks = [Blocks::open(dir).expect("readable").expect("runs stand together")];
    assert!(is_large(&blocks));
    Joint::DEFAULT.calibrate_large(&mut blocks, |_, warning| panic!("{warning}")).expect("calibrated")
}

/// How far two calibrations lie apart, over the second one's sigma, and the ratio of their sigmas: the most
/// over the parameters.
#[track_caller]
fn apart(a: &Calibration, b: &Calibration) -> (f64, f64) {
    let (a, b): (Vec<_>, Vec<_>) = (a.estimates().collect(), b.estimates().collect());
    let of = |estimates: &[calib::Estimate]| estimates.iter().map(|estimate| estimate.parameter).collect::<Vec<_>>();
    assert_eq!(of(&a), of(&b));
    a.iter().zip(&b).fold((0.0, 1.0), |(most, ratio): (f64, f64), (a, b)| {
        let (of_a, of_b) = (a.sigma.expect("known"), b.sigma.expect("known"));
        (most.max((a.value - b.value).abs() / of_b), ratio.max(of_a / of_b).max(of_b / of_a))
    })
}

/// The one step misses the whole fit by two things. Its noise is that of the pieces: a variance is off by
/// √(2/65 536) = 0.55 % of itself as far as measurements show it, and the wheels' by a few times that; an
/// estimate whose weights are off by a share ε moves by less than ε of its sigma, and its sigma by ε/2. And
/// the step itself bends, by less than its square, which [`Calibration::converged`] keeps below 5 % of a
/// sigma. Together: 0.1 sigma, and sigmas within 2 % (0.013 and 0.4 % seen).
const APART_SIGMAS: f64 = 0.1;
const RATIO: f64 = 1.02;

#[test]
fn one_step_is_the_whole_fit_within_a_tenth_of_a_sigma() {
    for ahead_m in [0.0, 0.3] {
        let dataset = dataset(ahead_m);
        let temp = tempfile::tempdir().expect("a temporary folder");
        let dir = temp.path().join("set");
        write(&dataset, &dir, Existing::Refuse).expect("written");
        let one_step = in_one_step(&dir);
        let whole = Joint::DEFAULT.calibrate(&[dataset.session()]).expect("calibrated");
        assert_eq!(one_step.extrinsics.is_some(), ahead_m > 0.0);
        let said = one_step.one_step.expect("it says so");
        assert_eq!((said.measurements, said.passes), (RUNS * ROWS, 1));
        assert!(said.first_measurements < RUNS * ROWS / 3, "{said:?}");
        assert!(whole.one_step.is_none() && one_step.converged);
        assert_eq!((one_step.runs_used, one_step.runs_rejected.len()), (RUNS, 0));
        let (sigmas, ratio) = apart(&one_step, &whole);
        assert!(sigmas < APART_SIGMAS && ratio < RATIO, "{sigmas} sigmas apart, sigmas by a factor of {ratio}");
        // An estimate that leaves out a third of the runs lies farther off, and believes itself less.
        let part = dataset.session_of(|info| !info.id.ends_with(['3', '5', '7']));
        let (sigmas, ratio) = apart(&Joint::DEFAULT.calibrate(&[part]).expect("calibrated"), &whole);
        assert!(sigmas > APART_SIGMAS && ratio > RATIO, "{sigmas} sigmas apart, sigmas by a factor of {ratio}");
    }
}

#[test]
fn threads_and_turns_change_no_bit_and_the_command_says_what_it_did() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    write(&dataset(0.0), &temp.path().join("set"), Existing::Refuse).expect("written");
    let first = in_one_step(&temp.path().join("set"));
    assert_eq!(first, in_one_step(&temp.path().join("set")));
    let found = document(temp.path(), &["calibrate", "set"]);
    let joint = &found["methods"][0];
    assert_eq!(found["dataset"], "large");
    assert_eq!(joint["one_step"]["looks"], RUNS * ROWS);
    let separation = first.estimate(Parameter::WheelSeparation).expect("there");
    assert_eq!(joint["parameters"]["wheel_separation_m"]["value"], separation.value);
    // The truth, within four sigmas: one dataset in 16 000 would fail.
    assert!((separation.value - SEPARATION_M).abs() < 4.0 * separation.sigma.expect("known"), "{separation:?}");
}
