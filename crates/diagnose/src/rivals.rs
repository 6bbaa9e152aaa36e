//! Rival models of one place: every effect that explains about as much, refitted, most probable first.

use estimation::ModelFit;
use nalgebra::DVector;

use crate::augmented_model::{AugmentedModel, cost, count};
use crate::candidate::Candidate;
use crate::fit_cache::FitCache;
use crate::model_comparison::{log_odds_margin, occam_factor, relative_odds};
use crate::physical::is_physical;
use crate::ranking::Entry;
use crate::settings::search::{
    CLOSE_RIVAL_FRACTION, CLOSE_RIVAL_STATISTIC, MAX_CLOSE_RIVALS, MAX_FURTHER_VARIANTS, MAX_RIVALS,
    MIN_RIVAL_STATISTIC_RATIO,
};
use crate::wald::wald_test;

/// A name for a finding.
#[derive(Debug, Clone)]
pub(crate) struct Name {
    pub(crate) candidate: Candidate,
    pub(crate) log_odds: f64,
    /// Log likelihood at its best, less what its freedom gains by chance: half of a χ² for each direction.
    pub(crate) explains: f64,
    /// Sizes that no effect can have explain more: something is there that looks like this one, and is none of the names.
    pub(crate) outdone: bool,
}

/// The rivals of one place in a model whose other candidates stay, each refitted: the best variant of each effect that explains enough, most probable first.
pub(crate) fn rivals<'a>(
    (base, known): (&ModelFit<'a>, &mut FitCache<'a>),
    without: &AugmentedModel<'a>,
    index: usize,
    entries: &[Entry],
    best: f64,
) -> Vec<(Name, AugmentedModel<'a>)> {
    let near = best - CLOSE_RIVAL_STATISTIC.max(CLOSE_RIVAL_FRACTION * best);
    let least = near.min(MIN_RIVAL_STATISTIC_RATIO * best);
    let mut contenders: Vec<&Entry> =
        entries.iter().filter(|entry| entry.scored.dimensions > 0 && entry.scored.statistic >= least).collect();
    contenders.sort_by(|a, b| b.scored.log_odds.total_cmp(&a.scored.log_odds));
    let ranked = contenders.into_iter().enumerate();
    let mut contenders: Vec<&Entry> = ranked
        .filter(|(rank, entry)| *rank < MAX_RIVALS || entry.scored.statistic >= near)
        .map(|(_, entry)| entry)
        .take(MAX_CLOSE_RIVALS)
        .collect();
    let best_variants: Vec<Candidate> = contenders.iter().map(|entry| entry.scored.candidate.clone()).collect();
    let mut fits = known.with_each(base, without, index, &best_variants);
    // With another variant, about as good, an effect may have a size that can be.
    let can_be = |fits: &[AugmentedModel<'_>], entry: &Entry| {
        let is_its = |extended: &&AugmentedModel<'_>| extended.candidates[index].id() == entry.scored.candidate.id();
        fits.iter().filter(is_its).any(|extended| is_physical(extended, index))
    };
    contenders.retain(|entry| entry.scored.statistic >= near && !can_be(&fits, entry));
    for variant in 0..MAX_FURTHER_VARIANTS {
        let next: Vec<Candidate> =
            contenders.iter().filter_map(|entry| entry.others(near).nth(variant)).cloned().collect();
        fits.extend(known.with_each(base, without, index, &next));
        contenders.retain(|entry| !can_be(&fits, entry));
    }
    let most = fits.iter().map(|extended| count(&extended.fit)).fold(count(&without.fit), f64::max);
    let base_cost = cost(&without.fit, most);
    let mut named: Vec<(Name, AugmentedModel<'a>)> = fits
        .into_iter()
        .map(|extended| {
            let candidate = extended.candidates[index].clone();
            let variants = entries.iter().find(|entry| entry.scored.candidate.id() == candidate.id());
            let trials = (variants.map_or(1, |entry| entry.variants.max(1)) as f64).ln();
            let likelier = base_cost - cost(&extended.fit, most);
            let directions = wald_test(&extended, index).map(|(_, directions)| directions);
            // Its likelihood times how well its sizes agree with what is plausible, the others staying.
            let log_odds =
                directions.as_ref().map_or(f64::NEG_INFINITY, |directions| likelier + occam_factor(directions))
                    - trials;
            let explains = likelier - 0.5 * directions.map_or(0, |directions| directions.len()) as f64;
            (Name { candidate, log_odds, explains, outdone: false }, extended)
        })
        .collect();
    named.sort_by(|a, b| b.0.log_odds.total_cmp(&a.0.log_odds));
    // What no effect can be is no name; where it explains more than all that can, no name is right alone.
    let best = named.first().map_or(f64::NEG_INFINITY, |(name, _)| name.log_odds);
    named.retain(|(_, extended)| is_physical(extended, index));
    if let Some((name, _)) = named.first_mut() {
        name.outdone = best > name.log_odds + log_odds_margin(name.log_odds);
    }
    named
}

/// Variances of sizes by what the candidate beside them is not known to be: how far they go where it has another of its names, by the names' chances. For each other candidate
/// of the likeliest model, its sizes in turn.
pub(crate) fn over_names(index: usize, names: &[(Name, AugmentedModel<'_>)]) -> Vec<(Candidate, Vec<f64>)> {
    let Some((top, likeliest)) = names.first() else { return Vec::new() };
    let weights: Vec<f64> = names.iter().map(|(name, _)| relative_odds(name.log_odds, top.log_odds)).collect();
    let all: f64 = weights.iter().sum();
    let variances = |other: usize| {
        let own = likeliest.estimates(other);
        let moved = |model: &AugmentedModel<'_>| (model.estimates(other) - &own).map(|by| by * by);
        let sum = names.iter().zip(&weights).fold(DVector::zeros(own.len()), |sum, ((_, model), occam_factor)| {
            sum + moved(model) * (occam_factor / all)
        });
        (likeliest.candidates[other].clone(), sum.as_slice().to_vec())
    };
    (0..likeliest.candidates.len()).filter(|other| *other != index).map(variances).collect()
}
