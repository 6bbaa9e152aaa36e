//! Findings on paper: causes, probabilities, doubts.

use effects::Covariate;

use super::*;
use crate::checks::check::Correlation;
use crate::checks::errors_at_rest::ErrorsAtRest;

const SLIP: Cause = Cause::Effect("slip_speed");
const CASTOR: Cause = Cause::Effect("castor_drag");

fn found(z: f64, causes: &[Cause]) -> Finding {
    let value = Value { value: 1e-3, sigma: Some(2e-4), unit: "1".to_owned() };
    Finding {
        causes: causes.to_vec(),
        probability: 0.9,
        z,
        p_value: 1e-4,
        parameters: BTreeMap::from([("share".to_owned(), value)]),
        basis: Basis::Mean,
        doubts: Vec::new(),
        runs: None,
        term: None,
        carry_over: None,
    }
}

#[test]
fn a_finding_of_low_significance_may_be_something_else() {
    let mut findings = [
        found(3.7, &[SLIP, CASTOR]),
        found(5.0, &[SLIP, CASTOR]),
        found(3.7, &[SLIP, Cause::Unknown]),
        found(3.7, &[Cause::Effect("swapped_wheels")]),
    ];
    let before = findings.clone();
    or_of_low_significance(&mut findings);
    assert_eq!(findings[0].causes, [SLIP, CASTOR, Cause::Unknown]);
    // None of the causes in three of ten, whatever their shares among themselves.
    assert!((findings[0].probability - 0.7 * before[0].probability).abs() < 1e-12, "{:?}", findings[0]);
    assert_eq!(findings[0].doubts, [Doubt::LowSignificance]);
    // What is significant, what is doubted already, and a fault of the records stay as they are.
    assert_eq!(findings[1..], before[1..]);
}

#[test]
fn a_weak_mean_effect_beside_a_strong_uncatalogued_one_is_probably_part_of_it() {
    let unknown = of_causes(vec![], 1e-20, BTreeMap::new(), Basis::Autocorrelated(0.3, ErrorsAtRest::Autocorrelated));
    assert!(unknown.is_unlisted() && unknown.probability == 1.0 && unknown.z > 9.0);
    let mut findings = [found(5.0, &[SLIP]), found(20.0, &[CASTOR]), found(40.0, &[SLIP]), unknown];
    doubt(&mut findings, false);
    assert_eq!(findings[0].causes, [Cause::Unknown, SLIP]);
    assert_eq!(findings[0].doubts, [Doubt::ProbablyPartOfUnlisted]);
    // Above its z, but not three times so.
    assert_eq!((&findings[1].causes[..], findings[1].probability), (&[CASTOR, Cause::Unknown][..], 0.45));
    assert!(findings[2].doubts.is_empty());
    // As many effects as are sought, and something left: the margin is three times as wide.
    let mut full = [found(20.0, &[CASTOR]), findings[3].clone()];
    doubt(&mut full, true);
    assert_eq!(full[0].causes, [Cause::Unknown, CASTOR]);
}

#[test]
fn a_term_keeps_its_cause_beside_a_doubt() {
    let term = UnlistedTerm { channel: "yaw".to_owned(), covariates: vec![], coefficient: 1.0, sigma: 0.1 };
    let mut finding = of_causes(vec![Cause::Term(term)], 1e-9, BTreeMap::new(), Basis::Products(300));
    let before = finding.clone();
    finding.or_unlisted(1.0, Doubt::FaultyRecords);
    assert_eq!(finding.causes, before.causes);
    assert_eq!(finding.probability, 0.5 * before.probability);
}

fn effect(id: &'static str) -> Candidate {
    Candidate::Effect { id, variant: 0, at: None }
}

fn test(p_value: f64, statistic: f64) -> Test {
    Test { statistic, p_value, estimates: vec![(0.02, 0.004), (0.01, f64::NAN)] }
}

fn name(id: &'static str, log_odds: f64, outdone: bool) -> Name {
    Name { candidate: effect(id), log_odds, explains: log_odds, inflation: 1.0, outdone }
}

fn is_near(found: f64, expected: f64) -> bool {
    (found - expected).abs() < 1e-9 * expected.abs().max(1e-300)
}

