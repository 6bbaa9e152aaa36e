//! What to drive next, with a sketch of it.

use ::diagnose::{Document, NextExperiment};
use motion_programs::Schedule;
use report_page::{Block, Cell, Manoeuvre, Section, Sketch, Table, Tile};

use super::words::count;
use crate::diagnosis_page::words::capitalised;

/// What a plan drives, drawn.
fn sketches(next: &NextExperiment) -> Vec<Sketch> {
    let of = |speed_m_s: f64, schedule: &Schedule| {
        let (manoeuvre, runs, each_way) = match *schedule {
            Schedule::Straights { length_m, runs } => (Manoeuvre::Straight { length_m }, runs, false),
            Schedule::Spins { turn_rad, runs } => (Manoeuvre::Spin { turn_rad }, runs, false),
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

/// The fact of the first screen.
pub(super) fn tile(document: &Document) -> Tile {
    let (value, note) = match &document.next_experiment {
        Some(next) => (
            capitalised(&next.drive),
            if next.free_x_m.max(next.free_y_m) < 0.05 {
                format!("{:.1} min, on the spot", next.minutes)
            } else {
                format!("{:.1} min on {:.1} m by {:.1} m", next.minutes, next.free_x_m, next.free_y_m)
            },
        ),
        None => {
            let why = document.next_experiment_why_null.as_deref().unwrap_or("none was sought");
            ("Nothing new".to_owned(), why.to_owned())
        }
    };
    Tile { label: "Drive next".to_owned(), value, note, section: "next".to_owned() }
}

/// The section.
pub(super) fn section(document: &Document) -> Section {
    let section = Section::new("next", "What to drive next");
    let Some(next) = &document.next_experiment else {
        let why = document.next_experiment_why_null.as_deref().unwrap_or("none was sought");
        return section.text(format!("No drive is proposed: {why}."));
    };
    let mut predicts = Table::new("What the drive will tell", &["cause", "what it is", "what it predicts"]);
    for (id, prediction) in &next.predicts {
        let meaning = effects::description(id).map_or("not in the catalogue", |of| of.meaning);
        predicts.row([Cell::id(id.clone()), Cell::text(meaning), Cell::text(prediction.clone())]);
    }
    let section = section.with(Block::Sketches(sketches(next))).text(capitalised(&next.why));
    let section = if predicts.rows.is_empty() { section } else { section.with(Block::Table(predicts)) };
    section.with(Block::Code("The drive as part of a scenario (TOML)".to_owned(), next.protocol.trim_end().to_owned()))
}
