//! Which instrument is enough for what: the standard deviations that each leaves of the drive's geometry in
//! the same room and time, before there are any data of it.
//!
//! The instruments, with their errors, and what is driven for each are those of the shipped scenarios that
//! docs/bench.md compares, fitted to room and time as a `[budget]` is. The numbers are Cramér–Rao bounds of
//! the robot without effects. Errors of SLAM are correlated and have no such bound.

use std::collections::BTreeMap;

use bench::FisherInformation;
use calib::Parameter;
use motion_programs::{Motion, MotionProgram};
use scenario::{Budget, Engine, NoFit, Scenario};
use serde::Serialize;

use crate::terminal::{Failure, Terminal, table};

/// The instruments, from what sees most to what costs least.
const INSTRUMENTS: [(&str, &str, &str); 5] = [
    ("capture", "motion capture", include_str!("../scenarios/gyro-and-tape-captured.toml")),
    ("slam", "SLAM or AMCL", include_str!("../scenarios/instruments-slam.toml")),
    ("wall", "a lidar that looks ahead, a wall", include_str!("../scenarios/instruments-wall.toml")),
    ("gyro-tape", "gyro, tape measure, mark", include_str!("../scenarios/gyro-and-tape.toml")),
    ("revisit", "tape measure, mark", include_str!("../scenarios/instruments-revisit.toml")),
];

/// What one instrument leaves.
#[derive(Debug, Serialize)]
pub(crate) struct Expected {
    instrument: &'static str,
    /// What it is, for people.
    what: &'static str,
    /// Standard deviations of the parameters that it determines, metres, by the names of `calibrate`.
    sigmas: BTreeMap<&'static str, f64>,
    /// The same relative to the nominal values.
    relative: BTreeMap<&'static str, f64>,
    runs: usize,
    minutes: f64,
    /// Why there are no numbers.
    why_null: Option<String>,
}

/// What each instrument leaves of a robot's geometry within a budget of time.
pub(crate) fn expected(robot: &Scenario, budget: Budget) -> Result<Vec<Expected>, Failure> {
    INSTRUMENTS
        .into_iter()
        .map(|(instrument, what, text)| of_instrument(instrument, what, text, robot, budget))
        .collect()
}

fn of_instrument(
    instrument: &'static str,
    what: &'static str,
    text: &'static str,
    robot: &Scenario,
    budget: Budget,
) -> Result<Expected, Failure> {
    let shipped = Scenario::parse(text, instrument)?;
    let scenario = Scenario {
        engine: Engine::ClosedForm,
        robot: robot.robot.clone(),
        noise: robot.noise,
        budget: Some(budget),
        effects: Vec::new(),
        sweep: None,
        ..shipped
    };
    let mut expected = Expected {
        instrument,
        what,
        sigmas: BTreeMap::new(),
        relative: BTreeMap::new(),
        runs: 0,
        minutes: 0.0,
        why_null: None,
    };
    let programs = match within_budget(&scenario, budget) {
        Ok(programs) => programs,
        Err(why) => return Ok(Expected { why_null: Some(why.to_string()), ..expected }),
    };
    (expected.runs, expected.minutes) = (programs.len(), scenario.cost_of(&programs).minutes);
    let information = match FisherInformation::of(&scenario, &programs) {
        Ok(information) => information,
        Err(why) => return Ok(Expected { why_null: Some(why.to_string()), ..expected }),
    };
    let nominal = scenario.nominal_geometry()?;
    let diameter_m = nominal.wheel_diameter_m();
    let parameters = [
        (Parameter::LeftWheelDiameter, diameter_m.left),
        (Parameter::RightWheelDiameter, diameter_m.right),
        (Parameter::WheelSeparation, nominal.wheel_separation_m()),
    ];
    for (parameter, value_m) in parameters {
        if let Some(variance) = information.bound_var(parameter) {
            expected.sigmas.insert(parameter.key(), variance.sqrt());
            expected.relative.insert(parameter.key(), variance.sqrt() / value_m);
        }
    }
    let open: Vec<&str> =
        parameters.into_iter().map(|(of, _)| of.key()).filter(|of| !expected.sigmas.contains_key(of)).collect();
    if !open.is_empty() {
        expected.why_null = Some(format!("what can be driven here does not determine {}", open.join(", ")));
    }
    Ok(expected)
}

/// What is driven within a budget that counts the standstills of each run too.
fn within_budget(scenario: &Scenario, budget: Budget) -> Result<Vec<MotionProgram>, NoFit> {
    let programs = scenario.programs_for("joint")?;
    let pause_s = |motion: &Motion| if let Motion::Pause { duration_s } = motion { *duration_s } else { 0.0 };
    let standing_s: f64 = programs.first().map_or(0.0, |program| program.motions.iter().map(pause_s).sum());
    let handling_s = Some(budget.handling_s.unwrap_or(0.0) + standing_s);
    Scenario { budget: Some(Budget { handling_s, ..budget }), ..scenario.clone() }.programs_for("joint")
}

/// The table for people.
pub(crate) fn show(all: &[Expected], budget: Budget, terminal: &Terminal) -> Result<(), Failure> {
    let minutes = budget.minutes.unwrap_or_default();
    terminal.say(&format!(
        "what other instruments would leave of ± in {minutes:.0} min in {} m × {} m (docs/bench.md has what each is):",
        budget.room_x_m, budget.room_y_m
    ))?;
    let mut rows = table(&["instrument", "runs", "min", "left %", "right %", "wheelbase %"], 1);
    for of in all {
        let percent = |parameter: Parameter| {
            of.relative.get(parameter.key()).map_or("–".to_owned(), |relative| format!("{:.4}", 100.0 * relative))
        };
        let [left, right, base] = Parameter::LENGTHS.map(percent);
        rows.add_row([of.what.to_owned(), of.runs.to_string(), format!("{:.1}", of.minutes), left, right, base]);
    }
    terminal.say(&rows.to_string())?;
    for of in all {
        if let Some(why) = &of.why_null {
            terminal.say(&format!("  {}: {why}", of.what))?;
        }
    }
    Ok(())
}
