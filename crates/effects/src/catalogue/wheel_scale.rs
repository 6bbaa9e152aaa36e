//! `wheel_scale`: both wheels are larger or smaller than nominal, by the same factor.
//!
//! Model: D = scale · D_nominal for both wheels.
//! Signature: e_dx = εv, e_dθ = εω with ε = scale − 1.
//! Observability: any distance measured from outside.
//! Alias: `clock_rate` when speeds are logged; the wheelbase where a robot only spins.
//! Reference: Navarro et al., eq. (4): the common part of α_c; Borenstein & Feng 1996 (who cannot see it on
//! closed squares).

use kinematics::DriveGeometry;
use serde::{Deserialize, Serialize};

use crate::description::{Description, GeometryRatio};
use crate::effect::{EffectError, PhysicalEffect};
use crate::hypothesis::{Hypothesis, value_of};
use crate::on_board::OnBoard;

/// Common factor of both diameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WheelScale {
    /// True over nominal diameter.
    pub scale: f64,
}

impl PhysicalEffect for WheelScale {
    fn check(&self) -> Result<(), EffectError> {
        let holds = self.scale.is_finite() && self.scale > 0.0;
        EffectError::unless(holds, "wheel_scale", "scale", self.scale, "positive")
    }

    fn true_geometry(&self, geometry: DriveGeometry) -> DriveGeometry {
        let diameter_m = geometry.wheel_diameter_m().map(|diameter_m| self.scale * diameter_m);
        DriveGeometry::new(diameter_m, geometry.wheel_separation_m()).unwrap_or(geometry)
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Geometry
    }

    fn description() -> Description {
        Description {
            geometry: Some((GeometryRatio::Wheels, "scale")),
            on_board: OnBoard::Geometry,
            ..Description::of("both wheels are larger or smaller than nominal, by one factor")
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        Some(Self { scale: value_of(values, "scale")? })
    }
}
