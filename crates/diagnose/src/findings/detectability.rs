//! What is not detectable in these data, and the detection limits of everything else.
//!
//! A size is detected with probability 0.9 at a false-positive rate of 1e-3 when √λ = 4.57. The test is a
//! score test; λ = size² of the projected information.

use crate::candidates::candidate::Candidate;
use crate::document::{Blind, Smallest};
use crate::findings::alternatives::NOT_RESOLVED;
use crate::fits::augmented_model::AugmentedModel;
use crate::fits::fit_cache::FitCache;
use crate::settings::{LEVELS, SEARCH};

/// Detection limit of every candidate beside a model; second, the candidates whose limit is above a
/// plausible size.
pub(crate) fn detectability(
    model: &AugmentedModel<'_>,
    catalogue: &[Candidate],
    known: &mut FitCache<'_>,
) -> (Vec<Blind>, Vec<Blind>) {
    let mut best: Vec<(Blind, f64)> = Vec::new();
    for scored in known.beside(model, catalogue) {
        let id = scored.candidate.id();
        // The parameter with the lowest detection limit in prior standard deviations, the others fixed.
        let smallest = scored
            .parameters
            .iter()
            .enumerate()
            .map(|(k, parameter)| {
                (parameter, LEVELS.detection_sqrt_lambda / scored.information[(k, k)].max(0.0).sqrt())
            })
            .filter(|(_, size)| size.is_finite())
            .min_by(|a, b| (a.1 / a.0.prior_sigma).total_cmp(&(b.1 / b.0.prior_sigma)));
        let entry = match smallest {
            _ if !scored.resolved => {
                (Blind { id: id.to_owned(), why: NOT_RESOLVED.to_owned(), smallest_detectable: None }, f64::INFINITY)
            }
            // A million times what would be large is rounding, not information.
            Some((parameter, size)) if size < SEARCH.max_detection_limit_prior_sigmas * parameter.prior_sigma => {
                // A ratio has no unit in print.
                let unit = if parameter.unit == "1" { String::new() } else { format!(" {}", parameter.unit) };
                let why = if size > parameter.prior_sigma {
                    format!(
                        "these runs hardly excite it: {} is detected from {size:.2e}{unit} on, and {:.1e} is large already",
                        parameter.name, parameter.prior_sigma
                    )
                } else {
                    format!("{} is detected from {size:.2e}{unit} on", parameter.name)
                };
                let smallest =
                    Smallest { value: size, unit: parameter.unit.to_owned(), parameter: parameter.name.to_owned() };
                (Blind { id: id.to_owned(), why, smallest_detectable: Some(smallest) }, size / parameter.prior_sigma)
            }
            _ => {
                let why = "no run excites it, or the calibration itself takes it up".to_owned();
                (Blind { id: id.to_owned(), why, smallest_detectable: None }, f64::INFINITY)
            }
        };
        match best.iter_mut().find(|(detectability, _)| detectability.id == id) {
            Some(known) if entry.1 < known.1 => *known = entry,
            Some(_) => {}
            None => best.push(entry),
        }
    }
    let detectability =
        best.iter().filter(|(_, size)| *size > 1.0).map(|(detectability, _)| detectability.clone()).collect();
    (best.into_iter().map(|(detectability, _)| detectability).collect(), detectability)
}
