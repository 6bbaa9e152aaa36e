//! Tests of the residuals: size, whiteness, tails, run against run, and dependence on what was recorded.
//!
//! Innovations of a right model are white, normal and of the predicted variance (Kailath 1968). Dependence
//! on covariates is tested by score tests (`covariate_tests.rs`): the filter would blur a regression of
//! innovations.
//! Reference: Ljung & Box 1978; Bar-Shalom, Li & Kirubarajan 2001 (NIS).

use estimation::{InnovationComponent, ModelFit, Segment, WHITENESS_Z};

use crate::candidates::candidate::terms;
use crate::checks::check::{Check, Component, Correlation, ResidualPersistence, TestResult};
use crate::checks::covariate_tests::covariates;
use crate::fits::augmented_model::AugmentedModel;
use crate::fits::null_distribution::{NullDistribution, among_simulated, beyond_simulated};
use crate::fits::statistics::{holm, p_of_chi_square, p_of_z};
use crate::settings::levels::CHECKS_LEVEL;
use crate::settings::{RESIDUALS, SEARCH};

/// What the checks of a model say.
pub(crate) struct Checked {
    /// Displacements are autocorrelated, if less plainly than poses would be after a filter.
    pub(crate) autocorrelated: bool,
    pub(crate) checks: Vec<TestResult>,
    pub(crate) correlation: Correlation,
    pub(crate) outliers: Outliers,
}

/// Measurements that do not fit.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Outliers {
    /// Isolated ones: the next measurement is right. Of displacements, pairs that cancel.
    pub(crate) isolated: usize,
    /// Persistent ones: the next measurement errs as well. Of displacements, those that no neighbour
    /// cancels.
    pub(crate) persistent: usize,
    pub(crate) measurements: usize,
    pub(crate) p_value: f64,
}

/// Asks the residuals of a model.
pub(crate) fn check(model: &AugmentedModel<'_>) -> Checked {
    let fit = &*model.fit.with_innovations(&mut terms(&model.candidates));
    let null = NullDistribution::of(model);
    let NoiseTests { mut checks, mut correlation, mut outliers } = noise_tests(fit);
    // What simulated runs say makes no test stricter: where none could fail, they are not asked.
    let matters = checks.iter().any(|test| test.p_value < RESIDUALS.resimulated_level)
        || correlation.sigmas.abs() >= SEARCH.autocorrelation_sigmas;
    if let Some(null) = null.as_ref().filter(|_| matters) {
        let simulated = null.resimulated(|fit| {
            let tests = noise_tests(fit);
            (tests.checks.iter().map(|test| test.p_value).collect::<Vec<f64>>(), tests.correlation)
        });
        let (p_values, correlations): (Vec<_>, Vec<_>) = simulated.into_iter().unzip();
        for (number, test) in checks.iter_mut().enumerate() {
            test.p_value = among_simulated(test.p_value, p_values.iter().filter_map(|of| of.get(number)));
        }
        correlation = beyond_simulated(correlation, &correlations);
        outliers.p_value = checks.last().map_or(1.0, |test| test.p_value);
    }
    covariates(model, null.as_ref(), &mut |check, statistic, p_value| {
        checks.push(TestResult { check, statistic, p_value, passes: true });
    });
    // Innovations that are all 0, or beyond all bounds, have no correlation and no mean square to test.
    checks.retain(|check| check.statistic.is_finite() && check.p_value.is_finite());
    judge(&mut checks);
    let is_displaced = fit.records.segments.iter().all(Segment::is_displacement);
    let fails_to_be_white = checks.iter().any(|test| test.check.is_of_whiteness() && !test.passes);
    let autocorrelated = is_displaced && fails_to_be_white && correlation.sigmas.abs() > WHITENESS_Z;
    Checked { autocorrelated, checks, correlation, outliers }
}

/// Which checks pass, all of them together at one level.
fn judge(checks: &mut [TestResult]) {
    let fails = holm(&checks.iter().map(|check| check.p_value).collect::<Vec<_>>(), CHECKS_LEVEL);
    checks.iter_mut().zip(fails).for_each(|(check, fails)| check.passes = !fails);
}

