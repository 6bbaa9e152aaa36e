//! Distributions of tests where encoders are coarse: from the runs simulated once more by the fitted model,
//! their counts rounded anew ([`ModelFit::resimulated`]).
//!
//! A test whose p-value is p by formula has z = Φ⁻¹(1 − p), standard normal if the formula holds. Over
//! simulated runs its mean and standard deviation say how far it does not, and z is judged by these. A score
//! test's statistic, χ² by formula, is inflated by a factor where errors last; it is judged over that factor.

use estimation::{ModelFit, Projected, total};
use rayon::prelude::*;
use rules::Rule;

use crate::candidates::candidate::{Candidate, terms};
use crate::checks::check::Correlation;
use crate::fits::augmented_model::AugmentedModel;
use crate::fits::scan::{detectable_statistic, scan_parts_of};
use crate::fits::statistics::{p_of_upper_student, z_of_upper};
use crate::settings::RESIDUALS;

/// A model whose tests depend on the rounding of counts.
pub(crate) struct NullDistribution<'m, 'a> {
    model: &'m AugmentedModel<'a>,
}

impl<'m, 'a> NullDistribution<'m, 'a> {
    /// Of a model; `None` where formulas hold.
    pub(crate) fn of(model: &'m AugmentedModel<'a>) -> Option<Self> {
        Rule::JudgedAmongSimulated.finds(model.fit.depends_on_rounding().then_some(Self { model }))
    }

    /// What simulated runs give, one after the other.
    pub(crate) fn resimulated<T: Send>(&self, of: impl Fn(&ModelFit<'_>) -> T + Sync) -> Vec<T> {
        of_each(|number| of(&self.model.fit.resimulated(&mut terms(&self.model.candidates), number)))
    }

    /// What scans of simulated runs give, one after the other.
    fn scanned<T: Send>(&self, of: impl Fn(&ModelFit<'_>) -> T + Sync) -> Vec<T> {
        of_each(|number| of(&self.model.fit.resimulated_without_pass(&mut terms(&self.model.candidates), number)))
    }

    /// By how much the score statistics of parts are inflated; 1 where they are not.
    pub(crate) fn inflation(&self, parts: &[&[Candidate]]) -> Vec<f64> {
        if parts.is_empty() {
            return Vec::new();
        }
        let scores = |fit: &ModelFit<'_>| {
            scan_parts_of(fit, &self.model.candidates, parts, |own, projected, _| ratio(own, projected))
        };
        means(&self.scanned(scores), parts.len())
    }

    /// The same of the model's own candidates at their sizes, each beside the others.
    pub(crate) fn inflation_of_own(&self) -> Vec<f64> {
        let scores = |fit: &ModelFit<'_>| {
            let Some(equations) = total(&fit.solution.pass.runs) else { return Vec::new() };
            let score = |(index, candidate): (usize, &Candidate)| {
                let own = self.model.columns(index);
                fit.eliminated(&equations, &own).map_or(1.0, |projection| {
                    ratio(std::slice::from_ref(candidate), &projection.of_columns(&equations, &own))
                })
            };
            self.model.candidates.iter().enumerate().map(score).collect()
        };
        means(&self.resimulated(scores), self.model.candidates.len())
    }
}

/// What each simulation gives, by its number.
fn of_each<T: Send>(of: impl Fn(u64) -> T + Sync) -> Vec<T> {
    (1..=RESIDUALS.resimulations).into_par_iter().map(&of).collect()
}

/// A score statistic over what it is by formula, on average.
fn ratio(own: &[Candidate], projected: &Projected) -> f64 {
    let (statistic, dimensions) = detectable_statistic(own, projected);
    if dimensions > 0 { statistic / dimensions as f64 } else { 1.0 }
}

/// The mean of each of several ratios over simulated runs, not below 1.
fn means(simulated: &[Vec<f64>], ratios: usize) -> Vec<f64> {
    let mean = |part: usize| {
        let of = simulated.iter().filter_map(|scores| scores.get(part));
        let (sum, count) = of.fold((0.0, 0.0_f64), |(sum, count), score| (sum + score, count + 1.0));
        if count > 0.0 { f64::max(sum / count, 1.0) } else { 1.0 }
    };
    (0..ratios).map(mean).collect()
}

/// A p-value by formula, judged among those of simulated runs; it is made no stricter.
pub(crate) fn among_simulated<'p>(p_value: f64, simulated: impl Iterator<Item = &'p f64>) -> f64 {
    let z: Vec<f64> = simulated.map(|p_value| z_of_upper(*p_value)).collect();
    judged(z_of_upper(p_value), &z).max(p_value)
}

/// A correlation beyond what simulated runs have in its direction.
pub(crate) fn beyond_simulated(found: Correlation, simulated: &[Correlation]) -> Correlation {
    let count = simulated.len() as f64;
    let mean = |of: fn(&Correlation) -> f64| simulated.iter().map(of).sum::<f64>() / count;
    let (coefficient_mean, sigmas_mean) = (mean(|of| of.coefficient), mean(|of| of.sigmas));
    let variance = simulated.iter().map(|of| (of.sigmas - sigmas_mean).powi(2)).sum::<f64>() / (count - 1.0);
    // What has the other sign explains nothing, and what is larger explains all.
    let left = |value: f64, mean: f64| {
        if value * mean > 0.0 { value.signum() * f64::max(value.abs() - mean.abs(), 0.0) } else { value }
    };
    Correlation {
        coefficient: left(found.coefficient, coefficient_mean),
        sigmas: left(found.sigmas, sigmas_mean) / variance.sqrt().max(1.0),
    }
}

