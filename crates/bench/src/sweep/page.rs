//! One page a sweep: bias, spread, RMSE, efficiency and coverage of every method against each axis.
//!
//! Against an axis of a grid the other axes stand at the middle of their levels, and the caption says where;
//! of a sampled design every point is drawn.

use std::collections::{BTreeMap, BTreeSet};

use report::{Axis, Figure, Marks, Panel, Range, Scale, Series};
use scenario::Level;

use super::plan::TRACKED;
use super::result::{EstimatorResult, PointResult, SweepResult};

/// Values that differ by more than this factor share no linear axis.
const LINEAR_FACTOR: f64 = 30.0;

/// A number of a method at a point with its standard error, in the unit that is drawn. What is not of a
/// parameter ignores it.
type Number = fn(&PointResult, method: &str, parameter: &str) -> Option<(f64, f64)>;

/// What is drawn: its name, its unit, and the number.
struct Quantity {
    name: &'static str,
    unit: &'static str,
    number: Number,
    /// Where it would be without fault, and what that is called.
    ideal: Option<(f64, &'static str)>,
    /// A share, drawn from 0 to 100 %.
    share: bool,
}

const QUANTITIES: [Quantity; 5] = [
    Quantity { name: "bias", unit: "%", number: bias, ideal: Some((0.0, "no bias")), share: false },
    Quantity { name: "standard deviation", unit: "%", number: std, ideal: None, share: false },
    Quantity { name: "RMSE", unit: "%", number: rmse, ideal: None, share: false },
    Quantity { name: "RMSE² / bound", unit: "", number: ratio, ideal: Some((1.0, "bound")), share: false },
    Quantity { name: "coverage", unit: "%", number: coverage, ideal: Some((95.0, "95 %")), share: true },
];

/// What a method's calibration is worth and what it costs, where the scenario states a validation path.
const VALIDATION_QUANTITIES: [Quantity; 3] = [
    Quantity { name: "RMS drift", unit: "%", number: drift, ideal: None, share: false },
    Quantity { name: "time for calibration", unit: "min", number: minutes, ideal: None, share: false },
    Quantity { name: "distance for calibration", unit: "m", number: metres, ideal: None, share: false },
];

fn estimator<'p>(point: &'p PointResult, method: &str, parameter: &str) -> Option<&'p EstimatorResult> {
    point.estimators.iter().find(|estimator| estimator.method == method && estimator.parameter == parameter)
}

fn bias(point: &PointResult, method: &str, parameter: &str) -> Option<(f64, f64)> {
    let estimator = estimator(point, method, parameter)?;
    Some(percent(estimator.bias.zip(estimator.bias_mcse)?, estimator.truth))
}

fn std(point: &PointResult, method: &str, parameter: &str) -> Option<(f64, f64)> {
    let estimator = estimator(point, method, parameter)?;
    Some(percent(estimator.std()?, estimator.truth))
}

fn rmse(point: &PointResult, method: &str, parameter: &str) -> Option<(f64, f64)> {
    let estimator = estimator(point, method, parameter)?;
    Some(percent(estimator.rmse.zip(estimator.rmse_mcse)?, estimator.truth))
}

fn ratio(point: &PointResult, method: &str, parameter: &str) -> Option<(f64, f64)> {
    let estimator = estimator(point, method, parameter)?;
    estimator.cramer_rao_ratio.zip(estimator.cramer_rao_ratio_mcse)
}

fn coverage(point: &PointResult, method: &str, parameter: &str) -> Option<(f64, f64)> {
    estimator(point, method, parameter)?.coverage_95.map(|of| (100.0 * of.share, 100.0 * of.mcse))
}

fn drift(point: &PointResult, method: &str, _: &str) -> Option<(f64, f64)> {
    let drift = point.drift.iter().find(|drift| drift.method == method)?;
    drift.rms_percent.zip(drift.rms_percent_mcse)
}

fn minutes(point: &PointResult, method: &str, _: &str) -> Option<(f64, f64)> {
    Some((point.costs.iter().find(|cost| cost.method == method)?.minutes, 0.0))
}

