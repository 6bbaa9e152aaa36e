//! Significance by the likelihood of refits, where a score says too little.
//!
//! What an effect does to runs that nothing explains is taken for noise: where few turns say how turns
//! scatter, the noise of the fit without the effect hides most of it, and a score is judged by that noise.
//! A refit finds the noise again. By how much its likelihood ratio exceeds the score says from how many
//! values the noise was estimated, and both have an F distribution then: of n values with one unknown
//! variance, a regression that explains the share R² of their sum of squares has the score n R² and the
//! likelihood ratio −n ln(1 − R²).
//! Reference: Buse 1982 (score, likelihood ratio and Wald statistics in one regression).

use crate::fits::augmented_model::{AugmentedModel, cost, count};
use crate::fits::fit_cache::FitCache;
use crate::fits::statistics::{p_of_ratio, sidak};
use crate::fits::wald::wald_test;
use crate::search::ranking::Entry;
use crate::settings::SEARCH;

/// Of the entries whose score is not significant by itself, the one that is most significant once refitted,
/// if it is at a family-wise level over so many tests.
pub(crate) fn significant_once_refitted<'e, 'a>(
    known: &mut FitCache<'a>,
    model: &AugmentedModel<'a>,
    entries: &'e [Entry],
    tests: f64,
    level: f64,
) -> Option<&'e Entry> {
    let mut ranked: Vec<&Entry> = entries.iter().filter(|entry| entry.p_value <= SEARCH.refitted_level).collect();
    ranked.sort_by(|a, b| a.p_value.total_cmp(&b.p_value));
    ranked.truncate(SEARCH.max_refitted_by_score);
    let p_value_of = |entry: &'e Entry| {
        let mut candidates = model.candidates.clone();
        candidates.push(entry.scored.candidate.clone());
        let refitted = known.refitted(model, candidates)?;
        let p_value = p_value(known, model, &refitted, entry, level / tests)?;
        Some((entry, sidak(p_value, entry.variants.max(1))))
    };
    let tested = ranked.into_iter().filter_map(p_value_of);
    let (best, p_value) = tested.min_by(|a, b| a.1.total_cmp(&b.1))?;
    (p_value * tests <= level).then_some(best)
}

/// The p-value of an entry's refit beside the model without it. Coarse encoders are asked where it is
/// significant without them.
fn p_value(
    known: &mut FitCache<'_>,
    model: &AugmentedModel<'_>,
    refitted: &AugmentedModel<'_>,
    entry: &Entry,
    level: f64,
) -> Option<f64> {
    let scored = &entry.scored;
    let most = count(&model.fit).max(count(&refitted.fit));
    let (wald, _) = wald_test(refitted, model.candidates.len())?;
    // A ratio beyond Wald's statistic is of measurements that the gate took back.
    let ratio = (2.0 * (cost(&model.fit, most) - cost(&refitted.fit, most))).min(wald.statistic);
    let over = |inflation: f64| p_of_ratio(scored.statistic, ratio, scored.dimensions, inflation);
    let p_value = over(1.0);
    if p_value > level {
        return Some(p_value);
    }
    Some(over(known.inflation_of(model, &scored.candidate)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fits::scan::scan;
    use crate::search::ranking::{best_variants, tests_in};
    use crate::small_robot::{effect, fitted, session};

    /// Two runs of a robot that slips, whose noise is taken for several times what it is.
    #[test]
    fn what_noise_hides_from_a_score_shows_once_refitted() {
        let mut day = session(0, 0.02);
        day.runs.truncate(2);
        let days = [day];
        let base = fitted(&days);
        let model = AugmentedModel::base(&base);
        let mut known = FitCache::of(&base);
        let entries = best_variants(&scan(&base, &[], &[effect("slip_speed"), effect("thermal_drift")]));
        let (score, tests) = (entries[0].p_value, tests_in(&entries));
        // A level that the score misses by a factor of a hundred.
        let level = 0.01 * score * tests;
        let found = significant_once_refitted(&mut known, &model, &entries, tests, level);
        assert_eq!(found.map(|entry| entry.scored.candidate.id()), Some("slip_speed"));
        assert!(known.fit(&[effect("slip_speed")]).is_some(), "rivals take the refit from here");
        // Nothing is significant at any level: rejects a level that is not asked.
        let none = significant_once_refitted(&mut known, &model, &entries, tests, 1e-30);
        assert!(none.is_none());
        // Nor are entries refitted whose score says nothing at all.
        let mut dull = entries.clone();
        dull.iter_mut().for_each(|entry| entry.p_value = 0.02);
        assert!(significant_once_refitted(&mut known, &model, &dull, tests, 1.0).is_none());
    }
}
