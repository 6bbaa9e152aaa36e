//! The Cramér–Rao bound against what does not share its code: textbook cases by hand, finite differences, a
//! batch over raw readings, simulated robots, and estimators that must not beat it and one that must reach
//! it.
//!
//! Statistical tests have fixed seeds; their limits are z scores with Monte-Carlo errors from the samples
//! themselves, and each says its rate of false positives.

mod batch;
mod efficiency;
mod noise_model;

use bench::{FisherInformation, LinearizedInnovation, NoBound};
use calib::Parameter;
use dataset::{Protocol, ProtocolSettings, Run};
use effects::{ContactPatchWheelbase, Effect, SlipSpeed, WheelMismatch, WheelScale, Wheelbase};
use kinematics::{DriveGeometry, Increment, Pose, Wheels};
use motion_programs::{Motion, MotionProgram, Platform, Schedule};
use nalgebra::{Matrix3, Vector3};
use scenario::{Engine, Instrument, Scenario};
use sim_yair::SimulatedRobot;

use batch::{Batch, Wrong};

fn paper() -> Scenario {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/paper.toml");
    Scenario::read(&path).expect("the shipped scenario")
}

/// The paper's robot as it believes itself to be, with marks over its wheels and nothing random but the
/// readings.
fn ideal(reading_sigma_m: f64) -> Scenario {
    let mut scenario = paper();
    scenario.effects.clear();
    scenario.noise.wheel_sigma_m_per_sqrt_m = 0.0;
    scenario.instruments = vec![Instrument::FloorGrid { resolution_m: 0.0, reading_sigma_m }];
    for mark in &mut scenario.robot.points {
        mark.y_m = 0.5 * 0.363 * mark.y_m.signum();
    }
    scenario
}

fn capture(rate_hz: f64) -> Instrument {
    Instrument::MotionCapture {
        rate_hz,
        sigma_xy_m: 3e-4,
        sigma_theta_rad: 5e-4,
        latency_s: 0.0,
        lever_x_m: 0.12,
        lever_y_m: -0.07,
        lever_theta_rad: 0.4,
    }
}

fn program(motions: &[Motion]) -> MotionProgram {
    let settings = ProtocolSettings::default();
    MotionProgram { id: "run".to_owned(), protocol: Protocol::Free, settings, motions: motions.to_vec() }
}

fn square(side_m: f64) -> Vec<Motion> {
    let side = [Motion::Straight { length_m: side_m }, Motion::Spin { turn_rad: std::f64::consts::FRAC_PI_2 }];
    side.repeat(4)
}

fn information(scenario: &Scenario, schedules: &[Schedule]) -> FisherInformation {
    let programs: Vec<_> = schedules.iter().flat_map(Schedule::programs).collect();
    FisherInformation::of(scenario, &programs).expect("bounded")
}

fn close(value: f64, expected: f64, relative: f64) {
    assert!((value / expected - 1.0).abs() < relative, "{value} is not {expected}");
}

/// Largest difference of two information matrices, in shares of their diagonal.
fn difference(a: &Matrix3<f64>, b: &Matrix3<f64>) -> f64 {
    let unit = Matrix3::from_diagonal(&a.diagonal().map(|value| 1.0 / value.sqrt()));
    (unit * (a - b) * unit).abs().max()
}

#[test]
fn straights_under_reading_errors_alone_give_c_to_the_textbook_variance() {
    let (sigma_m, length_m, runs) = (5e-4, 0.5, 82);
    let scenario = ideal(sigma_m);
    let found = information(&scenario, &[Schedule::Straights { length_m, runs }]);
    // Each wheel's path is the distance of two readings of the mark above it: C varies by 2σ²/N² a run. That
    // the middle's path across and the heading tell the same turn adds nothing: with equal errors at both
    // ends the two are one measurement.
    let ticks = length_m / (std::f64::consts::PI * 0.16) * scenario.robot.encoder.counts_per_wheel_turn();
    let textbook = 2.0 * sigma_m * sigma_m / (ticks * ticks) / f64::from(runs);
    for parameter in [Parameter::LeftPerTick, Parameter::RightPerTick] {
        // A dozen roundings through inverses of condition 1e4.
        close(found.bound_var(parameter).expect("seen"), textbook, 1e-9);
    }
    assert_eq!(found.bound_var(Parameter::WheelSeparation), None);
}

