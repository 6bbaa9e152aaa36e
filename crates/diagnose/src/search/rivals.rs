//! Rival models of one candidate: every effect that explains about as much, refitted, most probable first.

use std::collections::BTreeMap;

use nalgebra::DVector;
use rules::Rule;
use serde::Serialize;

use crate::candidates::candidate::Candidate;
use crate::candidates::physical::{is_physical, is_plausible};
use crate::findings::geometry_deviations::keeps_wheels;
use crate::fits::augmented_model::{AugmentedModel, cost, count, refit, refit_each};
use crate::fits::fit_cache::FitCache;
use crate::fits::model_comparison::{log_odds_margin, occam_factor, relative_odds};
use crate::fits::wald::wald_test;
use crate::search::ranking::Entry;
use crate::settings::SEARCH;

/// Why a candidate whose score is significant is not in the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Refusal {
    /// Its estimates are those of no effect that can be.
    Unphysical,
    /// Its size is beyond what robots have.
    Implausible,
    /// With it the wheels are far from the stated ones, and without it they are not.
    OtherWheels,
    /// The refit does not confirm what the score says of it.
    NotConfirmed,
    /// It is not significant over the runs: a few of them have it.
    NotOverRuns,
    /// Held-out runs are predicted worse with it.
    PredictsWorse,
    /// Held-out runs drift more with it.
    DriftsMore,
    /// It and another one take each other back: each by itself would be a far larger error than both are.
    Cancels,
}

impl Refusal {
    /// Whether no robot is as its fit says.
    pub(crate) const fn is_impossible(self) -> bool {
        matches!(self, Self::Unphysical | Self::Implausible | Self::OtherWheels)
    }

    /// Whether it explains what all runs show together, and is refused for what it does to single ones.
    pub(crate) const fn is_for_other_runs(self) -> bool {
        matches!(self, Self::NotOverRuns | Self::PredictsWorse | Self::DriftsMore)
    }
}

/// The last refusal of each effect, by its id.
pub(crate) type Refusals = BTreeMap<&'static str, Refusal>;

/// A candidate cause of a finding.
#[derive(Debug, Clone)]
pub(crate) struct Name {
    pub(crate) candidate: Candidate,
    pub(crate) log_odds: f64,
    /// Log likelihood less its expected gain without the effect: half of a χ² for each direction.
    pub(crate) explains: f64,
    /// By how much coarse encoders inflate what it explains; 1 where formulas hold.
    pub(crate) inflation: f64,
    /// A model with unphysical sizes explains more: the cause resembles this one, and may be none of the
    /// candidates.
    pub(crate) outdone: bool,
}

