//! `truth_latency`: the outside instrument's samples are stamped later than they are true.
//!
//! Model: what is stamped t was seen at t − τ.
//! Signature: −τ(v, 0, ω) in a seen pose, −τ(v̇, 0, ω̇) per unit of time in increments: nothing on a circle
//! at constant speed.
//! Observability: starts, stops and reversals.
//! Alias: `slip_acceleration`, exactly: the same lag of both wheels is a time shift.
//! Reference: the delay that target-tracking and hand-eye calibrations estimate beside the geometry; 5 to 100
//! ms, in published logs up to 0.3 s.

use std::collections::VecDeque;

use dataset::RunInfo;
use kinematics::{Increment, Pose, Twist};
use model_term::{Interval, Measurement, ModelTerm, TermParameter};
use serde::{Deserialize, Serialize};

use crate::description::{Description, Summary};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, PoseReading};
use crate::hypothesis::{Hypothesis, Variant, value_of};

/// What it is, in one line.
const MEANING: &str = "the instrument's measurements are late";

/// Delay of the instrument's stamps.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TruthLatency {
    /// Stamp minus instant (τ), seconds; negative when the stamps are early.
    pub delay_s: f64,
}

impl PhysicalEffect for TruthLatency {
    fn check(&self) -> Result<(), EffectError> {
        EffectError::unless_finite("truth_latency", [("delay_s", self.delay_s)])
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { effect: *self }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Terms(Variant::plain(Term::default()))
    }

    fn description() -> Description {
        Description {
            clock_offset: Some("delay_s"),
            summary: Summary::WithValues(|values| {
                format!("{MEANING} by {}: nothing is wrong with the robot", values.shown("delay_s", 1e3, "ms"))
            }),
            ..Description::of(MEANING)
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        Some(Self { delay_s: value_of(values, "delay_s")? })
    }
}

struct State {
    effect: TruthLatency,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { instrument: true, ..Hooks::NONE }
    }

    fn instrument(&mut self, reading: &mut PoseReading) {
        reading.t_s += self.effect.delay_s;
    }
}

/// The motion since the instant that a late measurement is of, over the delay: its twist where there is none
/// yet.
#[derive(Clone, Default)]
struct Term {
    delay_s: f64,
    /// Ends of the intervals of the last [`LONGEST_S`], with the velocities there.
    ends: VecDeque<(f64, Twist)>,
}

/// Delays of more are not followed back, seconds.
const LONGEST_S: f64 = 1.5;

impl Term {
    /// Distance and turn from the instant `delay_s` before now on.
    fn moved(&self, now: (f64, Twist)) -> Increment {
        let from_s = now.0 - self.delay_s;
        let (mut moved, mut after) = (Increment { distance_m: 0.0, turn_rad: 0.0 }, now);
        let mut add = |time_s: f64, a: Twist, b: Twist| {
            moved.distance_m += 0.5 * time_s * (a.v_m_s + b.v_m_s);
            moved.turn_rad += 0.5 * time_s * (a.omega_rad_s + b.omega_rad_s);
        };
        for before in self.ends.iter().rev().copied().filter(|(end_s, _)| *end_s < now.0) {
            let length_s = after.0 - before.0;
            if before.0 <= from_s {
                let share = if length_s > 0.0 { (after.0 - from_s) / length_s } else { 0.0 };
                let between = |after: f64, before: f64| after + share * (before - after);
                let start = Twist {
                    v_m_s: between(after.1.v_m_s, before.1.v_m_s),
                    omega_rad_s: between(after.1.omega_rad_s, before.1.omega_rad_s),
                };
                add(after.0 - from_s, start, after.1);
                return moved;
            }
            add(length_s, before.1, after.1);
            after = before;
        }
        // Before the log it went on as at its start.
        add(after.0 - from_s, after.1, after.1);
        moved
    }
}

