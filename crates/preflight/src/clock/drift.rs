//! Clocks of instrument and robot that drift so far apart that one offset does not hold.
//!
//! Each short run, and each part of a long one, has a profile likelihood of its offset ([`super::profile`]).
//! Where the offset is proportional to the time since each run's start, or since the session's, a line goes
//! through these offsets. A part that lies off the line costs no more than a cap: its offset may be beyond
//! the range of the profiles. The offsets are found anew beside a clock of this rate, and the next line is
//! fitted to what is left, until nothing is left. Reference: Fischler & Bolles 1981 (RANSAC: lines through
//! pairs, judged by all parts).

use crate::clock::model::Clock;
use crate::clock::profile::{Profile, RunClock};
use crate::clock::search::ClockSearch;
use crate::settings::CLOCKS;

/// A clock that drifts against that of the log, in all runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClockDrift {
    /// The clock, with the rate and the offset in the middle of the log.
    pub clock: Clock,
    /// Standard deviation of the rate, seconds a second.
    pub sigma: f64,
    /// Log likelihood over that of one offset.
    pub gain: f64,
}

/// A part of a run: its time on the clock asked for, seconds, and its profile.
struct Part<'p> {
    since_s: f64,
    profile: &'p Profile,
}

/// An offset that grows with the time.
#[derive(Debug, Clone, Copy)]
struct Line {
    at_start_s: f64,
    slope: f64,
}

impl Line {
    /// The offset of a part, seconds.
    fn at(self, part: &Part<'_>) -> f64 {
        self.at_start_s + self.slope * part.since_s
    }

    /// The residual of a part's offset, over that at which its clock is another one.
    fn residual(self, part: &Part<'_>) -> f64 {
        (part.profile.offset_s - self.at(part)) / part.profile.tolerance_s()
    }
}

impl ClockSearch<'_> {
    /// Looks for a drift beside a clock, by which the offset is so far from its mean at the ends at the
    /// least.
    #[must_use]
    pub fn drift(&self, near: Clock, min_offset_s: f64) -> Option<ClockDrift> {
        let first = self.profiles(near);
        // In a single run both are one, and the last of equals is taken: the run's.
        let lines = [true, false].map(|of_session| {
            // Through two or three clocks that were set one by one a line may go by chance.
            if of_session && (2..CLOCKS.min_drift_parts).contains(&first.len()) {
                return None;
            }
            let parts = parts_of(&first, of_session);
            Some((of_session, span_s(&parts), drift_of(&parts, min_offset_s)?))
        });
        let of_all = lines.into_iter().flatten().max_by(|a, b| a.2.1.total_cmp(&b.2.1))?;
        let (of_session, [first_s, last_s], (mut line, mut gain)) = of_all;
        let (middle_s, span_s) = (0.5 * (first_s + last_s), last_s - first_s);
        let mut clock = Clock { of_session, middle_s, ..near };
        for steps in 1.. {
            clock.offset_s += line.at_start_s + line.slope * middle_s;
            clock.rate = (1.0 + clock.rate) / (1.0 - line.slope) - 1.0;
            let found = self.profiles(clock);
            let parts = parts_of(&found, of_session);
            let (next, sigma) = line_of(&parts)?;
            gain += gain_of(&parts, next);
            line = next;
            if steps == CLOCKS.max_drift_steps || (line.slope * span_s).abs() < 0.1 * CLOCKS.step_s {
                return Some(ClockDrift { clock, sigma, gain });
            }
        }
        None
    }
}

/// The parts of all runs by their time since the session's start or the run's, not too many of them.
fn parts_of(clocks: &[RunClock], of_session: bool) -> Vec<Part<'_>> {
    let of_run = |clock: &'_ RunClock| if of_session { clock.start_s } else { 0.0 };
    let all: Vec<Part<'_>> = clocks
        .iter()
        .flat_map(|clock| clock.parts.iter().map(move |(run_s, profile)| (clock, run_s, profile)))
        .map(|(clock, run_s, profile)| Part { since_s: of_run(clock) + run_s, profile })
        .collect();
    let every = all.len().div_ceil(CLOCKS.max_drift_parts).max(1);
    all.into_iter().step_by(every).collect()
}

