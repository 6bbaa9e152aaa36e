//! Which effects the data show: forward selection over the catalogue with refits, and which other names would do as well.

use calib::methods::joint::JointFit;
use nalgebra::DVector;

use crate::candidate::{Choice, terms};
use crate::gain::gain;
use crate::scan::{Projection, Scored, inverse, log_weight, principal, scan, total};
use crate::scatter::{TURNS_LEVEL, differs_from_run_to_run};
use crate::shape::fit_shape;
use crate::statistics::{of_trials, p_of_statistic, p_of_student};

/// Family-wise rate of false alarms of the scan over the catalogue.
pub(crate) const SCAN_LEVEL: f64 = 0.02;
/// Most effects that are sought.
pub(crate) const MOST_EFFECTS: usize = 3;
/// A candidate that explains less than this share of what the best does, before any refit, is not its rival.
const RIVAL_SHARE: f64 = 0.5;
/// Most rivals that are refitted.
const MOST_RIVALS: usize = 6;
/// Names within this of the best, in log chance of the data, cannot be told apart: one in twenty.
pub(crate) const LEAST_REACH: f64 = 3.0;
/// A hypothesis describes its effect to a tenth of its size or so, and errs by the square of that in what it explains.
const FORM_ERROR: f64 = 0.01;

/// How much less likely than the best a name may make the data and still be told.
pub(crate) fn reach(best: f64) -> f64 {
    LEAST_REACH.max(FORM_ERROR * best)
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

/// Whether a choice's sizes make an effect that can be: a share that is lost is no gain. What is within its error of nothing counts as nothing.
fn is_physical(extended: &Extended<'_>, place: usize) -> bool {
    let Choice::Effect { id, .. } = &extended.choices[place] else { return true };
    let Some((test, _)) = examine(extended, place) else { return false };
    let choice = &extended.choices[place];
    let fitted = choice.parameters().iter().zip(&test.sizes);
    let sizes: Vec<(&str, f64)> = fitted
        .map(|(parameter, (size, sigma))| (parameter.name, if size.abs() < IN_ERROR * sigma { 0.0 } else { *size }))
        .chain(choice.held())
        .collect();
    effects::effect_of_sizes(id, &sizes).is_some_and(|effect| effect.physical().check().is_ok())
}

/// A size within so many standard deviations of nothing may be nothing.
const IN_ERROR: f64 = 3.0;

/// One candidate of an effect: its best shape, with its chance after paying for all shapes.
#[derive(Debug, Clone)]
pub(crate) struct Entry {
    pub(crate) scored: Scored,
    pub(crate) p_value: f64,
    pub(crate) shapes: usize,
}

/// The best shape of every effect.
pub(crate) fn best_shapes(scored: Vec<Scored>) -> Vec<Entry> {
    let mut entries: Vec<Entry> = Vec::new();
    for scored in scored {
        let id = scored.choice.id();
        // A shape that cannot be seen is no trial.
        let shown = usize::from(scored.dimensions > 0);
        match entries.iter_mut().find(|entry| entry.scored.choice.id() == id) {
            Some(entry) => {
                entry.shapes += shown;
                if scored.p_value < entry.scored.p_value
                    || (scored.p_value == entry.scored.p_value && scored.statistic > entry.scored.statistic)
                {
                    entry.scored = scored;
                }
            }
            None => entries.push(Entry { p_value: scored.p_value, shapes: shown, scored }),
        }
    }
    for entry in &mut entries {
        entry.p_value = of_trials(entry.scored.p_value, entry.shapes.max(1));
    }
    entries
}

/// A fit with effects.
#[derive(Debug, Clone)]
pub(crate) struct Extended<'a> {
    pub(crate) fit: JointFit<'a>,
    pub(crate) choices: Vec<Choice>,
}

/// A name for a finding.
#[derive(Debug, Clone)]
pub(crate) struct Name {
    pub(crate) choice: Choice,
    pub(crate) log_odds: f64,
    /// Log likelihood at its best, less what its freedom gains by chance, half of a χ² for each direction.
    pub(crate) explains: f64,
}

/// What the search found.
#[derive(Debug, Clone)]
pub(crate) struct Found<'a> {
    pub(crate) model: Extended<'a>,
    /// For each choice of the model: its names with itself, most probable first.
    pub(crate) names: Vec<Vec<Name>>,
    /// For each choice, its test at the end, in the presence of the others.
    pub(crate) tests: Vec<Test>,
    /// The first scan, effect by effect.
    pub(crate) first_scan: Vec<Entry>,
}

