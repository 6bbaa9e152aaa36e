//! The filter's noise is the simulator's: what dead reckoning from recorded counts misses of the end that was
//! seen, over many simulated runs, has the innovation's covariance.
//!
//! Misses are whitened by the filter's covariance; then all six second moments are 1 or 0. Each is held by a
//! z score with the sample's own error, at 5: a false positive of 6e-7 each, 1e-4 over the file. Rejected by
//! the same score: no scatter inside arcs, and roundings that are independent.

use bench::LinearizedInnovation;
use dataset::{Dataset, Run};
use effects::{ContactPatchWheelbase, Effect, Quantization};
use kinematics::{Pose, Rule, wrap_to_pi};
use motion_programs::{Motion, Platform};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use scenario::{Instrument, Scenario};
use sim_yair::SimulatedRobot;

use super::batch::{Batch, Wrong};
use super::{paper, program, square};

const RUNS: u64 = 20_000;
const Z_LIMIT: f64 = 5.0;

/// Readings so good that what the robot itself does is seen: a hundredth of it.
const SHARP_M: f64 = 1e-5;

/// The paper's wheels and base, and nothing random but sharp readings.
fn quiet() -> Scenario {
    let mut scenario = paper();
    scenario.effects.retain(|effect| matches!(effect.id(), "wheel_scale" | "wheel_mismatch"));
    scenario.noise.wheel_sigma_m_per_sqrt_m = 0.0;
    scenario.instruments = vec![Instrument::FloorGrid { resolution_m: 0.0, reading_sigma_m: SHARP_M }];
    scenario
}

fn with_wheel_noise(scenario: &mut Scenario) {
    scenario.noise.wheel_sigma_m_per_sqrt_m = 5e-4;
}

/// A tenth of the paper's contact patch: with all of it a square's end is no longer linear to a hundredth.
fn with_contact_patch(scenario: &mut Scenario) {
    let patch = ContactPatchWheelbase { sigma_m: 1e-4, slow_sigma_m: 0.0, slow_length_m: 0.0 };
    scenario.effects.push(Effect::ContactPatchWheelbase(patch));
}

fn with_sensitivity(scenario: &mut Scenario) {
    scenario.noise.sensitivity_sigma = 5e-4;
}

fn with_rounded_counts(scenario: &mut Scenario) {
    scenario.effects.push(Effect::Quantization(Quantization { counts_per_tick: 80 }));
}

fn with_rounded_readings(scenario: &mut Scenario) {
    scenario.instruments = vec![Instrument::FloorGrid { resolution_m: 1e-3, reading_sigma_m: 5e-4 }];
}

/// Straights, spins, arcs and squares whose travels are not whole ticks.
fn programs() -> [Vec<Motion>; 4] {
    [
        vec![Motion::Straight { length_m: 0.5003 }],
        vec![Motion::Spin { turn_rad: -std::f64::consts::TAU }],
        vec![Motion::Arc { radius_m: 0.5, turn_rad: 1.3 }],
        square(0.9997),
    ]
}

/// Measured end minus dead-reckoned end, from the measured start.
fn misses(scenario: &Scenario, motions: &[Motion]) -> Vec<Vector3<f64>> {
    let program = program(motions);
    (0..RUNS)
        .into_par_iter()
        .map_init(
            || SimulatedRobot::new(scenario, 41, 0).expect("simulates"),
            |robot, trial| {
                robot.restart(trial);
                let mut run = Run::default();
                robot.drive_into(&program, &mut run).expect("drives");
                let dataset = Dataset {
                    provenance: dataset::Provenance::default(),
                    robot: robot.robot(),
                    truth_noise: robot.truth_noise(),
                    points: robot.points().to_vec(),
                    runs: vec![run],
                };
                let view = dataset.session().runs[0];
                let (start, end) = view.observed_ends().expect("read at both ends");
                let mut dead_reckoned = Pose::IDENTITY;
                let geometry = robot.true_geometry();
                view.dead_reckon(&dataset.robot, &geometry, Rule::ExactArc, Pose::IDENTITY, |_, pose| {
                    dead_reckoned = pose;
                });
                let seen = start.to(end);
                let turn_rad = wrap_to_pi(seen.theta_rad - dead_reckoned.theta_rad);
                Vector3::new(seen.x_m - dead_reckoned.x_m, seen.y_m - dead_reckoned.y_m, turn_rad)
            },
        )
        .collect()
}

