//! Residuals against everything that was recorded: binned means with their standard errors, before and
//! after the extension.
//!
//! A residual is an innovation, along and across the robot (m) and of its heading (rad). Under a right
//! model its mean is zero whatever it is binned by. A bin's band is its mean ± 1.96 standard errors, from
//! the scatter in the bin; residuals are uncorrelated where the whiteness tests pass.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use dataset::RunInfo;
use estimation::{KinematicSample, ModelFit};
use kinematics::{Side, wrap_to_pi};
use rayon::prelude::*;
use serde::Serialize;

use crate::candidates::candidate::terms;
use crate::fits::augmented_model::AugmentedModel;
use crate::fits::statistics::p_of_chi_square;
use crate::settings::RESIDUALS;

/// Residuals against every covariate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Residuals {
    /// How many measurements of the calibrated model.
    #[serde(rename = "looks")]
    pub measurements: usize,
    /// One for each covariate that varies, in the order of the checks.
    #[serde(rename = "against")]
    pub by_covariate: Vec<ResidualsByCovariate>,
}

/// Residuals against one covariate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ResidualsByCovariate {
    /// Its name, that of the test of it.
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
    /// Its p-value when all means are zero.
    pub p_value: f64,
    /// The same about the mean of all bins: how much the residuals depend on the covariate.
    pub varies_chi_square: f64,
    /// Its p-value when all means are the same.
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

/// Where a measurement was taken, and how the robot moved before it.
struct Conditions<'r> {
    sample: &'r KinematicSample,
    t_s: f64,
    run: &'r RunInfo,
}

impl Conditions<'_> {
    fn speed_m_s(&self) -> f64 {
        self.sample.motion.distance_m / self.sample.duration_s
    }

    fn yaw_rate_rad_s(&self) -> f64 {
        self.sample.motion.turn_rad / self.sample.duration_s
    }

    /// The phase of a wheel, degrees. A wheel that turned on and on between two measurements has no one
    /// phase.
    fn phase_deg(&self, side: Side) -> Option<f64> {
        (self.sample.turned_rad[side].abs() < FRAC_PI_2).then(|| degrees(self.sample.phase_rad[side]))
    }
}

fn degrees(angle_rad: f64) -> f64 {
    wrap_to_pi(angle_rad).to_degrees()
}

/// The value of a covariate at a measurement; `None` where it has none.
type CovariateValue = dyn Fn(&Conditions<'_>) -> Option<f64> + Sync;

/// A covariate of a measurement, and how it is cut into bins.
struct Covariate {
    key: String,
    label: String,
    unit: &'static str,
    /// It is the same after a revolution.
    periodic: bool,
    /// A covariate that spans less than this is not drawn.
    min_span: f64,
    value: Box<CovariateValue>,
}

/// Key, label, unit, whether it is periodic, the least span that is drawn, and the value.
type Kinematic = (&'static str, &'static str, &'static str, bool, f64, fn(&Conditions<'_>) -> Option<f64>);

const KINEMATIC: [Kinematic; 13] = [
    ("speed", "speed", "m/s", false, 0.02, |at| Some(at.speed_m_s())),
    ("yaw_rate", "yaw rate", "rad/s", false, 0.05, |at| Some(at.yaw_rate_rad_s())),
    ("speed_times_yaw_rate", "speed × yaw rate", "m/s²", false, 0.01, |at| {
        Some(at.speed_m_s() * at.yaw_rate_rad_s())
    }),
    ("acceleration", "acceleration", "m/s²", false, 0.02, |at| {
        Some(at.sample.speed_change_m_s / at.sample.duration_s)
    }),
    ("heading_in_the_room", "heading in the room", "°", true, 10.0, |at| {
        Some(degrees(at.sample.world_from_body.theta_rad))
    }),
    ("left_wheel_phase", "phase of the left wheel", "°", true, 10.0, |at| at.phase_deg(Side::Left)),
    ("right_wheel_phase", "phase of the right wheel", "°", true, 10.0, |at| at.phase_deg(Side::Right)),
    ("time_in_run", "time in the run", "s", false, 1.0, |at| Some(at.t_s)),
    ("time_in_session", "time in the session", "s", false, 1.0, |at| Some(at.sample.session_s)),
    ("distance", "distance driven in the session", "m", false, 0.1, |at| Some(at.sample.session_m)),
    ("distance_since_reversal", "distance since reversal", "m", false, 0.01, |at| at.sample.since_reversal_m),
    ("position_x", "position in the room, x", "m", false, 0.05, |at| Some(at.sample.world_from_body.x_m)),
    ("position_y", "position in the room, y", "m", false, 0.05, |at| Some(at.sample.world_from_body.y_m)),
];

