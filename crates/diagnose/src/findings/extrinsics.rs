//! The instrument's extrinsics where they are no small step from the robot's frame: they are free in the base
//! fit, and so they are no term that could be found beside it.

use effects::Extrinsic;
use estimation::{Column, ModelFit};
use kinematics::wrap_to_pi;
use nalgebra::DVector;

use crate::candidates::candidate::{Candidate, mean_terms, terms};
use crate::candidates::cause::{Basis, Cause};
use crate::findings::finding::{Finding, of_causes, parameters, z};
use crate::fits::augmented_model::AugmentedModel;
use crate::fits::statistics::p_of_chi_square;
use crate::settings::LEVELS;

/// The columns of a base fit that are a part of the extrinsics; none where these stay nominal.
fn columns_of(base: &ModelFit<'_>, extrinsic: Extrinsic) -> Option<&'static [Column]> {
    let columns: &[Column] = match extrinsic {
        Extrinsic::Position => &[Column::SensorX, Column::SensorY],
        Extrinsic::Heading => &[Column::SensorTheta],
    };
    columns.iter().all(|column| base.position(*column).is_some()).then_some(columns)
}

/// Which part of the extrinsics a candidate is, if it is one.
fn extrinsic_of(candidate: &Candidate) -> Option<Extrinsic> {
    effects::description(candidate.id())?.extrinsic
}

/// Whether a base fit has free extrinsics in the place of a candidate.
pub(crate) fn has_instead(base: &ModelFit<'_>, candidate: &Candidate) -> bool {
    extrinsic_of(candidate).is_some_and(|extrinsic| columns_of(base, extrinsic).is_some())
}

/// What the extrinsics of a model are that are free in its base fit, where they are significant beside what
/// was found; a cause that is not to be named is unknown.
pub(crate) fn of_model(model: &AugmentedModel<'_>, without: &[String]) -> Vec<Finding> {
    let AugmentedModel { fit, candidates, .. } = model;
    let Some(covariance) = fit.covariance(&mut terms(candidates)) else { return Vec::new() };
    let sensor = fit.solution.model.body_from_sensor;
    let of_candidate = |candidate: Candidate| {
        let columns = columns_of(fit, extrinsic_of(&candidate)?)?;
        let rows: Vec<usize> = columns.iter().filter_map(|column| fit.position(*column)).collect();
        let values = DVector::from_iterator(
            rows.len(),
            columns.iter().map(|column| match column {
                Column::SensorX => sensor.x_m,
                Column::SensorY => sensor.y_m,
                _ => wrap_to_pi(sensor.theta_rad),
            }),
        );
        let chi_square = values.dot(&covariance.select_rows(&rows).select_columns(&rows).cholesky()?.solve(&values));
        let p_value = p_of_chi_square(chi_square, rows.len() as f64);
        let is_named = without.iter().all(|out| out != candidate.id());
        let cause = if is_named { candidate.cause() } else { Cause::Unknown };
        let estimates: Vec<(f64, f64)> =
            values.iter().zip(&rows).map(|(value, row)| (*value, covariance[(*row, *row)].sqrt())).collect();
        let found = of_causes(vec![cause], p_value, parameters(&candidate, &estimates), Basis::Extrinsics);
        (p_value < LEVELS.scan_level).then_some(Finding { z: z(chi_square, p_value), ..found })
    };
    mean_terms(&[]).into_iter().filter_map(of_candidate).collect()
}
