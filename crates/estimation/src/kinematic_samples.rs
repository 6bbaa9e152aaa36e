//! How the robot moved before each measurement, by the counts: speed, turn, phases of the wheels, distance
//! since a reversal.
//!
//! A pass takes these samples beside the innovations where it is asked to, for whoever tests residuals
//! against what was recorded. They depend on counts, geometry and the filter's pose alone.

use kinematics::{Increment, Pose, Side, Wheels};

use crate::model::Model;
use crate::settings::COMMON;
use crate::wheel_angles::WheelInterval;

/// How the robot moved between the measurement before and this one, by the counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KinematicSample {
    /// Which segment.
    pub segment: usize,
    /// Which measurement of the segment.
    pub measurement: usize,
    /// Predicted pose of the drive's centre.
    pub world_from_body: Pose,
    /// Motion since the measurement before.
    pub motion: Increment,
    /// Time since the measurement before, seconds; positive.
    pub duration_s: f64,
    /// Change of speed since the measurement before, m/s.
    pub speed_change_m_s: f64,
    /// Angle of each wheel in the middle of the last interval, by its counter, radians.
    pub phase_rad: Wheels<f64>,
    /// Turn of each wheel since the measurement before, radians.
    pub turned_rad: Wheels<f64>,
    /// Time on the session's clock at the start of the last interval, seconds.
    pub session_s: f64,
    /// Distance driven in the session up to the last interval, metres.
    pub session_m: f64,
    /// Distance since the last reversal, metres; `None` before the first one of the run.
    pub since_reversal_m: Option<f64>,
}

/// The motion along a run, summed between measurements.
#[derive(Debug, Clone, Copy)]
pub(crate) struct KinematicSampler {
    motion: Increment,
    duration_s: f64,
    speed_change_m_s: f64,
    phase_rad: Wheels<f64>,
    turned_rad: Wheels<f64>,
    session_s: f64,
    session_m: f64,
    /// Motion since the last reversal of direction, limited to half of what makes one to either side.
    swing_m: f64,
    forward: Option<bool>,
    since_reversal_m: Option<f64>,
}

impl KinematicSampler {
    /// At the start of a run.
    pub(crate) fn new() -> Self {
        Self {
            motion: Increment { distance_m: 0.0, turn_rad: 0.0 },
            duration_s: 0.0,
            speed_change_m_s: 0.0,
            phase_rad: Wheels::both(0.0),
            turned_rad: Wheels::both(0.0),
            session_s: 0.0,
            session_m: 0.0,
            swing_m: 0.0,
            forward: None,
            since_reversal_m: None,
        }
    }

    /// Adds intervals of a run that began at `start_s` on the session's clock. They start at these angles
    /// of the wheels, and at this distance driven in the session.
    pub(crate) fn add(
        &mut self,
        start_s: f64,
        intervals: &[WheelInterval],
        model: &Model,
        mut wheel_rad: Wheels<f64>,
        mut session_m: f64,
    ) {
        for interval in intervals {
            let travel_m = model.m_per_rad.zip_with(interval.wheel_rad, |m_per_rad, rad| m_per_rad * rad);
            let increment = Increment::from_travel(travel_m, model.separation_m);
            if interval.dt_s > 0.0 {
                let gained = |of: Wheels<f64>| model.increment(of).distance_m;
                let [start, end] = interval.rate_at_ends_rad_s.map(gained);
                self.add_interval(interval, increment, end - start);
                self.phase_rad = wheel_rad.zip_with(interval.wheel_rad, |start, turned| start + 0.5 * turned);
                self.session_s = start_s + interval.t_s;
                self.session_m = session_m;
            }
            session_m += increment.distance_m.abs();
            wheel_rad = wheel_rad.zip_with(interval.wheel_rad, |angle, rad| angle + rad);
        }
    }

    fn add_interval(&mut self, interval: &WheelInterval, increment: Increment, speed_change_m_s: f64) {
        self.speed_change_m_s += speed_change_m_s;
        self.motion.distance_m += increment.distance_m;
        self.motion.turn_rad += increment.turn_rad;
        self.duration_s += interval.dt_s;
        for side in Side::BOTH {
            self.turned_rad[side] += interval.wheel_rad[side];
        }
        self.swing_m = (self.swing_m + increment.distance_m).clamp(-0.5 * COMMON.reversal_m, 0.5 * COMMON.reversal_m);
        if self.swing_m.abs() >= 0.5 * COMMON.reversal_m {
            let forward = self.swing_m > 0.0;
            if self.forward.is_some_and(|before| before != forward) {
                self.since_reversal_m = Some(0.0);
            }
            self.forward = Some(forward);
        }
        self.since_reversal_m = self.since_reversal_m.map(|since_m| since_m + increment.distance_m.abs());
    }

