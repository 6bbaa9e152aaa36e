//! What is left of an effect once errors that do not average out are counted.
//!
//! A map's error at a place returns in every run, and so does the rounding of recorded rates wherever the
//! robot drives as before. The likelihood takes it for the robot's, and neither innovations nor the scatter
//! over runs show it. Its covariance of an effect's size is known ([`estimation::ModelFit::covariance`]): an
//! effect is one if it is significant beside that. Errors that last while the robot crosses a patch of the
//! map are the map's own.

use effects::CATALOGUE;
use estimation::{Column, ModelFit, RIDGE, inverse};
use nalgebra::{DMatrix, DVector};

use crate::candidates::candidate::{Candidate, terms};
use crate::candidates::cause::Basis;
use crate::document::Value;
use crate::findings::finding::Finding;
use crate::fits::augmented_model::{AugmentedModel, refit};
use crate::fits::statistics::p_of_chi_square;
use crate::settings::LEVELS;

/// Leaves out what systematic errors explain: terms of `model` that are not significant beside them, and
/// signs of errors of the instrument beside a map or rates that are rounded by more. Sizes of the others get
/// the standard deviations that they leave.
pub(crate) fn without_systematic_errors(findings: &mut Vec<Finding>, base: &ModelFit<'_>, model: &AugmentedModel<'_>) {
    if !base.has_systematic_errors() {
        return;
    }
    findings.retain_mut(|finding| {
        let (trials, level) = match finding.basis {
            Basis::FailedTests(_) | Basis::Autocorrelated(..) => {
                return base.records.map.is_none() && !base.rates_are_coarser_than_measurements();
            }
            Basis::Products(trials) => (trials, LEVELS.sparse_term_level),
            _ => (CATALOGUE.len(), LEVELS.scan_level),
        };
        let Some(candidate) = finding.term.map(|term| &model.candidates[term]) else { return true };
        let Some((p_value, covariance)) = beside_errors(base, candidate) else { return false };
        for (k, parameter) in candidate.parameters().iter().enumerate() {
            if let Some(Value { sigma: Some(sigma), .. }) = finding.parameters.get_mut(parameter.name) {
                *sigma = sigma.max(covariance[(k, k)].sqrt());
            }
        }
        p_value * trials as f64 <= level
    });
}

/// The p-value of a candidate by the covariance that its size has with theirs, and that covariance; `None`
/// where the fit with it diverges or has none.
fn beside_errors(base: &ModelFit<'_>, candidate: &Candidate) -> Option<(f64, DMatrix<f64>)> {
    let model = refit(base, &AugmentedModel::base(base), vec![candidate.clone()])?;
    let covariance = model.fit.covariance(&mut terms(&model.candidates))?;
    let at: Option<Vec<usize>> = model.range(0).map(|term| model.fit.position(Column::Term(term))).collect();
    let at = at?;
    let own = DMatrix::from_fn(at.len(), at.len(), |i, j| covariance[(at[i], at[j])]);
    Some((p_of_size(&model.estimates(0), &own), own))
}

/// The probability of an estimate as large or larger where the size is 0.
fn p_of_size(estimate: &DVector<f64>, covariance: &DMatrix<f64>) -> f64 {
    let statistic = inverse(covariance, RIDGE).map_or(0.0, |inverse| estimate.dot(&(inverse * estimate)));
    if statistic.is_finite() { p_of_chi_square(statistic, estimate.len() as f64) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_size_is_judged_by_its_whole_covariance() {
        // Two sizes of variance 1 and correlation 0.8, estimated at (2, −2): 2·4/(1 − 0.8) = 40, which
        // has the probability e^{−20} of two degrees of freedom. Rejects variances alone: 8, e^{−4}.
        let covariance = DMatrix::from_row_slice(2, 2, &[1.0, 0.8, 0.8, 1.0]);
        let p_value = p_of_size(&DVector::from_column_slice(&[2.0, -2.0]), &covariance);
        // The ridge changes the statistic by 1e-10.
        assert!((p_value / (-20.0_f64).exp() - 1.0).abs() < 1e-8, "{p_value}");
    }
}
