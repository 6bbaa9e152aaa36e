//! One good log, and the ways to spoil it: `calibrate` gives the right numbers or says what is wrong, and the
//! key that `check` names mends it.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;
use serde_json::Value;

use crate::support::{document, run_in};

/// Diameters and separation as they are, millimetres.
const TRUE_MM: [f64; 3] = [153.0, 152.7, 309.0];

/// What a calibration of the good log may be off by, millimetres: five standard deviations of the fit's
/// (1.2, 1.2 and 2.6 µm), and 0.02 mm for latencies and outliers that are estimated with them.
const TOLERANCE_MM: f64 = 0.03;

/// A row of the log and one of the instrument.
#[derive(Clone)]
struct Log {
    robot_m: [f64; 3],
    ticks_per_rev: f64,
    runs: Vec<(String, &'static str)>,
    /// Run, time, left and right.
    odometry: Vec<(usize, f64, [f64; 2])>,
    /// Run, time, x, y, heading.
    truth: Vec<(usize, f64, [f64; 3])>,
    positions: bool,
}

/// Straights, spins and squares both ways, 0.4 m/s and 0.8 rad/s, at 50 Hz, seen at 10 Hz.
fn good(seed: u64) -> Log {
    driven(TRUE_MM.map(|mm| 1e-3 * mm), seed)
}

fn driven(true_m: [f64; 3], seed: u64) -> Log {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let straight = |length_m: f64| vec![(length_m.abs() / 0.4, 0.4 * length_m.signum(), 0.0)];
    let spin = |turn_rad: f64| vec![(turn_rad.abs() / 0.8, 0.0, 0.8 * turn_rad.signum())];
    let square = |sense: f64| {
        let side = [straight(1.5), vec![(0.3, 0.0, 0.0)], spin(sense * FRAC_PI_2), vec![(0.3, 0.0, 0.0)]].concat();
        [side.clone(), side.clone(), side.clone(), side].concat()
    };
    let mut paths = Vec::new();
    for sense in [1.0, -1.0, 1.0, -1.0] {
        paths.push(("straight", straight(2.0 * sense)));
        paths.push(("spin", spin(TAU * sense)));
    }
    for (name, sense) in [("square_ccw", 1.0), ("square_cw", -1.0)] {
        paths.push((name, square(sense)));
    }
    let mut log = Log {
        robot_m: [0.150, 0.150, 0.300],
        ticks_per_rev: 4096.0,
        runs: Vec::new(),
        odometry: Vec::new(),
        truth: Vec::new(),
        positions: false,
    };
    let step_s = 0.005;
    // First-order lag; each seed is a drive of its own.
    let lag_s = 0.1 + 1e-3 * seed as f64;
    for (run, (protocol, path)) in paths.into_iter().enumerate() {
        log.runs.push((format!("{run:02}_{protocol}"), protocol));
        let path = [vec![(0.4, 0.0, 0.0)], path, vec![(0.4, 0.0, 0.0)]].concat();
        let (mut v, mut omega) = (0.0, 0.0);
        let (mut pose, mut turns, mut count) = ([0.0, 0.0, 0.7 * run as f64], [0.0, 0.0], 0);
        for (length_s, speed, rate) in path {
            for _ in 0..(length_s / step_s).round() as usize {
                let t_s = step_s * f64::from(count);
                if count % 4 == 0 {
                    log.odometry.push((run, t_s, turns.map(|turn: f64| (turn / TAU * 4096.0).round())));
                }
                if count % 20 == 0 {
                    let mut noisy = |value: f64, sigma: f64| value + sigma * random.sample::<f64, _>(StandardNormal);
                    let seen = [noisy(pose[0], 5e-4), noisy(pose[1], 5e-4), noisy(pose[2], 1e-3)];
                    log.truth.push((run, t_s, seen));
                }
                count += 1;
                v += (speed - v) * step_s / lag_s;
                omega += (rate - omega) * step_s / lag_s;
                let middle_rad = pose[2] + 0.5 * omega * step_s;
                pose = [
                    pose[0] + v * step_s * middle_rad.cos(),
                    pose[1] + v * step_s * middle_rad.sin(),
                    pose[2] + omega * step_s,
                ];
                let half = 0.5 * omega * true_m[2];
                turns[0] += (v - half) * step_s / (0.5 * true_m[0]);
                turns[1] += (v + half) * step_s / (0.5 * true_m[1]);
            }
        }
    }
    log
}

impl Log {
    fn write(&self, dir: &Path, more: &str) {
        fs::create_dir_all(dir).expect("made");
        let [left, right, separation] = self.robot_m;
        let mut toml = format!(
            "format = 1\n{more}[robot]\nleft_wheel_diameter_m = {left}\nright_wheel_diameter_m = {right}\n\
             wheel_separation_m = {separation}\nticks_per_rev = {}\n",
            self.ticks_per_rev
        );
        for (id, protocol) in &self.runs {
            let _ = write!(toml, "[[run]]\nid = \"{id}\"\nprotocol = \"{protocol}\"\n");
        }
        let mut odometry = "run,t_s,left_ticks,right_ticks\n".to_owned();
        for (run, t_s, [left, right]) in &self.odometry {
            let _ = writeln!(odometry, "{},{t_s:.4},{left},{right}", self.runs[*run].0);
        }
        let mut truth = "run,t_s,x_m,y_m,theta_rad\n".to_owned();
        for (run, t_s, [x, y, theta]) in &self.truth {
            let theta = if self.positions { String::new() } else { format!("{theta:.6}") };
            let _ = writeln!(truth, "{},{t_s:.4},{x:e},{y:e},{theta}", self.runs[*run].0);
        }
        fs::write(dir.join("dataset.toml"), toml).expect("written");
        fs::write(dir.join("odometry.csv"), odometry).expect("written");
        fs::write(dir.join("truth.csv"), truth).expect("written");
    }

