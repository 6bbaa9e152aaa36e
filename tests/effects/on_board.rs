//! What runs on board means something: a robot with one effect, by its simulation model, dead-reckons on line
//! nearer to where it was with the effect in its odometry than without.
//!
//! The equality of header and Rust says nothing of that: both could be wrong alike. Nothing of the rows after
//! a row is used.

use calib::{
    Alignment, CalibrationDrift, Delta, DeltaUnit, EvaluationOptions, PoseErrorOptions, evaluate_path, evaluate_runs,
};
use dataset::Dataset;
use diagnose::ExtendedModel;
use effects::{CATALOGUE, OnBoard};
use export::{CalibratedRobot, LogStart};
use scenario::{Estimated, EstimatedTerm, Scenario};

use super::hypotheses::watched::{drive, perfect};

/// An effect with its true sizes, what is held of it last.
struct Case {
    id: &'static str,
    values: &'static [(&'static str, f64)],
    /// Without it the odometry errs at least so many times as much, by the root of the mean square error of
    /// the position along the runs.
    factor: f64,
}

const fn case(id: &'static str, values: &'static [(&'static str, f64)], factor: f64) -> Case {
    Case { id, values, factor }
}

/// An error that shows: ten times what whole counts leave, 1.1e-5 m.
const SHOWS_M: f64 = 1.1e-4;

const CASES: &[Case] = &[
    // With state. Speeds are half an interval late while they change: seen are 67 and 690 times.
    case("slip_acceleration", &[("kappa_s", 0.02)], 30.0),
    case("sampling_skew", &[("right_delay_s", 0.01)], 100.0),
    // The mean of the last 20 stamps is no beat: 1.7 times, where all rows make it 11.
    case("interval_error", &[("share", 1.0), ("jitter_s", 4e-3)], 1.5),
    // Of the sizes of a usual floor, as a fit finds them (`fitted`): 1.9 and 2.0 times are seen, offline too.
    case("traction_loss", &[("sliding", 1.0), ("holds_m_s2", 0.36)], 1.7),
    case("traction_loss", &[("sliding", 1.0), ("holds_m_s2", 0.43)], 1.7),
    case("backlash", &[("left_gap_m", 2e-3), ("right_gap_m", 2e-3), ("width_m", 2e-3)], 50.0),
    // The row in which a turn changes the lean, as in hypotheses/means.rs: 7.6 times.
    case("castor_kick", &[("kick_rad", 0.02), ("decay_m", 0.06)], 5.0),
    // A mean of breakaways that are drawn: √(4/9 + 2/9)/√(2/9) = 1.7 at most.
    case("stick_slip", &[("breakaway_m", 1e-3), ("stick_speed_m_s", 0.05)], 1.3),
    case("stick_slip", &[("breakaway_m", 2e-3), ("stick_speed_m_s", 0.1)], 1.3),
    // With an input. An encoder that errs shows its own phase wrongly, by n A = 0.11: 64 times.
    case(
        "wheel_eccentricity",
        &[("left_sin", 0.02), ("left_cos", -0.015), ("right_sin", 0.01), ("right_cos", 0.02)],
        5.0,
    ),
    case(
        "encoder_cycle",
        &[
            ("left_sin_rad", 0.02),
            ("left_cos_rad", 0.01),
            ("right_sin_rad", -0.01),
            ("right_cos_rad", 0.02),
            ("cycles", 5.0),
        ],
        30.0,
    ),
    case("floor_slope", &[("creep_x_m_s", 2e-3), ("creep_y_m_s", -1e-3)], 100.0),
    case("floor_slope", &[("slide_x", -4e-3), ("slide_y", 6e-3)], 100.0),
    case(
        "carpet_nap",
        &[("drift_x", 5e-3), ("drift_y", -3e-3), ("yaw_sin_rad_m", 0.02), ("yaw_cos_rad_m", -0.01)],
        100.0,
    ),
    case("payload_compression", &[("common_per_kg", 1e-3), ("mismatch_per_kg", 4e-4), ("payload_kg", 8.0)], 5.0),
    case("thermal_drift", &[("growth", 0.03), ("tau_s", 150.0)], 100.0),
    // By the calibrated distance, which is longer than the true one by as much as is worn.
    case("wear", &[("loss_per_m", 2e-3)], 5.0),
    // Constants.
    case("swapped_wheels", &[("swapped", 1.0)], 100.0),
    case("reversed_wheel", &[("left", 0.0), ("right", 1.0)], 100.0),
    case("wrong_counts_per_turn", &[("factor", 2.0)], 100.0),
    case("counter_wrap", &[("bits", 16.0)], 100.0),
    // By itself it changes no travel, but the speeds that others go by.
    case("time_unit", &[("factor", 1000.0)], 100.0),
];

/// An effect that goes by the speed.
const BY_SPEED: (&str, [(&str, f64); 1]) = ("slip_speed", [("slip_s_m", 0.03)]);

/// The robot of a scenario with these effects at their true sizes.
fn model(scenario: &Scenario, effects: &[(&str, &[(&str, f64)])]) -> (ExtendedModel, CalibratedRobot) {
    let mut scenario = scenario.clone();
    let with_mean = |id: &str| effects::description(id).expect("known").on_board.has_mean();
    let term = |(id, values): &(&str, &[(&str, f64)])| EstimatedTerm {
        kind: (*id).to_owned(),
        values: values.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect(),
    };
    scenario.effects = effects.iter().map(|(id, values)| effect(id, values)).collect();
    effects::sort_by_stage(&mut scenario.effects);
    scenario.estimated = Some(Estimated {
        sensor_x_m: 0.0,
        sensor_y_m: 0.0,
        sensor_theta_rad: 0.0,
        latency_s: 0.0,
        terms: effects.iter().filter(|(id, _)| with_mean(id)).map(term).collect(),
    });
    let model = ExtendedModel::of(&scenario).expect("a model");
    let robot = CalibratedRobot::of_model("true.toml", &scenario, &model, None).expect("has all");
    (model, robot)
}

fn effect(id: &str, values: &[(&str, f64)]) -> effects::Effect {
    effects::effect_from_estimates(id, values).unwrap_or_else(|| panic!("{id}: the sizes make an effect"))
}

/// Positions as they are, at every instant that the instrument saw.
fn options() -> EvaluationOptions {
    let delta = Delta::new(1.0, DeltaUnit::Frames, false, Delta::DEFAULT_TOLERANCE).expect("a step");
    EvaluationOptions { name_runs: false, pose_errors: Some(PoseErrorOptions { alignment: Alignment::None, delta }) }
}

fn rmse_m(runs: Vec<calib::RunDrift>) -> f64 {
    let ape = CalibrationDrift::of_runs(None, runs).ape.expect("poses");
    ape.translation_m.expect("positions").rmse
}

/// Root of the mean square error of the position along the runs, metres, by what runs on board.
fn on_board_m(dataset: &Dataset, model: &ExtendedModel, robot: &CalibratedRobot, is_logged: bool) -> f64 {
    let (records, _) = model.undone(dataset).expect("undone");
    let session = records.session();
    let mut driven_m = 0.0;
    let of = |(run, raw): (&dataset::RunView<'_>, &dataset::Run)| {
        evaluate_path(&session, run, &model.calibration, &options(), &mut driven_m, |world_from_body, session_m| {
            let start = LogStart { world_from_body, session_m, is_logged };
            let mut path = robot.on_board_path(raw, None, &start).expect("a drive")?;
            path.iter_mut().zip(&run.odometry().t_s).for_each(|((at_s, _), t_s)| *at_s = *t_s);
            Some(path)
        })
    };
    rmse_m(session.runs.iter().zip(&dataset.runs).map(of).collect())
}

/// The same by the whole model, with rows on both sides.
fn offline_m(dataset: &Dataset, model: &ExtendedModel) -> f64 {
    let (records, _) = model.undone(dataset).expect("undone");
    rmse_m(evaluate_runs(&records.session(), Some(&model.calibration), &options(), &mut 0.0))
}

/// Sizes by which a model runs: the true ones. That of a slide is in multiples of a usual floor's under a
/// usual tremble of the tread: it is what the whole model, with rows on both sides, finds on half of the
/// runs, and the other half is left to what runs on board.
fn fitted(case: &Case, scenario: &Scenario, dataset: &mut Dataset) -> Vec<(&'static str, f64)> {
    let mut values = case.values.to_vec();
    let Some(at) = values.iter().position(|(name, _)| *name == "sliding") else { return values };
    let mut half = dataset.clone();
    half.runs.truncate(dataset.runs.len() / 2);
    dataset.runs.drain(..half.runs.len());
    let sliding = (1..=15).map(|tenths| 0.1 * f64::from(tenths)).min_by(|a, b| {
        let of = |sliding: &f64| {
            let mut values = values.clone();
            values[at].1 = *sliding;
            offline_m(&half, &model(scenario, &[(case.id, &values)]).0)
        };
        of(a).total_cmp(&of(b))
    });
    values[at].1 = sliding.expect("one of fifteen");
    values
}

#[test]
fn an_odometry_with_the_effect_is_nearer_to_the_truth_than_without() {
    let mut complaints = Vec::new();
    for case in CASES {
        let Case { id, values, factor } = case;
        let others: &[(&str, &[(&str, f64)])] = if *id == "time_unit" { &[(BY_SPEED.0, &BY_SPEED.1)] } else { &[] };
        let mut scenario = perfect();
        scenario.effects = others.iter().chain(&[(*id, *values)]).map(|(id, values)| effect(id, values)).collect();
        effects::sort_by_stage(&mut scenario.effects);
        let mut dataset = drive(&scenario, 6);
        if *id == "backlash" {
            // Where in its gap a wheel was left is over by then.
            dataset.runs.iter_mut().for_each(|run| run.truth.retain(|sample| sample.t_s >= 2.0));
        }
        let values = fitted(case, &scenario, &mut dataset);
        let all: Vec<_> = others.iter().copied().chain([(*id, &values[..])]).collect();
        let (with, robot) = model(&scenario, &all);
        let (_, without) = model(&scenario, others);
        let [found_m, without_m] = [&robot, &without].map(|robot| on_board_m(&dataset, &with, robot, true));
        let ratio = without_m / found_m;
        if ratio < *factor || without_m < SHOWS_M {
            let offline_m = offline_m(&dataset, &with);
            let text = format!("{without_m:.2e} m without, {found_m:.2e} m with it, {offline_m:.2e} m offline");
            complaints.push(format!("{id}: {text}: {ratio:.2} times, not {factor}"));
        }
        // Told nothing, it is as if the effect were not there.
        if robot.needs_inputs() {
            let untold_m = on_board_m(&dataset, &with, &robot, false);
            if (untold_m - without_m).abs() > 1e-9 {
                complaints.push(format!("{id}: logged nothing {untold_m} m, without it {without_m} m"));
            }
        }
    }
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
}

#[test]
fn every_effect_with_state_input_or_correction_is_driven() {
    let needs = |id: &&&str| {
        let on_board = effects::description(id).expect("known").on_board;
        matches!(on_board, OnBoard::State { .. } | OnBoard::Input { .. } | OnBoard::Constant(_))
    };
    for id in CATALOGUE.iter().filter(needs) {
        assert!(CASES.iter().any(|case| case.id == *id), "{id}");
    }
}
