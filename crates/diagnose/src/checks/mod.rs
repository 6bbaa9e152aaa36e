//! Tests of what a model leaves: dependence, whiteness, outliers, scatter of turns.

pub(crate) mod check;
pub(crate) mod covariate_tests;
pub(crate) mod errors_at_rest;
pub(crate) mod large_errors;
pub(crate) mod outlier_attribution;
pub(crate) mod residual_tests;
pub(crate) mod residuals;
pub(crate) mod run_to_run;
pub(crate) mod turn_to_turn;
