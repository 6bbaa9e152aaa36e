//! `yair fleet`: sessions grouped by robot, changes and ranks, what fails, and what the next call reuses.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use bench::FolderLock;
use serde_json::Value;

use crate::support::{document, everything_in, refusal, run_in, succeed, usage};

/// Three cases of a right tyre: new, worn by 0.1 % and by 0.4 %.
fn scenario() -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/fleet.toml").display().to_string()
}

fn session(at: &Path, name: &str, point: &str, seed: &str, identity: &[&str]) {
    let scenario = scenario();
    let arguments = ["simulate", &scenario, "--point", point, "--seed", seed, "--out", name];
    succeed(at, &[&arguments, identity].concat());
}

/// Two robots with two sessions each, of which the second changes.
fn fleet(at: &Path) {
    for (robot, day, point, seed) in [
        ("cart-1", "23", "1", "11"),
        ("cart-1", "24", "1", "12"),
        ("cart-2", "23", "1", "21"),
        ("cart-2", "24", "3", "22"),
    ] {
        let recorded = format!("2026-11-{day}T08:00:00+01:00");
        let identity = ["--robot-id", robot, "--recorded", &recorded];
        session(at, &format!("robots/{robot}/{day}"), point, seed, &identity);
    }
}

fn entries<'v>(value: &'v Value, key: &str) -> &'v [Value] {
    value[key].as_array().unwrap_or_else(|| panic!("{key} is no list in {value}"))
}

fn texts<'v>(list: &'v [Value], key: &str) -> Vec<&'v str> {
    list.iter().map(|entry| entry[key].as_str().unwrap_or_else(|| panic!("no text {key} in {entry}"))).collect()
}