fn metres(point: &PointResult, method: &str, _: &str) -> Option<(f64, f64)> {
    Some((point.costs.iter().find(|cost| cost.method == method)?.metres, 0.0))
}

fn percent(with_error: (f64, f64), truth: f64) -> (f64, f64) {
    (100.0 * with_error.0 / truth, 100.0 * with_error.1 / truth)
}

/// The picture of a sweep; `None` when there is no axis with two levels.
pub fn figure(result: &SweepResult) -> Option<Figure> {
    let mut caption = format!("Scenario {}, seed {}", result.scenario, result.seed);
    match result.precision {
        Some(precision) => caption.push_str(&format!(", Monte-Carlo errors of at most {} %.", 100.0 * precision)),
        None => caption.push_str(&format!(", {} trials a point.", result.trials)),
    }
    caption.push_str(" Errors in per cent of the true value, with their Monte-Carlo standard errors.");
    let mut panels = Vec::new();
    for axis in axes(result) {
        if axis.levels.len() < 2 {
            continue;
        }
        caption.push_str(&axis.caption(result));
        if result.points.iter().any(|point| !point.drift.is_empty()) {
            panels.extend(
                VALIDATION_QUANTITIES
                    .iter()
                    .map(|quantity| axis.panel(result, quantity, "", quantity.name == VALIDATION_QUANTITIES[0].name)),
            );
        }
        for quantity in &QUANTITIES {
            for (column, parameter) in TRACKED.into_iter().enumerate() {
                let named = column == 0 && quantity.name == QUANTITIES[0].name;
                panels.push(axis.panel(result, quantity, parameter.key(), named));
            }
        }
    }
    if panels.is_empty() {
        return None;
    }
    let figure =
        Figure::new(&format!("{}: {}", result.scenario, finding(result))).caption(&caption).columns(TRACKED.len());
    Some(panels.into_iter().fold(figure, Figure::panel))
}

/// A point to draw: level, value, standard error.
type Drawn = (f64, f64, f64);

/// One axis of the design.
struct DesignAxis {
    key: String,
    /// Its levels in ascending order, cases in the order of the design.
    levels: Vec<Level>,
    /// The points drawn against it, by number, in the order of the levels.
    points: Vec<usize>,
    /// Where the other axes stand; empty when all points are drawn.
    others: Vec<(String, Level)>,
}

/// The axes of a design, each with the points to be drawn against it.
fn axes(result: &SweepResult) -> Vec<DesignAxis> {
    let Some(first) = result.points.first() else { return Vec::new() };
    let levels: Vec<(String, Vec<Level>)> =
        first.levels.keys().map(|key| (key.clone(), levels_of(key, &result.points))).collect();
    // A sampled design has as many levels on each axis as points.
    let sampled = levels.iter().all(|(_, levels)| levels.len() == result.points.len()) && levels.len() > 1;
    levels
        .iter()
        .map(|(key, own)| {
            let middle = |levels: &[Level]| levels.get(levels.len() / 2).cloned();
            let others: Vec<(String, Level)> = levels
                .iter()
                .filter(|(other, _)| other != key && !sampled)
                .filter_map(|(other, levels)| Some((other.clone(), middle(levels)?)))
                .collect();
            let shown =
                |point: &PointResult| others.iter().all(|(other, level)| point.levels.get(other) == Some(level));
            let mut points: Vec<usize> = (0..result.points.len()).filter(|k| shown(&result.points[*k])).collect();
            points.sort_by_key(|k| own.iter().position(|level| result.points[*k].levels.get(key) == Some(level)));
            DesignAxis { key: key.clone(), levels: own.clone(), points, others }
        })
        .collect()
}

/// The distinct levels on an axis: numbers ascending, names as they come.
fn levels_of(key: &str, points: &[PointResult]) -> Vec<Level> {
    let mut levels: Vec<Level> = Vec::new();
    for level in points.iter().filter_map(|point| point.levels.get(key)) {
        if !levels.contains(level) {
            levels.push(level.clone());
        }
    }
    let number = |level: &Level| if let Level::Number(number) = level { *number } else { 0.0 };
    levels.sort_by(|a, b| number(a).total_cmp(&number(b)));
    levels
}

