//! Models against each other: Bayes factors, odds of candidate causes, and how much worse one may be and still be possible.

use estimation::ModelFit;

use crate::augmented_model::{AugmentedModel, cost, count};
use crate::candidate::terms;
use crate::scan::log_occam_factor;
use crate::settings::levels::{MIN_LOG_ODDS_MARGIN, MODEL_MISMATCH_FRACTION};
use crate::wald::wald_test;

/// How much less likely than the best a name may make the data and still be told.
pub(crate) fn log_odds_margin(best: f64) -> f64 {
    MIN_LOG_ODDS_MARGIN.max(MODEL_MISMATCH_FRACTION * best)
}

/// The chance of what makes the data likely by `log_odds`, relative to that of what explains `best`. Where that is thousands, its form is not known well enough for the
/// last of them to count in full.
pub(crate) fn relative_odds(log_odds: f64, best: f64) -> f64 {
    ((log_odds - best) * MIN_LOG_ODDS_MARGIN / log_odds_margin(best)).exp()
}

/// Log of the chance of the data under a model over that under its base.
pub(crate) fn log_bayes_factor(base: &ModelFit<'_>, model: &AugmentedModel<'_>) -> f64 {
    let most = count(base).max(count(&model.fit));
    let weights = (0..model.candidates.len())
        .filter_map(|candidate| wald_test(model, candidate))
        .map(|(_, own)| occam_factor(&own));
    cost(base, most) - cost(&model.fit, most) + weights.sum::<f64>()
}

/// How well sizes agree with what is plausible, and what their freedom costs.
pub(crate) fn occam_factor(directions: &[(f64, f64)]) -> f64 {
    log_occam_factor(&directions.iter().map(|(value, size)| (*value, size * size * value)).collect::<Vec<_>>())
}

/// A model of all measurements, without those that lie far off by it. `None` unless by it fewer do than by what was found without it, and what is left out as much as what is
/// not is likelier by it, what its trials cost paid.
pub(crate) fn regated<'a>(
    open: AugmentedModel<'a>,
    base: &ModelFit<'a>,
    found: &AugmentedModel<'a>,
    log_trials: f64,
) -> Option<AugmentedModel<'a>> {
    let fit = open.fit.refit_gated(&mut terms(&open.candidates)).ok()?;
    let model = AugmentedModel { fit, ..open };
    let outliers = |model: &AugmentedModel<'_>| model.fit.fit.pass.outliers.len();
    let (before, after) = (log_bayes_factor(base, found), log_bayes_factor(base, &model) - log_trials);
    (outliers(&model) < outliers(found) && after > before + log_odds_margin(before)).then_some(model)
}
