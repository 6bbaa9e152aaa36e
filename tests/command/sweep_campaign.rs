//! Campaigns that are stopped, killed, cut into shards and run on other numbers of threads end in the same
//! bytes.
//!
//! Rejected by what was tried: sums in the order of arrival, states without the last bits of their numbers, a
//! spool that is not cut back on going on.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::Duration;

use crate::support::{document, refusal, run_in, succeed, usage};
use bench::{BenchError, Campaign, Outcome, Shard, SweepOptions, SweepPlan, SweepResult};
use motion_programs::Schedule;
#[cfg(feature = "parquet")]
use parquet::{file::serialized_reader::SerializedFileReader, record::Field};
use scenario::Scenario;

/// The state's file, as documented, and the file in which estimates are collected for rows.
const STATE: &str = "sweep.state.json";
const SPOOL: &str = "sweep.trials.spool";

/// The paper's robot on few runs, at four points: 301 trials leave the last chunk of each unfilled.
fn scenario() -> Scenario {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/paper.toml");
    let mut scenario = Scenario::read(&path).expect("the shipped scenario");
    scenario.protocols = vec![
        Schedule::Straights { length_m: 0.5, runs: 6 },
        Schedule::Spins { turn_rad: std::f64::consts::TAU, runs: 4 },
        Schedule::Squares { side_m: 2.0, runs_each_way: 2 },
    ];
    let sweep = scenario.sweep.as_mut().expect("the paper sweeps");
    sweep.trials = 301;
    sweep.axes.retain(|key, _| key.contains("reading_sigma"));
    sweep.validation = vec![Schedule::Squares { side_m: 2.0, runs_each_way: 1 }];
    scenario
}

fn plan(precision: Option<f64>) -> SweepPlan {
    SweepPlan::new(&scenario(), SweepOptions { precision, ..SweepOptions::default() }).expect("a sweep")
}

/// Runs a campaign, stopped after `waves` waves if it lasts so long.
fn run(
    plan: &SweepPlan,
    folder: &Path,
    shard: Shard,
    jobs: usize,
    resume: bool,
    waves: u32,
) -> Result<Outcome, BenchError> {
    let (stop, left) = (AtomicBool::new(waves == 0), AtomicU32::new(waves));
    plan.campaign(&Campaign {
        jobs,
        folder: Some(folder),
        resume,
        shard,
        rows: true,
        stop: &stop,
        progress: &|_| {
            if left.fetch_sub(1, Ordering::Relaxed) <= 1 {
                stop.store(true, Ordering::Relaxed);
            }
        },
    })
}

/// Runs to the end and writes the results.
fn whole(plan: &SweepPlan, folder: &Path, jobs: usize) -> BTreeMap<String, Vec<u8>> {
    fs::create_dir_all(folder).expect("a folder");
    let Outcome::Whole(result) = run(plan, folder, Shard::WHOLE, jobs, false, u32::MAX).expect("runs") else {
        panic!("one shard that nobody stops")
    };
    finished(plan, &result, folder)
}

/// The estimates as they were collected, and the files that are made in the end; rows only where this build
/// writes them.
fn finished(plan: &SweepPlan, result: &SweepResult, folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let spool = fs::read(folder.join(SPOOL)).expect("a spool");
    bench::write_results(plan, result, cfg!(feature = "parquet"), folder).expect("written");
    let mut all = contents(folder);
    assert!(!all.contains_key(SPOOL) && !all.contains_key(STATE), "they are taken away");
    all.insert(SPOOL.to_owned(), spool);
    all
}

fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| {
            let entry = entry.expect("an entry");
            let name = entry.file_name().to_string_lossy().into_owned();
            (name, fs::read(entry.path()).expect("a file"))
        })
        .collect()
}

#[track_caller]
fn assert_same(a: &BTreeMap<String, Vec<u8>>, b: &BTreeMap<String, Vec<u8>>) {
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>());
    for (name, bytes) in a {
        assert!(bytes == &b[name], "{name} differs");
    }
}

