//! Anderson acceleration of the fit's steps. Mean and noise step side by side, each as if the other stayed,
//! so that steps converge linearly. The last of them give the rates, and the fixed point.
//!
//! Reference: Anderson 1965; Walker & Ni 2011 (the mixing as least squares over differences of steps).

use std::collections::VecDeque;

use nalgebra::{DMatrix, DVector};

use crate::settings::COMMON;

/// Size of a step: of the mean squared over its variance, and of the noise in the logarithm of a variance.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepSize {
    pub(super) mean: f64,
    pub(super) noise: f64,
}

/// The steps so far.
#[derive(Debug, Default)]
pub(super) struct Acceleration {
    /// The last step that was proposed, and the one that was taken.
    last: Option<(DVector<f64>, DVector<f64>)>,
    /// Differences of consecutive proposed steps, and the steps taken in between; the newest last.
    differences: VecDeque<(DVector<f64>, DVector<f64>)>,
    engaged: bool,
    diverged: u32,
}

impl Acceleration {
    /// Whether the next step, of this size, is to be mixed.
    pub(super) fn engages(&mut self, step: StepSize) -> bool {
        if self.engaged
            && (step.mean > COMMON.anderson_diverged_mean_step || step.noise > COMMON.anderson_diverged_noise_step)
        {
            (self.engaged, self.last) = (false, None);
            self.differences.clear();
            self.diverged += 1;
        }
        self.engaged |= step.mean < COMMON.anderson_mean_step
            && step.noise < COMMON.anderson_noise_step
            && self.diverged < COMMON.max_anderson_divergences;
        self.engaged
    }

    /// The mixed step in the place of a proposed one. `metric` is the information, so that lengths are in
    /// standard deviations.
    pub(super) fn mixed(&mut self, step: &DVector<f64>, metric: &DMatrix<f64>) -> DVector<f64> {
        let squared = |of: &DVector<f64>| of.dot(&(metric * of));
        if let Some((before, moved)) = self.last.take() {
            self.differences.push_back((step - before, moved));
        }
        if self.differences.len() > COMMON.anderson_depth {
            self.differences.pop_front();
        }
        if self.differences.is_empty() {
            return step.clone();
        }
        let n = self.differences.len();
        let part_equations: Vec<DVector<f64>> =
            self.differences.iter().map(|(difference, _)| metric * difference).collect();
        let products = DMatrix::from_fn(n, n, |i, j| self.differences[i].0.dot(&part_equations[j]));
        let along = DVector::from_fn(n, |i, _| part_equations[i].dot(step));
        // Squares of absurd steps overflow, and the decomposition panics at what is no number.
        if !products.iter().chain(along.iter()).all(|value| value.is_finite()) {
            self.differences.clear();
            return step.clone();
        }
        let least = COMMON.anderson_singular_value * products.diagonal().max();
        let Ok(shares) = products.svd(true, true).solve(&along, least) else { return step.clone() };
        let combined = self
            .differences
            .iter()
            .zip(shares.iter())
            .fold(step.clone(), |sum, ((difference, moved), share)| sum - (difference + moved) * *share);
        if combined.iter().all(|by| by.is_finite())
            && squared(&combined) <= COMMON.max_anderson_step_ratio * COMMON.max_anderson_step_ratio * squared(step)
        {
            combined
        } else {
            self.differences.clear();
            step.clone()
        }
    }

    /// Records the step that was taken for a proposed one.
    pub(super) fn moved(&mut self, proposed: DVector<f64>, by: DVector<f64>) {
        self.last = Some((proposed, by));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A linear map of three rates is solved after three differences.
    #[test]
    fn a_linear_iteration_ends_once_its_rates_are_known() {
        let shares = DVector::from_vec(vec![0.9, -0.5, 0.3]);
        let metric = DMatrix::from_diagonal(&DVector::from_vec(vec![4.0, 1e4, 1.0]));
        let mut acceleration = Acceleration::default();
        let mut x = DVector::from_vec(vec![1.0, -2.0, 3.0]);
        for _ in 0..5 {
            let step = shares.component_mul(&x) - &x;
            let by = acceleration.mixed(&step, &metric);
            x += &by;
            acceleration.moved(step, by);
        }
        assert!(x.norm() < 1e-9, "{x}");
    }

    #[test]
    fn steps_whose_squares_overflow_are_not_mixed() {
        let metric = DMatrix::identity(2, 2) * 1e300;
        let mut acceleration = Acceleration::default();
        for size in [1e10, 3e10, -2e10] {
            let step = DVector::from_element(2, size);
            let by = acceleration.mixed(&step, &metric);
            assert_eq!(by, step);
            acceleration.moved(step, by);
        }
    }
}
