//! APE and RPE are evo's: on the paths of `tests/evo`, through the library and through `yair evaluate`
//! (`tests/evo/make_golden.py` makes them and evo's numbers).

use std::fs;
use std::path::{Path, PathBuf};

use calib::{Alignment, Delta, DeltaUnit, ErrorStatistics, PoseErrors, absolute_pose_errors, relative_pose_errors};
use kinematics::Pose;
use serde_json::Value;

use crate::support::{document, run_in, succeed, usage};

/// What evo 1.38 and this library may differ by: both compute in doubles from the same text, over metres and
/// a hundred poses, a few 1e-16 each. A standard deviation with n − 1 is off by 1e-4 m here, and pairs by the
/// truth's path by 3e-4 m.
const TOLERANCE_M: f64 = 1e-9;
const TOLERANCE_RAD: f64 = 1e-8;

fn golden_folder() -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "tests", "evo"].iter().collect()
}

fn golden() -> Value {
    let text = fs::read_to_string(golden_folder().join("golden.json")).expect("evo's numbers");
    serde_json::from_str(&text).expect("JSON")
}

/// Poses of a TUM file in the plane.
fn poses(file: &str) -> Vec<Pose> {
    let text = fs::read_to_string(golden_folder().join(file)).expect("a path");
    let pose = |line: &str| {
        let numbers: Vec<f64> = line.split(' ').map(|word| word.parse().expect("a number")).collect();
        Pose::new(numbers[1], numbers[2], 2.0 * numbers[6].atan2(numbers[7]))
    };
    text.lines().map(pose).collect()
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key}: {value}"))
}

#[track_caller]
fn assert_same(found: &Value, evo: &Value, what: &str) {
    for (part, tolerance) in [("translation_m", TOLERANCE_M), ("rotation_rad", TOLERANCE_RAD)] {
        for key in ["rmse", "mean", "median", "std", "min", "max"] {
            let (found, evo) = (number(&found[part], key), number(&evo[part], key));
            assert!((found - evo).abs() < tolerance, "{what}: {part} {key}: {found}, evo {evo}");
        }
    }
}

/// As JSON, as the command gives it.
fn statistics(errors: &PoseErrors) -> Value {
    let of = |errors: &[f64]| serde_json::to_value(ErrorStatistics::of(errors)).expect("JSON");
    serde_json::json!({ "translation_m": of(&errors.translation_m), "rotation_rad": of(&errors.rotation_rad) })
}

fn delta(of: &Value) -> Delta {
    let unit = DeltaUnit::ALL.into_iter().find(|unit| of["unit"] == unit.name()).expect("a unit");
    let all_pairs = of["all_pairs"].as_bool().expect("a choice");
    Delta::new(number(of, "delta"), unit, all_pairs, number(of, "tolerance")).expect("a step")
}

#[test]
fn published_evo_numbers_come_out_of_the_same_paths() {
    let golden = golden();
    let mut refused = Vec::new();
    for (name, evo) in golden["paths"].as_object().expect("paths") {
        let (reference, estimate) = (poses(&format!("{name}.truth.tum")), poses(&format!("{name}.odometry.tum")));
        for alignment in Alignment::ALL {
            let what = format!("{name}, APE, {}", alignment.name());
            let evo = &evo["ape"][alignment.name()];
            match absolute_pose_errors(&reference, &estimate, alignment) {
                Ok(errors) => assert_same(&statistics(&errors), evo, &what),
                Err(_) => refused.push((what, evo["refused"].is_string())),
            }
        }
        for evo in evo["rpe"].as_array().expect("steps") {
            let delta = delta(evo);
            let what = format!("{name}, RPE, {}", delta.describe());
            match relative_pose_errors(&reference, &estimate, &delta) {
                Ok(errors) => assert_same(&statistics(&errors), evo, &what),
                Err(_) => refused.push((what, evo["refused"].is_string())),
            }
        }
    }
    // Where there is nothing to compute evo refuses too: no alignment of a straight, and steps that no pair
    // has.
    assert!(refused.iter().all(|(_, by_evo)| *by_evo), "{refused:?}");
    assert!(refused.iter().any(|(what, _)| what == "straight, APE, se2"), "{refused:?}");
}

