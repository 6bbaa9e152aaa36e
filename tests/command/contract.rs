//! What scripts rely on: documents, exit codes, files, and nothing else anywhere.

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};

use crate::support::{document, everything_in, paper, refusal, run_in, succeed, usage, workplace};
use serde_json::Value;

#[track_caller]
fn has_keys(value: &Value, keys: &[&str]) {
    let object = value.as_object().unwrap_or_else(|| panic!("not an object: {value}"));
    for key in keys {
        assert!(object.contains_key(*key), "no {key} in {value}");
    }
}

fn list<'a>(value: &'a Value, key: &str) -> &'a Vec<Value> {
    value[key].as_array().unwrap_or_else(|| panic!("{key} is no list in {value}"))
}

const DRIFT_KEYS: &[&str] = &["max_position_m", "max_heading_rad"];
const SUMMARY_KEYS: &[&str] = &[
    "name",
    "runs",
    "max_final_position_m",
    "max_final_heading_rad",
    "mean_final_position_m",
    "mean_final_heading_rad",
    "drift_percent",
];

#[test]
fn simulate_writes_a_dataset_and_the_truth_beside_it() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    fs::write(at.join("paper.toml"), paper()).expect("written");
    let found = document(at, &["simulate", "paper.toml", "--out", "new/parents/set/"]);
    has_keys(&found, &["scenario", "seed", "trial", "dataset", "truth", "runs"]);
    let names: Vec<_> = everything_in(&at.join("new"))
        .iter()
        .map(|path| path.strip_prefix(at).expect("below").display().to_string())
        .collect();
    let expected = [
        "new/parents",
        "new/parents/set",
        "new/parents/set/dataset.toml",
        "new/parents/set/odometry.csv",
        "new/parents/set/points.csv",
        "new/parents/set.truth.json",
    ];
    assert_eq!(names, expected);
    let read = dataset::read(&at.join("new/parents/set")).expect("reads back");
    assert!(read.warnings.is_empty());
    assert_eq!(found["runs"], read.dataset.runs.len());
    let truth: Value =
        serde_json::from_str(&fs::read_to_string(at.join("new/parents/set.truth.json")).expect("the truth"))
            .expect("JSON");
    has_keys(&truth, &["left_wheel_diameter_m", "right_wheel_diameter_m", "wheel_separation_m", "effects"]);
}

#[test]
fn the_truth_stays_outside_where_the_folder_is_the_current_one() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    fs::write(temp.path().join("paper.toml"), paper()).expect("written");
    let inside = temp.path().join("set");
    fs::create_dir(&inside).expect("made");
    succeed(&inside, &["simulate", "../paper.toml", "--out", "."]);
    assert!(temp.path().join("set.truth.json").is_file());
    assert_eq!(everything_in(&inside).len(), 3, "{:?}", everything_in(&inside));
}

/// Sizes that no other quantity of the scenario has by chance.
const TELLING: [(&str, &str); 3] =
    [("1.0328", "1.0371593"), ("0.9988387845945422", "0.99731913"), ("sigma_m = 0.001 ", "sigma_m = 0.00123457 ")];

#[test]
fn a_dataset_says_nothing_of_what_was_hidden() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    let mut scenario = paper();
    for (from, to) in TELLING {
        assert_eq!(scenario.matches(from).count(), 1, "{from}");
        scenario = scenario.replace(from, to);
    }
    fs::write(at.join("hidden.toml"), &scenario).expect("written");
    succeed(at, &["simulate", "hidden.toml", "--out", "set"]);
    let truth = fs::read_to_string(at.join("set.truth.json")).expect("the truth");
    let parsed: Value = serde_json::from_str(&truth).expect("JSON");
    let mut secrets: Vec<String> = effects::CATALOGUE.iter().map(|id| (*id).to_owned()).collect();
    secrets.extend(TELLING.map(|(_, to)| to.trim_start_matches("sigma_m = ").trim().to_owned()));
    for key in ["left_wheel_diameter_m", "right_wheel_diameter_m"] {
        // Eight digits: what a rounded note would show.
        secrets.push(parsed[key].to_string()[..10].to_owned());
    }
    secrets.extend(["effect", "seed", "scenario", "hidden"].map(str::to_owned));
    for file in everything_in(&at.join("set")) {
        let content = fs::read_to_string(&file).expect("text").to_lowercase();
        for secret in &secrets {
            assert!(!content.contains(secret), "{secret} in {}", file.display());
        }
    }
    // The search finds them where they are.
    assert!(truth.contains("wheel_scale") && truth.contains("1.0371593") && truth.contains("0.00123457"));
}

