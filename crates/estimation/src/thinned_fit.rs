//! Fits of thinned measurements: the spacing at which innovations are white; and fits that leave their
//! innovations out.

use std::borrow::Cow;
use std::sync::Arc;

use dataset::median;
use model_term::ModelTerm;
use rules::Rule;

use crate::error::EstimationError;
use crate::model::Column;
use crate::model_fit::ModelFit;
use crate::optimizer::{ConvergenceCriterion, FitOptions};
use crate::settings::THINNING;
use crate::thinning::{Selection, Thinning};

impl ModelFit<'_> {
    /// Thins measurements until their innovations are white, or a run has too few left.
    pub(crate) fn thin(&mut self) -> Result<(), EstimationError> {
        self.thin_beside(&mut [])
    }

    /// The same of a fit with terms.
    fn thin_beside(&mut self, terms: &mut [Box<dyn ModelTerm>]) -> Result<(), EstimationError> {
        let Some(between_s) = median(self.records.times_between()) else { return Ok(()) };
        let mut every_s = between_s;
        // How autocorrelated innovations are depends on no last digit of a fit.
        let compared = FitOptions { ends: ConvergenceCriterion::Likelihood, ..self.fit_options() };
        let mut has_converged = true;
        loop {
            let wider =
                if self.is_white() { None } else { self.thinned(THINNING.thinning_factor * every_s, between_s) };
            let wider = Rule::Thinning.finds(wider);
            if wider.is_none() && has_converged {
                return Ok(());
            }
            self.solution.pass.innovations = Arc::default(); // most of the memory
            has_converged = wider.is_none();
            match wider {
                Some((thinning, selections)) => {
                    every_s *= THINNING.thinning_factor;
                    (self.selections, self.thinning) = (Arc::new(selections), thinning);
                    self.refit_by(&compared, Some(self.current_values()), terms)?;
                }
                None => self.refit(Some(self.current_values()), terms)?,
            }
        }
    }

    /// The fit of the same sessions that thins poses and displacements, and estimates no nuisances. A fit by
    /// [`FitSettings::GEOMETRY_ONLY`](crate::FitSettings::GEOMETRY_ONLY) is its first step, and is not made
    /// again. `None` where this fit has gone on from there: with terms, noise of instants, or thinned.
    ///
    /// # Errors
    /// [`EstimationError`] when it diverges.
    pub fn thinned_further(self) -> Option<Result<Self, EstimationError>> {
        let is_first_step = self.thinning == Thinning::NONE
            && !self.ungated
            && self.prior.timing_s2 == 0.0
            && self.unobservable.is_empty()
            && !self.columns.iter().any(|column| matches!(column, Column::Term(_)))
            && !self.solution.pass.innovations.is_empty();
        is_first_step.then(|| {
            let mut thinned = Self { displacements_in_series: true, ..self };
            thinned.thin()?;
            thinned.fix_unobservable()?;
            Ok(thinned)
        })
    }

    /// The fit at the spacing at which the innovations of the same fit with terms are white: what an effect
    /// does to successive measurements is no error that lasts. `None` where they are white without thinning,
    /// or where this fit is thinned.
    ///
    /// # Errors
    /// [`EstimationError`] when it diverges.
    pub fn thinned_beside(
        &self,
        with_terms: &Self,
        terms: &mut [Box<dyn ModelTerm>],
    ) -> Option<Result<Self, EstimationError>> {
        let mut beside = Self { displacements_in_series: true, ..with_terms.with_innovations(terms).into_owned() };
        let is_to_thin = self.thinning == Thinning::NONE && !beside.is_white();
        is_to_thin.then(|| {
            beside.thin_beside(terms)?;
            let mut thinned = Self {
                displacements_in_series: true,
                selections: Arc::clone(&beside.selections),
                thinning: beside.thinning,
                ..self.clone()
            };
            thinned.refit(Some(thinned.current_values()), &mut [])?;
            thinned.fix_unobservable()?;
            Ok(thinned)
        })
    }

    /// Least time between measurements that the fit takes, seconds; 0 where it takes all.
    #[must_use]
    pub const fn spacing_s(&self) -> f64 {
        self.thinning.every_s
    }

    /// Measurements at a spacing of `every_s`, seconds; `None` when a run has too few left.
    fn thinned(&self, every_s: f64, between_s: f64) -> Option<(Thinning, Vec<Selection>)> {
        let thinning =
            Thinning { every_s: every_s - THINNING.spacing_slack * between_s, phases: THINNING.thinning_phases };
        let selections = Selection::of(&self.records, thinning, &self.start);
        (selections[0].mean_measurements(&self.records) >= THINNING.min_measurements_per_run)
            .then_some((thinning, selections))
    }

    /// Does [`Self::thin`] leave measurements out?
    pub(crate) fn is_to_be_thinned(&self) -> bool {
        let between_s = median(self.records.times_between()).filter(|_| !self.is_white());
        between_s.is_some_and(|between_s| self.thinned(THINNING.thinning_factor * between_s, between_s).is_some())
    }

    /// The fit without its innovations, most of its memory; [`Self::with_innovations`] finds them again.
    #[must_use]
    pub fn without_innovations(mut self) -> Self {
        self.solution.pass.innovations = Arc::default();
        self
    }

    /// The fit with its innovations, by a pass where they were left out. `terms` are those of the fit.
    #[must_use]
    pub fn with_innovations(&self, terms: &mut [Box<dyn ModelTerm>]) -> Cow<'_, Self> {
        if !self.solution.pass.innovations.is_empty() {
            return Cow::Borrowed(self);
        }
        let mut whole = self.clone();
        whole.solution.pass.innovations = self.scan(terms).innovations;
        Cow::Owned(whole)
    }
}
