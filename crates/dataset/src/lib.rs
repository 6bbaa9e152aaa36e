//! What a robot measured and the protocols it drives: the vocabulary that calibrators and the simulator
//! share.
//!
//! A [`Dataset`] holds one robot's runs: what it counted ([`Odometry`]) and what an outside instrument saw of
//! it (poses, displacements, marked points or wheel speeds). Estimators take borrowed views ([`Session`],
//! [`RunView`]), so that a subset of the runs costs nothing.

mod angle_counts;
mod checked;
mod column_names;
mod column_words;
mod corrections;
mod counted;
mod counter;
#[cfg(test)]
mod draws;
mod error;
mod fingerprint;
mod gyro_beside_poses;
mod identity;
pub mod import;
mod imported;
mod interval_means;
mod lateness;
mod map_distortion;
mod measurement_times;
mod name_units;
mod order_statistics;
mod packets;
mod partial;
mod pose_covariance;
mod prefetch;
mod protocols;
mod quaternion;
mod read;
mod read_times;
mod receipt_delays;
mod record;
mod recorded_step;
mod replicates;
mod retained_rows;
mod row_lengths;
mod row_numbers;
mod run_motion;
mod sampling_period;
mod session;
pub mod settings;
mod standstills;
mod table;
mod timestamps;
mod unit;
mod unknown_motion;
mod warning;
mod wheel_angles;
mod write;

pub use angle_counts::quantum_of_angles;
pub use checked::{Checked, NotNegative, Number, OutOfRange, Positive, Share, checked};
pub use column_names::Quantity;
pub use counter::{suspected_spike, suspected_wrap, wrap_warnings};
pub use error::DatasetError;
pub use identity::{parse_recorded, parse_robot_id};
pub use interval_means::interval_means;
pub use jiff::Timestamp;
pub use map_distortion::MapDistortion;
pub use measurement_times::RunSpans;
pub use order_statistics::{median, quantile};
pub use packets::rows_per_packet;
pub use partial::{GyroNoise, GyroSample, HeadingReading, LidarExtrinsics, Revisit, TapeDistance, WallReading};
pub use pose_covariance::PoseCovariance;
pub use prefetch::read_ahead;
pub use protocols::recognise_protocols;
pub use quaternion::Quaternion;
pub use read::{Blocks, Loaded, RunByRun, read};
pub use receipt_delays::has_bunched_rows;
pub use record::{
    CovarianceScale, Dataset, Displacement, ExtraChannel, MarkedPoint, NominalRobot, Odometry, PointReading, Protocol,
    ProtocolSettings, Provenance, Run, RunInfo, TruthNoise, TruthSample, TruthSigma, WheelLog, WheelSpeed,
};
pub use replicates::{LANES, ReplicatedReading, ReplicatedRun, Replicates};
pub use row_lengths::row_jitter_s;
pub use sampling_period::SamplingPeriod;
pub use session::{RunView, Session, fit_rigid, fit_two_points};
pub use settings::{MAX_ROW_S, MIN_LIDAR_TURN_RAD, USUAL_COUNTER_BITS};
pub use standstills::moving_pieces;
pub use timestamps::Timestamps;
pub use unit::Unit;
pub use unknown_motion::{RestoredMotion, UnknownMotion};
pub use warning::Warning;
pub use write::{Existing, Writer, check_writable, write, write_with_shift};
