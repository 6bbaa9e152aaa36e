//! From fits to findings: names, chances, sizes and sentences.

use std::collections::BTreeMap;

use effects::{CATALOGUE, Hypothesis, Sign, hypothesis};
use estimation::{JointFit, NoiseComponent};

use crate::candidate::Choice;
use crate::document::{Check, Finding, UnlistedTerm, Value};
use crate::model_comparison::chance;
use crate::record_faults::Fault;
use crate::residual_tests::{Checked, is_covariate};
use crate::rivals::Name;
use crate::selection::Found;
use crate::settings::{FAINT, FORM_ERROR, LEAST_REACH};
use crate::statistics::{of_trials, z_of_p};
use crate::wald::Test;

/// The parameters of a choice as found.
pub(crate) fn parameters(choice: &Choice, sizes: &[(f64, f64)]) -> BTreeMap<String, Value> {
    let held = choice.held().into_iter().map(|(name, value)| {
        let unit = name.rsplit_once('_').map_or("1", |(_, unit)| unit);
        (name.to_owned(), Value { value, sigma: None, unit: unit.to_owned() })
    });
    let fitted = choice.parameters().into_iter().zip(sizes).map(|(parameter, (value, sigma))| {
        let sigma = Some(*sigma).filter(|sigma| sigma.is_finite());
        (parameter.name.to_owned(), Value { value: *value, sigma, unit: parameter.unit.to_owned() })
    });
    fitted.chain(held).collect()
}

fn listed(values: &BTreeMap<String, Value>) -> String {
    let parts: Vec<String> = values
        .iter()
        .map(|(name, value)| match value.sigma {
            Some(sigma) if value.unit == "1" => format!("{name} = {:.3e} ± {sigma:.1e}", value.value),
            Some(sigma) => format!("{name} = {:.3e} ± {sigma:.1e} {}", value.value, value.unit),
            None => format!("{name} = {:.3}", value.value),
        })
        .collect();
    parts.join(", ")
}

/// The findings of a search over the catalogue.
pub(crate) fn of_search(found: &Found<'_>) -> Vec<Finding> {
    let places = found.model.choices.iter().zip(&found.names).zip(&found.tests);
    places.map(|((choice, names), test)| of_choice(choice, names, test, trials(found, choice))).collect()
}

/// How many shapes of an effect were tried.
fn trials(found: &Found<'_>, choice: &Choice) -> usize {
    let entry = found.first_scan.iter().find(|entry| entry.scored.choice.id() == choice.id());
    entry.map_or(1, |entry| entry.shapes.max(1))
}

/// Whether an effect that a search found hardly stands out.
pub(crate) fn is_faint(found: &Found<'_>, place: usize) -> bool {
    let (choice, test) = (&found.model.choices[place], &found.tests[place]);
    z(test, of_trials(test.p_value, trials(found, choice))) < FAINT
}

/// Chance that a finding has a cause that nobody wrote down and that looks like a name of the catalogue: one in twenty, as the blind benchmark finds.
const UNWRITTEN: f64 = 0.05;

/// The log of that chance over that of a cause that is written down.
pub(crate) fn unwritten_log_odds() -> f64 {
    (UNWRITTEN / (1.0 - UNWRITTEN)).ln()
}

fn of_choice(choice: &Choice, names: &[Name], test: &Test, trials: usize) -> Finding {
    let top = names.first().map_or(0.0, |name| name.log_odds);
    let weights: f64 = names.iter().map(|name| chance(name.log_odds, top)).sum();
    let p_value = of_trials(test.p_value, trials);
    let parameters = parameters(choice, &test.sizes);
    let mut ids: Vec<String> = names.iter().map(|name| name.choice.id().to_owned()).collect();
    if names.iter().any(|name| name.outdone) {
        ids.push("unlisted".to_owned());
    }
    let sentence = if ids.len() == 1 {
        format!("{}: {}", choice.id(), listed(&parameters))
    } else {
        format!("one of {}; this data cannot tell which. As {}: {}", ids.join(", "), choice.id(), listed(&parameters))
    };
    Finding {
        id: choice.id().to_owned(),
        names: ids,
        probability: (1.0 - UNWRITTEN) * if weights > 0.0 { 1.0 / weights } else { 1.0 },
        z: z(test, p_value),
        p_value,
        parameters,
        sentence,
        unlisted_term: None,
    }
}

/// The normal variable of a chance; where that is below what a double holds, from the statistic itself.
fn z(test: &Test, p_value: f64) -> f64 {
    if p_value > 1e-290 { z_of_p(p_value) } else { test.statistic.sqrt() }
}