#[test]
fn a_seed_gives_the_same_bytes_and_another_seed_others() {
    let at = &workplace();
    let at = at.path();
    let contents = |set: &str, seed: &str| -> Vec<Vec<u8>> {
        succeed(at, &["simulate", "paper.toml", "--out", set, "--seed", seed]);
        let mut files: Vec<_> = everything_in(&at.join(set)).iter().map(|file| fs::read(file).expect("read")).collect();
        files.push(fs::read(at.join(format!("{set}.truth.json"))).expect("read"));
        files
    };
    let (one, again, other) = (contents("a", "7"), contents("b", "7"), contents("c", "8"));
    assert_eq!(one, again);
    for (name, (one, other)) in ["odometry", "points", "truth"].iter().zip(one[1..].iter().zip(&other[1..])) {
        assert_ne!(one, other, "{name}");
    }
}

#[test]
fn nothing_is_overwritten_unasked() {
    let at = &workplace();
    let at = at.path();
    let before = fs::read(at.join("set/odometry.csv")).expect("read");
    let message = refusal(at, &["simulate", "paper.toml", "--out", "set", "--seed", "1"]);
    assert!(message.contains("already exists"), "{message}");
    assert_eq!(fs::read(at.join("set/odometry.csv")).expect("read"), before);
    // A truth file without its dataset is still someone's file.
    fs::write(at.join("other.truth.json"), "mine").expect("written");
    let message = refusal(at, &["simulate", "paper.toml", "--out", "other"]);
    assert!(message.starts_with("other.truth.json: already exists"), "{message}");
    assert_eq!(fs::read_to_string(at.join("other.truth.json")).expect("read"), "mine");
    assert!(!at.join("other").exists());
    succeed(at, &["simulate", "paper.toml", "--out", "set", "--seed", "1", "--force"]);
    assert_ne!(fs::read(at.join("set/odometry.csv")).expect("read"), before);
}

#[cfg(unix)]
#[test]
fn files_have_the_permissions_of_any_other() {
    use std::os::unix::fs::PermissionsExt;
    let at = &workplace();
    let at = at.path();
    succeed(at, &["calibrate", "set", "--out", "found.toml"]);
    let mode = |file: &str| at.join(file).metadata().expect("there").permissions().mode();
    succeed(at, &["sweep", "paper.toml", "--trials", "2", "--out", "swept"]);
    for file in ["set.truth.json", "found.toml", "set/odometry.csv", "swept/sweep.json", "swept/sweep.csv"] {
        assert_eq!(mode(file), mode("paper.toml"), "{file}");
    }
}

