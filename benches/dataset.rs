//! A large dataset imported, evaluated and calibrated, beside the time that reading and parsing it takes, and
//! the memory of each.
//!
//! The source is made first: a session in `OptiOdom`'s format of runs of 100 000 rows, the robot turning
//! elsewhere every ten seconds. Argument: its size in megabytes (100 where none is given). With `--whole`,
//! also calibrated with all runs held and fitted as a whole; with `--lasting`, the instrument's errors last
//! for seconds, as those of real ones do, and measurements are thinned. With `--growth`, diagnosed instead,
//! at a hundredth of its size and more, and in runs of other lengths: the cost against rows and
//! runs. `docs/performance.md` has a run of each.

use std::f64::consts::PI;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::time::Instant;

use calib::methods::joint::Joint;
use dataset::{Blocks, Existing, RunByRun, Writer, import, read_ahead};
use diagnose::{LargeLog, Options, diagnose};
use estimation::{is_large, many_rows};
use peak_alloc::PeakAlloc;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;

#[global_allocator]
static PEAK: PeakAlloc = PeakAlloc;

/// Rows of a run.
const ROWS: usize = 100_000;

/// Standard deviation of the instrument's errors, metres and radians.
const SIGMA: f64 = 1.7e-4;

/// How long the instrument's errors last with `--lasting`, seconds.
const LASTING_S: f64 = 2.0;

/// Sizes, each a share of the given one, and the rows of their runs.
const GROWTH: [(usize, usize); 7] =
    [(100, ROWS / 10), (30, ROWS), (10, ROWS), (3, ROWS), (1, ROWS), (10, ROWS / 10), (10, ROWS / 100)];

/// Counts a turn of the wheel, and the robot: metres a count of each wheel and the wheels' distance.
const COUNTS_PER_TURN: f64 = 43.7 * 64.0;
const M_PER_COUNT: [f64; 2] = [PI * 0.0848 / COUNTS_PER_TURN, PI * 0.0853 / COUNTS_PER_TURN];
const SEPARATION_M: f64 = 0.2065;

/// Writes a session of so many megabytes; gives its runs.
fn write_session(dir: &Path, megabytes: usize, rows: usize, lasts: f64) -> std::io::Result<usize> {
    let (mut runs, mut bytes) = (0, 0);
    while bytes < megabytes * 1_000_000 {
        runs += 1;
        let file = dir.join(format!("large_run-{runs:03}.csv"));
        write_run(&file, runs as u64, rows, lasts)?;
        bytes += usize::try_from(file.metadata()?.len()).unwrap_or(usize::MAX);
    }
    let metadata = format!("type,diff\nngear,43.7\nencRes,64\nLi,0.205\nDi,0.085,0.085\nN,{runs}\nL,\n");
    std::fs::write(dir.join("large_metadata.csv"), metadata)?;
    Ok(runs)
}

/// The instrument's error in a row is this share of the one before, and something new.
fn write_run(file: &Path, seed: u64, rows: usize, lasts: f64) -> std::io::Result<()> {
    let mut generator = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut out = BufWriter::with_capacity(1 << 16, File::create(file)?);
    let (mut pose, mut speed, mut counts, mut off) = ([0.0_f64; 3], [0.0; 2], [0.0_f64; 2], [0.0; 3]);
    for row in 0..rows {
        if row % 200 == 0 {
            speed = [0; 2].map(|_| generator.random_range(20.0..90.0));
        }
        let [left, right] = counts.map(f64::trunc);
        for off in &mut off {
            *off = lasts * *off + (1.0 - lasts * lasts).sqrt() * SIGMA * generator.sample::<f64, _>(StandardNormal);
        }
        let seen: [f64; 3] = std::array::from_fn(|k| pose[k] + off[k]);
        writeln!(out, "{},{},{},{},{right},{left}", 0.05 * row as f64, seen[0], seen[1], seen[2])?;
        let turned = speed.map(|speed: f64| speed + generator.random_range(-1.0..1.0));
        let [left_m, right_m] = [turned[0] * M_PER_COUNT[0], turned[1] * M_PER_COUNT[1]];
        let (distance_m, half_rad) = (0.5 * (left_m + right_m), 0.5 * (right_m - left_m) / SEPARATION_M);
        // The chord of the arc.
        let distance_m = distance_m * if half_rad == 0.0 { 1.0 } else { half_rad.sin() / half_rad };
        let (sin, cos) = (pose[2] + half_rad).sin_cos();
        pose = [pose[0] + distance_m * cos, pose[1] + distance_m * sin, pose[2] + 2.0 * half_rad];
        // What is not a whole count is counted later.
        counts = [counts[0].fract() + turned[0], counts[1].fract() + turned[1]];
    }
    out.flush()
}

/// Seconds and megabytes of heap that something takes.
fn measured<T>(what: impl FnOnce() -> T) -> (f64, f64) {
    PEAK.reset_peak_usage();
    let before = PEAK.current_usage();
    let started = Instant::now();
    drop(what());
    (started.elapsed().as_secs_f64(), PEAK.peak_usage().saturating_sub(before) as f64 / 1e6)
}

/// Seconds of processor time that this program has taken, to a hundredth; NaN where the system does not say.
fn processor_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    let ticks = |at: usize| fields.get(at).and_then(|field| field.parse::<f64>().ok()).unwrap_or(f64::NAN);
    (ticks(11) + ticks(12)) / 100.0
}

