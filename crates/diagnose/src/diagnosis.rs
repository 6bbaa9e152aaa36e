//! The order of work.

use dataset::Dataset;
use effects::CATALOGUE;
use estimation::{EstimationError, ModelFit};
use rules::Rule;

use crate::candidates::candidate::{Candidate, mean_terms};
use crate::findings::extrinsics;
use crate::options::Options;
use crate::records::log::Log;
use crate::records::prepared::Prepared;
use crate::records::record_faults::{
    Fault, determines_wheels, fault, is_correlated, rejected_share, second_fault, sessions,
};
use crate::records::stamp_errors::{StampError, stamp_error, with_rows_of};
use crate::records::unknown_motion::AnomalyKind;
use crate::report::{AsStamped, Diagnosis, EVERY_MEASUREMENT, Explained};
use crate::search::mean_structure::{MeanStructure, THINNED, mean_structure};
use crate::settings::RECORDS;
use crate::settings::large_log::MAX_RUNS;
use crate::stage::Step;

/// Why there is no diagnosis.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DiagnoseError {
    /// An id that the catalogue does not have.
    #[error("no effect \"{id}\" in the catalogue; known: {}", CATALOGUE.join(", "))]
    UnknownEffect {
        /// The id.
        id: String,
    },
    /// The model does not follow the robot, and neither a gross fault nor an effect explains it.
    #[error(
        "{percent:.0} % of the pose measurements are rejected as outliers, and no gross fault and no effect explains it; record poses along the path, not only at its ends"
    )]
    OdometryUncorrelated {
        /// Share of measurements left out.
        percent: f64,
    },
    /// The odometry does not follow the measurements, and these do not determine the geometry or are no more
    /// than what is fitted to them.
    #[error(
        "the measurements are too few to say whether the odometry follows the robot; record more poses along the path, or more runs"
    )]
    TooFewMeasurements,
    /// Neither the calibrated model nor one with effects converged: no number of either is a result.
    #[error(
        "the fit of the calibrated model did not converge: these runs hardly determine it; yair check says what they do not determine"
    )]
    NotConverged,
    /// So many runs take more memory and time than a diagnosis is to.
    #[error("{runs} runs, and a diagnosis is of at most {MAX_RUNS}; give fewer sessions")]
    TooManyRuns {
        /// Of all datasets.
        runs: usize,
    },
    /// There is no base fit.
    #[error("no calibrated model to ask: {0}")]
    NoFit(#[from] EstimationError),
}

/// Diagnoses a log: the sessions of one robot, or the stretches of a large log and the tests of all its rows.
/// The stages run in order, each a function of the results before it.
///
/// # Errors
/// [`DiagnoseError`] when an id is unknown or no base model can be fitted.
pub fn diagnose<'l>(log: impl Into<Log<'l>>, options: &Options) -> Result<Diagnosis, DiagnoseError> {
    let log = log.into();
    refuse(log, options)?;
    let begins = |step| options.on_stage.begins(step);
    begins(Step::Motions);
    let every_term = mean_terms(&options.without);
    let prepared = Prepared::of(log, &every_term, RECORDS.min_common_clock_offset_s);
    begins(Step::RecordFaults);
    let fit = |records| EVERY_MEASUREMENT.fit(&sessions(records));
    let as_recorded = fit(prepared.records());
    let first = Rule::RecordFault.finds(fault(prepared.records(), as_recorded.as_ref().ok(), &options.without));
    // To an instrument that is precise, a clock that is off by less makes most measurements outliers.
    let asks_again = first.is_none() && !prepared.has_clock() && as_recorded.as_ref().is_ok_and(has_most_rejected);
    let again = Rule::ClockRetry
        .applies(asks_again)
        .then(|| Prepared::of(log, &every_term, RECORDS.min_rejecting_clock_offset_s));
    let (prepared, as_recorded) = match &again {
        Some(again) => (again, fit(again.records())),
        None => (&prepared, as_recorded),
    };
    let base = match &first {
        None => as_recorded?,
        Some(fault) => fit(&fault.records)?,
    };
    let second = first.as_ref().and_then(|first| second_fault(first, &base, &options.without));
    let faults: Vec<&Fault> = first.iter().chain(&second).collect();
    let records = faults.last().map_or(prepared.records(), |fault| &fault.records);
    let base = if second.is_some() { fit(records)? } else { base };
    begins(Step::MeanStructure);
    let base = correlated_base(records, base);
    // Stamps that are wrong: everything that comes from them is sought in records that are restamped.
    let sought = prepared.by_counts.is_none() && is_correlated(&base, &[]);
    let error = sought.then(|| stamp_error(records, &base, &every_term)).flatten();
    let error = Rule::StampsByResiduals.finds(error);
    let restamped = error.as_ref().and_then(|error| Some((error, fit_restamped(error)?)));
    let stamped = (prepared.by_counts.is_some() && faults.is_empty()).then(|| with_rows_of(records, log.datasets));
    let (stamps, as_stamped, records, base) = match restamped {
        Some((error, fit)) => (Some(error), Some(AsStamped { records, base }), &error.records[..], fit),
        None => (prepared.by_counts.as_ref(), stamped.as_deref().and_then(AsStamped::of), records, base),
    };
    let is_open = |candidate: &Candidate| {
        stamps.is_none_or(|error| error.candidate.id() != candidate.id())
            && !Rule::ExtrinsicsInstead.applies(extrinsics::has_instead(&base, candidate))
    };
    let mut catalogue: Vec<Candidate> = every_term.into_iter().filter(is_open).collect();
    let mut structure = mean_structure(records, base, &catalogue);
    // Where the counts do not follow the robot at all, no small effect has a meaning: only one with which
    // they follow it, such as a clock that is off.
    let uncorrelated = is_uncorrelated(&structure, faults.is_empty())?;
    if uncorrelated {
        catalogue.clear();
        structure = mean_structure(records, structure.base, &catalogue);
    }
    let faults = &faults[..];
    let explained =
        Explained { log, prepared, faults, stamps, as_stamped, records, structure, catalogue, uncorrelated };
    let found = explained.diagnosis(options);
    // Where something happened that no wheel says, the same with nothing cut.
    let has_events = prepared.anomalies().iter().any(|anomaly| anomaly.kind == AnomalyKind::RobotOrFrame);
    if has_events
        && let Ok(whole) = diagnose(Log { cuts_events: false, ..log }, options)
        && Rule::WholeWithoutEvents.applies(whole.explains_events_of(&found))
    {
        return Ok(whole);
    }
    Ok(found)
}

