//! What a sweep keeps of its trials: for each method and parameter the moments of the error, its quantiles
//! and how often the intervals held the truth.

use std::ops::Range;

use calib::{Calibration, Parameter};
use serde::{Deserialize, Serialize};
use statrs::distribution::{Beta, ContinuousCDF};

use super::dyadic::{DyadicSum, Merge};
use super::quantile::Histogram;
use super::result::{Coverage, EstimatorResult, Quantile};
use crate::moments::{Moments, WithError};

/// Half-widths of the central 68.27 % and 95 % of a standard normal.
const HALF_WIDTHS: [f64; 2] = [1.0, 1.959_963_984_540_054];

/// What is not within this share at either side is stated of a coverage: its bounds hold at 95 %.
const BOUND_TAIL: f64 = 0.025;

/// Shares at which quantiles are stated.
pub(super) const QUANTILES: [f64; 3] = [0.05, 0.5, 0.95];

/// Largest value that counts as an estimate, SI; beyond, the method failed. Fourth powers of its errors, and
/// their sums, can be kept and read back.
pub(super) const LARGEST_ESTIMATE: f64 = 1e12;

/// What one trial says of one method's estimate of one parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Outcome {
    /// The estimate; NaN where there is none.
    pub(super) value: f64,
    /// Its stated standard deviation; NaN where there is none.
    pub(super) sigma: f64,
    /// Does the method say that it cannot see the parameter?
    pub(super) blind: bool,
}

impl Outcome {
    /// What a calibration says of a parameter; nothing when it did not converge.
    pub(super) fn of(calibration: Option<&Calibration>, parameter: Parameter) -> Self {
        let none = Self { value: f64::NAN, sigma: f64::NAN, blind: false };
        let Some(calibration) = calibration.filter(|calibration| calibration.converged) else { return none };
        let is_value = |estimate: &calib::Estimate| estimate.value.abs() <= LARGEST_ESTIMATE;
        let Some(estimate) = calibration.estimate(parameter).filter(is_value) else { return none };
        let blind =
            |blind: &calib::NotObservable| blind.parameter == parameter || blind.parameter == Parameter::CommonScale;
        Self {
            value: estimate.value,
            sigma: estimate.sigma.filter(|sigma| sigma.is_finite()).unwrap_or(f64::NAN),
            blind: calibration.not_observable.iter().any(blind),
        }
    }
}

/// Sums over trials of one method's estimates of one parameter.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Tally {
    errors: Moments,
    with_sigma: u64,
    covered: [u64; 2],
    failures: u64,
    blind: u64,
}

impl Tally {
    pub(super) fn take(&mut self, outcome: Outcome, truth: f64) {
        if outcome.value.is_nan() {
            self.failures += 1;
            return;
        }
        let error = outcome.value - truth;
        self.errors.push(error);
        if !outcome.sigma.is_nan() {
            self.with_sigma += 1;
            for (covered, half_width) in self.covered.iter_mut().zip(HALF_WIDTHS) {
                *covered += u64::from(error.abs() <= half_width * outcome.sigma);
            }
        }
        self.blind += u64::from(outcome.blind);
    }

    /// Did the method say in any trial that it cannot see the parameter?
    pub(super) const fn is_blind(&self) -> bool {
        self.blind > 0
    }

    /// Whether it can be of so many trials.
    fn is_of(&self, trials: u64) -> bool {
        let count = self.errors.count();
        let within = [self.blind, self.with_sigma].into_iter().all(|part| part as f64 <= count);
        let is_covered = self.covered.into_iter().all(|covered| covered <= self.with_sigma);
        count + self.failures as f64 == trials as f64 && within && is_covered
    }

    fn coverage(&self, which: usize) -> Option<Coverage> {
        coverage(self.covered[which], self.with_sigma)
    }
}

impl Merge for Tally {
    fn merge(&mut self, following: &Self) {
        self.errors.merge(&following.errors);
        self.with_sigma += following.with_sigma;
        for (covered, more) in self.covered.iter_mut().zip(following.covered) {
            *covered += more;
        }
        self.failures += following.failures;
        self.blind += following.blind;
    }
}

/// Sums of a chunk of trials: every method's parameters, and every method's drift.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct ChunkSum {
    pub(super) estimates: Vec<Tally>,
    pub(super) drift: Vec<Moments>,
}

impl Merge for ChunkSum {
    fn merge(&mut self, following: &Self) {
        for (sum, more) in self.estimates.iter_mut().zip(&following.estimates) {
            sum.merge(more);
        }
        for (sum, more) in self.drift.iter_mut().zip(&following.drift) {
            sum.merge(more);
        }
    }
}

