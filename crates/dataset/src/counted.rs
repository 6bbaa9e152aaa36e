//! Recorded rates and angles that are made of counts.
//!
//! A driver that divides counts by the time between rows, or by those of a turn, and writes the quotient with
//! few decimals, has not lost the counts: where they are farther apart than what was rounded, the nearest is
//! the right one. The rounding of a rate stays for as long as the robot drives evenly; that of counts does
//! not ([`crate::recorded_step`]).

use std::collections::BTreeSet;
use std::f64::consts::TAU;

use kinematics::{DriveGeometry, Side, Twist, Wheels};

use crate::order_statistics::median;
use crate::record::{NominalRobot, Run, WheelLog};
use crate::settings::ROUNDED_RATES;

/// Puts counts in place of recorded angles, where these are a whole number of the stated counts but for their
/// rounding, and of rates, where these are one in a sampling period, in the mean time between rows, or in the
/// time since the row before. Where a few rates are not, or rows are missing, of which nobody knows the
/// counts, the rates of the others are put right. What a robot's runs say together decides.
pub(crate) fn restore(runs: &mut [Run], robot: &NominalRobot) {
    fn restored<C: Counted>(runs: &mut [Run], of: impl Fn(&Run) -> Option<C>) -> bool {
        let found: Vec<Option<C>> = runs.iter().map(of).collect();
        let is_certain = are_counted(&found.iter().flatten().collect::<Vec<_>>());
        if is_certain {
            let found = runs.iter_mut().zip(&found).filter_map(|(run, found)| Some((run, found.as_ref()?)));
            found.for_each(|(run, found)| found.apply(run));
        }
        is_certain
    }
    let _ = restored(runs, |run| CountedAngles::of(run, robot))
        || [RowTime::Period, RowTime::Mean, RowTime::Stamps]
            .into_iter()
            .any(|of| restored(runs, |run| CountedRates::of(run, robot, of)));
}

/// The time that a driver divides counts by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum RowTime {
    /// The sampling period.
    Period,
    /// The mean time between rows: where stamps jitter by as much as the period, it is known better.
    Mean,
    /// The time since the row before, by its stamp.
    Stamps,
}

/// What a run may be made of.
trait Counted {
    fn counts(&self) -> &Counts;

    fn apply(&self, run: &mut Run);
}

/// Counts that something may be made of.
struct Counts {
    /// By row; `None` where it is no whole number.
    by_row: Vec<Option<Wheels<f64>>>,
    /// What they are off whole numbers by at the most.
    off: f64,
}

impl Counts {
    /// By row what may be counts, and what each is rounded by at the most; `None` where that is not known.
    fn of(rows: impl Iterator<Item = Option<(Wheels<f64>, Wheels<f64>)>>) -> Self {
        let mut off = 0.0_f64;
        let by_row = rows.map(|row| {
            let (counts, rounded) = row?;
            let whole = of_both(counts.zip_with(rounded, nearest_count))?;
            let apart = counts.zip_with(whole, |counts, whole| (counts - whole).abs());
            off = off.max(apart.left).max(apart.right);
            Some(whole)
        });
        let by_row = by_row.collect();
        Self { by_row, off }
    }
}

/// The counts that the angles of a run may be made of, since the first row.
struct CountedAngles {
    counts: Counts,
    /// Of the first row.
    first: Wheels<f64>,
}

impl CountedAngles {
    fn of(run: &Run, robot: &NominalRobot) -> Option<Self> {
        let WheelLog::Angles(angles) = &run.odometry.wheels else { return None };
        let rad_per_count = TAU / robot.ticks_per_rev?;
        // Those of a row and of the first.
        let rounded = run.odometry.wheels.decimal_step().unwrap_or(0.0) / rad_per_count;
        let first = Wheels { left: *angles.left.first()?, right: *angles.right.first()? };
        let of_row = |(left, right): (&f64, &f64)| {
            let since_first = Wheels { left: left - first.left, right: right - first.right };
            Some((since_first.map(|rad| rad / rad_per_count), Wheels::both(rounded)))
        };
        let counts = Counts::of(angles.left.iter().zip(&angles.right).map(of_row));
        let first = first.map(|rad| (rad / rad_per_count).round());
        Some(Self { counts, first })
    }
}

impl Counted for CountedAngles {
    fn counts(&self) -> &Counts {
        &self.counts
    }

