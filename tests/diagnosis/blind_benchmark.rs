//! The blind benchmark of diagnosis, a small part of it with a fixed seed, and the same floors under a fresh
//! one.
//!
//! The whole campaign is `just challenge`; docs/diagnosis-benchmark.md has its table. Here stand floors under
//! what that measures, so far below it that only a tool that has broken falls through: one that alarms at
//! nulls one time in two, finds half of what is plain, or names one in four of what it finds.
#![allow(clippy::print_stdout)] // the seed, and what came of it

use crate::support::{document, succeed, usage};
use blind_benchmark::{CaseKind, CaseResult, EffectKind, NoiseClass, Scope, challenge_case};
use rayon::prelude::*;
use statrs::distribution::{Binomial, DiscreteCDF};

/// What the tool must do at the least, as shares: the bar on false positives under white noise, and floors
/// under detection and naming, which docs/diagnosis-benchmark.md measures at 0.9 each.
const ALARMS: f64 = 0.05;
const DETECTED: f64 = 0.7;
const NAMED: f64 = 0.55;

/// A size, in detection limits, at which an effect must be detected: above where the bar on power is, 1.6.
const CLEAR_RATIO: f64 = 2.0;

/// Successes that so many trials fall short of with less than this chance.
fn least(of: usize, share: f64, alpha: f64) -> u64 {
    let binomial = Binomial::new(share, of as u64).expect("a share");
    (0..=of as u64).take_while(|count| binomial.cdf(*count) < alpha).count() as u64
}

fn most(of: usize, share: f64, alpha: f64) -> u64 {
    of as u64 - least(of, 1.0 - share, alpha)
}

fn count<'a>(cases: impl Iterator<Item = &'a CaseResult>, holds: impl Fn(&CaseResult) -> bool) -> (u64, usize) {
    cases.fold((0, 0), |(hits, all), case| (hits + u64::from(holds(case)), all + 1))
}

/// Places of a block of twenty cases that hold nulls and single effects: on these the floors stand.
const NULLS_AND_SINGLES: u64 = 14;

/// Drives these cases of a seed. Left out is the case of an effect that no robot drawn for it shows.
fn driven(seed: u64, numbers: impl Iterator<Item = u64>) -> Vec<CaseResult> {
    let numbers: Vec<u64> = numbers.collect();
    let results =
        numbers.into_par_iter().map(|number| challenge_case(Scope::Whole, seed, number).expect("simulates").ok());
    results.collect::<Vec<_>>().into_iter().flatten().collect()
}

/// Three floors, each with a third of `alpha`.
fn holds(seed: u64, cases: &[CaseResult], alpha: f64) {
    let white = || cases.iter().filter(|case| case.noise == NoiseClass::White);
    let share = alpha / 3.0;
    let (alarms, nulls) =
        count(white().filter(|case| case.case_kind == CaseKind::Null), |case| case.findings().next().is_some());
    let plain = || {
        white().filter(|case| {
            let shows = |ratio: Option<f64>| ratio.is_some_and(|ratio| ratio > CLEAR_RATIO);
            case.case_kind == CaseKind::Single
                && case.hidden.iter().all(|own| own.kind == EffectKind::Mean && shows(own.ratio))
        })
    };
    let (detected, singles) = count(plain(), |case| case.findings().next().is_some());
    let named = |case: &CaseResult| {
        case.hidden
            .iter()
            .all(|hidden| case.findings().next().is_some_and(|reported| reported.names.contains(&hidden.id)))
    };
    let (named, reported) = count(plain().filter(|case| case.findings().next().is_some()), named);
    println!(
        "seed {seed}: {alarms} alarms in {nulls} nulls, {detected} of {singles} detected, {named} of {reported} named"
    );
    assert!(alarms <= most(nulls, ALARMS, share), "{alarms} alarms in {nulls} nulls");
    assert!(detected >= least(singles, DETECTED, share), "{detected} of {singles} detected");
    assert!(named >= least(reported, NAMED, share), "{named} of {reported} named");
}

/// Of cases 0 to 19 of a seed all 7 nulls and 7 singles, and one pair and one effect that is left out, of
/// which nothing is asked here but an answer. CI's gate drives 440 cases of another seed.
#[test]
fn a_fixed_part_of_the_challenge_is_passed() {
    let seed = 20_260;
    let cases = driven(seed, (0..20).filter(|number| number % 20 < NULLS_AND_SINGLES || [14, 16].contains(number)));
    let in_case_kind = |case_kind: CaseKind| cases.iter().filter(|case| case.case_kind == case_kind).count();
    // No robot may show an effect that was drawn for it, in a few cases in a hundred.
    assert!(in_case_kind(CaseKind::Null) == 7 && (5..=7).contains(&in_case_kind(CaseKind::Single)), "{}", cases.len());
    assert!(in_case_kind(CaseKind::Pair) > 0 && in_case_kind(CaseKind::LeftOut) > 0);
    holds(seed, &cases, 1e-3);
}

/// Nothing can have been tuned on a seed that nobody has seen. At the floors' own rates this fails once in 10
/// 000 runs, and the tool is better than its floors.
#[test]
#[ignore = "a campaign, not a test: `just fresh-seeds` takes a seed from the clock and gives it in YAIR_SEED"]
fn a_part_of_the_challenge_that_nobody_has_seen_is_passed() {
    let seed = std::env::var("YAIR_SEED").expect("YAIR_SEED").parse().expect("a whole number");
    holds(seed, &driven(seed, (0..200).filter(|number| number % 20 < NULLS_AND_SINGLES)), 1e-4);
}

#[test]
fn floors_are_what_chance_leaves() {
    // Of 100 with share one half: 35.4 is 2.9 σ below (P ≤ 34 = 9e-4, P ≤ 35 = 1.8e-3).
    assert_eq!((least(100, 0.5, 1e-3), most(100, 0.5, 1e-3)), (35, 65));
    assert_eq!(least(0, 0.5, 1e-3), 0);
    assert!(most(20, 0.05, 3e-4) < 20, "a tool that always alarms is caught");
}

#[test]
fn the_command_prints_one_document_and_drives_any_case_again() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let whole = document(folder.path(), &["challenge", "--cases", "8", "--seed", "5"]);
    assert_eq!(whole["seed"], 5);
    let measures: Vec<&str> =
        whole["measures"].as_array().expect("measures").iter().filter_map(|measure| measure["id"].as_str()).collect();
    for id in
        ["false_alarms", "power_ratio", "first_name", "set_holds", "left_out", "pairs", "gain", "calibration_error"]
    {
        assert!(measures.contains(&id), "{id} in {measures:?}");
    }
    let seventh = whole["cases"].as_array().expect("cases").iter().find(|case| case["case"] == 7).expect("case 7");
    let alone = document(folder.path(), &["challenge", "--case", "7", "--seed", "5", "--out", "seen"]);
    assert_eq!(&alone, seventh);
    // What the tool saw can be given to it again by hand; nothing in it says what was hidden.
    let shown = document(folder.path(), &["diagnose", "seen/session_0"]);
    assert!(shown["verdict"].is_string());
    let text = succeed(folder.path(), &["challenge", "--case", "7", "--seed", "5"]).stdout;
    assert!(text.contains("hidden: ") && text.contains("said: "), "{text}");
    assert!(usage(folder.path(), &["challenge", "--cases", "0"]).contains("--cases"));
}
