//! The findings in one list: record faults, mean effects, sparse terms, noise effects, faults of the log;
//! and the doubts that they cast on each other. [`findings`] lists the stages in their order.

use dataset::Dataset;
use effects::GeometryRatio;
use rules::Rule;

use preflight::ClockDrift;

use crate::candidates::cause::{Basis, Doubt};
use crate::carry_over::CarryOver;
use crate::checks::check::TestResult;
use crate::findings::anomaly_findings::of_anomalies;
use crate::findings::extrinsics;
use crate::findings::finding;
use crate::findings::finding::Finding;
use crate::findings::geometry_deviations::remaining_deviations;
use crate::findings::lack_of_fit::lack_of_fit;
use crate::findings::mean_lateness::join_clock;
use crate::findings::noise_effects::scatter;
use crate::findings::systematic_errors::without_systematic_errors;
use crate::fits::wald::wald_test;
use crate::records::clocks::ClockOffset;
use crate::records::record_faults::{Fault, wrong_wheels};
use crate::records::stamp_errors::{StampError, have_uncertain_rows};
use crate::records::unknown_motion::Anomaly;
use crate::search::mean_structure::MeanStructure;
use crate::search::sparse_terms::UncataloguedTerms;
use crate::settings::{FINDINGS, LEVELS};

fn is_scatter(finding: &Finding) -> bool {
    match effects::hypothesis(finding.first().id()) {
        Some(effects::Hypothesis::Scatter(_)) => true,
        // Found by its sign it has no sizes.
        Some(effects::Hypothesis::TermsAndScatter(..)) => finding.parameters.is_empty(),
        _ => false,
    }
}

/// What the stages of the diagnosis before found out.
pub(crate) struct StageResults<'e, 'a> {
    /// The datasets as they were recorded.
    pub(crate) recorded: &'e [Dataset],
    pub(crate) structure: &'e MeanStructure<'a>,
    /// The tests of the log itself: its rows, and its time span.
    pub(crate) log: Option<&'e TestResult>,
    pub(crate) spans: Option<&'e TestResult>,
    pub(crate) faults: &'e [&'e Fault],
    pub(crate) clocks: &'e [ClockOffset],
    /// A drift of all clocks that was set right before the fit.
    pub(crate) drift: Option<&'e ClockDrift>,
    /// What was wrong with the log's stamps.
    pub(crate) stamps: Option<&'e StampError>,
    /// Runs and intervals that do not belong.
    pub(crate) anomalies: &'e [Anomaly],
    /// The odometry is uncorrelated with what the instrument measured.
    pub(crate) uncorrelated: bool,
    /// Effects that are not to be named.
    pub(crate) without: &'e [String],
    /// Whether each term of the model's mean carries over.
    pub(crate) carry_over: &'e [CarryOver],
}

impl StageResults<'_, '_> {
    /// Lost counts or stamps were restored roughly: they explain outliers and autocorrelated errors that are
    /// left.
    fn restored(&self) -> bool {
        self.faults.iter().any(|fault| fault.is_restored_roughly())
            || self.stamps.is_some_and(|stamps| stamps.is_undone_roughly)
    }
}

/// A stage: the findings so far, record faults first, to those after it.
type Stage = fn(&StageResults<'_, '_>, Vec<Finding>) -> Vec<Finding>;

/// The findings, record faults first, then by significance.
pub(crate) fn findings(results: &StageResults<'_, '_>) -> Vec<Finding> {
    let stages: [(Option<Rule>, Stage); 19] = [
        (None, record_faults),
        (Some(Rule::ExtrinsicsFound), extrinsics),
        (None, mean_effects),
        (None, clocks),
        (None, stamps),
        (Some(Rule::MeanLateness), mean_lateness),
        (None, anomalies),
        (None, sparse_terms),
        (None, noise_effects),
        (None, faults_of_the_log),
        (Some(Rule::FailedChecks), failed_checks),
        (Some(Rule::PartOfStronger), doubt_parts_of_stronger_findings),
        (None, doubt_incomplete_models),
        (Some(Rule::WithoutWhatDoubtsSay), without_what_doubts_say),
        (Some(Rule::LowSignificance), doubt_low_significance),
        (None, doubt_what_does_not_carry_over),
        (Some(Rule::SystematicErrors), without_errors_of_the_map),
        (Some(Rule::RemaindersOfStamps), without_remainders_of_stamps),
        (None, by_significance),
    ];
    stages.into_iter().fold(Vec::new(), |findings, (rule, stage)| match rule {
        Some(rule) => rule.changes(findings, |findings| stage(results, findings)),
        None => stage(results, findings),
    })
}

