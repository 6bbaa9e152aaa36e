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

/// Rows from which a beat is found: the line through so many is off by a twentieth of what stamps jitter by, a beat.
const LEAST_ROWS: usize = 24;
/// Rows after which a row counts for the beat by a part e less: a log's clock need not keep one beat all day.
const MEMORY_ROWS: f64 = 500.0;
/// Stamps that jitter by a third of the beat make a gap of one beat as long as this many, and no longer; with a row lost in it, hardly one as short.
const ONE_BEAT: f64 = 1.7;
/// Nor as short as this: such a row came by itself, at a standstill.
const NO_BEAT: f64 = 0.3;
/// A row that is farther from its beat than this share of it has missed it.
const MISSED: f64 = 0.45;
/// After so many in a row the log keeps another beat.
const MOST_MISSED: u32 = 3;

/// The regular beat behind a run's rows: a line through their times over the numbers of their beats.
#[derive(Clone, Default)]
struct Term {
    /// Times of the rows from which the beat is yet to be found.
    first_s: Vec<f64>,
    /// Of the rows of the beat: weight, means of number and time, and sums of squares and products about them.
    rows: f64,
    mean: [f64; 2],
    square: f64,
    product: f64,
    /// The number of the last.
    last: f64,
    /// Rows since the last that kept to the beat.
    missed: u32,
    /// How late the last row was by its beat, or the last before it that had one; 0 before any had.
    late_s: f64,
    /// What that makes of the wheels' ways at the last row, for a share of one.
    off_m: Wheels<f64>,
    /// The logged interval whose parts come in.
    row: Option<Row>,
    /// Length and travel of the rows before.
    recent: VecDeque<(f64, Wheels<f64>)>,
}

/// A logged interval.
#[derive(Clone, Copy)]
struct Row {
    end_s: f64,
    length_s: f64,
    /// What its end being late makes of the wheels' ways beyond what its start does.
    gained_m: Wheels<f64>,
    /// What came in so far.
    travel_m: Wheels<f64>,
}

/// Rows whose speed is taken for that of the wheels, the last of them left out.
const RECENT: usize = 5;
/// A wheel that went faster by this than it goes now has changed its speed.
const CHANGES: f64 = 1.5;

impl Term {
    /// When beat 0 is and the time between two beats, where that is known.
    fn line(&self) -> Option<(f64, f64)> {
        (self.square > 0.0).then(|| {
            let between_s = self.product / self.square;
            (self.mean[1] - between_s * self.mean[0], between_s)
        })
    }

    /// Takes a row of the beat, by Welford's recursion.
    fn add(&mut self, beat: f64, time_s: f64) {
        self.last = beat;
        let keeps = 1.0 - 1.0 / MEMORY_ROWS;
        self.rows = keeps * self.rows + 1.0;
        let off = [beat - self.mean[0], time_s - self.mean[1]];
        for (mean, off) in self.mean.iter_mut().zip(off) {
            *mean += off / self.rows;
        }
        self.square = keeps * self.square + off[0] * (beat - self.mean[0]);
        self.product = keeps * self.product + off[0] * (time_s - self.mean[1]);
    }

    /// Takes a row before anything is known of the beat. Once there are enough of them, their gaps are so many times the middle one.
    fn warm_up(&mut self, from_s: f64, row_s: f64) {
        if self.first_s.is_empty() {
            self.first_s.push(from_s);
        }
        self.first_s.push(row_s);
        if self.first_s.len() <= LEAST_ROWS {
            return;
        }
        let rows_s = std::mem::take(&mut self.first_s);
        let mut gaps_s: Vec<f64> = rows_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        gaps_s.sort_by(f64::total_cmp);
        let between_s = gaps_s[gaps_s.len() / 2];
        let (mut beat, mut last_s) = (0.0, rows_s[0]);
        self.add(beat, last_s);
        for &row_s in &rows_s[1..] {
            let gap = (row_s - last_s) / between_s;
            if gap > NO_BEAT {
                beat += if gap < ONE_BEAT { 1.0 } else { gap.round() };
                last_s = row_s;
                self.add(beat, row_s);
            }
        }
        self.late_s = self.line().map_or(0.0, |(zero_s, between_s)| last_s - zero_s - beat * between_s);
    }

    /// Takes the row that ends an interval: how late it is.
    fn next_row(&mut self, from_s: f64, row_s: f64) {
        let Some((zero_s, between_s)) = self.line() else {
            self.warm_up(from_s, row_s);
            return;
        };
        let beat = ((row_s - zero_s) / between_s).round();
        if beat <= self.last {
            return; // It came by itself, at a standstill.
        }
        let late_s = row_s - zero_s - beat * between_s;
        if late_s.abs() > MISSED * between_s {
            self.missed += 1;
            if self.missed >= MOST_MISSED {
                let (late_s, off_m) = (self.late_s, self.off_m);
                *self = Self { recent: std::mem::take(&mut self.recent), late_s, off_m, ..Self::default() };
            }
            return;
        }
        self.missed = 0;
        self.late_s = late_s;
        self.add(beat, row_s);
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
        *self = Self::default();
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
            self.next_row(from_s, row_s);
            // What a late stamp makes of a way is gone with the next one: only the speed then and the row count.
            let off_m = self.speed_m_s(interval.speed_m_s()).map(|speed_m_s| speed_m_s * self.late_s);
            let gained_m = off_m.zip_with(std::mem::replace(&mut self.off_m, off_m), |now, before| now - before);
            self.row = Some(Row { end_s: row_s, length_s: row_s - from_s, gained_m, travel_m: Wheels::both(0.0) });
        }
        let Some(row) = &mut self.row else { return };
        row.travel_m = row.travel_m.zip_with(interval.travel_m, |sum, travel_m| sum + travel_m);
        if row.length_s > 0.0 {
            let share = interval.dt_s / row.length_s;
            gradient[0] = interval.change(row.gained_m.map(|gained_m| gained_m * share));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Address, StreamName};

    #[test]
    fn a_jitter_of_a_third_of_the_beat_is_late_and_early_alike() {
        let (between_s, jitter_s, rows) = (0.025, 0.008, 2000_u32);
        for seed in 0..50 {
            let mut stream = Address { seed, point: 0, trial: 0, run: 0 }.stream(StreamName::new("test"));
            let mut stamp_s = |row: u32| between_s * f64::from(row) + stream.uniform_about_zero(jitter_s);
            let mut term = Term::default();
            let (mut before_s, mut square) = (stamp_s(0), 0.0);
            for row in 1..rows {
                let row_s = stamp_s(row).max(before_s + 1e-3);
                term.next_row(before_s, row_s);
                square += term.late_s * term.late_s;
                // Never later than a row can be: 8 ms either way, and what the line through the first rows does not know of the beat.
                assert!(term.late_s.abs() < between_s, "seed {seed} row {row}: {}", term.late_s);
                before_s = row_s;
            }
            // A uniform error.
            let expected = jitter_s * jitter_s / 3.0;
            let seen = square / f64::from(rows);
            assert!((0.8..1.2).contains(&(seen / expected)), "seed {seed}: {}", seen / expected);
        }
    }

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
