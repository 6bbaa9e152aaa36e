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
use rules::Rule;

use crate::candidates::candidate::terms;
use crate::candidates::cause::{Basis, Cause, Doubt};
use crate::checks::check::{Check, Component, Correlation, ResidualPersistence, TestResult};
use crate::checks::errors_at_rest::{ErrorsAtRest, errors_at_rest};
use crate::checks::outlier_attribution::{ErrorSource, log_likelihoods};
use crate::checks::residual_tests::residual_persistence;
use crate::checks::run_to_run::differs_from_run_to_run;
use crate::checks::turn_to_turn::differs_from_turn_to_turn;
use crate::document::Value;
use crate::findings::finding;
use crate::findings::finding::Finding;
use crate::fits::augmented_model::{AugmentedModel, cost, count};
use crate::fits::null_distribution::{NullDistribution, among_simulated};
use crate::fits::statistics::{p_of_chi_square, p_of_z};
use crate::search::mean_structure::MeanStructure;
use crate::settings::{LEVELS, RESIDUALS};

/// Autocorrelated errors, with what they are while the robot stands.
#[derive(Clone, Copy)]
struct LastingErrors {
    coefficient: f64,
    /// Standard errors of the coefficient.
    sigmas: f64,
    at_rest: ErrorsAtRest,
}

impl LastingErrors {
    /// An instrument errs while the robot stands, too, unless its errors go with the place.
    fn of(structure: &MeanStructure<'_>, recorded: &[Dataset]) -> Option<Self> {
        let Correlation { coefficient, sigmas } = structure.correlated.filter(|of| of.coefficient > 0.0)?;
        let at_rest =
            Rule::ErrorsAtRest.changes(ErrorsAtRest::Autocorrelated, |_| errors_at_rest(recorded, coefficient));
        Some(Self { coefficient, sigmas, at_rest })
    }

    /// The finding. Where something else is found too, `may_be_rest`: this may be the rest of it.
    fn finding(self, may_be_rest: bool, without_ids: &[String]) -> Finding {
        let mut causes = with_sign(Sign::AutocorrelatedErrors, without_ids);
        if self.at_rest == ErrorsAtRest::White {
            causes.insert(0, Cause::Unknown);
        } else if !causes.is_empty() && (may_be_rest || self.at_rest == ErrorsAtRest::WhiteOrSlow) {
            causes.push(Cause::Unknown);
        }
        let basis = Basis::Autocorrelated(self.coefficient, self.at_rest);
        finding::of_causes(causes, p_of_z(self.sigmas), BTreeMap::new(), basis)
    }
}

/// Scatter that failed checks show, and the datasets as they were recorded.
pub(crate) fn scatter(structure: &MeanStructure<'_>, recorded: &[Dataset], without_ids: &[String]) -> Vec<Finding> {
    let outliers = structure.checked.outliers;
    let tests = &structure.checked.checks;
    let rejected = outliers.isolated + outliers.persistent;
    if rejected as f64 > RESIDUALS.max_outlier_fraction * (outliers.measurements + rejected) as f64 {
        // The model does not follow the robot at all: that has no name.
        return Vec::new();
    }
    let lasting = LastingErrors::of(structure, recorded);
    let turns = Rule::TurnScatter.finds(of_turns(structure, without_ids));
    let least = |of: &dyn Fn(&TestResult) -> bool| {
        tests.iter().filter(|test| of(test)).map(|test| test.p_value).fold(1.0, f64::min)
    };
    let p_of_dependence = least(&TestResult::shows_dependence);
    let tails = least(&|test| matches!(test.check, Check::Tails(_) | Check::Outliers));
    let is_dependent = p_of_dependence < tails.max(RESIDUALS.dependence_beyond_tails_level);
    let mut findings: Vec<Finding> = isolated_errors(structure, lasting, without_ids).into_iter().collect();
    if Rule::DependentResiduals.applies(is_dependent) {
        // Large errors that depend on what was driven are no noise effect. Turn scatter correlates with
        // everything that turns, but less than its own significance.
        findings.extend(turns.filter(|turns| turns.p_value < p_of_dependence));
        return findings;
    }
    if findings.is_empty() {
        findings.extend(Rule::LargeErrors.finds(large_errors(structure, without_ids)));
    }
    let may_be_rest = structure.spurious || !structure.found.model.candidates.is_empty() || turns.is_some();
    findings.extend(lasting.map(|lasting| lasting.finding(may_be_rest, without_ids)));
    findings.extend(turns);
    findings
}

/// Whether runs have successive measurements: after the end of a run nothing follows that could be back.
fn has_successors(structure: &MeanStructure<'_>) -> bool {
    let taken = structure.base.selections.first();
    taken.is_some_and(|taken| taken.mean_measurements(&structure.base.records) >= 2.0)
}

