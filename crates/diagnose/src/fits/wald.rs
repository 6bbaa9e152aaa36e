//! Tests and standard deviations of sizes: by the likelihood, by how runs differ, and by uncertain variants
//! and causes.

use estimation::{ClusterRobust, Information, RIDGE, inverse, total};
use model_term::TermParameter;
use nalgebra::{DMatrix, DVector};

use crate::fits::augmented_model::AugmentedModel;
use crate::fits::null_distribution::NullDistribution;
use crate::fits::scan::{detectable_directions, freedom};
use crate::fits::statistics::{p_of_statistic, p_of_student, student_95};
use crate::settings::LEVELS;

/// A test of one candidate of a fitted model.
#[derive(Debug, Clone)]
pub(crate) struct Test {
    pub(crate) statistic: f64,
    pub(crate) p_value: f64,
    /// Value and standard deviation of each parameter.
    pub(crate) estimates: Vec<(f64, f64)>,
}

/// The Wald test of a candidate in its fitted model, and along its principal directions in units of the
/// plausible: information and size.
pub(crate) fn wald_test(extended: &AugmentedModel<'_>, candidate: usize) -> Option<(Test, Vec<(f64, f64)>)> {
    let equations = total(&extended.fit.solution.pass.runs)?;
    let own = extended.columns(candidate);
    let projected = extended.fit.eliminated(&equations, &own)?.of_columns(&equations, &own);
    let parameters = extended.candidates[candidate].parameters();
    let freedom = freedom(&extended.fit, &equations);
    Some(wald_test_of(&projected.information, &extended.estimates(candidate), &parameters, equations.count, freedom))
}

/// The same of estimates with the information that the free columns leave; of `count` observations they
/// leave `freedom`.
fn wald_test_of(
    information: &DMatrix<f64>,
    estimates: &DVector<f64>,
    parameters: &[TermParameter],
    count: f64,
    freedom: f64,
) -> (Test, Vec<(f64, f64)>) {
    let gradient = information * estimates;
    let directions: Vec<(f64, f64)> = detectable_directions(information, &gradient, parameters)
        .into_iter()
        .map(|(value, gradient)| (value, gradient / value))
        .collect();
    let shrink = freedom / count.max(1.0);
    let statistic = directions.iter().map(|(value, size)| shrink * value * size * size).sum();
    let covariance = inverse(information, RIDGE);
    let sigma = |k: usize| covariance.as_ref().map_or(f64::NAN, |covariance| (covariance[(k, k)] / shrink).sqrt());
    let test = Test {
        statistic,
        p_value: p_of_statistic(statistic, directions.len(), freedom),
        estimates: estimates.iter().enumerate().map(|(k, size)| (*size, sigma(k))).collect(),
    };
    (test, directions)
}

/// The p-value of a candidate whose statistic coarse encoders inflate by so much.
pub(crate) fn p_value_over(extended: &AugmentedModel<'_>, candidate: usize, inflation: f64) -> Option<f64> {
    let (test, directions) = wald_test(extended, candidate)?;
    let equations = total(&extended.fit.solution.pass.runs)?;
    Some(p_of_statistic(test.statistic / inflation, directions.len(), freedom(&extended.fit, &equations)))
}

/// Cluster-robust test of a candidate along its own size. Errors are alike within runs (a wheelbase that
/// differs from motion to motion, autocorrelated measurements), and a likelihood of independent
/// measurements makes sizes too significant.
///
/// With u_r the score of run r, the other free columns projected out, the size θ has the variance I⁻¹ (Σ
/// u_r u_rᵀ) I⁻¹ whatever is alike within runs.
/// References: White 1982; Liang & Zeger 1986.
pub(crate) fn cluster_robust_test(extended: &AugmentedModel<'_>, candidate: usize, level: f64) -> bool {
    // Fewer runs do not say how a size differs between them.
    let runs: Vec<_> = extended.fit.solution.pass.runs.iter().filter(|run| run.count > 0.0).collect();
    if runs.len() < LEVELS.min_runs {
        return true;
    }
    let Some(equations) = total(&extended.fit.solution.pass.runs) else { return false };
    let own = extended.columns(candidate);
    let Some(projection) = extended.fit.eliminated(&equations, &own) else { return false };
    let information = projection.of_columns(&equations, &own).information;
    let estimates = extended.estimates(candidate);
    let along: Vec<f64> = runs.iter().map(|run| projection.score_of(run, &equations, &own).dot(&estimates)).collect();
    let t = cluster_robust_t(estimates.dot(&(&information * &estimates)), &along);
    p_of_student(t, along.len() as f64 - 1.0) < level
}

/// Student's t of θᵀIθ over the scores of the runs along the estimate θ: with n runs, their sum of squares
/// times n/(n − 1).
fn cluster_robust_t(signal: f64, scores: &[f64]) -> f64 {
    let n = scores.len() as f64;
    let squares: f64 = scores.iter().map(|score| score.powi(2)).sum();
    signal / (squares * n / (n - 1.0)).sqrt()
}

/// Cluster-robust standard deviations of a candidate's sizes, each run's score taken as it would be without
/// the run in the fit; `None` where runs are too few. References: as above; Bell & McCaffrey 2002 (the
/// leverage of a cluster).
fn over_runs(extended: &AugmentedModel<'_>, candidate: usize) -> Option<Vec<f64>> {
    let runs: Vec<_> = extended.fit.solution.pass.runs.iter().filter(|run| run.count > 0.0).collect();
    if runs.len() < LEVELS.min_runs {
        return None;
    }
    let equations = total(&extended.fit.solution.pass.runs)?;
    let own = extended.columns(candidate);
    let projection = extended.fit.eliminated(&equations, &own)?;
    let inverse = inverse(&projection.of_columns(&equations, &own).information, RIDGE)?;
    let clusters = runs.iter().map(|run| Information {
        matrix: projection.variance_of(run, &equations, &own),
        gradient: projection.score_of(run, &equations, &own),
    });
    let ClusterRobust { covariance, left_out: 0 } = ClusterRobust::of(&inverse, clusters) else { return None };
    let n = runs.len() as f64;
    // As much wider as Student's quantile is than the normal one: a standard deviation is read as 95 %
    // within 1.96 of it.
    let widening = student_95(n - 1.0) / LEVELS.normal_quantile_95;
    Some(covariance.diagonal().iter().map(|variance| variance.sqrt() * widening).collect())
}

