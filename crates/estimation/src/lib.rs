//! Maximum-likelihood estimation of a differential drive from whole runs: the likelihood, the fit, augmented
//! models and predicted information.
//!
//! State: the robot's pose in the room. Motion between two measurements: exact arcs from the counts with the
//! geometry in force, plus mean terms; noise k² per metre that a wheel rolls and a variance per radian
//! turned. A measurement: the pose through the instrument's extrinsics, late by its latency, with white
//! noise. Start poses are free: a run begins at its first measurement. The innovations' derivatives by every
//! mean parameter give, run by run, a normal equation ([`NormalEquations`]): estimates, score tests, refits
//! and held-out scores are linear algebra on these.
//!
//! The noise is a nuisance of the mean and not the other way round: its size is estimated, but the geometry
//! is never moved to make a covariance fit (mean-only information). A wrong noise model on 10⁵ measurements
//! would outvote the mean.
//! Reference: Schweppe 1965 (likelihood from innovations); de Jong 1991 (diffuse starts); Gupta & Mehra 1974
//! (scoring); Chong & Kleeman 1997 (k²|s|).

mod acceleration;
mod covariances;
mod dead_reckoned_ends;
mod decimation;
mod derivatives;
mod drive_statistics;
mod error;
mod filter;
mod filter_state;
mod group_extrinsics;
mod innovation;
mod kinematic_samples;
mod layout;
mod log_dead_reckoning;
mod map_functions;
mod maximum_likelihood;
mod model;
mod model_fit;
mod noise;
mod noise_score;
mod noise_shape;
mod noisy_rates;
mod normal_equations;
mod nuisances;
mod one_step;
mod optimizer;
mod parameter_covariance;
mod partial_filter;
mod partial_noise;
mod partial_observation;
mod partial_outliers;
mod partial_poses;
mod partial_records;
mod parts;
mod pass;
mod pass_options;
mod path_shape;
mod poses_between_rows;
mod predicted_information;
mod products;
mod profile;
mod propagation;
mod quantum;
mod rate_noise;
mod rate_rounding;
mod recorded_rates;
mod records;
mod resimulation;
mod rounding;
mod segment;
mod segment_record;
mod sensor_heading;
mod sensor_position;
pub mod settings;
mod start;
mod stated_wheels;
mod step_control;
mod systematic_errors;
#[cfg(test)]
mod tests;
mod thinned_fit;
mod thinning;
mod timing_noise;
mod wall_start;
mod wheel_angles;
mod wheel_rates;

pub use dead_reckoned_ends::EndError;
pub use drive_statistics::DriveStatistics;
pub use error::{EstimationError, WrappedCounter, refuse_wrapped_counters};
pub use innovation::InnovationComponent;
pub use kinematic_samples::KinematicSample;
pub use log_dead_reckoning::{LogDeadReckoning, LogPose};
pub use maximum_likelihood::FitSettings;
pub use model::{Column, GroupExtrinsics, Grouping, Instrument, Model};
pub use model_fit::ModelFit;
pub use noise::{Noise, NoiseComponent};
pub use normal_equations::{
    ClusterRobust, Information, NormalEquations, Projected, SchurComplement, free_basis, inverse, total,
};
pub use one_step::{LargeFit, OneStep, OneStepError, fit_large, is_large, many_rows, rows_and_measurements};
pub use optimizer::{ConvergenceCriterion, FitOptions, Solution, fit, pass_with_innovations};
pub use partial_outliers::PartialOutliers;
pub use parts::{Part, over_parts};
pub use pass::Pass;
pub use pass_options::OutlierGate;
pub use path_shape::PathShape;
pub use records::Records;
pub use segment::Segment;
pub use settings::{LARGE_ROWS, RIDGE, RISE_95, WHITENESS_Z};
pub use thinning::{Selection, Thinning};
pub use wheel_angles::WheelAngleInterpolator;
pub use wheel_rates::stamp_jitter_s;
