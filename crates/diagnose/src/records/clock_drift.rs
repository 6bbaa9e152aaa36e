//! Clocks of instrument and robot that drift so far apart that one offset does not hold.
//!
//! Each short run, and each part of a long one, has a profile likelihood of its offset
//! ([`crate::records::clock_profile`]). Where the offset is proportional to the time since each run's start,
//! or since the session's, a line goes through these offsets. A part that lies off the line costs no more
//! than a cap: its offset may be beyond the range of the profiles. The line is taken off the measurements'
//! times, and the next one is fitted to what is left, until nothing is left. What the model fit finds of the
//! rate later is added. Reference: Fischler & Bolles 1981 (RANSAC: lines through pairs, judged by all parts).

use dataset::Dataset;

use crate::records::clock_profile::{Profile, RunClock};
use crate::settings::RECORDS;

/// A drift of the robot's clock against the instrument's, in all runs.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ClockDrift {
    /// What the robot's clock gains, seconds a second, and its standard deviation.
    pub(crate) rate: f64,
    pub(crate) sigma: f64,
    /// The clocks agreed when the session began, and not at the start of each run.
    pub(crate) of_session: bool,
    /// Log likelihood over that of one offset.
    pub(crate) gain: f64,
}

/// A drift, and the records without it.
pub(crate) struct DriftFound {
    pub(crate) drift: ClockDrift,
    pub(crate) records: Vec<Dataset>,
    /// The clocks of their runs.
    pub(crate) clocks: Vec<RunClock>,
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

/// Looks for a drift by which the offset is so far from its mean at the ends at the least.
pub(crate) fn clock_drift(datasets: &[Dataset], clocks: &[RunClock], min_offset_s: f64) -> Option<DriftFound> {
    // In a single run both are one, and the last of equals is taken: the run's.
    let lines =
        [true, false].map(|of_session| Some((of_session, drift_of(&parts_of(clocks, of_session), min_offset_s)?)));
    let (of_session, (first, mut gain)) = lines.into_iter().flatten().max_by(|a, b| a.1.1.total_cmp(&b.1.1))?;
    let mut records = datasets.to_vec();
    let (mut slope, mut time_scale, mut steps) = (first.slope, 1.0, 0);
    loop {
        correct_times(&mut records, slope, of_session);
        time_scale *= 1.0 - slope;
        let clocks = RunClock::of_all(&records);
        let parts = parts_of(&clocks, of_session);
        let (line, sigma) = line_of(&parts)?;
        gain += gain_of(&parts, line);
        (slope, steps) = (line.slope, steps + 1);
        if steps == RECORDS.max_drift_steps || (slope * span_s(&parts)).abs() < 0.1 * RECORDS.clock_step_s {
            let drift = ClockDrift { rate: time_scale - 1.0, sigma, of_session, gain };
            return Some(DriftFound { drift, records, clocks });
        }
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
    let every = all.len().div_ceil(RECORDS.max_drift_parts).max(1);
    all.into_iter().step_by(every).collect()
}

/// A line that explains parts better than any one offset, and by how much.
fn drift_of(parts: &[Part<'_>], min_offset_s: f64) -> Option<(Line, f64)> {
    if parts.len() < RECORDS.min_drift_parts {
        return None;
    }
    let (line, _) = line_of(parts)?;
    let gain = gain_of(parts, line);
    let at_ends_s = 0.5 * (line.slope * span_s(parts)).abs();
    (gain > RECORDS.min_clock_gain && at_ends_s >= min_offset_s && line.slope.abs() <= RECORDS.max_clock_rate)
        .then_some((line, gain))
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
        let most = RECORDS.min_clock_gain * line.residual(part).powi(2).min(1.0);
        part.profile.gain_over(line.at(part)).min(most)
    };
    parts.iter().map(of).sum()
}

fn span_s(parts: &[Part<'_>]) -> f64 {
    let since = parts.iter().map(|part| part.since_s);
    let [first, last] = since.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], s| [a.min(s), b.max(s)]);
    last - first
}

/// Takes an offset that grows with this slope off the measurements' times.
fn correct_times(records: &mut [Dataset], slope: f64, of_session: bool) {
    for run in records.iter_mut().flat_map(|dataset| &mut dataset.runs) {
        let start_s = if of_session { run.info.start_s.unwrap_or(0.0) } else { 0.0 };
        run.truth.iter_mut().for_each(|sample| sample.t_s -= slope * (start_s + sample.t_s));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::records::clock_profile::tests::driven;
    use crate::settings::RECORDS;

    /// Runs every so many seconds, whose poses are of so long before their stamps.
    fn every(seconds: f64, offsets_s: &[f64]) -> [Dataset; 1] {
        let mut dataset = driven(offsets_s);
        for (number, run) in dataset.runs.iter_mut().enumerate() {
            run.info.start_s = Some(seconds * number as f64);
        }
        [dataset]
    }

    fn sought(datasets: &[Dataset]) -> Option<DriftFound> {
        clock_drift(datasets, &RunClock::of_all(datasets), RECORDS.min_common_clock_offset_s)
    }

    #[test]
    fn an_offset_that_grows_from_run_to_run_is_a_clock_that_loses() {
        let offsets_s = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6];
        let DriftFound { drift, records, .. } = sought(&every(100.0, &offsets_s)).expect("it drifts");
        // A millisecond a second. Poses are taken at hundredths of a second, over ten minutes.
        assert!(drift.of_session && (drift.rate + 1e-3).abs() < 2e-5, "{drift:?}");
        assert!(drift.sigma > 0.0 && drift.sigma < 5e-5 && drift.gain > RECORDS.min_clock_gain, "{drift:?}");
        assert!(sought(&records).is_none(), "nothing is left");
        // Of the last run's stamps 0.6 s are taken, and a thousandth of its own.
        let last = |all: &[Dataset]| all[0].runs[6].truth[100].t_s;
        assert!((last(&records) - (last(&every(100.0, &offsets_s)) - 0.61)).abs() < 0.02);
    }

    #[test]
    fn one_clock_for_all_an_odd_run_and_what_the_fit_takes_are_no_drift() {
        let drifts = |offsets_s: &[f64]| sought(&every(100.0, offsets_s)).is_some();
        assert!(!drifts(&[0.3; 7]) && !drifts(&[0.0, 0.0, 0.0, 0.4, 0.0, 0.0, 0.0]));
        assert!(!drifts(&[0.0, 0.04, 0.08, 0.12, 0.16, 0.2, 0.24]), "0.12 s from its mean at the ends");
        assert!(!drifts(&[0.0, 0.3, 0.6]), "through three runs a line may go by chance");
    }

    #[test]
    fn runs_beyond_what_is_sought_do_not_hide_the_line_through_the_others() {
        // Of the last ones the offset is beyond a second, until the line is taken off.
        let offsets_s = [0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75];
        let DriftFound { drift, .. } = sought(&every(100.0, &offsets_s)).expect("it drifts");
        assert!((drift.rate + 2.5e-3).abs() < 3e-5, "{drift:?}");
    }
}
