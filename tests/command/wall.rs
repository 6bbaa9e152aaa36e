//! A lidar in front of a wall, as a scenario has it: spins at several speeds calibrate the wheelbase and show
//! that it depends on the yaw rate.

use std::fs;

use serde_json::Value;

use crate::support::{document, refusal, succeed};

const WALL: &str = include_str!("../../scenarios/wall.toml");

/// The scenario without its effect of the yaw rate.
fn plain() -> String {
    let (before, after) = WALL.split_once("[[effect]]\nkind = \"turn_rate_wheelbase\"").expect("in the scenario");
    let (_, protocol) = after.split_once("[[protocol]]").expect("in the scenario");
    format!("{before}[[protocol]]{protocol}")
}

#[test]
fn spins_at_several_speeds_in_front_of_a_wall_calibrate_the_wheelbase_that_goes_with_the_stated_wheels() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    fs::write(folder.join("plain.toml"), plain()).expect("written");
    succeed(folder, &["simulate", "plain.toml", "--out", "robot"]);
    let walls = fs::read_to_string(folder.join("robot/wall.csv")).expect("written");
    assert!(walls.starts_with("run,t_s,wall,distance_m,heading_rad,sigma_m,sigma_rad\nspin_000,0,wall_0,"), "{walls}");
    let manifest = fs::read_to_string(folder.join("robot/dataset.toml")).expect("written");
    assert!(manifest.contains("[lidar]\n\n"), "{manifest}");
    let found = document(folder, &["calibrate", "robot"]);
    let parameters = &found["methods"][0]["parameters"];
    let [value, sigma] =
        ["value", "sigma"].map(|key| parameters["wheel_separation_m"][key].as_f64().expect("a number"));
    // The wheelbase of 1.015 times 0.363 m over the wheels' common scale of 1.01, which nothing measures.
    let expected = 1.015 * 0.363 / 1.01;
    // Four standard deviations: one draw in 16 000 is farther off. The nominal wheelbase is 1.8 mm off.
    assert!((value - expected).abs() < 4.0 * sigma, "{value} ± {sigma}, not {expected}");
    // 16 spins of 4π with wheels of 0.5 mm/√m: √(2 · 2.3 m) · 0.5 mm / 0.363 m / 4π / √16 of it, 6e-5.
    assert!(sigma < 1.5e-4 * expected, "{value} ± {sigma}");
    assert!(parameters["left_wheel_diameter_m"]["value"].is_null(), "{found}");
}

#[test]
fn spins_at_several_speeds_in_front_of_a_wall_show_a_wheelbase_that_grows_with_the_yaw_rate() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    fs::write(folder.join("wall.toml"), WALL).expect("written");
    fs::write(folder.join("plain.toml"), plain()).expect("written");
    let found = |scenario: &str, name: &str| -> Vec<Value> {
        succeed(folder, &["simulate", scenario, "--out", name]);
        document(folder, &["diagnose", name])["findings"].as_array().expect("findings").clone()
    };
    let findings = found("wall.toml", "robot");
    let [one] = &findings[..] else { panic!("one finding: {findings:?}") };
    assert_eq!(one["id"], "turn_rate_wheelbase", "{one}");
    let beta = &one["parameters"]["beta_s"];
    let [value, sigma] = ["value", "sigma"].map(|key| beta[key].as_f64().expect("a number"));
    // Four standard deviations, as above.
    assert!((value - 0.01).abs() < 4.0 * sigma && sigma < 1e-3, "{beta}");
    assert!(found("plain.toml", "sound").is_empty());
}

#[test]
fn a_wall_that_cannot_be_is_refused_with_its_key() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    let (before, from) = WALL.split_once("[[instrument]]").expect("in the scenario");
    let (block, after) = from.split_once("[[effect]]").expect("in the scenario");
    let twice = format!("{before}[[instrument]]{block}[[instrument]]{block}[[effect]]{after}");
    let cases = [
        (WALL.replace("rate_hz = 10.0", "rate_hz = 0.0"), "1 / instrument.rate_hz is inf"),
        (WALL.replace("range_m = 8.0", "range_m = -8.0"), "instrument.range_m is -8"),
        (WALL.replace("range_m = 8.0", "reach_m = 8.0"), "unknown field `reach_m`"),
        (WALL.replace("still_s = 3.0", ""), "missing field `still_s`"),
        (
            WALL.replace("sigma_m = 0.003", "sigma_m = 0.0").replace("sigma_rad = 0.001", "sigma_rad = 0.0"),
            "instrument.sigma_m + instrument.sigma_rad is 0; it must be positive",
        ),
        (twice.replacen("lever_x_m = 0.15", "lever_x_m = 0.1", 1), "one lidar sees all walls"),
        (WALL.replace("fastest_m_s = 0.4", "fastest_m_s = 0.1"), "protocol.fastest_m_s is 0.1; it must be above"),
        (WALL.replace("speeds = 4", "speeds = 1"), "protocol.speeds is 1; it must be from 2 to 100"),
    ];
    for (text, expected) in cases {
        assert_ne!(text, WALL);
        fs::write(folder.join("wrong.toml"), text).expect("written");
        let message = refusal(folder, &["simulate", "wrong.toml", "--out", "robot"]);
        assert!(message.contains(expected), "{message}");
    }
    fs::write(folder.join("twice.toml"), twice).expect("written");
    succeed(folder, &["simulate", "twice.toml", "--out", "robot"]);
    let walls = fs::read_to_string(folder.join("robot/wall.csv")).expect("written");
    assert!(walls.contains("spin_000,0,wall_0,") && walls.contains("spin_000,0,wall_1,"), "{walls}");
}
