//! The paper's robot under the paper's protocols: `direct` gives its parameters back, UMBmark reads what
//! follows from them.

use bench::Moments;
use calib::methods::direct::Direct;
use calib::methods::umbmark::{Form, Umbmark};
use calib::{Method, Parameter};
use dataset::{RunInfo, Session};
use motion_programs::Schedule;
use scenario::{Instrument, Scenario};

fn paper() -> Scenario {
    Scenario::read(&std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/paper.toml"))
        .expect("the shipped scenario")
}

/// The paper's robot with every chance taken away, its counts unrounded.
fn noise_free(mut scenario: Scenario) -> Scenario {
    scenario.noise.wheel_sigma_m_per_sqrt_m = 0.0;
    scenario.instruments = vec![Instrument::FloorGrid { resolution_m: 0.0, reading_sigma_m: 0.0 }];
    scenario.effects.retain(|effect| matches!(effect.id(), "wheel_scale" | "wheel_mismatch"));
    scenario
}

fn mm_per_pulse(calibration: &calib::Calibration, parameter: Parameter, ticks_per_pulse: f64) -> f64 {
    calibration.estimate(parameter).expect("the robot reports ticks").value * ticks_per_pulse * 1e3
}

/// The contradiction in table 2: the robot of table 2's direct column, driven round 4 m squares on nominal
/// odometry.
#[test]
fn paper_umbmark_of_the_direct_parameters_to_the_last_digit() {
    let mut scenario = noise_free(paper());
    scenario.protocols = vec![Schedule::Squares { side_m: 4.0, runs_each_way: 1 }];
    let simulation = sim_yair::simulate(&scenario, 1, 0).expect("simulates");
    for (form, left, right, base) in
        [(Form::X, "1.00069", "0.99931", "350.54"), (Form::Y, "1.00047", "0.99953", "352.42")]
    {
        let found = Umbmark { form }.calibrate(&[simulation.dataset.session()]).expect("squares both ways");
        // A tick is one of the controller's 80 counts a nominal millimetre.
        assert_eq!(format!("{:.5}", mm_per_pulse(&found, Parameter::LeftPerTick, 80.0)), left, "{form:?}");
        assert_eq!(format!("{:.5}", mm_per_pulse(&found, Parameter::RightPerTick, 80.0)), right, "{form:?}");
        assert_eq!(format!("{:.2}", found.geometry.wheel_separation_m() * 1e3), base, "{form:?}");
    }
}

#[test]
fn paper_direct_is_exact_without_noise() {
    let mut scenario = noise_free(paper());
    scenario.protocols = vec![
        Schedule::Straights { length_m: 0.5, runs: 2 },
        Schedule::Spins { turn_rad: std::f64::consts::TAU, runs: 2 },
    ];
    let simulation = sim_yair::simulate(&scenario, 1, 0).expect("simulates");
    let found = Direct::DEFAULT.calibrate(&[simulation.dataset.session()]).expect("straights and spins");
    // Whole counts are commanded and the wheels stop where they began within a count: nothing is rounded, so
    // 1e-9 is left for f64.
    assert!((mm_per_pulse(&found, Parameter::LeftPerTick, 80.0) / 1.0334 - 1.0).abs() < 1e-9);
    assert!((mm_per_pulse(&found, Parameter::RightPerTick, 80.0) / 1.0322 - 1.0).abs() < 1e-9);
    assert!((found.geometry.wheel_separation_m() / 0.363 - 1.0).abs() < 1e-9);
}

/// Which runs a calibration is given.
type Subset = (&'static str, fn(&RunInfo) -> bool);

fn forward(info: &RunInfo) -> bool {
    info.settings.length_m.is_none_or(|length_m| length_m > 0.0)
}

fn backward(info: &RunInfo) -> bool {
    info.settings.length_m.is_none_or(|length_m| length_m < 0.0)
}

fn counter_clockwise(info: &RunInfo) -> bool {
    info.settings.turn_rad.is_none_or(|turn_rad| turn_rad > 0.0)
}

fn clockwise(info: &RunInfo) -> bool {
    info.settings.turn_rad.is_none_or(|turn_rad| turn_rad < 0.0)
}

/// 5000 trials of the paper's protocol with its noise. Rejects, as was tried: unsigned chords (the left wheel
/// off by 0.016 % over all runs, twice that backward) and (14) as printed (the wheelbase off by 3.4 % over
/// all spins).
#[test]
fn paper_direct_gives_the_robot_back_in_every_direction() {
    let mut scenario = paper();
    scenario.protocols.retain(|part| !matches!(part, Schedule::Squares { .. }));
    let subsets: [Subset; 5] = [
        ("all", |_| true),
        ("forward", forward),
        ("backward", backward),
        ("counter-clockwise", counter_clockwise),
        ("clockwise", clockwise),
    ];
    let truth = [
        (Parameter::LeftPerTick, 1.0334e-3),
        (Parameter::RightPerTick, 1.0322e-3),
        (Parameter::WheelSeparation, 0.363),
    ];
    let mut errors = [[Moments::default(); 3]; 5];
    let mut trial = bench::Trial::new(&scenario, 815).expect("simulates");
    for number in 0..5000 {
        let whole: Session<'_> = trial.drive(number).expect("drives");
        for ((_, keep), errors) in subsets.iter().zip(&mut errors) {
            let mut session = whole.clone();
            session.runs.retain(|run| keep(run.info()));
            let found = Direct::DEFAULT.calibrate(&[session]).expect("straights and spins");
            for ((parameter, truth), errors) in truth.iter().zip(errors) {
                errors.push(100.0 * (found.estimate(*parameter).expect("reported").value / truth - 1.0));
            }
        }
    }
    for ((subset, _), errors) in subsets.iter().zip(&errors) {
        for ((parameter, _), errors) in truth.iter().zip(errors) {
            let (bias, mcse) = errors.bias().expect("many");
            assert!(mcse <= 0.003, "{subset} {}: Monte-Carlo error {mcse} %", parameter.key());
            // Three standard errors and 0.01 %: the bar that the method was set.
            assert!(bias.abs() <= 3.0 * mcse + 0.01, "{subset} {}: bias {bias} ± {mcse} %", parameter.key());
        }
    }
}

/// A calibrator drives the robot itself, through the trait that a real robot could implement. Five standard
/// deviations for each method, on one fixed seed.
#[test]
fn each_method_drives_its_own_protocol_on_the_simulated_robot() {
    let scenario = paper();
    for method in calib::METHODS {
        let mut robot = sim_yair::SimulatedRobot::new(&scenario, 4, 0).expect("simulates");
        let found = calib::drive_and_calibrate(&mut robot, *method, None);
        if method.name() == "tachometer" {
            let refused = found.expect_err("the paper has no tachometer").to_string();
            assert!(refused.contains("wheel_reference.csv"), "{refused}");
            continue;
        }
        let base = found.expect("drives and calibrates").estimate(Parameter::WheelSeparation).expect("a wheelbase");
        let expected_m = match method.name() {
            // UMBmark reads the unmeasured scale of 3.3 % as a short wheelbase: 350.54 mm, as above; by
            // headings it is 363/1.0328.
            "umbmark" => 0.35054,
            "jung_chung" => 0.35147,
            _ => 0.363,
        };
        let sigma_m = base.sigma.expect("many runs");
        assert!((base.value - expected_m).abs() < 5.0 * sigma_m, "{}: {} ± {sigma_m}", method.name(), base.value);
    }
}

/// The paper's straights and spins, simulated once.
fn straights_and_spins(mut scenario: Scenario) -> dataset::Dataset {
    scenario.protocols = vec![
        Schedule::Straights { length_m: 0.5, runs: 82 },
        Schedule::Spins { turn_rad: std::f64::consts::TAU, runs: 30 },
    ];
    sim_yair::simulate(&scenario, 77, 0).expect("simulates").dataset
}

/// (4) and (5): C = (1+α_c) C_nom + ε_c with ε_c normal, drawn anew every run. Five standard errors of a mean
/// and of a variance over 4000 runs.
#[test]
fn paper_eq_4_and_5_the_sensitivity_is_normal_about_its_corrected_nominal() {
    let mut scenario = noise_free(paper());
    let sigma = 2.03e-3 / 1.0334;
    scenario.noise.sensitivity_sigma = sigma;
    scenario.protocols = vec![Schedule::Straights { length_m: 0.5, runs: 4000 }];
    let measured = sim_yair::simulate(&scenario, 78, 0).expect("simulates").dataset;
    let values = Direct::straight_values(&[measured.session()]).expect("marks beside the axle");
    for (values, mean) in [(&values.left, 1.0334), (&values.right, 1.0322)] {
        let mut relative = Moments::default();
        // Metres a radian over the nominal 80 mm: the sensitivity over its nominal 1 mm/pulse.
        values.iter().for_each(|value| relative.push(value.value / 0.08 / mean - 1.0));
        let (bias, error) = relative.bias().expect("many");
        assert!(bias.abs() < 5.0 * error, "{bias} ± {error}");
        let (variance, _) = relative.variance().expect("many");
        assert!((variance / (sigma * sigma) - 1.0).abs() < 5.0 * (2.0_f64 / 4000.0).sqrt(), "{variance}");
    }
}

/// (9): the sensitivity is the wheel's arc over its pulses.
#[test]
fn paper_eq_9_the_sensitivity_is_the_arc_over_the_pulses() {
    let mut scenario = noise_free(paper());
    scenario.protocols = vec![Schedule::Straights { length_m: 0.5, runs: 2 }];
    let simulation = sim_yair::simulate(&scenario, 79, 0).expect("simulates");
    let session = simulation.dataset.session();
    let values = Direct::straight_values(std::slice::from_ref(&session)).expect("marks beside the axle");
    for (run, truth) in session.runs.iter().zip(&simulation.truth.runs) {
        let turn_rad = truth.end_theta_rad - truth.start_theta_rad;
        let chord_m = (truth.end_x_m - truth.start_x_m).hypot(truth.end_y_m - truth.start_y_m);
        let centre_m =
            chord_m / kinematics::sinc(0.5 * turn_rad) * run.info().settings.length_m.expect("a straight").signum();
        let arc_m = centre_m - 0.5 * 0.363 * turn_rad;
        let pulses = run.ticks().expect("ticks").left / 80.0;
        let found = values.left.iter().find(|value| value.run == run.info().id).expect("valued").value / 0.08;
        // mm/pulse; a few roundings.
        assert!((found - 1e3 * arc_m / pulses).abs() < 1e-12, "{found}");
    }
}

/// (10): B = (1+α_b) d.
#[test]
fn paper_eq_10_the_wheelbase_is_its_corrected_nominal() {
    let mut scenario = noise_free(paper());
    scenario.effects.push(effects::Effect::Wheelbase(effects::Wheelbase { ratio: 1.02 }));
    let measured = straights_and_spins(scenario);
    let found = Direct::DEFAULT.calibrate(&[measured.session()]).expect("straights and spins");
    assert!((found.geometry.wheel_separation_m() / (1.02 * 0.363) - 1.0).abs() < 1e-9);
}

/// (12) and (13): B = (φ_R + φ_L)/2 with φ_i = 2 C_i ΔN_i/θ, pulses and turn taken by their size as the paper
/// prints them.
#[test]
fn paper_eq_12_and_13_the_base_is_the_mean_of_the_circles_of_both_contacts() {
    let simulation = {
        let mut scenario = noise_free(paper());
        scenario.protocols = vec![Schedule::Spins { turn_rad: std::f64::consts::TAU, runs: 2 }];
        sim_yair::simulate(&scenario, 80, 0).expect("simulates")
    };
    let session = simulation.dataset.session();
    let m_per_rad = kinematics::Wheels { left: 0.08 * 1.0334, right: 0.08 * 1.0322 };
    let values = Direct::spin_values(std::slice::from_ref(&session), m_per_rad).expect("marks beside the axle");
    for ((run, truth), (value, _)) in session.runs.iter().zip(&simulation.truth.runs).zip(&values) {
        let turn_rad = (truth.end_theta_rad - truth.start_theta_rad).abs();
        let pulses = run.ticks().expect("ticks").map(|counts| counts.abs() / 80.0);
        let circle_mm = kinematics::Wheels {
            left: 2.0 * 1.0334 * pulses.left / turn_rad,
            right: 2.0 * 1.0322 * pulses.right / turn_rad,
        };
        assert!((1e3 * value.value - 0.5 * (circle_mm.right + circle_mm.left)).abs() < 1e-9, "{}", value.value);
    }
}

/// "Statistical filtering rejects atypical values": three skids of the left wheel by 3 % are thrown out, on
/// the left wheel only, and without the rule the sensitivity is off by far more than its standard deviation.
#[test]
fn paper_outliers_are_rejected_wheel_by_wheel() {
    let mut measured = straights_and_spins(paper());
    for run in measured.runs.iter_mut().take(3) {
        let dataset::WheelLog::Ticks(ticks) = &mut run.odometry.wheels else { panic!("the simulator logs ticks") };
        let (first, last) = (ticks.left[0], ticks.left.len() - 1);
        let skidded = first + (1.03 * (ticks.left[last] - first) as f64).round() as i64;
        ticks.left[last] = skidded;
    }
    let found = Direct::DEFAULT.calibrate(&[measured.session()]).expect("straights and spins");
    let rejected: Vec<_> = found.runs_rejected.iter().filter(|run| run.run.starts_with("straight")).collect();
    assert_eq!(rejected.len(), 3, "{rejected:?}");
    assert!(rejected.iter().all(|run| run.why.starts_with("left")));
    let left = found.estimate(Parameter::LeftPerTick).expect("reported");
    let sigma = left.sigma.expect("many runs");
    assert!((left.value - 1.0334e-3).abs() < 4.0 * sigma, "{} ± {sigma}", left.value);
    let unfiltered = Direct { outliers: calib::MedianMad { cut: f64::INFINITY } };
    let off = unfiltered.calibrate(&[measured.session()]).expect("straights and spins");
    assert!((off.estimate(Parameter::LeftPerTick).expect("reported").value - 1.0334e-3).abs() > 4.0 * sigma);
}
