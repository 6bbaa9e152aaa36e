//! What a calibration and a diagnosis may not depend on: where a run starts, the room's frame, the order of
//! the runs, when it was, the units of a table; and what must scale with lengths and times.

use yair::calib::{Calibration, method};
use yair::dataset::import::csv::{Options, RobotGiven};
use yair::dataset::{Dataset, Run, TruthSample, WheelLog};
use yair::kinematics::{Pose, Wheels};
use yair::scenario::Scenario;

/// Standard deviations by which estimates of the same data may differ: the fit stops when a step is shorter
/// than a hundredth, and does so from two sides. The room's frame as a part of the estimate was seen to miss
/// by 30.
const SAME: f64 = 0.02;

/// A simulated robot under motion capture: straights, spins, squares and circles.
fn measured(runs: usize) -> Dataset {
    let text = include_str!("../../scenarios/motion-capture.toml");
    let scenario = Scenario::parse(text, "motion-capture.toml").expect("a scenario");
    let mut dataset = sim_yair::simulate(&scenario, 11, 0).expect("simulated").dataset;
    // Some of each kind of path.
    let every = dataset.runs.len().div_ceil(runs);
    dataset.runs = dataset.runs.into_iter().step_by(every).collect();
    dataset
}

fn joint(dataset: &Dataset) -> Calibration {
    method("joint").expect("a method").calibrate(&[dataset.session()]).expect("calibrated")
}

/// That lengths are those of `base` times `factor`, in standard deviations.
#[track_caller]
fn same(base: &Calibration, other: &Calibration, factor: f64) {
    for (one, two) in base.estimates().zip(other.estimates()).take(3) {
        let sigma = one.sigma.expect("a scatter");
        let apart = (two.value / factor - one.value).abs() / sigma;
        assert!(apart < SAME, "{:?}: {} and {}, {apart:.4} sigma", one.parameter, one.value, two.value / factor);
        let ratio = two.sigma.expect("a scatter") / factor / sigma;
        assert!((ratio - 1.0).abs() < SAME, "{:?}: its sigma is {ratio:.4} times as large", one.parameter);
    }
}

/// Every pose of a run, changed.
fn with_poses(dataset: &Dataset, change: impl Fn(usize, Pose) -> Pose) -> Dataset {
    let mut all = dataset.clone();
    for (number, run) in all.runs.iter_mut().enumerate() {
        for sample in &mut run.truth {
            let theta_rad = sample.theta_rad();
            let old = Pose { x_m: sample.x_m, y_m: sample.y_m, theta_rad: theta_rad.unwrap_or(0.0) };
            let new = change(number, old);
            *sample = TruthSample::new(sample.t_s, new.x_m, new.y_m, theta_rad.map(|_| new.theta_rad));
        }
    }
    all
}

/// A pose in a frame that is turned and moved.
fn moved(pose: Pose, turn_rad: f64, x_m: f64, y_m: f64) -> Pose {
    Pose { x_m, y_m, theta_rad: turn_rad } * pose
}

#[test]
fn a_calibration_does_not_depend_on_frame_start_order_and_clock() {
    let dataset = measured(9);
    let base = joint(&dataset);
    same(&base, &joint(&with_poses(&dataset, |_, pose| moved(pose, 2.1, -30.0, 12.0))), 1.0);
    // Each run in a room of its own: it starts anywhere.
    let apart = with_poses(&dataset, |run, pose| moved(pose, 0.7 * run as f64, 3.0 * run as f64, -5.0));
    same(&base, &joint(&apart), 1.0);
    let mut reversed = dataset.clone();
    reversed.runs.reverse();
    same(&base, &joint(&reversed), 1.0);
    same(&base, &joint(&in_time(&dataset, 1.0, 4096.0)), 1.0);
}

