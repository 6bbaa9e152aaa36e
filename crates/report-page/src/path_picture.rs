//! The robot's path, run by run: what the instrument measured, and dead reckoning under calibrations.

use serde_json::{Value, json};

use crate::decimation::{Point, kept};
use crate::embedded_json::embedded;
use crate::numbers::shown;
use crate::role::Role;
use crate::table::{Cell, Table};

/// Instants that are drawn, over all runs: with four tracks a page takes 0.15 MB for them, and a screen has
/// fewer pixels along a path.
pub const POINT_BUDGET: usize = 6000;

/// Runs that are drawn. A list of more cannot be used, and both ends of all would take the whole budget.
pub const MAX_DRAWN_RUNS: usize = 400;

/// Steps of the grid of positions over the larger side of all paths: at the largest magnification of the
/// picture, 200 times, one is less than a pixel.
const GRID_STEPS: f64 = 1e6;

/// Paths of runs.
#[derive(Debug, Clone, PartialEq)]
pub struct PathPicture {
    /// What it shows, as a finding.
    pub title: String,
    /// How to read it.
    pub caption: String,
    /// The tracks of every run: name and role.
    pub tracks: Vec<(String, Role)>,
    /// The runs, those that are to be drawn first at the front.
    pub runs: Vec<PathRun>,
}

/// One run.
#[derive(Debug, Clone, PartialEq)]
pub struct PathRun {
    /// Its name.
    pub name: String,
    /// Positions in metres, a list for each track; all of one length, or empty where there are none.
    pub tracks: Vec<Vec<Point>>,
    /// Single positions that the instrument measured, metres, where they are too few for a track.
    pub marks: Vec<Point>,
}

/// Paths, or errors, of runs as they are drawn.
pub(crate) struct Drawn {
    pub(crate) json: String,
    pub(crate) table: Table,
    /// How much of it is drawn, in words.
    pub(crate) share: String,
}

impl PathPicture {
    /// What a screen reader says of the picture.
    pub(crate) fn description(&self) -> String {
        let names: Vec<&str> = self.tracks.iter().map(|(name, _)| name.as_str()).collect();
        format!(
            "Paths of {} runs seen from above: {}. Their ends are in the table below.",
            self.runs.len(),
            names.join(", ")
        )
    }

    pub(crate) fn drawn(&self) -> Drawn {
        let runs = &self.runs[..self.runs.len().min(MAX_DRAWN_RUNS)];
        let views: Vec<&[Vec<Point>]> = runs.iter().map(|run| run.tracks.as_slice()).collect();
        let kept = kept(&views, POINT_BUDGET);
        let points = |runs: &[PathRun]| -> usize {
            runs.iter().map(|run| run.tracks.iter().map(Vec::len).max().unwrap_or(0)).sum()
        };
        let (drawn, all) = (kept.iter().map(Vec::len).sum::<usize>(), points(&self.runs));
        let mut share = if drawn == all {
            format!("Drawn: all {all} instants.")
        } else {
            format!("Drawn: {drawn} of {all} instants, those that shape the paths most.")
        };
        if runs.len() < self.runs.len() {
            share.push_str(&format!(" Drawn: {} of {} runs, those that drift most.", runs.len(), self.runs.len()));
        }
        let step_m = step_m(runs);
        let origin = runs.iter().flat_map(|run| run.tracks.iter().flatten()).next().copied().unwrap_or_default();
        let run = |(run, kept): (&PathRun, &Vec<usize>)| {
            let track = |track: &Vec<Point>| {
                if track.is_empty() { Value::Null } else { json!(steps(track, kept, origin, step_m)) }
            };
            let every: Vec<usize> = (0..run.marks.len()).collect();
            json!({
                "name": run.name,
                "tracks": run.tracks.iter().map(track).collect::<Vec<Value>>(),
                "marks": steps(&run.marks, &every, origin, step_m),
            })
        };
        let tracks: Vec<Value> =
            self.tracks.iter().map(|(name, role)| json!({ "name": name, "role": role.key() })).collect();
        let json = embedded(&json!({
            "step_m": step_m,
            "origin_m": origin,
            "tracks": tracks,
            "runs": runs.iter().zip(&kept).map(run).collect::<Vec<Value>>(),
        }));
        Drawn { json, table: self.table(), share }
    }