/// The tests of the innovations alone, by formula.
struct NoiseTests {
    checks: Vec<TestResult>,
    correlation: Correlation,
    outliers: Outliers,
}

fn noise_tests(fit: &ModelFit<'_>) -> NoiseTests {
    let mut checks = Vec::new();
    let mut add = |check: Check, statistic: f64, p_value: f64| {
        checks.push(TestResult { check, statistic, p_value, passes: true });
    };
    size(fit, &mut add);
    let correlation = whiteness(fit, &mut add);
    tails(fit, &mut add);
    let outliers = outliers(fit);
    add(Check::Outliers, (outliers.isolated + outliers.persistent) as f64, outliers.p_value);
    NoiseTests { checks, correlation, outliers }
}

/// The innovations of the first phase: phases share their measurements' errors.
fn innovations<'f>(fit: &'f ModelFit<'_>, component: usize) -> Vec<&'f InnovationComponent> {
    let first = fit.solution.pass.innovations.first();
    first.map(|phase| phase.iter().filter(|innovation| innovation.component == component).collect()).unwrap_or_default()
}

/// Whether a measurement's error is of the fitted noise: what nobody recorded of the motion within rows has a
/// size that is known roughly, and tails of its own.
fn is_tested_by_size(fit: &ModelFit<'_>, segment: usize, measurement: usize) -> bool {
    fit.within_row_share(segment, measurement) <= RESIDUALS.max_within_row_share
}

/// The innovations whose size and tails are tested.
fn tested<'f>(fit: &'f ModelFit<'_>, component: usize) -> Vec<&'f InnovationComponent> {
    let mut tested = innovations(fit, component);
    tested.retain(|innovation| is_tested_by_size(fit, innovation.segment, innovation.measurement));
    tested
}

/// Σz² over the measurements, and how it differs between runs: the noise is one for all.
fn size(fit: &ModelFit<'_>, add: &mut impl FnMut(Check, f64, f64)) {
    for (component, name) in Component::ALL.into_iter().enumerate() {
        let squares: Vec<f64> = tested(fit, component).iter().map(|innovation| innovation.z.powi(2)).collect();
        let n = squares.len() as f64;
        if n < 2.0 {
            continue;
        }
        let mean = squares.iter().sum::<f64>() / n;
        // The noise is fitted to all three together: one of them can still be off. Its own tails say how
        // well a mean square is known.
        let variance = squares.iter().map(|square| (square - mean).powi(2)).sum::<f64>() / (n - 1.0);
        let z = (mean - 1.0) / (variance.max(2.0) / n).sqrt();
        add(Check::InnovationSize(name), mean, p_of_z(z));
    }
    let runs: Vec<_> = fit.solution.pass.runs.iter().filter(|run| run.count > 0.0).collect();
    let (sum, count) = runs.iter().fold((0.0, 0.0), |(sum, count), run| (sum + run.chi_square, count + run.count));
    if runs.len() > 2 && count > 0.0 {
        let mean = sum / count;
        // Wilson & Hilferty 1931: the cube root of χ²/ν is normal about 1 − 2/(9ν) with variance 2/(9ν).
        let squares: f64 = runs
            .iter()
            .map(|run| {
                let part = 2.0 / (9.0 * run.count);
                (((run.chi_square / run.count / mean).cbrt() - (1.0 - part)) / part.sqrt()).powi(2)
            })
            .sum();
        add(Check::RunToRun, squares, p_of_chi_square(squares, runs.len() as f64 - 1.0));
    }
}

