//! The turn of each wheel along a run, at its rows and at instants between them.
//!
//! An outside instrument has a clock of its own. Between two rows of the log the wheels speed up as they do
//! from row to row, steadily; every method that compares the wheels with such measurements integrates the
//! same motion. A log whose rows jitter begins a little after its run does: half of an interval before the
//! first row and after the last, the speeds of the interval there go on.

use dataset::{NominalRobot, RestoredMotion, Run, RunView, WheelLog, quantum_of_angles, row_jitter_s};
use kinematics::{Count, Wheels};

use crate::recorded_rates::{RateRounding, RateSteps, RecordedRates};
use crate::settings::{COMMON, TIME_TOLERANCE_S};
use crate::wheel_rates::{RateWindow, WheelRates, are_inexact};

/// A stretch of the log within one row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct WheelInterval {
    pub(crate) t_s: f64,
    pub(crate) dt_s: f64,
    /// Turn of each wheel, radians.
    pub(crate) wheel_rad: Wheels<f64>,
    /// How late the stamps at its start and its end are, seconds.
    pub(crate) late_s: [f64; 2],
    /// Mean rate of each wheel, rad/s, for covariates ([`WheelRates`]).
    pub(crate) rate_rad_s: Wheels<f64>,
    /// Rates at the start and at the end.
    pub(crate) rate_at_ends_rad_s: [Wheels<f64>; 2],
    /// What makes the centre go across the arc of its wheels' turns: (w_R Δr_L − w_L Δr_R) T/12 for turns w
    /// and rates that change by Δr, rad². It is (ω Δv − v Δω) T²/12 of the robot, the second term of Magnus
    /// 1954.
    pub(crate) chord_area_rad2: f64,
    /// No count comes in it, nor near it.
    pub(crate) stands: bool,
    /// It starts within a row, and not at one.
    pub(crate) starts_within_row: bool,
    /// Variances of each wheel's turn at its start and at its end, rad²: what the motion within the row there
    /// may be off by from how the wheels are taken to speed up. 0 at a row.
    pub(crate) interpolated_rad2: [Wheels<f64>; 2],
    /// Variance of each wheel's turn over it, rad², where its counts were lost and are restored; 0 elsewhere.
    pub(crate) restored_rad2: Wheels<f64>,
    /// The row's recorded rates, where these are rounded.
    pub(crate) rate_steps: RateSteps,
}

impl WheelInterval {
    /// Rates of the wheels at an instant in it, rad/s; outside of it those at its nearer end.
    pub(crate) fn rate_at(&self, t_s: f64) -> Wheels<f64> {
        let [start, end] = self.rate_at_ends_rad_s;
        let share = if self.dt_s > 0.0 { ((t_s - self.t_s) / self.dt_s).clamp(0.0, 1.0) } else { 1.0 };
        start.zip_with(end, |start, end| start + share * (end - start))
    }
}

/// Turns of both wheels since a run's first row.
#[derive(Debug, Clone)]
pub struct WheelAngleInterpolator<'a> {
    t_s: &'a [f64],
    turn_rad: Wheels<Vec<f64>>,
    /// The counters' angles at the first row: where each wheel's mark stands.
    first_rad: Wheels<f64>,
    continuous: bool,
    rates: WheelRates,
    /// How late the stamps at the start and at the end of each row's interval are, seconds.
    late_s: Vec<[f64; 2]>,
    /// Variances of the wheels' turns over the intervals of rows whose counts are restored, rad², by row.
    restored_rad2: Vec<(usize, Wheels<f64>)>,
    recorded_rates: Option<RecordedRates>,
}

