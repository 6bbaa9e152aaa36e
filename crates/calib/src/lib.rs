//! Calibration of a differential drive's odometry: one file a method in `methods/`, behind the trait
//! [`Method`].
//!
//! A method takes borrowed sessions of one robot. It returns values with covariance, what it rejected and
//! what is not observable. The crate links neither the simulator nor the effects: what a method is not given,
//! it cannot read. Adding a method is one new file and its line in [`methods::METHODS`].

mod alignment;
mod compare;
mod conditioning;
mod dead_reckoning_jacobian;
mod drift;
mod drive;
mod estimate;
mod evaluated_instrument;
mod log_check;
mod named_calibration;
mod path_covariance;
mod pose_error;
mod pose_measurements;
mod pose_pairs;
mod report;
mod robust;
mod robust_lanes;
mod settings;
mod starts_by;
mod stated;
mod trained_on;
mod trajectory;
mod turn_loss;
mod withheld;
mod without_start;

pub mod methods;

pub use alignment::Alignment;
pub use compare::{
    ComparedMethod, ComparedSession, Comparison, KindMean, Pair, Refusal, TooFewSessions, compare, path_kind,
};
pub use drift::{
    CalibrationDrift, EvaluationOptions, RunDrift, evaluate, evaluate_path, evaluate_runs, evaluate_runs_and_paths,
};
pub use drive::{DriveError, drive_and_calibrate};
pub use estimate::{
    CalibError, Calibration, Covariance, Estimate, Extrinsics, GroupInstrument, Method, NotObservable, OdometryNoise,
    Parameter, Rejected,
};
pub use evaluated_instrument::{EvaluatedInstrument, with_instrument};
pub use log_check::check_and_fit;
pub use methods::{METHODS, method};
pub use named_calibration::NamedCalibration;
pub use path_covariance::path_covariances;
pub use pose_error::{
    ErrorStatistics, PoseErrorOptions, PoseErrorStatistics, PoseErrors, absolute_pose_errors, relative_pose_errors,
};
pub use pose_pairs::{Delta, DeltaUnit};
pub use report::{
    CalibrationReport, MethodReport, Names, ReportError, ReportedBlindness, ReportedRejection, ReportedValue,
};
pub use robust::{MedianMad, Summary};
pub use starts_by::StartsBy;
pub use stated::nominal_value;
pub use trained_on::TrainedOn;
pub use trajectory::{AugmentedCalibration, CorrectedRun, RunPath, corrected_run};
