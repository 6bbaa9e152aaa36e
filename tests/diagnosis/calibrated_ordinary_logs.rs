//! Calibration of logs that this project's simulator did not drive ([`plain_robot`]), of the same
//! kinds as [`crate::ordinary_logs`]: lengths within their standard deviations, or a refusal where they would
//! be wrong.
//!
//! The campaign: `YAIR_ROBOTS=40 cargo test --release --test diagnosis calibrated -- --nocapture`.
#![allow(clippy::print_stdout)] // every kind with its errors

use std::fs;
use std::path::Path;
use std::process::Command;

use rayon::prelude::*;
use serde_json::Value;

use crate::ordinary_kinds::{QUARTER, kinds, robots};
use plain_robot::Change;
use plain_robot::PlainRobot;
use plain_robot::Records;

/// Both wheels' diameters and their separation.
const LENGTHS: [&str; 3] = ["left_wheel_diameter_m", "right_wheel_diameter_m", "wheel_separation_m"];

/// What `calibrate` says.
pub(crate) struct Calibrated {
    pub(crate) is_refused: bool,
    pub(crate) said: String,
    /// Errors of what is determined, over their standard deviations.
    pub(crate) z: Vec<f64>,
}

pub(crate) fn calibrated(folder: &Path, truth_m: [f64; 3]) -> Calibrated {
    let mut command = Command::new(env!("CARGO_BIN_EXE_yair"));
    let output = command.args(["calibrate", "--json"]).arg(folder).output().expect("it runs");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    if !output.status.success() {
        return Calibrated { is_refused: true, said, z: Vec::new() };
    }
    let document: Value = serde_json::from_slice(&output.stdout).expect("a document");
    let methods = document["methods"].as_array().expect("methods");
    let joint = methods.iter().find(|of| of["method"] == "joint").expect("joint");
    let z = LENGTHS.iter().zip(truth_m).filter_map(|(length, truth_m)| {
        let of = &joint["parameters"][length];
        Some((of["value"].as_f64()? - truth_m) / of["sigma"].as_f64()?)
    });
    Calibrated { is_refused: false, said, z: z.collect() }
}

fn of_robot(change: Change, seed: u64) -> Calibrated {
    let mut robot = PlainRobot::ordinary(seed);
    change(&mut robot);
    let (folder, truth_m) = robot.written();
    calibrated(folder.path(), truth_m)
}

#[test]
fn lengths_of_ordinary_logs_are_within_their_standard_deviations() {
    let (robots, first) = robots();
    // Each kind has robots of its own, so that one robot's errors are not those of all kinds.
    let seeds = |number: usize| (0..robots).map(move |robot| first + robot + robots * number as u64);
    let cases: Vec<(&str, Change, u64)> = kinds(QUARTER)
        .enumerate()
        .flat_map(|(number, (kind, change, _))| seeds(number).map(move |seed| (*kind, *change, seed)))
        .collect();
    let found: Vec<(&str, Calibrated)> =
        cases.into_par_iter().map(|(kind, change, seed)| (kind, of_robot(change, seed))).collect();
    let (mut complaints, mut squares) = (Vec::new(), Vec::new());
    for of_kind in found.chunk_by(|a, b| a.0 == b.0) {
        let kind = of_kind[0].0;
        // Circles one way round determine neither wheels nor separation.
        let is_wrongly_refused = |of: &Calibrated| of.is_refused && !of.said.contains("determine no parameter");
        let refused = of_kind.iter().filter(|(_, of)| is_wrongly_refused(of));
        complaints.extend(refused.map(|(_, of)| format!("{kind}: {}", of.said)));
        let z: Vec<f64> = of_kind.iter().flat_map(|(_, of)| of.z.iter().copied()).collect();
        if z.is_empty() {
            println!("{kind}: nothing is determined");
            continue;
        }
        let mean = z.iter().sum::<f64>() / z.len() as f64;
        let square = z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64;
        println!("{kind}: RMS z {:.2}, mean {mean:+.2}, of {}", square.sqrt(), z.len());
        // Lengths of a robot share their errors: the mean of all of a robot has a standard deviation of 1 at
        // the most. Beyond 4.5 of it one of 70 kinds has a chance of 5e-4.
        if mean.abs() > 4.5 * (robots as f64).sqrt().recip() {
            complaints.push(format!("{kind}: mean z {mean:+.2}"));
        }
        squares.push(square);
    }
    let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    println!("RMS z of all kinds {rms:.2}");
    // Of 29 kinds with a robot each the root mean square has a standard deviation of a ninth, and
    // standard deviations that are known to a tenth are customary.
    assert!(complaints.is_empty() && (0.75..1.3).contains(&rms), "{rms} {complaints:#?}");
}

/// A robot that turns while a measurement is late was beside where its heading says.
#[test]
fn regress_truth_that_is_late_makes_no_wheel_smaller() {
    let z = |seed| of_robot(|of| of.latency_s = 0.05, seed).z;
    let z: Vec<f64> = (600..612_u64).into_par_iter().flat_map(z).collect();
    assert_eq!(z.len(), 36);
    // Lengths of a robot share their errors: the mean of twelve robots has a standard deviation of 0.29 at
    // the most. Rejects measurements on the tangent.
    let mean = z.iter().sum::<f64>() / z.len() as f64;
    assert!(mean.abs() < 3.5 * 0.29, "{mean:+.2} {z:.1?}");
}