#[test]
fn threads_stops_and_shards_end_in_the_same_bytes() {
    for precision in [None, Some(0.2)] {
        let plan = plan(precision);
        let temporary = tempfile::tempdir().expect("a folder");
        let at = |name: &str| temporary.path().join(name);
        let undisturbed = whole(&plan, &at("one"), 1);
        let names = [
            "sweep.csv",
            "sweep.json",
            #[cfg(feature = "png")]
            "sweep.png",
            "sweep.svg",
            SPOOL,
            #[cfg(feature = "parquet")]
            "trials.parquet",
        ];
        assert_eq!(undisturbed.keys().collect::<Vec<_>>(), names);
        assert_same(&undisturbed, &whole(&plan, &at("two"), 2));

        // Stopped again and again, after one wave, two, three.
        let folder = at("stopped");
        fs::create_dir_all(&folder).expect("a folder");
        let mut stops = 0;
        let result = loop {
            match run(&plan, &folder, Shard::WHOLE, 1, stops > 0, 1 + stops % 3).expect("goes on") {
                Outcome::Whole(result) => break result,
                Outcome::Stopped(_) => stops += 1,
                Outcome::Shard => panic!("one shard"),
            }
            // What a killed process leaves behind its state: a longer spool.
            let spool = folder.join(SPOOL);
            let mut bytes = fs::read(&spool).expect("a spool");
            bytes.extend([7; 33]);
            fs::write(&spool, bytes).expect("written");
        };
        assert!(stops >= 3, "it was stopped {stops} times only");
        assert_same(&undisturbed, &finished(&plan, &result, &folder));

        // Shards, some of which begin within a point; merged in another order.
        for of in [2, 5] {
            let mut folders: Vec<PathBuf> = Vec::new();
            for number in 1..=of {
                let folder = at(&format!("shard-{number}-of-{of}"));
                fs::create_dir_all(&folder).expect("a folder");
                let shard = Shard::new(number, of).expect("within");
                assert_eq!(run(&plan, &folder, shard, 2, false, u32::MAX).expect("runs"), Outcome::Shard);
                folders.insert(0, folder);
            }
            // The first shard comes last.
            let spools = folders.iter().rev().map(|folder| fs::read(folder.join(SPOOL)).expect("a spool"));
            assert!(spools.flatten().eq(undisturbed[SPOOL].iter().copied()), "the shards' estimates are all");
            let merged = bench::merge(&folders).expect("a whole");
            let mut json = serde_json::to_vec_pretty(&merged.result).expect("JSON");
            json.push(b'\n');
            assert!(json == undisturbed["sweep.json"], "the merged result differs");
            #[cfg(feature = "parquet")]
            {
                let out = at(&format!("merged-{of}"));
                bench::write_merged(&merged, &out).expect("written");
                let mut merged = contents(&out);
                merged.insert(SPOOL.to_owned(), undisturbed[SPOOL].clone());
                assert_same(&undisturbed, &merged);
            }
        }
    }
}

#[test]
fn another_seed_or_point_gives_other_bytes() {
    let result = plan(None).run(0, &|_| ()).expect("runs");
    let options = SweepOptions { seed: Some(3), ..SweepOptions::default() };
    let other = SweepPlan::new(&scenario(), options).expect("a sweep").run(0, &|_| ()).expect("runs");
    assert_ne!(result.points, other.points);
    // Points whose robots are alike scatter independently: equal levels twice on an axis give two estimates
    // of the same.
    let mut twice = scenario();
    let axes = &mut twice.sweep.as_mut().expect("the paper sweeps").axes;
    axes.clear();
    axes.insert("placement.half_width_m".to_owned(), scenario::Levels::List(vec![0.05, 0.05]));
    let result = SweepPlan::new(&twice, SweepOptions::default()).expect("a sweep").run(0, &|_| ()).expect("runs");
    assert_ne!(result.points[0].estimators, result.points[1].estimators);
}

