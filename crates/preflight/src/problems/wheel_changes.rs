//! Wheels whose records say something else in a part of the log: dead, reversed, or of another scale. That
//! part is left out of the checks that follow.

use std::ops::Range;

use kinematics::{Side, Wheels};

use crate::alignment::{Paired, explain};
use crate::clock::model::Clock;
use crate::gain_change::{GainChange, gain_change};
use crate::geometry_estimate::GeometryEstimate;
use crate::problem::{Problem, Severity, probability};
use crate::problems::runs_on::RunsOn;
use crate::record_fault::{Place, RecordFault, WheelChange};
use crate::session_check::SessionCheck;
use crate::settings::CHECKS;
use crate::windows::{Measured, Reading};

/// Names records that run on by themselves, and a part of the log whose wheels say something else; whether
/// there is such a part.
pub(crate) fn found(check: &mut SessionCheck, reading: Reading, clock: Clock) -> bool {
    let paired = |check: &SessionCheck| {
        let matched = check.matched_at(reading, clock).filter(|matched| matched.measured == Measured::Poses);
        matched.map(|matched| matched.pairs)
    };
    let Some(mut pairs) = paired(check) else { return false };
    let mut found = certain_change(&pairs, check.m_per_rad());
    // What explains the log better is undone before the other is sought.
    let runs_on = RunsOn::of(&pairs, check.m_per_rad());
    let is_better = |of: &RunsOn| found.as_ref().is_none_or(|(change, _)| of.nats > change.nats);
    if runs_on.filter(is_better).is_some_and(|of| of.said(check)) {
        pairs = paired(check).unwrap_or_default();
        found = certain_change(&pairs, check.m_per_rad());
    }
    let Some((mut change, sides)) = found else { return false };
    let is_known = part_at_fault(&mut change, &sides, &pairs, check.m_per_rad());
    let Range { start, end } = change.span;
    let place = |pair: &Paired, stamp_s: f64| {
        let run = &check.runs[pair.window.run];
        Place::at(run, clock.log_s(run.start_s, stamp_s))
    };
    let from = (start > 0).then(|| place(&pairs[start], pairs[start].window.from_s));
    let until = (end < pairs.len()).then(|| place(&pairs[end - 1], pairs[end - 1].window.to_s));
    let mut runs: Vec<String> = pairs[start..end].iter().map(|pair| check.runs[pair.window.run].id.clone()).collect();
    runs.dedup();
    let gain = sides.iter().map(|side| change.gain[*side]).sum::<f64>() / sides.len() as f64;
    let kind = RecordFault::WheelChange(WheelChange { sides, gain, from, until, is_known });
    check.problems.push(Problem::record(kind, Severity::Error, Some(runs), probability(change.nats)));
    cut(check, &pairs, change.span, clock);
    true
}

/// Leaves the windows of a span out, and of a run that goes on behind it what comes there.
fn cut(check: &mut SessionCheck, pairs: &[Paired], span: Range<usize>, clock: Clock) {
    for (number, run) in check.runs.iter_mut().enumerate() {
        let own =
            pairs.partition_point(|of| of.window.run < number)..pairs.partition_point(|of| of.window.run <= number);
        let (from, to) = (own.start.max(span.start), own.end.min(span.end));
        if from >= to {
            continue;
        }
        match (from > own.start, to < own.end) {
            (true, _) => run.keep(f64::NEG_INFINITY, clock.log_s(run.start_s, pairs[from].window.from_s)),
            (false, true) => run.keep(clock.log_s(run.start_s, pairs[to - 1].window.to_s), f64::INFINITY),
            (false, false) => run.keep(f64::INFINITY, f64::INFINITY),
        }
    }
    check.runs.retain(|run| run.t_s.len() > 2);
}

/// A change with the wheels whose gain changes beyond doubt; `None` where none does, or where gains do not
/// explain the span.
fn certain_change(pairs: &[Paired], m_per_rad: Wheels<f64>) -> Option<(GainChange, Vec<Side>)> {
    let change = gain_change(pairs)?;
    let is_changed = |side: &Side| {
        let (gain, sigma) = (change.gain[*side], change.sigma[*side]);
        let is_far = gain <= 0.0 || gain.ln().abs() > CHECKS.min_gain_change.ln();
        is_far && (gain - 1.0).abs() > CHECKS.certain_sigmas * sigma
    };
    let sides: Vec<Side> = Side::BOTH.into_iter().filter(is_changed).collect();
    let is_explained = change.nats > CHECKS.min_gain && change.unexplained < CHECKS.max_left_by_fix;
    // With other gains undone, the wheels explain turns and displacements of the whole log.
    let mut undone = pairs.to_vec();
    for pair in &mut undone[change.span.clone()] {
        for side in sides.iter().filter(|side| change.gain[**side].abs() > CHECKS.dead_gain) {
            pair.moved[*side] /= change.gain[*side];
        }
        pair.turned = pair.turned.map(|(_, turn_rad)| (pair.moved, turn_rad));
    }
    let is_dead = sides.iter().any(|side| change.gain[*side].abs() < CHECKS.dead_gain);
    let then = explain(&undone, Measured::Poses, m_per_rad)?;
    let explains = is_dead || then.unexplained.iter().all(|share| *share < CHECKS.max_left_by_fix);
    (!sides.is_empty() && is_explained && explains).then_some((change, sides))
}

/// Makes the span that of the part whose wheels are not those of the stated robot; whether the data tell.
fn part_at_fault(change: &mut GainChange, sides: &[Side], pairs: &[Paired], m_per_rad: Wheels<f64>) -> bool {
    let far = |side: &Side| change.gain[*side].abs().ln().abs();
    let Some(by) = sides.iter().max_by(|a, b| far(a).total_cmp(&far(b))).map(|side| change.gain[*side]) else {
        return false;
    };
    if by.abs() < CHECKS.dead_gain {
        return true;
    }
    let Range { start, end } = change.span.clone();
    let outside = [&pairs[..start], &pairs[end..]].concat();
    let off = |pairs: &[Paired]| off_stated(pairs, sides, m_per_rad);
    // Half of a change on a logarithmic scale, and any if a sign is wrong.
    let half = if by < 0.0 { f64::MAX } else { 0.5 * by.ln().abs() };
    let is_inside = match (off(&outside), off(&pairs[start..end])) {
        (Some(outside), Some(inside)) if outside.min(inside) < half => outside < inside,
        (Some(outside), None) => outside < half,
        (None, Some(inside)) => inside >= half,
        _ => return false,
    };
    if !is_inside {
        if start > 0 && end < pairs.len() {
            return false;
        }
        change.span = if start > 0 { 0..start } else { end..pairs.len() };
        change.gain = change.gain.map(f64::recip);
    }
    true
}

/// How far wheels are off the stated ones by a part of the windows, on a logarithmic scale; infinite where
/// they turn backwards.
fn off_stated(pairs: &[Paired], sides: &[Side], m_per_rad: Wheels<f64>) -> Option<f64> {
    let geometry = GeometryEstimate::of(pairs)?;
    let forward = geometry.separation_m.signum();
    let off = |side: &Side| {
        let ratio = forward * geometry.m_per_rad[*side] / m_per_rad[*side];
        if ratio > 0.0 { ratio.ln().abs() } else { f64::INFINITY }
    };
    sides.iter().map(off).reduce(f64::max)
}
