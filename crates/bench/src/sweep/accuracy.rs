//! The regression on accuracy: a sweep against a stored one, with a stated budget of false positive.
//!
//! Every estimator's bias, variance, coverages and share of failures is compared with the baseline's by a
//! two-sample test on a scale where the normal distribution holds far out: bias as it is, variance by its
//! logarithm, shares by Freeman & Tukey's (1950) arcsine of the root. The budget is divided by the number of
//! comparisons (Bonferroni), so that an honest change of draws, whatever the dependence between the numbers,
//! raises a false positive no more often than the budget says.

use std::path::Path;

use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal};

use super::plan::MAX_TRIALS;
use super::result::{EstimatorResult, SweepResult};
use crate::error::BenchError;

/// Probability that a whole comparison of two honest sweeps finds anything.
pub const FALSE_ALARM_BUDGET: f64 = 1e-4;

/// Longest result of a sweep, bytes; a baseline has some ten thousand.
const MAX_RESULT_BYTES: u64 = 1 << 30;

/// One number of a sweep beside the baseline's.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// Levels of the point, `key = level` each.
    pub point: String,
    /// The method.
    pub method: String,
    /// The parameter.
    pub parameter: String,
    /// Which number of it.
    pub statistic: &'static str,
    /// In the baseline.
    pub was: f64,
    /// Now.
    pub is: f64,
    /// The difference over its standard error; infinite where that is no number, so that it has moved.
    pub z: f64,
}

/// A sweep beside its baseline.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AccuracyCheck {
    /// Probability of a false positive, over all comparisons.
    pub false_alarm_budget: f64,
    /// |z| beyond which a number has moved.
    pub z_limit: f64,
    /// How many numbers were compared.
    pub compared: usize,
    /// The largest |z| of all; infinite where one is no number.
    pub largest_z: f64,
    /// What has moved, the farthest first.
    pub moved: Vec<Comparison>,
    /// Everything whose value is not the same, the farthest first.
    #[serde(skip)]
    pub changed: Vec<Comparison>,
}

/// Reads a baseline.
///
/// # Errors
/// [`BenchError::Baseline`] when it cannot be read or is no sweep's result.
pub fn read_baseline(path: &Path) -> Result<SweepResult, BenchError> {
    let failed = |why: String| BenchError::Baseline { path: path.display().to_string(), why };
    let bytes = atomic_file::read_at_most(path, MAX_RESULT_BYTES)
        .map_err(|error| failed(format!("{error}; --update writes a baseline")))?;
    let baseline: SweepResult =
        serde_json::from_slice(&bytes).map_err(|error| failed(format!("not a baseline: {error}")))?;
    for point in &baseline.points {
        let most = point.estimators.iter().map(|of| of.failures).max().unwrap_or(0);
        if point.trials == 0 || point.trials > MAX_TRIALS || most > point.trials {
            return Err(failed(format!("not a baseline: {most} failures in {} trials", point.trials)));
        }
    }
    Ok(baseline)
}

/// Compares a sweep with a baseline; `location` (the baseline's file) is named in errors.
///
/// # Errors
/// [`BenchError::Baseline`] when the two do not have the same points, methods and parameters.
pub fn compare(result: &SweepResult, baseline: &SweepResult, location: &str) -> Result<AccuracyCheck, BenchError> {
    let differ = |what: String| BenchError::Baseline {
        path: location.to_owned(),
        why: format!("{what}; if that is meant, --update writes the baseline anew"),
    };
    if result.points.len() != baseline.points.len() {
        return Err(differ(format!("it has {} points and the sweep {}", baseline.points.len(), result.points.len())));
    }
    let mut all = Vec::new();
    for (now, then) in result.points.iter().zip(&baseline.points) {
        let levels: Vec<String> = now.levels.iter().map(|(key, level)| format!("{key} = {level}")).collect();
        let point = levels.join(", ");
        let names = |estimators: &[EstimatorResult]| -> Vec<(String, String)> {
            estimators.iter().map(|of| (of.method.clone(), of.parameter.clone())).collect()
        };
        if now.levels != then.levels || names(&now.estimators) != names(&then.estimators) {
            return Err(differ(format!("it was made for other levels, methods or parameters than the point {point}")));
        }
        for (is, was) in now.estimators.iter().zip(&then.estimators) {
            all.extend(comparisons(&point, is, now.trials, was, then.trials));
        }
    }
    let tail = FALSE_ALARM_BUDGET / (2.0 * all.len().max(1) as f64);
    let z_limit = Normal::standard().inverse_cdf(1.0 - tail);
    all.sort_by(|a, b| b.z.abs().total_cmp(&a.z.abs()));
    Ok(AccuracyCheck {
        false_alarm_budget: FALSE_ALARM_BUDGET,
        z_limit,
        compared: all.len(),
        largest_z: all.first().map_or(0.0, |largest| largest.z.abs()),
        moved: all.iter().filter(|number| number.z.abs() > z_limit).cloned().collect(),
        // Changed where a bit is.
        changed: all.into_iter().filter(|number| number.is != number.was).collect(),
    })
}

