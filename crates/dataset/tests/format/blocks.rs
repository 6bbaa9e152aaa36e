//! Runs read in parts are the runs read whole, in any order, and no fault hides between two parts.

use std::path::Path;

use dataset::{
    Blocks, Dataset, DatasetError, Displacement, Existing, NominalRobot, Odometry, Provenance, Run, RunInfo,
    TruthNoise, TruthSample, WheelLog, read, write,
};
use kinematics::Wheels;

fn run(id: &str, rows: usize, measurements: usize) -> Run {
    let times = |rows: usize, step_s: f64| (0..rows).map(move |row| row as f64 * step_s);
    let counts = |by: i64| (0..i64::try_from(rows).expect("small")).map(move |row| row * by).collect();
    let odometry = Odometry {
        t_s: times(rows, 0.01).collect(),
        wheels: WheelLog::Ticks(Wheels { left: counts(7), right: counts(-9) }),
        ..Odometry::default()
    };
    // Measurements from before the log until after it.
    let truth =
        times(measurements, 0.0137).map(|t_s| TruthSample::new(t_s - 1.0, t_s, -t_s, Some(0.5 * t_s))).collect();
    Run { info: RunInfo { id: id.to_owned(), ..RunInfo::default() }, odometry, truth, ..Run::default() }
}

fn dataset() -> Dataset {
    let mut moved = run("moved", 3000, 0);
    moved.displacements = vec![Displacement { t0_s: 0.0, t1_s: 29.0, dx_m: 1.0, dy_m: 0.0, dtheta_rad: 0.1 }];
    Dataset {
        provenance: Provenance::default(),
        robot: NominalRobot {
            left_wheel_diameter_m: 0.1,
            right_wheel_diameter_m: 0.1,
            wheel_separation_m: 0.3,
            ticks_per_rev: Some(1000.0),
            counter_bits: None,
        },
        truth_noise: TruthNoise::default(),
        points: Vec::new(),
        runs: vec![run("long", 5000, 4000), run("short", 700, 600), moved, run("even", 2049, 1700)],
    }
}

fn written(dir: &Path) -> Dataset {
    write(&dataset(), dir, Existing::Refuse).expect("written");
    read(dir).expect("readable").dataset
}

#[test]
fn parts_of_runs_are_slices_of_the_whole_in_any_order() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let whole = written(&temp.path().join("set"));
    let mut blocks = Blocks::open(&temp.path().join("set")).expect("readable").expect("runs stand together");
    assert_eq!(blocks.header(), &whole.header());
    assert_eq!((0..4).map(|run| blocks.blocks(run)).collect::<Vec<_>>(), [5, 1, 1, 2]);
    assert_eq!((0..4).map(|run| blocks.rows(run)).collect::<Vec<_>>(), [5000, 700, 3000, 2049]);
    assert_eq!((0..4).map(|run| blocks.seen_rows(run)).collect::<Vec<_>>(), [4000, 600, 1, 1700]);
    for (number, of) in
        [(3, 1..2), (0, 0..2), (2, 0..1), (0, 2..5), (0, 1..3), (1, 0..1), (0, 4..5), (3, 0..1), (0, 0..5)]
    {
        let part = blocks.read(number, of.clone()).expect("readable").dataset;
        let (part, run) = (&part.runs[0], &whole.runs[number]);
        let all = of == (0..blocks.blocks(number));
        let rows = of.start * Blocks::ROWS..(of.end * Blocks::ROWS + 1).min(run.odometry.t_s.len());
        let rows = if all { 0..run.odometry.t_s.len() } else { rows };
        assert_eq!(part.info, run.info);
        assert_eq!(*part.odometry.t_s, run.odometry.t_s[rows.clone()]);
        let (WheelLog::Ticks(found), WheelLog::Ticks(ticks)) = (&part.odometry.wheels, &run.odometry.wheels) else {
            panic!("ticks were written");
        };
        assert_eq!(found.right, ticks.right[rows.clone()]);
        let from_s = if of.start == 0 { f64::NEG_INFINITY } else { run.odometry.t_s[rows.start] };
        let to_s = if rows.end == run.odometry.t_s.len() { f64::INFINITY } else { run.odometry.t_s[rows.end - 1] };
        let seen: Vec<_> = run
            .truth
            .iter()
            .filter(|measurement| measurement.t_s >= from_s && measurement.t_s <= to_s)
            .copied()
            .collect();
        assert_eq!(part.truth, seen, "run {number}, blocks {of:?}");
        assert_eq!(part.displacements, run.displacements);
    }
}

/// The file's line with that number, from 1, becomes another.
fn with_line(file: &Path, number: usize, change: impl Fn(&str) -> String) {
    let text = std::fs::read_to_string(file).expect("readable");
    let lines: Vec<String> = text
        .lines()
        .enumerate()
        .map(|(at, line)| if at + 1 == number { change(line) } else { line.to_owned() })
        .collect();
    std::fs::write(file, lines.join("\n")).expect("written");
}

#[test]
fn a_measurement_out_of_order_is_found_wherever_it_stands() {
    // Around the marks, which are every 1024 rows, and around the cuts.
    for row in [1, 700, 1023, 1024, 1025, 1500, 2047, 2048, 2049, 3998] {
        let temp = tempfile::tempdir().expect("a temporary folder");
        let dir = temp.path().join("set");
        written(&dir);
        // Line 1 is the header, and rows count from 0. A time long past.
        with_line(&dir.join("truth.csv"), row + 2, |line| {
            let mut fields: Vec<&str> = line.split(',').collect();
            fields[1] = "-5";
            fields.join(",")
        });
        let failed = (|| {
            let mut blocks = Blocks::open(&dir)?.expect("runs stand together");
            (0..5).try_for_each(|block| blocks.read(0, block..block + 1).map(drop))
        })();
        let Err(DatasetError::TimeRunsBackwards { line, .. }) = failed else { panic!("row {row}: {failed:?}") };
        assert_eq!(line, row as u64 + 2);
    }
}

#[test]
fn tables_that_mix_runs_have_no_blocks() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let dir = temp.path().join("set");
    written(&dir);
    let text = std::fs::read_to_string(dir.join("truth.csv")).expect("readable");
    let (head, tail) = text.split_once('\n').expect("a header");
    let (first, rest) = tail.split_once('\n').expect("rows");
    std::fs::write(dir.join("truth.csv"), format!("{head}\n{}\n{first}", rest.trim_end())).expect("written");
    assert!(Blocks::open(&dir).expect("readable").is_none());
}
