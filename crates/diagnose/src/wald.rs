//! How well sizes are known: by the likelihood, by how runs differ, by what is not known of variants, and by what is not known of the names beside them.

use estimation::{ClusterRobust, Information, RIDGE, inverse, total};

use crate::augmented_model::AugmentedModel;
use crate::scan::{freedom, principal};
use crate::settings::levels::{MIN_RUNS, NORMAL_QUANTILE_95};
use crate::settings::search::MIN_DETECTABLE_SIGMAS;
use crate::statistics::{p_of_statistic, p_of_student, student_95};

/// A test of one candidate of a fitted model.
#[derive(Debug, Clone)]
pub(crate) struct Test {
    pub(crate) statistic: f64,
    pub(crate) p_value: f64,
    /// Value and standard deviation of each parameter.
    pub(crate) estimates: Vec<(f64, f64)>,
}

/// The test of a candidate in its fitted model, and along its principal directions in units of the plausible: information and size.
pub(crate) fn wald_test(extended: &AugmentedModel<'_>, candidate: usize) -> Option<(Test, Vec<(f64, f64)>)> {
    let equations = total(&extended.fit.fit.pass.runs)?;
    let parameters = extended.candidates[candidate].parameters();
    let own = extended.columns(candidate);
    let projected = extended.fit.eliminated(&equations, &own)?.of_columns(&equations, &own);
    let estimates = extended.estimates(candidate);
    let gradient = &projected.information * &estimates;
    let directions: Vec<(f64, f64)> = principal(&projected.information, &gradient, &parameters)
        .into_iter()
        .filter(|(value, _)| *value >= MIN_DETECTABLE_SIGMAS * MIN_DETECTABLE_SIGMAS)
        .map(|(value, gradient)| (value, gradient / value))
        .collect();
    let freedom = freedom(&extended.fit, &equations);
    let shrink = freedom / equations.count.max(1.0);
    let statistic = directions.iter().map(|(value, size)| shrink * value * size * size).sum();
    let covariance = inverse(&projected.information, RIDGE);
    let sigma = |k: usize| covariance.as_ref().map_or(f64::NAN, |covariance| (covariance[(k, k)] / shrink).sqrt());
    let test = Test {
        statistic,
        p_value: p_of_statistic(statistic, directions.len(), freedom),
        estimates: estimates.iter().enumerate().map(|(k, size)| (*size, sigma(k))).collect(),
    };
    Some((test, directions))
}

/// Whether a candidate's size stands out against its own scatter from run to run, along itself: runs err alike within themselves (a wheelbase that differs from motion to
/// motion, measurements that resemble each other), and a likelihood that takes looks for independent believes them too much.
///
/// With u_r the score of run r, the other free columns taken out, the size θ has the variance I⁻¹ (Σ u_r u_rᵀ) I⁻¹ whatever is alike within runs. References: White 1982;
/// Liang & Zeger 1986.
pub(crate) fn cluster_robust_test(extended: &AugmentedModel<'_>, candidate: usize, level: f64) -> bool {
    // Fewer runs do not say how a size differs between them.
    let runs: Vec<_> = extended.fit.fit.pass.runs.iter().filter(|run| run.count > 0.0).collect();
    if runs.len() < MIN_RUNS {
        return true;
    }
    let Some(equations) = total(&extended.fit.fit.pass.runs) else { return false };
    let own = extended.columns(candidate);
    let Some(projection) = extended.fit.eliminated(&equations, &own) else { return false };
    let information = projection.of_columns(&equations, &own).information;
    let estimates = extended.estimates(candidate);
    let stands = estimates.dot(&(&information * &estimates));
    let n = runs.len() as f64;
    let squares: f64 = runs.iter().map(|run| projection.score_of(run, &equations, &own).dot(&estimates).powi(2)).sum();
    let t = stands / (squares * n / (n - 1.0)).sqrt();
    t.is_nan() || p_of_student(t, n - 1.0) < level
}

/// Standard deviations of a candidate's sizes by how they differ from run to run, each run's score taken as it would be without the run in the fit; `None` where runs are
/// too few to say. References: as above; Bell & McCaffrey 2002 (the leverage of a cluster).
fn over_runs(extended: &AugmentedModel<'_>, candidate: usize) -> Option<Vec<f64>> {
    let runs: Vec<_> = extended.fit.fit.pass.runs.iter().filter(|run| run.count > 0.0).collect();
    if runs.len() < MIN_RUNS {
        return None;
    }
    let equations = total(&extended.fit.fit.pass.runs)?;
    let own = extended.columns(candidate);
    let projection = extended.fit.eliminated(&equations, &own)?;
    let inverse = inverse(&projection.of_columns(&equations, &own).information, RIDGE)?;
    let clusters = runs.iter().map(|run| Information {
        matrix: projection.variance_of(run, &equations, &own),
        gradient: projection.score_of(run, &equations, &own),
    });
    let ClusterRobust { covariance, left_out: 0 } = ClusterRobust::of(&inverse, clusters) else { return None };
    let n = runs.len() as f64;
    // As wide as Student's quantile is over so few runs: a size is told with a standard deviation, and read as within 1.96 of it.
    let widening = student_95(n - 1.0) / NORMAL_QUANTILE_95;
    Some(covariance.diagonal().iter().map(|variance| variance.sqrt() * widening).collect())
}

/// Each candidate's test beside the others, and by how much what is not known of variants and names widens its sizes.
pub(crate) fn tests_of(model: &AugmentedModel<'_>, extra_sigma: &[Vec<f64>]) -> Vec<Test> {
    // As wide as Student's quantile is where measurements are few.
    let Some(equations) = total(&model.fit.fit.pass.runs) else { return Vec::new() };
    let few = student_95(freedom(&model.fit, &equations)) / NORMAL_QUANTILE_95;
    let test = |(candidate, extra_sigma): (usize, &Vec<f64>)| {
        let (mut test, _) = wald_test(model, candidate)?;
        test.estimates.iter_mut().for_each(|(_, sigma)| *sigma *= few);
        // Where runs differ more than measurements say, a size is known no better than by the runs.
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
