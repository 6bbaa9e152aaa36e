//! Poses of simultaneous localization and mapping, as a user calibrates with them: the map's distortion, its
//! scale, and poses that follow the wheels.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::good_log::good;
use crate::support::{document, refusal, run_in, succeed};

const SCENARIO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios/slam.toml");
const TAPE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios/gyro-and-tape.toml");
const CAPTURED: &str = include_str!("../../scenarios/gyro-and-tape-captured.toml");

const KEYS: [&str; 3] = ["left_wheel_diameter_m", "right_wheel_diameter_m", "wheel_separation_m"];

/// Value and standard deviation of each parameter.
fn parameters(folder: &Path) -> [[f64; 2]; 3] {
    let _ = fs::remove_file(folder.join("robot.toml"));
    let found = document(folder, &["calibrate", "robot", "--out", "robot.toml"]);
    KEYS.map(|key| {
        let of = &found["methods"][0]["parameters"][key];
        [&of["value"], &of["sigma"]].map(|number| number.as_f64().expect("a number"))
    })
}

#[test]
fn a_stated_distortion_of_the_map_is_in_the_sigma() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    succeed(folder, &["simulate", SCENARIO, "--out", "robot"]);
    let text = fs::read_to_string(folder.join("robot.truth.json")).expect("written");
    let truth: Value = serde_json::from_str(&text).expect("JSON");
    let stated = parameters(folder);
    for ([value, sigma], key) in stated.into_iter().zip(KEYS) {
        // Four standard deviations: one draw in 16 000 is farther off.
        assert!((value - truth[key].as_f64().expect("a number")).abs() < 4.0 * sigma, "{key}: {value} ± {sigma}");
    }
    let manifest = folder.join("robot/dataset.toml");
    let whole = fs::read_to_string(&manifest).expect("written");
    fs::write(&manifest, whole.replace("map_length_m = 1.0\n", "")).expect("written");
    let message = refusal(folder, &["calibrate", "robot", "--quiet", "--out", "none.toml"]);
    assert!(message.contains("dataset.toml") && message.contains("map_length_m is missing"), "{message}");
    let silent: String =
        whole.lines().filter(|line| !line.starts_with("map_")).map(|line| format!("{line}\n")).collect();
    fs::write(&manifest, silent).expect("written");
    for ([_, with], [_, without]) in stated.into_iter().zip(parameters(folder)) {
        // Runs all over the hall meet the same places: by the sweep the scatter over runs alone misses a
        // part of the error.
        assert!(with > 1.05 * without, "{with} and {without} without the map");
    }
}

#[test]
fn a_tape_tells_the_maps_scale_and_poses_alone_do_not() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    let (robot, _) = CAPTURED.split_once("[sweep]").expect("a sweep");
    let effect = "[[effect]]\nkind = \"truth_map_scale\"\nscale_error = 0.02\n";
    fs::write(folder.join("scaled.toml"), format!("{robot}{effect}")).expect("written");
    succeed(folder, &["simulate", "scaled.toml", "--out", "robot"]);
    succeed(folder, &["simulate", TAPE, "--out", "tape"]);

    let alone = document(folder, &["diagnose", "robot"]);
    assert_eq!(alone["findings"], Value::Array(Vec::new()), "{}", alone["findings"]);
    let blind = alone["blind_to"].as_array().expect("a list");
    let of_map = blind.iter().find(|of| of["id"] == "truth_map_scale").expect("not determined by poses alone");
    // Rounding alone is left of its information: a hundred times what is large would not show.
    let smallest = of_map["smallest_detectable"]["value"].as_f64();
    assert!(smallest.is_none_or(|scale_error| scale_error > 1.0), "{of_map}");

    let both = document(folder, &["diagnose", "robot", "tape"]);
    let findings = both["findings"].as_array().expect("a list");
    let [finding] = &findings[..] else { panic!("{findings:?}") };
    assert_eq!(finding["names"], serde_json::json!(["truth_map_scale"]));
    let scale = &finding["parameters"]["scale_error"];
    let [value, sigma] = ["value", "sigma"].map(|key| scale[key].as_f64().expect("a number"));
    // Four standard deviations, and the tape's millimetre over a dozen straights of 3 m.
    assert!((value - 0.02).abs() < 4.0 * sigma && sigma < 5e-4, "{value} ± {sigma}");

    // A distortion of the map is in what is known of its scale, until it may be all that was found.
    let manifest = folder.join("robot/dataset.toml");
    let exact = fs::read_to_string(&manifest).expect("written");
    let distorted = |sigma_xy_m: &str| {
        let stated = format!("[truth]\nmap_sigma_xy_m = {sigma_xy_m}\nmap_length_m = 1.0");
        fs::write(&manifest, exact.replace("[truth]", &stated)).expect("written");
        document(folder, &["diagnose", "robot", "tape"])
    };
    let known = distorted("0.01");
    assert_eq!(known["findings"][0]["names"], serde_json::json!(["truth_map_scale"]));
    let in_map = known["findings"][0]["parameters"]["scale_error"]["sigma"].as_f64().expect("a number");
    assert!(in_map > 3.0 * sigma && in_map < 0.005, "{in_map} and {sigma} of an exact map");
    let open = distorted("0.5");
    assert_eq!(open["findings"], Value::Array(Vec::new()), "{}", open["findings"]);
}

#[test]
fn poses_that_odometry_carries_on_between_corrections_are_named() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    let ids = |set: &str| {
        let ended = run_in(at, &["check", set, "--json", "--quiet"]);
        let found: Value = serde_json::from_str(&ended.stdout).expect("JSON");
        let of = |problem: &Value| problem["id"].as_str().expect("an id").to_owned();
        found["problems"].as_array().expect("a list").iter().map(of).collect::<Vec<_>>()
    };
    let corrected = |t_s: &mut f64, seen: &mut [f64; 3]| {
        if *t_s > 4.0 {
            *seen = [seen[0] + 0.05, seen[1] - 0.02, seen[2] + 0.03];
        }
    };
    good(23).with_own_truth().truths(corrected).write(&at.join("carried"), "");
    good(23).truths(corrected).write(&at.join("measured"), "");
    assert!(ids("carried").contains(&"truth_follows_odometry".to_owned()), "{:?}", ids("carried"));
    assert!(!ids("measured").contains(&"truth_follows_odometry".to_owned()), "{:?}", ids("measured"));
}
