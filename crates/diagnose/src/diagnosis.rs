//! The order of work.

use calib::methods::joint::calibrated_drive;
use calib::{CalibError, Calibration, CalibrationReport, MethodReport, Names};
use dataset::Dataset;
use effects::CATALOGUE;
use estimation::{EstimationError, FitSettings, ModelFit};
use rayon::prelude::*;
use scenario::Scenario;

use crate::alternatives::{Alternative, alternatives};
use crate::augmented_model::{AugmentedModel, refit};
use crate::beam::{ComparedModel, beam};
use crate::candidate::{Candidate, mean_terms};
use crate::carry_over::{CarryOver, carry_over};
use crate::check::TestResult;
use crate::clock_drift::clock_drift;
use crate::clock_offsets::clock_offsets;
use crate::clock_profile::RunClock;
use crate::detectability::detectability;
use crate::document::{Document, Gain};
use crate::extrinsics;
use crate::finding::Finding;
use crate::findings::{StageResults, findings};
use crate::gain::{gain_by_level, held_out_drift};
use crate::large_log::LargeLog;
use crate::log_rows::{check_rows, check_spans};
use crate::mean_structure::{THINNED, mean_structure};
use crate::names::session_names;
use crate::plan::{Limits, next_experiment};
use crate::record_faults::{Fault, determines_wheels, fault, is_correlated, rejected_share, sessions};
use crate::residuals::{Residuals, residuals};
use crate::settings::large_log::MAX_RUNS;
use crate::settings::records::{
    MAX_REJECTED_FRACTION, MIN_COMMON_CLOCK_OFFSET_S, MIN_MEASUREMENTS_PER_RUN, MIN_REJECTING_CLOCK_OFFSET_S,
};
use crate::stage::{OnStage, Step};
use crate::stamp_errors::{stamp_error, stamp_error_by_counts, uncertain_tick_s, whole_stamp_error, with_rows_of};
use crate::text;
use crate::unknown_motion::{AnomalyKind, unknown_motions};

/// What to leave out of the catalogue, and the limits of the next experiment.
#[derive(Debug, Clone)]
pub struct Options {
    /// Effects that are not to be named, by id.
    pub without: Vec<String>,
    /// Floor, time and speed within which the next experiment is sought; `None`: none is sought.
    pub limits: Option<Limits>,
    /// Whether models of an experiment are fitted too ([`Diagnosis::beam`]).
    pub beam: bool,
    /// What is told when a stage begins: a large log takes minutes.
    pub on_stage: OnStage,
}

impl Default for Options {
    fn default() -> Self {
        Self { without: Vec::new(), limits: Some(Limits::default()), beam: false, on_stage: OnStage::default() }
    }
}

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

/// A diagnosis.
#[derive(Debug, Clone)]
pub struct Diagnosis {
    /// What goes to scripts.
    pub document: Document,
    /// The simulated robot with what was found, where it can be written.
    pub extended: Result<Scenario, String>,
    /// Residuals of the calibrated and of the extended model against every recorded covariate.
    pub residuals: Residuals,
    /// Every effect that was tested, and what became of it.
    pub alternatives: Vec<Alternative>,
    /// The calibration without what was found; gains are over it.
    pub base: CalibrationReport,
    /// The calibrated model without what was found.
    pub calibrated: FittedModel,
    /// The calibrated model with what was found in its mean.
    pub found: FittedModel,
    /// The same without what other sessions and paths are not known to have: the model that `extended` has.
    pub carried: FittedModel,
    /// The geometry that suits these data best where none of the robot's own effects can be expressed: fitted
    /// beside what was found of the instrument alone. `None` where faults of the records were undone first.
    pub geometry_alone: Option<CalibrationReport>,
    /// Models for experiments on their comparison, where they are asked for.
    pub beam: Vec<ComparedModel>,
}

