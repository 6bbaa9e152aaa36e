//! A fleet as a table: a row for each session, robots in the order of service.

use ::fleet::{Fleet, FleetSession, Robot};

use crate::plain_text::spreadsheet_cell;
use crate::terminal::Failure;

const HEADER: [&str; 18] = [
    "rank",
    "robot",
    "dataset",
    "recorded",
    "runs",
    "drift_nominal_percent",
    "drift_calibrated_percent",
    "left_wheel_diameter_m",
    "left_wheel_diameter_sigma_m",
    "right_wheel_diameter_m",
    "right_wheel_diameter_sigma_m",
    "wheel_separation_m",
    "wheel_separation_sigma_m",
    "findings",
    "significant_changes",
    "excess_drift_percent",
    "excess_drift_sigma_percent",
    "excess_drift_q_value",
];

/// The text of the table. An empty cell is not known; findings and changed parameters are separated by
/// spaces.
pub(super) fn of(fleet: &Fleet) -> Result<Vec<u8>, Failure> {
    let mut table = csv::Writer::from_writer(Vec::new());
    table.write_record(HEADER)?;
    for robot in &fleet.robots {
        for session in &robot.sessions {
            table.write_record(row(robot, session))?;
        }
    }
    Ok(table.into_inner()?)
}

fn row(robot: &Robot, session: &FleetSession) -> Vec<String> {
    let result = &session.result;
    // Tiny numbers with an exponent.
    let number = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:?}"));
    let mut row = vec![
        robot.rank.to_string(),
        spreadsheet_cell(&robot.id).into_owned(),
        spreadsheet_cell(&session.dataset).into_owned(),
        result.recorded.map_or_else(String::new, |recorded| recorded.to_string()),
        result.runs.to_string(),
        number(result.drift_percent.nominal),
        number(result.drift_percent.calibrated),
    ];
    for parameter in 0..result.geometry.value_m.len() {
        row.extend([number(result.geometry.value_m[parameter]), number(result.geometry.sigma_m(parameter))]);
    }
    let findings: Vec<&str> = result.findings.iter().flatten().map(|finding| finding.id.as_str()).collect();
    let changed = robot.changes.iter().filter(|change| change.significant && change.to == session.dataset);
    row.extend([findings.join(" "), changed.map(|change| change.parameter).collect::<Vec<_>>().join(" ")]);
    // The excess is of the robot as its latest session has it.
    let excess = (session.dataset == robot.latest().dataset).then_some(&robot.excess);
    row.extend([
        number(excess.and_then(|excess| excess.value)),
        number(excess.and_then(|excess| excess.sigma)),
        number(excess.and_then(|excess| excess.q_value)),
    ]);
    row
}
