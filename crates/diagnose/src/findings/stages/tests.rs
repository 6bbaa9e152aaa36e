//! Stages of the findings, each for itself.

use std::collections::BTreeMap;

use effects::Covariate;

use super::*;
use crate::candidates::cause::Cause;
use crate::checks::check::{Check, Correlation};
use crate::checks::errors_at_rest::ErrorsAtRest;
use crate::checks::residual_tests::{Checked, Outliers};
use crate::findings::finding::of_causes;
use crate::fits::fit_cache::FitCache;
use crate::search::selection::search;
use crate::small_robot::{fitted, session};

/// A structure without effects, whose checks have these p-values.
fn structure<'a>(datasets: &'a [Dataset], checks: &[(Check, f64, bool)]) -> MeanStructure<'a> {
    let base = fitted(datasets);
    let found = search(FitCache::of(&base), &[], 0.01);
    let of = |(check, p_value, passes): &(Check, f64, bool)| TestResult {
        check: check.clone(),
        statistic: 9.0,
        p_value: *p_value,
        passes: *passes,
    };
    let checks = checks.iter().map(of).collect();
    let outliers = Outliers { p_value: 1.0, ..Outliers::default() };
    let checked = Checked { autocorrelated: false, checks, correlation: Correlation::default(), outliers };
    MeanStructure { base, found, checked, unlisted: None, correlated: None, spurious: false, competing: None }
}

fn results<'e, 'a>(datasets: &'e [Dataset], structure: &'e MeanStructure<'a>) -> StageResults<'e, 'a> {
    StageResults {
        recorded: datasets,
        structure,
        log: None,
        spans: None,
        faults: &[],
        clocks: &[],
        drift: None,
        stamps: None,
        anomalies: &[],
        uncorrelated: false,
        without: &[],
        carry_over: &[],
    }
}

fn mean(id: &'static str, z: f64) -> Finding {
    let value = crate::document::Value { value: 1e-3, sigma: Some(2e-4), unit: "1".to_owned() };
    let values = BTreeMap::from([("share".to_owned(), value)]);
    Finding { z, probability: 0.9, ..of_causes(vec![Cause::Effect(id)], 1e-9, values, Basis::Mean) }
}

fn scatters(z: f64) -> Finding {
    let basis = Basis::TurnScatter(0.1);
    Finding { z, ..of_causes(vec![Cause::Effect("bumps")], 1e-9, BTreeMap::new(), basis) }
}

fn fault(id: &'static str) -> Fault {
    let (rivals, values, sentence, records) = (Vec::new(), Vec::new(), String::new(), Vec::new());
    Fault { id, rivals, values, sentence, records, gain: 30.0 }
}

#[test]
fn a_clock_of_all_runs_joins_what_was_found_of_it_and_that_of_a_run_does_not() {
    let datasets = [session(0, 0.0)];
    let structure = structure(&datasets, &[]);
    let of = preflight::ClockOffset { offset_s: 0.3, sigma_s: 0.01, gain: 30.0 };
    let offset = |runs| ClockOffset { runs, of };
    let of_all = [offset(None)];
    let late = finding::of_clock(&of_all[0], &[]);
    let results_of = |offsets: &[ClockOffset], before: Vec<Finding>| {
        clocks(&StageResults { clocks: offsets, ..results(&datasets, &structure) }, before)
    };
    // Beside nothing it is a finding; beside the same effect it is a part of it.
    assert_eq!(results_of(&of_all, vec![]), std::slice::from_ref(&late));
    let joined = results_of(&of_all, vec![late.clone()]);
    assert_eq!((joined.len(), joined[0].parameters["delay_s"].value), (1, 0.6));
    let of_run = results_of(&[offset(Some(vec!["run-1".to_owned()]))], vec![late.clone()]);
    assert_eq!((of_run.len(), of_run[0].parameters["delay_s"].value), (2, 0.3));
}

