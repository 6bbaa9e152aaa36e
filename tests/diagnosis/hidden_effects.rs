//! Effects hidden in simulated robots are found and named, nulls are left alone, and what is not in the
//! catalogue gets no other name.
//!
//! The simulator's forward faces are other code and other functional forms than the hypotheses. Every case
//! prints its seed; a case is driven once with it. Seen to fail when the scan forgets to project the
//! calibration out, and when wheel phases start anew in every run.
#![allow(clippy::print_stdout)] // every case with its seed

use blind_benchmark::{Scope, challenge_case};
use dataset::Dataset;
use diagnose::{Document, Options, UnlistedTerm, Verdict, diagnose};
use effects::Effect;
use motion_programs::Schedule;
use scenario::Scenario;
use statrs::distribution::{Binomial, DiscreteCDF};

use crate::motion_capture::{self, simulated};

/// Straights, spins, squares and circles under motion capture, with calibration errors and one more effect.
pub(crate) fn robot(extra: &str) -> Scenario {
    motion_capture::robot(
        extra,
        &[
            Schedule::Straights { length_m: 1.5, runs: 6 },
            Schedule::Spins { turn_rad: std::f64::consts::TAU, runs: 4 },
            Schedule::Squares { side_m: 1.0, runs_each_way: 2 },
            Schedule::Circles { radius_m: 0.6, turns: None, runs_each_way: 2 },
        ],
    )
}

fn diagnosed(dataset: &Dataset, without: &[&str]) -> Document {
    let options = Options { without: without.iter().map(ToString::to_string).collect(), ..Options::default() };
    diagnose(std::slice::from_ref(dataset), &options).expect("a diagnosis").document
}

fn shown(document: &Document) -> Vec<String> {
    document.findings.iter().map(|finding| finding.names.join("|")).collect()
}

/// An effect with sizes that a real robot has, and the names that are right: its own, and what is the same
/// thing to first order on every path.
const HIDDEN: [(&str, &str, &[&str]); 12] = [
    ("slip_speed", "slip_s_m = 0.03", &["slip_speed"]),
    ("wheel_eccentricity", "right_amplitude = 0.004\nright_phase_rad = 1.0", &["wheel_eccentricity"]),
    ("backlash", "left_gap_m = 0.001\nright_gap_m = 0.001", &["backlash"]),
    ("lateral_skid", "skid_s = 0.02", &["lateral_skid"]),
    ("truth_lever_arm", "lever_x_m = 0.01\nlever_y_m = 0.005", &["truth_lever_arm"]),
    ("truth_latency", "delay_s = 0.03", &["truth_latency", "slip_acceleration"]),
    ("carpet_nap", "drift_x = 0.003\ndrift_y = 0.002", &["carpet_nap"]),
    ("direction_asymmetry", "left_asymmetry = 0.004", &["direction_asymmetry"]),
    ("turn_rate_wheelbase", "beta_s = 0.02", &["turn_rate_wheelbase"]),
    ("truth_outliers", "probability = 0.01\njump_m = 0.05\njump_rad = 0.05", &["truth_outliers"]),
    ("truth_correlated_noise", "sigma_xy_m = 0.001\nsigma_theta_rad = 0.001\ntau_s = 1.0", &["truth_correlated_noise"]),
    ("swapped_wheels", "swapped = true", &["swapped_wheels"]),
];

fn case(id: &str, sizes: &str) -> Scenario {
    robot(&format!("[[effect]]\nkind = \"{id}\"\n{sizes}\n"))
}

#[test]
fn a_hidden_effect_is_named() {
    for (number, (id, sizes, right)) in HIDDEN.iter().enumerate() {
        let seed = 9_000 + number as u64;
        let document = diagnosed(&simulated(&case(id, sizes), seed), &[]);
        println!("{id} (seed {seed}): {:?}, {:?}", document.verdict, shown(&document));
        let first = document.findings.first().unwrap_or_else(|| panic!("{id}: nothing was found"));
        assert!(right.contains(&first.names[0].as_str()), "{id}: {:?}", shown(&document));
        assert!(first.names.iter().any(|name| name == id), "{id}: {:?}", shown(&document));
        if let Some(gain) = &document.gain {
            assert!(gain.log_score_per_observation.low > 0.0, "{id}: {gain:?}");
        }
    }
}