    /// The sample at a measurement, and sums that start anew; `None` where no time went by since the one
    /// before.
    pub(crate) fn sample(
        &mut self,
        segment: usize,
        measurement: usize,
        world_from_body: Pose,
    ) -> Option<KinematicSample> {
        let Self { motion, duration_s, speed_change_m_s, phase_rad, turned_rad, .. } = *self;
        let Self { session_s, session_m, since_reversal_m, .. } = *self;
        if duration_s <= 0.0 {
            return None;
        }
        let start = Self::new();
        (self.motion, self.duration_s, self.speed_change_m_s) = (start.motion, 0.0, 0.0);
        self.turned_rad = start.turned_rad;
        Some(KinematicSample {
            segment,
            measurement,
            world_from_body,
            motion,
            duration_s,
            speed_change_m_s,
            phase_rad,
            turned_rad,
            session_s,
            session_m,
            since_reversal_m,
        })
    }
}

#[cfg(test)]
mod tests {
    use kinematics::DriveGeometry;

    use super::*;

    /// 0.1 m ahead in 1 s at 1 m/rad, a stop of 1 s, 0.2 m back in 1 s, each wheel alike.
    #[test]
    fn sums_are_between_measurements_and_reversals_are_remembered() {
        let intervals = [0.1, 0.0, -0.2].map(|rad| (Wheels::both(rad), 1.0));
        let intervals: Vec<WheelInterval> = intervals
            .iter()
            .zip(0_u8..)
            .map(|((wheel_rad, dt_s), row)| WheelInterval {
                wheel_rad: *wheel_rad,
                t_s: f64::from(row),
                dt_s: *dt_s,
                rate_rad_s: *wheel_rad,
                rate_at_ends_rad_s: [[0.0, 0.05], [0.05, -0.1], [-0.1, -0.2]][usize::from(row)].map(Wheels::both),
                late_s: [0.0; 2],
                chord_area_rad2: 0.0,
                stands: false,
                starts_within_row: false,
                interpolated_rad2: [Wheels::both(0.0); 2],
                restored_rad2: Wheels::both(0.0),
                rate_steps: [0; 2],
            })
            .collect();
        let geometry = DriveGeometry::new(Wheels::both(2.0), 0.5).expect("a drive");
        let model = Model::of(&geometry, 0);
        let mut sampler = KinematicSampler::new();
        sampler.add(10.0, &intervals[..2], &model, Wheels::both(2.0), 5.0);
        let first = sampler.sample(0, 1, Pose::IDENTITY).expect("two seconds went by");
        assert_eq!((first.motion.distance_m, first.duration_s, first.since_reversal_m), (0.1, 2.0, None));
        // Session's clock and distance at the start of the last interval; 2 rad and the 0.1 rad of the
        // first one.
        assert_eq!((first.session_s, first.session_m, first.phase_rad.left), (11.0, 5.1, 2.1));
        // Sums start anew: a second sample without motion.
        assert_eq!(sampler.sample(0, 2, Pose::IDENTITY), None);
        sampler.add(10.0, &intervals[2..], &model, Wheels::both(2.1), 5.1);
        let second = sampler.sample(0, 3, Pose::IDENTITY).expect("one second went by");
        assert_eq!(
            (second.motion.distance_m, second.turned_rad.right, second.since_reversal_m),
            (-0.2, -0.2, Some(0.2))
        );
        // From −0.1 m/s at its start to −0.2 m/s at its end.
        assert_eq!(second.speed_change_m_s, -0.1);
    }

    /// Intervals of so many seconds in which each wheel turns by so much, one after the other, at 1 m/rad.
    fn intervals(turns: &[(f64, Wheels<f64>)]) -> Vec<WheelInterval> {
        let mut t_s = 0.0;
        let of = |(dt_s, wheel_rad): &(f64, Wheels<f64>)| {
            let from_s = t_s;
            t_s += dt_s;
            let rate_rad_s = wheel_rad.map(|rad| if *dt_s > 0.0 { rad / dt_s } else { 0.0 });
            WheelInterval {
                wheel_rad: *wheel_rad,
                t_s: from_s,
                dt_s: *dt_s,
                rate_rad_s,
                rate_at_ends_rad_s: [rate_rad_s, rate_rad_s.map(|rate| 1.5 * rate)],
                late_s: [0.0; 2],
                chord_area_rad2: 0.0,
                stands: false,
                starts_within_row: false,
                interpolated_rad2: [Wheels::both(0.0); 2],
                restored_rad2: Wheels::both(0.0),
                rate_steps: [0; 2],
            }
        };
        turns.iter().map(of).collect()
    }