/// Ljung–Box test over the measurements of each segment and the displacements of each run. Returns the most
/// significant correlation.
fn whiteness(fit: &ModelFit<'_>, add: &mut impl FnMut(Check, f64, f64)) -> Correlation {
    let mut strongest = Correlation::default();
    for (component, name) in Component::ALL.into_iter().enumerate() {
        let series = innovations(fit, component);
        let n = series.len() as f64;
        if n < RESIDUALS.min_whiteness_innovations {
            continue;
        }
        let variance = series.iter().map(|innovation| innovation.z.powi(2)).sum::<f64>() / n;
        let (mut statistic, mut lags, mut coefficient) = (0.0, 0.0, 0.0);
        let (mut weighted_products, mut squared_weights) = (0.0, 0.0_f64);
        for lag in 1..=RESIDUALS.whiteness_lags {
            let (mut products, mut pairs) = (0.0, 0.0_f64);
            let follows =
                |pair: &&[&InnovationComponent]| fit.records.are_in_series(pair[0].segment, pair[lag].segment);
            for pair in series.windows(lag + 1).filter(follows) {
                products += pair[0].z * pair[lag].z;
                pairs += 1.0;
                let weight = fit.records.weight_of_pair(pair[0].segment, pair[lag].segment, lag as i32);
                weighted_products += weight * pair[0].z * pair[lag].z;
                squared_weights += weight * weight;
            }
            if pairs < RESIDUALS.min_whiteness_pairs {
                break;
            }
            let z = products / variance / pairs.sqrt();
            if lag == 1 {
                coefficient = products / variance / pairs;
            }
            statistic += z * z;
            lags += 1.0;
        }
        if lags > 0.0 {
            let sigmas = weighted_products / variance / squared_weights.sqrt();
            if sigmas.abs() > strongest.sigmas.abs() {
                strongest = Correlation { coefficient, sigmas };
            }
            add(Check::Whiteness(name), statistic, p_of_chi_square(statistic, lags));
        }
    }
    strongest
}

fn tails(fit: &ModelFit<'_>, add: &mut impl FnMut(Check, f64, f64)) {
    for (component, name) in Component::ALL.into_iter().enumerate() {
        let series = tested(fit, component);
        let n = series.len() as f64;
        if n < RESIDUALS.min_kurtosis_innovations {
            continue;
        }
        let moment = |power: i32| series.iter().map(|innovation| innovation.z.powi(power)).sum::<f64>() / n;
        let kurtosis = moment(4) / moment(2).powi(2);
        // Anscombe & Glynn 1983: kurtosis is skewed until n is in the thousands.
        add(Check::Tails(name), kurtosis, p_of_z(anscombe_glynn(kurtosis, n)));
    }
}

/// The kurtosis of n normal values as a normal variable.
fn anscombe_glynn(kurtosis: f64, n: f64) -> f64 {
    let mean = 3.0 * (n - 1.0) / (n + 1.0);
    let variance = 24.0 * n * (n - 2.0) * (n - 3.0) / ((n + 1.0).powi(2) * (n + 3.0) * (n + 5.0));
    let x = (kurtosis - mean) / variance.sqrt();
    let skew = 6.0 * (n * n - 5.0 * n + 2.0) / ((n + 7.0) * (n + 9.0))
        * (6.0 * (n + 3.0) * (n + 5.0) / (n * (n - 2.0) * (n - 3.0))).sqrt();
    let a = 6.0 + 8.0 / skew * (2.0 / skew + (1.0 + 4.0 / (skew * skew)).sqrt());
    let low = 1.0 + x * (2.0 / (a - 4.0)).sqrt();
    ((1.0 - 2.0 / (9.0 * a)) - ((1.0 - 2.0 / a) / low.abs()).cbrt() * low.signum()) / (2.0 / (9.0 * a)).sqrt()
}