#[test]
fn a_precision_is_kept_by_every_number() {
    let precision = 0.05;
    let result = plan(Some(precision)).run(0, &|_| ()).expect("runs");
    for point in &result.points {
        assert_eq!(point.precise, Some(true));
        // 2.1/√n of the outer quantiles asks for about 1760 trials of normals; four times that would be
        // waste.
        assert!((800..8000).contains(&point.trials), "{}", point.trials);
        for estimator in &point.estimators {
            let (std, _) = estimator.std().expect("a spread");
            let relative = |error: Option<f64>, scale: f64| error.expect("an error") / scale;
            assert!(relative(estimator.bias_mcse, std) <= precision);
            assert!(relative(estimator.variance_mcse, std * std) <= precision);
            assert!(relative(estimator.rmse_mcse, estimator.rmse.expect("an RMSE")) <= precision);
            assert!(estimator.quantiles.len() == 3 && estimator.quantiles.iter().all(|q| q.mcse <= precision * std));
            assert!(estimator.coverage_95.expect("a coverage").mcse <= precision);
            assert!(estimator.coverage_68.expect("a coverage").mcse <= precision);
            if let (Some(ratio), Some(error)) = (estimator.cramer_rao_ratio, estimator.cramer_rao_ratio_mcse) {
                assert!(error <= precision * ratio * (1.0 + 1e-12), "{error} {ratio}");
            }
        }
    }
    // What cannot be reached is said, and ends.
    let options = SweepOptions { precision: Some(0.001), trials: Some(600), seed: None };
    let result = SweepPlan::new(&scenario(), options).expect("a sweep").run(0, &|_| ()).expect("runs");
    assert!(result.points.iter().all(|point| point.precise == Some(false) && point.trials == 600));
}

fn write_scenario(folder: &Path, trials: u64) {
    let mut scenario = scenario();
    scenario.sweep.as_mut().expect("the paper sweeps").trials = trials;
    fs::write(folder.join("small.toml"), scenario.to_toml().expect("TOML")).expect("written");
}

/// Starts a campaign in a folder and kills it, with no time to say anything, a little after it has written
/// its state anew. Whether it lasted so long.
fn killed_after_a_state(here: &Path, arguments: &[&str], state: &Path) -> bool {
    let written = || fs::metadata(state).and_then(|of| of.modified()).ok();
    let before = written();
    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_yair"))
        .current_dir(here)
        .args(arguments)
        .stdout(std::process::Stdio::null())
        .spawn()
        .expect("yair starts");
    while written() == before && child.try_wait().expect("a child").is_none() {
        std::thread::sleep(Duration::from_millis(10));
    }
    std::thread::sleep(Duration::from_millis(150));
    child.kill().expect("killed, or ended before");
    // A process that a signal ended has no code; one that failed by itself has.
    child.wait().expect("ended").code().is_none()
}

/// The command killed as soon as its state stands.
#[test]
fn a_killed_command_goes_on_where_it_was() {
    let temporary = tempfile::tempdir().expect("a folder");
    let here = temporary.path();
    let arguments = [
        "sweep",
        "small.toml",
        #[cfg(feature = "parquet")]
        "--rows",
        "--json",
        "--quiet",
        "--jobs",
        "1",
        "--out",
    ];
    let state = here.join("killed").join(STATE);
    let mut trials = 2000;
    // A state is written every two seconds: where the campaign ends before, it gets longer.
    loop {
        write_scenario(here, trials);
        if killed_after_a_state(here, &[&arguments[..], &["killed"]].concat(), &state) {
            break;
        }
        assert!(trials < 10_000_000, "no state is written");
        fs::remove_dir_all(here.join("killed")).expect("removed");
        trials *= 2;
    }
    let message = refusal(here, &["sweep", "small.toml", "--out", "killed"]);
    assert!(message.contains("--resume") && message.contains(STATE), "{message}");
    let undisturbed = succeed(here, &[&arguments[..], &["whole"]].concat());
    let resumed = run_in(here, &[&arguments[..], &["killed", "--resume"]].concat());
    assert_eq!(resumed.code, Some(0), "{}", resumed.stderr);
    assert_eq!(resumed.stdout, undisturbed.stdout);
    assert_same(&contents(&here.join("whole")), &contents(&here.join("killed")));
}

