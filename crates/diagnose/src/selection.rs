//! Which effects the data show: forward selection over the catalogue with refits, and which other names would do as well.

use estimation::JointFit;

use crate::augmented_model::Extended;
use crate::candidate::Choice;
use crate::fit_cache::Known;
use crate::gain::gain;
use crate::model_comparison::{closed_again, reach};
use crate::profile::fit_shape;
use crate::ranking::{Entry, best_shapes, tests_in};
use crate::rivals::{Name, over_names, rivals};
use crate::run_to_run::differs_from_run_to_run;
use crate::settings::{MOST_EFFECTS, RUNS_LEVEL, SCAN_LEVEL, TURNS_LEVEL};
use crate::statistics::of_trials;
use crate::wald::{Test, examine, holds_over_runs, tests_of};

/// Most candidates that are tried for the next effect: where the best is not confirmed, another may be.
const MOST_TRIED: usize = 3;
/// Odometry must drift more with a name by so many times what the 95 % interval reaches before the name is none: within one of it an effect that is there, and does
/// nothing to the drift, would be refused once in forty times.
const NAMES_DRIFT: f64 = 2.0;
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
    let model = closed_again(bold.model, base, &found.model, 0.0)?;
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
