//! Scores of runs with the free columns taken out: their sum, and their variances.

use super::*;
use crate::{NormalEquations, SchurComplement};

/// Roundings, and the ridge of 10⁻¹², which changes what the free columns explain by as much of itself.
const TOLERANCE: f64 = 1e-9;

#[test]
fn scores_of_runs_and_their_variances_sum_to_those_of_all_runs() {
    let dataset = dataset_of(4, true);
    let fit = ModelFit::from_parameters(MODEL, NOISE, &[dataset.session()]);
    let runs = fit.scan(&mut [Box::new(TravelTerm)]).runs;
    let all = total(&runs).expect("runs");
    let tested = [Column::Term(0).index(), Column::Term(1).index()];
    let free = [Column::LeftWheel, Column::RightWheel, Column::Separation, Column::SensorY];
    // One direction of the free columns stays nominal.
    let fixed = nalgebra::DVector::from_row_slice(&[0.6, -0.8, 0.0, 0.0]);
    for basis in [crate::free_basis(4, &[]), crate::free_basis(4, &[fixed])] {
        let complement = SchurComplement::of(&all, &free, basis).expect("determined");
        let projected = complement.of_columns(&all, &tested);
        let scores = runs.iter().map(|run| complement.score_of(run, &all, &tested));
        let sum = scores.fold(nalgebra::DVector::zeros(2), |sum, score| sum + score);
        let scale = projected.information.diagonal().map(f64::sqrt);
        assert!((sum - &projected.gradient).component_div(&scale).amax() < TOLERANCE);
        let of = |run: &NormalEquations| complement.variance_of(run, &all, &tested);
        let sum = runs.iter().map(of).fold(nalgebra::DMatrix::zeros(2, 2), |sum, variance| sum + variance);
        // Of all runs together it is the information that is left.
        for (name, variance) in [("sum", sum), ("of all", of(&all))] {
            let off = (&variance - &projected.information).amax() / projected.information.amax();
            assert!(off < TOLERANCE, "{name}: {variance} {}", projected.information);
        }
        // The free columns do explain a part.
        assert!(projected.share.iter().all(|share| *share < 0.99), "{:?}", projected.share);
    }
}

#[test]
fn a_scan_has_samples_where_they_are_asked_for_and_nothing_of_columns_that_are_not_free() {
    let dataset = dataset_of(3, true);
    let mut fit = ModelFit::from_parameters(MODEL, NOISE, &[dataset.session()]);
    let samples = fit.scan_with_samples(&mut []).samples;
    let scanned = fit.scan(&mut []);
    let innovations: usize = scanned.innovations.iter().map(Vec::len).sum();
    // Of three components.
    assert_eq!(3 * samples.iter().map(Vec::len).sum::<usize>(), innovations);
    assert!(samples.iter().any(|phase| !phase.is_empty()));
    assert!(scanned.samples.iter().all(Vec::is_empty));

    fit.columns = Column::GEOMETRY.to_vec();
    let all = total(&fit.scan(&mut [Box::new(TravelTerm)]).runs).expect("runs");
    let parts = total(&fit.scan_parts(&mut [Box::new(TravelTerm)], &[2])).expect("runs");
    let (free, other) = (Column::Separation.index(), Column::SensorY.index());
    assert!(all.information[(free, other)] != 0.0 && all.information[(other, other)] > 0.0);
    assert_eq!((parts.information[(free, other)], parts.information[(other, other)]), (0.0, 0.0));
    let near = (parts.information[(free, free)] / all.information[(free, free)] - 1.0).abs();
    // Sums of hundreds of roundings.
    assert!(near < 1e-12, "{near}");
}

/// A scale of all variances by S χ² over n has its restricted likelihood's maximum at χ²/(n − p).
#[test]
fn parameters_take_up_a_part_of_the_scatter() {
    let dataset = dataset_of(4, true);
    let pass_options = PassOptions { gate: OutlierGate::Off, noise_score: true, ..PassOptions::default() };
    let found = run(&dataset, &MODEL, &NOISE, &[0.0; 4], pass_options);
    let all = total(&found.runs).expect("runs");
    // Counts are not rounded, so that the four variances make all of S: along their common scale the score is
    // ½ (n − χ²), and that of the restricted likelihood ½ (n − p − χ²).
    let along = |score: nalgebra::Vector4<f64>| score.sum();
    let expected = |parameters: f64| 0.5 * (all.count - parameters - all.chi_square);
    for parameters in [0_usize, 12, 40] {
        let score = along(found.restricted_noise_score(parameters));
        assert!((score - expected(parameters as f64)).abs() < 1e-9 * all.count, "{score} {parameters}");
    }
    assert!(!found.shows_no_scatter(all.count as usize - 1) && found.shows_no_scatter(all.count as usize));
}