/// The finding of a sparse term at the end of a model's choices.
pub(crate) fn of_sparse(choice: &Choice, test: &Test, p_value: f64, trials: usize) -> Option<Finding> {
    let Choice::Sparse(sparse) = choice else { return None };
    let (coefficient, sigma) = *test.sizes.first()?;
    let (channel, covariates) = (sparse.channel.name(), sparse.names());
    let sentence = format!(
        "not in the catalogue: {channel}, grows with {} ({coefficient:.3e} ± {sigma:.1e}); the best of {trials} products tried",
        covariates.join(" · ")
    );
    Some(Finding {
        id: "unlisted".to_owned(),
        names: vec!["unlisted".to_owned()],
        probability: 1.0,
        z: z(test, p_value),
        p_value,
        parameters: BTreeMap::new(),
        sentence,
        unlisted_term: Some(UnlistedTerm { channel: channel.to_owned(), covariates, coefficient, sigma }),
    })
}

/// Something is left, and nothing that was tried explains it.
pub(crate) fn of_failed_checks(checked: &Checked) -> Option<Finding> {
    let failed: Vec<&str> =
        checked.checks.iter().filter(|check| !check.passes).map(|check| check.name.as_str()).collect();
    // Heavy tails have names of their own: what goes with something says how sure it is.
    let of = |covariates: bool| {
        let own = checked.checks.iter().filter(|check| !check.passes && (!covariates || is_covariate(&check.name)));
        own.map(|check| check.p_value).reduce(f64::min)
    };
    let worst = of(true).or(of(false)).unwrap_or(1.0);
    (!failed.is_empty()).then(|| Finding {
        id: "unlisted".to_owned(),
        names: vec!["unlisted".to_owned()],
        probability: 1.0,
        z: z_of_p(worst),
        p_value: worst,
        parameters: BTreeMap::new(),
        sentence: format!(
            "the residuals are not what the model says ({}), and nothing in the catalogue explains it: what it is cannot be told",
            failed.join(", ")
        ),
        unlisted_term: None,
    })
}

/// What is found beside something that has no name, or a scatter, that stands out as much as a third of it may be a part of that, or an accident of it; where it stands
/// out less than that it is so before it is what its name says.
const DOUBTFUL: f64 = 3.0;

/// By how much more both are so where as many effects were found as are sought, and there is still something left.
const DOUBTFUL_IF_FULL: f64 = 3.0;

/// Says of effects found that what has no name would do as well, with so much of a chance over theirs.
pub(crate) fn beside_unlisted(findings: &mut [Finding], chance: f64) {
    for finding in findings.iter_mut().filter(|finding| is_mean(finding)) {
        or_unlisted(finding, chance, "a term without a name would do as well");
    }
}

/// Chance at which the names found do not explain all that is there though they do.
const LACK_OF_FIT: f64 = 0.05;

/// Says of the effects found, where no other doubt is on them, that they may not be what is there where the score of a term without a name still stands out beside them,
/// by more than what their form may err by. A chance p speaks against what it was computed under by no more than 1/(−e p ln p) (Sellke, Bayarri & Berger 2001).
pub(crate) fn or_incomplete(findings: &mut [Finding], (score, p_value): (f64, f64)) {
    if p_value >= LACK_OF_FIT {
        return;
    }
    let against = (-std::f64::consts::E * p_value * p_value.max(f64::MIN_POSITIVE).ln()).recip();
    let chance = (against * UNWRITTEN / (1.0 - UNWRITTEN)).min(1.0);
    let is_incomplete = |finding: &&mut Finding| is_sure(finding) && score > FORM_ERROR * finding.z.powi(2);
    for finding in findings.iter_mut().filter(is_incomplete) {
        or_unlisted(finding, chance, "it does not explain all that is there");
    }
}

/// Chance that then none of the names is right over that one of them is: of such findings of the blind benchmark seven of ten have the right name among theirs, of others
/// forty-nine of fifty.
const NONE_OF_THEM: f64 = 3.0 / 7.0;

/// Says of the effects found, where no other doubt is on them, that they may be something else where they hardly stand out.
pub(crate) fn or_faint(findings: &mut [Finding]) {
    for finding in findings.iter_mut().filter(|finding| is_sure(finding) && finding.z < FAINT) {
        or_unlisted(finding, NONE_OF_THEM, "it hardly stands out, and may be something else");
    }
}

/// Whether a finding is a mean effect that nothing without a name is held to do as well.
pub(crate) fn is_sure(finding: &Finding) -> bool {
    is_mean(finding) && !finding.names.iter().any(|name| name == "unlisted")
}

