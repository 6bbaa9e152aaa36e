//! Findings: candidate causes with their probabilities, significance and parameter values, and the doubts
//! that are on them.

use std::collections::BTreeMap;

use effects::{CATALOGUE, Description, Hypothesis, Sign, hypothesis};
use estimation::{ModelFit, NoiseComponent};
use preflight::ClockDrift;

use crate::candidates::candidate::Candidate;
use crate::candidates::cause::{Basis, Cause, Doubt};
use crate::carry_over::CarryOver;
use crate::checks::check::{Check, TestResult};
use crate::checks::residual_tests::Checked;
use crate::document::{UnlistedTerm, Value};
use crate::findings::geometry_deviation::GeometryDeviation;
use crate::findings::lack_of_fit::FormDeviation;
use crate::fits::model_comparison::relative_odds;
use crate::fits::statistics::{p_of_chi_square, sidak, z_of_p};
use crate::fits::wald::Test;
use crate::records::clocks::ClockOffset;
use crate::records::record_faults::Fault;
use crate::records::stamp_errors::StampError;
use crate::search::rivals::Name;
use crate::search::selection::SearchResult;
use crate::settings::{CARRY_OVER, FINDINGS, LEVELS, RECORDS};

/// Something that the calibrated model gets wrong.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Finding {
    /// The ambiguity set: causes that this data cannot discriminate, most probable first; never empty.
    pub(crate) causes: Vec<Cause>,
    /// Of the first cause, among all that were tried.
    pub(crate) probability: f64,
    /// The standard normal quantile of `p_value`.
    pub(crate) z: f64,
    /// Probability of so large an effect where there is none; multiplicity corrected.
    pub(crate) p_value: f64,
    /// Parameter values of the first cause.
    pub(crate) parameters: BTreeMap<String, Value>,
    pub(crate) basis: Basis,
    pub(crate) doubts: Vec<Doubt>,
    /// Ids of the runs that it concerns; `None` for all.
    pub(crate) runs: Option<Vec<String>>,
    /// The index of its term in the model's mean, if it has one, and whether that carries over.
    pub(crate) term: Option<usize>,
    pub(crate) carry_over: Option<CarryOver>,
}

impl Finding {
    /// The most probable cause.
    pub(crate) fn first(&self) -> &Cause {
        self.causes.first().unwrap_or(&Cause::Unknown)
    }

    /// Whether the most probable cause is in no catalogue.
    pub(crate) fn is_unlisted(&self) -> bool {
        self.first().is_unlisted()
    }

    /// Whether its most probable cause is an error of the log's stamps.
    pub(crate) fn is_of_stamps(&self) -> bool {
        effects::description(self.first().id()).is_some_and(|description| description.restamped.is_some())
    }

    /// Whether an uncatalogued cause is among the candidates.
    pub(crate) fn has_unlisted(&self) -> bool {
        self.causes.iter().any(Cause::is_unlisted)
    }

    /// Whether a cause of this id is among the candidates.
    pub(crate) fn names(&self, cause: &Cause) -> bool {
        self.causes.iter().any(|own| own.id() == cause.id())
    }

    /// Whether it is a mean effect with parameter values.
    fn is_mean(&self) -> bool {
        hypothesis(self.first().id()).and_then(Hypothesis::into_variants).is_some() && !self.parameters.is_empty()
    }

    /// Whether it is a mean effect that no uncatalogued cause is held to explain as well.
    pub(crate) fn is_certain(&self) -> bool {
        self.is_mean() && !self.has_unlisted()
    }

    /// Whether the extended model has its term, which acts wherever the robot drives. Beside the data that it
    /// was found in, one of several causes, or an unknown one, is likely to predict worse than none.
    pub(crate) fn is_in_extended_model(&self) -> bool {
        let established = self.probability >= CARRY_OVER.min_established_probability && !self.has_unlisted();
        self.carry_over.as_ref().and_then(|of| of.carries_over).unwrap_or(established)
    }