    fn apply(&self, run: &mut Run) {
        let Some(counts) = self.counts.by_row.iter().copied().collect::<Option<Vec<Wheels<f64>>>>() else { return };
        let column = |side: Side| counts.iter().map(|of| (self.first[side] + of[side]) as i64).collect();
        run.odometry.wheels = WheelLog::Ticks(Wheels::from_sides(column));
    }
}

/// The counts that the rates of a run may be made of.
struct CountedRates {
    counts: Counts,
    /// In which they came, by row, seconds.
    row_s: Vec<f64>,
    /// Are rows missing?
    is_missing: bool,
    m_per_count: Wheels<f64>,
    geometry: DriveGeometry,
}

impl CountedRates {
    fn of(run: &Run, robot: &NominalRobot, row_time: RowTime) -> Option<Self> {
        let ticks_per_rev = robot.ticks_per_rev?;
        let geometry = robot.geometry().ok()?;
        let wheels = &run.odometry.wheels;
        // A twist has the rounding of both of its rates in each wheel.
        let wheel_share = match wheels {
            WheelLog::Speeds(_) => 1.0,
            WheelLog::Twist { .. } => 1.0 + 0.5 * geometry.wheel_separation_m(),
            WheelLog::Ticks(_) | WheelLog::Angles(_) => return None,
        };
        let rounded_m_s = 0.5 * wheel_share * wheels.decimal_step().unwrap_or(0.0);
        let m_per_count = geometry.m_per_rad().map(|m_per_rad| m_per_rad * TAU / ticks_per_rev);
        let t_s = &run.odometry.t_s;
        let since_s: Vec<f64> = t_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let usual_s = median(since_s.clone())?;
        let period = t_s.sampling_period();
        let even = |row_s: f64| vec![row_s; t_s.len()];
        let row_s = match row_time {
            RowTime::Period => even(period.map_or(usual_s, |period| period.period_s)),
            RowTime::Mean => even((t_s.last()? - t_s.first()?) / since_s.len() as f64),
            RowTime::Stamps => [usual_s].into_iter().chain(since_s).collect(),
        };
        let of_row = |(row, row_s): (usize, &f64)| {
            let speed_m_s = wheels.reported_speed_m_s(&geometry, row)?;
            let counts = speed_m_s.zip_with(m_per_count, |speed_m_s, m_per_count| speed_m_s * row_s / m_per_count);
            Some((counts, m_per_count.map(|m_per_count| rounded_m_s * row_s / m_per_count)))
        };
        Some(Self {
            counts: Counts::of(row_s.iter().enumerate().map(of_row)),
            row_s,
            is_missing: period.is_some_and(|period| period.numbers.windows(2).any(|pair| pair[1] - pair[0] != 1)),
            m_per_count,
            geometry,
        })
    }

    /// A wheel's counter since the first row, whose own counts are of an interval before the log.
    fn counter(&self, side: Side) -> Vec<i64> {
        let mut count = 0;
        let next = |of: &Option<Wheels<f64>>| {
            count += of.map_or(0, |of| of[side] as i64);
            count
        };
        let since_first: Vec<i64> = self.counts.by_row.iter().skip(1).map(next).collect();
        [0].into_iter().chain(since_first).collect()
    }
}

impl Counted for CountedRates {
    fn counts(&self) -> &Counts {
        &self.counts
    }

    fn apply(&self, run: &mut Run) {
        let by_row = &self.counts.by_row;
        if !self.is_missing && by_row.iter().skip(1).all(Option::is_some) {
            run.odometry.wheels = WheelLog::Ticks(Wheels::from_sides(|side| self.counter(side)));
            return;
        }
        for (row, (of, row_s)) in by_row.iter().zip(&self.row_s).enumerate() {
            let Some(counts) = of else { continue };
            let speed_m_s = counts.zip_with(self.m_per_count, |count, m_per_count| count * m_per_count / row_s);
            match &mut run.odometry.wheels {
                WheelLog::Speeds(speeds) => (speeds.left[row], speeds.right[row]) = (speed_m_s.left, speed_m_s.right),
                WheelLog::Twist { v_mps, omega_radps } => {
                    let Twist { v_m_s, omega_rad_s } = self.geometry.twist(speed_m_s);
                    (v_mps[row], omega_radps[row]) = (v_m_s, omega_rad_s);
                }
                WheelLog::Ticks(_) | WheelLog::Angles(_) => {}
            }
        }
    }
}