#[test]
fn spins_beside_straights_give_the_separation_to_the_textbook_variance() {
    let (sigma_m, length_m, turn_rad) = (5e-4, 0.5, std::f64::consts::TAU);
    let scenario = ideal(sigma_m);
    let straights = Schedule::Straights { length_m, runs: 82 };
    let spins = Schedule::Spins { turn_rad, runs: 30 };
    assert_eq!(information(&scenario, &[spins]).bound_var(Parameter::WheelSeparation), None, "C and B together turn");
    // B = (C_R + C_L) N/θ: its relative error is that of the mean sensitivity, σ² over L² a straight (the
    // middle of two marks, twice), and that of the turn: two axles of marks at ±b/2, 2·2σ²/b², a spin. The
    // commanded turn is rounded to whole counts: 1e-5.
    let relative = sigma_m * sigma_m / (length_m * length_m) / 82.0
        + 4.0 * sigma_m * sigma_m / (0.363 * 0.363) / (turn_rad * turn_rad) / 30.0;
    let var = information(&scenario, &[straights, spins]).bound_var(Parameter::WheelSeparation).expect("seen");
    close(var, relative * 0.363 * 0.363, 5e-5);
}

#[test]
fn contact_patch_alone_leaves_its_own_variance_over_the_spins() {
    // Readings of a micrometre: what is left is σ_b² a spin.
    let mut scenario = ideal(1e-6);
    scenario.effects = vec![Effect::ContactPatchWheelbase(ContactPatchWheelbase {
        sigma_m: 1e-3,
        slow_sigma_m: 0.0,
        slow_length_m: 0.0,
    })];
    let schedules = [
        Schedule::Straights { length_m: 5.0, runs: 100 },
        Schedule::Spins { turn_rad: std::f64::consts::TAU, runs: 30 },
    ];
    let var = information(&scenario, &schedules).bound_var(Parameter::WheelSeparation).expect("seen");
    // The turn's reading is 4σ²B²/(b²θ²) of a spin: 1e-7 of σ_b².
    close(var, 1e-6 / 30.0, 1e-6);
}

/// The pose where a program ends by a geometry, from the run's counts.
fn reckoned(scenario: &Scenario, motions: &[Motion], diameter_m: Wheels<f64>, separation_m: f64) -> Pose {
    let geometry = DriveGeometry::new(diameter_m, separation_m).expect("a drive");
    let nominal = scenario.nominal_geometry().expect("a drive");
    let counts_per_turn = scenario.robot.encoder.counts_per_wheel_turn();
    let (by_nominal, by_geometry) =
        (nominal.m_per_count(counts_per_turn).expect("counts"), geometry.m_per_count(counts_per_turn).expect("counts"));
    motions.iter().fold(Pose::IDENTITY, |pose, motion| {
        let increment = match *motion {
            Motion::Straight { length_m } => Increment { distance_m: length_m, turn_rad: 0.0 },
            Motion::Spin { turn_rad } | Motion::SpinAt { turn_rad, .. } => Increment { distance_m: 0.0, turn_rad },
            Motion::Arc { radius_m, turn_rad } => Increment { distance_m: radius_m * turn_rad.abs(), turn_rad },
            Motion::Pause { .. } | Motion::Measure => Increment::default(),
        };
        let counts = nominal.travel_m(increment).zip_with(by_nominal, |travel_m, m| (travel_m / m).round());
        pose * geometry.increment(counts.zip_with(by_geometry, |counts, m| counts * m)).arc()
    })
}

