//! The mean model: which effects and sparse terms a base fit needs.

use dataset::Dataset;
use estimation::{FitSettings, JointFit};

use crate::augmented_model::Extended;
use crate::candidate::Choice;
use crate::check::{Check, TestResult};
use crate::finding;
use crate::fit_cache::Known;
use crate::model_comparison::{chance, evidence, reach};
use crate::record_faults::sessions;
use crate::residual_tests::{Checked, check};
use crate::selection::{Found, search, search_every_look};
use crate::settings::{LEAST_REACH, SCAN_LEVEL, UNLISTED_LEVEL};
use crate::sparse_terms::{Sought, Unlisted, sparse};

/// Looks whose errors resemble the ones before by this much, and by so many standard errors, are not taken for independent.
const CORRELATED: f64 = 0.05;

const CORRELATED_SIGMAS: f64 = 4.0;

const THINNED: FitSettings = FitSettings { nuisances: false, thin: true, thin_displacements: true };

fn is_white(checked: &Checked) -> bool {
    let (coefficient, sigmas) = checked.correlation;
    coefficient.abs() < CORRELATED || (sigmas.abs() < CORRELATED_SIGMAS && !checked.resemble)
}

/// The mean model after the search: what was found in it, what is there without a name, and the tests of the residuals that are left.
pub(crate) struct MeanStructure<'a> {
    pub(crate) base: JointFit<'a>,
    pub(crate) found: Found<'a>,
    pub(crate) checked: Checked,
    /// What is there without a name.
    pub(crate) unlisted: Option<Unlisted<'a>>,
    /// Correlation of looks that follow each other, where they had to be thinned.
    pub(crate) correlated: Option<(f64, f64)>,
    /// A term made looks likelier for certain and odometry drift more: something is there that is not that term.
    pub(crate) in_disguise: bool,
    /// The chance of one term that is in no catalogue over that of all the names together, where it has any and does not stand in their place.
    pub(crate) rivalled: Option<f64>,
}

impl<'a> MeanStructure<'a> {
    /// The model with all that was found.
    pub(crate) fn model(&self) -> &Extended<'a> {
        self.unlisted.as_ref().map_or(&self.found.model, |unlisted| &unlisted.model)
    }

    /// Terms without a name are there.
    fn keep(&mut self, unlisted: Unlisted<'a>) {
        self.checked = check(&unlisted.model);
        self.unlisted = Some(unlisted);
    }

    /// Holds the names against one term that is in no catalogue: where that explains more than all of them together, something without a name is there. Whether it is.
    fn hold_against_sparse(&mut self) -> bool {
        self.rivalled = None;
        let alone = Extended::alone(&self.base);
        if self.found.model.choices.is_empty() {
            return false;
        }
        let Some(sought) = Sought::beside(&self.base, &alone) else { return false };
        let named = evidence(&alone.fit, &self.found.model);
        let finding = sought.finding(UNLISTED_LEVEL);
        let unnamed = finding.as_ref().map_or_else(|| sought.evidence(), |sparse| sought.evidence_of(&sparse.model));
        let Some(sparse) = finding.filter(|_| unnamed > named + reach(named)) else {
            // A cause that nobody wrote down is less likely before any data.
            let unnamed = unnamed + finding::unwritten_log_odds();
            self.rivalled = Some(chance(unnamed, named)).filter(|_| unnamed > named - LEAST_REACH);
            return false;
        };
        let instead = Unlisted::from(&self.base, sparse);
        let beside = self.sparse_beside().filter(|beside| beside.evidence(&alone.fit) >= instead.evidence(&alone.fit));
        if beside.is_none() {
            // The names only stand round it.
            self.found.model = alone;
            self.found.names.clear();
            self.found.tests.clear();
        }
        self.keep(beside.unwrap_or(instead));
        true
    }

    /// What is there without a name beside the names that were found.
    fn sparse_beside(&self) -> Option<Unlisted<'a>> {
        sparse(&self.base, &self.found.model, UNLISTED_LEVEL).map(|sparse| Unlisted::from(&self.base, sparse))
    }

    /// Whether more looks lie far off than chance makes.
    fn lie_far_off(&self) -> bool {
        self.checked.checks.iter().any(|test| test.check == Check::Outliers && !test.passes)
    }

    /// Whether residuals go with something that was recorded.
    fn goes_with_something(&self) -> bool {
        self.checked.checks.iter().any(TestResult::shows_dependence)
    }
}

/// Family-wise rate of false alarms of the scan where a check has already found that something is there.
const SURE_LEVEL: f64 = 0.2;

/// Searches the mean model of a base fit: selection over the catalogue, sparse terms, thinning where residuals are autocorrelated, and a bolder search where residuals
/// depend on something recorded. `restored`: counts that were lost have been restored, and make later errors alike.
pub(crate) fn mean_structure<'a>(
    datasets: &'a [Dataset],
    base: JointFit<'a>,
    catalogue: &[Choice],
    restored: bool,
) -> MeanStructure<'a> {
    let found = search(&base, catalogue, SCAN_LEVEL, Known::default());
    let checked = check(&found.model);
    let mut asked =
        MeanStructure { base, found, checked, unlisted: None, correlated: None, in_disguise: false, rivalled: None };
    if asked.lie_far_off()
        && let Some(found) = search_every_look(&asked.base, &asked.found, catalogue)
    {
        asked.checked = check(&found.model);
        asked.found = found;
    }
    if asked.lie_far_off()
        && asked.found.model.choices.is_empty()
        && asked.goes_with_something()
        && let Some(unlisted) = Unlisted::among_every_look(&asked.base)
    {
        asked.keep(unlisted);
        return asked;
    }
    if asked.hold_against_sparse() {
        return asked;
    }
    // What was lost of the counts and is restored roughly makes looks after it err alike: they are no fault of the instrument's.
    if !restored && !is_white(&asked.checked) {
        // Looks that resemble each other are believed too much, each for itself. Perhaps a term that is not in the catalogue makes them so; else farther
        // apart they are independent, and what stands out then may be believed.
        let tried =
            sparse(&asked.base, &asked.found.model, UNLISTED_LEVEL).map(|sparse| (check(&sparse.model), sparse));
        asked.in_disguise = tried.as_ref().is_some_and(|(_, sparse)| sparse.certain && sparse.drifts_more);
        let explains = tried.filter(|(checked, sparse)| is_white(checked) || (sparse.certain && !sparse.drifts_more));
        if let Some((_, sparse)) = explains {
            asked.keep(Unlisted::from(&asked.base, sparse));
            return asked;
        }
        if let Ok(thinned) = THINNED.fit(&sessions(datasets)) {
            asked.correlated = Some(asked.checked.correlation);
            asked.found = search(&thinned, catalogue, SCAN_LEVEL, Known::default());
            asked.checked = check(&asked.found.model);
            asked.base = thinned;
            if asked.hold_against_sparse() {
                return asked;
            }
        }
    }
    if asked.goes_with_something() {
        // Something is there: what it is may be asked more boldly.
        let found = search(&asked.base, catalogue, SURE_LEVEL, asked.found.known.clone());
        if found.model.choices.len() > asked.found.model.choices.len() {
            asked.checked = check(&found.model);
            asked.found = found;
            // What was refused before, or hardly stands out, is one name of what there is.
            asked.rivalled = Some(1.0);
        }
    }
    if asked.goes_with_something()
        && let Some(unlisted) = asked.sparse_beside()
    {
        asked.keep(unlisted);
    }
    asked
}
