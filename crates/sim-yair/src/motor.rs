//! A DC motor with gear under voltage control, with friction that really holds.
//!
//! J dω/dt = K i − b ω − τ_c sign(ω), i = (V − K ω)/R. With λ = (K²/R + b)/J, drive a = K V/(R J) and c =
//! τ_c/J the speed while it keeps its sign s is ω(t) = ω∞ + (ω0 − ω∞) e^{−λt}, ω∞ = (a − s c)/λ, and the
//! angle is its integral: both are used exactly, so results do not depend on the step. At standstill the
//! motor stays while |a| ≤ c (breakaway torque = Coulomb torque); a step across zero is split there.
//!
//! Assumptions: no inductance (its time constant is far under a sample), no cogging, no torque ripple; all
//! values at the motor's axis.
//! Reference: the Coulomb-viscous model in Armstrong-Hélouvry, Dupont & Canudas de Wit 1994 (Automatica 30),
//! §2.1.

use scenario::Motor;

use crate::servo_error::ServoError;

/// A motor's motion and the constants that move it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DcMotor {
    /// λ, reciprocal of the mechanical time constant, 1/s.
    decay_rate_1_s: f64,
    /// Acceleration for one volt at standstill, rad/s²/V.
    drive_rad_s2_v: f64,
    /// Deceleration by Coulomb friction, rad/s².
    coulomb_rad_s2: f64,
    rate_rad_s: f64,
    last_step: Decay,
}

/// e^{−λ dt} − 1 of the last step: an engine's steps are mostly alike and `exp_m1` is half of a step's cost.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Decay {
    dt_s: f64,
    minus_one: f64,
}

impl DcMotor {
    /// A motor at rest.
    ///
    /// # Errors
    /// When resistance, torque constant or inertia is not positive, or a friction negative.
    pub(crate) fn new(motor: &Motor) -> Result<Self, ServoError> {
        ServoError::unless_positive("resistance_ohm", motor.resistance_ohm)?;
        ServoError::unless_positive("torque_constant_nm_a", motor.torque_constant_nm_a)?;
        ServoError::unless_positive("inertia_kg_m2", motor.inertia_kg_m2)?;
        ServoError::unless_not_negative("viscous_friction_nm_s", motor.viscous_friction_nm_s)?;
        ServoError::unless_not_negative("coulomb_friction_nm", motor.coulomb_friction_nm)?;
        let torque_per_volt = motor.torque_constant_nm_a / motor.resistance_ohm;
        let damping = torque_per_volt * motor.torque_constant_nm_a + motor.viscous_friction_nm_s;
        Ok(Self {
            decay_rate_1_s: damping / motor.inertia_kg_m2,
            drive_rad_s2_v: torque_per_volt / motor.inertia_kg_m2,
            coulomb_rad_s2: motor.coulomb_friction_nm / motor.inertia_kg_m2,
            rate_rad_s: 0.0,
            last_step: Decay { dt_s: 0.0, minus_one: 0.0 },
        })
    }

    /// Speed of the motor's axis, rad/s.
    #[must_use]
    pub(crate) const fn rate_rad_s(&self) -> f64 {
        self.rate_rad_s
    }

    /// Turns for `dt_s` under a constant voltage and returns the angle turned at the motor's axis, rad.
    pub(crate) fn turn(&mut self, voltage_v: f64, dt_s: f64) -> f64 {
        let drive_rad_s2 = self.drive_rad_s2_v * voltage_v;
        if self.rate_rad_s == 0.0 {
            return self.turn_from_rest(drive_rad_s2, dt_s);
        }
        let sign = self.rate_rad_s.signum();
        let limit_rad_s = (drive_rad_s2 - sign * self.coulomb_rad_s2) / self.decay_rate_1_s;
        if self.last_step.dt_s != dt_s {
            self.last_step = Decay { dt_s, minus_one: (-self.decay_rate_1_s * dt_s).exp_m1() };
        }
        let minus_one = self.last_step.minus_one;
        let above_limit = self.rate_rad_s - limit_rad_s;
        let rate_rad_s = self.rate_rad_s + above_limit * minus_one;
        if rate_rad_s * sign > 0.0 {
            self.rate_rad_s = rate_rad_s;
            return limit_rad_s * dt_s - above_limit * minus_one / self.decay_rate_1_s;
        }
        // ω(t0) = 0: the friction changes sign or holds, so the rest of the step starts from rest.
        let to_rest_s = ((above_limit / -limit_rad_s).ln() / self.decay_rate_1_s).clamp(0.0, dt_s);
        let angle_rad = limit_rad_s * to_rest_s + self.rate_rad_s / self.decay_rate_1_s;
        self.rate_rad_s = 0.0;
        angle_rad + self.turn_from_rest(drive_rad_s2, dt_s - to_rest_s)
    }

