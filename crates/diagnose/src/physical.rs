//! Whether estimated parameters make an effect that can be.

use effects::{Effect, effect_from_estimates};
use estimation::NoiseComponent;

use crate::augmented_model::AugmentedModel;
use crate::candidate::Candidate;
use crate::settings::search::{INSIGNIFICANT_ESTIMATE_SIGMAS, MAX_CONTACT_VARIANCE_RATIO};
use crate::wald::wald_test;

/// Whether a candidate's sizes make an effect that can be: a share that is lost is no gain.
pub(crate) fn is_physical(extended: &AugmentedModel<'_>, index: usize) -> bool {
    let candidate = &extended.candidates[index];
    let Candidate::Effect { .. } = candidate else { return true };
    let Some((test, _)) = wald_test(extended, index) else { return false };
    let is_possible = |effect: Effect| {
        let effect = effect.physical();
        scatters_enough(extended, effect.scatter_of_contact_m())
            && (!effect.needs_row_lengths() || extended.fit.records.go_by_row_lengths())
    };
    effect_of(candidate, &test.estimates).is_some_and(is_possible)
}

/// The effect that a candidate is with some sizes, each with its standard deviation, if there can be one.
/// What is within its error of nothing counts as nothing.
pub(crate) fn effect_of(candidate: &Candidate, estimates: &[(f64, f64)]) -> Option<Effect> {
    let parameters = candidate.parameters();
    let fitted = parameters.iter().zip(estimates);
    let estimates: Vec<(&str, f64)> = fitted
        .map(|(parameter, (size, sigma))| {
            (parameter.name, if size.abs() < INSIGNIFICANT_ESTIMATE_SIGMAS * sigma { 0.0 } else { *size })
        })
        .chain(candidate.fixed())
        .collect();
    effect_from_estimates(candidate.id(), &estimates).filter(|effect| effect.physical().check().is_ok())
}

/// Whether the noise of a fit leaves room for what the contacts of both wheels scatter by.
fn scatters_enough(extended: &AugmentedModel<'_>, contact_m: f64) -> bool {
    let fit = &extended.fit;
    let variance = |of| fit.solution.noise.sigma(of).powi(2);
    let distance_m = fit.records.distance_between_measurements_m(&fit.solution.model);
    let (wheel, separation_m) = (variance(NoiseComponent::Wheel) * distance_m, fit.solution.model.separation_m);
    // Along, half of each wheel; in heading, their difference.
    let along = variance(NoiseComponent::MeasurementPosition) + 0.5 * wheel;
    let heading = variance(NoiseComponent::MeasurementHeading) + 2.0 * wheel / separation_m.powi(2);
    let of_both = contact_m * contact_m;
    (0.5 * of_both / along).max(2.0 * of_both / separation_m.powi(2) / heading) <= MAX_CONTACT_VARIANCE_RATIO
}
