//! What can be tested: the catalogue's mean terms, sparse terms, and deviations from the form of either, as
//! the likelihood takes them.

use effects::{CATALOGUE, Covariate, Description, Hypothesis, OnBoard, Sparse, hypothesis};
use model_term::{ModelTerm, TermParameter};

use crate::candidates::cause::Cause;

/// A mean term with its variant held.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Candidate {
    /// One of the variants of an effect of the catalogue; between them where `at` says so.
    Effect { id: &'static str, variant: usize, at: Option<f64> },
    /// A product of covariates on one channel.
    Sparse(Sparse),
    /// A deviation from the form of another candidate at its sizes, with a covariate. It is tested, and named
    /// by nothing.
    Deviation { of: Box<Self>, sizes: Vec<f64>, by: Covariate },
}

impl Candidate {
    /// The effect of the catalogue that it is.
    const fn effect(&self) -> Option<&'static str> {
        match self {
            Self::Effect { id, .. } => Some(id),
            Self::Sparse(_) | Self::Deviation { .. } => None,
        }
    }

    /// What is known of the effect of the catalogue that it is.
    fn description(&self) -> Option<Description> {
        effects::description(self.effect()?)
    }

    /// The term, at the start of its life; `None` only for a variant that the catalogue does not have.
    pub(crate) fn term(&self) -> Option<Box<dyn ModelTerm>> {
        match self {
            Self::Effect { id, variant, at } => {
                variants(id).into_iter().nth(*variant).map(|variant| match at.zip(variant.at) {
                    Some((value, at)) => at(value),
                    None => variant.term,
                })
            }
            Self::Sparse(sparse) => Some(sparse.term()),
            Self::Deviation { of, sizes, by } => Some(effects::modulated(of.term()?, sizes.clone(), by.clone())),
        }
    }

    /// The id of the effect, or `unlisted`.
    pub(crate) fn id(&self) -> &'static str {
        self.effect().unwrap_or("unlisted")
    }

    /// It as a cause; of a product its term is not known before it is estimated.
    pub(crate) fn cause(&self) -> Cause {
        self.effect().map_or(Cause::Unknown, Cause::Effect)
    }

    /// Whether both are the same effect of the catalogue, perhaps in two of its variants.
    pub(crate) fn is_variant_of(&self, other: &Self) -> bool {
        matches!((self, other), (Self::Effect { id, .. }, Self::Effect { id: of, .. }) if id == of)
    }

    /// How the records' stamps are without it, where it is in the stamps alone.
    pub(crate) fn restamped(&self) -> Option<effects::Restamped> {
        self.description()?.restamped
    }

    /// Its estimate by counts alone, where it is in the stamps alone.
    pub(crate) fn shown_by_counts(&self) -> Option<effects::ShownByCounts> {
        self.description()?.shown_by_counts
    }

    /// Whether it is of the outside instrument, and no part of the robot's motion.
    pub(crate) fn is_of_instrument(&self) -> bool {
        match self {
            Self::Effect { .. } => {
                self.description().is_some_and(|description| matches!(description.on_board, OnBoard::OfInstrument))
            }
            Self::Sparse(sparse) => sparse.channel.is_of_instrument(),
            Self::Deviation { of, .. } => of.is_of_instrument(),
        }
    }

    /// Whether its form is known exactly: what an instrument and the clocks do is, and what a wheel, a floor
    /// or a castor does is not.
    pub(crate) fn has_exact_form(&self) -> bool {
        self.is_of_instrument() || self.description().is_some_and(|description| description.is_clock_rate)
    }

    /// Whether it is a delay to first order, whatever the robot drives.
    pub(crate) fn is_delay(&self) -> bool {
        self.description().is_some_and(|description| description.is_delay)
    }

    /// Its held variant parameters.
    pub(crate) fn fixed(&self) -> Vec<(&'static str, f64)> {
        match self {
            Self::Effect { id, variant, at } => {
                let mut fixed = variants(id).into_iter().nth(*variant).map(|variant| variant.fixed).unwrap_or_default();
                if let (Some(value), [(_, own)]) = (at, &mut fixed[..]) {
                    *own = *value;
                }
                fixed
            }
            Self::Sparse(_) | Self::Deviation { .. } => Vec::new(),
        }
    }

    /// The values of its variant parameter that the scan tries, where anything between them is as possible.
    pub(crate) fn grid(&self) -> Vec<f64> {
        let Self::Effect { id, .. } = self else { return Vec::new() };
        let variants = variants(id);
        let values =
            variants.iter().filter(|variant| variant.at.is_some()).filter_map(|variant| Some(variant.fixed.first()?.1));
        values.collect()
    }

    /// The same effect with its variant parameter anywhere.
    pub(crate) fn moved_to(&self, value: f64) -> Self {
        match self {
            Self::Effect { id, variant, .. } => Self::Effect { id, variant: *variant, at: Some(value) },
            Self::Sparse(_) | Self::Deviation { .. } => self.clone(),
        }
    }

    pub(crate) fn parameters(&self) -> Vec<TermParameter> {
        self.term().map_or_else(Vec::new, |term| term.parameters().to_vec())
    }
}