/// Speeds that a tachometer measures, or a driver takes from short intervals.
#[test]
fn regress_noise_of_recorded_speeds_biases_no_length() {
    let change: Change = |of| (of.records, of.speed_noise) = (Records::Speeds { step_m_s: 0.0 }, 0.1);
    let found: Vec<Calibrated> = (640..652_u64).into_par_iter().map(|seed| of_robot(change, seed)).collect();
    for (length, name) in LENGTHS.iter().enumerate() {
        let z: Vec<f64> = found.iter().filter_map(|of| of.z.get(length).copied()).collect();
        assert_eq!(z.len(), 12, "{name}");
        // Twelve robots, 3.5 standard deviations of their mean. Rejects rates taken as they are: a separation
        // 2.2 standard deviations too large in the mean.
        let mean = z.iter().sum::<f64>() / 12.0;
        assert!(mean.abs() < 3.5 / 12_f64.sqrt(), "{name}: {mean:+.2} {z:.1?}");
    }
}

/// Two computers that nobody synchronises, over a session of twenty minutes.
#[test]
fn regress_a_clock_that_drifts_over_a_session_is_undone() {
    let change: Change = |of| (of.clock_gain, of.clock_runs_on) = (-1e-4, true);
    let found: Vec<Calibrated> = (660..668_u64).into_par_iter().map(|seed| of_robot(change, seed)).collect();
    for of in &found {
        assert!(!of.is_refused && of.said.contains("the instrument's clock gains"), "{}", of.said);
    }
    // 24 errors; the root mean square of as many is 1 ± 0.25 where lengths of a robot share theirs.
    let z: Vec<f64> = found.into_iter().flat_map(|of| of.z).collect();
    let rms = (z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64).sqrt();
    assert!(z.len() == 24 && rms < 1.75, "{rms} {z:.1?}");
}

/// A run that was started by hand, of four.
#[test]
fn regress_a_run_whose_clock_is_off_refuses_no_log() {
    let change: Change = |of| (of.runs, of.late_run) = (4, Some((2, 5.0)));
    let found: Vec<Calibrated> = (680..688_u64).into_par_iter().map(|seed| of_robot(change, seed)).collect();
    for of in &found {
        // Rejects a shift of all runs. Three errors of eight robots: one beyond 5 has a chance of 1e-5.
        assert!(!of.is_refused && of.z.len() == 3 && of.z.iter().all(|z| z.abs() < 5.0), "{:?} {}", of.z, of.said);
    }
}

/// A clock that runs at another rate makes wheels of another size where the robot drives steadily.
#[test]
fn a_clock_of_another_rate_is_refused_with_what_mends_it() {
    for (change, factor) in [
        ((|of| (of.clock_gain, of.joined) = (1e-3, true)) as Change, 1.001),
        (|of| (of.clock_gain, of.joined) = (-4e-3, true), 0.996),
        (|of| (of.clock_gain, of.truth_sigma_m, of.truth_sigma_rad) = (4e-3, 3e-4, 5e-4), 1.004),
    ] {
        let mut robot = PlainRobot::ordinary(600);
        change(&mut robot);
        let (folder, truth_m) = robot.written();
        let found = calibrated(folder.path(), truth_m);
        assert!(found.is_refused && found.said.contains("clock_drift"), "{}", found.said);
        // As it says, to five digits.
        let mends = found.said.split("truth_time_factor = ").nth(1).expect("what mends it");
        let mends: f64 = mends.split(' ').next().and_then(|text| text.parse().ok()).expect("a factor");
        assert!((mends - factor).abs() < 3e-5, "{mends} for {factor}");
        let manifest = folder.path().join("dataset.toml");
        let text = fs::read_to_string(&manifest).expect("a manifest");
        let corrected = format!("[corrections]\ntruth_time_factor = {mends:?}\n[robot]");
        fs::write(&manifest, text.replace("[robot]", &corrected)).expect("written");
        let found = calibrated(folder.path(), truth_m);
        // The factor is known to some 1e-5, a seventh of what wheels are.
        assert!(!found.is_refused && found.z.iter().all(|z| z.abs() < 4.5), "{:?} {}", found.z, found.said);
    }
}

/// Of the logs whose rows are sent some at a time these do not converge as they are stamped.
#[test]
fn rows_that_are_sent_some_at_a_time_are_calibrated_once_they_are_corrected_as_check_says() {
    for seed in [971, 978, 979] {
        let mut robot = PlainRobot::ordinary(seed);
        robot.rows_per_packet = 5;
        let (folder, truth_m) = robot.written();
        let mut command = Command::new(env!("CARGO_BIN_EXE_yair"));
        let checked = command.args(["check", "--json"]).arg(folder.path()).output().expect("it runs");
        let document: Value = serde_json::from_slice(&checked.stdout).expect("a document");
        let problems = document["problems"].as_array().expect("problems");
        let found = problems.iter().find(|problem| problem["id"] == "rows_in_packets").expect("it is said");
        let fix = found["fix"].as_str().expect("a remedy");
        let key = fix.strip_prefix("[corrections] ").expect("a key of the table");
        let file = folder.path().join("dataset.toml");
        let text = fs::read_to_string(&file).expect("a manifest");
        fs::write(&file, format!("{text}\n[corrections]\n{key}\n")).expect("it is written");
        let Calibrated { is_refused, said, z } = calibrated(folder.path(), truth_m);
        // Nine errors: one beyond five standard deviations has a chance of 5e-6.
        assert!(!is_refused && z.len() == 3 && z.iter().all(|z| z.abs() < 5.0), "{seed}: {said} {z:?}");
    }
}