/// Everything that can be compared of one estimator; the numbers beside the estimators are their trials.
fn comparisons(point: &str, is: &EstimatorResult, is_of: u64, was: &EstimatorResult, was_of: u64) -> Vec<Comparison> {
    let (method, parameter) = (&is.method, &is.parameter);
    let number = |statistic, was: f64, is: f64, z: f64| Comparison {
        point: point.to_owned(),
        method: method.clone(),
        parameter: parameter.clone(),
        statistic,
        was,
        is,
        z: if z.is_nan() { f64::INFINITY } else { z },
    };
    let over = |difference: f64, error: f64| if difference == 0.0 { 0.0 } else { difference / error };
    let mut found = Vec::new();
    let bias = |of: &EstimatorResult| of.bias.zip(of.bias_mcse);
    if let (Some((is, is_error)), Some((was, was_error))) = (bias(is), bias(was)) {
        found.push(number("bias", was, is, over(is - was, is_error.hypot(was_error))));
    }
    let variance = |of: &EstimatorResult| of.variance.zip(of.variance_mcse);
    if let (Some((is, is_error)), Some((was, was_error))) = (variance(is), variance(was)) {
        let z = if is > 0.0 && was > 0.0 {
            over((is / was).ln(), (is_error / is).hypot(was_error / was))
        } else {
            over(is - was, 0.0)
        };
        found.push(number("variance", was, is, z));
    }
    let (is_used, was_used) = ((is_of - is.failures) as f64, (was_of - was.failures) as f64);
    let shares = [
        ("coverage", is.coverage, was.coverage, is_used, was_used),
        ("coverage_68", is.coverage_68.map(|of| of.share), was.coverage_68.map(|of| of.share), is_used, was_used),
        (
            "failures",
            Some(is.failures as f64 / is_of as f64),
            Some(was.failures as f64 / was_of as f64),
            is_of as f64,
            was_of as f64,
        ),
    ];
    for (statistic, is, was, is_of, was_of) in shares {
        if let (Some(is), Some(was)) = (is, was) {
            found.push(number(statistic, was, is, over(angle(is, is_of) - angle(was, was_of), spread(is_of, was_of))));
        }
    }
    // A number that is there on one side only has moved as far as can be.
    let there = |of: &EstimatorResult| {
        [bias(of).is_some(), variance(of).is_some(), of.coverage.is_some(), of.coverage_68.is_some()]
    };
    if there(is) != there(was) {
        let all = |of: &EstimatorResult| f64::from(u8::from(there(of) == [true; 4]));
        found.push(number("has a value", all(was), all(is), f64::INFINITY));
    }
    found
}

/// Freeman & Tukey's angle of a share of `n`, whose standard deviation is 1/√(n + ½) whatever the share.
fn angle(share: f64, n: f64) -> f64 {
    let k = share * n;
    (k / (n + 1.0)).sqrt().asin() + ((k + 1.0) / (n + 1.0)).sqrt().min(1.0).asin()
}

fn spread(n: f64, m: f64) -> f64 {
    (1.0 / (n + 0.5) + 1.0 / (m + 0.5)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_angle_of_a_share_scatters_alike_everywhere() {
        // Binomial draws of n = 2000 at three shares: the variance of the angle times n + ½ is 1; of 4000
        // draws its standard error is √(2/4000) = 2.2 %.
        let mut stream =
            effects::Address { seed: 9, point: 0, trial: 0, run: 0 }.stream(effects::StreamName::new("shares"));
        for share in [0.5, 0.95, 0.99] {
            let mut angles = crate::Moments::default();
            for _ in 0..4000 {
                let k = (0..2000).filter(|_| stream.uniform() < share).count();
                angles.push(angle(k as f64 / 2000.0, 2000.0));
            }
            let scaled = angles.variance().expect("many").0 * 2000.5;
            assert!((scaled - 1.0).abs() < 4.5 * 0.022, "{share}: {scaled}");
        }
    }
}
