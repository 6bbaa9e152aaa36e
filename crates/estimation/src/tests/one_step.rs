//! The scoring step of a large fit.

use super::*;

#[test]
fn after_a_step_parts_cost_what_their_parabolas_say() {
    let dataset = dataset_of(3, true);
    let mut fit = ModelFit::from_parameters(MODEL, NOISE, &[dataset.session()]);
    let parts = fit.scan(&mut []).runs;
    let before = fit.solution.model.clone();
    fit.step_over(parts.clone()).expect("determined");
    let after = &fit.solution.model;
    let step = nalgebra::DVector::from_row_slice(&[
        (after.m_per_rad.left / before.m_per_rad.left).ln(),
        (after.m_per_rad.right / before.m_per_rad.right).ln(),
        (after.separation_m / before.separation_m).ln(),
    ]);
    assert!(step.amax() > 1e-4, "no step to speak of: {step}");
    for (before, after) in parts.iter().zip(&fit.parts) {
        let expected = before.cost_after(&Column::GEOMETRY, &step);
        // Roundings of a dozen terms.
        assert!((after.cost() / expected - 1.0).abs() < 1e-9, "{} {expected}", after.cost());
    }
    // At the least of their sum no gradient is left of the columns that were stepped along.
    let left = total(&fit.parts).expect("parts").of(&Column::GEOMETRY);
    let scale = left.matrix.diagonal().map(f64::sqrt);
    assert!(left.gradient.component_div(&scale).amax() < 1e-9, "{:?}", left.gradient);
}

#[test]
fn a_step_is_enough_from_near_and_not_from_far() {
    let dataset = dataset_of(3, true);
    let is_near = |factor: f64| {
        let model = Model { m_per_rad: CENTRED_MODEL.m_per_rad.map(|of| factor * of), ..CENTRED_MODEL };
        let model = Model { body_from_sensor: BODY_FROM_SENSOR, ..model };
        let mut fit = ModelFit::from_parameters(model, NOISE, &[dataset.session()]);
        fit.ungated = true;
        let parts = fit.scan(&mut []).runs;
        fit.step_over(parts).expect("determined")
    };
    // The square of 5 % is more than a standard deviation of 0.1 %; that of 0.02 % is nothing beside it.
    assert!(is_near(1.0002) && !is_near(1.05));
}