#[test]
fn the_worn_robot_is_first_its_change_is_found_and_what_fails_stops_nothing() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    fleet(at);
    // A dataset of nobody; one that cannot be read; a session of cart-1 without a date; a copy of a session.
    session(at, "robots/alone", "1", "31", &[]);
    session(at, "robots/cart-1/undated", "1", "13", &["--robot-id", "cart-1"]);
    for copy in ["broken", "copy"] {
        fs::create_dir(at.join("robots").join(copy)).expect("made");
        for file in ["dataset.toml", "odometry.csv", "truth.csv"] {
            fs::copy(at.join("robots/cart-1/23").join(file), at.join("robots").join(copy).join(file)).expect("copied");
        }
    }
    fs::write(at.join("robots/broken/odometry.csv"), "run,t_s\nnonsense\n").expect("written");
    let arguments = ["fleet", "robots", "--calibrate-only", "--json", "--csv", "fleet.csv", "--html", "fleet.html"];
    let ended = run_in(at, &arguments);
    assert_eq!(ended.code, Some(1), "{}", ended.stderr);
    assert!(ended.stderr.contains("error: 3 of 8 datasets failed, the others are complete"), "{}", ended.stderr);
    let found: Value = serde_json::from_str(&ended.stdout).expect("a document");

    let failed = entries(&found, "failed");
    assert_eq!(texts(failed, "dataset"), ["robots/broken", "robots/cart-1/undated", "robots/copy"]);
    let errors = texts(failed, "error");
    assert!(errors[0].contains("odometry.csv:"), "{errors:?}");
    assert!(errors[1].contains("recorded = "), "{errors:?}");
    assert!(errors[2].contains("robots/cart-1/23"), "{errors:?}");

    let robots = entries(&found, "robots");
    assert_eq!(robots.iter().map(|robot| robot["rank"].as_u64()).collect::<Vec<_>>(), [Some(1), Some(2), Some(3)]);
    assert_eq!(texts(robots, "id")[0], "cart-2");
    let of = |id: &str| robots.iter().find(|robot| robot["id"] == id).unwrap_or_else(|| panic!("no {id}"));
    let (worn, steady, alone) = (of("cart-2"), of("cart-1"), of("robots/alone"));
    assert_eq!(alone["id_is_stated"], false);
    assert_eq!(texts(entries(worn, "sessions"), "recorded"), ["2026-11-23T07:00:00Z", "2026-11-24T07:00:00Z"]);
    assert_eq!(found["tested_changes"], 6);
    let changes = entries(worn, "changes");
    let right = changes.iter().find(|change| change["parameter"] == "right_wheel_diameter_m").expect("tested");
    let number = |value: &Value| value.as_f64().unwrap_or_else(|| panic!("no number: {value}"));
    // 0.4 % of 0.16 m; five standard deviations of a difference that is found to 0.03 mm.
    assert!((number(&right["difference"]) + 6.4e-4).abs() < 5.0 * number(&right["sigma"]), "{right}");
    assert!(number(&right["sigma"]) < 5e-5 && right["significant"] == true, "{right}");
    // The seeds are fixed: of the steady robot's three changes none is significant.
    assert!(entries(steady, "changes").iter().all(|change| change["significant"] == false), "{steady}");
    // Per metre the right wheel turns it by 0.004/0.363 rad, which squares of 1.5 m and straights of 2 m show
    // as about a per cent.
    let excess = &worn["excess_drift_percent"];
    assert!(excess["distinguishable"] == true && (0.8..1.6).contains(&number(&excess["value"])), "{excess}");
    let none = &steady["excess_drift_percent"];
    assert!(none["value"].is_null() && none["why_null"].as_str().is_some_and(|why| why.contains("zero")), "{none}");
    assert!(worn["findings"].is_null() && worn["findings_why_null"].is_string());
    // The parameters are those of `yair calibrate` on the latest session.
    let alone = document(at, &["calibrate", "robots/cart-2/24"]);
    for (key, value) in worn["parameters"].as_object().expect("parameters") {
        assert_eq!(value["value"], alone["methods"][0]["parameters"][key]["value"], "{key}");
        assert_eq!(value["sigma"], alone["methods"][0]["parameters"][key]["sigma"], "{key}");
    }

    let table = fs::read_to_string(at.join("fleet.csv")).expect("written");
    let mut rows = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = rows.next().expect("a header");
    let rows: Vec<_> = rows.collect();
    assert_eq!((rows.len(), rows.iter().all(|row| row.len() == header.len())), (5, true));
    assert_eq!(rows[1][1..3], ["cart-2", "robots/cart-2/24"]);
    let changed = header.iter().position(|name| *name == "significant_changes").expect("a column");
    assert!(rows[1][changed].contains("right_wheel_diameter_m") && rows[0][changed].is_empty());
    let page = fs::read_to_string(at.join("fleet.html")).expect("written");
    for part in ["Service cart-2 first", "robots/cart-1/undated", "right_wheel_diameter_m"] {
        assert!(page.contains(part), "{part}");
    }
}

#[test]
fn a_second_call_computes_nothing_and_jobs_change_nothing() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    fleet(at);
    let call = |more: &[&str]| document(at, &[&["fleet", "robots", "--calibrate-only"], more].concat());
    let counts = |found: &Value| (found["datasets"]["computed"].clone(), found["datasets"]["reused"].clone());
    let without_counts = |mut found: Value| {
        found["datasets"] = Value::Null;
        found
    };
    let first = call(&["--out", "kept", "--jobs", "1"]);
    assert_eq!(counts(&first), (4.into(), 0.into()));
    let stored = everything_in(&at.join("kept/sessions"));
    assert_eq!(stored.len(), 4);
    let second = call(&["--out", "kept", "--jobs", "3"]);
    assert_eq!(counts(&second), (0.into(), 4.into()));
    assert_eq!(without_counts(second), without_counts(first.clone()));
    assert_eq!(without_counts(call(&["--jobs", "3"])), without_counts(first.clone()));

    // What is stored is what is shown: another number in a file is another number in the document.
    let text = fs::read_to_string(&stored[0]).expect("readable");
    fs::write(&stored[0], text.replace("\"runs\":24", "\"runs\":25")).expect("written");
    let runs = |found: &Value| -> Vec<u64> {
        let sessions = entries(found, "robots").iter().flat_map(|robot| entries(robot, "sessions"));
        sessions.filter_map(|session| session["runs"].as_u64()).collect()
    };
    assert_eq!(runs(&call(&["--out", "kept"])).iter().sum::<u64>(), 97);
    // A file that is cut off, and a log that changes, are found anew.
    fs::write(&stored[0], &text[..text.len() / 2]).expect("written");
    let log = at.join("robots/cart-1/23/dataset.toml");
    fs::write(&log, fs::read_to_string(&log).expect("readable") + "# looked at\n").expect("written");
    let again = call(&["--out", "kept"]);
    let whole = serde_json::from_slice::<Value>(&fs::read(&stored[0]).expect("readable")).is_ok();
    // The file that is cut off may be that of the log that changed: then it is asked for no more.
    assert_eq!(counts(&again), if whole { (2.into(), 2.into()) } else { (1.into(), 3.into()) });
    assert_eq!(everything_in(&at.join("kept/sessions")).len(), 5);
}

