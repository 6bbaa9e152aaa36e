//! Planar kinematics of a differential drive: poses, the drive geometry, dead reckoning and its covariance.
//!
//! Everything here is pure arithmetic on SI quantities in right-handed frames (x forward, y left,
//! counter-clockwise positive; REP 103). Frames stand in names, so that products read like dominoes:
//! `world_from_body * body_from_marker`.
//!
//! | symbol of the paper | here |
//! | --- | --- |
//! | `ΔS`, `Δθ` (eq. 1, 2) | [`Increment::distance_m`], [`Increment::turn_rad`] |
//! | `C` (mm/pulse) | metres per count, [`DriveGeometry::m_per_count`] |
//! | `d`, `B` | [`DriveGeometry::wheel_separation_m`], nominal or effective |
//! | `S_L`, `S_R` | [`Wheels`] of metres |
//! | eq. 3 | [`Rule::Midpoint`] |
//!
//! Source: Navarro, Benet, Ríos, Bueno, "Mejoras en la localización odométrica de un robot diferencial
//! mediante la corrección de errores sistemáticos".

mod angle;
mod covariance;
mod dead_reckoning;
mod drive;
mod elementary;
mod instruction_set;
mod pose;
mod prefetch;
mod trajectory;
mod trig;
mod wheels;
mod whole_log;

pub use angle::{sinc_derivative, unwrap_near, wrap_to_pi};
pub use covariance::{BridgeCovariance, OdometryCovariance, WheelNoise};
pub use dead_reckoning::{Count, DeadReckoning, Odometry, Rule};
pub use drive::{DriveGeometry, GeometryError, Increment, Twist};
pub use elementary::{BranchFree, Branching, Elementary, Formula, by_lanes};
pub use instruction_set::{InstructionSet, Kernel};
pub use pose::{Frame, Point, Pose, Rotation};
pub use trig::{atan2, sin_cos, sinc};
pub use wheels::{Side, Wheels};