/// Says of a finding that it may be the doing of something that has no name, with so much of a chance over that of its names.
pub(crate) fn or_unlisted(finding: &mut Finding, chance: f64, why: &str) {
    finding.names.retain(|name| name != "unlisted");
    finding.names.push("unlisted".to_owned());
    finding.probability /= 1.0 + chance;
    finding.sentence = format!("{}; {why}", finding.sentence);
}

/// Whether a finding is a mean effect with sizes.
fn is_mean(finding: &Finding) -> bool {
    hypothesis(&finding.id).and_then(Hypothesis::into_shapes).is_some() && !finding.parameters.is_empty()
}

/// Says of names that they may be part of something that has none: where that stands out as well, the more so where as many effects were found as are sought. A scatter
/// keeps its name first.
pub(crate) fn doubt(findings: &mut [Finding], full: bool) {
    let strongest = |findings: &[Finding], is: fn(&Finding) -> bool| {
        findings.iter().filter(|finding| is(finding)).map(|finding| finding.z).fold(0.0, f64::max)
    };
    let unlisted = strongest(findings, |finding| finding.id == "unlisted");
    let scatter = strongest(findings, |finding| has_sign(&finding.id, Sign::ScatterWithTurn));
    for finding in findings {
        if finding.id == "unlisted" {
            continue;
        }
        let is_mean = is_mean(finding);
        let stands_out = unlisted * if full && is_mean { DOUBTFUL_IF_FULL } else { 1.0 };
        if is_mean && (finding.z < stands_out || DOUBTFUL * finding.z < scatter) {
            finding.id = "unlisted".to_owned();
            finding.names.retain(|name| name != "unlisted");
            finding.names.insert(0, "unlisted".to_owned());
            finding.sentence = format!("perhaps part of what has no name, or else {}", finding.sentence);
        } else if finding.z < DOUBTFUL * stands_out {
            or_unlisted(finding, 1.0, "it may be part of what has no name");
        }
    }
}

/// The counts do not follow the robot, and no gross fault explains it.
pub(crate) fn of_lost(base: &JointFit<'_>) -> Option<Finding> {
    let sigma = |of| base.fit.noise.sigma(of);
    let what = format!(
        "the robot was not seen where its wheels' counts say: to the best fit they err by {:.0} mm for each root of a metre and {:.0} mrad for each root of a radian, and looks by {:.0} mm and {:.0} mrad",
        1e3 * sigma(NoiseComponent::Wheel),
        1e3 * sigma(NoiseComponent::Turn),
        1e3 * sigma(NoiseComponent::LookPosition),
        1e3 * sigma(NoiseComponent::LookHeading),
    );
    of_scatter(&[], 0.0, BTreeMap::new(), &what)
}

/// Rows astray that no fault of the catalogue explains.
pub(crate) fn of_rows_astray(log: Option<&Check>) -> Option<Finding> {
    let check = log.filter(|check| !check.passes)?;
    let what = format!("{:.0} rows of the log are not where the rows around them go on", check.statistic);
    of_scatter(&[], check.p_value, BTreeMap::new(), &what)
}

/// A log and looks of two clocks.
pub(crate) fn of_spans(spans: Option<&Check>) -> Option<Finding> {
    let check = spans.filter(|check| !check.passes)?;
    let what = format!(
        "the log lasts {:.3e} times as long as what was seen of the robot: their times are not in one unit",
        check.statistic
    );
    of_scatter(&[], check.p_value, BTreeMap::new(), &what)
}

/// Wheels that are another robot's by a factor: a fault that multiplies the counts, unless that is not to be
/// named.
pub(crate) fn of_wrong_wheels(factor: f64, without: &[String]) -> Option<Finding> {
    let factor_of = |id: &'static str| effects::description(id)?.record_fault.counts_factor.map(|size| (id, size));
    let (id, size) = CATALOGUE.iter().copied().find_map(factor_of)?;
    let what = format!(
        "calibrated wheels are {factor:.2} times as large as the robot's description says: it, its counts or their units are another robot's"
    );
    let ids: &[&'static str] = if without.iter().any(|out| out == id) { &[] } else { &[id] };
    // Logged over true counts: wheels that count twice as often seem half as large.
    let value = Value { value: factor.recip(), sigma: None, unit: "1".to_owned() };
    of_scatter(ids, 0.0, BTreeMap::from([(size.to_owned(), value)]), &what)
}

/// The finding of a gross fault.
pub(crate) fn of_fault(fault: &Fault) -> Finding {
    let value = |(name, value): &(&'static str, f64)| {
        ((*name).to_owned(), Value { value: *value, sigma: None, unit: "1".to_owned() })
    };
    // A likelihood ratio of e^gain bounds the chance of as much by accident (Markov's inequality).
    let p_value = (-fault.gain).exp();
    Finding {
        id: fault.id.to_owned(),
        names: vec![fault.id.to_owned()],
        probability: 1.0,
        z: (2.0 * fault.gain.min(1e6)).sqrt(),
        p_value,
        parameters: fault.sizes.iter().map(value).collect(),
        sentence: format!("{}: {}", fault.id, fault.sentence),
        unlisted_term: None,
    }
}

/// Effects of the catalogue that show by a sign, without those taken out.
pub(crate) fn with_sign(sign: Sign, without: &[String]) -> Vec<&'static str> {
    CATALOGUE
        .iter()
        .copied()
        .filter(|id| !without.iter().any(|out| out == id))
        .filter(|id| has_sign(id, sign))
        .collect()
}

