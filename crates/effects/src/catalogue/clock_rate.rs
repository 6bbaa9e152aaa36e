//! `clock_rate`: the robot's clock runs fast.
//!
//! Model: stamp = (1 + ρ) t from the run's start.
//! Signature: none in a pose by counts, but a time offset that grows: ρ t (v, 0, ω) between what is seen and
//! what is counted; where speeds are logged instead, a scale.
//! Observability: a robot that moves late in long runs.
//! Alias: `wheel_scale` where speeds are logged; `truth_latency` over short runs.
//! Reference: resonators and timers, 0.01 to 3 %, as users report.

use dataset::RunInfo;
use kinematics::{Pose, Twist};
use model_term::{Interval, Measurement, ModelTerm, TermParameter};
use serde::{Deserialize, Serialize};

use crate::description::{Description, Excitation, Summary};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, SampleClock};
use crate::hypothesis::{Hypothesis, Variant, value_of};
use crate::on_board::OnBoard;
use crate::time_shift::TimeShift;

/// What it is, in one line.
const MEANING: &str = "one clock runs fast";

/// Rate of the robot's clock.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClockRate {
    /// How much the robot's clock gains (ρ), seconds a second.
    pub rate: f64,
}

impl PhysicalEffect for ClockRate {
    fn check(&self) -> Result<(), EffectError> {
        let holds = self.rate.is_finite() && self.rate > -1.0;
        EffectError::unless(holds, "clock_rate", "rate", self.rate, "more than -1")
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { effect: *self }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Terms(Variant::plain(Term::default()))
    }

    fn description() -> Description {
        Description {
            summary: Summary::WithValues(|values| format!("{MEANING}, by {}", values.shown("rate", 100.0, "%"))),
            excitation: Excitation::Conditions("log speeds beside an instrument with a clock of its own"),
            on_board: OnBoard::Never("a pose by counts has no clock in it, and speeds are by the clock of the log that was fitted"),
            ..Description::of(MEANING)
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        Some(Self { rate: value_of(values, "rate")? })
    }
}

struct State {
    effect: ClockRate,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { clock: true, ..Hooks::NONE }
    }

    fn clock(&mut self, sample: &mut SampleClock) {
        sample.stamp_s *= 1.0 + self.effect.rate;
    }
}

/// The motion from the stamp on to the instant by the true clock, over the rate: its twist times the time
/// since the run's start where there is none yet.
#[derive(Clone, Default)]
struct Term {
    rate: f64,
    shift: TimeShift,
}

impl ModelTerm for Term {
    /// Plausible: 3 %, the upper end of what users report.
    fn parameters(&self) -> &'static [TermParameter] {
        &[TermParameter { name: "rate", unit: "1", prior_sigma: 0.03 }]
    }

    fn linearize_at(&mut self, values: &[f64]) {
        self.rate = values.first().copied().unwrap_or(0.0);
    }

    fn restart(&mut self, _run: &RunInfo) {
        self.shift.restart();
    }

    fn motion(&mut self, interval: &Interval<'_>, _gradient: &mut [Pose]) {
        if self.rate != 0.0 {
            self.shift.motion(interval);
        }
    }

    /// What the counts say of the instant t by the robot's clock was true ρ t before: the robot is seen
    /// farther on.
    fn measurement(&mut self, measurement: &Measurement<'_>, gradient: &mut [Pose]) {
        gradient[0] = if self.rate == 0.0 {
            let Twist { v_m_s, omega_rad_s } = measurement.twist;
            Pose::new(measurement.t_s * v_m_s, 0.0, measurement.t_s * omega_rad_s)
        } else {
            let seen = self.shift.seen(measurement, -self.rate * measurement.t_s);
            Pose::new(seen.x_m / self.rate, seen.y_m / self.rate, seen.theta_rad / self.rate)
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kinematics::Wheels;

    #[test]
    fn stamps_gain_and_readings_do_not() {
        let mut sample = SampleClock { stamp_s: 2.0, read_s: Wheels::both(2.0) };
        State { effect: ClockRate { rate: 0.01 } }.clock(&mut sample);
        assert_eq!(sample, SampleClock { stamp_s: 2.02, read_s: Wheels::both(2.0) });
    }
}
