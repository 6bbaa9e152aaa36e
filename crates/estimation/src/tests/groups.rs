//! Instruments that groups of runs have for themselves: what they follow by, and what is left without them.

use nalgebra::{DMatrix, DVector};

use super::*;
use crate::settings::{COMMON, LATENCY_PRIOR_SIGMA_S};
use crate::{GroupExtrinsics, Grouping, Information, Instrument, NormalEquations};

const OWN: [Column; 4] = [Column::SensorX, Column::SensorY, Column::SensorTheta, Column::Latency];

/// A run's normal equation: B Bᵀ of ten times the priors' precision, with a gradient of all columns but a
/// gyroscope's.
fn equation(session: usize) -> NormalEquations {
    let mut equation = NormalEquations::new((session, 0), Column::BASE.len());
    // Of squares, so that no rows are sums of others.
    let odd = |k: usize| (12.9898 * ((k + 100 * session) as f64).powi(2)).sin();
    let factor = DMatrix::from_fn(7, 9, |row, column| 30.0 * odd(9 * row + column));
    equation.information.view_mut((0, 0), (7, 7)).copy_from(&(&factor * factor.transpose()));
    equation.gradient.rows_mut(0, 7).copy_from(&DVector::from_fn(7, |row, _| 5.0 * odd(70 + row)));
    equation
}

#[test]
fn an_instrument_of_its_own_follows_to_its_least_cost_and_the_cost_along_it_is_left() {
    let equations = [equation(0), equation(1)];
    let common = Instrument { body_from_sensor: Pose::new(0.1, -0.2, 0.3), latency_s: 0.01 };
    let own = Instrument { body_from_sensor: Pose::new(0.13, -0.26, 0.42), latency_s: 0.03 };
    let mut extrinsics = GroupExtrinsics::new(Grouping::Session, OWN.to_vec());
    // The second session stands at the common values.
    extrinsics.of.insert((0, 0), own);
    let Instrument { body_from_sensor, latency_s } = common;
    let model = Model { body_from_sensor, latency_s, own: Some(extrinsics.clone()), ..MODEL };
    let mut eliminated = equations.to_vec();
    let responses = extrinsics.eliminate(&mut eliminated, &model);
    assert_eq!(responses.len(), 2);
    let sigma = [
        COMMON.extrinsics_prior_sigma_m,
        COMMON.extrinsics_prior_sigma_m,
        COMMON.extrinsics_prior_sigma_rad,
        LATENCY_PRIOR_SIGMA_S,
    ];
    let precision = DVector::from_fn(4, |k, _| sigma[k].powi(-2));
    let offs = [[0.03, -0.06, 0.12, 0.02], [0.0; 4]];
    let step = DVector::from_row_slice(&[2e-3, -3e-3, 1e-3]);
    let all: Vec<Column> = Column::GEOMETRY.into_iter().chain(OWN).collect();
    for (session, response) in responses.iter().enumerate() {
        let Information { matrix, gradient } = equations[session].of(&all);
        // The own columns where the geometry has taken its step, each with its prior about the common value.
        let prior = precision.component_mul(&DVector::from_row_slice(&offs[session]));
        let pulled = gradient.rows(3, 4) + prior + matrix.view((3, 0), (4, 3)) * &step;
        let curvature = matrix.view((3, 3), (4, 4)) + DMatrix::from_diagonal(&precision);
        let expected = -curvature.cholesky().expect("positive").solve(&pulled);
        let found = response.step(&Column::GEOMETRY, &step);
        // Roundings of a dozen terms.
        assert!((&found - &expected).amax() < 1e-9 * expected.amax(), "{session}: {found} {expected}");
        // What is left costs what the run does along that path, without what they step by themselves.
        let by_step = found - response.step(&Column::GEOMETRY, &DVector::zeros(3));
        let path = DVector::from_iterator(7, step.iter().chain(by_step.iter()).copied());
        let [left, whole] =
            [eliminated[session].cost_after(&Column::GEOMETRY, &step), equations[session].cost_after(&all, &path)];
        assert!((left / whole - 1.0).abs() < 1e-9, "{session}: {left} {whole}");
        assert!(OWN.iter().all(|column| extrinsics.is_shown(response, *column)));
        assert!(!extrinsics.is_shown(response, Column::LeftWheel));
    }
    let sum = total(&eliminated).expect("two");
    assert!(OWN.iter().all(|column| sum.gradient[column.index()] == 0.0));
    assert!(OWN.iter().all(|column| sum.information.column(column.index()).amax() == 0.0));
}

/// Rejects a group that keeps the mounting of the model that it began with: a step of the mounting then
/// changes no pass, and the fit never converges.
#[test]
fn regress_a_run_with_a_latency_of_its_own_has_the_mounting_of_all() {
    let mut model = Model { own: Some(GroupExtrinsics::new(Grouping::Run, vec![Column::Latency])), ..MODEL };
    model.advance_own((0, 0), &DVector::from_element(1, 0.02));
    [Column::SensorX, Column::SensorY, Column::SensorTheta, Column::Latency]
        .into_iter()
        .for_each(|column| model.advance(column, 0.1));
    let [own, other] = [(0, 0), (0, 1)].map(|run| model.instrument(run));
    assert_eq!(own.body_from_sensor, other.body_from_sensor);
    assert_eq!([own.latency_s, other.latency_s], [MODEL.latency_s + 0.02, MODEL.latency_s + 0.1]);
}