    fn truths(mut self, change: impl Fn(&mut f64, &mut [f64; 3])) -> Self {
        self.truth.iter_mut().for_each(|(_, t_s, seen)| change(t_s, seen));
        self
    }

    fn rows(mut self, change: impl Fn(&mut f64, &mut [f64; 2])) -> Self {
        self.odometry.iter_mut().for_each(|(_, t_s, wheels)| change(t_s, wheels));
        self
    }

    /// The runs of one protocol.
    fn only(mut self, protocol: &str) -> Self {
        let runs = self.runs.clone();
        self.odometry.retain(|row| runs[row.0].1 == protocol);
        self.truth.retain(|row| runs[row.0].1 == protocol);
        let kept: Vec<usize> = (0..runs.len()).filter(|run| runs[*run].1 == protocol).collect();
        let place = |run: usize| kept.iter().position(|kept| *kept == run).expect("kept");
        self.odometry.iter_mut().for_each(|row| row.0 = place(row.0));
        self.truth.iter_mut().for_each(|row| row.0 = place(row.0));
        self.runs = kept.iter().map(|run| runs[*run].clone()).collect();
        self
    }

    /// Nominal dead reckoning as the truth.
    fn with_own_truth(mut self) -> Self {
        let mut pose = [0.0_f64; 3];
        let mut before: Option<(usize, [f64; 2])> = None;
        self.truth.clear();
        for (row, (run, t_s, wheels)) in self.odometry.iter().enumerate() {
            match before {
                Some((last, was)) if last == *run => {
                    let [left, right] = [0, 1].map(|side| (wheels[side] - was[side]) * PI * 0.150 / 4096.0);
                    let turn_rad = (right - left) / 0.300;
                    let middle_rad = pose[2] + 0.5 * turn_rad;
                    let step_m = 0.5 * (left + right);
                    pose =
                        [pose[0] + step_m * middle_rad.cos(), pose[1] + step_m * middle_rad.sin(), pose[2] + turn_rad];
                }
                _ => pose = [0.0; 3],
            }
            before = Some((*run, *wheels));
            if row % 5 == 0 {
                self.truth.push((*run, *t_s, pose));
            }
        }
        self
    }
}

/// The values of a calibration in millimetres; `None` where it is refused.
fn calibrated(folder: &Path, set: &str) -> (Option<[Option<f64>; 3]>, String) {
    let ended = run_in(folder, &["calibrate", set, "--json"]);
    if ended.code != Some(0) {
        assert_eq!(ended.code, Some(1), "{set}: {}", ended.stderr);
        return (None, ended.stderr);
    }
    let found: Value = serde_json::from_str(&ended.stdout).expect("a document");
    let parameters = &found["methods"][0]["parameters"];
    let keys = ["left_wheel_diameter_m", "right_wheel_diameter_m", "wheel_separation_m"];
    (Some(keys.map(|key| Some(1e3 * parameters[key]["value"].as_f64()?))), ended.stderr)
}

#[track_caller]
fn right(found: [Option<f64>; 3]) {
    let off =
        found.iter().zip(TRUE_MM).map(|(found, truth)| found.map_or(f64::INFINITY, |found| (found - truth).abs()));
    assert!(off.clone().all(|off| off < TOLERANCE_MM), "{found:?}");
}

/// The problems of a dataset: id, severity and fix.
fn problems(folder: &Path, set: &str) -> Vec<(String, String, Option<String>)> {
    let ended = run_in(folder, &["check", set, "--json", "--quiet"]);
    let found: Value = serde_json::from_str(&ended.stdout).unwrap_or_else(|_| panic!("{set}: {}", ended.stderr));
    assert_eq!(ended.code == Some(0), found["ok"] == true, "{set}");
    let text = |value: &Value| value.as_str().map(str::to_owned);
    let of = |problem: &Value| {
        let (id, severity) = (text(&problem["id"]), text(&problem["severity"]));
        (id.expect("an id"), severity.expect("a severity"), text(&problem["fix"]))
    };
    found["problems"].as_array().expect("a list").iter().map(of).collect()
}

/// A spoiled log is refused by its name; where `mended`, the key that `check` names makes the numbers right.
#[track_caller]
fn refused(log: &Log, id: &str, mended: bool) {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    log.write(&at.join("set"), "");
    let (values, message) = calibrated(at, "set");
    assert!(values.is_none(), "{id}: {values:?}");
    assert!(message.contains(&format!("error: {id}: ")), "{id}: {message}");
    let found = problems(at, "set");
    let (_, severity, fix) = found.iter().find(|(name, ..)| name == id).unwrap_or_else(|| panic!("{id}: {found:?}"));
    assert_eq!(severity, "error", "{id}");
    if mended {
        let keys = fix.as_ref().and_then(|fix| fix.strip_prefix("[corrections] ")).expect("a key");
        log.write(&at.join("mended"), &format!("[corrections]\n{}\n", keys.replace(", ", "\n")));
        right(calibrated(at, "mended").0.unwrap_or_else(|| panic!("{id}: {}", calibrated(at, "mended").1)));
    }
}

#[test]
fn the_good_log_has_no_problem_and_gives_the_right_numbers() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    good(1).write(&temp.path().join("set"), "");
    assert_eq!(problems(temp.path(), "set"), []);
    let (values, message) = calibrated(temp.path(), "set");
    right(values.expect("calibrated"));
    assert_eq!(message, "");
    let found = document(temp.path(), &["check", "set"]);
    assert!(found["determined"].as_object().expect("by name").values().all(|is| is == true), "{found}");
}

