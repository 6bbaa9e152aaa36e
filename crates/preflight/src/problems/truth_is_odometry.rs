//! Truth that is computed from the wheels: its headings and distances are those of nominal dead reckoning,
//! nearer than any instrument is.

use crate::kind::Kind;
use crate::problem::{Problem, Severity};
use crate::run_log::RunLog;
use crate::session_check::SessionCheck;
use crate::settings::{MIN_OWN_STEP_M, MIN_OWN_TURN_RAD, MIN_WINDOWS, OWN_DISTANCE, OWN_HEADING_RAD};
use kinematics::{Wheels, wrap_to_pi};

pub(crate) fn found(check: &mut SessionCheck) {
    let m_per_rad = check.m_per_rad();
    let separation_m = check.robot.wheel_separation_m;
    let (mut samples, mut turning_rad) = (0, 0.0);
    let (mut off_rad, mut went_m, mut driven_m) = (0.0_f64, 0.0, 0.0);
    for run in &check.runs {
        let Some(found) = compared(run, m_per_rad, separation_m) else { continue };
        samples += found.samples;
        turning_rad += found.turning_rad;
        off_rad = off_rad.max(found.off_rad);
        went_m += found.went_m;
        driven_m += found.driven_m;
    }
    let ratio_off = if driven_m > 0.0 { (went_m / driven_m - 1.0).abs() } else { 0.0 };
    if samples >= MIN_WINDOWS && turning_rad > MIN_OWN_TURN_RAD && off_rad < OWN_HEADING_RAD && ratio_off < OWN_DISTANCE
    {
        check.problems.push(Problem::new(&Kind::TruthIsOdometry, Severity::Warning, None, 0.99));
    }
}

struct Compared {
    samples: usize,
    turning_rad: f64,
    off_rad: f64,
    /// Of steps that are no rounding.
    went_m: f64,
    driven_m: f64,
}

/// Largest difference of the headings, and both lengths of the path.
fn compared(run: &RunLog, m_per_rad: Wheels<f64>, separation_m: f64) -> Option<Compared> {
    let first = run.truth.first()?;
    let (start, start_rad) = (run.angles_at(first.t_s)?, first.theta_rad()?);
    let mut found = Compared { samples: 0, turning_rad: 0.0, off_rad: 0.0, went_m: 0.0, driven_m: 0.0 };
    let mut before: Option<(f64, f64, f64, f64)> = None;
    for sample in &run.truth {
        let (Some(heading_rad), Some(now)) = (sample.theta_rad(), run.angles_at(sample.t_s)) else { continue };
        let travel_m = now.zip_with(start, |now, start| now - start).zip_with(m_per_rad, |rad, m| rad * m);
        let turn_rad = (travel_m.right - travel_m.left) / separation_m;
        found.off_rad = found.off_rad.max(wrap_to_pi(heading_rad - start_rad - turn_rad).abs());
        found.samples += 1;
        let distance_m = 0.5 * (travel_m.left + travel_m.right);
        if let Some((x_m, y_m, before_rad, before_m)) = before {
            found.turning_rad += (turn_rad - before_rad).abs();
            let step_m = (distance_m - before_m).abs() * kinematics::sinc(0.5 * (turn_rad - before_rad));
            if step_m > MIN_OWN_STEP_M {
                found.went_m += (sample.x_m - x_m).hypot(sample.y_m - y_m);
                found.driven_m += step_m;
            }
        }
        before = Some((sample.x_m, sample.y_m, turn_rad, distance_m));
    }
    Some(found)
}
