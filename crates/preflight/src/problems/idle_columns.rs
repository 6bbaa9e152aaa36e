//! Columns that say nothing of their own throughout a log: a wheel that never turns, two wheels that are one
//! column, a gyroscope that is never filled.

use dataset::Dataset;
use kinematics::{Side, wrap_to_pi};

use crate::clock::model::Clock;
use crate::problem::{Problem, Severity};
use crate::record_fault::{RecordFault, WheelChange};
use crate::run_log::RunLog;
use crate::session_check::SessionCheck;
use crate::settings::CHECKS;
use crate::windows::Reading;

/// Whether a wheel's column says nothing, so that nothing else can be checked.
pub(crate) fn found(check: &mut SessionCheck, dataset: &Dataset) -> bool {
    let turning = check.turning();
    let mut say =
        |fault: RecordFault, severity: Severity| check.problems.push(Problem::record(fault, severity, None, 0.999));
    if let Some(rate_rad_s) = constant_gyro(dataset).filter(|_| check.runs.iter().any(wheels_turn_it)) {
        let is_alone = check.runs.iter().all(|run| !run.sees_headings());
        let severity = if is_alone { Severity::Error } else { Severity::Warning };
        say(RecordFault::ConstantGyro { rate_rad_s }, severity);
    }
    if turning.left.max(turning.right) < CHECKS.min_turning_rad {
        return false;
    }
    if check.runs.iter().all(are_alike) && check.runs.iter().any(is_seen_turning) {
        say(RecordFault::WheelsAlike, Severity::Error);
        return true;
    }
    let Some(side) = Side::BOTH.into_iter().find(|side| turning[*side] < CHECKS.min_wheel_turn_rad) else {
        return false;
    };
    // A robot that pivots about a wheel that stands is explained by the other.
    let Some(explained) = check.explained(Reading::AS_IS, Clock::default()) else { return false };
    let is_dead = explained.unexplained.iter().any(|share| *share > CHECKS.max_left_by_fix);
    if is_dead {
        let throughout = WheelChange { sides: vec![side], gain: 0.0, from: None, until: None, is_known: true };
        let kind = RecordFault::WheelChange(throughout);
        check.problems.push(Problem::record(kind, Severity::Error, None, 0.99));
    }
    is_dead
}

/// The one value of all gyroscopes' rows.
fn constant_gyro(dataset: &Dataset) -> Option<f64> {
    let mut all = dataset.runs.iter().filter_map(dataset::Run::gyro_rates).filter(|rates| rates.len() > 2);
    let first = all.next()?;
    let value = *first.iter().find(|rate| rate.is_finite())?;
    let is_it = |rates: &[f64]| rates.iter().all(|rate| *rate == value || rate.is_nan());
    (is_it(&first) && all.all(|rates| is_it(&rates))).then_some(value)
}

/// Does each wheel turn in each row as the other does?
fn are_alike(run: &RunLog) -> bool {
    let mut rows = run.wheels.left.windows(2).zip(run.wheels.right.windows(2));
    rows.all(|(left, right)| {
        let (left, right) = (left[1] - left[0], right[1] - right[0]);
        (left - right).abs() <= 1e-9 * left.abs().max(1.0)
    })
}

fn wheels_turn_it(run: &RunLog) -> bool {
    let apart = run.wheels.left.iter().zip(&run.wheels.right).map(|(left, right)| right - left);
    extent(apart) > CHECKS.min_turning_rad
}

/// Does the instrument see the robot turn? Positions alone do by a path that is not straight.
fn is_seen_turning(run: &RunLog) -> bool {
    let mut headings = run.truth.iter().filter_map(dataset::TruthSample::theta_rad);
    let mut before = headings.next();
    let mut heading_rad = 0.0;
    let turned = headings.map(|now| {
        heading_rad += before.replace(now).map_or(0.0, |before| wrap_to_pi(now - before));
        heading_rad
    });
    let by_steps_rad: f64 = run.displacements.iter().map(|of| wrap_to_pi(of.dtheta_rad).abs()).sum();
    if extent(turned).max(by_steps_rad) > 10.0 * CHECKS.min_wheel_turn_rad {
        return true;
    }
    let [Some(first), Some(last)] = [run.truth.first(), run.truth.last()] else { return false };
    let far = run.truth.iter().map(|of| (of.x_m - first.x_m).hypot(of.y_m - first.y_m)).fold(0.0, f64::max);
    // Closed paths of positions: the way out is not the way back.
    let across = |of: &dataset::TruthSample| {
        let (dx_m, dy_m) = (last.x_m - first.x_m, last.y_m - first.y_m);
        ((of.x_m - first.x_m) * dy_m - (of.y_m - first.y_m) * dx_m) / dx_m.hypot(dy_m).max(f64::MIN_POSITIVE)
    };
    !run.sees_headings() && far > 0.0 && extent(run.truth.iter().map(across)) > 0.3 * far
}

fn extent(values: impl Iterator<Item = f64>) -> f64 {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), of| (low.min(of), high.max(of)));
    high - low
}