impl ModelTerm for Term {
    /// Plausible: 100 ms, the upper end of the rule of thumb; three times that has been published.
    fn parameters(&self) -> &'static [TermParameter] {
        &[TermParameter { name: "delay_s", unit: "s", prior_sigma: 0.1 }]
    }

    fn linearize_at(&mut self, values: &[f64]) {
        self.delay_s = values.first().map_or(0.0, |delay_s| delay_s.clamp(0.0, LONGEST_S));
    }

    fn restart(&mut self, _run: &RunInfo) {
        self.ends.clear();
    }

    fn motion(&mut self, interval: &Interval<'_>, _gradient: &mut [Pose]) {
        if self.delay_s == 0.0 {
            return;
        }
        let [start, end] = interval.speed_at_ends_m_s.map(|speed_m_s| {
            let Increment { distance_m, turn_rad } = Increment::from_travel(speed_m_s, interval.wheel_separation_m);
            Twist { v_m_s: distance_m, omega_rad_s: turn_rad }
        });
        if self.ends.is_empty() {
            self.ends.push_back((interval.t_s, start));
        }
        let end_s = interval.t_s + interval.dt_s;
        self.ends.push_back((end_s, end));
        while self.ends.front().is_some_and(|(at_s, _)| *at_s < end_s - LONGEST_S) {
            self.ends.pop_front();
        }
    }

    fn measurement(&mut self, measurement: &Measurement<'_>, gradient: &mut [Pose]) {
        let Twist { v_m_s, omega_rad_s } = measurement.twist;
        gradient[0] = if self.delay_s == 0.0 {
            Pose::new(-v_m_s, 0.0, -omega_rad_s)
        } else {
            let Increment { distance_m, turn_rad } = self.moved((measurement.t_s, measurement.twist));
            let back = Increment { distance_m: -distance_m, turn_rad: -turn_rad }.arc();
            Pose::new(back.x_m / self.delay_s, back.y_m / self.delay_s, back.theta_rad / self.delay_s)
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kinematics::Wheels;

    #[test]
    fn a_late_stamp_shows_the_robot_behind() {
        let mut state = State { effect: TruthLatency { delay_s: 0.05 } };
        let mut reading = PoseReading { t_s: 1.0, world_from_body: Pose::IDENTITY };
        state.instrument(&mut reading);
        assert_eq!(reading, PoseReading { t_s: 1.05, world_from_body: Pose::IDENTITY });
        let (run, twist) = (RunInfo::default(), Twist { v_m_s: 0.4, omega_rad_s: -0.2 });
        let mut gradient = [Pose::IDENTITY];
        Term::default().measurement(&Measurement { t_s: 1.05, world_from_body: Pose::IDENTITY, twist, run: &run }, &mut gradient);
        assert_eq!(gradient, [Pose::new(-0.4, 0.0, 0.2)]);
    }

    #[test]
    fn a_large_delay_goes_back_over_what_the_robot_did() {
        // Speeding up at 1 m/s² for a second, in rows of 40 ms: 0.1 s before t = 1 s it was 0.1 − 0.1²/2 m
        // back.
        let (run, mut term) = (RunInfo::default(), Term::default());
        term.linearize_at(&[0.1]);
        let mut gradient = [Pose::IDENTITY];
        for row in 0..25 {
            let t_s = 0.04 * f64::from(row);
            let interval = Interval {
                t_s,
                dt_s: 0.04,
                late_s: [0.0; 2],
                travel_m: Wheels::both(0.0),
                speed_m_s: Wheels::both(t_s + 0.02),
                speed_at_ends_m_s: [t_s, t_s + 0.04].map(Wheels::both),
                count_m: Wheels::both(0.0),
                wheel_separation_m: 0.36,
                wheel_rad: Wheels::both(0.0),
                turned_rad: Wheels::both(0.0),
                world_from_body: Pose::IDENTITY,
                session_m: 0.0,
                run: &run,
            };
            term.motion(&interval, &mut gradient);
        }
        let twist = Twist { v_m_s: 1.0, omega_rad_s: 0.0 };
        term.measurement(&Measurement { t_s: 1.0, world_from_body: Pose::IDENTITY, twist, run: &run }, &mut gradient);
        // Rejects the speed at the measurement, −1.
        assert!((gradient[0].x_m + 0.95).abs() < 1e-12, "{:?}", gradient[0]);
    }
}