#[test]
fn slopes_are_central_differences_and_would_not_pass_wrong() {
    let scenario = paper();
    let truth = scenario.true_geometry().expect("a drive");
    let (diameter_m, separation_m) = (truth.wheel_diameter_m(), truth.wheel_separation_m());
    let straight = [Motion::Straight { length_m: -0.5 }];
    let spin = [Motion::Spin { turn_rad: std::f64::consts::TAU }];
    let arc = [Motion::Arc { radius_m: 0.7, turn_rad: -2.0 }, Motion::Straight { length_m: 1.0 }];
    for motions in [&straight[..], &spin, &arc, &square(4.0)] {
        let innovations = LinearizedInnovation::of_run(&scenario, &program(motions)).expect("bounded");
        let slope = innovations[0].slope;
        let h = 1e-7;
        let end = |left: f64, right: f64, separation: f64| {
            let diameter_m = Wheels { left: diameter_m.left + left, right: diameter_m.right + right };
            let pose = reckoned(&scenario, motions, diameter_m, separation_m + separation);
            Vector3::new(pose.x_m, pose.y_m, pose.theta_rad)
        };
        let columns = [
            end(h, 0.0, 0.0) - end(-h, 0.0, 0.0),
            end(0.0, h, 0.0) - end(0.0, -h, 0.0),
            end(0.0, 0.0, h) - end(0.0, 0.0, -h),
        ];
        for (column, difference) in columns.iter().enumerate() {
            let difference = difference / (2.0 * h);
            let off = (slope.column(column) - difference).abs().max();
            // Truncation h²/6 times a third derivative: 16 m of wheel turn the square by 16/(d·B) = 275
            // rad/m, 4 m times its cube is 8e7 m/m³:
            // 1.4e-7. Rounding: 1e-15 of 16 m over 1e-7, 2e-7.
            let tolerance = 5e-7;
            assert!(off < tolerance, "{motions:?} {column}: {off}");
            assert!((slope.column(column) - difference.add_scalar(1e-3)).abs().max() > tolerance);
        }
    }
}

/// Everything random at once, and rounded counts that do not come out even.
fn everything() -> Scenario {
    let mut scenario = paper();
    scenario.noise.sensitivity_sigma = 7e-4;
    scenario
}

#[test]
fn information_is_that_of_a_batch_over_all_raw_readings() {
    let mut captured = everything();
    captured.instruments = vec![capture(10.0)];
    let mut both = everything();
    both.instruments.insert(0, capture(7.0));
    let measured = [
        Motion::Straight { length_m: 0.5003 },
        Motion::Measure,
        Motion::Spin { turn_rad: 2.0 },
        Motion::Pause { duration_s: 0.3 },
        Motion::Measure,
        Motion::Arc { radius_m: 0.4, turn_rad: -1.5 },
    ];
    let cases = [
        (&everything(), &measured[..]),
        (&captured, &measured),
        (&both, &measured),
        (&both, &square(0.5)),
        (&everything(), &square(4.0)),
    ];
    for (scenario, motions) in cases {
        let found = FisherInformation::of(scenario, &[program(motions)]).expect("bounded");
        let batch = Batch::of(scenario, motions, Wrong::Nothing);
        let off = difference(found.matrix(), &batch.information());
        // The batch's slopes are differences with a step of 1e-6: good to 1e-9 of a slope, times the
        // condition of its covariance's blocks, 1e2.
        assert!(off < 1e-6, "{off}\n{}\n{}", found.matrix(), batch.information());
        for wrong in [Wrong::NoScatterWithin, Wrong::IndependentRounding] {
            let off = difference(found.matrix(), &Batch::of(scenario, motions, wrong).information());
            // The least is the noise inside the pieces between two measurements at 7 and 10 Hz: 4e-5.
            assert!(off > 1e-5, "{wrong:?} is not told apart: {off}");
        }
    }
}

/// The scenario with its true diameters and separation changed by given shares.
fn changed(scenario: &Scenario, shares: [f64; 3]) -> Scenario {
    let [left, right, separation] = shares.map(|share| 1.0 + share);
    let ratio = right / left;
    let mut scenario = scenario.clone();
    scenario.effects.push(Effect::WheelScale(WheelScale { scale: 0.5 * left * (ratio + 1.0) }));
    scenario.effects.push(Effect::WheelMismatch(WheelMismatch { right_over_left: ratio }));
    scenario.effects.push(Effect::Wheelbase(Wheelbase { ratio: separation }));
    scenario
}

