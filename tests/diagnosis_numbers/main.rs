//! Every number of a diagnosis and of a plan against those that were found before: the files of `golden/`.
//!
//! A change that moves a number shows here, whatever it moves. That numbers are right say the tests of
//! `diagnosis` and the blind benchmark.

#[path = "../../crates/estimation/src/tests/golden_numbers.rs"]
mod golden_numbers;
#[path = "../support/motion_capture.rs"]
mod motion_capture;

use std::fmt::Write;
use std::path::{Path, PathBuf};

use blind_benchmark::{Scope, challenge_datasets};
use dataset::Dataset;
use diagnose::{Limits, Options, diagnose, nested_gains, plan_scenario};
use motion_programs::Schedule;
use scenario::Scenario;

use crate::motion_capture::MOTION_CAPTURE;

/// Of the blind benchmark's cases under this seed, small ones of many kinds: coarse and fine encoders, poses
/// and ends, one run and many, with effects of wheels, floors, instruments and clocks, with errors that last,
/// with what no catalogue has, and without anything.
const SEED: u64 = 31_031;
const CASES: [u64; 11] = [58, 55, 67, 23, 11, 31, 14, 12, 10, 1, 56];

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/diagnosis_numbers/golden").join(name)
}

/// The shipped scenario with calibration errors, a few short runs and one more effect.
fn simulated(effect: &str, seed: u64) -> Dataset {
    let protocols = [
        Schedule::Straights { length_m: 1.0, runs: 4 },
        Schedule::Spins { turn_rad: std::f64::consts::PI, runs: 4 },
        Schedule::Squares { side_m: 0.5, runs_each_way: 1 },
    ];
    motion_capture::simulated(&motion_capture::robot(effect, &protocols), seed)
}

/// Two terms of which each would be far more than both are together.
const CANCELLING: (u64, u64) = (20_022, 619);

/// Logs of what the blind benchmark does not draw.
fn other_logs() -> Vec<(&'static str, Dataset)> {
    let sound = simulated("", 5);
    let described = |diameters: f64, separation: f64| {
        let mut dataset = sound.clone();
        dataset.robot.left_wheel_diameter_m /= diameters;
        dataset.robot.right_wheel_diameter_m /= diameters;
        dataset.robot.wheel_separation_m /= separation;
        dataset
    };
    let mut late = sound.clone();
    late.runs[5].truth.iter_mut().for_each(|sample| sample.t_s += 0.3);
    let mut lifted = sound.clone();
    lifted.runs[1].truth.iter_mut().filter(|sample| sample.t_s > 3.0).for_each(|sample| sample.y_m += 0.1);
    // Rows are stamped when they are received: some are late, and none overtakes another.
    let mut received = sound.clone();
    let mut state = 1_u64;
    for run in &mut received.runs {
        let mut before_s = f64::NEG_INFINITY;
        for t_s in run.odometry.t_s.iter_mut() {
            // A congruential generator (Knuth 1998) for exponential delays of 15 ms.
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let share = ((state >> 40) as f64 + 0.5) / (1_u64 << 24) as f64;
            *t_s = (*t_s - 0.015 * share.ln()).max(before_s + 1e-4);
            before_s = *t_s;
        }
    }
    // Each run's poses are those of another one.
    let mut exchanged = sound.clone();
    let runs = exchanged.runs.len();
    for other in 1..runs {
        let (before, behind) = exchanged.runs.split_at_mut(other);
        std::mem::swap(&mut before[other - 1].truth, &mut behind[0].truth);
    }
    vec![
        ("coarse", simulated("[[effect]]\nkind = \"quantization\"\ncounts_per_tick = 80\n", 5)),
        ("kicks", simulated("[[effect]]\nkind = \"castor_kick\"\nkick_rad = 0.02\ndecay_m = 0.15\n", 5)),
        ("swapped", simulated("[[effect]]\nkind = \"swapped_wheels\"\nswapped = true\n", 5)),
        ("larger wheels", described(1.18, 1.0)),
        ("skid steered", described(1.0, 1.4)),
        ("late run", late),
        ("moved run", lifted),
        ("received", received),
        ("bumps", simulated("[[effect]]\nkind = \"bumps\"\nper_m = 0.5\nheight_m = 0.006\n", 5)),
        ("exchanged runs", exchanged),
    ]
}

/// All that a diagnosis says, each line behind the name of what it is of.
fn written(case: &str, datasets: &[Dataset]) -> String {
    let diagnosis = match diagnose(datasets, &Options::default()) {
        Ok(diagnosis) => diagnosis,
        Err(why) => return format!("{case}: {why}\n"),
    };
    let mut text = String::new();
    let serde_json::Value::Object(document) = serde_json::to_value(&diagnosis.document).expect("JSON") else {
        panic!("a document has keys");
    };
    for (key, value) in &document {
        writeln!(text, "{case}: {key}: {value}").expect("written");
    }
    for alternative in &diagnosis.alternatives {
        writeln!(text, "{case}: {alternative:?}").expect("written");
    }
    let models = [&diagnosis.calibrated, &diagnosis.found, &diagnosis.carried].map(|fitted| &fitted.model);
    writeln!(text, "{case}: models {models:?}").expect("written");
    let base = serde_json::to_string(&diagnosis.base).expect("JSON");
    writeln!(text, "{case}: base {base}").expect("written");
    // Profiles of residuals are long, and those of one case go through what makes all.
    let covariates = if case == "58" { &diagnosis.residuals.by_covariate[..] } else { &[] };
    for residuals in covariates {
        writeln!(text, "{case}: {residuals:?}").expect("written");
    }
    writeln!(text, "{case}: extended {:?}", diagnosis.extended).expect("written");
    text
}

#[test]
fn regress_no_number_of_a_diagnosis_moves() {
    for case in CASES {
        let datasets = challenge_datasets(Scope::Whole, SEED, case).expect("simulates");
        golden_numbers::assert_unmoved(&file(&format!("case_{case}.txt")), &written(&case.to_string(), &datasets));
    }
    let cancelling = challenge_datasets(Scope::Whole, CANCELLING.0, CANCELLING.1).expect("simulates");
    golden_numbers::assert_unmoved(&file("cancelling.txt"), &written("cancelling", &cancelling));
    for (name, dataset) in other_logs() {
        let file = file(&format!("{}.txt", name.replace(' ', "_")));
        golden_numbers::assert_unmoved(&file, &written(name, std::slice::from_ref(&dataset)));
    }
}

#[test]
fn regress_no_number_of_a_nested_gain_moves() {
    let turn_rate = "[[effect]]\nkind = \"turn_rate_wheelbase\"\nbeta_s = 0.05\n";
    let sessions = [simulated(turn_rate, 6), simulated(turn_rate, 7)];
    let gains = nested_gains(&sessions, &Options::default()).expect("diagnoses");
    golden_numbers::assert_unmoved(&file("nested.txt"), &format!("{gains:#?}"));
}

#[test]
fn regress_no_number_of_a_plan_moves() {
    let paper = include_str!("../../scenarios/paper.toml");
    for (name, text) in [("motion-capture", MOTION_CAPTURE), ("paper", paper)] {
        let scenario = Scenario::parse(text, name).expect("a shipped scenario");
        let limits = Limits { room_m: Some([5.0, 4.0]), minutes: Some(10.0), ..Limits::default() };
        let plan = plan_scenario(&scenario, &limits).expect("a plan");
        golden_numbers::assert_unmoved(&file(&format!("plan_{name}.txt")), &format!("{plan:#?}"));
    }
}
