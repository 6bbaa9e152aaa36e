//! Laws that every effect of the catalogue keeps, each with a specimen that breaks it.

use dataset::{
    Dataset, Interval, ModelTerm, Motion, MotionProgram, Platform, Protocol, ProtocolSettings, Run, WheelLog,
};
use effects::{
    Backlash, CATALOGUE, ContactPatchWheelbase, CounterWrap, Effect, MissedCounts, Quantization, SamplingSkew,
    SlipAcceleration, SlipSpeed, TractionLoss, TruthOutliers, WheelEccentricity, WheelMismatch, WheelScale, Wheelbase,
    Which,
};
use kinematics::{Increment, Pose, Rule, Wheels};
use scenario::{Engine, Instrument, Log, Scenario};
use sim_yair::{SimulatedRobot, SimulationError};

/// An effect three times: of no size, of a size that shows, and of an unphysical one.
struct Specimen {
    none: Effect,
    some: Effect,
    unphysical: Effect,
}

#[allow(clippy::too_many_lines)]
fn specimens() -> Vec<Specimen> {
    let of = |make: fn(f64) -> Effect, none, some, unphysical| Specimen {
        none: make(none),
        some: make(some),
        unphysical: make(unphysical),
    };
    vec![
        of(|scale| Effect::WheelScale(WheelScale { scale }), 1.0, 1.01, -1.0),
        of(|e_d| Effect::WheelMismatch(WheelMismatch { right_over_left: e_d }), 1.0, 1.01, 0.0),
        of(|ratio| Effect::Wheelbase(Wheelbase { ratio }), 1.0, 1.02, f64::NAN),
        of(
            |sigma_m| {
                Effect::ContactPatchWheelbase(ContactPatchWheelbase { sigma_m, slow_sigma_m: 0.0, slow_length_m: 0.0 })
            },
            0.0,
            5e-3,
            -1e-3,
        ),
        of(|gap_rad| Effect::Backlash(Backlash { wheel: Which::Left, gap_rad }), 0.0, 0.02, -0.1),
        of(
            |amplitude| Effect::WheelEccentricity(WheelEccentricity { wheel: Which::Right, amplitude, phase_rad: 0.3 }),
            0.0,
            0.02,
            1.5,
        ),
        of(|slip_s_m| Effect::SlipSpeed(SlipSpeed { slip_s_m }), 0.0, 0.05, f64::INFINITY),
        of(|kappa_s| Effect::SlipAcceleration(SlipAcceleration { kappa_s }), 0.0, 5e-3, f64::NAN),
        of(
            |static_friction| {
                let kinetic_friction = 0.6 * static_friction;
                Effect::TractionLoss(TractionLoss { static_friction, kinetic_friction, stribeck_speed_m_s: 0.05 })
            },
            1e3,
            0.03,
            -0.1,
        ),
        of(
            |lost_share| Effect::MissedCounts(MissedCounts { wheel: Which::Left, hinge_speed_m_s: 0.0, lost_share }),
            0.0,
            0.02,
            1.0,
        ),
        of(|right_delay_s| Effect::SamplingSkew(SamplingSkew { right_delay_s }), 0.0, 2e-3, -1e-3),
        of(
            |n| {
                #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
                Effect::Quantization(Quantization { counts_per_tick: n as u32 })
            },
            1.0,
            80.0,
            0.0,
        ),
        of(
            |bits| {
                #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
                Effect::CounterWrap(CounterWrap { bits: bits as u32 })
            },
            32.0,
            16.0,
            7.0,
        ),
        of(
            |probability| Effect::TruthOutliers(TruthOutliers { probability, jump_m: 0.05, jump_rad: 0.1 }),
            0.0,
            1.0,
            1.5,
        ),
    ]
}

const STEPPING: Engine = Engine::Stepping { step_s: 1e-3 };

/// The paper's robot without any imperfection or noise, watched exactly, logging every 20 ms.
fn perfect(engine: Engine) -> Scenario {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/paper.toml");
    let mut scenario = Scenario::read(&path).expect("the shipped scenario");
    scenario.engine = engine;
    scenario.effects.clear();
    scenario.noise.wheel_sigma_m_per_sqrt_m = 0.0;
    scenario.robot.controller.right_phase_s = 0.0;
    scenario.instruments = vec![Instrument::FloorGrid { resolution_m: 0.0, reading_sigma_m: 0.0 }];
    scenario.log = Some(Log { interval_s: 0.02 });
    scenario
}

