//! Contenders timed in turn. A machine that is busy for a while slows all contenders of a round, so that
//! ratios within a round keep their value.

use std::time::Instant;

use serde::{Deserialize, Serialize};

/// Turns of a contender in a round. The fastest counts: an interruption seldom hits all of them.
const TURNS: usize = 5;

/// One thing to be timed.
pub struct Contender<'a> {
    name: String,
    calls: u32,
    run: Box<dyn FnMut() + 'a>,
}

impl<'a> Contender<'a> {
    /// `run` is called `calls` times in a turn; a turn should take about a millisecond.
    pub fn new(name: impl Into<String>, calls: u32, run: impl FnMut() + 'a) -> Self {
        Self { name: name.into(), calls, run: Box::new(run) }
    }

    /// What tables call it.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Seconds of one call in the fastest turn.
    fn fastest_s(&mut self) -> f64 {
        let turn = |_| {
            let started = Instant::now();
            (0..self.calls).for_each(|_| (self.run)());
            started.elapsed().as_secs_f64() / f64::from(self.calls)
        };
        (0..TURNS).map(turn).fold(f64::INFINITY, f64::min)
    }
}

/// Seconds of one call of each contender (columns) in each round (rows).
#[derive(Debug, Clone, PartialEq)]
pub struct Race {
    rounds: Vec<Vec<f64>>,
}

impl Race {
    /// Times all contenders in turn, `rounds` times.
    #[must_use]
    pub fn run(rounds: usize, contenders: &mut [Contender<'_>]) -> Self {
        let round = |_| contenders.iter_mut().map(Contender::fastest_s).collect();
        Self { rounds: (0..rounds).map(round).collect() }
    }

    /// Seconds of one call of a contender: the median over rounds.
    #[must_use]
    pub fn seconds(&self, contender: usize) -> f64 {
        Ratio::of(self.rounds.iter().map(|round| round[contender]).collect()).median
    }

    /// How many times as fast `fast` is as `slow`.
    #[must_use]
    pub fn ratio(&self, slow: usize, fast: usize) -> Ratio {
        Ratio::of(self.rounds.iter().map(|round| round[slow] / round[fast]).collect())
    }
}

/// A ratio of times within one run: the median over rounds, and the quartiles.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ratio {
    /// Half of the rounds have less.
    pub median: f64,
    /// A quarter of the rounds has less.
    pub low: f64,
    /// A quarter of the rounds has more.
    pub high: f64,
}

impl Ratio {
    fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let quantile = |quarters: usize| values.get(values.len() * quarters / 4).copied().unwrap_or(f64::NAN);
        Self { median: quantile(2), low: quantile(1), high: quantile(3) }
    }

    /// The ratio where a call of `fast` does `scale` times the work of a call of `slow`.
    #[must_use]
    pub fn times(self, scale: f64) -> Self {
        Self { median: scale * self.median, low: scale * self.low, high: scale * self.high }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ratio_is_the_median_of_ratios_within_rounds_with_its_quartiles() {
        // Rounds of a machine that becomes ten times slower: ratios of medians would say otherwise.
        let rounds = vec![vec![2.0, 1.0], vec![30.0, 10.0], vec![40.0, 10.0], vec![5.0, 1.0]];
        let ratio = Race { rounds }.ratio(0, 1);
        assert_eq!(ratio, Ratio { median: 4.0, low: 3.0, high: 5.0 });
        assert_eq!(ratio.times(2.0), Ratio { median: 8.0, low: 6.0, high: 10.0 });
        assert!(Race { rounds: Vec::new() }.ratio(0, 1).median.is_nan());
    }

    #[test]
    fn every_contender_has_its_turns_in_every_round() {
        let calls = std::cell::Cell::new([0, 0]);
        let count = |k: usize| {
            move |calls: &std::cell::Cell<[u32; 2]>| {
                let mut all = calls.get();
                all[k] += 1;
                calls.set(all);
            }
        };
        let (first, second) = (count(0), count(1));
        let mut contenders =
            [Contender::new("first", 1, || first(&calls)), Contender::new("second", 3, || second(&calls))];
        let race = Race::run(4, &mut contenders);
        drop(contenders);
        assert_eq!(calls.get(), [4 * 5, 4 * 5 * 3]);
        assert!(race.seconds(0) >= 0.0);
    }
}
