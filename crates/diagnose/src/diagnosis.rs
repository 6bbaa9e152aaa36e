//! The order of work.

use calib::{CalibError, Calibration, CalibrationReport, MethodReport, Names};
use dataset::Dataset;
use effects::CATALOGUE;
use estimation::{EstimationError, FitSettings, JointFit};
use kinematics::DriveGeometry;
use nalgebra::DMatrix;
use scenario::Scenario;

use crate::alternatives::{Alternative, alternatives};
use crate::blind::blind;
use crate::candidate::{Choice, mean_terms};
use crate::checks::{Checked, check};
use crate::document::{Check, Document, Finding, Gain, Verdict};
use crate::gain::gain;
use crate::gross::{Fault, fault, follows, left_out, sessions, wrong_wheels};
use crate::log_rows::{self, LOG_ROWS, LOG_SPANS};
use crate::naming;
use crate::plan::{Limits, next_experiment};
use crate::residuals::{Residuals, residuals};
use crate::scatter::scatter;
use crate::search::{
    Extended, Found, Known, LEAST_REACH, MOST_EFFECTS, SCAN_LEVEL, chance, evidence, reach, search, search_every_look,
};
use crate::sizes::examine;
use crate::unlisted::{Sought, UNLISTED_LEVEL, Unlisted, lack_of_fit, sparse};

/// What to leave out.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Effects that are not to be named, by id.
    pub without: Vec<String>,
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
    /// The base model does not follow the robot, and no gross fault explains it.
    #[error(
        "the calibrated model leaves out {percent:.0} % of the looks, and no gross fault explains it: there is nothing to build on; add runs with looks on the way"
    )]
    NothingFollows {
        /// Share of looks left out.
        percent: f64,
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
    /// What the calibrated and the extended model leave, against everything recorded.
    pub residuals: Residuals,
    /// Every effect that was asked for, and what became of it.
    pub alternatives: Vec<Alternative>,
    /// The calibrated model with what was found in its mean.
    pub found: FittedModel,
}

/// A model with the terms whose sizes it has, for whoever wants to hold it against other records.
#[derive(Debug, Clone)]
pub struct FittedModel {
    /// Lengths, and sizes in the order of the terms' parameters.
    pub model: estimation::Model,
    choices: Vec<Choice>,
}

impl FittedModel {
    fn of(extended: &Extended<'_>) -> Self {
        Self { model: extended.fit.fit.model.clone(), choices: extended.choices.clone() }
    }

    /// Its terms, at the start of their lives.
    #[must_use]
    pub fn terms(&self) -> Vec<Box<dyn model_term::ModelTerm>> {
        crate::candidate::terms(&self.choices)
    }
}

/// Looks whose errors resemble the ones before by this much, and by so many standard errors, are not taken for independent.
const CORRELATED: f64 = 0.05;
const CORRELATED_SIGMAS: f64 = 4.0;

/// A model that leaves out more of the looks is none.
const MOST_LEFT_OUT: f64 = 0.2;
/// With fewer looks a run, a fit that follows nothing may have gone astray by itself: no fault is named then that the log does not show.
const LEAST_LOOKS_A_RUN: f64 = 3.0;

#[allow(clippy::cast_precision_loss)] // thousands
fn looks_a_run(fit: &JointFit<'_>) -> f64 {
    let runs = fit.fit.pass.runs.iter().filter(|run| run.count > 0.0).count();
    fit.records.looks() as f64 / runs.max(1) as f64
}

const ALL_LOOKS: FitSettings = FitSettings::GEOMETRY_ONLY;
const THINNED: FitSettings = FitSettings { nuisances: false, thin: true, thin_displacements: true };

/// Diagnoses one robot's sessions.
///
/// # Errors
/// [`DiagnoseError`] when an id is unknown or no base model can be fitted.
pub fn diagnose(datasets: &[Dataset], options: &Options) -> Result<Diagnosis, DiagnoseError> {
    diagnose_within(datasets, options, &Limits::default())
}