#[test]
fn wheels_and_headings_on_the_wrong_side_are_named_and_mended() {
    refused(&good(2).rows(|_, wheels| wheels.swap(0, 1)), "wheels_exchanged", true);
    refused(&good(3).rows(|_, wheels| wheels[1] = -wheels[1]), "wheel_backwards", true);
    refused(&good(3).rows(|_, wheels| wheels[0] = -wheels[0]), "wheel_backwards", true);
    refused(&good(4).truths(|_, seen| (seen[1], seen[2]) = (-seen[1], -seen[2])), "wheels_exchanged", true);
    refused(&good(5).truths(|_, seen| seen[2] = -seen[2]), "heading_clockwise", true);
    refused(&good(6).truths(|_, seen| seen.swap(0, 1)), "axes_exchanged", true);
    refused(&good(6).truths(|_, seen| seen[1] = -seen[1]), "axis_mirrored", true);
}

#[test]
fn positions_alone_tell_of_wheels_and_units_too() {
    let positions = |seed| Log { positions: true, ..good(seed) };
    refused(&positions(28).rows(|_, wheels| wheels.swap(0, 1)), "wheels_exchanged", false);
    refused(&positions(28).rows(|_, wheels| wheels[1] = -wheels[1]), "wheel_backwards", false);
    let millimetres = positions(29).truths(|_, seen| (seen[0], seen[1]) = (1e3 * seen[0], 1e3 * seen[1]));
    refused(&millimetres, "truth_length_unit", false);
    let temp = tempfile::tempdir().expect("a temporary folder");
    positions(30).write(&temp.path().join("set"), "");
    assert_eq!(problems(temp.path(), "set"), []);
}