fn record_faults(results: &StageResults<'_, '_>, _: Vec<Finding>) -> Vec<Finding> {
    results.faults.iter().map(|fault| finding::of_fault(fault)).collect()
}

/// Extrinsics that were fitted before effects were sought.
fn extrinsics(results: &StageResults<'_, '_>, mut findings: Vec<Finding>) -> Vec<Finding> {
    // Extrinsics of a motion that is not the robot's are none.
    if !results.uncorrelated {
        findings.extend(extrinsics::of_model(results.structure.model(), results.without));
    }
    findings
}

/// Effects of the mean; where one uncatalogued term explains nearly as much, with that doubt.
fn mean_effects(results: &StageResults<'_, '_>, mut findings: Vec<Finding>) -> Vec<Finding> {
    findings.extend(finding::of_search(&results.structure.found));
    if let Some(relative_odds) = results.structure.competing {
        finding::beside_unlisted(&mut findings, relative_odds);
    }
    findings
}

/// Clocks that were set right before the fit, or whose runs were left out.
fn clocks(results: &StageResults<'_, '_>, mut findings: Vec<Finding>) -> Vec<Finding> {
    if let Some(drift) = results.drift {
        let found = finding::of_drift(drift, results.without);
        let is_named = !found.is_unlisted();
        // What is left of it, by the error of its estimate, may resemble other errors of the clocks.
        findings.retain(|own| !is_named || own.first() == found.first() || !own.names(found.first()));
        if !is_named || !finding::add_offset(&mut findings, &found) {
            findings.push(found);
        }
    }
    for offset in results.clocks {
        let found = finding::of_clock(offset, results.without);
        if offset.runs.is_some() || !finding::add_offset(&mut findings, &found) {
            findings.push(found);
        }
    }
    findings
}

/// Stamps that were set right before effects were sought.
fn stamps(results: &StageResults<'_, '_>, mut findings: Vec<Finding>) -> Vec<Finding> {
    findings.extend(results.stamps.map(finding::of_stamps));
    findings
}

/// What all stamps are late by, which the instrument's clock shows.
fn mean_lateness(results: &StageResults<'_, '_>, mut findings: Vec<Finding>) -> Vec<Finding> {
    join_clock(&mut findings, results.stamps, results.recorded);
    findings
}

/// Intervals across which nothing was compared, and runs that were left out.
fn anomalies(results: &StageResults<'_, '_>, mut findings: Vec<Finding>) -> Vec<Finding> {
    findings.extend(of_anomalies(results.anomalies, results.without));
    findings
}

fn sparse_terms(results: &StageResults<'_, '_>, mut findings: Vec<Finding>) -> Vec<Finding> {
    let model = results.structure.model();
    for (index, p_value, trials) in results.structure.unlisted.iter().flat_map(UncataloguedTerms::terms) {
        let test = wald_test(model, index).map(|(test, _)| test);
        let found = test.and_then(|test| finding::of_sparse(&model.candidates[index], &test, p_value, trials));
        findings.extend(found.map(|found| Finding { term: Some(index), ..found }));
    }
    findings
}

/// Noise effects, or that odometry is uncorrelated with the measurements. A mean effect of the same cause
/// excludes a noise effect.
fn noise_effects(results: &StageResults<'_, '_>, mut findings: Vec<Finding>) -> Vec<Finding> {
    if results.uncorrelated {
        findings.push(finding::of_uncorrelated(&results.structure.base));
    } else if !results.restored() {
        let mut signs = scatter(results.structure, results.recorded, results.without);
        signs.retain(|sign| {
            let is_named = findings.iter().any(|finding| sign.names(finding.first()));
            !Rule::NamedAlready.applies(is_named)
        });
        findings.extend(signs);
    }
    findings
}