/// Gone on with, a place beyond the design was a campaign of a thousand years, and a count beyond its trials
/// a panic.
#[test]
fn a_state_that_its_plan_cannot_have_come_to_is_refused() {
    let temporary = tempfile::tempdir().expect("a folder");
    let (here, plan) = (temporary.path(), plan(None));
    run(&plan, here, Shard::WHOLE, 1, false, 2).expect("stopped");
    let state: serde_json::Value = serde_json::from_slice(&fs::read(here.join(STATE)).expect("a state")).expect("JSON");
    let resumed = |at: &str, value: serde_json::Value| {
        let mut changed = state.clone();
        *changed.pointer_mut(at).unwrap_or_else(|| panic!("no {at} in {state}")) = value;
        fs::write(here.join(STATE), changed.to_string()).expect("written");
        // No wave: what is read is written again.
        run(&plan, here, Shard::WHOLE, 1, true, 0)
    };
    assert!(matches!(resumed("/spooled", state["spooled"].clone()), Ok(Outcome::Stopped(_))));
    let tally = "/open/0/1/chunks/nodes/0/sum/estimates/0";
    for (at, value) in [
        ("/next/chunk", 1_u64 << 32),
        ("/next/point", 1 << 32),
        ("/end/chunk", 1 << 32),
        ("/end/point", 1 << 32),
        ("/first/chunk", 1),
        ("/open/0/0", 7),
        ("/open/0/1/look", 1 << 32),
        ("/open/0/1/chunks/next", 1 << 63),
        ("/open/0/1/chunks/nodes/0/level", 63),
        ("/open/0/1/chunks/nodes/0/level", 64),
        ("/open/0/1/histograms/0/count", u64::MAX),
        (&format!("{tally}/failures"), u64::MAX),
        (&format!("{tally}/with_sigma"), 1 << 32),
        (&format!("{tally}/errors/count"), 1 << 32),
    ] {
        let ended = resumed(at, value.into());
        assert!(matches!(ended, Err(BenchError::NotAState { .. })), "{at} = {value}: {ended:?}");
    }
    for (key, value) in [("count", -1.0), ("mean", 1e100), ("m2", -1e-9), ("m4", 1e300), ("m3", -1e300)] {
        let ended = resumed(&format!("{tally}/errors/{key}"), value.into());
        assert!(matches!(ended, Err(BenchError::NotAState { .. })), "{key} = {value}: {ended:?}");
    }
}

#[test]
fn what_does_not_fit_together_is_refused_with_the_reason() {
    let temporary = tempfile::tempdir().expect("a folder");
    let here = temporary.path();
    write_scenario(here, 40);
    let shard = |number: &str, out: &str, more: &[&str]| {
        let arguments = ["sweep", "small.toml", "--shard", number, "--out", out];
        succeed(here, &[&arguments[..], more].concat());
    };
    shard("1/3", "a", &[]);
    shard("2/3", "b", &[]);
    shard("3/3", "c", &[]);
    shard("3/3", "other", &["--seed", "5"]);
    let merged = document(here, &["merge", "c", "a", "b", "--out", "ab"]);
    assert_eq!(merged, document(here, &["sweep", "small.toml"]));
    let merge = |folders: &[&str]| refusal(here, &[&["merge"], folders, &["--out", "m"]].concat());
    assert!(merge(&["a", "c"]).contains("missing"));
    assert!(merge(&["a", "b"]).contains("after 2/3 are missing"));
    assert!(merge(&["a", "b", "b", "c"]).contains("too"));
    assert!(merge(&["a", "b", "other"]).contains("seed is 5"));
    assert!(merge(&["a", "."]).contains("not the folder of a shard"));
    assert!(!here.join("m").exists());
    // A shard that is done can be asked for again; another shard's folder cannot be taken.
    shard("2/3", "b", &["--resume"]);
    let arguments = ["sweep", "small.toml", "--shard", "1/3", "--out", "b", "--resume"];
    assert!(refusal(here, &arguments).contains("its shard is 2/3, not 1/3"));
    let arguments = ["sweep", "small.toml", "--shard", "2/3", "--out", "b", "--resume", "--trials", "41"];
    assert!(refusal(here, &arguments).contains("number of trials is 40, not 41"));
    fs::create_dir(here.join("bad")).expect("a folder");
    let state = fs::read_to_string(here.join("a").join(STATE)).expect("a state");
    fs::write(here.join("bad").join(STATE), &state[..state.len() / 2]).expect("written");
    let message = merge(&["bad", "b", "c"]);
    assert!(message.contains("not the state of a sweep") && message.contains("bad"), "{message}");
    for wrong in ["0/3", "4/3", "x"] {
        assert!(usage(here, &["sweep", "small.toml", "--shard", wrong, "--out", "d"]).contains("I/N"));
    }
    assert!(usage(here, &["sweep", "small.toml", "--shard", "1/3"]).contains("--out"));
    assert!(usage(here, &["sweep", "small.toml", "--precision", "7"]).contains("0.01%"));
    fs::write(here.join("file"), "x").expect("written");
    assert!(refusal(here, &["sweep", "small.toml", "--out", "file"]).contains("cannot write results there"));
}

