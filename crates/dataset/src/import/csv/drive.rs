//! What the columns of the wheels mean as motion of the stated robot, in each unit that they may be in.

use kinematics::{DriveGeometry, Increment, Pose, Wheels};

use super::columns::Chosen;
use super::options::{Options, Rates};
use super::runs::{Part, RawRun};
use super::times::seconds;
use super::took::{Basis, Confidence};
use crate::column_names::Quantity;
use crate::unit::Unit;

/// Drive and counts by which wheels become motion.
#[derive(Debug, Clone, Copy)]
pub(super) struct Drive {
    pub(super) geometry: DriveGeometry,
    pub(super) ticks_per_rev: Option<f64>,
    pub(super) counter_bits: Option<u8>,
    pub(super) rates: Rates,
}

impl Drive {
    /// Metres of one unit of a wheel's column, or metres a second.
    pub(super) fn m_per_unit(&self, unit: Unit) -> Option<Wheels<f64>> {
        let m_per_rad = self.geometry.m_per_rad();
        match unit {
            Unit::Ticks | Unit::TicksPerRow => self.geometry.m_per_count(self.ticks_per_rev?).ok(),
            Unit::RadPerRow => Some(m_per_rad),
            Unit::MPerRow => Some(Wheels::both(1.0)),
            _ if unit.is_of_contact() || Unit::LENGTHS.contains(&unit) => Some(Wheels::both(unit.to_si(1.0))),
            _ => Some(m_per_rad.map(|m_per_rad| m_per_rad * unit.to_si(1.0))),
        }
    }

    /// How far a wheel went from one row to another in units of its column.
    fn moved(&self, unit: Unit, column: &[f64], before: usize, row: usize, dt_s: f64) -> f64 {
        match (unit, self.counter_bits) {
            _ if unit.is_rate() => self.rate(column, before, row) * dt_s,
            _ if unit.is_per_row() => column[row],
            (Unit::Ticks, Some(bits)) => {
                // The step modulo 2ⁿ that is the nearest to none, as the reader takes it.
                let turn = 2_f64.powi(i32::from(bits));
                let step = column[row] - column[before];
                step - turn * (step / turn).round()
            }
            _ => column[row] - column[before],
        }
    }

    fn rate(&self, column: &[f64], before: usize, row: usize) -> f64 {
        match self.rates {
            Rates::IntervalEnd => column[row],
            Rates::Instantaneous => 0.5 * (column[before] + column[row]),
        }
    }