#[test]
fn calibrate_and_evaluate_keep_their_contract() {
    let at = &workplace();
    let at = at.path();
    let found = document(at, &["calibrate", "set", "--method", "all", "--out", "found.toml"]);
    has_keys(&found, &["dataset", "methods"]);
    assert_eq!(found["dataset"], "set");
    let methods: Vec<_> = list(&found, "methods").iter().map(|method| method["method"].clone()).collect();
    assert_eq!(methods, calib::METHODS.iter().map(|method| method.name()).collect::<Vec<_>>());
    for method in list(&found, "methods") {
        has_keys(method, &["method", "not_observable", "runs_used", "runs_rejected", "converged"]);
        assert!(method.get("error").is_some() != method.get("parameters").is_some(), "{method}");
        list(method, "not_observable").iter().for_each(|blind| has_keys(blind, &["parameter", "why"]));
        list(method, "runs_rejected").iter().for_each(|run| has_keys(run, &["run", "why"]));
        if let Some(parameters) = method.get("parameters") {
            has_keys(parameters, &["left_wheel_diameter_m", "right_wheel_diameter_m", "wheel_separation_m"]);
            let values = parameters.as_object().expect("an object").values();
            values.for_each(|value| has_keys(value, &["value", "sigma"]));
        }
    }

    // A method that did not apply left nothing in the file.
    let applied = list(&found, "methods").iter().filter(|method| method.get("parameters").is_some()).count();

    succeed(at, &["calibrate", "set", "--method", "direct", "--out", "direct.toml"]);
    let found = document(at, &["evaluate", "set", "--calibration", "found.toml", "--calibration", "direct.toml"]);
    has_keys(&found, &["dataset", "calibrations"]);
    let calibrations = list(&found, "calibrations");
    assert_eq!((&calibrations[0]["name"], &calibrations[applied + 1]["name"]), (&"nominal".into(), &"direct".into()));
    for calibration in calibrations {
        has_keys(calibration, SUMMARY_KEYS);
        has_keys(calibration, DRIFT_KEYS);
        for run in list(calibration, "runs") {
            has_keys(run, &["run", "length_m", "final_position_m", "final_heading_rad"]);
            has_keys(run, DRIFT_KEYS);
            assert!(run.get("dataset").is_none());
        }
    }
    let drift = |entry: &Value| entry["drift_percent"].as_f64().expect("a drift");
    // The robot of the scenario is 3 % off; a calibration that was not used would drift as the nominal values
    // do.
    assert!(drift(calibrations.last().expect("some")) < drift(&calibrations[0]) / 2.0);
}

#[test]
fn a_method_that_cannot_be_applied_says_so_in_its_place() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    let squares_only = paper().replace("runs = 82", "runs = 0").replace("runs = 30", "runs = 0");
    fs::write(at.join("squares.toml"), squares_only).expect("written");
    succeed(at, &["simulate", "squares.toml", "--out", "set"]);
    let found = document(at, &["calibrate", "set", "--method", "all"]);
    let direct = list(&found, "methods").iter().find(|method| method["method"] == "direct").expect("listed");
    assert!(direct["error"].as_str().is_some_and(|why| why.contains("straight")) && direct.get("parameters").is_none());
    // Asked for alone it is a failure; the document says why all the same, and no file is left.
    let ended = run_in(at, &["calibrate", "set", "--method", "direct", "--json", "--out", "found.toml"]);
    assert_eq!(ended.code, Some(1));
    assert!(serde_json::from_str::<Value>(&ended.stdout).is_ok_and(|found| found["methods"][0]["error"].is_string()));
    assert_eq!(ended.stderr.lines().count(), 1);
    assert!(!at.join("found.toml").exists());
}

#[test]
fn several_datasets_are_named_in_every_document() {
    let at = &workplace();
    let at = at.path();
    succeed(at, &["simulate", "paper.toml", "--out", "second", "--trial", "1"]);
    let both = serde_json::json!(["set", "second"]);
    assert_eq!(document(at, &["calibrate", "set", "second"])["dataset"], both);
    let found = document(at, &["evaluate", "set", "second"]);
    assert_eq!(found["dataset"], both);
    let runs = list(&found["calibrations"][0], "runs");
    assert_eq!(runs.len(), 244);
    assert_eq!((&runs[0]["dataset"], &runs[243]["dataset"]), (&both[0], &both[1]));
    // The same session twice would halve every variance.
    let message = refusal(at, &["calibrate", "set", "./second/../set"]);
    assert!(message.contains("given twice"), "{message}");
    // Runs that the drift leaves out are counted where a person reads it.
    let tape = "run,t0_s,t1_s,distance_m,sigma_m\na,0,1,0.1,0.001\n";
    let toml = fs::read_to_string(at.join("set/dataset.toml")).expect("read");
    let robot = toml.split("[[run]]").next().expect("a head").split("[truth]").next().expect("a head");
    fs::create_dir(at.join("relative")).expect("made");
    for (file, content) in [
        ("dataset.toml", format!("{robot}[[run]]\nid = \"a\"\n")),
        ("odometry.csv", "run,t_s,left_ticks,right_ticks\na,0,0,0\na,1,9,9\n".to_owned()),
        ("distance.csv", tape.to_owned()),
    ] {
        fs::write(at.join("relative").join(file), content).expect("written");
    }
    let ended = succeed(at, &["evaluate", "set", "relative"]);
    assert!(ended.stdout.contains("nominal: 1 of 123 runs are left out; a: no absolute truth"), "{}", ended.stdout);
}

