//! An instrument that is turned on the robot, or late: what dead reckoning drifts does not depend on it, and
//! each session has its own.

use std::path::Path;

use serde_json::Value;

use crate::good_log::{Log, good};
use crate::support::{document, run_in, succeed};

/// A drive seen by a tag that is turned by so many degrees and stamped so late.
fn seen_by(log: Log, turned_deg: f64, late_s: f64) -> Log {
    log.truths(move |t_s, seen| {
        *t_s += late_s;
        seen[2] += turned_deg.to_radians();
    })
}

/// Drift of nominal values and of the calibration, per cent, and where the instrument is taken from.
fn drifts(at: &Path, set: &str, calibration: &str) -> ([f64; 2], Value) {
    let found = document(at, &["evaluate", set, "--calibration", calibration]);
    let of = |number: usize| &found["calibrations"][number];
    ([0, 1].map(|number| of(number)["drift_percent"].as_f64().expect("a drift")), of(1)["mounting_from"].clone())
}

#[test]
fn drift_is_the_same_however_the_tag_is_turned_and_however_late_it_is() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    let mut first = None;
    let all = [0.0, 3.0, 10.0, 100.0, 180.0].into_iter().flat_map(|deg| [0, 50, 150].map(|late_ms| (deg, late_ms)));
    // A tag of 2° that is late did not converge.
    for (turned_deg, late_ms) in all.chain([(2.0, 50), (2.0, 150)]) {
        let name = format!("set-{turned_deg}-{late_ms}");
        seen_by(good(40), turned_deg, 1e-3 * f64::from(late_ms)).write(&at.join(&name), "");
        succeed(at, &["calibrate", &name, "--out", &format!("{name}.toml"), "--quiet"]);
        let (found, _) = drifts(at, &name, &format!("{name}.toml"));
        let first = *first.get_or_insert(found);
        for (found, first) in found.iter().zip(first) {
            assert!((found - first).abs() < 0.01 * first, "{name}: {found} and {first} %");
        }
    }
}

#[test]
fn a_tag_that_was_mounted_anew_is_said_and_each_session_is_evaluated_with_its_own() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    for (name, seed, turned_deg, late_s) in [("a", 41, 0.0, 0.0), ("b", 42, 100.0, 0.12), ("c", 43, -60.0, 0.2)] {
        seen_by(good(seed), turned_deg, late_s).write(&at.join(name), &format!("name = \"{name}\"\n"));
    }
    let said = run_in(at, &["calibrate", "a", "b", "--out", "both.toml"]).stderr;
    for what in ["between a and b the instrument turned by ", "between a and b the instrument became "] {
        assert!(said.contains(what), "{said}");
    }
    let file = std::fs::read_to_string(at.join("both.toml")).expect("written");
    assert!(file.contains("[[methods.own_instruments]]"), "{file}");
    // A session that it was not found on has an instrument of its own as well.
    for (name, from) in [("a", "joint"), ("b", "joint"), ("c", "these runs, with all lengths free")] {
        let ([nominal, calibrated], mounting_from) = drifts(at, name, "both.toml");
        assert_eq!(mounting_from, from, "{name}");
        assert!(calibrated < 0.1 && (1.0..5.0).contains(&nominal), "{name}: {nominal} and {calibrated} %");
    }
}
