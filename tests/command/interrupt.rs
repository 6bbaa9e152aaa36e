//! Ctrl-C and SIGTERM while results are written: what has its final name is whole or not there, nothing is
//! left beside it, and the exit code tells the signal.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::Duration;

use crate::support::{everything_in, succeed};

/// Signals with what a command gives that tidies up first, as a shell has it for them.
const SIGNALS: [(&str, i32); 2] = [("-INT", 130), ("-TERM", 143)];

/// A shell starts what runs in its background deaf to the signal, and what that starts inherits it.
fn start(here: &Path, arguments: &[&str]) -> Child {
    Command::new("env")
        .args(["--default-signal=INT", env!("CARGO_BIN_EXE_yair")])
        .current_dir(here)
        .args(arguments)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("yair starts")
}

/// Sends a signal to a command as soon as `is_time`; `None` where it ended before.
fn interrupted(here: &Path, signal: &str, arguments: &[&str], is_time: impl Fn() -> bool) -> Option<ExitStatus> {
    let mut child = start(here, arguments);
    while !is_time() {
        if let Some(ended) = child.try_wait().expect("it can be asked") {
            assert!(ended.success(), "{arguments:?}: {ended}");
            return None;
        }
        std::thread::sleep(Duration::from_micros(200));
    }
    let sent = Command::new("kill").args([signal, &child.id().to_string()]).status().expect("kill");
    assert!(sent.success());
    Some(child.wait().expect("it ends"))
}

/// A folder that is being made has this name, beside the one that it will have.
pub(crate) fn is_being_written(here: &Path) -> bool {
    let names = fs::read_dir(here).expect("a folder").filter_map(Result::ok).map(|entry| entry.file_name());
    names.into_iter().any(|name| name.to_string_lossy().starts_with(".writing-"))
}

/// A table of a robot that drives straight on.
pub(crate) fn long_table(rows: u32) -> String {
    let mut table = "t,left_ticks,right_ticks,x,y,theta\n".to_owned();
    for row in 0..rows {
        let (t_s, ticks, x_m) = (0.02 * f64::from(row), 40 * row, 0.0046 * f64::from(row));
        writeln!(table, "{t_s:.2},{ticks},{ticks},{x_m:.4},0,0").expect("a text");
    }
    table
}

#[test]
fn an_import_that_is_interrupted_leaves_no_dataset() {
    let temp = tempfile::tempdir().expect("a folder");
    let here = temp.path();
    // So many rows that writing them takes tens of milliseconds.
    fs::write(here.join("log.csv"), long_table(150_000)).expect("written");
    let arguments = ["import", "csv", "log.csv", "--out", "new", "--wheel", "0.15", "--base", "0.3"];
    let arguments = [&arguments[..], &["--ticks-per-rev", "4096", "--time-unit", "s", "--angle-unit", "rad"]].concat();
    for (signal, code) in SIGNALS {
        let ended = interrupted(here, signal, &arguments, || is_being_written(here)).expect("it is seen at its work");
        assert_eq!(ended.code(), Some(code), "{signal}: {ended}");
        assert_eq!(everything_in(here), [here.join("log.csv")], "{signal}");
    }
    succeed(here, &arguments);
    assert!(["dataset.toml", "odometry.csv", "truth.csv"].iter().all(|name| here.join("new").join(name).is_file()));
}

#[test]
fn a_diagnosis_that_is_interrupted_leaves_no_folder() {
    let temp = tempfile::tempdir().expect("a folder");
    let here = temp.path();
    let scenario = concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios/motion-capture.toml");
    succeed(here, &["simulate", scenario, "--out", "robot"]);
    let arguments = ["diagnose", "robot", "--out", "found", "--quiet"];
    for (signal, code) in SIGNALS {
        let ended = interrupted(here, signal, &arguments, || is_being_written(here)).expect("it is seen at its work");
        assert_eq!(ended.code(), Some(code), "{signal}: {ended}");
        assert!(!here.join("found").exists() && !is_being_written(here), "{:?}", everything_in(here));
    }
}

/// What is under way may take half a minute; who asked for the end is answered before.
#[test]
fn a_sweep_answers_ctrl_c_at_once() {
    let temp = tempfile::tempdir().expect("a folder");
    let here = temp.path();
    let scenario = concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios/noise-levels.toml");
    let mut child = Command::new("env")
        .args(["--default-signal=INT", env!("CARGO_BIN_EXE_yair")])
        .current_dir(here)
        .args(["sweep", scenario, "--trials", "4000", "--out", "sweep"])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("yair starts");
    while !here.join("sweep/sweep.state.json").exists() && child.try_wait().expect("it can be asked").is_none() {
        std::thread::sleep(Duration::from_millis(1));
    }
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill");
    assert!(sent.success());
    let said = String::from_utf8(child.wait_with_output().expect("it ends").stderr).expect("UTF-8");
    let (answered, stopped) = (said.find("stopping when"), said.find("stopped after"));
    assert!(answered.is_some() && answered < stopped, "{said}");
}

#[test]
fn a_sweep_that_is_interrupted_has_no_results_and_goes_on() {
    let temp = tempfile::tempdir().expect("a folder");
    let here = temp.path();
    let scenario = concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios/noise-levels.toml");
    let arguments = ["sweep", scenario, "--trials", "400", "--out", "sweep", "--quiet"];
    // A campaign takes its folder first.
    let begun = || here.join("sweep/sweep.lock").exists();
    let results = ["sweep.json", "sweep.svg", "report.html"].map(|name| here.join("sweep").join(name));
    for (signal, code) in SIGNALS {
        let resumed = [&arguments[..], if signal == SIGNALS[0].0 { &[] } else { &["--resume"] }].concat();
        let ended = interrupted(here, signal, &resumed, begun).expect("it is seen at its work");
        assert_eq!(ended.code(), Some(code), "{signal}: {ended}");
        assert!(!begun() && results.iter().all(|file| !file.exists()), "{:?}", everything_in(here));
    }
    succeed(here, &[&arguments[..], &["--resume"]].concat());
    assert!(results.iter().all(|file| file.is_file()), "{:?}", everything_in(here));
}