/// A model with its terms, to be compared with other records.
#[derive(Debug, Clone)]
pub struct FittedModel {
    /// Geometry, and values in the order of the terms' parameters.
    pub model: estimation::Model,
    candidates: Vec<Candidate>,
}

impl FittedModel {
    fn of(extended: &AugmentedModel<'_>) -> Self {
        Self { model: extended.fit.solution.model.clone(), candidates: extended.candidates.clone() }
    }

    /// Its terms, in their initial states.
    #[must_use]
    pub fn terms(&self) -> Vec<Box<dyn model_term::ModelTerm>> {
        crate::candidate::terms(&self.candidates)
    }
}

fn measurements_per_run(fit: &ModelFit<'_>) -> f64 {
    let runs = fit.solution.pass.runs.iter().filter(|run| run.count > 0.0).count();
    fit.records.measurements() as f64 / runs.max(1) as f64
}

const EVERY_MEASUREMENT: FitSettings = FitSettings::GEOMETRY_ONLY;

/// Diagnoses one robot's sessions: the stages in order, each a function of the results before it.
///
/// # Errors
/// [`DiagnoseError`] when an id is unknown or no base model can be fitted.
pub fn diagnose(datasets: &[Dataset], options: &Options) -> Result<Diagnosis, DiagnoseError> {
    diagnose_rows(datasets, None, options)
}

/// The same of stretches of a large log; what all of its rows show is said too.
///
/// # Errors
/// As [`diagnose`].
pub fn diagnose_large(log: &LargeLog, options: &Options) -> Result<Diagnosis, DiagnoseError> {
    diagnose_rows(log.datasets(), Some(log), options)
}

fn diagnose_rows(
    datasets: &[Dataset],
    large: Option<&LargeLog>,
    options: &Options,
) -> Result<Diagnosis, DiagnoseError> {
    if let Some(id) = options.without.iter().find(|id| !CATALOGUE.contains(&id.as_str())) {
        return Err(DiagnoseError::UnknownEffect { id: id.clone() });
    }
    let runs = datasets.iter().map(|dataset| dataset.runs.len()).sum();
    if runs > MAX_RUNS {
        return Err(DiagnoseError::TooManyRuns { runs });
    }
    let stages = |before_fit: BeforeFit| stages((datasets, large), options, before_fit);
    let mut before_fit = BeforeFit { min_common_clock_s: MIN_COMMON_CLOCK_OFFSET_S, events: true };
    let first = match stages(before_fit) {
        // To an instrument that is precise, a clock that is off by less makes most measurements outliers.
        Err(DiagnoseError::OdometryUncorrelated { .. }) => {
            before_fit.min_common_clock_s = MIN_REJECTING_CLOCK_OFFSET_S;
            stages(before_fit)?
        }
        result => result?,
    };
    if first.has_events
        && let Ok(whole) = stages(BeforeFit { events: false, ..before_fit })
        && whole.explains_events_of(&first)
    {
        return Ok(whole.diagnosis);
    }
    Ok(first.diagnosis)
}

/// What is taken off the records before the fit.
#[derive(Clone, Copy)]
struct BeforeFit {
    /// An offset of all clocks from so many seconds on.
    min_common_clock_s: f64,
    /// Intervals in which robot or frame moved as no wheel says.
    events: bool,
}

/// What the stages come to.
struct Staged {
    diagnosis: Diagnosis,
    /// Nothing is compared across some intervals in which the robot may have moved.
    has_events: bool,
    /// Share of the measurements that are outliers beside all that was found.
    outlier_share: f64,
}

impl Staged {
    /// Whether what was found with all intervals compared explains what happened in those of another: as a
    /// castor turns a robot wherever it reverses. Where it does not, what follows an event are outliers.
    fn explains_events_of(&self, cut: &Self) -> bool {
        !self.diagnosis.found.candidates.is_empty() && self.outlier_share <= cut.outlier_share
    }
}

