//! `wheel_eccentricity`: a wheel turns about a point beside its centre.
//!
//! Model: rolling radius r(φ) = r (1 + ε sin(φ + φ₀)). Signature: e_dx and e_dθ locked to that wheel's phase, zero over whole turns.
//! Observability: phase continuity and more than two samples a turn. Alias: `encoder_cycle` with one cycle a turn, exactly.
//! Reference: geometry of a circular wheel on an offset axis, to first order in the offset.

use kinematics::{Side, sinc};
use serde::{Deserialize, Serialize};

use crate::effect::{EffectError, PhysicalEffect, Which};
use crate::forward::{Forward, Step};
use crate::hypothesis::Hypothesis;

/// Eccentricity of one wheel or of both.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WheelEccentricity {
    /// Which wheels are eccentric.
    pub wheel: Which,
    /// Offset of the axis over the radius (ε).
    pub amplitude: f64,
    /// Phase at wheel angle zero (φ₀), radians.
    pub phase_rad: f64,
}

impl PhysicalEffect for WheelEccentricity {
    fn check(&self) -> Result<(), EffectError> {
        let holds = self.amplitude >= 0.0 && self.amplitude < 1.0;
        EffectError::unless(holds, "wheel_eccentricity", "amplitude", self.amplitude, "in [0, 1)")?;
        EffectError::unless(self.phase_rad.is_finite(), "wheel_eccentricity", "phase_rad", self.phase_rad, "finite")
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { size: *self }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Silent
    }
}

struct State {
    size: WheelEccentricity,
}

impl Forward for State {
    /// The mean radius over the step, exactly: ∫sin over [φ, φ+Δ] is Δ·sin(φ+Δ/2)·sinc(Δ/2).
    fn wheel(&mut self, step: &mut Step) {
        for side in Side::BOTH {
            if self.size.wheel.includes(side) {
                let half_rad = 0.5 * step.wheel_rad[side];
                let mean_sine = (step.wheel_angle_rad[side] + half_rad + self.size.phase_rad).sin() * sinc(half_rad);
                step.radius_m[side] *= 1.0 + self.size.amplitude * mean_sine;
            }
        }
    }

    fn needs_stepping(&self) -> Option<&'static str> {
        Some("the path bends within a wheel turn")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::specimen_step;
    use std::f64::consts::TAU;

    fn travel_m(from_rad: f64, turn_rad: f64, parts: u32) -> f64 {
        let mut state = State { size: WheelEccentricity { wheel: Which::Right, amplitude: 0.01, phase_rad: 0.4 } };
        let part_rad = turn_rad / f64::from(parts);
        (0..parts)
            .map(|part| {
                let mut step = specimen_step();
                step.wheel_angle_rad.right = from_rad + f64::from(part) * part_rad;
                step.wheel_rad.right = part_rad;
                state.wheel(&mut step);
                step.radius_m.right * step.wheel_rad.right
            })
            .sum()
    }

    #[test]
    fn a_whole_turn_rolls_the_mean_radius_and_a_half_turn_does_not() {
        let radius_m = specimen_step().radius_m.right;
        assert!((travel_m(0.3, TAU, 1) - TAU * radius_m).abs() < 1e-15);
        let half_m = travel_m(-0.4, TAU / 2.0, 1);
        // ∫₀^π (1 + ε sin φ) dφ = π + 2ε
        assert!((half_m - radius_m * (TAU / 2.0 + 0.02)).abs() < 1e-15);
    }

    #[test]
    fn cutting_the_turn_changes_nothing() {
        assert!((travel_m(1.0, 2.0, 1) - travel_m(1.0, 2.0, 37)).abs() < 1e-15);
    }
}
