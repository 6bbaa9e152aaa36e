//! The likelihood of runs that nobody has driven yet: what they would say of the parameters, and how surely dead reckoning would end where it should.
//!
//! Information needs a path and instants of looks, no measured values: a fitted model, or a nominal one, with records made up along a program gives the normal
//! equation that driving it would add (to first order; Atkinson & Donev 1992, optimum designs for models linear in their parameters).

use dataset::Session;
use nalgebra::{Matrix3, Vector3};

use crate::model::Model;
use crate::model_fit::JointFit;
use crate::noise::Noise;
use crate::optimizer::{Ends, Fit, NOISE_SETTLED, start_heading};
use crate::pass::Pass;
use crate::thinning::Selection;

impl<'a> JointFit<'a> {
    /// A model with its noise on records that it was not fitted to; the three lengths are free.
    #[must_use]
    pub fn unfitted(model: Model, noise: Noise, sessions: &[Session<'a>]) -> Self {
        let fit = Self::before_any_step(sessions, model.clone(), Ends::NoiseShare(NOISE_SETTLED), false);
        let free_headings = fit.records.chains.iter().map(|chain| start_heading(chain, &model)).collect();
        let known = Fit { model, noise, free_headings, pass: Pass::nothing(), converged: true, strayed: false };
        Self { fit: known, ..fit }
    }
}

impl JointFit<'_> {
    /// The same model on records of other runs, its further terms without size: their looks are taken as this fit takes its own.
    #[must_use]
    pub fn foreseeing<'b>(&self, sessions: &[Session<'b>]) -> JointFit<'b> {
        let model = Model { sizes: vec![0.0; self.fit.model.sizes.len()], own: None, ..self.fit.model.clone() };
        let mut foreseen = JointFit::unfitted(model, self.fit.noise, sessions);
        foreseen.selections = Selection::of(&foreseen.records, self.thinning, &self.nominal).into();
        foreseen.thinning = self.thinning;
        foreseen.nominal = self.nominal.clone();
        foreseen.columns = self.columns.clone();
        foreseen
    }

    /// For each chain of two looks, how dead reckoning from the first scatters about the second by the noise alone: variances along, across (m²) and of the
    /// heading (rad²) in the frame of the second look, both looks' errors included. In the order of [`Self::reckoned`] where every chain is such a one.
    #[must_use]
    pub fn end_variances(&self) -> Vec<Vector3<f64>> {
        let Some(selection) = self.selections.first() else { return Vec::new() };
        let [wheel, turn, xy, theta] = self.fit.noise.variance;
        let looks = Vector3::new(xy, xy, theta);
        selection
            .legs
            .iter()
            .zip(&self.records.chains)
            .filter_map(|(legs, chain)| {
                let (start, _, (_, end)) = chain.ends()?;
                let ([leg], moved) = (&legs[..], start.to(end)) else { return None };
                let mut covariance = leg.noise.matrix(0) * wheel + leg.noise.matrix(1) * turn;
                let lever = Vector3::new(-moved.y_m, moved.x_m, 1.0);
                covariance += Matrix3::from_diagonal(&Vector3::new(xy, xy, 0.0)) + lever * lever.transpose() * theta;
                let (sin, cos) = moved.theta_rad.sin_cos();
                let turned = Matrix3::new(cos, sin, 0.0, -sin, cos, 0.0, 0.0, 0.0, 1.0);
                Some((turned * covariance * turned.transpose()).diagonal() + looks)
            })
            .collect()
    }
}