#[test]
fn published_evo_numbers_come_out_of_the_command() {
    let golden = golden();
    let set = golden_folder().join("robot").display().to_string();
    let evaluated = |flags: &[&str]| document(Path::new("."), &[&["evaluate", &set], flags].concat());
    let run = |found: &Value, id: &str| {
        let runs = found["calibrations"][0]["runs"].as_array().expect("runs").clone();
        runs.into_iter().find(|run| run["run"] == id).expect("the run")
    };
    for (id, evo) in golden["robot"].as_object().expect("runs") {
        for align in ["none", "se2"] {
            let found = evaluated(&["--align", align]);
            assert_eq!(found["alignment"], align);
            assert_same(&run(&found, id)["ape"], &evo["ape"][align], &format!("{id}, APE, {align}"));
        }
        for evo in evo["rpe"].as_array().expect("steps").iter().filter(|of| of["refused"].is_null()) {
            let (step, tolerance) = (evo["delta"].to_string(), evo["tolerance"].to_string());
            let mut flags = vec!["--delta", &step, "--delta-unit", evo["unit"].as_str().expect("a unit")];
            if evo["all_pairs"] == true {
                flags.extend(["--all-pairs", "--delta-tol", &tolerance]);
            }
            let found = evaluated(&flags);
            assert_eq!(found["delta"]["unit"], evo["unit"]);
            assert_same(&run(&found, id)["rpe"], evo, &format!("{id}, RPE, {flags:?}"));
        }
    }
}

#[test]
fn errors_of_all_runs_are_pooled_and_what_is_missing_has_its_reason() {
    let set = golden_folder().join("robot").display().to_string();
    let at = Path::new(".");
    let found = document(at, &["evaluate", &set]);
    let (all, runs) = (&found["calibrations"][0], &found["calibrations"][0]["runs"]);
    let sum = |what: &str| number(&runs[0][what], "count") + number(&runs[1][what], "count");
    assert_eq!((number(&all["ape"], "count"), number(&all["rpe"], "count")), (sum("ape"), sum("rpe")));
    // The mean of all is the mean of the runs by their poses.
    let weighted = |run: usize| number(&runs[run]["ape"], "count") * number(&runs[run]["ape"]["translation_m"], "mean");
    let mean = (weighted(0) + weighted(1)) / number(&all["ape"], "count");
    assert!((mean - number(&all["ape"]["translation_m"], "mean")).abs() < 1e-15);
    // One of two runs is long enough for the step.
    let flags = ["--delta", "2.01", "--delta-unit", "m"];
    let found = document(at, &[&["evaluate", &set], &flags[..]].concat());
    let runs = &found["calibrations"][0]["runs"];
    let reasons: Vec<bool> = [0, 1].map(|run: usize| runs[run]["rpe"]["why_null"].is_string()).to_vec();
    assert_eq!(reasons.iter().filter(|is_missing| **is_missing).count(), 1, "{runs}");
    let said = succeed(at, &[&["evaluate", &set], &flags[..]].concat()).stdout;
    assert!(said.contains("nominal: RPE (--delta) is without 1 of 2 runs;"), "{said}");
    assert!(said.contains("APE not aligned (--align); RPE over 2.01 m, consecutive pairs (--delta)"), "{said}");
    let far = succeed(at, &["evaluate", &set, "--delta", "900", "--delta-unit", "m"]).stdout;
    assert!(far.contains("nominal: no RPE: no two poses are a step apart; take a smaller --delta"), "{far}");
}

#[test]
fn a_step_that_is_none_is_bad_usage() {
    let set = golden_folder().join("robot").display().to_string();
    for (flags, why) in [
        (&["--delta", "0"][..], "--delta 0: expected a positive step"),
        (&["--delta", "-1"], "--delta -1: expected a positive step"),
        (&["--delta", "1.5"], "--delta 1.5: expected a whole number of poses"),
        (&["--delta", "200", "--delta-unit", "d"], "--delta 200: expected at most half a turn, 180"),
        (&["--align", "sim3"], "invalid value 'sim3'"),
        (&["--delta-unit", "m"], "--delta <STEP>"),
        (&["--delta-tol", "0.1"], "--all-pairs"),
    ] {
        let said = usage(Path::new("."), &[&["evaluate", &set], flags].concat());
        assert!(said.contains(why), "{flags:?}: {said}");
    }
    assert_eq!(run_in(Path::new("."), &["evaluate", &set, "--align", "se2", "--quiet"]).stderr, "");
}