/// All that is kept of one point's trials, or of a range of them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct PointSum {
    pub(super) chunks: DyadicSum<ChunkSum>,
    /// Errors relative to the true values, as many as there are estimates.
    pub(super) histograms: Vec<Histogram>,
    /// The chunk before which it is looked at whether the point is done.
    #[serde(rename = "look")]
    pub(super) decision_chunk: u64,
}

impl PointSum {
    /// Nothing yet, from chunk `first` on.
    pub(super) fn starting_at(first: u64, estimates: usize, decision_chunk: u64) -> Self {
        Self {
            chunks: DyadicSum::starting_at(first),
            histograms: vec![Histogram::default(); estimates],
            decision_chunk,
        }
    }

    /// Whether it can be of a point with these estimates and methods, `chunks` of them at the most, of which
    /// `trials_before` tells the trials.
    pub(super) fn is_of(
        &self,
        estimates: usize,
        methods: usize,
        chunks: u64,
        trials_before: impl Fn(u64) -> u64,
    ) -> bool {
        let is_chunk = |leaves: Range<u64>, sum: &ChunkSum| {
            let trials = trials_before(leaves.end) - trials_before(leaves.start);
            let is_drift = |drift: &Moments| drift.count().fract() == 0.0 && drift.count() <= trials as f64;
            sum.estimates.len() == estimates
                && sum.drift.len() == methods
                && sum.estimates.iter().all(|tally| tally.is_of(trials))
                && sum.drift.iter().all(is_drift)
        };
        let are_chunks = self.chunks.next() <= chunks && (1..=chunks).contains(&self.decision_chunk);
        if !are_chunks || !self.chunks.is_whole(is_chunk) || self.histograms.len() != estimates {
            return false;
        }
        let total = self.chunks.total().unwrap_or_default();
        total.estimates.iter().zip(&self.histograms).all(|(tally, of)| of.holds(tally.errors.count() as u64))
    }

    /// Adds the trials that follow; false when they do not.
    #[must_use]
    pub(super) fn join(&mut self, following: Self) -> bool {
        for (histogram, more) in self.histograms.iter_mut().zip(&following.histograms) {
            histogram.merge(more);
        }
        self.chunks.join(following.chunks)
    }
}

/// The largest Monte-Carlo error among a tally's numbers: bias and quantiles over the spread, spread, RMSE
/// and efficiency over themselves, coverage and share of failures as they are.
pub(super) fn largest_error(tally: &Tally, histogram: &Histogram, truth: f64) -> f64 {
    let mut errors = Vec::new();
    if let (Some((variance, variance_error)), Some((_, bias_error)), Some((rmse, rmse_error))) =
        (tally.errors.variance(), tally.errors.bias(), tally.errors.rmse())
        && variance > 0.0
    {
        let std = variance.sqrt();
        // The ratio to the bound is a square of the RMSE.
        errors.extend([bias_error / std, variance_error / variance, 2.0 * rmse_error / rmse]);
        errors.extend(QUANTILES.iter().filter_map(|q| histogram.quantile(*q)).map(|(_, error)| error * truth / std));
    }
    errors.extend((0..HALF_WIDTHS.len()).filter_map(|which| tally.coverage(which)).map(|coverage| coverage.mcse));
    errors.into_iter().fold(0.0, f64::max)
}

/// As [`largest_error`], for a drift: mean and RMS over the RMS.
pub(super) fn largest_drift_error(drift: &Moments) -> f64 {
    match (drift.bias(), drift.rmse()) {
        (Some((_, mean_error)), Some((rms, rms_error))) if rms > 0.0 => (mean_error / rms).max(rms_error / rms),
        _ => 0.0,
    }
}

/// A share of `of` trials with its standard error and the bounds of Clopper & Pearson (1934).
fn coverage(covered: u64, of: u64) -> Option<Coverage> {
    let (k, n) = (covered as f64, of as f64);
    let quantile = |a: f64, b: f64, p: f64| Beta::new(a, b).map(|beta| beta.inverse_cdf(p)).ok();
    (of > 0).then(|| Coverage {
        share: k / n,
        // Of (k+1)/(n+2): a share of exactly one is not without error (Laplace's rule).
        mcse: ((k + 1.0) * (n - k + 1.0) / ((n + 2.0) * (n + 2.0) * (n + 3.0))).sqrt(),
        low: if covered == 0 { Some(0.0) } else { quantile(k, n - k + 1.0, BOUND_TAIL) },
        high: if covered == of { Some(1.0) } else { quantile(k + 1.0, n - k, 1.0 - BOUND_TAIL) },
    })
}