impl<'a> WheelAngleInterpolator<'a> {
    /// The wheels of a run; `None` when it has no row, or ticks of a robot that does not say how many make a
    /// turn.
    ///
    /// A robot that reports only speeds or its twist has its wheels rebuilt from the nominal geometry.
    #[must_use]
    pub fn of(run: &RunView<'a>, robot: &NominalRobot) -> Option<Self> {
        fn since_first<C: Count>(column: &[C], rad: f64) -> Vec<f64> {
            column.iter().map(|count| count.since(column[0]) * rad).collect()
        }
        let odometry = run.odometry();
        if odometry.t_s.is_empty() {
            return None;
        }
        let (mut first_rad, ahead_rad) = (Wheels::both(0.0), run.run().wheels_ahead_rad);
        let mut quantum_rad = Wheels::both(0.0);
        let recorded_rates = RecordedRates::of(run, robot);
        let turn_rad = match &odometry.wheels {
            WheelLog::Ticks(ticks) => {
                let rad = std::f64::consts::TAU / robot.ticks_per_rev?;
                let mark = |column: &Vec<i64>, ahead_rad: f64| {
                    (column[0] as f64 * rad + ahead_rad).rem_euclid(std::f64::consts::TAU)
                };
                first_rad = ticks.as_ref().zip_with(ahead_rad, mark);
                quantum_rad = Wheels::both(rad.abs());
                ticks.as_ref().map(|column| since_first(column, rad))
            }
            WheelLog::Angles(angles) => {
                first_rad = angles.as_ref().zip_with(ahead_rad, |column, ahead_rad| column[0] + ahead_rad);
                quantum_rad = angles.as_ref().map(|column| quantum_of_angles(column));
                angles.as_ref().map(|column| since_first(column, 1.0))
            }
            WheelLog::Speeds(_) | WheelLog::Twist { .. } => {
                let turns = run.angles_by_rates_rad(robot)?;
                if recorded_rates.is_none() {
                    // Of counts, by a driver that divides them by the time.
                    quantum_rad = turns.as_ref().map(|column| quantum_of_angles(column));
                }
                turns
            }
        };
        let continuous = run.info().continuous;
        let drive = robot.geometry();
        let (separation_m, m_per_rad) =
            drive.map_or((1.0, Wheels::both(1.0)), |of| (of.wheel_separation_m(), of.m_per_rad()));
        // Of stamps that are exact but for a few, those few are true.
        let has_period = continuous && are_inexact(&odometry.t_s);
        let period = if has_period { odometry.t_s.sampling_period() } else { None };
        let late_s = period.map_or_else(|| vec![0.0; odometry.t_s.len()], |period| period.late_s.clone());
        let rates = WheelRates::of(&odometry.t_s, &late_s, &turn_rad, quantum_rad, separation_m, m_per_rad, continuous);
        // Stamps that do not tell the tick do not tell by how many periods they are late.
        let most_s = period.filter(|period| !period.is_certain()).map_or(f64::INFINITY, |period| period.period_s);
        let late_s = if continuous {
            late_s.windows(2).map(|pair| [pair[0], pair[1]].map(|late_s| late_s.clamp(-most_s, most_s))).collect()
        } else {
            // Which end of a row between gaps is off nobody knows; the length counts.
            row_jitter_s(&odometry.t_s).into_iter().map(|jitter_s| [-0.5 * jitter_s, 0.5 * jitter_s]).collect()
        };
        let restored_rad2 = restored_rad2(run.run(), &odometry.t_s, quantum_rad);
        Some(Self { t_s: &odometry.t_s, turn_rad, first_rad, continuous, rates, late_s, restored_rad2, recorded_rates })
    }

    /// How both wheels turned from one instant to a later one, row by row, radians; `None` when the log does
    /// not span them, or has gaps and more than one of its intervals lies between them.
    #[must_use]
    pub fn steps(&self, from_s: f64, to_s: f64) -> Option<Vec<Wheels<f64>>> {
        let (first, last) = (self.row_at(from_s)?, self.row_at(to_s)?);
        let from = self.turn_at(first, from_s)?;
        let to = self.turn_at(last, to_s)?;
        let within = self.t_s.partition_point(|t_s| *t_s <= from_s + TIME_TOLERANCE_S)
            ..self.t_s.partition_point(|t_s| *t_s < to_s - TIME_TOLERANCE_S);
        if to_s < from_s || !(self.continuous || within.is_empty()) {
            return None;
        }
        let mut previous = from;
        let inner = within.map(|row| self.row_rad(row));
        let step = |next: Wheels<f64>| {
            let turned = next.zip_with(previous, |next, previous| next - previous);
            previous = next;
            turned
        };
        Some(inner.chain([to]).map(step).collect())
    }

    /// Whether the log spans two instants, as [`Self::steps`] needs it.
    #[must_use]
    pub fn spans(&self, from_s: f64, to_s: f64) -> bool {
        self.steps(from_s, to_s).is_some()
    }

    /// The wheels' angles at the rows, radians since the first.
    #[must_use]
    pub fn turns(&self) -> &Wheels<Vec<f64>> {
        &self.turn_rad
    }

    /// The wheels' angles at the first row, by the counters and what they were set back by, radians; 0 for a
    /// robot that reports only its twist.
    #[must_use]
    pub const fn first_rad(&self) -> Wheels<f64> {
        self.first_rad
    }

