//! `wheel_eccentricity`: a wheel turns about a point beside its centre.
//!
//! Model: rolling radius r(φ) = r (1 + ε sin(φ + φ₀)).
//! Signature: e_dx and e_dθ locked to that wheel's phase, zero over whole turns.
//! Observability: phase continuity and more than two samples a turn. Over runs the counters tell the phase,
//! or, where they begin anew in each run, that a wheel keeps its angle between runs; one that is turned by
//! hand meanwhile has another phase in each run, and its effect averages out.
//! Alias: `encoder_cycle` with one cycle a turn, exactly.
//! Reference: geometry of a circular wheel on an offset axis, to first order in the offset; 0.1 to 1 %, a
//! rule of thumb.

use kinematics::{Pose, Side, Wheels, sinc};
use model_term::{Interval, ModelTerm, TermParameter};
use serde::{Deserialize, Serialize};

use crate::benchmark::Benchmark;
use crate::description::{Description, Statement, Summary};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, Step};
use crate::hypothesis::{Hypothesis, LastAngle, Variant, value_of};
use crate::on_board::{Code, Input, OnBoard};

/// What it is, in one line.
const MEANING: &str = "a wheel is not round or not centred";

/// The mean term in C, for a robot's own odometry. A wrong phase doubles the error: it is off while the phase
/// is not known.
const ON_BOARD: OnBoard = OnBoard::Input {
    input: Input::WheelAngles,
    code: Code::of(
        "\
if (left_turned_rad != 0.0) {
    const double to_rad = left_wheel_rad + left_turned_rad;
    left_change_m += left_m / left_turned_rad
                     * (left_sin * (cos(left_wheel_rad) - cos(to_rad)) + left_cos * (sin(to_rad) - sin(left_wheel_rad)));
}
if (right_turned_rad != 0.0) {
    const double to_rad = right_wheel_rad + right_turned_rad;
    right_change_m += right_m / right_turned_rad
                      * (right_sin * (cos(right_wheel_rad) - cos(to_rad)) + right_cos * (sin(to_rad) - sin(right_wheel_rad)));
}",
    ),
};

/// Eccentricity of each wheel.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WheelEccentricity {
    /// Offset of the left wheel's axis over its radius (ε).
    #[serde(default)]
    pub left_amplitude: f64,
    /// Its phase at wheel angle zero (φ₀), radians.
    #[serde(default)]
    pub left_phase_rad: f64,
    /// Offset of the right wheel's axis over its radius.
    #[serde(default)]
    pub right_amplitude: f64,
    /// Its phase, radians.
    #[serde(default)]
    pub right_phase_rad: f64,
}

impl PhysicalEffect for WheelEccentricity {
    fn check(&self) -> Result<(), EffectError> {
        let id = "wheel_eccentricity";
        for (name, value) in [("left_amplitude", self.left_amplitude), ("right_amplitude", self.right_amplitude)] {
            EffectError::unless((0.0..1.0).contains(&value), id, name, value, "in [0, 1)")?;
        }
        let phases = [("left_phase_rad", self.left_phase_rad), ("right_phase_rad", self.right_phase_rad)];
        EffectError::unless_finite(id, phases)
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State {
            amplitude: Wheels { left: self.left_amplitude, right: self.right_amplitude },
            phase_rad: Wheels { left: self.left_phase_rad, right: self.right_phase_rad },
        }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Terms(Variant::plain(Term { last: Wheels::both(LastAngle::NONE) }))
    }

