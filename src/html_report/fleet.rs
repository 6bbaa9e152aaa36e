//! The page of a fleet.

use std::path::Path;

use ::fleet::{Change, Fleet, GEOMETRY, Robot};
use calib::nominal_value;
use dataset::Timestamp;
use report_page::{Axis, Block, Cell, Chart, Mark, Report, Role, Section, Series, Table, Tile, Tone};

use super::made_by;
use super::words::{count, plus_minus};
use crate::simulate::write_whole;
use crate::terminal::Failure;

/// Pictures on the page: more make a page that nobody scrolls, and the table of changes has all.
const MAX_CHARTS: usize = 12;

/// Standard deviations of a 95 % interval of a normal distribution.
const SIGMAS_95: f64 = 1.96;

/// Writes the page of a fleet into a file, which is replaced.
pub(crate) fn write_fleet(fleet: &Fleet, file: &Path) -> Result<(), Failure> {
    let excessive = fleet.robots.iter().filter(|robot| robot.excess.distinguishable).count();
    let changed: Vec<(&Robot, &Change)> = fleet
        .robots
        .iter()
        .flat_map(|robot| robot.changes.iter().map(move |change| (robot, change)))
        .filter(|(_, change)| change.significant)
        .collect();
    let sessions: usize = fleet.robots.iter().map(|robot| robot.sessions.len()).sum();
    let subject = format!("{}, {}", count(fleet.robots.len(), "robot"), count(sessions, "session"));
    let first = fleet.robots.first().filter(|robot| robot.excess.distinguishable);
    let headline = match first {
        Some(robot) => format!(
            "Service {} first: as configured it drifts {} % of the distance more than it need.",
            robot.id,
            plus_minus(robot.excess.value.unwrap_or(0.0), robot.excess.sigma)
        ),
        None => "No robot drifts distinguishably more than its calibration predicts.".to_owned(),
    };
    let tile = |label: &str, value: String, note: &str, section: &str| Tile {
        label: label.to_owned(),
        value,
        note: note.to_owned(),
        section: section.to_owned(),
    };
    let mut page = Report {
        command: "yair fleet".to_owned(),
        subject,
        tone: Tone::Neutral,
        headline,
        lead: format!(
            "Predicted excess drift is how far the configured geometry takes a robot from where its latest calibration does, on the runs of its latest session. Changes and excesses are judged at a false-discovery rate of {} over the fleet.",
            fleet.false_discovery_rate
        ),
        bars: None,
        tiles: vec![
            tile("Robots with an excess", excessive.to_string(), "distinguishable from zero", "robots"),
            tile(
                "Changes",
                changed.len().to_string(),
                &format!("significant, of {} tested", fleet.tested_changes),
                "changes",
            ),
            tile("Failed datasets", fleet.failed.len().to_string(), "which take no part", "failed"),
        ],
        sections: vec![Section::new("robots", "Robots by service order").with(Block::Table(robots(fleet)))],
        appendix: Vec::new(),
        made_by: made_by(Vec::new()),
    };
    let mut section = Section::new("changes", "Significant changes between consecutive sessions");
    section = if changed.is_empty() {
        section.text("No parameter changed significantly.")
    } else {
        section.with(Block::Table(changes(&changed)))
    };
    for chart in charts(&changed).into_iter().take(MAX_CHARTS) {
        section = section.with(Block::Chart(chart));
    }
    page.sections.push(section);
    let mut failed = Table::new("Datasets that take no part", &["dataset", "why"]);
    for of in &fleet.failed {
        failed.row([Cell::id(of.dataset.clone()), Cell::text(of.error.clone())]);
    }
    let section = Section::new("failed", "Failed datasets");
    page.sections.push(if fleet.failed.is_empty() {
        section.text("None.")
    } else {
        section.with(Block::Table(failed))
    });
    write_whole(file, page.render()?.as_bytes())
}