/// Outliers, isolated or persistent. After a jump of the robot the next measurements err the same way, as
/// the filter has followed only in part. After an error of one measurement they err the other way, or not
/// at all where the measurement was rejected.
///
/// A displacement starts anew where the instrument stood: the next one is right after a jump as after an
/// error. But where displacements are differences of measurements, one error spoils two of them, and both
/// together are right.
fn outliers(fit: &ModelFit<'_>) -> Outliers {
    let mut found = Outliers { measurements: tested(fit, 0).len(), ..Outliers::default() };
    let rejected = fit.solution.pass.outliers.iter().copied();
    let rejected: Vec<_> =
        rejected.filter(|(segment, measurement)| is_tested_by_size(fit, *segment, *measurement)).collect();
    let phase = fit.solution.pass.innovations.first().map_or(&[][..], Vec::as_slice);
    let mut cancelled_by = None;
    for (position, &(segment, measurement)) in rejected.iter().enumerate() {
        if fit.records.segments[segment].is_displacement() {
            if cancelled_by == Some(segment) {
                cancelled_by = None;
            } else if cancel(fit, segment, segment + 1, segment) {
                cancelled_by = Some(segment + 1);
                found.isolated += 1;
            } else if segment > 0 && cancel(fit, segment - 1, segment, segment) {
                found.isolated += 1;
            } else {
                found.persistent += 1;
            }
            continue;
        }
        // Thinned measurements have gaps between them: the next that was taken is the neighbour.
        let next =
            phase.partition_point(|innovation| (innovation.segment, innovation.measurement) <= (segment, measurement));
        let after = phase[next..].iter().take(3).filter(|innovation| innovation.segment == segment);
        let (square, values) = after.fold((0.0, 0.0), |(sum, n), innovation| (sum + innovation.z.powi(2), n + 1.0));
        let followed = rejected.get(position + 1).is_some_and(|&(c, l)| c == segment && l == measurement + 1);
        let follows = position
            .checked_sub(1)
            .is_some_and(|before| rejected[before].0 == segment && rejected[before].1 + 1 == measurement);
        if followed || follows || (values > 0.0 && p_of_chi_square(square, values) < RESIDUALS.after_outlier_level) {
            found.persistent += 1;
        } else {
            found.isolated += 1;
        }
    }
    let (count, expected) =
        (rejected.len() as f64, (found.measurements + rejected.len()) as f64 * RESIDUALS.outlier_probability);
    // A Poisson count at least as large: the χ² with twice the count degrees of freedom is less than twice
    // the mean.
    found.p_value = if count > 0.0 { 1.0 - p_of_chi_square(2.0 * expected, 2.0 * count) } else { 1.0 };
    found
}

/// Whether two successive displacements cancel: whether together they are nearer to dead reckoning.
fn cancel(fit: &ModelFit<'_>, first: usize, second: usize, wrong: usize) -> bool {
    let of = |segments| fit.mahalanobis_distance(segments).unwrap_or(f64::INFINITY);
    fit.records.continues(second) && of(first..second + 1) < RESIDUALS.cancellation_ratio * of(wrong..wrong + 1)
}

/// Persistence of large innovations of a component: the mean of the next ones in the same direction, in
/// standard errors. Successive displacements start anew, and cannot show a jump.
pub(crate) fn residual_persistence(model: &AugmentedModel<'_>, component: usize) -> ResidualPersistence {
    let fit = &*model.fit.with_innovations(&mut terms(&model.candidates));
    let series = innovations(fit, component);
    let large = |pair: &&[&InnovationComponent]| {
        pair[0].z.abs() > RESIDUALS.tail_innovation_sigmas
            && is_tested_by_size(fit, pair[0].segment, pair[0].measurement)
    };
    let follows = |is_next: &dyn Fn(usize, usize) -> bool| {
        let pairs = series.windows(2).filter(large).filter(|pair| is_next(pair[0].segment, pair[1].segment));
        let (sum, count) = pairs.fold((0.0, 0.0_f64), |(sum, n), pair| (sum + pair[1].z * pair[0].z.signum(), n + 1.0));
        if count > 0.0 { sum / count.sqrt() } else { 0.0 }
    };
    let of_measurements = follows(&|segment, next| next == segment);
    let of_displacements = follows(&|segment, next| next == segment + 1 && fit.records.continues(next));
    if of_measurements > RESIDUALS.persistence_sigmas {
        ResidualPersistence::Persistent
    } else if of_measurements.min(of_displacements) < -RESIDUALS.persistence_sigmas {
        ResidualPersistence::Reverting
    } else {
        ResidualPersistence::Undecided
    }
}

#[cfg(test)]
mod tests {
    use dataset::{Dataset, Displacement, Odometry, Run, RunInfo, WheelLog};
    use estimation::{FitSettings, ModelFit};
    use kinematics::{Increment, Pose, Wheels};

    use super::{CHECKS_LEVEL, anscombe_glynn, judge, outliers, residual_persistence, whiteness};
    use crate::checks::check::{Check, ResidualPersistence, TestResult};
    use crate::fits::augmented_model::AugmentedModel;
    use crate::small_robot::dataset_of;
    use crate::{Options, Verdict, diagnose};

