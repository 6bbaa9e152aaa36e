//! What scripts and people get of a failure: one JSON document with `error`, silence where it was asked for,
//! what to type instead, and colours where somebody watches. A scenario of eight lines, as docs/scenario.md
//! has it.

use std::fs;

use serde_json::Value;

use crate::import_ros2::bag;
use crate::support::{run_in, succeed};

/// The one document on standard output.
fn answer(at: &std::path::Path, arguments: &[&str], code: i32) -> Value {
    let ended = run_in(at, &[arguments, &["--json"]].concat());
    assert_eq!(ended.code, Some(code), "{arguments:?}: {}", ended.stderr);
    serde_json::from_str(&ended.stdout).unwrap_or_else(|why| panic!("{arguments:?}: {why}: {:?}", ended.stdout))
}

#[test]
fn every_failure_is_one_document_with_its_message() {
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    fs::write(at.join("empty.csv"), "").expect("written");
    let zstd = bag("zstd.mcap");
    for (arguments, code, part) in [
        (&["check", "none"][..], 1, "none"),
        (&["calibrate", "none"], 1, "none"),
        (&["evaluate", "none"], 1, "none"),
        (&["diagnose", "none"], 1, "none"),
        (&["export", "mm", "none.toml"], 1, "none.toml"),
        (&["export", "mm", "none.toml", "--run", "a"], 2, "--run is not for the format mm"),
        (&["sweep", "none.toml"], 1, "none.toml"),
        (&["simulate", "none.toml", "--out", "x"], 1, "none.toml"),
        (&["import", "csv", "empty.csv", "--out", "x"], 1, "empty.csv"),
        (&["import", "ros2", &zstd, "--out", "x"], 1, "give --wheel DIAMETER_M --base SEPARATION_M"),
        (&["import", "log.csv"], 2, "did you mean: yair import csv log.csv"),
        (&["check"], 2, "required arguments were not provided"),
        (&["check", "--speed", "3"], 2, "unexpected argument '--speed' found"),
        (&["chekc", "a"], 2, "unrecognized subcommand 'chekc'"),
        (&[], 2, "no subcommand is given"),
    ] {
        let found = answer(at, arguments, code);
        let message = found["error"].as_str().unwrap_or_else(|| panic!("{arguments:?}: {found}"));
        assert!(message.contains(part) && !message.contains("Usage"), "{arguments:?}: {message}");
    }
    // What succeeds has none, and a check that finds an error says so by `ok`.
    assert!(answer(at, &["import", "ros2", &zstd, "--list"], 0).get("error").is_none());
}

#[test]
fn quiet_leaves_results_and_errors_alone() {
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    fs::write(at.join("s.toml"), include_str!("../../scenarios/motion-capture.toml")).expect("written");
    fs::write(at.join("c.toml"), crate::export::CALIBRATION).expect("written");
    fs::copy(bag("controllers.yaml"), at.join("own.yaml")).expect("copied");
    let described = bag("described.mcap");
    for arguments in [
        &["import", "ros2", &described, "--out", "new"][..],
        &["import", "csv", "new/odometry.csv", "new/truth.csv", "--out", "again", "--robot", "own.yaml"],
        &["simulate", "s.toml", "--out", "set"],
        &["correct", "new", "--calibration", "c.toml", "--out", "poses"],
        &["export", "mm", "c.toml", "--out", "table.txt"],
        &["export", "ros2-yaml", "c.toml", "--into", "own.yaml"],
    ] {
        let ended = succeed(at, &[arguments, &["--quiet"]].concat());
        assert_eq!((&ended.stdout[..], &ended.stderr[..]), ("", ""), "{arguments:?}");
    }
    // A result is what was asked for.
    assert!(succeed(at, &["export", "mm", "c.toml", "--quiet"]).stdout.contains("wheel separation"));
    assert!(succeed(at, &["check", "set", "--quiet"]).stdout.contains("determined by these runs"));
    assert!(run_in(at, &["check", "none", "--quiet"]).stderr.starts_with("error: "));
}