#[test]
fn a_fleet_has_the_findings_of_diagnose() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/motion-capture.toml").display().to_string();
    succeed(at, &["simulate", &scenario, "--out", "robots/cart", "--robot-id", "cart-3"]);
    let found = document(at, &["fleet", "robots"]);
    let alone = document(at, &["diagnose", "robots/cart"]);
    let [robot] = entries(&found, "robots") else { panic!("one robot") };
    let findings = entries(robot, "findings");
    assert!(!findings.is_empty());
    assert_eq!(texts(findings, "sentence"), texts(entries(&alone, "findings"), "sentence"));
}

#[test]
fn a_folder_without_datasets_a_wrong_rate_and_a_folder_in_use_are_refused() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    session(at, "a/b/set", "1", "1", &[]);
    assert!(refusal(at, &["fleet", "nowhere"]).contains("nowhere: there is no such folder"));
    fs::create_dir_all(at.join("x/y")).expect("made");
    assert!(refusal(at, &["fleet", "x"]).contains("a dataset is a folder with dataset.toml"));
    assert!(refusal(at, &["fleet", "a", "a/b"]).contains("given twice"));
    assert!(refusal(at, &["fleet", "a", "--csv", "x"]).contains("it is a folder, where a file belongs"));
    assert!(refusal(at, &["fleet", "a", "--html", "none/f.html"]).contains("there is no folder none"));
    assert!(usage(at, &["fleet", "a", "--fdr", "5"]).contains("expected a rate"));
    assert!(usage(at, &["simulate", "s.toml", "--out", "b", "--recorded", "today"]).contains("RFC 3339"));
    let lock = FolderLock::take(&at.join("kept")).expect("free");
    assert!(refusal(at, &["fleet", "a", "--out", "kept"]).contains("another process writes there"));
    drop(lock);
    // Two levels below, and no third.
    fs::create_dir_all(at.join("deep/1/2")).expect("made");
    fs::rename(at.join("a/b/set"), at.join("deep/1/2/set")).expect("moved");
    assert!(refusal(at, &["fleet", "deep"]).contains("two folders below"));
    assert_eq!(entries(&document(at, &["fleet", "deep/1", "--calibrate-only"]), "robots").len(), 1);
}

