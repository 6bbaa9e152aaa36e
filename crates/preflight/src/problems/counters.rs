//! Counters that show something else for a row, or start again from 0. Such rows are undone for the checks
//! that follow.

use dataset::{median, quantile};
use kinematics::Side;

use crate::kind::Kind;
use crate::problem::{Problem, Severity};
use crate::run_log::RunLog;
use crate::session_check::SessionCheck;
use crate::settings::CHECKS;

/// What a run's counter does.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fault {
    Spike { row: usize, angle_rad: f64 },
    Restart { row: usize },
}

pub(crate) fn found(check: &mut SessionCheck) {
    let mut problems = Vec::new();
    for run in &mut check.runs {
        if run.has_rates {
            continue;
        }
        for side in Side::BOTH {
            let faults = faults(run, side);
            let mut spikes = faults.iter().filter_map(|fault| match fault {
                Fault::Spike { row, angle_rad } => Some((*row, *angle_rad)),
                Fault::Restart { .. } => None,
            });
            let in_counts =
                |angle_rad: f64| if run.count_rad > 0.0 { (angle_rad / run.count_rad).round() } else { angle_rad };
            let mut kinds = Vec::new();
            if let Some((row, angle_rad)) = spikes.next() {
                let (t_s, rows) = (run.t_s[row], 1 + spikes.count());
                kinds.push(Kind::CounterSpike { side, t_s, count: in_counts(angle_rad), rows });
            }
            let restart = faults.iter().find_map(|fault| match fault {
                Fault::Restart { row } => Some(*row),
                Fault::Spike { .. } => None,
            });
            kinds.extend(restart.map(|row| Kind::CounterRestart { side, t_s: run.t_s[row] }));
            let runs = || Some(vec![run.id.clone()]);
            problems.extend(kinds.iter().map(|kind| Problem::new(kind, Severity::Error, runs(), 0.999)));
            undo(run, side, &faults);
        }
    }
    check.problems.extend(problems);
}

/// Steps over what is usual, a second.
fn faults(run: &RunLog, side: Side) -> Vec<Fault> {
    let angles = &run.wheels[side];
    if angles.len() < CHECKS.min_rows {
        return Vec::new();
    }
    let length_s = |row: usize| run.t_s[row + 1] - run.t_s[row];
    let Some(median_s) = median((0..angles.len() - 1).map(length_s)) else { return Vec::new() };
    // In a gap, wheels go on turning.
    let step = |row: usize| (angles[row + 1] - angles[row]) * (median_s / length_s(row)).min(1.0);
    let sizes = (0..angles.len() - 1).map(|row| step(row).abs()).filter(|size| *size > 0.0);
    let Some(usual) = quantile(sizes, CHECKS.usual_step_quantile) else { return Vec::new() };
    let usual = usual.max(CHECKS.min_usual_counts * run.count_rad).max(CHECKS.min_wheel_turn_rad * 1e-2);
    let impossible = |row: usize| step(row).abs() > CHECKS.impossible_step_ratio * usual;
    let mut found = Vec::new();
    let mut row = 0;
    while row + 1 < angles.len() {
        if impossible(row) {
            let back = row + 2 < angles.len() && (angles[row + 2] - angles[row]).abs() < 4.0 * usual;
            if back {
                found.push(Fault::Spike { row: row + 1, angle_rad: angles[row + 1] });
                row += 2;
                continue;
            }
            let jump = (angles[row + 1] - angles[row]).abs() / if run.count_rad > 0.0 { run.count_rad } else { 1.0 };
            let wraps =
                CHECKS.counter_bits.iter().any(|bits| (jump - 2.0_f64.powi(*bits)).abs() * run.count_rad < 4.0 * usual);
            if !wraps && angles[row + 1].abs() < 4.0 * usual && angles[row].abs() > CHECKS.impossible_step_ratio * usual
            {
                found.push(Fault::Restart { row: row + 1 });
            }
        }
        row += 1;
    }
    found
}

fn undo(run: &mut RunLog, side: Side, faults: &[Fault]) {
    for fault in faults {
        let angles = &mut run.wheels[side];
        match *fault {
            Fault::Spike { row, .. } => angles[row] = 0.5 * (angles[row - 1] + angles[row + 1]),
            Fault::Restart { row } => {
                let missing = angles[row - 1] - angles[row];
                angles[row..].iter_mut().for_each(|angle| *angle += missing);
            }
        }
    }
}