/// Each candidate's test beside the others, as coarse encoders inflate it, with the standard deviations that
/// uncertain variants and causes add.
pub(crate) fn tests_of(model: &AugmentedModel<'_>, extra_sigma: &[Vec<f64>]) -> Vec<Test> {
    // As wide as Student's quantile is where measurements are few.
    let Some(equations) = total(&model.fit.solution.pass.runs) else { return Vec::new() };
    let freedom = freedom(&model.fit, &equations);
    let few = student_95(freedom) / LEVELS.normal_quantile_95;
    let inflation = NullDistribution::of(model).map(|null| null.inflation_of_own());
    let test = |(candidate, extra_sigma): (usize, &Vec<f64>)| {
        let (mut test, directions) = wald_test(model, candidate)?;
        let inflation = inflation.as_ref().map_or(1.0, |of_each| of_each[candidate]);
        test.statistic /= inflation;
        test.p_value = p_of_statistic(test.statistic, directions.len(), freedom);
        test.estimates.iter_mut().for_each(|(_, sigma)| *sigma *= few * inflation.sqrt());
        // Where runs differ more than the measurements' noise explains, the scatter between runs limits
        // what is known.
        if let Some(over_runs) = over_runs(model, candidate) {
            test.estimates.iter_mut().zip(over_runs).for_each(|((_, sigma), of)| *sigma = sigma.max(of));
        }
        for ((_, sigma), extra_sigma) in test.estimates.iter_mut().zip(extra_sigma) {
            *sigma = sigma.hypot(*extra_sigma);
        }
        Some(test)
    };
    extra_sigma.iter().enumerate().filter_map(test).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: TermParameter = TermParameter { name: "a", unit: "1", prior_sigma: 1.0 };

    /// I = [[4, 2], [2, 3]], θ = (−1/4, 3/2): Iθ = (2, 4), θᵀIθ = 11/2, I⁻¹ = [[3, −2], [−2, 4]]/8.
    fn tested(prior_sigma: [f64; 2], count: f64, freedom: f64) -> (Test, Vec<(f64, f64)>) {
        let information = DMatrix::from_row_slice(2, 2, &[4.0, 2.0, 2.0, 3.0]);
        let parameters = prior_sigma.map(|prior_sigma| TermParameter { prior_sigma, ..UNIT });
        wald_test_of(&information, &DVector::from_column_slice(&[-0.25, 1.5]), &parameters, count, freedom)
    }

    #[test]
    fn the_wald_test_of_two_parameters_is_that_on_paper() {
        let (test, directions) = tested([1.0, 1.0], 1e9, 1e9);
        // Rejects a sum of θᵢ²Iᵢᵢ = 1/4 + 27/4. The ridge and rounding change each number by 1e-11 at most.
        assert!((test.statistic - 5.5).abs() < 1e-11, "{test:?}");
        assert!((test.estimates[0].1 - 0.375_f64.sqrt()).abs() < 1e-11, "{test:?}");
        assert!((test.estimates[1].1 - 0.5_f64.sqrt()).abs() < 1e-11, "{test:?}");
        // In principal directions, trace and determinant are those of I, and Σ value·size² is the statistic
        // again.
        let values: Vec<f64> = directions.iter().map(|(value, _)| *value).collect();
        assert!((values[0] + values[1] - 7.0).abs() < 1e-12 && (values[0] * values[1] - 8.0).abs() < 1e-12);
        let again: f64 = directions.iter().map(|(value, size)| value * size * size).sum();
        assert!((again - 5.5).abs() < 1e-12, "{directions:?}");
    }

    #[test]
    fn sizes_of_few_observations_are_known_less_well() {
        // 8 observations, 6 free: the variance is 8/2 times as large. Rejects shrink in place of its
        // reciprocal.
        let (test, _) = tested([1.0, 1.0], 8.0, 2.0);
        assert!((test.estimates[1].1 - (0.5_f64 * 4.0).sqrt()).abs() < 1e-11, "{test:?}");
        assert!((test.statistic - 5.5 / 4.0).abs() < 1e-11, "{test:?}");
        // Scaled by prior sigmas of 0.1, no direction has an eigenvalue of 1: nothing is tested.
        let (test, directions) = tested([0.1, 0.1], 1e9, 1e9);
        assert!(directions.is_empty() && test.statistic == 0.0 && test.p_value == 1.0, "{test:?}");
    }

    #[test]
    fn runs_that_differ_weaken_a_test() {
        // Four runs of score 1/2 along θ sum to the signal 2: squares 1, times 4/3, t = 2/√(4/3) = √3.
        // Rejects n/(n − 1) forgotten, which gives 2.
        assert!((cluster_robust_t(2.0, &[0.5; 4]) - 3_f64.sqrt()).abs() < 1e-15);
        // One run that has it all: squares 4, t = √(3/4). Rejects squares of the sum, which are the same
        // for both.
        assert!((cluster_robust_t(2.0, &[2.0, 0.0, 0.0, 0.0]) - 0.75_f64.sqrt()).abs() < 1e-15);
    }
}
