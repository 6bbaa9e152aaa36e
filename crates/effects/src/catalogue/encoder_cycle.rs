//! `encoder_cycle`: an encoder whose error repeats n times a turn of the wheel.
//!
//! Model: shown angle = φ + A sin(nφ + φ₀) per wheel: an eccentric or tilted disc (n = 1, 2), gear teeth,
//! quadrature phases.
//! Signature: e_dx and e_dθ locked to that wheel's phase, n times a turn.
//! Observability: a continuous log with more than 2n samples a turn, and the phase over runs as
//! `wheel_eccentricity` has it.
//! Alias: `wheel_eccentricity` at n = 1, exactly.
//! Reference: geometry of an eccentric disc, A = e/r_disc over the gear's ratio.

use kinematics::{Pose, Side, Wheels};
use model_term::{Interval, ModelTerm, TermParameter};
use serde::{Deserialize, Serialize};

use crate::description::{Description, Statement, Summary};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, Step};
use crate::hypothesis::{Hypothesis, LastAngle, Variant, value_of};
use crate::on_board::{Code, Input, OnBoard};

/// Cycles a turn that are tried; one a turn is an eccentric wheel to any data.
const CYCLES: [f64; 11] = [2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 16.0, 20.0, 24.0];

/// The mean term in C, for a robot's own odometry. A wrong phase doubles the error: it is off while the phase
/// is not known.
const ON_BOARD: OnBoard = OnBoard::Input {
    input: Input::WheelAngles,
    code: Code::of(
        "\
if (left_turned_rad != 0.0) {
    const double from_rad = cycles * left_wheel_rad, to_rad = cycles * (left_wheel_rad + left_turned_rad);
    left_change_m -= left_m / left_turned_rad
                     * (left_sin_rad * (sin(to_rad) - sin(from_rad)) + left_cos_rad * (cos(to_rad) - cos(from_rad)));
}
if (right_turned_rad != 0.0) {
    const double from_rad = cycles * right_wheel_rad, to_rad = cycles * (right_wheel_rad + right_turned_rad);
    right_change_m -= right_m / right_turned_rad
                      * (right_sin_rad * (sin(to_rad) - sin(from_rad)) + right_cos_rad * (cos(to_rad) - cos(from_rad)));
}",
    ),
};

/// Periodic error of each encoder.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EncoderCycle {
    /// Cycles in one turn of the wheel (n).
    pub cycles: u32,
    /// Amplitude of the left encoder's error (A), radians at the wheel.
    #[serde(default)]
    pub left_amplitude_rad: f64,
    /// Its phase at wheel angle zero (φ₀), radians.
    #[serde(default)]
    pub left_phase_rad: f64,
    /// The right encoder's amplitude, radians at the wheel.
    #[serde(default)]
    pub right_amplitude_rad: f64,
    /// Its phase, radians.
    #[serde(default)]
    pub right_phase_rad: f64,
}

impl PhysicalEffect for EncoderCycle {
    fn check(&self) -> Result<(), EffectError> {
        let id = "encoder_cycle";
        let n = f64::from(self.cycles);
        EffectError::unless(n >= 1.0, id, "cycles", n, "1 or more")?;
        let amplitudes =
            [("left_amplitude_rad", self.left_amplitude_rad), ("right_amplitude_rad", self.right_amplitude_rad)];
        for (name, value) in amplitudes {
            let holds = value >= 0.0 && value * n < 1.0;
            EffectError::unless(holds, id, name, value, "from 0 to less than 1/cycles, so that counts never run back")?;
        }
        let phases = [("left_phase_rad", self.left_phase_rad), ("right_phase_rad", self.right_phase_rad)];
        EffectError::unless_finite(id, phases)
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State {
            cycles: f64::from(self.cycles),
            amplitude_rad: Wheels { left: self.left_amplitude_rad, right: self.right_amplitude_rad },
            phase_rad: Wheels { left: self.left_phase_rad, right: self.right_phase_rad },
        }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Terms(Variant::over("cycles", &CYCLES, |cycles| Term {
            cycles,
            last: Wheels::both(LastAngle::NONE),
        }))
    }

