//! The mean model: which effects and sparse terms a base fit needs.

use dataset::Dataset;
use estimation::{FitSettings, ModelFit};

use crate::augmented_model::AugmentedModel;
use crate::candidate::Candidate;
use crate::check::{Check, TestResult};
use crate::finding;
use crate::fit_cache::FitCache;
use crate::model_comparison::{log_bayes_factor, log_odds_margin, relative_odds};
use crate::record_faults::sessions;
use crate::residual_tests::{Checked, check};
use crate::selection::{SearchResult, search, search_ungated};
use crate::settings::{MIN_LOG_ODDS_MARGIN, SCAN_LEVEL, UNLISTED_LEVEL};
use crate::sparse_terms::{SparseSearch, UncataloguedTerms, sparse};

/// Measurements whose errors resemble the ones before by this much, and by so many standard errors, are not taken for independent.
const CORRELATED: f64 = 0.05;

const CORRELATED_SIGMAS: f64 = 4.0;

const THINNED: FitSettings = FitSettings { nuisances: false, thin: true, thin_displacements: true };

fn is_white(checked: &Checked) -> bool {
    let (coefficient, sigmas) = checked.correlation;
    coefficient.abs() < CORRELATED || (sigmas.abs() < CORRELATED_SIGMAS && !checked.autocorrelated)
}

/// The mean model after the search: what was found in it, what is there without a name, and the tests of the residuals that are left.
pub(crate) struct MeanStructure<'a> {
    pub(crate) base: ModelFit<'a>,
    pub(crate) found: SearchResult<'a>,
    pub(crate) checked: Checked,
    /// What is there without a name.
    pub(crate) unlisted: Option<UncataloguedTerms<'a>>,
    /// Correlation of measurements that follow each other, where they had to be thinned.
    pub(crate) correlated: Option<(f64, f64)>,
    /// A term made looks likelier for certain and odometry drift more: something is there that is not that term.
    pub(crate) spurious: bool,
    /// The chance of one term that is in no catalogue over that of all the names together, where it has any and does not stand in their place.
    pub(crate) competing: Option<f64>,
}

impl<'a> MeanStructure<'a> {
    /// The model with all that was found.
    pub(crate) fn model(&self) -> &AugmentedModel<'a> {
        self.unlisted.as_ref().map_or(&self.found.model, |unlisted| &unlisted.model)
    }

    /// Terms without a name are there.
    fn keep(&mut self, unlisted: UncataloguedTerms<'a>) {
        self.checked = check(&unlisted.model);
        self.unlisted = Some(unlisted);
    }

    /// Holds the names against one term that is in no catalogue: where that explains more than all of them together, something without a name is there. Whether it is.
    fn compare_with_sparse(&mut self) -> bool {
        self.competing = None;
        let alone = AugmentedModel::base(&self.base);
        if self.found.model.candidates.is_empty() {
            return false;
        }
        let Some(sparse_search) = SparseSearch::beside(&self.base, &alone) else { return false };
        let named = log_bayes_factor(&alone.fit, &self.found.model);
        let finding = sparse_search.finding(UNLISTED_LEVEL);
        let unnamed = finding.as_ref().map_or_else(
            || sparse_search.log_bayes_factor(),
            |sparse| sparse_search.log_bayes_factor_of(&sparse.model),
        );
        let Some(sparse) = finding.filter(|_| unnamed > named + log_odds_margin(named)) else {
            // A cause that nobody wrote down is less likely before any data.
            let unnamed = unnamed + finding::uncatalogued_log_odds();
            self.competing = Some(relative_odds(unnamed, named)).filter(|_| unnamed > named - MIN_LOG_ODDS_MARGIN);
            return false;
        };
        let instead = UncataloguedTerms::from(&self.base, sparse);
        let beside = self
            .terms_beside()
            .filter(|beside| beside.log_bayes_factor(&alone.fit) >= instead.log_bayes_factor(&alone.fit));
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
    fn terms_beside(&self) -> Option<UncataloguedTerms<'a>> {
        sparse(&self.base, &self.found.model, UNLISTED_LEVEL).map(|sparse| UncataloguedTerms::from(&self.base, sparse))
    }

    /// Whether more measurements lie far off than chance makes.
    fn has_outliers(&self) -> bool {
        self.checked.checks.iter().any(|test| test.check == Check::Outliers && !test.passes)
    }

    /// Whether residuals go with something that was recorded.
    fn depends_on_something(&self) -> bool {
        self.checked.checks.iter().any(TestResult::shows_dependence)
    }
}

/// Family-wise rate of false positives of the scan where a check has already found that something is there.
const SURE_LEVEL: f64 = 0.2;

/// Searches the mean model of a base fit: selection over the catalogue, sparse terms, thinning where residuals are autocorrelated, and a bolder search where residuals
/// depend on something recorded. `restored`: counts that were lost have been restored, and make later errors alike.
pub(crate) fn mean_structure<'a>(
    datasets: &'a [Dataset],
    base: ModelFit<'a>,
    catalogue: &[Candidate],
    restored: bool,
) -> MeanStructure<'a> {
    let found = search(&base, catalogue, SCAN_LEVEL, FitCache::default());
    let checked = check(&found.model);
    let mut asked =
        MeanStructure { base, found, checked, unlisted: None, correlated: None, spurious: false, competing: None };
    if asked.has_outliers()
        && let Some(found) = search_ungated(&asked.base, &asked.found, catalogue)
    {
        asked.checked = check(&found.model);
        asked.found = found;
    }
    if asked.has_outliers()
        && asked.found.model.candidates.is_empty()
        && asked.depends_on_something()
        && let Some(unlisted) = UncataloguedTerms::ungated_terms(&asked.base)
    {
        asked.keep(unlisted);
        return asked;
    }
    if asked.compare_with_sparse() {
        return asked;
    }
    // What was lost of the counts and is restored roughly makes measurements after it err alike: they are no fault of the instrument's.
    if !restored && !is_white(&asked.checked) {
        // Measurements that resemble each other are believed too much, each for itself. Perhaps a term that is not in the catalogue makes them so; else farther
        // apart they are independent, and what stands out then may be believed.
        let tried =
            sparse(&asked.base, &asked.found.model, UNLISTED_LEVEL).map(|sparse| (check(&sparse.model), sparse));
        asked.spurious = tried.as_ref().is_some_and(|(_, sparse)| sparse.certain && sparse.drifts_more);
        let explains = tried.filter(|(checked, sparse)| is_white(checked) || (sparse.certain && !sparse.drifts_more));
        if let Some((_, sparse)) = explains {
            asked.keep(UncataloguedTerms::from(&asked.base, sparse));
            return asked;
        }
        if let Ok(thinned) = THINNED.fit(&sessions(datasets)) {
            asked.correlated = Some(asked.checked.correlation);
            asked.found = search(&thinned, catalogue, SCAN_LEVEL, FitCache::default());
            asked.checked = check(&asked.found.model);
            asked.base = thinned;
            if asked.compare_with_sparse() {
                return asked;
            }
        }
    }
    if asked.depends_on_something() {
        // Something is there: what it is may be asked more boldly.
        let found = search(&asked.base, catalogue, SURE_LEVEL, asked.found.known.clone());
        if found.model.candidates.len() > asked.found.model.candidates.len() {
            asked.checked = check(&found.model);
            asked.found = found;
            // What was refused before, or hardly stands out, is one name of what there is.
            asked.competing = Some(1.0);
        }
    }
    if asked.depends_on_something()
        && let Some(unlisted) = asked.terms_beside()
    {
        asked.keep(unlisted);
    }
    asked
}
