//! Memory of large and of hopeless files. A program with one test, as the peak is the process's;
//! `benches/dataset.rs` measures the time.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;

use dataset::{DatasetError, RunByRun, read};
use peak_alloc::PeakAlloc;

#[global_allocator]
static PEAK: PeakAlloc = PeakAlloc;

const ROWS: usize = 10_000_000;

/// A row of ticks: a time and two counts.
const ROW_BYTES: usize = 24;

/// What may stand beside the columns: buffers, the manifest, one set of vectors a run.
const BYTES_PER_ROW_LIMIT: usize = 32;

const GIGABYTE: u64 = 1 << 30;

fn write_manifest(dir: &Path, runs: usize) {
    let mut toml = "format = 1\n[robot]\nleft_wheel_diameter_m = 0.1\nright_wheel_diameter_m = 0.1\n\
         wheel_separation_m = 0.3\nticks_per_rev = 2000.0\n"
        .to_owned();
    let mut truth = "run,t_s,x_m,y_m,theta_rad\n".to_owned();
    for run in 0..runs {
        toml += &format!("[[run]]\nid = \"run-{run:05}\"\n");
        truth += &format!("run-{run:05},0,0,0,0\n");
    }
    fs::write(dir.join("dataset.toml"), toml).expect("written");
    fs::write(dir.join("truth.csv"), truth).expect("written");
}

/// Rows of 200 Hz in blocks of `block` rows a run, the runs in turns.
fn write_odometry(dir: &Path, rows: usize, runs: usize, block: usize) {
    let mut out = BufWriter::with_capacity(1 << 20, File::create(dir.join("odometry.csv")).expect("made"));
    writeln!(out, "run,t_s,left_ticks,right_ticks").expect("written");
    let mut row_of_run = vec![0_usize; runs];
    for row in 0..rows {
        let run = row / block % runs;
        let k = row_of_run[run];
        row_of_run[run] += 1;
        writeln!(out, "run-{run:05},{}.{:03},{},{}", k / 200, k % 200 * 5, 37 * k, 41 * k).expect("written");
    }
    out.flush().expect("written");
}

/// Reads, and gives the largest heap beyond what was held before, bytes.
fn peak_of_reading(dir: &Path) -> (Result<usize, DatasetError>, usize) {
    let before = PEAK.current_usage();
    PEAK.reset_peak_usage();
    let rows = read(dir).map(|loaded| loaded.dataset.runs.iter().map(|run| run.odometry.t_s.len()).sum());
    (rows, PEAK.peak_usage().saturating_sub(before))
}

#[test]
#[allow(clippy::print_stderr)]
fn columns_are_all_that_is_held_and_garbage_is_not_held_at_all() {
    for (rows, runs, block) in [(ROWS, 1, 1), (ROWS / 5, 1000, 500), (ROWS / 5, 1000, 1)] {
        let temp = tempfile::tempdir().expect("a temporary folder");
        write_manifest(temp.path(), runs);
        write_odometry(temp.path(), rows, runs, block);
        let (read_rows, peak_bytes) = peak_of_reading(temp.path());
        assert_eq!(read_rows.expect("readable"), rows);
        assert!(peak_bytes >= ROW_BYTES * rows, "the columns alone take more: the measurement is wrong");
        assert!(peak_bytes <= BYTES_PER_ROW_LIMIT * rows, "{} bytes a row", peak_bytes / rows);
    }

    // One run at a time: the columns of one, and half a megabyte of buffers.
    let temp = tempfile::tempdir().expect("a temporary folder");
    write_manifest(temp.path(), 100);
    write_odometry(temp.path(), ROWS / 5, 100, ROWS / 500);
    let before = PEAK.current_usage();
    PEAK.reset_peak_usage();
    let loaded = RunByRun::open(temp.path()).expect("readable").map(|loaded| loaded.expect("readable"));
    let rows: usize = loaded.map(|loaded| loaded.dataset.runs[0].odometry.t_s.len()).sum();
    let peak_bytes = PEAK.peak_usage().saturating_sub(before);
    assert_eq!(rows, ROWS / 5);
    assert!(peak_bytes < BYTES_PER_ROW_LIMIT * ROWS / 500 + (1 << 20), "{peak_bytes} bytes");

    for file in ["odometry.csv", "truth.csv", "dataset.toml"] {
        let temp = tempfile::tempdir().expect("a temporary folder");
        write_manifest(temp.path(), 1);
        write_odometry(temp.path(), 2, 1, 1);
        // A line without end: a sparse file, which takes no room on the disk.
        let endless = File::options().append(true).open(temp.path().join(file)).expect("opened");
        endless.set_len(GIGABYTE).expect("grown");
        let (read_rows, peak_bytes) = peak_of_reading(temp.path());
        let error = read_rows.expect_err("a gigabyte of nothing");
        assert!(peak_bytes < 1 << 20, "{file}: {peak_bytes} bytes: {error}");
        assert!(error.to_string().contains(file), "{error}");
    }
}
