//! `wheel_mismatch`: the wheels differ in diameter.
//!
//! Model: D_R/D_L = E_d with the mean kept: D_L = 2D/(E_d+1), D_R = 2D/(1/E_d+1).
//! Signature: e_dθ = (E_d−1)v/b.
//! Observability: heading after driving straight.
//! Alias: none on paths that drive in both directions.
//! Reference: Borenstein & Feng 1996, eq. for E_d; Navarro et al., eq. (4): the differential part of α_c.

use kinematics::{DriveGeometry, Wheels};
use serde::{Deserialize, Serialize};

use crate::description::{Description, GeometryRatio};
use crate::effect::{EffectError, PhysicalEffect};
use crate::hypothesis::{Hypothesis, value_of};
use crate::on_board::OnBoard;

/// Ratio of the diameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WheelMismatch {
    /// Right over left diameter, relative to the nominal ratio (E_d).
    pub right_over_left: f64,
}

impl PhysicalEffect for WheelMismatch {
    fn check(&self) -> Result<(), EffectError> {
        let holds = self.right_over_left.is_finite() && self.right_over_left > 0.0;
        EffectError::unless(holds, "wheel_mismatch", "right_over_left", self.right_over_left, "positive")
    }

    fn true_geometry(&self, geometry: DriveGeometry) -> DriveGeometry {
        let ratio = self.right_over_left;
        let diameter_m = geometry.wheel_diameter_m();
        let diameter_m =
            Wheels { left: diameter_m.left * 2.0 / (ratio + 1.0), right: diameter_m.right * 2.0 / (1.0 / ratio + 1.0) };
        DriveGeometry::new(diameter_m, geometry.wheel_separation_m()).unwrap_or(geometry)
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Geometry
    }

    fn description() -> Description {
        Description {
            geometry: Some((GeometryRatio::RightOverLeft, "right_over_left")),
            on_board: OnBoard::Geometry,
            ..Description::of("the wheels differ in diameter")
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        Some(Self { right_over_left: value_of(values, "right_over_left")? })
    }
}