#[test]
fn faults_come_first_and_then_what_is_most_significant() {
    let datasets = [session(0, 0.0)];
    let structure = structure(&datasets, &[]);
    let (one, faults) = (fault("swapped_wheels"), [&fault("swapped_wheels")]);
    let of = StageResults { faults: &faults, ..results(&datasets, &structure) };
    let first = record_faults(&of, Vec::new());
    assert_eq!(first, [finding::of_fault(&one)]);
    let all = by_significance(&of, vec![first[0].clone(), mean("slip_speed", 5.0), mean("backlash", 50.0)]);
    let ids: Vec<&str> = all.iter().map(|finding| finding.first().id()).collect();
    assert_eq!(ids, ["swapped_wheels", "backlash", "slip_speed"]);
    // Parts of stronger findings are sought behind the faults alone.
    let unknown = of_causes(vec![], 1e-200, BTreeMap::new(), Basis::Autocorrelated(0.3, ErrorsAtRest::Autocorrelated));
    let doubted = doubt_parts_of_stronger_findings(&of, vec![first[0].clone(), mean("slip_speed", 5.0), unknown]);
    assert!(doubted[0].doubts.is_empty() && !doubted[1].doubts.is_empty());
}

#[test]
fn scatter_is_of_effects_without_sizes() {
    assert!(is_scatter(&scatters(5.0)) && !is_scatter(&mean("slip_speed", 5.0)));
    // Backlash or sticking wheels that have sizes were found by their mean.
    let both = effects::CATALOGUE
        .iter()
        .copied()
        .find(|id| matches!(effects::hypothesis(id), Some(effects::Hypothesis::TermsAndScatter(..))))
        .expect("one that does both");
    assert!(!is_scatter(&mean(both, 5.0)));
    assert!(is_scatter(&Finding { parameters: BTreeMap::new(), ..mean(both, 5.0) }));
}

#[test]
fn a_drift_takes_its_remainder_and_one_without_a_name_takes_nothing() {
    let datasets = [session(0, 0.0)];
    let structure = structure(&datasets, &[]);
    let clock = preflight::Clock { rate: -4e-3, ..preflight::Clock::default() };
    let drift = ClockDrift { clock, sigma: 1e-5, gain: 50.0 };
    let of = |without: &[String], causes: Vec<Cause>| {
        let before = Finding { causes, ..mean("slip_speed", 9.0) };
        let results = StageResults { drift: Some(&drift), without, ..results(&datasets, &structure) };
        let all = clocks(&results, vec![before]);
        all.iter().map(|finding| finding.first().id()).collect::<Vec<_>>()
    };
    let (slip, rate) = (Cause::Effect("slip_speed"), Cause::Effect("clock_rate"));
    assert_eq!(of(&[], vec![slip.clone()]), ["slip_speed", "clock_rate"]);
    // A set that holds the clock is what its estimate left, and the clock itself is one finding.
    assert_eq!(of(&[], vec![slip.clone(), rate.clone()]), ["clock_rate"]);
    assert_eq!(of(&[], vec![rate]), ["clock_rate"]);
    // Left out of the catalogue it has no name, and what is doubted stays.
    assert_eq!(of(&["clock_rate".to_owned()], vec![slip, Cause::Unknown]), ["slip_speed", "unlisted"]);
}

#[test]
fn failed_checks_are_reported_where_nothing_explains_them() {
    let datasets = [session(0, 0.0)];
    let speed = || Check::Covariate("speed".to_owned());
    let reported = |p_value, before: Vec<Finding>, faults: &[&Fault]| {
        let structure = structure(&datasets, &[(speed(), p_value, false)]);
        let of = StageResults { faults, ..results(&datasets, &structure) };
        let number = before.len();
        failed_checks(&of, before).len() > number
    };
    assert!(reported(1e-6, vec![], &[]) && reported(1e-6, vec![mean("slip_speed", 9.0)], &[]));
    // Noise explains a dependence, unless that is too plain; what is in no catalogue explains all.
    assert!(!reported(1e-6, vec![scatters(5.0)], &[]) && reported(1e-9, vec![scatters(5.0)], &[]));
    let unknown = of_causes(vec![], 1e-9, BTreeMap::new(), Basis::Autocorrelated(0.3, ErrorsAtRest::Autocorrelated));
    assert!(!reported(1e-9, vec![unknown], &[]));
    // So do counts that are restored roughly, and not every fault.
    assert!(
        !reported(1e-9, vec![], &[&fault("dropped_samples")]) && reported(1e-9, vec![], &[&fault("swapped_wheels")])
    );
}

