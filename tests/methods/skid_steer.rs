//! A robot that skids in turns: the separation by which it turns, what it loses in turns, and the name of it.

use serde_json::Value;

use crate::support::{document, run_in};

/// Share of half of the wheels' difference that turns take from the distance, as the scenario has it.
const LOST_SHARE: f64 = 0.07;
/// The same for each radian, mm: half of 1.6 times the stated separation.
const LOST_MM_RAD: f64 = LOST_SHARE * 0.5 * 1.6 * 363.0;

#[test]
fn what_a_skidding_robot_loses_in_turns_is_said_by_calibrate_and_named_by_diagnose() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios/skid-steer.toml");
    let text = std::fs::read_to_string(file).expect("shipped");
    assert!(text.contains("lost_share = 0.07\n") && text.contains("ratio = 1.6\n"), "{text}");
    assert_eq!(run_in(at, &["simulate", file, "--trial", "1", "--out", "set"]).code, Some(0));
    let said = run_in(at, &["calibrate", "set"]).stderr;
    let of = said.split("shortens the distance driven by ").nth(1).unwrap_or_else(|| panic!("{said}"));
    let numbers: Vec<f64> = of.split_whitespace().take(3).filter_map(|word| word.parse().ok()).collect();
    let [lost, sigma] = numbers[..] else { panic!("{said}") };
    assert!((lost - LOST_MM_RAD).abs() < 3.0 * sigma && sigma < 0.1 * LOST_MM_RAD, "{lost} ± {sigma}");
    // Where no distance is driven in turns, nothing tells, and it is said.
    let without = text.split("[[protocol]]\nkind = \"circles\"").next().expect("a head");
    std::fs::write(at.join("no-bends.toml"), without).expect("written");
    assert_eq!(run_in(at, &["simulate", "no-bends.toml", "--trial", "1", "--out", "no-bends"]).code, Some(0));
    let said = run_in(at, &["calibrate", "no-bends"]).stderr;
    assert!(said.contains("these runs do not show by how much") && said.contains("add straights"), "{said}");

    let found = document(at, &["diagnose", "set"]);
    let first = &found["findings"][0];
    assert_eq!((&first["id"], &first["names"]), (&Value::from("turn_slip"), &serde_json::json!(["turn_slip"])));
    let value = |key: &str| first["parameters"]["lost_share"][key].as_f64().expect("a number");
    assert!((value("value") - LOST_SHARE).abs() < 3.0 * value("sigma"), "{first}");
    let drift = |of: &str| found["gain"]["drift_percent"][of].as_f64().expect("a drift");
    assert!(drift("low") > 0.0 && drift("extended") < 0.4 * drift("base"), "{}", found["gain"]);
}
