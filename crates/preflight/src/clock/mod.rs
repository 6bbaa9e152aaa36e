//! The clock of an instrument against that of the log: an offset, a rate, and runs that have another.
//!
//! Each run has a profile likelihood of its offset (`profile`). An offset that grows with the time since a
//! run's start, or since the session's, is a rate (`drift`); the mean of the runs' offsets is that of all,
//! and a run far off it has a clock of its own (`offsets`).

mod drift;
#[cfg(test)]
mod driven_runs;
pub(crate) mod model;
mod offsets;
mod profile;
mod search;
mod searched_run;

pub use drift::ClockDrift;
pub use model::Clock;
pub use offsets::{ClockOffset, ClockOffsets, SessionClock};
pub use search::ClockSearch;
