//! Terms outside of the catalogue: every covariate and channel has the size that a scenario says, and
//! recorded data show it so.

use dataset::{Protocol, ProtocolSettings, Run};
use effects::{Channel, Covariate, Effect, Hypothesis, SparseTerm};
use kinematics::Pose;
use motion_programs::{Motion, MotionProgram, Platform};
use scenario::{Engine, Placement, Scenario};
use sim_yair::{SimulatedRobot, SimulationError};

use super::watched::{Watch, difference, drive, missed, perfect};

fn term(channel: Channel, covariates: &[&str], coefficient: f64) -> SparseTerm {
    let covariates: Vec<String> = covariates.iter().map(ToString::to_string).collect();
    let loads = covariates.iter().filter(|name| *name == "load").map(|name| (name.clone(), vec![1.0, 5.0]));
    let of_runs = loads.collect();
    SparseTerm { channel, covariates, coefficient, of_runs }
}

fn with(mut scenario: Scenario, term: &SparseTerm) -> Scenario {
    scenario.effects = vec![Effect::Term(term.clone())];
    scenario
}

/// Channel, covariates, coefficient, and the share of the whole that may remain; [`super::means`] says of the
/// last whence it comes.
const CASES: [(Channel, &[&str], f64, f64); 38] = [
    (Channel::Along, &["v", "|v|"], 0.1, 0.0),
    (Channel::Along, &["|omega|"], 0.005, 0.0),
    (Channel::Along, &["v", "cos(theta)"], 0.03, 0.0),
    (Channel::Along, &["v", "load"], 0.03, 0.0),
    (Channel::Along, &["v", "x"], 0.03, 0.0),
    (Channel::Along, &["v", "y"], 0.03, 0.0),
    (Channel::Along, &["v", "time in run"], 0.03, 0.0),
    (Channel::Along, &["v", "session time"], 0.3, 0.0),
    (Channel::Along, &["v", "distance driven"], 0.2, 0.0),
    // The way at the end of a row of 5 mm instead of in its middle, of a decay of 100 mm.
    (Channel::Along, &["v", "exp(-distance since reversal / 0.1 m)"], 0.3, 0.05),
    (Channel::Along, &["v cos(left wheel)"], 0.05, 0.0),
    (Channel::Along, &["v sin(left wheel)"], 0.05, 0.0),
    (Channel::Along, &["v cos(right wheel)"], 0.05, 0.0),
    (Channel::Yaw, &["v sin(right wheel)"], 0.1, 0.0),
    // Within ramps the mean speed of a row lags the speed at its end.
    (Channel::Along, &["acceleration"], 0.03, 0.06),
    (Channel::Yaw, &["yaw_acceleration"], 0.03, 0.06),
    (Channel::Across, &["v", "omega"], 0.05, 0.0),
    (Channel::Across, &["|v|", "|v|", "omega"], 0.2, 0.0),
    (Channel::Yaw, &["|v|", "sin(theta)"], 0.03, 0.0),
    (Channel::Yaw, &["v"], 0.02, 0.0),
    (Channel::Yaw, &["omega", "|omega|"], 0.01, 0.0),
    (Channel::OffsetAlong, &["v"], 0.05, 0.06),
    (Channel::OffsetAcross, &["omega"], 0.02, 0.06),
    (Channel::OffsetAlong, &["cos(theta)"], 0.02, 0.0),
    (Channel::OffsetHeading, &["sin(theta)"], 0.02, 0.03),
    (Channel::OffsetHeading, &["1"], 0.02, 0.0),
    (Channel::MeasurementDelay, &["time in run"], 0.1, 0.06),
    (Channel::Wheels, &["wheel v", "|wheel v|"], 0.1, 0.0),
    // A wheel that starts within a row has its sense for all of it.
    (Channel::Wheels, &["wheel sense"], 0.003, 0.03),
    (Channel::LeftWheel, &["wheel acceleration"], 0.03, 0.06),
    (Channel::RightWheel, &["v cos(5 right wheel)"], 0.1, 0.0),
    (Channel::Yaw, &["|v|", "bend"], 0.03, 0.0),
    (Channel::Yaw, &["|v|", "exp(-distance since reversal / 0.1 m)", "last turn"], 0.3, 0.05),
    // The row in which a wheel turns round knows its way on balance.
    (Channel::Wheels, &["wheel v", "exp(-wheel distance since reversal / 2 mm)"], 0.3, 0.15),
    (Channel::LeftWheel, &["wheel v", "exp(-|wheel v| / 0.05 m/s)"], 0.3, 0.06),
    // The speeds at which a ramp is slow are two rows of it, and its corner is spread over two.
    (Channel::RightWheel, &["wheel acceleration", "exp(-|wheel v| / 0.05 m/s)"], 0.05, 0.3),
    // The speed of a row by its own stamps goes with their errors, and the first rows have no beat yet.
    (Channel::Wheels, &["wheel v", "row length"], 0.02, 0.3),
    // A row knows the time at its start.
    (Channel::RightWheel, &["|wheel v|", "time in run"], 0.1, 2e-3),
];

