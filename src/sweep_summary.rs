//! A sweep by method: one row a method, one column a point, a table a quantity.

use bench::{PointResult, SweepResult};

use crate::sweep_table::{concise, symbol};
use crate::terminal::{Failure, Terminal, table};

/// Points beside each other in 100 columns.
const POINTS_A_TABLE: usize = 6;

/// A number of a method at a point with its standard error.
type Number<'a> = Box<dyn Fn(&PointResult, &str) -> Option<(f64, f64)> + 'a>;

pub(crate) fn show(result: &SweepResult, terminal: &Terminal) -> Result<(), Failure> {
    terminal.say(&format!(
        "{}: seed {}, {} trials at each of {} points; (8) = standard error of the last digit",
        result.scenario,
        result.seed,
        result.trials,
        result.points.len()
    ))?;
    let Some(first) = result.points.first() else { return Ok(()) };
    let (mut methods, mut parameters): (Vec<&str>, Vec<&str>) = (Vec::new(), Vec::new());
    for estimator in &first.estimators {
        if !methods.contains(&estimator.method.as_str()) {
            methods.push(&estimator.method);
        }
        if !parameters.contains(&estimator.parameter.as_str()) {
            parameters.push(&estimator.parameter);
        }
    }
    let mut quantities: Vec<(String, Number<'_>)> = Vec::new();
    if result.points.iter().any(|point| !point.drift.is_empty()) {
        quantities.push(("RMS drift on the validation path, per cent of the distance".to_owned(), Box::new(drift)));
    }
    for parameter in parameters {
        let title = format!("RMSE of {}, per cent of the true value", symbol(parameter));
        quantities.push((title, Box::new(move |point, method| rmse(point, method, parameter))));
    }
    let axes: Vec<&str> = first.levels.keys().map(String::as_str).collect();
    if !axes.is_empty() {
        terminal.say(&format!("columns are levels of {}", axes.join(", ")))?;
    }
    for points in result.points.chunks(POINTS_A_TABLE) {
        for (title, number) in &quantities {
            terminal.say(title)?;
            let mut headers = vec!["method".to_owned()];
            headers.extend(points.iter().map(label));
            let mut rows = table(&headers.iter().map(String::as_str).collect::<Vec<_>>(), 1);
            for method in &methods {
                let cells = points.iter().map(|point| match number(point, method) {
                    Some((value, error)) => {
                        let mark = if failures(point, method) > 0 { "!" } else { "" };
                        format!("{}{mark}", concise(value, error))
                    }
                    None => "–".to_owned(),
                });
                rows.add_row([(*method).to_owned()].into_iter().chain(cells));
            }
            terminal.say(&rows.to_string())?;
        }
    }
    for method in &methods {
        let failed: Vec<u64> = result.points.iter().map(|point| failures(point, method)).collect();
        let (Some(least), Some(most)) = (failed.iter().min(), failed.iter().max()) else { continue };
        if *most > 0 {
            let trials = result.trials;
            terminal.say(&format!(
                "! {method} gave no value in {least} to {most} of {trials} trials, which are left out"
            ))?;
        }
    }
    Ok(())
}

/// A point by its levels.
fn label(point: &PointResult) -> String {
    let levels: Vec<String> = point.levels.values().map(ToString::to_string).collect();
    if levels.is_empty() { "all".to_owned() } else { levels.join(", ") }
}

fn drift(point: &PointResult, method: &str) -> Option<(f64, f64)> {
    let drift = point.drift.iter().find(|drift| drift.method == method)?;
    drift.rms_percent.zip(drift.rms_percent_mcse)
}

fn rmse(point: &PointResult, method: &str, parameter: &str) -> Option<(f64, f64)> {
    let of = point.estimators.iter().find(|of| of.method == method && of.parameter == parameter)?;
    let percent = 100.0 / of.truth;
    let (value, error) = of.rmse.zip(of.rmse_mcse)?;
    Some((value * percent, error * percent))
}

/// Trials in which the method gave no value, of the parameter that lacks most.
fn failures(point: &PointResult, method: &str) -> u64 {
    point.estimators.iter().filter(|of| of.method == method).map(|of| of.failures).max().unwrap_or(0)
}