/// Straight, spin, backward and an arc whose inner wheel runs at half of the outer one's speed: both speeds lie on the controller's lattice (40 and 20
/// counts a sample), so that the stepped robot drives the radius that it is told.
fn program() -> MotionProgram {
    let motions = vec![
        Motion::Straight { length_m: 1.0 },
        Motion::Spin { turn_rad: 1.5 },
        Motion::Straight { length_m: -0.4 },
        Motion::Arc { radius_m: 1.5 * 0.363, turn_rad: -1.2 },
    ];
    MotionProgram { id: "run".to_owned(), protocol: Protocol::Free, settings: ProtocolSettings::default(), motions }
}

/// A run with its true motion from start to end and the dataset that shows it.
fn drive(scenario: &Scenario) -> Result<(Dataset, Pose), SimulationError> {
    let mut robot = SimulatedRobot::new(scenario, 9, 0)?;
    let mut run = Run::default();
    robot.drive_into(&program(), &mut run)?;
    let (start, end) = robot.last_true_ends();
    let dataset = Dataset {
        provenance: dataset::Provenance::default(),
        robot: robot.robot(),
        truth_noise: robot.truth_noise(),
        points: robot.points().to_vec(),
        runs: vec![run],
    };
    Ok((dataset, start.to(end)))
}

fn with(mut scenario: Scenario, effect: &Effect) -> Scenario {
    scenario.effects = vec![effect.clone()];
    scenario
}

#[test]
fn every_effect_has_a_specimen() {
    let ids: Vec<_> = specimens().iter().map(|specimen| specimen.some.id()).collect();
    assert_eq!(ids, CATALOGUE);
}

#[test]
fn an_effect_of_no_size_changes_no_bit_and_one_of_some_size_does() {
    let without = drive(&perfect(STEPPING)).expect("drives");
    for specimen in specimens() {
        let none = drive(&with(perfect(STEPPING), &specimen.none)).expect("drives");
        assert_eq!(none, without, "{}", specimen.none.id());
        let some = drive(&with(perfect(STEPPING), &specimen.some)).expect("drives");
        assert_ne!(some, without, "{}", specimen.some.id());
    }
}

#[test]
fn unphysical_sizes_are_refused_by_name() {
    for specimen in specimens() {
        specimen.some.physical().check().expect("a physical size");
        let error = specimen.unphysical.physical().check().expect_err("an unphysical size").to_string();
        assert!(error.contains(specimen.some.id()), "{error}");
    }
}

/// What dead reckoning with the true geometry misses of the true motion.
fn missed(scenario: &Scenario) -> Result<Pose, SimulationError> {
    let (dataset, moved) = drive(scenario)?;
    let mut reckoned = Pose::IDENTITY;
    let session = dataset.session();
    let geometry = scenario.true_geometry()?;
    session.runs[0].dead_reckon(session.robot, &geometry, Rule::ExactArc, Pose::IDENTITY, |_, pose| reckoned = pose);
    Ok(Pose::new(moved.x_m - reckoned.x_m, moved.y_m - reckoned.y_m, moved.theta_rad - reckoned.theta_rad))
}

fn difference(a: Pose, b: Pose) -> f64 {
    (a.x_m - b.x_m).abs().max((a.y_m - b.y_m).abs()).max((a.theta_rad - b.theta_rad).abs())
}

/// Counts are whole on both sides: 12.5 µm a wheel, 3e-5 rad, over a metre of arm after four motions 1e-4. A closed form that skipped the ramps of a motion
/// would be off by 5e-4 for `slip_speed`; one that drove shafts instead of counts to the target, by 3e-2 for `missed_counts`.
const ENGINES_AGREE: f64 = 2e-4;

