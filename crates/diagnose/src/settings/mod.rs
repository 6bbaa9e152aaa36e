//! Every level, margin, tolerance, limit and count of the diagnosis, by stage.
//!
//! A comment says the unit, the meaning and, in its last sentence, the source: *Derived* from an equation,
//! *Budgeted* of an error budget, *Tuned* on something, or a *Convention*. docs/settings.md is made of
//! these files.

pub mod beam;
pub mod carry_over;
pub mod findings;
pub mod large_log;
pub mod levels;
pub mod plan;
pub mod records;
pub mod residuals;
pub mod search;

rules::rooms! {
    beam: beam::Beam as BEAM,
    carry_over: carry_over::CarryOver as CARRY_OVER,
    findings: findings::Findings as FINDINGS,
    large_log: large_log::LargeLog as LARGE_LOG,
    levels: levels::Levels as LEVELS,
    plan: plan::Plan as PLAN,
    records: records::Records as RECORDS,
    residuals: residuals::Residuals as RESIDUALS,
    search: search::Search as SEARCH,
}
