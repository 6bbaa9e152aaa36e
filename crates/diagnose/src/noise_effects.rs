//! Noise effects: isolated outliers, jumps, autocorrelated measurements, and turns that scatter more than
//! the wheels explain.
//!
//! A noise effect has no mean to be scanned; failed tests of the residuals show most of them. Turn noise is
//! in every fit: a fit without it is compared, with half a χ² of one degree of freedom for a variance at
//! its boundary (Chernoff 1954; Self & Liang 1987).

use std::collections::BTreeMap;

use dataset::Dataset;
use effects::Sign;
use estimation::NoiseComponent;

use crate::augmented_model::{AugmentedModel, cost, count};
use crate::candidate::terms;
use crate::cause::{Basis, Cause, Doubt};
use crate::check::{Check, Component, ResidualPersistence};
use crate::document::Value;
use crate::errors_at_rest::{ErrorsAtRest, errors_at_rest};
use crate::finding;
use crate::finding::Finding;
use crate::mean_structure::MeanStructure;
use crate::null_distribution::{NullDistribution, among_simulated};
use crate::outlier_attribution::{ErrorSource, log_likelihoods};
use crate::residual_tests::residual_persistence;
use crate::run_to_run::differs_from_run_to_run;
use crate::settings::levels::TURN_SCATTER_LEVEL;
use crate::settings::residuals::{
    DEPENDENCE_BEYOND_TAILS_LEVEL, ISOLATED_TO_PERSISTENT_RATIO, MAX_OUTLIER_FRACTION, NOISE_EFFECT_LEVEL,
    NORMAL_KURTOSIS,
};
use crate::statistics::{p_of_chi_square, p_of_z};
use crate::turn_to_turn::differs_from_turn_to_turn;

/// Scatter that failed checks show, and the datasets as they were recorded.
#[expect(clippy::too_many_lines, reason = "one check after the other; to be split")]
pub(crate) fn scatter(structure: &MeanStructure<'_>, recorded: &[Dataset], without_ids: &[String]) -> Vec<Finding> {
    let mut findings = Vec::new();
    let outliers = structure.checked.outliers;
    let tests = &structure.checked.checks;
    let rejected = outliers.isolated + outliers.persistent;
    if rejected as f64 > MAX_OUTLIER_FRACTION * (outliers.measurements + rejected) as f64 {
        // The model does not follow the robot at all: that has no name.
        return findings;
    }
    // Autocorrelated errors, with what they are while the robot stands: an instrument errs then, too, unless
    // its errors go with the place.
    let autocorrelated = structure
        .correlated
        .filter(|(coefficient, _)| *coefficient > 0.0)
        .map(|(coefficient, sigmas)| (coefficient, sigmas, errors_at_rest(recorded, coefficient)));
    let may_be_motions = autocorrelated.is_some_and(|(.., at_rest)| at_rest != ErrorsAtRest::Autocorrelated);
    let turns = of_turns(structure, without_ids);
    let p_of_dependence = tests.iter().filter(|test| test.shows_dependence());
    let p_of_dependence = p_of_dependence.map(|test| test.p_value).fold(1.0, f64::min);
    let tails = tests.iter().filter(|test| matches!(test.check, Check::Tails(_) | Check::Outliers));
    let tails = tails.map(|test| test.p_value).fold(1.0, f64::min);
    let is_dependent = p_of_dependence < tails.max(DEPENDENCE_BEYOND_TAILS_LEVEL);
    // After the end of a run nothing follows that could be back.
    let has_successors =
        structure.base.selections.first().is_some_and(|taken| taken.mean_measurements(&structure.base.records) >= 2.0);
    if has_successors
        && outliers.p_value < NOISE_EFFECT_LEVEL
        && outliers.isolated >= ISOLATED_TO_PERSISTENT_RATIO * outliers.persistent
    {
        let share = outliers.isolated as f64 / (outliers.measurements + rejected) as f64;
        let value = Value { value: share, sigma: None, unit: "1".to_owned() };
        let of = outliers.measurements + rejected;
        let mut causes = with_sign(Sign::IsolatedErrors, without_ids);
        // Where motions err for a while at a time, some of these errors are large.
        if !causes.is_empty() && may_be_motions {
            causes.push(Cause::Unknown);
        }
        let parameters = BTreeMap::from([("probability".to_owned(), value)]);
        let basis = Basis::IsolatedErrors(outliers.isolated, of);
        findings.push(finding::of_causes(causes, outliers.p_value, parameters, basis));
    }
    if is_dependent {
        // Large errors that depend on what was driven are no noise effect. Turn scatter correlates with
        // everything that turns, but less than its own significance.
        findings.extend(turns.filter(|turns| turns.p_value < p_of_dependence));
        return findings;
    }
    if findings.is_empty() {
        // Tails of one component, and what follows them, say whether the robot jumped or the instrument
        // erred.
        let tails = [(Component::Heading, 2, Sign::HeadingJumps), (Component::Along, 0, Sign::DistanceJumps)];
        let test = |component: Component| tests.iter().find(|test| test.check == Check::Tails(component));
        let kurtosis = |component: Component| test(component).map_or(0.0, |test| test.statistic);
        let has_outliers = outliers.p_value < NOISE_EFFECT_LEVEL && (outliers.persistent > 0 || !has_successors);
        let heaviest = tails.into_iter().max_by(|a, b| kurtosis(a.0).total_cmp(&kurtosis(b.0)));
        let jump = heaviest.and_then(|(component, number, sign)| {
            // Tails that are lighter than normal ones are no large errors.
            let fails = test(component).filter(|test| !test.passes && test.statistic > NORMAL_KURTOSIS);
            let p_value = fails.map(|test| test.p_value).or(has_outliers.then_some(outliers.p_value))?;
            Some((p_value, residual_persistence(&structure.found.model, number), sign))
        });
        if let Some((p_value, persistence, sign)) = jump {
            let named = |signs: &[Sign]| {
                let mut ids: Vec<&'static str> = Vec::new();
                for id in signs.iter().flat_map(|sign| finding::with_sign(*sign, without_ids)) {
                    if !ids.contains(&id) {
                        ids.push(id);
                    }
                }
                ids
            };
            // What jumps ahead may turn as well: a bump costs one wheel its way.
            let signs: &[Sign] = if sign == Sign::DistanceJumps {
                &[Sign::HeadingJumps, Sign::DistanceJumps]
            } else {
                &[Sign::HeadingJumps]
            };
            let (jumps, errors) = (named(signs), named(&[Sign::IsolatedErrors, Sign::TailsAtLowSpeed]));
            let (ids, any): (_, &[ErrorSource]) = match persistence {
                ResidualPersistence::Persistent => (jumps, &[ErrorSource::Robot]),
                ResidualPersistence::Reverting => (errors, &[ErrorSource::Instrument]),
                ResidualPersistence::Undecided => {
                    ([&jumps[..], &errors].concat(), &[ErrorSource::Robot, ErrorSource::Instrument])
                }
            };
            // Tails have many causes.
            let or_unlisted = persistence == ResidualPersistence::Undecided;
            let likelihoods = log_likelihoods(structure.model(), &ids, any);
            let (likelihoods, any) = likelihoods.unwrap_or_else(|| (vec![0.0; ids.len()], f64::NEG_INFINITY));
            let likely: Vec<_> = ids.into_iter().zip(likelihoods).collect();
            let basis = Basis::LargeErrors(persistence);
            findings.push(finding::of_likely_scatter(likely, any, or_unlisted, p_value, basis));
        }
    }
    if let Some((coefficient, sigmas, at_rest)) = autocorrelated {
        let mut causes = with_sign(Sign::AutocorrelatedErrors, without_ids);
        // Where something else is found too, it may be that this is the rest of it.
        let may_be_rest = structure.spurious || !structure.found.model.candidates.is_empty() || turns.is_some();
        if at_rest == ErrorsAtRest::White {
            causes.insert(0, Cause::Unknown);
        } else if !causes.is_empty() && (may_be_rest || at_rest == ErrorsAtRest::WhiteOrSlow) {
            causes.push(Cause::Unknown);
        }
        let basis = Basis::Autocorrelated(coefficient, at_rest);
        findings.push(finding::of_causes(causes, p_of_z(sigmas), BTreeMap::new(), basis));
    }
    findings.extend(turns);
    findings
}

