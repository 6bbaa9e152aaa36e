//! What only scatters: single measurements far off, jumps that stay, measurements that err alike, and turns that scatter more than the wheels explain.
//!
//! A scatter has no mean to be scanned: failed checks of the fit show most of it. Noise of the turns is in every fit; a fit without it says what it is worth,
//! with half a χ² of one degree of freedom for a variance at its boundary (Chernoff 1954; Self & Liang 1987).

use std::collections::BTreeMap;

use effects::Sign;
use estimation::NoiseComponent;

use crate::augmented_model::{cost, count};
use crate::candidate::terms;
use crate::cause::{Basis, Cause};
use crate::check::{Check, Component, ResidualPersistence};
use crate::document::Value;
use crate::finding;
use crate::finding::Finding;
use crate::mean_structure::MeanStructure;
use crate::outlier_attribution::{ErrorSource, log_likelihoods};
use crate::residual_tests::what_follows;
use crate::run_to_run::differs_from_run_to_run;
use crate::settings::levels::TURN_SCATTER_LEVEL;
use crate::settings::residuals::{
    DEPENDENCE_BEYOND_TAILS_LEVEL, ISOLATED_TO_PERSISTENT_RATIO, MAX_OUTLIER_FRACTION, NOISE_EFFECT_LEVEL,
};
use crate::statistics::{p_of_chi_square, p_of_z};

/// Scatter that failed checks show.
pub(crate) fn scatter(structure: &MeanStructure<'_>, without_ids: &[String]) -> Vec<Finding> {
    let mut findings = Vec::new();
    let outliers = structure.checked.outliers;
    let tests = &structure.checked.checks;
    let far = outliers.isolated + outliers.staying;
    if far as f64 > MAX_OUTLIER_FRACTION * (outliers.measurements + far) as f64 {
        // The model does not follow the robot at all: that has no name.
        return findings;
    }
    let turns = of_turns(structure, without_ids);
    let with_something = tests.iter().filter(|test| test.shows_dependence());
    let with_something = with_something.map(|test| test.p_value).fold(1.0, f64::min);
    let tails = tests.iter().filter(|test| matches!(test.check, Check::Tails(_) | Check::Outliers));
    let tails = tails.map(|test| test.p_value).fold(1.0, f64::min);
    let depends_on_something = with_something < tails.max(DEPENDENCE_BEYOND_TAILS_LEVEL);
    // After the end of a run nothing follows that could be back.
    let followed =
        structure.base.selections.first().is_some_and(|taken| taken.mean_measurements(&structure.base.records) >= 2.0);
    if followed
        && outliers.p_value < NOISE_EFFECT_LEVEL
        && outliers.isolated >= ISOLATED_TO_PERSISTENT_RATIO * outliers.staying
    {
        let share = outliers.isolated as f64 / (outliers.measurements + far) as f64;
        let value = Value { value: share, sigma: None, unit: "1".to_owned() };
        let of = outliers.measurements + far;
        let causes = with_sign(Sign::IsolatedErrors, without_ids);
        let parameters = BTreeMap::from([("probability".to_owned(), value)]);
        let basis = Basis::IsolatedErrors(outliers.isolated, of);
        findings.push(finding::of_causes(causes, outliers.p_value, parameters, basis));
    }
    if depends_on_something {
        // Other large errors that go with what was driven are no scatter; but turns that scatter go with everything that turns, by chance, and less so.
        findings.extend(turns.filter(|turns| turns.p_value < with_something));
        return findings;
    }
    if findings.is_empty() {
        // Tails of one component, and what follows them, say whether the robot jumped or the instrument erred.
        let tails = [(Component::Heading, 2, Sign::HeadingJumps), (Component::Along, 0, Sign::DistanceJumps)];
        let test = |component: Component| tests.iter().find(|test| test.check == Check::Tails(component));
        let kurtosis = |component: Component| test(component).map_or(0.0, |test| test.statistic);
        let far_off = outliers.p_value < NOISE_EFFECT_LEVEL && (outliers.staying > 0 || !followed);
        let heaviest = tails.into_iter().max_by(|a, b| kurtosis(a.0).total_cmp(&kurtosis(b.0)));
        let jump = heaviest.and_then(|(component, number, sign)| {
            let fails = test(component).filter(|test| !test.passes);
            let p_value = fails.map(|test| test.p_value).or(far_off.then_some(outliers.p_value))?;
            Some((p_value, what_follows(&structure.found.model.fit, number), sign))
        });
        if let Some((p_value, follows, sign)) = jump {
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
            let jumps: &[Sign] = if sign == Sign::DistanceJumps {
                &[Sign::HeadingJumps, Sign::DistanceJumps]
            } else {
                &[Sign::HeadingJumps]
            };
            let (stays, errs) = (named(jumps), named(&[Sign::IsolatedErrors, Sign::TailsAtLowSpeed]));
            let (ids, any): (_, &[ErrorSource]) = match follows {
                ResidualPersistence::Persistent => (stays, &[ErrorSource::Robot]),
                ResidualPersistence::Reverting => (errs, &[ErrorSource::Instrument]),
                ResidualPersistence::Undecided => {
                    ([&stays[..], &errs].concat(), &[ErrorSource::Robot, ErrorSource::Instrument])
                }
            };
            // Tails have many causes.
            let or_unlisted = follows == ResidualPersistence::Undecided;
            let likelihoods = log_likelihoods(structure.model(), &ids, any);
            let (likelihoods, any) = likelihoods.unwrap_or_else(|| (vec![0.0; ids.len()], f64::NEG_INFINITY));
            let likely: Vec<_> = ids.into_iter().zip(likelihoods).collect();
            let basis = Basis::LargeErrors(follows);
            findings.push(finding::of_likely_scatter(likely, any, or_unlisted, p_value, basis));
        }
    }
    if let Some((coefficient, sigmas)) = structure.correlated
        && coefficient > 0.0
    {
        let mut causes = with_sign(Sign::AutocorrelatedErrors, without_ids);
        // Where something else is found too, it may be that this is the rest of it.
        if !causes.is_empty() && (structure.spurious || !structure.found.model.candidates.is_empty()) {
            causes.push(Cause::Unknown);
        }
        let basis = Basis::Autocorrelated(coefficient);
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
    let without = model.fit.without_noise(NoiseComponent::Turn, &mut terms(&model.candidates)).ok()?;
    let most = count(&without).max(count(&model.fit));
    let statistic = 2.0 * (cost(&without, most) - cost(&model.fit, most));
    let p_value = 2.0 * (0.5 * p_of_chi_square(statistic.max(0.0), 1.0)).min(differs_from_run_to_run(model));
    if p_value >= TURN_SCATTER_LEVEL {
        return None;
    }
    let sigma = model.fit.fit.noise.sigma(NoiseComponent::Turn);
    let value = Value { value: sigma, sigma: None, unit: "rad/sqrt(rad)".to_owned() };
    let parameters = BTreeMap::from([("turn_sigma_rad_per_sqrt_rad".to_owned(), value)]);
    let causes = with_sign(Sign::ScatterWithTurn, without_ids);
    Some(finding::of_causes(causes, p_value, parameters, Basis::TurnScatter(sigma)))
}
