//! Real logs of a Khepera III with a laser (Censi et al. 2013) through the command: relative truth only, with
//! gaps.

use std::fs;
use std::path::Path;

use crate::support::real_data::real_data;
use crate::support::{document, refusal, succeed};

/// Counts of a wheel turn, as the data's description says.
const TICKS_PER_REV: f64 = 2764.8;

/// Objects, and total counts of both wheels, by a way of its own: text for the number of objects, a generic
/// parser for the sums.
fn counted(log: &str) -> (usize, [i64; 2]) {
    let mut totals = [0; 2];
    for object in serde_json::Deserializer::from_str(log).into_iter::<serde_json::Value>() {
        let object = object.expect("JSON");
        let number = |key: &str| object[key].as_f64().expect("a number");
        for (total, key) in totals.iter_mut().zip(["phi_l", "phi_r"]) {
            let turns = number(key) * number("T") / std::f64::consts::TAU;
            let counts = (turns * TICKS_PER_REV).round() as i64;
            *total += counts;
        }
    }
    (log.matches("\"T\"").count(), totals)
}

#[test]
fn khepera_logs_become_datasets_with_every_object_and_whole_counts() {
    let Some(folder) = real_data("khepera_logs_become_datasets_with_every_object_and_whole_counts", "khepera") else {
        return;
    };
    for file in ["l90.tuple", "lstraight.tuple"] {
        let log = fs::read_to_string(folder.join(file)).expect("a log");
        let (objects, totals) = counted(&log);
        let temp = tempfile::tempdir().expect("a temporary folder");
        let source = folder.join(file).display().to_string();
        let imported = document(temp.path(), &["import", "censi", &source, "--out", "set"]);
        // One row an object and one at time 0.
        assert_eq!(imported["datasets"][0]["odometry_rows"], objects + 1, "{file}");

        let set = temp.path().join("set");
        let lines = |name: &str| fs::read_to_string(set.join(name)).expect("a table").lines().count();
        assert_eq!((lines("displacement.csv"), lines("odometry.csv")), (objects + 1, objects + 2), "{file}");
        let odometry = fs::read_to_string(set.join("odometry.csv")).expect("a table");
        // Every count is a whole number as text, and the last ones are the sums.
        let counts: Vec<[i64; 2]> = odometry
            .lines()
            .skip(1)
            .map(|line| {
                let fields: Vec<&str> = line.split(',').collect();
                [2, 3].map(|column: usize| fields[column].parse().expect("a whole count"))
            })
            .collect();
        assert_eq!(counts.last(), Some(&totals), "{file}");
        assert!(!dataset::read(&set).expect("readable").dataset.runs[0].info.continuous, "{file}");

        // What must not pass: a log cut after an object, and one whose speeds are no whole counts.
        let cut = log.rfind("{ \"T\"").expect("a last object");
        fs::write(temp.path().join("cut.tuple"), &log[..cut]).expect("written");
        let imported = document(temp.path(), &["import", "censi", "cut.tuple", "--out", "cut"]);
        assert_eq!(imported["datasets"][0]["odometry_rows"], objects, "{file}");
        fs::write(temp.path().join("scaled.tuple"), log.replacen("\"T\": 7.9", "\"T\": 7.8", 1)).expect("written");
        let message = refusal(temp.path(), &["import", "censi", "scaled.tuple", "--out", "scaled"]);
        assert!(message.starts_with("scaled.tuple:") && message.contains("expected a whole number"), "{message}");
        assert!(!temp.path().join("scaled").exists());
    }
}

#[test]
fn khepera_logs_drift_along_their_chain_and_say_why_they_have_no_closed_form() {
    let Some(folder) =
        real_data("khepera_logs_drift_along_their_chain_and_say_why_they_have_no_closed_form", "khepera")
    else {
        return;
    };
    for file in ["l90", "lstraight"] {
        let temp = tempfile::tempdir().expect("a temporary folder");
        let at = temp.path();
        let source = folder.join(format!("{file}.tuple")).display().to_string();
        succeed(at, &["import", "censi", &source, "--out", "set"]);
        let evaluated = document(at, &["evaluate", "set"]);
        assert_eq!(evaluated["dataset"], file);
        let nominal = &evaluated["calibrations"][0];
        // Scans were matched one after the other: their chain is what the drift is measured against.
        for key in ["max_position_m", "max_heading_rad", "max_final_position_m", "drift_percent"] {
            assert!(nominal[key].as_f64().is_some_and(|value| value > 0.0), "{key}");
        }
        assert_eq!(nominal["runs"][0]["starts_by"], "chain");
        assert!(nominal["runs"][0]["length_m"].as_f64().is_some_and(|length_m| length_m > 1.0));
        only_one_message(at, &["calibrate", "set", "--method", "direct"], "direct cannot be applied");
        only_one_message(at, &["calibrate", "set", "--method", "umbmark"], "umbmark cannot be applied");
    }
}

#[track_caller]
fn only_one_message(folder: &Path, arguments: &[&str], begins: &str) {
    let message = refusal(folder, arguments);
    assert!(message.starts_with(begins), "{message}");
}
