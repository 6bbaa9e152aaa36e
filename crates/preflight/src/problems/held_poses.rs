//! Poses that are logged again until a new one comes: late by up to the time that they are held, more than a
//! latency can say.

use dataset::{TruthSample, quantile};

use crate::problem::{Problem, Severity};
use crate::record_fault::{Place, RecordFault};
use crate::session_check::SessionCheck;
use crate::settings::CHECKS;

/// Names poses that are held, and keeps the first of each.
pub(crate) fn found(check: &mut SessionCheck) {
    let m_per_rad = check.m_per_rad();
    let (mut steps, mut first, mut held_s) = (0, None, Vec::new());
    let is_same = |a: &TruthSample, b: &TruthSample| (a.x_m, a.y_m, a.theta_rad()) == (b.x_m, b.y_m, b.theta_rad());
    for run in &check.runs {
        // The step that positions are rounded to, or less.
        let moves = run.truth.windows(2).flat_map(|pair| [pair[1].x_m - pair[0].x_m, pair[1].y_m - pair[0].y_m]);
        let least_m = moves.map(f64::abs).filter(|of| *of > 0.0).fold(f64::INFINITY, f64::min);
        let mut since_s = f64::NAN;
        for pair in run.truth.windows(2) {
            let Some(turned) = run.turned(pair[0].t_s, pair[1].t_s) else { continue };
            let rolled = turned.zip_with(m_per_rad, |rad, m| (rad * m).abs());
            if rolled.left.max(rolled.right) < CHECKS.min_held_steps * least_m {
                continue;
            }
            steps += 1;
            if is_same(&pair[0], &pair[1]) {
                // The first of those that are alike.
                if since_s.is_nan() {
                    since_s = pair[0].t_s;
                }
                first.get_or_insert_with(|| Place::at(run, pair[0].t_s));
                held_s.push(pair[1].t_s - since_s);
            } else {
                since_s = f64::NAN;
            }
        }
    }
    let (Some(from), Some(usual_s)) = (first, quantile(held_s.iter().copied(), 0.9)) else { return };
    let share = held_s.len() as f64 / steps as f64;
    if steps < CHECKS.min_windows || share < CHECKS.min_held_share || usual_s < CHECKS.min_held_s {
        return;
    }
    let kind = RecordFault::HeldPoses { share, from };
    check.problems.push(Problem::record(kind, Severity::Warning, None, 0.95));
    for run in &mut check.runs {
        run.truth.dedup_by(|later, earlier| is_same(later, earlier));
    }
}