    /// Where runs end.
    fn table(&self) -> Table {
        let mut table = Table::new("Where runs end: x and y in metres", &["run"]);
        table.headings.extend(self.tracks.iter().map(|(name, _)| name.clone()));
        for run in &self.runs {
            let end = |track: &Vec<Point>| {
                Cell::number(match track.last() {
                    None => "–".to_owned(),
                    Some([x_m, y_m]) => format!("{}, {}", shown(*x_m), shown(*y_m)),
                })
            };
            table.row(std::iter::once(Cell::id(run.name.clone())).chain(run.tracks.iter().map(end)));
        }
        table
    }
}

/// Step of the grid: a power of ten.
fn step_m(runs: &[PathRun]) -> f64 {
    let points = || runs.iter().flat_map(|run| run.tracks.iter().flatten());
    let span = |axis: usize| {
        let low = points().map(|point| point[axis]).fold(f64::INFINITY, f64::min);
        let high = points().map(|point| point[axis]).fold(f64::NEG_INFINITY, f64::max);
        high - low
    };
    let span_m = span(0).max(span(1));
    // Paths of no size, such as those of turns on the spot, are seen to a micrometre.
    if span_m.is_finite() && span_m > 1.0 { 10.0_f64.powi((span_m / GRID_STEPS).log10().ceil() as i32) } else { 1e-6 }
}

/// Differences of whole steps of the grid, x and y in turn.
fn steps(track: &[Point], kept: &[usize], origin: Point, step_m: f64) -> Vec<i64> {
    let mut before = [0_i64; 2];
    let mut differences = Vec::with_capacity(2 * kept.len());
    for at in kept {
        for axis in 0..2 {
            let place = ((track[*at][axis] - origin[axis]) / step_m).round() as i64;
            differences.push(place - before[axis]);
            before[axis] = place;
        }
    }
    differences
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(runs: usize, points: usize) -> PathPicture {
        let track = |shift: f64| {
            (0..points).map(|k| [f64::from(k as u32) * 1e-3, shift + (f64::from(k as u32) * 1e-2).sin()]).collect()
        };
        let run = |number: usize| PathRun {
            name: format!("run-{number}"),
            tracks: vec![track(0.0), track(0.01)],
            marks: vec![],
        };
        PathPicture {
            title: "paths".to_owned(),
            caption: String::new(),
            tracks: vec![("measured".to_owned(), Role::Truth), ("nominal".to_owned(), Role::Nominal)],
            runs: (0..runs).map(run).collect(),
        }
    }

    #[test]
    fn positions_are_read_back_to_half_a_step() {
        let picture = picture(2, 50);
        let data: Value = serde_json::from_str(&picture.drawn().json).expect("JSON");
        let step_m = data["step_m"].as_f64().expect("a step");
        let differences = data["runs"][1]["tracks"][1].as_array().expect("a track");
        let sum = |axis: usize| differences.iter().skip(axis).step_by(2).filter_map(Value::as_i64).sum::<i64>() as f64;
        for axis in 0..2 {
            let end_m = data["origin_m"][axis].as_f64().expect("an origin") + step_m * sum(axis);
            let there_m = picture.runs[1].tracks[1].last().expect("points")[axis];
            // Half a step, and rounding of the sum.
            assert!((end_m - there_m).abs() <= 0.5000001 * step_m, "{end_m} {there_m}");
        }
        assert_eq!(picture.drawn().share, "Drawn: all 100 instants.");
    }

    #[test]
    fn many_runs_and_points_stay_small_and_the_page_says_what_is_left_out() {
        let drawn = picture(MAX_DRAWN_RUNS + 100, 100).drawn();
        assert!(
            drawn.share.contains("of 50000 instants") && drawn.share.contains("400 of 500 runs"),
            "{}",
            drawn.share
        );
        // Four numbers an instant, of at most eight characters each.
        assert!(drawn.json.len() < 4 * 8 * POINT_BUDGET + 100 * MAX_DRAWN_RUNS, "{}", drawn.json.len());
    }

    #[test]
    fn a_run_that_nothing_measured_has_no_such_track() {
        let mut picture = picture(1, 3);
        picture.runs[0].tracks[0].clear();
        let drawn = picture.drawn();
        let data: Value = serde_json::from_str(&drawn.json).expect("JSON");
        assert_eq!(data["runs"][0]["tracks"][0], Value::Null);
        assert_eq!(drawn.table.rows[0][1], Cell::number("–"));
    }
}
