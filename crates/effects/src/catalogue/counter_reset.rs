//! `counter_reset`: a counter reads zero, for a row or from then on.
//!
//! Model: with some probability a counter's register is cleared between two rows. It reads zero in one row
//! and comes back in the next, or it counts on from zero.
//! Signature: a row of zero among large counts; or a jump to about zero from which the counts go on. A gross
//! fault, tried before any fit: the records without it have such rows between their neighbours, or the counts
//! carried on.
//! Observability: the record itself, where the counts are far from zero.
//! Alias: `counter_wrap` where a counter that starts at zero is as far as it can count; `torn_read` where one
//! is a byte's step from zero.
//! Reference: microcontrollers that restart by their watchdog or for want of voltage; registers that are read
//! while a driver clears them.

use dataset::{Dataset, USUAL_COUNTER_BITS, WheelLog};
use kinematics::{Side, Wheels};
use serde::{Deserialize, Serialize};

use crate::benchmark::Benchmark;
use crate::description::{Description, RecordFault};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, Readout};
use crate::hypothesis::{Hypothesis, RecordCorrection, median_of_few, value_of};
use crate::on_board::OnBoard;
use crate::settings::{COUNTER_FAULTS, NEIGHBOUR_ROWS};
use crate::stream::Stream;

/// Counters that are cleared.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CounterReset {
    /// Probability that a counter is cleared before a row; before the first of a run it never is.
    pub probability: f64,
    /// Does it count on from zero? Else it comes back in the next row.
    #[serde(default)]
    pub persistent: bool,
}

impl PhysicalEffect for CounterReset {
    fn check(&self) -> Result<(), EffectError> {
        let probability = self.probability;
        let holds = (0.0..1.0).contains(&probability);
        EffectError::unless(holds, "counter_reset", "probability", probability, "in [0, 1)")
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { effect: *self, stream: None, last: None, zero: Wheels::both(0) }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Records(corrections)
    }

    fn description() -> Description {
        Description {
            record_fault: RecordFault { is_restored_roughly: true, ..RecordFault::WITH_A_TRACE },
            benchmark: Benchmark::of_fault(|_, stream| match stream.below(2) {
                0 => vec![("probability", stream.uniform_in(0.005, 0.02)), ("persistent", 0.0)],
                _ => vec![("probability", stream.uniform_in(0.001, 0.004)), ("persistent", 1.0)],
            }),
            on_board: OnBoard::Never("whether a counter was cleared or the wheel went back, later readings say alone"),
            ..Description::of("a counter is cleared, for a row or from then on")
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        Some(Self { probability: value_of(values, "probability")?, persistent: value_of(values, "persistent")? != 0.0 })
    }
}

struct State {
    effect: CounterReset,
    stream: Option<Stream>,
    last: Option<Wheels<i64>>,
    /// What the counter had counted when it was last cleared for good.
    zero: Wheels<i64>,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { seed_run: true, readout: true, ..Hooks::NONE }
    }

    fn seed_run(&mut self, stream: Stream) {
        *self = Self { effect: self.effect, stream: Some(stream), last: None, zero: Wheels::both(0) };
    }

    fn readout(&mut self, readout: &mut Readout) {
        let Some(stream) = &mut self.stream else { return };
        let counted = readout.ticks;
        for side in Side::BOTH {
            let (uniform, share) = (stream.uniform(), stream.uniform());
            let is_cleared = uniform < self.effect.probability;
            readout.ticks[side] = match self.last {
                // Cleared anywhere between the rows.
                Some(last) if is_cleared && self.effect.persistent => {
                    let since = (counted[side] - last[side]) as f64;
                    self.zero[side] = last[side] + (share * since).round() as i64;
                    counted[side] - self.zero[side]
                }
                Some(_) if is_cleared => 0,
                _ => counted[side] - self.zero[side],
            };
        }
        self.last = Some(counted);
    }
}

/// Increments of a column, and the rate around each.
struct Rates<'c> {
    t_s: &'c [f64],
    increments: Vec<f64>,
}

impl<'c> Rates<'c> {
    fn of(t_s: &'c [f64], ticks: &[i64]) -> Self {
        let increments = ticks.windows(2).map(|pair| pair[1].wrapping_sub(pair[0]) as f64).collect();
        Self { t_s, increments }
    }

