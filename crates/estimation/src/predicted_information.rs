//! The likelihood of runs that nobody has driven yet: what they would say of the parameters, and how surely dead reckoning would end where it should.
//!
//! Information needs a path and instants of measurements, no measured values: a fitted model, or a nominal one, with records made up along a program gives the normal
//! equation that driving it would add (to first order; Atkinson & Donev 1992, optimum designs for models linear in their parameters).

use dataset::Session;
use nalgebra::{Matrix3, Vector3};

use crate::model::Model;
use crate::model_fit::ModelFit;
use crate::noise::Noise;
use crate::optimizer::{ConvergenceCriterion, Solution, start_heading};
use crate::pass::Pass;
use crate::settings::NOISE_STEP_TOLERANCE;
use crate::thinning::Selection;

impl<'a> ModelFit<'a> {
    /// A model with its noise on records that it was not fitted to; the three geometry parameters are free.
    #[must_use]
    pub fn from_parameters(model: Model, noise: Noise, sessions: &[Session<'a>]) -> Self {
        let fit = Self::before_any_step(
            sessions,
            model.clone(),
            ConvergenceCriterion::NoiseShare(NOISE_STEP_TOLERANCE),
            false,
        );
        let free_headings = fit.records.segments.iter().map(|segment| start_heading(segment, &model)).collect();
        let reused =
            Solution { model, noise, free_headings, pass: Pass::nothing(), converged: true, left_basin: false };
        Self { solution: reused, ..fit }
    }
}

impl ModelFit<'_> {
    /// The same model on records of other runs, its further terms without size: their measurements are taken as this fit takes its own.
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

    /// For each segment of two measurements, how dead reckoning from the first scatters about the second by the noise alone: variances along, across (m²) and of the
    /// heading (rad²) in the frame of the second look, both measurements' errors included. In the order of [`Self::dead_reckoned`] where every segment is such a one.
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
