//! Which effects the data show: forward selection over the catalogue with refits, and which other names would do as well.

use std::ops::Range;
use std::sync::Arc;

use effects::{Effect, effect_of_sizes};
use estimation::JointFit;
use estimation::total;
use estimation::{Column, Evidence, NoiseComponent};
use nalgebra::DVector;
use rayon::prelude::*;

use crate::candidate::{Choice, terms};
use crate::checks::CHECKS_LEVEL;
use crate::gain::gain;
use crate::scan::{Scored, log_weight, scan};
use crate::scatter::{TURNS_LEVEL, differs_from_run_to_run};
use crate::shape::fit_shape;
use crate::sizes::{RUNS_LEVEL, Test, examine, holds_over_runs, over_names, tests_of};
use crate::statistics::of_trials;
use crate::unlisted::UNLISTED_LEVEL;

/// Family-wise rate of false alarms of the scan over the catalogue: with the checks' and that of terms without a name, 5 %.
pub(crate) const SCAN_LEVEL: f64 = 0.05 - CHECKS_LEVEL - UNLISTED_LEVEL;
/// Most effects that are sought.
pub(crate) const MOST_EFFECTS: usize = 3;
/// A candidate that explains less than this share of what the best does, before any refit, is not its rival.
const RIVAL_SHARE: f64 = 0.5;
/// One that explains less by no more than this, or by this share of the best, may come near it: the log of its odds is off by half of it, and the refit may find that much again.
const NEAR: f64 = 12.0;
const NEAR_SHARE: f64 = 0.1;
/// Most candidates that are tried for the next effect: where the best is not confirmed, another may be.
const MOST_TRIED: usize = 3;
/// Odometry must drift more with a name by so many times what the 95 % interval reaches before the name is none: within one of it an effect that is there, and does
/// nothing to the drift, would be refused once in forty times.
const NAMES_DRIFT: f64 = 2.0;
/// Most rivals that are refitted, and most with those that may come near the best.
const MOST_RIVALS: usize = 6;
const MOST_NEAR: usize = 10;
/// Most further shapes of an effect that are tried where the best one's size is none that it can have.
const MOST_SHAPES: usize = 3;
/// Names within this of the best, in log chance of the data, cannot be told apart: one in twenty.
pub(crate) const LEAST_REACH: f64 = 3.0;
/// A hypothesis describes its effect to a tenth of its size or so, and errs by the square of that in what it explains.
pub(crate) const FORM_ERROR: f64 = 0.01;

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
fn weight(directions: &[(f64, f64)]) -> f64 {
    log_weight(&directions.iter().map(|(value, size)| (*value, size * size * value)).collect::<Vec<_>>())
}

/// Whether a choice's sizes make an effect that can be: a share that is lost is no gain.
fn is_physical(extended: &Extended<'_>, place: usize) -> bool {
    let choice = &extended.choices[place];
    let Choice::Effect { .. } = choice else { return true };
    let Some((test, _)) = examine(extended, place) else { return false };
    let scatters = |effect: Effect| scatters_enough(extended, effect.physical().scatter_of_contact_m());
    effect_of(choice, &test.sizes).is_some_and(scatters)
}

/// The effect that a choice is with some sizes, each with its standard deviation, if there can be one. What is within its error of nothing counts as nothing.
fn effect_of(choice: &Choice, sizes: &[(f64, f64)]) -> Option<Effect> {
    let parameters = choice.parameters();
    let fitted = parameters.iter().zip(sizes);
    let sizes: Vec<(&str, f64)> = fitted
        .map(|(parameter, (size, sigma))| (parameter.name, if size.abs() < IN_ERROR * sigma { 0.0 } else { *size }))
        .chain(choice.held())
        .collect();
    effect_of_sizes(choice.id(), &sizes).filter(|effect| effect.physical().check().is_ok())
}

/// A scatter of more than so many times a look's variance would be seen in the noise, though it be there in some looks only: a robot creeps or stands in a fourth of them at
/// least where its wheels are seen to stick. Of sticking wheels of the blind benchmark it is 2.7 at the most, of play in the wheels that is taken for it 6.8.
const SEEN_SCATTER: f64 = 4.0;