#[test]
fn counts_of_another_number_a_turn_are_named_where_only_the_ends_of_bent_paths_are_seen() {
    // From end to end it is half as far as the way between.
    let mut scenario = case("wrong_counts_per_turn", "factor = 4.0");
    scenario.protocols = vec![Schedule::Circles { radius_m: 0.6, turns: Some(0.6), runs_each_way: 4 }];
    let mut dataset = simulated(&scenario, 9_100);
    for run in &mut dataset.runs {
        let within = 1..run.truth.len() - 1;
        run.truth.drain(within);
    }
    let document = diagnosed(&dataset, &[]);
    assert_eq!(shown(&document)[0], "wrong_counts_per_turn", "{:?}", shown(&document));
    assert!((document.findings[0].parameters["factor"].value - 4.0).abs() < 1e-9);
}

/// Family-wise over all gates at most 5 %. As many nulls as YAIR_NULLS says, 40 without; the test fails where
/// so many alarms have a chance of 1e-3 at 5 %.
#[test]
fn nulls_are_consistent() {
    let nulls: u64 = std::env::var("YAIR_NULLS").ok().and_then(|text| text.parse().ok()).unwrap_or(40);
    let scenario = robot("");
    let mut alarms = 0;
    for seed in 0..nulls {
        let document = diagnosed(&simulated(&scenario, 20_000 + seed), &[]);
        if document.verdict != Verdict::Consistent {
            println!("alarm at seed {}: {:?}", 20_000 + seed, shown(&document));
            alarms += 1;
        }
    }
    println!("{alarms} alarms in {nulls} nulls");
    let binomial = Binomial::new(0.05, nulls).expect("a rate");
    let bound = (0..nulls).find(|count| binomial.sf(*count) < 1e-3).unwrap_or(nulls);
    assert!(alarms <= bound, "{alarms} alarms in {nulls}; at 5 % more than {bound} have a chance below 1e-3");
}

/// With the ends of runs alone a large effect makes a fifth of the measurements lie far off by any model
/// without it, and what is left shows nothing: without a search among all measurements this one is
/// `unlisted`.
#[test]
fn a_large_effect_that_shows_in_few_looks_is_not_taken_for_outliers() {
    let (yaw_rad, seed) = (0.02, 71);
    let mut dataset = simulated(&case("truth_yaw", &format!("yaw_rad = {yaw_rad}")), seed);
    for run in &mut dataset.runs {
        run.truth.drain(1..run.truth.len() - 1);
    }
    let document = diagnosed(&dataset, &[]);
    println!("truth_yaw at the ends (seed {seed}): {:?}", shown(&document));
    let found = document.findings.iter().find(|finding| finding.names[0] == "truth_yaw").expect("its name");
    let size = &found.parameters["yaw_rad"];
    // Four of its standard deviations: 6e-5 by chance.
    let sigma = size.sigma.expect("a standard deviation");
    assert!((size.value - yaw_rad).abs() < 4.0 * sigma && sigma < 0.1 * yaw_rad, "{size:?}");
}

/// A wheel's phase has a sine and a cosine: left out of the catalogue, an eccentric wheel is two terms
/// without a name, of that wheel, at the sizes that it has.
#[test]
fn a_wheel_out_of_round_is_two_terms_of_that_wheel_where_it_has_no_name() {
    let (id, sizes, _) = HIDDEN[1];
    let document = diagnosed(&simulated(&case(id, sizes), 9_001), &[id]);
    let found: Vec<&UnlistedTerm> = document.findings.iter().filter_map(|of| of.unlisted_term.as_ref()).collect();
    println!("{id} taken out: {found:?}");
    // 0.004 sin(φ + 1).
    for (covariate, expected) in
        [("v cos(right wheel)", 0.004 * 1.0_f64.sin()), ("v sin(right wheel)", 0.004 * 1.0_f64.cos())]
    {
        let own = found
            .iter()
            .find(|term| term.channel == "right_wheel" && term.covariates == [covariate])
            .expect("its term");
        // Four standard deviations, and a hundredth of it for a form of first order.
        assert!((own.coefficient - expected).abs() < 4.0 * own.sigma + 0.01 * expected, "{own:?} for {expected}");
    }
}

