//! The units of wheels, positions and headings, where no name says them: those in which the wheels by the
//! nominal robot and the poses tell of the same motion.

use kinematics::{DriveGeometry, Increment, Pose, Wheels, wrap_to_pi};

use super::columns::Chosen;
use super::options::{Options, Rates};
use super::runs::{Part, RawRun};
use super::times::seconds;
use super::took::{Basis, Confidence};
use crate::column_names::Quantity;
use crate::error::DatasetError;
use crate::unit::Unit;

/// Poses and wheels tell of the same motion where they reach equally far within this factor. Nominal and true
/// wheels differ by a few per cent; units differ by at least 1.45 (rad/s and m against deg/s and inches).
const MAX_EQUAL_EXTENT_RATIO: f64 = 1.2;

/// From here on a user should look, though the units are known: counts of a turn are mistaken by a factor of
/// 2 or 4, diameters and radii by 2.
const MAX_USUAL_EXTENT_RATIO: f64 = 1.5;

/// Below this reach, metres, wheels say nothing of the unit of length: a spin wanders so far.
const MIN_EXTENT_M: f64 = 0.1;

/// Turns between two poses that say something of the unit of angle, radians: well above the noise of
/// headings, and not so long that the nominal robot's error passes for another turn.
const TELLING_TURN_RAD: std::ops::RangeInclusive<f64> = 0.2..=12.0;

/// The residuals of the right unit of angle are this many times smaller than the other's: those of a wrong
/// one are as large as the turns (radians in degrees) or random (degrees in radians).
const CLEARER: f64 = 3.0;

/// Drive and counts by which wheels become motion.
#[derive(Debug, Clone, Copy)]
pub(super) struct Drive {
    pub(super) geometry: DriveGeometry,
    pub(super) ticks_per_rev: Option<f64>,
    pub(super) rates: Rates,
}

impl Drive {
    /// Metres of one unit of a wheel's column, or metres a second.
    pub(super) fn m_per_unit(&self, unit: Unit) -> Option<Wheels<f64>> {
        let m_per_rad = self.geometry.m_per_rad();
        match unit {
            Unit::Ticks => self.geometry.m_per_count(self.ticks_per_rev?).ok(),
            _ if unit.is_of_contact() || Unit::LENGTHS.contains(&unit) => Some(Wheels::both(unit.to_si(1.0))),
            _ => Some(m_per_rad.map(|m_per_rad| m_per_rad * unit.to_si(1.0))),
        }
    }
}

/// What the wheels' columns are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum WheelUnits {
    /// Both wheels in one unit.
    Wheels(Unit),
    /// Speed and yaw rate.
    Twist([Unit; 2]),
}

impl WheelUnits {
    fn name(self) -> String {
        match self {
            Self::Wheels(unit) => format!("wheels in {}", unit.name()),
            Self::Twist([speed, yaw_rate]) => format!("v in {}, omega in {}", speed.name(), yaw_rate.name()),
        }
    }
}

/// The units of one part's columns.
#[derive(Debug, Clone)]
pub(super) struct Units {
    pub(super) wheels: WheelUnits,
    pub(super) wheels_by: Basis,
    pub(super) length: Unit,
    pub(super) length_by: Basis,
    pub(super) angle: Unit,
    pub(super) angle_by: Basis,
    pub(super) remark: Option<String>,
}

/// How far the wheels of a log go in one unit of its time, metres, while they move; `None` for rates.
pub(super) fn speed_m_per_unit(part: &Part, units: WheelUnits, drive: &Drive) -> Option<f64> {
    let WheelUnits::Wheels(unit) = units else { return None };
    let m = drive.m_per_unit(unit).filter(|_| !unit.is_rate())?;
    let log = &part.log;
    let [left, right] = log.wheels.as_ref()?;
    let rows: Vec<usize> = (0..log.time.len()).filter(|&row| log.has_wheels_at(row)).collect();
    let (mut distance_m, mut time) = (0.0, 0.0);
    for pair in rows.windows(2) {
        let moved = |column: &[f64], m: f64| (column[pair[1]] - column[pair[0]]).abs() * m;
        let of_pair = 0.5 * (moved(left, m.left) + moved(right, m.right));
        if of_pair > 0.0 && log.run_of(pair[0]) == log.run_of(pair[1]) {
            distance_m += of_pair;
            time += seconds(log.time[pair[0]], log.time[pair[1]]);
        }
    }
    (time > 0.0).then(|| distance_m / time)
}

