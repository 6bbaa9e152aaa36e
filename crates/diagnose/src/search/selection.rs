//! Forward selection over the catalogue with refits, and the causes that the data do not discriminate.

use estimation::ModelFit;
use rules::Rule;

use crate::candidates::candidate::{Candidate, terms};
use crate::checks::run_to_run::differs_from_run_to_run;
use crate::fits::augmented_model::AugmentedModel;
use crate::fits::cancellation::effects_cancel;
use crate::fits::fit_cache::FitCache;
use crate::fits::likelihood_ratio::significant_once_refitted;
use crate::fits::model_comparison::{
    form_error_statistic, log_bayes_factor, log_odds_margin, log_odds_margin_of, margin_over_units,
    with_scaled_difference,
};
use crate::fits::profile::fit_variant;
use crate::fits::statistics::sidak;
use crate::fits::wald::{Test, cluster_robust_test, p_value_over, tests_of, wald_test};
use crate::gain::gain;
use crate::search::ranking::{Entry, best_variants, tests_in};
use crate::search::rivals::{Name, Refusal, Refusals, over_names, rivals};
use crate::settings::{LEVELS, SEARCH};

/// What the search found.
#[derive(Debug, Clone)]
pub(crate) struct SearchResult<'a> {
    pub(crate) model: AugmentedModel<'a>,
    /// For each candidate of the model: its possible causes, most probable first.
    pub(crate) names: Vec<Vec<Name>>,
    /// For each candidate, its test at the end, in the presence of the others.
    pub(crate) tests: Vec<Test>,
    /// For each candidate, the standard deviation that uncertain variants and causes add to each of its
    /// sizes.
    extra_sigma: Vec<Vec<f64>>,
    /// The first scan, effect by effect.
    pub(crate) first_scan: Vec<Entry>,
    /// Why significant candidates are not in the model.
    pub(crate) refusals: Refusals,
    /// Cache of the scans and fits on the base.
    pub(crate) known: FitCache<'a>,
}

impl<'a> SearchResult<'a> {
    /// The same search where another explanation replaces its effects; `base` is the model without any.
    pub(crate) fn without_effects(self, base: AugmentedModel<'a>) -> Self {
        Self { model: base, names: Vec::new(), tests: Vec::new(), ..self }
    }
}

/// The model with one effect more: the best of a scan, refitted, if that confirms it, else the next.
fn grown<'a>(
    known: &mut FitCache<'a>,
    model: &AugmentedModel<'a>,
    mut entries: Vec<Entry>,
    level: f64,
    refusals: &mut Refusals,
) -> Option<AugmentedModel<'a>> {
    let (tests, index) = (tests_in(&entries), model.candidates.len());
    for _ in 0..SEARCH.max_candidates_tried {
        let best = most_significant(&entries, tests, level).or_else(|| {
            Rule::SignificantOnceRefitted.finds(significant_once_refitted(known, model, &entries, tests, level))
        })?;
        let (id, statistic) = (best.scored.candidate.id(), best.scored.statistic);
        let found = rivals(known, model, index, &entries, statistic, refusals);
        let refuted = match found.into_iter().next().filter(|(name, _)| name.log_odds > 0.0) {
            Some((name, extended)) => match confirm(known, model, &extended, index, tests, level) {
                Ok(()) => return Some(extended),
                Err(refusal) => {
                    refusals.insert(name.candidate.id(), refusal);
                    name.candidate.id()
                }
            },
            None => {
                refusals.entry(id).or_insert(Refusal::NotConfirmed);
                id
            }
        };
        // What comes next may be what is there.
        entries.retain(|entry| entry.scored.candidate.id() != refuted);
    }
    None
}