    fn model() -> Model {
        Model::of(&DriveGeometry::new(Wheels::both(2.0), 0.5).expect("a drive"), 0)
    }

    #[test]
    fn an_arc_is_summed_with_its_turn_its_speeds_and_its_phases() {
        // Powers of two, which sums do not round: an arc, an interval without length, and another arc.
        let wheels = |left, right| Wheels { left, right };
        let arcs = intervals(&[(0.5, wheels(0.25, 0.5)), (0.0, wheels(0.125, 0.125)), (2.0, wheels(-0.5, 1.0))]);
        let mut sampler = KinematicSampler::new();
        sampler.add(8.0, &arcs, &model(), wheels(1.0, 2.0), 16.0);
        let found = sampler.sample(3, 4, Pose::IDENTITY).expect("time went by");
        assert_eq!((found.segment, found.measurement, found.duration_s), (3, 4, 2.5));
        // The interval without length is no part of the motion: (0.375 + 0.25) m, (0.25 + 1.5)/0.5 rad.
        assert_eq!((found.motion.distance_m, found.motion.turn_rad), (0.625, 3.5));
        assert_eq!(found.turned_rad, wheels(-0.25, 1.5));
        // Speeds of 0.75 and 0.125 m/s grow by half.
        assert_eq!(found.speed_change_m_s, 0.375 + 0.0625);
        // But it moves the phases and the distance at which the last one starts: 1 + 0.375 − 0.25 rad,
        // 2 + 0.625 + 0.5 rad, and 16 + 0.375 + 0.125 m.
        assert_eq!((found.phase_rad, found.session_s, found.session_m), (wheels(1.125, 3.125), 8.5, 16.5));
        // Sums start anew, the last interval stays until the next.
        let next = intervals(&[(1.0, wheels(0.5, 0.5))]);
        sampler.add(8.0, &next, &model(), wheels(2.0, 2.0), 20.0);
        let found = sampler.sample(3, 5, Pose::IDENTITY).expect("time went by");
        assert_eq!((found.motion.distance_m, found.motion.turn_rad, found.duration_s), (0.5, 0.0, 1.0));
        assert_eq!((found.turned_rad, found.speed_change_m_s), (wheels(0.5, 0.5), 0.25));
        assert_eq!((found.phase_rad, found.session_m), (wheels(2.25, 2.25), 20.0));
    }

    #[test]
    fn reversals_are_a_millimetre_back_and_less_is_none() {
        let mut sampler = KinematicSampler::new();
        let mut since = |distances_m: &[f64]| {
            let turns: Vec<(f64, Wheels<f64>)> = distances_m.iter().map(|m| (1.0, Wheels::both(*m))).collect();
            sampler.add(0.0, &intervals(&turns), &model(), Wheels::both(0.0), 0.0);
            sampler.sample(0, 0, Pose::IDENTITY).expect("time went by").since_reversal_m
        };
        // The first motion is no reversal in either direction, and less than half a millimetre has none.
        assert_eq!(since(&[-0.4e-3, 0.8e-3]), None);
        // Ahead, 0.9 mm back and ahead again. Rejects a reversal at each change of sign.
        assert_eq!(since(&[10e-3, -0.9e-3, 5e-3]), None);
        // Back by 1.1 mm in two parts: it is known in the second, and counts from its start.
        let found = since(&[-0.6e-3, -0.5e-3]).expect("a reversal");
        // Roundings of three sums; the same below.
        assert!((found - 0.5e-3).abs() < 1e-12, "{found}");
        // Ahead by 0.9 mm and on: distance adds up, whichever its direction.
        let found = since(&[0.9e-3, -3e-3]).expect("the same reversal");
        assert!((found - 4.4e-3).abs() < 1e-12, "{found}");
        // From the back the same, and it counts anew.
        let found = since(&[1.1e-3, 2e-3]).expect("a second reversal");
        assert!((found - 3.1e-3).abs() < 1e-12, "{found}");
        // Back and forth within a millimetre leaves the direction as it was: the next motion ahead is none.
        let found = since(&[-0.9e-3, 0.9e-3, 4e-3]).expect("the same reversal");
        assert!((found - 8.9e-3).abs() < 1e-12, "{found}");
    }
}
