//! The unit of headings, where no name says it: that in which they turn as the wheels do.

use kinematics::{Pose, wrap_to_pi};

use super::columns::known_or;
use super::options::Options;
use super::runs::{Part, RawRun};
use super::took::{Basis, Confidence};
use crate::column_names::Quantity;
use crate::error::DatasetError;
use crate::unit::Unit;

/// Turns between two poses that say something of the unit of angle, radians: well above the noise of
/// headings, and not so long that the nominal robot's error passes for another turn.
const TELLING_TURN_RAD: std::ops::RangeInclusive<f64> = 0.2..=12.0;

/// The residuals of the right unit of angle are this many times smaller than the other's: those of a wrong
/// one are as large as the turns (radians in degrees) or random (degrees in radians).
const CLEARER: f64 = 3.0;

/// The unit of the headings, if there are any.
pub(super) fn angle_unit(
    parts: &[Part],
    runs: &[RawRun],
    options: &Options,
    reckoned: &[Vec<Pose>],
) -> Result<(Unit, Basis), DatasetError> {
    let truth = &parts[runs[0].truth_part];
    let Some(chosen) = truth.roles.of.get(&Quantity::Heading) else {
        let why = if truth.roles.has(Quantity::Qw) { "a quaternion" } else { "no heading" };
        return Ok((Unit::Rad, Basis::new(Confidence::Certain, why)));
    };
    let (candidates, basis) = known_or(chosen, options.angle_unit, "--angle-unit", &Unit::ANGLES);
    if let [unit] = candidates[..] {
        return Ok((unit, basis));
    }
    let theta =
        |run: &RawRun, row: usize| parts[run.truth_part].log.pose.as_ref().map_or(f64::NAN, |pose| pose.theta[row]);
    // By turns between poses.
    let (mut squares, mut turns) = ([0.0, 0.0], 0);
    for (run, reckoned) in runs.iter().zip(reckoned) {
        let mut last = None;
        for (&row, by_wheels) in run.truth_rows.iter().zip(reckoned) {
            let theta = theta(run, row);
            if !theta.is_finite() {
                continue;
            }
            let Some((last_theta, last_rad)) = last else {
                last = Some((theta, by_wheels.theta_rad));
                continue;
            };
            let turn_rad: f64 = by_wheels.theta_rad - last_rad;
            if turn_rad.abs() >= *TELLING_TURN_RAD.start() {
                if turn_rad.abs() <= *TELLING_TURN_RAD.end() {
                    turns += 1;
                    for (square, unit) in squares.iter_mut().zip(Unit::ANGLES) {
                        *square += wrap_to_pi(unit.to_si(theta - last_theta) - turn_rad).powi(2);
                    }
                }
                last = Some((theta, by_wheels.theta_rad));
            }
        }
    }
    let rms = squares.map(|square: f64| (square / f64::from(turns.max(1))).sqrt());
    for (unit, own, other) in [(Unit::Rad, rms[0], rms[1]), (Unit::Deg, rms[1], rms[0])] {
        if turns > 0 && CLEARER * own < other {
            let why = format!("turns agree with the wheels to {own:.3} rad, {turns} of them");
            return Ok((unit, Basis::new(Confidence::Likely, why)));
        }
    }
    // By size: a heading that is wrapped stays within a turn.
    let all: Vec<f64> = runs
        .iter()
        .flat_map(|run| run.truth_rows.iter().map(|&row| theta(run, row)))
        .filter(|theta| theta.is_finite())
        .collect();
    let largest = all.iter().copied().map(f64::abs).fold(0.0, f64::max);
    let leaps = all.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
    if leaps > 180.0 && largest <= 360.0 {
        return Ok((Unit::Deg, Basis::new(Confidence::Likely, format!("it leaps by {leaps:.1}, a whole turn"))));
    }
    if leaps > std::f64::consts::PI && largest <= std::f64::consts::TAU {
        return Ok((Unit::Rad, Basis::new(Confidence::Likely, format!("it leaps by {leaps:.3}, a whole turn"))));
    }
    let why = if turns > 0 { "turns agree with the wheels' in neither" } else { "the robot hardly turns" };
    Err(DatasetError::Undecided {
        file: truth.sheet.file.clone(),
        what: format!("the unit of {} (at most {largest}, and {why})", truth.sheet.names[chosen.index]),
        readings: "rad or deg".to_owned(),
        flag: "--angle-unit rad or --angle-unit deg".to_owned(),
    })
}