    /// What the wheel may count from a row to the next, by the increments around it but the two largest: it
    /// may set off there, and a reset is one of them.
    fn may_count(&self, row: usize) -> f64 {
        let near = row.saturating_sub(NEIGHBOUR_ROWS)..(row + NEIGHBOUR_ROWS + 1).min(self.increments.len());
        let mut largest = [0.0_f64; 3];
        for size in near.map(|k| self.increments[k].abs()) {
            let place = largest.partition_point(|larger| *larger >= size);
            if place < largest.len() {
                largest[place..].rotate_right(1);
                largest[place] = size;
            }
        }
        far(largest[2])
    }

    /// What the wheel counts from a row to a later one, by the increments around the first.
    fn due(&self, from: usize, to: usize) -> f64 {
        let near = from.saturating_sub(NEIGHBOUR_ROWS)..(from + NEIGHBOUR_ROWS + 1).min(self.increments.len());
        let rates = near.filter(|k| self.t_s[k + 1] > self.t_s[*k]);
        let rates = rates.map(|k| self.increments[k] / (self.t_s[k + 1] - self.t_s[k]));
        median_of_few::<{ 2 * NEIGHBOUR_ROWS + 1 }>(rates).unwrap_or(0.0) * (self.t_s[to] - self.t_s[from])
    }
}

/// What a wheel counts over a stretch at the most, by what is due.
fn far(due: f64) -> f64 {
    COUNTER_FAULTS.far_increments * due.abs() + COUNTER_FAULTS.far_counts
}

/// Puts rows that read zero for a moment between their neighbours, and says how many there were.
fn fill_zero_rows(t_s: &[f64], ticks: &mut [i64]) -> usize {
    let rates = Rates::of(t_s, ticks);
    let (mut restored, mut row) = (0, 1);
    while row < ticks.len() {
        let before = row - 1;
        let end = (row..ticks.len()).find(|k| ticks[*k] != 0).unwrap_or(ticks.len());
        let is_zero = (1..=COUNTER_FAULTS.max_fault_rows).contains(&(end - row));
        if !is_zero || (ticks[before] as f64).abs() <= far(rates.due(before, row)) {
            row += 1;
            continue;
        }
        // Of the last rows of a log nobody knows whether they come back.
        let counted = match ticks.get(end) {
            Some(next) => (next - ticks[before]) as f64,
            None => rates.due(before, end - 1),
        };
        let last = end.min(ticks.len() - 1);
        let (from, passed_s) = (ticks[before], t_s[last] - t_s[before]);
        if counted.abs() <= COUNTER_FAULTS.max_counted_share * (from as f64).abs() && passed_s > 0.0 {
            for k in row..end {
                ticks[k] = from + (counted * (t_s[k] - t_s[before]) / passed_s).round() as i64;
                restored += 1;
            }
        }
        row = end;
    }
    restored
}

/// What the wheel counts up to a row at which its counter begins again at zero; `None` of another row.
fn reset_of(shown: &[i64], rates: &Rates<'_>, row: usize) -> Option<f64> {
    let [before, now] = [row - 1, row].map(|row| (shown[row] as f64).abs());
    // Near zero, from far off. It goes on from there, and does not come back.
    let most = if now < before { rates.may_count(row - 1) } else { return None };
    let goes_on = rates.increments.get(row).is_some_and(|next| next.abs() <= most);
    if now > most || before <= most || !goes_on {
        return None;
    }
    let due = rates.due(row - 1, row);
    let off = (rates.increments[row - 1] - due).abs();
    let most_off = 2.0 * due.abs() + COUNTER_FAULTS.far_counts;
    let wraps = |bits: &u8| (off - 2_f64.powi(i32::from(*bits))).abs() <= most_off;
    (off > most && !USUAL_COUNTER_BITS.iter().any(wraps)).then_some(due)
}

