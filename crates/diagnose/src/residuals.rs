//! What a model leaves, look by look, against everything that was recorded: binned means with their errors, before and after the extension.
//!
//! A residual is an innovation: what a measurement sees beyond what counts, model and the measurements before predict, along and across the robot (m) and of its heading (rad). Of a
//! right model it has mean zero whatever it is drawn against. A bin's band is its mean ± 1.96 standard errors, from the scatter in the bin; residuals are uncorrelated
//! where the checks of whiteness pass.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;
use std::sync::{Arc, Mutex, PoisonError};

use dataset::RunInfo;
use estimation::ModelFit;
use kinematics::{Pose, Side, wrap_to_pi};
use model_term::{Interval, Measurement, ModelTerm, TermParameter};
use serde::Serialize;

use crate::augmented_model::AugmentedModel;
use crate::candidate::terms;
use crate::statistics::p_of_chi_square;

/// Bins of a covariate that varies continuously.
const BINS: usize = 12;
/// A bin with fewer residuals has no scatter to speak of.
const MIN_IN_BIN: usize = 8;
/// Way back that counts as a reversal, metres: more than the counts of a standstill.
const REVERSAL_M: f64 = 1e-3;

/// Residuals against every covariate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Residuals {
    /// How many measurements of the calibrated model.
    #[serde(rename = "looks")]
    pub measurements: usize,
    /// One for each covariate that varies, in the order of the checks.
    pub against: Vec<ResidualsByCovariate>,
}

/// Residuals against one covariate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ResidualsByCovariate {
    /// Its name, that of the check that asks for it.
    pub covariate: String,
    /// For people.
    pub label: String,
    /// Its unit; empty for a number.
    pub unit: String,
    /// Along, across, heading.
    pub components: Vec<Component>,
}

/// One component of the residuals against a covariate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Component {
    /// `along`, `across` or `heading`.
    pub component: String,
    /// `m` or `rad`.
    pub unit: String,
    /// Root mean square of single residuals under the calibrated model, m or rad.
    pub scatter: f64,
    /// Under the calibrated model.
    pub before: Profile,
    /// Under the extended model; the same where nothing was found.
    pub after: Profile,
}

/// Means over bins of a covariate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Profile {
    /// The bins in ascending order.
    pub bins: Vec<Bin>,
    /// Σ (mean/standard error)².
    pub chi_square: f64,
    /// Its chance when all means are zero.
    pub p_value: f64,
    /// The same about the mean of all bins: how much the residuals go with the covariate, whatever they are on the whole.
    pub varies_chi_square: f64,
    /// Its chance when all means are the same.
    pub varies_p_value: f64,
}

/// A bin of a covariate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bin {
    /// Mean of the covariate.
    pub at: f64,
    /// Mean residual, m or rad.
    pub mean: f64,
    /// One standard error.
    pub sigma: f64,
    /// Mean of the residuals over the standard deviations that the model gives them.
    pub mean_z: f64,
    /// How many.
    pub count: usize,
}

/// What was recorded between two measurements.
#[derive(Debug, Clone, Default)]
struct Recorded {
    values: Vec<Option<f64>>,
}

/// A covariate of a measurement: name, words, unit, and how it is cut into bins.
struct Covariate {
    key: String,
    label: &'static str,
    unit: &'static str,
    /// It comes back after a turn.
    periodic: bool,
    /// Varying less, it says nothing.
    least: f64,
}

/// Name, words, unit, whether it comes back after a turn, and how much it must vary to say anything.
const PLAIN: [(&str, &str, &str, bool, f64); 13] = [
    ("speed", "speed", "m/s", false, 0.02),
    ("yaw_rate", "yaw rate", "rad/s", false, 0.05),
    ("speed_times_yaw_rate", "speed × yaw rate", "m/s²", false, 0.01),
    ("acceleration", "acceleration", "m/s²", false, 0.02),
    ("heading_in_the_room", "heading in the room", "°", true, 10.0),
    ("left_wheel_phase", "phase of the left wheel", "°", true, 10.0),
    ("right_wheel_phase", "phase of the right wheel", "°", true, 10.0),
    ("time_in_run", "time in the run", "s", false, 1.0),
    ("time_in_session", "time in the session", "s", false, 1.0),
    ("distance", "distance driven in the session", "m", false, 0.1),
    ("distance_since_reversal", "distance since reversal", "m", false, 0.01),
    ("position_x", "position in the room, x", "m", false, 0.05),
    ("position_y", "position in the room, y", "m", false, 0.05),
];