/// Lower bound of the variance of unbiased estimates, or why there is none.
pub(super) type Bound = Result<f64, String>;

/// The account of one method's estimates of one parameter.
pub(super) fn estimator_result(
    method: &str,
    parameter: Parameter,
    truth: f64,
    tally: &Tally,
    histogram: &Histogram,
    bound: &Bound,
) -> EstimatorResult {
    let (bias, bias_mcse) = tally.errors.bias().unzip();
    let (variance, variance_mcse) = tally.errors.variance().unzip();
    let (rmse, rmse_mcse) = tally.errors.rmse().unzip();
    let [low, middle, high] = QUANTILES.map(|q| {
        histogram.quantile(q).map(|(value, mcse)| Quantile { share: q, error: value * truth, mcse: mcse * truth })
    });
    let ratio = |rmse: WithError, bound: f64| (rmse.0 * rmse.0 / bound, 2.0 * rmse.0 * rmse.1 / bound);
    let (cramer_rao_ratio, cramer_rao_ratio_mcse) =
        tally.errors.rmse().zip(bound.as_ref().ok()).map(|(rmse, bound)| ratio(rmse, *bound)).unzip();
    let why_null = match (bound, cramer_rao_ratio) {
        (Err(why), _) => Some(why.clone()),
        (Ok(_), None) => Some("the method gave no two values".to_owned()),
        (Ok(_), Some(_)) => None,
    };
    let [one_sigma, ninety_five] = [tally.coverage(0), tally.coverage(1)];
    EstimatorResult {
        method: method.to_owned(),
        parameter: parameter.key().to_owned(),
        truth,
        bias,
        bias_mcse,
        variance,
        variance_mcse,
        rmse,
        rmse_mcse,
        quantiles: [low, middle, high].into_iter().flatten().collect(),
        coverage: ninety_five.map(|coverage| coverage.share),
        coverage_95: ninety_five,
        coverage_68: one_sigma,
        failures: tally.failures,
        not_applicable: None,
        common_scale_observable: !tally.is_blind(),
        cramer_rao_sigma: bound.as_ref().ok().map(|bound| bound.sqrt()),
        cramer_rao_ratio,
        cramer_rao_ratio_mcse,
        cramer_rao_why_null: why_null,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coverage_is_bounded_as_clopper_and_pearson_print() {
        // 95 % bounds of 8 in 10 and of 0 in 10 (Clopper & Pearson 1934; 1 − 0.025^{1/10} = 0.3085).
        let eight = coverage(8, 10).expect("ten trials");
        let close = |value: Option<f64>, printed: f64| (value.expect("a bound") - printed).abs() < 5e-5;
        assert!(close(eight.low, 0.4439) && close(eight.high, 0.9748), "{eight:?}");
        let none = coverage(0, 10).expect("ten trials");
        assert!(none.low == Some(0.0) && close(none.high, 0.3085), "{none:?}");
        assert_eq!(coverage(10, 10).expect("ten").high, Some(1.0));
        assert!(coverage(10, 10).expect("ten").mcse > 0.0);
        assert_eq!(coverage(0, 0), None);
        // Large counts, as campaigns have them: the normal approximation to a hundredth of its width.
        let many = coverage(950_000, 1_000_000).expect("many");
        assert!((many.low.expect("low") - (0.95 - 1.96 * many.mcse)).abs() < 0.02 * many.mcse, "{many:?}");
    }

    #[test]
    fn the_largest_error_of_normals_is_that_of_their_outer_quantiles() {
        // 2.1/√n (quantile.rs) is above √(2/n) of the variance.
        let mut stream =
            effects::Address { seed: 4, point: 0, trial: 0, run: 0 }.stream(effects::StreamName::new("largest error"));
        let (mut tally, mut histogram) = (Tally::default(), Histogram::default());
        for _ in 0..10_000 {
            let error = 1e-4 * stream.normal();
            tally.take(Outcome { value: 0.3 * (1.0 + error), sigma: 0.3e-4, blind: false }, 0.3);
            histogram.push(error);
        }
        let largest = largest_error(&tally, &histogram, 0.3);
        assert!((0.018..0.024).contains(&largest), "{largest}");
        assert_eq!(largest_error(&Tally::default(), &Histogram::default(), 1.0), 0.0);
    }
}
