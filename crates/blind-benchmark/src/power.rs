//! What a test can do: noncentralities for a power, and one-sided limits of shares.
//!
//! Reference: Patnaik 1949 (noncentral χ² as a Poisson mixture); Clopper & Pearson 1934.

use statrs::distribution::{Beta, ChiSquared, ContinuousCDF, Discrete, Poisson};

/// Level of the oracle's tests.
const LEVEL: f64 = 0.05;
/// Power at which a size counts as detectable, and two candidates as discriminated.
const POWER: f64 = 0.9;

/// Noncentrality at which two candidates are discriminated at the level and power above: their log likelihood
/// ratio is N(±λ/2, λ), so √λ = z(0.95) + z(0.9).
pub(crate) const DISCRIMINATION_LEVEL: f64 = 8.564;

/// Power of a χ² test at 5 % with this noncentrality.
pub(crate) fn power(freedom: f64, noncentrality: f64) -> f64 {
    let Ok(central) = ChiSquared::new(freedom) else { return 0.0 };
    let critical = central.inverse_cdf(1.0 - LEVEL);
    let Ok(poisson) = Poisson::new(0.5 * noncentrality) else { return LEVEL };
    // 60 and more terms: noncentralities here are under 40.
    let terms = 60 + (3.0 * noncentrality) as u64;
    (0..terms)
        .map(|k| {
            let more = freedom + 2.0 * k as f64;
            poisson.pmf(k) * ChiSquared::new(more).map_or(0.0, |chi| chi.sf(critical))
        })
        .sum()
}

/// The noncentrality at which a χ² test of so many degrees of freedom at 5 % has power 0.9.
pub(crate) fn detection_limit(freedom: usize) -> f64 {
    let freedom = freedom.max(1) as f64;
    let (mut low, mut high) = (1.0, 60.0);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if power(freedom, middle) < POWER { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// One-sided 95 % limits of a share, lower and upper (Clopper–Pearson).
pub(crate) fn limits(successes: usize, of: usize) -> (f64, f64) {
    clopper_pearson(successes, of, 0.05)
}

/// The two-sided 95 % interval of a share (Clopper–Pearson).
pub(crate) fn two_sided(successes: usize, of: usize) -> (f64, f64) {
    clopper_pearson(successes, of, 0.025)
}

/// Limits of a share, each with so much probability beyond it.
fn clopper_pearson(successes: usize, of: usize, beyond: f64) -> (f64, f64) {
    let (k, n) = (successes as f64, of as f64);
    let quantile = |a: f64, b: f64, p: f64| Beta::new(a, b).map_or(f64::NAN, |beta| beta.inverse_cdf(p));
    let low = if successes == 0 { 0.0 } else { quantile(k, n - k + 1.0, beyond) };
    let high = if successes >= of { 1.0 } else { quantile(k + 1.0, n - k, 1.0 - beyond) };
    (low, high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn published_noncentralities_for_ninety_per_cent() {
        // Cohen 1988, table 9.3 (λ at a = .05, power .90): 10.51, 12.65, 14.17, 15.41 for 1 to 4 degrees of
        // freedom, to its last digit.
        for (freedom, expected) in [(1, 10.51), (2, 12.65), (3, 14.17), (4, 15.41)] {
            assert!((detection_limit(freedom) - expected).abs() < 0.006, "{freedom}");
        }
    }

    #[test]
    fn published_limits_of_shares() {
        // The rule of three: no success in n leaves 1 − 0.05^{1/n}.
        let (low, high) = limits(0, 100);
        assert!(low == 0.0 && (high - (1.0 - 0.05_f64.powf(0.01))).abs() < 1e-9, "{high}");
        let (low, high) = limits(100, 100);
        assert!(high == 1.0 && (low - 0.05_f64.powf(0.01)).abs() < 1e-9, "{low}");
        // Two-sided 10 of 100: 4.90 to 17.62 %.
        let (low, high) = two_sided(10, 100);
        assert!((low - 0.0490).abs() < 5e-5 && (high - 0.1762).abs() < 5e-5, "{low} {high}");
        let (low, high) = limits(10, 100);
        assert!(low < 0.1 && high > 0.1 && (high - 0.1638).abs() < 5e-4 && (low - 0.0553).abs() < 5e-4, "{low} {high}");
    }
}
