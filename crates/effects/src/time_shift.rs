//! How a robot moved from one instant to a later one, for terms whose measurements are of another instant
//! than their stamp says: its recorded motion, and where the record ends before that instant its speed and
//! acceleration on.

use std::collections::VecDeque;

use kinematics::{Increment, Pose, Twist};
use model_term::{Interval, Measurement, RecordedMotion};

/// Motion of more is not followed back, seconds.
pub(crate) const LONGEST_S: f64 = 1.5;

/// The motion of the last [`LONGEST_S`].
#[derive(Clone, Default)]
pub(crate) struct TimeShift {
    /// Ends of the intervals, with the velocities there.
    ends: VecDeque<(f64, Twist)>,
}

impl TimeShift {
    pub(crate) fn restart(&mut self) {
        self.ends.clear();
    }

    pub(crate) fn motion(&mut self, interval: &Interval<'_>) {
        let [start, end] = interval.speed_at_ends_m_s.map(|speed_m_s| {
            let Increment { distance_m, turn_rad } = Increment::from_travel(speed_m_s, interval.wheel_separation_m);
            Twist { v_m_s: distance_m, omega_rad_s: turn_rad }
        });
        if self.ends.is_empty() {
            self.ends.push_back((interval.t_s, start));
        }
        let end_s = interval.t_s + interval.dt_s;
        self.ends.push_back((end_s, end));
        while self.ends.front().is_some_and(|(at_s, _)| *at_s < end_s - LONGEST_S) {
            self.ends.pop_front();
        }
    }

    /// What the instrument sees in place of the robot of the stamp where it sees that of `ago_s` before, or
    /// of a later instant where that is negative: a pose in the frame of the stamp's.
    pub(crate) fn seen(&self, measurement: &Measurement<'_>, ago_s: f64) -> Pose {
        let ago_s = ago_s.clamp(-LONGEST_S, LONGEST_S);
        let now = (measurement.t_s, measurement.twist);
        // Terms go on as in the interval before: their phases are those of the instant that was seen.
        let Twist { v_m_s, omega_rad_s } = measurement.twist_of_terms;
        let with_terms = |Increment { distance_m, turn_rad }: Increment| Increment {
            distance_m: distance_m - ago_s * v_m_s,
            turn_rad: turn_rad - ago_s * omega_rad_s,
        };
        if ago_s > 0.0 {
            let Increment { distance_m, turn_rad } = self.since(ago_s, now);
            return with_terms(Increment { distance_m: -distance_m, turn_rad: -turn_rad }).arc();
        }
        let to_s = measurement.t_s - ago_s;
        let ahead =
            measurement.record.between(measurement.t_s, to_s).map(|RecordedMotion { increment, until_s, twist }| {
                let left_s = (to_s - until_s).max(0.0);
                Increment {
                    distance_m: increment.distance_m + left_s * twist.v_m_s,
                    turn_rad: increment.turn_rad + left_s * twist.omega_rad_s,
                }
            });
        with_terms(ahead.unwrap_or_else(|| self.until(-ago_s, now))).arc()
    }

    /// Distance and turn from the instant `ago_s` before now on.
    fn since(&self, ago_s: f64, now: (f64, Twist)) -> Increment {
        let from_s = now.0 - ago_s;
        let (mut moved, mut after) = (Increment { distance_m: 0.0, turn_rad: 0.0 }, now);
        let mut add = |time_s: f64, a: Twist, b: Twist| {
            moved.distance_m += 0.5 * time_s * (a.v_m_s + b.v_m_s);
            moved.turn_rad += 0.5 * time_s * (a.omega_rad_s + b.omega_rad_s);
        };
        for before in self.ends.iter().rev().copied().filter(|(end_s, _)| *end_s < now.0) {
            let length_s = after.0 - before.0;
            if before.0 <= from_s {
                let share = if length_s > 0.0 { (after.0 - from_s) / length_s } else { 0.0 };
                let between = |after: f64, before: f64| after + share * (before - after);
                let start = Twist {
                    v_m_s: between(after.1.v_m_s, before.1.v_m_s),
                    omega_rad_s: between(after.1.omega_rad_s, before.1.omega_rad_s),
                };
                add(after.0 - from_s, start, after.1);
                return moved;
            }
            add(length_s, before.1, after.1);
            after = before;
        }
        // Before the log it went on as at its start.
        add(after.0 - from_s, after.1, after.1);
        moved
    }

    /// Distance and turn from now on for `time_s`, speeding up as on average for as long before: counts of
    /// single rows say little of an acceleration.
    fn until(&self, time_s: f64, now: (f64, Twist)) -> Increment {
        let before_now = || self.ends.iter().copied().filter(|(end_s, _)| *end_s < now.0);
        let as_long_ago = before_now().rev().find(|(end_s, _)| *end_s <= now.0 - time_s);
        let before = as_long_ago.or_else(|| before_now().next()).unwrap_or(now);
        let passed_s = now.0 - before.0;
        let of = |now: f64, before: f64| {
            let acceleration = if passed_s > 0.0 { (now - before) / passed_s } else { 0.0 };
            // It does not turn back: a robot that slows down stops.
            let stops_s = if now * acceleration < 0.0 { -now / acceleration } else { f64::INFINITY };
            let time_s = time_s.min(stops_s);
            time_s * (now + 0.5 * acceleration * time_s)
        };
        Increment { distance_m: of(now.1.v_m_s, before.1.v_m_s), turn_rad: of(now.1.omega_rad_s, before.1.omega_rad_s) }
    }
}