/// The same, with the next experiment sought within given limits.
///
/// # Errors
/// As [`diagnose`].
pub fn diagnose_within(datasets: &[Dataset], options: &Options, limits: &Limits) -> Result<Diagnosis, DiagnoseError> {
    if let Some(id) = options.without.iter().find(|id| !CATALOGUE.contains(&id.as_str())) {
        return Err(DiagnoseError::UnknownEffect { id: id.clone() });
    }
    let measured = sessions(datasets);
    let first = ALL_LOOKS.fit(&measured);
    let astray =
        first.as_ref().is_ok_and(|first| left_out(first) > MOST_LEFT_OUT && looks_a_run(first) < LEAST_LOOKS_A_RUN);
    match fault(datasets, first.as_ref().ok(), &options.without, astray) {
        Some(found) => {
            let rewritten = sessions(&found.records);
            let base = ALL_LOOKS.fit(&rewritten)?;
            // One may hide another.
            let without = [&options.without[..], &[found.id.to_owned()]].concat();
            let Some(hidden) = fault(&found.records, Some(&base), &without, false) else {
                return Ok(continued(&found.records, base, &[&found], options, limits));
            };
            let rewritten = sessions(&hidden.records);
            let base = ALL_LOOKS.fit(&rewritten)?;
            Ok(continued(&hidden.records, base, &[&found, &hidden], options, limits))
        }
        None => {
            let first = first?;
            let share = left_out(&first);
            if share > MOST_LEFT_OUT {
                return Err(DiagnoseError::NothingFollows { percent: 100.0 * share });
            }
            Ok(continued(datasets, first, &[], options, limits))
        }
    }
}

fn is_white(checked: &Checked) -> bool {
    let (coefficient, sigmas) = checked.correlation;
    coefficient.abs() < CORRELATED || (sigmas.abs() < CORRELATED_SIGMAS && !checked.resemble)
}

/// What is left after the search, and how much of it has a name.
pub(crate) struct Asked<'a> {
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

impl<'a> Asked<'a> {
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
            let unnamed = unnamed + naming::unwritten_log_odds();
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
        self.checked.checks.iter().any(|check| check.name == "outliers" && !check.passes)
    }

    /// Whether residuals go with something that was recorded.
    fn goes_with_something(&self) -> bool {
        self.checked.checks.iter().any(|check| !check.passes && is_covariate(&check.name))
    }
}

/// Family-wise rate of false alarms of the scan where a check has already found that something is there.
const SURE_LEVEL: f64 = 0.2;