fn covariates(fit: &ModelFit<'_>) -> Vec<Covariate> {
    let kinematic = KINEMATIC.map(|(key, label, unit, periodic, min_span, value)| Covariate {
        key: key.to_owned(),
        label: label.to_owned(),
        unit,
        periodic,
        min_span,
        value: Box::new(value),
    });
    let of_runs = crate::candidates::covariates::of_runs(fit).into_iter().map(|covariate| {
        let name = covariate.name();
        Covariate {
            key: format!("covariate_{name}"),
            label: name.clone(),
            unit: "",
            periodic: false,
            min_span: 0.0,
            value: Box::new(move |at| at.run.covariates.get(&name).copied()),
        }
    });
    kinematic.into_iter().chain(of_runs).collect()
}

/// A residual with the values of the covariates.
struct Residual {
    values: Arc<Vec<Option<f64>>>,
    component: usize,
    size: f64,
    z: f64,
}

fn residuals_of(model: &AugmentedModel<'_>, covariates: &[Covariate]) -> Vec<Residual> {
    let pass = model.fit.scan_with_samples(&mut terms(&model.candidates));
    // Of several phases of thinned measurements the first is drawn; the others are of other instants.
    let (Some(innovations), Some(samples)) = (pass.innovations.first(), pass.samples.first()) else {
        return Vec::new();
    };
    let records = &model.fit.records;
    let values = |sample: &KinematicSample| {
        let run = records.segments.get(sample.segment)?.info;
        let t_s = records.measurement_s(sample.segment, sample.measurement)?;
        let at = Conditions { sample, t_s, run };
        let values: Vec<Option<f64>> = covariates.iter().map(|covariate| (covariate.value)(&at)).collect();
        Some(((sample.segment, sample.measurement), Arc::new(values)))
    };
    let values: BTreeMap<(usize, usize), Arc<Vec<Option<f64>>>> = samples.iter().filter_map(values).collect();
    innovations
        .iter()
        .filter_map(|innovation| {
            let values = Arc::clone(values.get(&(innovation.segment, innovation.measurement))?);
            let (component, z) = (innovation.component, innovation.z);
            Some(Residual { values, component, size: z * innovation.sigma, z })
        })
        .collect()
}

