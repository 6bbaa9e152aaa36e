//! The closed-form trial against a bare loop over the same experiment, timed in turns in one process: the ratio is held, whatever the machine.

#[path = "../benches/yardstick/mod.rs"]
mod yardstick;

use std::hint::black_box;
use std::time::Instant;

use bench::{Moments, Trial};
use calib::{Calibration, Parameter};
use motion_programs::Schedule;
use scenario::Scenario;
use yardstick::Yardstick;

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

/// The yardstick does the same work: its estimates have the library's mean and spread. Twelve means and twelve variances at 4.5 standard errors, a false positive of
/// 7e-6 each. A yardstick without the noise inside an arc has UMBmark's spread too small by a third.
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

/// Rounds of a few milliseconds in turns, and the median of their ratios: what disturbs a round is dropped, what disturbs both sides cancels.
#[test]
fn the_library_is_as_fast_as_a_general_one_can_be() {
    const ROUNDS: usize = 41;
    const TRIALS: u64 = 100;
    /// 3.9 was measured in the profile of the tests, whose crates are compiled apart; a quarter more is for other machines.
    const LARGEST_RATIO: f64 = 5.0;
    let (mut trial, mut yardstick) = (trial(), Yardstick::new(1));
    let mut ratios: Vec<f64> = (0..ROUNDS)
        .map(|round| {
            let started = Instant::now();
            for number in 0..TRIALS {
                black_box(of_library(&mut trial, round as u64 * TRIALS + number));
            }
            let library_s = started.elapsed().as_secs_f64();
            let started = Instant::now();
            for _ in 0..TRIALS {
                black_box(yardstick.trial());
            }
            library_s / started.elapsed().as_secs_f64()
        })
        .collect();
    ratios.sort_by(f64::total_cmp);
    let median = ratios[ROUNDS / 2];
    assert!(median < LARGEST_RATIO, "a trial takes {median:.2} times a bare loop's time");
}