    fn description() -> Description {
        Description {
            summary: Summary::WithSize(|values| {
                Statement::of(MEANING, values.amplitudes("", 100.0, "%", "wheel's radius varies"))
            }),
            benchmark: Benchmark::OF_MEAN.with_form(
                "a radius that rises and falls linearly with the wheel's angle, a triangle for a sine",
                |values, _| {
                    let of = |name: &str| value_of(values, name).unwrap_or(0.0);
                    let amplitude = |side: &str| of(&format!("{side}_sin")).hypot(of(&format!("{side}_cos")));
                    let phase = |side: &str| of(&format!("{side}_cos")).atan2(of(&format!("{side}_sin")));
                    Box::new(FlatSpots {
                        amplitude: Wheels { left: amplitude("left"), right: amplitude("right") },
                        phase_rad: Wheels { left: phase("left"), right: phase("right") },
                    })
                },
            ),
            on_board: ON_BOARD,
            ..Description::of(MEANING)
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        let (left_sin, left_cos) = (value_of(values, "left_sin")?, value_of(values, "left_cos")?);
        let (right_sin, right_cos) = (value_of(values, "right_sin")?, value_of(values, "right_cos")?);
        Some(Self {
            left_amplitude: left_sin.hypot(left_cos),
            left_phase_rad: left_cos.atan2(left_sin),
            right_amplitude: right_sin.hypot(right_cos),
            right_phase_rad: right_cos.atan2(right_sin),
        })
    }

    fn estimates(&self) -> Vec<(&'static str, f64)> {
        let Self { left_amplitude, left_phase_rad, right_amplitude, right_phase_rad } = *self;
        vec![
            ("left_sin", left_amplitude * left_phase_rad.cos()),
            ("left_cos", left_amplitude * left_phase_rad.sin()),
            ("right_sin", right_amplitude * right_phase_rad.cos()),
            ("right_cos", right_amplitude * right_phase_rad.sin()),
        ]
    }
}

struct State {
    amplitude: Wheels<f64>,
    phase_rad: Wheels<f64>,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { wheel: true, ..Hooks::NONE }
    }

    /// The mean radius over the step, exactly: ∫sin over [φ, φ+Δ] is Δ·sin(φ+Δ/2)·sinc(Δ/2).
    fn wheel(&mut self, step: &mut Step) {
        for side in Side::BOTH {
            let half_rad = 0.5 * step.wheel_rad[side];
            let mean_sine = (step.wheel_angle_rad[side] + half_rad + self.phase_rad[side]).sin() * sinc(half_rad);
            step.radius_m[side] *= 1.0 + self.amplitude[side] * mean_sine;
        }
    }

    fn needs_stepping(&self) -> Option<&'static str> {
        Some("the path bends within a wheel turn")
    }
}

#[derive(Clone)]
struct Term {
    last: Wheels<LastAngle>,
}

impl ModelTerm for Term {
    /// Plausible: 1 %, the upper end of the rule of thumb.
    fn parameters(&self) -> &'static [TermParameter] {
        &[
            TermParameter { name: "left_sin", unit: "1", prior_sigma: 0.01 },
            TermParameter { name: "left_cos", unit: "1", prior_sigma: 0.01 },
            TermParameter { name: "right_sin", unit: "1", prior_sigma: 0.01 },
            TermParameter { name: "right_cos", unit: "1", prior_sigma: 0.01 },
        ]
    }

    /// From angle to angle, so that whole turns telescope: ∫sin φ dφ = cos φ₁ − cos φ₂, ∫cos φ dφ = sin φ₂ −
    /// sin φ₁.
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
            let (sin_before, cos_before) = self.last[side].sin_cos(interval.wheel_rad[side]);
            let (sin, cos) = self.last[side].sin_cos(interval.wheel_rad[side] + turned_rad);
            for (gradient, integral) in gradient.iter_mut().zip([cos_before - cos, sin - sin_before]) {
                let mut travel_m = Wheels::both(0.0);
                travel_m[side] = m_per_rad * integral;
                *gradient = interval.change(travel_m);
            }
        }
    }
}

/// The other form: a radius that rises and falls linearly with the wheel's angle, a triangle for a sine.
struct FlatSpots {
    amplitude: Wheels<f64>,
    phase_rad: Wheels<f64>,
}

impl Forward for FlatSpots {
    fn hooks(&self) -> Hooks {
        Hooks { wheel: true, ..Hooks::NONE }
    }

    fn wheel(&mut self, step: &mut Step) {
        for side in Side::BOTH {
            let angle_rad = step.wheel_angle_rad[side] + 0.5 * step.wheel_rad[side] + self.phase_rad[side];
            // asin(sin) is a triangle of height π/2, whose first harmonic has the amplitude 4/π.
            step.radius_m[side] *= 1.0 + self.amplitude[side] * angle_rad.sin().asin() * std::f64::consts::FRAC_PI_4;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::specimen_step;
    use std::f64::consts::TAU;

    fn travel_m(from_rad: f64, turn_rad: f64, parts: u32) -> f64 {
        let amplitude = Wheels { left: 0.0, right: 0.01 };
        let mut state = State { amplitude, phase_rad: Wheels::both(0.4) };
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