    /// An uncatalogued cause may do the same, with so much probability relative to that of the causes here.
    pub(crate) fn or_unlisted(&mut self, odds: f64, doubt: Doubt) {
        if !matches!(self.causes[..], [Cause::Term(_)]) {
            self.causes.retain(|cause| !cause.is_unlisted());
            self.causes.push(Cause::Unknown);
        }
        self.probability /= 1.0 + odds;
        self.doubts.push(doubt);
    }
}

/// The parameters of a candidate as found.
pub(crate) fn parameters(candidate: &Candidate, estimates: &[(f64, f64)]) -> BTreeMap<String, Value> {
    let fixed = candidate.fixed().into_iter().map(|(name, value)| {
        let unit = name.rsplit_once('_').map_or("1", |(_, unit)| unit);
        (name.to_owned(), Value { value, sigma: None, unit: unit.to_owned() })
    });
    let fitted = candidate.parameters().into_iter().zip(estimates).map(|(parameter, (value, sigma))| {
        let sigma = Some(*sigma).filter(|sigma| sigma.is_finite());
        (parameter.name.to_owned(), Value { value: *value, sigma, unit: parameter.unit.to_owned() })
    });
    fitted.chain(fixed).collect()
}

/// The findings of a search over the catalogue.
pub(crate) fn of_search(found: &SearchResult<'_>) -> Vec<Finding> {
    let indices = found.model.candidates.iter().zip(&found.names).zip(&found.tests);
    indices
        .enumerate()
        .map(|(index, ((candidate, names), test))| Finding {
            term: Some(index),
            ..of_candidate(candidate, names, test, trials(found, candidate))
        })
        .collect()
}

/// How many variants of an effect were tried.
fn trials(found: &SearchResult<'_>, candidate: &Candidate) -> usize {
    let entry = found.first_scan.iter().find(|entry| entry.scored.candidate.id() == candidate.id());
    entry.map_or(1, |entry| entry.variants.max(1))
}

/// Whether an effect that a search found is of low significance.
pub(crate) fn is_of_low_significance(found: &SearchResult<'_>, index: usize) -> bool {
    let (candidate, test) = (&found.model.candidates[index], &found.tests[index]);
    z(test.statistic, sidak(test.p_value, trials(found, candidate))) < LEVELS.low_significance_sigmas
}

/// The log of that probability over that of a catalogued cause.
pub(crate) fn uncatalogued_log_odds() -> f64 {
    (FINDINGS.uncatalogued_prior / (1.0 - FINDINGS.uncatalogued_prior)).ln()
}

fn of_candidate(candidate: &Candidate, names: &[Name], test: &Test, trials: usize) -> Finding {
    let top = names.first().map_or(0.0, |name| name.log_odds);
    // What explains more than any cause that can be is as likely as the first.
    let is_outdone = names.iter().any(|name| name.outdone);
    let of_unlisted = if is_outdone { 1.0 } else { 0.0 };
    let total_odds: f64 = names.iter().map(|name| relative_odds(name.log_odds, top)).sum::<f64>() + of_unlisted;
    let p_value = sidak(test.p_value, trials);
    let mut causes: Vec<Cause> = names.iter().map(|name| name.candidate.cause()).collect();
    if is_outdone {
        causes.push(Cause::Unknown);
    }
    Finding {
        causes,
        probability: (1.0 - FINDINGS.uncatalogued_prior) * if total_odds > 0.0 { 1.0 / total_odds } else { 1.0 },
        z: z(test.statistic, p_value),
        p_value,
        parameters: parameters(candidate, &test.estimates),
        basis: Basis::Mean,
        doubts: Vec::new(),
        runs: None,
        term: None,
        carry_over: None,
    }
}

/// The standard normal quantile of a probability; where that is below what a double holds, from the
/// statistic itself.
pub(crate) fn z(statistic: f64, p_value: f64) -> f64 {
    if p_value > LEVELS.min_quantile_p_value { z_of_p(p_value) } else { statistic.sqrt() }
}

