//! How the robot moved before each measurement, by the counts: speed, turn, phases of the wheels, distance
//! since a reversal.
//!
//! A pass takes these samples beside the innovations where it is asked to, for whoever tests residuals
//! against what was recorded. They depend on counts, geometry and the filter's pose alone.

use kinematics::{Increment, Pose, Side, Wheels};

use crate::model::Model;
use crate::settings::REVERSAL_M;
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
        (mut wheel_rad, mut session_m): (Wheels<f64>, f64),
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
        self.swing_m = (self.swing_m + increment.distance_m).clamp(-0.5 * REVERSAL_M, 0.5 * REVERSAL_M);
        if self.swing_m.abs() >= 0.5 * REVERSAL_M {
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
        (segment, measurement): (usize, usize),
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
            })
            .collect();
        let geometry = DriveGeometry::new(Wheels::both(2.0), 0.5).expect("a drive");
        let model = Model::of(&geometry, 0);
        let mut sampler = KinematicSampler::new();
        sampler.add(10.0, &intervals[..2], &model, (Wheels::both(2.0), 5.0));
        let first = sampler.sample((0, 1), Pose::IDENTITY).expect("two seconds went by");
        assert_eq!((first.motion.distance_m, first.duration_s, first.since_reversal_m), (0.1, 2.0, None));
        // Session's clock and distance at the start of the last interval; 2 rad and the 0.1 rad of the
        // first one.
        assert_eq!((first.session_s, first.session_m, first.phase_rad.left), (11.0, 5.1, 2.1));
        // Sums start anew: a second sample without motion.
        assert_eq!(sampler.sample((0, 2), Pose::IDENTITY), None);
        sampler.add(10.0, &intervals[2..], &model, (Wheels::both(2.1), 5.1));
        let second = sampler.sample((0, 3), Pose::IDENTITY).expect("one second went by");
        assert_eq!(
            (second.motion.distance_m, second.turned_rad.right, second.since_reversal_m),
            (-0.2, -0.2, Some(0.2))
        );
        // From −0.1 m/s at its start to −0.2 m/s at its end.
        assert_eq!(second.speed_change_m_s, -0.1);
    }
}
