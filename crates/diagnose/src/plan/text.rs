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
            let [slowest, fastest] = [slowest_m_s, fastest_m_s].map(speed);
            format!("spins of {turns:.0} turns on the spot at {slowest} to {fastest} m/s, both ways")
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
    format!("{} at {} m/s", kind(&manoeuvre.schedule), speed(manoeuvre.speed_m_s))
}

/// A speed that a person sets, m/s: to the millimetre a second, and below 1 cm/s to two digits.
fn speed(m_s: f64) -> String {
    let decimals = if m_s >= 0.01 { 3 } else { (1.0 - m_s.log10().floor()).clamp(3.0, 9.0) as usize };
    let text = format!("{m_s:.decimals$}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
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

#[cfg(test)]
mod tests {
    use super::*;

    fn manoeuvres() -> [Schedule; 6] {
        [
            Schedule::Straights { length_m: 1.5, runs: 2 },
            Schedule::Spins { turn_rad: TAU, runs: 2 },
            Schedule::Spins { turn_rad: 3.0 * TAU, runs: 2 },
            Schedule::Squares { side_m: 1.2, runs_each_way: 1 },
            Schedule::Circles { radius_m: 0.6, turns: None, runs_each_way: 1 },
            Schedule::ValidationPath { length_m: 20.0, measure_every_m: 1.0, runs: 1 },
        ]
    }

    #[test]
    fn what_is_driven_is_said_with_its_sizes_and_its_directions() {
        let said = manoeuvres().map(|schedule| kind(&schedule));
        assert_eq!(said[0], "straights of 1.50 m, forward and backward in turn");
        assert_eq!(said[1], "spins of a turn on the spot, counter-clockwise and clockwise in turn");
        assert_eq!(said[2], "spins of 3 turns on the spot, counter-clockwise and clockwise in turn");
        assert_eq!(said[3], "squares with sides of 1.20 m, clockwise and counter-clockwise in turn");
        assert_eq!(said[4], "circles with a radius of 0.60 m, clockwise and counter-clockwise in turn");
        assert_eq!(said[5], "validation paths of 20 m");
        let both = manoeuvres().map(|schedule| [0, 1].map(|number| direction(&schedule, number)));
        assert_eq!(both[0], ["forward", "backward"]);
        assert_eq!(both[1], ["counter-clockwise", "clockwise"]);
        assert_eq!((both[3], both[4]), (["clockwise", "counter-clockwise"], ["clockwise", "counter-clockwise"]));
        assert_eq!(both[5], ["validation", "validation"]);
        let nouns = manoeuvres().map(|schedule| noun(&schedule));
        assert_eq!(nouns, ["straights", "spins", "spins", "squares", "circles", "paths"]);
        let at_speeds = Schedule::SpinsAtSpeeds {
            turn_rad: 2.0 * TAU,
            slowest_m_s: 0.1,
            fastest_m_s: 0.3,
            speeds: 2,
            runs_each_way: 1,
        };
        let digits = [0.0621, 0.25, 1.0, 0.125, 0.00418, 0.1].map(speed);
        assert_eq!(digits, ["0.062", "0.25", "1", "0.125", "0.0042", "0.1"]);
        assert_eq!(kind(&at_speeds), "spins of 2 turns on the spot at 0.1 to 0.3 m/s, both ways");
    }

    #[test]
    fn an_offset_has_the_digits_of_its_error_and_a_side() {
        let of = |value: f64, sigma: f64, component: &str| {
            offset(&Value { value, sigma: Some(sigma), unit: String::new() }, component)
        };
        assert_eq!(of(0.0123, 0.002, "along"), "12 ± 2 mm ahead");
        assert_eq!(of(-0.0123, 0.0012, "across"), "12.3 ± 1.2 mm to the right");
        assert_eq!(of(0.01234, 0.000_12, "across"), "12.34 ± 0.12 mm to the left");
        assert_eq!(of(-0.5, 0.01, "heading"), "500 ± 10 mrad turned to the right");
        assert_eq!(
            (of(0.0, 1.0, "heading").as_str(), of(-0.001, 0.01, "along").as_str()),
            ("0 ± 1000 mrad turned to the left", "1 ± 10 mm short")
        );
    }

    #[test]
    fn a_plan_says_where_to_measure_and_what_floor_it_needs() {
        let part = |schedule, speed_m_s| Part { manoeuvre: Manoeuvre { schedule, speed_m_s }, pairs: 3 };
        let straight = part(manoeuvres()[0], 0.25);
        let at = |share| where_to_measure(&straight, &Where { direction: 1, share, component: 0 });
        assert!(at(1.0).starts_with(" Predicted is, at the end of the backward straights"), "{}", at(1.0));
        assert!(at(0.5).starts_with(" Predicted is, after 50 % of the time of the backward"), "{}", at(0.5));
        let parts = [straight, part(manoeuvres()[4], 0.125), part(manoeuvres()[3], 0.25), part(manoeuvres()[1], 0.25)];
        let setting = crate::plan::manoeuvres::tests::setting();
        let plan = next_experiment(&parts, &setting, 4.0, "why", Predictions::Sizes(BTreeMap::new()));
        // Six runs of each of four kinds; the straights are the longest along x, and squares and circles are
        // 1.2 m wide.
        assert_eq!((plan.runs, plan.minutes, plan.free_x_m, plan.free_y_m), (24, 4.0, 1.5, 1.2));
        // A session for each speed, the faster first.
        let speeds: Vec<(f64, usize)> = plan.sessions.iter().map(|of| (of.speed_m_s, of.schedules.len())).collect();
        assert_eq!(speeds, [(0.25, 3), (0.125, 1)]);
        let first = plan.protocol.lines().next().expect("a line");
        assert_eq!(first, "# [robot] cruise_speed_m_s = 0.25");
        assert!(plan.protocol.contains("[[protocol]]\nkind = \"circles\""), "{}", plan.protocol);
        assert!(plan.drive.starts_with("6 straights of 1.50 m, forward and backward in turn at 0.25 m/s; 6 circles"));
        assert_eq!(plan.why, format!("{}: why", plan.drive));
        assert_eq!((plan.predicts.len(), plan.predicted), (0, None));
    }
}