/// The finding of a sparse term at the end of a model's candidates.
pub(crate) fn of_sparse(candidate: &Candidate, test: &Test, p_value: f64, trials: usize) -> Option<Finding> {
    let Candidate::Sparse(sparse) = candidate else { return None };
    let (channel, size) = (sparse.channel.name(), *test.estimates.first()?);
    let cause = UnlistedTerm::determined(channel, sparse.names(), size).map_or(Cause::Unknown, Cause::Term);
    Some(Finding {
        causes: vec![cause],
        probability: 1.0,
        z: z(test.statistic, p_value),
        p_value,
        parameters: BTreeMap::new(),
        basis: Basis::Products(trials),
        doubts: Vec::new(),
        runs: None,
        term: None,
        carry_over: None,
    })
}

/// Something is left, and nothing that was tried explains it, but for effects that were refused for what they
/// do to other runs.
pub(crate) fn of_failed_checks(
    checked: &Checked,
    without: &[String],
    refused: impl Iterator<Item = &'static str>,
) -> Option<Finding> {
    let failed: Vec<Check> = checked.checks.iter().filter(|test| !test.passes).map(|test| test.check.clone()).collect();
    // Heavy tails have causes of their own: the p-value is that of the tests of dependence.
    let least = |tests: &mut dyn Iterator<Item = &TestResult>| tests.map(|test| test.p_value).reduce(f64::min);
    let worst = least(&mut checked.checks.iter().filter(|test| test.shows_dependence()))
        .or_else(|| least(&mut checked.checks.iter().filter(|test| !test.passes)));
    let worst = worst.filter(|_| !failed.is_empty())?;
    // Residuals that are correlated with the ones before them may be errors of the instrument that last.
    // Tests of dependence take errors to be independent, and fail too then, if less plainly.
    let of_correlation = least(&mut checked.checks.iter().filter(|test| test.check.is_of_whiteness())).unwrap_or(1.0);
    let may_be_correlation =
        |test: &TestResult| test.check.is_of_whiteness() || (test.shows_dependence() && test.p_value >= of_correlation);
    let only_correlated = checked.checks.iter().filter(|test| !test.passes).all(may_be_correlation);
    let sign = only_correlated.then_some(Sign::AutocorrelatedErrors);
    let errors = sign.into_iter().flat_map(|sign| with_sign(sign, without)).map(Cause::Effect);
    let of_dependence = checked.checks.iter().any(TestResult::shows_dependence);
    let refused = refused.filter(|_| of_dependence).map(Cause::Effect);
    // Whatever else was left out of the model is as likely, and has no name.
    let causes = [Cause::Unknown].into_iter().chain(errors).chain(refused).collect();
    Some(of_causes(causes, worst, BTreeMap::new(), Basis::FailedTests(failed)))
}

/// Doubts mean effects: one uncatalogued term explains as much, with these odds over them.
pub(crate) fn beside_unlisted(findings: &mut [Finding], odds: f64) {
    for finding in findings.iter_mut().filter(|finding| finding.is_mean()) {
        finding.or_unlisted(odds, Doubt::TermDoesAsWell);
    }
}

/// The odds of an uncatalogued cause over those named, by a p-value beside these. A p-value speaks against
/// its hypothesis by no more than 1/(−e p ln p) (Sellke, Bayarri & Berger 2001).
fn uncatalogued_odds(p_value: f64) -> f64 {
    let bayes_factor_bound = (-std::f64::consts::E * p_value * p_value.max(f64::MIN_POSITIVE).ln()).recip();
    (bayes_factor_bound * FINDINGS.uncatalogued_prior / (1.0 - FINDINGS.uncatalogued_prior)).min(1.0)
}

/// Doubts an effect whose form is off significantly, and by more than is known of it.
pub(crate) fn or_of_other_form(finding: &mut Finding, deviation: FormDeviation, has_exact_form: bool) {
    let FormDeviation { share, p_value, by } = deviation;
    if p_value < FINDINGS.lack_of_fit_level && (has_exact_form || share > LEVELS.model_mismatch_fraction) {
        finding.or_unlisted(uncatalogued_odds(p_value), Doubt::OtherForm(by));
    }
}

