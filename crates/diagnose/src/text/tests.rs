//! What is said of findings, to the letter.

use super::*;
use crate::checks::check::Component;
use crate::checks::errors_at_rest::ErrorsAtRest;
use crate::document::Compared;
use crate::findings::geometry_deviation::GeometryDeviation;
use effects::Covariate;
use kinematics::Pose;

const SLIP: Cause = Cause::Effect("slip_speed");
const CASTOR: Cause = Cause::Effect("castor_drag");

fn value(value: f64, sigma: Option<f64>, unit: &str) -> Value {
    Value { value, sigma, unit: unit.to_owned() }
}

fn found(basis: Basis, causes: &[Cause], doubts: &[Doubt]) -> Finding {
    let parameters = BTreeMap::from([
        ("a_m".to_owned(), value(0.0125, Some(0.001), "m")),
        ("b".to_owned(), value(2.0, Some(0.1), "1")),
        ("c".to_owned(), value(0.5, None, "1")),
    ]);
    Finding {
        causes: causes.to_vec(),
        probability: 0.9,
        z: 6.0,
        p_value: 1e-9,
        parameters,
        basis,
        doubts: doubts.to_vec(),
        runs: None,
        term: None,
        carry_over: None,
    }
}

/// A finding in words.
fn said(basis: Basis, causes: &[Cause], doubts: &[Doubt]) -> String {
    sentence(&found(basis, causes, doubts))
}

#[test]
fn a_mean_effect_is_said_with_its_sizes_and_its_rivals() {
    let sizes = "a_m = 1.250e-2 ± 1.0e-3 m, b = 2.000e0 ± 1.0e-1, c = 0.500";
    assert_eq!(said(Basis::Mean, &[SLIP], &[]), format!("slip_speed: {sizes}"));
    let of_two = format!("one of slip_speed, castor_drag; this data cannot tell which. As slip_speed: {sizes}");
    assert_eq!(said(Basis::Mean, &[SLIP, CASTOR], &[]), of_two);
    // A doubt comes after it, and its unknown cause is none of those that it was found with.
    let low = said(Basis::Mean, &[SLIP, Cause::Unknown], &[Doubt::LowSignificance]);
    assert_eq!(low, format!("slip_speed: {sizes}; its significance is low, and it may be something else"));
    // One that was found with an unknown cause names it.
    let outdone = said(Basis::Mean, &[SLIP, Cause::Unknown], &[]);
    assert_eq!(outdone, format!("one of slip_speed, unlisted; this data cannot tell which. As slip_speed: {sizes}"));
    let part = said(Basis::Mean, &[Cause::Unknown, SLIP], &[Doubt::ProbablyPartOfUnlisted]);
    let or_else = "probably part of an effect that is not in the catalogue, or else slip_speed: ";
    assert_eq!(part, format!("{or_else}{sizes}"));
    let scatter = Basis::TurnScatter(0.0123);
    let by = "headings scatter with the turn, by 12.3 mrad/√rad";
    assert_eq!(said(scatter.clone(), &[SLIP], &[]), format!("slip_speed: {by}"));
    assert_eq!(said(scatter.clone(), &[Cause::Unknown], &[]), format!("not in the catalogue: {by}"));
    // An unknown cause alone is not taken away by a doubt.
    let doubted = said(scatter.clone(), &[Cause::Unknown], &[Doubt::FaultyRecords]);
    let records = "what is wrong with the records may do the same";
    assert_eq!(doubted, format!("not in the catalogue: {by}; {records}"));
    let of_two = format!("one of slip_speed, castor_drag; this data cannot tell which: {by}");
    assert_eq!(said(scatter, &[SLIP, CASTOR], &[]), of_two);
}

