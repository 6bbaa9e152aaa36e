//! Noise of the instants of measurements: what stamps that jitter, and motion that rows do not tell, do to a
//! moving robot.
//!
//! An instant that is off by ε moves a measurement along the path: by ε times the velocity u of the
//! instrument, turn rate included. R = σ²-terms + σ_t² u uᵀ grows with speed, where noise of poses does not.
//! The variance is fitted outside the optimizer, by its own score, where that is significant: near zero its
//! logarithm has no information.
//! Reference: Rao 1948 (score test); Bar-Shalom, Li & Kirubarajan 2001, chapter 5 (innovations).

use model_term::ModelTerm;

use crate::error::EstimationError;
use crate::model_fit::ModelFit;
use crate::noise::Noise;
use crate::settings::COMMON;

impl ModelFit<'_> {
    /// Whether the noise of instants is larger than it is in the fit, beyond chance.
    #[must_use]
    pub fn has_timing_noise(&self) -> bool {
        self.solution.pass.timing.z() > COMMON.min_timing_noise_sigmas
    }

    /// Fits the noise of instants where it is significant, with the values that were found. `terms` are those
    /// of the fit.
    ///
    /// # Errors
    /// [`EstimationError`] when it diverges.
    pub fn fit_timing_noise(&mut self, terms: &mut [Box<dyn ModelTerm>]) -> Result<(), EstimationError> {
        if !self.has_timing_noise() {
            return Ok(());
        }
        for _ in 0..COMMON.max_timing_noise_steps {
            let before_s2 = self.prior.timing_s2;
            let next_s2 = (before_s2 + self.solution.pass.timing.step_s2()).max(0.0);
            self.refit_at_timing_noise(next_s2, terms)?;
            if (next_s2 - before_s2).abs() <= COMMON.timing_noise_tolerance * next_s2 {
                break;
            }
        }
        Ok(())
    }

    /// The fit with the noise of instants that another one has, on the same records.
    ///
    /// # Errors
    /// [`EstimationError`] when it diverges.
    pub fn with_timing_noise_of(&self, other: &Self) -> Result<Self, EstimationError> {
        let mut noisy = self.clone();
        noisy.refit_at_timing_noise(other.prior.timing_s2, &mut [])?;
        Ok(noisy)
    }

    fn refit_at_timing_noise(
        &mut self,
        timing_s2: f64,
        terms: &mut [Box<dyn ModelTerm>],
    ) -> Result<(), EstimationError> {
        self.prior.timing_s2 = timing_s2;
        let mut from = self.current_values();
        from.noise = from.noise.map(|noise| Noise { timing_s2, ..noise });
        self.refit(Some(from), terms)
    }
}
