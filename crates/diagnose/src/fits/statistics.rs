//! Distributions behind the tests: F, χ², normal, Student; and Holm's order of many tests.
//!
//! Reference: Holm 1979.

use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor, Normal, StudentsT};
use statrs::function::erf::erfc_inv;

use crate::settings::{LEVELS, SEARCH};

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
    if !statistic.is_finite() {
        return 1.0;
    }
    p_of_share(statistic / count.max(1.0), dimensions, freedom, 1.0)
}

/// p-value of the share of a sum of squares that a regression explains, of so many values: its F over an
/// inflation.
fn p_of_share(share: f64, dimensions: usize, freedom: f64, inflation: f64) -> f64 {
    let left = freedom - dimensions as f64;
    if dimensions == 0 || left < 1.0 {
        return 1.0;
    }
    let share = share.clamp(0.0, 1.0 - 1e-9);
    p_of_statistic(left * share / (1.0 - share) / inflation, dimensions, left)
}

/// p-value of a refit, from the score's statistic and the likelihood ratio: F of a regression whose variance
/// is estimated from n values, of which the score is n R² and the ratio −n ln(1 − R²); χ² of the ratio where
/// it is no larger. F and χ² are judged over their `inflation`; from how many values the variance was
/// estimated does not depend on it.
pub(crate) fn p_of_ratio(score: f64, ratio: f64, dimensions: usize, inflation: f64) -> f64 {
    if dimensions == 0 || !score.is_finite() || !ratio.is_finite() {
        return 1.0;
    }
    if ratio <= score {
        return p_of_chi_square(ratio / inflation, dimensions as f64);
    }
    // score/ratio = R²/−ln(1 − R²), which falls from 1 to 0.
    let quotient = |share: f64| share / -(-share).ln_1p();
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..SEARCH.share_bisections {
        let share = 0.5 * (low + high);
        if quotient(share) * ratio > score { low = share } else { high = share }
    }
    let share = 0.5 * (low + high);
    p_of_share(share, dimensions, score / share, inflation)
}

/// p-value of a χ² variable.
pub(crate) fn p_of_chi_square(statistic: f64, freedom: f64) -> f64 {
    ChiSquared::new(freedom.max(1.0)).map_or(1.0, |chi| chi.sf(statistic.max(0.0)))
}