/// Residuals of the calibrated model and of the extended one.
pub(crate) fn residuals(base: &ModelFit<'_>, model: &AugmentedModel<'_>) -> Residuals {
    let covariates = covariates(base);
    let before = residuals_of(&AugmentedModel::base(base), &covariates);
    let after = residuals_of(model, &covariates);
    let measurements = before.iter().filter(|residual| residual.component == 0).count();
    let by_covariate = covariates.par_iter().enumerate().filter_map(|(number, covariate)| {
        let components: Vec<Component> = ["along", "across", "heading"]
            .iter()
            .enumerate()
            .filter_map(|(component, name)| {
                let own = |all: &[Residual]| -> Vec<(f64, f64, f64)> {
                    let own = all.iter().filter(|residual| residual.component == component);
                    own.filter_map(|residual| Some((residual.values[number]?, residual.size, residual.z))).collect()
                };
                let (mut before, mut after) = (own(&before), own(&after));
                let edges = edges(&mut before, covariate.periodic, covariate.min_span)?;
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
        let (label, unit) = (covariate.label.clone(), covariate.unit.to_owned());
        let covariate = covariate.key.clone();
        let drawn = |component: &Component| !component.before.bins.is_empty() && !component.after.bins.is_empty();
        (!components.is_empty() && components.iter().all(drawn)).then_some(ResidualsByCovariate {
            covariate,
            label,
            unit,
            components,
        })
    });
    Residuals { measurements, by_covariate: by_covariate.collect() }
}

/// Sorts values and cuts them into bins: a revolution into equal parts, few levels one each, others into
/// equal counts, or equal widths where those are too narrow. `None` when they span less than `min_span`.
fn edges(values: &mut [(f64, f64, f64)], periodic: bool, min_span: f64) -> Option<Vec<f64>> {
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (first, last) = (values.first()?.0, values.last()?.0);
    let span = last - first;
    if span <= min_span.max(RESIDUALS.covariate_tolerance * first.abs().max(last.abs())) {
        return None;
    }
    let share = |k: usize| k as f64 / RESIDUALS.bins as f64;
    if periodic {
        // About the middle of a bin, not its edge: robots like to start at 0.
        return Some((0..RESIDUALS.bins).map(|k| 360.0 * (share(k) + 0.5 * share(1)) - 180.0).collect());
    }
    let mut levels: Vec<f64> = Vec::new();
    for (value, ..) in values.iter() {
        if levels.last().is_none_or(|level| value - level > RESIDUALS.covariate_tolerance * span) {
            levels.push(*value);
        }
        if levels.len() > RESIDUALS.bins {
            break;
        }
    }
    if levels.len() <= RESIDUALS.bins {
        return Some(levels.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect());
    }
    let mut edges: Vec<f64> = Vec::new();
    for k in 1..RESIDUALS.bins {
        let edge = values[k * values.len() / RESIDUALS.bins].0;
        if edge - edges.last().copied().unwrap_or(first) > RESIDUALS.min_bin_width * span
            && last - edge > RESIDUALS.min_bin_width * span
        {
            edges.push(edge);
        }
    }
    if 2 * edges.len() < RESIDUALS.bins {
        // Most values are at a few levels, such as commanded speeds: equal widths keep levels whole and
        // separate.
        edges = (1..RESIDUALS.bins).map(|k| first + span * share(k)).collect();
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
        if own.len() < RESIDUALS.min_residuals_per_bin {
            continue;
        }
        let n = own.len() as f64;
        let (at, mean, mean_z) =
            own.iter().fold((0.0, 0.0, 0.0), |sum, (x, size, z)| (sum.0 + x / n, sum.1 + size / n, sum.2 + z / n));
        let variance = own.iter().map(|(_, size, _)| (size - mean).powi(2)).sum::<f64>() / (n - 1.0);
        bins.push(Bin { at, mean, sigma: (variance / n).sqrt(), mean_z, count: own.len() });
    }
    let precision = |bin: &Bin| if bin.sigma > 0.0 { bin.sigma.powi(-2) } else { 0.0 };
    let (sum, precisions) =
        bins.iter().fold((0.0, 0.0), |sum, bin| (sum.0 + precision(bin) * bin.mean, sum.1 + precision(bin)));
    let about = |centre: f64| bins.iter().map(|bin| precision(bin) * (bin.mean - centre).powi(2)).sum::<f64>();
    let (chi_square, varies_chi_square) = (about(0.0), if precisions > 0.0 { about(sum / precisions) } else { 0.0 });
    let freedom = bins.len() as f64;
    let varies_p_value = if freedom > 1.0 { p_of_chi_square(varies_chi_square, freedom - 1.0) } else { 1.0 };
    Profile { p_value: p_of_chi_square(chi_square, freedom), bins, chi_square, varies_chi_square, varies_p_value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_level_is_a_bin_and_a_continuum_is_cut_into_equal_counts() {
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

    #[test]
    fn edges_cut_where_values_are_apart_and_a_revolution_evenly() {
        let of = |values: &[f64], periodic, min_span| {
            let mut values: Vec<_> = values.iter().map(|value| (*value, 0.0, 0.0)).collect();
            edges(&mut values, periodic, min_span)
        };
        // Spans of what is drawn and below it. Rejects the least value for the span.
        assert_eq!(of(&[3.0, 1.0], false, 1.9), Some(vec![2.0]));
        assert_eq!(
            (of(&[1.0, 3.0], false, 2.0), of(&[5.0, 5.000_001], false, 0.0), of(&[], false, 0.0)),
            (None, None, None)
        );
        // Twelve parts of 30°, the first about −180 + 15°.
        let cut = of(&[-100.0, 100.0], true, 10.0).expect("it varies");
        assert!(cut.len() == 12 && cut[0] == -165.0 && cut[11] == 165.0, "{cut:?}");
        // Twelve levels are a bin each, and thirteen a continuum; levels within a millionth are one.
        let levels = |n: u32| of(&(0..n).map(f64::from).collect::<Vec<_>>(), false, 0.0).expect("it varies");
        assert_eq!((levels(12).len(), levels(12)[10]), (11, 10.5));
        assert_eq!(of(&[0.0, 1e-7, 1.0], false, 0.0).map(|cut| cut.len()), Some(1));
        // Most values at two levels and a few all over: equal widths of 1/12.
        let mut most: Vec<f64> = [0.0, 1.0].repeat(200);
        most.extend((0..20).map(|k| f64::from(k) / 20.0));
        let cut = of(&most, false, 0.0).expect("it varies");
        assert!(
            cut.len() == 11 && (cut[0] - 1.0 / 12.0).abs() < 1e-12 && (cut[10] - 11.0 / 12.0).abs() < 1e-12,
            "{cut:?}"
        );
        assert!((scatter(&[(0.0, 3.0, 0.0), (0.0, -4.0, 0.0)]) - 12.5_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn a_profile_tests_its_means_against_nothing_and_against_each_other() {
        // Two bins of eight: means 1 and 3 with errors of ½ each, by residuals of ±√3.5 · ... about them.
        let off = (8.0_f64 * 7.0 / 8.0 / 4.0).sqrt();
        let values: Vec<(f64, f64, f64)> = (0..16)
            .map(|k| {
                let (at, mean) = if k < 8 { (0.0, 1.0) } else { (2.0, 3.0) };
                (at, mean + if k % 2 == 0 { off } else { -off }, 0.5 * at)
            })
            .collect();
        let of = profile(&values, &[1.0]);
        let [low, high] = &of.bins[..] else { panic!("two bins") };
        assert!((low.sigma - 0.5).abs() < 1e-12 && (high.mean - 3.0).abs() < 1e-12, "{of:?}");
        assert_eq!((low.count, high.at, high.mean_z), (8, 2.0, 1.0));
        // (1² + 3²)/¼ about nothing, and 2 · 1²/¼ about the mean of 2.
        assert!((of.chi_square - 40.0).abs() < 1e-9 && (of.varies_chi_square - 8.0).abs() < 1e-9, "{of:?}");
        assert!(
            (of.p_value - (-20.0_f64).exp()).abs() < 1e-12
                && (of.varies_p_value - p_of_chi_square(8.0, 1.0)).abs() < 1e-12
        );
        // Seven are too few; one bin does not vary.
        let one = profile(&values[1..], &[1.0]);
        assert_eq!((one.bins.len(), one.varies_p_value), (1, 1.0));
        // Bins without scatter have no weight.
        let still = profile(&[(0.0, 1.0, 0.0); 8], &[]);
        assert_eq!((still.chi_square, still.varies_chi_square), (0.0, 0.0));
    }
}
