//! Nothing moves: the wheels, or the robot that the instrument sees.

use crate::kind::Kind;
use crate::problem::{Problem, Severity};
use crate::session_check::SessionCheck;
use crate::settings::CHECKS;

/// Whether nothing moves, so that nothing else can be checked.
pub(crate) fn found(check: &mut SessionCheck) -> bool {
    let turning = check.turning();
    let wheels_turn_rad = turning.left + turning.right;
    let net = check.runs.iter().any(|run| {
        let spread = |angles: &[f64]| {
            let (low, high) =
                angles.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), a| (l.min(*a), h.max(*a)));
            high - low
        };
        spread(&run.wheels.left).max(spread(&run.wheels.right)) > CHECKS.min_wheel_turn_rad
    });
    if !net {
        let kind = Kind::NothingMoves { wheels_turn_rad, truth_extent_m: None };
        check.problems.push(Problem::new(&kind, Severity::Error, None, 0.999));
        return true;
    }
    // Wheels that should have carried the robot metres, and headings that do not turn either.
    let m_per_rad = check.m_per_rad();
    let driven_m = 0.5 * (turning.left * m_per_rad.left + turning.right * m_per_rad.right);
    let extent = |values: &[f64]| {
        let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), a| (l.min(*a), h.max(*a)));
        high - low
    };
    let mut extent_m = 0.0_f64;
    let mut turns = false;
    for run in check.runs.iter().filter(|run| !run.truth.is_empty()) {
        let of = |value: fn(&dataset::TruthSample) -> f64| extent(&run.truth.iter().map(value).collect::<Vec<_>>());
        extent_m = extent_m.max(of(|sample| sample.x_m)).max(of(|sample| sample.y_m));
        let headings: Vec<f64> = run.truth.iter().filter_map(dataset::TruthSample::theta_rad).collect();
        // Positions alone do not show a robot that spins on the spot.
        turns |= headings.is_empty() || extent(&headings) > 5.0 * CHECKS.min_wheel_turn_rad;
    }
    let sees = check.runs.iter().all(|run| run.truth.len() > 2);
    if sees && !turns && extent_m < CHECKS.standing_m && driven_m > 50.0 * CHECKS.standing_m {
        let kind = Kind::NothingMoves { wheels_turn_rad, truth_extent_m: Some(extent_m) };
        check.problems.push(Problem::new(&kind, Severity::Error, None, 0.99));
        return true;
    }
    false
}
