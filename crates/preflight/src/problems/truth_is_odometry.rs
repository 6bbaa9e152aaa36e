//! Truth that is computed from the wheels: its headings and distances are those of nominal dead reckoning,
//! nearer than any instrument is. Poses of a filter or
//! of SLAM that moves by the wheels between its corrections are so from one pose to the next, and not from
//! start to end.

use crate::kind::Kind;
use crate::problem::{Problem, Severity};
use crate::run_log::RunLog;
use crate::session_check::SessionCheck;
use crate::settings::CHECKS;
use kinematics::{Wheels, wrap_to_pi};

pub(crate) fn found(check: &mut SessionCheck) {
    let m_per_rad = check.m_per_rad();
    let separation_m = check.robot.wheel_separation_m;
    let (mut samples, mut turning_rad) = (0, 0.0);
    let (mut off_rad, mut went_m, mut driven_m) = (0.0_f64, 0.0, 0.0);
    let mut steps_off_rad = Vec::new();
    for run in &check.runs {
        let Some(found) = compared(run, m_per_rad, separation_m) else { continue };
        samples += found.samples;
        turning_rad += found.turning_rad;
        off_rad = off_rad.max(found.off_rad);
        went_m += found.went_m;
        driven_m += found.driven_m;
        steps_off_rad.extend(found.steps_off_rad);
    }
    let ratio_off = if driven_m > 0.0 { (went_m / driven_m - 1.0).abs() } else { 0.0 };
    if samples >= CHECKS.min_windows
        && turning_rad > CHECKS.min_own_turn_rad
        && off_rad < CHECKS.own_heading_rad
        && ratio_off < CHECKS.own_distance
    {
        check.problems.push(Problem::new(&Kind::TruthIsOdometry, Severity::Warning, None, 0.99));
    } else if steps_off_rad.len() >= CHECKS.min_windows && turning_rad > CHECKS.min_own_turn_rad {
        let own = steps_off_rad.iter().filter(|off_rad| **off_rad < CHECKS.own_step_rad).count();
        if 2 * own > steps_off_rad.len() {
            let kind = Kind::TruthFollowsOdometry { share: own as f64 / steps_off_rad.len() as f64 };
            check.problems.push(Problem::new(&kind, Severity::Warning, None, 0.99));
        }
    }
}

struct Compared {
    samples: usize,
    turning_rad: f64,
    off_rad: f64,
    /// Of steps that are no rounding.
    went_m: f64,
    driven_m: f64,
    /// Of each step with a turn, how far the instrument's turn is off that of the wheels.
    steps_off_rad: Vec<f64>,
}

/// Largest difference of the headings, and both lengths of the path.
fn compared(run: &RunLog, m_per_rad: Wheels<f64>, separation_m: f64) -> Option<Compared> {
    let first = run.truth.first()?;
    let (start, start_rad) = (run.angles_at(first.t_s)?, first.theta_rad()?);
    let mut found =
        Compared { samples: 0, turning_rad: 0.0, off_rad: 0.0, went_m: 0.0, driven_m: 0.0, steps_off_rad: Vec::new() };
    let mut before: Option<(f64, f64, f64, f64, f64)> = None;
    for sample in &run.truth {
        let (Some(heading_rad), Some(now)) = (sample.theta_rad(), run.angles_at(sample.t_s)) else { continue };
        let travel_m = now.zip_with(start, |now, start| now - start).zip_with(m_per_rad, |rad, m| rad * m);
        let turn_rad = (travel_m.right - travel_m.left) / separation_m;
        found.off_rad = found.off_rad.max(wrap_to_pi(heading_rad - start_rad - turn_rad).abs());
        found.samples += 1;
        let distance_m = 0.5 * (travel_m.left + travel_m.right);
        if let Some((x_m, y_m, seen_rad, before_rad, before_m)) = before {
            found.turning_rad += (turn_rad - before_rad).abs();
            if (turn_rad - before_rad).abs() > CHECKS.min_own_step_rad {
                found.steps_off_rad.push(wrap_to_pi(heading_rad - seen_rad - (turn_rad - before_rad)).abs());
            }
            let step_m = (distance_m - before_m).abs() * kinematics::sinc(0.5 * (turn_rad - before_rad));
            if step_m > CHECKS.min_own_step_m {
                found.went_m += (sample.x_m - x_m).hypot(sample.y_m - y_m);
                found.driven_m += step_m;
            }
        }
        before = Some((sample.x_m, sample.y_m, heading_rad, turn_rad, distance_m));
    }
    Some(found)
}
