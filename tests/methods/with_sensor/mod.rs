//! `censi`, `segments` and `augmented_kalman`: the methods that take an outside instrument's poses on any
//! path, from the simulator and on real logs.

mod faults;
mod honesty;
mod khepera;
mod online;

use std::f64::consts::{FRAC_PI_2, TAU};
use std::path::Path;

use calib::methods::augmented_kalman::AugmentedKalman;
use calib::methods::censi::Censi;
use calib::methods::segments::Segments;
use calib::{CalibError, Method, Parameter};
use dataset::{Protocol, RunInfo, WheelLog};
use kinematics::{DriveGeometry, Pose, Wheels, wrap_to_pi};
use motion_programs::Schedule;
use scenario::{Engine, Instrument, Scenario};

const METHODS: [&dyn Method; 3] = [&Censi::DEFAULT, &Segments::DEFAULT, &AugmentedKalman::DEFAULT];

const DRIVE: [Parameter; 3] = [Parameter::LeftWheelDiameter, Parameter::RightWheelDiameter, Parameter::WheelSeparation];

/// Where the instrument of these tests sits on the robot.
const MOUNTED: Pose = Pose::new(0.12, -0.05, 0.4);

fn shipped(name: &str) -> Scenario {
    Scenario::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios").join(name)).expect("a shipped scenario")
}

/// Motion capture of a robot whose wheels are 1 % large, unequal by 0.2 % and 1.5 % farther apart than it
/// believes, and that is else as modelled.
fn motion_capture(body_from_sensor: Pose) -> Scenario {
    let mut scenario = shipped("motion-capture.toml");
    scenario.engine = Engine::ClosedForm;
    scenario.effects.retain(|effect| matches!(effect.id(), "wheel_scale" | "wheel_mismatch" | "wheelbase"));
    scenario.protocols = vec![
        Schedule::Straights { length_m: 1.5, runs: 8 },
        Schedule::Spins { turn_rad: TAU, runs: 8 },
        Schedule::Squares { side_m: 1.0, runs_each_way: 4 },
    ];
    let [Instrument::MotionCapture { lever_x_m, lever_y_m, lever_theta_rad, .. }] = scenario.instruments.as_mut_slice()
    else {
        panic!("one motion capture")
    };
    (*lever_x_m, *lever_y_m, *lever_theta_rad) =
        (body_from_sensor.x_m, body_from_sensor.y_m, body_from_sensor.theta_rad);
    scenario
}

fn with_instrument_sigma(mut scenario: Scenario, sigma_m: f64, sigma_rad: f64) -> Scenario {
    let [Instrument::MotionCapture { sigma_xy_m, sigma_theta_rad, .. }] = scenario.instruments.as_mut_slice() else {
        panic!("one motion capture")
    };
    (*sigma_xy_m, *sigma_theta_rad) = (sigma_m, sigma_rad);
    scenario
}

fn lengths(geometry: &DriveGeometry) -> [f64; 3] {
    let diameter_m = geometry.wheel_diameter_m();
    [diameter_m.left, diameter_m.right, geometry.wheel_separation_m()]
}

fn relative(found: &DriveGeometry, truth: &DriveGeometry) -> f64 {
    lengths(found).iter().zip(lengths(truth)).map(|(found, truth)| (found / truth - 1.0).abs()).fold(0.0, f64::max)
}

/// The paper's robot, read while it stands, with nothing left to chance and nothing rounded.
fn exact(protocols: Vec<Schedule>) -> sim_yair::Simulation {
    let mut scenario = shipped("paper.toml");
    scenario.noise.wheel_sigma_m_per_sqrt_m = 0.0;
    scenario.instruments = vec![Instrument::FloorGrid { resolution_m: 0.0, reading_sigma_m: 0.0 }];
    scenario.effects.retain(|effect| matches!(effect.id(), "wheel_scale" | "wheel_mismatch"));
    scenario.protocols = protocols;
    sim_yair::simulate(&scenario, 1, 0).expect("simulates")
}