    /// Mean distance that the wheels roll over the log, metres, by nominal diameters.
    pub(crate) fn distance_m(&self, robot: &NominalRobot) -> f64 {
        let distance_m = |diameter_m: f64, side: &[f64]| {
            side.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum::<f64>() * 0.5 * diameter_m
        };
        0.5 * (distance_m(robot.left_wheel_diameter_m, &self.turn_rad.left)
            + distance_m(robot.right_wheel_diameter_m, &self.turn_rad.right))
    }

    /// Radians that a count of each wheel stands for; 0 where angles are not rounded.
    #[must_use]
    pub const fn quantum_rad(&self) -> Wheels<f64> {
        self.rates.quantum_rad
    }

    /// How the recorded rates are rounded.
    pub(crate) fn rate_rounding(&self) -> RateRounding {
        self.recorded_rates.as_ref().map_or(RateRounding::default(), |rates| rates.rounding)
    }

    /// How the rates at the rows are found.
    pub(crate) const fn rate_window(&self) -> RateWindow {
        self.rates.window
    }

    /// A reader that goes through the log once.
    pub(crate) fn cursor(&self) -> Cursor<'_, 'a> {
        Cursor { track: self, row: 0 }
    }

    fn row_rad(&self, row: usize) -> Wheels<f64> {
        Wheels { left: self.turn_rad.left[row], right: self.turn_rad.right[row] }
    }

    /// The row whose interval says how the wheels turned at an instant: the last at or before it, or that of
    /// the outer interval where it is close outside of the log; `None` farther out.
    fn row_at(&self, t_s: f64) -> Option<usize> {
        let before = self.t_s.partition_point(|row_s| *row_s <= t_s + TIME_TOLERANCE_S);
        self.row_of(before, t_s)
    }

    /// The same where it is known how many rows are at or before it.
    fn row_of(&self, before: usize, t_s: f64) -> Option<usize> {
        let rows_s = self.t_s;
        let last = rows_s.len() - 1;
        if (1..=last).contains(&before) || (t_s - rows_s[last]).abs() <= TIME_TOLERANCE_S {
            return Some(before - 1);
        }
        let (row, outside_s) =
            if before == 0 { (0, rows_s[0] - t_s) } else { (last.checked_sub(1)?, t_s - rows_s[last]) };
        let next_s = rows_s.get(row + 1).filter(|_| self.continuous)?;
        (outside_s <= COMMON.max_extrapolation * (next_s - rows_s[row])).then_some(row)
    }

    fn turn_at(&self, row: usize, t_s: f64) -> Option<Wheels<f64>> {
        let since_s = t_s - self.t_s[row];
        if since_s.abs() <= TIME_TOLERANCE_S {
            return Some(self.row_rad(row));
        }
        let length_s = self.t_s.get(row + 1)? - self.t_s[row];
        let share = since_s / length_s;
        let (start, end) = (self.row_rad(row), self.row_rad(row + 1));
        let even = start.zip_with(end, |start, end| start + share * (end - start));
        if !(0.0..=1.0).contains(&share) {
            return Some(even);
        }
        let half_rad = -0.5 * length_s * length_s * share * (1.0 - share);
        Some(even.zip_with(self.acceleration_rad_s2(row), |even, acceleration| even + half_rad * acceleration))
    }

    /// How the wheels speed up steadily within a row, rad/s²: by the rates of the rows before and after,
    /// whichever says less, and not at all where they disagree, as at a jump of the speed (van Leer 1979).
    /// 0 at the ends of the log, and in rows so long that a robot does several things.
    fn acceleration_rad_s2(&self, row: usize) -> Wheels<f64> {
        let Some([before, after]) =
            self.accelerations_around(row).filter(|_| self.rates.are_joined_around(self.t_s, row))
        else {
            return Wheels::both(0.0);
        };
        before.zip_with(
            after,
            |before, after| {
                if before * after > 0.0 { before.signum() * before.abs().min(after.abs()) } else { 0.0 }
            },
        )
    }

    /// How the wheels speed up into a row and out of it, rad/s²: from the middle of the row before to its own
    /// and on to that of the next, or, where single rows do not say their rates, around its start and its end
    /// by the rates there. `None` at the ends of the log.
    fn accelerations_around(&self, row: usize) -> Option<[Wheels<f64>; 2]> {
        if row == 0 || row + 2 >= self.t_s.len() {
            return None;
        }
        let gained = |from: Wheels<f64>, to: Wheels<f64>, passed_s: f64| {
            to.zip_with(from, |to, from| if passed_s > 0.0 { (to - from) / passed_s } else { 0.0 })
        };
        if self.rates.window.row_by_row {
            let middle_s = |row: usize| 0.5 * (self.t_s[row] + self.t_s[row + 1]);
            let by =
                |from: usize, to: usize| gained(self.row_rate(from), self.row_rate(to), middle_s(to) - middle_s(from));
            return Some([by(row - 1, row), by(row, row + 1)]);
        }
        let around = |row: usize| {
            let (before, after) = (row - 1, row + 1);
            gained(self.rates.at_row(before), self.rates.at_row(after), self.t_s[after] - self.t_s[before])
        };
        Some([around(row), around(row + 1)])
    }