#[test]
fn what_does_not_carry_over_is_doubted_and_what_is_of_low_significance_too() {
    let datasets = [session(0, 0.0)];
    let structure = structure(&datasets, &[]);
    let refuted = crate::carry_over::tests::of_verdict(Some(false));
    let open = crate::carry_over::tests::of_verdict(None);
    let of = StageResults { carry_over: &[refuted, open], ..results(&datasets, &structure) };
    let term = |term| Finding { term, ..mean("slip_speed", 9.0) };
    let all = doubt_what_does_not_carry_over(&of, vec![term(Some(0)), term(Some(1)), term(None)]);
    assert_eq!(all[0].doubts, [Doubt::DoesNotCarryOver]);
    assert!(all[1].doubts.is_empty() && all[2].doubts.is_empty());
    assert!(all[1].carry_over.is_some() && all[2].carry_over.is_none());
    let all = doubt_low_significance(&of, vec![mean("slip_speed", 4.0), mean("slip_speed", 5.0)]);
    assert!(!all[0].doubts.is_empty() && all[1].doubts.is_empty());
}

#[test]
fn what_the_log_shows_without_a_name_doubts_all_but_the_faults() {
    let datasets = [session(0, 0.0)];
    let structure = structure(&datasets, &[]);
    let failed = |check| TestResult { check, statistic: 7.0, p_value: 1e-9, passes: false };
    let (rows, spans) = (failed(Check::LogRows), failed(Check::LogSpans));
    let swapped = fault("swapped_wheels");
    let faults = [&swapped];
    let before = || vec![finding::of_fault(&swapped), mean("slip_speed", 9.0)];
    let doubts = |log, spans| {
        let of = StageResults { faults: &faults, log, spans, ..results(&datasets, &structure) };
        let all = faults_of_the_log(&of, before());
        (all.len(), all[0].doubts.len(), all[1].doubts.len())
    };
    assert_eq!(doubts(None, None), (2, 0, 0));
    assert_eq!(doubts(Some(&rows), None), (3, 0, 1));
    // Times in other units doubt the fault as well.
    assert_eq!(doubts(None, Some(&spans)), (3, 1, 1));
    let lost = [&fault("dropped_samples")];
    let of = StageResults { faults: &lost, log: Some(&rows), ..results(&datasets, &structure) };
    assert_eq!(faults_of_the_log(&of, before()).len(), 2, "rows that are restored roughly are off");
}

#[test]
fn one_term_that_competes_doubts_mean_effects_and_an_uncorrelated_odometry_is_said() {
    let datasets = [session(0, 0.0)];
    let structure = MeanStructure { competing: Some(0.5), ..structure(&datasets, &[]) };
    let of = results(&datasets, &structure);
    let all = mean_effects(&of, vec![mean("slip_speed", 9.0)]);
    assert_eq!(all[0].doubts, [Doubt::TermDoesAsWell]);
    let all = noise_effects(&StageResults { uncorrelated: true, ..results(&datasets, &structure) }, Vec::new());
    assert!(matches!(all[..], [Finding { basis: Basis::Uncorrelated(_), .. }]), "{all:?}");
    assert!(noise_effects(&of, Vec::new()).is_empty());
}

#[test]
fn another_robots_geometry_is_said_once_and_doubts_what_was_found_beside_it() {
    let datasets = [session(0, 0.0)];
    let of = |[wheels, separation]: [f64; 2]| {
        let mut structure = structure(&datasets, &[]);
        for fit in [&mut structure.base, &mut structure.found.model.fit] {
            let model = &mut fit.solution.model;
            model.m_per_rad = model.m_per_rad.map(|m| wheels * m);
            model.separation_m *= separation;
        }
        let basis = Basis::Autocorrelated(0.3, ErrorsAtRest::Autocorrelated);
        let of_noise = of_causes(vec![Cause::Effect("truth_correlated_noise")], 1e-9, BTreeMap::new(), basis);
        let all = faults_of_the_log(&results(&datasets, &structure), vec![mean("slip_speed", 9.0), of_noise]);
        let doubts = all[0].doubts.clone();
        // Errors that are autocorrelated may be what the wheels of another robot leave.
        assert_eq!(all[1].doubts, doubts);
        (doubts, all[2..].iter().map(|finding| finding.first().id()).collect::<Vec<_>>())
    };
    assert_eq!(of([1.0, 1.0]), (vec![], vec![]));
    // Wheels of another robot are no larger wheels too; a separation is a finding of its own.
    let other = vec![Doubt::OtherGeometry];
    assert_eq!(of([2.0, 1.0]), (other.clone(), vec!["wrong_counts_per_turn"]));
    assert_eq!(of([2.0, 1.4]), (other.clone(), vec!["wrong_counts_per_turn", "wheelbase"]));
    assert_eq!(of([1.2, 1.0]), (other.clone(), vec!["wheel_scale"]));
    // A robot that skids in turns is the one that is described.
    assert_eq!((of([1.0, 1.4]), of([1.0, 0.7])), ((vec![], vec!["wheelbase"]), (other, vec!["wheelbase"])));
}