#[test]
fn a_cause_is_as_probable_as_its_odds_and_no_catalogue_is_complete() {
    let names = [name("slip_speed", 20.0, false), name("castor_drag", 19.0, false)];
    let found = of_candidate(&effect("slip_speed"), &names, &test(1e-6, 25.0), 4);
    assert_eq!(found.causes, [SLIP, CASTOR]);
    // Odds 1 : e⁻¹ of 0.95.
    assert!(is_near(found.probability, 0.95 / (1.0 + (-1.0_f64).exp())), "{}", found.probability);
    // Four variants were tried. Rejects the p-value of one.
    assert!(is_near(found.p_value, sidak(1e-6, 4)) && is_near(found.z, z_of_p(sidak(1e-6, 4))), "{found:?}");
    assert_eq!(found.parameters["slip_s_m"].value, 0.02);
    assert_eq!((found.parameters["slip_s_m"].sigma, found.basis), (Some(0.004), Basis::Mean));
    // Where an impossible one does better, it may be none of them.
    let outdone = of_candidate(&effect("slip_speed"), &[name("slip_speed", 20.0, true)], &test(1e-6, 25.0), 1);
    assert_eq!(outdone.causes, [SLIP, Cause::Unknown]);
    // What cannot be explains more: something else is as likely.
    assert!(is_near(outdone.probability, 0.475) && is_near(outdone.p_value, 1e-6));
    // What a double does not hold is told by the statistic.
    let beyond = of_candidate(&effect("slip_speed"), &[], &test(0.0, 2500.0), 1);
    assert_eq!((beyond.z, beyond.probability), (50.0, 0.95));
}

#[test]
fn parameters_have_their_units_and_those_that_were_tried_have_no_error() {
    // A hinge speed is held: its unit is the end of its name.
    let hinged = crate::candidates::candidate::mean_terms(&[])
        .into_iter()
        .find(|candidate| candidate.fixed().iter().any(|(name, _)| name.ends_with("_s")))
        .expect("a variant that holds a time or a speed");
    let (held, value) = hinged.fixed()[0];
    let estimates = vec![(0.02, f64::INFINITY); hinged.parameters().len()];
    let all = parameters(&hinged, &estimates);
    assert_eq!((all[held].value, all[held].sigma, all[held].unit.as_str()), (value, None, "s"));
    let first = hinged.parameters()[0];
    assert_eq!((all[first.name].sigma, all[first.name].unit.as_str()), (None, first.unit));
    assert_eq!(all.len(), hinged.parameters().len() + hinged.fixed().len());
}

#[test]
fn the_prior_of_an_uncatalogued_cause_is_one_in_twenty() {
    assert!(is_near(uncatalogued_log_odds(), -19.0_f64.ln()));
}

#[test]
fn a_product_that_is_determined_is_a_cause_with_its_covariates() {
    use effects::{Channel, Covariate, Sparse};
    let product = Candidate::Sparse(Sparse { channel: Channel::Yaw, covariates: vec![Covariate::Speed] });
    let found = of_sparse(&product, &test(1e-8, 40.0), 1e-5, 300).expect("a product");
    let Cause::Term(term) = found.first() else { panic!("a term") };
    assert_eq!((term.channel.as_str(), term.coefficient, term.sigma), ("yaw", 0.02, 0.004));
    assert!(found.is_unlisted() && found.has_unlisted() && found.probability == 1.0);
    assert_eq!((found.p_value, found.z, found.basis), (1e-5, z_of_p(1e-5), Basis::Products(300)));
    // One without an error is no term, and an effect is no product.
    let without = Test { estimates: vec![(0.02, f64::NAN)], ..test(1e-8, 40.0) };
    assert_eq!(of_sparse(&product, &without, 1e-5, 300).expect("a product").causes, [Cause::Unknown]);
    assert!(of_sparse(&effect("slip_speed"), &test(1e-8, 40.0), 1e-5, 300).is_none());
}

/// Checks that fail or pass with their p-values.
fn checked(checks: &[(Check, f64, bool)]) -> Checked {
    let of = |(check, p_value, passes): &(Check, f64, bool)| TestResult {
        check: check.clone(),
        statistic: 9.0,
        p_value: *p_value,
        passes: *passes,
    };
    let outliers = crate::checks::residual_tests::Outliers::default();
    Checked {
        autocorrelated: false,
        checks: checks.iter().map(of).collect(),
        correlation: Correlation::default(),
        outliers,
    }
}