fn covariates(fit: &ModelFit<'_>) -> Vec<Covariate> {
    let plain = PLAIN.map(|(key, label, unit, periodic, least)| Covariate {
        key: key.to_owned(),
        label,
        unit,
        periodic,
        least,
    });
    let of_runs = crate::covariates::of_runs(fit).into_iter().map(|covariate| Covariate {
        key: format!("covariate_{}", covariate.name()),
        label: "",
        unit: "",
        periodic: false,
        least: 0.0,
    });
    plain.into_iter().chain(of_runs).collect()
}

/// Measurements by their run and instant.
type Records = Arc<Mutex<BTreeMap<(usize, u64), Recorded>>>;

fn key(run: &RunInfo, t_s: f64) -> (usize, u64) {
    (std::ptr::from_ref(run) as usize, t_s.to_bits())
}

/// A term without effect that writes down what it is shown: the likelihood hands every interval and every measurement to its terms.
#[derive(Clone)]
struct Recorder {
    keys: Vec<String>,
    records: Records,
    distance_m: f64,
    turn_rad: f64,
    time_s: f64,
    gained_m_s: f64,
    phase_rad: [f64; 2],
    /// How far each wheel turned since the last measurement, radians.
    turned_rad: [f64; 2],
    session_s: f64,
    session_m: f64,
    swung_m: f64,
    ahead: Option<bool>,
    since_m: Option<f64>,
}

impl Recorder {
    fn new(keys: Vec<String>, records: Records) -> Self {
        Self {
            keys,
            records,
            distance_m: 0.0,
            turn_rad: 0.0,
            time_s: 0.0,
            gained_m_s: 0.0,
            phase_rad: [0.0; 2],
            turned_rad: [0.0; 2],
            session_s: 0.0,
            session_m: 0.0,
            swung_m: 0.0,
            ahead: None,
            since_m: None,
        }
    }
}

const NOTHING: [TermParameter; 1] = [TermParameter { name: "nothing", unit: "1", prior_sigma: 1.0 }];

impl ModelTerm for Recorder {
    fn parameters(&self) -> &'static [TermParameter] {
        &NOTHING
    }

    fn restart(&mut self, _run: &RunInfo) {
        *self = Self::new(std::mem::take(&mut self.keys), Arc::clone(&self.records));
    }

    fn motion(&mut self, interval: &Interval<'_>, _gradient: &mut [Pose]) {
        if interval.dt_s <= 0.0 {
            return;
        }
        let increment = interval.increment();
        let (now, before) = (interval.speed_m_s(), interval.previous_speed_m_s());
        if self.session_s > 0.0 || interval.t_s > 0.0 {
            self.gained_m_s += 0.5 * (now.left + now.right - before.left - before.right);
        }
        self.distance_m += increment.distance_m;
        self.turn_rad += increment.turn_rad;
        self.time_s += interval.dt_s;
        for (k, side) in Side::BOTH.into_iter().enumerate() {
            self.phase_rad[k] = interval.wheel_rad[side] + 0.5 * interval.turned_rad[side];
            self.turned_rad[k] += interval.turned_rad[side];
        }
        (self.session_s, self.session_m) = (interval.session_s(), interval.session_m);
        self.swung_m = (self.swung_m + increment.distance_m).clamp(-0.5 * REVERSAL_M, 0.5 * REVERSAL_M);
        if self.swung_m.abs() >= 0.5 * REVERSAL_M {
            let ahead = self.swung_m > 0.0;
            if self.ahead.is_some_and(|before| before != ahead) {
                self.since_m = Some(0.0);
            }
            self.ahead = Some(ahead);
        }
        self.since_m = self.since_m.map(|since_m| since_m + increment.distance_m.abs());
    }

    fn measurement(&mut self, measurement: &Measurement<'_>, _gradient: &mut [Pose]) {
        if self.time_s <= 0.0 {
            return;
        }
        let (v, omega) = (self.distance_m / self.time_s, self.turn_rad / self.time_s);
        let degrees = |angle_rad: f64| wrap_to_pi(angle_rad).to_degrees();
        // A wheel that turned on and on between two measurements has no one phase.
        let phase = |k: usize| (self.turned_rad[k].abs() < FRAC_PI_2).then(|| degrees(self.phase_rad[k]));
        let value = |key: &String| match &key[..] {
            "speed" => Some(v),
            "yaw_rate" => Some(omega),
            "speed_times_yaw_rate" => Some(v * omega),
            "acceleration" => Some(self.gained_m_s / self.time_s),
            "heading_in_the_room" => Some(degrees(measurement.world_from_body.theta_rad)),
            "left_wheel_phase" => phase(0),
            "right_wheel_phase" => phase(1),
            "time_in_run" => Some(measurement.t_s),
            "time_in_session" => Some(self.session_s),
            "distance" => Some(self.session_m),
            "distance_since_reversal" => self.since_m,
            "position_x" => Some(measurement.world_from_body.x_m),
            "position_y" => Some(measurement.world_from_body.y_m),
            other => other.strip_prefix("covariate_").and_then(|name| measurement.run.covariates.get(name).copied()),
        };
        let recorded = Recorded { values: self.keys.iter().map(value).collect() };
        // Of several phases of thinned looks the first is drawn, and the others look at other instants or later.
        let mut records = self.records.lock().unwrap_or_else(PoisonError::into_inner);
        records.entry(key(measurement.run, measurement.t_s)).or_insert(recorded);
        (self.distance_m, self.turn_rad, self.time_s, self.gained_m_s) = (0.0, 0.0, 0.0, 0.0);
        self.turned_rad = [0.0; 2];
    }
}

