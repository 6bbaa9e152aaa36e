//! Steps as they are taken, and start headings, against what is known of them on paper.

use kinematics::{Pose, Wheels};

use super::*;
use crate::normal_equations::NormalEquations;
use crate::{GroupExtrinsics, Grouping, Instrument};

const MODEL: Model = Model {
    m_per_rad: Wheels { left: 0.08, right: 0.09 },
    separation_m: 0.4,
    body_from_sensor: Pose::new(0.1, 0.2, 0.3),
    own: None,
    latency_s: 0.05,
    gyro_scale: 0.0,
    term_values: Vec::new(),
};

fn columns() -> Vec<Column> {
    vec![Column::LeftWheel, Column::RightWheel, Column::Separation, Column::SensorX, Column::Latency]
}

/// A pass of two runs, the second of which has a free heading.
fn found() -> Pass {
    let run = |number| NormalEquations::new((0, number), Column::BASE.len());
    let by = vec![0.5, -1.0, 2.0, 4.0, 8.0, 16.0, -32.0, 64.0];
    let response = HeadingResponse { rest: 0.25, by, information: 1.0 };
    let headings = vec![FreeHeading { segment: 1, run: (0, 1), response }];
    Pass { runs: vec![run(0), run(1)], headings, ..Pass::nothing() }
}

fn taken(step: &[f64]) -> (Model, [f64; 2], DVector<f64>, f64) {
    let (mut model, mut headings) = (MODEL, [1.0, 2.0]);
    let options = FitOptions::of(&columns());
    let step = DVector::from_row_slice(step);
    let (step, own) = take_step(&mut model, &mut headings, &found(), &options, step).expect("finite");
    (model, headings, step, own)
}

#[test]
fn a_step_moves_the_model_and_headings_follow_it() {
    let (model, headings, step, own) = taken(&[0.125, -0.25, 0.0625, 2.0, -0.5]);
    // No column is cut: the geometry's are below one half, and others are in units of their own.
    assert_eq!((step.as_slice(), own), (&[0.125, -0.25, 0.0625, 2.0, -0.5][..], 0.0));
    let close = |a: f64, b: f64| (a - b).abs() < 1e-15;
    assert!(close(model.m_per_rad.left, 0.08 * 0.125_f64.exp()) && close(model.m_per_rad.right, 0.09 / 0.25_f64.exp()));
    assert!(close(model.separation_m, 0.4 * 0.0625_f64.exp()) && close(model.body_from_sensor.x_m, 2.1));
    assert_eq!((model.body_from_sensor.y_m, model.latency_s), (0.2, 0.05 - 0.5));
    // A quarter of its own, and 0.5 · 0.125 + 1 · 0.25 + 2 · 0.0625 + 4 · 2 + 32 · 0.5 of the step.
    assert_eq!(headings, [1.0, 2.0 + 0.25 + 0.0625 + 0.25 + 0.125 + 8.0 + 16.0]);
}

#[test]
fn geometry_is_moved_by_a_half_at_most_and_headings_follow_the_step_as_it_was_taken() {
    let (model, headings, step, _) = taken(&[3.0, -3.0, 0.0, 0.0, 0.0]);
    assert_eq!(step.as_slice(), &[COMMON.max_geometry_step, -COMMON.max_geometry_step, 0.0, 0.0, 0.0]);
    assert!((model.m_per_rad.left / (0.08 * COMMON.max_geometry_step.exp()) - 1.0).abs() < 1e-15);
    assert_eq!(headings, [1.0, 2.25 + 0.5 * COMMON.max_geometry_step + COMMON.max_geometry_step]);
    let (mut model, options) = (MODEL, FitOptions::of(&columns()));
    for number in [f64::NAN, f64::INFINITY] {
        let step = DVector::from_row_slice(&[0.0, 0.0, 0.0, number, 0.0]);
        let taken = take_step(&mut model, &mut [0.0; 2], &found(), &options, step);
        assert!(matches!(taken, Err(EstimationError::Diverges)), "{number}");
    }
    let nothing = take_step(&mut model, &mut [], &Pass::nothing(), &options, DVector::zeros(5));
    assert!(matches!(nothing, Err(EstimationError::NoMeasurements)));
}

