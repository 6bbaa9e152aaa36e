//! Which instrument is enough for what: what `check` says would determine a parameter that is open, and what
//! `plan` says that each instrument would leave of ±.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::support::{document, succeed};

fn scenario(name: &str) -> String {
    format!("{}/scenarios/{name}.toml", env!("CARGO_MANIFEST_DIR"))
}

/// What would determine each parameter that is open in a dataset.
fn would_determine(folder: &Path) -> Vec<(String, Vec<String>)> {
    let found = document(folder, &["check", "robot"]);
    let entry = |of: &Value| {
        let with = of["with"].as_array().expect("instruments").iter();
        let with = with.map(|one| one.as_str().expect("a name").to_owned()).collect();
        (of["parameter"].as_str().expect("a name").to_owned(), with)
    };
    found["would_determine"].as_array().expect("a list").iter().map(entry).collect()
}

#[test]
fn check_names_the_cheapest_instrument_that_would_determine_what_is_open() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    succeed(folder, &["simulate", &scenario("gyro-and-tape"), "--out", "robot"]);
    assert!(would_determine(folder).is_empty());
    let open = |parameter: &str, with: &[&str]| {
        (parameter.to_owned(), with.iter().map(|one| (*one).to_owned()).collect::<Vec<_>>())
    };

    let tapes = fs::read(folder.join("robot/distance.csv")).expect("written");
    fs::remove_file(folder.join("robot/distance.csv")).expect("removed");
    let wheels = [open("left_wheel_diameter_m", &["tape"]), open("right_wheel_diameter_m", &["tape"])];
    assert_eq!(would_determine(folder), wheels);
    let said = succeed(folder, &["check", "robot"]).stdout;
    assert!(said.contains("left_wheel_diameter_m: would be determined by a tape measure"), "{said}");
    // What is named does it.
    fs::write(folder.join("robot/distance.csv"), tapes).expect("written");
    assert!(would_determine(folder).is_empty());

    fs::remove_file(folder.join("robot/revisit.csv")).expect("removed");
    assert_eq!(would_determine(folder), [open("wheel_separation_m", &["revisit"])]);

    // Spins alone: whatever measures them, no length is driven.
    fs::remove_dir_all(folder.join("robot")).expect("removed");
    fs::remove_file(folder.join("robot.truth.json")).expect("removed");
    succeed(folder, &["simulate", &scenario("wall"), "--out", "robot"]);
    assert_eq!(would_determine(folder), [open("left_wheel_diameter_m", &[]), open("right_wheel_diameter_m", &[])]);
    let said = succeed(folder, &["check", "robot"]).stdout;
    assert!(said.contains("no instrument determines it with these drives: drive straights"), "{said}");
}

#[test]
fn plan_says_what_each_instrument_would_leave_in_the_same_room_and_time() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    let planned = |minutes: &str| -> Vec<Value> {
        let arguments = ["plan", &scenario("gyro-and-tape-captured"), "--room", "5,4", "--minutes", minutes];
        document(folder, &arguments)["instruments"].as_array().expect("a list").clone()
    };
    let (ten, forty) = (planned("10"), planned("40"));
    let names: Vec<&str> = ten.iter().filter_map(|of| of["instrument"].as_str()).collect();
    assert_eq!(names, ["capture", "slam", "wall", "gyro-tape", "revisit"]);
    for (of, more) in ten.iter().zip(&forty) {
        let minutes = of["minutes"].as_f64().expect("a number");
        assert!(minutes <= 10.0, "{of}");
        if of["instrument"] == "slam" {
            assert!(of["why_null"].as_str().expect("a reason").contains("correlated"), "{of}");
            continue;
        }
        assert!(minutes > 8.0 && of["why_null"].is_null(), "{of}");
        for key in ["left_wheel_diameter_m", "right_wheel_diameter_m", "wheel_separation_m"] {
            let [sigma, later] = [of, more].map(|of| of["sigmas"][key].as_f64().expect("a number"));
            // Four times as many runs halve it. Pairs of runs are whole: two of them become up to eleven.
            assert!((sigma / later / 2.0 - 1.0).abs() < 0.2, "{key} {of} {more}");
        }
    }
    let base = |at: usize| ten[at]["sigmas"]["wheel_separation_m"].as_f64().expect("a number");
    // Gyro, tape and mark come within twice of motion capture, and tape and mark do not.
    assert!(base(0) < base(3) && base(3) < 2.0 * base(0) && base(4) > 2.0 * base(0), "{ten:?}");
}