fn stages(
    (datasets, large): (&[Dataset], Option<&LargeLog>),
    options: &Options,
    before_fit: BeforeFit,
) -> Result<Staged, DiagnoseError> {
    let begins = |step| options.on_stage.begins(step);
    begins(Step::Motions);
    // The sampling periods of all runs, on all cores: whoever asks for them later asks run by run.
    datasets.par_iter().flat_map(|dataset| &dataset.runs).for_each(|run| {
        let _ = run.odometry.t_s.sampling_period();
    });
    let every_term = mean_terms(&options.without);
    // Stamps that counts show to be wrong by themselves: all else is sought in records that are restamped.
    let by_counts = stamp_error_by_counts(datasets, &every_term);
    let recorded = datasets;
    let datasets = by_counts.as_ref().map_or(datasets, |error| &error.records[..]);
    let of_runs = RunClock::of_all(datasets);
    let drift = clock_drift(datasets, &of_runs, before_fit.min_common_clock_s);
    let (datasets, of_runs) = drift.as_ref().map_or((datasets, &of_runs), |found| (&found.records[..], &found.clocks));
    let clocks = clock_offsets(datasets, of_runs, before_fit.min_common_clock_s);
    let datasets = clocks.records.as_deref().unwrap_or(datasets);
    let odd = unknown_motions(datasets, clocks.remaining_s, uncertain_tick_s(recorded), before_fit.events);
    let (datasets, anomalies) =
        odd.as_ref().map_or((datasets, &[][..]), |found| (&found.records[..], &found.anomalies[..]));
    begins(Step::RecordFaults);
    // Record faults and the base fit. One fault may mask another, so that a second is sought after the first.
    let as_recorded = EVERY_MEASUREMENT.fit(&sessions(datasets));
    let outlying = as_recorded.as_ref().is_ok_and(|base| {
        rejected_share(base) > MAX_REJECTED_FRACTION && measurements_per_run(base) < MIN_MEASUREMENTS_PER_RUN
    });
    let first = fault(datasets, as_recorded.as_ref().ok(), &options.without, outlying);
    let second;
    let (records, base, faults): (&[Dataset], ModelFit<'_>, Vec<&Fault>) = match &first {
        None => (datasets, as_recorded?, Vec::new()),
        Some(first) => {
            let base = EVERY_MEASUREMENT.fit(&sessions(&first.records))?;
            let without = [&options.without[..], &[first.id.to_owned()]].concat();
            second = fault(&first.records, Some(&base), &without, false);
            match &second {
                None => (&first.records, base, vec![first]),
                Some(second) => {
                    let base = EVERY_MEASUREMENT.fit(&sessions(&second.records))?;
                    (&second.records, base, vec![first, second])
                }
            }
        }
    };
    begins(Step::MeanStructure);
    let base = correlated_base(records, base);
    // Stamps that are wrong: everything that comes from them is sought in records that are restamped.
    let sought = by_counts.is_none() && is_correlated(&base, &[]);
    let error = sought.then(|| stamp_error(records, &base, &every_term)).flatten();
    let whole = || by_counts.is_none().then(|| whole_stamp_error(records, &base, &every_term)).flatten();
    let error = error.or_else(whole);
    let restamped = error.as_ref().and_then(|error| {
        let fit = correlated_base(&error.records, EVERY_MEASUREMENT.fit(&sessions(&error.records)).ok()?);
        error.is_undone_by(&fit).then_some((error, fit))
    });
    let with_stamps = (by_counts.is_some() && faults.is_empty()).then(|| with_rows_of(records, recorded));
    let (stamps, as_stamped, records, base) = match restamped {
        Some((error, fit)) => (Some(error), Some((records, base)), &error.records[..], fit),
        None => {
            let fit_as_stamped = |records| Some((records, EVERY_MEASUREMENT.fit(&sessions(records)).ok()?));
            (by_counts.as_ref(), with_stamps.as_deref().and_then(fit_as_stamped), records, base)
        }
    };
    let is_open = |candidate: &Candidate| {
        stamps.is_none_or(|error| error.candidate.id() != candidate.id()) && !extrinsics::has_instead(&base, candidate)
    };
    let mut catalogue: Vec<Candidate> = every_term.into_iter().filter(is_open).collect();
    let mut structure = mean_structure(records, base, &catalogue);
    // Where the counts do not follow the robot at all, no small effect has a meaning: only one with which
    // they follow it, such as a clock that is off.
    let found = &structure.found.model;
    // A large effect makes outliers of what the calibrated model alone cannot follow.
    let share = rejected_share(&found.fit);
    if faults.is_empty() && share > MAX_REJECTED_FRACTION {
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
    if is_uncorrelated {
        catalogue.clear();
        let base = structure.base;
        structure = mean_structure(records, base, &catalogue);
    }
    // Records that were corrected are not those of which all rows were looked at.
    let (log, spans) = match large.filter(|_| faults.is_empty() && stamps.is_none()) {
        Some(large) => (large.check_rows(), large.check_spans()),
        None => (check_rows(records), check_spans(records)),
    };
    let model = structure.model();
    let names = session_names(records);
    begins(Step::CarryOver);
    let carry_over: Vec<CarryOver> =
        (0..model.candidates.len()).map(|candidate| carry_over(model, candidate, &names)).collect();
    let findings = findings(&StageResults {
        recorded,
        structure: &structure,
        log: log.as_ref(),
        spans: spans.as_ref(),
        faults: &faults,
        clocks: &clocks.offsets,
        drift: drift.as_ref().map(|found| &found.drift),
        stamps,
        anomalies,
        uncorrelated: is_uncorrelated,
        without: &options.without,
        carry_over: &carry_over,
    });
    begins(Step::Gain);
    let as_stamped = as_stamped.map(|(records, base)| match structure.correlated {
        Some(_) => THINNED.fit(&sessions(records)).unwrap_or(base),
        None => base,
    });
    let before = as_stamped.as_ref().unwrap_or(&structure.base);
    // What is reported, handed on and measured is one model.
    let carried = carried(&structure.base, model, &findings);
    let (gain, gain_why_null) = if !carried.candidates.is_empty() || stamps.is_some() {
        gain_of(before, &carried, &names)
    } else if model.candidates.is_empty() {
        (None, Some("nothing was added to the calibrated model's mean".to_owned()))
    } else {
        (None, Some("no cause is certain enough for the extended model".to_owned()))
    };
    let drift_of_runs = if faults.is_empty() {
        held_out_drift(&AugmentedModel::base(before), gain.as_ref().map(|_| &carried))
    } else {
        None
    };
    begins(Step::Detectability);
    let (sensitivity, blind_to) = detectability(model, &catalogue, &mut structure.found.known.clone());
    begins(Step::NextExperiment);
    let next = match &options.limits {
        None => Err("none was sought".to_owned()),
        Some(limits) => {
            next_experiment(records, (&structure.base, &structure.found), (model, &catalogue, &blind_to), limits)
        }
    };
    let beam = if options.beam { beam(&structure, &catalogue) } else { Vec::new() };
    let extended = crate::extended_scenario::scenario_of(records, &datasets[0].robot, &faults, stamps, &carried);
    begins(Step::Residuals);
    let residuals = residuals(&structure.base, model);
    let alternatives = alternatives(&structure.found, stamps, &findings);
    let calibration_of = |model: &AugmentedModel<'_>| CalibrationReport {
        trained_on: Vec::new(),
        dataset: Names::of(names.clone()),
        methods: vec![MethodReport::new("joint", &calibration(records, model), &records[0].robot)],
    };
    let calibrated = AugmentedModel::base(&structure.base);
    let (base, calibrated) = (calibration_of(&calibrated), FittedModel::of(&calibrated));
    let of_instrument = with_candidates(&structure.base, model, |_, candidate| candidate.is_of_instrument());
    let geometry_alone = faults.is_empty().then(|| calibration_of(&of_instrument));
    let document = Document {
        dataset: Names::of(names.clone()),
        verdict: text::verdict(&findings),
        sentence: text::summary(&findings, gain.as_ref()),
        subsample: large.map(|large| large.subsample().clone()),
        checks: structure.checked.checks.iter().chain(&log).chain(&spans).map(TestResult::document).collect(),
        findings: findings.iter().map(text::finding).collect(),
        candidates: alternatives.iter().map(text::candidate).collect(),
        blind_to,
        sensitivity,
        calibration: calibration_of(&carried),
        drift: drift_of_runs,
        gain,
        gain_why_null,
        nested: Vec::new(),
        next_experiment_why_null: next.as_ref().err().cloned(),
        next_experiment: next.ok(),
        calibration_file: None,
        extended_model: None,
        extended_model_why_null: extended.as_ref().err().cloned(),
    };
    let (found, carried) = (FittedModel::of(model), FittedModel::of(&carried));
    Ok(Staged {
        has_events: anomalies.iter().any(|anomaly| anomaly.kind == AnomalyKind::RobotOrFrame),
        outlier_share: rejected_share(&model.fit),
        diagnosis: Diagnosis {
            document,
            extended,
            residuals,
            alternatives,
            base,
            calibrated,
            found,
            carried,
            geometry_alone,
            beam,
        },
    })
}

