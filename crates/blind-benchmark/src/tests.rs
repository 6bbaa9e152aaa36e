//! The benchmark benched: is the oracle's power what it says, does the tool get nothing of the answer, does a
//! case stand by itself?

use rayon::prelude::*;
use statrs::distribution::{Binomial, DiscreteCDF};

use super::hidden::EffectKind;
use super::instrument::TruthKind;
use super::power::power;
use super::trial::Trial;
use super::*;

/// Probability of either side of a binomial count at which a test fails.
const ALPHA: f64 = 1e-4;

fn is_likely(successes: usize, of: usize, probability: f64) -> bool {
    let binomial = Binomial::new(probability, of as u64).expect("a probability");
    let count = successes as u64;
    binomial.sf(count.saturating_sub(1)) > ALPHA && binomial.cdf(count) > ALPHA
        || (count == 0 && binomial.cdf(0) > ALPHA)
}

/// The oracle's own test on data with noise, by the catalogue's hypothesis and the true variances: at 5 % it
/// rejects nulls so often, and finds an effect of the oracle's limit with the power that its noncentrality
/// says. Half or twice the noncentrality is rejected.
#[test]
fn the_oracle_has_the_power_that_it_states() {
    const TRIALS: usize = 160;
    let id = "slip_speed";
    let trial = Trial::at_limit(5, id).expect("simulates").expect("a robot that shows it");
    let found = |hidden: bool| -> usize {
        (0..TRIALS as u64)
            .into_par_iter()
            .filter(|number| trial.statistic(1000 + number, hidden).expect("simulates") > 3.841_459)
            .count()
    };
    let (alarms, hits) = (found(false), found(true));
    let expected = power(1.0, trial.noncentrality);
    assert!((0.85..0.95).contains(&expected), "{id}: {expected}");
    assert!(is_likely(alarms, TRIALS, 0.05), "{id}: {alarms} alarms in {TRIALS} at 5 %");
    assert!(is_likely(hits, TRIALS, expected), "{id}: {hits} found of {TRIALS} at power {expected}");
    for wrong in [0.5, 2.0] {
        assert!(!is_likely(hits, TRIALS, power(1.0, wrong * trial.noncentrality)), "{id}: {hits} says nothing");
    }
}

#[test]
fn a_case_stands_by_itself() {
    let whole = challenge(3, 8, Scope::Whole, 2, &|| ()).expect("simulates");
    let alone = challenge(3, 8, Scope::Whole, 1, &|| ()).expect("simulates");
    let text = |result: &ChallengeResult| serde_json::to_string(result).expect("has a JSON form");
    assert_eq!(text(&whole), text(&alone));
    let last = whole.cases.last().expect("cases");
    assert_eq!(challenge_case(Scope::Whole, 3, last.case).expect("simulates").as_ref(), Ok(last));
    let other = challenge_case(Scope::Whole, 4, last.case).expect("simulates");
    assert_ne!(other.as_ref(), Ok(last), "another seed is another case");
}

/// The robot drives on where causes stand together, and its plan discriminates them.
#[test]
fn a_set_of_causes_is_followed_by_the_planned_runs() {
    let case = challenge_case(Scope::Whole, 26_026, 110).expect("simulates").expect("shows");
    let planned = case.planned.expect("turn_rate_wheelbase or castor_drag");
    assert!(planned.names.len() > 1, "{:?}", planned.names);
    // Rejects a diagnosis without a plan.
    assert!(planned.planned && planned.resolved_by_plan && !planned.reported.is_empty());
}

/// A robot with coarse encoders, on whose draws causes that were deflated by their own inflation each left
/// `unlisted` alone.
#[test]
fn regress_the_cause_that_explains_most_does_not_lose_by_its_own_inflation() {
    let case = challenge_case(Scope::Whole, 26_026, 2269).expect("simulates").expect("shows");
    let first = case.reported.first().expect("a finding");
    assert!(first.names.iter().any(|name| name == "slip_acceleration"), "{:?}", first.names);
}

