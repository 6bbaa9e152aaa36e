//! Large logs: stretches of them are diagnosed, all rows are looked at, and the command says so.

use std::path::Path;

use dataset::{
    Blocks, Dataset, Existing, NominalRobot, Odometry, Provenance, Run, RunInfo, TruthNoise, TruthSample, WheelLog,
    write,
};
use diagnose::LargeLog;
use kinematics::{Increment, Pose, Wheels};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::support::document;

const RUNS: usize = 10;
/// Rows of a run, 100 a second.
const ROWS: usize = 100_000;
/// Rows for each measured pose.
const ROWS_PER_POSE: usize = 50;
const RAD_PER_COUNT: f64 = std::f64::consts::TAU / 4096.0;
const M_PER_RAD: f64 = 0.04;
const SEPARATION_M: f64 = 0.2;
/// The right wheel's eccentricity.
const ECCENTRICITY: f64 = 5e-3;

/// A robot whose right wheel is eccentric; other speeds every eight seconds.
fn run(seed: u64) -> Run {
    let mut chance = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut normal = move |sigma: f64| sigma * chance.sample::<f64, _>(StandardNormal);
    let mut speeds = Xoshiro256PlusPlus::seed_from_u64(1000 + seed);
    let (mut pose, mut speed, mut angle) = (Pose::IDENTITY, Wheels::both(0.0), Wheels::both(0.0));
    let mut odometry = Odometry { wheels: WheelLog::Ticks(Wheels::default()), ..Odometry::default() };
    let mut truth = Vec::new();
    for row in 0..ROWS {
        if row % 800 == 0 {
            speed = Wheels { left: speeds.random_range(2.0..8.0), right: speeds.random_range(2.0..8.0) };
        }
        let t_s = 0.01 * row as f64;
        odometry.t_s.push(t_s);
        if let WheelLog::Ticks(ticks) = &mut odometry.wheels {
            let counted = angle.map(|rad| (rad / RAD_PER_COUNT).round() as i64);
            ticks.left.push(counted.left);
            ticks.right.push(counted.right);
        }
        if row % ROWS_PER_POSE == 0 {
            let (x_m, y_m) = (pose.x_m + normal(1e-3), pose.y_m + normal(1e-3));
            truth.push(TruthSample::new(t_s, x_m, y_m, Some(pose.theta_rad + normal(1e-3))));
        }
        let turned = speed.map(|rad_s| 0.01 * rad_s);
        let phase_rad = angle.right + 0.5 * turned.right;
        let radius = Wheels { left: 1.0, right: 1.0 + ECCENTRICITY * phase_rad.cos() };
        let travel_m = turned.zip_with(radius, |rad, radius| M_PER_RAD * rad * radius);
        let travel_m = travel_m.map(|travel_m| travel_m + normal(3e-4 * travel_m.abs().sqrt()));
        pose = pose * Increment::from_travel(travel_m, SEPARATION_M).arc();
        angle = angle.zip_with(turned, |angle, turned| angle + turned);
    }
    Run { info: RunInfo { id: format!("run-{seed}"), ..RunInfo::default() }, odometry, truth, ..Run::default() }
}

fn large() -> Dataset {
    Dataset {
        provenance: Provenance { name: Some("large".to_owned()), ..Provenance::default() },
        robot: NominalRobot {
            left_wheel_diameter_m: 2.0 * M_PER_RAD,
            right_wheel_diameter_m: 2.0 * M_PER_RAD,
            wheel_separation_m: SEPARATION_M,
            ticks_per_rev: Some(4096.0),
            counter_bits: None,
        },
        truth_noise: TruthNoise::default(),
        points: Vec::new(),
        runs: (0..RUNS as u64).map(run).collect(),
    }
}

/// Tears some counts of a run, a hundred rows apart.
fn tear(run: &mut Run, first: usize) {
    let WheelLog::Ticks(ticks) = &mut run.odometry.wheels else { panic!("counts") };
    (0..6).for_each(|tear| ticks.left[first + 100 * tear] += 256);
}

fn read(dir: &Path) -> LargeLog {
    LargeLog::read(&mut [Blocks::open(dir).expect("readable").expect("runs stand together")]).expect("readable")
}

