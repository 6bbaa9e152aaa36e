//! Quantiles of many errors in constant memory: counts in fixed bins, so that adding them in any order gives
//! the same.
//!
//! Bins are [`FINEST`] wide up to 16384 of them on each side of zero and a 16384th of the error beyond, as in
//! a floating-point number of 14 bits (the idea of `HdrHistogram`, Tene 2012): the bins of a sample are as
//! many as its spread asks for. Within a bin the errors are taken to be spread evenly. Standard errors are
//! half the distance of the quantiles at q ± √(q(1−q)/n) (Woodruff 1952).

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::moments::WithError;

/// Width of the bins about zero, as a share of the true value: a hundredth of the smallest spread that
/// calibration reaches (1e-5).
const FINEST: f64 = 1e-7;

/// Bins of one width; beyond, every doubling has as many.
const LINEAR: f64 = 16_384.0;

/// Largest relative error of a state that is read: its bin's edges are doubles, times any true value too.
const LARGEST_ERROR: f64 = 1e60;

/// Errors relative to the true value, counted.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Histogram {
    count: u64,
    bins: BTreeMap<i32, u64>,
}

impl Histogram {
    /// Takes one relative error in.
    pub(crate) fn push(&mut self, relative_error: f64) {
        self.count += 1;
        *self.bins.entry(bin(relative_error)).or_default() += 1;
    }

    /// Adds another histogram.
    pub(crate) fn merge(&mut self, other: &Self) {
        self.count += other.count;
        for (bin, count) in &other.bins {
            *self.bins.entry(*bin).or_default() += count;
        }
    }

    /// The value below which the share `q` lies, with its standard error; `None` with fewer than two errors.
    pub(crate) fn quantile(&self, q: f64) -> Option<WithError> {
        let n = self.count as f64;
        (self.count > 1).then(|| {
            let by = (q * (1.0 - q) / n).sqrt();
            (self.at(q * n), 0.5 * (self.at((q + by).min(1.0) * n) - self.at((q - by).max(0.0) * n)))
        })
    }

    /// Whether it holds so many errors, each in a bin that an error can have.
    pub(crate) fn holds(&self, count: u64) -> bool {
        let most = bin(LARGEST_ERROR);
        let sum = self.bins.values().try_fold(0_u64, |sum, count| sum.checked_add(*count));
        let are_bins = self.bins.iter().all(|(bin, count)| *count > 0 && (-1 - most..=most).contains(bin));
        self.count == count && sum == Some(count) && are_bins
    }

    /// The value with `rank` errors below it.
    fn at(&self, rank: f64) -> f64 {
        let (mut below, mut last) = (0.0, 0.0);
        for (bin, count) in &self.bins {
            let count = *count as f64;
            let (low, high) = edges(*bin);
            if below + count >= rank {
                return low + (high - low) * ((rank - below) / count).max(0.0);
            }
            below += count;
            last = high;
        }
        last
    }
}

/// The bin of a relative error; bin k ≥ 0 lies at or above zero, bin −1−k mirrors it.
// At most 16384 bins for each of 1100 doublings.
fn bin(relative_error: f64) -> i32 {
    let size = (relative_error.abs() / FINEST).min(f64::MAX);
    let k = if size < LINEAR {
        size as i32
    } else {
        let doublings = (size / LINEAR).log2().floor().max(0.0);
        // log2 may round up to the next doubling: the mantissa tells.
        let doublings = if size / LINEAR < doublings.exp2() { doublings - 1.0 } else { doublings };
        (LINEAR * (1.0 + doublings)) as i32 + ((size / doublings.exp2() - LINEAR) as i32).min(LINEAR as i32 - 1)
    };
    if relative_error < 0.0 { -1 - k } else { k }
}

/// Lower and upper edge of a bin.
fn edges(bin: i32) -> (f64, f64) {
    let k = f64::from(if bin < 0 { -1 - bin } else { bin });
    let (low, high) = if k < LINEAR {
        (k, k + 1.0)
    } else {
        let doublings = (k / LINEAR).floor() - 1.0;
        let within = k - LINEAR * (1.0 + doublings);
        ((LINEAR + within) * doublings.exp2(), (LINEAR + within + 1.0) * doublings.exp2())
    };
    if bin < 0 { (-high * FINEST, -low * FINEST) } else { (low * FINEST, high * FINEST) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use effects::{Address, StreamName};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_error_lies_in_its_bin_which_is_narrow(exponent in -9.0..300.0, mantissa in 1.0..10.0, negative: bool) {
            let error = mantissa * 10_f64.powf(exponent) * if negative { -1.0 } else { 1.0 };
            let (low, high) = edges(bin(error));
            // A few roundings of the bin's arithmetic.
            let slack = 1e-14 * error.abs();
            prop_assert!(low <= error + slack && error - slack <= high, "{low} {error} {high}");
            prop_assert!(high - low <= FINEST.max(error.abs() / LINEAR) * (1.0 + 1e-12));
        }
    }

    fn normals(seed: u64, n: usize, mean: f64, sigma: f64) -> Histogram {
        let mut stream = Address { seed, point: 0, trial: 0, run: 0 }.stream(StreamName::new("quantile"));
        let mut histogram = Histogram::default();
        (0..n).for_each(|_| histogram.push(mean + sigma * stream.normal()));
        histogram
    }

    #[test]
    fn quantiles_of_normals_fall_where_they_should() {
        // Bias fifty times the spread, as UMBmark's: 5, 50 and 95 % at −1.6449, 0 and 1.6449 sigma; the bound
        // is 4.5 of the stated errors, each of six comparisons a false positive of 7e-6.
        for (mean, sigma) in [(0.0, 1e-4), (-0.034, 6e-4)] {
            let histogram = normals(3, 20_000, mean, sigma);
            for (q, z) in [(0.05, -1.644_854), (0.5, 0.0), (0.95, 1.644_854)] {
                let (value, error) = histogram.quantile(q).expect("many");
                assert!(((value - mean) / sigma - z).abs() < 4.5 * error / sigma, "{q}: {value} ± {error}");
                // √(q(1−q)/n)/φ(z); the stated error counts the 2√(nq(1−q)) errors nearby, 62 at 5 %: 4.5/√62
                // is its bound.
                let known = (q * (1.0 - q) / 20_000.0).sqrt() / (0.398_942 * (-0.5 * z * z).exp());
                assert!((error / sigma / known - 1.0).abs() < 0.57, "{q}: {error}");
            }
        }
    }

    #[test]
    fn halves_in_any_order_make_the_whole() {
        let (a, b) = (normals(1, 500, 0.0, 1e-3), normals(2, 300, 0.1, 1e-5));
        let (mut ab, mut ba) = (a.clone(), b.clone());
        ab.merge(&b);
        ba.merge(&a);
        assert_eq!(ab, ba);
        assert_eq!(ab.count, 800);
        assert_eq!(Histogram::default().quantile(0.5), None);
    }
}
