//! What is left beside the effects that were found: scores of a library of products, and of each effect's own
//! term times a covariate.
//!
//! What is named for another cause explains part of it, and what is left goes with the same motion: a delay
//! for a clock that runs fast grows with time. One direction for each covariate tells that where a library of
//! hundreds of products, each by itself, does not.

use effects::Covariate;
use estimation::ModelFit;

use crate::candidates::candidate::Candidate;
use crate::fits::augmented_model::AugmentedModel;
use crate::fits::scan::{Scored, scan};
use crate::fits::wald::{Test, wald_test};
use crate::search::sparse_terms::{best_first, library};
use crate::settings::FINDINGS;

/// What a form may be off with: the speeds, and the time.
const COVARIATES: [Covariate; 3] = [Covariate::AbsSpeed, Covariate::AbsYawRate, Covariate::RunTime];

/// What a model leaves.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LackOfFit {
    /// Score of the best product of the library, and its p-value; `None` where none is detectable.
    pub(crate) of_products: Option<(f64, f64)>,
    /// The deviations of the forms asked for, by the indices of their effects in the model; without those
    /// that are not detectable.
    pub(crate) of_forms: Vec<(usize, FormDeviation)>,
}

/// The deviation from a form that is most significant.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FormDeviation {
    /// Statistic of its score over that of the effect.
    pub(crate) share: f64,
    /// Corrected for the covariates that were tried.
    pub(crate) p_value: f64,
    pub(crate) by: Covariate,
}

/// What a model leaves, and by what the forms of these of its effects are off most.
pub(crate) fn lack_of_fit(base: &ModelFit<'_>, model: &AugmentedModel<'_>, effects: &[usize]) -> LackOfFit {
    let of_effect = |index: &usize| Some((*index, wald_test(model, *index)?.0));
    let effects: Vec<_> = effects.iter().filter_map(of_effect).collect();
    let mut candidates = library(base);
    let products = candidates.len();
    for (index, test) in &effects {
        let of = Box::new(model.candidates[*index].clone());
        let sizes: Vec<f64> = test.estimates.iter().map(|(size, _)| *size).collect();
        candidates.extend(COVARIATES.map(|by| Candidate::Deviation { of: of.clone(), sizes: sizes.clone(), by }));
    }
    let mut scored = scan(&model.fit, &model.candidates, &candidates);
    let of_forms = scored.split_off(products);
    let first = |scored| {
        let (scored, p_value) = best_first(model, scored, FINDINGS.lack_of_fit_level, FINDINGS.lack_of_fit_level)?;
        Some((scored.into_iter().next()?, p_value))
    };
    let of_form = |((index, test), scored): (&(usize, Test), &[Scored])| {
        let (best, p_value) = first(scored.to_vec())?;
        let Candidate::Deviation { by, .. } = best.candidate else { return None };
        Some((*index, FormDeviation { share: best.statistic / test.statistic, p_value, by }))
    };
    LackOfFit {
        of_forms: effects.iter().zip(of_forms.chunks(COVARIATES.len())).filter_map(of_form).collect(),
        of_products: first(scored).map(|(best, p_value)| (best.statistic, p_value)),
    }
}
