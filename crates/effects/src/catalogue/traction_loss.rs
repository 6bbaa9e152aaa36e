//! `traction_loss`: a wheel that is accelerated harder than the floor can hold slides until it is caught.
//!
//! Model: the contact sticks while the acceleration stays under μ_s g; then it slides with Stribeck friction
//! μ(u) = μ_k + (μ_s − μ_k) exp(−|u|/u_s) of the sliding speed u, until the speeds meet. Signature: a one-sided heavy tail of e_dx above some |a|.
//! Observability: hard starts and stops. Alias: `bumps`. Reference: Stribeck friction, Armstrong-Hélouvry et al. 1994.

use kinematics::{Side, Wheels};
use serde::{Deserialize, Serialize};

use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, Step};
use crate::hypothesis::{Hypothesis, Sign, size};

/// Standard gravity, m/s² (CGPM 1901).
const GRAVITY_M_S2: f64 = 9.806_65;

/// Friction between tread and floor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TractionLoss {
    /// Static friction coefficient times the driven wheel's share of what it must push (μ_s).
    pub static_friction: f64,
    /// The same when sliding fast (μ_k).
    pub kinetic_friction: f64,
    /// Sliding speed at which friction has fallen by 1/e of the way (u_s), m/s.
    pub stribeck_speed_m_s: f64,
}

impl PhysicalEffect for TractionLoss {
    fn check(&self) -> Result<(), EffectError> {
        let id = "traction_loss";
        let positive = |parameter, value: f64| {
            EffectError::unless(value.is_finite() && value > 0.0, id, parameter, value, "positive")
        };
        positive("static_friction", self.static_friction)?;
        positive("stribeck_speed_m_s", self.stribeck_speed_m_s)?;
        let holds = self.kinetic_friction > 0.0 && self.kinetic_friction <= self.static_friction;
        EffectError::unless(
            holds,
            id,
            "kinetic_friction",
            self.kinetic_friction,
            "positive and at most static_friction",
        )
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { size: *self, ground_m_s: Wheels::both(0.0), sliding: Wheels::both(false) }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Scatter(&[Sign::WayJumps, Sign::HeadingJumps])
    }

    fn of_sizes(sizes: &[(&str, f64)]) -> Option<Self> {
        Some(Self {
            static_friction: size(sizes, "static_friction")?,
            kinetic_friction: size(sizes, "kinetic_friction")?,
            stribeck_speed_m_s: size(sizes, "stribeck_speed_m_s")?,
        })
    }
}

struct State {
    size: TractionLoss,
    ground_m_s: Wheels<f64>,
    sliding: Wheels<bool>,
}

impl State {
    fn held_m_s2(&self, sliding_m_s: f64) -> f64 {
        let TractionLoss { static_friction, kinetic_friction, stribeck_speed_m_s } = self.size;
        let excess = (static_friction - kinetic_friction) * (-sliding_m_s.abs() / stribeck_speed_m_s).exp();
        GRAVITY_M_S2 * (kinetic_friction + excess)
    }
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { start_motion: true, floor: true, ..Hooks::NONE }
    }

    fn start_motion(&mut self) {
        self.ground_m_s = Wheels::both(0.0);
        self.sliding = Wheels::both(false);
    }

    fn floor(&mut self, step: &mut Step) {
        let (speed_m_s, acceleration_m_s2) = (step.contact_speed_m_s(), step.contact_acceleration_m_s2());
        for side in Side::BOTH {
            let before_m_s = self.ground_m_s[side];
            if !self.sliding[side] {
                if acceleration_m_s2[side].abs() <= GRAVITY_M_S2 * self.size.static_friction {
                    self.ground_m_s[side] = speed_m_s[side];
                    continue;
                }
                self.sliding[side] = true;
            }
            let gap_m_s = speed_m_s[side] - before_m_s;
            let gain_m_s = self.held_m_s2(gap_m_s) * step.dt_s;
            if gap_m_s.abs() <= gain_m_s {
                self.ground_m_s[side] = speed_m_s[side];
                self.sliding[side] = false;
            } else {
                self.ground_m_s[side] = before_m_s + gain_m_s * gap_m_s.signum();
            }
            // While sliding the ground passes at the contact's own speed and not at the tread's.
            step.travel_m[side] = 0.5 * (before_m_s + self.ground_m_s[side]) * step.dt_s;
        }
    }

    fn needs_stepping(&self) -> Option<&'static str> {
        Some("sliding is a transient")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::specimen_step;

    /// Ground travel of the left wheel over a start at `acceleration_m_s2` to 0.4 m/s and 0.3 s of cruise, and the tread's.
    fn start(acceleration_m_s2: f64) -> (f64, f64) {
        let mut state = TractionLoss { static_friction: 0.1, kinetic_friction: 0.06, stribeck_speed_m_s: 0.05 }
            .forward()
            .expect("acts");
        state.start_motion();
        let (mut speed_m_s, mut ground_m, mut tread_m, dt_s) = (0.0_f64, 0.0, 0.0, 1e-4);
        let ramp_s = 0.4 / acceleration_m_s2;
        for k in 0..((ramp_s + 0.9) / dt_s) as u32 {
            let a_m_s2 = if f64::from(k) * dt_s < ramp_s { acceleration_m_s2 } else { 0.0 };
            let mut step = specimen_step();
            step.dt_s = dt_s;
            step.travel_m.left = (speed_m_s + 0.5 * a_m_s2 * dt_s) * dt_s;
            tread_m += step.travel_m.left;
            speed_m_s += a_m_s2 * dt_s;
            step.rate_rad_s.left = speed_m_s / 0.08;
            step.acceleration_rad_s2.left = a_m_s2 / 0.08;
            state.floor(&mut step);
            ground_m += step.travel_m.left;
        }
        (ground_m, tread_m)
    }

    #[test]
    fn a_gentle_start_holds_and_a_hard_one_loses_ground() {
        let (ground_m, tread_m) = start(0.5);
        assert!((ground_m - tread_m).abs() < 1e-12, "0.5 m/s² is under 0.1 g");
        let (ground_m, tread_m) = start(3.0);
        // Between the loss under μ_s throughout and under μ_k throughout: v²/2·(1/a_held − 1/a).
        let loss = |held_m_s2: f64| 0.08 * (1.0 / held_m_s2 - 1.0 / 3.0);
        let lost_m = tread_m - ground_m;
        assert!(lost_m > loss(0.1 * GRAVITY_M_S2) && lost_m < loss(0.06 * GRAVITY_M_S2), "{lost_m}");
    }
}
