//! Uneven turning: gears, treads and load that push the shafts about faster than the controllers correct.
//!
//! Model: each shaft turns by A sin(2πft + φ) of its speed too much, before the controllers correct it. Both
//! wheels have a phase of their own in every run. Encoders see it, as they see all that the shafts do:
//! nothing is wrong with the robot.

use std::f64::consts::TAU;

use effects::{Forward, Hooks, Step, Stream};
use kinematics::{Side, Wheels};

/// Gain of a controller that leaves ripple to be seen: a quarter of the shipped robot's.
pub(crate) const SLACK_GAIN: u8 = 12;

pub(crate) struct SpeedRipple {
    amplitude: f64,
    rate_rad_s: f64,
    phase_rad: Wheels<f64>,
}

impl SpeedRipple {
    /// The name of its draws.
    pub(crate) const ID: &'static str = "speed_ripple";

    pub(crate) fn boxed(amplitude: f64, frequency_hz: f64) -> Box<dyn Forward> {
        Box::new(Self { amplitude, rate_rad_s: TAU * frequency_hz, phase_rad: Wheels::both(0.0) })
    }
}

impl Forward for SpeedRipple {
    fn hooks(&self) -> Hooks {
        Hooks { seed_run: true, motor: true, ..Hooks::NONE }
    }

    fn seed_run(&mut self, mut stream: Stream) {
        self.phase_rad = Wheels::from_sides(|_| TAU * stream.uniform());
    }

    fn motor(&mut self, step: &mut Step) {
        for side in Side::BOTH {
            let (sine, cosine) = (self.rate_rad_s * step.t_s + self.phase_rad[side]).sin_cos();
            let rate_rad_s = step.rate_rad_s[side];
            step.shaft_rad[side] *= 1.0 + self.amplitude * sine;
            step.rate_rad_s[side] += self.amplitude * sine * rate_rad_s;
            step.acceleration_rad_s2[side] +=
                self.amplitude * (self.rate_rad_s * cosine * rate_rad_s + sine * step.acceleration_rad_s2[side]);
        }
    }
}
