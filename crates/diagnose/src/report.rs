//! What the stages of a diagnosis found out, and the diagnosis that is made of it: findings, gain, limits,
//! the next experiment, and the document.

use calib::methods::joint::calibrated_drive;
use calib::{CalibError, Calibration, CalibrationReport, MethodReport, Names};
use dataset::Dataset;
use estimation::{FitSettings, ModelFit};
use scenario::Scenario;

use crate::candidates::candidate::Candidate;
use crate::carry_over::{CarryOver, carry_over};
use crate::checks::check::TestResult;
use crate::checks::residuals::{Residuals, residuals};
use crate::document::{Document, Gain, HeldOutDrift};
use crate::findings::alternatives::{Alternative, alternatives};
use crate::findings::detectability::detectability;
use crate::findings::finding::Finding;
use crate::findings::stages::{StageResults, findings};
use crate::fits::augmented_model::{AugmentedModel, refit};
use crate::gain::extended_scenario::scenario_of;
use crate::gain::{gain_by_level, held_out_drift};
use crate::options::Options;
use crate::plan::next_experiment;
use crate::records::log::Log;
use crate::records::log_rows::{check_rows, check_spans};
use crate::records::names::session_names;
use crate::records::prepared::Prepared;
use crate::records::record_faults::{Fault, rejected_share, sessions};
use crate::records::stamp_errors::StampError;
use crate::search::beam::{ComparedModel, beam};
use crate::search::mean_structure::{MeanStructure, THINNED};
use crate::stage::Step;
use crate::text;

pub(crate) const EVERY_MEASUREMENT: FitSettings = FitSettings::GEOMETRY_ONLY;

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
    /// Share of the measurements that are outliers with all that was found.
    pub(crate) outlier_share: f64,
}

/// A model with its terms, to be compared with other records.
#[derive(Debug, Clone)]
pub struct FittedModel {
    /// Geometry, and values in the order of the terms' parameters.
    pub model: estimation::Model,
    pub(crate) candidates: Vec<Candidate>,
}

impl Diagnosis {
    /// Whether what was found with all intervals compared explains what happened in those that another
    /// diagnosis cuts: as a castor turns a robot wherever it reverses. Where it does not, what follows an
    /// event are outliers.
    pub(crate) fn explains_events_of(&self, cut: &Self) -> bool {
        !self.found.candidates.is_empty() && self.outlier_share <= cut.outlier_share
    }
}

impl FittedModel {
    fn of(extended: &AugmentedModel<'_>) -> Self {
        Self { model: extended.fit.solution.model.clone(), candidates: extended.candidates.clone() }
    }

    /// Its terms, in their initial states.
    #[must_use]
    pub fn terms(&self) -> Vec<Box<dyn model_term::ModelTerm>> {
        crate::candidates::candidate::terms(&self.candidates)
    }
}

/// Records with their stamps as they were, and the base fit to them: what a gain is over.
pub(crate) struct AsStamped<'a> {
    pub(crate) records: &'a [Dataset],
    pub(crate) base: ModelFit<'a>,
}

impl<'a> AsStamped<'a> {
    pub(crate) fn of(records: &'a [Dataset]) -> Option<Self> {
        Some(Self { records, base: EVERY_MEASUREMENT.fit(&sessions(records)).ok()? })
    }
}

/// What the stages came to: the log explained.
pub(crate) struct Explained<'s, 'a> {
    pub(crate) log: Log<'s>,
    pub(crate) prepared: &'s Prepared<'s>,
    pub(crate) faults: &'s [&'s Fault],
    pub(crate) stamps: Option<&'s StampError>,
    pub(crate) as_stamped: Option<AsStamped<'a>>,
    /// As effects were sought in them.
    pub(crate) records: &'a [Dataset],
    pub(crate) structure: MeanStructure<'a>,
    /// What was open to the search.
    pub(crate) catalogue: Vec<Candidate>,
    /// The odometry is uncorrelated with what the instrument measured.
    pub(crate) uncorrelated: bool,
}

/// The tests of the log itself: its rows, and its time span.
struct LogTests {
    rows: Option<TestResult>,
    spans: Option<TestResult>,
}

