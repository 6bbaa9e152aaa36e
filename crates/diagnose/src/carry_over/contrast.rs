//! The contrast of one unit with all others: is its size more than half of theirs? With a of the unit and b
//! of the others, it is a − ½ b in the sense of b.

use nalgebra::DMatrix;

use crate::settings::CARRY_OVER;

/// A unit against all others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Contrast {
    /// a − ½ b, signed by b, with its standard deviation.
    pub(crate) value: (f64, f64),
    /// |b| over its standard deviation.
    pub(crate) sigmas_of_others: f64,
    /// ½ |b| over the standard deviation of the contrast: how plainly a unit that agrees would show it.
    pub(crate) power_sigmas: f64,
}

impl Contrast {
    /// Of a unit's size and that of the others, in the sense of the others.
    pub(crate) fn of(own: f64, others: f64, covariance: &DMatrix<f64>) -> Option<Self> {
        let variance = covariance[(0, 0)] - covariance[(0, 1)] + 0.25 * covariance[(1, 1)];
        let (sigma, sigma_of_others) = (variance.sqrt(), covariance[(1, 1)].sqrt());
        (sigma > 0.0 && sigma_of_others > 0.0).then(|| Self {
            value: (others.signum() * (own - 0.5 * others), sigma),
            sigmas_of_others: others.abs() / sigma_of_others,
            power_sigmas: 0.5 * others.abs() / sigma,
        })
    }

    /// Do the others determine the size, and would the unit show it?
    pub(crate) fn is_testable(&self) -> bool {
        self.sigmas_of_others >= CARRY_OVER.min_sigmas_of_others && self.power_sigmas >= CARRY_OVER.min_power_sigmas
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_is_asked_where_the_others_know_the_size_and_it_would_show() {
        let is_testable = |sigmas_of_others, power_sigmas| {
            Contrast { value: (0.5, 0.1), sigmas_of_others, power_sigmas }.is_testable()
        };
        assert!(is_testable(3.0, 2.93) && !is_testable(2.99, 10.0) && !is_testable(10.0, 2.92));
    }

    /// A size that is negative in all units carries over, and one whose sign differs in a unit does not.
    #[test]
    fn a_contrast_counts_in_the_sense_of_the_others() {
        let covariance = DMatrix::from_row_slice(2, 2, &[0.04, 0.01, 0.01, 0.04]);
        for sign in [1.0, -1.0] {
            let of = |own: f64| Contrast::of(sign * own, sign, &covariance).expect("determined");
            // 0.04 − 0.01 + 0.04/4 = 0.04.
            assert!((of(1.0).value.0 - 0.5).abs() < 1e-15 && (of(1.0).value.1 - 0.2).abs() < 1e-15);
            assert!((of(-1.0).value.0 + 1.5).abs() < 1e-15);
            assert!((of(1.0).sigmas_of_others - 5.0).abs() < 1e-12 && (of(1.0).power_sigmas - 2.5).abs() < 1e-12);
        }
    }
}
