//! `wheelbase`: the wheels' contacts are farther apart or closer than nominal.
//!
//! Model: B = ratio · b_nominal (E_b; 1+α_b in the paper).
//! Signature: e_dθ = (1/E_b−1)ω̂.
//! Observability: turns measured from outside.
//! Alias: `wheel_scale` where the robot only spins; `turn_rate_wheelbase` at one yaw rate.
//! Reference: Navarro et al., eq. (10); Borenstein & Feng 1996.

use kinematics::DriveGeometry;
use serde::{Deserialize, Serialize};

use crate::description::{Description, GeometryRatio};
use crate::effect::{EffectError, PhysicalEffect};
use crate::hypothesis::{Hypothesis, value_of};
use crate::on_board::OnBoard;

/// Ratio of the wheelbases.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wheelbase {
    /// Effective over nominal distance between the wheel contacts (E_b).
    pub ratio: f64,
}

impl PhysicalEffect for Wheelbase {
    fn check(&self) -> Result<(), EffectError> {
        EffectError::unless(self.ratio.is_finite() && self.ratio > 0.0, "wheelbase", "ratio", self.ratio, "positive")
    }

    fn true_geometry(&self, geometry: DriveGeometry) -> DriveGeometry {
        DriveGeometry::new(geometry.wheel_diameter_m(), self.ratio * geometry.wheel_separation_m()).unwrap_or(geometry)
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Geometry
    }

    fn description() -> Description {
        Description {
            geometry: Some((GeometryRatio::Separation, "ratio")),
            on_board: OnBoard::Geometry,
            ..Description::of("the effective wheelbase is larger or smaller than nominal")
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        Some(Self { ratio: value_of(values, "ratio")? })
    }
}