/// p-value of independent scores that differ so much, each with its variance. Σ u² is a weighted sum of χ²
/// variables, approximated by one χ² of the same mean and variance (Satterthwaite 1946); 1 of fewer than
/// three scores.
pub(crate) fn p_of_differing_scores(scores: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (mut squares, mut mean, mut spread, mut count) = (0.0, 0.0, 0.0, 0);
    for (score, variance) in scores {
        squares += score * score;
        mean += variance;
        spread += variance * variance;
        count += 1;
    }
    if count < 3 || mean <= 0.0 {
        return 1.0;
    }
    p_of_chi_square(squares * mean / spread, mean * mean / spread)
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
    StudentsT::new(0.0, 1.0, freedom.clamp(1.0, LEVELS.max_student_freedom))
        .map_or(f64::INFINITY, |student| student.inverse_cdf(0.975))
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
    fn scores_that_differ_are_judged_by_their_own_variances() {
        let p = |scores: &[(f64, f64)]| p_of_differing_scores(scores.iter().copied());
        // Of one variance v, Σ u²/v is χ² of as many: 12/2 of three. Rejects squares that are not over it.
        assert!((p(&[(2.0, 2.0); 3]) - p_of_chi_square(6.0, 3.0)).abs() < 1e-15);
        // Variances 4, 1, 1: mean 6, spread 18, Σ u² = 18: χ² of 36/18 with 18 · 6/18.
        assert!((p(&[(4.0, 4.0), (1.0, 1.0), (1.0, 1.0)]) - p_of_chi_square(6.0, 2.0)).abs() < 1e-15);
        // Two scores do not differ from each other by a scatter of their own.
        assert_eq!((p(&[(9.0, 1.0); 2]), p(&[(0.0, 0.0); 3])), (1.0, 1.0));
    }

    #[test]
    fn regress_the_quantile_of_many_degrees_of_freedom_is_the_normal_one() {
        // Ten: 2.228139. Rejects the normal quantile for all.
        assert!((student_95(10.0) - 2.228_139).abs() < 1e-6);
        // The library's own gave 1.83 at 10⁷, and did not return at 10⁹.
        for freedom in [1e6, 1e7, 1e9] {
            assert!((student_95(freedom) - 1.959_964).abs() < 3e-5, "{freedom}: {}", student_95(freedom));
        }
    }

    /// Ten values of which a regression explains the share 0.8: score 8, ratio −10 ln 0.2 = 16.09, and F of
    /// one and nine degrees of freedom 9 · 0.8/0.2 = 36, which is t = 6 of nine.
    #[test]
    fn a_score_and_a_likelihood_ratio_say_how_many_values_there_are() {
        let found = p_of_ratio(8.0, -10.0 * 0.2_f64.ln(), 1, 1.0);
        assert!((found / p_of_student(6.0, 9.0) - 1.0).abs() < 1e-5, "{found}");
        // Of F that is inflated fourfold a quarter counts, t = 3, of as many values. Rejects a score and a
        // ratio that are both divided, as if fewer values had been there.
        let inflated = p_of_ratio(8.0, -10.0 * 0.2_f64.ln(), 1, 4.0);
        assert!((inflated / p_of_student(3.0, 9.0) - 1.0).abs() < 1e-5, "{inflated}");
        // Between χ² of the ratio and χ² of the score.
        assert!(found > p_of_chi_square(16.09, 1.0) && found < p_of_chi_square(8.0, 1.0), "{found}");
        // Of very many values both are χ². Rejects a share that is found to a thousandth.
        let many = p_of_ratio(20.0, -1e5 * (1.0 - 2e-4_f64).ln(), 1, 1.0);
        assert!((many / p_of_chi_square(20.0, 1.0) - 1.0).abs() < 1e-2, "{many}");
        // A ratio that is no larger than the score is χ² by itself.
        assert_eq!(p_of_ratio(8.0, 5.0, 2, 2.0), p_of_chi_square(2.5, 2.0));
        assert_eq!((p_of_ratio(8.0, 5.0, 0, 1.0), p_of_ratio(f64::NAN, 5.0, 1, 1.0)), (1.0, 1.0));
    }

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

    fn is_near(found: f64, expected: f64) -> bool {
        (found - expected).abs() < 1e-6 * expected.abs()
    }

    #[test]
    fn a_score_of_few_observations_has_the_tail_of_the_regression_that_it_is() {
        // 5 of 10 explained, 6 − 1 values left: F = 5 · 0.5/0.5 = 5, or t = √5 with five degrees of freedom,
        // of which both tails are 1/2 − 4/(3π). Rejects the χ² of 5, and a count in the place of what is
        // left.
        let expected = 0.5 - 4.0 / (3.0 * std::f64::consts::PI);
        assert!(is_near(p_of_score(5.0, 1, 10.0, 6.0), expected));
        assert!(is_near(p_of_statistic(5.0, 1, 5.0), expected));
        // Two dimensions share the statistic: F of 2 and 2 at 3 has the tail 1/(1 + 3).
        assert!(is_near(p_of_statistic(6.0, 2, 2.0), 0.25));
        // As large as the count it may not be, but for roundings: the least of probabilities.
        assert!(p_of_score(10.0, 1, 10.0, 6.0) < 1e-15 && p_of_score(20.0, 1, 10.0, 6.0) < 1e-15);
        assert!(is_near(p_of_score(-5.0, 1, 10.0, 6.0), 1.0));
    }

    #[test]
    fn what_is_no_test_has_the_probability_one() {
        for p in [
            p_of_statistic(5.0, 0, 5.0),
            p_of_statistic(f64::NAN, 1, 5.0),
            p_of_statistic(-1.0, 1, 5.0),
            p_of_score(5.0, 0, 10.0, 6.0),
            p_of_score(f64::NAN, 1, 10.0, 6.0),
            // One direction tested of 1.5 values leaves a half of one.
            p_of_score(5.0, 1, 10.0, 1.5),
            p_of_chi_square(-1.0, 2.0),
            p_of_student(f64::NAN, 3.0),
            p_of_upper_student(f64::NAN, 3.0),
        ] {
            assert_eq!(p, 1.0);
        }
        // Of two values one is left, which is enough: F of 1 and 1 at 1.
        assert!(is_near(p_of_score(5.0, 1, 10.0, 2.0), 0.5));
    }

    #[test]
    fn tails_of_students_and_of_chi_square_are_those_of_closed_forms() {
        // Cauchy's distribution at 1: a quarter above. Rejects tails of one side for two, and of −t for t.
        assert!(is_near(p_of_student(1.0, 1.0), 0.5) && is_near(p_of_student(-1.0, 1.0), 0.5));
        assert!(is_near(p_of_upper_student(1.0, 1.0), 0.25) && is_near(p_of_upper_student(-1.0, 1.0), 0.75));
        // No distribution has less than one degree of freedom.
        assert!(is_near(p_of_student(1.0, 0.0), 0.5) && is_near(p_of_upper_student(1.0, 0.0), 0.25));
        assert!(is_near(p_of_chi_square(3.0, 2.0), f64::exp(-1.5)));
        assert!(is_near(p_of_chi_square(3.841_459, 0.0), 0.05));
        // Tables of Student's distribution.
        assert!((student_95(1.0) - 12.706).abs() < 1e-3 && (student_95(0.0) - 12.706).abs() < 1e-3);
        assert!((student_95(2.0) - 4.3027).abs() < 1e-4 && (student_95(1000.0) - 1.9623).abs() < 1e-4);
    }

    #[test]
    fn quantiles_of_upper_tails_have_the_sign_of_their_side() {
        let upper = |z: f64| 0.5 * p_of_z(z);
        assert!((z_of_upper(upper(2.0)) - 2.0).abs() < 1e-6 && (z_of_upper(1.0 - upper(2.0)) + 2.0).abs() < 1e-6);
        assert!(z_of_upper(0.5).abs() < 1e-9);
        assert!(z_of_upper(0.0) > 30.0 && z_of_upper(1.0) < -6.0 && z_of_upper(1.0).is_finite());
        assert!(is_near(p_of_z(-1.959_964), 0.05) && z_of_p(0.0) > 30.0);
    }

    #[test]
    fn many_trials_make_anything_likely_and_the_last_of_holms_order_pays_for_itself_alone() {
        // 1 − 0.9³ = 0.271. Rejects 3 · 0.1.
        assert!(is_near(sidak(0.1, 3), 0.271) && sidak(1.0, 5) <= 1.0 && sidak(1.0, 5) > 0.999);
        // 0.02 · 3 is above 0.05 where 0.001 came before it: all after it pass too.
        assert_eq!(holm(&[0.001, 0.02, 0.02, 0.03], 0.05), [true, false, false, false]);
        assert_eq!(holm(&[0.05], 0.05), [true]);
    }
}
