//! A term of a scenario: what it adds to a step, to what is seen and to the record, and what makes none.

use dataset::RunInfo;
use kinematics::Pose;

use super::*;
use crate::catalogue::specimen_step;

fn term(channel: Channel, covariates: &[&str]) -> SparseTerm {
    let covariates = covariates.iter().map(ToString::to_string).collect();
    SparseTerm { channel, covariates, coefficient: 0.1, of_runs: BTreeMap::new() }
}

fn problem(term: &SparseTerm) -> String {
    term.check().expect_err("no term").to_string()
}

#[test]
fn a_step_gains_the_product_on_its_channel() {
    let gained = |channel| {
        let mut state = term(channel, &["v", "|omega|", "sin(theta)"]).forward().expect("a term");
        let mut step = specimen_step();
        step.rate_rad_s = Wheels { left: -1.0, right: -3.0 };
        step.world_from_body.theta_rad = 0.7;
        step.travel_m = Wheels { left: -8e-5, right: -2.4e-4 };
        state.floor(&mut step);
        (0.5 * (step.travel_m.left + step.travel_m.right) + 1.6e-4, step.lateral_m, step.extra_turn_rad)
    };
    // v = −0.16 m/s and ω = −0.16/0.363 rad/s; the middle of the step is half of its turn on.
    let omega_rad_s = -0.16 / 0.363;
    let size = 0.1 * -0.16 * 0.16 / 0.363 * f64::sin(0.7 + 5e-4 * omega_rad_s) * 1e-3;
    // Rounding of millimetres alone.
    let is = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-18, "{found:e} {expected:e}");
    for (channel, expected) in
        [(Channel::Along, [size, 0.0, 0.0]), (Channel::Across, [0.0, size, 0.0]), (Channel::Yaw, [0.0, 0.0, size])]
    {
        let (along, across, yaw) = gained(channel);
        is(along, expected[0]);
        is(across, expected[1]);
        is(yaw, expected[2]);
    }
}

#[test]
fn a_wheel_gains_by_what_it_does_itself() {
    // Contacts at 0.2 m/s and −0.4 m/s: c v|v| for 1 ms.
    let expected = Wheels { left: 4e-6, right: -1.6e-5 };
    for (channel, has) in [
        (Channel::Wheels, Wheels::both(1.0)),
        (Channel::LeftWheel, Wheels { left: 1.0, right: 0.0 }),
        (Channel::RightWheel, Wheels { left: 0.0, right: 1.0 }),
    ] {
        let mut state = term(channel, &["wheel v", "|wheel v|"]).forward().expect("a term");
        let mut step = specimen_step();
        step.rate_rad_s = Wheels { left: 2.5, right: -5.0 };
        let before_m = step.travel_m;
        state.floor(&mut step);
        let gained_m = step.travel_m.zip_with(before_m, |after, before| after - before);
        let off_m = gained_m.zip_with(expected.zip_with(has, |of, has| of * has), |a, b| (a - b).abs());
        // Rounding of tenths of millimetres alone.
        assert!(off_m.left.max(off_m.right) < 1e-18, "{channel:?}: {gained_m:?}");
    }
}

#[test]
fn an_instrument_is_off_in_the_frame_of_the_robot() {
    let mut state = term(Channel::OffsetAcross, &["v"]).forward().expect("a term");
    let mut reading = PoseReading { t_s: 0.0, world_from_body: Pose::new(1.0, 2.0, std::f64::consts::FRAC_PI_2) };
    let before = reading;
    state.instrument(&mut reading);
    assert_eq!(reading, before, "nothing has moved yet");
    let mut step = specimen_step();
    step.rate_rad_s = Wheels::both(2.5);
    let untouched = step;
    state.floor(&mut step);
    assert_eq!(step, untouched, "it is seen, and not driven");
    state.instrument(&mut reading);
    // Left of a robot that looks along y is −x: 0.1 × 0.2 m/s.
    assert!((reading.world_from_body.x_m - 0.98).abs() < 1e-15, "{reading:?}");
    assert!((reading.world_from_body.y_m - 2.0).abs() < 1e-15, "{reading:?}");
}

