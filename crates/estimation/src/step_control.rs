//! How far the steps of a fit go, and when they lead nowhere.

use nalgebra::Vector4;

use crate::settings::COMMON;

/// Whether steps come to an end.
#[derive(Default)]
pub(crate) struct Progress {
    /// The smallest squared step so far, and how many were taken since.
    nearest: Option<f64>,
    since: usize,
}

impl Progress {
    /// Takes a squared step, of mean and noise over their variances. Steps that have not become smaller for
    /// long go round in circles, as between two sides of an outlier gate, or away.
    pub(crate) fn has_stalled(&mut self, squared: f64) -> bool {
        if self.nearest.is_none_or(|nearest| squared < nearest) {
            (self.nearest, self.since) = (Some(squared), 0);
        } else {
            self.since += 1;
        }
        self.since >= COMMON.max_steps_without_progress
    }
}

/// Share of its scoring step that the logarithm of each variance takes: scoring overshoots where the model is
/// wrong, and shorter steps converge.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StepDamping {
    last: Vector4<f64>,
    share: Vector4<f64>,
    /// Shares grow no more: steps go to and fro for ever where a measurement is an outlier by one variance
    /// and none by the next, and what they enclose is the result.
    pub(crate) only_shorter: bool,
}

impl Default for StepDamping {
    fn default() -> Self {
        Self { last: Vector4::zeros(), share: Vector4::repeat(1.0), only_shorter: false }
    }
}

impl StepDamping {
    /// The step to take instead of `step`.
    pub(crate) fn damped(&mut self, step: Vector4<f64>) -> Vector4<f64> {
        for k in 0..step.len() {
            self.share[k] = if step[k] * self.last[k] < 0.0 {
                COMMON.step_decrease * self.share[k]
            } else if self.only_shorter {
                self.share[k]
            } else {
                (COMMON.step_increase * self.share[k]).min(1.0)
            };
        }
        self.last = step;
        step.component_mul(&self.share)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_that_have_not_become_smaller_for_long_have_stalled() {
        let mut progress = Progress::default();
        let mut taken =
            |squared: f64, times: usize| (0..times).map(|_| progress.has_stalled(squared)).collect::<Vec<_>>();
        assert_eq!(taken(1.0, 1), [false]);
        // Equal ones are no smaller; a smaller one begins anew.
        assert!(!taken(1.0, COMMON.max_steps_without_progress - 1).contains(&true));
        assert_eq!(taken(0.5, 1), [false]);
        let mut on = taken(0.7, COMMON.max_steps_without_progress);
        assert_eq!(on.pop(), Some(true));
        assert!(!on.contains(&true));
        // Steps that are no number are no smaller either.
        let mut progress = Progress::default();
        let stalled = (0..=COMMON.max_steps_without_progress).any(|_| progress.has_stalled(f64::NAN));
        assert!(stalled);
    }

    #[test]
    fn a_damped_noise_step_is_shorter_where_it_turns_back_and_longer_where_it_goes_on() {
        let mut damping = StepDamping::default();
        let ahead = Vector4::new(1.0, 2.0, -3.0, 0.0);
        // From a whole step on nothing grows.
        assert_eq!(damping.damped(ahead), ahead);
        let turned = damping.damped(Vector4::new(-1.0, 2.0, 3.0, 5.0));
        assert_eq!(turned, Vector4::new(-COMMON.step_decrease, 2.0, 3.0 * COMMON.step_decrease, 5.0));
        let again = damping.damped(Vector4::new(-1.0, -2.0, 3.0, 5.0));
        let grown = (COMMON.step_increase * COMMON.step_decrease).min(1.0);
        assert_eq!(again, Vector4::new(-grown, -2.0 * COMMON.step_decrease, 3.0 * grown, 5.0));
        // Back once more: it shrinks each time.
        let [twice, grown_twice] =
            [COMMON.step_decrease * COMMON.step_decrease, (COMMON.step_increase * grown).min(1.0)];
        let back = damping.damped(Vector4::new(-1.0, 2.0, 3.0, 5.0));
        assert_eq!(back, Vector4::new(-grown_twice, 2.0 * twice, 3.0 * grown_twice, 5.0));
    }
}
