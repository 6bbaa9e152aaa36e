//! Clocks that are apart or run at different rates, and headings or axes that are read wrongly: what the
//! wheels explain decisively better once it is undone.
//! Reference: Knapp & Carter 1976 (time delay by maximum likelihood).

use std::collections::BTreeMap;

use crate::alignment::{BestClock, Comparison, Explained};
use crate::clock::{Clock, ClockDrift, ClockOffset, ClockOffsets, ClockSearch};
use crate::kind::{Kind, MirroredAxis};
use crate::problem::{Problem, Severity, probability};
use crate::session_check::{Matched, SessionCheck};
use crate::settings::CHECKS;
use crate::windows::{Measured, Reading, windows};

/// Readings that are tried, the sound one first.
const READINGS: [Reading; 4] = [
    Reading::AS_IS,
    Reading { degrees: true, clockwise: false },
    Reading { degrees: false, clockwise: true },
    Reading { degrees: true, clockwise: true },
];

/// Leaves out runs whose clock is another than that of all, which may drift.
pub(crate) fn without_odd_runs(check: &mut SessionCheck) -> BTreeMap<String, ClockOffset> {
    let search = ClockSearch::of_session(check, Reading::AS_IS, Clock::default());
    let drift = search.drift(Clock::default(), CHECKS.min_clock_offset_s);
    let Some(ClockOffsets { common, mut odd }) = search.offsets(drift.map_or(Clock::default(), |of| of.clock)) else {
        return BTreeMap::new();
    };
    // A fit bears a smaller one, and delays of rows that hold up each other look like it.
    odd.retain(|(_, of)| (of.offset_s - common.offset_s).abs() > CHECKS.min_warned_offset_s);
    odd.into_iter().rev().map(|((_, run), of)| (check.runs.remove(run).id, of)).collect()
}

/// Names them, and leaves them out of the checks that follow.
pub(crate) fn odd_runs(check: &mut SessionCheck) {
    for (run, ClockOffset { offset_s, sigma_s, gain }) in without_odd_runs(check) {
        let kind = Kind::ClockOffset { offset_s, sigma_s };
        // No key shifts one run, and the others are sound.
        let problem = Problem::new(&kind, Severity::Warning, Some(vec![run]), probability(gain));
        check.problems.push(Problem { fix: None, ..problem });
    }
}

/// The reading and the clock by which log and instrument go together; `None` where too few windows tell.
pub(crate) fn matched(check: &mut SessionCheck) -> Option<Matched> {
    let as_is = check.explained(Reading::AS_IS, Clock::default());
    let (reading, explained) = best_reading(check, as_is);
    let best = best_clock(check, reading, explained);
    let (reading, best) = match best {
        // Both may be wrong at once.
        Some(best) if best.explained.unexplained.iter().any(|share| *share < CHECKS.max_unexplained) => {
            (reading, Some(best))
        }
        _ => READINGS
            .iter()
            .filter_map(|reading| Some((*reading, best_clock(check, *reading, None)?)))
            .min_by(|a, b| a.1.explained.cost.total_cmp(&b.1.explained.cost))
            .map_or((reading, best), |(reading, best)| (reading, Some(best))),
    };
    let best = best?;
    let found = best.explained;
    let positions = check.measures_positions();
    if !positions && found.unexplained.iter().all(|share| *share > CHECKS.unrelated) {
        if found.windows > 4.0 * CHECKS.min_windows as f64 {
            let unexplained = found.unexplained[1].min(1.0);
            check.problems.push(Problem::new(&Kind::TruthUnrelated { unexplained }, Severity::Error, None, 0.9));
        }
        return None;
    }
    let clock = said_clock(check, reading, as_is, best);
    let matched = check.matched_at(reading, clock)?;
    say_reading(check, &matched, as_is);
    Some(matched)
}

/// Says a rate and an offset that matter; the clock with them.
fn said_clock(check: &mut SessionCheck, reading: Reading, as_is: Option<Explained>, best: BestClock) -> Clock {
    let drift = clock_drift(check, reading, best.clock);
    if let Some(ClockDrift { clock, gain, .. }) = drift {
        let severity = match clock.rate.abs() {
            // A fit undoes it.
            _ if clock.of_session => Severity::Hint,
            rate if rate > CHECKS.max_clock_rate => Severity::Error,
            _ => Severity::Warning,
        };
        let kind = Kind::ClockRate { rate: clock.rate, of_session: clock.of_session };
        check.problems.push(Problem::new(&kind, severity, None, probability(gain)));
        // What is left at the start of the records.
        if clock.late_s(0.0).abs() < 2.0 * CHECKS.min_warned_offset_s {
            return clock;
        }
    }
    let clock = drift.map_or(best.clock, |drift| drift.clock);
    match offset_gain(check, reading, as_is, clock, best.sigma_s) {
        Some(gain) => {
            let offset_s = clock.late_s(0.0);
            let severity = match offset_s.abs() {
                large if large > CHECKS.max_fitted_offset_s => Severity::Error,
                some if some > CHECKS.min_warned_offset_s => Severity::Warning,
                _ => Severity::Hint,
            };
            let kind = Kind::ClockOffset { offset_s, sigma_s: best.sigma_s };
            check.problems.push(Problem::new(&kind, severity, None, probability(gain)));
            clock
        }
        None => drift.map_or(Clock::default(), |drift| drift.clock),
    }
}