#[test]
fn other_units_are_named_and_mended() {
    let wrapped = |degrees: f64| (degrees + 180.0).rem_euclid(360.0) - 180.0;
    refused(&good(7).truths(|_, seen| seen[2] = wrapped(seen[2].to_degrees())), "heading_in_degrees", true);
    refused(&good(8).truths(|_, seen| (seen[0], seen[1]) = (1e3 * seen[0], 1e3 * seen[1])), "truth_length_unit", true);
    let milliseconds = good(9).truths(|t_s, _| *t_s *= 1e3).rows(|t_s, _| *t_s *= 1e3);
    refused(&milliseconds, "time_in_milliseconds", true);
    refused(&good(9).truths(|t_s, _| *t_s *= 1e3), "truth_time_unit", true);
    refused(&Log { robot_m: [150.0, 150.0, 300.0], ..good(10) }, "robot_length_unit", false);
    refused(&Log { ticks_per_rev: 1024.0, ..good(11) }, "ticks_per_turn", false);
    refused(&Log { ticks_per_rev: 16384.0, ..good(11) }, "ticks_per_turn", false);
}

#[test]
fn clocks_that_are_apart_are_named_and_mended() {
    for offset_s in [3.0, 100.0, -100.0] {
        refused(&good(12).truths(|t_s, _| *t_s += offset_s), "clock_offset", true);
    }
    refused(&good(13).truths(|t_s, _| *t_s *= 1.02), "clock_drift", true);
    // What a fit of a latency explains is said in words.
    for late_s in [0.05, 0.1] {
        let temp = tempfile::tempdir().expect("a temporary folder");
        good(14).truths(|t_s, _| *t_s += late_s).write(&temp.path().join("set"), "");
        let check = run_in(temp.path(), &["check", "set"]);
        assert!(check.stdout.contains(&format!("{late_s:.2}")) && check.stdout.contains("late"), "{}", check.stdout);
        let ended = run_in(temp.path(), &["calibrate", "set"]);
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        let has_latency = ended.stdout.contains("latency_s");
        assert_eq!(has_latency, ended.stdout.contains("ms late against the log"), "{}", ended.stdout);
        // Drives both ways: a latency that is not fitted moves a length by a third of a thousandth.
        let found = calibrated(temp.path(), "set").0.expect("calibrated");
        let off = found.iter().zip(TRUE_MM).map(|(found, truth)| (found.expect("a value") / truth - 1.0).abs());
        assert!(off.fold(0.0, f64::max) < 3.3e-4, "{found:?}");
    }
}

#[test]
fn rows_that_no_wheel_and_no_instrument_makes_are_named() {
    let mut spike = good(15);
    spike.odometry[2000].2[0] = 4e9;
    refused(&spike, "counter_spike", false);
    let mut zero = good(15);
    let row = zero.odometry.iter().position(|row| row.0 == 8).expect("a square") + 300;
    zero.odometry[row].2 = [0.0, 0.0];
    refused(&zero, "counter_spike", false);
    let mut restart = good(16);
    let from = restart.odometry[row].2;
    for (_, _, wheels) in restart.odometry[row..].iter_mut().take_while(|row| row.0 == 8) {
        *wheels = [wheels[0] - from[0], wheels[1] - from[1]];
    }
    refused(&restart, "counter_restart", false);
    let mut far = good(17);
    far.truth[100].2[0] = 1e300;
    refused(&far, "truth_outlier", false);
    far.truth[100].2[0] = 50.0;
    let temp = tempfile::tempdir().expect("a temporary folder");
    far.write(&temp.path().join("set"), "");
    let (values, message) = calibrated(temp.path(), "set");
    right(values.expect("calibrated"));
    assert!(message.contains("truth_outlier"), "{message}");
}

