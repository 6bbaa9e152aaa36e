//! Circles of a real robot (Sousa et al. 2022) calibrated from parts of what was seen: ends alone, positions
//! alone, and headings alone, against the full calibration.

use std::collections::BTreeMap;
use std::fs;

use calib::methods::joint::Joint;
use calib::{Calibration, Method};
use dataset::import::importer;
use dataset::{Dataset, TruthSample, WallReading};
use kinematics::wrap_to_pi;

use crate::support::real_data::real_data;

/// Standard deviation that headings alone are given, radians: what the full fits estimate of this
/// instrument is some milliradians.
const HEADING_SIGMA_RAD: f64 = 5e-3;

/// How far parts may be from the whole, in standard deviations of the difference: 2.2 is the largest of the
/// 36 that the six sessions have, and independent normal ones would be beyond this in 1.2 % of all.
const MAX_SIGMAS: f64 = 2.5;

/// Headings alone are taken so far apart, seconds: their errors last for a second or two.
const HEADINGS_EVERY_S: f64 = 4.0;

fn calibrated(dataset: &Dataset) -> Calibration {
    Joint::DEFAULT.calibrate(&[dataset.session()]).expect("a calibration")
}

/// The relative value of a combination of left, right and separation, and its standard deviation.
fn combined(found: &Calibration, by: [f64; 3]) -> (f64, f64) {
    let diameter_m = found.geometry.wheel_diameter_m();
    let geometry_m = [diameter_m.left, diameter_m.right, found.geometry.wheel_separation_m()];
    let covariance = found.covariance.as_ref().expect("a covariance");
    let variance: f64 = (0..9)
        .map(|k| (k / 3, k % 3))
        .map(|(i, j)| by[i] * by[j] * covariance[(i, j)] / (geometry_m[i] * geometry_m[j]))
        .sum();
    (by.iter().zip(geometry_m).map(|(by, length_m)| by * length_m.ln()).sum(), variance.sqrt())
}

#[test]
#[expect(clippy::print_stdout, reason = "docs/real-robots.md shows what it prints")]
fn circles_of_june_from_ends_positions_or_headings_agree_with_the_full_calibration() {
    let Some(folder) = real_data("circles in part", "optiodom/diff/circular") else { return };
    let mut sessions: Vec<_> =
        fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path()).collect();
    sessions.sort();
    let mut compared = 0;
    let mut off: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    // Every second one: a fit of all poses takes a second.
    for session in sessions.iter().filter(|path| path.is_dir()).step_by(2) {
        let mut imported = importer("optiodom").expect("the importer").read(session).expect("a session");
        let dataset = imported.remove(0).dataset;
        let full = calibrated(&dataset);
        let ends = with_runs(&dataset, |truth| vec![truth[0], truth[truth.len() - 1]]);
        let positions = with_runs(&dataset, |truth| {
            truth.iter().map(|sample| TruthSample::new(sample.t_s, sample.x_m, sample.y_m, None)).collect()
        });
        let headings = headings_alone(&dataset);
        // Headings know no length: only the wheels over the separation.
        let over_separation = [[1.0, 0.0, -1.0], [0.0, 1.0, -1.0]];
        let all = [[1.0, -1.0, 0.0], [0.5, 0.5, -1.0]];
        for (name, part, of) in
            [("ends", ends, all), ("positions", positions, all), ("headings", headings, over_separation)]
        {
            let part = calibrated(&part);
            for by in of {
                let ((a, sigma_a), (b, sigma_b)) = (combined(&full, by), combined(&part, by));
                let sigma = sigma_a.hypot(sigma_b);
                off.entry(name).or_default().push((a - b) / sigma);
                assert!(
                    (a - b).abs() < MAX_SIGMAS * sigma,
                    "{} {name} {by:?}: {b} ± {sigma_b}, not {a} ± {sigma_a}",
                    session.display()
                );
                compared += 1;
            }
        }
    }
    assert!(compared >= 12, "{compared}");
    for (name, off) in off {
        let squares: f64 = off.iter().map(|z| z * z).sum();
        let largest = off.iter().fold(0.0_f64, |most, z| most.max(z.abs()));
        let within = off.iter().filter(|z| z.abs() < 1.96).count();
        let rms = (squares / off.len() as f64).sqrt();
        println!(
            "{name}: {} differences, RMS {rms:.2} and at most {largest:.2} standard deviations, {within} within 1.96",
            off.len()
        );
    }
}

fn with_runs(dataset: &Dataset, of: impl Fn(&[TruthSample]) -> Vec<TruthSample>) -> Dataset {
    let mut dataset = dataset.clone();
    for run in &mut dataset.runs {
        (run.truth, run.truth_sigma) = (of(&run.truth), None);
    }
    dataset
}

/// The headings as those along a wall.
fn headings_alone(dataset: &Dataset) -> Dataset {
    let mut dataset = dataset.clone();
    for run in &mut dataset.runs {
        let mut due_s = f64::NEG_INFINITY;
        for sample in std::mem::take(&mut run.truth) {
            let Some(theta_rad) = sample.theta_rad().filter(|_| sample.t_s >= due_s) else { continue };
            due_s = sample.t_s + HEADINGS_EVERY_S;
            run.walls.push(WallReading {
                t_s: sample.t_s,
                wall: "room".to_owned(),
                distance_m: None,
                heading_rad: Some(wrap_to_pi(theta_rad)),
                sigma_m: None,
                sigma_rad: Some(HEADING_SIGMA_RAD),
            });
        }
        run.truth_sigma = None;
    }
    dataset
}
