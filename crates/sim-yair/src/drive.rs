//! A run in progress: from the shafts through effects, floor and counters to the records.
//!
//! Both engines share this way, command → motor → wheel → floor → encoder → clock → instrument, at each stage
//! of which the effects act; the body's part of it is [`crate::body`]. Time passes from event to event: what
//! an actuator, a log's clock or an instrument wants next.

use dataset::{Run, WheelLog};
use effects::{Command, Readout, SampleClock};
use kinematics::{Pose, Side, Wheels};

use crate::active::ActiveEffects;
use crate::actuator::{Actuator, RateSegment, RateSegments, ShaftMotion};
use crate::body::{Body, DriveSetup, DriveStreams, Start};
use crate::instrument::Observer;
use crate::planned_motion::PlannedMotion;
use crate::servo::ServoError;

/// Two instants closer than this are one: a nanosecond, far under any sample time and far over the rounding
/// of a long run's clock.
pub(crate) const SAME_INSTANT_S: f64 = 1e-9;

/// A run in progress.
pub(crate) struct Drive<'a> {
    setup: &'a DriveSetup,
    actuator: Actuator,
    effects: &'a mut ActiveEffects,
    observers: &'a mut [Observer],
    run: &'a mut Run,
    body: Body,
    streams: &'a mut DriveStreams,
    log: Option<LogClock>,
    /// When the next instrument measures by itself.
    next_measurement_s: f64,
    /// The instant of the last row, by the true clock.
    last_row_s: f64,
}

/// A stamp that jitters does not come before the last one: it is at least so much later, seconds.
const NEXT_STAMP_S: f64 = 1e-6;

/// The robot's own log: which row is due and which of its two readings are done.
struct LogClock {
    interval_s: f64,
    rows: u32,
    due_s: f64,
    pending: SampleClock,
    read: Wheels<Option<i64>>,
}

impl LogClock {
    fn schedule(interval_s: f64, rows: u32, effects: &mut ActiveEffects) -> Self {
        let t_s = f64::from(rows) * interval_s;
        let mut pending = SampleClock { stamp_s: t_s, read_s: Wheels::both(t_s) };
        effects.clock(&mut pending);
        Self { interval_s, rows, due_s: t_s, pending, read: Wheels::both(None) }
    }

    fn next_read_s(&self) -> f64 {
        let due = |side| if self.read[side].is_none() { self.pending.read_s[side] } else { f64::INFINITY };
        due(Side::Left).min(due(Side::Right))
    }
}

impl<'a> Drive<'a> {
    #[inline]
    pub(crate) fn start(
        setup: &'a DriveSetup,
        actuator: Actuator,
        start: Start,
        streams: &'a mut DriveStreams,
        effects: &'a mut ActiveEffects,
        observers: &'a mut [Observer],
        run: &'a mut Run,
    ) -> Self {
        let next_measurement_s = next_measurement_s(observers);
        // The row at t = 0 is a standing row; the clock's first is one interval later.
        let log = setup.log_interval_s.map(|interval_s| LogClock::schedule(interval_s, 1, effects));
        let body = Body::new(setup, &start);
        Self {
            setup,
            actuator,
            effects,
            observers,
            run,
            body,
            streams,
            log,
            next_measurement_s,
            last_row_s: f64::NEG_INFINITY,
        }
    }

    pub(crate) const fn world_from_body(&self) -> Pose {
        self.body.world_from_body.pose()
    }

    /// How long the run has taken, seconds, and how far the drive's centre has gone, metres.
    pub(crate) const fn so_far(&self) -> (f64, f64) {
        (self.body.t_s, self.body.distance_m)
    }

    /// Performs one motion and, where the counters have moved on, writes the row of its end.
    #[inline]
    pub(crate) fn perform(&mut self, motion: &PlannedMotion) -> Result<(), ServoError> {
        match motion {
            PlannedMotion::Measure => self.stand(),
            PlannedMotion::Pause { duration_s } => {
                self.actuator.hold(*duration_s);
                self.travel();
            }
            PlannedMotion::Go { command, segments } => self.go(*command, segments.as_deref())?,
        }
        self.write_standing_row();
        Ok(())
    }

    /// The outside instruments read the standing robot.
    #[inline]
    pub(crate) fn stand(&mut self) {
        self.measure_if_due();
        if self.run.point_readings.last().is_none_or(|reading| self.body.t_s > reading.t_s + SAME_INSTANT_S) {
            let (t_s, world_from_body) = self.body.reading(self.effects, self.body.t_s);
            for observer in &mut *self.observers {
                observer.read_standing(t_s, world_from_body, &self.setup.points, &mut self.run.point_readings);
            }
        }
        self.write_standing_row();
        let (t_s, pose) = (self.body.t_s, self.world_from_body());
        for observer in &mut *self.observers {
            observer.stands(t_s, pose, self.run);
        }
    }

    #[inline]
    fn go(&mut self, mut command: Command, planned_segments: Option<&[RateSegment]>) -> Result<(), ServoError> {
        self.effects.start_motion();
        self.effects.command(&mut command);
        self.body.start_motion(self.setup, self.streams);
        match (&mut self.actuator, planned_segments) {
            (Actuator::Stepping(pair), _) => {
                pair.begin(&command)?;
                self.travel();
            }
            (Actuator::ClosedForm(_), Some(segments)) => self.travel_in(segments),
            (Actuator::ClosedForm(_), None) => {
                let segments = self.segments(&command);
                self.travel_in(segments.as_slice());
            }
        }
        Ok(())
    }