    fn turn_from_rest(&mut self, drive_rad_s2: f64, dt_s: f64) -> f64 {
        if drive_rad_s2.abs() <= self.coulomb_rad_s2 {
            return 0.0;
        }
        let limit_rad_s = (drive_rad_s2 - drive_rad_s2.signum() * self.coulomb_rad_s2) / self.decay_rate_1_s;
        let minus_one = (-self.decay_rate_1_s * dt_s).exp_m1();
        self.rate_rad_s = -limit_rad_s * minus_one;
        limit_rad_s * (dt_s + minus_one / self.decay_rate_1_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A 24 V motor near YAIR's, with visible viscous friction.
    const MOTOR: Motor = Motor {
        supply_v: 24.0,
        resistance_ohm: 4.0,
        torque_constant_nm_a: 0.06,
        inertia_kg_m2: 6e-5,
        viscous_friction_nm_s: 1e-5,
        coulomb_friction_nm: 0.01,
    };
    /// Voltage whose stall torque equals the Coulomb torque: τ_c R/K.
    const BREAKAWAY_V: f64 = 0.01 * 4.0 / 0.06;

    fn motor() -> DcMotor {
        DcMotor::new(&MOTOR).expect("a valid motor")
    }

    fn turn_in_steps(motor: &mut DcMotor, voltage_v: f64, duration_s: f64, steps: u32) -> f64 {
        (0..steps).map(|_| motor.turn(voltage_v, duration_s / f64::from(steps))).sum()
    }

    fn assert_close(actual: f64, expected: f64, relative: f64) {
        assert!(
            (actual - expected).abs() <= relative * expected.abs(),
            "{actual} is not {expected} within {relative} of it"
        );
    }

    #[test]
    fn results_do_not_depend_on_the_step_even_across_a_reversal() {
        // 12 V forward for 50 ms, then 6 V backward for 300 ms, which passes zero speed. 1e-9: rounding grows
        // with 3000 steps × 1e-16 and the logarithm at the crossing; an Euler step of 1 ms is 1e-2 off.
        let totals = [350, 3500].map(|steps| {
            let mut motor = motor();
            let out = turn_in_steps(&mut motor, 12.0, 0.05, steps / 7);
            assert!(motor.rate_rad_s() > 0.0);
            let back = turn_in_steps(&mut motor, -6.0, 0.3, steps / 7 * 6);
            assert!(motor.rate_rad_s() < 0.0);
            (out + back, motor.rate_rad_s())
        });
        assert_close(totals[0].0, totals[1].0, 1e-9);
        assert_close(totals[0].1, totals[1].1, 1e-9);
    }

    #[test]
    fn steady_speed_balances_drive_and_friction() {
        let mut motor = motor();
        let _ = turn_in_steps(&mut motor, 10.0, 5.0, 5000);
        // (K V/R − τ_c)/(K²/R + b); after 70 time constants only rounding is left.
        let expected = (0.06 * 10.0 / 4.0 - 0.01) / (0.06 * 0.06 / 4.0 + 1e-5);
        assert_close(motor.rate_rad_s(), expected, 1e-12);
    }

    #[test]
    fn short_circuited_it_stops_after_the_analytic_time_and_angle_and_stays() {
        let mut motor = motor();
        let _ = turn_in_steps(&mut motor, 10.0, 5.0, 5000);
        let (start_rad_s, lambda, coulomb) = (motor.rate_rad_s(), 0.00091 / 6e-5, 0.01 / 6e-5);
        // ω(t) = 0 at t = ln(1 + λω0/c)/λ; angle (ω0 − c t)/λ.
        let stop_s = (1.0 + lambda * start_rad_s / coulomb).ln() / lambda;
        let stop_rad = (start_rad_s - coulomb * stop_s) / lambda;
        let mut angle_rad = 0.0;
        let mut steps = 0;
        while motor.rate_rad_s() > 0.0 && steps < 10_000 {
            angle_rad += motor.turn(0.0, 1e-3);
            steps += 1;
        }
        assert_eq!(steps, (stop_s / 1e-3).ceil() as i32, "it stops within the step in which the analytic time falls");
        assert_close(angle_rad, stop_rad, 1e-9); // hundreds of exact steps: rounding only
        assert_eq!(motor.rate_rad_s(), 0.0);
        assert_eq!(turn_in_steps(&mut motor, 0.0, 1.0, 1000), 0.0, "no chatter");
    }

    #[test]
    fn it_sticks_below_breakaway_and_moves_above_in_both_directions() {
        for sign in [1.0, -1.0] {
            let mut motor = motor();
            assert_eq!(turn_in_steps(&mut motor, sign * 0.999 * BREAKAWAY_V, 1.0, 1000), 0.0);
            assert!(sign * turn_in_steps(&mut motor, sign * 1.001 * BREAKAWAY_V, 0.01, 10) > 0.0);
        }
    }

    #[test]
    fn a_brake_of_less_than_breakaway_stops_it_and_does_not_pull_it_back() {
        let mut motor = motor();
        let _ = turn_in_steps(&mut motor, 12.0, 0.02, 20);
        let forward = turn_in_steps(&mut motor, -0.9 * BREAKAWAY_V, 1.0, 1000);
        assert!(forward > 0.0);
        assert_eq!(motor.rate_rad_s(), 0.0);
    }

    #[test]
    fn impossible_motors_are_refused() {
        let refused = DcMotor::new(&Motor { inertia_kg_m2: 0.0, ..MOTOR });
        assert!(matches!(refused, Err(ServoError::OutOfRange { quantity: "inertia_kg_m2", value: 0.0, .. })));
        assert!(DcMotor::new(&Motor { coulomb_friction_nm: f64::NAN, ..MOTOR }).is_err());
    }
}
