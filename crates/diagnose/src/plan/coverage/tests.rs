//! What a plan adds, takes out and says.

use nalgebra::{DMatrix, DVector};

use super::*;
use crate::plan::manoeuvres::tests::setting;
use crate::plan::rival_odds::tests::normal_equations;

fn scenario(text: &str) -> Scenario {
    Scenario::parse(text, "a.toml").expect("a shipped scenario")
}

#[test]
fn noise_is_that_of_the_instrument_and_of_the_wheels() {
    let of = |scenario: &Scenario| noise(scenario).map(|noise| noise.variance.map(f64::sqrt));
    let is_near =
        |found: [f64; 4], expected: [f64; 4]| found.iter().zip(expected).all(|(found, of)| (found - of).abs() < 1e-9);
    let captured = scenario(crate::small_robot::MOTION_CAPTURE);
    assert!(is_near(of(&captured).expect("poses"), [5e-4, 1e-6, 3e-4, 5e-4]));
    // Two marks, 0.463 m from each other, read to 0.5 mm on a grid of 1 mm: √(0.25 + 1/12) mm each.
    let grid = scenario(crate::small_robot::PAPER);
    let mark = (0.25e-6_f64 + 1e-6 / 12.0).sqrt();
    let heading = mark / (2.0 * 0.2315_f64.powi(2)).sqrt();
    let found = of(&grid).expect("poses");
    assert!(is_near(found, [5e-4, 1e-6, mark / 2_f64.sqrt(), heading]), "{found:?}");
    let blind = Scenario { instruments: Vec::new(), ..grid };
    assert_eq!(of(&blind), None);
}

#[test]
fn some_variants_are_the_first_the_middle_and_the_last() {
    let candidates = |id: &'static str, variants: usize| {
        (0..variants).map(move |variant| Candidate::Effect { id, variant, at: None })
    };
    let all: Vec<Candidate> = candidates("a", 7).chain(candidates("b", 2)).chain(candidates("c", 1)).collect();
    let some: Vec<(&str, usize)> = some_shapes(&all)
        .iter()
        .map(|of| match of {
            Candidate::Effect { id, variant, .. } => (*id, *variant),
            Candidate::Sparse(_) | Candidate::Deviation { .. } => panic!("an effect"),
        })
        .collect();
    assert_eq!(some, [("a", 0), ("a", 3), ("a", 6), ("b", 0), ("b", 1), ("c", 0)]);
}

/// Normal equations of one column with this information.
fn informing(information: f64) -> NormalEquations {
    normal_equations(&DMatrix::from_element(1, 1, information.sqrt()), &DVector::zeros(1))
}

/// A pair of runs of each manoeuvre whose only column has this information.
fn informing_options(setting: &Setting, information: &[f64]) -> Vec<(Manoeuvre, NormalEquations)> {
    let of = |(manoeuvre, information): (Manoeuvre, &f64)| (manoeuvre, informing(*information));
    library(setting).into_iter().zip(information).map(of).collect()
}

#[test]
fn runs_are_added_by_what_they_bring_a_minute_as_long_as_there_is_time() {
    let setting = setting();
    // Eight kinds of run, of which each run brings as much as the one before.
    let options = informing_options(&setting, &[1.0, 0.5, 1.2, 1.1, 0.001, 0.9, 1.0, 1.0]);
    let before = informing(0.0);
    let worth = |equations: &NormalEquations| equations.information[(0, 0)];
    let (parts, after, minutes) = mix(&options, &before, &setting, worth);
    let of = |parts: &[Part]| -> (f64, f64) {
        let sum = parts.iter().map(|part| {
            let (_, equations) = options.iter().find(|(of, _)| *of == part.manoeuvre).expect("an option");
            let pairs = f64::from(part.pairs);
            (pairs * part.manoeuvre.cost(&setting).minutes, pairs * worth(equations))
        });
        sum.fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1))
    };
    assert!((of(&parts).0 - minutes).abs() < 1e-9 && (of(&parts).1 - worth(&after)).abs() < 1e-9, "{parts:?}");
    assert!(minutes <= setting.minutes, "{minutes}");
    // The first is worth most a minute, and no other one a third more than another run of it.
    let best = options.iter().max_by(|a, b| {
        let per_minute = |of: &(Manoeuvre, NormalEquations)| worth(&of.1) / of.0.cost(&setting).minutes;
        per_minute(a).total_cmp(&per_minute(b))
    });
    assert_eq!(parts[0].manoeuvre, best.expect("an option").0);
    let left = setting.minutes - minutes;
    assert!(left < parts[0].manoeuvre.cost(&setting).minutes, "{left} min are left");
    // A gain of a hundredth is too little.
    let (none, _, minutes) = mix(&options[4..5], &before, &setting, worth);
    assert!(none.is_empty() && minutes == 0.0);
    // Where each kind is worth something once, six are all that anybody keeps track of.
    let once = |equations: &NormalEquations| worth(equations).sqrt();
    let ten = informing_options(&Setting { minutes: 1e3, ..setting.clone() }, &[1.0; 10]);
    let (six, ..) = mix(&ten, &before, &Setting { minutes: 1e3, ..setting }, once);
    assert!(six.len() <= 6, "{six:?}");
}

#[test]
fn runs_that_change_nothing_are_taken_out_again() {
    let setting = setting();
    let options = informing_options(&setting, &[1.0, 1.0, 1.0]);
    let before = informing(0.0);
    let part = |k: usize, pairs| Part { manoeuvre: options[k].0, pairs };
    let mut parts = vec![part(0, 3), part(1, 2), part(2, 2)];
    let after = with_parts(&before, &parts, &options);
    // Detectable from an information of 4 on: the last kinds go first.
    let detected = |equations: &NormalEquations| if equations.information[(0, 0)] > 3.5 { vec!["a"] } else { vec![] };
    let left = pruned(&mut parts, &options, &before, &after, detected);
    assert_eq!(parts, [part(0, 3), part(1, 1)]);
    assert!((left.information[(0, 0)] - 4.0).abs() < 1e-12);
    // What never became detectable was in vain.
    pruned(&mut parts, &options, &before, &left, |_| Vec::new());
    assert_eq!(parts, []);
}

#[test]
fn what_stays_hidden_is_said_with_what_would_show_it() {
    assert_eq!(not_detectable_among(&[]), "");
    let manoeuvred = not_detectable_among(&["slip_speed", "backlash"]);
    assert_eq!(manoeuvred, " Still not detectable: slip_speed, backlash.");
    let how = conditions("payload_compression").expect("it needs a payload");
    assert_eq!(
        not_detectable_among(&["payload_compression"]),
        format!(" Still not detectable: payload_compression ({how}).")
    );
    assert!(
        !is_driven(&crate::small_robot::effect("payload_compression"))
            && is_driven(&crate::small_robot::effect("slip_speed"))
    );
    let smallest = |unit: &str| Smallest { value: 0.0123, unit: unit.to_owned(), parameter: "a".to_owned() };
    assert_eq!(from_size(&smallest("m")), "shows from a = 1.23e-2 m on");
    assert_eq!(from_size(&smallest("1")), "shows from a = 1.23e-2 on");
    let all = [("a", 4.57, smallest("m")), ("b", 4.56, smallest("m"))];
    assert_eq!(detected_ids(&all), ["a"]);
}
