//! Models against each other: Bayes factors, odds of candidate causes, and how much worse one may be and still be possible.

use estimation::JointFit;

use crate::augmented_model::{Extended, cost, count};
use crate::candidate::terms;
use crate::scan::log_weight;
use crate::settings::{FORM_ERROR, LEAST_REACH};
use crate::wald::examine;

/// How much less likely than the best a name may make the data and still be told.
pub(crate) fn reach(best: f64) -> f64 {
    LEAST_REACH.max(FORM_ERROR * best)
}

/// The chance of what makes the data likely by `log_odds`, relative to that of what explains `best`. Where that is thousands, its form is not known well enough for the
/// last of them to count in full.
pub(crate) fn chance(log_odds: f64, best: f64) -> f64 {
    ((log_odds - best) * LEAST_REACH / reach(best)).exp()
}

/// Log of the chance of the data under a model over that under its base.
pub(crate) fn evidence(base: &JointFit<'_>, model: &Extended<'_>) -> f64 {
    let most = count(base).max(count(&model.fit));
    let weights = (0..model.choices.len()).filter_map(|choice| examine(model, choice)).map(|(_, own)| weight(&own));
    cost(base, most) - cost(&model.fit, most) + weights.sum::<f64>()
}

/// How well sizes agree with what is plausible, and what their freedom costs.
pub(crate) fn weight(directions: &[(f64, f64)]) -> f64 {
    log_weight(&directions.iter().map(|(value, size)| (*value, size * size * value)).collect::<Vec<_>>())
}

/// A model of all looks, without those that lie far off by it. `None` unless by it fewer do than by what was found without it, and what is left out as much as what is
/// not is likelier by it, what its trials cost paid.
pub(crate) fn closed_again<'a>(
    open: Extended<'a>,
    base: &JointFit<'a>,
    found: &Extended<'a>,
    paid: f64,
) -> Option<Extended<'a>> {
    let fit = open.fit.without_outliers(&mut terms(&open.choices)).ok()?;
    let model = Extended { fit, ..open };
    let outliers = |model: &Extended<'_>| model.fit.fit.pass.outliers.len();
    let (before, after) = (evidence(base, found), evidence(base, &model) - paid);
    (outliers(&model) < outliers(found) && after > before + reach(before)).then_some(model)
}