/// A robot whose clock gains four thousandths of all time, as seen every so many of the instrument's poses.
fn of_fast_clock(every: usize) -> Dataset {
    let mut dataset = simulated(&case("clock_rate", "rate = 0.004"), 9_200);
    for run in &mut dataset.runs {
        run.truth = run.truth.iter().step_by(every).copied().collect();
    }
    dataset
}

/// A delay takes up what a clock does in the middle of a run: too much before and too little after. Left out
/// of the catalogue, the clock is no delay alone, also where measurements are too few for a term among
/// hundreds.
#[test]
fn a_clock_that_runs_fast_is_no_delay_alone_where_it_has_no_name() {
    let document = diagnosed(&of_fast_clock(40), &["clock_rate"]);
    println!("clock_rate taken out: {:?}", shown(&document));
    let delay = document.findings.iter().find(|finding| finding.names[0] == "truth_latency").expect("a delay");
    assert!(delay.names.iter().any(|name| name == "unlisted"), "{:?}", shown(&document));
}

/// The first cause of a case's first finding; its effect is the one hidden.
fn first_cause(scope: Scope, seed: u64, number: u64, hidden: &str) -> Option<String> {
    let case = challenge_case(scope, seed, number).expect("it can be simulated").expect("its effect shows");
    assert_eq!(case.hidden[0].id, hidden);
    case.findings().next().map(|reported| reported.names[0].clone())
}

/// Castors that turn a robot by five degrees wherever it reverses: it was pushed there, five times in one log
/// and once in another, and nothing was compared across that.
#[test]
fn regress_a_large_kick_of_a_castor_is_no_robot_that_was_pushed() {
    for number in [3, 132] {
        let first = first_cause(Scope::Large, 6304, number, "castor_kick");
        assert_eq!(first.as_deref(), Some("castor_kick"), "case {number}");
    }
}

/// A castor's drag of sizes that cannot be explains more: lost counts were taken in spite of it, and dropped
/// again as they explained too little beside it, so that nothing was found. So it was in case 29 of seed
/// 44044, where a fit does not confirm lost counts any more since rates go by more rows.
#[test]
fn regress_what_is_found_in_spite_of_what_cannot_be_stays() {
    assert_eq!(first_cause(Scope::Whole, 55_055, 833, "missed_counts").as_deref(), Some("missed_counts"));
}

/// To the calibrated model a quarter of the poses are outliers, which was refused before anything was sought.
#[test]
fn regress_a_large_effect_that_makes_many_poses_outliers_is_named_and_not_refused() {
    assert_eq!(shown(&diagnosed(&of_fast_clock(20), &[])), ["clock_rate"]);
}

/// Taken out of the catalogue, an effect may show as `unlisted`, or stay unseen, or among several names; a
/// single other name would be a lie.
#[test]
fn what_is_not_in_the_catalogue_gets_no_other_name() {
    for (number, (id, sizes, right)) in HIDDEN.iter().enumerate().filter(|(_, (id, ..))| *id != "swapped_wheels") {
        let seed = 9_000 + number as u64;
        let document = diagnosed(&simulated(&case(id, sizes), seed), &[id]);
        println!("{id} taken out (seed {seed}): {:?}, {:?}", document.verdict, shown(&document));
        let same_thing = document.findings.iter().all(|finding| right.contains(&finding.names[0].as_str()));
        assert!(document.verdict != Verdict::Named || same_thing, "{id}: {:?}", shown(&document));
    }
}

