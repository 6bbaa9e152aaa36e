//! A fleet on the terminal.

use ::fleet::{Change, Fleet, Robot};
use calib::Parameter;

use crate::terminal::{Failure, Terminal, cell, table};

/// Robots in the table; the page and the document have all.
const MAX_SHOWN: usize = 40;

pub(super) fn show(fleet: &Fleet, terminal: &Terminal) -> Result<(), Failure> {
    let headers = ["#", "robot", "sessions", "latest", "drift %", "excess %", "changed", "findings"];
    let mut rows = table(&headers, headers.len());
    for robot in fleet.robots.iter().take(MAX_SHOWN) {
        rows.add_row(row(robot));
    }
    if !fleet.robots.is_empty() {
        terminal.say(&rows.to_string())?;
    }
    if fleet.robots.len() > MAX_SHOWN {
        terminal
            .say(&format!("and {} robots more: --csv, --html and --json have all", fleet.robots.len() - MAX_SHOWN))?;
    }
    let significant: Vec<(&Robot, &Change)> = fleet
        .robots
        .iter()
        .flat_map(|robot| robot.latest_changes().map(move |change| (robot, change)))
        .filter(|(_, change)| change.significant)
        .collect();
    for (robot, change) in significant.iter().take(MAX_SHOWN) {
        terminal.say(&format!(
            "{}: {}, {} → {} (q = {:.1e})",
            robot.id,
            sentence(change),
            change.from,
            change.to,
            change.q_value
        ))?;
    }
    for robot in fleet.robots.iter().take(MAX_SHOWN) {
        if let Some(why) = &robot.excess.why_null {
            terminal.say(&format!("{}: excess drift: {why}", robot.id))?;
        }
    }
    terminal.say(&format!(
        "changes: {} tested in all sessions, {} significant since the last session, at a false-discovery rate of {}",
        fleet.tested_changes,
        significant.len(),
        fleet.false_discovery_rate
    ))?;
    for failed in &fleet.failed {
        terminal.say(&format!("failed: {}: {}", failed.dataset, failed.error))?;
    }
    Ok(())
}

fn row(robot: &Robot) -> [String; 8] {
    let latest = &robot.latest().result;
    let drift = &latest.drift_percent;
    let names = |robot: &Robot| {
        let names: Vec<&str> =
            robot.latest_changes().filter(|change| change.significant).map(|change| short(change.parameter)).collect();
        match (robot.sessions.len(), names.is_empty()) {
            (1, _) => "–".to_owned(),
            (_, true) => "no".to_owned(),
            (_, false) => names.join(", "),
        }
    };
    let findings = match &latest.findings {
        None => "–".to_owned(),
        Some(none) if none.is_empty() => "none".to_owned(),
        Some(all) => all.iter().map(|finding| finding.id.as_str()).collect::<Vec<_>>().join(", "),
    };
    [
        robot.rank.to_string(),
        robot.id.clone(),
        robot.sessions.len().to_string(),
        latest.recorded.map_or_else(|| "–".to_owned(), |recorded| recorded.strftime("%Y-%m-%d %H:%MZ").to_string()),
        format!("{} → {}", cell(drift.nominal, 1.0, 3), cell(drift.calibrated, 1.0, 3)),
        match (robot.excess.value, robot.excess.sigma, robot.excess.q_value) {
            (Some(value), Some(sigma), _) => format!("{value:.3} ± {sigma:.3}"),
            (None, _, Some(_)) => "none seen".to_owned(),
            _ => "not known".to_owned(),
        },
        names(robot),
        findings,
    ]
}

/// A parameter as the column has it.
fn short(parameter: &str) -> &str {
    match parameter {
        key if key == Parameter::LeftWheelDiameter.key() => "left wheel",
        key if key == Parameter::RightWheelDiameter.key() => "right wheel",
        key if key == Parameter::WheelSeparation.key() => "separation",
        other => other,
    }
}

/// A change in millimetres.
fn sentence(change: &Change) -> String {
    let decimals = (1.0 - (1e3 * change.sigma).log10().floor()).clamp(0.0, 9.0) as usize;
    let (by, sigma) = (1e3 * change.difference, 1e3 * change.sigma);
    format!("{} {by:+.decimals$} ± {sigma:.decimals$} mm", change.parameter)
}