    fn description() -> Description {
        Description {
            summary: Summary::WithSize(|values| {
                let cycles = values.value("cycles").map_or_else(|| "some".to_owned(), |cycles| format!("{cycles:.0}"));
                let off = values.amplitudes("_rad", 1e3, "mrad", "encoder is off");
                Statement::of("an encoder errs periodically within a turn", format!("{cycles} times a turn, {off}"))
            }),
            on_board: ON_BOARD,
            ..Description::of("an encoder errs periodically within a turn")
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        let (left_sin, left_cos) = (value_of(values, "left_sin_rad")?, value_of(values, "left_cos_rad")?);
        let (right_sin, right_cos) = (value_of(values, "right_sin_rad")?, value_of(values, "right_cos_rad")?);
        Some(Self {
            cycles: value_of(values, "cycles")? as u32,
            left_amplitude_rad: left_sin.hypot(left_cos),
            left_phase_rad: left_cos.atan2(left_sin),
            right_amplitude_rad: right_sin.hypot(right_cos),
            right_phase_rad: right_cos.atan2(right_sin),
        })
    }

    fn estimates(&self) -> Vec<(&'static str, f64)> {
        let Self { left_amplitude_rad, left_phase_rad, right_amplitude_rad, right_phase_rad, .. } = *self;
        vec![
            ("left_sin_rad", left_amplitude_rad * left_phase_rad.cos()),
            ("left_cos_rad", left_amplitude_rad * left_phase_rad.sin()),
            ("right_sin_rad", right_amplitude_rad * right_phase_rad.cos()),
            ("right_cos_rad", right_amplitude_rad * right_phase_rad.sin()),
            ("cycles", f64::from(self.cycles)),
        ]
    }
}

struct State {
    cycles: f64,
    amplitude_rad: Wheels<f64>,
    phase_rad: Wheels<f64>,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { encoder: true, ..Hooks::NONE }
    }

    fn encoder(&mut self, step: &mut Step) {
        for side in Side::BOTH {
            let shown = |angle_rad: f64| (self.cycles * angle_rad + self.phase_rad[side]).sin();
            let from_rad = step.wheel_angle_rad[side];
            let excess = shown(from_rad + step.shaft_rad[side]) - shown(from_rad);
            step.encoder_rad[side] += self.amplitude_rad[side] * excess;
        }
    }

    fn needs_stepping(&self) -> Option<&'static str> {
        Some("the path bends within a cycle")
    }
}

#[derive(Clone)]
struct Term {
    cycles: f64,
    last: Wheels<LastAngle>,
}

impl ModelTerm for Term {
    /// Plausible: a disc 0.1 mm off its axis at a radius of 10 mm, on the wheel.
    fn parameters(&self) -> &'static [TermParameter] {
        &[
            TermParameter { name: "left_sin_rad", unit: "rad", prior_sigma: 0.01 },
            TermParameter { name: "left_cos_rad", unit: "rad", prior_sigma: 0.01 },
            TermParameter { name: "right_sin_rad", unit: "rad", prior_sigma: 0.01 },
            TermParameter { name: "right_cos_rad", unit: "rad", prior_sigma: 0.01 },
        ]
    }

    /// What the encoder showed too much was not rolled.
    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        if !interval.run.continuous {
            return; // The wheels' phases are lost in its gaps.
        }
        for (side, gradient) in Side::BOTH.into_iter().zip(gradient.chunks_exact_mut(2)) {
            let turned_rad = interval.turned_rad[side];
            if turned_rad == 0.0 {
                continue;
            }
            let m_per_rad = interval.travel_m[side] / turned_rad;
            let (sin_before, cos_before) = self.last[side].sin_cos(self.cycles * interval.wheel_rad[side]);
            let (sin, cos) = self.last[side].sin_cos(self.cycles * (interval.wheel_rad[side] + turned_rad));
            for (gradient, shown) in gradient.iter_mut().zip([sin - sin_before, cos - cos_before]) {
                let mut travel_m = Wheels::both(0.0);
                travel_m[side] = -m_per_rad * shown;
                *gradient = interval.change(travel_m);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::specimen_step;
    use std::f64::consts::TAU;

    #[test]
    fn a_cycle_shows_nothing_when_it_is_whole_and_twice_the_amplitude_at_its_half() {
        let effect = EncoderCycle {
            cycles: 5,
            left_amplitude_rad: 0.01,
            left_phase_rad: 0.0,
            right_amplitude_rad: 0.0,
            right_phase_rad: 0.0,
        };
        let excess_rad = |from_rad: f64, turned_rad: f64| {
            let mut step = specimen_step();
            step.wheel_angle_rad = Wheels::both(from_rad);
            step.shaft_rad = Wheels::both(turned_rad);
            step.encoder_rad = step.shaft_rad;
            effect.forward().expect("acts on encoders").encoder(&mut step);
            assert_eq!(step.encoder_rad.right, turned_rad);
            step.encoder_rad.left - turned_rad
        };
        assert!(excess_rad(0.3, TAU / 5.0).abs() < 1e-15);
        assert!((excess_rad(-TAU / 20.0, TAU / 10.0) - 0.02).abs() < 1e-15);
    }
}