/// Each run has its own position and latency, and responds to the common columns.
#[test]
fn headings_follow_the_instruments_of_their_own_runs() {
    let mut extrinsics = GroupExtrinsics::new(Grouping::Run, vec![Column::SensorX, Column::Latency]);
    extrinsics.of.insert((0, 0), Instrument { body_from_sensor: Pose::new(0.11, 0.2, 0.3), latency_s: 0.06 });
    let mut model = Model { own: Some(extrinsics.clone()), ..MODEL };
    let mut pass = found();
    for (number, run) in pass.runs.iter_mut().enumerate() {
        let odd = |k: usize| (12.9898 * ((k + 50 * number) as f64).powi(2)).sin();
        let factor = DMatrix::from_fn(8, 9, |row, column| 30.0 * odd(9 * row + column));
        run.information.copy_from(&(&factor * factor.transpose()));
        run.gradient.copy_from(&DVector::from_fn(8, |row, _| 10.0 * odd(90 + row)));
    }
    pass.own = extrinsics.eliminate(&mut pass.runs, &model);
    let options = FitOptions::of(&Column::GEOMETRY);
    let step = DVector::from_row_slice(&[0.01, -0.02, 0.03]);
    let mut headings = [1.0, 2.0];
    let (taken, squared) = take_step(&mut model, &mut headings, &pass, &options, step.clone()).expect("finite");
    assert_eq!(taken, step);
    let own: Vec<DVector<f64>> = pass.own.iter().map(|response| response.step(&Column::GEOMETRY, &step)).collect();
    assert!(own.iter().all(|own| own.amin() > 1e-9), "steps to speak of: {own:?}");
    // 0.5 · 0.01 + 1 · 0.02 + 2 · 0.03, and of the second run's own 4 metres and −32 seconds.
    let on_paper = 2.0 + 0.25 + 0.005 + 0.02 + 0.06 + 4.0 * own[1][0] - 32.0 * own[1][1];
    // Roundings of a few numbers. Rejects the first run's instrument.
    assert!((headings[1] - on_paper).abs() < 1e-12 && headings[0] == 1.0, "{headings:?} {on_paper}");
    // The squares of both runs' own steps, over their variances.
    let squares = pass.own[0].squared(&own[0]) + pass.own[1].squared(&own[1]);
    assert!(pass.own[0].squared(&own[0]) > 0.0 && pass.own[1].squared(&own[1]) > 0.0);
    assert!((squared / squares - 1.0).abs() < 1e-12, "{squared} {squares}");
    // From its own instrument, or from the common one where there was none.
    let moved = model.own.expect("own").of;
    let close = |a: f64, b: f64| (a - b).abs() < 1e-15;
    let [first, second] = [moved[&(0, 0)], moved[&(0, 1)]];
    assert!(close(first.body_from_sensor.x_m, 0.11 + own[0][0]) && close(first.latency_s, 0.06 + own[0][1]));
    assert!(close(second.body_from_sensor.x_m, 0.1 + own[1][0]) && close(second.latency_s, 0.05 + own[1][1]));
}

#[test]
fn a_noise_step_is_cut_as_a_whole_and_ends_at_the_least_noise() {
    let least = COMMON.min_noise_sigma * COMMON.min_noise_sigma;
    let of = |variance: [f64; 4], by: [f64; 4]| {
        let mut noise = Noise { variance, timing_s2: 0.0 };
        let moved = take_noise_step(&mut noise, Vector4::from(by));
        (noise.variance, moved)
    };
    let close = |a: f64, b: f64| (a - b).abs() < 1e-12 * b.abs();
    let (variance, moved) = of([1.0, 2.0, 3.0, 4.0], [0.25, -0.25, 0.125, 0.0]);
    let expected = [0.25_f64.exp(), 2.0 / 0.25_f64.exp(), 3.0 * 0.125_f64.exp(), 4.0];
    assert!(variance.iter().zip(expected).all(|(found, on_paper)| close(*found, on_paper)), "{variance:?}");
    assert!((moved - Vector4::new(0.25, -0.25, 0.125, 0.0)).amax() < 1e-12);
    // Twice too long: all of it is halved, so that it keeps its direction.
    let long = 2.0 * COMMON.max_noise_step;
    let (_, moved) = of([1.0; 4], [long, -0.5 * long, 0.0, 0.25 * long]);
    assert!((moved - Vector4::new(1.0, -0.5, 0.0, 0.25) * COMMON.max_noise_step).amax() < 1e-12, "{moved}");
    let (variance, moved) = of([2.0 * least, 1.0, 1.0, 1.0], [-1.0, 0.0, 0.0, 0.0]);
    assert!(variance[0] == least && (moved[0] + 2.0_f64.ln()).abs() < 1e-12, "{variance:?} {moved}");
}

#[test]
fn steps_of_mean_and_noise_stand_one_below_the_other() {
    let noise = Matrix4::from_fn(|row, column| (10 * row + column) as f64);
    let all = block_diagonal(&DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 3.0, 4.0]), &noise);
    assert_eq!(all.shape(), (6, 6));
    for (row, column) in (0..36).map(|k| (k / 6, k % 6)) {
        let on_paper = match (row < 2, column < 2) {
            (true, true) => (1 + 2 * row + column) as f64,
            (false, false) => noise[(row - 2, column - 2)],
            _ => 0.0,
        };
        assert_eq!(all[(row, column)], on_paper);
    }
    let step = stacked(&DVector::from_row_slice(&[1.0, 2.0]), &Vector4::new(3.0, 4.0, 5.0, 6.0));
    assert_eq!(step.as_slice(), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
}

#[test]
fn regress_a_start_that_makes_outliers_settles_among_all_measurements_first() {
    // From its rough start the gate rejects so many, and the heading stays; among all it comes to 1, where so
    // many are rejected.
    let settled_with = |from_rough: usize, from_settled: usize| {
        let pass = |outliers: usize| Pass { outliers: vec![(0, 0); outliers], ..Pass::nothing() };
        let settled = |heading: f64, gate: OutlierGate| match gate {
            OutlierGate::Off => Ok::<_, ()>((1.0, pass(0))),
            OutlierGate::On => Ok((heading, pass(if heading == 1.0 { from_settled } else { from_rough }))),
        };
        settled_from(0.5, OutlierGate::On, settled).map(|(heading, pass)| (heading, pass.outliers.len()))
    };
    assert_eq!(settled_with(462, 3), Ok((1.0, 3)));
    // What makes no fewer outliers is not taken: gross errors may turn a heading that is sought among all.
    assert_eq!(settled_with(3, 462), Ok((0.5, 3)));
    assert_eq!(settled_with(0, 462), Ok((0.5, 0)));
}