/// A line that explains parts better than any one offset, and by how much.
fn drift_of(parts: &[Part<'_>], min_offset_s: f64) -> Option<(Line, f64)> {
    if parts.len() < CLOCKS.min_drift_parts {
        return None;
    }
    let (line, _) = line_of(parts)?;
    let gain = gain_of(parts, line);
    let [first_s, last_s] = span_s(parts);
    let at_ends_s = 0.5 * (line.slope * (last_s - first_s)).abs();
    (gain > CLOCKS.min_gain && at_ends_s >= min_offset_s && line.slope.abs() <= CLOCKS.max_rate).then_some((line, gain))
}

/// Log likelihood of a line over that of the best of the parts' own offsets for all.
fn gain_of(parts: &[Part<'_>], line: Line) -> f64 {
    let even = parts.iter().map(|part| Line { at_start_s: part.profile.offset_s, slope: 0.0 });
    let even = even.map(|line| cost(parts, line)).fold(f64::INFINITY, f64::min);
    even - cost(parts, line)
}

/// Of the lines through two parts the likeliest by all, fitted to the parts near it by weighted least
/// squares, and the standard deviation of its slope.
fn line_of(parts: &[Part<'_>]) -> Option<(Line, f64)> {
    let through = |(a, b): (&Part<'_>, &Part<'_>)| {
        let slope = (b.profile.offset_s - a.profile.offset_s) / (b.since_s - a.since_s);
        slope.is_finite().then_some(Line { at_start_s: a.profile.offset_s - slope * a.since_s, slope })
    };
    let pairs = parts.iter().enumerate().flat_map(|(k, a)| parts[k + 1..].iter().map(move |b| (a, b)));
    let likeliest = pairs.filter_map(through).map(|line| (cost(parts, line), line));
    let (_, line) = likeliest.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let [mut n, mut x, mut xx, mut y, mut xy] = [0.0; 5];
    for part in parts.iter().filter(|part| line.residual(part).abs() < 1.0) {
        let (weight, since_s, offset_s) = (part.profile.sigma_s.powi(-2), part.since_s, part.profile.offset_s);
        (n, x, xx) = (n + weight, x + weight * since_s, xx + weight * since_s * since_s);
        (y, xy) = (y + weight * offset_s, xy + weight * since_s * offset_s);
    }
    let determinant = n * xx - x * x;
    let slope = (n * xy - x * y) / determinant;
    let fitted = if slope.is_finite() { Line { at_start_s: (y - slope * x) / n, slope } } else { line };
    Some((fitted, (n / determinant).sqrt()))
}

/// Negative log likelihood of a line. What a part loses is bounded by the square of its residual, since its
/// offset is uncertain by up to what makes another clock, and by a cap beyond that.
fn cost(parts: &[Part<'_>], line: Line) -> f64 {
    let of = |part: &Part<'_>| {
        let most = CLOCKS.min_gain * line.residual(part).powi(2).min(1.0);
        part.profile.gain_over(line.at(part)).min(most)
    };
    parts.iter().map(of).sum()
}

/// The times of the first and of the last part.
fn span_s(parts: &[Part<'_>]) -> [f64; 2] {
    let since = parts.iter().map(|part| part.since_s);
    since.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], s| [a.min(s), b.max(s)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::driven_runs::driven;
    use dataset::Dataset;

    /// Runs every so many seconds, whose poses are of so long before their stamps.
    fn every(seconds: f64, offsets_s: &[f64]) -> [Dataset; 1] {
        let mut dataset = driven(offsets_s);
        for (number, run) in dataset.runs.iter_mut().enumerate() {
            run.info.start_s = Some(seconds * number as f64);
        }
        [dataset]
    }

    fn sought(offsets_s: &[f64], near: Clock) -> Option<ClockDrift> {
        ClockSearch::of(&every(100.0, offsets_s), |_| true).drift(near, 0.15)
    }

    #[test]
    fn an_offset_that_grows_from_run_to_run_is_a_clock_that_gains() {
        let offsets_s = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6];
        let found = sought(&offsets_s, Clock::default()).expect("it drifts");
        let ClockDrift { clock, sigma, gain } = found;
        // A millisecond a second. Poses are taken at hundredths of a second, over ten minutes.
        assert!(clock.of_session && (clock.rate - 1e-3).abs() < 2e-5, "{found:?}");
        assert!(sigma > 0.0 && sigma < 5e-5 && gain > CLOCKS.min_gain, "{found:?}");
        assert!(sought(&offsets_s, clock).is_none(), "nothing is left");
        // Of the last run's stamps 0.6 s are taken, and a thousandth of its own.
        assert!((10.0 - clock.log_s(600.0, 10.0) - 0.61).abs() < 0.02);
    }

    #[test]
    fn one_clock_for_all_an_odd_run_and_what_the_fit_takes_are_no_drift() {
        let drifts = |offsets_s: &[f64]| sought(offsets_s, Clock::default()).is_some();
        assert!(!drifts(&[0.3; 7]) && !drifts(&[0.0, 0.0, 0.0, 0.4, 0.0, 0.0, 0.0]));
        assert!(!drifts(&[0.0, 0.04, 0.08, 0.12, 0.16, 0.2, 0.24]), "0.12 s from its mean at the ends");
        assert!(!drifts(&[0.0, 0.3, 0.6]), "through three runs a line may go by chance");
    }

    #[test]
    fn runs_beyond_what_is_sought_do_not_hide_the_line_through_the_others() {
        // Of the last ones the offset is beyond a second, until the line is taken off.
        let offsets_s = [0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75];
        let found = sought(&offsets_s, Clock::default()).expect("it drifts");
        assert!((found.clock.rate - 2.5e-3).abs() < 3e-5, "{found:?}");
    }
}
