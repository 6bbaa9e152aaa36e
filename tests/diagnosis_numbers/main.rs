//! Every number of a diagnosis and of a plan against those that were found before: the files of `golden/`.
//!
//! A change that moves a number shows here, whatever it moves. That numbers are right say the tests of
//! `diagnosis` and the blind benchmark.

#[path = "../../crates/estimation/src/tests/golden_numbers.rs"]
mod golden_numbers;
mod logs;
#[path = "../support/motion_capture.rs"]
mod motion_capture;

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use blind_benchmark::{Scope, challenge_datasets};
use dataset::Dataset;
use diagnose::{ExtendedModel, FittedModel, Limits, OnStage, Options, diagnose, nested_gains, plan_scenario};
use scenario::Scenario;

use crate::logs::{CANCELLING, further_logs, other_logs, simulated};
use crate::motion_capture::MOTION_CAPTURE;

/// Of the blind benchmark's cases under this seed, small ones of many kinds: coarse and fine encoders, poses
/// and ends, one run and many, with effects of wheels, floors, instruments and clocks, with errors that last,
/// with what no catalogue has, and without anything.
const SEED: u64 = 31_031;
const CASES: [u64; 11] = [58, 55, 67, 23, 11, 31, 14, 12, 10, 1, 56];

fn file_of(name: &str) -> PathBuf {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/diagnosis_numbers/golden");
    golden.join(format!("{}.txt", name.replace(' ', "_")))
}

/// All that a diagnosis says, each line behind the name of what it is of.
fn written(case: &str, datasets: &[Dataset], options: &Options) -> String {
    let diagnosis = match diagnose(datasets, options) {
        Ok(diagnosis) => diagnosis,
        Err(why) => return format!("{case}: {why}\n"),
    };
    let mut text = String::new();
    let mut line = |what: &str| writeln!(text, "{case}: {what}").expect("written");
    let serde_json::Value::Object(document) = serde_json::to_value(&diagnosis.document).expect("JSON") else {
        panic!("a document has keys");
    };
    for (key, value) in &document {
        line(&format!("{key}: {value}"));
    }
    for alternative in &diagnosis.alternatives {
        line(&format!("{alternative:?}"));
    }
    let models = [&diagnosis.calibrated, &diagnosis.found, &diagnosis.carried];
    line(&format!("models {:?}", models.map(|fitted| &fitted.model)));
    let names = |fitted: &FittedModel| -> Vec<&'static str> {
        fitted.terms().iter().flat_map(|term| term.parameters()).map(|parameter| parameter.name).collect()
    };
    line(&format!("terms {:?}", models.map(names)));
    let reports = [Some(&diagnosis.base), diagnosis.geometry_alone.as_ref()];
    for (name, report) in ["base", "geometry alone"].into_iter().zip(reports) {
        line(&format!("{name} {}", serde_json::to_string(&report).expect("JSON")));
    }
    // Profiles of residuals are long, and those of one case go through what makes all.
    let covariates = if case == "58" { &diagnosis.residuals.by_covariate[..] } else { &[] };
    for residuals in covariates {
        line(&format!("{residuals:?}"));
    }
    line(&format!("measurements {}", diagnosis.residuals.measurements));
    line(&format!("extended {:?}", diagnosis.extended));
    if let Ok(scenario) = &diagnosis.extended {
        match ExtendedModel::of(scenario) {
            Err(why) => line(&format!("model: {why}")),
            Ok(model) => {
                let (calibration, values) = (&model.calibration.calibration.values, &model.calibration.term_values);
                line(&format!("model {calibration:?} {values:?} {:?} {:?}", model.effects, model.remarks));
                let undone = model.undone(&datasets[0]).map(|(_, remarks)| remarks);
                line(&format!("undone {} {undone:?} {:?}", model.changes_records(), model.check(&datasets[0].robot)));
            }
        }
    }
    text
}

#[test]
fn regress_no_number_of_a_diagnosis_moves() {
    for case in CASES {
        let datasets = challenge_datasets(Scope::Whole, SEED, case).expect("simulates");
        golden_numbers::assert_unmoved(
            &file_of(&format!("case {case}")),
            &written(&case.to_string(), &datasets, &Options::default()),
        );
    }
    let cancelling = challenge_datasets(Scope::Whole, CANCELLING.0, CANCELLING.1).expect("simulates");
    golden_numbers::assert_unmoved(&file_of("cancelling"), &written("cancelling", &cancelling, &Options::default()));
    for (name, dataset) in other_logs() {
        golden_numbers::assert_unmoved(&file_of(name), &written(name, &[dataset], &Options::default()));
    }
}

#[test]
fn regress_no_number_of_another_instrument_or_fault_moves() {
    for (name, datasets) in further_logs() {
        golden_numbers::assert_unmoved(&file_of(name), &written(name, &datasets, &Options::default()));
    }
}

#[test]
fn regress_no_number_moves_where_something_is_not_to_be_named_and_floor_and_time_are_short() {
    let limits = Limits { room_m: Some([2.0, 1.5]), minutes: Some(4.0), top_speed_m_s: Some(0.3) };
    let without = ["swapped_wheels", "wheel_scale", "truth_jump"].map(ToOwned::to_owned).to_vec();
    let stages = Arc::new(Mutex::new(String::new()));
    let reported = Arc::clone(&stages);
    let on_stage = OnStage::call(move |stage| reported.lock().expect("one thread").push_str(&format!("{stage:?}\n")));
    let options = Options { without, limits: Some(limits), on_stage, ..Options::default() };
    let mut text = String::new();
    for (name, dataset) in other_logs().into_iter().filter(|(name, _)| ["swapped", "moved run"].contains(name)) {
        text += &written(name, &[dataset], &options);
    }
    golden_numbers::assert_unmoved(&file_of("without"), &(text + &stages.lock().expect("one thread")));
}

#[test]
fn regress_no_number_of_a_nested_gain_moves() {
    let turn_rate = "[[effect]]\nkind = \"turn_rate_wheelbase\"\nbeta_s = 0.05\n";
    let sessions = [simulated(turn_rate, 6), simulated(turn_rate, 7)];
    let gains = nested_gains(&sessions, &Options::default()).expect("diagnoses");
    golden_numbers::assert_unmoved(&file_of("nested"), &format!("{gains:#?}"));
}

#[test]
fn regress_no_number_of_a_plan_moves() {
    let paper = include_str!("../../scenarios/paper.toml");
    for (name, text) in [("motion-capture", MOTION_CAPTURE), ("paper", paper)] {
        let scenario = Scenario::parse(text, name).expect("a shipped scenario");
        let limits = Limits { room_m: Some([5.0, 4.0]), minutes: Some(10.0), ..Limits::default() };
        let plan = plan_scenario(&scenario, &limits).expect("a plan");
        golden_numbers::assert_unmoved(&file_of(&format!("plan {name}")), &format!("{plan:#?}"));
    }
}