#[test]
fn failed_checks_are_as_significant_as_the_dependence_that_they_show() {
    use crate::checks::check::Component;
    let (tails, white) = (Check::Tails(Component::Along), Check::Whiteness(Component::Across));
    let speed = Check::Covariate("speed".to_owned());
    let of = |checks: &[(Check, f64, bool)]| of_failed_checks(&checked(checks), &[], ["slip_speed"].into_iter());
    assert!(of(&[(tails.clone(), 1e-9, true), (speed.clone(), 0.1, true)]).is_none());
    // Rejects the least of all p-values, that of the tails, and one that passes.
    let found = of(&[(tails.clone(), 1e-9, false), (speed.clone(), 1e-6, false), (white.clone(), 1e-12, true)]);
    let found = found.expect("two fail");
    // What was refused for other runs may explain a dependence, and neither tails nor autocorrelation.
    assert_eq!((found.p_value, &found.causes[..]), (1e-6, &[Cause::Unknown, SLIP][..]));
    assert_eq!(found.basis, Basis::FailedTests(vec![tails.clone(), speed]));
    assert_eq!(of(&[(tails.clone(), 1e-9, false)]).expect("it fails").p_value, 1e-9);
    // Autocorrelation alone may be of errors of the instrument that last.
    let errors = of(&[(white.clone(), 1e-7, false), (tails.clone(), 0.3, true)]).expect("it fails");
    assert_eq!(errors.causes, [Cause::Unknown, Cause::Effect("truth_correlated_noise")]);
    assert_eq!(of(&[(white, 1e-7, false), (tails, 1e-7, false)]).expect("both fail").causes, [Cause::Unknown]);
}

#[test]
fn regress_errors_that_last_may_show_as_a_dependence_that_is_less_plain_than_their_correlation() {
    use crate::checks::check::Component;
    let of = |white: f64, speed: f64| {
        let checks =
            [(Check::Whiteness(Component::Across), white, false), (Check::Covariate("speed".to_owned()), speed, false)];
        of_failed_checks(&checked(&checks), &[], [].into_iter()).expect("both fail").causes
    };
    assert_eq!(of(1e-8, 1e-6), [Cause::Unknown, Cause::Effect("truth_correlated_noise")]);
    // A dependence that is plainer than the correlation is not made by it.
    assert_eq!(of(1e-6, 1e-8), [Cause::Unknown]);
}

#[test]
fn effects_with_a_sign_are_named_unless_they_are_taken_out() {
    let all = with_sign(Sign::AutocorrelatedErrors, &[]);
    assert_eq!(all, ["truth_correlated_noise"]);
    assert!(with_sign(Sign::AutocorrelatedErrors, &["truth_correlated_noise".to_owned()]).is_empty());
    // Rejects taking out all but the one that is to be.
    assert_eq!(with_sign(Sign::AutocorrelatedErrors, &["bumps".to_owned()]), all);
    assert!(!has_sign("slip_speed", Sign::AutocorrelatedErrors) && !has_sign("nothing", Sign::HeadingJumps));
}

#[test]
fn mean_effects_alone_are_doubted_for_a_term_that_does_as_well() {
    let scatter = Finding { parameters: BTreeMap::new(), ..found(5.0, &[Cause::Effect("bumps")]) };
    let mut findings = [found(5.0, &[SLIP]), scatter.clone()];
    beside_unlisted(&mut findings, 0.5);
    assert_eq!((&findings[0].causes[..], findings[0].probability), (&[SLIP, Cause::Unknown][..], 0.9 / 1.5));
    assert_eq!(findings[0].doubts, [Doubt::TermDoesAsWell]);
    assert_eq!(findings[1], scatter);
    // Sizes without a mean term, and a mean term without sizes, are no mean effect.
    assert!(!Finding { parameters: BTreeMap::new(), ..found(5.0, &[SLIP]) }.is_certain());
    assert!(!found(5.0, &[Cause::Effect("swapped_wheels")]).is_certain() && found(5.0, &[SLIP]).is_certain());
}

