//! A fit with candidate terms: the augmented model, its cost against that of others, and refits with other
//! terms.

use std::ops::Range;

use estimation::{Column, ModelFit, NormalEquations, total};
use nalgebra::DVector;
use rayon::prelude::*;

use crate::candidates::candidate::{Candidate, terms};
use crate::settings::SEARCH;

/// A fit with effects.
#[derive(Debug, Clone)]
pub(crate) struct AugmentedModel<'a> {
    pub(crate) fit: ModelFit<'a>,
    pub(crate) candidates: Vec<Candidate>,
}

impl<'a> AugmentedModel<'a> {
    /// A fit without any.
    pub(crate) fn base(base: &ModelFit<'a>) -> Self {
        Self { fit: base.clone(), candidates: Vec::new() }
    }

    /// Which of the fit's sizes are a candidate's.
    pub(crate) fn range(&self, index: usize) -> Range<usize> {
        let first = self.candidates[..index].iter().map(|candidate| candidate.parameters().len()).sum();
        first..first + self.candidates[index].parameters().len()
    }

    /// The indices of a candidate's columns.
    pub(crate) fn columns(&self, index: usize) -> Vec<usize> {
        self.range(index).map(|k| Column::Term(k).index()).collect()
    }

    /// A candidate's sizes.
    pub(crate) fn estimates(&self, index: usize) -> DVector<f64> {
        DVector::from_column_slice(&self.fit.solution.model.term_values[self.range(index)])
    }
}

/// Negative log likelihood of a fit over as many innovations as the fullest of those compared. A
/// measurement that one fit rejects is charged as an outlier.
pub(crate) fn cost(fit: &ModelFit<'_>, count: f64) -> f64 {
    total(&fit.solution.pass.runs).map_or(f64::INFINITY, |sum| sum.cost() + left_out_cost(&sum, count))
}

/// Cost of the innovations that are missing to a count: each costs as much as an outlier at the gate, and
/// has the mean variance of the others.
pub(crate) fn left_out_cost(equations: &NormalEquations, count: f64) -> f64 {
    (count - equations.count).max(0.0) * (SEARCH.outlier_cost + 0.5 * equations.log_det / equations.count.max(1.0))
}

pub(crate) fn count(fit: &ModelFit<'_>) -> f64 {
    fit.solution.pass.runs.iter().map(|run| run.count).sum()
}

/// The model with other candidates, fitted from where it stands, and where steps stray from the base too:
/// the likelier of the two. `None` when both diverge.
pub(crate) fn refit<'a>(
    base: &ModelFit<'a>,
    from: &AugmentedModel<'a>,
    candidates: Vec<Candidate>,
) -> Option<AugmentedModel<'a>> {
    let mut estimates = Vec::new();
    for candidate in &candidates {
        let none = vec![0.0; candidate.parameters().len()];
        let of_shape = from.candidates.iter().position(|own| own == candidate);
        let known = of_shape.or_else(|| from.candidates.iter().position(|own| own.is_variant_of(candidate)));
        let own = known.map(|index| from.estimates(index).as_slice().to_vec());
        estimates.extend(own.filter(|own| own.len() == none.len()).unwrap_or(none));
    }
    let takes_enough = |fit: &ModelFit<'_>| {
        fit.solution.model.term_values.iter().all(|size| size.is_finite())
            && count(fit) > SEARCH.min_taken_fraction * count(&from.fit)
    };
    let from_here = from.fit.extended_from(estimates.clone(), &mut terms(&candidates)).ok().filter(takes_enough);
    let from_here = match from_here {
        Some(fit) if !fit.solution.left_basin => {
            return Some(AugmentedModel { fit, candidates });
        }
        from_here => from_here,
    };
    let zeros = vec![0.0; estimates.len()];
    let from_base = base.extended_from(zeros, &mut terms(&candidates)).ok().filter(takes_enough);
    let most = [&from_here, &from_base].into_iter().flatten().map(count).fold(0.0, f64::max);
    let fit = from_here.into_iter().chain(from_base).min_by(|a, b| cost(a, most).total_cmp(&cost(b, most)))?;
    Some(AugmentedModel { fit, candidates })
}

/// The models that `refit` makes for each of some candidates, in their order. While a fit goes on it holds
/// the propagations of all runs, and its passes take all cores by themselves: only a few go on at a time.
pub(crate) fn refit_each<'a, T: Sync>(
    of: &[T],
    refit: impl Fn(&T) -> Option<AugmentedModel<'a>> + Sync,
) -> Vec<AugmentedModel<'a>> {
    let few = |few: &[T]| few.par_iter().filter_map(&refit).collect::<Vec<_>>();
    of.chunks(SEARCH.max_fits_at_a_time).flat_map(few).collect()
}

/// A model's candidates but one.
pub(crate) fn others(model: &AugmentedModel<'_>, index: usize) -> Vec<Candidate> {
    let mut others = model.candidates.clone();
    others.remove(index);
    others
}

/// A model without one of its candidates; the base where it has no other. `None` when that diverges.
pub(crate) fn without<'a>(base: &ModelFit<'a>, model: &AugmentedModel<'a>, index: usize) -> Option<AugmentedModel<'a>> {
    let others = others(model, index);
    if others.is_empty() { Some(AugmentedModel::base(base)) } else { refit(base, model, others) }
}
