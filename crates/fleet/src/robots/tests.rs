//! Fleets whose order, changes and ranks are known on paper.

use dataset::{NominalRobot, Timestamp};

use super::{Failed, Fleet, FleetSession};
use crate::excess_drift::ExcessDrift;
use crate::geometry::GeometryEstimate;
use crate::session::{SessionDrift, SessionResult};
use crate::settings::DEFAULT_FALSE_DISCOVERY_RATE;

const SIGMA_M: f64 = 1e-4;

/// A session with a left wheel of 0.1 m and so many standard deviations more.
fn session(dataset: &str, robot_id: Option<&str>, day: Option<i64>, left_sigmas: f64) -> FleetSession {
    let geometry_m = [0.1 + left_sigmas * SIGMA_M, 0.1, 0.3];
    let covariance = [0, 1, 2].map(|row| [0, 1, 2].map(|column| if row == column { SIGMA_M * SIGMA_M } else { 0.0 }));
    FleetSession {
        dataset: dataset.to_owned(),
        result: SessionResult {
            robot_id: robot_id.map(str::to_owned),
            recorded: day.map(|day| Timestamp::from_second(86_400 * day).expect("a date")),
            nominal: NominalRobot {
                left_wheel_diameter_m: 0.1,
                right_wheel_diameter_m: 0.1,
                wheel_separation_m: 0.3,
                ticks_per_rev: None,
                counter_bits: None,
            },
            path_kind: "squares".to_owned(),
            runs: 1,
            drift_percent: SessionDrift { nominal: None, calibrated: None, why_null: None },
            geometry: GeometryEstimate {
                value_m: geometry_m.map(Some),
                covariance_m2: Some(covariance),
                not_observable: Vec::new(),
            },
            excess_drift: Err("no runs".to_owned()),
            findings: None,
            remarks: Vec::new(),
        },
    }
}

fn with_excess(mut session: FleetSession, percent: f64, p_value: f64) -> FleetSession {
    session.result.excess_drift = Ok(ExcessDrift { percent, sigma_percent: 0.1, p_value });
    session
}

fn fleet(sessions: Vec<FleetSession>) -> Fleet {
    Fleet::of(sessions, Vec::new(), DEFAULT_FALSE_DISCOVERY_RATE)
}

#[test]
fn sessions_are_grouped_by_id_and_ordered_by_time_whatever_their_order() {
    let sessions = vec![
        session("z", Some("a"), Some(1), 0.0),
        session("y", Some("a"), Some(3), 8.0),
        session("x", Some("a"), Some(2), 0.0),
        session("alone", None, None, 0.0),
    ];
    let found = fleet(sessions.clone());
    let names = |fleet: &Fleet| {
        let of =
            |robot: &super::Robot| robot.sessions.iter().map(|session| session.dataset.clone()).collect::<Vec<_>>();
        fleet.robots.iter().map(|robot| (robot.id.clone(), of(robot))).collect::<Vec<_>>()
    };
    let expected = [("a", vec!["z", "x", "y"]), ("alone", vec!["alone"])];
    let expected = expected.map(|(id, all)| (id.to_owned(), all.into_iter().map(str::to_owned).collect::<Vec<_>>()));
    assert_eq!(names(&found), expected);
    assert_eq!(fleet(sessions.into_iter().rev().collect()), found);
    // Two pairs of three parameters; the left wheel changes by 8/√2 standard deviations in the second.
    assert_eq!(found.tested_changes, 6);
    let significant: Vec<_> = found.robots[0].changes.iter().filter(|change| change.significant).collect();
    let [change] = &significant[..] else { panic!("{significant:?}") };
    assert_eq!((change.parameter, &change.from[..], &change.to[..]), ("left_wheel_diameter_m", "x", "y"));
    assert!((change.z - 8.0 / 2.0_f64.sqrt()).abs() < 1e-9 && (change.q_value / change.p_value - 6.0).abs() < 1e-9);
    assert_eq!(found.robots[0].latest_changes().count(), 3);
}