#[test]
fn both_engines_mean_the_same_by_an_effect_or_the_closed_form_refuses_it() {
    let mut refused = Vec::new();
    for specimen in specimens().iter().filter(|specimen| !matches!(specimen.some.id(), "counter_wrap" | "quantization"))
    {
        let id = specimen.some.id();
        let stepped = missed(&with(perfect(STEPPING), &specimen.some)).expect("steps");
        match missed(&with(perfect(Engine::ClosedForm), &specimen.some)) {
            Ok(closed) => assert!(difference(stepped, closed) < ENGINES_AGREE, "{id}: {stepped:?} {closed:?}"),
            Err(SimulationError::NeedsStepping { id, .. }) => refused.push(id),
            Err(error) => panic!("{id}: {error}"),
        }
    }
    assert_eq!(refused, ["wheel_eccentricity", "slip_acceleration", "traction_loss"]);
}

/// End of the run when the hypothesis' mean term, at `size`, is added to the increments that the log shows.
fn predicted(dataset: &Dataset, term: &mut dyn ModelTerm, size: f64) -> Pose {
    let run = &dataset.runs[0];
    let WheelLog::Ticks(ticks) = &run.odometry.wheels else { panic!("the simulator logs ticks") };
    let geometry = dataset.robot.geometry().expect("valid");
    let m_per_count = geometry.m_per_count(dataset.robot.ticks_per_rev.expect("ticks")).expect("valid");
    let mut gradient = [Pose::IDENTITY];
    let mut pose = Pose::IDENTITY;
    for k in 1..run.odometry.t_s.len() {
        #[allow(clippy::cast_precision_loss)]
        let counts = Wheels {
            left: (ticks.left[k] - ticks.left[k - 1]) as f64,
            right: (ticks.right[k] - ticks.right[k - 1]) as f64,
        };
        let travel_m = counts.zip_with(m_per_count, |counts, m_per_count| counts * m_per_count);
        let wheel_separation_m = geometry.wheel_separation_m();
        let interval = Interval { dt_s: run.odometry.t_s[k] - run.odometry.t_s[k - 1], travel_m, wheel_separation_m };
        term.gradient(&interval, &mut gradient);
        let base = interval.increment();
        let turn_rad = base.turn_rad + size * gradient[0].theta_rad;
        pose = pose * Increment { distance_m: base.distance_m + size * gradient[0].x_m, turn_rad }.arc();
    }
    pose
}

/// The forward face and the hypothesis face are written apart; here they meet. The log's 20 ms rows blur the speed at the ramps' ends, and small sizes leave
/// second-order terms of 5e-3: 2 % of the effect is allowed, and a hypothesis that is 5 % off is rejected.
#[test]
fn a_hypothesis_predicts_what_its_forward_face_does() {
    type Small = (f64, fn(f64) -> Effect);
    let small: [Small; 4] = [
        (5e-3, |size| Effect::WheelScale(WheelScale { scale: 1.0 + size })),
        (5e-3, |size| Effect::WheelMismatch(WheelMismatch { right_over_left: 1.0 + size })),
        (5e-3, |size| Effect::Wheelbase(Wheelbase { ratio: 1.0 + size })),
        (1e-2, |size| Effect::SlipSpeed(SlipSpeed { slip_s_m: size })),
    ];
    for (size, make) in small {
        let effect = make(size);
        let mut term = effect.physical().hypothesis().expect("has a hypothesis face");
        assert_eq!(term.parameters().len(), 1);
        let (dataset, moved) = drive(&with(perfect(STEPPING), &effect)).expect("drives");
        let without = predicted(&dataset, term.as_mut(), 0.0);
        let whole = difference(moved, without);
        let allowed = 0.02 * whole + 3e-5; // and the last counts' rounding
        let error = difference(moved, predicted(&dataset, term.as_mut(), size));
        assert!(error < allowed, "{}: {error} of {whole}", effect.id());
        for wrong_size in [-size, 0.95 * size, 1.05 * size] {
            let wrong = difference(moved, predicted(&dataset, term.as_mut(), wrong_size));
            assert!(wrong > allowed, "{}: {wrong_size} is not told from {size}", effect.id());
        }
    }
    let with_hypothesis = specimens().iter().filter(|specimen| specimen.some.physical().hypothesis().is_some()).count();
    assert_eq!(with_hypothesis, small.len(), "every hypothesis face is tried here");
}