/// Whether the noise of a fit leaves room for what the contacts of both wheels scatter by.
fn scatters_enough(extended: &Extended<'_>, contact_m: f64) -> bool {
    let fit = &extended.fit;
    let variance = |of| fit.fit.noise.sigma(of).powi(2);
    let way_m = fit.records.way_between_looks_m(&fit.fit.model);
    let (wheel, separation_m) = (variance(NoiseComponent::Wheel) * way_m, fit.fit.model.separation_m);
    // Along, half of each wheel; in heading, their difference.
    let along = variance(NoiseComponent::LookPosition) + 0.5 * wheel;
    let heading = variance(NoiseComponent::LookHeading) + 2.0 * wheel / separation_m.powi(2);
    let of_both = contact_m * contact_m;
    (0.5 * of_both / along).max(2.0 * of_both / separation_m.powi(2) / heading) <= SEEN_SCATTER
}

/// A size within so many standard deviations of nothing may be nothing.
const IN_ERROR: f64 = 3.0;

/// One candidate of an effect: its best shape, with its chance after paying for all shapes.
#[derive(Debug, Clone)]
pub(crate) struct Entry {
    pub(crate) scored: Scored,
    pub(crate) p_value: f64,
    pub(crate) shapes: usize,
    /// Shapes that can be seen and that the scan gives a size that can be, with their statistics, that which explains most first.
    possible: Vec<(Choice, f64)>,
}

impl Entry {
    /// Those of them beside the best shape that explain enough.
    fn others(&self, least: f64) -> impl Iterator<Item = &Choice> {
        let is_other = move |(choice, statistic): &&(Choice, f64)| *choice != self.scored.choice && *statistic >= least;
        self.possible.iter().filter(is_other).map(|(choice, _)| choice)
    }
}

/// The best shape of every effect.
pub(crate) fn best_shapes(scored: &[Scored]) -> Vec<Entry> {
    let mut entries: Vec<Entry> = Vec::new();
    for scored in scored {
        let id = scored.choice.id();
        let known = entries.iter().position(|entry| entry.scored.choice.id() == id);
        let at = known.unwrap_or(entries.len());
        if known.is_none() {
            entries.push(Entry { p_value: scored.p_value, shapes: 0, scored: scored.clone(), possible: Vec::new() });
        }
        let entry = &mut entries[at];
        let best = &entry.scored;
        if scored.p_value < best.p_value || (scored.p_value == best.p_value && scored.statistic > best.statistic) {
            entry.scored = scored.clone();
        }
        // A shape that cannot be seen is no trial.
        if scored.dimensions > 0 {
            entry.shapes += 1;
            if scored.sizes.is_empty() || effect_of(&scored.choice, &scored.sizes).is_some() {
                entry.possible.push((scored.choice.clone(), scored.statistic));
            }
        }
    }
    for entry in &mut entries {
        entry.possible.sort_by(|a, b| b.1.total_cmp(&a.1));
        entry.p_value = of_trials(entry.scored.p_value, entry.shapes.max(1));
    }
    entries
}

/// How many effects of a scan can be seen at all, each a test: at least one.
#[allow(clippy::cast_precision_loss)] // dozens
pub(crate) fn tests_in(entries: &[Entry]) -> f64 {
    entries.iter().filter(|entry| entry.scored.dimensions > 0).count().max(1) as f64
}

/// A fit with effects.
#[derive(Debug, Clone)]
pub(crate) struct Extended<'a> {
    pub(crate) fit: JointFit<'a>,
    pub(crate) choices: Vec<Choice>,
}

impl<'a> Extended<'a> {
    /// A fit without any.
    pub(crate) fn alone(base: &JointFit<'a>) -> Self {
        Self { fit: base.clone(), choices: Vec::new() }
    }

    /// Which of the fit's sizes are a choice's.
    pub(crate) fn range(&self, place: usize) -> Range<usize> {
        let first = self.choices[..place].iter().map(|choice| choice.parameters().len()).sum();
        first..first + self.choices[place].parameters().len()
    }

    /// The indices of a choice's columns.
    pub(crate) fn columns(&self, place: usize) -> Vec<usize> {
        self.range(place).map(|k| Column::Term(k).index()).collect()
    }

    /// A model of all looks, without those that lie far off by it. `None` unless by it fewer do than by what was found without it, and what is left out as much as what is
    /// not is likelier by it, what its trials cost paid.
    pub(crate) fn closed_again(self, base: &JointFit<'a>, found: &Self, paid: f64) -> Option<Self> {
        let fit = self.fit.without_outliers(&mut terms(&self.choices)).ok()?;
        let model = Self { fit, ..self };
        let outliers = |model: &Self| model.fit.fit.pass.outliers.len();
        let (before, after) = (evidence(base, found), evidence(base, &model) - paid);
        (outliers(&model) < outliers(found) && after > before + reach(before)).then_some(model)
    }

