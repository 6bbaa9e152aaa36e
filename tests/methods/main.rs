//! The calibration methods: each gives a known robot back, none beats the Cramér–Rao bound, published results
//! come out, and real robots are calibrated.

mod all_methods;
mod closed_form;
mod cramer_rao;
mod fleet_campaign;
mod invariances;
mod joint;
mod khepera_logs;
mod one_step;
mod partial_optiodom;
mod published_optiodom;
mod skid_steer;
#[path = "../support/mod.rs"]
mod support;
mod with_sensor;
