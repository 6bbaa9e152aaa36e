//! Profile-likelihood intervals: the values of a parameter at which the likelihood, maximised over all
//! others, falls by a given amount.
//!
//! Where the cost is no parabola (few measurements, a sensor position that is correlated with the wheels)
//! they are asymmetric about the estimate.
//! Reference: Venzon & Moolgavkar 1988. The noise is held at its estimate: its own profile would widen an
//! interval by less than a part in the number of measurements.

use nalgebra::DVector;

use crate::error::EstimationError;
use crate::model::Column;
use crate::model_fit::ModelFit;
use crate::normal_equations::NormalEquations;
use crate::optimizer::{FitOptions, fit_from};
use crate::settings::COMMON;

impl ModelFit<'_> {
    /// The interval of a free column's steps, relative to the estimate, at whose ends the cost has risen by
    /// `rise` ([`crate::RISE_95`]).
    ///
    /// # Errors
    /// [`EstimationError`] when the column is not free, or a refit diverges.
    pub fn profile(&self, column: Column, rise: f64) -> Result<(f64, f64), EstimationError> {
        let position = self.position(column);
        let sigma = position.zip(self.solution.information(&self.columns)).and_then(|(position, information)| {
            let (_, covariance) = information.solve()?;
            Some(covariance[(position, position)].sqrt())
        });
        let (Some(position), Some(sigma)) = (position, sigma) else {
            return Err(EstimationError::NoProfile { parameter: format!("{column:?}") });
        };
        let best = self.cost();
        let first = sigma * (2.0 * rise).sqrt();
        let low = self.end(column, position, -first, best + rise)?;
        let high = self.end(column, position, first, best + rise)?;
        Ok((low, high))
    }

    fn cost(&self) -> f64 {
        self.solution.pass.runs.iter().map(NormalEquations::cost).sum()
    }

    /// The step at which the cost reaches `level`: the cost is nearly a parabola, so its root is that of the
    /// parabola through the last step.
    fn end(&self, column: Column, position: usize, first: f64, level: f64) -> Result<f64, EstimationError> {
        let best = self.cost();
        let mut by = first;
        for _ in 0..COMMON.max_profile_steps {
            let risen = self.cost_with(column, position, by)? - best;
            let wanted = level - best;
            if (risen - wanted).abs() < COMMON.profile_rise_tolerance * wanted {
                break;
            }
            // A cost that rises little moves the end outwards by a factor of two at the most.
            by *= (wanted / risen.max(COMMON.min_profile_rise * wanted)).sqrt();
        }
        Ok(by)
    }

    /// The least cost with one column moved and held there.
    fn cost_with(&self, column: Column, position: usize, by: f64) -> Result<f64, EstimationError> {
        let mut from = self.current_values();
        from.model.advance(column, by);
        let mut fixed = self.fixed();
        fixed.push(DVector::from_fn(self.columns.len(), |row, _| f64::from(u8::from(row == position))));
        let options = FitOptions { fixed, noise_fixed: true, ..FitOptions::of(&self.columns) };
        let moved = fit_from(&self.records, &self.selections, from, &self.prior, &mut [], &options)?;
        Ok(moved.pass.runs.iter().map(NormalEquations::cost).sum())
    }
}
