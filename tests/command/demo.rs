//! `yair demo`: what is hidden is what is told, the files are there, and what cannot be hidden is refused.

use serde_json::Value;

use crate::support::{refusal, succeed};

/// A right size is beyond so many standard deviations once in 16 000 draws.
const MAX_SIGMAS: f64 = 4.0;

#[test]
fn the_fault_that_is_hidden_is_named_with_its_size() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    let printed = succeed(at, &["demo", "--fault", "floor_slope", "--json", "--out", "story"]).stdout;
    let document: Value = serde_json::from_str(&printed).expect("one document");
    assert_eq!((&document["found"], &document["named_first"]), (&Value::from(true), &Value::from(true)));
    let hidden = document["hidden"]["parameters"].as_object().expect("sizes");
    assert!(!hidden.is_empty());
    for (name, value) in hidden {
        let found = &document["finding"]["parameters"][name];
        let of = |value: &Value| value.as_f64().expect("a number");
        let sigmas = (of(&found["value"]) - of(value)).abs() / of(&found["sigma"]);
        assert!(sigmas < MAX_SIGMAS, "{name}: {value} hidden, {found} found");
    }
    let drift = &document["new_session_drift_percent"];
    assert!(drift["extended"].as_f64() < drift["nominal"].as_f64(), "{drift}");
    for file in ["truth.json", "robot/odometry.csv", "new-session/truth.csv", "diagnosis/report.html"] {
        assert!(at.join("story").join(file).is_file(), "{file}");
    }
    let filled = refusal(at, &["demo", "--out", "story"]);
    assert!(filled.contains("story: already exists") && filled.contains("--force"), "{filled}");
}

#[test]
fn what_cannot_be_hidden_is_refused_and_nothing_is_written() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    for (fault, why) in [("nonsense", "known: wheel_scale"), ("wheelbase", "every calibration fits it")] {
        let refused = refusal(at, &["demo", "--fault", fault]);
        assert!(refused.contains(why), "{refused}");
    }
    assert!(std::fs::read_dir(at).expect("there").next().is_none());
}
