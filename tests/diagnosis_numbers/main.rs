//! Every number of a diagnosis and of a plan against those that were found before: the files of `golden/`.
//!
//! A change that moves a number shows here, whatever it moves. That numbers are right say the tests of
//! `diagnosis` and the blind benchmark.

#[path = "../../crates/estimation/src/tests/golden_numbers.rs"]
mod golden_numbers;

use std::fmt::Write;
use std::path::{Path, PathBuf};

use blind_benchmark::{Scope, challenge_datasets};
use diagnose::{Limits, Options, diagnose, plan_scenario};
use scenario::Scenario;

/// Of the blind benchmark's cases under this seed, small ones of many kinds: coarse and fine encoders, poses
/// and ends, one run and many, with effects of wheels, floors, instruments and clocks, with what no catalogue
/// has, and without anything.
const SEED: u64 = 31_031;
const CASES: [u64; 10] = [58, 55, 67, 23, 11, 31, 14, 12, 10, 1];

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/diagnosis_numbers/golden").join(name)
}

/// All that a diagnosis says of a case.
fn written(case: u64) -> String {
    let datasets = challenge_datasets(Scope::Whole, SEED, case).expect("simulates");
    let diagnosis = diagnose(&datasets, &Options::default()).expect("a diagnosis");
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
    let covariates = if case == CASES[0] { &diagnosis.residuals.by_covariate[..] } else { &[] };
    for residuals in covariates {
        writeln!(text, "{case}: {residuals:?}").expect("written");
    }
    writeln!(text, "{case}: extended {:?}", diagnosis.extended).expect("written");
    text
}

#[test]
fn regress_no_number_of_a_diagnosis_moves() {
    for case in CASES {
        golden_numbers::assert_unmoved(&file(&format!("case_{case}.txt")), &written(case));
    }
}

#[test]
fn regress_no_number_of_a_plan_moves() {
    let motion_capture = include_str!("../../scenarios/motion-capture.toml");
    let scenario = Scenario::parse(motion_capture, "motion-capture.toml").expect("the shipped scenario");
    let limits = Limits { room_m: Some([5.0, 4.0]), minutes: Some(10.0), ..Limits::default() };
    let plan = plan_scenario(&scenario, &limits).expect("a plan");
    golden_numbers::assert_unmoved(&file("plan.txt"), &format!("{plan:#?}"));
}
