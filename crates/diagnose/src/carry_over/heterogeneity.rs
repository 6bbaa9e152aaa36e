//! How the sizes of one term differ between units, and what a new unit will have.
//!
//! With sizes s_u and standard deviations σ_u, weights w = σ⁻² and their weighted mean s̄: Q = Σ w (s − s̄)²
//! is χ² of k − 1 degrees where all units have one size (Cochran 1954). Else they scatter by
//! τ² = (Q − (k − 1)) / (Σw − Σw²/Σw) (DerSimonian & Laird 1986), and a new unit's size is about the mean
//! with variance τ² + se², by Student's distribution of k − 2 degrees (Higgins, Thompson & Spiegelhalter
//! 2009).

use crate::fits::statistics::{p_of_chi_square, p_of_upper_student};

/// Differences between units, in shares of the size found in all.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Heterogeneity {
    pub(crate) units: usize,
    /// Cochran's Q, and its p-value where all units have one size.
    pub(crate) q: f64,
    pub(crate) p_value: f64,
    /// Standard deviation of the units' own sizes.
    pub(crate) tau: f64,
    /// Probability that a new unit has less than half of the mean size.
    pub(crate) less_than_half: f64,
}

impl Heterogeneity {
    /// Of sizes with their standard deviations; `None` of fewer than three, which say nothing of a scatter.
    pub(crate) fn of(sizes: &[(f64, f64)]) -> Option<Self> {
        let units = sizes.len();
        let weight = |(_, sigma): &(f64, f64)| sigma.powi(-2);
        let sum = |of: &dyn Fn(&(f64, f64)) -> f64| sizes.iter().map(of).sum::<f64>();
        let all = sum(&weight);
        if units < 3 || !all.is_finite() || all <= 0.0 {
            return None;
        }
        let mean = sum(&|of| weight(of) * of.0) / all;
        let q = sum(&|of| weight(of) * (of.0 - mean).powi(2));
        let freedom = (units - 1) as f64;
        let tau2 = ((q - freedom) / (all - sum(&|of| weight(of).powi(2)) / all)).max(0.0);
        // A Q that is its expectation to the last digits.
        let tau2 = if q - freedom < 1e-9 * freedom { 0.0 } else { tau2 };
        // The mean where units scatter has weights of its own.
        let own = |of: &(f64, f64)| (tau2 + of.1 * of.1).recip();
        let of_mean = sum(&own);
        let mean = sum(&|of| own(of) * of.0) / of_mean;
        let sigma = (tau2 + of_mean.recip()).sqrt();
        Some(Self {
            units,
            q,
            p_value: p_of_chi_square(q, freedom),
            tau: tau2.sqrt(),
            less_than_half: p_of_upper_student(0.5 * mean / sigma, freedom - 1.0),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_that_agree_do_not_scatter_and_those_that_differ_do() {
        // Weights of 100: Q = 100 (0.01 + 0 + 0.01) = 2.
        let alike = Heterogeneity::of(&[(0.9, 0.1), (1.0, 0.1), (1.1, 0.1)]).expect("three");
        assert!((alike.q - 2.0).abs() < 1e-9 && alike.tau == 0.0, "{alike:?}");
        // p of χ² = 2 with two degrees is e⁻¹; t = 0.5/0.0577 = 8.66 with one degree: its upper tail is
        // atan(1/8.66)/π = 0.0366.
        assert!((alike.p_value - (-1.0_f64).exp()).abs() < 1e-9, "{alike:?}");
        assert!((alike.less_than_half - 0.0366).abs() < 1e-4, "{alike:?}");
        // Q = 100 · 2 · 0.64 = 128; τ² = (128 − 2)/(300 − 100) = 0.63.
        let heterogeneous = Heterogeneity::of(&[(0.2, 0.1), (1.0, 0.1), (1.8, 0.1)]).expect("three");
        assert!(
            (heterogeneous.q - 128.0).abs() < 1e-9 && (heterogeneous.tau - 0.63_f64.sqrt()).abs() < 1e-9,
            "{heterogeneous:?}"
        );
        assert!(heterogeneous.p_value < 1e-20 && heterogeneous.less_than_half > 0.3, "{heterogeneous:?}");
        assert!(Heterogeneity::of(&[(1.0, 0.1), (0.2, 0.1)]).is_none());
    }
}