#[test]
fn stamps_that_were_set_right_roughly_leave_what_has_no_name() {
    let datasets = [session(0, 0.0)];
    let structure = structure(&datasets, &[]);
    let unknown = || of_causes(vec![], 1e-9, BTreeMap::new(), Basis::Autocorrelated(0.3, ErrorsAtRest::Autocorrelated));
    let of_stamps = |share: f64| {
        let value = crate::document::Value { value: share, sigma: Some(0.01), unit: "1".to_owned() };
        Finding { parameters: BTreeMap::from([("share".to_owned(), value)]), ..mean("interval_error", 9.0) }
    };
    let error =
        |is_undone_roughly| StampError::of_test(crate::small_robot::effect("interval_error"), is_undone_roughly);
    let left = |stamps: Option<&StampError>| {
        let of = StageResults { stamps, ..results(&datasets, &structure) };
        without_remainders_of_stamps(&of, vec![of_stamps(0.9), mean("slip_speed", 9.0), unknown()]).len()
    };
    // Rows of this log are told by their stamps: nothing is rough but what was undone roughly.
    assert_eq!((left(Some(&error(true))), left(Some(&error(false))), left(None)), (2, 3, 3));
    let rough = error(true);
    assert!(StageResults { stamps: Some(&rough), ..results(&datasets, &structure) }.restored());
    assert!(!results(&datasets, &structure).restored());
    // Rows that wait for each other are not told; stamps of a negative share are true.
    let mut waiting = session(0, 0.0);
    for run in &mut waiting.runs {
        let t_s: Vec<f64> = (0..run.odometry.t_s.len())
            .map(|row| 0.1 * row as f64 + if row % 7 < 4 { 0.1 * (4 - row % 7) as f64 * 0.9 } else { 0.0 })
            .collect();
        run.odometry.t_s = t_s.into();
    }
    let waiting = [waiting];
    assert!(have_uncertain_rows(&waiting));
    let of = StageResults { recorded: &waiting, ..results(&datasets, &structure) };
    let left = |share| without_remainders_of_stamps(&of, vec![of_stamps(share), unknown()]).len();
    assert_eq!((left(0.9), left(-0.9), left(0.0)), (1, 2, 2));
}

#[test]
fn what_is_left_beside_a_plainer_effect_is_said_once() {
    let datasets = [session(0, 0.0)];
    let structure = structure(&datasets, &[]);
    let left = |doubts: Vec<Doubt>, z: f64| {
        let checks = of_causes(vec![], 1e-9, BTreeMap::new(), Basis::FailedTests(vec![Check::RunToRun]));
        let tails = of_causes(vec![], 1e-9, BTreeMap::new(), Basis::Autocorrelated(0.3, ErrorsAtRest::Autocorrelated));
        let all = vec![Finding { doubts, ..mean("slip_speed", 9.0) }, Finding { z, ..checks }, tails];
        without_what_doubts_say(&results(&datasets, &structure), all).len()
    };
    assert_eq!((left(vec![Doubt::Incomplete], 8.9), left(vec![Doubt::OtherForm(Covariate::RunTime)], 8.9)), (2, 2));
    assert_eq!(
        (left(vec![Doubt::Incomplete], 9.1), left(vec![Doubt::LowSignificance], 8.9), left(vec![], 1.0)),
        (3, 3, 3)
    );
}