/// Doubts effects that no other doubt is on, where the score of an uncatalogued term is significant beside
/// them by more than the error of their form.
pub(crate) fn or_incomplete(findings: &mut [Finding], score: f64, p_value: f64) {
    if p_value >= FINDINGS.lack_of_fit_level {
        return;
    }
    let odds = uncatalogued_odds(p_value);
    let is_incomplete =
        |finding: &&mut Finding| finding.is_certain() && score > LEVELS.model_mismatch_fraction * finding.z.powi(2);
    for finding in findings.iter_mut().filter(is_incomplete) {
        finding.or_unlisted(odds, Doubt::Incomplete);
    }
}

/// Doubts effects of low significance that no other doubt is on.
pub(crate) fn or_of_low_significance(findings: &mut [Finding]) {
    for finding in
        findings.iter_mut().filter(|finding| finding.is_certain() && finding.z < LEVELS.low_significance_sigmas)
    {
        finding.or_unlisted(FINDINGS.none_of_causes_odds, Doubt::LowSignificance);
    }
}

/// Doubts findings that may be part of a stronger uncatalogued or noise finding. The margin is wider where
/// as many effects were found as are sought. A noise effect keeps its cause first.
pub(crate) fn doubt(findings: &mut [Finding], full: bool) {
    let strongest = |findings: &[Finding], is: fn(&Finding) -> bool| {
        findings.iter().filter(|finding| is(finding)).map(|finding| finding.z).fold(0.0, f64::max)
    };
    let unlisted = strongest(findings, Finding::is_unlisted);
    let scatter = strongest(findings, |finding| has_sign(finding.first().id(), Sign::ScatterWithTurn));
    for finding in findings.iter_mut().filter(|finding| !finding.is_unlisted()) {
        let is_mean = finding.is_mean();
        let limit = unlisted * if full && is_mean { FINDINGS.part_of_stronger_ratio_if_full } else { 1.0 };
        if is_mean && (finding.z < limit || FINDINGS.part_of_stronger_ratio * finding.z < scatter) {
            finding.causes.retain(|cause| !cause.is_unlisted());
            finding.causes.insert(0, Cause::Unknown);
            finding.doubts.push(Doubt::ProbablyPartOfUnlisted);
        } else if finding.z < FINDINGS.part_of_stronger_ratio * limit {
            finding.or_unlisted(1.0, Doubt::PartOfUnlisted);
        }
    }
}

/// Odometry is uncorrelated with the measurements, and no record fault explains it.
pub(crate) fn of_uncorrelated(base: &ModelFit<'_>) -> Finding {
    let sigmas = NoiseComponent::ALL.map(|component| base.solution.noise.sigma(component));
    of_causes(vec![Cause::Unknown], 0.0, BTreeMap::new(), Basis::Uncorrelated(sigmas))
}

/// Outlying rows that no fault of the catalogue explains.
pub(crate) fn of_outlying_rows(log: Option<&TestResult>) -> Option<Finding> {
    let test = log.filter(|test| !test.passes)?;
    let basis = Basis::OutlyingRows(test.statistic);
    Some(of_causes(vec![Cause::Unknown], test.p_value, BTreeMap::new(), basis))
}

/// A log and measurements of two clocks.
pub(crate) fn of_spans(spans: Option<&TestResult>) -> Option<Finding> {
    let test = spans.filter(|test| !test.passes)?;
    Some(of_causes(vec![Cause::Unknown], test.p_value, BTreeMap::new(), Basis::OtherClock(test.statistic)))
}