#[test]
fn the_extended_scenario_shows_the_same_effect() {
    for (id, sizes) in [("turn_rate_wheelbase", "beta_s = 0.02"), ("carpet_nap", "drift_x = 0.003\ndrift_y = 0.002")] {
        let dataset = simulated(&case(id, sizes), 31);
        let found = diagnose(&[dataset], &Options::default()).expect("a diagnosis");
        let extended = found.extended.expect("a scenario");
        assert!(extended.effects.iter().any(|effect| effect.id() == id), "{id}: {:?}", extended.effects);
        let again = diagnosed(&simulated(&extended, 32), &[]);
        println!("{id} again: {:?}", shown(&again));
        assert!(again.findings.iter().any(|finding| finding.names[0] == id), "{id}: {:?}", shown(&again));
    }
}

/// Hidden terms that no effect of the catalogue does and no other product does on these paths: channel,
/// covariates, coefficient, what else the effect says.
const TERMS: [(&str, &[&str], f64, &str); 4] = [
    ("along", &["|omega|"], 0.004, ""),
    ("yaw", &["v", "x"], 0.02, ""),
    ("along", &["v", "battery_v"], 0.002, "of_runs = { battery_v = [24.0, 23.5, 23.0, 22.0] }"),
    ("seen_heading", &["sin(theta)"], 0.003, ""),
];

fn effect_of_term(channel: &str, covariates: &[impl AsRef<str>], coefficient: f64, more: &str) -> String {
    let names: Vec<&str> = covariates.iter().map(AsRef::as_ref).collect();
    format!(
        "[[effect]]\nkind = \"term\"\nchannel = \"{channel}\"\ncovariates = {names:?}\ncoefficient = {coefficient:?}\n{more}\n"
    )
}

/// The one finding, which must be a term outside of the catalogue on this channel with these covariates, and
/// this size within five standard deviations.
fn unlisted(document: &Document, channel: &str, covariates: &[&str], coefficient: f64) -> UnlistedTerm {
    let [finding] = &document.findings[..] else { panic!("{channel} {covariates:?}: {:?}", shown(document)) };
    let term = finding.unlisted_term.clone().unwrap_or_else(|| panic!("{channel} {covariates:?}: {finding:?}"));
    println!("{channel} {covariates:?}: {}", finding.sentence);
    let mut names: Vec<&str> = term.covariates.iter().map(String::as_str).collect();
    names.sort_by_key(|name| covariates.iter().position(|own| own == name));
    assert_eq!((document.verdict, term.channel.as_str(), &names[..]), (Verdict::Unlisted, channel, covariates));
    // A chance of 5e-6 for all eight that are asked; half of the size would be off by 20 σ or more.
    assert!((term.coefficient - coefficient).abs() < 5.0 * term.sigma, "{coefficient}: {term:?}");
    term
}

/// What hides in a robot and has no name comes back with its channel and its covariates, and again from the
/// extended scenario.
#[test]
fn a_term_of_no_name_comes_back_from_the_extended_scenario() {
    for (number, (channel, covariates, coefficient, more)) in (0..).zip(TERMS) {
        let hidden = robot(&effect_of_term(channel, covariates, coefficient, more));
        let found = diagnose(&[simulated(&hidden, 40 + number)], &Options::default()).expect("a diagnosis");
        let term = unlisted(&found.document, channel, covariates, coefficient);
        let extended = found.extended.expect("a scenario");
        // A finding can be pasted.
        let more = if more.is_empty() { "" } else { "of_runs = { battery_v = [24.0, 23.5] }" };
        let pasted = robot(&effect_of_term(&term.channel, &term.covariates, term.coefficient, more));
        let (Some(Effect::Term(own)), Some(Effect::Term(pasted))) = (extended.effects.last(), pasted.effects.last())
        else {
            panic!("a term comes last: {:?}", extended.effects)
        };
        assert_eq!(
            (own.channel, &own.covariates, own.coefficient),
            (pasted.channel, &pasted.covariates, term.coefficient)
        );
        let again = diagnosed(&simulated(&extended, 60 + number), &[]);
        unlisted(&again, channel, covariates, term.coefficient);
    }
}
