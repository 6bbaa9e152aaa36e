//! A beam of models for experiments on their comparison (docs/one-model.md): effects and products that are
//! added to what a diagnosis compares, each model with what a posterior over all of them needs. Nothing
//! depends on it.

use std::slice::from_ref;

use estimation::{Column, ModelFit, NormalEquations, total};
use serde::Serialize;

use crate::candidates::candidate::{Candidate, terms};
use crate::candidates::physical::{is_physical, is_plausible};
use crate::findings::geometry_deviations::keeps_wheels;
use crate::fits::augmented_model::{AugmentedModel, refit, refit_each};
use crate::fits::cancellation::effects_cancel;
use crate::fits::fit_cache::FitCache;
use crate::fits::model_comparison::log_bayes_factor;
use crate::fits::profile::fit_variant;
use crate::search::mean_structure::MeanStructure;
use crate::search::ranking::{Entry, best_variants};
use crate::search::sparse_terms::SparseSearch;
use crate::settings::BEAM;

/// A model of the beam, or the calibrated model with scores by candidates whose sizes are 0.
#[derive(Debug, Clone, Serialize)]
pub struct ComparedModel {
    /// Its candidates: id and variant, or channel and factors.
    candidates: Vec<String>,
    /// How many sizes each has, and whether a robot can have them.
    parameters: Vec<(usize, bool)>,
    sizes: Vec<f64>,
    /// Name and prior scale of each size.
    scales: Vec<(&'static str, f64)>,
    /// Free columns of the normal equations, and directions of the first three that are not free.
    columns: (Vec<usize>, Vec<Vec<f64>>),
    /// Rows of their information, and the gradient.
    information: (Vec<f64>, Vec<f64>),
    /// Sum of squares, log determinant and number of innovations, and number of rejected measurements.
    likelihood: (f64, f64, f64, usize),
    /// Of each run, or block where runs are few.
    units: Vec<Unit>,
    /// Whether effects cancel each other, and whether wheels stay as stated.
    limits: (bool, bool),
    /// What a scan adds to it: candidate, directions, statistic, log odds, and inflation by coarse encoders.
    scanned: Vec<(String, usize, f64, f64, f64)>,
    /// How many products were tried to find its last candidate.
    trials: usize,
}

/// A run, or a block of one.
#[derive(Debug, Clone, Serialize)]
struct Unit {
    /// Session and run.
    of: (usize, usize),
    /// Number of innovations, and their cost.
    likelihood: (f64, f64),
    gradient: Vec<f64>,
    /// Information of each candidate along its sizes.
    along: Vec<f64>,
}

fn name(candidate: &Candidate) -> String {
    match candidate {
        Candidate::Effect { id, variant, at: None } => format!("{id}/{variant}"),
        Candidate::Effect { id, variant, at: Some(at) } => format!("{id}/{variant}/{at}"),
        Candidate::Sparse(sparse) => format!("*{} {}", sparse.channel.name(), sparse.names().join(" ")),
        Candidate::Deviation { .. } => "*".to_owned(),
    }
}

impl ComparedModel {
    /// A fitted model; `base` is that without candidates.
    fn of(base: &ModelFit<'_>, model: &AugmentedModel<'_>, trials: usize) -> Option<Self> {
        let AugmentedModel { fit, candidates } = model;
        let all = total(&fit.solution.pass.runs)?;
        let columns: Vec<usize> = fit.columns.iter().map(|column| column.index()).collect();
        let gradient = |of: &NormalEquations| of.gradient_of(&columns).as_slice().to_vec();
        let along = |of: &NormalEquations, index: usize| {
            let (at, sizes) = (model.columns(index), model.estimates(index));
            sizes.dot(&(of.block(&at, &at) * &sizes))
        };
        let of_unit = |of: &NormalEquations| Unit {
            of: of.run,
            likelihood: (of.count, of.cost()),
            gradient: gradient(of),
            along: (0..candidates.len()).map(|index| along(of, index)).collect(),
        };
        Some(Self {
            candidates: candidates.iter().map(name).collect(),
            parameters: (0..candidates.len()).map(|index| (model.range(index).len(), can_be(model, index))).collect(),
            sizes: fit.solution.model.term_values.clone(),
            scales: candidates.iter().flat_map(Candidate::parameters).map(|of| (of.name, of.prior_sigma)).collect(),
            information: (all.block(&columns, &columns).as_slice().to_vec(), gradient(&all)),
            likelihood: (all.chi_square, all.log_det, all.count, fit.solution.pass.outliers.len()),
            units: fit.units(&mut terms(candidates)).iter().map(of_unit).collect(),
            columns: (columns, fit.unobservable.iter().map(|of| of.as_slice().to_vec()).collect()),
            limits: (effects_cancel(model), keeps_wheels(base, fit)),
            scanned: Vec::new(),
            trials,
        })
    }
}

fn can_be(model: &AugmentedModel<'_>, index: usize) -> bool {
    is_physical(model, index) && is_plausible(model, index)
}

/// The calibrated model with scores by candidates whose sizes are 0.
fn with_scores<'a>(base: &ModelFit<'a>, candidates: Vec<Candidate>) -> AugmentedModel<'a> {
    let mut fit = base.clone();
    let sizes = candidates.iter().map(|candidate| candidate.parameters().len()).sum();
    fit.columns.extend((0..sizes).map(Column::Term));
    fit.solution.model.term_values = vec![0.0; sizes];
    fit.solution.pass.runs = base.scan(&mut terms(&candidates)).runs;
    AugmentedModel { fit, candidates }
}