/// Refuses unknown effects, and logs with more runs than a diagnosis can take.
fn refuse(log: Log<'_>, options: &Options) -> Result<(), DiagnoseError> {
    if let Some(id) = options.without.iter().find(|id| !CATALOGUE.contains(&id.as_str())) {
        return Err(DiagnoseError::UnknownEffect { id: id.clone() });
    }
    let runs = log.datasets.iter().map(|dataset| dataset.runs.len()).sum();
    if runs > MAX_RUNS { Err(DiagnoseError::TooManyRuns { runs }) } else { Ok(()) }
}

fn has_most_rejected(fit: &ModelFit<'_>) -> bool {
    rejected_share(fit) > RECORDS.max_rejected_fraction
}

/// Whether the odometry is uncorrelated with what was measured; an error where nothing can be said.
fn is_uncorrelated(structure: &MeanStructure<'_>, has_no_fault: bool) -> Result<bool, DiagnoseError> {
    let found = &structure.found.model;
    // A large effect makes outliers of what the calibrated model alone cannot follow.
    let share = rejected_share(&found.fit);
    if has_no_fault && share > RECORDS.max_rejected_fraction {
        return Err(DiagnoseError::OdometryUncorrelated { percent: 100.0 * share });
    }
    if !structure.base.solution.converged && !found.fit.solution.converged {
        return Err(DiagnoseError::NotConverged);
    }
    let is_uncorrelated = !is_correlated(&found.fit, &found.candidates);
    // Stated lengths that are not determined, and are off, look like odometry that does not follow.
    if is_uncorrelated && (!structure.base.unobservable.is_empty() || structure.base.shows_no_scatter()) {
        return Err(DiagnoseError::TooFewMeasurements);
    }
    Ok(is_uncorrelated)
}

/// The base fit to restamped records, if it explains as much as the error of the stamps does.
fn fit_restamped(error: &StampError) -> Option<ModelFit<'_>> {
    let fit = correlated_base(&error.records, EVERY_MEASUREMENT.fit(&sessions(&error.records)).ok()?);
    (!Rule::StampsUndone.applies(!error.is_undone_by(&fit))).then_some(fit)
}

/// The base fit, of thinned measurements where odometry seems uncorrelated with all of them: between frequent
/// measurements the robot moves less than their lasting errors, or wrong stamps, move them. A few that are
/// left and determine no wheel do not say that it is correlated.
fn correlated_base<'a>(records: &'a [Dataset], base: ModelFit<'a>) -> ModelFit<'a> {
    if is_correlated(&base, &[]) {
        return base;
    }
    match THINNED.fit(&sessions(records)) {
        Ok(thinned) if Rule::ThinnedIfUncorrelated.applies(determines_wheels(&thinned, &[])) => thinned,
        _ => base,
    }
}
