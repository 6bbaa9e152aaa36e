//! `interval_error`: the log's stamps are irregular, and the irregularity is not true.
//!
//! Model: a row that is due at t is stamped t + η with η uniform, and read at t + (1 − σ) η: a share σ of the stamps' irregularity is false. Signature: an
//! interval whose length departs from the usual one by ξ is off by σξ(v, 0, ω); where speeds are logged and not counts, by −σξ(v, 0, ω), a negative share.
//! Observability: a moving robot and an irregular log; looks between the rows blur it. Alias: wheel noise, but for the slope against ξ.
//! Reference: stamps given on receipt, by a scheduler that is late, of readings that a timer takes; milliseconds.

use dataset::{Interval, ModelTerm, RunInfo, TermParameter};
use kinematics::Pose;
use serde::{Deserialize, Serialize};

use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, SampleClock};
use crate::hypothesis::{Hypothesis, Shape, median, size};
use crate::stream::Stream;

/// Irregular stamps.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IntervalError {
    /// Share of the irregularity that is false (σ), 0 to 1.
    pub share: f64,
    /// Every stamp is uniform within ± this of its due time, seconds.
    pub jitter_s: f64,
}

/// The irregularity of a fitted effect, seconds: data show the share that is false, and their own irregularity.
const USUAL_JITTER_S: f64 = 0.005;

impl PhysicalEffect for IntervalError {
    fn check(&self) -> Result<(), EffectError> {
        let id = "interval_error";
        EffectError::unless((0.0..=1.0).contains(&self.share), id, "share", self.share, "from 0 to 1")?;
        EffectError::unless_sizes(id, [("jitter_s", self.jitter_s)])
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { size: *self, stream: None }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Terms(Shape::plain(Term { lengths_s: Vec::new() }))
    }

    fn of_sizes(sizes: &[(&str, f64)]) -> Option<Self> {
        Some(Self { share: size(sizes, "share")?, jitter_s: size(sizes, "jitter_s").unwrap_or(USUAL_JITTER_S) })
    }
}

struct State {
    size: IntervalError,
    stream: Option<Stream>,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { start_run: true, clock: true, ..Hooks::NONE }
    }

    fn start_run(&mut self, stream: Stream) {
        self.stream = Some(stream);
    }

    fn clock(&mut self, sample: &mut SampleClock) {
        let Some(stream) = &mut self.stream else { return };
        let late_s = stream.uniform_about_zero(self.size.jitter_s);
        sample.stamp_s += late_s;
        sample.read_s = sample.read_s.map(|read_s| read_s + (1.0 - self.size.share) * late_s);
    }
}

/// Intervals from which the usual one is taken: enough for a median, few enough to sort every time.
const REMEMBERED: usize = 64;

struct Term {
    lengths_s: Vec<f64>,
}

impl ModelTerm for Term {
    /// Plausible: all of it.
    fn parameters(&self) -> &'static [TermParameter] {
        &[TermParameter { name: "share", unit: "1", plausible: 1.0 }]
    }

    fn restart(&mut self, _run: &RunInfo) {
        self.lengths_s.clear();
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        if self.lengths_s.len() < REMEMBERED {
            self.lengths_s.push(interval.dt_s);
        }
        let Some(usual_s) = median(self.lengths_s.clone()) else { return };
        let excess_s = interval.dt_s - usual_s;
        // Half as long or half as long again is a gap or a row out of turn, and no jitter.
        if interval.dt_s > 0.0 && excess_s.abs() < 0.5 * usual_s {
            let share = excess_s / interval.dt_s;
            gradient[0] = interval.change(interval.travel_m.map(|travel_m| share * travel_m));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Address, StreamName};
    use kinematics::Wheels;

    #[test]
    fn a_false_share_of_the_stamp_is_not_in_the_reading() {
        let size = IntervalError { share: 0.25, jitter_s: 0.004 };
        let mut state = size.forward().expect("acts on the clock");
        state.start_run(Address { seed: 1, point: 0, trial: 0, run: 0 }.stream(StreamName::new("test")));
        for row in 0..1000 {
            let due_s = f64::from(row);
            let mut sample = SampleClock { stamp_s: due_s, read_s: Wheels::both(due_s) };
            state.clock(&mut sample);
            let (stamp_s, read_s) = (sample.stamp_s - due_s, sample.read_s.left - due_s);
            assert!(stamp_s.abs() <= 0.004 + 1e-12 && (read_s - 0.75 * stamp_s).abs() < 1e-12);
        }
    }
}