    /// The motion of each interval that ends at a row of a run, none at the first.
    pub(super) fn increments(&self, part: &Part, rows: &[usize], units: WheelUnits) -> Vec<Increment> {
        let still = Increment { distance_m: 0.0, turn_rad: 0.0 };
        let Some([first, second]) = &part.log.wheels else { return vec![still; rows.len()] };
        let increment = |before: usize, row: usize| {
            let dt_s = seconds(part.log.time[before], part.log.time[row]);
            match units {
                WheelUnits::Twist([speed, yaw_rate]) => Increment {
                    distance_m: speed.to_si(self.rate(first, before, row)) * dt_s,
                    turn_rad: yaw_rate.to_si(self.rate(second, before, row)) * dt_s,
                },
                WheelUnits::Wheels(unit) => {
                    let moved = |column: &[f64]| self.moved(unit, column, before, row, dt_s);
                    let moved = Wheels { left: moved(first), right: moved(second) };
                    let m_per_unit = self.m_per_unit(unit).unwrap_or(Wheels::both(0.0));
                    self.geometry.increment(moved.zip_with(m_per_unit, |moved, m| moved * m))
                }
            }
        };
        let pairs = rows.windows(2).map(|pair| increment(pair[0], pair[1]));
        rows.iter().take(1).map(|_| still).chain(pairs).collect()
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
    pub(super) fn name(self) -> String {
        match self {
            Self::Wheels(unit) => format!("wheels in {}", unit.name()),
            Self::Twist([speed, yaw_rate]) => format!("v in {}, omega in {}", speed.name(), yaw_rate.name()),
        }
    }

    /// The one unit of both wheels.
    pub(super) const fn of_wheels(self) -> Option<Unit> {
        match self {
            Self::Wheels(unit) => Some(unit),
            Self::Twist(_) => None,
        }
    }
}

/// How far the wheels of a log go in one unit of its time, metres, while they move; `None` for rates.
pub(super) fn speed_m_per_unit(part: &Part, units: WheelUnits, drive: &Drive) -> Option<f64> {
    let unit = units.of_wheels().filter(|unit| !unit.is_rate())?;
    let m = drive.m_per_unit(unit)?;
    let log = &part.log;
    let [left, right] = log.wheels.as_ref()?;
    let rows: Vec<usize> = (0..log.time.len()).filter(|&row| log.has_wheels_at(row)).collect();
    let (mut distance_m, mut time) = (0.0, 0.0);
    for pair in rows.windows(2) {
        let moved = |column: &[f64], m: f64| drive.moved(unit, column, pair[0], pair[1], 0.0).abs() * m;
        let of_pair = 0.5 * (moved(left, m.left) + moved(right, m.right));
        if of_pair > 0.0 && log.run_of(pair[0]) == log.run_of(pair[1]) {
            distance_m += of_pair;
            time += seconds(log.time[pair[0]], log.time[pair[1]]);
        }
    }
    (time > 0.0).then(|| distance_m / time)
}

/// What a run's wheels may be, the usual first, before poses are looked at.
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
    // A name says that a wheel is counted, not whether its rows are readings or what was counted since the
    // last.
    const COUNTS: [Unit; 2] = [Unit::Ticks, Unit::TicksPerRow];
    match chosen[0].unit.or(chosen[1].unit) {
        Some(Unit::Ticks) => return (of(&COUNTS), chosen[0].unit_basis.clone()),
        Some(unit) => return (of(&[unit]), chosen[0].unit_basis.clone()),
        None => {}
    }
    if chosen[0].is_counted && chosen[1].is_counted {
        return (of(&COUNTS), Basis::new(Confidence::Likely, "names"));
    }
    let rates = [Unit::RadPerS, Unit::DegPerS, Unit::Rpm, Unit::MPerS, Unit::MmPerS];
    if chosen[0].is_rate && chosen[1].is_rate {
        return (of(&rates), Basis::new(Confidence::Likely, ""));
    }
    if chosen[0].is_angle && chosen[1].is_angle {
        return (of(&[Unit::Rad, Unit::Deg]), Basis::new(Confidence::Likely, "names"));
    }
    let are_whole = part.log.wheels.iter().flatten().flatten().all(|value| value.is_nan() || value.fract() == 0.0);
    if are_whole {
        return (of(&COUNTS), Basis::new(Confidence::Likely, "whole numbers"));
    }
    (of(&[&[Unit::Rad, Unit::Deg][..], &rates[..4]].concat()), Basis::new(Confidence::Likely, ""))
}

/// Poses by the wheels at the instants of the truth, from the first of them on.
pub(super) fn dead_reckoned(parts: &[Part], run: &RawRun, units: WheelUnits, drive: &Drive) -> Vec<Pose> {
    let (part, truth) = (&parts[run.part], &parts[run.truth_part]);
    let (mut poses, mut pose, mut waiting) = (Vec::new(), Pose::IDENTITY, run.truth_rows.iter().peekable());
    for (&row, increment) in run.rows.iter().zip(drive.increments(part, &run.rows, units)) {
        pose = pose * increment.arc();
        while waiting.next_if(|&&seen| truth.log.time[seen] <= part.log.time[row]).is_some() {
            poses.push(pose);
        }
    }
    // Poses after the last row are of a robot that no one watched any more.
    poses
}
