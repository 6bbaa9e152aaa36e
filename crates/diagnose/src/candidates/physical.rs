//! Whether estimated parameters make an effect that can be.

use effects::{Effect, effect_from_estimates};
use estimation::NoiseComponent;
use model_term::TermParameter;

use crate::candidates::candidate::Candidate;
use crate::fits::augmented_model::AugmentedModel;
use crate::fits::wald::wald_test;
use crate::settings::SEARCH;

/// Whether a candidate's sizes make an effect that can be: a share that is lost is no gain.
pub(crate) fn is_physical(extended: &AugmentedModel<'_>, index: usize) -> bool {
    let candidate = &extended.candidates[index];
    let Candidate::Effect { .. } = candidate else { return true };
    let Some((test, _)) = wald_test(extended, index) else { return false };
    let is_possible = |effect: Effect| {
        let effect = effect.physical();
        scatters_enough(extended, effect.scatter_of_contact_m())
            && (!effect.needs_row_lengths() || extended.fit.records.go_by_row_lengths())
            && (!effect.needs_distances() || extended.fit.records.has_distances())
    };
    effect_of(candidate, &test.estimates).is_some_and(is_possible)
}

/// Whether a candidate has sizes that robots have. What explains the data with others is something else.
pub(crate) fn is_plausible(extended: &AugmentedModel<'_>, index: usize) -> bool {
    let candidate = &extended.candidates[index];
    let Candidate::Effect { .. } = candidate else { return true };
    wald_test(extended, index).is_none_or(|(test, _)| are_plausible(&candidate.parameters(), &test.estimates))
}

/// Whether no estimate is beyond what is plausible by more than its error.
fn are_plausible(parameters: &[TermParameter], estimates: &[(f64, f64)]) -> bool {
    // An error that is not determined shows nothing.
    !parameters.iter().zip(estimates).any(|(parameter, (size, sigma))| {
        size.abs() - SEARCH.insignificant_estimate_sigmas * sigma > SEARCH.max_plausible_sizes * parameter.prior_sigma
    })
}

/// The effect that a candidate is with some sizes, each with its standard deviation, if there can be one.
/// What is within its error of nothing counts as nothing.
pub(crate) fn effect_of(candidate: &Candidate, estimates: &[(f64, f64)]) -> Option<Effect> {
    let parameters = candidate.parameters();
    let fitted = parameters.iter().zip(estimates);
    let estimates: Vec<(&str, f64)> = fitted
        .map(|(parameter, (size, sigma))| {
            (parameter.name, if size.abs() < SEARCH.insignificant_estimate_sigmas * sigma { 0.0 } else { *size })
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
    (0.5 * of_both / along).max(2.0 * of_both / separation_m.powi(2) / heading) <= SEARCH.max_contact_variance_ratio
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_size_is_implausible_only_by_more_than_its_error() {
        let parameter = |prior_sigma: f64| TermParameter { name: "a", unit: "1", prior_sigma };
        let both = [parameter(1.0), parameter(0.01)];
        // Ten times what is plausible, of either sign, in each parameter's own unit.
        assert!(are_plausible(&both, &[(-9.9, 0.01), (0.099, 1e-6)]));
        assert!(!are_plausible(&both, &[(0.1, 0.01), (-0.11, 1e-3)]));
        // Three standard deviations of 0.01 reach it.
        assert!(are_plausible(&both, &[(0.1, 0.01), (-0.11, 0.01)]));
        assert!(are_plausible(&both, &[(20.0, f64::NAN), (0.0, 0.01)]), "nobody knows its error");
    }
}
