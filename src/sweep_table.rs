//! A sweep in the terminal: within 100 columns, errors in the digits' own place.

use bench::{EstimatorResult, PointResult, SweepResult};
use scenario::Level;

use crate::terminal::{Failure, Terminal, table};

/// Most digits behind the point: beyond, a table of per cents is unreadable.
const MAX_DECIMALS: f64 = 7.0;

pub(crate) fn show(result: &SweepResult, terminal: &Terminal) -> Result<(), Failure> {
    let trials = match result.precision {
        Some(precision) => format!("trials until every Monte-Carlo error is at most {} %", 100.0 * precision),
        None => format!("{} trials", result.trials),
    };
    terminal.say(&format!(
        "{}: seed {}, {trials} at each of {} points; per cent of the true value; (8) = standard error of the last digit",
        result.scenario,
        result.seed,
        result.points.len()
    ))?;
    let axes = Axes::of(result);
    for line in axes.legend() {
        terminal.say(&line)?;
    }
    let mut headers = axes.headers();
    headers.extend(["method", "", "bias %", "std %", "RMSE %", "covers", "RMSE²/bound"].map(ToOwned::to_owned));
    let mut rows = table(&headers.iter().map(String::as_str).collect::<Vec<_>>(), axes.keys.len() + 2);
    let mut blind = false;
    for point in &result.points {
        // A level or a method is printed where it begins, so that the eye finds the blocks.
        let mut levels = axes.cells(point);
        let mut method = "";
        for estimator in &point.estimators {
            blind |= !estimator.common_scale_observable;
            let name = if estimator.method == method { "" } else { &estimator.method };
            method = &estimator.method;
            rows.add_row(levels.iter().cloned().chain(cells(name, estimator)));
            levels.iter_mut().for_each(String::clear);
        }
    }
    terminal.say(&rows.to_string())?;
    if blind {
        terminal.say("* cannot see the scale common to both wheels: its bias is the scale that was not measured")?;
    }
    for (number, point) in result.points.iter().enumerate() {
        let mut unusable: Vec<(&str, &str)> = Vec::new();
        for estimator in &point.estimators {
            if let Some(why) = &estimator.not_applicable
                && !unusable.iter().any(|(method, _)| *method == estimator.method)
            {
                unusable.push((&estimator.method, why));
            }
        }
        for (method, why) in unusable {
            terminal.say(&format!("point {}: {method} cannot be used: {why}", number + 1))?;
        }
    }
    let imprecise = result.points.iter().filter(|point| point.precise == Some(false)).count();
    if imprecise > 0 {
        terminal.say(&format!("{imprecise} points did not reach the precision within {} trials", result.trials))?;
    }
    show_drift(result, &axes, terminal)
}

/// What a method costs at a point and how well the robot drives with it: the table that tells which to use.
fn show_drift(result: &SweepResult, axes: &Axes, terminal: &Terminal) -> Result<(), Failure> {
    if result.points.iter().all(|point| point.drift.is_empty()) {
        return Ok(());
    }
    terminal.say("drift on the validation path with each method's calibration, per cent of the distance")?;
    let mut headers = axes.headers();
    headers.extend(["method", "runs", "minutes", "metres", "mean drift %", "RMS drift %"].map(ToOwned::to_owned));
    let mut rows = table(&headers.iter().map(String::as_str).collect::<Vec<_>>(), axes.keys.len() + 1);
    for point in &result.points {
        let mut levels = axes.cells(point);
        let best = clearly_best(point);
        for (k, drift) in point.drift.iter().enumerate() {
            let cost = point.costs.iter().find(|cost| cost.method == drift.method);
            let of_cost = |number: Option<String>| number.unwrap_or_else(|| "–".to_owned());
            let or_dash = |pair: Option<(f64, f64)>| pair.map_or_else(|| "–".to_owned(), |(v, e)| concise(v, e));
            let mark = if best == Some(k) { " <" } else { "" };
            rows.add_row(levels.iter().cloned().chain([
                format!("{}{mark}", drift.method),
                of_cost(cost.map(|cost| cost.runs.to_string())),
                of_cost(cost.map(|cost| format!("{:.1}", cost.minutes))),
                of_cost(cost.map(|cost| format!("{:.1}", cost.metres))),
                or_dash(drift.mean_percent.zip(drift.mean_percent_mcse)),
                or_dash(drift.rms_percent.zip(drift.rms_percent_mcse)),
            ]));
            levels.iter_mut().for_each(String::clear);
        }
    }
    terminal.say(&rows.to_string())?;
    terminal.say("< drifts less than any other by more than two standard errors of the difference")
}