/// What a run's wheels may be, before poses are looked at.
pub(super) fn wheel_candidates(part: &Part, options: &Options) -> (Vec<WheelUnits>, Basis) {
    let Some(pair) = part.roles.wheels() else { return (Vec::new(), Basis::new(Confidence::Assumed, "")) };
    let chosen = pair.map(|quantity| &part.roles.of[&quantity]);
    if pair[0] == Quantity::Speed {
        let of = |chosen: &Chosen, usual| chosen.unit.unwrap_or(usual);
        let units = [of(chosen[0], Unit::MPerS), of(chosen[1], Unit::RadPerS)];
        let known = chosen.iter().all(|chosen| chosen.unit.is_some());
        let basis =
            if known { chosen[0].unit_basis.clone() } else { Basis::new(Confidence::Likely, "usual for a twist") };
        return (vec![WheelUnits::Twist(units)], basis);
    }
    let of = |units: &[Unit]| units.iter().copied().map(WheelUnits::Wheels).collect::<Vec<_>>();
    let given = chosen[0].unit.filter(|_| chosen[0].unit_basis.confidence == Confidence::Given);
    if let Some(unit) = given {
        return (of(&[unit]), chosen[0].unit_basis.clone());
    }
    if let Some(unit) = options.wheel_unit {
        return (of(&[unit]), Basis::new(Confidence::Given, "--wheel-unit"));
    }
    if let Some(unit) = chosen[0].unit.or(chosen[1].unit) {
        return (of(&[unit]), chosen[0].unit_basis.clone());
    }
    if chosen[0].is_counted && chosen[1].is_counted {
        return (of(&[Unit::Ticks]), Basis::new(Confidence::Likely, "names"));
    }
    if chosen[0].is_rate && chosen[1].is_rate {
        return (
            of(&[Unit::RadPerS, Unit::DegPerS, Unit::Rpm, Unit::MPerS, Unit::MmPerS]),
            Basis::new(Confidence::Likely, ""),
        );
    }
    let are_whole = part.log.wheels.iter().flatten().flatten().all(|value| value.is_nan() || value.fract() == 0.0);
    if are_whole {
        return (of(&[Unit::Ticks]), Basis::new(Confidence::Likely, "whole numbers"));
    }
    (
        of(&[Unit::Rad, Unit::Deg, Unit::RadPerS, Unit::DegPerS, Unit::Rpm, Unit::MPerS]),
        Basis::new(Confidence::Likely, ""),
    )
}

/// Poses by the wheels at the instants of the truth, from the first of them on.
fn dead_reckoned(parts: &[Part], run: &RawRun, units: WheelUnits, drive: &Drive) -> Vec<Pose> {
    let (part, truth) = (&parts[run.part], &parts[run.truth_part]);
    let Some([first, second]) = &part.log.wheels else { return Vec::new() };
    let (mut poses, mut pose, mut waiting) = (Vec::new(), Pose::IDENTITY, run.truth_rows.iter().peekable());
    let increment = |before: usize, row: usize| -> Option<Increment> {
        let dt_s = seconds(part.log.time[before], part.log.time[row]);
        let rate = |column: &[f64]| match drive.rates {
            Rates::IntervalEnd => column[row],
            Rates::Instantaneous => 0.5 * (column[before] + column[row]),
        };
        match units {
            WheelUnits::Twist([speed, yaw_rate]) => Some(Increment {
                distance_m: speed.to_si(rate(first)) * dt_s,
                turn_rad: yaw_rate.to_si(rate(second)) * dt_s,
            }),
            WheelUnits::Wheels(unit) => {
                let moved = |column: &[f64]| {
                    if unit.is_rate() { rate(column) * dt_s } else { column[row] - column[before] }
                };
                let moved = Wheels { left: moved(first), right: moved(second) };
                Some(drive.geometry.increment(moved.zip_with(drive.m_per_unit(unit)?, |moved, m| moved * m)))
            }
        }
    };
    for (index, &row) in run.rows.iter().enumerate() {
        if let Some(before) = index.checked_sub(1)
            && let Some(increment) = increment(run.rows[before], row)
        {
            pose = pose * increment.arc();
        }
        while waiting.next_if(|&&seen| truth.log.time[seen] <= part.log.time[row]).is_some() {
            poses.push(pose);
        }
    }
    // Poses after the last row are of a robot that no one watched any more.
    poses
}

/// The largest distance from the first of some positions.
fn extent_m(positions: impl Iterator<Item = (f64, f64)>) -> f64 {
    let mut positions = positions.peekable();
    let Some(&(x, y)) = positions.peek() else { return 0.0 };
    positions.map(|position| (position.0 - x).hypot(position.1 - y)).fold(0.0, f64::max)
}