#[test]
fn what_is_left_beside_an_effect_doubts_it_by_the_bound_of_its_p_value() {
    let doubted = |score: f64, p_value: f64| {
        let mut findings = [found(10.0, &[SLIP]), found(10.0, &[SLIP, Cause::Unknown])];
        or_incomplete(&mut findings, score, p_value);
        assert_eq!(findings[1], found(10.0, &[SLIP, Cause::Unknown]));
        let [first, _] = findings;
        first.has_unlisted().then_some(first.probability)
    };
    // 1/(e · 0.01 · ln 100) = 7.988, of odds of 1 : 19.
    let odds = (std::f64::consts::E * 0.01 * 100_f64.ln()).recip() / 19.0;
    assert!(is_near(doubted(30.0, 0.01).expect("in doubt"), 0.9 / (1.0 + odds)));
    // Nothing is more than as likely.
    assert!(is_near(doubted(30.0, 1e-12).expect("in doubt"), 0.45));
    assert!(is_near(doubted(30.0, 0.0).expect("in doubt"), 0.45));
    // Above the level, and no more than a hundredth of the effect's own z² = 100.
    assert!(doubted(30.0, 0.05).is_none() && doubted(1.0, 0.01).is_none() && doubted(1.01, 0.01).is_some());
}

#[test]
fn an_effect_whose_size_changes_with_what_it_should_not_is_doubted_beyond_what_is_known_of_its_form() {
    let doubted = |share: f64, p_value: f64, has_exact_form: bool| {
        let mut finding = found(10.0, &[SLIP]);
        or_of_other_form(&mut finding, FormDeviation { share, p_value, by: Covariate::RunTime }, has_exact_form);
        assert!(finding.doubts.is_empty() || finding.doubts == [Doubt::OtherForm(Covariate::RunTime)]);
        finding.has_unlisted().then_some(finding.probability)
    };
    // By the bound of its p-value, as above.
    let odds = (std::f64::consts::E * 0.01 * 100_f64.ln()).recip() / 19.0;
    assert!(is_near(doubted(0.2, 0.01, false).expect("in doubt"), 0.9 / (1.0 + odds)));
    assert!(is_near(doubted(0.2, 1e-12, true).expect("in doubt"), 0.45));
    // A hundredth may be the error of a form, but of no instrument's.
    assert!(doubted(0.01, 1e-12, false).is_none() && doubted(0.011, 1e-12, false).is_some());
    assert!(doubted(0.001, 1e-12, true).is_some() && doubted(0.2, 0.05, true).is_none());
}

#[test]
fn what_the_log_shows_is_a_finding_where_its_test_fails() {
    let test = |passes| TestResult { check: Check::LogRows, statistic: 7.0, p_value: 1e-9, passes };
    let rows = of_outlying_rows(Some(&test(false))).expect("it fails");
    assert_eq!((rows.p_value, rows.basis, &rows.causes[..]), (1e-9, Basis::OutlyingRows(7.0), &[Cause::Unknown][..]));
    let spans = of_spans(Some(&test(false))).expect("it fails");
    assert_eq!((spans.p_value, spans.basis), (1e-9, Basis::OtherClock(7.0)));
    assert!(of_outlying_rows(Some(&test(true))).is_none() && of_spans(Some(&test(true))).is_none());
    assert!(of_outlying_rows(None).is_none() && of_spans(None).is_none());
}

#[test]
fn wheels_that_seem_twice_as_large_count_half_as_often() {
    let found = of_wrong_wheels(2.0, &[]).expect("a fault that multiplies the counts");
    assert_eq!(found.causes, [Cause::Effect("wrong_counts_per_turn")]);
    assert_eq!(found.parameters["factor"].value, 0.5);
    assert_eq!((found.basis, found.p_value), (Basis::WheelFactor(2.0), 0.0));
    let without = of_wrong_wheels(2.0, &["wrong_counts_per_turn".to_owned()]).expect("the same");
    assert_eq!(without.causes, [Cause::Unknown]);
    assert_eq!(of_wrong_wheels(2.0, &["slope".to_owned()]).expect("the same").causes, found.causes);
    // Millimetres for metres, and wheels that no units explain.
    assert_eq!(of_wrong_wheels(1e3, &[]).expect("the same").causes, found.causes);
    assert_eq!(of_wrong_wheels(2e-4, &[]).expect("the same").causes, [Cause::Unknown]);
}

