//! How often `yair fleet` errs: simulated fleets of which some robots change, by a documented campaign.

use calib::Method;
use calib::methods::joint::Joint;
use dataset::Timestamp;
use fleet::{
    DEFAULT_FALSE_DISCOVERY_RATE, ExcessDrift, Fleet, FleetSession, GeometryEstimate, SessionDrift, SessionResult,
};
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use scenario::Scenario;

/// Robots of a fleet, of which the first change between their two sessions.
const ROBOTS: u64 = 100;
const CHANGED: u64 = 20;

/// What came of a fleet.
struct Counts {
    /// Discoveries among the changes, and how many of them are false.
    discoveries: usize,
    false_discoveries: usize,
    /// Right wheels of the robots that change, found.
    found: usize,
    /// Tests at p < 0.05 of robots that do not change: of changes, of which there are three a robot, and of
    /// the excess, and how many excesses are called distinguishable.
    changes_below: usize,
    excesses_below: usize,
    false_excesses: usize,
    /// Robots that change whose excess is distinguishable.
    excesses_found: usize,
}

/// A session of the fleet: a trial of its own of the case that is driven.
fn session(of_case: &[Scenario], robot: u64, day: u64, changed_case: usize, seed: u64) -> FleetSession {
    let case = if robot < CHANGED && day == 1 { changed_case } else { 0 };
    let simulated = sim_yair::simulate(&of_case[case], seed, 2 * robot + day).expect("a scenario of ours").dataset;
    let sessions = [simulated.session()];
    let calibration = Joint::DEFAULT.calibrate(&sessions).expect("its runs suffice");
    let geometry = GeometryEstimate::of(&calibration, |_| true);
    FleetSession {
        dataset: format!("{robot:03}/{day}"),
        result: SessionResult {
            robot_id: Some(format!("{robot:03}")),
            recorded: Timestamp::from_second(86_400 * i64::try_from(day).expect("a day")).ok(),
            nominal: simulated.robot,
            path_kind: calib::path_kind(&sessions[0]),
            runs: simulated.runs.len(),
            drift_percent: SessionDrift { nominal: None, calibrated: None, why_null: None },
            excess_drift: ExcessDrift::of(&sessions[0], &calibration, &geometry, None),
            geometry,
            findings: None,
            remarks: Vec::new(),
        },
    }
}

fn counts(scenario: &Scenario, changed_case: usize, seed: u64) -> Counts {
    let sweep = scenario.sweep.as_ref().expect("cases");
    let points = sweep.points(scenario, "fleet.toml").expect("cases");
    let of_case: Vec<Scenario> = points.into_iter().map(|point| point.scenario).collect();
    let all = (0..2 * ROBOTS).into_par_iter();
    let sessions = all.map(|number| session(&of_case, number / 2, number % 2, changed_case, seed)).collect();
    let fleet = Fleet::of(sessions, Vec::new(), DEFAULT_FALSE_DISCOVERY_RATE);
    assert_eq!((fleet.robots.len(), fleet.tested_changes), (100, 300));
    let does_change = |robot: &&fleet::Robot| robot.id.parse::<u64>().expect("a number") < CHANGED;
    let (changing, steady): (Vec<_>, Vec<_>) = fleet.robots.iter().partition(does_change);
    // The separation of a robot whose tyre wears does not change; its left wheel does not either.
    let is_true = |robot: &fleet::Robot, change: &fleet::Change| {
        does_change(&robot) && change.parameter == calib::Parameter::RightWheelDiameter.key()
    };
    let pairs = || fleet.robots.iter().flat_map(|robot| robot.changes.iter().map(move |change| (robot, change)));
    let discovered: Vec<_> = pairs().filter(|(_, change)| change.significant).collect();
    let found = discovered.iter().filter(|(robot, change)| is_true(robot, change)).count();
    let below = |p_value: f64| p_value < 0.05;
    Counts {
        discoveries: discovered.len(),
        false_discoveries: discovered.len() - found,
        found,
        changes_below: steady.iter().flat_map(|robot| &robot.changes).filter(|change| below(change.p_value)).count(),
        excesses_below: steady.iter().filter(|robot| robot.excess.p_value.is_some_and(below)).count(),
        false_excesses: steady.iter().filter(|robot| robot.excess.distinguishable).count(),
        excesses_found: changing.iter().filter(|robot| robot.excess.distinguishable).count(),
    }
}

/// The table of docs/fleet.md; YAIR_SEED takes another seed.
#[test]
#[ignore = "a campaign of a minute, not a test: docs/fleet.md has its command"]
#[expect(clippy::print_stdout, reason = "its table is what it is for")]
fn fleet_campaign() {
    let seed = std::env::var("YAIR_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(101);
    let many = include_str!("../../scenarios/fleet.toml");
    let few = many.replace("runs = 8", "runs = 3").replace("runs_each_way = 4", "runs_each_way = 1");
    // Draws of their own for each column.
    let columns = [(many, 2, 0), (many, 1, 1), (&few[..], 2, 2)].map(|(text, case, column)| {
        counts(&Scenario::parse(text, "fleet.toml").expect("a scenario"), case, seed + column)
    });
    let line = |what: &str, of: &dyn Fn(&Counts) -> String| {
        let cells: Vec<String> = columns.iter().map(of).collect();
        println!("| {what} | {} |", cells.join(" | "));
    };
    line("worn right wheels found", &|of| format!("{} of 20", of.found));
    line("false among the significant changes", &|of| format!("{} of {}", of.false_discoveries, of.discoveries));
    line("p < 0.05 among 240 changes of the 80", &|of| format!("{} (12 expected)", of.changes_below));
    line("excess distinguishable, of the 20", &|of| of.excesses_found.to_string());
    line("excess distinguishable, of the 80 without one", &|of| of.false_excesses.to_string());
    line("p < 0.05 among the excesses of the 80", &|of| format!("{} (4 expected)", of.excesses_below));
    for of in &columns {
        assert_eq!((of.found, of.excesses_found), (20, 20));
        // Of 21 discoveries one is expected to be false; five or more have a probability of 0.003.
        assert!(of.false_discoveries < 5, "{} false", of.false_discoveries);
    }
}
