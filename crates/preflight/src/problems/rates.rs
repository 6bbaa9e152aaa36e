//! Rates of the instant where those of an interval are expected.

use dataset::Dataset;

use crate::alignment::{Clock, Comparison};
use crate::kind::Kind;
use crate::problem::{Problem, Severity, probability};
use crate::run_log::RunLog;
use crate::session_check::SessionCheck;
use crate::settings::{MAX_WINDOWS, MIN_GAIN, MIN_WARNED_OFFSET_S};
use crate::windows::windows;

pub(crate) fn found(check: &mut SessionCheck, dataset: &Dataset) {
    let Some(matched) = check.matched.as_ref().filter(|_| check.runs.iter().all(|run| run.has_rates)) else { return };
    // A clock that is far off is the better reason; half a row is no more than the rates'.
    if matched.clock.rate != 0.0 || matched.clock.offset_s.abs() > MIN_WARNED_OFFSET_S {
        return;
    }
    let session = dataset.session();
    let of_instant: Vec<RunLog> = check
        .runs
        .iter()
        .filter_map(|run| {
            let view = session.runs.iter().find(|view| view.info().id == run.id)?;
            run.with_instant_rates(view, &check.robot)
        })
        .collect();
    if of_instant.len() != check.runs.len() {
        return;
    }
    let (windows, measured) = windows(&check.runs, matched.reading, MAX_WINDOWS);
    let comparison = |runs| Comparison { windows: &windows, measured, runs, m_per_rad: check.m_per_rad() };
    let (interval, instant) = (comparison(&check.runs), comparison(&of_instant));
    let (Some(now), Some(then)) = (interval.at(matched.clock), instant.at(Clock::default())) else { return };
    let gain = then.gain_over(&now);
    let as_well = matched.clock != Clock::default();
    if gain > if as_well { 0.0 } else { MIN_GAIN } {
        let gain = gain.max(MIN_GAIN);
        check.problems.retain(|problem| !as_well || problem.severity != Severity::Hint || problem.fix.is_none());
        check.problems.push(Problem::new(&Kind::InstantRates, Severity::Warning, None, probability(gain)));
    }
}