#[test]
fn a_ratio_of_the_geometry_is_the_effect_that_changes_it() {
    use effects::GeometryRatio;
    let deviation = |of| GeometryDeviation { of, ratio: 1.2, sigma: 0.06 };
    let of = |ratio, without: &[String]| of_geometry(deviation(ratio), without);
    let ids = [GeometryRatio::Wheels, GeometryRatio::RightOverLeft, GeometryRatio::Separation].map(|ratio| {
        let found = of(ratio, &[]);
        // ln 1.2 · 1.2/0.06 standard deviations of the logarithm. Rejects 0.2/0.06.
        let z = 1.2_f64.ln() * 1.2 / 0.06;
        assert!(is_near(found.p_value, p_of_chi_square(z * z, 1.0)), "{found:?}");
        let value = found.parameters.values().next().expect("its size");
        assert_eq!((value.value, value.sigma), (1.2, Some(0.06)));
        found.first().id()
    });
    assert_eq!(ids, ["wheel_scale", "wheel_mismatch", "wheelbase"]);
    let without = of(GeometryRatio::Wheels, &["wheel_scale".to_owned()]);
    assert_eq!((&without.causes[..], without.parameters.len()), (&[Cause::Unknown][..], 0));
}

#[test]
fn a_clock_that_was_taken_off_is_added_to_what_is_found_of_all_runs() {
    let of = preflight::ClockOffset { offset_s: 0.3, sigma_s: 0.01, gain: 12.0 };
    let offset = |runs: Option<Vec<String>>| ClockOffset { runs, of };
    let of_all = of_clock(&offset(None), &[]);
    assert_eq!(of_all.causes, [Cause::Effect("truth_latency")]);
    assert_eq!((of_all.parameters["delay_s"].value, of_all.parameters["delay_s"].sigma), (0.3, Some(0.01)));
    // Twice a log likelihood is χ².
    assert!(is_near(of_all.p_value, p_of_chi_square(24.0, 1.0)));
    assert_eq!(of_clock(&offset(None), &["truth_latency".to_owned()]).causes, [Cause::Unknown]);
    let of_run = of_clock(&offset(Some(vec!["run-3".to_owned()])), &[]);
    assert_eq!(of_run.runs.as_deref(), Some(&["run-3".to_owned()][..]));
    let late = Value { value: 0.02, sigma: Some(0.001), unit: "s".to_owned() };
    let late = Finding { parameters: BTreeMap::from([("delay_s".to_owned(), late)]), ..found(9.0, &of_all.causes) };
    let mut findings = [found(5.0, &[SLIP]), late.clone()];
    assert!(add_offset(&mut findings, &of_all));
    // Rejects an offset that replaces what was found, or is taken off it.
    assert!(is_near(findings[1].parameters["delay_s"].value, 0.32) && findings[0] == found(5.0, &[SLIP]));
    // Not to what one run has, nor where there is nothing.
    let mut findings = [Finding { runs: of_run.runs, ..late }];
    assert!(!add_offset(&mut findings, &of_all) && !add_offset(&mut [found(5.0, &[SLIP])], &of_all));
}