    /// A choice's sizes.
    pub(crate) fn sizes(&self, place: usize) -> DVector<f64> {
        DVector::from_column_slice(&self.fit.fit.model.sizes[self.range(place)])
    }
}

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

/// What the search found.
#[derive(Debug, Clone)]
pub(crate) struct Found<'a> {
    pub(crate) model: Extended<'a>,
    /// For each choice of the model: its names with itself, most probable first.
    pub(crate) names: Vec<Vec<Name>>,
    /// For each choice, its test at the end, in the presence of the others.
    pub(crate) tests: Vec<Test>,
    /// By how much a choice's shape and the names beside it, not being known for certain, widen each of its sizes.
    wider: Vec<Vec<f64>>,
    /// The first scan, effect by effect.
    pub(crate) first_scan: Vec<Entry>,
    /// What was asked of the base.
    pub(crate) known: Known<'a>,
}

/// What has been asked of one base: scans of the catalogue's other effects beside models, and fits of models. Many are asked for again.
#[derive(Debug, Clone, Default)]
pub(crate) struct Known<'a> {
    scans: Vec<(Vec<Choice>, Vec<Scored>)>,
    fits: Vec<Arc<Extended<'a>>>,
}

impl<'a> Known<'a> {
    /// The scan beside a model: one made before, or a new one.
    pub(crate) fn beside(&mut self, model: &Extended<'_>, catalogue: &[Choice]) -> &[Scored] {
        let known = self.scans.iter().position(|(choices, _)| *choices == model.choices);
        let at = known.unwrap_or_else(|| {
            let is_chosen = |choice: &Choice| model.choices.iter().any(|chosen| chosen.id() == choice.id());
            let left: Vec<Choice> = catalogue.iter().filter(|choice| !is_chosen(choice)).cloned().collect();
            self.scans.push((model.choices.clone(), scan(&model.fit, &model.choices, &left)));
            self.scans.len() - 1
        });
        &self.scans[at].1
    }

    fn fit(&self, choices: &[Choice]) -> Option<&Extended<'a>> {
        self.fits.iter().map(Arc::as_ref).find(|model| model.choices == choices)
    }

    /// Models that each have a choice more than another at one place, without those that diverge.
    fn with_each(
        &mut self,
        base: &JointFit<'a>,
        without: &Extended<'a>,
        place: usize,
        added: &[Choice],
    ) -> Vec<Extended<'a>> {
        let with = |choice: &Choice| {
            let mut choices = without.choices.clone();
            choices.insert(place, choice.clone());
            self.fit(&choices).cloned().or_else(|| refit(base, without, choices))
        };
        let models: Vec<Extended<'a>> = added.par_iter().filter_map(with).collect();
        for model in &models {
            self.keep(model);
        }
        models
    }

    /// A model without one of its choices; the base where it has no other.
    fn without(&mut self, base: &JointFit<'a>, model: &Extended<'a>, place: usize) -> Option<Extended<'a>> {
        let fewer = self.fit(&others(model, place)).cloned().or_else(|| without(base, model, place))?;
        self.keep(&fewer);
        Some(fewer)
    }

    fn keep(&mut self, model: &Extended<'a>) {
        if self.fit(&model.choices).is_none() {
            self.fits.push(Arc::new(model.clone()));
        }
    }
}

/// −log likelihood of a fit over as many innovations as the fullest of those compared: a look that one fit takes for an outlier is charged as one.
pub(crate) fn cost(fit: &JointFit<'_>, count: f64) -> f64 {
    total(&fit.fit.pass.runs).map_or(f64::INFINITY, |sum| sum.cost() + left_out_cost(&sum, count))
}

/// What the innovations that are missing to a number of them cost: each lies as far off as an outlier does at least, and has a variance as the others have.
pub(crate) fn left_out_cost(evidence: &Evidence, count: f64) -> f64 {
    // Half of the χ² with three degrees of freedom at which a look is an outlier, a component.
    const OUTLIER: f64 = 0.5 * 25.9 / 3.0;
    (count - evidence.count).max(0.0) * (OUTLIER + 0.5 * evidence.log_det / evidence.count.max(1.0))
}

pub(crate) fn count(fit: &JointFit<'_>) -> f64 {
    fit.fit.pass.runs.iter().map(|run| run.count).sum()
}

/// A fit that takes a smaller share of the looks that another one takes has lost the robot.
const LEAST_FOLLOWED: f64 = 0.5;