/// Imports a session of so many megabytes in runs of so many rows, and prints what its diagnosis costs: the
/// reading of all rows, and the diagnosis of what is taken of them.
#[allow(clippy::print_stdout)]
fn diagnosed(megabytes: usize, rows: usize, lasts: f64) {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let (source, set) = (temp.path().join("large"), temp.path().join("set"));
    std::fs::create_dir(&source).expect("made");
    let runs = write_session(&source, megabytes, rows, lasts).expect("written");
    let session = (import::importer("optiodom").expect("there").open)(&source).expect("a session").remove(0);
    let mut writer = Writer::create(session.header, &set, Existing::Refuse).expect("begun");
    read_ahead(session.runs, |loaded| writer.push(&loaded?.dataset.runs[0])).expect("written");
    writer.finish().expect("written");
    let started_s = processor_s();
    let mut taken = 0;
    let mut read_s = 0.0;
    let (seconds, heap) = measured(|| {
        let mut blocks = [Blocks::open(&set).expect("readable").expect("runs stand together")];
        if many_rows(&blocks) {
            let log = LargeLog::read(&mut blocks).expect("readable");
            (taken, read_s) = (log.subsample().diagnosed_rows, processor_s() - started_s);
            drop(diagnose(&log, &Options::default()).expect("diagnosed"));
        } else {
            let dataset = dataset::read(&set).expect("readable").dataset;
            (taken, read_s) = (runs * rows, processor_s() - started_s);
            drop(diagnose(&[dataset], &Options::default()).expect("diagnosed"));
        }
    });
    let all_s = processor_s() - started_s;
    println!(
        "{megabytes:>6} {:>10} {runs:>7} {taken:>10} {seconds:>7.1} {all_s:>12.1} {read_s:>12.1} {heap:>8.1}",
        runs * rows
    );
}

#[allow(clippy::print_stdout)]
fn main() {
    let megabytes = std::env::args().find_map(|argument| argument.parse().ok()).unwrap_or(100);
    let given = |option: &str| std::env::args().any(|argument| argument == option);
    let lasts = if given("--lasting") { f64::exp(-0.05 / LASTING_S) } else { 0.0 };
    if given("--growth") {
        println!(
            "{:>6} {:>10} {:>7} {:>10} {:>7} {:>12} {:>12} {:>8}",
            "MB", "rows", "runs", "diagnosed", "s", "processor s", "of it read", "heap MB"
        );
        for (share, rows) in GROWTH {
            diagnosed((megabytes / share).max(1), rows, lasts);
        }
        return;
    }
    let temp = tempfile::tempdir().expect("a temporary folder");
    let (source, set) = (temp.path().join("large"), temp.path().join("set"));
    std::fs::create_dir(&source).expect("made");
    let runs = write_session(&source, megabytes, ROWS, lasts).expect("written");
    println!("{megabytes} MB, {runs} runs, {} rows", runs * ROWS);
    println!("{:<28} {:>7} {:>9} {:>8}", "", "s", "x parsing", "heap MB");
    let show = |what: &str, (seconds, megabytes): (f64, f64), parsing_s: f64| {
        println!("{what:<28} {seconds:>7.2} {:>9.2} {megabytes:>8.1}", seconds / parsing_s);
    };

    let open = || (import::importer("optiodom").expect("there").open)(&source).expect("a session").remove(0);
    let parse = measured(|| open().runs.for_each(|loaded| drop(loaded.expect("readable"))));
    show("source parsed", parse, parse.0);
    let imported = measured(|| {
        let session = open();
        let mut writer = Writer::create(session.header, &set, Existing::Refuse).expect("begun");
        read_ahead(session.runs, |loaded| writer.push(&loaded?.dataset.runs[0])).expect("written");
        writer.finish().expect("written");
    });
    show("imported", imported, parse.0);

    let parse = measured(|| RunByRun::open(&set).expect("readable").for_each(|loaded| drop(loaded.expect("readable"))));
    show("dataset parsed", parse, parse.0);
    let evaluated = measured(|| {
        let runs = RunByRun::open(&set).expect("readable").flat_map(|loaded| {
            let dataset = loaded.expect("readable").dataset;
            calib::evaluate(&[dataset.session()], None, false).runs
        });
        calib::CalibrationDrift::of_runs(None, runs.collect())
    });
    show("evaluated", evaluated, parse.0);
    let calibrated = measured(|| {
        let mut blocks = [Blocks::open(&set).expect("readable").expect("runs stand together")];
        assert!(is_large(&blocks), "this session is small: make it larger");
        Joint::DEFAULT.calibrate_large(&mut blocks, |_, _| ()).expect("calibrated")
    });
    show("calibrated by joint", calibrated, parse.0);
    // What holds all runs.
    let methods = if given("--whole") { &["linear", "joint"][..] } else { &[] };
    for name in methods {
        let method = calib::method(name).expect("there");
        let calibrated = measured(|| {
            let dataset = dataset::read(&set).expect("readable").dataset;
            method.calibrate(&[dataset.session()]).map_err(|error| println!("{name}: {error}"))
        });
        show(&format!("by {name}, as a whole"), calibrated, parse.0);
    }
}
