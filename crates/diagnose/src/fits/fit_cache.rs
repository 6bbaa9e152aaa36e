//! Cache of the scans, fits and simulated distributions that were made on one base.

use std::sync::Arc;

use estimation::ModelFit;
use rules::Rule;

use crate::candidates::candidate::Candidate;
use crate::fits::augmented_model::{AugmentedModel, others, refit, without};
use crate::fits::null_distribution::NullDistribution;
use crate::fits::reliability::unresolved;
use crate::fits::scan::{Scored, scan};

/// Scans of the catalogue's other effects beside models, and fits of models, on one base.
#[derive(Debug, Clone)]
pub(crate) struct FitCache<'a> {
    base: ModelFit<'a>,
    scans: Vec<(Vec<Candidate>, Vec<Scored>)>,
    fits: Vec<Arc<AugmentedModel<'a>>>,
    /// Of candidates beside models: the model's candidates, the candidate, and by how much coarse encoders
    /// inflate its statistic.
    inflations: Vec<(Vec<Candidate>, Candidate, f64)>,
    /// What the encoders do not resolve, by the first scan.
    unresolved: Option<Vec<Candidate>>,
}

impl<'a> FitCache<'a> {
    /// Nothing so far.
    pub(crate) fn of(base: &ModelFit<'a>) -> Self {
        Self { base: base.clone(), scans: Vec::new(), fits: Vec::new(), inflations: Vec::new(), unresolved: None }
    }

    /// The fit without effects.
    pub(crate) const fn base(&self) -> &ModelFit<'a> {
        &self.base
    }

    /// The scan beside a model: one made before, or a new one.
    pub(crate) fn beside(&mut self, model: &AugmentedModel<'_>, catalogue: &[Candidate]) -> &[Scored] {
        let known = self.scans.iter().position(|(candidates, _)| *candidates == model.candidates);
        let at = known.unwrap_or_else(|| {
            let is_chosen = |candidate: &Candidate| model.candidates.iter().any(|chosen| chosen.id() == candidate.id());
            let left: Vec<Candidate> = catalogue.iter().filter(|candidate| !is_chosen(candidate)).cloned().collect();
            let scored = scan(&model.fit, &model.candidates, &left);
            let unresolved = self.unresolved.get_or_insert_with(|| unresolved(&model.fit, &model.candidates, &scored));
            let resolved = |scored: Scored| {
                if Rule::Unresolved.applies(unresolved.contains(&scored.candidate)) {
                    scored.unresolved()
                } else {
                    scored
                }
            };
            self.scans.push((model.candidates.clone(), scored.into_iter().map(resolved).collect()));
            self.scans.len() - 1
        });
        &self.scans[at].1
    }

    /// The fit of these candidates, where one was made.
    pub(crate) fn fit(&self, candidates: &[Candidate]) -> Option<&AugmentedModel<'a>> {
        self.fits.iter().map(Arc::as_ref).find(|model| model.candidates == candidates)
    }

    /// All fits that were made.
    pub(crate) fn fits(&self) -> impl Iterator<Item = &AugmentedModel<'a>> {
        self.fits.iter().map(Arc::as_ref)
    }

    /// A model without one of its candidates; the base where it has no other.
    pub(crate) fn without(&mut self, model: &AugmentedModel<'a>, index: usize) -> Option<AugmentedModel<'a>> {
        let fewer = self.fit(&others(model, index)).cloned().or_else(|| without(&self.base, model, index))?;
        self.keep(&fewer);
        Some(fewer)
    }

    /// The model with other candidates, as [`refit`] makes it: one made before, or a new one, which is kept.
    pub(crate) fn refitted(
        &mut self,
        from: &AugmentedModel<'a>,
        candidates: Vec<Candidate>,
    ) -> Option<AugmentedModel<'a>> {
        let fit = self.fit(&candidates).cloned().or_else(|| refit(&self.base, from, candidates))?;
        self.keep(&fit);
        Some(fit)
    }

    /// By how much coarse encoders inflate the statistics of candidates beside a model; 1 where formulas
    /// hold.
    pub(crate) fn inflation_of_each(&mut self, without: &AugmentedModel<'_>, candidates: &[Candidate]) -> Vec<f64> {
        let Some(null) = NullDistribution::of(without) else { return vec![1.0; candidates.len()] };
        let is_of = |known: &(Vec<Candidate>, Candidate, f64), candidate: &Candidate| {
            known.1 == *candidate && known.0 == without.candidates
        };
        let is_new = |candidate: &&Candidate| !self.inflations.iter().any(|known| is_of(known, candidate));
        let new: Vec<&[Candidate]> = candidates.iter().filter(is_new).map(std::slice::from_ref).collect();
        let found = null.inflation(&new);
        let found =
            new.iter().zip(found).map(|(own, inflation)| (without.candidates.clone(), own[0].clone(), inflation));
        self.inflations.extend(found);
        let of = |candidate: &Candidate| self.inflations.iter().find(|known| is_of(known, candidate));
        candidates.iter().map(|candidate| of(candidate).map_or(1.0, |known| known.2)).collect()
    }

    /// The same of one candidate.
    pub(crate) fn inflation_of(&mut self, without: &AugmentedModel<'_>, candidate: &Candidate) -> f64 {
        self.inflation_of_each(without, std::slice::from_ref(candidate)).first().copied().unwrap_or(1.0)
    }

    pub(crate) fn keep(&mut self, model: &AugmentedModel<'a>) {
        if self.fit(&model.candidates).is_none() {
            let AugmentedModel { fit, candidates } = model.clone();
            self.fits.push(Arc::new(AugmentedModel { fit: fit.without_innovations(), candidates }));
        }
    }
}