#[test]
fn what_the_covariance_tells_of_the_geometry_is_little() {
    // The second term of Kay's (3.31), ½ tr(S⁻¹ ∂ᵢS S⁻¹ ∂ⱼS), is left out of the bound: how much lower would
    // the bound be?
    let scenario = paper();
    let geometry = scenario.true_geometry().expect("a drive");
    let diameter_m = geometry.wheel_diameter_m();
    let lengths =
        Matrix3::from_diagonal(&Vector3::new(diameter_m.left, diameter_m.right, geometry.wheel_separation_m()));
    let in_covariance = |program: &MotionProgram| {
        let measurement = |scenario: &Scenario| LinearizedInnovation::of_run(scenario, program).expect("bounded")[0];
        let change = |parameter: usize| {
            let h = 1e-5;
            let at = |share: f64| {
                let mut shares = [0.0; 3];
                shares[parameter] = share;
                measurement(&changed(&scenario, shares)).covariance
            };
            measurement(&scenario).precision * (at(h) - at(-h)) / (2.0 * h)
        };
        let changes = [change(0), change(1), change(2)];
        Matrix3::from_fn(|i, j| 0.5 * (changes[i] * changes[j]).trace())
    };
    let gain = |schedules: &[Schedule]| {
        let programs: Vec<_> = schedules.iter().flat_map(Schedule::programs).collect();
        let in_mean = lengths * FisherInformation::of(&scenario, &programs).expect("bounded").matrix() * lengths;
        let both = in_mean + programs.iter().map(in_covariance).sum::<Matrix3<f64>>();
        let (lower, bound) = (both.try_inverse().expect("seen"), in_mean.try_inverse().expect("seen"));
        (0..3).map(|parameter| 1.0 - lower[(parameter, parameter)] / bound[(parameter, parameter)]).fold(0.0, f64::max)
    };
    let of_the_paper = gain(&scenario.protocols);
    let of_the_squares = gain(&[Schedule::Squares { side_m: 4.0, runs_each_way: 5 }]);
    // 1.4e-4 and 4.8e-3: the end of a square turns by 44 rad for its diameter's whole, and the ellipse of
    // its errors with it.
    assert!((1e-5..2e-4).contains(&of_the_paper), "{of_the_paper}");
    assert!((1e-3..6e-3).contains(&of_the_squares), "{of_the_squares}");
}

#[test]
fn dense_truth_tells_more_the_denser_it_is() {
    let mut scenario = everything();
    let motions =
        [Motion::Straight { length_m: 2.0 }, Motion::Spin { turn_rad: 3.0 }, Motion::Straight { length_m: 2.0 }];
    let mut previous = Vector3::zeros();
    // Each rate's measurements are among the next one's, so that information grows for certain.
    for rate_hz in [1.25, 2.5, 5.0, 10.0, 20.0] {
        scenario.instruments = vec![capture(rate_hz)];
        let found = FisherInformation::of(&scenario, &[program(&motions)]).expect("bounded");
        let diagonal = found.matrix().diagonal();
        for parameter in 0..3 {
            assert!(diagonal[parameter] > previous[parameter], "{rate_hz}: {diagonal}");
        }
        previous = diagonal;
    }
}

#[test]
fn a_program_driven_twice_tells_twice_and_an_empty_one_nothing() {
    let scenario = paper();
    let one = FisherInformation::of(&scenario, &[program(&square(1.0))]).expect("bounded");
    let two = FisherInformation::of(&scenario, &[program(&square(1.0)), program(&square(1.0))]).expect("bounded");
    assert!(difference(two.matrix(), &(2.0 * one.matrix())) < 1e-15);
    let none = FisherInformation::of(&scenario, &[program(&[])]).expect("bounded");
    assert_eq!(*none.matrix(), Matrix3::zeros());
    for parameter in Parameter::ESTIMATED {
        assert_eq!(none.bound_var(parameter), None);
    }
}

