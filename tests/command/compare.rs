//! `yair compare`: simulated sessions of one robot against each other, and what cannot be compared.

use std::fs;
use std::path::Path;

use crate::support::{document, everything_in, paper, refusal, succeed, usage};
use serde_json::Value;

/// Sessions of the paper's robot: two of straights and spins, two of squares.
fn sessions(at: &Path) {
    let scenario = paper();
    let (head, protocols) = scenario.split_once("[[protocol]]").expect("the paper's protocols");
    let (squares, _) = protocols.split_once("[sweep]").expect("the paper sweeps");
    let squares = squares.rsplit_once("[[protocol]]").expect("squares come last").1;
    let others = "kind = \"straights\"\nlength_m = 2.0\nruns = 10\n[[protocol]]\nkind = \"spins\"\nturn_rad = 6.283\nruns = 10\n";
    for (name, protocols) in [("squares", squares), ("others", others)] {
        fs::write(at.join(format!("{name}.toml")), format!("{head}[[protocol]]\n{protocols}")).expect("written");
        for trial in ["0", "1"] {
            let out = format!("sessions/{name}-{trial}");
            succeed(at, &["simulate", &format!("{name}.toml"), "--out", &out, "--trial", trial]);
        }
    }
}

fn entries<'v>(value: &'v Value, key: &str) -> &'v [Value] {
    value[key].as_array().unwrap_or_else(|| panic!("{key} is no list in {value}"))
}

fn named<'v>(list: &'v [Value], key: &str, name: &str) -> &'v Value {
    list.iter().find(|entry| entry[key] == name).unwrap_or_else(|| panic!("no {name}"))
}

#[test]
fn a_pair_is_what_calibrate_and_evaluate_find_and_a_kind_is_the_mean_of_its_pairs() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    sessions(at);
    let found = document(at, &["compare", "sessions"]);
    let kinds: Vec<&str> = entries(&found, "sessions").iter().filter_map(|entry| entry["path_kind"].as_str()).collect();
    assert_eq!(kinds, ["straights + spins", "straights + spins", "squares", "squares"]);
    let methods = entries(&found, "methods");
    let names: Vec<&str> = methods.iter().filter_map(|entry| entry["method"].as_str()).collect();
    let expected: Vec<&str> =
        ["nominal"].into_iter().chain(calib::METHODS.iter().map(|method| method.name())).collect();
    assert_eq!(names, expected);

    let keys = ["mean_final_position_m", "mean_final_heading_rad"];
    for (method, from, to) in
        [("direct", "others-0", "squares-1"), ("direct", "others-0", "others-1"), ("umbmark", "squares-1", "others-0")]
    {
        let (from_set, to_set) = (format!("sessions/{from}"), format!("sessions/{to}"));
        succeed(at, &["calibrate", &from_set, "--method", method, "--out", "one.toml"]);
        let drift = &document(at, &["evaluate", &to_set, "--calibration", "one.toml"])["calibrations"][1];
        let pairs = entries(named(methods, "method", method), "pairs");
        let pair = pairs.iter().find(|pair| pair["trained_on"] == from && pair["evaluated_on"] == to).expect("a pair");
        for key in keys {
            // Through the file's text and back: the shortest text that is the same number.
            assert_eq!(pair[key], drift[key], "{method} {from} {to} {key}");
        }
        assert!(pairs.iter().all(|pair| pair["trained_on"] != pair["evaluated_on"]), "a session met itself");
    }
    for method in methods {
        for kind in entries(method, "kinds") {
            let name_of = |session: &Value| {
                named(entries(&found, "sessions"), "dataset", session.as_str().unwrap_or_default())["path_kind"].clone()
            };
            let pairs: Vec<&Value> = entries(method, "pairs")
                .iter()
                .filter(|pair| {
                    let trained_on =
                        if pair["trained_on"].is_null() { Value::Null } else { name_of(&pair["trained_on"]) };
                    trained_on == kind["trained_on"] && name_of(&pair["evaluated_on"]) == kind["evaluated_on"]
                })
                .collect();
            assert_eq!(kind["pairs"], pairs.len(), "{kind}");
            for key in keys.iter().filter(|_| !pairs.is_empty()) {
                let sum: f64 = pairs.iter().map(|pair| pair[key].as_f64().expect("a number")).sum();
                let mean = kind[key].as_f64().expect("a number") * f64::from(u32::try_from(pairs.len()).expect("few"));
                assert!((mean / sum - 1.0).abs() < 1e-14, "{kind}");
            }
        }
    }

    // Nominal wheels are 3.28 % small; straights of 2 m show it, and a spin ends where it began: 33 mm on
    // average.
    let straights = |method: &str, trained_on: Option<&str>| {
        let kinds = entries(named(methods, "method", method), "kinds");
        let of =
            |kind: &&Value| kind["trained_on"].as_str() == trained_on && kind["evaluated_on"] == "straights + spins";
        kinds.iter().find(of).expect("a mean")["mean_final_position_m"].as_f64().expect("pairs")
    };
    assert!((straights("nominal", None) - 0.033).abs() < 0.002);
    // Marks read to 0.5 mm and rounded to 1 mm, wheels that scatter by 0.7 mm over 2 m.
    assert!(straights("direct", Some("straights + spins")) < 0.003);
    // UMBmark does not see the scale.
    assert!((straights("umbmark", Some("squares")) - 0.033).abs() < 0.002);
    let refusal = &entries(named(methods, "method", "umbmark"), "refusals")[0];
    assert_eq!((&refusal["dataset"], &refusal["path_kind"]), (&"others-0".into(), &"straights + spins".into()));
    assert!(refusal["why"].as_str().is_some_and(|why| why.contains("squares in both directions")), "{refusal}");
}