    /// Variances of the wheels' turns at an instant of a row's interval, rad²: an acceleration that is off
    /// by what it changes by from row to row, or by what it changes by in the rows around where that is
    /// more, as what pushes the shafts goes on. A smooth one is off by half of that; one that changes
    /// faster than rows come, by more than they show. In a row that is not taken to speed up, all of its
    /// acceleration is off. A wheel that did not turn from row to row stood in between.
    fn interpolated_rad2(&self, row: usize, t_s: f64) -> Wheels<f64> {
        let since_s = t_s - self.t_s[row];
        let left_s = self.t_s.get(row + 1).map_or(0.0, |next_s| next_s - t_s);
        if since_s <= TIME_TOLERANCE_S || left_s <= TIME_TOLERANCE_S {
            return Wheels::both(0.0);
        }
        let off_by = |row: usize| {
            let [before, after] = self.accelerations_around(row)?;
            let is_taken = self.rates.are_joined_around(self.t_s, row);
            Some(before.zip_with(after, |before, after| {
                let change = (after - before).powi(2);
                if is_taken { change } else { change.max(before * before).max(after * after) }
            }))
        };
        let near = row.saturating_sub(COMMON.rows_of_change)..row + COMMON.rows_of_change + 1;
        let (sum, count) = near.filter_map(off_by).fold((Wheels::both(0.0), 0.0_f64), |(sum, count), off_by| {
            (sum.zip_with(off_by, |sum, off_by| sum + off_by), count + 1.0)
        });
        let own = off_by(row).unwrap_or(Wheels::both(0.0));
        let half_s2 = 0.5 * since_s * left_s;
        let off_by = own.zip_with(sum, |own, sum| own.max(sum / count.max(1.0)) * half_s2 * half_s2);
        off_by.zip_with(self.row_rate(row), |off_by, rate| if rate == 0.0 { 0.0 } else { off_by })
    }

    /// Variance of the wheels' turns over so many seconds of a row's interval, rad².
    fn restored_over(&self, row: usize, dt_s: f64) -> Wheels<f64> {
        let (Ok(at), Some(next_s)) =
            (self.restored_rad2.binary_search_by_key(&row, |(row, _)| *row), self.t_s.get(row + 1))
        else {
            return Wheels::both(0.0);
        };
        self.restored_rad2[at].1.map(|variance_rad2| variance_rad2 * dt_s / (next_s - self.t_s[row]))
    }

    /// Rates of the wheels at an instant of a row's interval, rad/s.
    fn rate_at(&self, row: usize, t_s: f64) -> Wheels<f64> {
        let Some(next_s) = self.t_s.get(row + 1) else { return self.rates.at_row(row) };
        let length_s = next_s - self.t_s[row];
        if !self.rates.are_joined(self.t_s, row) {
            return self.row_rate(row);
        }
        let share = ((t_s - self.t_s[row]) / length_s).clamp(0.0, 1.0);
        self.rates.at_row(row).zip_with(self.rates.at_row(row + 1), |start, end| start + share * (end - start))
    }

    /// How late the stamps are at an instant of a row's interval, seconds.
    fn late_at(&self, row: usize, t_s: f64) -> f64 {
        let Some(([start, end], next_s)) = self.late_s.get(row).zip(self.t_s.get(row + 1)) else {
            return self.late_s.last().map_or(0.0, |[_, end]| *end);
        };
        let share = ((t_s - self.t_s[row]) / (next_s - self.t_s[row])).clamp(0.0, 1.0);
        start + share * (end - start)
    }

    /// Mean rates over a row's interval by its own counts, rad/s.
    fn row_rate(&self, row: usize) -> Wheels<f64> {
        let Some(next_s) = self.t_s.get(row + 1) else { return self.rates.at_row(row) };
        let length_s = next_s - self.t_s[row];
        let turned = self.row_rad(row + 1).zip_with(self.row_rad(row), |end, start| end - start);
        turned.map(|turned_rad| if length_s > 0.0 { turned_rad / length_s } else { 0.0 })
    }
}