/// The method whose RMS drift is below every other's by more than two standard errors.
fn clearly_best(point: &PointResult) -> Option<usize> {
    let rms: Vec<Option<(f64, f64)>> =
        point.drift.iter().map(|drift| drift.rms_percent.zip(drift.rms_percent_mcse)).collect();
    (0..rms.len()).find(|k| {
        let below = |other: &Option<(f64, f64)>| match (rms[*k], other) {
            (Some((value, error)), Some((other, other_error))) => value + 2.0 * error.hypot(*other_error) < *other,
            (value, None) => value.is_some(),
            (None, _) => false,
        };
        rms.len() > 1 && rms.iter().enumerate().all(|(other, drift)| other == *k || below(drift))
    })
}

fn cells(method: &str, estimator: &EstimatorResult) -> [String; 7] {
    let percent = |pair: Option<(f64, f64)>| {
        let scale = 100.0 / estimator.truth;
        pair.map_or_else(|| "–".to_owned(), |(value, error)| concise(value * scale, error * scale))
    };
    let mark = if estimator.common_scale_observable { "" } else { "*" };
    let share = |share: f64| format!("{:.1}%", 100.0 * share);
    [
        method.to_owned(),
        format!("{}{mark}", symbol(&estimator.parameter)),
        percent(estimator.bias.zip(estimator.bias_mcse)),
        percent(estimator.std()),
        percent(estimator.rmse.zip(estimator.rmse_mcse)),
        estimator.coverage.map_or_else(|| "–".to_owned(), share),
        estimator
            .cramer_rao_ratio
            .zip(estimator.cramer_rao_ratio_mcse)
            .map_or_else(|| "–".to_owned(), |(ratio, error)| concise(ratio, error)),
    ]
}

/// A parameter as the paper writes it.
pub(crate) fn symbol(parameter: &str) -> &str {
    match parameter {
        "left_m_per_tick" => "C_L",
        "right_m_per_tick" => "C_R",
        "wheel_separation_m" => "B",
        other => other,
    }
}

/// A value with its standard error in units of the last digit, `-3.1656(7)`: no digit is printed that the
/// trials do not carry.
pub(crate) fn concise(value: f64, error: f64) -> String {
    if error.is_nan() || error <= 0.0 || !error.is_finite() {
        return format!("{value:.4}");
    }
    if error >= 9.5 {
        // No digit behind the point; the error stands in full.
        return format!("{value:.0}({error:.0})");
    }
    let mut decimals = (-error.log10().floor()).clamp(0.0, MAX_DECIMALS);
    let mut digits = (error * 10_f64.powf(decimals)).round();
    if digits >= 10.0 && decimals >= 1.0 {
        (decimals, digits) = (decimals - 1.0, 1.0);
    }
    format!("{value:.0$}({digits:.0})", decimals as usize)
}

/// The axes of a design as columns: short names, with a legend.
struct Axes {
    keys: Vec<String>,
    /// The names of cases in the order in which they come, by axis.
    names: Vec<Vec<String>>,
}

impl Axes {
    fn of(result: &SweepResult) -> Self {
        let keys: Vec<String> =
            result.points.first().map_or(Vec::new(), |point| point.levels.keys().cloned().collect());
        let names_of = |key: &String| {
            let mut names: Vec<String> = Vec::new();
            for point in &result.points {
                if let Some(Level::Name(name)) = point.levels.get(key)
                    && !names.contains(name)
                {
                    names.push(name.clone());
                }
            }
            names
        };
        let names = keys.iter().map(names_of).collect();
        Self { keys, names }
    }

    fn headers(&self) -> Vec<String> {
        (1..=self.keys.len()).map(|number| format!("axis {number}")).collect()
    }

    fn legend(&self) -> Vec<String> {
        let mut lines = Vec::new();
        for (number, (key, names)) in self.keys.iter().zip(&self.names).enumerate() {
            lines.push(format!("  axis {}: {key}", number + 1));
            lines.extend(names.iter().enumerate().map(|(place, name)| format!("    {} = {name}", place + 1)));
        }
        lines
    }

    /// A point's levels; of a case its number in the legend.
    fn cells(&self, point: &PointResult) -> Vec<String> {
        let cell = |(key, names): (&String, &Vec<String>)| match point.levels.get(key) {
            Some(Level::Name(name)) => {
                names.iter().position(|known| known == name).map_or_else(String::new, |place| (place + 1).to_string())
            }
            Some(level) => level.to_string(),
            None => String::new(),
        };
        self.keys.iter().zip(&self.names).map(cell).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::concise;

    #[test]
    fn errors_stand_in_the_place_of_the_last_digit() {
        let all = [
            ((-3.165_58, 0.000_07), "-3.16558(7)"),
            ((0.008_34, 0.000_08), "0.00834(8)"),
            ((1.0, 0.096), "1.0(1)"),
            ((1.0, 0.0949), "1.00(9)"),
            ((12.3, 1.2), "12(1)"),
            ((1234.0, 99.4), "1234(99)"),
            ((0.5, 0.0), "0.5000"),
            ((5.0, 9.6), "5(10)"),
        ];
        for ((value, error), text) in all {
            assert_eq!(concise(value, error), text);
        }
    }
}