/// Decides the units of the wheels of one part and of the poses that saw its runs.
pub(super) fn units(parts: &[Part], runs: &[RawRun], options: &Options, drive: &Drive) -> Result<Units, DatasetError> {
    let (part, truth) = (&parts[runs[0].part], &parts[runs[0].truth_part]);
    let (wheels, mut wheels_by) = wheel_candidates(part, options);
    let (lengths, mut length_by) =
        known_or(&truth.roles.of[&Quantity::X], options.length_unit, "--length-unit", &Unit::LENGTHS);
    let by_unit: Vec<(WheelUnits, Vec<Vec<Pose>>)> = wheels
        .iter()
        .map(|&units| (units, runs.iter().map(|run| dead_reckoned(parts, run, units, drive)).collect()))
        .collect();
    let mut readings: Vec<Reading<'_>> = Vec::new();
    for (units, poses) in &by_unit {
        let (mut seen, mut reckoned) = (0.0, 0.0);
        for (run, poses) in runs.iter().zip(poses) {
            let pose = parts[run.truth_part].log.pose.as_ref();
            let position = |&row: &usize| pose.map(|pose| (pose.x[row], pose.y[row]));
            seen += extent_m(run.truth_rows.iter().take(poses.len()).filter_map(position));
            reckoned += extent_m(poses.iter().map(|pose| (pose.x_m, pose.y_m)));
        }
        for &length in &lengths {
            let ratio = (reckoned >= MIN_EXTENT_M && seen > 0.0).then(|| length.to_si(seen) / reckoned);
            readings.push((*units, length, ratio, poses));
        }
    }
    let fits = |ratio: &Option<f64>, factor: f64| ratio.is_some_and(|ratio| (1.0 / factor..=factor).contains(&ratio));
    let is_open = readings.len() > 1;
    let mut remark = None;
    let fitting: Vec<_> = if is_open {
        readings.iter().filter(|reading| fits(&reading.2, MAX_EQUAL_EXTENT_RATIO)).collect()
    } else {
        readings.iter().collect()
    };
    let &&(units, length, ratio, poses) = match &fitting[..] {
        [one] => one,
        _ => return Err(undecided_extent(part, truth, &readings, &fitting)),
    };
    if let Some(ratio) = ratio {
        let why = format!("poses reach {ratio:.3} times as far as wheels");
        if lengths.len() > 1 {
            length_by = Basis::new(Confidence::Likely, why.clone());
        }
        if wheels.len() > 1 {
            wheels_by = Basis::new(Confidence::Likely, why);
        }
        if !is_open && !fits(&Some(ratio), MAX_USUAL_EXTENT_RATIO) {
            remark = Some(format!(
                "the poses reach {ratio:.3} times as far as the wheels by the nominal robot; look at the units, --wheel and --ticks-per-rev"
            ));
        }
    }
    let (angle, angle_by) = angle_unit(parts, runs, options, poses)?;
    Ok(Units { wheels: units, wheels_by, length, length_by, angle, angle_by, remark })
}

/// A unit that is said or named, or all that it may be.
fn known_or(chosen: &Chosen, flag: Option<Unit>, name: &str, all: &[Unit]) -> (Vec<Unit>, Basis) {
    match (chosen.unit, flag) {
        (Some(unit), _) if chosen.unit_basis.confidence == Confidence::Given => (vec![unit], chosen.unit_basis.clone()),
        (_, Some(unit)) => (vec![unit], Basis::new(Confidence::Given, name)),
        (Some(unit), None) => (vec![unit], chosen.unit_basis.clone()),
        (None, None) => (all.to_vec(), Basis::new(Confidence::Likely, "")),
    }
}

/// Units of wheels and positions, how many times as far the poses then reach, and the poses by the wheels of
/// each run.
type Reading<'a> = (WheelUnits, Unit, Option<f64>, &'a Vec<Vec<Pose>>);

fn undecided_extent(part: &Part, truth: &Part, all: &[Reading<'_>], fitting: &[&Reading<'_>]) -> DatasetError {
    let many_wheels = all.iter().any(|reading| reading.0 != all[0].0);
    let many_lengths = all.iter().any(|reading| reading.1 != all[0].1);
    let name = |reading: &Reading<'_>| match (many_wheels, many_lengths) {
        (true, true) => format!("{} with x, y in {}", reading.0.name(), reading.1.name()),
        (true, false) => reading.0.name(),
        (false, _) => reading.1.name().to_owned(),
    };
    let (why, mut readings) = if fitting.is_empty() {
        let first = all[0];
        let why = first.2.map_or("the robot does not go far enough to tell".to_owned(), |ratio| {
            format!(
                "none fits: with {} the poses reach {ratio:.3} times as far as the wheels by the nominal robot; are --wheel and --ticks-per-rev right?",
                name(&first)
            )
        });
        (format!(" ({why})"), all.iter().map(name).collect::<Vec<_>>())
    } else {
        (String::new(), fitting.iter().map(|reading| name(reading)).collect())
    };
    readings.dedup();
    let flags = [(many_wheels, "--wheel-unit"), (many_lengths, "--length-unit")];
    let flags: Vec<_> = flags.into_iter().filter(|(open, _)| *open).map(|(_, flag)| format!("{flag} UNIT")).collect();
    DatasetError::Undecided {
        file: if many_wheels { part.sheet.file.clone() } else { truth.sheet.file.clone() },
        what: format!("the unit of {}{why}", if many_wheels { "the wheels" } else { "x and y" }),
        readings: readings.join(" or "),
        flag: flags.join(" and "),
    }
}

/// The unit of the headings, if there are any.
fn angle_unit(
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