#[test]
fn a_term_and_failed_tests_are_said_by_themselves() {
    let term = UnlistedTerm {
        channel: "yaw".to_owned(),
        covariates: vec!["v".to_owned(), "omega".to_owned()],
        coefficient: 0.0125,
        sigma: 0.001,
    };
    let cause = Cause::Term(term);
    let of_term = "not in the catalogue: yaw, grows with v · omega (1.250e-2 ± 1.0e-3); the best of 300 products tried";
    assert_eq!(said(Basis::Products(300), std::slice::from_ref(&cause), &[]), of_term);
    let late = |channel: &str, coefficient: f64| {
        let covariates = vec!["wheel acceleration".to_owned()];
        let term = UnlistedTerm { channel: channel.to_owned(), covariates, coefficient, sigma: 0.001 };
        said(Basis::Products(300), &[Cause::Term(term)], &[])
    };
    assert!(late("wheels", 0.077).ends_with("; so is a log whose speeds are filtered, or that is late, by 0.077 s"));
    assert!(!late("wheels", -0.077).contains("filtered") && !late("left_wheel", 0.077).contains("filtered"));
    let unknown = "not in the catalogue: the best of 300 products tried";
    assert_eq!(said(Basis::Products(300), &[Cause::Unknown], &[]), unknown);
    let names = [found(Basis::Products(300), &[cause], &[]), found(Basis::Mean, &[SLIP, CASTOR], &[])];
    let all = "found, and not all of it is in the catalogue: unlisted (yaw with v · omega), slip_speed or castor_drag";
    assert_eq!(summary(&names, None), all);
    let failed = || Basis::FailedTests(vec![Check::Outliers, Check::Whiteness(Component::Heading)]);
    assert_eq!(
        said(failed(), &[Cause::Unknown], &[]),
        "the residuals are not what the model says (outliers, white_heading), and nothing in the catalogue explains it: the cause is not determined"
    );
    let by_speed = Basis::FailedTests(vec![Check::Covariate("speed".to_owned())]);
    assert!(said(by_speed, &[Cause::Unknown, SLIP], &[]).ends_with(
        "the residuals are not what the model says (speed), and what explains them does not hold over the runs"
    ));
    assert!(said(failed(), &[Cause::Unknown, SLIP], &[]).starts_with(
        "one of unlisted, slip_speed; this data cannot tell which: the residuals are autocorrelated (outliers, white"
    ));
}

#[test]
fn every_basis_is_said_with_its_numbers() {
    let of = |basis| basis_of(basis, None);
    assert!(
        of(Basis::Uncorrelated([0.012, 0.034, 0.056, 0.078]))
            .ends_with("the wheels err by 12 mm/√m and 34 mrad/√rad, and measurements by 56 mm and 78 mrad")
    );
    assert!(of(Basis::OutlyingRows(7.0)).starts_with("7 rows of the log are outliers"));
    assert!(of(Basis::OtherClock(1000.0)).starts_with("the log lasts 1.000e3 times as long"));
    assert!(of(Basis::WheelFactor(2.0)).starts_with("calibrated wheels are 2.00 times as large"));
    let ratio = |of, ratio| Basis::Geometry(GeometryDeviation { of, ratio, sigma: 0.01 });
    assert_eq!(
        of(ratio(GeometryRatio::Separation, 1.5)),
        "the calibrated wheel separation is 1.50 times what the robot's description says: as of a robot that skids in turns, or the description is another robot's"
    );
    assert_eq!(
        of(ratio(GeometryRatio::RightOverLeft, 1.5)),
        "the right wheel over the left one is 1.50 times what the robot's description says: the description is another robot's, or the fit is of something else"
    );
    assert_eq!(of(Basis::RecordFault("swapped".to_owned())), "swapped");
    assert!(of(Basis::IsolatedErrors(3, 200)).starts_with("3 of 200 measurements are isolated"));
    let autocorrelated = |at_rest| of(Basis::Autocorrelated(0.456, at_rest));
    assert!(autocorrelated(ErrorsAtRest::Autocorrelated).contains("(lag-one coefficient 0.46), and no term"));
    assert!(autocorrelated(ErrorsAtRest::WhiteOrSlow).contains("it stands too shortly to tell"));
    assert!(autocorrelated(ErrorsAtRest::White).contains("(lag-one coefficient 0.46) and not while it stands"));
    let errors = [ResidualPersistence::Persistent, ResidualPersistence::Reverting, ResidualPersistence::Undecided];
    let errors = errors.map(|persistence| of(Basis::LargeErrors(persistence)));
    assert!(errors[0].contains("persist") && errors[1].contains("reverts") && errors[2].contains("heavier tails"));
}

