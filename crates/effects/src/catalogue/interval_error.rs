//! `interval_error`: the log's stamps are irregular, and the irregularity is not true.
//!
//! Model: a row that is due at t is stamped t + η with η uniform, and read at t + (1 − σ) η: a share σ of the stamps' irregularity is false. Signature: an
//! interval whose length departs from the usual one by ξ is off by σξ(v, 0, ω); where speeds are logged and not counts, by −σξ(v, 0, ω), a negative share.
//! Observability: a moving robot and an irregular log; looks between the rows blur it. Alias: wheel noise, but for the slope against ξ.
//! Reference: stamps given on receipt, by a scheduler that is late, of readings that a timer takes; milliseconds.

use std::collections::VecDeque;

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
        Some(Box::new(State { size: *self, stream: None, last_s: f64::NEG_INFINITY }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Terms(Shape::plain(Term::default()))
    }

    /// A share that was found beyond all of it is all of it; a negative one is of a log of speeds, which the simulator does not write.
    fn of_sizes(sizes: &[(&str, f64)]) -> Option<Self> {
        Some(Self {
            share: size(sizes, "share")?.min(1.0),
            jitter_s: size(sizes, "jitter_s").unwrap_or(USUAL_JITTER_S),
        })
    }
}

struct State {
    size: IntervalError,
    stream: Option<Stream>,
    /// The last stamp: no log goes back.
    last_s: f64,
}

/// Rows that would be stamped out of order are stamped this much after one another, seconds.
const NEXT_S: f64 = 1e-4;

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { start_run: true, clock: true, ..Hooks::NONE }
    }

    fn start_run(&mut self, stream: Stream) {
        (self.stream, self.last_s) = (Some(stream), f64::NEG_INFINITY);
    }

    fn clock(&mut self, sample: &mut SampleClock) {
        let Some(stream) = &mut self.stream else { return };
        let late_s = stream.uniform_about_zero(self.size.jitter_s).max(self.last_s + NEXT_S - sample.stamp_s);
        sample.stamp_s += late_s;
        self.last_s = sample.stamp_s;
        sample.read_s = sample.read_s.map(|read_s| read_s + (1.0 - self.size.share) * late_s);
    }
}

/// Rows from which the beat is taken: the last ones, so many that their own jitter tells little, and at least so many that it is a beat.
const ROWS: std::ops::RangeInclusive<usize> = 8..=64;

/// A row that is farther from its beat than this share of it is no jitter: the log has missed its beat, and a new one begins.
const MISSED: f64 = 0.45;

/// The regular beat behind the rows: a line through the last rows' times over the numbers of their beats.
#[derive(Default)]
struct Term {
    rows: VecDeque<(f64, f64)>,
    /// How late the last row was by its beat; 0 while there is none.
    late_s: f64,
    /// End of the logged interval whose parts come in, and by which share of it what came before its end was late.
    row: Option<(f64, f64)>,
}

impl Term {
    /// When beat 0 is and the time between two beats, where rows enough are known.
    fn line(&self) -> Option<(f64, f64)> {
        if self.rows.len() < *ROWS.start() {
            return None;
        }
        #[allow(clippy::cast_precision_loss)]
        let n = self.rows.len() as f64;
        let mean = |of: fn(&(f64, f64)) -> f64| self.rows.iter().map(of).sum::<f64>() / n;
        let (beat, time_s) = (mean(|row| row.0), mean(|row| row.1));
        let (square, product) = self.rows.iter().fold((0.0, 0.0), |(square, product), row| {
            (square + (row.0 - beat).powi(2), product + (row.0 - beat) * (row.1 - time_s))
        });
        let between_s = product / square;
        Some((time_s - between_s * beat, between_s))
    }
}

impl ModelTerm for Term {
    /// Plausible: all of it.
    fn parameters(&self) -> &'static [TermParameter] {
        &[TermParameter { name: "share", unit: "1", plausible: 1.0 }]
    }

    fn restart(&mut self, _run: &RunInfo) {
        *self = Self::default();
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        let [from_s, row_s] = interval.row_s;
        let share = match self.row {
            Some((known_s, share)) if known_s == row_s => share,
            _ => {
                let share = self.next_row(from_s, row_s);
                self.row = Some((row_s, share));
                share
            }
        };
        gradient[0] = interval.change(interval.travel_m.map(|travel_m| share * travel_m));
    }
}

impl Term {
    /// Takes a row: by which share of its length the interval that ends there is late.
    fn next_row(&mut self, from_s: f64, row_s: f64) -> f64 {
        let line = self.line();
        let Some(&(last, last_s)) = self.rows.back() else {
            self.rows.extend([(0.0, from_s), (1.0, row_s)]);
            return 0.0;
        };
        let gaps_s = || self.rows.iter().zip(self.rows.range(1..)).map(|(a, b)| (b.1 - a.1) / (b.0 - a.0)).collect();
        let Some(between_s) = line.map(|(_, between_s)| between_s).or_else(|| median(gaps_s())) else { return 0.0 };
        let beats = ((row_s - last_s) / between_s).round();
        if beats < 1.0 {
            return 0.0; // Between two beats: the row of a standstill.
        }
        let late_s = line.map(|(zero_s, between_s)| row_s - zero_s - (last + beats) * between_s);
        if late_s.is_some_and(|late_s| late_s.abs() > MISSED * between_s) {
            *self = Self { rows: VecDeque::from([(-1.0, row_s - between_s), (0.0, row_s)]), ..Self::default() };
            return 0.0;
        }
        // A beat most often begins where a run or a standstill does: nothing had been late then. The counts are of whole beats: by the length that was
        // logged, speeds would average too low.
        let share = late_s.map_or(0.0, |late_s| (late_s - self.late_s) / (beats * between_s));
        self.late_s = late_s.unwrap_or(0.0);
        self.rows.push_back((last + beats, row_s));
        if self.rows.len() > *ROWS.end() {
            self.rows.pop_front();
        }
        share
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
