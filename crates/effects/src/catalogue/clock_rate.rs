//! `clock_rate`: the robot's clock runs fast.
//!
//! Model: stamp = (1 + ρ) t from the run's start.
//! Signature: none in a pose by counts, but a time offset that grows: ρ t (v, 0, ω) between what is seen and
//! what is counted; where speeds are logged instead, a scale. Clocks that agree at the start of each run, and
//! clocks that run on from the session's start, are two variants (`since_session_start` is 1 for the latter):
//! a log that is cut into runs has the second.
//! Observability: a robot that moves late in long runs.
//! Alias: `wheel_scale` where speeds are logged; `truth_latency` over short runs.
//! Reference: resonators and timers, 0.01 to 3 %, as users report.

use dataset::RunInfo;
use kinematics::{Pose, Twist};
use model_term::{Interval, Measurement, ModelTerm, TermParameter};
use serde::{Deserialize, Serialize};

use crate::description::{Description, Excitation, Statement, Summary};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, SampleClock};
use crate::hypothesis::{Hypothesis, Variant, value_of};
use crate::on_board::OnBoard;
use crate::time_shift::TimeShift;

/// What it is, in one line.
const MEANING: &str = "the robot's clock runs fast";

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
        let of_session = Term { of_session: true, ..Term::default() };
        let of_session = Variant { fixed: vec![("since_session_start", 1.0)], term: Box::new(of_session), at: None };
        Hypothesis::Terms(Variant::plain(Term::default()).into_iter().chain([of_session]).collect())
    }

    fn description() -> Description {
        Description {
            summary: Summary::WithSize(|values| {
                let what = values.by_sign("rate", MEANING, "the robot's clock runs slow");
                Statement::of(what, format!("by {}", values.magnitude("rate", 100.0, "%")))
            }),
            excitation: Excitation::Conditions("log speeds together with an instrument that has its own clock"),
            is_clock_rate: true,
            on_board: OnBoard::Never(
                "a pose by counts has no clock in it, and speeds are by the clock of the log that was fitted",
            ),
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
    /// The clocks agreed when the session began, and not at the start of each run.
    of_session: bool,
    session_s: f64,
    shift: TimeShift,
}

impl ModelTerm for Term {
    /// Plausible: 3 %, the upper end of what users report.
    fn parameters(&self) -> &'static [TermParameter] {
        &[TermParameter { name: "rate", unit: "1", prior_sigma: 0.03 }]
    }

    fn moves_body(&self) -> bool {
        true
    }

    fn linearize_at(&mut self, values: &[f64]) {
        self.rate = values.first().copied().unwrap_or(0.0);
    }

    fn restart(&mut self, run: &RunInfo) {
        self.shift.restart();
        self.session_s = if self.of_session { run.start_s.unwrap_or(0.0) } else { 0.0 };
    }

    fn motion(&mut self, interval: &Interval<'_>, _gradient: &mut [Pose]) {
        if self.rate != 0.0 {
            self.shift.motion(interval);
        }
    }

    /// What the counts say of the instant t by the robot's clock was true ρ t before: the robot is seen
    /// farther on.
    fn measurement(&mut self, measurement: &Measurement<'_>, gradient: &mut [Pose]) {
        let since_s = self.session_s + measurement.t_s;
        gradient[0] = if self.rate == 0.0 {
            let Twist { v_m_s, omega_rad_s } = measurement.twist;
            Pose::new(since_s * v_m_s, 0.0, since_s * omega_rad_s)
        } else {
            let seen = self.shift.seen(measurement, -self.rate * since_s);
            Pose::new(seen.x_m / self.rate, seen.y_m / self.rate, seen.theta_rad / self.rate)
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kinematics::Wheels;
    use model_term::NoRecord;

    #[test]
    fn clocks_run_on_from_the_start_of_the_run_or_of_the_session() {
        let run = RunInfo { start_s: Some(100.0), ..RunInfo::default() };
        let measurement = Measurement {
            t_s: 2.0,
            world_from_body: Pose::IDENTITY,
            twist: Twist { v_m_s: 0.5, omega_rad_s: 0.1 },
            twist_of_terms: Twist::default(),
            record: &NoRecord,
            run: &run,
        };
        let seen = |of_session: bool| {
            let mut term = Term { of_session, ..Term::default() };
            term.restart(&run);
            let mut gradient = [Pose::IDENTITY];
            term.measurement(&measurement, &mut gradient);
            gradient[0]
        };
        // v t and ω t.
        assert_eq!(seen(false), Pose::new(1.0, 0.0, 0.2));
        assert_eq!(seen(true), Pose::new(51.0, 0.0, 0.1 * 102.0));
    }

    #[test]
    fn stamps_gain_and_readings_do_not() {
        let mut sample = SampleClock { stamp_s: 2.0, read_s: Wheels::both(2.0) };
        State { effect: ClockRate { rate: 0.01 } }.clock(&mut sample);
        assert_eq!(sample, SampleClock { stamp_s: 2.02, read_s: Wheels::both(2.0) });
    }
}