#[test]
fn a_fault_of_the_records_shares_its_probability_with_its_rivals() {
    let fault = |gain: f64, rivals: &[(&'static str, f64)]| Fault {
        id: "swapped_wheels",
        rivals: rivals.to_vec(),
        values: vec![("probability", 0.01)],
        sentence: "exchanged".to_owned(),
        records: Vec::new(),
        gain,
    };
    let found = of_fault(&fault(50.0, &[("reversed_wheel", -1.0)]));
    assert_eq!(found.causes, [Cause::Effect("swapped_wheels"), Cause::Effect("reversed_wheel")]);
    assert!(is_near(found.probability, 1.0 / (1.0 + (-1.0_f64).exp())) && is_near(found.z, 10.0));
    assert!(is_near(found.p_value, (-50.0_f64).exp()) && found.parameters["probability"].value == 0.01);
    assert_eq!(of_fault(&fault(f64::MAX, &[])).z, 2e6_f64.sqrt());
}

#[test]
fn of_scatter_what_another_cause_exceeds_by_the_margin_is_left_out() {
    let likely = || vec![("bumps", 5.0), ("stick_slip", 10.0), ("traction_loss", 7.5)];
    let scatter = |any, or_unlisted| of_likely_scatter(likely(), any, or_unlisted, 1e-6, Basis::TurnScatter(0.1));
    // The margin is 3: 10, 7.5, and not 5. Odds are over all three.
    let found = scatter(f64::NEG_INFINITY, false);
    assert_eq!(found.causes, [Cause::Effect("stick_slip"), Cause::Effect("traction_loss")]);
    let odds = 1.0 + (-2.5_f64).exp() + (-5.0_f64).exp();
    assert!(is_near(found.probability, 0.95 / odds), "{}", found.probability);
    // An unknown cause is as likely as each of the three.
    let found = scatter(f64::NEG_INFINITY, true);
    assert_eq!(found.causes.last(), Some(&Cause::Unknown));
    assert!(is_near(found.probability, 0.95 * 0.75 / odds), "{}", found.probability);
    // Any cause exceeds 7.5 by more than the margin, and then all.
    assert_eq!(scatter(11.0, false).causes, [Cause::Effect("stick_slip")]);
    let unknown = scatter(20.0, false);
    assert_eq!((&unknown.causes[..], unknown.probability), (&[Cause::Unknown][..], 1.0));
}

#[test]
fn causes_without_a_mean_share_what_the_catalogue_has() {
    let two = of_causes(vec![SLIP, CASTOR], 0.01, BTreeMap::new(), Basis::TurnScatter(0.1));
    assert!(is_near(two.probability, 0.475) && is_near(two.z, z_of_p(0.01)) && two.p_value == 0.01);
    let beside = of_causes(vec![Cause::Unknown, SLIP], 0.01, BTreeMap::new(), Basis::TurnScatter(0.1));
    assert!(is_near(beside.probability, 0.475) && beside.is_unlisted());
}

#[test]
fn an_extended_model_has_what_carries_over_or_what_is_probable_and_alone() {
    let probable = |probability, causes: &[Cause]| Finding { probability, ..found(5.0, causes) }.is_in_extended_model();
    assert!(probable(0.5, &[SLIP]) && probable(0.9, &[SLIP, CASTOR]));
    assert!(!probable(0.49, &[SLIP]) && !probable(0.9, &[SLIP, Cause::Unknown]));
    assert!(found(5.0, &[SLIP, CASTOR]).names(&CASTOR) && !found(5.0, &[SLIP]).names(&CASTOR));
    assert!(found(5.0, &[Cause::Effect("interval_error")]).is_of_stamps() && !found(5.0, &[SLIP]).is_of_stamps());
}

#[test]
fn turns_that_scatter_three_times_as_plainly_take_a_mean_effect_for_a_part_of_them() {
    let scatter = Finding { parameters: BTreeMap::new(), ..found(16.0, &[Cause::Effect("contact_patch_wheelbase")]) };
    let mut findings = [found(5.0, &[SLIP]), found(5.5, &[SLIP]), scatter.clone()];
    doubt(&mut findings, false);
    // 3 · 5 is below 16, 3 · 5.5 is not; the scatter itself is no part.
    assert_eq!(findings[0].doubts, [Doubt::ProbablyPartOfUnlisted]);
    assert!(findings[1].doubts.is_empty() && findings[2] == scatter);
    // What has no mean is doubted below three times, and never put behind; at three times it is not.
    let unknown = of_causes(vec![], 1e-20, BTreeMap::new(), Basis::Autocorrelated(0.3, ErrorsAtRest::Autocorrelated));
    let weak = |z| Finding { parameters: BTreeMap::new(), ..found(z, &[Cause::Effect("bumps")]) };
    let mut findings = [weak(2.0), weak(3.0 * unknown.z), unknown];
    doubt(&mut findings, true);
    assert_eq!(findings[0].doubts, [Doubt::PartOfUnlisted]);
    assert_eq!(findings[0].causes, [Cause::Effect("bumps"), Cause::Unknown]);
    assert!(findings[1].doubts.is_empty());
}