/// Candidates of one entry: the best variant, and others that explain about as much.
fn variants(entry: &Entry) -> Vec<Candidate> {
    let others = entry.others(BEAM.min_other_variant_ratio * entry.scored.statistic).take(BEAM.max_other_variants);
    [&entry.scored.candidate].into_iter().chain(others).cloned().collect()
}

/// The beam on the base of a search, with the models that it ended with, and last the calibrated model's
/// scores by all that is refitted alone.
pub(crate) fn beam(structure: &MeanStructure<'_>, catalogue: &[Candidate]) -> Vec<ComparedModel> {
    let base = &structure.base;
    let mut known: FitCache<'_> = structure.found.known.clone();
    let none = AugmentedModel::base(base);
    let of = |model: &AugmentedModel<'_>| ComparedModel::of(base, model, 1);
    let (mut all, mut level, mut alone) = (Vec::new(), vec![none.clone()], Vec::new());
    for ((extended, most), profiled) in
        BEAM.models_extended.into_iter().zip(BEAM.refitted_beside).zip(BEAM.models_profiled)
    {
        let mut next: Vec<AugmentedModel<'_>> = Vec::new();
        for (rank, model) in level.iter().take(extended).enumerate() {
            let scored = known.beside(model, catalogue).to_vec();
            let mut entries = best_variants(&scored);
            entries.retain(|entry| entry.scored.dimensions > 0);
            entries.sort_by(|a, b| b.scored.log_odds.total_cmp(&a.scored.log_odds));
            let added: Vec<Candidate> = entries.iter().take(most).flat_map(variants).collect();
            let with = |added: &Candidate| {
                let candidates = [&model.candidates[..], from_ref(added)].concat();
                let of_both = |next: &&AugmentedModel<'_>| candidates.iter().all(|own| next.candidates.contains(own));
                next.iter().find(of_both).is_none().then_some(())?;
                known.fit(&candidates).cloned().or_else(|| refit(base, model, candidates))
            };
            let fits = refit_each(&added, with);
            next.extend(fits);
            if model.candidates.is_empty() {
                alone = added;
            }
            let inflation = known.inflation_of_each(&none, &alone);
            let scanned = scored.iter().filter(|of| of.dimensions > 0 || !of.resolved).map(|of| {
                let at = alone.iter().position(|own| *own == of.candidate);
                (name(&of.candidate), of.dimensions, of.statistic, of.log_odds, at.map_or(1.0, |at| inflation[at]))
            });
            all.extend(of(model).map(|of| ComparedModel { scanned: scanned.collect(), ..of }));
            if let Some(search) = SparseSearch::beside(1.0, base, model).filter(|_| rank == 0) {
                let (models, trials) = search.refitted();
                all.extend(models.iter().filter_map(|model| ComparedModel::of(base, model, trials)));
            }
        }
        all.extend(next.iter().filter_map(of));
        let is_possible = |of: &AugmentedModel<'_>| (0..of.candidates.len()).all(|index| can_be(of, index));
        next.retain(|of| is_possible(of) && keeps_wheels(base, &of.fit));
        next.sort_by(|a, b| log_bayes_factor(base, b).total_cmp(&log_bayes_factor(base, a)));
        // One variant of each set of effects is extended.
        let mut sets: Vec<Vec<&str>> = Vec::new();
        next.retain(|of| {
            let mut ids: Vec<&str> = of.candidates.iter().map(Candidate::id).collect();
            ids.sort_unstable();
            let is_first = !sets.contains(&ids);
            sets.push(ids);
            is_first
        });
        for model in next.iter_mut().take(profiled).filter(|model| log_bayes_factor(base, model) > 0.0) {
            (0..model.candidates.len()).for_each(|index| drop(fit_variant(base, model, index)));
            all.extend(of(model));
        }
        level = next;
    }
    let ended = [&structure.found.model, structure.model()];
    all.extend(ended.into_iter().chain(known.fits()).filter_map(of));
    all.extend(of(&with_scores(base, alone)));
    all
}