/// The rows whose intervals have counts that are restored, and the variances of the wheels' turns there,
/// rad². Stamps may have been set right since: a span is of the row in whose interval its middle lies.
fn restored_rad2(run: &Run, rows_s: &[f64], quantum_rad: Wheels<f64>) -> Vec<(usize, Wheels<f64>)> {
    let of = |span: &RestoredMotion| {
        let row = rows_s.partition_point(|row_s| *row_s <= 0.5 * (span.from_s + span.to_s)).checked_sub(1)?;
        let variance_rad2 = span.variance_counts2.zip_with(quantum_rad, |variance, rad| variance * rad * rad);
        (row + 1 < rows_s.len()).then_some((row, variance_rad2))
    };
    run.restored_motion.iter().filter_map(of).collect()
}

/// Reads a track in the order of time, in time that grows with its rows.
#[derive(Debug, Clone)]
pub(crate) struct Cursor<'t, 'a> {
    track: &'t WheelAngleInterpolator<'a>,
    /// The row of the last instant.
    row: usize,
}

impl Cursor<'_, '_> {
    /// Goes to the row of an instant; false where the log does not span it.
    fn seek(&mut self, t_s: f64) -> bool {
        let rows_s = self.track.t_s;
        let is_before = |row_s: f64| row_s <= t_s + TIME_TOLERANCE_S;
        let mut before = if is_before(rows_s[self.row]) { self.row + 1 } else { 0 };
        while before < rows_s.len() && is_before(rows_s[before]) {
            before += 1;
        }
        let row = self.track.row_of(before, t_s);
        self.row = row.unwrap_or(self.row);
        row.is_some()
    }

    /// Turns of the wheels at an instant since the first row, radians.
    pub(crate) fn angle_rad(&mut self, t_s: f64) -> Option<Wheels<f64>> {
        if !self.seek(t_s) {
            return None;
        }
        self.track.turn_at(self.row, t_s)
    }

    /// Appends the stretches of constant speed from one instant to a later one; false, and nothing is
    /// appended, where the log does not reach from one to the other without a gap.
    pub(crate) fn intervals(&mut self, from_s: f64, to_s: f64, intervals: &mut Vec<WheelInterval>) -> bool {
        let before = intervals.len();
        let Some(mut angle) = self.angle_rad(from_s) else { return false };
        let (mut at_s, mut row) = (from_s, self.row);
        let Some(end) = self.angle_rad(to_s).filter(|_| to_s > from_s) else { return false };
        let rows_s = self.track.t_s;
        let mut push = |t_s: f64, next: Wheels<f64>, row: usize| {
            let wheel_rad = next.zip_with(angle, |next, angle| next - angle);
            let dt_s = t_s - at_s;
            let ends = [at_s, t_s].map(|t_s| self.track.rate_at(row, t_s));
            let rate_rad_s = if self.track.rates.window.row_by_row && dt_s > 0.0 {
                wheel_rad.map(|rad| rad / dt_s)
            } else {
                ends[0].zip_with(ends[1], |start, end| 0.5 * (start + end))
            };
            let change = self.track.acceleration_rad_s2(row).map(|acceleration| acceleration * dt_s);
            let chord_area_rad2 = (wheel_rad.right * change.left - wheel_rad.left * change.right) * dt_s / 12.0;
            let stands = self.track.rates.stands(rows_s, [at_s, t_s], row);
            let starts_within_row = at_s > rows_s[row] + TIME_TOLERANCE_S;
            let interpolated_rad2 = [at_s, t_s].map(|t_s| self.track.interpolated_rad2(row, t_s));
            intervals.push(WheelInterval {
                t_s: at_s,
                dt_s,
                wheel_rad,
                restored_rad2: self.track.restored_over(row, dt_s),
                late_s: [at_s, t_s].map(|t_s| self.track.late_at(row, t_s)),
                rate_rad_s,
                rate_at_ends_rad_s: ends,
                chord_area_rad2,
                stands,
                starts_within_row,
                interpolated_rad2,
                // A row's rates hold over the interval that ends there.
                rate_steps: self.track.recorded_rates.as_ref().map_or([0; 2], |rates| rates.at(row + 1)),
            });
            (at_s, angle) = (t_s, next);
        };
        while row + 1 < rows_s.len() && rows_s[row + 1] < to_s - TIME_TOLERANCE_S {
            row += 1;
            push(rows_s[row], self.track.row_rad(row), row - 1);
        }
        push(to_s, end, row);
        if self.track.continuous || intervals.len() - before == 1 {
            return true;
        }
        intervals.truncate(before);
        false
    }
}

#[cfg(test)]
mod tests;