fn ask<'a>(datasets: &'a [Dataset], base: JointFit<'a>, catalogue: &[Choice], restored: bool) -> Asked<'a> {
    let found = search(&base, catalogue, SCAN_LEVEL, Known::default());
    let checked = check(&found.model);
    let mut asked =
        Asked { base, found, checked, unlisted: None, correlated: None, in_disguise: false, rivalled: None };
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

/// What residuals go with by less chance than this, no scatter makes them go with.
const BEYOND_SCATTER: f64 = 1e-8;

/// Whether a check asks what residuals go with, not how they scatter.
pub(crate) fn is_covariate(name: &str) -> bool {
    !["nis_", "white_", "kurtosis_"].iter().any(|start| name.starts_with(start))
        && !["outliers", "run_to_run", LOG_ROWS, LOG_SPANS].contains(&name)
}

fn continued(
    datasets: &[Dataset],
    base: JointFit<'_>,
    faults: &[&Fault],
    options: &Options,
    limits: &Limits,
) -> Diagnosis {
    // Where the counts do not follow the robot at all, no small effect has a meaning.
    let lost = !follows(&base);
    let catalogue = if lost { Vec::new() } else { mean_terms(&options.without) };
    // What lies far off by counts that are restored roughly has its name already.
    let is_rough =
        |id| effects::description(id).is_some_and(|description| description.record_fault.is_restored_roughly);
    let restored = faults.iter().any(|fault| is_rough(fault.id));
    let asked = ask(datasets, base, &catalogue, restored);
    let mut findings: Vec<Finding> = faults.iter().map(|fault| naming::of_fault(fault)).collect();
    findings.extend(naming::of_search(&asked.found));
    let model = asked.model();
    if let Some(chance) = asked.rivalled {
        naming::beside_unlisted(&mut findings, chance);
    }
    for (place, p_value, trials) in asked.unlisted.iter().flat_map(Unlisted::terms) {
        let test = examine(model, place).map(|(test, _)| test);
        findings.extend(test.and_then(|test| naming::of_sparse(&model.choices[place], &test, p_value, trials)));
    }
    if lost {
        findings.extend(naming::of_lost(&asked.base));
    } else if !restored {
        // What has a size is not told again by its sign.
        let told = |sign: &Finding| findings.iter().any(|finding| sign.names.contains(&finding.id));
        let signs: Vec<Finding> = scatter(&asked, options).into_iter().filter(|sign| !told(sign)).collect();
        findings.extend(signs);
    }
    let (log, spans) = (log_rows::check(datasets), log_rows::check_spans(datasets));
    let wheels = if lost { None } else { wrong_wheels(&asked.base) };
    let wheels = wheels.and_then(|factor| naming::of_wrong_wheels(factor, &options.without));
    let of_log = naming::of_rows_astray(log.as_ref()).into_iter().chain(naming::of_spans(spans.as_ref()));
    let (nameless, named): (Vec<_>, Vec<_>) = of_log.chain(wheels).partition(|finding| finding.id == "unlisted");
    findings.extend(named);
    if !nameless.is_empty() {
        // With times in other units even a gross fault may be an accident.
        let sound = spans.as_ref().is_none_or(|check| check.passes);
        for finding in &mut findings[if sound { faults.len() } else { 0 }..] {
            naming::or_unlisted(finding, 1.0, "what is wrong with the records may do the same");
        }
    }
    findings.extend(nameless);
    // Something is left that no name explains; a failed check that a scatter explains has its name already.
    let plainly = |check: &Check| !check.passes && is_covariate(&check.name) && check.p_value < BEYOND_SCATTER;
    let scatters = findings.iter().any(is_scatter) && !asked.checked.checks.iter().any(plainly);
    let told = asked.unlisted.is_some() || findings.iter().any(|finding| finding.id == "unlisted");
    if !(restored || scatters || told) {
        findings.extend(naming::of_failed_checks(&asked.checked));
    }
    naming::doubt(&mut findings[faults.len()..], asked.found.model.choices.len() >= MOST_EFFECTS);
    // A term without a name that stands out beside all that was found, though not by enough to be a finding.
    if findings.iter().any(naming::is_sure)
        && let Some(left) = lack_of_fit(&asked.base, model)
    {
        naming::or_incomplete(&mut findings, left);
    }
    naming::or_faint(&mut findings);
    // The plainest first; a gross fault before everything, as everything else was asked of the records without it.
    findings[faults.len()..].sort_by(|a, b| b.z.total_cmp(&a.z));
    let (gain, gain_why_null) = gain_of(&asked.base, model);
    let (sensitivity, blind_to) = blind(model, &catalogue, &mut asked.found.known.clone());
    let next = next_experiment(datasets, (&asked.base, &asked.found), (model, &catalogue, &blind_to), limits);
    let verdict = verdict(&findings);
    let extended = crate::scenario_of::scenario_of(datasets, model);
    let residuals = residuals(&asked.base, model);
    let alternatives = alternatives(&asked.found, &findings);
    let names: Vec<String> = datasets
        .iter()
        .map(|dataset| dataset.provenance.name.clone().unwrap_or_else(|| "dataset".to_owned()))
        .collect();
    let document = Document {
        dataset: Names::of(names.clone()),
        verdict,
        sentence: sentence(verdict, &findings, gain.as_ref()),
        checks: asked.checked.checks.iter().cloned().chain(log).chain(spans).collect(),
        findings,
        blind_to,
        sensitivity,
        calibration: CalibrationReport {
            dataset: Names::of(names),
            methods: vec![MethodReport::new("joint", &calibration(datasets, model), &datasets[0].robot)],
        },
        gain,
        gain_why_null,
        next_experiment_why_null: next.as_ref().err().cloned(),
        next_experiment: next.ok(),
        extended_model: None,
        extended_model_why_null: extended.as_ref().err().cloned(),
    };
    let found = FittedModel::of(model);
    Diagnosis { document, extended, residuals, alternatives, found }
}

fn is_scatter(finding: &Finding) -> bool {
    match effects::hypothesis(&finding.id) {
        Some(effects::Hypothesis::Scatter(_)) => true,
        // Found by its sign it has no sizes.
        Some(effects::Hypothesis::TermsAndScatter(..)) => finding.parameters.is_empty(),
        _ => false,
    }
}

fn gain_of(base: &JointFit<'_>, model: &Extended<'_>) -> (Option<Gain>, Option<String>) {
    if model.choices.is_empty() {
        return (None, Some("nothing was added to the calibrated model's mean".to_owned()));
    }
    let alone = Extended::alone(base);
    match gain(&alone, model) {
        Ok(gain) => (Some(gain), None),
        Err(why) => (None, Some(why)),
    }
}

fn verdict(findings: &[Finding]) -> Verdict {
    if findings.is_empty() {
        Verdict::Consistent
    } else if findings.iter().any(|finding| finding.id == "unlisted") {
        Verdict::Unlisted
    } else if findings.iter().any(|finding| finding.names.len() > 1) {
        Verdict::Ambiguous
    } else {
        Verdict::Named
    }
}

fn sentence(verdict: Verdict, findings: &[Finding], gain: Option<&Gain>) -> String {
    let names = |finding: &Finding| {
        let names = finding.names.join(" or ");
        // What has no name is told by what it goes with.
        finding.unlisted_term.as_ref().map_or_else(
            || names.clone(),
            |term| format!("{names} ({} with {})", term.channel, term.covariates.join(" · ")),
        )
    };
    let names: Vec<String> = findings.iter().map(names).collect();
    let gains = match gain {
        Some(gain) if gain.log_score_per_observation.low > 0.0 => "; the extended model predicts unseen runs better",
        Some(_) => "; on unseen runs the extended model gains nothing that is certain",
        None => "",
    };
    match verdict {
        Verdict::Consistent => "the calibrated model explains what was measured".to_owned(),
        Verdict::Named => format!("found: {}{gains}", names.join(", ")),
        Verdict::Ambiguous => {
            format!("found, with names that this data cannot tell apart: {}{gains}", names.join("; "))
        }
        Verdict::Unlisted => format!("found, and not all of it has a name: {}{gains}", names.join(", ")),
    }
}

/// The calibration with what was found in the model.
fn calibration(datasets: &[Dataset], extended: &Extended<'_>) -> Result<Calibration, CalibError> {
    let fit = &extended.fit;
    let model = &fit.fit.model;
    let not_physical =
        |why: kinematics::GeometryError| CalibError::NotApplicable { method: "joint", why: why.to_string() };
    let geometry = DriveGeometry::new(model.m_per_rad.map(|m_per_rad| 2.0 * m_per_rad), model.separation_m)
        .map_err(not_physical)?;
    let diameter_m = geometry.wheel_diameter_m();
    let sizes = [diameter_m.left, diameter_m.right, model.separation_m];
    let covariance = fit.covariance(&mut crate::candidate::terms(&extended.choices));
    Ok(Calibration {
        covariance: covariance
            .as_ref()
            .map(|covariance| DMatrix::from_fn(3, 3, |i, j| covariance[(i, j)] * sizes[i] * sizes[j])),
        not_observable: calib::methods::joint::not_observable(fit),
        runs_used: fit.fit.pass.runs.iter().filter(|run| run.count > 0.0).count(),
        converged: fit.fit.converged,
        ..Calibration::new("joint", geometry, datasets[0].robot.ticks_per_rev)
    })
}