/// As for the means of the catalogue: what counts and rows hide.
const HIDDEN: f64 = 2e-4;

#[test]
fn recorded_data_show_a_term_at_its_size_and_at_no_other() {
    let mut complaints = Vec::new();
    for (channel, covariates, coefficient, remains) in CASES {
        let term = term(channel, covariates, coefficient);
        let dataset = drive(&with(perfect(), &term), 2);
        let Some(Hypothesis::Terms(variants)) = Effect::Term(term).hypothesis() else { panic!("a mean term") };
        let [mut shape] = <[_; 1]>::try_from(variants).unwrap_or_else(|_| panic!("one shape"));
        // What follows the log's beat is asked from measurement to measurement, as `interval_error` is.
        let watch = if covariates.contains(&"row length") { Watch::LookByLook } else { Watch::FromTheStart };
        let mut at = |factor: f64| missed(&dataset, &mut *shape.term, &[factor * coefficient], watch);
        let (whole, right) = (at(0.0), at(1.0));
        let allowed = remains * whole + HIDDEN;
        let (half, turned) = (at(0.5).min(at(1.5)), at(-1.0));
        let found = format!(
            "{} {covariates:?}: {right:.1e} of {whole:.1e}, half {half:.1e}, turned {turned:.1e}",
            channel.name()
        );
        if right > allowed || half < allowed || turned < allowed || whole < allowed {
            complaints.push(found);
        }
    }
    assert!(complaints.is_empty(), "{complaints:#?}");
}

#[test]
fn every_covariate_and_every_channel_is_tried() {
    for name in Covariate::NAMED.iter().map(Covariate::name) {
        assert!(CASES.iter().any(|(_, covariates, ..)| covariates.contains(&name.as_str())), "{name}");
    }
    for channel in Channel::all() {
        assert!(CASES.iter().any(|(tried, ..)| *tried == channel), "{channel:?}");
    }
}

/// Where a run of these motions ends, seen from its start; the run starts where the room's frame is.
fn driven(mut scenario: Scenario, motions: Vec<Motion>) -> Result<Pose, SimulationError> {
    scenario.placement = Placement { half_width_m: 0.0, half_width_rad: 0.0 };
    let mut robot = SimulatedRobot::new(&scenario, 9, 0)?;
    let settings = ProtocolSettings::default();
    let program = MotionProgram { id: "run".to_owned(), protocol: Protocol::Free, settings, motions };
    robot.drive_into(&program, &mut Run::default())?;
    let (start, end) = robot.last_true_ends();
    Ok(start.to(end))
}