/// The counts of both wheels, where both are whole.
fn of_both(counts: Wheels<Option<f64>>) -> Option<Wheels<f64>> {
    Some(Wheels { left: counts.left?, right: counts.right? })
}

/// The nearest whole number of counts; `None` where the rounding leaves open which it is, none is within it,
/// or there are so many that any number is whole.
fn nearest_count(counts: f64, rounded: f64) -> Option<f64> {
    let (settings, nearest) = (&*ROUNDED_RATES, counts.round());
    let tolerance = settings.count_tolerance_ratio * nearest.abs();
    let tolerance = tolerance.clamp(settings.min_count_tolerance, settings.max_count_tolerance);
    let is_within = (counts - nearest).abs() <= rounded + tolerance;
    (is_within && rounded <= settings.max_rounded_counts && nearest.abs() <= settings.max_counts).then_some(nearest)
}

/// Are nearly all rows in which a wheel turned made of counts, and of so many numbers that it is no chance?
/// What is not made of counts is as near to a whole number as all are with twice that probability. A robot
/// that drives evenly says the same again and again, so that a number counts once; but a row below or above
/// both of those beside it is no even drive.
fn are_counted(runs: &[&impl Counted]) -> bool {
    let settings = &*ROUNDED_RATES;
    let moving = || runs.iter().flat_map(|run| &run.counts().by_row).filter(|of| **of != Some(Wheels::both(0.0)));
    let counted: Vec<&Wheels<f64>> = moving().flatten().collect();
    let numbers: BTreeSet<(Side, i64)> =
        counted.iter().flat_map(|of| Side::BOTH.map(|side| (side, of[side] as i64))).collect();
    // Whole numbers themselves are of a period that is known to so much.
    let off = runs.iter().map(|run| run.counts().off).fold(settings.min_count_error, f64::max);
    let alone: usize = runs.iter().map(|run| rows_alone(&run.counts().by_row)).sum();
    let log_chance = (numbers.len() + alone) as f64 * (2.0 * off).ln();
    log_chance <= settings.max_chance_of_counts.ln()
        && counted.len() as f64 >= settings.min_counted_share * moving().count() as f64
}