/// The rivals of one candidate in a model whose others stay, each refitted: the best variant of each effect
/// that explains enough, most probable first.
pub(crate) fn rivals<'a>(
    known: &mut FitCache<'a>,
    without: &AugmentedModel<'a>,
    index: usize,
    entries: &[Entry],
    best: f64,
    refusals: &mut Refusals,
) -> Vec<(Name, AugmentedModel<'a>)> {
    let close = close_statistic(best);
    let mut contenders = contenders(entries, best);
    let best_variants: Vec<Candidate> = contenders.iter().map(|entry| entry.scored.candidate.clone()).collect();
    // Models that each have one of these candidates more, without those that diverge.
    let mut fit_each = |added: &[Candidate]| {
        let with = |candidate: &Candidate| {
            let mut candidates = without.candidates.clone();
            candidates.insert(index, candidate.clone());
            known.fit(&candidates).cloned().or_else(|| refit(known.base(), without, candidates))
        };
        let models = refit_each(added, with);
        models.iter().for_each(|model| known.keep(model));
        models
    };
    let mut fits = fit_each(&best_variants);
    let impossible = |extended: &AugmentedModel<'_>| {
        if Rule::Unphysical.applies(!is_physical(extended, index)) {
            return Some(Refusal::Unphysical);
        }
        if Rule::Implausible.applies(!is_plausible(extended, index)) {
            return Some(Refusal::Implausible);
        }
        Rule::OtherWheels.applies(!keeps_wheels(&without.fit, &extended.fit)).then_some(Refusal::OtherWheels)
    };
    let is_possible = |extended: &AugmentedModel<'_>| impossible(extended).is_none();
    // Another variant that explains about as much may have physical sizes.
    let can_be = |fits: &[AugmentedModel<'_>], entry: &Entry| {
        let is_its = |extended: &&AugmentedModel<'_>| extended.candidates[index].id() == entry.scored.candidate.id();
        fits.iter().filter(is_its).any(is_possible)
    };
    contenders.retain(|entry| entry.scored.statistic >= close && !can_be(&fits, entry));
    for variant in 0..SEARCH.max_further_variants {
        let next: Vec<Candidate> =
            contenders.iter().filter_map(|entry| entry.others(close).nth(variant)).cloned().collect();
        if Rule::FurtherVariants.finds(next.first()).is_none() {
            break;
        }
        fits.extend(fit_each(&next));
        contenders.retain(|entry| !can_be(&fits, entry));
    }
    let most = fits.iter().map(|extended| count(&extended.fit)).fold(count(&without.fit), f64::max);
    let base_cost = cost(&without.fit, most);
    // A likelihood that is no number says nothing for the candidate.
    let explained = |extended: &AugmentedModel<'_>| match base_cost - cost(&extended.fit, most) {
        likelier if likelier.is_nan() => f64::NEG_INFINITY,
        likelier => likelier,
    };
    // Causes are compared on the same data: what coarse encoders inflate of the one that explains most, they
    // inflate of all. By its own inflation each, one that explains less might come first. Log likelihoods of
    // dependent errors are as much too large (Pace, Salvan & Sartori 2011).
    let added: Vec<Candidate> = fits.iter().map(|extended| extended.candidates[index].clone()).collect();
    let of_each = known.inflation_of_each(without, &added);
    let of_best = fits.iter().zip(&of_each).max_by(|a, b| explained(a.0).total_cmp(&explained(b.0)));
    let common = of_best.map_or(1.0, |(_, inflation)| *inflation);
    let mut named: Vec<(Name, AugmentedModel<'a>)> = fits
        .into_iter()
        .zip(of_each)
        .map(|(extended, inflation)| {
            let candidate = extended.candidates[index].clone();
            let variants = entries.iter().find(|entry| entry.scored.candidate.id() == candidate.id());
            let trials = variants.map_or(1, |entry| entry.variants.max(1));
            let likelier = explained(&extended) / common;
            let directions = wald_test(&extended, index).map(|(_, directions)| directions);
            let (log_odds, explains) = odds_and_explained(likelier, directions.as_deref(), trials);
            (Name { candidate, log_odds, explains, inflation, outdone: false }, extended)
        })
        .collect();
    named.sort_by(|a, b| b.0.log_odds.total_cmp(&a.0.log_odds));
    // Unphysical candidates are no causes. Where one explains more than all others, the first of those is
    // doubted.
    let best = named.first().map_or(f64::NEG_INFINITY, |(name, _)| name.log_odds);
    named.retain(|(name, extended)| {
        let refusal = impossible(extended);
        refusals.extend(refusal.map(|refusal| (name.candidate.id(), refusal)));
        refusal.is_none()
    });
    if let Some((name, _)) = named.first_mut() {
        name.outdone = Rule::Outdone.applies(best > name.log_odds + log_odds_margin(name.log_odds));
    }
    named
}

/// The score statistic from which on a candidate is a close rival of the best.
fn close_statistic(best: f64) -> f64 {
    best - SEARCH.close_rival_statistic.max(SEARCH.close_rival_fraction * best)
}

/// The candidates that are refitted, by their scores: those that explain enough, most probable first, and
/// no more of them than are worth it; close rivals beyond that.
fn contenders(entries: &[Entry], best: f64) -> Vec<&Entry> {
    let close = close_statistic(best);
    let least = close.min(SEARCH.min_rival_statistic_ratio * best);
    let mut ranked: Vec<&Entry> =
        entries.iter().filter(|entry| entry.scored.dimensions > 0 && entry.scored.statistic >= least).collect();
    ranked.sort_by(|a, b| b.scored.log_odds.total_cmp(&a.scored.log_odds));
    let refitted = ranked.into_iter().enumerate();
    refitted
        .filter(|(rank, entry)| *rank < SEARCH.max_rivals || entry.scored.statistic >= close)
        .map(|(_, entry)| entry)
        .take(SEARCH.max_close_rivals)
        .collect()
}

