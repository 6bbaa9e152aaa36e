//! Whether an effect that was found has the form of its data: scores of its own term times a covariate.
//!
//! What is named for another cause explains part of it, and what is left goes with the same motion: a delay for a
//! clock that runs fast grows with time. One direction for each covariate tells that where a library of hundreds of
//! products, each by itself, does not.

use effects::Covariate;

use crate::augmented_model::AugmentedModel;
use crate::candidate::Candidate;
use crate::settings::findings::LACK_OF_FIT_LEVEL;
use crate::sparse_terms::best_first;
use crate::wald::wald_test;

/// What a form may be off with: the speeds, and the time.
const COVARIATES: [Covariate; 3] = [Covariate::AbsSpeed, Covariate::AbsYawRate, Covariate::RunTime];

/// The deviation from a form that is most significant.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FormDeviation {
    /// Statistic of its score over that of the effect.
    pub(crate) share: f64,
    /// Corrected for the covariates that were tried.
    pub(crate) p_value: f64,
    pub(crate) by: Covariate,
}

/// By what the form of one of a model's candidates is off most; `None` where the data would show none.
pub(crate) fn form_deviation(model: &AugmentedModel<'_>, index: usize) -> Option<FormDeviation> {
    let (test, _) = wald_test(model, index)?;
    let sizes: Vec<f64> = test.estimates.iter().map(|(size, _)| *size).collect();
    let deviation = |by| {
        let of = Box::new(model.candidates[index].clone());
        Candidate::Deviation { of, sizes: sizes.clone(), by }
    };
    let library = COVARIATES.map(deviation);
    let (scored, p_value) = best_first(model, &library, LACK_OF_FIT_LEVEL)?;
    let best = scored.into_iter().next()?;
    let Candidate::Deviation { by, .. } = best.candidate else { return None };
    Some(FormDeviation { share: best.statistic / test.statistic, p_value, by })
}