/// The same runs with other times.
fn in_time(dataset: &Dataset, factor: f64, shift_s: f64) -> Dataset {
    let mut all = dataset.clone();
    for run in &mut all.runs {
        let Run { odometry, truth, .. } = run;
        odometry.t_s.iter_mut().for_each(|t_s| *t_s = factor * *t_s + shift_s);
        truth.iter_mut().for_each(|sample| sample.t_s = factor * sample.t_s + shift_s);
    }
    all
}

#[test]
fn lengths_scale_with_lengths_and_not_with_times() {
    let dataset = measured(9);
    let base = joint(&dataset);
    same(&base, &joint(&twice_as_large(&dataset)), 2.0);
    same(&base, &joint(&in_time(&dataset, 2.0, 0.0)), 1.0);
}

/// The same runs of a robot twice as large in a room twice as large.
fn twice_as_large(dataset: &Dataset) -> Dataset {
    let mut larger = with_poses(dataset, |_, pose| Pose { x_m: 2.0 * pose.x_m, y_m: 2.0 * pose.y_m, ..pose });
    larger.robot.left_wheel_diameter_m *= 2.0;
    larger.robot.right_wheel_diameter_m *= 2.0;
    larger.robot.wheel_separation_m *= 2.0;
    larger.truth_noise.sigma_xy_m = larger.truth_noise.sigma_xy_m.map(|sigma_m| 2.0 * sigma_m);
    larger
}

fn diagnosed(dataset: Dataset) -> Vec<diagnose::Finding> {
    diagnose::diagnose(&[dataset], &diagnose::Options::default()).expect("diagnosed").document.findings
}

/// That two diagnoses name the same causes, with the same sizes in standard deviations: of lengths `factor`
/// times as large.
#[track_caller]
fn same_findings(base: &[diagnose::Finding], other: &[diagnose::Finding], factor: f64) {
    let names = |all: &[diagnose::Finding]| {
        all.iter().map(|finding| (finding.id.clone(), finding.names.clone())).collect::<Vec<_>>()
    };
    assert!(!base.is_empty(), "nothing was found");
    assert_eq!(names(base), names(other));
    for (one, two) in base.iter().zip(other) {
        for (name, value) in &one.parameters {
            let factor = if value.unit == "m" { factor } else { 1.0 };
            let (sigma, scaled) = (value.sigma.expect("a scatter"), two.parameters[name].value / factor);
            assert!((scaled - value.value).abs() < SAME * sigma, "{}: {name} is {} and {scaled}", one.id, value.value);
        }
    }
}

/// The eccentric wheel of the scenario has no size in metres or seconds.
#[test]
fn a_diagnosis_scales_with_lengths_and_times() {
    let dataset = measured(6);
    let base = diagnosed(dataset.clone());
    same_findings(&base, &diagnosed(twice_as_large(&dataset)), 2.0);
    same_findings(&base, &diagnosed(in_time(&dataset, 2.0, 0.0)), 1.0);
}

#[test]
fn a_diagnosis_does_not_depend_on_frame_and_order() {
    let dataset = measured(6);
    let mut turned = with_poses(&dataset, |_, pose| moved(pose, -1.3, 8.0, 20.0));
    turned.runs.reverse();
    same_findings(&diagnosed(dataset), &diagnosed(turned), 1.0);
}