/// The reading that the wheels explain decisively better than the sound one.
fn best_reading(check: &SessionCheck, as_is: Option<Explained>) -> (Reading, Option<Explained>) {
    let Some(sound) = as_is else { return (Reading::AS_IS, None) };
    let better = READINGS[1..].iter().filter_map(|reading| {
        let found = check.explained(*reading, Clock::default())?;
        is_decisive(&found, &sound).then_some((*reading, found))
    });
    better
        .min_by(|a, b| a.1.cost.total_cmp(&b.1.cost))
        .map_or((Reading::AS_IS, as_is), |(reading, found)| (reading, Some(found)))
}

/// Whether a reading explains the records beyond doubt where another does not.
pub(crate) fn is_decisive(found: &Explained, sound: &Explained) -> bool {
    found.gain_over(sound) > CHECKS.min_gain
        && found.ratio_to(sound) < CHECKS.decisive_ratio
        && found.unexplained.iter().any(|share| *share < CHECKS.max_unexplained)
}

/// The best clock near the stated one, or anywhere if none is good there.
pub(crate) fn best_clock(check: &SessionCheck, reading: Reading, now: Option<Explained>) -> Option<BestClock> {
    let (windows, measured) = windows(&check.runs, reading, CHECKS.max_windows / 4);
    if windows.len() < CHECKS.min_windows {
        return None;
    }
    let comparison = Comparison { windows: &windows, measured, runs: &check.runs, m_per_rad: check.m_per_rad() };
    let is_good = |best: &BestClock| best.explained.unexplained.iter().any(|share| *share < CHECKS.max_unexplained);
    if now.is_some() {
        // A path that repeats itself fits again a lap later: the clock is far off where that is decisive.
        let close = comparison.best_offset(Some(CHECKS.max_fitted_offset_s)).filter(is_good);
        let near = comparison.best_offset(Some(CHECKS.max_near_offset_s)).filter(is_good);
        let is_farther =
            |near: &BestClock| close.is_none_or(|close| near.explained.gain_over(&close.explained) > CHECKS.min_gain);
        if let Some(found) = near.filter(is_farther).or(close) {
            return Some(found);
        }
    }
    comparison.best_offset(None)
}

/// What an offset gains, if it matters.
pub(crate) fn offset_gain(
    check: &SessionCheck,
    reading: Reading,
    as_is: Option<Explained>,
    clock: Clock,
    sigma_s: f64,
) -> Option<f64> {
    if clock.offset_s.abs() < CHECKS.min_clock_offset_s.max(4.0 * sigma_s) {
        return None;
    }
    let now = if reading == Reading::AS_IS { as_is } else { check.explained(reading, Clock::default()) };
    let with = check.explained(reading, clock)?;
    now.map_or(Some(f64::INFINITY), |now| clearly_better(&with, &now))
}

/// A drift that matters, beside a clock of all runs: over the session, or one within runs with which the
/// wheels explain the motion clearly better. On real instruments, delays of moments look like a drift within
/// runs.
pub(crate) fn clock_drift(check: &SessionCheck, reading: Reading, near: Clock) -> Option<ClockDrift> {
    let found = ClockSearch::of_session(check, reading, near).drift(near, CHECKS.min_clock_offset_s)?;
    let matters = || {
        let (now, with) = (check.explained(reading, near)?, check.explained(reading, found.clock)?);
        let is_explained = with.unexplained.iter().all(|share| *share < CHECKS.max_left_by_fix);
        clearly_better(&with, &now).filter(|_| is_explained)
    };
    (found.clock.of_session || matters().is_some()).then_some(found)
}

/// What a clock gains over another, in nats, where it explains the records clearly better.
fn clearly_better(with: &Explained, now: &Explained) -> Option<f64> {
    let gain = with.gain_over(now);
    (gain > CHECKS.min_gain && with.ratio_to(now) < 0.5 * (1.0 + CHECKS.decisive_ratio)).then_some(gain)
}

/// Says how the instrument's records are to be read.
fn say_reading(check: &mut SessionCheck, matched: &Matched, as_is: Option<Explained>) {
    let gain = as_is.map_or(CHECKS.min_gain, |sound| matched.explained.gain_over(&sound));
    // What is named explains the log.
    let is_explained = matched.explained.unexplained.iter().all(|share| *share < CHECKS.max_left_by_fix);
    if matched.measured == Measured::Positions || matched.reading == Reading::AS_IS || !is_explained {
        return;
    }
    let mut say = |kind: &Kind| check.problems.push(Problem::new(kind, Severity::Error, None, probability(gain)));
    if matched.reading.degrees {
        say(&Kind::HeadingInDegrees);
    }
    if matched.reading.clockwise {
        let mirrored = matched.geometry.filter(|found| {
            let sign = found.m_per_rad.left.signum() * found.separation_m.signum();
            sign < 0.0 && found.m_per_rad.left * found.m_per_rad.right > 0.0
        });
        match mirrored {
            None => say(&Kind::HeadingClockwise),
            Some(found) => {
                let (sin, cos) = found.sensor_rad.sin_cos();
                let axis = match () {
                    () if sin.abs() > cos.abs() => MirroredAxis::Exchanged,
                    () if found.m_per_rad.left < 0.0 => MirroredAxis::X,
                    () => MirroredAxis::Y,
                };
                say(&Kind::AxesMirrored { axis });
            }
        }
    }
}