/// No name, note or key of a dataset tells what is hidden; loads and jitter stand in cases without such an
/// effect too.
#[test]
fn records_do_not_tell_what_is_hidden() {
    let mut loads_elsewhere = 0;
    for number in 0..20 {
        let Ok(case) = Case::draw(Scope::Whole, 11, number).expect("simulates") else { continue };
        let hidden: Vec<&str> = case.hidden.iter().map(|hidden| hidden.id).collect();
        for dataset in &case.datasets {
            assert_eq!(dataset.provenance, dataset::Provenance::default());
            for run in &dataset.runs {
                assert!(hidden.iter().all(|id| !run.info.id.contains(id)));
                let loaded = run.info.covariates.contains_key("payload_kg");
                assert!(run.info.covariates.len() == usize::from(loaded), "{:?}", run.info.covariates);
                loads_elsewhere += usize::from(loaded && !hidden.contains(&"payload_compression"));
            }
        }
    }
    assert!(loads_elsewhere > 0);
}

#[test]
fn rounds_take_turns_and_leave_every_effect_out_once() {
    let all = hidden::hideable();
    // Three geometry effects, the silent one, that of an instrument's lengths and that of robots that skid
    // cannot be hidden; single events are no property of a robot.
    let is_event = |id: &&&str| matches!(effects::hypothesis(id), Some(effects::Hypothesis::UnknownMotion { .. }));
    assert_eq!(all.len(), effects::CATALOGUE.len() - 6 - effects::CATALOGUE.iter().filter(is_event).count());
    assert!(
        [EffectKind::Mean, EffectKind::Scatter, EffectKind::RecordFault]
            .iter()
            .all(|kind| all.iter().any(|(_, of)| of == kind))
    );
    let places: Vec<u64> = (0..200)
        .map(CaseKind::of)
        .filter(|(case_kind, _)| *case_kind == CaseKind::LeftOut)
        .map(|(_, place)| place)
        .collect();
    assert_eq!(places, (0..40).collect::<Vec<u64>>());
}

/// Positions without headings: what a run's start heading takes up is no signature. Taken for one, it was
/// four fifths of this effect's, which no term could explain.
#[test]
fn regress_a_start_heading_that_is_not_measured_is_no_signature() {
    let case = Case::draw(Scope::Whole, 29029, 233).expect("simulates").expect("a robot");
    assert_eq!((case.instrument_model.kind, case.hidden[0].id), (TruthKind::Positions, "thermal_drift"));
    let share = case.oracle[0].form_share.expect("a mean");
    // A time constant that is tried is within a factor of two of the true one.
    assert!(share > 0.95, "{share}");
}

/// Where the model with the term leaves no residual b of a signature a, the gain is ½|a|² with a standard
/// deviation of |a|; the other way round the term is a loss of as much. The tolerance is what models that
/// explain 99 % of the signature leave, and the curvature of the path over sizes.
#[test]
fn the_gain_of_a_true_term_is_half_of_its_squared_standard_deviation() {
    let mut asked = 0;
    for number in 30..33 {
        let Ok(case) = Case::draw(Scope::Whole, 11, number).expect("simulates") else { continue };
        let ([hidden], [view]) = (&case.hidden[..], &case.oracle[..]) else { continue };
        let explains = view.form_share.is_some_and(|share| share > 0.99) && view.ratio.is_some_and(|ratio| ratio > 2.0);
        if hidden.kind != EffectKind::Mean || hidden.other_form || !explains || case.conditions.has_clock_offset() {
            continue;
        }
        let Some(variants) = effects::hypothesis(hidden.id).and_then(effects::Hypothesis::into_variants) else {
            continue;
        };
        let (truth, elsewhere) = (case.truth().expect("a drive"), case.drive_elsewhere().expect("simulates"));
        let plain = estimation::Model::of(&truth, 0);
        let gains = variants.into_iter().filter_map(|variant| {
            let extended = estimation::Model { term_values: hidden.term_values(&*variant.term), ..plain.clone() };
            oracle::gain_of_terms(&elsewhere, case.noise, &plain, &extended, &mut [variant.term])
        });
        let Some((gain, sigma)) = gains.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(_, sigma)| *sigma > 3.0) else {
            continue;
        };
        assert!((gain / (0.5 * sigma * sigma) - 1.0).abs() < 0.1, "{number}, {}: {gain} ± {sigma}", hidden.id);
        asked += 1;
    }
    assert!(asked >= 2, "{asked}");
}
