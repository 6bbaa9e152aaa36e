//! Models against each other: Bayes factors, odds of candidate causes, and how much worse one may be and
//! still be possible.

use estimation::ModelFit;

use crate::candidates::candidate::terms;
use crate::fits::augmented_model::{AugmentedModel, cost, count};
use crate::fits::scan::log_occam_factor;
use crate::fits::wald::wald_test;
use crate::settings::LEVELS;

/// Largest difference in log odds from the best cause at which a cause is not discriminated.
pub(crate) fn log_odds_margin(best: f64) -> f64 {
    LEVELS.min_log_odds_margin.max(LEVELS.model_mismatch_fraction * best)
}

/// The same of two models whose log likelihoods differ from unit to unit, runs or blocks where these are
/// few: their sum over n units with the standard deviation s scatters by √n s (Vehtari & Lampinen 2002),
/// and a few units that one of them suits decide nothing.
pub(crate) fn margin_over_units(best: f64, one: &AugmentedModel<'_>, other: &AugmentedModel<'_>) -> f64 {
    let costs = |model: &AugmentedModel<'_>| -> Vec<((usize, usize), f64)> {
        let units = model.fit.units(&mut terms(&model.candidates));
        units.iter().map(|unit| (unit.run, unit.cost())).collect()
    };
    let (one, other) = (costs(one), costs(other));
    let are_paired = one.len() == other.len() && one.iter().zip(&other).all(|(one, other)| one.0 == other.0);
    let differences: Vec<f64> = one.iter().zip(&other).map(|((_, one), (_, other))| one - other).collect();
    let sigma = if are_paired { sigma_of_sum(&differences) } else { 0.0 };
    log_odds_margin(best).max(LEVELS.normal_quantile_one_sided_95 * sigma)
}

/// Standard error of the sum of independent values; 0 of a single one, which does not scatter.
fn sigma_of_sum(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    if values.len() > 1 { (count * squares / (count - 1.0)).sqrt() } else { 0.0 }
}

/// Odds of a cause over the best one. Where log odds are in the thousands, they are scaled down: the form
/// of a hypothesis is not known well enough for the last of them to count in full.
pub(crate) fn relative_odds(log_odds: f64, best: f64) -> f64 {
    odds_within(log_odds - best, log_odds_margin(best))
}

/// Odds for a difference of log odds of which so much is no difference.
pub(crate) fn odds_within(difference: f64, margin: f64) -> f64 {
    (difference * LEVELS.min_log_odds_margin / margin).exp()
}

/// Log odds whose difference from the best counts as a share of so much scatter, where that is more than the
/// margin: a difference of the scatter is one of the margin.
pub(crate) fn with_scaled_difference(log_odds: f64, best: f64, scatter: f64) -> f64 {
    best - (best - log_odds) * (log_odds_margin(best) / scatter).min(1.0)
}

/// Log Bayes factor of a model over its base.
pub(crate) fn log_bayes_factor(base: &ModelFit<'_>, model: &AugmentedModel<'_>) -> f64 {
    let count_of_both = count(base).max(count(&model.fit));
    let occam_factors = (0..model.candidates.len())
        .filter_map(|candidate| wald_test(model, candidate))
        .map(|(_, own)| occam_factor(&own));
    cost(base, count_of_both) - cost(&model.fit, count_of_both) + occam_factors.sum::<f64>()
}

/// The largest statistic that the error of form of the effects in a model may give to what is tested beside
/// them.
pub(crate) fn form_error_statistic(model: &AugmentedModel<'_>) -> f64 {
    let inexact = model.candidates.iter().enumerate().filter(|(_, candidate)| !candidate.has_exact_form());
    let statistics = inexact.filter_map(|(index, _)| wald_test(model, index)).map(|(test, _)| test.statistic);
    LEVELS.model_mismatch_fraction * statistics.fold(0.0, f64::max)
}

/// Difference in log odds from a model at which one of fewer effects is not discriminated from it.
pub(crate) fn log_odds_margin_of(model: &AugmentedModel<'_>) -> f64 {
    LEVELS.min_log_odds_margin.max(0.5 * form_error_statistic(model))
}

/// Log Occam factor: how well sizes agree with their prior, and what their freedom costs.
pub(crate) fn occam_factor(directions: &[(f64, f64)]) -> f64 {
    log_occam_factor(&directions.iter().map(|(value, size)| (*value, size * size * value)).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sum_over_units_scatters_as_they_do() {
        // Mean 2, variance (1 + 0 + 1)/2: √3. Rejects a mean's standard error, 1/√3.
        assert!((sigma_of_sum(&[1.0, 2.0, 3.0]) - 3_f64.sqrt()).abs() < 1e-12);
        assert_eq!(sigma_of_sum(&[5.0]), 0.0);
    }

    #[test]
    fn margins_and_odds_are_of_three_or_of_a_hundredth() {
        assert_eq!((log_odds_margin(100.0), log_odds_margin(-5.0)), (3.0, 3.0));
        assert!((log_odds_margin(1000.0) - 10.0).abs() < 1e-12);
        // A difference of one margin is one of three: e⁻³.
        assert!((odds_within(-6.0, 6.0) - (-3.0_f64).exp()).abs() < 1e-12);
        assert!((relative_odds(98.0, 100.0) - (-2.0_f64).exp()).abs() < 1e-12);
        // Of 1000 the margin is 10: 20 below it are e⁻⁶.
        assert!((relative_odds(980.0, 1000.0) - (-6.0_f64).exp()).abs() < 1e-12);
    }

    #[test]
    fn a_difference_of_the_scatter_is_one_of_the_margin() {
        // 24 below 1000, whose margin is 10, at a scatter of 24; half of it at 48. Rejects shares of 3.
        assert!((with_scaled_difference(976.0, 1000.0, 24.0) - 990.0).abs() < 1e-12);
        assert!((with_scaled_difference(976.0, 1000.0, 48.0) - 995.0).abs() < 1e-12);
        // Runs that scatter by less make no difference larger.
        assert_eq!(with_scaled_difference(976.0, 1000.0, 3.0), 976.0);
    }

    #[test]
    fn an_occam_factor_takes_what_directions_explain_from_their_sizes() {
        // Information 4 and size 3 explain 36. Rejects the size alone, or its square alone.
        assert_eq!(occam_factor(&[(4.0, 3.0)]), log_occam_factor(&[(4.0, 36.0)]));
        assert!(occam_factor(&[(4.0, 3.0)]) < occam_factor(&[(4.0, 1.0)]));
    }
}