#[test]
fn measurements_are_those_of_the_simulator() {
    let motions = program(&[
        Motion::Straight { length_m: 0.61 },
        Motion::Pause { duration_s: 0.21 },
        Motion::Spin { turn_rad: -1.0 },
        Motion::Measure,
        Motion::Arc { radius_m: 0.3, turn_rad: 1.0 },
    ]);
    let measurements_s = |scenario: &Scenario| -> Vec<f64> {
        // The first measurement finds the start and is no innovation.
        let innovations = LinearizedInnovation::of_run(scenario, &motions).expect("bounded");
        std::iter::once(0.0).chain(innovations.iter().map(|innovation| innovation.t_s)).collect()
    };
    let seen_s = |scenario: &Scenario| -> Vec<f64> {
        let mut run = Run::default();
        SimulatedRobot::new(scenario, 1, 0).expect("simulates").drive_into(&motions, &mut run).expect("drives");
        let grid = run.point_readings.iter().filter(|reading| reading.point == 0).map(|reading| reading.t_s);
        let mut seen_s: Vec<f64> = run.truth.iter().map(|sample| sample.t_s).chain(grid).collect();
        seen_s.sort_by(f64::total_cmp);
        seen_s
    };
    let mut scenario = everything();
    scenario.instruments.push(capture(20.0));
    let mut ramped = scenario.clone();
    // Any effect of speed makes the closed form take ramps apart; this one is too small to matter.
    ramped.effects.push(Effect::SlipSpeed(SlipSpeed { slip_s_m: 1e-12 }));
    for scenario in [&scenario, &ramped] {
        let (measurements_s, seen_s) = (measurements_s(scenario), seen_s(scenario));
        assert_eq!(measurements_s.len(), seen_s.len());
        // Clocks sum a hundred steps of seconds.
        assert!(
            measurements_s.iter().zip(&seen_s).all(|(measurement_s, seen_s)| (measurement_s - seen_s).abs() < 1e-12)
        );
    }
    assert!(measurements_s(&ramped).len() > measurements_s(&scenario).len(), "ramps take time");
    // A stepped robot settles: it is seen as often as its ramps say or a little more.
    ramped.engine = Engine::Stepping { step_s: 1e-3 };
    let (measurements, seen) = (measurements_s(&ramped).len(), seen_s(&ramped).len());
    assert!(measurements <= seen && seen < measurements + measurements / 4, "{measurements} {seen}");
}

#[test]
fn a_scenario_without_a_bound_says_why() {
    let mut slow = paper();
    slow.effects = vec![Effect::ContactPatchWheelbase(ContactPatchWheelbase {
        sigma_m: 1e-3,
        slow_sigma_m: 1e-3,
        slow_length_m: 0.2,
    })];
    let why = FisherInformation::of(&slow, &slow.programs()).expect_err("no closed bound");
    assert_eq!(
        why.to_string(),
        "effect contact_patch_wheelbase has no closed bound: its slow part varies within a motion"
    );

    let mut blind = paper();
    blind.instruments.clear();
    assert_eq!(FisherInformation::of(&blind, &blind.programs()), Err(NoBound::NoInstrument));

    // Readings that are nothing but rounded share their rounding.
    let mut rounded = paper();
    rounded.instruments = vec![Instrument::FloorGrid { resolution_m: 1e-3, reading_sigma_m: 0.0 }];
    let why = FisherInformation::of(&rounded, &rounded.programs()).expect_err("rounding alone");
    assert!(matches!(why, NoBound::RoundedReadings { .. }), "{why}");

    let exact = ideal(0.0);
    let why = FisherInformation::of(&exact, &exact.programs()).expect_err("known without error");
    assert!(matches!(why, NoBound::NoError { .. }), "{why}");

    // Exact readings of noisy wheels are fine.
    let mut noisy = ideal(0.0);
    noisy.noise.wheel_sigma_m_per_sqrt_m = 1e-3;
    assert!(FisherInformation::of(&noisy, &noisy.programs()).is_ok());
}