/// The model with other choices, fitted from where it stands, and where steps stray from the base too: the likelier of the two. `None` when both diverge.
pub(crate) fn refit<'a>(base: &JointFit<'a>, from: &Extended<'a>, choices: Vec<Choice>) -> Option<Extended<'a>> {
    let mut sizes = Vec::new();
    for choice in &choices {
        let none = vec![0.0; choice.parameters().len()];
        let of_shape = from.choices.iter().position(|own| own == choice);
        let known = of_shape.or_else(|| from.choices.iter().position(|own| own.is_shape_of(choice)));
        let own = known.map(|place| from.sizes(place).as_slice().to_vec());
        sizes.extend(own.filter(|own| own.len() == none.len()).unwrap_or(none));
    }
    let follows = |fit: &JointFit<'_>| {
        fit.fit.model.sizes.iter().all(|size| size.is_finite()) && count(fit) > LEAST_FOLLOWED * count(&from.fit)
    };
    let near = from.fit.extended_from(sizes, &mut terms(&choices)).ok().filter(follows);
    let near = match near {
        Some(fit) if !fit.fit.strayed => return Some(Extended { fit, choices }),
        near => near,
    };
    let anew = base.extended(&mut terms(&choices)).ok().filter(follows);
    let most = [&near, &anew].into_iter().flatten().map(count).fold(0.0, f64::max);
    let fit = near.into_iter().chain(anew).min_by(|a, b| cost(a, most).total_cmp(&cost(b, most)))?;
    Some(Extended { fit, choices })
}

/// A model's choices but one.
fn others(model: &Extended<'_>, place: usize) -> Vec<Choice> {
    let mut others = model.choices.clone();
    others.remove(place);
    others
}

/// A model without one of its choices; the base where it has no other. `None` when that diverges.
pub(crate) fn without<'a>(base: &JointFit<'a>, model: &Extended<'a>, place: usize) -> Option<Extended<'a>> {
    let others = others(model, place);
    if others.is_empty() { Some(Extended::alone(base)) } else { refit(base, model, others) }
}

/// The rivals of one place in a model whose other choices stay, each refitted: the best shape of each effect that explains enough, most probable first.
fn rivals<'a>(
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

/// The best of a scan, refitted, if that confirms it; else its name.
fn confirmed<'a>(
    (base, known): (&JointFit<'a>, &mut Known<'a>),
    model: &Extended<'a>,
    entries: &[Entry],
    (best, tests): (&Entry, f64),
    level: f64,
) -> Result<Extended<'a>, &'static str> {
    let place = model.choices.len();
    let mut found = rivals((base, known), model, place, entries, best.scored.statistic);
    if found.first().is_none_or(|(name, _)| name.log_odds <= 0.0) {
        return Err(best.scored.choice.id());
    }
    let (name, extended) = found.swap_remove(0);
    // A size that the refit does not confirm was an accident of the score.
    let is_an_accident = examine(&extended, place).is_none_or(|(test, _)| test.p_value * tests > level);
    // Nor is one of a few runs a size: what differs from run to run is none. Where turns scatter from run to run still, what goes with turns stands out by chance:
    // it must hold over the runs as if looks said nothing.
    let scattered = differs_from_run_to_run(&extended) < TURNS_LEVEL;
    let over_runs = if scattered { level / tests } else { RUNS_LEVEL };
    if is_an_accident || !holds_over_runs(&extended, place, over_runs) {
        return Err(name.choice.id());
    }
    Ok(extended)
}

/// The model with one effect more, if the scan finds one.
fn grown<'a>(
    (base, known): (&JointFit<'a>, &mut Known<'a>),
    model: &Extended<'a>,
    mut entries: Vec<Entry>,
    level: f64,
) -> Option<Extended<'a>> {
    let tests = tests_in(&entries);
    for _ in 0..MOST_TRIED {
        let best = entries
            .iter()
            .min_by(|a, b| a.p_value.total_cmp(&b.p_value).then(b.scored.statistic.total_cmp(&a.scored.statistic)))?;
        if best.p_value * tests > level {
            return None;
        }
        match confirmed((base, &mut *known), model, &entries, (best, tests), level) {
            Ok(grown) => return Some(grown),
            // What comes next may be what is there.
            Err(id) => entries.retain(|entry| entry.scored.choice.id() != id),
        }
    }
    None
}

