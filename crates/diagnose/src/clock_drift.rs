//! Clocks of instrument and robot that drift so far apart that no fit of one offset holds.
//!
//! Parts of long runs, and short runs as wholes, have each the profile likelihood of an offset
//! ([`crate::clock_offsets`]). An offset that grows in proportion to the time, since each run's start or the
//! session's, is a line through them; parts at which it is beyond what offsets are sought to are no nearer to
//! it than a cap. The measurements' times are set right by the line, and the parts asked again, until nothing
//! is left. What the fit finds of the rate beside that is added.
//! Reference: Fischler & Bolles 1981 (lines through pairs, judged by all); the cap as there.

use dataset::Dataset;
use rayon::prelude::*;

use crate::clock_offsets::Profile;
use crate::settings::records::{
    CLOCK_STEP_S, DRIFT_PARTS_PER_RUN, MAX_CLOCK_RATE, MAX_DRIFT_PARTS, MAX_DRIFT_STEPS, MIN_CLOCK_GAIN,
    MIN_DRIFT_PARTS, MIN_DRIFT_RUN_S,
};

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

/// What is known of a part of a run: seconds since the run's start and since the session's, and its profile.
struct Part {
    since_s: [f64; 2],
    profile: Profile,
}

impl Part {
    /// What its offset is by a line, seconds.
    fn offset_s(&self, of_session: bool, line: Line) -> f64 {
        line.at_start_s + line.slope * self.since_s[usize::from(of_session)]
    }

    /// How far its own offset is from that, in units of what another clock is off by.
    fn apart(&self, of_session: bool, line: Line) -> f64 {
        (self.profile.offset_s - self.offset_s(of_session, line)) / self.profile.tolerance_s()
    }
}

/// An offset that grows with the time.
#[derive(Debug, Clone, Copy)]
struct Line {
    at_start_s: f64,
    slope: f64,
}

/// Looks for a drift by which the offset is so far from its mean at an end at the least; the records without
/// it.
pub(crate) fn clock_drift(datasets: &[Dataset], min_offset_s: f64) -> Option<(ClockDrift, Vec<Dataset>)> {
    let parts = parts_of(datasets);
    // In a single run both are one, and the last of equals is taken: the run's.
    let lines = [true, false].map(|of_session| Some((of_session, drift_of(&parts, of_session, min_offset_s)?)));
    let (of_session, (first, mut gain)) = lines.into_iter().flatten().max_by(|a, b| a.1.1.total_cmp(&b.1.1))?;
    let mut records = datasets.to_vec();
    let (mut line, mut kept) = (first, 1.0);
    let mut parts = parts;
    for _ in 0..MAX_DRIFT_STEPS {
        set_right(&mut records, line.slope, of_session);
        kept *= 1.0 - line.slope;
        parts = parts_of(&records);
        line = line_of(&parts, of_session)?;
        gain += gain_of(&parts, of_session, line);
        if (line.slope * span_s(&parts, of_session)).abs() < 0.1 * CLOCK_STEP_S {
            break;
        }
    }
    Some((ClockDrift { rate: kept - 1.0, sigma: sigma_of(&parts, of_session), of_session, gain }, records))
}

fn parts_of(datasets: &[Dataset]) -> Vec<Part> {
    let mut all = Vec::new();
    for dataset in datasets {
        let Ok(geometry) = dataset.robot.geometry() else { return Vec::new() };
        let runs = &dataset.session().runs;
        let of_run = |run: &dataset::RunView<'_>| -> Vec<Part> {
            let (Some(first), Some(last)) = (run.run().truth.first(), run.run().truth.last()) else {
                return Vec::new();
            };
            let length_s = last.t_s - first.t_s;
            let count = if length_s >= MIN_DRIFT_RUN_S { DRIFT_PARTS_PER_RUN } else { 1 };
            let part = |number: usize| {
                let at = |number: usize| first.t_s + length_s * number as f64 / count as f64;
                let span_s = [at(number), at(number + 1)];
                let run_s = 0.5 * (span_s[0] + span_s[1]);
                let profile = Profile::of_part(run, dataset, &geometry, (span_s, count))?;
                Some(Part { since_s: [run_s, run.info().start_s.unwrap_or(0.0) + run_s], profile })
            };
            (0..count).filter_map(part).collect()
        };
        all.par_extend(runs.par_iter().flat_map_iter(of_run));
    }
    let every = all.len().div_ceil(MAX_DRIFT_PARTS).max(1);
    all.into_iter().step_by(every).collect()
}

/// A line that explains parts better than any one offset, and by how much.
fn drift_of(parts: &[Part], of_session: bool, min_offset_s: f64) -> Option<(Line, f64)> {
    if parts.len() < MIN_DRIFT_PARTS {
        return None;
    }
    let line = line_of(parts, of_session)?;
    let gain = gain_of(parts, of_session, line);
    let at_ends_s = 0.5 * (line.slope * span_s(parts, of_session)).abs();
    (gain > MIN_CLOCK_GAIN && at_ends_s >= min_offset_s && line.slope.abs() <= MAX_CLOCK_RATE).then_some((line, gain))
}

/// Log likelihood of a line over that of the best of the parts' own offsets for all.
fn gain_of(parts: &[Part], of_session: bool, line: Line) -> f64 {
    let even = parts.iter().map(|part| Line { at_start_s: part.profile.offset_s, slope: 0.0 });
    let even = even.map(|line| cost(parts, of_session, line)).fold(f64::INFINITY, f64::min);
    even - cost(parts, of_session, line)
}

