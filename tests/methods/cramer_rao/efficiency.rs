//! Who reaches the bound, who stays above it and by how much.
//!
//! The oracle starts at the truth and takes one step of weighted least squares with the filter's slopes and
//! covariances: linear and unbiased, it must reach the bound, which says that the bound is not too low. A
//! method that beats it would say that it is too high. Ratios are mean squared error over bound with the
//! Monte-Carlo error of the numerator; limits are z scores of 4.5, a false positive of 7e-6 each.

use bench::{FisherInformation, LinearizedInnovation, Moments};
use calib::methods::direct::Direct;
use calib::{MedianMad, Method, Parameter};
use dataset::{Dataset, Run, Session};
use kinematics::{DriveGeometry, Pose, Rule, wrap_to_pi};
use motion_programs::{MotionProgram, Platform, Schedule};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use scenario::{Instrument, Scenario};
use sim_yair::SimulatedRobot;

use super::paper;

const Z_LIMIT: f64 = 4.5;
const TRACKED: [Parameter; 3] =
    [Parameter::LeftWheelDiameter, Parameter::RightWheelDiameter, Parameter::WheelSeparation];
const TRIALS: u64 = 2000;

/// Mean squared error over the bound, with its Monte-Carlo standard error.
#[derive(Debug, Clone, Copy)]
struct Ratio {
    value: f64,
    mcse: f64,
}

impl Ratio {
    fn of(errors: &[f64], bound_var: f64) -> Self {
        let mut moments = Moments::default();
        errors.iter().for_each(|error| moments.push(*error));
        let (rmse, mcse) = moments.rmse().expect("many trials");
        Self { value: rmse * rmse / bound_var, mcse: 2.0 * rmse * mcse / bound_var }
    }

    fn z(self, expected: f64) -> f64 {
        (self.value - expected) / self.mcse
    }
}

