//! Errors of dead reckoning along each run, against time or distance: one run at a time, chosen on the page.

use serde_json::{Value, json};

use crate::embedded_json::embedded;
use crate::numbers::{rounded, shown};
use crate::path_picture::{Drawn, MAX_DRAWN_RUNS};
use crate::role::Role;
use crate::table::{Cell, Table};

/// Instants that are drawn, over all runs: with three models a page takes 0.2 MB for them.
const INSTANT_BUDGET: usize = 4000;
/// Fewer instants of a run are no curve.
const MIN_INSTANTS: usize = 8;

/// Errors of runs under several models.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorPicture {
    /// What it shows.
    pub title: String,
    /// How to read it.
    pub caption: String,
    /// The models: name and role.
    pub models: Vec<(String, Role)>,
    /// The runs, those that are to be chosen first at the front.
    pub runs: Vec<RunErrors>,
}

/// Errors of one run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunErrors {
    /// Its name.
    pub name: String,
    /// Instants since the run's start, seconds.
    pub t_s: Vec<f64>,
    /// Distance driven by then, metres.
    pub distance_m: Vec<f64>,
    /// For each model its errors at these instants; `None` where it has none.
    pub models: Vec<Option<ModelErrors>>,
}

/// Errors of one model along a run.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelErrors {
    /// Distance between the dead-reckoned and the measured position, metres.
    pub position_m: Vec<f64>,
    /// Heading of dead reckoning over the measured one, radians; empty where none was measured.
    pub heading_rad: Vec<f64>,
}

impl ErrorPicture {
    pub(crate) fn description(&self) -> String {
        let names: Vec<&str> = self.models.iter().map(|(name, _)| name.as_str()).collect();
        format!(
            "Position and heading errors of {} along one run at a time, of {}. The largest are in the table below.",
            names.join(", "),
            self.runs.len()
        )
    }

    pub(crate) fn drawn(&self) -> Drawn {
        let runs = &self.runs[..self.runs.len().min(MAX_DRAWN_RUNS)];
        let each = (INSTANT_BUDGET / runs.len().max(1)).max(MIN_INSTANTS);
        let models: Vec<Value> =
            self.models.iter().map(|(name, role)| json!({ "name": name, "role": role.key() })).collect();
        let (mut drawn, mut all) = (0, 0);
        let data: Vec<Value> = runs
            .iter()
            .map(|run| {
                let kept = even(run.t_s.len(), each);
                (drawn, all) = (drawn + kept.len(), all + run.t_s.len());
                let of = |values: &[f64], scale: f64| -> Value {
                    kept.iter().filter_map(|at| values.get(*at)).map(|value| rounded(scale * value, 3)).collect()
                };
                let model = |model: &Option<ModelErrors>| match model {
                    None => Value::Null,
                    Some(errors) => json!({
                        "position": of(&errors.position_m, 1e3),
                        "heading": of(&errors.heading_rad, 180.0 / std::f64::consts::PI),
                    }),
                };
                json!({
                    "name": run.name,
                    "t_s": of(&run.t_s, 1.0),
                    "distance_m": of(&run.distance_m, 1.0),
                    "models": run.models.iter().map(model).collect::<Vec<Value>>(),
                })
            })
            .collect();
        let share = if drawn == all {
            format!("Drawn: all {all} measured instants.")
        } else {
            format!("Drawn: {drawn} of {all} measured instants, evenly spaced.")
        };
        let json = embedded(&json!({ "models": models, "runs": data }));
        Drawn { json, table: self.table(), share }
    }

    /// The largest error of every run.
    fn table(&self) -> Table {
        let mut table = Table::new("Largest errors along each run", &["run"]);
        for (name, _) in &self.models {
            table.headings.extend([format!("{name}: position, mm"), format!("{name}: heading, °")]);
        }
        let largest = |values: &[f64], scale: f64| {
            let largest = values.iter().map(|value| value.abs()).fold(f64::NAN, f64::max);
            Cell::number(if largest.is_nan() { "–".to_owned() } else { shown(scale * largest) })
        };
        for run in &self.runs {
            let cells = run.models.iter().flat_map(|model| {
                let empty = ModelErrors { position_m: Vec::new(), heading_rad: Vec::new() };
                let errors = model.as_ref().unwrap_or(&empty);
                let degrees = 180.0 / std::f64::consts::PI;
                [largest(&errors.position_m, 1e3), largest(&errors.heading_rad, degrees)]
            });
            table.row(std::iter::once(Cell::id(run.name.clone())).chain(cells));
        }
        table
    }
}

/// At most so many places of a list, evenly, with both ends.
fn even(length: usize, most: usize) -> Vec<usize> {
    if length <= most {
        return (0..length).collect();
    }
    (0..most).map(|k| k * (length - 1) / (most - 1)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(runs: usize, instants: usize) -> ErrorPicture {
        let ramp: Vec<f64> = (0..instants).map(|k| k as f64 * 0.1).collect();
        let errors = ModelErrors { position_m: ramp.clone(), heading_rad: vec![-0.5; instants] };
        let run = |number: usize| RunErrors {
            name: format!("run-{number}"),
            t_s: ramp.clone(),
            distance_m: ramp.clone(),
            models: vec![Some(errors.clone()), None],
        };
        ErrorPicture {
            title: String::new(),
            caption: String::new(),
            models: vec![("nominal".to_owned(), Role::Nominal), ("calibrated".to_owned(), Role::Calibrated)],
            runs: (0..runs).map(run).collect(),
        }
    }

    #[test]
    fn errors_are_in_millimetres_and_degrees_and_the_largest_stand_in_the_table() {
        let drawn = picture(1, 11).drawn();
        let data: Value = serde_json::from_str(&drawn.json).expect("JSON");
        assert_eq!(data["runs"][0]["models"][0]["position"][10], json!(1000.0));
        assert_eq!(data["runs"][0]["models"][0]["heading"][0], json!(-28.65));
        assert_eq!(data["runs"][0]["models"][1], Value::Null);
        assert_eq!(drawn.table.rows[0][1..], ["1000", "28.65", "–", "–"].map(Cell::number));
        assert_eq!(drawn.share, "Drawn: all 11 measured instants.");
    }

    #[test]
    fn long_logs_stay_small_and_keep_both_ends_of_each_run() {
        let drawn = picture(10, 5000).drawn();
        assert!(drawn.share.contains(&format!("{INSTANT_BUDGET} of 50000")), "{}", drawn.share);
        let data: Value = serde_json::from_str(&drawn.json).expect("JSON");
        let times = data["runs"][9]["t_s"].as_array().expect("times");
        assert_eq!((times.first(), times.last()), (Some(&json!(0.0)), Some(&json!(499.9))));
    }
}