/// dθ/ds = c sin θ along a way s has the solution tan(θ/2) = tan(θ₀/2) e^(cs), forward and backward alike for
/// |v|.
#[test]
fn a_yaw_that_goes_with_the_heading_bends_the_path_as_its_equation_says() {
    const C: f64 = 0.2;
    let scenario = || with(perfect(), &term(Channel::Yaw, &["|v|", "sin(theta)"], C));
    for length_m in [1.0, -1.0] {
        let motions = vec![Motion::Spin { turn_rad: 1.0 }, Motion::Straight { length_m }];
        let end = driven(scenario(), motions).expect("drives");
        let expected_rad = 2.0 * ((0.5_f64).tan() * C.exp()).atan();
        // Whole counts are 12.5 µm at each wheel, 7e-5 rad over both, twice. With cos θ for sin θ it would be
        // off by 0.08, with v for |v| backward by 0.3.
        let off_rad = end.theta_rad - expected_rad;
        assert!(off_rad.abs() < 2e-4, "{length_m} m: {off_rad:.1e}");
    }
}

/// ∫v²dt over a trapezoid of speed u and acceleration a is uL − u³/(3a).
#[test]
fn the_closed_form_takes_ramps_apart_for_a_term() {
    const C: f64 = 0.1;
    let mut scenario = with(perfect(), &term(Channel::Along, &["v", "|v|"], C));
    scenario.engine = Engine::ClosedForm;
    let (u, a) = (scenario.robot.cruise_speed_m_s, scenario.robot.acceleration_m_s2);
    let end = driven(scenario, vec![Motion::Straight { length_m: 1.0 }]).expect("the closed form is exact");
    let expected_m = 1.0 + C * (u - u.powi(3) / (3.0 * a));
    // A length of 1 m is a whole number of counts to 12.5 µm; without ramps it would be off by 1e-3 m.
    assert!((end.x_m - expected_m).abs() < 1.3e-5, "{} {expected_m}", end.x_m);
}

#[test]
fn both_engines_mean_the_same_by_a_term_or_the_closed_form_refuses_it() {
    let ends = |scenario: Scenario| {
        let motions = vec![Motion::Straight { length_m: 0.7 }, Motion::Arc { radius_m: 1.5 * 0.363, turn_rad: -1.2 }];
        driven(scenario, motions)
    };
    let plain = |engine| ends(Scenario { engine, ..perfect() }).expect("drives");
    let stepping = perfect().engine;
    let (stepped, closed) = (plain(stepping), plain(Engine::ClosedForm));
    let mut exact = Vec::new();
    for (channel, covariates, coefficient, _) in CASES {
        let of = |engine| ends(Scenario { engine, ..with(perfect(), &term(channel, covariates, coefficient)) });
        match of(Engine::ClosedForm) {
            Ok(end) => {
                // The controllers end a little elsewhere than the closed form: what the term adds is what
                // both mean.
                let off = difference(closed.to(end), stepped.to(of(stepping).expect("steps")));
                // Whole counts, as in `tests/effects/laws.rs`.
                assert!(off < 2e-4, "{channel:?} {covariates:?}: {off:e}");
                exact.push(covariates.join(" "));
            }
            Err(SimulationError::NeedsStepping { id, .. }) => assert_eq!(id, "term"),
            Err(error) => panic!("{error}"),
        }
    }
    let expected = [
        "v |v|",
        "|omega|",
        "v load",
        "v omega",
        "|v| |v| omega",
        "v",
        "omega |omega|",
        "cos(theta)",
        "sin(theta)",
        "1",
        "wheel v row length",
    ];
    assert_eq!(exact, expected);
}

#[test]
fn a_term_of_no_size_changes_no_bit() {
    let without = drive(&perfect(), 2);
    for (channel, covariates, coefficient, _) in CASES.into_iter().filter(|(_, names, ..)| !names.contains(&"load")) {
        let name = format!("{channel:?} {covariates:?}");
        assert!(drive(&with(perfect(), &term(channel, covariates, 0.0)), 2) == without, "{name} of no size");
        assert!(drive(&with(perfect(), &term(channel, covariates, coefficient)), 2) != without, "{name} of some size");
    }
}
