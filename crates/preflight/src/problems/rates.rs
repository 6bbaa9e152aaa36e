//! Rates of the instant where those of an interval are expected.

use dataset::Dataset;

use crate::alignment::Comparison;
use crate::clock::model::Clock;
use crate::kind::Kind;
use crate::problem::{Problem, Severity, probability};
use crate::run_log::RunLog;
use crate::session_check::SessionCheck;
use crate::settings::CHECKS;
use crate::windows::windows;

pub(crate) fn found(check: &mut SessionCheck, dataset: &Dataset) {
    let Some(matched) = check.matched.as_ref().filter(|_| check.runs.iter().all(|run| run.has_rates)) else { return };
    // A clock that is far off is the better reason; half a row is no more than the rates'.
    if matched.clock.rate != 0.0 || matched.clock.offset_s.abs() > CHECKS.min_warned_offset_s {
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
    let (windows, measured) = windows(&check.runs, matched.reading, CHECKS.max_windows);
    let comparison = |runs| Comparison { windows: &windows, measured, runs, m_per_rad: check.m_per_rad() };
    let (interval, instant) = (comparison(&check.runs), comparison(&of_instant));
    let (Some(as_stamped), Some(then)) = (interval.at(Clock::default()), instant.at(Clock::default())) else { return };
    let gain = then.gain_over(&as_stamped);
    let as_well = matched.clock != Clock::default();
    if !as_well && gain <= CHECKS.min_gain {
        return;
    }
    // Rates of the instant, taken for those of the interval, make poses late by half a row and no more. Poses
    // that are late by something else gain by that half too; and the mean of two rows is less noisy where
    // stamps or rates are.
    let Some(delayed) = interval.best_offset(Some(CHECKS.max_near_offset_s)) else { return };
    let half_row_s = 0.5 * mean_interval_s(&check.runs);
    let gained = delayed.explained.gain_over(&as_stamped);
    let is_half_row =
        (delayed.clock.offset_s - half_row_s).abs() < CHECKS.half_row_share * half_row_s + 2.0 * delayed.sigma_s;
    let is_as_good = delayed.explained.gain_over(&then) < CHECKS.delay_gain_share * gained;
    if is_half_row && is_as_good && gained > CHECKS.min_gain {
        check.problems.retain(|problem| !as_well || problem.severity != Severity::Hint || problem.fix.is_none());
        check.problems.push(Problem::new(
            &Kind::InstantRates,
            Severity::Warning,
            None,
            probability(gain.max(CHECKS.min_gain)),
        ));
    }
}

/// Time between rows, mean of all.
fn mean_interval_s(runs: &[RunLog]) -> f64 {
    let ends = runs.iter().filter_map(|run| Some((run.t_s.last()? - run.t_s.first()?, run.t_s.len().checked_sub(1)?)));
    let (total_s, count) = ends.fold((0.0, 0), |(total_s, count), (s, rows)| (total_s + s, count + rows));
    total_s / count.max(1) as f64
}
