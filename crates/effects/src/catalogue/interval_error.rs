//! `interval_error`: the log's stamps are irregular, and the irregularity is not true.
//!
//! Model: a row that is due at t is stamped t + η with η uniform, and read at t + (1 − σ) η: a share σ of the stamps' irregularity is false. Signature: an
//! interval whose length departs from the usual one by ξ is off by σξ(v, 0, ω); where speeds are logged and not counts, by −σξ(v, 0, ω), a negative share.
//! Observability: a moving robot and an irregular log; looks between the rows blur it. Alias: wheel noise, but for the slope against ξ.
//! Reference: stamps given on receipt, by a scheduler that is late, of readings that a timer takes; milliseconds.

use std::collections::VecDeque;

use dataset::{Interval, ModelTerm, RunInfo, TermParameter};
use kinematics::{Pose, Wheels};
use serde::{Deserialize, Serialize};

use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, SampleClock};
use crate::hypothesis::{Hypothesis, Shape, size};
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

/// Rows of a beat that no other has shown the length of before there is a line through them.
const LEAST_ROWS: f64 = 8.0;
/// Rows after which a row counts for the beat by a part e less: a log's clock need not keep one beat all day.
const MEMORY_ROWS: f64 = 500.0;
/// A row that is farther from its beat than this share of it is no jitter: the log has missed its beat, and a new one begins.
const MISSED: f64 = 0.45;

/// The regular beat behind the rows: a line through the rows' times over the numbers of their beats, with one slope for all beats of the log.
#[derive(Default)]
struct Term {
    /// Of the rows of this beat: weight, means of number and time, and sums of squares and products about them.
    rows: f64,
    mean: [f64; 2],
    square: f64,
    product: f64,
    /// The same sums of the beats before.
    before: [f64; 2],
    /// The last row: the number of its beat, and its time.
    last: Option<(f64, f64)>,
    /// How late the last row was by its beat; 0 while there is none.
    late_s: f64,
    /// The logged interval whose parts come in.
    row: Option<Row>,
    /// Length and travel of the rows before, of a beat that goes on.
    recent: VecDeque<(f64, Wheels<f64>)>,
}

/// A logged interval.
#[derive(Clone, Copy)]
struct Row {
    end_s: f64,
    length_s: f64,
    /// By how much more its end is late than its start, seconds.
    later_s: f64,
    /// Of the wheels, by the rows before.
    speed_m_s: Wheels<f64>,
    /// What came in so far.
    travel_m: Wheels<f64>,
}

/// Rows whose speed is taken for that of the wheels, the last of them left out.
const RECENT: usize = 5;
/// A wheel that went faster by this than it goes now has changed its speed.
const CHANGES: f64 = 1.5;

impl Term {
    /// When beat 0 is and the time between two beats, where rows enough are known.
    fn line(&self) -> Option<(f64, f64)> {
        let [square, product] = [self.square + self.before[0], self.product + self.before[1]];
        let known = self.before[0] > 0.0 || self.rows >= LEAST_ROWS;
        (known && self.rows > 0.0 && square > 0.0).then(|| {
            let between_s = product / square;
            (self.mean[1] - between_s * self.mean[0], between_s)
        })
    }

    /// Takes a row of the beat, by Welford's recursion.
    fn add(&mut self, beat: f64, time_s: f64) {
        let keeps = 1.0 - 1.0 / MEMORY_ROWS;
        self.rows = keeps * self.rows + 1.0;
        let off = [beat - self.mean[0], time_s - self.mean[1]];
        for (mean, off) in self.mean.iter_mut().zip(off) {
            *mean += off / self.rows;
        }
        self.square = keeps * self.square + off[0] * (beat - self.mean[0]);
        self.product = keeps * self.product + off[0] * (time_s - self.mean[1]);
        self.last = Some((beat, time_s));
    }

    /// A new beat begins; how long one lasts stays known, if enough rows have shown it.
    fn new_beat(&mut self) {
        let knows = self.rows >= LEAST_ROWS;
        let before = if knows { [self.before[0] + self.square, self.before[1] + self.product] } else { self.before };
        *self = Self { before, ..Self::default() };
    }

    /// Takes the row that ends an interval: by how much more than at the row before it is late, seconds.
    fn next_row(&mut self, from_s: f64, row_s: f64) -> f64 {
        let Some((last, last_s)) = self.last else {
            self.add(0.0, from_s);
            self.add(1.0, row_s);
            return 0.0;
        };
        let line = self.line();
        let between_s =
            line.map_or_else(|| (last_s - self.mean[1]) / (last - self.mean[0]), |(_, between_s)| between_s);
        let beats = ((row_s - last_s) / between_s).round();
        if beats.is_nan() || beats < 1.0 {
            return 0.0; // Between two beats: the row of a standstill.
        }
        let late_s = line.map(|(zero_s, between_s)| row_s - zero_s - (last + beats) * between_s);
        if late_s.is_some_and(|late_s| late_s.abs() > MISSED * between_s) {
            self.new_beat();
            self.add(-1.0, row_s - between_s);
            self.add(0.0, row_s);
            return 0.0;
        }
        // A beat most often begins where a run or a standstill does: nothing had been late then.
        let later_s = late_s.map_or(0.0, |late_s| late_s - self.late_s);
        self.late_s = late_s.unwrap_or(0.0);
        self.add(last + beats, row_s);
        later_s
    }

    /// The speed of the wheels by rows that have nothing to do with when this one and the one before were stamped: the speed of an interval by its own stamps goes
    /// with their errors, and would lengthen or shorten all ways.
    fn speed_m_s(&self, now_m_s: Wheels<f64>) -> Wheels<f64> {
        let known = self.recent.iter().take(self.recent.len().saturating_sub(1));
        let (length_s, travel_m) = known.fold((0.0, Wheels::both(0.0)), |(length_s, sum), (of_row_s, travel_m)| {
            (length_s + of_row_s, sum.zip_with(*travel_m, |sum, travel_m| sum + travel_m))
        });
        if length_s <= 0.0 {
            return Wheels::both(0.0);
        }
        // At a start or a stop the rows before say little.
        travel_m
            .zip_with(now_m_s, |travel_m, now| (travel_m / length_s).clamp(-CHANGES * now.abs(), CHANGES * now.abs()))
    }
}

impl ModelTerm for Term {
    /// Plausible: all of it.
    fn parameters(&self) -> &'static [TermParameter] {
        &[TermParameter { name: "share", unit: "1", plausible: 1.0 }]
    }

    fn restart(&mut self, _run: &RunInfo) {
        self.new_beat();
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        let [from_s, row_s] = interval.row_s;
        if self.row.is_none_or(|row| row.end_s != row_s) {
            if let Some(Row { length_s, travel_m, .. }) = self.row.take() {
                self.recent.push_back((length_s, travel_m));
                if self.recent.len() > RECENT {
                    self.recent.pop_front();
                }
            }
            let later_s = self.next_row(from_s, row_s);
            let speed_m_s = self.speed_m_s(interval.speed_m_s());
            self.row =
                Some(Row { end_s: row_s, length_s: row_s - from_s, later_s, speed_m_s, travel_m: Wheels::both(0.0) });
        }
        let Some(row) = &mut self.row else { return };
        row.travel_m = row.travel_m.zip_with(interval.travel_m, |sum, travel_m| sum + travel_m);
        if row.length_s > 0.0 {
            let late_s = row.later_s * interval.dt_s / row.length_s;
            gradient[0] = interval.change(row.speed_m_s.map(|speed_m_s| speed_m_s * late_s));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Address, StreamName};

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