fn basis_of(basis: Basis, runs: Option<Vec<String>>) -> String {
    super::basis(&Finding { runs, ..found(basis, &[Cause::Unknown], &[]) })
}

#[test]
fn a_clock_is_before_or_after_and_of_its_runs() {
    let of = |offset_s, runs: &[&str]| {
        let runs = (!runs.is_empty()).then(|| runs.iter().map(ToString::to_string).collect());
        basis_of(Basis::ClockOffset(offset_s), runs)
    };
    assert_eq!(of(0.3, &[]), "the instrument's poses are of 300 ms before their stamps, in all runs");
    assert!(
        of(-0.3, &["a"]).ends_with("300 ms after their stamps, in run a alone, which is left out of everything else")
    );
    assert_eq!(basis_of(Basis::ClockDrift(-4e-3), None), "the robot's clock loses 0.400 % on the instrument's");
    assert!(basis_of(Basis::ClockDrift(4e-3), None).contains("gains 0.400 %"));
    assert!(of(0.3, &["a", "b"]).ends_with("in runs a, b, which are left out of everything else"));
}

#[test]
fn three_events_are_shown_and_the_others_counted() {
    let event = |kind| Anomaly {
        kind,
        run: "r".to_owned(),
        span_s: [1.0, 2.5],
        displacement: Pose::new(0.012, -0.034, 0.1),
        sigmas: 20.0,
    };
    let by = "12 mm ahead, -34 mm to the left, 5.7°";
    let shown = |kind, count: usize| anomalies(&vec![event(kind); count]);
    let one = format!("run r, 1.00 s to 2.50 s: {by}");
    assert!(shown(AnomalyKind::Frame, 1).ends_with(&format!("nothing is compared across it ({one})")));
    assert!(shown(AnomalyKind::RobotOrFrame, 3).ends_with(&format!("across it ({one}; {one}; {one})")));
    assert!(shown(AnomalyKind::RobotOrFrame, 5).ends_with(&format!("({one}; {one}; {one}; 2 more)")));
    assert_eq!(
        shown(AnomalyKind::ExtrinsicHeading, 1),
        format!("the instrument was mounted otherwise than in the other runs; the run is left out (run r: {by})")
    );
}

#[test]
fn doubts_are_said_in_their_order() {
    let all = [
        (Doubt::PartOfUnlisted, "may be part of an effect that is not in the catalogue"),
        (Doubt::TermDoesAsWell, "a term that is not in the catalogue explains it as well"),
        (Doubt::Incomplete, "does not explain all that is there"),
        (Doubt::OtherForm(Covariate::RunTime), "its size changes with time in run, which it should not"),
        (Doubt::ScattersAlike, "other effects that differ from turn to turn scatter alike"),
        (Doubt::OtherGeometry, "with a geometry that is not the described robot's"),
        (Doubt::DoesNotCarryOver, "it does not hold elsewhere: "),
    ];
    for (doubt, words) in all {
        assert!(said(Basis::Mean, &[SLIP, Cause::Unknown], &[doubt]).contains(words), "{words}");
    }
    let two = said(Basis::Mean, &[SLIP, Cause::Unknown], &[Doubt::Incomplete, Doubt::LowSignificance]);
    assert!(two.find("does not explain") < two.find("its significance is low"), "{two}");
}