/// Whether an effect of the catalogue shows by a sign.
fn has_sign(id: &str, sign: Sign) -> bool {
    hypothesis(id).is_some_and(|hypothesis| hypothesis.signs().contains(&sign))
}

/// A finding of what only scatters.
pub(crate) fn of_scatter(
    ids: &[&'static str],
    p_value: f64,
    parameters: BTreeMap<String, Value>,
    what: &str,
) -> Option<Finding> {
    let ids = if ids.is_empty() { &["unlisted"] } else { ids };
    let first = ids.first()?;
    #[allow(clippy::cast_precision_loss)]
    let probability = if ids == ["unlisted"] { 1.0 } else { (1.0 - UNWRITTEN) / ids.len() as f64 };
    let sentence = match ids {
        ["unlisted"] => format!("not in the catalogue: {what}"),
        [id] => format!("{id}: {what}"),
        ids => format!("one of {}; this data cannot tell which: {what}", ids.join(", ")),
    };
    Some(Finding {
        id: (*first).to_owned(),
        names: ids.iter().map(|id| (*id).to_owned()).collect(),
        probability,
        z: z_of_p(p_value),
        p_value,
        parameters,
        sentence,
        unlisted_term: None,
    })
}

/// A finding of what only scatters, by names each with the log of its chance of the data: the likeliest first, without those that cannot be it, as another of them or `any`
/// cause does better. What has no name may be anything, and is as likely as they are on average.
pub(crate) fn of_likely_scatter(
    mut likely: Vec<(&'static str, f64)>,
    any: f64,
    or_unlisted: bool,
    p_value: f64,
    what: &str,
) -> Option<Finding> {
    likely.sort_by(|a, b| b.1.total_cmp(&a.1));
    let best = likely.first().map_or(0.0, |(_, log)| *log);
    let weights: f64 = likely.iter().map(|(_, log)| (log - best).exp()).sum();
    #[allow(clippy::cast_precision_loss)] // a handful
    let named = if or_unlisted { likely.len() as f64 / (likely.len() + 1) as f64 } else { 1.0 };
    likely.retain(|(_, log)| *log > best.max(any) - LEAST_REACH);
    let mut ids: Vec<&'static str> = likely.into_iter().map(|(id, _)| id).collect();
    if or_unlisted {
        ids.push("unlisted");
    }
    let finding = of_scatter(&ids, p_value, BTreeMap::new(), what)?;
    let probability = if finding.id == "unlisted" { 1.0 } else { (1.0 - UNWRITTEN) * named / weights };
    Some(Finding { probability, ..finding })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(id: &str, z: f64, names: &[&str]) -> Finding {
        let value = Value { value: 1e-3, sigma: Some(2e-4), unit: "1".to_owned() };
        Finding {
            id: id.to_owned(),
            names: names.iter().map(|name| (*name).to_owned()).collect(),
            probability: 0.9,
            z,
            p_value: 1e-4,
            parameters: BTreeMap::from([("share".to_owned(), value)]),
            sentence: id.to_owned(),
            unlisted_term: None,
        }
    }

    #[test]
    fn what_hardly_stands_out_may_be_something_else() {
        let mut findings = [
            found("slip_speed", 3.7, &["slip_speed", "castor_drag"]),
            found("slip_speed", 5.0, &["slip_speed", "castor_drag"]),
            found("slip_speed", 3.7, &["slip_speed", "unlisted"]),
            found("swapped_wheels", 3.7, &["swapped_wheels"]),
        ];
        let before = findings.clone();
        or_faint(&mut findings);
        assert_eq!(findings[0].names, ["slip_speed", "castor_drag", "unlisted"]);
        // None of the names in three of ten, whatever their shares among themselves.
        assert!((findings[0].probability - 0.7 * before[0].probability).abs() < 1e-12, "{:?}", findings[0]);
        assert!(findings[0].sentence.contains("hardly stands out"), "{}", findings[0].sentence);
        // What stands out, what is doubted already, and a fault of the records stay as they are.
        assert_eq!(findings[1..], before[1..]);
    }
}