/// Wheels that are another robot's by a factor: a fault that multiplies the counts, unless that is not to
/// be named.
pub(crate) fn of_wrong_wheels(factor: f64, without: &[String]) -> Option<Finding> {
    let factor_of = |id: &'static str| effects::description(id)?.record_fault.counts_factor.map(|size| (id, size));
    let (id, size) = CATALOGUE.iter().copied().find_map(factor_of)?;
    let is_nameable = factor.ln().abs() <= RECORDS.max_wrong_wheels_factor.ln() && without.iter().all(|out| out != id);
    let cause = if is_nameable { Cause::Effect(id) } else { Cause::Unknown };
    // Logged over true counts: wheels that count twice as often seem half as large.
    let value = Value { value: factor.recip(), sigma: None, unit: "1".to_owned() };
    Some(of_causes(vec![cause], 0.0, BTreeMap::from([(size.to_owned(), value)]), Basis::WheelFactor(factor)))
}

/// The effect of the catalogue of which something is known, and what, among those that may be named.
fn nameable<T>(known: impl Fn(Description) -> Option<T>, without: &[String]) -> Option<(&'static str, T)> {
    let mut nameable = CATALOGUE.iter().copied().filter(|id| !without.iter().any(|out| out == id));
    nameable.find_map(|id| Some((id, known(effects::description(id)?)?)))
}

/// Geometry that is not that of the described robot.
pub(crate) fn of_geometry(deviation: GeometryDeviation, without: &[String]) -> Finding {
    let ratio_of = |description: Description| description.geometry.filter(|(of, _)| *of == deviation.of);
    let (mut causes, parameters) = match nameable(ratio_of, without) {
        Some((id, (_, name))) => {
            let value = Value { value: deviation.ratio, sigma: Some(deviation.sigma), unit: "1".to_owned() };
            (vec![Cause::Effect(id)], BTreeMap::from([(name.to_owned(), value)]))
        }
        None => (Vec::new(), BTreeMap::new()),
    };
    // A fit of something else has another robot's geometry too.
    if causes.is_empty() || !deviation.is_of_skid_steering() {
        causes.push(Cause::Unknown);
    }
    of_causes(causes, p_of_chi_square(deviation.chi_square(), 1.0), parameters, Basis::Geometry(deviation))
}

/// The finding of a clock that is far off.
pub(crate) fn of_clock(ClockOffset { runs, of: offset }: &ClockOffset, without: &[String]) -> Finding {
    let (cause, parameters) = match nameable(|description| description.clock_offset, without) {
        Some((id, name)) => {
            let value = Value { value: offset.offset_s, sigma: Some(offset.sigma_s), unit: "s".to_owned() };
            (Cause::Effect(id), BTreeMap::from([(name.to_owned(), value)]))
        }
        None => (Cause::Unknown, BTreeMap::new()),
    };
    let basis = Basis::ClockOffset(offset.offset_s);
    let found = of_causes(vec![cause], p_of_chi_square(2.0 * offset.gain, 1.0), parameters, basis);
    Finding { runs: runs.clone(), ..found }
}

/// The finding of a clock that runs fast or slow.
pub(crate) fn of_drift(drift: &ClockDrift, without: &[String]) -> Finding {
    // What the robot's clock gains on the instrument's.
    let gains = (1.0 + drift.clock.rate).recip() - 1.0;
    let rate = Value { value: gains, sigma: Some(drift.sigma), unit: "1".to_owned() };
    let since = Value { value: 1.0, sigma: None, unit: "1".to_owned() };
    let since = drift.clock.of_session.then(|| ("since_session_start".to_owned(), since));
    let is_clock_rate = |description: Description| description.is_clock_rate.then_some(());
    let (cause, parameters) = match nameable(is_clock_rate, without) {
        Some((id, ())) => (Cause::Effect(id), [("rate".to_owned(), rate)].into_iter().chain(since).collect()),
        None => (Cause::Unknown, BTreeMap::new()),
    };
    of_causes(vec![cause], p_of_chi_square(2.0 * drift.gain, 1.0), parameters, Basis::ClockDrift(gains))
}

/// The finding of an error of the stamps.
pub(crate) fn of_stamps(error: &StampError) -> Finding {
    let (p_value, values) = (error.test.p_value, parameters(&error.candidate, &error.test.estimates));
    let found = of_causes(vec![error.candidate.cause()], p_value, values, Basis::Mean);
    Finding { z: z(error.test.statistic, p_value), ..found }
}

