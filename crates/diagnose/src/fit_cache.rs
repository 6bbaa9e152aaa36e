//! Scans and fits that have been made of one base: many are asked for again.

use std::sync::Arc;

use estimation::JointFit;
use rayon::prelude::*;

use crate::augmented_model::{Extended, others, refit, without};
use crate::candidate::Choice;
use crate::scan::{Scored, scan};

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
    pub(crate) fn with_each(
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
    pub(crate) fn without(&mut self, base: &JointFit<'a>, model: &Extended<'a>, place: usize) -> Option<Extended<'a>> {
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
