//! One good log, and the ways to spoil it: `calibrate` gives the right numbers or says what is wrong, and the
//! key that `check` names mends it.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::good_log::{Log, TOLERANCE_MM, TRUE_MM, calibrated, driven, good, right};
use crate::support::{document, run_in};

/// The problems of a dataset: id, severity and fix.
fn problems(folder: &Path, set: &str) -> Vec<(String, String, Option<String>)> {
    let ended = run_in(folder, &["check", set, "--json", "--quiet"]);
    let found: Value = serde_json::from_str(&ended.stdout).unwrap_or_else(|_| panic!("{set}: {}", ended.stderr));
    assert_eq!(ended.code == Some(0), found["ok"] == true, "{set}");
    let text = |value: &Value| value.as_str().map(str::to_owned);
    let of = |problem: &Value| {
        let (id, severity) = (text(&problem["id"]), text(&problem["severity"]));
        (id.expect("an id"), severity.expect("a severity"), text(&problem["fix"]))
    };
    found["problems"].as_array().expect("a list").iter().map(of).collect()
}

/// A spoiled log is refused by its name; where `mended`, the key that `check` names makes the numbers right.
#[track_caller]
fn refused(log: &Log, id: &str, mended: bool) {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    log.write(&at.join("set"), "");
    let (values, message) = calibrated(at, "set");
    assert!(values.is_none(), "{id}: {values:?}");
    assert!(message.contains(&format!("error: {id}: ")), "{id}: {message}");
    let found = problems(at, "set");
    let (_, severity, fix) = found.iter().find(|(name, ..)| name == id).unwrap_or_else(|| panic!("{id}: {found:?}"));
    assert_eq!(severity, "error", "{id}");
    if mended {
        let keys = fix.as_ref().and_then(|fix| fix.strip_prefix("[corrections] ")).expect("a key");
        log.write(&at.join("mended"), &format!("[corrections]\n{}\n", keys.replace(", ", "\n")));
        right(calibrated(at, "mended").0.unwrap_or_else(|| panic!("{id}: {}", calibrated(at, "mended").1)));
    }
}

#[test]
fn the_good_log_has_no_problem_and_gives_the_right_numbers() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    good(1).write(&temp.path().join("set"), "");
    assert_eq!(problems(temp.path(), "set"), []);
    let (values, message) = calibrated(temp.path(), "set");
    right(values.expect("calibrated"));
    assert_eq!(message, "");
    let found = document(temp.path(), &["check", "set"]);
    assert!(found["determined"].as_object().expect("by name").values().all(|is| is == true), "{found}");
}

#[test]
fn wheels_and_headings_on_the_wrong_side_are_named_and_mended() {
    refused(&good(2).rows(|_, wheels| wheels.swap(0, 1)), "wheels_exchanged", true);
    refused(&good(3).rows(|_, wheels| wheels[1] = -wheels[1]), "wheel_backwards", true);
    refused(&good(3).rows(|_, wheels| wheels[0] = -wheels[0]), "wheel_backwards", true);
    refused(&good(4).truths(|_, seen| (seen[1], seen[2]) = (-seen[1], -seen[2])), "wheels_exchanged", true);
    refused(&good(5).truths(|_, seen| seen[2] = -seen[2]), "heading_clockwise", true);
    refused(&good(6).truths(|_, seen| seen.swap(0, 1)), "axes_exchanged", true);
    refused(&good(6).truths(|_, seen| seen[1] = -seen[1]), "axis_mirrored", true);
}

#[test]
fn positions_alone_tell_of_wheels_and_units_too() {
    let positions = |seed| Log { positions: true, ..good(seed) };
    refused(&positions(28).rows(|_, wheels| wheels.swap(0, 1)), "wheels_exchanged", false);
    refused(&positions(28).rows(|_, wheels| wheels[1] = -wheels[1]), "wheel_backwards", false);
    let millimetres = positions(29).truths(|_, seen| (seen[0], seen[1]) = (1e3 * seen[0], 1e3 * seen[1]));
    refused(&millimetres, "truth_length_unit", false);
    let temp = tempfile::tempdir().expect("a temporary folder");
    positions(30).write(&temp.path().join("set"), "");
    assert_eq!(problems(temp.path(), "set"), []);
}

#[test]
fn other_units_are_named_and_mended() {
    let wrapped = |degrees: f64| (degrees + 180.0).rem_euclid(360.0) - 180.0;
    refused(&good(7).truths(|_, seen| seen[2] = wrapped(seen[2].to_degrees())), "heading_in_degrees", true);
    refused(&good(8).truths(|_, seen| (seen[0], seen[1]) = (1e3 * seen[0], 1e3 * seen[1])), "truth_length_unit", true);
    let milliseconds = good(9).truths(|t_s, _| *t_s *= 1e3).rows(|t_s, _| *t_s *= 1e3);
    refused(&milliseconds, "time_in_milliseconds", true);
    refused(&good(9).truths(|t_s, _| *t_s *= 1e3), "truth_time_unit", true);
    refused(&Log { robot_m: [150.0, 150.0, 300.0], ..good(10) }, "robot_length_unit", false);
    refused(&Log { ticks_per_rev: 1024.0, ..good(11) }, "ticks_per_turn", false);
    refused(&Log { ticks_per_rev: 16384.0, ..good(11) }, "ticks_per_turn", false);
}