/// In how many rows a wheel turns faster or slower than in both of those beside it.
fn rows_alone(by_row: &[Option<Wheels<f64>>]) -> usize {
    let is_alone = |rows: &&[Option<Wheels<f64>>]| {
        let [Some(before), Some(row), Some(behind)] = rows else { return false };
        Side::BOTH.iter().any(|&side| (row[side] - before[side]) * (row[side] - behind[side]) > 0.0)
    };
    by_row.windows(3).filter(is_alone).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Odometry;

    const ROBOT: NominalRobot = NominalRobot {
        left_wheel_diameter_m: 0.16,
        right_wheel_diameter_m: 0.16,
        wheel_separation_m: 0.363,
        ticks_per_rev: Some(500.0),
        counter_bits: None,
    };

    /// A robot that speeds up for 2 s and goes on, its counts divided by these times; rates in steps.
    fn run(row_s: impl Fn(usize) -> f64, step: f64, is_twist: bool) -> (Run, Wheels<Vec<f64>>) {
        let m_per_count = 0.16 * std::f64::consts::PI / 500.0;
        let counts = |share: f64| -> Vec<f64> {
            let at = |row: u32| {
                let t_s = 0.02 * f64::from(row);
                (share * 0.3 * if t_s < 2.0 { 0.25 * t_s * t_s } else { t_s - 1.0 } / m_per_count).floor()
            };
            (0..400).map(|row| at(row + 1) - at(row)).collect()
        };
        let speeds = |share: f64| -> Vec<f64> {
            counts(share).iter().enumerate().map(|(row, count)| count * m_per_count / row_s(row)).collect()
        };
        let exact = Wheels { left: speeds(1.0), right: speeds(-0.61) };
        let rounded = |of: f64| (of / step).round() * step;
        let wheels = if is_twist {
            let both = || exact.left.iter().zip(&exact.right);
            WheelLog::Twist {
                v_mps: both().map(|(left, right)| rounded(0.5 * (left + right))).collect(),
                omega_radps: both().map(|(left, right)| rounded((right - left) / 0.363)).collect(),
            }
        } else {
            WheelLog::Speeds(exact.as_ref().map(|of| of.iter().map(|of| rounded(*of)).collect()))
        };
        let t_s: Vec<f64> = (0..400)
            .scan(0.0, |t_s, row| {
                *t_s += row_s(row);
                Some(*t_s)
            })
            .collect();
        (Run { odometry: Odometry { t_s: t_s.into(), wheels, ..Odometry::default() }, ..Run::default() }, exact)
    }

    fn largest_error(run: &Run, exact: &Wheels<Vec<f64>>) -> f64 {
        let geometry = ROBOT.geometry().expect("a robot");
        let off = |row: usize| {
            let of = run.odometry.wheels.reported_speed_m_s(&geometry, row).expect("speeds");
            f64::max((of.left - exact.left[row]).abs(), (of.right - exact.right[row]).abs())
        };
        (0..run.odometry.t_s.len()).map(off).fold(0.0, f64::max)
    }

    #[test]
    fn rates_of_counts_are_the_counts() {
        // One count is 50 mm/s; the rates of rows of even length, and of rows that were late.
        let late = |row: usize| if row % 7 == 3 { 0.023 } else { 0.0195 };
        for is_twist in [false, true] {
            for row_s in [&|_| 0.02, &late as &dyn Fn(usize) -> f64] {
                let (mut run, exact) = run(row_s, 1e-3, is_twist);
                restore(std::slice::from_mut(&mut run), &ROBOT);
                let WheelLog::Ticks(ticks) = &run.odometry.wheels else { panic!("{is_twist}") };
                let m_per_count = 0.16 * std::f64::consts::PI / 500.0;
                for row in 1..400 {
                    let count = |column: &[i64]| (column[row] - column[row - 1]) as f64 * m_per_count / row_s(row);
                    assert!((count(&ticks.left) - exact.left[row]).abs() < 1e-9);
                    assert!((count(&ticks.right) - exact.right[row]).abs() < 1e-9);
                }
            }
        }
    }

    #[test]
    fn rates_beside_missing_rows_are_those_of_their_counts() {
        for is_twist in [false, true] {
            let (mut run, mut exact) = run(|_| 0.02, 1e-3, is_twist);
            let keep: Vec<bool> = (0..400).map(|row| row % 50 != 7).collect();
            run.odometry.retain_rows(&keep);
            for column in [&mut exact.left, &mut exact.right] {
                let mut kept = keep.iter();
                column.retain(|_| kept.next() == Some(&true));
            }
            assert!(largest_error(&run, &exact) > 3e-4);
            restore(std::slice::from_mut(&mut run), &ROBOT);
            assert!(largest_error(&run, &exact) < 1e-9, "{is_twist}");
            assert_eq!(run.odometry.wheels.recorded_step(), None);
        }
    }

    /// What is made of speeds in steps of `step_m_s`, both wheels' the same, of a robot of so many counts.
    fn restored(t_s: &[f64], speeds_m_s: &[f64], step_m_s: f64, ticks_per_rev: f64) -> WheelLog {
        let rounded = speeds_m_s.iter().map(|of| (of / step_m_s).round() * step_m_s).collect();
        let wheels = WheelLog::Speeds(Wheels::both(rounded));
        let odometry = Odometry { t_s: t_s.to_vec().into(), wheels, ..Odometry::default() };
        let mut run = Run { odometry, ..Run::default() };
        restore(std::slice::from_mut(&mut run), &NominalRobot { ticks_per_rev: Some(ticks_per_rev), ..ROBOT });
        run.odometry.wheels
    }

    /// Rows that are more frequent than counts, with stamps that are off by half of what is between two:
    /// there are no counts but 0 and 1, and no beat.
    #[test]
    fn regress_rates_of_single_counts_are_the_counts() {
        let m_per_count = 0.16 * std::f64::consts::PI / 500.0;
        let off = |row: u32| 2.5e-3 * (f64::from(row * 7919 % 1000) / 1000.0 - 0.5);
        let t_s: Vec<f64> = (0..2000).map(|row| 0.005 * f64::from(row) + off(row)).collect();
        let at = |row: u32| (f64::from(row) * 0.37).floor();
        let speeds: Vec<f64> = (0..2000).map(|row| (at(row + 1) - at(row)) * m_per_count / 0.005).collect();
        let counts: Vec<i64> = (0..2000).map(|row| (at(row + 1) - at(1)) as i64).collect();
        let of = |ticks_per_rev: f64| restored(&t_s, &speeds, 1e-4, ticks_per_rev);
        assert!(of(500.0) == WheelLog::Ticks(Wheels::both(counts)), "counts");
        assert!(matches!(of(505.0), WheelLog::Speeds(_)), "another number of counts");
    }

    /// Speeds of 0 to 3 counts, 27.17 mm/s each, that are rounded to 27, 54 and 81 mm/s: too few for their
    /// decimals to be those of rounding, unless they are counts.
    #[test]
    fn regress_rates_of_few_counts_are_the_counts() {
        let m_per_count = 0.16 * std::f64::consts::PI / 1850.0;
        let t_s: Vec<f64> = (0..2000).map(|row| 0.01 * f64::from(row)).collect();
        let at = |row: u32| (f64::from(row) * 2.37).floor();
        let speeds: Vec<f64> = (0..2000).map(|row| (at(row + 1) - at(row)) * m_per_count / 0.01).collect();
        let counts: Vec<i64> = (0..2000).map(|row| (at(row + 1) - at(1)) as i64).collect();
        let of = |step_m_s: f64| restored(&t_s, &speeds, step_m_s, 1850.0);
        assert!(of(1e-3) == WheelLog::Ticks(Wheels::both(counts)), "counts");
        assert!(matches!(of(2e-2), WheelLog::Speeds(_)), "a rounding of most of a count");
    }

    /// Two speeds again and again, of which one is a count, are what a robot was told to drive.
    #[test]
    fn even_drives_are_no_counts() {
        let is_alone = |of: &[f64]| rows_alone(&of.iter().map(|of| Some(Wheels::both(*of))).collect::<Vec<_>>());
        assert_eq!(is_alone(&[0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0]), 0);
        assert_eq!(is_alone(&[0.0, 1.0, 0.0, 0.0, 2.0, 1.0, 2.0]), 3);
        assert_eq!(rows_alone(&[Some(Wheels::both(0.0)), None, Some(Wheels::both(0.0))]), 0);
    }

    #[test]
    fn rates_of_finer_counts_and_of_no_counts_stay() {
        // Steps of 0.05 m/s are as large as a count.
        let (before, _) = run(|_| 0.02, 0.05, false);
        let mut after = before.clone();
        restore(std::slice::from_mut(&mut after), &ROBOT);
        assert_eq!(after.odometry.wheels, before.odometry.wheels);
        // A robot of 437 counts says these rates no more often than chance does.
        let (before, _) = run(|_| 0.02, 1e-3, false);
        let mut after = before.clone();
        restore(std::slice::from_mut(&mut after), &NominalRobot { ticks_per_rev: Some(437.0), ..ROBOT });
        assert_eq!(after.odometry.wheels, before.odometry.wheels);
    }

    #[test]
    fn angles_of_counts_are_the_counts() {
        let count = |share: f64| (0..400).map(move |row| (1000.0 + share * f64::from(row * row) / 90.0).floor());
        let of = |ticks_per_rev: f64, step_rad: f64| {
            let angles = |share: f64| {
                count(share).map(|count| (count / 500.0 * TAU / step_rad).round() * step_rad).collect::<Vec<f64>>()
            };
            let wheels = WheelLog::Angles(Wheels { left: angles(1.0), right: angles(-0.61) });
            let mut run = Run { odometry: Odometry { wheels, ..Odometry::default() }, ..Run::default() };
            restore(std::slice::from_mut(&mut run), &NominalRobot { ticks_per_rev: Some(ticks_per_rev), ..ROBOT });
            run.odometry.wheels
        };
        let ticks = |share: f64| count(share).map(|count| count as i64).collect::<Vec<i64>>();
        assert_eq!(of(500.0, 1e-3), WheelLog::Ticks(Wheels { left: ticks(1.0), right: ticks(-0.61) }));
        // A count is 12.6 mrad.
        assert!(matches!(of(500.0, 1e-2), WheelLog::Angles(_)), "a rounding of most of a count");
        assert!(matches!(of(437.0, 1e-3), WheelLog::Angles(_)), "another number of counts");
    }
}