/// Where a stretch begins: its run and the first row.
fn place(run: &Run) -> (usize, usize) {
    let number = run.info.id.trim_start_matches("run-").split(' ').next().expect("a number");
    (number.parse().expect("a number"), (100.0 * run.odometry.t_s[0]).round() as usize)
}

#[test]
fn a_fault_of_rows_is_found_where_it_is_and_the_effect_of_all_rows_beside_it() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let mut dataset = large();
    write(&dataset, &temp.path().join("sound"), Existing::Refuse).expect("written");
    let sound = read(&temp.path().join("sound"));
    let of = sound.subsample();
    assert_eq!((of.rows, of.measurements), (RUNS * ROWS, RUNS * ROWS / ROWS_PER_POSE));
    assert!(of.row_faults.is_empty() && of.diagnosed_rows <= 1 << 19 && of.diagnosed_rows > 1 << 18, "{of:?}");
    let taken: Vec<&Run> = sound.datasets()[0].runs.iter().collect();
    assert_eq!(taken.len(), of.diagnosed_stretches);
    // Every run has its share, and says how far the robot had driven before: as far as the rows say that were
    // left out.
    for number in 0..RUNS {
        assert!(taken.iter().any(|run| place(run).0 == number), "run {number} is left out");
    }
    let rolled_m = |run: usize, rows: usize| {
        let mut part = dataset.session_of(|info| info.id == format!("run-{run}")).runs[0].run().clone();
        let WheelLog::Ticks(ticks) = &mut part.odometry.wheels else { panic!("counts") };
        [&mut ticks.left, &mut ticks.right].into_iter().for_each(|column| column.truncate(rows + 1));
        Dataset { runs: vec![part], ..dataset.header() }.session().runs[0].rolled_m(&dataset.robot)
    };
    let last = taken[taken.len() - 1];
    let (number, row) = place(last);
    let before_m = (0..number).map(|run| rolled_m(run, ROWS)).sum::<f64>() + rolled_m(number, row);
    assert!((last.session_m.expect("it says so") - before_m).abs() < 1e-6, "{:?} for {before_m}", last.session_m);
    assert!(before_m > 1000.0);

    // A fault in a stretch that is left out.
    let starts: Vec<(usize, usize)> = taken.iter().map(|run| place(run)).collect();
    let length = starts.iter().zip(&taken).map(|(_, run)| run.odometry.t_s.len()).max().expect("stretches");
    let is_taken =
        |run: usize, row: usize| starts.iter().any(|(of, first)| *of == run && (*first..first + length).contains(&row));
    let is_left_out = |run: usize, row: usize| [row, row + 1024].iter().all(|row| !is_taken(run, *row));
    let mut places = (0..RUNS).flat_map(|run| (1024..ROWS - 2048).step_by(512).map(move |row| (run, row)));
    let (of, first) = places.find(|(run, row)| is_left_out(*run, *row)).expect("a stretch that is left out");
    tear(&mut dataset.runs[of], first);
    write(&dataset, &temp.path().join("torn"), Existing::Refuse).expect("written");
    let torn = document(temp.path(), &["diagnose", "torn"]);
    let said = &torn["subsample"];
    assert_eq!(said["row_faults"][0]["id"], "torn_read");
    assert_eq!(said["row_faults"][0]["diagnosed_stretches"], said["row_faults"][0]["stretches"]);
    let more = said["diagnosed_stretches"].as_u64().expect("a number") - sound.subsample().diagnosed_stretches as u64;
    assert!(more == 1 || more == 2, "{more}");
    assert!(said["sentence"].as_str().expect("a text").contains("torn_read"));
    let names: Vec<&str> =
        torn["findings"].as_array().expect("a list").iter().filter_map(|of| of["id"].as_str()).collect();
    assert_eq!(names, ["torn_read", "wheel_eccentricity"]);
    let size = &torn["findings"][1]["parameters"];
    let amplitude = size["right_cos"]["value"].as_f64().expect("a value");
    let sigma = size["right_cos"]["sigma"].as_f64().expect("a value");
    assert!((amplitude - ECCENTRICITY).abs() < 4.0 * sigma && sigma < 0.1 * ECCENTRICITY, "{amplitude} ± {sigma}");
}