/// Effects of the catalogue that show by a sign, without those taken out, as causes.
fn with_sign(sign: Sign, without_ids: &[String]) -> Vec<Cause> {
    finding::with_sign(sign, without_ids).into_iter().map(Cause::Effect).collect()
}

/// Turns that scatter more than the wheels' noise explains, whatever else was found.
fn of_turns(structure: &MeanStructure<'_>, without_ids: &[String]) -> Option<Finding> {
    let model = structure.model();
    let p_value = p_of_turn_scatter(model)?;
    if p_value >= TURN_SCATTER_LEVEL {
        return None;
    }
    let sigma = model.fit.solution.noise.sigma(NoiseComponent::Turn);
    let value = Value { value: sigma, sigma: None, unit: "rad/sqrt(rad)".to_owned() };
    let parameters = BTreeMap::from([("turn_sigma_rad_per_sqrt_rad".to_owned(), value)]);
    let causes = with_sign(Sign::ScatterWithTurn, without_ids);
    let mut found = finding::of_causes(causes, p_value, parameters, Basis::TurnScatter(sigma));
    // Whatever else is unmodelled and differs from turn to turn has no other sign.
    found.or_unlisted(1.0, Doubt::ScattersAlike);
    Some(found)
}

/// The p-value of what turns scatter by beyond the wheels' noise; `None` where the fit without noise of turns
/// diverges. Where counts are coarse, what they are rounded by grows with turns until a count is full, and
/// makes turn noise likelier; it is soon over, and no turn differs from another by it. By the rounding of
/// recorded rates turns do differ, and they are judged among those of simulated runs.
fn p_of_turn_scatter(model: &AugmentedModel<'_>) -> Option<f64> {
    let differ = |model: &AugmentedModel<'_>| [differs_from_run_to_run(model), differs_from_turn_to_turn(model)];
    let mut p_values = differ(model).to_vec();
    let may_be_found = p_values.iter().any(|p_value| *p_value < TURN_SCATTER_LEVEL);
    if let Some(null) = NullDistribution::of(model).filter(|_| may_be_found) {
        let simulated =
            null.resimulated(|fit| differ(&AugmentedModel { fit: fit.clone(), candidates: model.candidates.clone() }));
        for (test, p_value) in p_values.iter_mut().enumerate() {
            *p_value = among_simulated(*p_value, simulated.iter().map(|of| &of[test]));
        }
    }
    let without = || {
        let fit = model.fit.without_noise(NoiseComponent::Turn, &mut terms(&model.candidates)).ok()?;
        let most = count(&fit).max(count(&model.fit));
        let statistic = 2.0 * (cost(&fit, most) - cost(&model.fit, most));
        Some(0.5 * p_of_chi_square(statistic.max(0.0), 1.0))
    };
    let by_ratio = if model.fit.depends_on_rounding() { None } else { Some(without()?) };
    p_values.extend(by_ratio);
    let least = p_values.iter().copied().fold(1.0, f64::min);
    Some((p_values.len() as f64 * least).min(1.0))
}