#[test]
fn exit_codes_are_those_of_the_contract() {
    let at = &workplace();
    let at = at.path();
    for (drift, code) in [("0.001", 3), ("99", 0)] {
        let ended = run_in(at, &["evaluate", "set", "--json", "--max-drift", drift]);
        assert_eq!(ended.code, Some(code), "{}", ended.stderr);
        assert!(serde_json::from_str::<Value>(&ended.stdout).is_ok());
        assert_eq!(ended.stderr.lines().count(), usize::from(code != 0), "{}", ended.stderr);
    }
    refusal(at, &["simulate", "absent.toml", "--out", "x"]);
    refusal(at, &["sweep", "absent.toml"]);
    for wrong in [
        &["frobnicate"][..],
        &[],
        &["calibrate"],
        &["simulate", "paper.toml"],
        &["evaluate", "set", "--max-drift", "-1"],
        &["evaluate", "set", "--max-drift", "nan"],
        &["sweep", "paper.toml", "--jobs", "1000000"],
        &["import", "matlab", "x", "--out", "y"],
    ] {
        usage(at, wrong);
    }
    let message = usage(at, &["calibrate", "set", "--method", "best"]);
    assert!(calib::METHODS.iter().all(|method| message.contains(method.name())), "{message}");
}

#[test]
fn quiet_is_quiet_and_results_go_to_standard_output() {
    let at = &workplace();
    let at = at.path();
    let simulated = succeed(at, &["simulate", "paper.toml", "--out", "new", "--quiet"]);
    assert_eq!((&simulated.stdout[..], &simulated.stderr[..]), ("", ""));
    let commands: [&[&str]; 3] = [
        &["calibrate", "set", "--out", "found.toml"],
        &["evaluate", "set"],
        &["sweep", "paper.toml", "--trials", "2", "--out", "swept"],
    ];
    for command in commands {
        let ended = succeed(at, &[command, &["--quiet"]].concat());
        assert_eq!(ended.stderr, "", "{command:?}");
        assert!(!ended.stdout.is_empty() && !ended.stdout.contains(['\r', '\u{1b}']), "{command:?}: {}", ended.stdout);
        assert!(ended.stdout.lines().all(|line| line.chars().count() <= 200), "{command:?}: {}", ended.stdout);
    }
}

#[test]
fn a_sweep_is_the_same_on_any_number_of_threads() {
    let at = &workplace();
    let at = at.path();
    // More trials than one task takes, and no multiple of it.
    let swept = |jobs: &str| succeed(at, &["sweep", "paper.toml", "--trials", "150", "--json", "--jobs", jobs]).stdout;
    let one = swept("1");
    assert!(one == swept("2") && one == swept("3"));
    let found: Value = serde_json::from_str(&one).expect("one document");
    has_keys(&found, &["scenario", "seed", "trials", "points"]);
    assert_eq!((list(&found, "points").len(), &found["trials"]), (12, &150.into()));
    for point in list(&found, "points") {
        has_keys(point, &["levels", "estimators"]);
        assert_eq!(list(point, "estimators").len(), 2 * 3);
        for estimator in list(point, "estimators") {
            has_keys(estimator, &["method", "parameter", "bias", "bias_mcse", "variance", "variance_mcse", "rmse"]);
            has_keys(estimator, &["coverage", "failures", "cramer_rao_ratio"]);
            if estimator["cramer_rao_ratio"].is_null() {
                has_keys(estimator, &["cramer_rao_why_null"]);
            }
        }
    }
    assert_ne!(one, succeed(at, &["sweep", "paper.toml", "--trials", "150", "--json", "--seed", "1"]).stdout);

    succeed(at, &["sweep", "paper.toml", "--trials", "150", "--out", "swept"]);
    assert_eq!(fs::read_to_string(at.join("swept/sweep.json")).expect("written"), one);
    let csv = fs::read_to_string(at.join("swept/sweep.csv")).expect("written");
    let rows: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len() - 1, 12 * 2 * 3);
    assert!(rows.iter().all(|row| row.len() == rows[0].len()));
    // The same numbers in both files.
    let column = rows[0].iter().position(|name| *name == "rmse").expect("a column");
    let estimators = list(&found, "points").iter().flat_map(|point| list(point, "estimators"));
    for (row, estimator) in rows[1..].iter().zip(estimators) {
        let (csv, json) =
            (row[column].parse::<f64>().expect("a number"), estimator["rmse"].as_f64().expect("a number"));
        // This JSON parser may miss the last bit.
        assert!((csv / json - 1.0).abs() <= f64::EPSILON, "{row:?} {json}");
    }
}

