//! What a calibrated model gets wrong: residuals → findings and their causes → the extended model → the
//! gain on held-out runs.
//!
//! Order: record faults by likelihood; a base fit; a score scan over the catalogue's mean terms, with base
//! and nuisances projected out; refits of the rivals; tests of the residuals; noise effects by failed
//! tests; sparse terms where residuals are not explained; the gain on held-out runs. It depends on the
//! measured records and the hypotheses of [`effects`] alone, never on what a simulator hid.
//! docs/diagnose.md says what the numbers mean.

mod candidates;
mod carry_over;
mod checks;
mod diagnosis;
mod document;
mod findings;
mod fits;
mod gain;
mod options;
mod plan;
mod records;
mod report;
mod search;
pub mod settings;
mod stage;
mod text;

#[cfg(test)]
mod small_robot;
#[cfg(test)]
mod tests;

pub use checks::residuals::{Bin, Component, Profile, Residuals, ResidualsByCovariate};
pub use diagnosis::{DiagnoseError, diagnose};
pub use document::{
    Blind, CandidateCause, Check, Compared, Differences, Document, Drift, Finding, Gain, GainLevel, HeldOutDrift,
    HeldOutUnit, LevelGain, NestedGain, NextExperiment, PlannedSession, Predicted, RowFault, Smallest, Subsample,
    UnlistedTerm, Value, Verdict,
};
pub use findings::alternatives::{Alternative, Status};
pub use gain::extended_model::{ExtendedModel, ExtendedModelError, ModelledEffect};
pub use gain::nested_gain::nested_gains;
pub use options::Options;
pub use plan::{HANDLING_S, Limits, MINUTES, PlanError, ScenarioPlan, moved_over_m, plan_scenario};
pub use records::large_log::LargeLog;
pub use records::log::Log;
pub use report::{Diagnosis, FittedModel};
pub use search::beam::ComparedModel;
pub use search::rivals::Refusal;
pub use settings::levels::CHECKS_LEVEL;
pub use stage::{OnStage, Stage};