/// The rivals of an effect of the model by how much the best of a scan explains. Where none of those that
/// explain as much can be, by how much the best of the others does: what was taken in spite of the first
/// stays for that reason. Its cause is outdone then.
fn possible_rivals<'a>(
    known: &mut FitCache<'a>,
    without: &AugmentedModel<'a>,
    index: usize,
    entries: &[Entry],
    refusals: &mut Refusals,
) -> Vec<(Name, AugmentedModel<'a>)> {
    let mut open = entries.to_vec();
    loop {
        let best = open.iter().map(|entry| entry.scored.statistic).fold(0.0, f64::max);
        let mut found = rivals(known, without, index, &open, best, refusals);
        let left = open.len();
        if !found.is_empty() {
            found[0].0.outdone |= left < entries.len();
            return found;
        }
        open.retain(|entry| !refusals.get(entry.scored.candidate.id()).is_some_and(|refusal| refusal.is_impossible()));
        if !Rule::RivalsOfTheRest.applies(open.len() != left) {
            return found;
        }
    }
}

/// The model without the effects that only cancel each other: two that were found in the place of a third
/// stay significant beside it, each given the other, and two that no third stands for fit the driving that
/// was recorded by the difference of two large errors, and fail on any other. Of all subsets of the effects
/// that do not cancel each other, the smallest that the log Bayes factor does not discriminate from the best,
/// by more than what may be the error of its own effects' form.
fn without_what_cancels<'a>(
    known: &mut FitCache<'a>,
    model: AugmentedModel<'a>,
    refusals: &mut Refusals,
) -> AugmentedModel<'a> {
    let effects = model.candidates.len();
    if effects < 2 {
        return model;
    }
    let mut subsets: Vec<AugmentedModel<'a>> = (1..(1_u32 << effects) - 1)
        .filter_map(|chosen| {
            let is_chosen = |(index, _): &(usize, &Candidate)| chosen >> index & 1 == 1;
            let candidates: Vec<Candidate> =
                model.candidates.iter().enumerate().filter(is_chosen).map(|(_, candidate)| candidate.clone()).collect();
            known.refitted(&model, candidates)
        })
        .collect();
    let all: Vec<&'static str> = model.candidates.iter().map(Candidate::id).collect();
    subsets.retain(|subset| !Rule::Cancellation.applies(effects_cancel(subset)));
    let all_cancel = Rule::Cancellation.applies(effects_cancel(&model));
    // A single effect cancels nothing, but may have no fit of its own.
    if !all_cancel || subsets.is_empty() {
        subsets.push(model);
    }
    let odds: Vec<f64> = subsets.iter().map(|subset| log_bayes_factor(known.base(), subset)).collect();
    let best = odds.iter().copied().fold(f64::MIN, f64::max);
    // What more effects explain may be the error of form of those in the subset, and of no others.
    let is_close = |subset: usize| odds[subset] >= best - log_odds_margin_of(&subsets[subset]);
    let fewest = (0..subsets.len())
        .filter(|&subset| is_close(subset))
        .min_by(|&a, &b| {
            let sizes = subsets[a].candidates.len().cmp(&subsets[b].candidates.len());
            sizes.then(odds[b].total_cmp(&odds[a]))
        })
        .unwrap_or(subsets.len() - 1);
    let is_subset = subsets[fewest].candidates.len() < effects;
    let whole = subsets.iter().position(|subset| subset.candidates.len() == effects);
    let chosen = match whole {
        Some(whole) if !Rule::SmallestSubset.applies(is_subset) => subsets.swap_remove(whole),
        _ => subsets.swap_remove(fewest),
    };
    if all_cancel {
        let left: Vec<&'static str> = chosen.candidates.iter().map(Candidate::id).collect();
        refusals.extend(all.into_iter().filter(|id| !left.contains(id)).map(|id| (id, Refusal::Cancels)));
    }
    chosen
}

