//! Fits with candidates, their tests, and models against each other.

pub(crate) mod augmented_model;
pub(crate) mod cancellation;
pub(crate) mod fit_cache;
pub(crate) mod likelihood_ratio;
pub(crate) mod model_comparison;
pub(crate) mod null_distribution;
pub(crate) mod profile;
pub(crate) mod reliability;
pub(crate) mod scan;
pub(crate) mod statistics;
pub(crate) mod wald;