/// Ratios of an estimator's diameters and separation over the trials of a scenario's protocol, to a bound.
fn ratios(
    scenario: &Scenario,
    bound: &FisherInformation,
    estimate: impl Fn(&Session<'_>, DriveGeometry) -> Option<Vector3<f64>> + Sync,
) -> [Ratio; 3] {
    let programs = scenario.programs();
    let errors: Vec<Vector3<f64>> = (0..TRIALS)
        .into_par_iter()
        .map(|trial| {
            let mut robot = SimulatedRobot::new(scenario, 53, trial).expect("simulates");
            let mut runs = vec![Run::default(); programs.len()];
            for (program, run) in programs.iter().zip(&mut runs) {
                robot.drive_into(program, run).expect("drives");
            }
            let dataset = Dataset {
                provenance: dataset::Provenance::default(),
                robot: robot.robot(),
                truth_noise: robot.truth_noise(),
                points: robot.points().to_vec(),
                runs,
            };
            let truth = robot.true_geometry();
            estimate(&dataset.session(), truth).expect("an estimate") - geometry_m(truth)
        })
        .collect();
    std::array::from_fn(|parameter| {
        let errors: Vec<f64> = errors.iter().map(|error| error[parameter]).collect();
        Ratio::of(&errors, bound.bound_var(TRACKED[parameter]).expect("seen"))
    })
}

fn geometry_m(geometry: DriveGeometry) -> Vector3<f64> {
    Vector3::new(geometry.wheel_diameter_m().left, geometry.wheel_diameter_m().right, geometry.wheel_separation_m())
}

/// What one run says to the oracle, by its motions.
struct Oracle {
    kinds: Vec<(MotionProgram, LinearizedInnovation)>,
    covariance: Matrix3<f64>,
}

impl Oracle {
    fn new(scenario: &Scenario) -> Self {
        let mut kinds: Vec<(MotionProgram, LinearizedInnovation)> = Vec::new();
        let mut information = Matrix3::zeros();
        for program in scenario.programs() {
            let innovations = LinearizedInnovation::of_run(scenario, &program).expect("bounded");
            assert_eq!(innovations.len(), 1, "read at the start and the end");
            information += innovations[0].information();
            kinds.push((program, innovations[0]));
        }
        Self { kinds, covariance: information.try_inverse().expect("everything is seen") }
    }

    fn estimate(&self, session: &Session<'_>, truth: DriveGeometry) -> Vector3<f64> {
        let mut gradient = Vector3::zeros();
        for ((_, innovation), run) in self.kinds.iter().zip(&session.runs) {
            let (start, end) = run.observed_ends().expect("read at both ends");
            let mut reckoned = Pose::IDENTITY;
            run.dead_reckon(session.robot, &truth, Rule::ExactArc, Pose::IDENTITY, |_, pose| reckoned = pose);
            let seen = start.to(end);
            let turn_rad = wrap_to_pi(seen.theta_rad - reckoned.theta_rad);
            let miss = Vector3::new(seen.x_m - reckoned.x_m, seen.y_m - reckoned.y_m, turn_rad);
            gradient += innovation.slope.transpose() * innovation.precision * miss;
        }
        geometry_m(truth) + self.covariance * gradient
    }
}

fn by_direct(direct: Direct) -> impl Fn(&Session<'_>, DriveGeometry) -> Option<Vector3<f64>> + Sync {
    move |session, _| direct.calibrate(std::slice::from_ref(session)).ok().map(|found| geometry_m(found.geometry))
}

fn bound(scenario: &Scenario) -> FisherInformation {
    FisherInformation::of(scenario, &scenario.programs()).expect("bounded")
}

fn assert_reached(scenario: &Scenario) {
    let oracle = Oracle::new(scenario);
    let found = ratios(scenario, &bound(scenario), |session, truth| Some(oracle.estimate(session, truth)));
    for (parameter, ratio) in TRACKED.into_iter().zip(found) {
        // The mean square of a Gaussian error varies by √(2/n): 3 %.
        assert!(ratio.z(1.0).abs() < Z_LIMIT, "{parameter:?}: {ratio:?}");
    }
}

#[test]
fn weighted_least_squares_from_the_truth_reaches_the_bound_of_the_papers_protocol() {
    assert_reached(&paper());
}

#[test]
fn weighted_least_squares_from_the_truth_reaches_the_bound_of_barely_dithered_readings() {
    // Nothing random but readings that err by a little more than a third of what they are rounded to.
    let mut scenario = straights_and_spins(paper());
    scenario.noise.wheel_sigma_m_per_sqrt_m = 0.0;
    scenario.instruments = vec![Instrument::FloorGrid { resolution_m: 1e-3, reading_sigma_m: 3.4e-4 }];
    assert_reached(&scenario);
}

#[test]
fn weighted_least_squares_from_the_truth_reaches_the_bound_of_the_squares_alone() {
    let mut scenario = paper();
    scenario.protocols = vec![Schedule::Squares { side_m: 4.0, runs_each_way: 5 }];
    assert_reached(&scenario);
}

/// Scenarios whose errors are all Gaussian: no rounding of readings.
fn gaussian() -> Scenario {
    let mut scenario = paper();
    scenario.instruments = vec![Instrument::FloorGrid { resolution_m: 0.0, reading_sigma_m: 5e-4 }];
    scenario
}

/// The scenario with those of its protocols that `direct` uses.
fn straights_and_spins(mut scenario: Scenario) -> Scenario {
    scenario.protocols.retain(|schedule| !matches!(schedule, Schedule::Squares { .. }));
    scenario
}

#[test]
fn direct_never_beats_the_bound() {
    for k in [0.0, 5e-4, 1e-3] {
        let mut scenario = straights_and_spins(gaussian());
        scenario.noise.wheel_sigma_m_per_sqrt_m = k;
        for ratio in ratios(&scenario, &bound(&scenario), by_direct(Direct::DEFAULT)) {
            assert!(ratio.z(1.0) > -Z_LIMIT, "k = {k}: {ratio:?}");
        }
    }
}

#[test]
fn direct_reaches_the_bound_of_its_own_runs_and_misses_that_of_the_protocol_for_the_squares() {
    // Without its outlier rule, which throws away 2 % of what Gaussian spins tell.
    let direct = || by_direct(Direct { outliers: MedianMad { cut: f64::INFINITY } });
    let scenario = paper();
    let own = straights_and_spins(scenario.clone());
    let (whole_bound, own_bound) = (bound(&scenario), bound(&own));
    for (parameter, ratio) in TRACKED.into_iter().zip(ratios(&scenario, &whole_bound, direct())) {
        let of = |bound: &FisherInformation| bound.bound_var(parameter).expect("seen");
        let unused = of(&own_bound) / of(&whole_bound);
        // Ten squares tell a third of all there is.
        assert!(unused > 1.5, "{parameter:?}: {unused}");
        assert!(ratio.z(unused).abs() < Z_LIMIT, "{parameter:?}: {ratio:?}, and {unused} for the squares");
    }
}
