//! How far calibrated wheels and their separation are from those that the robot's description states.

use effects::GeometryRatio;
use estimation::{Column, ModelFit};

use crate::candidates::candidate::terms;
use crate::findings::geometry_deviation::GeometryDeviation;
use crate::fits::augmented_model::AugmentedModel;
use crate::settings::RECORDS;

/// The deviations of the base fit that are too large and certain, and that the effects found do not take
/// back.
pub(crate) fn remaining_deviations(base: &ModelFit<'_>, model: &AugmentedModel<'_>) -> Vec<GeometryDeviation> {
    let remain = geometry_deviations(model);
    let of_base = geometry_deviations(&AugmentedModel::base(base));
    of_base.into_iter().filter(|deviation| remain.iter().any(|other| other.of == deviation.of)).collect()
}

/// The deviations of a model that are too large and certain.
fn geometry_deviations(model: &AugmentedModel<'_>) -> Vec<GeometryDeviation> {
    let fit = &model.fit;
    let Some(covariance) = fit.covariance(&mut terms(&model.candidates)) else { return Vec::new() };
    let (model, nominal) = (&fit.solution.model, &fit.nominal);
    // Steps of the geometry's columns are relative.
    let columns = [Column::LeftWheel, Column::RightWheel, Column::Separation];
    let at = columns.map(|column| fit.position(column));
    let logs = [
        model.m_per_rad.left / nominal.m_per_rad.left,
        model.m_per_rad.right / nominal.m_per_rad.right,
        model.separation_m / nominal.separation_m,
    ]
    .map(f64::ln);
    let deviation = |(of, weights, limit): (GeometryRatio, [f64; 3], f64)| {
        let log: f64 = weights.iter().zip(logs).map(|(weight, log)| weight * log).sum();
        let pairs = || (0..3).flat_map(|i| (0..3).map(move |j| (i, j)));
        let variance: f64 =
            pairs().filter_map(|(i, j)| Some(weights[i] * weights[j] * covariance[(at[i]?, at[j]?)])).sum();
        let (ratio, sigma) = (log.exp(), variance.max(0.0).sqrt());
        let is_large = log.abs() > limit.ln_1p() && log.abs() > RECORDS.min_deviation_sigmas * sigma;
        is_large.then_some(GeometryDeviation { of, ratio, sigma: ratio * sigma })
    };
    let wheels = RECORDS.max_wheel_deviation_sigmas * RECORDS.wheel_prior_sigma;
    [
        (GeometryRatio::Wheels, [0.5, 0.5, 0.0], wheels),
        (GeometryRatio::RightOverLeft, [-1.0, 1.0, 0.0], wheels),
        (GeometryRatio::Separation, [0.0, 0.0, 1.0], RECORDS.max_separation_deviation),
    ]
    .into_iter()
    .filter_map(deviation)
    .collect()
}

/// Whether an effect leaves the wheels as large as a robot of the description may have them, or no farther
/// off than they are without it: with one of which wheels and effect are determined together alone, as a loss
/// per second at a single speed, neither is.
pub(crate) fn keeps_wheels(without: &ModelFit<'_>, with: &ModelFit<'_>) -> bool {
    let limit = (RECORDS.max_wheel_deviation_sigmas * RECORDS.wheel_prior_sigma).ln_1p();
    let off = |fit: &ModelFit<'_>| {
        let ratio = fit.solution.model.m_per_rad.zip_with(fit.nominal.m_per_rad, |found, nominal| found / nominal);
        ratio.map(|ratio| ratio.ln().abs())
    };
    let (before, after) = (off(without), off(with));
    [(before.left, after.left), (before.right, after.right)]
        .into_iter()
        .all(|(before, after)| after <= limit || after <= before + limit)
}
