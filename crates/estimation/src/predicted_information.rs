//! Predicted information of planned runs: on the parameters, and the variance of where dead reckoning ends.
//!
//! Information needs a path and the instants of measurements, not their values. A fitted or nominal model
//! with synthetic records of a program gives, to first order, the normal equation that the program would add.
//! Reference: Atkinson & Donev 1992 (optimum designs for models linear in their parameters).

use dataset::Session;
use nalgebra::{Matrix3, Vector3};

use crate::model::Model;
use crate::model_fit::ModelFit;
use crate::noise::Noise;
use crate::optimizer::{ConvergenceCriterion, Solution};
use crate::pass::Pass;
use crate::settings::COMMON;
use crate::thinning::Selection;

impl<'a> ModelFit<'a> {
    /// A model and its noise on records that it was not fitted to; the three geometry parameters are free.
    #[must_use]
    pub fn from_parameters(model: Model, noise: Noise, sessions: &[Session<'a>]) -> Self {
        let fit = Self::before_any_step(
            sessions,
            model.clone(),
            ConvergenceCriterion::NoiseShare(COMMON.noise_step_tolerance),
            false,
        );
        let free_headings = fit.records.start_headings_rad(&model);
        let reused =
            Solution { model, noise, free_headings, pass: Pass::nothing(), converged: true, left_basin: false };
        Self { solution: reused, ..fit }
    }
}

impl ModelFit<'_> {
    /// The same model on records of planned runs, with its terms at zero. Measurements are thinned as in this
    /// fit.
    #[must_use]
    pub fn on_planned_runs<'b>(&self, sessions: &[Session<'b>]) -> ModelFit<'b> {
        let model = Model {
            term_values: vec![0.0; self.solution.model.term_values.len()],
            own: None,
            ..self.solution.model.clone()
        };
        let mut planned = ModelFit::from_parameters(model, self.solution.noise, sessions);
        planned.selections = Selection::of(&planned.records, self.thinning, &self.nominal).into();
        planned.thinning = self.thinning;
        planned.nominal = self.nominal.clone();
        planned.columns = self.columns.clone();
        planned
    }

    /// Variances of dead reckoning from the first measurement of a segment about its second, by noise alone:
    /// along and across (m²) and of the heading (rad²), in the frame of the second measurement. Both
    /// measurements' errors are included. Segments of other than two measurements are left out; the order is
    /// that of [`Self::dead_reckoned`].
    #[must_use]
    pub fn end_variances(&self) -> Vec<Vector3<f64>> {
        let Some(selection) = self.selections.first() else { return Vec::new() };
        let [wheel, turn, xy, theta] = self.solution.noise.variance;
        let measurements = Vector3::new(xy, xy, theta);
        selection
            .propagations
            .iter()
            .zip(&self.records.segments)
            .filter_map(|(propagations, segment)| {
                let (start, _, (_, end)) = segment.ends()?;
                let ([propagation], moved) = (&propagations[..], start.to(end)) else { return None };
                let mut covariance = propagation.noise.matrix(0) * wheel + propagation.noise.matrix(1) * turn;
                let lever = Vector3::new(-moved.y_m, moved.x_m, 1.0);
                covariance += Matrix3::from_diagonal(&Vector3::new(xy, xy, 0.0)) + lever * lever.transpose() * theta;
                let (sin, cos) = moved.theta_rad.sin_cos();
                let turned = Matrix3::new(cos, sin, 0.0, -sin, cos, 0.0, 0.0, 0.0, 1.0);
                Some((turned * covariance * turned.transpose()).diagonal() + measurements)
            })
            .collect()
    }
}