/// The base fit, of thinned measurements where odometry seems uncorrelated with all of them: between frequent
/// measurements the robot moves less than their lasting errors, or wrong stamps, move them. A few that are
/// left and determine no wheel do not say that it is correlated.
fn correlated_base<'a>(records: &'a [Dataset], base: ModelFit<'a>) -> ModelFit<'a> {
    if is_correlated(&base, &[]) {
        return base;
    }
    match THINNED.fit(&sessions(records)) {
        Ok(thinned) if determines_wheels(&thinned, &[]) => thinned,
        _ => base,
    }
}

fn gain_of(base: &ModelFit<'_>, model: &AugmentedModel<'_>, names: &[String]) -> (Option<Gain>, Option<String>) {
    let alone = AugmentedModel::base(base);
    match gain_by_level(&alone, model, names) {
        Ok(gain) => (Some(gain), None),
        Err(why) => (None, Some(why)),
    }
}

/// The model without the terms that other sessions and paths are not known to have.
fn carried<'a>(base: &ModelFit<'a>, model: &AugmentedModel<'a>, findings: &[Finding]) -> AugmentedModel<'a> {
    with_candidates(base, model, |index, candidate| {
        let of_term = findings.iter().find(|finding| finding.term == Some(index));
        of_term.map_or(candidate.is_of_instrument(), Finding::is_in_extended_model)
    })
}

/// The model with some of its candidates alone, refitted.
fn with_candidates<'a>(
    base: &ModelFit<'a>,
    model: &AugmentedModel<'a>,
    stays: impl Fn(usize, &Candidate) -> bool,
) -> AugmentedModel<'a> {
    let of = model.candidates.iter().enumerate().filter(|(index, candidate)| stays(*index, candidate));
    let candidates: Vec<Candidate> = of.map(|(_, candidate)| candidate.clone()).collect();
    if candidates.len() == model.candidates.len() {
        return model.clone();
    }
    let others = if candidates.is_empty() { None } else { refit(base, model, candidates) };
    others.unwrap_or_else(|| AugmentedModel::base(base))
}

/// The calibration with what was found in the model.
fn calibration(datasets: &[Dataset], extended: &AugmentedModel<'_>) -> Result<Calibration, CalibError> {
    let covariance = extended.fit.covariance(&mut crate::candidate::terms(&extended.candidates));
    calibrated_drive(&extended.fit, covariance.as_ref(), datasets[0].robot.ticks_per_rev)
}
