//! The simulation model and the estimation model of an effect are written apart; here they meet, on recorded
//! data.
//!
//! A robot without any other imperfection or noise drives with the effect and is watched exactly. With the
//! mean terms at the effect's sizes, what the counts predict is what was seen; at another size or with one
//! sign changed it is not. Gross faults: some rewriting of the faulty records is the faultless log.

mod faults;
mod means;
mod scatter;
mod terms;
mod variants;
pub(crate) mod watched;