#[test]
fn runs_have_their_own_covariates_in_turn_and_their_records_say_so() {
    let mut of_load = term(Channel::Along, &["v", "load"]);
    of_load.of_runs.insert("load".to_owned(), vec![1.0, 5.0]);
    let mut state = of_load.forward().expect("a term");
    let gained_m = |state: &mut dyn Forward, number, predicted: Option<f64>| {
        let mut info = RunInfo::default();
        info.covariates.extend(predicted.map(|predicted| ("load".to_owned(), predicted)));
        state.on_run_start(&mut RunStart { number, session_s: 0.0, session_m: 0.0, info: &mut info });
        let mut step = specimen_step();
        step.rate_rad_s = Wheels::both(2.5);
        state.floor(&mut step);
        (info.covariates["load"], step.travel_m.left)
    };
    // (value − 3)/2 × 0.2 m/s × 0.1 × 1 ms.
    for (number, predicted, load, expected) in
        [(0, None, 1.0, -2e-5), (1, None, 5.0, 2e-5), (2, None, 1.0, -2e-5), (3, Some(3.5), 3.5, 5e-6)]
    {
        let (found, gained_m) = gained_m(&mut *state, number, predicted);
        assert_eq!(found, load);
        assert!((gained_m - expected).abs() < 1e-18, "{number}: {gained_m:e}");
    }
}

#[test]
fn what_makes_no_term_says_why() {
    assert_eq!(term(Channel::Yaw, &["|v|", "sin(theta)"]).check(), Ok(()));
    assert_eq!(term(Channel::OffsetHeading, &["1"]).check(), Ok(()));
    let unknown = problem(&term(Channel::Yaw, &["v", "speed"]));
    assert!(unknown.contains("no covariate \"speed\"") && unknown.contains("\"|omega|\""), "{unknown}");
    assert!(problem(&term(Channel::Yaw, &[])).contains("0 covariates"));
    assert!(problem(&term(Channel::Yaw, &["v", "v", "v", "v"])).contains("4 covariates"));
    let at_rest = problem(&term(Channel::Along, &["cos(theta)", "x"]));
    assert!(at_rest.contains("along must vanish at standstill") && at_rest.contains("\"v\""), "{at_rest}");
    assert!(problem(&term(Channel::Along, &["1"])).contains("vanish at standstill"));
    assert!(problem(&term(Channel::Along, &["1", "v"])).contains("no covariate \"1\""));
    let of_a_wheel = problem(&term(Channel::Along, &["wheel sense"]));
    assert!(
        of_a_wheel.contains("\"wheel sense\" is a covariate of wheels, left_wheel, right_wheel alone"),
        "{of_a_wheel}"
    );
    assert_eq!(term(Channel::Wheels, &["wheel v", "row length"]).check(), Ok(()));
    let of_rows = problem(&term(Channel::Yaw, &["omega", "row length"]));
    assert!(
        of_rows.contains("\"row length\" is a covariate of the channel wheels with \"wheel v\" alone"),
        "{of_rows}"
    );
    let seen = problem(&term(Channel::OffsetAlong, &["session time"]));
    assert!(seen.contains("seen_along takes these covariates alone") && seen.contains("\"cos(theta)\""), "{seen}");
    let endless = SparseTerm { coefficient: f64::NAN, ..term(Channel::Yaw, &["v"]) };
    assert!(problem(&endless).contains("coefficient is NaN"));
    let of_runs = |key: &str, values: &[f64]| {
        let mut term = term(Channel::Yaw, &["v", "load"]);
        term.of_runs.insert(key.to_owned(), values.to_vec());
        problem(&term)
    };
    assert!(of_runs("load", &[2.0, 2.0]).contains("of_runs.load must be finite values that differ"));
    assert!(of_runs("load", &[]).contains("must be finite"));
    assert!(of_runs("load", &[2.0, f64::INFINITY]).contains("must be finite"));
    assert!(of_runs("mass", &[1.0, 2.0]).contains("of_runs.mass is not among the covariates"));
    assert!(of_runs("v", &[1.0, 2.0]).contains("the name is taken"));
}