/// Log odds of a candidate over none, and its log likelihood less what its freedom gains by accident: from
/// how much likelier it makes the data, its estimates along principal directions, and how many variants were
/// tried.
fn odds_and_explained(likelier: f64, directions: Option<&[(f64, f64)]>, trials: usize) -> (f64, f64) {
    let log_odds = directions.map_or(f64::NEG_INFINITY, |directions| likelier + occam_factor(directions));
    let explains = likelier - 0.5 * directions.map_or(0, <[_]>::len) as f64;
    (log_odds - (trials as f64).ln(), explains)
}

/// Variances of the other candidates' estimates over the causes of one candidate: how far they move if it has
/// another cause, weighed by the causes' odds. For each other candidate of the most probable model, its
/// estimates in turn.
pub(crate) fn over_names(index: usize, names: &[(Name, AugmentedModel<'_>)]) -> Vec<(Candidate, Vec<f64>)> {
    let Some((top, likeliest)) = names.first() else { return Vec::new() };
    let odds: Vec<f64> = names.iter().map(|(name, _)| relative_odds(name.log_odds, top.log_odds)).collect();
    let variances = |other: usize| {
        let estimates: Vec<DVector<f64>> = names.iter().map(|(_, model)| model.estimates(other)).collect();
        (likeliest.candidates[other].clone(), variances_between(&estimates, &odds).as_slice().to_vec())
    };
    (0..likeliest.candidates.len()).filter(|other| *other != index).map(variances).collect()
}

/// Mean squares of estimates about the first ones, weighed by the odds of the models that have them.
fn variances_between(estimates: &[DVector<f64>], odds: &[f64]) -> DVector<f64> {
    let all: f64 = odds.iter().sum();
    let moved = |own: &DVector<f64>| (own - &estimates[0]).map(|by| by * by);
    estimates
        .iter()
        .zip(odds)
        .fold(DVector::zeros(estimates[0].len()), |sum, (own, odds)| sum + moved(own) * (odds / all))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::search::ranking::best_variants;
    use crate::search::ranking::tests::scored;

    fn ids(entries: &[&Entry]) -> Vec<&'static str> {
        entries.iter().map(|entry| entry.scored.candidate.id()).collect()
    }

    #[test]
    fn contenders_explain_half_of_the_best_or_are_close_to_it() {
        // The best explains 100: half of it is 50; a close rival lacks 12 at the most. One without a
        // direction is none.
        let all = [
            scored("slip_speed", 100.0, 40.0, 1),
            scored("lateral_skid", 51.0, 20.0, 1),
            scored("carpet_nap", 49.0, 30.0, 1),
            scored("backlash", 90.0, 41.0, 1),
            scored("slope", 100.0, 50.0, 0),
        ];
        // Rejects an order by the statistic, which puts slip_speed first, and a limit at 12 below the best
        // for all.
        assert_eq!(ids(&contenders(&best_variants(&all), 100.0)), ["backlash", "slip_speed", "lateral_skid"]);
        // A weak best: 15 less 12 is 3, below half of it. Rejects half of the best as the only limit.
        let weak =
            [scored("slip_speed", 15.0, 4.0, 1), scored("backlash", 3.5, 1.0, 1), scored("carpet_nap", 2.5, 2.0, 1)];
        assert_eq!(ids(&contenders(&best_variants(&weak), 15.0)), ["slip_speed", "backlash"]);
    }

    #[test]
    fn odds_are_likelihood_less_freedom_and_trials() {
        // Two directions of no information cost nothing but what they explain: none at size 0. Four
        // variants cost ln 4.
        let (log_odds, explains) = odds_and_explained(10.0, Some(&[(0.0, 0.0), (0.0, 0.0)]), 4);
        assert!((log_odds - (10.0 - 4_f64.ln())).abs() < 1e-15);
        // Half of χ² with two degrees of freedom, on average. Rejects a whole one a direction, 8.
        assert_eq!(explains, 9.0);
        // What cannot be tested has no odds, whatever it explains.
        assert_eq!(odds_and_explained(10.0, None, 1), (f64::NEG_INFINITY, 10.0));
    }

    #[test]
    fn sizes_that_differ_between_causes_are_known_less_well() {
        // Odds 3 : 1, estimates (1, 0) and (3, 0): a quarter of (3 − 1)². Rejects a variance about the mean,
        // 3/4.
        let estimates = [[1.0, 0.0], [3.0, 0.0]].map(|size| DVector::from_column_slice(&size));
        assert_eq!(variances_between(&estimates, &[3.0, 1.0]).as_slice(), [1.0, 0.0]);
    }
}
