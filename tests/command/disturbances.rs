//! Disks that are full, places that cannot be written, input that changes while it is read, two processes
//! with one folder, and numbers of threads: what is there afterwards is whole, or a line says what is wrong.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::interrupt::{is_being_written, long_table};
use crate::support::{Ended, everything_in, run_in, succeed};

const YAIR: &str = env!("CARGO_BIN_EXE_yair");
const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// Runs a line of the shell in which `$0` is the command.
fn shell(here: &Path, line: &str) -> Ended {
    let output = Command::new("sh").args(["-c", line, YAIR]).current_dir(here).output().expect("a shell");
    let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
    Ended { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) }
}

/// A failure that says in one line what is wrong.
#[track_caller]
fn failed(ended: &Ended, what: &str) {
    assert_eq!(ended.code, Some(1), "{what}: {}", ended.stderr);
    let last = ended.stderr.lines().last().unwrap_or_default();
    assert!(last.starts_with("error: ") && !ended.stderr.contains("panicked"), "{what}: {}", ended.stderr);
}

const IMPORT: &str = "import csv log.csv --out set --wheel 0.15 --base 0.3 --ticks-per-rev 4096 --time-unit s \
                      --angle-unit rad --quiet";

#[test]
fn a_full_disk_is_said_and_what_was_there_stays() {
    let temp = tempfile::tempdir().expect("a folder");
    let here = temp.path();
    fs::write(here.join("log.csv"), long_table(2000)).expect("written");
    let robot = format!("{ROOT}/tests/evo/robot");
    succeed(here, &["calibrate", &robot, "--out", "c.toml"]);
    fs::write(here.join("model.h"), "old").expect("written");
    let before = everything_in(here);
    let sweep = format!("sweep {ROOT}/scenarios/paper.toml --trials 2 --out swept --quiet");
    for line in [
        IMPORT,
        &format!("import ros2 {ROOT}/tests/ros2/zstd.mcap --out bag --wheel 0.15 --base 0.3 --quiet"),
        &format!("simulate {ROOT}/scenarios/motion-capture.toml --out robot --quiet"),
        &format!("diagnose {robot} --out found --quiet"),
        &format!("correct {robot} --calibration c.toml --out poses --quiet"),
        "export c c.toml --out model.h --force --quiet",
        // Folders that are made for results, and would be empty.
        &format!("evaluate {robot} --out-dir drift --quiet"),
        &format!("calibrate {robot} --out-dir page/of/it --quiet"),
        "reproduce --trials 2 --out paper --quiet",
        &sweep,
    ] {
        // No file grows beyond two kilobytes, or four where a block of the shell has 1024 bytes; its signal
        // ends no command.
        let ended = shell(here, &format!("ulimit -f 4; exec \"$0\" {line}"));
        failed(&ended, line);
        assert!(ended.stderr.to_lowercase().contains("file too large"), "{line}: {}", ended.stderr);
        // The file is named by the place that it was to have.
        assert!(!ended.stderr.contains(".writing-"), "{line}: {}", ended.stderr);
        if line != sweep {
            assert_eq!(everything_in(here), before, "{line}");
        }
    }
    assert_eq!(fs::read_to_string(here.join("model.h")).expect("there"), "old");
    // A sweep goes on when there is room again.
    succeed(here, &[&sweep.split(' ').collect::<Vec<_>>()[..], &["--resume"]].concat());
    assert!(here.join("swept/report.html").is_file() && !here.join("swept/sweep.state.json").exists());
}