#[test]
fn a_change_counts_for_less_among_more_robots() {
    // z = 2.9: p = 0.0037, a discovery among three tests and none among the thirty of ten robots.
    let changed = |id: &str| {
        vec![
            session(&format!("{id}-1"), Some(id), Some(1), 0.0),
            session(&format!("{id}-2"), Some(id), Some(2), if id == "0" { 2.9 * 2.0_f64.sqrt() } else { 0.0 }),
        ]
    };
    let significant = |count: usize| {
        let found = fleet((0..count).flat_map(|number| changed(&number.to_string())).collect());
        found.robots.iter().flat_map(|robot| &robot.changes).filter(|change| change.significant).count()
    };
    assert_eq!((significant(1), significant(10)), (1, 0));
}

#[test]
fn sessions_without_an_instant_take_no_part_where_a_robot_has_several() {
    let found = Fleet::of(
        vec![session("x", Some("a"), None, 0.0), session("y", Some("a"), Some(3), 0.0)],
        vec![Failed { dataset: "broken".to_owned(), error: "unreadable".to_owned() }],
        DEFAULT_FALSE_DISCOVERY_RATE,
    );
    let failed: Vec<&str> = found.failed.iter().map(|failed| failed.dataset.as_str()).collect();
    assert_eq!(failed, ["broken", "x"]);
    assert!(found.failed[1].error.contains("recorded = "), "{:?}", found.failed);
    assert_eq!((found.robots.len(), found.robots[0].sessions.len()), (1, 1));
    // None of two says when: no robot is left.
    let found = fleet(vec![session("x", Some("a"), None, 0.0), session("y", Some("a"), None, 0.0)]);
    assert_eq!((found.robots.len(), found.failed.len()), (0, 2));
}

#[test]
fn sessions_at_one_instant_are_not_compared_and_other_nominal_values_are_told() {
    let mut other = session("y", Some("a"), Some(1), 9.0);
    other.result.nominal.wheel_separation_m = 0.31;
    other.result.path_kind = "circles".to_owned();
    let found = fleet(vec![session("x", Some("a"), Some(1), 0.0), other]);
    let [robot] = &found.robots[..] else { panic!("{found:?}") };
    assert!(robot.changes.is_empty());
    let [same, paths, differs] = &robot.warnings[..] else { panic!("{:?}", robot.warnings) };
    assert!(paths.contains("squares") && paths.contains("circles"), "{paths}");
    assert!(same.contains("1970-01-02T00:00:00Z") && differs.contains("300.000") && differs.contains("310.000"));
}

#[test]
fn the_largest_distinguishable_excess_is_serviced_first() {
    let of = |id: &str, percent: f64, p_value: f64| with_excess(session(id, None, None, 0.0), percent, p_value);
    let found = fleet(vec![
        session("unknown", None, None, 0.0),
        of("small", 0.2, 1e-9),
        of("none", 5.0, 0.6),
        of("large", 0.9, 1e-4),
    ]);
    let order: Vec<(usize, &str)> = found.robots.iter().map(|robot| (robot.rank, robot.id.as_str())).collect();
    assert_eq!(order, [(1, "large"), (2, "small"), (3, "none"), (4, "unknown")]);
    let [large, _, none, unknown] = &found.robots[..] else { panic!("four") };
    // The largest of three p-values, and the second.
    assert_eq!((large.excess.value, none.excess.q_value), (Some(0.9), Some(0.6)));
    assert!((large.excess.q_value.expect("tested") - 1.5e-4).abs() < 1e-18);
    assert!(none.excess.value.is_none() && none.excess.why_null.as_deref().is_some_and(|why| why.contains("5.200 %")));
    assert_eq!(unknown.excess.why_null.as_deref(), Some("no runs"));
}
