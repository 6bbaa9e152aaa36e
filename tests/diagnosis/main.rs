//! Diagnosis of simulated robots: hidden effects are found and named, nulls are left alone, and planned runs
//! tell names apart.

mod blind_benchmark;
mod calibrated_ordinary_logs;
mod coarse_encoders;
mod extended_model;
mod hidden_effects;
mod large_log;
mod mixed_logs;
#[path = "../support/motion_capture.rs"]
mod motion_capture;
mod nested_gain;
mod ordinary_kinds;
mod ordinary_logs;
mod plan;
mod record_faults;
mod report;
#[path = "../support/mod.rs"]
mod support;