impl DesignAxis {
    /// Where a point is drawn: at its number, or at the place of its case.
    fn x(&self, point: &PointResult) -> Option<f64> {
        match point.levels.get(&self.key)? {
            Level::Number(number) => Some(*number),
            name => self.levels.iter().position(|level| level == name).map(|place| place as f64 + 1.0),
        }
    }

    fn caption(&self, result: &SweepResult) -> String {
        let mut text = String::new();
        let rest: Vec<String> = self.others.iter().map(|(key, level)| format!("{key} = {level}")).collect();
        if !rest.is_empty() && self.points.len() < result.points.len() {
            text.push_str(&format!(" Against {}: {}.", self.key, rest.join(", ")));
        }
        text
    }

    fn panel(&self, result: &SweepResult, quantity: &Quantity, parameter: &str, named: bool) -> Panel {
        let methods: BTreeSet<&str> =
            result.points.iter().flat_map(|point| &point.estimators).map(|estimator| &estimator.method[..]).collect();
        let of_method = |method: &str| -> Vec<Drawn> {
            let found = self.points.iter().filter_map(|k| {
                let point = &result.points[*k];
                let (value, error) = (quantity.number)(point, method, parameter)?;
                Some((self.x(point)?, value, error))
            });
            found.collect()
        };
        let all: Vec<(&str, Vec<Drawn>)> = methods.iter().map(|method| (*method, of_method(method))).collect();
        let sizes: Vec<f64> = all.iter().flat_map(|(_, points)| points).map(|(_, value, _)| value.abs()).collect();
        let largest = sizes.iter().copied().fold(0.0, f64::max);
        let smallest = sizes.iter().copied().filter(|size| *size > 0.0).fold(f64::INFINITY, f64::min);
        let log = !quantity.share && largest > LINEAR_FACTOR * smallest;
        let signed =
            sizes.iter().zip(all.iter().flat_map(|(_, points)| points)).any(|(size, (_, value, _))| size != value);
        let name = if log && signed { format!("|{}|", quantity.name) } else { quantity.name.to_owned() };
        let mut y = if quantity.unit.is_empty() { Axis::dimensionless(&name) } else { Axis::new(&name, quantity.unit) };
        if quantity.share {
            y = y.range(Range::Fixed { low: 0.0, high: 105.0 });
        } else if log {
            y = y.scale(Scale::Log);
        } else {
            y = y.include(0.0);
        }
        let short = self.key.rsplit('.').next().unwrap_or(&self.key);
        let mut panel = Panel::new(symbol(parameter), self.horizontal(short), y);
        for (method, points) in &all {
            let kept = points.iter().filter(|(_, value, _)| !log || *value != 0.0);
            let drawn: Vec<(f64, f64)> =
                kept.clone().map(|(x, value, _)| (*x, if log { value.abs() } else { *value })).collect();
            if drawn.is_empty() {
                continue;
            }
            let ascending = drawn.len() > 1 && drawn.windows(2).all(|pair| pair[0].0 < pair[1].0);
            let connected = ascending && !self.is_of_cases() && !self.others_vary(result);
            if connected {
                panel = panel.series(Series::line(method, drawn.clone()));
            }
            let y_error = Some(kept.map(|(_, _, error)| *error).collect());
            panel = panel.series(Series::new(method, Marks::Points { points: drawn, y_error }));
        }
        if let Some((ideal, text)) = quantity.ideal.filter(|(ideal, _)| !log || *ideal > 0.0) {
            panel = panel.series(Series::new(text, Marks::HorizontalLine { y: ideal }));
        }
        if named { panel } else { panel.without_legend() }
    }

