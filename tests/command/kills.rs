//! `kill -9` at random instants: whatever is there afterwards is whole, doing it again or going on gives the
//! bytes of an undisturbed run, and nothing of the killed one is left.
//!
//! `cargo test` tries a few instants. `.ci/run kills` tries two hundred, with YAIR_KILLS_OF="sweep --shard"
//! those of this command alone; docs/reliability.md has what came of them.

use std::collections::BTreeMap;
use std::fs;
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

/// Instants of a campaign for each task: two hundred.
const INSTANTS: [u32; 5] = [50, 50, 40, 30, 30];

/// What is killed, and how it is done again.
struct Task {
    name: &'static str,
    arguments: Vec<String>,
    /// The folder that it makes.
    out: &'static str,
    /// Added where the folder is there already; without it a folder that is there must be whole.
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
    let robot = "--wheel 0.15 --base 0.3";
    vec![
        task(
            "import csv",
            &format!("import csv log.csv --out table {robot} --ticks-per-rev 4096 --time-unit s --angle-unit rad"),
            "table",
            None,
        ),
        task("import ros2", &format!("import ros2 {root}/tests/ros2/zstd.mcap --out bag {robot}"), "bag", None),
        task("diagnose", &format!("diagnose {root}/tests/evo/robot --out found"), "found", None),
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
    ]
}

fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let files = everything_in(folder).into_iter().filter(|path| path.is_file());
    files.map(|path| (path.strip_prefix(folder).expect("inside").to_owned(), fs::read(&path).expect("read"))).collect()
}

fn words(arguments: &[String]) -> Vec<&str> {
    arguments.iter().map(String::as_str).collect()
}

/// Kills a task at instants of its undisturbed time, one in each equal part; how often it was killed at work,
/// and how often its folder was there by then.
fn killed(here: &Path, task: &Task, instants: u32, random: &mut Xoshiro256PlusPlus) -> (u32, u32) {
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
        child.kill().expect("killed, or ended before");
        let was_at_work = child.wait().expect("ended").code().is_none();
        at_work += u32::from(was_at_work);
        there += u32::from(was_at_work && out.exists());
        match task.goes_on_by {
            Some(flag) => drop(succeed(here, &[&words(&task.arguments)[..], &[flag]].concat())),
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
    if task.goes_on_by.is_none() {
        succeed(here, &words(&task.arguments));
        fs::remove_dir_all(&out).expect("removed");
    }
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
        at_work += killed(here, &task, 2, &mut random).0;
    }
    // A test that comes too late each time kills nothing.
    assert!(at_work > 0);
}

#[test]
#[ignore = "a campaign: .ci/run kills"]
#[allow(clippy::print_stdout)] // what the campaign found
fn two_hundred_instants() {
    let temp = tempfile::tempdir().expect("a folder");
    let here = temp.path();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(200);
    println!("| command | instants | killed at work | its folder was there | other bytes, or something left |");
    println!("| --- | --- | --- | --- | --- |");
    let only = std::env::var("YAIR_KILLS_OF").ok();
    let tasks = tasks(here, SWEPT, 150_000);
    let asked = |task: &Task| only.as_ref().is_none_or(|name| name == task.name);
    assert!(tasks.iter().any(asked), "YAIR_KILLS_OF names none of the commands");
    for (task, instants) in tasks.iter().zip(INSTANTS).filter(|(task, _)| asked(task)) {
        let (at_work, there) = killed(here, task, instants, &mut random);
        println!("| `{}` | {instants} | {at_work} | {there} | 0 |", task.name);
    }
}