/// Whether a refit confirms what a score says of a candidate, or why not.
fn confirm(
    known: &mut FitCache<'_>,
    without: &AugmentedModel<'_>,
    extended: &AugmentedModel<'_>,
    index: usize,
    tests: f64,
    level: f64,
) -> Result<(), Refusal> {
    // A size that the refit does not confirm was an accident of the score.
    let confirms =
        |inflation: f64| p_value_over(extended, index, inflation).is_some_and(|p_value| p_value * tests <= level);
    // Coarse encoders make no size more significant.
    if Rule::RefitConfirms.applies(!confirms(1.0)) {
        return Err(Refusal::NotConfirmed);
    }
    if confirms(1.0) && Rule::Inflation.applies(!confirms(known.inflation_of(without, &extended.candidates[index]))) {
        return Err(Refusal::NotConfirmed);
    }
    // Nor is an effect of a few runs. Where turns scatter from run to run, everything correlated with turns
    // seems significant: it must be significant over the runs alone.
    let scattered = differs_from_run_to_run(extended) < LEVELS.turn_scatter_level;
    if Rule::OverRuns.applies(!cluster_robust_test(extended, index, LEVELS.cluster_robust_level)) {
        return Err(Refusal::NotOverRuns);
    }
    let fails_there = scattered && !cluster_robust_test(extended, index, level / tests);
    if Rule::OverScatteredRuns.applies(fails_there) { Err(Refusal::NotOverRuns) } else { Ok(()) }
}

/// The most significant effect of a scan, if it is significant at a family-wise level over so many tests
/// (Bonferroni: the smallest p-value is the first step of Holm's order). Where p-values are equal, as where
/// both are 0, the larger statistic.
fn most_significant(entries: &[Entry], tests: f64, level: f64) -> Option<&Entry> {
    let order = |a: &&Entry, b: &&Entry| {
        a.p_value.total_cmp(&b.p_value).then(b.scored.statistic.total_cmp(&a.scored.statistic))
    };
    entries.iter().min_by(order).filter(|best| best.p_value * tests <= level)
}

/// Which causes are not discriminated from the first, the most probable one: those within the margin of its
/// log odds, or, as neither the prior nor what is plausible may exclude a cause that explains as much, of
/// the most that any explains. Log odds and explained log likelihood of each.
fn is_not_discriminated(causes: &[(f64, f64)]) -> Vec<bool> {
    let top = causes.first().map_or(0.0, |(log_odds, _)| *log_odds);
    let most = causes.iter().map(|(_, explains)| *explains).fold(f64::MIN, f64::max);
    let is_close = |(log_odds, explains): &(f64, f64)| {
        *log_odds > top - log_odds_margin(top) || Rule::ExplainsAsMuch.applies(*explains > most - log_odds_margin(most))
    };
    causes.iter().map(is_close).collect()
}

