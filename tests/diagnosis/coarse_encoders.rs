//! Motion capture beside coarse encoders: what counts are rounded by is neither normal nor independent, and
//! tests are judged by runs that are simulated with it.

use blind_benchmark::{CaseInstrument, Scope, challenge_case};

/// What is said of a null of the benchmark that motion capture sees, and no fault of its records explains.
fn said(seed: u64, number: u64) -> Vec<String> {
    let case = challenge_case(Scope::Instrument(CaseInstrument::Capture), seed, number);
    let result = case.expect("it can be simulated").expect("nothing is hidden, so that nothing fails to show");
    assert!(result.hidden.is_empty());
    result.findings().map(|reported| reported.names.join("|")).collect()
}

/// Circles of a toy with ticks of 1.4 mm: headings seemed to scatter with the turn, z = 15.8.
#[test]
fn regress_rounding_is_no_scatter_of_turns() {
    assert_eq!(said(22_022, 28), Vec::<String>::new());
}

/// A vehicle with ticks of 6.9 mm: `missed_counts` at z = 9.6, as what it explains was not judged by
/// simulated runs once it took another's place, and `backlash`, as simulated runs stopped at whole counts.
#[test]
fn regress_rounding_is_no_slip_and_no_play() {
    assert_eq!(said(22_022, 104), Vec::<String>::new());
    assert_eq!(said(20_020, 60), Vec::<String>::new());
}

/// Squares of a toy whose wheels are 50 mm apart, ticks of 0.3 mm: `castor_drag` at z = 23, whose covariate
/// has the rounding of the counts in it.
#[test]
fn regress_rounding_within_a_covariate_is_no_effect() {
    assert!(said(20_020, 92).iter().all(|names| !names.contains("castor_drag")));
}