#[test]
fn a_robot_that_stands_and_truth_that_is_the_odometry_are_named() {
    refused(&good(18).rows(|_, wheels| *wheels = [7.0, 9.0]), "nothing_moves", false);
    refused(&good(18).truths(|_, seen| *seen = [1.0, 2.0, 0.3]), "nothing_moves", false);
    let temp = tempfile::tempdir().expect("a temporary folder");
    good(19).with_own_truth().write(&temp.path().join("set"), "");
    let (_, message) = calibrated(temp.path(), "set");
    assert!(message.contains("warning: truth_is_odometry: "), "{message}");
}

#[test]
fn what_the_runs_do_not_determine_has_no_value() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    good(20).only("straight").write(&at.join("straights"), "");
    let (values, message) = calibrated(at, "straights");
    let [left, right, separation] = values.expect("calibrated");
    assert!((left.expect("a value") - TRUE_MM[0]).abs() < TOLERANCE_MM && right.is_some() && separation.is_none());
    assert!(message.contains("not_determined"), "{message}");
    let ended = run_in(at, &["calibrate", "straights", "--out", "found.toml"]);
    assert!(ended.stdout.contains("not determined: wheel_separation_m: "), "{}", ended.stdout);
    let file = fs::read_to_string(at.join("found.toml")).expect("written");
    assert!(!file.contains("parameters.wheel_separation_m") && file.contains("left_wheel_diameter_m"), "{file}");
    good(21).only("spin").write(&at.join("spins"), "");
    let (values, message) = calibrated(at, "spins");
    assert!(values.is_none() && message.contains("determine no parameter"), "{message}");
    assert_eq!(run_in(at, &["calibrate", "spins", "--force"]).code, Some(0));
}

#[test]
fn sessions_of_two_robots_are_refused_and_those_that_state_it_alone_are_not() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    good(22).write(&at.join("both/a"), "");
    driven([0.163, 0.1625, 0.320], 23).write(&at.join("both/b"), "");
    let (values, message) = calibrated(at, "both");
    assert!(values.is_none() && message.contains("error: several_robots: "), "{message}");
    assert_eq!(run_in(at, &["calibrate", "both", "--force"]).code, Some(0));
    good(22).write(&at.join("one/a"), "");
    Log { robot_m: [0.140, 0.140, 0.290], ..good(24) }.write(&at.join("one/b"), "");
    right(calibrated(at, "one").0.expect("calibrated"));
}

#[test]
fn a_calibration_is_no_test_of_itself_and_none_of_another_robot() {
    let temp = tempfile::tempdir().expect("a temporary folder");
    let at = temp.path();
    good(25).write(&at.join("a"), "");
    good(26).write(&at.join("b"), "");
    driven([0.163, 0.1625, 0.320], 27).write(&at.join("c"), "");
    assert_eq!(run_in(at, &["calibrate", "a", "--out", "a.toml"]).code, Some(0));
    let on = |set: &str| run_in(at, &["evaluate", set, "--calibration", "a.toml", "--runs"]);
    assert!(on("a").stderr.contains("a.toml was trained on 10 of these 10 runs"), "{}", on("a").stderr);
    assert_eq!(on("b").stderr, "");
    assert!(on("b").stdout.contains("00_straight"), "{}", on("b").stdout);
    // A robot whose own wheels are stated well, under what was found of another.
    Log { robot_m: [0.163, 0.1625, 0.320], ..driven([0.163, 0.1625, 0.320], 27) }.write(&at.join("d"), "");
    assert!(on("d").stderr.contains("is it a calibration of this robot?"), "{}", on("d").stderr);
}
