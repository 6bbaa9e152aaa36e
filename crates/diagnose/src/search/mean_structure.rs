//! The mean model: which effects and sparse terms a base fit needs.
//!
//! Stages, each a function of the results before it: search, search without the outlier gate, comparison with
//! one sparse term, sparse terms for autocorrelation or thinning, search at a higher level, sparse terms with
//! the effects. Once sparse terms are found, the stages after that leave the model as it is.

use dataset::Dataset;
use estimation::{FitSettings, ModelFit};
use rules::Rule;

use crate::candidates::candidate::{Candidate, terms};
use crate::checks::check::{Check, Correlation, TestResult};
use crate::checks::residual_tests::{Checked, check};
use crate::findings::finding;
use crate::fits::augmented_model::AugmentedModel;
use crate::fits::fit_cache::FitCache;
use crate::fits::model_comparison::{log_bayes_factor, margin_over_units, odds_within};
use crate::records::part_of_runs::part_of_runs;
use crate::records::record_faults::sessions;
use crate::search::selection::{SearchResult, search, search_ungated};
use crate::search::sparse_terms::{SparseSearch, UncataloguedTerms, sparse};
use crate::settings::{LEVELS, SEARCH};

pub(crate) const THINNED: FitSettings = FitSettings { nuisances: false, thin: true, thin_displacements: true };

fn is_white(checked: &Checked) -> bool {
    let Correlation { coefficient, sigmas } = checked.correlation;
    coefficient.abs() < SEARCH.min_autocorrelation
        || (sigmas.abs() < SEARCH.autocorrelation_sigmas && !checked.autocorrelated)
}

/// The mean model after the search: the effects found, uncatalogued terms, and the tests of the residuals
/// that are left.
pub(crate) struct MeanStructure<'a> {
    pub(crate) base: ModelFit<'a>,
    pub(crate) found: SearchResult<'a>,
    pub(crate) checked: Checked,
    pub(crate) unlisted: Option<UncataloguedTerms<'a>>,
    /// Correlation of successive measurements, where they were thinned.
    pub(crate) correlated: Option<Correlation>,
    /// A sparse term made measurements certainly likelier though odometry drifts more with it: another
    /// cause is present.
    pub(crate) spurious: bool,
    /// Posterior odds of one uncatalogued term against all named effects; `None` if none is named or it
    /// replaced them.
    pub(crate) competing: Option<f64>,
}

impl<'a> MeanStructure<'a> {
    /// The model with all that was found.
    pub(crate) fn model(&self) -> &AugmentedModel<'a> {
        self.unlisted.as_ref().map_or(&self.found.model, |unlisted| &unlisted.model)
    }
}

/// What a stage hands to the next one: effects, sparse terms where any are needed, and the tests of the
/// residuals left.
struct MeanModel<'a> {
    found: SearchResult<'a>,
    unlisted: Option<UncataloguedTerms<'a>>,
    checked: Checked,
    competing: Option<f64>,
}

impl<'a> MeanModel<'a> {
    fn of_effects(found: SearchResult<'a>) -> Self {
        Self { checked: check(&found.model), found, unlisted: None, competing: None }
    }

    fn with_terms(self, unlisted: UncataloguedTerms<'a>) -> Self {
        Self { checked: check(&unlisted.model), unlisted: Some(unlisted), ..self }
    }

    /// Takes sparse terms in.
    fn take_terms(&mut self, unlisted: UncataloguedTerms<'a>) {
        self.checked = check(&unlisted.model);
        self.unlisted = Some(unlisted);
    }

    /// Whether more measurements are outliers than the noise model predicts.
    fn has_outliers(&self) -> bool {
        self.checked.checks.iter().any(|test| test.check == Check::Outliers && !test.passes)
    }

    /// Whether residuals depend on a recorded quantity.
    fn shows_dependence(&self) -> bool {
        self.checked.checks.iter().any(TestResult::shows_dependence)
    }
}

/// Searches the mean model of a base fit.
pub(crate) fn mean_structure<'a>(
    datasets: &'a [Dataset],
    base: ModelFit<'a>,
    catalogue: &[Candidate],
) -> MeanStructure<'a> {
    let (mut searched, by_part) = match correlation_by_part(datasets, &base, catalogue) {
        Some(by_part) => {
            let whole = base.clone().without_innovations(); // most of its memory
            match thinned(datasets, base) {
                Some(thinned) => (search_among_all(thinned, catalogue), Some(by_part)),
                None => (search_among_all(whole.with_innovations(&mut []).into_owned(), catalogue), None),
            }
        }
        None => (search_among_all(base, catalogue), None),
    };
    let autocorrelation = by_part.or_else(|| searched.explain_autocorrelation());
    let mut correlated = by_part.map(|by_part| by_part.correlation);
    if by_part.is_none()
        && let Some(Autocorrelation { correlation, lasts, .. }) = autocorrelation
        && Rule::ThinIfAutocorrelated.applies(lasts)
        && let Some(thinned) = thinned_beside(datasets, &searched.base, &searched.model.found.model)
    {
        drop(searched); // its fits are large
        searched = search_among_all(thinned, catalogue);
        correlated = Some(correlation);
    }
    let spurious = autocorrelation.is_some_and(|of| of.spurious);
    let Searched { base, model } = searched;
    let model = terms_if_dependent(&base, search_if_dependent(model, catalogue));
    let MeanModel { found, unlisted, checked, competing } = model;
    MeanStructure { base, found, checked, unlisted, correlated, spurious, competing }
}