/// Adds effects while the scan finds some, then asks of each whether it is needed beside the others, and what else it may be.
/// `known` is what has been asked of the same base before.
pub(crate) fn search<'a>(base: &JointFit<'a>, catalogue: &[Choice], level: f64, mut known: Known<'a>) -> Found<'a> {
    let mut model = Extended::alone(base);
    let mut first_scan = Vec::new();
    let mut names: Vec<Vec<Name>> = Vec::new();
    let mut beside = Vec::new();
    while model.choices.len() < MOST_EFFECTS {
        let entries = best_shapes(known.beside(&model, catalogue));
        if model.choices.is_empty() {
            first_scan.clone_from(&entries);
        }
        let Some(extended) = grown((base, &mut known), &model, entries, level) else { break };
        model = extended;
    }
    let mut place = 0;
    while place < model.choices.len() {
        let Some(without) = known.without(base, &model, place) else { break };
        let entries = best_shapes(known.beside(&without, catalogue));
        let best = entries.iter().map(|entry| entry.scored.statistic).fold(0.0, f64::max);
        let mut found = rivals((base, &mut known), &without, place, &entries, best);
        if found.first().is_none_or(|(name, _)| name.log_odds <= 0.0) {
            // Another one took over what this one stood for, or beside the others it is none that can be.
            model = without;
            continue;
        }
        let shapes =
            |id| entries.iter().find(|entry| entry.scored.choice.id() == id).map_or(1, |entry| entry.shapes.max(1));
        let tests = tests_in(&entries);
        let stands = |(name, extended): &(Name, Extended<'_>)| {
            examine(extended, place)
                .is_some_and(|(test, _)| of_trials(test.p_value, shapes(name.choice.id())) * tests <= level)
        };
        // A term that predicts unseen runs worse than none, or with which odometry drifts more for certain, is none. It is asked beside the others: alone, a part of
        // what is there may predict worse.
        let predicts = gain(&without, &found[0].1).map_or(true, |gain| {
            let score = gain.log_score_per_observation;
            score.low + score.high > 0.0 && !gain.drifts_more_by(NAMES_DRIFT)
        });
        if !predicts || !found.iter().any(stands) {
            // Nor does a name that came in its place.
            model = without;
            continue;
        }
        let (top, most) = (found[0].0.log_odds, found.iter().map(|(name, _)| name.explains).fold(f64::MIN, f64::max));
        // Neither what is plausible nor the prior of sizes may silence a name that explains as much.
        found.retain(|(name, _)| name.log_odds > top - reach(top) || name.explains > most - reach(most));
        names.push(found.iter().map(|(name, _)| name.clone()).collect());
        beside.extend(over_names(place, &found));
        model = found.swap_remove(0).1;
        place += 1;
    }
    let choices = model.choices.clone();
    let mut wider: Vec<Vec<f64>> = (0..choices.len()).map(|place| fit_shape(base, &mut model, place)).collect();
    for (choice, variances) in beside {
        if let Some(place) = choices.iter().position(|own| *own == choice) {
            wider[place].iter_mut().zip(variances).for_each(|(wider, variance)| *wider = wider.hypot(variance.sqrt()));
        }
    }
    // What stood for a shape that was not met is not needed any more.
    let tests = tests_in(&first_scan);
    for place in (0..names.len()).rev() {
        if examine(&model, place).is_some_and(|(test, _)| test.p_value * tests <= level) {
            continue;
        }
        if let Some(without) = known.without(base, &model, place) {
            model = without;
            names.remove(place);
            wider.remove(place);
        }
    }
    Found { tests: tests_of(&model, &wider), model, names, wider, first_scan, known }
}

/// What a search among all looks finds, those too that lie far off by the model that was found: a large effect that shows in few looks makes them lie far off, and among
/// the others it is not seen.
pub(crate) fn search_every_look<'a>(base: &JointFit<'a>, found: &Found<'a>, catalogue: &[Choice]) -> Option<Found<'a>> {
    let open = base.with_every_look().ok()?;
    let bold = search(&open, catalogue, SCAN_LEVEL, Known::default());
    if bold.model.choices.is_empty() {
        return None;
    }
    let model = bold.model.closed_again(base, &found.model, 0.0)?;
    let tests = tests_of(&model, &bold.wider);
    let trials = tests_in(&bold.first_scan);
    let stands = tests.iter().all(|test| test.p_value * trials <= SCAN_LEVEL);
    let predicts = gain(&Extended::alone(base), &model).map_or(true, |gain| !gain.drifts_more_by(NAMES_DRIFT));
    (stands && predicts).then(|| Found {
        model,
        tests,
        first_scan: found.first_scan.clone(),
        known: found.known.clone(),
        ..bold
    })
}
