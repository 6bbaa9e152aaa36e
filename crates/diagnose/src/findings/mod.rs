//! The findings: from what each stage found out to one list, with the doubts on it.

pub(crate) mod alternatives;
pub(crate) mod anomaly_findings;
pub(crate) mod detectability;
pub(crate) mod extrinsics;
pub(crate) mod finding;
pub(crate) mod geometry_deviation;
pub(crate) mod geometry_deviations;
pub(crate) mod lack_of_fit;
pub(crate) mod mean_lateness;
pub(crate) mod noise_effects;
pub(crate) mod stages;
pub(crate) mod systematic_errors;
