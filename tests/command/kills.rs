//! `kill -9` and SIGTERM at random instants: whatever is there afterwards is whole, doing it again or going
//! on gives the bytes of an undisturbed run, and nothing is left of the process that was ended. SIGTERM
//! leaves nothing in the first place.
//!
//! `cargo test` tries a few instants. `.ci/run kills` tries two hundred and sixty, with
//! YAIR_KILLS_OF="sweep --shard" those of this command alone; docs/reliability.md has what came of them.

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::interrupt::long_table;
use crate::support::{everything_in, succeed};

/// Trials of a campaign's sweep, and of that of which a third is done: both take long enough for some states,
/// which are written every two seconds.
const SWEPT: [u32; 2] = [1000, 3000];

/// Instants of a campaign for each of the first tasks: two hundred.
const INSTANTS: [u32; 5] = [50, 50, 40, 30, 30];

/// Instants of a campaign of SIGTERM for each of all tasks: sixty.
const TERM_INSTANTS: [u32; 9] = [7, 7, 7, 7, 7, 7, 6, 6, 6];

/// How a process is ended.
#[derive(Clone, Copy, PartialEq)]
enum Signal {
    Kill,
    Term,
}

impl Signal {
    fn name_and_number(self) -> (&'static str, i32) {
        match self {
            Self::Kill => ("-KILL", 9),
            Self::Term => ("-TERM", 15),
        }
    }
}

/// What is killed, and how it is done again.
struct Task {
    name: &'static str,
    arguments: Vec<String>,
    /// The folder that it makes.
    out: &'static str,
    /// Flags to add where the folder is there already; without them a folder that is there must be whole.
    goes_on_by: Option<&'static str>,
}

fn task(name: &'static str, line: &str, out: &'static str, goes_on_by: Option<&'static str>) -> Task {
    let arguments = line.split_whitespace().map(str::to_owned).chain(["--quiet".to_owned()]).collect();
    Task { name, arguments, out, goes_on_by }
}

/// The commands of a campaign, with the trials of a sweep and of a third of one and the rows of a table;
/// their sources in `here`.
fn tasks(here: &Path, trials: [u32; 2], rows: u32) -> Vec<Task> {
    let root = env!("CARGO_MANIFEST_DIR");
    fs::write(here.join("log.csv"), long_table(rows)).expect("written");
    let evo = format!("{root}/tests/evo/robot");
    succeed(here, &["calibrate", &evo, "--out", "c.toml"]);
    for trial in ["1", "2", "3"] {
        let scenario = format!("{root}/scenarios/paper.toml");
        succeed(here, &["simulate", &scenario, "--trial", trial, "--out", trial]);
    }
    let robot = "--wheel 0.15 --base 0.3";
    vec![
        task(
            "import csv",
            &format!("import csv log.csv --out table {robot} --ticks-per-rev 4096 --time-unit s --angle-unit rad"),
            "table",
            None,
        ),
        task("import ros2", &format!("import ros2 {root}/tests/ros2/zstd.mcap --out bag {robot}"), "bag", None),
        task("diagnose", &format!("diagnose {evo} --out found"), "found", None),
        task(
            "sweep",
            &format!("sweep {root}/scenarios/noise-levels.toml --trials {} --jobs 1 --out swept", trials[0]),
            "swept",
            Some("--resume"),
        ),
        task(
            "sweep --shard",
            &format!("sweep {root}/scenarios/noise-levels.toml --trials {} --shard 2/3 --jobs 1 --out part", trials[1]),
            "part",
            Some("--resume"),
        ),
        // Truth stands beside the dataset.
        task(
            "simulate",
            &format!("simulate {root}/scenarios/motion-capture.toml --out new/robot"),
            "new",
            Some("--force"),
        ),
        task("fleet", "fleet 1 2 3 --jobs 1 --out fleet", "fleet", Some("")),
        // Files that are each whole.
        task("correct", &format!("correct {evo} --calibration c.toml --out poses"), "poses", Some("--force")),
        task("calibrate", &format!("calibrate {evo} --method all --out-dir pages"), "pages", Some("")),
    ]
}

fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let files = everything_in(folder).into_iter().filter(|path| path.is_file());
    files.map(|path| (path.strip_prefix(folder).expect("inside").to_owned(), fs::read(&path).expect("read"))).collect()
}

/// Files and folders under way, and locks.
fn leftovers(here: &Path) -> Vec<PathBuf> {
    let is_left = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        name.starts_with(".writing-") || name == "sweep.lock"
    };
    everything_in(here).into_iter().filter(is_left).collect()
}

fn words(arguments: &[String]) -> Vec<&str> {
    arguments.iter().map(String::as_str).collect()
}