/// What the log or the wheels' sizes show. Faults without a name cast doubt on all findings before them.
fn faults_of_the_log(results: &StageResults<'_, '_>, mut findings: Vec<Finding>) -> Vec<Finding> {
    let StageResults { structure, log, spans, faults, without, .. } = *results;
    let wheels = if results.uncorrelated { None } else { wrong_wheels(&structure.base) };
    let mut deviations =
        if results.uncorrelated { Vec::new() } else { remaining_deviations(&structure.base, structure.model()) };
    // Another robot's counts say more than another robot's wheels.
    deviations.retain(|deviation| wheels.is_none() || deviation.of != GeometryRatio::Wheels);
    // An effect that is found beside another robot's geometry may be what the geometry is wrong by, and
    // errors that are autocorrelated may be what the wheels of another robot leave.
    if wheels.is_some() || deviations.iter().any(|deviation| !deviation.is_of_skid_steering()) {
        let is_autocorrelated = |finding: &Finding| matches!(finding.basis, Basis::Autocorrelated(..));
        let may_be_rest =
            |finding: &&mut Finding| finding.is_certain() || (is_autocorrelated(finding) && !finding.has_unlisted());
        for finding in findings.iter_mut().filter(may_be_rest).filter(|_| Rule::OtherGeometryDoubts.applies(true)) {
            finding.or_unlisted(1.0, Doubt::OtherGeometry);
        }
    }
    let wheels = wheels.and_then(|factor| finding::of_wrong_wheels(factor, without));
    let geometry = deviations.into_iter().map(|deviation| finding::of_geometry(deviation, without));
    let wheels = wheels.into_iter().chain(geometry);
    // Rows whose counts or stamps were restored roughly lie off by what is left.
    let log = log.filter(|_| !results.restored());
    let of_log = finding::of_outlying_rows(log).into_iter().chain(finding::of_spans(spans));
    let (nameless, named): (Vec<_>, Vec<_>) = of_log.chain(wheels).partition(Finding::is_unlisted);
    findings.extend(named);
    if !nameless.is_empty() {
        // Where times are in other units, a record fault may be an accident too.
        let sound = spans.is_none_or(|check| check.passes);
        for finding in &mut findings[if sound { faults.len() } else { 0 }..] {
            if Rule::FaultyRecordsDoubt.applies(true) {
                finding.or_unlisted(1.0, Doubt::FaultyRecords);
            }
        }
    }
    findings.extend(nameless);
    findings
}

/// Failed checks that no finding explains. A noise effect explains failed checks, unless residuals depend
/// on something too plainly.
fn failed_checks(results: &StageResults<'_, '_>, mut findings: Vec<Finding>) -> Vec<Finding> {
    let StageResults { structure, .. } = results;
    let plainly = |test: &TestResult| test.shows_dependence() && test.p_value < FINDINGS.dependence_beyond_noise_level;
    let scatters = findings.iter().any(is_scatter) && !structure.checked.checks.iter().any(plainly);
    let is_reported = structure.unlisted.is_some() || findings.iter().any(Finding::is_unlisted);
    if !(results.restored() || scatters || is_reported) {
        let refusals = structure.found.refusals.iter();
        let refused = refusals.filter(|(_, refusal)| refusal.is_for_other_runs()).map(|(id, _)| *id);
        findings.extend(finding::of_failed_checks(&structure.checked, results.without, refused));
    }
    findings
}

fn doubt_parts_of_stronger_findings(results: &StageResults<'_, '_>, mut findings: Vec<Finding>) -> Vec<Finding> {
    let full = results.structure.found.model.candidates.len() >= LEVELS.max_effects;
    finding::doubt(&mut findings[results.faults.len()..], full);
    findings
}