#[cfg(test)]
mod tests {
    use dataset::RunInfo;
    use kinematics::Wheels;
    use model_term::{MotionRecord, NoRecord};

    use super::*;

    /// Speeding up at 1 m/s² for a second, in rows of 40 ms.
    pub(crate) fn speeding_up(mut motion: impl FnMut(&Interval<'_>), run: &RunInfo) {
        for row in 0..25 {
            let t_s = 0.04 * f64::from(row);
            motion(&Interval {
                t_s,
                dt_s: 0.04,
                late_s: [0.0; 2],
                travel_m: Wheels::both(0.0),
                speed_m_s: Wheels::both(t_s + 0.02),
                speed_at_ends_m_s: [t_s, t_s + 0.04].map(Wheels::both),
                count_m: Wheels::both(0.0),
                wheel_separation_m: 0.36,
                wheel_rad: Wheels::both(0.0),
                turned_rad: Wheels::both(0.0),
                world_from_body: Pose::IDENTITY,
                session_m: 0.0,
                run,
            });
        }
    }

    #[test]
    fn the_robot_of_another_instant_is_where_it_was_or_will_be() {
        let (run, mut shift) = (RunInfo::default(), TimeShift::default());
        speeding_up(|interval| shift.motion(interval), &run);
        let twist = Twist { v_m_s: 1.0, omega_rad_s: 0.0 };
        let measurement = Measurement {
            t_s: 1.0,
            world_from_body: Pose::IDENTITY,
            twist,
            twist_of_terms: Twist::default(),
            record: &NoRecord,
            run: &run,
        };
        // 0.1 s before and after t = 1 s: ∓0.1 + 0.1²/2 m. Rejects the speed at the measurement alone, ∓0.1.
        assert!((shift.seen(&measurement, 0.1).x_m + 0.095).abs() < 1e-12);
        assert!((shift.seen(&measurement, -0.1).x_m - 0.105).abs() < 1e-12);
        // Slowing down from 0.02 m/s at 1 m/s²: it stops after 0.2 mm, and does not go back.
        let slow = Measurement { twist: Twist { v_m_s: 0.02, omega_rad_s: 0.0 }, t_s: 0.98, ..measurement };
        shift.ends = [(0.96, Twist { v_m_s: 0.04, omega_rad_s: 0.0 })].into();
        assert!((shift.seen(&slow, -0.1).x_m - 2e-4).abs() < 1e-12);
        // A speed that is off in the last row is no acceleration: 0.1 m/s over 0.1 s, not over 0.02 s, is
        // 0.1 + 0.1²/2 m. Rejects the last row, 0.1 + 5 · 0.1²/2.
        let at = |t_s: f64, v_m_s: f64| (t_s, Twist { v_m_s, omega_rad_s: 0.0 });
        shift.ends = [at(0.88, 0.9), at(0.9, 0.9), at(0.98, 0.9)].into();
        assert!((shift.seen(&measurement, -0.1).x_m - 0.105).abs() < 1e-12);
    }

    /// A record of 1 m/s for 40 ms after any instant.
    #[derive(Debug)]
    struct ShortRecord;

    impl MotionRecord for ShortRecord {
        fn between(&self, from_s: f64, to_s: f64) -> Option<RecordedMotion> {
            let time_s = (to_s - from_s).min(0.04);
            let increment = Increment { distance_m: time_s, turn_rad: 0.0 };
            Some(RecordedMotion { increment, until_s: from_s + time_s, twist: Twist { v_m_s: 1.0, omega_rad_s: 0.5 } })
        }
    }

    #[test]
    fn regress_motion_after_a_measurement_is_taken_from_the_record() {
        let (run, shift) = (RunInfo::default(), TimeShift::default());
        let twist = Twist { v_m_s: 9.0, omega_rad_s: 9.0 };
        let measurement = Measurement {
            t_s: 1.0,
            world_from_body: Pose::IDENTITY,
            twist,
            twist_of_terms: Twist::default(),
            record: &ShortRecord,
            run: &run,
        };
        // Rejects the speed at the measurement, which coarse counts may have wrong.
        assert!((shift.seen(&measurement, -0.03).x_m - 0.03).abs() < 1e-12);
        // After its end the motion goes on as it is there: 0.06 s at 1 m/s and 0.5 rad/s.
        let (beyond, seen) = (Increment { distance_m: 0.1, turn_rad: 0.03 }.arc(), shift.seen(&measurement, -0.1));
        assert!((seen.x_m - beyond.x_m).abs() < 1e-12 && (seen.theta_rad - 0.03).abs() < 1e-12, "{seen:?}");
    }
}
