//! What to drive next, with a sketch of it.

use ::diagnose::{Document, NextExperiment, Predicted};
use motion_programs::Schedule;
use report_page::{Axis, Block, Cell, Chart, Manoeuvre, Mark, Role, Section, Series, Sketch, Table, Tile};

use super::words::count;
use crate::diagnosis_page::predictions_title;
use crate::diagnosis_page::words::capitalised;

const TITLE: &str = "What to drive next";

/// Half of a 95 % interval, in standard errors.
const HALF_WIDTH: f64 = 1.959_964;

/// What a plan drives, drawn.
fn sketches(next: &NextExperiment) -> Vec<Sketch> {
    let of = |speed_m_s: f64, schedule: &Schedule| {
        let (manoeuvre, runs, each_way) = match *schedule {
            Schedule::Straights { length_m, runs } => (Manoeuvre::Straight { length_m }, runs, false),
            Schedule::Spins { turn_rad, runs } => (Manoeuvre::Spin { turn_rad }, runs, false),
            Schedule::SpinsAtSpeeds { turn_rad, speeds, runs_each_way, .. } => {
                (Manoeuvre::Spin { turn_rad }, speeds * runs_each_way, true)
            }
            Schedule::Squares { side_m, runs_each_way } => (Manoeuvre::Square { side_m }, runs_each_way, true),
            Schedule::Circles { radius_m, runs_each_way, .. } => (Manoeuvre::Circle { radius_m }, runs_each_way, true),
            Schedule::ValidationPath { length_m, runs, .. } => (Manoeuvre::Polygon { length_m }, runs, false),
        };
        let ways = if each_way { " each way" } else { "" };
        let caption = format!("{}{ways} at {speed_m_s:.2} m/s", count(runs as usize, "run"));
        Sketch { manoeuvre, caption }
    };
    let sessions = next.sessions.iter();
    sessions.flat_map(|session| session.schedules.iter().map(|schedule| of(session.speed_m_s, schedule))).collect()
}

/// A side that reads 0.0 m is no side.
const MIN_SIDE_M: f64 = 0.05;

/// The floor that is needed, in words.
fn floor(next: &NextExperiment) -> String {
    let (longer_m, shorter_m) = (next.free_x_m.max(next.free_y_m), next.free_x_m.min(next.free_y_m));
    if longer_m < MIN_SIDE_M {
        "on the spot".to_owned()
    } else if shorter_m < MIN_SIDE_M {
        format!("along {longer_m:.1} m")
    } else {
        format!("on {longer_m:.1} m by {shorter_m:.1} m")
    }
}

/// The fact of the first screen; the section has every detail.
pub(super) fn tile(document: &Document) -> Tile {
    match &document.next_experiment {
        Some(next) => tile_of(next),
        None => with_label(
            "Nothing new".to_owned(),
            "no drive was found that would add information; the reason is below".to_owned(),
        ),
    }
}

/// The same of a plan.
pub(super) fn tile_of(next: &NextExperiment) -> Tile {
    let mut schedules = next.sessions.iter().flat_map(|session| &session.schedules);
    let value = match (schedules.next(), schedules.next()) {
        (Some(only), None) => manoeuvre(only),
        _ => count(next.sessions.iter().map(|session| session.schedules.len()).sum(), "kind") + " of manoeuvre",
    };
    let runs = count(usize::try_from(next.runs).unwrap_or(usize::MAX), "run");
    with_label(value, format!("{runs} in {:.1} min {}", next.minutes, floor(next)))
}

/// A manoeuvre in three words.
fn manoeuvre(schedule: &Schedule) -> String {
    match *schedule {
        Schedule::Straights { length_m, .. } => format!("Straights of {length_m:.1} m"),
        Schedule::Spins { turn_rad, .. } | Schedule::SpinsAtSpeeds { turn_rad, .. } => {
            let turns = turn_rad.abs() / std::f64::consts::TAU;
            if turns < 1.0 {
                format!("Spins of {:.0}°", 360.0 * turns)
            } else {
                let turns = format!("{turns:.3}").replace(".000", "");
                let plural = if turns == "1" { "" } else { "s" };
                format!("Spins of {turns} turn{plural}")
            }
        }
        Schedule::Squares { side_m, .. } => format!("Squares with sides of {side_m:.1} m"),
        Schedule::Circles { radius_m, .. } => format!("Circles with a radius of {radius_m:.2} m"),
        Schedule::ValidationPath { length_m, .. } => format!("A path of {length_m:.0} m"),
    }
}

fn with_label(value: String, note: String) -> Tile {
    Tile { label: "Drive next".to_owned(), value, note, section: "next".to_owned() }
}

/// A plan in a sentence.
pub(super) fn headline(next: &NextExperiment) -> String {
    format!("Drive {}.", next.drive)
}

/// The section.
pub(super) fn section(document: &Document) -> Section {
    match &document.next_experiment {
        Some(next) => section_of(next),
        None => {
            let why = document.next_experiment_why_null.as_deref().unwrap_or("none was sought");
            Section::new("next", TITLE).text(format!("No drive is proposed: {why}."))
        }
    }
}

/// What each cause predicts, with the causes along the axis.
fn predictions(predicted: &Predicted) -> Chart {
    let (quantity, unit) = match &predicted.component[..] {
        "along" => ("ahead of dead reckoning", "mm"),
        "across" => ("to the left of dead reckoning", "mm"),
        _ => ("turned to the left of dead reckoning", "mrad"),
    };
    let when = if predicted.share_of_duration > 0.999 {
        "at the end".to_owned()
    } else {
        format!("after {:.0} % of the time", 100.0 * predicted.share_of_duration)
    };
    let values = || predicted.values.values();
    let series = Series {
        name: "prediction".to_owned(),
        role: Role::Calibrated,
        mark: Mark::Points,
        values: values().map(|value| Some(1e3 * value.value)).collect(),
        half_widths: values().map(|value| value.sigma.map(|sigma| HALF_WIDTH * 1e3 * sigma)).collect(),
    };
    Chart {
        title: predictions_title(predicted),
        caption: format!(
            "Where the {} runs will be seen, {when}, if one of these is the cause. Bars are 95 %: where they do not overlap, the drive separates the causes.",
            predicted.direction
        ),
        x: Axis::new("if the cause is", ""),
        y: Axis::new(quantity, unit),
        at: (0_u32..).map(f64::from).take(predicted.values.len()).collect(),
        names: predicted.values.keys().cloned().collect(),
        series: vec![series],
    }
}

/// The section of a plan.
pub(super) fn section_of(next: &NextExperiment) -> Section {
    let section = Section::new("next", TITLE);
    let mut predicts = Table::new("What the drive will show", &["cause", "what it is", "what it predicts"]);
    for (id, prediction) in &next.predicts {
        let meaning = effects::description(id).map_or("not in the catalogue", |of| of.meaning);
        predicts.row([Cell::id(id.clone()), Cell::text(meaning), Cell::text(prediction.clone())]);
    }
    let section = section.with(Block::Sketches(sketches(next))).text(capitalised(&next.why));
    let section = match &next.predicted {
        Some(predicted) => section.with(Block::Chart(predictions(predicted))),
        None => section,
    };
    let section = if predicts.rows.is_empty() { section } else { section.with(Block::Table(predicts)) };
    section.with(Block::Code("The drive as part of a scenario (TOML)".to_owned(), next.protocol.trim_end().to_owned()))
}
