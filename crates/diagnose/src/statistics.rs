//! Distributions behind the tests: F, χ², normal, Student; and Holm's order of many tests.
//!
//! Reference: Holm 1979.

use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor, Normal, StudentsT};
use statrs::function::erf::erfc_inv;

/// p-value of a sum of `dimensions` squared normal variables over their variance, when the variance was
/// estimated from about `freedom` values.
pub(crate) fn p_of_statistic(statistic: f64, dimensions: usize, freedom: f64) -> f64 {
    if dimensions == 0 || !statistic.is_finite() {
        return 1.0;
    }
    let dimensions = dimensions as f64;
    FisherSnedecor::new(dimensions, freedom.max(1.0)).map_or(1.0, |f| f.sf(statistic.max(0.0) / dimensions))
}

/// The same of a score's statistic, g'I⁻¹g, whose variance was estimated from `count` values that have what
/// is tested in them: it is at most `count`, and what it leaves of that is what the variance should have
/// been estimated from (exact for one variance: F of the regression).
pub(crate) fn p_of_score(statistic: f64, dimensions: usize, count: f64, freedom: f64) -> f64 {
    let left = freedom - dimensions as f64;
    if dimensions == 0 || !statistic.is_finite() || left < 1.0 {
        return 1.0;
    }
    let share = (statistic / count.max(1.0)).clamp(0.0, 1.0 - 1e-9);
    p_of_statistic(left * share / (1.0 - share), dimensions, left)
}

/// p-value of a χ² variable.
pub(crate) fn p_of_chi_square(statistic: f64, freedom: f64) -> f64 {
    ChiSquared::new(freedom.max(1.0)).map_or(1.0, |chi| chi.sf(statistic.max(0.0)))
}

/// Two-sided p-value of a normal variable.
pub(crate) fn p_of_z(z: f64) -> f64 {
    Normal::new(0.0, 1.0).map_or(1.0, |normal| 2.0 * normal.sf(z.abs()))
}

/// Two-sided p-value of a Student variable.
pub(crate) fn p_of_student(t: f64, freedom: f64) -> f64 {
    // Of columns without scatter there is no statistic, and no evidence.
    if t.is_nan() {
        return 1.0;
    }
    StudentsT::new(0.0, 1.0, freedom.max(1.0)).map_or(1.0, |student| 2.0 * student.sf(t.abs()))
}

/// Upper tail of a Student variable.
pub(crate) fn p_of_upper_student(t: f64, freedom: f64) -> f64 {
    if t.is_nan() {
        return 1.0;
    }
    StudentsT::new(0.0, 1.0, freedom.max(1.0)).map_or(1.0, |student| student.sf(t))
}

/// Standard normal quantile of an upper tail of this probability.
pub(crate) fn z_of_upper(p: f64) -> f64 {
    let p = p.clamp(1e-300, 1.0 - 1e-12);
    if p <= 0.5 { z_of_p(2.0 * p) } else { -z_of_p(2.0 * (1.0 - p)) }
}

/// Standard normal quantile of a two-sided p-value.
pub(crate) fn z_of_p(p: f64) -> f64 {
    std::f64::consts::SQRT_2 * erfc_inv(p.clamp(1e-300, 1.0))
}

/// Student's quantile for a two-sided interval of 95 %.
pub(crate) fn student_95(freedom: f64) -> f64 {
    StudentsT::new(0.0, 1.0, freedom.max(1.0)).map_or(f64::INFINITY, |student| student.inverse_cdf(0.975))
}

/// Probability that the best of so many trials is as good as `p`; Šidák 1967.
pub(crate) fn sidak(p: f64, trials: usize) -> f64 {
    let trials = trials as f64;
    -f64::exp_m1(trials * f64::ln_1p(-p.min(1.0 - 1e-16)))
}

/// Which of several tests fail at a family-wise level; Holm 1979.
pub(crate) fn holm(p: &[f64], level: f64) -> Vec<bool> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|a, b| p[*a].total_cmp(&p[*b]));
    let mut fails = vec![false; p.len()];
    for (rank, &test) in order.iter().enumerate() {
        let left = (p.len() - rank) as f64;
        if p[test] * left > level {
            break;
        }
        fails[test] = true;
    }
    fails
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probabilities_and_quantiles_are_each_others_inverse() {
        for z in [0.5, 1.959_964, 4.0, 12.0] {
            assert!((z_of_p(p_of_z(z)) - z).abs() < 1e-6 * z, "{z}");
        }
        // One dimension with many degrees of freedom is a squared normal variable.
        assert!((p_of_statistic(1.959_964_f64.powi(2), 1, 1e7) - 0.05).abs() < 1e-6);
        assert!((p_of_chi_square(3.841_459, 1.0) - 0.05).abs() < 1e-6);
        assert!(
            p_of_statistic(10.0, 1, 5.0) > p_of_statistic(10.0, 1, 500.0),
            "few values know little of the variance"
        );
    }

    #[test]
    fn holm_stops_at_the_first_that_passes() {
        assert_eq!(holm(&[0.06, 0.001, 0.012, 0.02], 0.05), [false, true, true, true]);
        assert_eq!(holm(&[0.03, 0.02], 0.05), [true, true]);
        assert_eq!(holm(&[0.03, 0.03], 0.05), [false, false]);
    }

    #[test]
    fn the_best_of_trials_pays_for_them() {
        assert!((sidak(0.01, 1) - 0.01).abs() < 1e-15);
        assert!((sidak(1e-12, 40) - 4e-11).abs() < 1e-20);
    }
}