/// One long log, which is calibrated part by part: rows at 50 Hz for three hours, and a pose every two
/// seconds. The robot drives in bends to both sides with a separation 1 % above the stated one.
fn long_log(at: &Path) {
    const PER_M: f64 = 4096.0 / (std::f64::consts::PI * 0.15);
    fs::create_dir(at).expect("made");
    let robot = "left_wheel_diameter_m = 0.15\nright_wheel_diameter_m = 0.15\nwheel_separation_m = 0.3\nticks_per_rev = 4096.0\n";
    fs::write(at.join("dataset.toml"), format!("format = 1\n[robot]\n{robot}[[run]]\nid = \"a\"\n")).expect("written");
    let (mut odometry, mut truth) =
        ("run,t_s,left_ticks,right_ticks\n".to_owned(), "run,t_s,x_m,y_m,theta_rad\n".to_owned());
    let (mut x_m, mut y_m, mut theta_rad, mut arcs_m) = (0.0_f64, 0.0_f64, 0.0_f64, [0.0, 0.0]);
    for row in 0..530_000_u32 {
        let t_s = 0.02 * f64::from(row);
        let (distance_m, turn_rad) = (0.005, 0.02 * 0.4 * (0.3 * t_s).sin());
        if row > 0 {
            let middle_rad = theta_rad + 0.5 * turn_rad;
            (x_m, y_m) = (x_m + distance_m * middle_rad.cos(), y_m + distance_m * middle_rad.sin());
            theta_rad += turn_rad;
            arcs_m = [arcs_m[0] + distance_m - 0.1515 * turn_rad, arcs_m[1] + distance_m + 0.1515 * turn_rad];
        }
        let [left, right] = arcs_m.map(|arc_m| (PER_M * arc_m).round());
        writeln!(odometry, "a,{t_s:.2},{left},{right}").expect("a text");
        if row % 100 == 0 {
            writeln!(truth, "a,{t_s:.2},{x_m:.3},{y_m:.3},{theta_rad:.3}").expect("a text");
        }
    }
    fs::write(at.join("odometry.csv"), odometry).expect("written");
    fs::write(at.join("truth.csv"), truth).expect("written");
}

/// What is too large for one fit was fitted as a whole by one command and part by part by the other.
#[test]
fn a_long_log_has_the_same_numbers_in_fleet_and_calibrate() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    long_log(&at.join("long"));
    let calibrated = document(at, &["calibrate", "long"]);
    let of = document(at, &["fleet", "long", "--calibrate-only"]);
    assert!(!calibrated["methods"][0]["one_step"].is_null(), "it is no large log");
    for key in ["left_wheel_diameter_m", "right_wheel_diameter_m", "wheel_separation_m"] {
        let (calibrated, of) = (&calibrated["methods"][0]["parameters"][key], &of["robots"][0]["parameters"][key]);
        assert_eq!((&of["value"], &of["sigma"]), (&calibrated["value"], &calibrated["sigma"]), "{key}");
        assert!(of["sigma"].is_f64());
    }
}

/// What is kept is a file that anybody may have changed: with a wheel of 1e308 m the page had "inf ± 0.045".
#[test]
fn a_kept_session_with_numbers_of_no_robot_is_found_anew() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    session(at, "set", "1", "11", &[]);
    let arguments = ["fleet", "set", "--calibrate-only", "--out", "kept", "--html", "page.html", "--json"];
    succeed(at, &arguments);
    let kept = fs::read_dir(at.join("kept/sessions")).expect("kept").next().expect("one").expect("readable").path();
    let text = fs::read_to_string(&kept).expect("read");
    let page = fs::read_to_string(at.join("page.html")).expect("written");
    let changed = |of: &Value, at: &str, value: Value| {
        let mut changed = of.clone();
        *changed.pointer_mut(at).unwrap_or_else(|| panic!("no {at} in {of}")) = value;
        changed.to_string()
    };
    let of: Value = serde_json::from_str(&text).expect("JSON");
    for (place, value) in [
        ("/geometry/value_m/0", 1e308),
        ("/geometry/value_m/0", -0.1),
        ("/geometry/covariance_m2/0/0", 1e308),
        ("/nominal/wheel_separation_m", 1e308),
        ("/nominal/wheel_separation_m", 0.0),
        ("/drift_percent/nominal", f64::MAX),
        ("/excess_drift/Ok/percent", -1.0),
        ("/excess_drift/Ok/sigma_percent", 1e308),
        ("/excess_drift/Ok/p_value", 2.0),
    ] {
        fs::write(&kept, changed(&of, place, value.into())).expect("written");
        let again = succeed(at, &arguments);
        assert!(again.stderr.contains("1 datasets computed, 0 reused"), "{place} = {value}: {}", again.stderr);
        assert_eq!(fs::read_to_string(&kept).expect("read"), text);
        assert_eq!(fs::read_to_string(at.join("page.html")).expect("written"), page);
    }
    assert!(succeed(at, &arguments).stderr.contains("0 datasets computed, 1 reused"));
}