    /// Poses of six runs of forty seconds, turning both ways and back and forth, by the nominal robot.
    fn driven() -> (Dataset, Vec<Vec<Pose>>) {
        let mut poses = Vec::new();
        let run = |number: u32| {
            let mut angles = Wheels { left: vec![0.0], right: vec![0.0] };
            let mut path = vec![Pose::IDENTITY];
            for second in 0..40 {
                let k = f64::from(second + number);
                let turned = Wheels { left: 2.0 + (0.9 * k).sin(), right: 2.0 + (1.3 * k).cos() };
                let turned = if (second + number) % 4 == 3 { turned.map(|rad: f64| -rad) } else { turned };
                let arc = Increment::from_travel(turned.map(|rad| 0.08 * rad), 0.363).arc();
                path.push(*path.last().expect("a start") * arc);
                angles.left.push(angles.left.last().expect("a start") + turned.left);
                angles.right.push(angles.right.last().expect("a start") + turned.right);
            }
            poses.push(path);
            let t_s = (0..=40).map(f64::from).collect();
            let info = RunInfo { id: format!("run-{number}"), continuous: true, ..RunInfo::default() };
            let odometry = Odometry { t_s, wheels: WheelLog::Angles(angles), ..Odometry::default() };
            Run { info, odometry, ..Run::default() }
        };
        let runs = (0..6).map(run).collect();
        (dataset_of(0.363, runs), poses)
    }

    /// Errors as good as normal ones: millimetres and milliradians, the sum of twelve uniform ones by
    /// `SplitMix64` (Steele, Lea & Flood 2014).
    fn error(state: &mut u64) -> [f64; 3] {
        let mut uniform = || {
            *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = *state;
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            f64::from(u32::try_from((z ^ (z >> 31)) >> 32).expect("half of the bits")) / f64::from(u32::MAX)
        };
        std::array::from_fn(|_| 1e-3 * ((0..12).map(|_| uniform()).sum::<f64>() - 6.0))
    }

    /// Displacements between the poses, the instrument's errors of each given.
    fn displacements(path: &[Pose], mut off: impl FnMut(usize) -> [f64; 3]) -> Vec<Displacement> {
        let of = |(k, pair): (usize, &[Pose])| {
            let (moved, [x_m, y_m, theta_rad], second) = (pair[0].to(pair[1]), off(k), u32::try_from(k).expect("few"));
            Displacement {
                t0_s: f64::from(second),
                t1_s: f64::from(second + 1),
                dx_m: moved.x_m + x_m,
                dy_m: moved.y_m + y_m,
                dtheta_rad: moved.theta_rad + theta_rad,
            }
        };
        path.windows(2).enumerate().map(of).collect()
    }

    /// Seen by displacements whose errors keep a share from one to the next (a first-order autoregression).
    fn lasting(keeps: f64) -> Dataset {
        let ((mut dataset, paths), mut state) = (driven(), 7);
        for (run, path) in dataset.runs.iter_mut().zip(&paths) {
            let mut last = error(&mut state);
            run.displacements = displacements(path, |_| {
                let new = error(&mut state);
                last = std::array::from_fn(|k| keeps * last[k] + (1.0 - keeps * keeps).sqrt() * new[k]);
                last
            });
        }
        dataset
    }