fn robots(fleet: &Fleet) -> Table {
    let headings = [
        "rank",
        "robot",
        "sessions",
        "latest",
        "excess drift, %",
        "drift, %",
        "left wheel, mm",
        "right wheel, mm",
        "separation, mm",
        "changed",
        "findings",
    ];
    let mut table = Table::new(
        "Every robot as its latest session has it, drift as configured; ± is one standard deviation, at most one of the excess",
        &headings,
    );
    for robot in &fleet.robots {
        let latest = &robot.latest().result;
        let geometry = &latest.geometry;
        let length = |row: usize| {
            let shown = |value_m: f64| plus_minus(1e3 * value_m, geometry.sigma_m(row).map(|sigma_m| 1e3 * sigma_m));
            Cell::number(geometry.value_m[row].map_or_else(|| "not determined".to_owned(), shown))
        };
        let excess = match (robot.excess.value, robot.excess.p_value) {
            (Some(value), _) => plus_minus(value, robot.excess.sigma),
            (None, Some(_)) => "none seen".to_owned(),
            (None, None) => "not known".to_owned(),
        };
        let changed = robot.latest_changes().filter(|change| change.significant).map(|change| change.parameter);
        let changed = changed.collect::<Vec<_>>().join(", ");
        let findings = latest.findings.as_ref().map_or_else(
            || "not diagnosed".to_owned(),
            |all| all.iter().map(|finding| finding.names.join(" or ")).collect::<Vec<_>>().join(", "),
        );
        let or_none = |text: String| if text.is_empty() { "none".to_owned() } else { text };
        table.row([
            Cell::number(robot.rank.to_string()),
            Cell::id(robot.id.clone()),
            Cell::number(robot.sessions.len().to_string()),
            Cell::number(instant(latest.recorded)),
            Cell::number(excess),
            Cell::number(latest.drift_percent.nominal.map_or_else(|| "–".to_owned(), |drift| format!("{drift:.3}"))),
            length(0),
            length(1),
            length(2),
            Cell::text(if robot.sessions.len() > 1 { or_none(changed) } else { "one session".to_owned() }),
            Cell::text(or_none(findings)),
        ]);
    }
    table
}

/// An instant to the minute; a dash where none is stated.
fn instant(recorded: Option<Timestamp>) -> String {
    recorded.map_or_else(|| "–".to_owned(), |recorded| recorded.strftime("%Y-%m-%d %H:%MZ").to_string())
}

fn changes(changed: &[(&Robot, &Change)]) -> Table {
    let headings = ["robot", "parameter", "from", "to", "difference, mm", "z", "q"];
    let mut table = Table::new("q is the smallest false-discovery rate at which a change is a discovery", &headings);
    for (robot, change) in changed {
        table.row([
            Cell::id(robot.id.clone()),
            Cell::id(change.parameter),
            Cell::id(change.from.clone()),
            Cell::id(change.to.clone()),
            Cell::number(plus_minus(1e3 * change.difference, Some(1e3 * change.sigma))),
            Cell::number(format!("{:.1}", change.z)),
            Cell::number(format!("{:.1e}", change.q_value)),
        ]);
    }
    table
}

/// A picture for each parameter of a robot that changed, over its sessions.
fn charts(changed: &[(&Robot, &Change)]) -> Vec<Chart> {
    let mut charts: Vec<Chart> = Vec::new();
    for (robot, change) in changed {
        let title = format!("{}: {}", robot.id, change.parameter);
        let Some(row) = GEOMETRY.iter().position(|parameter| parameter.key() == change.parameter) else { continue };
        if charts.iter().any(|chart| chart.title == title) {
            continue;
        }
        let results = || robot.sessions.iter().map(|session| &session.result);
        // From what the first session is configured with: an axis from zero would show no change.
        let zero_m = results().find_map(|of| nominal_value(&of.nominal, change.parameter)).unwrap_or(0.0);
        let millimetres = |value_m: Option<f64>| value_m.map(|value_m| 1e3 * (value_m - zero_m));
        let half_width = |sigma_m: Option<f64>| sigma_m.map(|sigma_m| SIGMAS_95 * 1e3 * sigma_m);
        charts.push(Chart {
            title,
            caption: format!(
                "Calibrated in every session, with 95 % intervals, and as the robot is configured, over {:.3} mm.",
                1e3 * zero_m
            ),
            x: Axis::new("session", ""),
            y: Axis::new("difference", "mm"),
            at: (0_u32..).map(f64::from).take(robot.sessions.len()).collect(),
            names: results().map(|of| instant(of.recorded)).collect(),
            series: vec![
                Series {
                    name: "calibrated".to_owned(),
                    role: Role::Calibrated,
                    mark: Mark::Points,
                    values: results().map(|of| millimetres(of.geometry.value_m[row])).collect(),
                    half_widths: results().map(|of| half_width(of.geometry.sigma_m(row))).collect(),
                },
                Series {
                    name: "configured".to_owned(),
                    role: Role::Nominal,
                    mark: Mark::Line,
                    values: results().map(|of| millimetres(nominal_value(&of.nominal, change.parameter))).collect(),
                    half_widths: Vec::new(),
                },
            ],
        });
    }
    charts
}