/// The terms of candidates, in order.
pub(crate) fn terms(candidates: &[Candidate]) -> Vec<Box<dyn ModelTerm>> {
    candidates.iter().filter_map(Candidate::term).collect()
}

/// The terms of candidates, in order; products that follow each other come as one.
pub(crate) fn batched_terms<'c>(candidates: impl Iterator<Item = &'c Candidate>) -> Vec<Box<dyn ModelTerm>> {
    let product = |candidate: &&Candidate| matches!(candidate, Candidate::Sparse(sparse) if sparse.shares_samples());
    let candidates: Vec<&Candidate> = candidates.collect();
    let of_chunk = |chunk: &[&Candidate]| {
        let sparse = chunk.iter().filter_map(|candidate| match candidate {
            Candidate::Sparse(sparse) => Some(sparse.clone()),
            Candidate::Effect { .. } | Candidate::Deviation { .. } => None,
        });
        if product(&chunk[0]) { Sparse::batched(&sparse.collect::<Vec<_>>()) } else { chunk[0].term() }
    };
    candidates.chunk_by(|a, b| product(a) && product(b)).filter_map(of_chunk).collect()
}

fn variants(id: &str) -> Vec<effects::Variant> {
    hypothesis(id).and_then(Hypothesis::into_variants).unwrap_or_default()
}

/// Every variant of every effect whose hypothesis is a mean term, without those taken out.
pub(crate) fn mean_terms(without: &[String]) -> Vec<Candidate> {
    CATALOGUE
        .iter()
        .filter(|id| !without.iter().any(|out| out == *id))
        .flat_map(|id| (0..variants(id).len()).map(|variant| Candidate::Effect { id, variant, at: None }))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_effect_can_be_left_out() {
        let all = mean_terms(&[]);
        assert!(all.iter().any(|candidate| candidate.id() == "slip_speed"));
        let fewer = mean_terms(&["slip_speed".to_owned()]);
        assert!(fewer.iter().all(|candidate| candidate.id() != "slip_speed") && fewer.len() < all.len());
        assert!(all.iter().all(|candidate| !candidate.parameters().is_empty()));
    }

    #[test]
    fn what_instruments_and_clocks_do_is_of_an_exact_form() {
        let exact: Vec<&str> =
            mean_terms(&[]).iter().filter(|candidate| candidate.has_exact_form()).map(Candidate::id).collect();
        assert!(["clock_rate", "truth_latency", "truth_yaw"].iter().all(|id| exact.contains(id)), "{exact:?}");
        assert!(["slip_speed", "interval_error", "backlash"].iter().all(|id| !exact.contains(id)), "{exact:?}");
    }
}
