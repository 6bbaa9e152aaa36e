//! The command as a user runs it, for the tests of the whole system.
#![allow(dead_code)] // each test uses its own part of it

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use serde_json::Value;

pub(crate) mod real_data;

/// How a command ended.
pub(crate) struct Ended {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

/// `yair` with arguments, started in `folder`.
pub(crate) fn run_in(folder: &Path, arguments: &[&str]) -> Ended {
    let output = Command::new(env!("CARGO_BIN_EXE_yair"))
        .current_dir(folder)
        .args(arguments)
        .timeout(std::time::Duration::from_secs(240))
        .output()
        .expect("yair starts");
    let text = |bytes| String::from_utf8(bytes).expect("yair speaks UTF-8");
    Ended { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) }
}

/// Runs what must succeed.
#[track_caller]
pub(crate) fn succeed(folder: &Path, arguments: &[&str]) -> Ended {
    let ended = run_in(folder, arguments);
    assert_eq!(ended.code, Some(0), "{arguments:?}: {}", ended.stderr);
    ended
}

/// Runs what must succeed with `--json --quiet`: exactly one document on standard output, nothing on standard
/// error.
#[track_caller]
pub(crate) fn document(folder: &Path, arguments: &[&str]) -> Value {
    let ended = succeed(folder, &[arguments, &["--json", "--quiet"]].concat());
    assert_eq!(ended.stderr, "", "{arguments:?}");
    // from_str refuses anything before and after the one document.
    serde_json::from_str(&ended.stdout).unwrap_or_else(|error| panic!("{arguments:?}: {error}: {}", ended.stdout))
}

/// Runs what must be refused as bad input: exit 1, one line, no output. Gives the message.
#[track_caller]
pub(crate) fn refusal(folder: &Path, arguments: &[&str]) -> String {
    let ended = run_in(folder, arguments);
    let Ended { code, stdout, stderr } = ended;
    assert_eq!(code, Some(1), "{arguments:?}: {stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
    assert_eq!(stderr.lines().count(), 1, "{arguments:?}: {stderr}");
    // A line that a person can take in: the longest good one lists the effects that are known.
    assert!(stderr.len() < 1100, "{arguments:?}: {stderr}");
    let message = stderr.strip_prefix("error: ").unwrap_or_else(|| panic!("{arguments:?}: {stderr}")).trim_end();
    if arguments.contains(&"--json") {
        let document: Value = serde_json::from_str(&stdout).expect("one JSON document of the failure");
        assert_eq!(document["error"], message, "{arguments:?}");
    } else {
        assert_eq!(stdout, "", "{arguments:?}");
    }
    message.to_owned()
}

/// Runs what must be refused as bad usage: exit 2. Gives the message.
#[track_caller]
pub(crate) fn usage(folder: &Path, arguments: &[&str]) -> String {
    let ended = run_in(folder, arguments);
    assert_eq!((ended.code, ended.stdout.as_str()), (Some(2), ""), "{arguments:?}: {}", ended.stderr);
    ended.stderr
}

/// Every path below a folder, sorted.
pub(crate) fn everything_in(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            found.extend(everything_in(&path));
        }
        found.push(path);
    }
    found.sort();
    found
}

/// The shipped scenario of the paper.
pub(crate) fn paper() -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/paper.toml"))
        .expect("the shipped scenario")
}

/// A folder with `paper.toml`, and `set` simulated from it.
pub(crate) fn workplace() -> tempfile::TempDir {
    let temp = tempfile::tempdir().expect("a temporary folder");
    fs::write(temp.path().join("paper.toml"), paper()).expect("written");
    succeed(temp.path(), &["simulate", "paper.toml", "--out", "set"]);
    temp
}
