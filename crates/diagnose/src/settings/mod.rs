//! Every level, margin, tolerance, limit and count of the diagnosis, by stage.
//!
//! A comment says the unit, the meaning and, in its last sentence, the source: *Derived* from an equation,
//! *Budgeted* of an error budget, *Tuned* on something, or a *Convention*. docs/settings.md is made of
//! these files.

pub(crate) mod beam;
pub(crate) mod carry_over;
pub(crate) mod findings;
pub(crate) mod large_log;
pub(crate) mod levels;
pub(crate) mod plan;
pub(crate) mod records;
pub(crate) mod residuals;
pub(crate) mod search;