/// Rows of the sweep's third point and seventh trial, which is `found ± sigma`.
#[cfg(feature = "parquet")]
fn the_rows_of_the_trial_say(here: &Path, found: f64, sigma: f64) {
    succeed(here, &["sweep", "small.toml", "--rows", "--out", "rows"]);
    let file = fs::File::open(here.join("rows/trials.parquet")).expect("rows");
    let rows = SerializedFileReader::new(file).expect("a Parquet file").into_iter();
    let rows = rows.map(|row| row.expect("a row").get_column_iter().map(|(k, v)| (k.clone(), v.clone())).collect());
    let rows: Vec<BTreeMap<String, Field>> = rows.collect();
    // Four points, twenty trials, two methods, three parameters.
    assert_eq!(rows.len(), 4 * 20 * 2 * 3);
    let text = |text: &str| Field::Str(text.to_owned());
    let the_row = |row: &&BTreeMap<String, Field>| {
        (row["point"] == Field::Long(3) && row["trial"] == Field::Long(7))
            && (row["method"] == text("direct") && row["parameter"] == text("wheel_separation_m"))
    };
    let row = rows.iter().find(the_row).expect("the trial's row");
    for (column, value) in
        [("estimate", found), ("sigma", sigma), ("truth", 0.363), ("instrument.floor_grid.reading_sigma_m", 0.001)]
    {
        assert_eq!(row[column], Field::Double(value), "{column}");
    }
}

/// A trial of a sweep is a dataset that can be looked into: what the rows say of it is what a method finds in
/// it.
#[test]
fn a_trial_of_a_sweep_can_be_looked_into() {
    let temporary = tempfile::tempdir().expect("a folder");
    let here = temporary.path();
    write_scenario(here, 20);
    succeed(here, &["simulate", "small.toml", "--point", "3", "--trial", "7", "--method", "direct", "--out", "trial"]);
    let found = document(here, &["calibrate", "trial", "--method", "direct"]);
    let found = found["methods"][0]["parameters"]["wheel_separation_m"]["value"].as_f64().expect("a number");
    let scenario = Scenario::read(&here.join("small.toml")).expect("as written");
    let plan = SweepPlan::new(&scenario, SweepOptions::default()).expect("a sweep");
    let mut trial = bench::Trial::new(&plan.points()[2].scenario, plan.seed()).expect("simulates").at_point(2);
    let session = [trial.drive(7).expect("drives")];
    let expected = calib::method("direct").expect("there").calibrate(&session).expect("applies");
    // Written with all digits and read again: the same.
    assert_eq!(found, expected.geometry.wheel_separation_m());
    #[cfg(feature = "parquet")]
    {
        let sigma = expected.estimate(calib::Parameter::WheelSeparation).expect("has it").sigma.expect("of many spins");
        the_rows_of_the_trial_say(here, found, sigma);
    }
    #[cfg(not(feature = "parquet"))]
    {
        let message = refusal(here, &["sweep", "small.toml", "--rows", "--out", "rows"]);
        assert!(message.contains("--features parquet") && !here.join("rows").exists(), "{message}");
    }
    assert!(refusal(here, &["simulate", "small.toml", "--point", "5", "--out", "t"]).contains("1 to 4"));
    assert!(refusal(here, &["simulate", "small.toml", "--point", "0", "--out", "t"]).contains("1 to 4"));
    assert!(refusal(here, &["simulate", "small.toml", "--method", "x", "--out", "t"]).contains("umbmark"));
}

/// A device that is always full stands where the estimates of the trials would go.
#[cfg(all(target_os = "linux", feature = "parquet"))]
#[test]
fn a_full_disk_is_a_clear_error() {
    let temporary = tempfile::tempdir().expect("a folder");
    let here = temporary.path();
    write_scenario(here, 4000);
    fs::create_dir(here.join("full")).expect("a folder");
    std::os::unix::fs::symlink("/dev/full", here.join("full/sweep.trials.spool")).expect("a link");
    let message = refusal(here, &["sweep", "small.toml", "--rows", "--out", "full"]);
    assert!(message.contains("No space left on device") && message.contains("full/sweep.trials.spool"), "{message}");
}