/// Effects whose data have another form than they have, and an uncatalogued term that is significant beside
/// all that was found, though not by enough to be a finding.
fn doubt_incomplete_models(results: &StageResults<'_, '_>, mut findings: Vec<Finding>) -> Vec<Finding> {
    if !findings.iter().any(Finding::is_certain) {
        return findings;
    }
    let model = results.structure.model();
    let effects: Vec<usize> =
        findings.iter().filter(|finding| finding.is_certain()).filter_map(|finding| finding.term).collect();
    let left = lack_of_fit(&results.structure.base, model, &effects);
    for (index, deviation) in left.of_forms {
        let has_exact_form = model.candidates[index].has_exact_form();
        if let Some(finding) = findings.iter_mut().find(|finding| finding.term == Some(index)) {
            *finding = Rule::OtherForm.changes(finding.clone(), |mut finding| {
                finding::or_of_other_form(&mut finding, deviation, has_exact_form);
                finding
            });
        }
    }
    if let Some((score, p_value)) = left.of_products {
        findings = Rule::Incomplete.changes(findings, |mut findings| {
            finding::or_incomplete(&mut findings, score, p_value);
            findings
        });
    }
    findings
}

/// Failed checks say what is said already of an effect that is plainer than they are, and does not explain
/// all that is there.
fn without_what_doubts_say(_: &StageResults<'_, '_>, mut findings: Vec<Finding>) -> Vec<Finding> {
    let is_incomplete = |doubt: &Doubt| matches!(doubt, Doubt::Incomplete | Doubt::OtherForm(_));
    let incomplete = findings.iter().filter(|finding| finding.doubts.iter().any(is_incomplete));
    let plainest = incomplete.map(|finding| finding.z).fold(0.0, f64::max);
    findings.retain(|finding| !matches!(finding.basis, Basis::FailedTests(_)) || finding.z >= plainest);
    findings
}

fn doubt_low_significance(_: &StageResults<'_, '_>, mut findings: Vec<Finding>) -> Vec<Finding> {
    finding::or_of_low_significance(&mut findings);
    findings
}

/// A term that some session or kind of path does not have as the others give it shares its place: what else
/// was special there does as well.
fn doubt_what_does_not_carry_over(results: &StageResults<'_, '_>, mut findings: Vec<Finding>) -> Vec<Finding> {
    for finding in &mut findings {
        finding.carry_over = finding.term.and_then(|term| results.carry_over.get(term)).cloned();
        let is_refuted = finding.carry_over.as_ref().is_some_and(|of| of.carries_over == Some(false));
        if Rule::DoesNotCarryOver.applies(is_refuted && !finding.is_unlisted()) {
            finding.or_unlisted(1.0, Doubt::DoesNotCarryOver);
        }
    }
    findings
}

/// What the instrument's map explains by its errors, which return with the place.
fn without_errors_of_the_map(results: &StageResults<'_, '_>, mut findings: Vec<Finding>) -> Vec<Finding> {
    without_systematic_errors(&mut findings, &results.structure.base, results.structure.model());
    findings
}

/// Stamps that were set right only roughly, or that a term explains which does not know of which tick all
/// rows are, leave errors that no term is of. Where something that is in no catalogue explains the data as
/// well as what was found, that is what they left.
fn without_remainders_of_stamps(results: &StageResults<'_, '_>, mut findings: Vec<Finding>) -> Vec<Finding> {
    // Of a negative share the stamps are true.
    let is_of_late_stamps = |finding: &Finding| {
        finding.is_of_stamps() && finding.parameters.get("share").is_none_or(|share| share.value > 0.0)
    };
    let are_rough = match results.stamps {
        Some(stamps) => stamps.is_undone_roughly,
        None => findings.iter().any(is_of_late_stamps) && have_uncertain_rows(results.recorded),
    };
    if are_rough {
        findings.retain(|finding| finding.is_of_stamps() || !finding.has_unlisted());
    }
    findings
}

/// Record faults stay first: everything else is found in the records without them.
fn by_significance(results: &StageResults<'_, '_>, mut findings: Vec<Finding>) -> Vec<Finding> {
    findings[results.faults.len()..].sort_by(|a, b| b.z.total_cmp(&a.z));
    findings
}

#[cfg(test)]
mod tests;