impl<'a> Explained<'_, 'a> {
    fn log_tests(&self) -> LogTests {
        // Records that were corrected are not those of which all rows were looked at.
        match self.log.large.filter(|_| self.faults.is_empty() && self.stamps.is_none()) {
            Some(large) => LogTests { rows: large.check_rows(), spans: large.check_spans() },
            None => LogTests { rows: check_rows(self.records), spans: check_spans(self.records) },
        }
    }

    fn findings(&self, tests: &LogTests, names: &[String], without: &[String]) -> Vec<Finding> {
        let model = self.structure.model();
        let carry_over: Vec<CarryOver> =
            (0..model.candidates.len()).map(|candidate| carry_over(model, candidate, names)).collect();
        findings(&StageResults {
            recorded: self.log.datasets,
            structure: &self.structure,
            log: tests.rows.as_ref(),
            spans: tests.spans.as_ref(),
            faults: self.faults,
            clocks: &self.prepared.clocks.offsets,
            drift: self.prepared.clocks.drift.as_ref(),
            stamps: self.stamps,
            anomalies: self.prepared.anomalies(),
            uncorrelated: self.uncorrelated,
            without,
            carry_over: &carry_over,
        })
    }

    /// The base fit that a gain is over.
    fn before(&self) -> ModelFit<'a> {
        let Some(AsStamped { records, base }) = &self.as_stamped else { return self.structure.base.clone() };
        let thinned = self.structure.correlated.and_then(|_| THINNED.fit(&sessions(records)).ok());
        thinned.unwrap_or_else(|| base.clone())
    }

    /// The diagnosis.
    pub(crate) fn diagnosis(self, options: &Options) -> Diagnosis {
        let begins = |step| options.on_stage.begins(step);
        let Self { records, structure, catalogue, .. } = &self;
        let names = session_names(records);
        begins(Step::CarryOver);
        let tests = self.log_tests();
        let findings = self.findings(&tests, &names, &options.without);
        begins(Step::Gain);
        let before = self.before();
        // What is reported, handed on and measured is one model.
        let model = structure.model();
        let carried = carried(&structure.base, model, &findings);
        let gain = gain(&before, &carried, &names, self.stamps.is_some(), model.candidates.is_empty());
        let drift = held_out(&before, gain.is_ok().then_some(&carried), self.faults.is_empty());
        begins(Step::Detectability);
        let (sensitivity, blind_to) = detectability(model, catalogue, &mut structure.found.known.clone());
        begins(Step::NextExperiment);
        let next = match &options.limits {
            None => Err("none was sought".to_owned()),
            Some(limits) => {
                next_experiment(records, &structure.base, &structure.found, model, catalogue, &blind_to, limits)
            }
        };
        let extended = scenario_of(records, &self.log.datasets[0].robot, self.faults, self.stamps, &carried);
        begins(Step::Residuals);
        let residuals = residuals(&structure.base, model);
        let alternatives = alternatives(&structure.found, self.stamps, &findings);
        let calibrated = AugmentedModel::base(&structure.base);
        let of_instrument = with_candidates(&structure.base, model, |_, candidate| candidate.is_of_instrument());
        let report_of = |model: &AugmentedModel<'_>| calibration_report(records, model, &names);
        let checks = structure.checked.checks.iter().chain(&tests.rows).chain(&tests.spans);
        let document = Document {
            dataset: Names::of(names.clone()),
            verdict: text::verdict(&findings),
            sentence: text::summary(&findings, gain.as_ref().ok()),
            subsample: self.log.large.map(|large| large.subsample().clone()),
            checks: checks.map(TestResult::document).collect(),
            findings: findings.iter().map(text::finding).collect(),
            candidates: alternatives.iter().map(text::candidate).collect(),
            blind_to,
            sensitivity,
            calibration: report_of(&carried),
            drift,
            gain_why_null: gain.as_ref().err().cloned(),
            gain: gain.ok(),
            nested: Vec::new(),
            next_experiment_why_null: next.as_ref().err().cloned(),
            next_experiment: next.ok(),
            calibration_file: None,
            extended_model: None,
            extended_model_why_null: extended.as_ref().err().cloned(),
        };
        Diagnosis {
            document,
            extended,
            residuals,
            alternatives,
            base: report_of(&calibrated),
            calibrated: FittedModel::of(&calibrated),
            found: FittedModel::of(model),
            carried: FittedModel::of(&carried),
            beam: if options.beam { beam(structure, catalogue) } else { Vec::new() },
            outlier_share: rejected_share(&model.fit),
            geometry_alone: self.faults.is_empty().then(|| report_of(&of_instrument)),
        }
    }
}

/// The gain of the model that is handed on, or why there is none.
fn gain(
    before: &ModelFit<'_>,
    carried: &AugmentedModel<'_>,
    names: &[String],
    is_restamped: bool,
    is_nothing_found: bool,
) -> Result<Gain, String> {
    if !carried.candidates.is_empty() || is_restamped {
        gain_by_level(&AugmentedModel::base(before), carried, names)
    } else if is_nothing_found {
        Err("nothing was added to the calibrated model's mean".to_owned())
    } else {
        Err("no cause is certain enough for the extended model".to_owned())
    }
}

/// The drift of held-out runs; `None` where the records had a fault.
fn held_out(before: &ModelFit<'_>, carried: Option<&AugmentedModel<'_>>, has_no_fault: bool) -> Option<HeldOutDrift> {
    if has_no_fault { held_out_drift(&AugmentedModel::base(before), carried) } else { None }
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

fn calibration_report(records: &[Dataset], model: &AugmentedModel<'_>, names: &[String]) -> CalibrationReport {
    CalibrationReport {
        trained_on: Vec::new(),
        dataset: Names::of(names.to_vec()),
        methods: vec![MethodReport::new("joint", &calibration(records, model), &records[0].robot)],
    }
}

/// The calibration with what was found in the model.
fn calibration(datasets: &[Dataset], extended: &AugmentedModel<'_>) -> Result<Calibration, CalibError> {
    let covariance = extended.fit.covariance(&mut crate::candidates::candidate::terms(&extended.candidates));
    calibrated_drive(&extended.fit, covariance.as_ref(), datasets[0].robot.ticks_per_rev)
}