/// Rows of a table as they are imported: a run, instants, poses and counts, with empty cells where a row has
/// none; `scale` multiplies time, places and headings.
fn imported(name: &str, header: &str, scale: [f64; 3], dataset: &Dataset) -> Dataset {
    let mut table = format!("{header}\n");
    for run in &dataset.runs {
        let WheelLog::Ticks(ticks) = &run.odometry.wheels else { panic!("the simulated robot counts") };
        let counts = run.odometry.t_s.iter().zip(ticks.left.iter().zip(&ticks.right));
        let counted = counts.map(|(t_s, (left, right))| (*t_s, format!(",,,{left},{right}")));
        let seen = run.truth.iter().map(|sample| {
            let [_, length, angle] = scale;
            let theta = sample.theta_rad().map_or(String::new(), |theta_rad| (theta_rad * angle).to_string());
            (sample.t_s, format!("{},{},{theta},,", sample.x_m * length, sample.y_m * length))
        });
        let mut rows: Vec<(f64, String)> = counted.chain(seen).collect();
        rows.sort_by(|one, two| one.0.total_cmp(&two.0));
        for (t_s, cells) in rows {
            table += &format!("{},{},{cells}\n", run.info.id, t_s * scale[0]);
        }
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join(name);
    std::fs::write(&file, table).expect("written");
    let robot = &dataset.robot;
    let robot = RobotGiven {
        wheel_diameter_m: Some(Wheels { left: robot.left_wheel_diameter_m, right: robot.right_wheel_diameter_m }),
        wheel_separation_m: Some(robot.wheel_separation_m),
        ticks_per_rev: robot.ticks_per_rev,
        counter_bits: None,
    };
    let options = Options { robot, ..Options::default() };
    dataset::import::csv::read(&[file], &options).expect("imported").imported.dataset
}

#[test]
fn a_diagnosis_does_not_depend_on_the_units_of_a_table() {
    let dataset = measured(6);
    let si = imported("si.csv", "run,t_s,x_m,y_m,theta_rad,left_ticks,right_ticks", [1.0; 3], &dataset);
    let degrees = 180.0 / std::f64::consts::PI;
    let header = "run,t_ms,x_mm,y_mm,theta_deg,left_ticks,right_ticks";
    let other = imported("other.csv", header, [1e3, 1e3, degrees], &dataset);
    assert_eq!(si.runs.len(), dataset.runs.len());
    same_findings(&diagnosed(si), &diagnosed(other), 1.0);
}

#[test]
fn a_table_in_other_units_is_the_same_log() {
    let rows: Vec<[f64; 4]> = (0..60)
        .map(|row| {
            let (s_m, turn_rad) = (0.05 * f64::from(row), 0.02 * f64::from(row));
            [0.1 * f64::from(row), s_m, 0.3 * s_m, turn_rad]
        })
        .collect();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let read = |name: &str, header: &str, scale: [f64; 4]| {
        let line = |row: &[f64; 4]| {
            let cells: Vec<String> = row.iter().zip(scale).map(|(value, scale)| format!("{}", value * scale)).collect();
            let count = (1e4 * row[1]).round();
            format!("{},{count},{count}\n", cells.join(","))
        };
        let file = folder.path().join(name);
        std::fs::write(&file, header.to_owned() + &rows.iter().map(line).collect::<String>()).expect("written");
        let robot = RobotGiven {
            wheel_diameter_m: Some(Wheels::both(0.15)),
            wheel_separation_m: Some(0.3),
            ticks_per_rev: Some(4096.0),
            counter_bits: None,
        };
        let options = Options { robot, ..Options::default() };
        dataset::import::csv::read(&[file], &options).expect("imported").imported.dataset
    };
    let si = read("si.csv", "t_s,x_m,y_m,theta_rad,left_ticks,right_ticks\n", [1.0; 4]);
    let degrees = 180.0 / std::f64::consts::PI;
    let other = read("other.csv", "t_ms,x_mm,y_mm,theta_deg,left_ticks,right_ticks\n", [1e3, 1e3, 1e3, degrees]);
    let (one, two) = (&si.runs[0], &other.runs[0]);
    assert_eq!((&one.odometry.wheels, one.truth.len()), (&two.odometry.wheels, two.truth.len()));
    // Two roundings of a double and one of the printed digits.
    let near = |a: f64, b: f64| (a - b).abs() <= 4.0 * f64::EPSILON * a.abs().max(1e-3);
    for (one, two) in one.truth.iter().zip(&two.truth) {
        assert!(near(one.t_s, two.t_s) && near(one.x_m, two.x_m) && near(one.y_m, two.y_m), "{one:?} {two:?}");
        assert!(near(one.theta_rad().expect("seen"), two.theta_rad().expect("seen")), "{one:?} {two:?}");
    }
}