#[test]
fn a_reader_that_goes_away_changes_neither_files_nor_exit_codes() {
    let at = &workplace();
    let cases: [(&[&str], i32); 3] = [
        (&["sweep", "paper.toml", "--trials", "2", "--out", "swept"], 0),
        (&["evaluate", "set", "--max-drift", "0.001"], 3),
        (&["calibrate", "set", "--method", "all", "--json"], 0),
    ];
    for (arguments, code) in cases {
        let mut child = Command::new(env!("CARGO_BIN_EXE_yair"))
            .current_dir(at.path())
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("yair starts");
        // Gone before the first line.
        drop(child.stdout.take());
        let stderr: Vec<_> =
            BufReader::new(child.stderr.take().expect("piped")).lines().map(|line| line.expect("text")).collect();
        assert_eq!(child.wait().expect("ends").code(), Some(code), "{arguments:?}: {stderr:?}");
        assert!(stderr.iter().all(|line| !line.contains("panicked")), "{stderr:?}");
    }
    assert!(Path::new(&at.path().join("swept/sweep.csv")).is_file());
}

#[test]
fn reproduce_writes_the_page_and_its_pictures() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    let found = document(at, &["reproduce", "--trials", "20", "--seed", "5", "--out", "paper"]);
    has_keys(&found, &["seed", "trials", "table_1", "table_2", "audit", "causes", "figure_4", "figure_6", "figure_7"]);
    assert_eq!((&found["seed"], &found["trials"]), (&Value::from(5), &Value::from(20)));
    let names: Vec<_> =
        everything_in(&at.join("paper")).iter().map(|path| path.file_name().expect("named").to_owned()).collect();
    for name in ["report.html", "paper.md", "paper-figure-4.svg", "paper-figure-6.svg", "paper-figure-7.svg"] {
        assert!(names.contains(&name.into()), "{name} in {names:?}");
    }
    assert_eq!(names.len(), if cfg!(feature = "png") { 8 } else { 5 });
    assert!(refusal(at, &["reproduce", "--trials", "1"]).contains("at least 2"));
}

#[test]
fn the_command_alone_says_what_to_do_first_and_help_groups_what_there_is() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    let alone = run_in(at, &[]);
    assert_eq!((alone.code, &alone.stdout[..]), (Some(2), ""));
    assert!(alone.stderr.contains("yair import csv") && alone.stderr.contains("--help"), "{}", alone.stderr);
    let help = succeed(at, &["--help"]).stdout;
    for title in ["Your robot:", "Simulate and bench:", "The paper:", "Options:"] {
        assert!(help.contains(&format!("\n\n{title}\n")), "{title}: {help}");
    }
    assert!(help.lines().all(|line| line.chars().count() <= 100), "{help}");
}

#[test]
fn shells_and_man_know_the_command() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        assert!(succeed(at, &["completions", shell]).stdout.contains("diagnose"), "{shell}");
    }
    assert!(succeed(at, &["man"]).stdout.starts_with(".ie"));
    succeed(at, &["man", "--out", "man"]);
    let page = fs::read_to_string(at.join("man/yair-import-csv.1")).expect("a page of an inner subcommand");
    assert!(page.contains("delimiter"), "{page}");
}
