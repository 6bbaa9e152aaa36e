//! The findings of all stages in one list: record faults, effects of the mean, sparse terms, noise effects, faults of the log; each with the doubts that the others cast on it.

use crate::cause::Doubt;
use crate::check::TestResult;
use crate::finding;
use crate::finding::Finding;
use crate::mean_structure::MeanStructure;
use crate::noise_effects::scatter;
use crate::record_faults::{Fault, wrong_wheels};
use crate::settings::MAX_EFFECTS;
use crate::sparse_terms::{UncataloguedTerms, lack_of_fit};
use crate::wald::wald_test;

/// What residuals go with by less chance than this, no scatter makes them go with.
const BEYOND_SCATTER: f64 = 1e-8;

fn is_scatter(finding: &Finding) -> bool {
    match effects::hypothesis(finding.first().id()) {
        Some(effects::Hypothesis::Scatter(_)) => true,
        // Found by its sign it has no sizes.
        Some(effects::Hypothesis::TermsAndScatter(..)) => finding.parameters.is_empty(),
        _ => false,
    }
}

/// The findings, record faults first and then those of the highest significance. `log`, `spans`: the tests of the log itself; `lost`: the odometry is uncorrelated with what the instrument measured.
pub(crate) fn findings(
    asked: &MeanStructure<'_>,
    (log, spans): (Option<&TestResult>, Option<&TestResult>),
    faults: &[&Fault],
    lost: bool,
    without: &[String],
) -> Vec<Finding> {
    // What lies far off by counts that are restored roughly has its name already.
    let restored = faults.iter().any(|fault| fault.is_restored_roughly());
    let mut findings: Vec<Finding> = faults.iter().map(|fault| finding::of_fault(fault)).collect();
    findings.extend(finding::of_search(&asked.found));
    let model = asked.model();
    if let Some(relative_odds) = asked.competing {
        finding::beside_unlisted(&mut findings, relative_odds);
    }
    for (index, p_value, trials) in asked.unlisted.iter().flat_map(UncataloguedTerms::terms) {
        let test = wald_test(model, index).map(|(test, _)| test);
        findings.extend(test.and_then(|test| finding::of_sparse(&model.candidates[index], &test, p_value, trials)));
    }
    if lost {
        findings.push(finding::of_lost(&asked.base));
    } else if !restored {
        // What has a size is not told again by its sign.
        let told = |sign: &Finding| findings.iter().any(|finding| sign.names(finding.first()));
        let signs: Vec<Finding> = scatter(asked, without).into_iter().filter(|sign| !told(sign)).collect();
        findings.extend(signs);
    }
    let wheels = if lost { None } else { wrong_wheels(&asked.base) };
    let wheels = wheels.and_then(|factor| finding::of_wrong_wheels(factor, without));
    let of_log = finding::of_outlying_rows(log).into_iter().chain(finding::of_spans(spans));
    let (nameless, named): (Vec<_>, Vec<_>) = of_log.chain(wheels).partition(Finding::is_unlisted);
    findings.extend(named);
    if !nameless.is_empty() {
        // With times in other units even a gross fault may be an accident.
        let sound = spans.is_none_or(|check| check.passes);
        for finding in &mut findings[if sound { faults.len() } else { 0 }..] {
            finding.or_unlisted(1.0, Doubt::FaultyRecords);
        }
    }
    findings.extend(nameless);
    // Something is left that no name explains; a failed check that a scatter explains has its name already.
    let plainly = |test: &TestResult| test.shows_dependence() && test.p_value < BEYOND_SCATTER;
    let scatters = findings.iter().any(is_scatter) && !asked.checked.checks.iter().any(plainly);
    let told = asked.unlisted.is_some() || findings.iter().any(Finding::is_unlisted);
    if !(restored || scatters || told) {
        findings.extend(finding::of_failed_checks(&asked.checked));
    }
    finding::doubt(&mut findings[faults.len()..], asked.found.model.candidates.len() >= MAX_EFFECTS);
    // A term without a name that stands out beside all that was found, though not by enough to be a finding.
    if findings.iter().any(Finding::is_sure)
        && let Some(left) = lack_of_fit(&asked.base, model)
    {
        finding::or_incomplete(&mut findings, left);
    }
    finding::or_of_low_significance(&mut findings);
    // The plainest first; a gross fault before everything, as everything else was asked of the records without it.
    findings[faults.len()..].sort_by(|a, b| b.z.total_cmp(&a.z));
    findings
}