/// The largest |z| of the six second moments of misses that a covariance whitens.
fn largest_z(misses: &[Vector3<f64>], covariance: &Matrix3<f64>) -> f64 {
    let Some(cholesky) = covariance.cholesky() else { return f64::INFINITY };
    let whiten = cholesky.l().try_inverse().expect("a triangle with a positive diagonal");
    let n = misses.len() as f64;
    let mut largest: f64 = 0.0;
    for (i, j) in [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)] {
        let products = || misses.iter().map(|miss| whiten * miss).map(|white| white[i] * white[j]);
        let mean = products().sum::<f64>() / n;
        let var = products().map(|product| (product - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let expected = if i == j { 1.0 } else { 0.0 };
        largest = largest.max((mean - expected).abs() / (var / n).sqrt());
    }
    largest
}

/// Holds one scenario on one program; gives the misses and the filter's covariance for what must be rejected.
fn hold(scenario: &Scenario, motions: &[Motion]) -> (Vec<Vector3<f64>>, Matrix3<f64>) {
    let innovations = LinearizedInnovation::of_run(scenario, &program(motions)).expect("bounded");
    assert_eq!(innovations.len(), 1, "the end seen from the start");
    let misses = misses(scenario, motions);
    let z = largest_z(&misses, &innovations[0].covariance);
    assert!(z < Z_LIMIT, "{motions:?}: z = {z}");
    (misses, innovations[0].covariance)
}

/// Is the filter's covariance with this mistake in it discriminated?
fn reject(wrong: Wrong, scenario: &Scenario, motions: &[Motion], held: &(Vec<Vector3<f64>>, Matrix3<f64>)) {
    let own = |wrong| *Batch::of(scenario, motions, wrong).end_covariance();
    let z = largest_z(&held.0, &(held.1 - own(Wrong::Nothing) + own(wrong)));
    assert!(z > Z_LIMIT, "{wrong:?} passes on {motions:?}: z = {z}");
}

#[test]
fn wheel_noise_alone() {
    let mut scenario = quiet();
    with_wheel_noise(&mut scenario);
    for motions in programs() {
        let held = hold(&scenario, &motions);
        reject(Wrong::NoScatterWithin, &scenario, &motions, &held);
    }
}

#[test]
fn contact_patch_alone() {
    let mut scenario = quiet();
    with_contact_patch(&mut scenario);
    for motions in programs() {
        hold(&scenario, &motions);
    }
}

#[test]
fn sensitivity_alone() {
    let mut scenario = quiet();
    with_sensitivity(&mut scenario);
    for motions in programs() {
        hold(&scenario, &motions);
    }
}

#[test]
fn rounded_counts_alone() {
    let mut scenario = quiet();
    with_rounded_counts(&mut scenario);
    for motions in programs() {
        let held = hold(&scenario, &motions);
        reject(Wrong::IndependentRounding, &scenario, &motions, &held);
    }
    // 500 ticks of one straight, to the count: no rounding at all.
    let whole = [Motion::Straight { length_m: 0.5 }];
    let held = hold(&scenario, &whole);
    reject(Wrong::IndependentRounding, &scenario, &whole, &held);
}

#[test]
fn rounded_readings_alone() {
    let mut scenario = quiet();
    with_rounded_readings(&mut scenario);
    for motions in programs() {
        hold(&scenario, &motions);
    }
}

#[test]
fn everything_together() {
    let mut scenario = quiet();
    for with in [with_wheel_noise, with_contact_patch, with_sensitivity, with_rounded_counts, with_rounded_readings] {
        with(&mut scenario);
    }
    for motions in programs() {
        let held = hold(&scenario, &motions);
        // Beside readings of a millimetre the scatter inside a spin or a short straight is lost; a square's
        // is not.
        if motions.len() > 1 {
            reject(Wrong::NoScatterWithin, &scenario, &motions, &held);
            reject(Wrong::IndependentRounding, &scenario, &motions, &held);
        }
    }
}
