//! Runs of the truth that are those of other runs of the log.

use crate::alignment::{Comparison, Explained};
use crate::clock::model::Clock;
use crate::problem::{Problem, Severity, probability};
use crate::problems::clock::is_decisive;
use crate::record_fault::RecordFault;
use crate::session_check::SessionCheck;
use crate::settings::CHECKS;
use crate::windows::{Reading, Window, windows};

/// Names a shift of the runs' ids, and undoes it.
pub(crate) fn found(check: &mut SessionCheck) {
    let count = check.runs.len();
    let Some(as_is) = check.explained(Reading::AS_IS, Clock::default()) else { return };
    if count < 2 || as_is.unexplained.iter().all(|share| *share < CHECKS.max_left_by_fix) {
        return;
    }
    let (windows, measured) = windows(&check.runs, Reading::AS_IS, CHECKS.max_windows / 4);
    let shifted = |by: usize| -> Option<Explained> {
        let of = |window: &Window| Window { run: (window.run + by) % count, ..*window };
        let windows: Vec<Window> = windows.iter().map(of).collect();
        let (runs, m_per_rad) = (&check.runs[..], check.m_per_rad());
        Comparison { windows: &windows, measured, runs, m_per_rad }.at(Clock::default())
    };
    // The nearest runs: ids are shifted by a file that is missing, or counted from 1.
    let near = (1..count).filter(|by| (*by).min(count - by) <= CHECKS.max_run_shift);
    let found = near.filter_map(|by| Some((by, shifted(by)?)));
    let Some((by, best)) = found.min_by(|a, b| a.1.cost.total_cmp(&b.1.cost)) else { return };
    let as_is = shifted(0).unwrap_or(as_is);
    if !is_decisive(&best, &as_is) || best.unexplained.iter().any(|share| *share > CHECKS.max_unexplained) {
        return;
    }
    let ids = [check.runs[0].id.clone(), check.runs[by].id.clone()];
    let kind = RecordFault::RunsShifted { ids, by: if 2 * by > count { by as f64 - count as f64 } else { by as f64 } };
    check.problems.push(Problem::record(kind, Severity::Error, None, probability(best.gain_over(&as_is))));
    let seen: Vec<_> = check
        .runs
        .iter_mut()
        .map(|run| (std::mem::take(&mut run.truth), std::mem::take(&mut run.displacements)))
        .collect();
    for (number, of) in seen.into_iter().enumerate() {
        let run = &mut check.runs[(number + by) % count];
        (run.truth, run.displacements) = of;
    }
}
