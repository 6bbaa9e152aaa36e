//! Errors of the log's stamps: undone in the records before effects are sought.
//!
//! Speeds, accelerations and the instants of measurements all come from the stamps. Stamps that are wrong by
//! much are therefore more than one linear term: what that term leaves resembles other effects.

use dataset::Dataset;
use estimation::ModelFit;

use crate::candidates::candidate::Candidate;
use crate::fits::augmented_model::{AugmentedModel, cost, count, refit};
use crate::fits::model_comparison::log_bayes_factor;
use crate::fits::statistics::p_of_chi_square;
use crate::fits::wald::{Test, cluster_robust_test, wald_test};
use crate::settings::{LEVELS, RECORDS};

/// An error of the stamps, and the records without it.
pub(crate) struct StampError {
    pub(crate) candidate: Candidate,
    /// Its test alone in the records as they are, with a p-value for one candidate.
    pub(crate) test: Test,
    pub(crate) records: Vec<Dataset>,
    /// Stamps are later than rows can be told by in some run: what is left of their errors is unlike noise.
    pub(crate) is_undone_roughly: bool,
    /// Log Bayes factor of it as a linear term, or of the records without it, over none.
    pub(crate) log_odds: f64,
    /// How well a fit explains it; `None` where counts show it by themselves.
    explained: Option<Explained>,
}

/// Cost of the model that has an error of the stamps as a linear term, or of the fit to the records without
/// it, its number of observations, and by how much it costs less than the model without.
struct Explained {
    cost: f64,
    count: f64,
    by: f64,
}

impl StampError {
    /// One that counts show by themselves, of records that a test does not ask for.
    #[cfg(test)]
    pub(crate) fn of_test(candidate: Candidate, is_undone_roughly: bool) -> Self {
        let test = Test { statistic: 100.0, p_value: 1e-20, estimates: vec![(0.9, 0.01)] };
        Self { candidate, test, records: Vec::new(), is_undone_roughly, log_odds: 50.0, explained: None }
    }

    /// Whether the records without it are about as likely as those with it beside the linear term.
    pub(crate) fn is_undone_by(&self, restamped: &ModelFit<'_>) -> bool {
        let Some(explained) = &self.explained else { return true };
        let most = explained.count.max(count(restamped));
        cost(restamped, most)
            <= explained.cost + LEVELS.min_log_odds_margin.max(RECORDS.max_restamping_loss * explained.by)
    }
}

/// Whether stamps do not tell in some run of which tick each row is.
pub(crate) fn have_uncertain_rows(datasets: &[Dataset]) -> bool {
    uncertain_ticks_s(datasets).next().is_some()
}

/// The longest sampling period of such runs, seconds; 0 where there are none.
pub(crate) fn uncertain_tick_s(datasets: &[Dataset]) -> f64 {
    uncertain_ticks_s(datasets).fold(0.0, f64::max)
}

fn uncertain_ticks_s(datasets: &[Dataset]) -> impl Iterator<Item = f64> {
    let runs = datasets.iter().flat_map(|dataset| &dataset.runs);
    let periods = runs.filter_map(|run| run.odometry.t_s.sampling_period());
    periods.filter(|period| !period.is_certain()).map(|period| period.period_s)
}

/// An error of the stamps that counts show by themselves, whatever the instrument says.
pub(crate) fn stamp_error_by_counts(datasets: &[Dataset], catalogue: &[Candidate]) -> Option<StampError> {
    catalogue.iter().find_map(|candidate| {
        let (restamped, shown_by_counts) = (candidate.restamped()?, candidate.shown_by_counts()?);
        let (value, sigma) = shown_by_counts(datasets)?;
        if value - RECORDS.min_share_sigmas * sigma < 0.5 {
            return None;
        }
        let each: Option<Vec<Dataset>> = datasets.iter().map(|dataset| restamped(dataset, value, sigma)).collect();
        let statistic = (value / sigma).powi(2);
        let p_value = p_of_chi_square(statistic, 1.0);
        Some(StampError {
            candidate: candidate.clone(),
            test: Test { statistic, p_value, estimates: vec![(value, sigma)] },
            records: each?,
            is_undone_roughly: have_uncertain_rows(datasets),
            log_odds: 0.5 * statistic - (catalogue.len() as f64).ln(),
            explained: None,
        })
    })
}

/// Records with the stamps and counts of others of the same runs, as far as there are such.
pub(crate) fn with_rows_of(records: &[Dataset], others: &[Dataset]) -> Vec<Dataset> {
    let of = |dataset: &Dataset, other: &Dataset| {
        let mut dataset = dataset.clone();
        for run in &mut dataset.runs {
            if let Some(other) = other.runs.iter().find(|other| other.info.id == run.info.id) {
                run.odometry = other.odometry.clone();
            }
        }
        dataset
    };
    records.iter().zip(others).map(|(dataset, other)| of(dataset, other)).collect()
}

/// The most significant error of the stamps that restamping undoes, if it is significant among all of the
/// catalogue. `base` is the fit to `datasets`.
pub(crate) fn stamp_error(datasets: &[Dataset], base: &ModelFit<'_>, catalogue: &[Candidate]) -> Option<StampError> {
    let alone = AugmentedModel::base(base);
    let found = catalogue.iter().filter_map(|candidate| {
        let restamped = candidate.restamped()?;
        let model = refit(base, &alone, vec![candidate.clone()])?;
        let (test, _) = wald_test(&model, 0)?;
        let &[(value, sigma)] = &test.estimates[..] else { return None };
        if test.p_value * catalogue.len() as f64 > LEVELS.scan_level
            || !cluster_robust_test(&model, 0, LEVELS.cluster_robust_level)
        {
            return None;
        }
        let each: Vec<Option<Dataset>> = datasets.iter().map(|dataset| restamped(dataset, value, sigma)).collect();
        let changes = each.iter().any(Option::is_some);
        let records = each.into_iter().zip(datasets).map(|(own, dataset)| own.unwrap_or_else(|| dataset.clone()));
        let (count, log_odds) = (count(&model.fit), log_bayes_factor(base, &model));
        let (without, cost) = (cost(base, count), cost(&model.fit, count));
        changes.then(|| StampError {
            candidate: candidate.clone(),
            test,
            records: records.collect(),
            is_undone_roughly: have_uncertain_rows(datasets),
            log_odds,
            explained: Some(Explained { cost, count, by: without - cost }),
        })
    });
    found.max_by(|a, b| a.test.statistic.total_cmp(&b.test.statistic))
}