/// Carries the counts on where they begin again at zero, and says how often they did.
fn carry_on(t_s: &[f64], ticks: &mut [i64]) -> usize {
    let rates = Rates::of(t_s, ticks);
    let (mut carried, mut resets) = (0_i64, 0);
    let shown = ticks.to_vec();
    for row in 1..shown.len() {
        if let Some(due) = reset_of(&shown, &rates, row) {
            carried += shown[row - 1] + due.round() as i64 - shown[row];
            resets += 1;
        }
        ticks[row] += carried;
    }
    resets
}

fn corrections(dataset: &Dataset) -> Vec<RecordCorrection> {
    let without = |persistent: bool| {
        let (mut found, mut samples) = (0, 0);
        let mut records = dataset.clone();
        for run in &mut records.runs {
            if let WheelLog::Ticks(Wheels { left, right }) = &mut run.odometry.wheels {
                for column in [left, right] {
                    samples += column.len();
                    let t_s = &run.odometry.t_s;
                    found += if persistent { carry_on(t_s, column) } else { fill_zero_rows(t_s, column) };
                }
            }
        }
        let sentence = match persistent {
            true => format!("{found} times a counter begins again at zero"),
            false => format!("{found} counts read zero for a row, and come back in the next"),
        };
        (found > 0).then(|| RecordCorrection {
            values: vec![
                ("probability", found as f64 / samples as f64),
                ("persistent", f64::from(u8::from(persistent))),
            ],
            sentence,
            visible_in_log: persistent || found >= COUNTER_FAULTS.min_visible_faults,
            mistakes: 1,
            records,
        })
    };
    [false, true].into_iter().filter_map(without).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wheel that speeds up to 50 counts a row and keeps on, in rows of 10 ms.
    fn counted() -> (Vec<f64>, Vec<i64>) {
        let t_s: Vec<f64> = (0..1200).map(|row| 0.01 * f64::from(row)).collect();
        let count = |t_s: &f64| (5000.0 * (0.5 * t_s.min(1.0).powi(2) + (t_s - 1.0).max(0.0))).round() as i64;
        let ticks = t_s.iter().map(count).collect();
        (t_s, ticks)
    }

    #[test]
    fn a_row_of_zero_lies_between_its_neighbours() {
        let (t_s, whole) = counted();
        let mut ticks = whole.clone();
        [40, 300, 301, 900, 1199].into_iter().for_each(|row: usize| ticks[row] = 0);
        assert_eq!((fill_zero_rows(&t_s, &mut ticks), carry_on(&t_s, &mut ticks)), (5, 0));
        // Half of what the speed changes by in a row, and rounding.
        assert!(ticks.iter().zip(&whole).all(|(found, count)| (found - count).abs() <= 1));
    }

    #[test]
    fn counts_that_begin_again_at_zero_are_carried_on() {
        let (t_s, whole) = counted();
        let mut ticks = whole.clone();
        for (row, share) in [(400, 0), (800, 30)] {
            let zero = ticks[row - 1] + share;
            ticks[row..].iter_mut().for_each(|count| *count -= zero);
        }
        assert_eq!((fill_zero_rows(&t_s, &mut ticks.clone()), carry_on(&t_s, &mut ticks)), (0, 2));
        assert_eq!(ticks, whole);
    }

    #[test]
    fn a_wheel_at_zero_a_wrap_and_a_large_step_are_no_reset() {
        let (t_s, whole) = counted();
        let untouched = |ticks: &[i64]| {
            let mut own = ticks.to_vec();
            (fill_zero_rows(&t_s, &mut own), carry_on(&t_s, &mut own)) == (0, 0) && own == ticks
        };
        // Back over its zero, and standing there.
        let back: Vec<i64> = whole.iter().map(|count| (20_000 - count).clamp(0, 20_000)).collect();
        assert!(untouched(&whole) && untouched(&back));
        // From 0 to 2¹⁶: its end and its zero are beside each other.
        let wrapped: Vec<i64> = whole.iter().map(|count| (count + 30_000) % 65_536).collect();
        assert!(wrapped.windows(2).any(|pair| pair[1] < pair[0]) && untouched(&wrapped));
        let stepped: Vec<i64> =
            whole.iter().enumerate().map(|(row, count)| count - if row >= 600 { 9_000 } else { 0 }).collect();
        assert!(untouched(&stepped));
    }
}
