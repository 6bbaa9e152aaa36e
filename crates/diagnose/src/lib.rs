//! What a calibrated model gets wrong: residuals → findings and their causes → the extended model → the
//! gain on held-out runs.
//!
//! Order: record faults by likelihood; a base fit; a score scan over the catalogue's mean terms, with base
//! and nuisances projected out; refits of the rivals; tests of the residuals; noise effects by failed
//! tests; sparse terms where residuals are not explained; the gain on held-out runs. It depends on the
//! measured records and the hypotheses of [`effects`] alone, never on what a simulator hid.
//! docs/diagnose.md says what the numbers mean.

mod alternatives;
mod anomaly_findings;
mod augmented_model;
mod beam;
mod cancellation;
mod candidate;
mod carry_over;
mod cause;
mod check;
mod clock_drift;
mod clock_offsets;
mod clock_profile;
mod contrast;
mod covariate_tests;
mod covariates;
mod detectability;
mod diagnosis;
mod document;
mod errors_at_rest;
mod extended_model;
mod extended_scenario;
mod extrinsics;
mod finding;
mod findings;
mod fit_cache;
mod gain;
mod geometry_deviation;
mod geometry_deviations;
mod heterogeneity;
mod kinds;
mod lack_of_fit;
mod large_errors;
mod large_log;
mod likelihood_ratio;
mod log_rows;
mod mean_lateness;
mod mean_structure;
mod model_comparison;
mod names;
mod nested_gain;
mod noise_effects;
mod null_distribution;
mod outlier_attribution;
mod part_of_runs;
mod physical;
mod plan;
mod pose_windows;
mod profile;
mod ranking;
mod record_faults;
mod reliability;
mod residual_tests;
mod residuals;
mod rivals;
mod run_to_run;
mod same_measurements;
mod scan;
mod selection;
mod settings;
mod sparse_terms;
mod stage;
mod stamp_errors;
mod statistics;
mod systematic_errors;
mod text;
mod turn_to_turn;
mod unknown_motion;
mod wald;

#[cfg(test)]
mod small_robot;
#[cfg(test)]
mod tests;

pub use alternatives::{Alternative, Status};
pub use beam::ComparedModel;
pub use diagnosis::{DiagnoseError, Diagnosis, FittedModel, Options, diagnose, diagnose_large};
pub use document::{
    Blind, CandidateCause, Check, Compared, Differences, Document, Drift, Finding, Gain, GainLevel, HeldOutDrift,
    HeldOutUnit, LevelGain, NestedGain, NextExperiment, PlannedSession, Predicted, RowFault, Smallest, Subsample,
    UnlistedTerm, Value, Verdict,
};
pub use extended_model::{ExtendedModel, ExtendedModelError, ModelledEffect};
pub use large_log::LargeLog;
pub use nested_gain::nested_gains;
pub use plan::{HANDLING_S, Limits, MINUTES, PlanError, ScenarioPlan, moved_over_m, plan_scenario};
pub use residuals::{Bin, Component, Profile, Residuals, ResidualsByCovariate};
pub use rivals::Refusal;
pub use settings::levels::CHECKS_LEVEL;
pub use stage::{OnStage, Stage};