/// A residual with what was recorded.
struct Residual {
    values: Vec<Option<f64>>,
    component: usize,
    size: f64,
    z: f64,
}

fn residuals_of(model: &AugmentedModel<'_>, keys: &[String]) -> Vec<Residual> {
    let records: Records = Arc::default();
    let mut all = terms(&model.candidates);
    all.push(Box::new(Recorder::new(keys.to_vec(), Arc::clone(&records))));
    let pass = model.fit.scan(&mut all);
    let records = records.lock().unwrap_or_else(PoisonError::into_inner);
    let innovations = pass.innovations.first().map(Vec::as_slice).unwrap_or_default();
    innovations
        .iter()
        .filter_map(|innovation| {
            let run = model.fit.records.segments.get(innovation.segment)?.info;
            let t_s = model.fit.records.measurement_s(innovation.segment, innovation.measurement)?;
            let values = records.get(&key(run, t_s))?.values.clone();
            let (component, z) = (innovation.component, innovation.z);
            Some(Residual { values, component, size: z * innovation.sigma, z })
        })
        .collect()
}

/// Residuals of the calibrated model and of the extended one.
pub(crate) fn residuals(base: &ModelFit<'_>, model: &AugmentedModel<'_>) -> Residuals {
    let covariates = covariates(base);
    let keys: Vec<String> = covariates.iter().map(|covariate| covariate.key.clone()).collect();
    let alone = AugmentedModel::base(base);
    let (before, after) = (residuals_of(&alone, &keys), residuals_of(model, &keys));
    let measurements = before.iter().filter(|residual| residual.component == 0).count();
    let against = covariates.iter().enumerate().filter_map(|(number, covariate)| {
        let components: Vec<Component> = ["along", "across", "heading"]
            .iter()
            .enumerate()
            .filter_map(|(component, name)| {
                let own = |all: &[Residual]| -> Vec<(f64, f64, f64)> {
                    let own = all.iter().filter(|residual| residual.component == component);
                    own.filter_map(|residual| Some((residual.values[number]?, residual.size, residual.z))).collect()
                };
                let (mut before, mut after) = (own(&before), own(&after));
                let edges = edges(&mut before, covariate.periodic, covariate.least)?;
                after.sort_by(|a, b| a.0.total_cmp(&b.0));
                Some(Component {
                    component: (*name).to_owned(),
                    unit: if component == 2 { "rad" } else { "m" }.to_owned(),
                    scatter: scatter(&before),
                    before: profile(&before, &edges),
                    after: profile(&after, &edges),
                })
            })
            .collect();
        let label = if covariate.label.is_empty() {
            covariate.key.trim_start_matches("covariate_").to_owned()
        } else {
            covariate.label.to_owned()
        };
        let (covariate, unit) = (covariate.key.clone(), covariate.unit.to_owned());
        let drawn = |component: &Component| !component.before.bins.is_empty() && !component.after.bins.is_empty();
        (!components.is_empty() && components.iter().all(drawn)).then_some(ResidualsByCovariate {
            covariate,
            label,
            unit,
            components,
        })
    });
    Residuals { measurements, against: against.collect() }
}

/// Bins no nearer to each other than this share of what a covariate spans: nearer, a picture shows a blot.
const NEAREST: f64 = 0.025;

