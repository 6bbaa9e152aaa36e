//! A plan in words, and as the part of a scenario that drives it.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use motion_programs::Schedule;
use serde::Serialize;

use super::constraints::Setting;
use super::manoeuvres::{Manoeuvre, Part, Where};
use crate::document::{NextExperiment, PlannedSession, Predicted, Value};

/// What is driven, of any number of runs.
fn kind(schedule: &Schedule) -> String {
    match *schedule {
        Schedule::Straights { length_m, .. } => format!("straights of {length_m:.2} m, forward and backward in turn"),
        Schedule::Spins { turn_rad, .. } => {
            let turns = turn_rad / TAU;
            let turns = if turns == 1.0 { "a turn".to_owned() } else { format!("{turns:.0} turns") };
            format!("spins of {turns} on the spot, counter-clockwise and clockwise in turn")
        }
        Schedule::SpinsAtSpeeds { turn_rad, slowest_m_s, fastest_m_s, .. } => {
            let turns = turn_rad / TAU;
            format!("spins of {turns:.0} turns on the spot at {slowest_m_s} to {fastest_m_s} m/s, both ways")
        }
        Schedule::Squares { side_m, .. } => {
            format!("squares with sides of {side_m:.2} m, clockwise and counter-clockwise in turn")
        }
        Schedule::Circles { radius_m, .. } => {
            format!("circles with a radius of {radius_m:.2} m, clockwise and counter-clockwise in turn")
        }
        Schedule::ValidationPath { length_m, .. } => format!("validation paths of {length_m:.0} m"),
    }
}

pub(super) fn manoeuvre(manoeuvre: &Manoeuvre) -> String {
    format!("{} at {} m/s", kind(&manoeuvre.schedule), manoeuvre.speed_m_s)
}

fn driven(part: &Part) -> String {
    format!("{} {}", part.schedule().runs(), manoeuvre(&part.manoeuvre))
}

/// Runs of one direction.
pub(super) fn direction(schedule: &Schedule, number: usize) -> &'static str {
    match (schedule, number) {
        (Schedule::Straights { .. }, 0) => "forward",
        (Schedule::Straights { .. }, _) => "backward",
        (Schedule::Spins { .. } | Schedule::SpinsAtSpeeds { .. }, 0)
        | (Schedule::Squares { .. } | Schedule::Circles { .. }, 1) => "counter-clockwise",
        (
            Schedule::Spins { .. }
            | Schedule::SpinsAtSpeeds { .. }
            | Schedule::Squares { .. }
            | Schedule::Circles { .. },
            _,
        ) => "clockwise",
        (Schedule::ValidationPath { .. }, _) => "validation",
    }
}

const fn noun(schedule: &Schedule) -> &'static str {
    match schedule {
        Schedule::Straights { .. } => "straights",
        Schedule::Spins { .. } | Schedule::SpinsAtSpeeds { .. } => "spins",
        Schedule::Squares { .. } => "squares",
        Schedule::Circles { .. } => "circles",
        Schedule::ValidationPath { .. } => "paths",
    }
}

pub(super) fn where_to_measure(part: &Part, at: &Where) -> String {
    let schedule = &part.manoeuvre.schedule;
    let (direction, noun) = (direction(schedule, at.direction), noun(schedule));
    let when =
        if at.share > 0.999 { "at the end".to_owned() } else { format!("after {:.0} % of the time", 100.0 * at.share) };
    format!(
        " Predicted is, {when} of the {direction} {noun}, their mean, where the instrument measures the robot relative to dead reckoning with the calibrated geometry alone."
    )
}

/// A size with its standard deviation, and a direction: ahead, to the left, turned to the left are positive.
fn offset(value: &Value, component: &str) -> String {
    let (milli, sigma) = (1e3 * value.value, 1e3 * value.sigma.unwrap_or(0.0));
    let decimals = usize::from(sigma < 1.5) + usize::from(sigma < 0.15);
    let (unit, more, less) = match component {
        "along" => ("mm", "ahead", "short"),
        "across" => ("mm", "to the left", "to the right"),
        _ => ("mrad", "turned to the left", "turned to the right"),
    };
    let side = if milli >= 0.0 { more } else { less };
    format!("{:.decimals$} ± {sigma:.decimals$} {unit} {side}", milli.abs())
}

/// The blocks of a scenario that drive schedules.
pub(super) fn toml(schedules: &[Schedule]) -> String {
    #[derive(Serialize)]
    struct Blocks<'s> {
        protocol: &'s [Schedule],
    }
    toml::to_string(&Blocks { protocol: schedules }).unwrap_or_default()
}

/// Parts by speed, fastest first: runs of one speed are one session.
pub(super) fn sessions(parts: &[Part]) -> Vec<PlannedSession> {
    let mut speeds: Vec<f64> = parts.iter().map(|part| part.manoeuvre.speed_m_s).collect();
    speeds.sort_by(|a, b| b.total_cmp(a));
    speeds.dedup();
    speeds
        .into_iter()
        .map(|speed_m_s| {
            let own = parts.iter().filter(|part| part.manoeuvre.speed_m_s == speed_m_s);
            let schedules: Vec<Schedule> = own.map(Part::schedule).collect();
            PlannedSession { speed_m_s, protocol_toml: toml(&schedules), schedules }
        })
        .collect()
}

/// The protocol as text that a scenario takes: speeds stand above as remarks, because they are the robot's.
fn protocol(sessions: &[PlannedSession]) -> String {
    let block = |session: &PlannedSession| {
        format!("# [robot] cruise_speed_m_s = {}\n{}", session.speed_m_s, session.protocol_toml)
    };
    sessions.iter().map(block).collect::<Vec<_>>().join("\n")
}

/// What is said of each name beforehand.
pub(super) enum Predictions {
    /// From which size on it would show.
    Sizes(BTreeMap<String, String>),
    /// What it will show.
    Of(Predicted),
}

pub(super) fn next_experiment(
    parts: &[Part],
    setting: &Setting,
    minutes: f64,
    why: &str,
    predicts: Predictions,
) -> NextExperiment {
    let (predicts, predicted) = match predicts {
        Predictions::Sizes(predicts) => (predicts, None),
        Predictions::Of(predicted) => {
            let words = |(id, value): (&String, &Value)| (id.clone(), offset(value, &predicted.component));
            (predicted.values.iter().map(words).collect(), Some(predicted))
        }
    };
    let sessions = sessions(parts);
    let drive: Vec<String> = parts.iter().map(driven).collect();
    let drive = drive.join("; ");
    let runs = parts.iter().map(|part| part.schedule().runs()).sum();
    let needs = |part: &Part| match part.manoeuvre.schedule {
        Schedule::Straights { length_m, .. } => [length_m, 0.0],
        Schedule::Squares { side_m, .. } => [side_m, side_m],
        Schedule::Circles { radius_m, .. } => [2.0 * radius_m, 2.0 * radius_m],
        Schedule::Spins { .. } | Schedule::SpinsAtSpeeds { .. } | Schedule::ValidationPath { .. } => [0.0, 0.0],
    };
    let free_m = parts.iter().map(needs).fold([0.0_f64; 2], |a, b| [a[0].max(b[0]), a[1].max(b[1])]);
    NextExperiment {
        protocol: protocol(&sessions),
        why: format!("{drive}: {why}"),
        predicts,
        predicted,
        drive,
        sessions,
        runs,
        minutes,
        free_x_m: free_m[0],
        free_y_m: free_m[1],
        within: setting.within.clone(),
    }
}