/// Whole counts are commanded and the wheels stop where they began within a count: what is left are roundings
/// through normal equations, as in `direct`: 1e-9.
#[test]
fn without_noise_each_method_gives_the_robot_back() {
    for method in METHODS {
        let simulation = exact(method.protocol());
        let truth = DriveGeometry::new(
            Wheels { left: simulation.truth.left_wheel_diameter_m, right: simulation.truth.right_wheel_diameter_m },
            simulation.truth.wheel_separation_m,
        )
        .expect("a drive");
        let found = method.calibrate(&[simulation.dataset.session()]).expect("its own protocol");
        assert!(found.converged, "{}", method.name());
        assert!(relative(&found.geometry, &truth) < 1e-9, "{}: {:?} {truth:?}", method.name(), found.geometry);
        // What must not pass: the wheels for each other.
        let mut swapped = simulation.dataset.clone();
        for run in &mut swapped.runs {
            let WheelLog::Ticks(ticks) = &mut run.odometry.wheels else { panic!("the simulator logs ticks") };
            std::mem::swap(&mut ticks.left, &mut ticks.right);
        }
        let wrong = method.calibrate(&[swapped.session()]);
        assert!(wrong.is_err() || relative(&wrong.expect("found").geometry, &truth) > 1e-4, "{}", method.name());
    }
}

/// The same through marks that are measured in a frame that is not the drive's: the frame is what `censi`
/// finds.
#[test]
fn without_noise_censi_gives_the_mounting_back() {
    let mut simulation = exact(Censi::DEFAULT.protocol());
    for point in &mut simulation.dataset.points {
        point.body = MOUNTED.inverse() * point.body;
    }
    let found = Censi::DEFAULT.calibrate(&[simulation.dataset.session()]).expect("its own protocol");
    let place = MOUNTED.to(found.extrinsics.expect("censi finds it").body_from_sensor);
    // Roundings as above, on a lever of 0.13 m.
    let off = place.x_m.abs().max(place.y_m.abs()).max(wrap_to_pi(place.theta_rad).abs());
    assert!(off < 1e-9, "{place:?}");
    assert!((found.geometry.wheel_separation_m() / 0.363 - 1.0).abs() < 1e-9);
    // The pose of the drive in the sensor's frame would not pass.
    assert!(
        MOUNTED.inverse().position().distance_m(found.extrinsics.expect("found").body_from_sensor.position()) > 1e-2
    );
}

/// Which runs a method is left with.
type Keep = fn(&RunInfo) -> bool;

#[test]
fn paths_that_do_not_show_it_are_refused_and_the_reason_says_what_to_drive() {
    let of = |protocols| exact(protocols).dataset;
    let dataset = of(vec![
        Schedule::Straights { length_m: 1.0, runs: 4 },
        Schedule::Spins { turn_rad: FRAC_PI_2, runs: 4 },
        // Whole turns of this robot, whose wheels are 3.28 % larger than it believes.
        Schedule::Spins { turn_rad: TAU / 1.0328, runs: 4 },
        Schedule::Circles { radius_m: 0.5, turns: Some(0.5), runs_each_way: 2 },
    ]);
    let straight: Keep = |info| info.protocol == Some(Protocol::Straight);
    let spin: Keep = |info| info.protocol == Some(Protocol::Spin);
    let whole: Keep = |info| {
        info.protocol == Some(Protocol::Straight) || info.settings.turn_rad.is_some_and(|turn_rad| turn_rad.abs() > 6.0)
    };
    let one_way: Keep = |info| info.protocol == Some(Protocol::CircleCw);
    let free: Keep = |info| info.protocol == Some(Protocol::Free);
    let (censi, segments, filter) = (METHODS[0], METHODS[1], METHODS[2]);
    let refusals = [
        (censi, straight, "the robot drives straight: add spins"),
        (censi, spin, "the robot spins: add straight runs"),
        (censi, whole, "whole turns only; add measurements after quarter turns"),
        (censi, one_way, "one arc: add straight runs and spins, or arcs to the other side"),
        (censi, free, "displacement.csv"),
        (segments, straight, "wheel_separation_m is not observable"),
        (segments, spin, "common_scale is not observable"),
        (segments, free, "the robot's pose at two instants"),
        (filter, straight, "wheel_separation_m is not observable"),
        (filter, spin, "common_scale is not observable"),
        (filter, free, "the robot's pose at two instants"),
    ];
    for (number, (method, keep, why)) in refusals.into_iter().enumerate() {
        let refusal = method.calibrate(&[dataset.session_of(keep)]).expect_err("refused");
        assert!(matches!(refusal, CalibError::NotApplicable { .. } | CalibError::Unobservable { .. }), "{refusal:?}");
        let refusal = refusal.to_string();
        assert!(refusal.starts_with(method.name()) && refusal.contains(why), "{number}: {refusal}");
    }
    // And with everything none of them is.
    for method in METHODS {
        assert!(method.calibrate(&[dataset.session()]).is_ok(), "{}", method.name());
    }
}
