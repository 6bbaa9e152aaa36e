//! Whatever decides an exit code by a number: one that is none passes no gate, and a baseline that is none is
//! not compared with.

use std::fs;
use std::path::Path;

use bench::{EstimatorResult, SweepResult};
use blind_benchmark::{DiagnosisCheck, Guarded};
use calib::{CalibrationDrift, evaluate};
use dataset::NominalRobot;
use serde_json::Value;

use crate::support::{paper, refusal, run_in, succeed};

/// A gate: its name, and whether it passes a number in the place where it compares.
type Gate = (&'static str, fn(f64) -> bool);

/// The small sweep that is held against itself.
fn sweep() -> SweepResult {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut result = bench::read_baseline(&root.join("baselines/accuracy.json")).expect("the shipped baseline");
    result.points.truncate(1);
    result
}

/// Whether a sweep passes whose first estimator was changed, and whether it passes as the baseline.
fn passes_accuracy(change: impl Fn(&mut EstimatorResult)) -> bool {
    let (sound, mut changed) = (sweep(), sweep());
    change(&mut changed.points[0].estimators[0]);
    let passes = |now, then| bench::compare(now, then, "b.json").is_ok_and(|check| check.moved.is_empty());
    passes(&changed, &sound) && passes(&sound, &changed)
}

fn passes_diagnosis(p_value: f64, level: f64) -> bool {
    let guarded = Guarded {
        id: "null_findings".to_owned(),
        what: String::new(),
        was: (0, 9),
        is: (0, 9),
        new_failures: None,
        mended: None,
        p_value,
    };
    DiagnosisCheck { false_alarm_budget: 0.01, level, guarded: vec![guarded] }.worse().is_empty()
}

fn drift(percent: f64) -> CalibrationDrift {
    CalibrationDrift { drift_percent: Some(percent), ..evaluate(&[], None, false) }
}

const GATES: [Gate; 11] = [
    ("sweep --check, bias", |value| passes_accuracy(|of| of.bias = of.bias.map(|bias| bias + value))),
    ("sweep --check, error of the bias", |value| {
        passes_accuracy(|of| (of.bias, of.bias_mcse) = (of.bias.map(|bias| bias + value), Some(value)))
    }),
    ("sweep --check, variance", |value| passes_accuracy(|of| of.variance = of.variance.map(|var| var + value))),
    ("sweep --check, coverage", |value| passes_accuracy(|of| of.coverage = of.coverage.map(|share| share + value))),
    ("sweep --check, coverage_68", |value| {
        passes_accuracy(|of| of.coverage_68.iter_mut().for_each(|of| of.share += value))
    }),
    ("challenge --check, p-value", |value| passes_diagnosis(1.0 + value, 0.002)),
    ("challenge --check, level", |value| passes_diagnosis(1.0, 0.002 + value)),
    ("evaluate --max-drift, drift", |value| drift(0.5 + value).is_at_most(1.0)),
    ("evaluate --max-drift, limit", |value| drift(0.5).is_at_most(1.0 + value)),
    ("calibrate, a length of no robot", |value| is_plausible(0.1 + value, 0.1)),
    ("calibrate, a length of no robot, nominal", |value| is_plausible(0.1, 0.1 + value)),
];

/// Whether a calibration of these diameters is one of a robot that states others.
fn is_plausible(found_m: f64, stated_m: f64) -> bool {
    let geometry = |diameter_m: f64| {
        kinematics::DriveGeometry::new(kinematics::Wheels::both(diameter_m), 0.3).map_err(|error| error.to_string())
    };
    let nominal = NominalRobot {
        left_wheel_diameter_m: stated_m,
        right_wheel_diameter_m: stated_m,
        wheel_separation_m: 0.3,
        ticks_per_rev: None,
        counter_bits: None,
    };
    // What is no drive is no calibration.
    let found = geometry(found_m).map(|geometry| calib::Calibration::new("joint", geometry, None));
    found.is_ok_and(|found| found.plausibility_warnings(&nominal).is_empty())
}

#[test]
fn no_gate_passes_a_number_that_is_none() {
    for (name, passes) in GATES {
        assert!(passes(0.0), "{name} passes nothing");
        assert!(!passes(f64::NAN), "{name} passes NaN");
    }
}

/// Without the reader's check a coverage of 2 had the arcsine of 2 for an angle, and the smallest of all
/// variances an infinity over an infinity for z: nothing was larger than the limit.
#[test]
fn a_baseline_with_numbers_that_are_none_is_refused() {
    let temp = tempfile::tempdir().expect("a folder");
    let here = temp.path();
    fs::write(here.join("paper.toml"), paper()).expect("written");
    let check = ["sweep", "paper.toml", "--trials", "4", "--check", "baseline.json"];
    succeed(here, &[&check[..], &["--update"]].concat());
    assert!(run_in(here, &check).stdout.contains("0 moved"));
    let sound: Value = serde_json::from_slice(&fs::read(here.join("baseline.json")).expect("read")).expect("JSON");
    let with = |key: &str, text: &str| {
        let mut changed = sound.clone();
        changed["points"][0]["estimators"][0][key] = "here".into();
        let text = serde_json::to_string(&changed).expect("JSON").replace("\"here\"", text);
        fs::write(here.join("baseline.json"), text).expect("written");
    };
    for (key, text) in [
        ("coverage", "2.0"),
        ("coverage", "1e308"),
        ("coverage", "-0.1"),
        ("variance", "5e-324"),
        ("variance", "-1e-9"),
        ("variance_mcse", "-1e-9"),
        ("bias", "1e308"),
        ("bias", "1e999"),
        ("failures", "5"),
    ] {
        with(key, text);
        let why = refusal(here, &check);
        assert!(why.contains("baseline.json: not a baseline"), "{key} = {text}: {why}");
    }
    // A number that is missing on one side has moved.
    for key in ["bias", "variance", "coverage", "coverage_68"] {
        with(key, "null");
        let ended = run_in(here, &check);
        assert!(ended.code == Some(3) && ended.stdout.contains("largest |z| = no number"));
    }
}