#[test]
fn rows_that_are_received_together_are_not_taken_for_lost_ones() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    // Five rows at once, ten times a second.
    let together = |t_s: &mut f64, _: &mut [f64; 2]| {
        let received_s = 0.1 * (*t_s / 0.1 - 1e-6).ceil();
        *t_s = received_s - 5e-3 * (received_s - *t_s);
    };
    good(15).rows(together).write(&temp.path().join("set"), "");
    let found = problems(temp.path(), "set");
    assert!(found.iter().all(|(id, ..)| id != "lost_rows" && id != "gap"), "{found:?}");
}

#[test]
fn clocks_that_are_apart_are_named_and_mended() {
    for offset_s in [3.0, 100.0, -100.0] {
        refused(&good(12).truths(|t_s, _| *t_s += offset_s), "clock_offset", true);
    }
    refused(&good(13).truths(|t_s, _| *t_s *= 1.02), "clock_drift", true);
    // What a fit of a latency explains is said in words.
    for late_s in [0.05, 0.1] {
        let temp = tempfile::tempdir().expect("a temporary folder");
        good(14).truths(|t_s, _| *t_s += late_s).write(&temp.path().join("set"), "");
        let check = run_in(temp.path(), &["check", "set"]);
        assert!(check.stdout.contains(&format!("{late_s:.2}")) && check.stdout.contains("late"), "{}", check.stdout);
        let ended = run_in(temp.path(), &["calibrate", "set"]);
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        let has_latency = ended.stdout.contains("latency_s");
        assert_eq!(has_latency, ended.stdout.contains("ms late against the log"), "{}", ended.stdout);
        // Drives both ways: a latency that is not fitted moves a length by a third of a thousandth.
        let found = calibrated(temp.path(), "set").0.expect("calibrated");
        let off = found.iter().zip(TRUE_MM).map(|(found, truth)| (found.expect("a value") / truth - 1.0).abs());
        assert!(off.fold(0.0, f64::max) < 3.3e-4, "{found:?}");
    }
}

/// A delay that is larger than what the other causes of such residuals make leaves nothing else to be found.
#[test]
fn poses_that_come_late_are_diagnosed_as_that_and_nothing_else() {
    for late_s in [0.05, 0.1] {
        let temp = tempfile::tempdir().expect("a temporary folder");
        good(33).truths(|t_s, _| *t_s += late_s).write(&temp.path().join("set"), "");
        let found = document(temp.path(), &["diagnose", "set"]);
        let findings = found["findings"].as_array().expect("a list");
        assert_eq!(findings.len(), 1, "{findings:?}");
        let delay_s = findings[0]["parameters"]["delay_s"]["value"].as_f64().expect("a delay");
        // A row's motion is taken as evenly spread over its 20 ms: a millisecond in ramps.
        assert!((delay_s - late_s).abs() < 1e-3, "{delay_s} for {late_s}");
    }
}

#[test]
fn rates_of_the_instant_are_named_and_mended() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    good(34).write_instant_rates(&at.join("set"), "");
    let found = problems(at, "set");
    let [(id, severity, fix)] = &found[..] else { panic!("{found:?}") };
    assert_eq!(
        (&id[..], &severity[..], fix.as_deref()),
        ("instant_rates", "warning", Some("[corrections] instant_rates = true"))
    );
    let message = calibrated(at, "set").1;
    assert!(message.contains("warning: instant_rates: "), "{message}");
    good(34).write_instant_rates(&at.join("mended"), "[corrections]\ninstant_rates = true\n");
    assert_eq!(problems(at, "mended"), []);
    right(calibrated(at, "mended").0.expect("calibrated"));
}

#[test]
fn rows_that_no_wheel_and_no_instrument_makes_are_named() {
    let mut spike = good(15);
    spike.odometry[2000].2[0] = 4e9;
    refused(&spike, "counter_spike", false);
    let mut zero = good(15);
    let row = zero.odometry.iter().position(|row| row.0 == 8).expect("a square") + 300;
    zero.odometry[row].2 = [0.0, 0.0];
    refused(&zero, "counter_spike", false);
    let mut restart = good(16);
    let from = restart.odometry[row].2;
    for (_, _, wheels) in restart.odometry[row..].iter_mut().take_while(|row| row.0 == 8) {
        *wheels = [wheels[0] - from[0], wheels[1] - from[1]];
    }
    refused(&restart, "counter_restart", false);
    let mut far = good(17);
    far.truth[100].2[0] = 1e300;
    refused(&far, "truth_outlier", false);
    far.truth[100].2[0] = 50.0;
    let temp = tempfile::tempdir().expect("a temporary folder");
    far.write(&temp.path().join("set"), "");
    let (values, message) = calibrated(temp.path(), "set");
    right(values.expect("calibrated"));
    assert!(message.contains("truth_outlier"), "{message}");
}

