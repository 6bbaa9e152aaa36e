//! The paper's robot under the paper's protocols: `direct` gives its parameters back, UMBmark reads what the digest derived.

use bench::Moments;
use calib::methods::direct::Direct;
use calib::methods::umbmark::{Form, Umbmark};
use calib::{Method, Parameter};
use dataset::{RunInfo, Schedule, Session};
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

/// Digest, contradiction 2: the robot of table 2's direct column, driven round 4 m squares on nominal odometry.
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
    // Whole counts are commanded and the wheels stop where they began within a count: nothing is rounded, so 1e-9 is left for f64.
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

/// 5000 trials of the paper's protocol with its noise. Rejects, as was tried: unsigned chords (the left wheel off by 0.016 % over all runs, twice that
/// backward) and (14) as printed (the wheelbase off by 3.4 % over all spins).
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

/// A calibrator drives the robot itself, through the trait that a real robot could implement. Five standard deviations on three numbers of one fixed seed.
#[test]
fn each_method_drives_its_own_protocol_on_the_simulated_robot() {
    let scenario = paper();
    for method in calib::METHODS {
        let mut robot = sim_yair::SimulatedRobot::new(&scenario, 4, 0).expect("simulates");
        let found = calib::drive_and_calibrate(&mut robot, *method, None).expect("drives and calibrates");
        let base = found.estimate(Parameter::WheelSeparation).expect("every method gives a wheelbase");
        // UMBmark reads the unmeasured scale of 3.3 % as a short wheelbase: the digest's 350.54 mm.
        let expected_m = if method.name() == "umbmark" { 0.35054 } else { 0.363 };
        let sigma_m = base.sigma.expect("many runs");
        assert!((base.value - expected_m).abs() < 5.0 * sigma_m, "{}: {} ± {sigma_m}", method.name(), base.value);
    }
}