/// Adds what was taken off the clock before the fit to what was found of it after, which is as significant as
/// both.
pub(crate) fn add_offset(findings: &mut [Finding], of_clock: &Finding) -> bool {
    let same = |finding: &&mut Finding| finding.runs.is_none() && finding.first() == of_clock.first();
    let Some(found) = findings.iter_mut().find(same) else { return false };
    for (name, value) in of_clock.parameters.iter().filter(|(_, value)| value.sigma.is_some()) {
        if let Some(own) = found.parameters.get_mut(name) {
            own.value += value.value;
        }
    }
    (found.z, found.p_value) = (found.z.max(of_clock.z), found.p_value.min(of_clock.p_value));
    true
}

/// The finding of a gross fault.
pub(crate) fn of_fault(fault: &Fault) -> Finding {
    let value = |(name, value): &(&'static str, f64)| {
        ((*name).to_owned(), Value { value: *value, sigma: None, unit: "1".to_owned() })
    };
    let rivals = fault.rivals.iter().map(|(id, _)| Cause::Effect(id));
    let odds = fault.rivals.iter().map(|(_, log_odds)| relative_odds(fault.gain + log_odds, fault.gain));
    Finding {
        causes: [Cause::Effect(fault.id)].into_iter().chain(rivals).collect(),
        probability: 1.0 / (1.0 + odds.sum::<f64>()),
        z: (2.0 * fault.gain.min(1e6)).sqrt(),
        // A likelihood ratio of e^gain bounds the probability of as much by accident (Markov's inequality).
        p_value: (-fault.gain).exp(),
        parameters: fault.values.iter().map(value).collect(),
        basis: Basis::RecordFault(fault.sentence.clone()),
        doubts: Vec::new(),
        runs: None,
        term: None,
        carry_over: None,
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

/// A finding without a mean: causes of equal probability, or an unknown one where there is none.
pub(crate) fn of_causes(
    mut causes: Vec<Cause>,
    p_value: f64,
    parameters: BTreeMap<String, Value>,
    basis: Basis,
) -> Finding {
    if causes.is_empty() {
        causes.push(Cause::Unknown);
    }
    let probability =
        if causes == [Cause::Unknown] { 1.0 } else { (1.0 - FINDINGS.uncatalogued_prior) / causes.len() as f64 };
    Finding {
        causes,
        probability,
        z: z_of_p(p_value),
        p_value,
        parameters,
        basis,
        doubts: Vec::new(),
        runs: None,
        term: None,
        carry_over: None,
    }
}

/// A noise effect by the log likelihood of each candidate cause. The likeliest comes first. Those that
/// another cause, or `any`, exceeds by the margin are left out. An unknown cause, where there may be one,
/// is as likely as the others on average.
pub(crate) fn of_likely_scatter(
    mut likely: Vec<(&'static str, f64)>,
    any: f64,
    or_unlisted: bool,
    p_value: f64,
    basis: Basis,
) -> Finding {
    likely.sort_by(|a, b| b.1.total_cmp(&a.1));
    let best = likely.first().map_or(0.0, |(_, log)| *log);
    let total_odds: f64 = likely.iter().map(|(_, log)| (log - best).exp()).sum();
    let named = if or_unlisted { likely.len() as f64 / (likely.len() + 1) as f64 } else { 1.0 };
    likely.retain(|(_, log)| *log > best.max(any) - LEVELS.min_log_odds_margin);
    let mut causes: Vec<Cause> = likely.into_iter().map(|(id, _)| Cause::Effect(id)).collect();
    if or_unlisted {
        causes.push(Cause::Unknown);
    }
    let finding = of_causes(causes, p_value, BTreeMap::new(), basis);
    let probability =
        if finding.is_unlisted() { 1.0 } else { (1.0 - FINDINGS.uncatalogued_prior) * named / total_odds };
    Finding { probability, ..finding }
}

#[cfg(test)]
mod tests;