#[cfg(target_os = "linux")]
#[test]
fn output_that_nobody_takes_is_a_failure() {
    let temp = tempfile::tempdir().expect("a folder");
    let here = temp.path();
    let robot = format!("{ROOT}/tests/evo/robot");
    succeed(here, &["calibrate", &robot, "--out", "c.toml"]);
    let mut lines: Vec<String> = ["--help", "--version", "man", "completions bash", "export c c.toml"]
        .map(str::to_owned)
        .into_iter()
        .chain(["calibrate", "evaluate", "check", "diagnose"].map(|command| format!("{command} {robot}")))
        .chain([format!("simulate {ROOT}/scenarios/motion-capture.toml --force --out new")])
        .collect();
    let documents = lines[5..].iter().map(|line| format!("{line} --json --quiet")).collect::<Vec<_>>();
    lines.extend(documents);
    for line in lines {
        // A full disk, and none at all. What is thrown away on purpose is none.
        for (output, why) in [("> /dev/full", "No space left"), (">&-", "closed")] {
            let ended = shell(here, &format!("exec \"$0\" {line} {output}"));
            failed(&ended, &line);
            let said = ended.stderr.matches("error: ").count();
            assert!(said == 1 && ended.stderr.contains("standard output: "), "{line} {output}: {}", ended.stderr);
            assert!(ended.stderr.contains(why), "{line} {output}: {}", ended.stderr);
        }
        let ended = shell(here, &format!("exec \"$0\" {line} 1<> /dev/null"));
        assert_eq!(ended.code, Some(0), "{line}: {}", ended.stderr);
    }
    // What was to be written is there all the same.
    assert!(here.join("new/dataset.toml").is_file() && here.join("new.truth.json").is_file());
}

/// What is there already and may be replaced changes no byte of a page.
#[test]
fn pages_have_the_same_bytes_whatever_is_replaced() {
    let temp = tempfile::tempdir().expect("a folder");
    let here = temp.path();
    let robot = format!("{ROOT}/tests/evo/robot");
    let page = |words: &[&str]| {
        succeed(here, &[&["diagnose", &robot, "--out", "found", "--quiet"], words].concat());
        fs::read(here.join("found/report.html")).expect("a page")
    };
    let first = page(&[]);
    assert!(first == page(&["--force"]), "the page tells of --force");
    let command = "yair diagnose";
    assert!(String::from_utf8_lossy(&first).contains(command), "the page tells its command");
}

#[test]
fn a_place_that_cannot_be_written_is_named() {
    let temp = tempfile::tempdir().expect("a folder");
    let here = temp.path();
    fs::write(here.join("log.csv"), long_table(100)).expect("written");
    // A folder in which nobody can make another, whoever asks.
    let place = if cfg!(target_os = "linux") { "/proc/self/results" } else { "/dev/null/results" };
    for line in [
        IMPORT.replace("--out set", &format!("--out {place}")),
        format!("diagnose {ROOT}/tests/evo/robot --out {place} --quiet"),
        format!("sweep {ROOT}/scenarios/paper.toml --trials 2 --out {place} --quiet"),
        format!("calibrate {ROOT}/tests/evo/robot --out {place}/c.toml --quiet"),
    ] {
        let ended = run_in(here, &line.split_whitespace().collect::<Vec<_>>());
        failed(&ended, &line);
        assert!(ended.stderr.contains(place), "{line}: {}", ended.stderr);
    }
}

/// A log to which a recorder still writes, that is cut, and that vanishes: what is imported is a dataset, or
/// nothing is there.
#[test]
fn input_that_changes_while_it_is_read_gives_a_dataset_or_a_refusal() {
    let temp = tempfile::tempdir().expect("a folder");
    let here = temp.path();
    let (log, table) = (here.join("log.csv"), long_table(30_000));
    let changes: [fn(&Path, &str); 3] = [
        |log, table| {
            let mut file = fs::File::options().append(true).open(log).expect("opened");
            // Rows go on where the table ends, and a write ends amid a row.
            let row = table.lines().last().unwrap_or_default().replacen("599.98", "700.00", 1);
            let _ = write!(file, "{row}\n{}", &row[..9]);
        },
        |log, table| {
            fs::File::options().write(true).open(log).expect("opened").set_len(table.len() as u64 / 2).expect("cut");
        },
        |log, _| fs::remove_file(log).expect("removed"),
    ];
    for change in changes {
        fs::write(&log, &table).expect("written");
        let begun = AtomicBool::new(false);
        let ended = std::thread::scope(|scope| {
            scope.spawn(|| {
                while !begun.load(Ordering::Relaxed) {
                    std::thread::yield_now();
                }
                // The middle of the reading, on a machine that is idle.
                std::thread::sleep(Duration::from_millis(4));
                change(&log, &table);
            });
            begun.store(true, Ordering::Relaxed);
            run_in(here, &IMPORT.split_whitespace().collect::<Vec<_>>())
        });
        if ended.code == Some(0) {
            dataset::read(&here.join("set")).expect("what was imported can be read");
            fs::remove_dir_all(here.join("set")).expect("removed");
        } else {
            failed(&ended, "import");
        }
        let left: Vec<_> = everything_in(here).into_iter().filter(|path| *path != log).collect();
        assert!(left.is_empty(), "{left:?}");
    }
}