    /// The closed form drives a motion's pieces.
    #[inline]
    fn travel_in(&mut self, segments: &[RateSegment]) {
        let undisturbed = self.log.is_none() && self.next_measurement_s == f64::INFINITY;
        for segment in segments {
            self.actuator.begin_segment(*segment);
            if undisturbed {
                self.advance(segment.duration_s);
            } else {
                self.travel();
            }
        }
    }

    /// How the closed form turns the shafts for a command, given what the counters now see of them.
    fn segments(&mut self, command: &Command) -> RateSegments {
        let mut probe = self.body.step(self.setup, 0.0, &ShaftMotion::REST);
        self.setup.profile.segments(command, |rate_rad_s| {
            probe.rate_rad_s = rate_rad_s;
            probe.encoder_rad = Wheels::both(1.0);
            self.effects.encoder(&mut probe);
            probe.encoder_rad
        })
    }

    /// Lets time pass until the actuator is done.
    fn travel(&mut self) {
        while let Some(event_s) = self.actuator.next_event_s() {
            let log_s = self.log.as_ref().map_or(f64::INFINITY, LogClock::next_read_s);
            let dt_s = event_s.min(log_s - self.body.t_s).min(self.next_measurement_s - self.body.t_s);
            if dt_s > 0.0 {
                self.advance(dt_s);
            }
            self.measure_if_due();
            self.read_counters_if_due();
        }
    }

    #[inline]
    fn advance(&mut self, dt_s: f64) {
        let motion = self.actuator.turn(dt_s);
        let step = self.body.advance(self.setup, self.streams, self.effects, dt_s, &motion);
        self.actuator.count(&step);
    }

    #[inline]
    fn measure_if_due(&mut self) {
        if self.next_measurement_s <= self.body.t_s + SAME_INSTANT_S {
            self.measurement();
        }
    }

    fn measurement(&mut self) {
        for k in 0..self.observers.len() {
            let measurement_s = self.observers[k].next_measurement_s();
            if measurement_s <= self.body.t_s + SAME_INSTANT_S {
                // Stamped with its own schedule: the clock of a long run has summed the rounding of its
                // steps.
                let (t_s, world_from_body) = self.body.reading(self.effects, measurement_s);
                self.observers[k].measurement(t_s, world_from_body, self.body.ground_m, self.run);
            }
        }
        self.next_measurement_s = next_measurement_s(self.observers);
    }

    fn read_counters_if_due(&mut self) {
        let Some(log) = &mut self.log else { return };
        let counts = self.actuator.counts();
        for side in Side::BOTH {
            if log.read[side].is_none() && log.pending.read_s[side] <= self.body.t_s + SAME_INSTANT_S {
                log.read[side] = Some(counts[side]);
            }
        }
        if let (Some(left), Some(right)) = (log.read.left, log.read.right) {
            let (due_s, SampleClock { stamp_s, read_s }) = (log.due_s, log.pending);
            *log = LogClock::schedule(log.interval_s, log.rows + 1, self.effects);
            self.write_row(due_s, read_s.left.max(read_s.right), stamp_s, Wheels { left, right });
        }
    }

    /// The row of a standstill: both counters rest, so that it does not matter when each is read, but only
    /// what the clock shows.
    #[inline]
    fn write_standing_row(&mut self) {
        let t_s = self.body.t_s;
        if t_s > self.last_row_s + SAME_INSTANT_S {
            let mut sample = SampleClock { stamp_s: t_s, read_s: Wheels::both(t_s) };
            self.effects.clock(&mut sample);
            let counts = self.actuator.counts();
            self.write_row(t_s, t_s, sample.stamp_s, counts);
        }
    }

    /// The row that was due at an instant, read by another and stamped with a third, unless the last row is
    /// as late.
    #[inline]
    fn write_row(&mut self, due_s: f64, read_s: f64, stamp_s: f64, counts: Wheels<i64>) {
        if due_s <= self.last_row_s + SAME_INSTANT_S {
            return;
        }
        self.last_row_s = due_s;
        let mut readout = Readout { ticks: counts, m_per_count: self.setup.m_per_count, written: true };
        self.effects.readout(&mut readout);
        if !readout.written {
            return;
        }
        // Rows are stamped in the order in which they are written.
        let before_s = self.run.odometry.t_s.last().map_or(f64::NEG_INFINITY, |before_s| before_s + NEXT_STAMP_S);
        self.run.odometry.t_s.push(stamp_s.max(before_s));
        if let WheelLog::Ticks(ticks) = &mut self.run.odometry.wheels {
            ticks.left.push(readout.ticks.left);
            ticks.right.push(readout.ticks.right);
        }
        let theta_rad = self.world_from_body().theta_rad;
        for observer in &mut *self.observers {
            observer.row(read_s, theta_rad, self.run);
        }
    }
}

fn next_measurement_s(observers: &[Observer]) -> f64 {
    observers.iter().map(Observer::next_measurement_s).fold(f64::INFINITY, f64::min)
}