/// What two delays differ by is of second order, and a few runs with large errors decide it: where runs
/// scatter by more than the margin, differences from the first cause count as shares of what they scatter by.
fn scale_differences_of_delays(causes: &mut [(Name, AugmentedModel<'_>)]) {
    let most = causes.iter().map(|(name, _)| name.explains).fold(f64::MIN, f64::max);
    let Some(((first, first_model), others)) = causes.split_first_mut() else { return };
    for (name, model) in others.iter_mut().filter(|(name, _)| name.candidate.is_delay() && first.candidate.is_delay()) {
        let scatter = margin_over_units(0.0, first_model, model);
        let odds = with_scaled_difference(name.log_odds, first.log_odds, scatter);
        if Rule::DelayScatter.applies(odds != name.log_odds) {
            (name.log_odds, name.explains) = (odds, with_scaled_difference(name.explains, most, scatter));
        }
    }
}

/// The standard deviation that uncertain variants and causes add to each size of each candidate; `beside` has
/// the variances over the causes of the others. Variants are fitted.
fn extra_sigma<'a>(
    base: &ModelFit<'a>,
    model: &mut AugmentedModel<'a>,
    beside: Vec<(Candidate, Vec<f64>)>,
) -> Vec<Vec<f64>> {
    let candidates = model.candidates.clone();
    let mut extra_sigma: Vec<Vec<f64>> = (0..candidates.len()).map(|index| fit_variant(base, model, index)).collect();
    for (candidate, variances) in beside {
        if let Some(index) = candidates.iter().position(|own| *own == candidate) {
            extra_sigma[index]
                .iter_mut()
                .zip(variances)
                .for_each(|(extra_sigma, variance)| *extra_sigma = extra_sigma.hypot(variance.sqrt()));
        }
    }
    extra_sigma
}

/// Adds effects while the scan finds some. Then tests whether each is needed beside the others, and finds
/// its possible causes.
pub(crate) fn search<'a>(mut known: FitCache<'a>, catalogue: &[Candidate], level: f64) -> SearchResult<'a> {
    let mut model = AugmentedModel::base(known.base());
    let mut refusals = Refusals::new();
    let mut first_scan = Vec::new();
    let mut names: Vec<Vec<Name>> = Vec::new();
    let mut beside = Vec::new();
    while model.candidates.len() < LEVELS.max_effects {
        let mut entries = best_variants(known.beside(&model, catalogue));
        if model.candidates.is_empty() {
            first_scan.clone_from(&entries);
        }
        // What is no more than the error of a larger effect's form is none beside it.
        let form_error = form_error_statistic(&model);
        entries.retain(|entry| entry.scored.statistic >= form_error || !Rule::FormErrorInScan.applies(true));
        let Some(extended) = grown(&mut known, &model, entries, level, &mut refusals) else { break };
        model = extended;
    }
    model = without_what_cancels(&mut known, model, &mut refusals);
    let mut index = 0;
    while index < model.candidates.len() {
        let Some(without) = known.without(&model, index) else { break };
        let entries = best_variants(known.beside(&without, catalogue));
        let mut found = possible_rivals(&mut known, &without, index, &entries, &mut refusals);
        if found.first().is_none_or(|(name, _)| name.log_odds <= 0.0) {
            // Another candidate explains it, or beside the others no physical one does.
            model = without;
            continue;
        }
        let variants = |id| {
            entries.iter().find(|entry| entry.scored.candidate.id() == id).map_or(1, |entry| entry.variants.max(1))
        };
        let tests = tests_in(&entries);
        let is_significant = |(name, extended): &(Name, AugmentedModel<'_>)| {
            p_value_over(extended, index, name.inflation)
                .is_some_and(|p_value| sidak(p_value, variants(name.candidate.id())) * tests <= level)
        };
        // A term that predicts held-out runs worse, or with which odometry drifts significantly more, is
        // refused. It is tested beside the others: alone, a part of a larger effect may predict worse.
        let refusal = gain(&without, &found[0].1).ok().and_then(|gain| {
            if Rule::PredictsWorse.applies(gain.predicts_worse()) {
                return Some(Refusal::PredictsWorse);
            }
            let drifts_more = Rule::DriftsMore.applies(gain.drifts_more_by(SEARCH.max_drift_increase_intervals));
            drifts_more.then_some(Refusal::DriftsMore)
        });
        // Where no cause that replaced it is significant either, it is not confirmed.
        let unconfirmed =
            || Rule::Unconfirmed.applies(!found.iter().any(is_significant)).then_some(Refusal::NotConfirmed);
        if let Some(refusal) = refusal.or_else(unconfirmed) {
            refusals.insert(found[0].0.candidate.id(), refusal);
            model = without;
            continue;
        }
        scale_differences_of_delays(&mut found);
        let odds: Vec<(f64, f64)> = found.iter().map(|(name, _)| (name.log_odds, name.explains)).collect();
        let mut kept = is_not_discriminated(&odds).into_iter();
        found.retain(|_| kept.next().unwrap_or(false));
        names.push(found.iter().map(|(name, _)| name.clone()).collect());
        if found.len() > 1 && Rule::SpreadOverCauses.applies(true) {
            beside.extend(over_names(index, &found));
        }
        model = found.swap_remove(0).1;
        index += 1;
    }
    let mut extra_sigma = extra_sigma(known.base(), &mut model, beside);
    // Candidates that stood in for a variant that is fitted now are not needed any more.
    let tests = tests_in(&first_scan);
    for index in (0..names.len()).rev() {
        let is_significant = wald_test(&model, index).is_some_and(|(test, _)| test.p_value * tests <= level);
        if !Rule::InsignificantAtTheEnd.applies(!is_significant) {
            continue;
        }
        if let Some(without) = known.without(&model, index) {
            model = without;
            names.remove(index);
            extra_sigma.remove(index);
        }
    }
    SearchResult { tests: tests_of(&model, &extra_sigma), model, names, extra_sigma, first_scan, refusals, known }
}