#[test]
fn a_file_in_the_place_of_a_format_is_answered_with_the_command() {
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    fs::create_dir(at.join("recorded")).expect("made");
    for (file, expected) in [
        (
            "log.csv",
            "log.csv is no format but a file, and its format comes first; did you mean: yair import csv log.csv --out log --wheel METRES",
        ),
        ("drive.mcap", "did you mean: yair import ros2 drive.mcap --out drive --wheel METRES"),
        ("drive.bag", "did you mean: yair import ros2 drive.bag --out drive"),
        ("truth.tum", "did you mean: yair import tum truth.tum --out truth --odometry FILE"),
        ("recorded", "did you mean: yair import ros2 recorded --out recorded"),
    ] {
        let ended = run_in(at, &["import", file]);
        assert_eq!(ended.code, Some(2));
        assert!(ended.stderr.contains(expected), "{file}: {}", ended.stderr);
    }
    assert!(run_in(at, &["import", "cvs"]).stderr.contains("unrecognized subcommand 'cvs'"));
}

#[test]
fn severities_have_colours_where_somebody_watches_and_nowhere_else() {
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    let zstd = bag("zstd.mcap");
    // Wheels of half the size, which a check says.
    succeed(at, &["import", "ros2", &zstd, "--out", "half", "--wheel", "0.075", "--base", "0.3"]);
    let printed = |variables: &[(&str, &str)]| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_yair"));
        command.current_dir(at).args(["check", "half"]).env_remove("NO_COLOR").env_remove("CLICOLOR_FORCE");
        command.envs(variables.iter().copied());
        String::from_utf8(command.output().expect("it runs").stdout).expect("UTF-8")
    };
    let plain = printed(&[]);
    assert!(plain.contains("severity") && !plain.contains('\u{1b}'), "{plain}");
    let coloured = printed(&[("CLICOLOR_FORCE", "1")]);
    let is_red_or_yellow = coloured.contains("\u{1b}[31m") || coloured.contains("\u{1b}[33m");
    assert!(is_red_or_yellow, "{coloured:?}");
    let stripped = ["\u{1b}[1m", "\u{1b}[31m", "\u{1b}[33m", "\u{1b}[36m", "\u{1b}[0m"];
    assert_eq!(stripped.iter().fold(coloured, |text, code| text.replace(code, "")), plain);
    assert_eq!(printed(&[("CLICOLOR_FORCE", "1"), ("NO_COLOR", "1")]), plain);
}

#[test]
fn the_eight_lines_of_the_document_are_a_robot_whose_effect_is_found() {
    let page = include_str!("../../docs/scenario.md");
    let (_, block) = page.split_once("```toml\n").expect("a scenario");
    let (text, _) = block.split_once("```").expect("an end");
    assert_eq!(text.lines().count(), 8);
    let temp = tempfile::tempdir().expect("a folder");
    let at = temp.path();
    fs::write(at.join("mine.toml"), text).expect("written");
    succeed(at, &["simulate", "mine.toml", "--out", "robot"]);
    let found = crate::support::document(at, &["calibrate", "robot"]);
    let separation = &found["methods"][0]["parameters"]["wheel_separation_m"];
    let of = |key: &str| separation[key].as_f64().expect("a number");
    // 0.3 m · 1.02, of which the wheels' noise leaves a tenth of a millimetre.
    let off = (of("value") - 0.306) / of("sigma");
    assert!(off.abs() < 4.0 && of("sigma") < 5e-4, "{separation}");
    // An effect that the closed form does not have says what to set.
    let slides =
        "{ kind = \"traction_loss\", static_friction = 0.05, kinetic_friction = 0.04, stribeck_speed_m_s = 0.01 }";
    fs::write(at.join("slides.toml"), text.replace("{ kind = \"wheelbase\", ratio = 1.02 }", slides)).expect("written");
    let why = crate::support::refusal(at, &["simulate", "slides.toml", "--out", "slid"]);
    assert!(why.contains("kind = \"stepping\""), "{why}");
}
