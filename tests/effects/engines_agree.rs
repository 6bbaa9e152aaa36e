//! Two engines, one meaning: motors under their controllers in 1 ms steps, and whole motions in closed form,
//! scatter alike.
//!
//! Compared is what dead reckoning misses: the true end seen from the true start, against the end by the
//! counts. Moments of both engines are compared by z tests at 4.5 standard errors, a false positive of 7e-6
//! each. Every comparison is also made against a closed form without the noise inside an arc (the L²/12
//! term), which must be discriminated: it was.

use dataset::{Protocol, ProtocolSettings, Run, RunView};
use kinematics::{BridgeCovariance, Increment, Pose, Rule, Wheels};
use motion_programs::{Motion, MotionProgram, Platform};
use rayon::prelude::*;
use scenario::{Engine, Scenario};
use sim_yair::SimulatedRobot;

const K_M_PER_SQRT_M: f64 = 2e-3;
const Z_LIMIT: f64 = 4.5;

fn scenario(engine: Engine) -> Scenario {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/paper.toml");
    let mut scenario = Scenario::read(&path).expect("the shipped scenario");
    scenario.engine = engine;
    scenario.noise.wheel_sigma_m_per_sqrt_m = K_M_PER_SQRT_M;
    scenario.effects.retain(|effect| effect.id() != "quantization");
    // The chips start together here: a late right wheel bends the path by v·δ/b, which counts read at
    // standstills cannot show.
    scenario.robot.controller.right_phase_s = 0.0;
    scenario
}

fn program(motions: &[Motion]) -> MotionProgram {
    let settings = ProtocolSettings::default();
    MotionProgram { id: "run".to_owned(), protocol: Protocol::Free, settings, motions: motions.to_vec() }
}

/// What dead reckoning missed in `trials` runs: true end minus dead-reckoned end, seen from the start.
fn missed(engine: Engine, motions: &[Motion], trials: u64) -> Vec<Pose> {
    let (scenario, program) = (scenario(engine), program(motions));
    (0..trials)
        .into_par_iter()
        .map(|trial| {
            let mut robot = SimulatedRobot::new(&scenario, 31, trial).expect("simulates");
            let mut run = Run::default();
            robot.drive_into(&program, &mut run).expect("drives");
            let (start, end) = robot.last_true_ends();
            let (nominal, geometry) = (robot.robot(), robot.true_geometry());
            let mut dead_reckoned = Pose::IDENTITY;
            let dataset = dataset::Dataset {
                provenance: dataset::Provenance::default(),
                robot: nominal,
                truth_noise: dataset::TruthNoise::default(),
                points: Vec::new(),
                runs: vec![run],
            };
            let view: RunView<'_> = dataset.session().runs[0];
            view.dead_reckon(&nominal, &geometry, Rule::ExactArc, Pose::IDENTITY, |_, pose| dead_reckoned = pose);
            let seen = start.to(end);
            Pose::new(
                seen.x_m - dead_reckoned.x_m,
                seen.y_m - dead_reckoned.y_m,
                seen.theta_rad - dead_reckoned.theta_rad,
            )
        })
        .collect()
}

/// Largest |z| over the three means, three variances and the covariance of y and θ.
fn largest_z(a: &[Pose], b: &[Pose]) -> f64 {
    let moment = |of: &dyn Fn(&Pose) -> f64| {
        let summary = |sample: &[Pose]| {
            let n = sample.len() as f64;
            let mean = sample.iter().map(of).sum::<f64>() / n;
            (mean, sample.iter().map(|pose| (of(pose) - mean).powi(2)).sum::<f64>() / (n - 1.0) / n)
        };
        let ((mean_a, var_a), (mean_b, var_b)) = (summary(a), summary(b));
        (mean_a - mean_b).abs() / (var_a + var_b).sqrt().max(f64::MIN_POSITIVE)
    };
    [
        moment(&|pose| pose.x_m),
        moment(&|pose| pose.y_m),
        moment(&|pose| pose.theta_rad),
        moment(&|pose| pose.x_m * pose.x_m),
        moment(&|pose| pose.y_m * pose.y_m),
        moment(&|pose| pose.theta_rad * pose.theta_rad),
        moment(&|pose| pose.y_m * pose.theta_rad),
    ]
    .into_iter()
    .fold(0.0, f64::max)
}