/// Residuals that are autocorrelated with the effects found among all measurements.
#[derive(Clone, Copy)]
struct Autocorrelation {
    correlation: Correlation,
    /// As in [`MeanStructure`].
    spurious: bool,
    /// No sparse terms explain it.
    lasts: bool,
}

/// A base fit, and the model that was found with it.
struct Searched<'a> {
    base: ModelFit<'a>,
    model: MeanModel<'a>,
}

impl Searched<'_> {
    /// Where residuals are autocorrelated: sparse terms if they explain that. Autocorrelated measurements
    /// taken as independent make any effect too significant.
    fn explain_autocorrelation(&mut self) -> Option<Autocorrelation> {
        let Self { base, model } = self;
        if model.unlisted.is_some() || is_white(&model.checked) {
            return None;
        }
        let correlation = model.checked.correlation;
        let best = SparseSearch::beside(LEVELS.sparse_term_level, base, &model.found.model)
            .and_then(|search| search.best_prediction(LEVELS.sparse_term_level));
        let tried = best.map(|sparse| (check(&sparse.model), sparse));
        let spurious = tried.as_ref().is_some_and(|(_, sparse)| sparse.certain && sparse.drifts_more);
        let explains = tried.filter(|(checked, sparse)| !sparse.drifts_more && (is_white(checked) || sparse.certain));
        let explains = Rule::TermsExplainAutocorrelation.finds(explains);
        let lasts = explains.is_none();
        if let Some((_, sparse)) = explains {
            model.take_terms(UncataloguedTerms::from(base, sparse));
        }
        Some(Autocorrelation { correlation, spurious: Rule::SpuriousTerm.applies(spurious), lasts })
    }
}

/// The effects with a base fit, and one sparse term against them. Where instants are noisy beside the
/// effects, the base fit with that noise, and the effects with it: motion that stamps do not tell resembles
/// effects that grow with speed.
fn search_among_all<'a>(base: ModelFit<'a>, catalogue: &[Candidate]) -> Searched<'a> {
    let found = search(FitCache::of(&base), catalogue, LEVELS.scan_level);
    let (base, found) = match Rule::TimingNoise.finds(noisy_base(&base, &found.model)) {
        None => (base, found),
        Some(noisy) => {
            drop((base, found)); // their fits are large
            let found = search(FitCache::of(&noisy), catalogue, LEVELS.scan_level);
            (noisy, found)
        }
    };
    let mut model = MeanModel::of_effects(found);
    // A large effect in few measurements looks like outliers: where there are more of them than noise makes,
    // or than with the effects that were found.
    let outliers = |fit: &ModelFit<'_>| fit.solution.pass.outliers.len();
    if (model.has_outliers() || outliers(&base) > outliers(&model.found.model.fit))
        && let Some(ungated) = Rule::UngatedSearch.finds(search_ungated(&model.found, catalogue))
    {
        model = MeanModel::of_effects(ungated);
    }
    let model = compare_with_sparse(&base, model);
    Searched { base, model }
}

/// A base fit, thinned until what it leaves is white.
fn thinned<'a>(datasets: &'a [Dataset], base: ModelFit<'a>) -> Option<ModelFit<'a>> {
    base.thinned_further().unwrap_or_else(|| THINNED.fit(&sessions(datasets))).ok()
}

/// A base fit at the spacing at which what is left with the effects found among all measurements is white,
/// where that is less than without them. Errors that alternate, as of displacements that share a scan, may
/// show with the effects alone: wider than without them nothing is thinned.
fn thinned_beside<'a>(
    datasets: &'a [Dataset],
    base: &ModelFit<'a>,
    found: &AugmentedModel<'a>,
) -> Option<ModelFit<'a>> {
    let has_effects = !found.candidates.is_empty();
    let beside = has_effects.then(|| base.thinned_beside(&found.fit, &mut terms(&found.candidates))?.ok()).flatten();
    let is_nearer = |beside: &ModelFit<'_>, alone: &ModelFit<'_>| beside.spacing_s() < alone.spacing_s();
    match (thinned(datasets, base.clone()), beside) {
        (Some(alone), Some(beside)) if Rule::ThinnedBesideEffects.applies(is_nearer(&beside, &alone)) => Some(beside),
        (alone, beside) => alone.or(beside),
    }
}

