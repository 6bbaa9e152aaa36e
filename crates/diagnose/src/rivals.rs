//! Rival models of one place: every effect that explains about as much, refitted, most probable first.

use estimation::JointFit;
use nalgebra::DVector;

use crate::augmented_model::{Extended, cost, count};
use crate::candidate::Choice;
use crate::fit_cache::Known;
use crate::model_comparison::{chance, reach, weight};
use crate::physical::is_physical;
use crate::ranking::Entry;
use crate::wald::examine;

/// A name for a finding.
#[derive(Debug, Clone)]
pub(crate) struct Name {
    pub(crate) choice: Choice,
    pub(crate) log_odds: f64,
    /// Log likelihood at its best, less what its freedom gains by chance: half of a χ² for each direction.
    pub(crate) explains: f64,
    /// Sizes that no effect can have explain more: something is there that looks like this one, and is none of the names.
    pub(crate) outdone: bool,
}

/// A candidate that explains less than this share of what the best does, before any refit, is not its rival.
const RIVAL_SHARE: f64 = 0.5;

/// One that explains less by no more than this, or by this share of the best, may come near it: the log of its odds is off by half of it, and the refit may find that much again.
const NEAR: f64 = 12.0;

const NEAR_SHARE: f64 = 0.1;

/// Most rivals that are refitted, and most with those that may come near the best.
const MOST_RIVALS: usize = 6;

const MOST_NEAR: usize = 10;

/// Most further shapes of an effect that are tried where the best one's size is none that it can have.
const MOST_SHAPES: usize = 3;

/// The rivals of one place in a model whose other choices stay, each refitted: the best shape of each effect that explains enough, most probable first.
pub(crate) fn rivals<'a>(
    (base, known): (&JointFit<'a>, &mut Known<'a>),
    without: &Extended<'a>,
    place: usize,
    entries: &[Entry],
    best: f64,
) -> Vec<(Name, Extended<'a>)> {
    let near = best - NEAR.max(NEAR_SHARE * best);
    let least = near.min(RIVAL_SHARE * best);
    let mut contenders: Vec<&Entry> =
        entries.iter().filter(|entry| entry.scored.dimensions > 0 && entry.scored.statistic >= least).collect();
    contenders.sort_by(|a, b| b.scored.log_odds.total_cmp(&a.scored.log_odds));
    let ranked = contenders.into_iter().enumerate();
    let mut contenders: Vec<&Entry> = ranked
        .filter(|(rank, entry)| *rank < MOST_RIVALS || entry.scored.statistic >= near)
        .map(|(_, entry)| entry)
        .take(MOST_NEAR)
        .collect();
    let best_shapes: Vec<Choice> = contenders.iter().map(|entry| entry.scored.choice.clone()).collect();
    let mut fits = known.with_each(base, without, place, &best_shapes);
    // With another shape, about as good, an effect may have a size that can be.
    let can_be = |fits: &[Extended<'_>], entry: &Entry| {
        let is_its = |extended: &&Extended<'_>| extended.choices[place].id() == entry.scored.choice.id();
        fits.iter().filter(is_its).any(|extended| is_physical(extended, place))
    };
    contenders.retain(|entry| entry.scored.statistic >= near && !can_be(&fits, entry));
    for shape in 0..MOST_SHAPES {
        let next: Vec<Choice> = contenders.iter().filter_map(|entry| entry.others(near).nth(shape)).cloned().collect();
        fits.extend(known.with_each(base, without, place, &next));
        contenders.retain(|entry| !can_be(&fits, entry));
    }
    let most = fits.iter().map(|extended| count(&extended.fit)).fold(count(&without.fit), f64::max);
    let base_cost = cost(&without.fit, most);
    let mut named: Vec<(Name, Extended<'a>)> = fits
        .into_iter()
        .map(|extended| {
            let choice = extended.choices[place].clone();
            let shapes = entries.iter().find(|entry| entry.scored.choice.id() == choice.id());
            #[allow(clippy::cast_precision_loss)]
            let trials = (shapes.map_or(1, |entry| entry.shapes.max(1)) as f64).ln();
            let likelier = base_cost - cost(&extended.fit, most);
            let directions = examine(&extended, place).map(|(_, directions)| directions);
            // Its likelihood times how well its sizes agree with what is plausible, the others staying.
            let log_odds =
                directions.as_ref().map_or(f64::NEG_INFINITY, |directions| likelier + weight(directions)) - trials;
            #[allow(clippy::cast_precision_loss)] // a handful
            let explains = likelier - 0.5 * directions.map_or(0, |directions| directions.len()) as f64;
            (Name { choice, log_odds, explains, outdone: false }, extended)
        })
        .collect();
    named.sort_by(|a, b| b.0.log_odds.total_cmp(&a.0.log_odds));
    // What no effect can be is no name; where it explains more than all that can, no name is right alone.
    let best = named.first().map_or(f64::NEG_INFINITY, |(name, _)| name.log_odds);
    named.retain(|(_, extended)| is_physical(extended, place));
    if let Some((name, _)) = named.first_mut() {
        name.outdone = best > name.log_odds + reach(name.log_odds);
    }
    named
}

/// Variances of sizes by what the choice beside them is not known to be: how far they go where it has another of its names, by the names' chances. For each other choice
/// of the likeliest model, its sizes in turn.
pub(crate) fn over_names(place: usize, names: &[(Name, Extended<'_>)]) -> Vec<(Choice, Vec<f64>)> {
    let Some((top, likeliest)) = names.first() else { return Vec::new() };
    let weights: Vec<f64> = names.iter().map(|(name, _)| chance(name.log_odds, top.log_odds)).collect();
    let all: f64 = weights.iter().sum();
    let variances = |other: usize| {
        let own = likeliest.sizes(other);
        let moved = |model: &Extended<'_>| (model.sizes(other) - &own).map(|by| by * by);
        let sum = names
            .iter()
            .zip(&weights)
            .fold(DVector::zeros(own.len()), |sum, ((_, model), weight)| sum + moved(model) * (weight / all));
        (likeliest.choices[other].clone(), sum.as_slice().to_vec())
    };
    (0..likeliest.choices.len()).filter(|other| *other != place).map(variances).collect()
}
