//! The bare loop that `cargo bench --bench trial` times the closed-form trial against does the same work: its
//! estimates have the library's mean and spread.

use crate::yardstick::Yardstick;
use bench::{Moments, Trial};
use calib::{Calibration, Parameter};
use motion_programs::Schedule;
use scenario::Scenario;

/// The paper's trial: 30 straights, 30 spins, 10 squares.
fn trial() -> Trial {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/paper.toml");
    let mut scenario = Scenario::read(&path).expect("the shipped scenario");
    scenario.protocols = vec![
        Schedule::Straights { length_m: 0.5, runs: 30 },
        Schedule::Spins { turn_rad: std::f64::consts::TAU, runs: 30 },
        Schedule::Squares { side_m: 4.0, runs_each_way: 5 },
    ];
    Trial::new(&scenario, 4711).expect("simulates")
}

/// One trial of the library: driven, and given to both methods of the paper.
fn of_library(trial: &mut Trial, number: u64) -> [Calibration; 2] {
    let session = [trial.drive(number).expect("drives")];
    ["direct", "umbmark"].map(|name| calib::method(name).expect("there").calibrate(&session).expect("applies"))
}

const PARAMETERS: [Parameter; 3] = [Parameter::LeftPerTick, Parameter::RightPerTick, Parameter::WheelSeparation];

/// The yardstick does the same work: its estimates have the library's mean and spread. Twelve means and
/// twelve variances at 4.5 standard errors, a false positive of 7e-6 each. A yardstick without the noise
/// inside an arc has UMBmark's spread too small by a third.
#[test]
fn the_yardstick_does_the_librarys_work() {
    const TRIALS: u64 = 4000;
    let (mut trial, mut yardstick) = (trial(), Yardstick::new(4711));
    let (mut library, mut bare) = ([Moments::default(); 12], [Moments::default(); 12]);
    for number in 0..TRIALS {
        let found = of_library(&mut trial, number);
        let estimates = found.iter().flat_map(|found| PARAMETERS.map(|parameter| found.estimate(parameter)));
        for (k, estimate) in estimates.flatten().enumerate() {
            library[k].push(estimate.value);
            library[6 + k].push(estimate.sigma.expect("of many runs"));
        }
        let found = yardstick.trial();
        for (k, estimate) in found.direct.iter().chain(&found.umbmark).enumerate() {
            bare[k].push(estimate.value);
            bare[6 + k].push(estimate.sigma);
        }
    }
    for (k, (a, b)) in library.iter().zip(&bare).enumerate() {
        for of in [Moments::bias, Moments::variance] {
            let ((a, a_error), (b, b_error)) = (of(a).expect("many"), of(b).expect("many"));
            let z = (a - b) / a_error.hypot(b_error);
            assert!(z.abs() < 4.5, "number {k}: {a} against {b}, z = {z:.1}");
        }
    }
}