/// Ends a task at instants of its undisturbed time, one in each equal part; how often it was ended at work,
/// and how often its folder was there by then.
fn ended(here: &Path, task: &Task, signal: Signal, instants: u32, random: &mut Xoshiro256PlusPlus) -> (u32, u32) {
    let (name, number) = signal.name_and_number();
    let out = here.join(task.out);
    let sources = everything_in(here);
    let begun = Instant::now();
    succeed(here, &words(&task.arguments));
    let undisturbed_s = begun.elapsed().as_secs_f64();
    let whole = contents(&out);
    fs::remove_dir_all(&out).expect("removed");
    let (mut at_work, mut there) = (0, 0);
    for instant in 0..instants {
        let mut child = Command::new(env!("CARGO_BIN_EXE_yair"))
            .current_dir(here)
            .args(&task.arguments)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("yair starts");
        let share = (f64::from(instant) + random.random::<f64>()) / f64::from(instants);
        std::thread::sleep(Duration::from_secs_f64(share * undisturbed_s));
        // It may have ended before.
        let _ = Command::new("kill").args([name, &child.id().to_string()]).stderr(Stdio::null()).status();
        let status = child.wait().expect("ended");
        let was_at_work = !status.success();
        if was_at_work && signal == Signal::Term {
            // In its first milliseconds a process does not answer signals yet.
            let is_answered = status.code() == Some(128 + number);
            assert!(is_answered || status.signal() == Some(number), "{}: {status} at {share:.3}", task.name);
            let left = leftovers(here);
            assert!(left.is_empty(), "{}: at {share:.3} of its time: {left:?}", task.name);
        } else {
            assert!(!was_at_work || status.signal() == Some(number), "{}: {status}", task.name);
        }
        at_work += u32::from(was_at_work);
        there += u32::from(was_at_work && out.exists());
        match task.goes_on_by {
            Some(flags) => {
                let flags: Vec<&str> = flags.split_whitespace().collect();
                succeed(here, &[&words(&task.arguments)[..], &flags].concat());
            }
            // Its name is given to what is whole.
            None if out.exists() => assert!(contents(&out) == whole, "{}: half of it is there", task.name),
            None => drop(succeed(here, &words(&task.arguments))),
        }
        let found = contents(&out);
        let names = |of: &BTreeMap<PathBuf, Vec<u8>>| of.keys().cloned().collect::<Vec<_>>();
        assert_eq!(names(&found), names(&whole), "{}: killed at {share:.3} of its time", task.name);
        assert!(found == whole, "{}: killed at {share:.3} of its time it gives other bytes", task.name);
        fs::remove_dir_all(&out).expect("removed");
    }
    // What the last one left, if it came to its end in time, is for the next in the same place.
    succeed(here, &words(&task.arguments));
    fs::remove_dir_all(&out).expect("removed");
    assert_eq!(everything_in(here), sources, "{}", task.name);
    (at_work, there)
}

#[test]
fn what_is_killed_is_done_again_with_the_same_bytes() {
    let temp = tempfile::tempdir().expect("a folder");
    let here = temp.path();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut at_work = 0;
    for task in tasks(here, [40, 120], 20_000) {
        at_work += ended(here, &task, Signal::Kill, 2, &mut random).0;
    }
    // A test that comes too late each time kills nothing.
    assert!(at_work > 0);
}

#[test]
fn what_is_asked_to_end_leaves_nothing_and_goes_on_with_the_same_bytes() {
    let temp = tempfile::tempdir().expect("a folder");
    let here = temp.path();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(2);
    let mut at_work = 0;
    for task in tasks(here, [40, 120], 20_000) {
        at_work += ended(here, &task, Signal::Term, 2, &mut random).0;
    }
    assert!(at_work > 0);
}

/// A campaign of a signal over the first tasks.
#[allow(clippy::print_stdout)] // what the campaign found
fn campaign(signal: Signal, instants: &[u32], seed: u64) {
    let temp = tempfile::tempdir().expect("a folder");
    let here = temp.path();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    println!("| command | instants | ended at work | its folder was there | other bytes, or something left |");
    println!("| --- | --- | --- | --- | --- |");
    let only = std::env::var("YAIR_KILLS_OF").ok();
    let tasks = tasks(here, SWEPT, 150_000);
    let asked = |task: &Task| only.as_ref().is_none_or(|name| name == task.name);
    assert!(tasks.iter().any(asked), "YAIR_KILLS_OF names none of the commands");
    for (task, instants) in tasks.iter().zip(instants).filter(|(task, _)| asked(task)) {
        let (at_work, there) = ended(here, task, signal, *instants, &mut random);
        println!("| `{}` | {instants} | {at_work} | {there} | 0 |", task.name);
    }
}

#[test]
#[ignore = "a campaign: .ci/run kills"]
fn two_hundred_instants() {
    campaign(Signal::Kill, &INSTANTS, 200);
}

#[test]
#[ignore = "a campaign: .ci/run kills"]
fn sixty_instants_of_sigterm() {
    campaign(Signal::Term, &TERM_INSTANTS, 60);
}