#[test]
fn the_table_fits_and_only_the_asked_for_methods_are_in_it() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    sessions(at);
    let shown = succeed(at, &["compare", "sessions/others-0", "sessions/squares-0", "--method", "umbmark", "--quiet"]);
    assert!(shown.stdout.lines().all(|line| line.chars().count() <= 100), "{}", shown.stdout);
    assert!(shown.stdout.starts_with("2 sessions: 1 of straights + spins, 1 of squares\n"), "{}", shown.stdout);
    for word in ["nominal", "umbmark", "1 of 1 straights + spins", "squares in both directions"] {
        assert!(shown.stdout.contains(word), "{word} is not in\n{}", shown.stdout);
    }
    assert!(!shown.stdout.contains("direct ") && shown.stderr.is_empty(), "{}", shown.stderr);
    // All of them fit too.
    let all = succeed(at, &["compare", "sessions"]);
    assert!(all.stdout.lines().all(|line| line.chars().count() <= 100), "{}", all.stdout);
}

/// A session of a single mark can be neither calibrated on nor evaluated on, and says why; the others are
/// compared all the same.
#[test]
fn a_session_without_poses_gives_no_pair_and_says_why() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    sessions(at);
    let points = at.join("sessions/others-1/points.csv");
    let text = fs::read_to_string(&points).expect("read");
    // One mark is a position and no pose.
    let left: Vec<&str> = text.lines().filter(|line| !line.contains("right")).collect();
    fs::write(&points, left.join("\n") + "\n").expect("written");
    let found = document(at, &["compare", "sessions", "--method", "direct"]);
    let nominal = entries(named(entries(&found, "methods"), "method", "nominal"), "pairs");
    let without = named(nominal, "evaluated_on", "others-1");
    assert!(without["mean_final_position_m"].is_null() && without["why_null"].is_string(), "{without}");
    let direct = named(entries(&found, "methods"), "method", "direct");
    let refused: Vec<&Value> = entries(direct, "refusals").iter().map(|refusal| &refusal["dataset"]).collect();
    assert!(refused.contains(&&Value::from("others-1")), "{refused:?}");
    // others-0 on both sessions of squares, and nothing else.
    let evaluated = entries(direct, "kinds").iter().map(|kind| kind["pairs"].as_u64().expect("a count")).sum::<u64>();
    assert_eq!(evaluated, 2, "{direct}");
    let shown = succeed(at, &["compare", "sessions", "--method", "direct"]).stdout;
    assert!(shown.contains("nothing is evaluated on others-1: no absolute truth"), "{shown}");
}

#[test]
fn what_cannot_be_compared_is_refused_with_what_to_do() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    sessions(at);
    let before = everything_in(at);
    let one = refusal(at, &["compare", "sessions/others-0"]);
    assert!(one.contains("two sessions or more") && one.contains("there is 1"), "{one}");
    let twice = refusal(at, &["compare", "sessions/others-0", "sessions/others-0"]);
    assert!(twice.contains("given twice"), "{twice}");
    let inside = refusal(at, &["compare", "sessions", "sessions/others-0"]);
    assert!(inside.contains("given twice"), "{inside}");
    let none = refusal(at, &["compare", "nowhere", "sessions"]);
    assert!(none.contains("nowhere"), "{none}");
    fs::create_dir(at.join("empty")).expect("made");
    let empty = refusal(at, &["compare", "empty", "sessions"]);
    assert!(empty.contains("empty") && empty.contains("dataset.toml"), "{empty}");
    fs::remove_dir(at.join("empty")).expect("removed");
    assert!(usage(at, &["compare"]).contains("DATASET"));
    assert!(usage(at, &["compare", "sessions", "--method", "guess"]).contains("umbmark"));
    assert_eq!(everything_in(at), before);
}

#[test]
fn a_calibration_of_a_file_stands_beside_the_methods_on_every_session() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    sessions(at);
    let calibrations = ["--calibration", "others.toml", "--calibration", "one.toml"];
    succeed(at, &["calibrate", "sessions/others-0", "--method", "direct", "--out", "one.toml"]);
    let arguments = [&["compare", "sessions", "--method", "direct"][..], &calibrations].concat();
    let found = document(at, &arguments);
    let methods = entries(&found, "methods");
    let names: Vec<&str> = methods.iter().filter_map(|entry| entry["method"].as_str()).collect();
    assert_eq!(names, ["nominal", "paper", "direct", "direct"]);
    for session in ["others-0", "squares-1"] {
        let set = format!("sessions/{session}");
        let drifts = document(at, &[&["evaluate", &set][..], &calibrations].concat());
        for method in [1, 2] {
            let pairs = entries(&methods[method], "pairs");
            let pair = pairs.iter().find(|pair| pair["evaluated_on"] == session).expect("a pair");
            assert!(pair["trained_on"].is_null());
            assert_eq!(pair["mean_final_position_m"], drifts["calibrations"][method]["mean_final_position_m"]);
        }
    }
    let said = succeed(at, &arguments).stdout;
    assert_eq!(said.lines().filter(|line| line.trim_start().starts_with('–')).count(), 3, "{said}");
}