/// Of the lines through two parts, the likeliest by all, through all that are near it.
fn line_of(parts: &[Part], of_session: bool) -> Option<Line> {
    let at = |part: &Part| part.since_s[usize::from(of_session)];
    let through = |(a, b): (&Part, &Part)| {
        let slope = (b.profile.offset_s - a.profile.offset_s) / (at(b) - at(a));
        slope.is_finite().then(|| Line { at_start_s: a.profile.offset_s - slope * at(a), slope })
    };
    let pairs = parts.iter().enumerate().flat_map(|(k, a)| parts[k + 1..].iter().map(move |b| (a, b)));
    let likeliest = pairs.filter_map(through).map(|line| (cost(parts, of_session, line), line));
    let (_, line) = likeliest.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let near = parts.iter().filter(|part| part.apart(of_session, line).abs() < 1.0);
    // Weighed least squares.
    let [mut n, mut x, mut xx, mut y, mut xy] = [0.0; 5];
    for part in near {
        let (weight, since_s, offset_s) = (part.profile.sigma_s.powi(-2), at(part), part.profile.offset_s);
        (n, x, xx) = (n + weight, x + weight * since_s, xx + weight * since_s * since_s);
        (y, xy) = (y + weight * offset_s, xy + weight * since_s * offset_s);
    }
    let slope = (n * xy - x * y) / (n * xx - x * x);
    Some(if slope.is_finite() { Line { at_start_s: (y - slope * x) / n, slope } } else { line })
}

/// Negative log likelihood of a line. An offset is known no better than clocks are discriminated: within that
/// a part loses no more than in proportion to the square, and beyond it no more than a cap, whatever its
/// profile says.
fn cost(parts: &[Part], of_session: bool, line: Line) -> f64 {
    let of = |part: &Part| {
        let most = MIN_CLOCK_GAIN * part.apart(of_session, line).powi(2).min(1.0);
        part.profile.gain_over(part.offset_s(of_session, line)).min(most)
    };
    parts.iter().map(of).sum()
}

fn span_s(parts: &[Part], of_session: bool) -> f64 {
    let since = parts.iter().map(|part| part.since_s[usize::from(of_session)]);
    let [first, last] = since.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], s| [a.min(s), b.max(s)]);
    last - first
}

/// Standard deviation of the slope.
fn sigma_of(parts: &[Part], of_session: bool) -> f64 {
    let weighed = |of: &dyn Fn(f64) -> f64| -> f64 {
        parts.iter().map(|part| of(part.since_s[usize::from(of_session)]) * part.profile.sigma_s.powi(-2)).sum()
    };
    let mean_s = weighed(&|since_s| since_s) / weighed(&|_| 1.0);
    weighed(&|since_s| (since_s - mean_s).powi(2)).sqrt().recip()
}

/// The measurements at the times that the robot's clock had.
fn set_right(records: &mut [Dataset], slope: f64, of_session: bool) {
    for run in records.iter_mut().flat_map(|dataset| &mut dataset.runs) {
        let start_s = if of_session { run.info.start_s.unwrap_or(0.0) } else { 0.0 };
        run.truth.iter_mut().for_each(|sample| sample.t_s -= slope * (start_s + sample.t_s));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock_offsets::tests::driven;
    use crate::settings::records::MIN_COMMON_CLOCK_OFFSET_S;

    /// Runs every so many seconds, whose poses are of so long before their stamps.
    fn every(seconds: f64, offsets_s: &[f64]) -> [Dataset; 1] {
        let mut dataset = driven(offsets_s);
        for (number, run) in dataset.runs.iter_mut().enumerate() {
            run.info.start_s = Some(seconds * number as f64);
        }
        [dataset]
    }

    #[test]
    fn an_offset_that_grows_from_run_to_run_is_a_clock_that_loses() {
        let offsets_s = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6];
        let (drift, records) = clock_drift(&every(100.0, &offsets_s), MIN_COMMON_CLOCK_OFFSET_S).expect("it drifts");
        // A millisecond a second. Poses are taken at hundredths of a second, over ten minutes.
        assert!(drift.of_session && (drift.rate + 1e-3).abs() < 2e-5, "{drift:?}");
        assert!(drift.sigma > 0.0 && drift.sigma < 5e-5 && drift.gain > MIN_CLOCK_GAIN, "{drift:?}");
        assert!(clock_drift(&records, MIN_COMMON_CLOCK_OFFSET_S).is_none(), "nothing is left");
        // Of the last run's stamps 0.6 s are taken, and a thousandth of its own.
        let last = |all: &[Dataset]| all[0].runs[6].truth[100].t_s;
        assert!((last(&records) - (last(&every(100.0, &offsets_s)) - 0.61)).abs() < 0.02);
    }

    #[test]
    fn one_clock_for_all_an_odd_run_and_what_the_fit_takes_are_no_drift() {
        let drifts = |offsets_s: &[f64]| clock_drift(&every(100.0, offsets_s), MIN_COMMON_CLOCK_OFFSET_S).is_some();
        assert!(!drifts(&[0.3; 7]) && !drifts(&[0.0, 0.0, 0.0, 0.4, 0.0, 0.0, 0.0]));
        assert!(!drifts(&[0.0, 0.04, 0.08, 0.12, 0.16, 0.2, 0.24]), "0.12 s from its mean at the ends");
        assert!(!drifts(&[0.0, 0.3, 0.6]), "through three runs a line may go by chance");
    }

    #[test]
    fn runs_beyond_what_is_sought_do_not_hide_the_line_through_the_others() {
        // Of the last ones the offset is beyond a second, until the line is taken off.
        let offsets_s = [0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75];
        let (drift, _) = clock_drift(&every(100.0, &offsets_s), MIN_COMMON_CLOCK_OFFSET_S).expect("it drifts");
        assert!((drift.rate + 2.5e-3).abs() < 3e-5, "{drift:?}");
    }
}
