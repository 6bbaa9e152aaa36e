//! Positions metres off for a row. They are left out of the checks that follow.

use dataset::quantile;

use crate::kind::Kind;
use crate::problem::{Problem, Severity};
use crate::session_check::SessionCheck;
use crate::settings::CHECKS;

pub(crate) fn found(check: &mut SessionCheck) {
    let mut problems = Vec::new();
    for run in &mut check.runs {
        let truth = &run.truth;
        let step = |a: usize, b: usize| (truth[b].x_m - truth[a].x_m).hypot(truth[b].y_m - truth[a].y_m);
        let is_far = |row: usize| truth[row].x_m.abs().max(truth[row].y_m.abs()) > CHECKS.max_position_m;
        let mut far: Vec<usize> = (0..truth.len()).filter(|row| is_far(*row)).collect();
        let all_are_far = far.len() * 2 > truth.len();
        if all_are_far {
            far.clear();
        }
        if truth.len() >= CHECKS.min_rows {
            let steps = (1..truth.len()).map(|row| step(row - 1, row)).filter(|step| *step > 0.0);
            let usual = quantile(steps, CHECKS.usual_step_quantile).unwrap_or(0.0);
            let most = (CHECKS.impossible_step_ratio * usual).max(CHECKS.min_outlier_m);
            let jumps = |row: &usize| {
                let (before, after) = (step(row - 1, *row), step(*row, row + 1));
                before > most && after > most && step(row - 1, row + 1) < 0.2 * before.min(after)
            };
            far.extend((1..truth.len() - 1).filter(jumps));
        }
        far.sort_unstable();
        far.dedup();
        let Some(&first) = far.first() else { continue };
        let distance_m = if first > 0 { step(first - 1, first) } else { step(first, (first + 1).min(truth.len() - 1)) };
        // What a fit's gate leaves out is a warning; what no arithmetic survives is none.
        let severity = if far.iter().any(|row| is_far(*row)) { Severity::Error } else { Severity::Warning };
        let kind = Kind::TruthOutlier { t_s: truth[first].t_s, distance_m, rows: far.len() };
        problems.push(Problem::new(&kind, severity, Some(vec![run.id.clone()]), 0.999));
        let mut row = 0;
        run.truth.retain(|_| {
            row += 1;
            far.binary_search(&(row - 1)).is_err()
        });
    }
    check.problems.extend(problems);
}