/// What lasts of the measurements' autocorrelation, as far as a part of the runs tells: it says which effects
/// stand beside an autocorrelation, and all measurements how large that is with these effects. `None` where
/// the part does not say so, or all do not agree: what is sought among all is needed then.
fn correlation_by_part(datasets: &[Dataset], base: &ModelFit<'_>, catalogue: &[Candidate]) -> Option<Autocorrelation> {
    let part = Rule::AutocorrelationByPart.finds(part_of_runs(datasets, base))?;
    let beside_none = check(&AugmentedModel::base(base));
    if is_white(&beside_none) {
        return None;
    }
    let mut part = search_among_all(FitSettings::GEOMETRY_ONLY.fit(&part).ok()?, catalogue);
    let of_part = part.explain_autocorrelation().filter(|of| of.lasts)?;
    let AugmentedModel { fit, candidates } = part.model.found.model;
    let checked = if candidates.is_empty() {
        beside_none
    } else {
        let fit = base.extended_from(fit.solution.model.term_values, &mut terms(&candidates)).ok()?;
        check(&AugmentedModel { fit, candidates })
    };
    (!is_white(&checked)).then_some(Autocorrelation { correlation: checked.correlation, ..of_part })
}

/// The base fit with the noise of instants that is left beside a model's effects; `None` where none is.
fn noisy_base<'a>(base: &ModelFit<'a>, model: &AugmentedModel<'a>) -> Option<ModelFit<'a>> {
    if !model.fit.has_timing_noise() {
        return None;
    }
    let mut noisy = model.fit.clone();
    noisy.fit_timing_noise(&mut terms(&model.candidates)).ok()?;
    base.with_timing_noise_of(&noisy).ok()
}

/// Compares the effects with one sparse term. Where that explains more than all effects together, sparse
/// terms come beside the effects, or replace them if that explains more.
fn compare_with_sparse<'a>(base: &ModelFit<'a>, model: MeanModel<'a>) -> MeanModel<'a> {
    if model.unlisted.is_some() || model.found.model.candidates.is_empty() {
        return model;
    }
    let without = AugmentedModel::base(base);
    let Some(sparse_search) = SparseSearch::beside(1.0, base, &without) else { return model };
    let named = log_bayes_factor(&without.fit, &model.found.model);
    let finding = sparse_search.finding(LEVELS.sparse_term_level);
    let Some(likeliest) = finding.as_ref().map(|found| &found.model).or_else(|| sparse_search.likeliest()) else {
        return model;
    };
    let unnamed = sparse_search.log_bayes_factor_of(likeliest);
    // The prior of an uncatalogued cause is lower.
    let more = unnamed + finding::uncatalogued_log_odds() - named;
    let margin = margin_over_units(named, likeliest, &model.found.model);
    let Some(term) = finding.filter(|_| Rule::TermInstead.applies(more > margin)) else {
        let is_close = Rule::CompetingTerm.applies(more > -LEVELS.min_log_odds_margin);
        let competing = Some(odds_within(more, margin).min(1.0)).filter(|_| is_close);
        return MeanModel { competing, ..model };
    };
    let instead = UncataloguedTerms::from(base, term);
    let log_bayes_factor_instead = instead.log_bayes_factor(&without.fit);
    let beside =
        sparse(base, &model.found.model, LEVELS.sparse_term_level).map(|term| UncataloguedTerms::from(base, term));
    match beside.filter(|beside| beside.log_bayes_factor(&without.fit) >= log_bayes_factor_instead) {
        Some(beside) => model.with_terms(beside),
        None => MeanModel { found: model.found.without_effects(without), ..model }.with_terms(instead),
    }
}

/// Where residuals depend on something recorded: a search at a higher level of false positives, if it finds
/// more effects.
fn search_if_dependent<'a>(model: MeanModel<'a>, catalogue: &[Candidate]) -> MeanModel<'a> {
    if model.unlisted.is_some() || !model.shows_dependence() {
        return model;
    }
    let found = search(model.found.known.clone(), catalogue, SEARCH.scan_level_if_dependent);
    let is_more = found.model.candidates.len() > model.found.model.candidates.len();
    if !Rule::SearchIfDependent.applies(is_more) {
        return model;
    }
    // What the first search refused, or what is of low significance, is one candidate cause among others.
    MeanModel { competing: Some(1.0), ..MeanModel::of_effects(found) }
}

/// Where residuals depend on something recorded still: sparse terms beside the effects.
fn terms_if_dependent<'a>(base: &ModelFit<'a>, model: MeanModel<'a>) -> MeanModel<'a> {
    if model.unlisted.is_some() || !model.shows_dependence() {
        return model;
    }
    match Rule::TermsIfDependent.finds(sparse(base, &model.found.model, LEVELS.sparse_term_level)) {
        Some(term) => model.with_terms(UncataloguedTerms::from(base, term)),
        None => model,
    }
}