/// What a search without the outlier gate finds. A large effect that shows in few measurements makes them
/// outliers, and among the others it is not detected. It holds if with the gate on it rejects fewer
/// measurements than what was found, and is likelier by the margin.
pub(crate) fn search_ungated<'a>(found: &SearchResult<'a>, catalogue: &[Candidate]) -> Option<SearchResult<'a>> {
    let base = found.known.base();
    let bold = search(FitCache::of(&base.refit_ungated().ok()?), catalogue, LEVELS.scan_level);
    if bold.model.candidates.is_empty() {
        return None;
    }
    let candidates = bold.model.candidates;
    let model = AugmentedModel { fit: bold.model.fit.refit_gated(&mut terms(&candidates)).ok()?, candidates };
    let outliers = |model: &AugmentedModel<'_>| model.fit.solution.pass.outliers.len();
    let (before, after) = (log_bayes_factor(base, &found.model), log_bayes_factor(base, &model));
    let tests = tests_of(&model, &bold.extra_sigma);
    let trials = tests_in(&bold.first_scan);
    let holds = outliers(&model) < outliers(&found.model)
        && after > before + log_odds_margin(before)
        && tests.iter().all(|test| test.p_value * trials <= LEVELS.scan_level)
        && gain(&AugmentedModel::base(base), &model)
            .map_or(true, |gain| !gain.predicts_worse() && !gain.drifts_more_by(SEARCH.max_drift_increase_intervals));
    holds.then(|| SearchResult {
        model,
        tests,
        names: bold.names,
        extra_sigma: bold.extra_sigma,
        first_scan: found.first_scan.clone(),
        refusals: bold.refusals,
        known: found.known.clone(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::search::ranking::tests::scored;

    #[test]
    fn the_most_significant_effect_is_next_if_it_pays_for_all() {
        // χ² with one degree of freedom: 6.63 has p = 0.01, 3.84 has p = 0.05.
        let all = [scored("slip_speed", 3.84, 9.0, 1), scored("backlash", 6.635, 1.0, 1)];
        let entries = best_variants(&all);
        let next = |tests, level| most_significant(&entries, tests, level).map(|entry| entry.scored.candidate.id());
        // Two tests at 3 %: 0.01 · 2 ≤ 0.03. Rejects the most probable, which is not the most significant.
        assert_eq!(next(2.0, 0.03), Some("backlash"));
        // Four: 0.04 > 0.03. Rejects an uncorrected p-value.
        assert_eq!(next(4.0, 0.03), None);
        // Both underflow: the larger statistic. Rejects the first in the catalogue's order.
        let large = best_variants(&[scored("slip_speed", 5e3, 9.0, 1), scored("backlash", 6e3, 1.0, 1)]);
        assert_eq!(most_significant(&large, 2.0, 0.03).map(|entry| entry.scored.candidate.id()), Some("backlash"));
    }

    #[test]
    fn causes_within_the_margin_are_not_discriminated() {
        // Margin 3 below log odds of 300 and less. Rejects a margin of the best's share alone, 0.2.
        assert_eq!(is_not_discriminated(&[(20.0, 30.0), (17.1, 20.0), (16.9, 20.0)]), [true, true, false]);
        // 1 % of 1000. Rejects the margin of 3.
        assert_eq!(is_not_discriminated(&[(1000.0, 1010.0), (991.0, 0.0), (989.0, 0.0)]), [true, true, false]);
        // Far less probable, but it explains as much: its prior alone excludes it. Rejects the odds as the
        // only criterion.
        assert_eq!(is_not_discriminated(&[(20.0, 30.0), (5.0, 29.0)]), [true, true]);
    }
}