/// Sorts values and cuts them: a turn into equal parts, few levels each for itself, others into parts of equal counts, or of equal widths where those were too
/// narrow. `None` when they vary by less than `least`.
fn edges(values: &mut [(f64, f64, f64)], periodic: bool, least: f64) -> Option<Vec<f64>> {
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (first, last) = (values.first()?.0, values.last()?.0);
    let span = last - first;
    if span <= least.max(1e-6 * first.abs().max(last.abs())) {
        return None;
    }
    let share = |k: usize| k as f64 / BINS as f64;
    if periodic {
        // About the middle of a bin, not its edge: robots like to start at 0.
        return Some((0..BINS).map(|k| 360.0 * (share(k) + 0.5 * share(1)) - 180.0).collect());
    }
    let mut levels: Vec<f64> = Vec::new();
    for (value, ..) in values.iter() {
        if levels.last().is_none_or(|level| value - level > 1e-6 * span) {
            levels.push(*value);
        }
        if levels.len() > BINS {
            break;
        }
    }
    if levels.len() <= BINS {
        return Some(levels.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect());
    }
    let mut edges: Vec<f64> = Vec::new();
    for k in 1..BINS {
        let edge = values[k * values.len() / BINS].0;
        if edge - edges.last().copied().unwrap_or(first) > NEAREST * span && last - edge > NEAREST * span {
            edges.push(edge);
        }
    }
    if 2 * edges.len() < BINS {
        // Most values lie in a few heaps, such as the speeds that were commanded: equal widths keep heaps whole and apart.
        edges = (1..BINS).map(|k| first + span * share(k)).collect();
    }
    Some(edges)
}

/// Root mean square of the residuals.
fn scatter(values: &[(f64, f64, f64)]) -> f64 {
    let n = values.len() as f64;
    (values.iter().map(|(_, size, _)| size * size).sum::<f64>() / n).sqrt()
}

/// Means over bins of sorted values.
fn profile(values: &[(f64, f64, f64)], edges: &[f64]) -> Profile {
    let mut bins = Vec::new();
    let mut from = 0;
    for edge in edges.iter().copied().chain([f64::INFINITY]) {
        let to = from + values[from..].partition_point(|(value, ..)| *value < edge);
        let own = &values[from..to];
        from = to;
        if own.len() < MIN_IN_BIN {
            continue;
        }
        let n = own.len() as f64;
        let (at, mean, mean_z) =
            own.iter().fold((0.0, 0.0, 0.0), |sum, (x, size, z)| (sum.0 + x / n, sum.1 + size / n, sum.2 + z / n));
        let variance = own.iter().map(|(_, size, _)| (size - mean).powi(2)).sum::<f64>() / (n - 1.0);
        bins.push(Bin { at, mean, sigma: (variance / n).sqrt(), mean_z, count: own.len() });
    }
    let weight = |bin: &Bin| if bin.sigma > 0.0 { bin.sigma.powi(-2) } else { 0.0 };
    let (sum, weights) = bins.iter().fold((0.0, 0.0), |sum, bin| (sum.0 + weight(bin) * bin.mean, sum.1 + weight(bin)));
    let about = |centre: f64| bins.iter().map(|bin| weight(bin) * (bin.mean - centre).powi(2)).sum::<f64>();
    let (chi_square, varies_chi_square) = (about(0.0), if weights > 0.0 { about(sum / weights) } else { 0.0 });
    let freedom = bins.len() as f64;
    let varies_p_value = if freedom > 1.0 { p_of_chi_square(varies_chi_square, freedom - 1.0) } else { 1.0 };
    Profile { p_value: p_of_chi_square(chi_square, freedom), bins, chi_square, varies_chi_square, varies_p_value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_stay_apart_and_a_continuum_is_cut_into_equal_counts() {
        let mut three: Vec<(f64, f64, f64)> = (0..90).map(|k| (f64::from(k % 3), f64::from(k % 3), 0.0)).collect();
        let cut = edges(&mut three, false, 0.0).expect("varies");
        assert_eq!(cut, [0.5, 1.5]);
        let means: Vec<f64> = profile(&three, &cut).bins.iter().map(|bin| bin.mean).collect();
        // Sums of thirty thirtieths: a few roundings.
        assert!(means.iter().zip([0.0, 1.0, 2.0]).all(|(mean, level)| (mean - level).abs() < 1e-12), "{means:?}");
        let mut many: Vec<(f64, f64, f64)> = (0..1200).map(|k| (f64::from(k), 0.0, 0.0)).collect();
        let cut = edges(&mut many, false, 0.0).expect("varies");
        assert!(profile(&many, &cut).bins.iter().all(|bin| bin.count == 100));
        assert_eq!(edges(&mut [(2.0, 0.0, 0.0); 50], false, 0.0), None);
    }

    #[test]
    fn a_bins_error_is_that_of_its_mean() {
        // ±1 in turn: variance n/(n−1), standard error 1/√(n−1).
        let values: Vec<(f64, f64, f64)> = (0..100).map(|k| (0.0, if k % 2 == 0 { 1.0 } else { -1.0 }, 0.0)).collect();
        let bin = profile(&values, &[]).bins[0];
        assert!(bin.mean.abs() < 1e-15 && (bin.sigma - 1.0 / 99_f64.sqrt()).abs() < 1e-12, "{bin:?}");
    }
}