#[test]
fn a_verdict_is_that_of_the_least_certain_finding_and_a_gain_is_said_where_it_is_significant() {
    let one = || found(Basis::Mean, &[SLIP], &[]);
    let two = || found(Basis::Mean, &[SLIP, CASTOR], &[]);
    let unknown = || found(Basis::TurnScatter(0.1), &[Cause::Unknown], &[]);
    assert_eq!(verdict(&[]), Verdict::Consistent);
    assert_eq!(verdict(&[one()]), Verdict::Named);
    assert_eq!(verdict(&[one(), two()]), Verdict::Ambiguous);
    assert_eq!(verdict(&[two(), unknown()]), Verdict::Unlisted);
    let gain = |low| Gain {
        held_out_runs: 6,
        log_score_per_observation: Compared { base: 0.0, extended: 0.1, low, high: 0.2 },
        drift_percent: None,
        levels: Vec::new(),
    };
    let says = |low| summary(&[one()], Some(&gain(low)));
    assert_eq!(says(0.01), "found: slip_speed; the extended model predicts held-out runs better");
    let nothing = "found: slip_speed; on held-out runs the extended model gains nothing that is significant";
    // Rejects a bound at nothing that counts as above it.
    assert_eq!((says(0.0).as_str(), says(-0.1).as_str()), (nothing, nothing));
    let of_two = "found, with causes that this data cannot discriminate: slip_speed or castor_drag; slip_speed";
    assert_eq!(summary(&[two(), one()], None), of_two);
    assert_eq!(summary(&[], Some(&gain(0.1))), "the calibrated model explains what was measured");
}

#[test]
fn scripts_get_what_was_found_and_why_others_were_refused() {
    let one = finding(&found(Basis::Mean, &[SLIP, CASTOR], &[]));
    assert_eq!(
        (one.id.as_str(), &one.names[..]),
        ("slip_speed", &["slip_speed".to_owned(), "castor_drag".to_owned()][..])
    );
    assert_eq!((one.carries_over, one.in_extended_model, one.unlisted_term), (None, None, None));
    assert_eq!(one.carries_over_why, "it is no term of the mean");
    // A size that was tried at a few values has no share by unit.
    assert_eq!(fitted(&one.parameters), [("a_m", "m", 0.0125), ("b", "1", 2.0)]);
    let cause = |status| {
        let alternative = Alternative { id: "bumps".to_owned(), z: 2.0, log_odds: 3.0, to_the_best: -1.0, status };
        candidate(&alternative).refused
    };
    assert_eq!((cause(Status::Found), cause(Status::NotDiscriminated)), (None, None));
    assert_eq!(cause(Status::NotSignificant).as_deref(), Some("not significant"));
    let of = Heterogeneity::of(&[(0.2, 0.1), (1.0, 0.1), (1.8, 0.1)]).expect("three");
    let said = differences(Level::Kind, of);
    assert_eq!((said.level, said.units, said.cochran_q, said.tau), (GainLevel::Kinds, 3, of.q, of.tau));
    assert_eq!(differences(Level::Session, of).level, GainLevel::Sessions);
}

#[test]
fn a_part_of_a_large_log_is_said_with_its_faults() {
    let part = |row_faults| Subsample {
        sentence: String::new(),
        rows: 600,
        diagnosed_rows: 60,
        measurements: 500,
        diagnosed_measurements: 50,
        stretches: 40,
        diagnosed_stretches: 4,
        row_faults,
    };
    let said = subsample(&part(Vec::new()));
    assert!(said.contains("4 of its 40 stretches were diagnosed") && said.ends_with("in all rows: none"), "{said}");
    assert!(said.contains("(60 of 600 rows, 50 of 500 measurements)"), "{said}");
    let fault = document::RowFault { id: "torn_read".to_owned(), stretches: 7, diagnosed_stretches: 2 };
    let said = subsample(&part(vec![fault.clone(), fault]));
    let one = "torn_read in 7 stretches, 2 of them diagnosed";
    assert!(said.ends_with(&format!("in all rows: {one}; {one}")), "{said}");
}