#[test]
fn a_robot_that_stands_and_truth_that_is_the_odometry_are_named() {
    refused(&good(18).rows(|_, wheels| *wheels = [7.0, 9.0]), "nothing_moves", false);
    refused(&good(18).truths(|_, seen| *seen = [1.0, 2.0, 0.3]), "nothing_moves", false);
    let temp = tempfile::tempdir().expect("a temporary folder");
    good(19).with_own_truth().write(&temp.path().join("set"), "");
    let (_, message) = calibrated(temp.path(), "set");
    assert!(message.contains("warning: truth_is_odometry: "), "{message}");
}

#[test]
fn what_the_runs_do_not_determine_has_no_value() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    good(20).only("straight").write(&at.join("straights"), "");
    let (values, message) = calibrated(at, "straights");
    let [left, right, separation] = values.expect("calibrated");
    assert!((left.expect("a value") - TRUE_MM[0]).abs() < TOLERANCE_MM && right.is_some() && separation.is_none());
    assert_eq!(message, "");
    let check = run_in(at, &["check", "straights"]);
    assert!(
        check.stdout.contains("not_determined: these runs do not determine wheel_separation_m"),
        "{}",
        check.stdout
    );
    let ended = run_in(at, &["calibrate", "straights", "--out", "found.toml"]);
    assert!(ended.stdout.contains("not determined: wheel_separation_m: "), "{}", ended.stdout);
    let file = fs::read_to_string(at.join("found.toml")).expect("written");
    assert!(!file.contains("parameters.wheel_separation_m") && file.contains("left_wheel_diameter_m"), "{file}");
    good(21).only("spin").write(&at.join("spins"), "");
    let (values, message) = calibrated(at, "spins");
    assert!(values.is_none() && message.contains("determine no parameter"), "{message}");
    assert_eq!(run_in(at, &["calibrate", "spins", "--force"]).code, Some(0));
}

/// What is too large to be held is checked as it is read.
#[test]
fn large_logs_are_checked_before_they_are_fitted_evaluated_and_corrected() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    let log = good(35);
    log.write(&at.join("small"), "");
    assert_eq!(run_in(at, &["calibrate", "small", "--out", "c.toml"]).code, Some(0));
    let many = 500_000_usize.div_ceil(log.odometry.len());
    log.rows(|_, wheels| wheels.swap(0, 1)).repeated(many).write(&at.join("set"), "");
    let (values, message) = calibrated(at, "set");
    assert!(values.is_none() && message.contains("error: wheels_exchanged: "), "{values:?} {message}");
    for arguments in [&["evaluate", "set"][..], &["correct", "set", "--calibration", "c.toml", "--out", "poses"]] {
        let ended = run_in(at, arguments);
        assert!(ended.stderr.contains("error: wheels_exchanged: "), "{arguments:?}: {}", ended.stderr);
    }
}

#[test]
fn sessions_of_two_robots_are_refused_and_those_that_state_it_alone_are_not() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    good(22).write(&at.join("both/a"), "");
    driven([0.163, 0.1625, 0.320], 23).write(&at.join("both/b"), "");
    let (values, message) = calibrated(at, "both");
    assert!(values.is_none() && message.contains("error: several_robots: "), "{message}");
    assert_eq!(run_in(at, &["calibrate", "both", "--force"]).code, Some(0));
    good(22).write(&at.join("one/a"), "");
    Log { robot_m: [0.140, 0.140, 0.290], ..good(24) }.write(&at.join("one/b"), "");
    right(calibrated(at, "one").0.expect("calibrated"));
}

#[test]
fn a_calibration_is_no_test_of_itself_and_none_of_another_robot() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    good(25).write(&at.join("a"), "");
    good(26).write(&at.join("b"), "");
    driven([0.163, 0.1625, 0.320], 27).write(&at.join("c"), "");
    assert_eq!(run_in(at, &["calibrate", "a", "--out", "a.toml"]).code, Some(0));
    let on = |set: &str| run_in(at, &["evaluate", set, "--calibration", "a.toml", "--runs"]);
    assert!(on("a").stderr.contains("a.toml was trained on 10 of these 10 runs"), "{}", on("a").stderr);
    assert_eq!(on("b").stderr, "");
    assert!(on("b").stdout.contains("00_straight"), "{}", on("b").stdout);
    // A robot whose own wheels are stated well, under what was found of another.
    Log { robot_m: [0.163, 0.1625, 0.320], ..driven([0.163, 0.1625, 0.320], 27) }.write(&at.join("d"), "");
    assert!(on("d").stderr.contains("is it a calibration of this robot?"), "{}", on("d").stderr);
}
