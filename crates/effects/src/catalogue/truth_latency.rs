//! `truth_latency`: the outside instrument's samples are stamped later than they are true.
//!
//! Model: what is stamped t was seen at t − τ.
//! Signature: −τ(v, 0, ω) in a seen pose, −τ(v̇, 0, ω̇) per unit of time in increments: nothing on a circle
//! at constant speed.
//! Observability: starts, stops and reversals.
//! Alias: `slip_acceleration`, exactly: the same lag of both wheels is a time shift.
//! Reference: the delay that target-tracking and hand-eye calibrations estimate beside the geometry; 5 to 100
//! ms, in published logs up to 0.3 s.

use dataset::RunInfo;
use kinematics::Pose;
use model_term::{Interval, Measurement, ModelTerm, TermParameter};
use serde::{Deserialize, Serialize};

use crate::description::{Description, Statement, Summary};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, PoseReading};
use crate::hypothesis::{Hypothesis, Variant, value_of};
use crate::on_board::OnBoard;
use crate::time_shift::{LONGEST_S, TimeShift};

/// What it is, in one line.
const MEANING: &str = "the instrument's timestamps are late";

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
            is_delay: true,
            summary: Summary::WithSize(|values| {
                let what = values.by_sign("delay_s", MEANING, "the instrument's timestamps are early");
                Statement::of(what, format!("by {}", values.magnitude("delay_s", 1e3, "ms")))
            }),
            on_board: OnBoard::OfInstrument,
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
    shift: TimeShift,
}

impl ModelTerm for Term {
    /// Plausible: 100 ms, the upper end of the rule of thumb; three times that has been published.
    fn parameters(&self) -> &'static [TermParameter] {
        &[TermParameter { name: "delay_s", unit: "s", prior_sigma: 0.1 }]
    }

    fn moves_body(&self) -> bool {
        true
    }

    fn linearize_at(&mut self, values: &[f64]) {
        self.delay_s = values.first().map_or(0.0, |delay_s| delay_s.clamp(-LONGEST_S, LONGEST_S));
    }

    fn restart(&mut self, _run: &RunInfo) {
        self.shift.restart();
    }

    fn motion(&mut self, interval: &Interval<'_>, _gradient: &mut [Pose]) {
        if self.delay_s != 0.0 {
            self.shift.motion(interval);
        }
    }

    fn measurement(&mut self, measurement: &Measurement<'_>, gradient: &mut [Pose]) {
        gradient[0] = if self.delay_s == 0.0 {
            let (of_counts, of_terms) = (measurement.twist, measurement.twist_of_terms);
            Pose::new(-of_counts.v_m_s - of_terms.v_m_s, 0.0, -of_counts.omega_rad_s - of_terms.omega_rad_s)
        } else {
            let seen = self.shift.seen(measurement, self.delay_s);
            Pose::new(seen.x_m / self.delay_s, seen.y_m / self.delay_s, seen.theta_rad / self.delay_s)
        };
    }
}

#[cfg(test)]
mod tests {
    use kinematics::Twist;
    use model_term::NoRecord;

    use super::*;

    #[test]
    fn a_late_stamp_shows_the_robot_behind() {
        let mut state = State { effect: TruthLatency { delay_s: 0.05 } };
        let mut reading = PoseReading { t_s: 1.0, world_from_body: Pose::IDENTITY };
        state.instrument(&mut reading);
        assert_eq!(reading, PoseReading { t_s: 1.05, world_from_body: Pose::IDENTITY });
        let (run, twist) = (RunInfo::default(), Twist { v_m_s: 0.4, omega_rad_s: -0.2 });
        let mut gradient = [Pose::IDENTITY];
        let measurement = Measurement {
            t_s: 1.05,
            world_from_body: Pose::IDENTITY,
            twist,
            twist_of_terms: Twist::default(),
            record: &NoRecord,
            run: &run,
        };
        Term::default().measurement(&measurement, &mut gradient);
        assert_eq!(gradient, [Pose::new(-0.4, 0.0, 0.2)]);
    }
}