/// A test of one choice of a fitted model.
#[derive(Debug, Clone)]
pub(crate) struct Test {
    pub(crate) statistic: f64,
    pub(crate) p_value: f64,
    /// Value and standard deviation of each parameter.
    pub(crate) sizes: Vec<(f64, f64)>,
}

/// −log likelihood of a fit over as many innovations as the fullest of those compared: a look that one fit takes for an outlier is charged as one.
pub(crate) fn cost(fit: &JointFit<'_>, count: f64) -> f64 {
    let Some(sum) = total(&fit.fit.pass.runs) else { return f64::INFINITY };
    // Half of the χ² with three degrees of freedom at which a look is an outlier, a component.
    const OUTLIER: f64 = 0.5 * 25.9 / 3.0;
    sum.cost() + (count - sum.count).max(0.0) * (OUTLIER + 0.5 * sum.log_det / sum.count.max(1.0))
}

pub(crate) fn count(fit: &JointFit<'_>) -> f64 {
    fit.fit.pass.runs.iter().map(|run| run.count).sum()
}

/// Log of the chance of the data under a fitted choice over that without it, the others staying: its likelihood times how well its sizes agree with what
/// is plausible.
pub(crate) fn log_odds(base_cost: f64, extended: &Extended<'_>, count: f64, choice: usize) -> f64 {
    let Some((_, directions)) = examine(extended, choice) else { return f64::NEG_INFINITY };
    base_cost - cost(&extended.fit, count) + weight(&directions)
}

/// The test of a choice in its fitted model, and along its principal directions in units of the plausible: information and size.
pub(crate) fn examine(extended: &Extended<'_>, choice: usize) -> Option<(Test, Vec<(f64, f64)>)> {
    let evidence = total(&extended.fit.fit.pass.runs)?;
    let parameters = extended.choices[choice].parameters();
    let first: usize = extended.choices[..choice].iter().map(|choice| choice.parameters().len()).sum();
    let own: Vec<usize> = (0..parameters.len()).map(|k| calib::likelihood::Column::Term(first + k).index()).collect();
    // The same fit with the choice's columns not counted among the free ones.
    let mut others = extended.fit.clone();
    others.columns.retain(|column| !own.contains(&column.index()));
    let projected = Projection::of(&others, &evidence)?.of_columns(&evidence, &own);
    let sizes = DVector::from_fn(parameters.len(), |k, _| extended.fit.fit.model.sizes[first + k]);
    let gradient = &projected.information * &sizes;
    let directions: Vec<(f64, f64)> = principal(&projected.information, &gradient, parameters)
        .into_iter()
        .filter(|(value, _)| *value >= 1.0)
        .map(|(value, gradient)| (value, gradient / value))
        .collect();
    let freedom = crate::scan::freedom(&extended.fit, &evidence);
    let shrink = freedom / evidence.count.max(1.0);
    let statistic = directions.iter().map(|(value, size)| shrink * value * size * size).sum();
    let covariance = inverse(&projected.information);
    let sigma = |k: usize| covariance.as_ref().map_or(f64::NAN, |covariance| (covariance[(k, k)] / shrink).sqrt());
    let test = Test {
        statistic,
        p_value: p_of_statistic(statistic, directions.len(), freedom),
        sizes: sizes.iter().enumerate().map(|(k, size)| (*size, sigma(k))).collect(),
    };
    Some((test, directions))
}

/// With fewer runs they do not say how a size differs between them.
const LEAST_RUNS: usize = 6;
/// Chance at which a size that is none passes for one over the runs, once it has passed over the looks.
const RUNS_LEVEL: f64 = 0.05;

/// Whether a choice's size stands out against its own scatter from run to run, along itself: runs err alike within themselves (a wheelbase that differs from motion to
/// motion, looks that resemble each other), and a likelihood that takes looks for independent believes them too much.
///
/// With u_r the score of run r, the other free columns taken out, the size θ has the variance I⁻¹ (Σ u_r u_rᵀ) I⁻¹ whatever is alike within runs. References: White 1982;
/// Liang & Zeger 1986.
pub(crate) fn holds_over_runs(extended: &Extended<'_>, choice: usize, level: f64) -> bool {
    let runs: Vec<_> = extended.fit.fit.pass.runs.iter().filter(|run| run.count > 0.0).collect();
    if runs.len() < LEAST_RUNS {
        return true;
    }
    let Some(evidence) = total(&extended.fit.fit.pass.runs) else { return false };
    let parameters = extended.choices[choice].parameters().len();
    let first: usize = extended.choices[..choice].iter().map(|choice| choice.parameters().len()).sum();
    let own: Vec<usize> = (0..parameters).map(|k| calib::likelihood::Column::Term(first + k).index()).collect();
    let mut others = extended.fit.clone();
    others.columns.retain(|column| !own.contains(&column.index()));
    let Some(projection) = Projection::of(&others, &evidence) else { return false };
    let information = projection.of_columns(&evidence, &own).information;
    let sizes = DVector::from_fn(parameters, |k, _| extended.fit.fit.model.sizes[first + k]);
    let stands = sizes.dot(&(&information * &sizes));
    #[allow(clippy::cast_precision_loss)]
    let n = runs.len() as f64;
    let squares: f64 = runs.iter().map(|run| projection.score_of(run, &evidence, &own).dot(&sizes).powi(2)).sum();
    let t = stands / (squares * n / (n - 1.0)).sqrt();
    t.is_nan() || p_of_student(t, n - 1.0) < level
}

