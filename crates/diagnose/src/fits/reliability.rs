//! Which terms the encoders resolve: how much of what a term goes by is motion, and how much is rounding.
//!
//! Speeds and accelerations by counts have the rounding of the counts. The size of a term in them is
//! estimated too small, and other terms take up what is left ([`ModelFit::with_noisier_rates`]). A term of
//! whose information rounding makes more than a share is not resolved by these encoders, and is not tested.

use estimation::ModelFit;
use model_term::TermParameter;
use nalgebra::DMatrix;

use crate::candidates::candidate::Candidate;
use crate::fits::scan::{Scored, prior_scaled, scan_parts_of};
use crate::settings::SEARCH;

/// Which of candidates that were tested beside a fit's own the encoders do not resolve. Of all measurements:
/// the motion by which an effect shows is in those that it makes outliers.
pub(crate) fn unresolved(fit: &ModelFit<'_>, chosen: &[Candidate], scored: &[Scored]) -> Vec<Candidate> {
    let open = if fit.solution.pass.outliers.is_empty() { None } else { Some(fit.evaluated_ungated()) };
    let Some(noisier) = open.as_ref().unwrap_or(fit).with_noisier_rates() else { return Vec::new() };
    let detectable: Vec<&Scored> = scored.iter().filter(|scored| scored.dimensions > 0).collect();
    let parts: Vec<&[Candidate]> = detectable.iter().map(|scored| std::slice::from_ref(&scored.candidate)).collect();
    let informations = |fit| scan_parts_of(fit, chosen, &parts, |_, projected, _| projected.information.clone());
    let own = open.as_ref().map_or_else(|| detectable.iter().map(|of| of.information.clone()).collect(), informations);
    let with_noise = informations(&noisier);
    let is_unresolved = |(scored, (own, noisier)): &(&Scored, (DMatrix<f64>, DMatrix<f64>))| {
        reliability(&scored.parameters, own, noisier) < SEARCH.min_reliability
    };
    let of = detectable.into_iter().zip(own.into_iter().zip(with_noise)).filter(is_unresolved);
    of.map(|(scored, _)| scored.candidate.clone()).collect()
}

/// Share of the motion in a candidate's information, by that under noise added once more: of all directions
/// in which it is detectable together. Negative where the noise is more than the motion.
fn reliability(parameters: &[TermParameter], own: &DMatrix<f64>, noisier: &DMatrix<f64>) -> f64 {
    let eigen = prior_scaled(own, parameters).symmetric_eigen();
    let noisier = prior_scaled(noisier, parameters);
    let directions = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter());
    let (own, with_noise) = directions
        .filter(|(value, _)| **value >= SEARCH.min_detectable_sigmas * SEARCH.min_detectable_sigmas)
        .fold((0.0, 0.0), |(own, with_noise), (value, direction)| {
            (own + value, with_noise + direction.dot(&(&noisier * direction)))
        });
    if own > 0.0 { 2.0 - with_noise / own } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reliability_is_the_share_of_the_motion() {
        let parameter = |prior_sigma: f64| TermParameter { name: "a", unit: "1", prior_sigma };
        let of = |prior_sigma: [f64; 2], own: [f64; 4], noisier: [f64; 4]| {
            let of = |values: &[f64]| DMatrix::from_row_slice(2, 2, values);
            reliability(&prior_sigma.map(parameter), &of(&own), &of(&noisier))
        };
        let none = |value: f64| [value, 0.0, 0.0, value];
        // Motion of 30 and noise of 10, which once more makes 50: ¾.
        assert!((of([1.0; 2], none(40.0), none(50.0)) - 0.75).abs() < 1e-12);
        // More noise than motion: 10 and 30, 70 with it once more.
        assert!((of([1.0; 2], none(40.0), none(70.0)) - 0.25).abs() < 1e-12);
        // A direction that is not detectable does not count, whatever its noise.
        assert!((of([1.0, 1e-3], none(40.0), [50.0, 0.0, 0.0, 4e6]) - 0.75).abs() < 1e-12);
        // Nor what stands off the directions' own: cross terms alone.
        assert!((of([1.0; 2], [40.0, 0.0, 0.0, 20.0], [50.0, 7.0, 7.0, 25.0]) - 0.75).abs() < 1e-12);
    }
}
