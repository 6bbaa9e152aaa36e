//! `yair calibrate --online`: the parameters as a robot would follow them while it drives.

use std::process::ExitCode;

use calib::methods::augmented_kalman::{AugmentedKalman, Followed, settled_at};
use dataset::Session;
use serde_json::{Value, json};

use crate::terminal::{Failure, Terminal, cell, table};

/// Rows of the table at most; the JSON has every measurement.
const ROWS: usize = 16;

pub(super) fn run(sessions: &[Session<'_>], terminal: &Terminal) -> Result<ExitCode, Failure> {
    let followed = AugmentedKalman::DEFAULT.follow(sessions).map_err(|error| error.to_string())?;
    let settled = settled_at(&followed);
    let mut table =
        table(&["measurement", "run", "distance m", "turn °", "left mm", "±", "right mm", "±", "wheelbase mm", "±"], 2);
    // Measurements that lie apart by a constant factor: at first much is learned, later little.
    let mut due = 1.0;
    for step in &followed {
        let measurement = step.measurements as f64;
        let is_settling = settled.is_some_and(|settled| settled.measurements == step.measurements);
        if measurement >= due || is_settling || step.measurements == followed.len() {
            while due <= measurement {
                let factor = (followed.len() as f64).powf(1.0 / (ROWS as f64 - 3.0));
                due = (due * factor).max(due + 1.0);
            }
            table.add_row(row(step, is_settling));
        }
    }
    terminal.say(&table.to_string())?;
    let verdict = match settled {
        Some(step) => format!(
            "settled after {} measurements, {:.1} m and {:.0}° of turns (run {}): no factor moves by more than what it learns, and each is known to 0.2 %",
            step.measurements,
            step.distance_m,
            step.turn_rad.to_degrees(),
            step.run
        ),
        None => "not settled: some factor is known to worse than 0.2 %, or still moves; drive on, straight and round both ways".to_owned(),
    };
    terminal.say(&verdict)?;
    let track: Vec<Value> = followed.iter().map(document).collect();
    terminal.document(&json!({ "online": { "settled": settled.map(document), "track": track } }))?;
    Ok(ExitCode::SUCCESS)
}

fn row(step: &Followed, is_settling: bool) -> Vec<String> {
    let diameter_m = step.geometry.wheel_diameter_m();
    let values = [diameter_m.left, diameter_m.right, step.geometry.wheel_separation_m()];
    let mark = if is_settling { " settled" } else { "" };
    let mut cells = vec![
        step.measurements.to_string() + mark,
        step.run.clone(),
        format!("{:.1}", step.distance_m),
        format!("{:.0}", step.turn_rad.to_degrees()),
    ];
    for (value, sigma) in values.iter().zip(step.sigma_m.iter()) {
        cells.extend([cell(Some(*value), 1e3, 2), cell(Some(*sigma), 1e3, 2)]);
    }
    cells
}

fn document(step: &Followed) -> Value {
    let diameter_m = step.geometry.wheel_diameter_m();
    let value = |value: f64, sigma: f64| json!({ "value": value, "sigma": sigma });
    json!({
        "run": step.run,
        "looks": step.measurements,
        "way_m": step.distance_m,
        "turn_rad": step.turn_rad,
        "settled": step.settled,
        "parameters": {
            "left_wheel_diameter_m": value(diameter_m.left, step.sigma_m[0]),
            "right_wheel_diameter_m": value(diameter_m.right, step.sigma_m[1]),
            "wheel_separation_m": value(step.geometry.wheel_separation_m(), step.sigma_m[2]),
        },
    })
}