/// Refits a model with its choices; `None` when that diverges.
pub(crate) fn refit<'a>(base: &JointFit<'a>, choices: Vec<Choice>) -> Option<Extended<'a>> {
    let mut all = terms(&choices);
    let fit = base.extended(&mut all).ok()?;
    fit.fit.model.sizes.iter().all(|size| size.is_finite()).then_some(Extended { fit, choices })
}

/// The rivals of one place in a model whose other choices stay, each refitted: the best shape of each effect that explains enough, most probable first.
fn rivals<'a>(
    base: &JointFit<'a>,
    without: &Extended<'a>,
    place: usize,
    entries: &[Entry],
    best: f64,
) -> Vec<(Name, Extended<'a>)> {
    let mut contenders: Vec<&Entry> = entries
        .iter()
        .filter(|entry| entry.scored.dimensions > 0 && entry.scored.statistic >= RIVAL_SHARE * best)
        .collect();
    contenders.sort_by(|a, b| b.scored.log_odds.total_cmp(&a.scored.log_odds));
    contenders.truncate(MOST_RIVALS);
    let fits: Vec<(Choice, Extended<'a>)> = contenders
        .into_iter()
        .filter_map(|entry| {
            let mut choices = without.choices.clone();
            choices.insert(place, entry.scored.choice.clone());
            let extended = refit(base, choices)?;
            is_physical(&extended, place).then(|| (entry.scored.choice.clone(), extended))
        })
        .collect();
    let most = fits.iter().map(|(_, extended)| count(&extended.fit)).fold(count(&without.fit), f64::max);
    let base_cost = cost(&without.fit, most);
    let mut named: Vec<(Name, Extended<'a>)> = fits
        .into_iter()
        .map(|(choice, extended)| {
            let shapes = entries.iter().find(|entry| entry.scored.choice.id() == choice.id());
            #[allow(clippy::cast_precision_loss)]
            let trials = (shapes.map_or(1, |entry| entry.shapes.max(1)) as f64).ln();
            let log_odds = log_odds(base_cost, &extended, most, place) - trials;
            let directions = examine(&extended, place).map_or(0, |(_, directions)| directions.len());
            #[allow(clippy::cast_precision_loss)] // a handful
            let explains = base_cost - cost(&extended.fit, most) - 0.5 * directions as f64;
            (Name { choice, log_odds, explains }, extended)
        })
        .collect();
    named.sort_by(|a, b| b.0.log_odds.total_cmp(&a.0.log_odds));
    named
}

/// Adds effects while the scan finds some.
pub(crate) fn search<'a>(base: &JointFit<'a>, catalogue: &[Choice]) -> Found<'a> {
    let mut model = Extended { fit: base.clone(), choices: Vec::new() };
    let mut first_scan = Vec::new();
    let mut names: Vec<Vec<Name>> = Vec::new();
    for round in 0..=MOST_EFFECTS {
        let left: Vec<Choice> = catalogue
            .iter()
            .filter(|choice| model.choices.iter().all(|chosen| chosen.id() != choice.id()))
            .cloned()
            .collect();
        let entries = best_shapes(scan(&model.fit, &model.choices, &left));
        if round == 0 {
            first_scan.clone_from(&entries);
        }
        if round == MOST_EFFECTS {
            break;
        }
        #[allow(clippy::cast_precision_loss)]
        let tests = entries.iter().filter(|entry| entry.scored.dimensions > 0).count().max(1) as f64;
        let Some(best) = entries
            .iter()
            .min_by(|a, b| a.p_value.total_cmp(&b.p_value).then(b.scored.statistic.total_cmp(&a.scored.statistic)))
        else {
            break;
        };
        if best.p_value * tests > SCAN_LEVEL {
            break;
        }
        let place = model.choices.len();
        let mut found = rivals(base, &model, place, &entries, best.scored.statistic);
        if found.is_empty() || found[0].0.log_odds <= 0.0 {
            break;
        }
        let (_, extended) = found.swap_remove(0);
        // A size that the refit does not confirm was an accident of the score.
        if examine(&extended, place).is_none_or(|(test, _)| test.p_value * tests > SCAN_LEVEL) {
            break;
        }
        // Nor an accident of a few runs: what differs from run to run is no size.
        // Where turns scatter from run to run still, what goes with turns stands out by chance: it must hold over the runs as if looks said nothing.
        let scattered = differs_from_run_to_run(&extended) < TURNS_LEVEL;
        let level = if scattered { SCAN_LEVEL / tests } else { RUNS_LEVEL };
        if !holds_over_runs(&extended, place, level) {
            break;
        }
        // Nor is a term that predicts unseen runs worse than none, or with which odometry drifts more for certain.
        if gain(&model, &extended).is_ok_and(|gain| {
            let score = gain.log_score_per_observation;
            score.low + score.high <= 0.0 || gain.drifts_more()
        }) {
            break;
        }
        model = extended;
    }
    names.clear();
    let mut place = 0;
    while place < model.choices.len() {
        let mut others = model.choices.clone();
        others.remove(place);
        let without = if others.is_empty() {
            Some(Extended { fit: base.clone(), choices: Vec::new() })
        } else {
            refit(base, others)
        };
        let Some(without) = without else { break };
        let left: Vec<Choice> = catalogue
            .iter()
            .filter(|choice| without.choices.iter().all(|chosen| chosen.id() != choice.id()))
            .cloned()
            .collect();
        let entries = best_shapes(scan(&without.fit, &without.choices, &left));
        let best = entries.iter().map(|entry| entry.scored.statistic).fold(0.0, f64::max);
        let mut found = rivals(base, &without, place, &entries, best);
        if found.is_empty() {
            break;
        }
        if found[0].0.log_odds <= 0.0 {
            // Another one took over what this one stood for.
            model = without;
            continue;
        }
        let shapes =
            |id| entries.iter().find(|entry| entry.scored.choice.id() == id).map_or(1, |entry| entry.shapes.max(1));
        #[allow(clippy::cast_precision_loss)]
        let tests = entries.iter().filter(|entry| entry.scored.dimensions > 0).count().max(1) as f64;
        let stands = |(name, extended): &(Name, Extended<'_>)| {
            examine(extended, place)
                .is_some_and(|(test, _)| of_trials(test.p_value, shapes(name.choice.id())) * tests <= SCAN_LEVEL)
        };
        if !found.iter().any(stands) {
            // Nor does a name that came in its place.
            model = without;
            continue;
        }
        let (top, most) = (found[0].0.log_odds, found.iter().map(|(name, _)| name.explains).fold(f64::MIN, f64::max));
        // Neither what is plausible nor the prior of sizes may silence a name that explains as much.
        let near = |name: &Name| name.log_odds > top - reach(top) || name.explains > most - reach(most);
        names.push(found.iter().filter(|(name, _)| near(name)).map(|(name, _)| name.clone()).collect());
        model = found.swap_remove(0).1;
        place += 1;
    }
    let mut wider: Vec<Vec<f64>> = (0..model.choices.len()).map(|place| fit_shape(base, &mut model, place)).collect();
    // What stood for a shape that was not met is not needed any more.
    #[allow(clippy::cast_precision_loss)]
    let tests = first_scan.iter().filter(|entry| entry.scored.dimensions > 0).count().max(1) as f64;
    for place in (0..names.len()).rev() {
        if examine(&model, place).is_some_and(|(test, _)| test.p_value * tests <= SCAN_LEVEL) {
            continue;
        }
        let mut others = model.choices.clone();
        others.remove(place);
        let alone = || Some(Extended { fit: base.clone(), choices: Vec::new() });
        if let Some(without) = if others.is_empty() { alone() } else { refit(base, others) } {
            model = without;
            names.remove(place);
            wider.remove(place);
        }
    }
    let test = |(choice, wider): (usize, &Vec<f64>)| {
        let (mut test, _) = examine(&model, choice)?;
        for ((_, sigma), wider) in test.sizes.iter_mut().zip(wider) {
            *sigma = sigma.hypot(*wider);
        }
        Some(test)
    };
    let tests = wider.iter().enumerate().filter_map(test).collect();
    Found { model, names, tests, first_scan }
}