    /// Logarithmic where the levels were chosen so.
    fn horizontal(&self, name: &str) -> Axis {
        let numbers = self.levels.iter().filter_map(|level| if let Level::Number(x) = level { Some(*x) } else { None });
        let (low, high) = numbers.fold((f64::INFINITY, 0.0_f64), |(low, high), x| (low.min(x), high.max(x)));
        let (name, unit) = with_unit(name);
        if self.is_of_cases() {
            return Axis::named(&name, self.levels.iter().map(ToString::to_string));
        }
        let axis = if unit.is_empty() { Axis::dimensionless(&name) } else { Axis::new(&name, unit) };
        if low > 0.0 && high > LINEAR_FACTOR * low { axis.scale(Scale::Log) } else { axis }
    }

    /// Are the levels names, between which there is nothing?
    fn is_of_cases(&self) -> bool {
        self.levels.iter().any(|level| matches!(level, Level::Name(_)))
    }

    /// Do the points drawn differ in other axes too?
    fn others_vary(&self, result: &SweepResult) -> bool {
        self.others.is_empty() && result.points.first().is_some_and(|point| point.levels.len() > 1)
    }
}

/// A parameter as the paper writes it, and what it is.
fn symbol(parameter: &str) -> &str {
    match parameter {
        "left_m_per_tick" => "C_L, the left wheel",
        "right_m_per_tick" => "C_R, the right wheel",
        "wheel_separation_m" => "B, the wheel separation",
        other => other,
    }
}

/// Ends of keys and the units that they say, longer ones first.
const UNITS: [(&str, &str); 13] = [
    ("_m_per_sqrt_m", "m/√m"),
    ("_rad_per_sqrt_rad", "rad/√rad"),
    ("_rad_per_sqrt_m", "rad/√m"),
    ("_m_per_tick", "m/tick"),
    ("_rad_s2", "rad/s²"),
    ("_m_s2", "m/s²"),
    ("_rad_s", "rad/s"),
    ("_m_s", "m/s"),
    ("_rad", "rad"),
    ("_kg", "kg"),
    ("_hz", "Hz"),
    ("_m", "m"),
    ("_s", "s"),
];

/// The name in a key without its unit, and the unit.
fn with_unit(key: &str) -> (String, &'static str) {
    let of = UNITS.iter().find_map(|(end, unit)| Some((key.strip_suffix(end)?, *unit)));
    let (name, unit) = of.filter(|(name, _)| !name.is_empty()).unwrap_or((key, ""));
    (name.replace('_', " "), unit)
}

/// What the sweep shows in a sentence: which method is nearest to the truth, and how often.
fn finding(result: &SweepResult) -> String {
    let mut wins: BTreeMap<&str, usize> = BTreeMap::new();
    let mut all = 0;
    for point in &result.points {
        for parameter in TRACKED {
            let of = point.estimators.iter().filter(|of| of.parameter == parameter.key());
            let known = of.filter_map(|of| Some((of.rmse?, &of.method[..])));
            if let Some((_, method)) = known.min_by(|a, b| a.0.total_cmp(&b.0)) {
                *wins.entry(method).or_default() += 1;
                all += 1;
            }
        }
    }
    let methods: BTreeSet<&str> =
        result.points.iter().flat_map(|point| &point.estimators).map(|of| &of.method[..]).collect();
    match wins.into_iter().max_by_key(|(_, count)| *count) {
        Some((best, count)) if methods.len() > 1 => {
            format!("{best} has the smallest RMSE in {count} of {all} cases (points × parameters)")
        }
        _ => "accuracy of the calibration".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_say_their_units() {
        let text_of = |key| {
            let (name, unit) = with_unit(key);
            format!("{name} [{unit}]")
        };
        let keys =
            ["reading_sigma_m", "wheel_sigma_m_per_sqrt_m", "speed_m_s", "yaw_rate_rad_s", "right_over_left", "m"];
        let expected = [
            "reading sigma [m]",
            "wheel sigma [m/√m]",
            "speed [m/s]",
            "yaw rate [rad/s]",
            "right over left []",
            "m []",
        ];
        assert_eq!(keys.map(text_of), expected);
    }
}