/// Outliers after which the next measurement is back.
fn isolated_errors(
    structure: &MeanStructure<'_>,
    lasting: Option<LastingErrors>,
    without_ids: &[String],
) -> Option<Finding> {
    let outliers = structure.checked.outliers;
    let are_isolated = has_successors(structure)
        && outliers.p_value < RESIDUALS.noise_effect_level
        && outliers.isolated >= RESIDUALS.isolated_to_persistent_ratio * outliers.persistent;
    Rule::IsolatedErrors.applies(are_isolated).then(|| {
        let all = outliers.measurements + outliers.isolated + outliers.persistent;
        let value = Value { value: outliers.isolated as f64 / all as f64, sigma: None, unit: "1".to_owned() };
        let mut causes = with_sign(Sign::IsolatedErrors, without_ids);
        // Where motions err for a while at a time, some of these errors are large.
        let may_be_motions = lasting.is_some_and(|lasting| lasting.at_rest != ErrorsAtRest::Autocorrelated);
        if !causes.is_empty() && may_be_motions {
            causes.push(Cause::Unknown);
        }
        let parameters = BTreeMap::from([("probability".to_owned(), value)]);
        finding::of_causes(causes, outliers.p_value, parameters, Basis::IsolatedErrors(outliers.isolated, all))
    })
}

/// Large errors: tails of one component, and what follows them, say whether the robot jumped or the
/// instrument erred.
fn large_errors(structure: &MeanStructure<'_>, without_ids: &[String]) -> Option<Finding> {
    let (tests, outliers) = (&structure.checked.checks, structure.checked.outliers);
    let test = |component: Component| tests.iter().find(|test| test.check == Check::Tails(component));
    let kurtosis = |component: Component| test(component).map_or(0.0, |test| test.statistic);
    // What jumps ahead may turn as well: a bump costs one wheel its way.
    let tails: [(Component, usize, &[Sign]); 2] = [
        (Component::Heading, 2, &[Sign::HeadingJumps]),
        (Component::Along, 0, &[Sign::HeadingJumps, Sign::DistanceJumps]),
    ];
    let (component, number, signs) = tails.into_iter().max_by(|a, b| kurtosis(a.0).total_cmp(&kurtosis(b.0)))?;
    // Tails that are lighter than normal ones are no large errors.
    let fails = test(component).filter(|test| !test.passes && test.statistic > RESIDUALS.normal_kurtosis);
    let has_outliers =
        outliers.p_value < RESIDUALS.noise_effect_level && (outliers.persistent > 0 || !has_successors(structure));
    let p_value = fails.map(|test| test.p_value).or(has_outliers.then_some(outliers.p_value))?;
    let persistence = residual_persistence(&structure.found.model, number);
    let named = |signs: &[Sign]| {
        let mut ids: Vec<&'static str> = Vec::new();
        for id in signs.iter().flat_map(|sign| finding::with_sign(*sign, without_ids)) {
            if !ids.contains(&id) {
                ids.push(id);
            }
        }
        ids
    };
    let (jumps, errors) = (named(signs), named(&[Sign::IsolatedErrors, Sign::TailsAtLowSpeed]));
    let (ids, any): (_, &[ErrorSource]) = match persistence {
        ResidualPersistence::Persistent => (jumps, &[ErrorSource::Robot]),
        ResidualPersistence::Reverting => (errors, &[ErrorSource::Instrument]),
        ResidualPersistence::Undecided => {
            ([&jumps[..], &errors].concat(), &[ErrorSource::Robot, ErrorSource::Instrument])
        }
    };
    let likelihoods = Rule::Attribution.finds(log_likelihoods(structure.model(), &ids, any));
    let (likelihoods, any) = likelihoods.unwrap_or_else(|| (vec![0.0; ids.len()], f64::NEG_INFINITY));
    let likely: Vec<_> = ids.into_iter().zip(likelihoods).collect();
    // Tails have many causes.
    let or_unlisted = persistence == ResidualPersistence::Undecided;
    Some(finding::of_likely_scatter(likely, any, or_unlisted, p_value, Basis::LargeErrors(persistence)))
}

/// Effects of the catalogue that show by a sign, without those taken out, as causes.
fn with_sign(sign: Sign, without_ids: &[String]) -> Vec<Cause> {
    finding::with_sign(sign, without_ids).into_iter().map(Cause::Effect).collect()
}

/// Turns that scatter more than the wheels' noise explains, whatever else was found.
fn of_turns(structure: &MeanStructure<'_>, without_ids: &[String]) -> Option<Finding> {
    let model = structure.model();
    let p_value = p_of_turn_scatter(model)?;
    if p_value >= LEVELS.turn_scatter_level {
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
    let may_be_found = p_values.iter().any(|p_value| *p_value < LEVELS.turn_scatter_level);
    if let Some(null) = NullDistribution::of(model).filter(|_| Rule::TurnScatterAmongSimulated.applies(may_be_found)) {
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