/// Upper tail of a value among simulated ones, which are normal with unknown mean and variance: not below 0
/// and 1, by formula.
fn judged(z: f64, simulated: &[f64]) -> f64 {
    let count = simulated.len() as f64;
    let simulated: Vec<f64> = simulated.iter().map(|z| z.max(RESIDUALS.lowest_simulated_z)).collect();
    let mean = simulated.iter().sum::<f64>() / count;
    let variance = simulated.iter().map(|z| (z - mean).powi(2)).sum::<f64>() / (count - 1.0);
    let (mean, sd) = (mean.max(0.0), variance.sqrt().max(1.0));
    p_of_upper_student((z - mean) / (sd * (1.0 + 1.0 / count).sqrt()), count - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inflation_is_the_mean_of_what_simulated_runs_have_and_no_less_than_one() {
        // A run whose fit determines nothing has no ratios.
        assert_eq!(means(&[vec![2.0, 0.5], vec![4.0, 0.25], Vec::new()], 2), [3.0, 1.0]);
        assert_eq!(means(&[], 1), [1.0]);
    }

    #[test]
    fn a_value_is_judged_among_simulated_ones() {
        // Mean 2, variance (4 + 0 + 4)/2 = 4: (6 − 2)/(2 √(4/3)) = √3 of Student's t with two degrees of
        // freedom, whose upper tail there is (1 − √3/√5)/2.
        let p = judged(6.0, &[0.0, 2.0, 4.0]);
        assert!((p - 0.5 * (1.0 - (3.0_f64 / 5.0).sqrt())).abs() < 1e-9, "{p}");
        // Below the formula's mean and variance nothing is gained. Rejects a z over its own sd of 0.1.
        let p = judged(3.0, &[-1.1, -1.0, -0.9]);
        assert!((p - p_of_upper_student(3.0 / (4.0_f64 / 3.0).sqrt(), 2.0)).abs() < 1e-12, "{p}");
        // p-values of 1 are no scatter: −7 counts as −1, mean 0 and variance 4/3. Rejects a variance of 18.
        let p = judged(6.0, &[-7.0, -7.0, 1.0, 1.0]);
        assert!((p - p_of_upper_student(6.0 / (4.0_f64 / 3.0 * 1.25).sqrt(), 3.0)).abs() < 1e-12, "{p}");
    }

    #[test]
    fn a_correlation_is_judged_beyond_what_simulated_runs_have() {
        // Means 0.2 and 4, standard deviation 2: 0.5 − 0.2 and (10 − 4)/2. Rejects quotients by the sum, by
        // the count of values or by the variance.
        let of = |(coefficient, sigmas): (f64, f64)| Correlation { coefficient, sigmas };
        let simulated = [(0.1, 2.0), (0.2, 4.0), (0.3, 6.0)].map(of);
        let Correlation { coefficient, sigmas } = beyond_simulated(of((0.5, 10.0)), &simulated);
        assert!((coefficient - 0.3).abs() < 1e-12 && (sigmas - 3.0).abs() < 1e-12, "{coefficient} {sigmas}");
        // What is no more than that is nothing, and what has the other sign stays.
        assert_eq!(beyond_simulated(of((0.1, 3.0)), &simulated), of((0.0, 0.0)));
        assert_eq!(beyond_simulated(of((-0.5, -10.0)), &simulated), of((-0.5, -5.0)));
        // Rejects means that are taken off by their sign alone: both are negative here.
        let negative = simulated.map(|a| of((-a.coefficient, -a.sigmas)));
        let Correlation { coefficient, sigmas } = beyond_simulated(of((-0.5, -10.0)), &negative);
        assert!((coefficient + 0.3).abs() < 1e-12 && (sigmas + 3.0).abs() < 1e-12, "{coefficient} {sigmas}");
        // Standard errors are not below 1, by formula.
        let sigmas = beyond_simulated(of((0.5, 10.0)), &[(0.0, 3.9), (0.0, 4.0), (0.0, 4.1)].map(of)).sigmas;
        assert!((sigmas - 6.0).abs() < 1e-12, "{sigmas}");
    }

    #[test]
    fn a_p_value_among_simulated_ones_is_made_no_stricter() {
        use crate::fits::statistics::p_of_z;
        // Simulated ones that are all large leave it as it is, but for the tail of few.
        let p_value = among_simulated(1e-3, [0.9, 0.8, 0.7].iter());
        assert!(p_value > 1e-3 && p_value < 0.1, "{p_value}");
        assert_eq!(among_simulated(0.9, [0.5, 0.5, 0.5].iter()), 0.9);
        // z of 0, 2 and 4, and 6 itself, as above. Rejects z of both sides.
        let of = |z: f64| if z == 0.0 { 0.5 } else { 0.5 * p_of_z(z) };
        let p_value = among_simulated(of(6.0), [of(0.0), of(2.0), of(4.0)].iter());
        assert!((p_value - 0.5 * (1.0 - (3.0_f64 / 5.0).sqrt())).abs() < 1e-6, "{p_value}");
    }
}
