//! The state-space likelihood of whole runs: dead reckoning predicts, whatever the instrument saw corrects, and every parameter's effect is carried along.
//!
//! State: the robot's pose in the room. Motion between two looks: exact arcs from the counts with the lengths in force, plus mean terms; noise k² per metre that
//! a wheel rolls and a variance per radian turned. A look: the pose through the instrument's mounting, late by its latency, with white noise. Start poses are
//! free: a run begins at its first look. The innovations' derivatives by every mean parameter give, run by run, a normal equation ([`Evidence`]): estimates,
//! score tests, refits and held-out scores are linear algebra on these.
//!
//! The noise is a nuisance of the mean and not the other way round: its size is estimated, but the lengths are never moved to make a covariance fit
//! (mean-only information). A wrong noise model on 10⁵ looks would outvote the mean.
//! Reference: Schweppe 1965 (likelihood from innovations); de Jong 1991 (diffuse starts); Gupta & Mehra 1974 (scoring); Chong & Kleeman 1997 (k²|s|).

mod acceleration;
mod apart;
mod coarse;
mod covariances;
mod derivatives;
mod evidence;
mod filter;
mod fit;
mod model;
mod noise;
mod normal;
mod pass;
mod records;
#[cfg(test)]
mod tests;
mod thinning;

pub use apart::{Apart, Instrument, Own};
pub(crate) use coarse::Coarse;
pub(crate) use evidence::total;
pub use evidence::{Evidence, Information};
pub use filter::Innovation;
pub(crate) use filter::{Gate, Want};
pub use fit::{Ends, Fit, FitError, FitOptions, fit, pass_with_innovations};
pub(crate) use fit::{From, NOISE_SETTLED, basis, fit_from, pass_settled, start_heading};
pub use model::{Column, Model};
pub(crate) use noise::{LEAST_SIGMA, NoisePrior};
pub use noise::{Noise, NoiseComponent};
pub use pass::Pass;
pub(crate) use pass::pass;
pub use records::{Chain, Records};
pub(crate) use records::{Piece, Seen};
pub use thinning::{Selection, Thinning};