/// The wrong specimen: each motion as one arc with the wheels' noise summed and nothing inside.
fn without_noise_inside(motions: &[Motion], trials: u64) -> Vec<Pose> {
    let geometry = scenario(Engine::ClosedForm).true_geometry().expect("valid");
    let nominal = scenario(Engine::ClosedForm).nominal_geometry().expect("valid");
    (0..trials)
        .map(|trial| {
            let mut stream =
                effects::Address { seed: 77, point: 0, trial, run: 0 }.stream(effects::StreamName::new("specimen"));
            let (mut world, mut dead_reckoned) = (Pose::IDENTITY, Pose::IDENTITY);
            for motion in motions {
                let increment = match *motion {
                    Motion::Straight { length_m } => Increment { distance_m: length_m, turn_rad: 0.0 },
                    Motion::Spin { turn_rad } | Motion::SpinAt { turn_rad, .. } => {
                        Increment { distance_m: 0.0, turn_rad }
                    }
                    _ => continue,
                };
                let scale = geometry.wheel_diameter_m().zip_with(nominal.wheel_diameter_m(), |a, b| a / b);
                let travel_m = nominal.travel_m(increment).zip_with(scale, |travel_m, scale| travel_m * scale);
                let noisy_m = travel_m.map(|m| m + K_M_PER_SQRT_M * m.abs().sqrt() * stream.normal());
                world = world * geometry.increment(noisy_m).arc();
                dead_reckoned = dead_reckoned * geometry.increment(travel_m).arc();
            }
            Pose::new(
                world.x_m - dead_reckoned.x_m,
                world.y_m - dead_reckoned.y_m,
                world.theta_rad - dead_reckoned.theta_rad,
            )
        })
        .collect()
}

fn agree(motions: &[Motion], stepped: u64, closed: u64) {
    let stepped = missed(Engine::Stepping { step_s: 1e-3 }, motions, stepped);
    let closed = missed(Engine::ClosedForm, motions, closed);
    let z = largest_z(&stepped, &closed);
    assert!(z < Z_LIMIT, "the engines differ: z = {z}");
    let wrong = largest_z(&stepped, &without_noise_inside(motions, 40_000));
    assert!(wrong > Z_LIMIT, "a closed form without the noise inside its arcs is not discriminated: z = {wrong}");
}

#[test]
fn a_straight_scatters_alike_in_both_engines() {
    agree(&[Motion::Straight { length_m: 2.0 }], 3000, 40_000);
}

#[test]
fn a_spin_scatters_alike_in_both_engines() {
    agree(&[Motion::Spin { turn_rad: std::f64::consts::TAU }], 2000, 40_000);
}

#[test]
fn an_umbmark_square_scatters_alike_in_both_engines() {
    let side = [Motion::Straight { length_m: 1.0 }, Motion::Spin { turn_rad: std::f64::consts::FRAC_PI_2 }];
    agree(&side.repeat(4), 3000, 40_000);
}

/// The term itself: σ_θ²L²/12 across a straight.
#[test]
fn the_noise_inside_a_straight_is_a_twelfth_of_its_square() {
    let (length_m, base_m) = (4.0, 0.363);
    let var_m2 = Wheels::both(K_M_PER_SQRT_M * K_M_PER_SQRT_M * length_m);
    let scatter = BridgeCovariance::within(Wheels::both(length_m), var_m2, base_m);
    let theta_var = 2.0 * var_m2.left / (base_m * base_m);
    assert!((scatter.across_var_m2 / (theta_var * length_m * length_m / 12.0) - 1.0).abs() < 1e-12);
}