    fn fitted(dataset: &Dataset) -> ModelFit<'_> {
        FitSettings::GEOMETRY_ONLY.fit(&[dataset.session()]).expect("a fit")
    }

    /// Of ten checks one fails by itself at a tenth of the level; each for itself, all would be tried at the
    /// whole of it, and one sound log in forty would be refused.
    #[test]
    fn checks_are_judged_together() {
        let passes = |p_values: &[f64]| {
            let check = |p_value: &f64| TestResult {
                check: Check::RunToRun,
                statistic: 1.0,
                p_value: p_value * CHECKS_LEVEL,
                passes: true,
            };
            let mut checks: Vec<TestResult> = p_values.iter().map(check).collect();
            judge(&mut checks);
            checks.iter().map(|check| check.passes).collect::<Vec<_>>()
        };
        let mut p_values = [0.9; 10];
        assert_eq!(passes(&p_values), [true; 10]);
        p_values[3] = 0.09;
        assert!(!passes(&p_values)[3] && passes(&p_values).iter().filter(|passes| **passes).count() == 9);
        // The next is judged among the nine that are left.
        p_values[7] = 0.105;
        assert!(!passes(&p_values)[7]);
        assert_eq!(passes(&[0.9]), [false]);
    }

    #[test]
    fn displacements_that_err_alike_are_not_white_and_the_instrument_is_named() {
        let is_white = |dataset: &Dataset| {
            let mut least = 1.0_f64;
            let correlation = whiteness(&fitted(dataset), &mut |_, _, p_value| least = least.min(p_value));
            (least > 1e-3, correlation.coefficient)
        };
        let (white, alike) = (lasting(0.0), lasting(0.7));
        // 234 pairs show a correlation to 0.07.
        assert!(is_white(&white).0 && !is_white(&alike).0, "{:?} {:?}", is_white(&white), is_white(&alike));
        assert!((is_white(&alike).1 - 0.7).abs() < 0.2, "{:?}", is_white(&alike));
        let diagnosed = |dataset: Dataset| diagnose(&[dataset], &Options::default()).expect("a diagnosis").document;
        assert_eq!(diagnosed(white).verdict, Verdict::Consistent);
        let document = diagnosed(alike);
        let names: Vec<&str> = document.findings.iter().map(|finding| finding.id.as_str()).collect();
        assert_eq!(names, ["truth_correlated_noise"]);
    }

    /// Refits keep no innovations: what asks for them finds them again.
    #[test]
    fn errors_that_revert_show_in_a_fit_without_innovations() {
        let ((mut dataset, paths), mut state) = (driven(), 11);
        for (number, (run, path)) in dataset.runs.iter_mut().zip(&paths).enumerate() {
            // Two displacements of every second run are off by 5 mm, one forward and the next one back.
            run.displacements = displacements(path, |k| {
                let [x_m, y_m, theta_rad] = error(&mut state);
                let off_m = if number % 2 == 0 && k == 10 { 5e-3 } else { 0.0 };
                let off_m = if number % 2 == 0 && k == 11 { -5e-3 } else { off_m };
                [x_m + off_m, y_m, theta_rad]
            });
        }
        let model = AugmentedModel::base(&fitted(&dataset).without_innovations());
        assert!(model.fit.solution.pass.innovations.is_empty());
        // Rejects innovations that were left out taken for none, which are undecided.
        assert_eq!(residual_persistence(&model, 0), ResidualPersistence::Reverting);
    }

    /// A measurement that errs spoils the displacement to it and the one from it; a displacement that errs
    /// alone may be the robot's jump as well.
    #[test]
    fn only_displacements_that_cancel_are_errors_of_a_measurement() {
        let ((mut dataset, paths), mut state) = (driven(), 11);
        let wrong = Pose::new(0.05, -0.03, 0.04);
        for (number, (run, path)) in dataset.runs.iter_mut().zip(&paths).enumerate() {
            let mut path = path.clone();
            // In the first run a measurement errs; in the second a displacement does.
            if number == 0 {
                path[20] = path[20] * wrong;
            }
            run.displacements = displacements(&path, |k| {
                let [x_m, y_m, theta_rad] = error(&mut state);
                let Pose { x_m: off_x_m, y_m: off_y_m, theta_rad: off_rad } =
                    if number == 1 && k == 20 { wrong } else { Pose::IDENTITY };
                [x_m + off_x_m, y_m + off_y_m, theta_rad + off_rad]
            });
        }
        let fit = fitted(&dataset);
        assert_eq!(fit.solution.pass.outliers, [(19, 0), (20, 0), (60, 0)]);
        let found = outliers(&fit);
        assert_eq!((found.isolated, found.persistent), (1, 1));
    }

    #[test]
    fn published_example_of_the_kurtosis_test() {
        // SciPy's documentation of stats.kurtosistest: the 20 values 0 … 19 give z = −1.7058104152122062.
        let values: Vec<f64> = (0..20).map(f64::from).collect();
        let moment = |power: i32| values.iter().map(|value| (value - 9.5).powi(power)).sum::<f64>() / 20.0;
        let z = anscombe_glynn(moment(4) / moment(2).powi(2), 20.0);
        assert!((z + 1.705_810_415_212_206_2).abs() < 1e-12, "{z}");
    }
}