#[test]
fn of_two_processes_with_one_folder_one_ends_well() {
    let temp = tempfile::tempdir().expect("a folder");
    let here = temp.path();
    fs::write(here.join("log.csv"), long_table(20_000)).expect("written");
    for line in [IMPORT, &format!("diagnose {ROOT}/tests/evo/robot --out found --quiet")] {
        let words: Vec<&str> = line.split_whitespace().collect();
        let start =
            || Command::new(YAIR).current_dir(here).args(&words).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
        let both = [start().expect("starts"), start().expect("starts")];
        let mut codes = both.map(|mut child| child.wait().expect("ends").code());
        codes.sort_unstable();
        assert_eq!(codes, [Some(0), Some(1)], "{line}");
    }
    let names = fs::read_dir(here).expect("a folder").map(|entry| entry.expect("an entry").file_name());
    let mut names: Vec<String> = names.map(|name| name.to_string_lossy().into_owned()).collect();
    names.sort();
    assert_eq!(names, ["found", "log.csv", "set"]);
    succeed(here, &["check", "set"]);
}

/// What comes to stand under a dataset's name while it is made stays; the words are not the system's.
#[test]
fn a_folder_that_is_filled_meanwhile_stays_and_is_said() {
    let temp = tempfile::tempdir().expect("a folder");
    let here = temp.path();
    fs::write(here.join("log.csv"), long_table(150_000)).expect("written");
    let words: Vec<&str> = IMPORT.split_whitespace().collect();
    let mut command = Command::new(YAIR);
    command.current_dir(here).args(&words).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("starts");
    while !is_being_written(here) {
        assert_eq!(child.try_wait().expect("it can be asked"), None, "it is seen at its work");
        std::thread::sleep(Duration::from_micros(200));
    }
    fs::create_dir(here.join("set")).expect("made");
    fs::write(here.join("set/mine"), "mine").expect("written");
    let ended = child.wait_with_output().expect("it ends");
    let said = String::from_utf8(ended.stderr).expect("UTF-8");
    assert_eq!(ended.status.code(), Some(1), "{said}");
    assert!(said.contains("set: already exists and is not empty; nothing was written"), "{said}");
    assert!(!said.contains("os error"), "{said}");
    let left: Vec<_> = ["log.csv", "set", "set/mine"].map(|name| here.join(name)).into();
    assert_eq!(everything_in(here), left);
}

#[test]
fn a_diagnosis_is_the_same_on_any_number_of_threads_and_again() {
    let temp = tempfile::tempdir().expect("a folder");
    let here = temp.path();
    succeed(here, &["simulate", &format!("{ROOT}/scenarios/motion-capture.toml"), "--out", "robot"]);
    let found = |threads: &str| {
        let line = format!("RAYON_NUM_THREADS={threads} exec \"$0\" diagnose robot --out found --force --json --quiet");
        let ended = shell(here, &line);
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        let files = everything_in(&here.join("found"));
        (ended.stdout, files.iter().map(|file| fs::read(file).expect("read")).collect::<Vec<_>>())
    };
    let one = found("1");
    assert!(one == found("2"), "two threads give other bytes");
    assert!(one == found("3"), "three threads give other bytes");
}
