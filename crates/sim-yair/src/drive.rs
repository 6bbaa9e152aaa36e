//! A run in progress: from the shafts through effects, floor and counters to the records.
//!
//! Both engines share this way, command → motor → wheel → floor → encoder → clock → instrument, at each stage of which the effects act. A step is a
//! stretch of constant wheel rates; it becomes one SE(2) arc with the wheels' random walk summed over it. In the closed form a step may be a whole motion,
//! and then the noise *inside* the arc is added too: the Brownian bridge of [`kinematics::ArcScatter`], σ_θ²L²/12 across a straight of length L. Without it
//! the spread of UMBmark's results comes out too small.

use dataset::{MarkedPoint, Run, WheelLog};
use effects::{Command, Readout, SampleClock, Sighting, Step, Stream};
use kinematics::{ArcScatter, Frame, Increment, Pose, Side, WheelNoise, Wheels};

use crate::active::ActiveEffects;
use crate::actuator::{Actuator, Piece, Pieces, Profile, ShaftMotion};
use crate::instrument::Observer;
use crate::plan::PlannedMotion;
use crate::servo::ServoError;

/// Two instants closer than this are one: a nanosecond, far under any sample time and far over the rounding of a long run's clock.
const SAME_INSTANT_S: f64 = 1e-9;

/// What is the same in every run of a robot.
#[derive(Debug, Clone)]
pub(crate) struct DriveSetup {
    pub(crate) counts_per_rad: f64,
    /// Nominal travel for one count.
    pub(crate) m_per_count: Wheels<f64>,
    pub(crate) nominal_radius_m: Wheels<f64>,
    pub(crate) true_radius_m: Wheels<f64>,
    pub(crate) wheel_separation_m: f64,
    pub(crate) noise: WheelNoise,
    pub(crate) sensitivity_sigma: f64,
    pub(crate) closed_form: bool,
    pub(crate) profile: Profile,
    pub(crate) log_interval_s: Option<f64>,
    pub(crate) points: Vec<MarkedPoint>,
}

/// Where a run begins.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Start {
    pub(crate) world_from_body: Pose,
    pub(crate) counts: Wheels<f64>,
}

/// The drive's own draws.
#[derive(Debug)]
pub(crate) struct DriveStreams {
    pub(crate) wheel_noise: Stream,
    /// Drawn from only where sensitivities scatter.
    pub(crate) sensitivity: Stream,
}

/// A run in progress.
pub(crate) struct Drive<'a> {
    setup: &'a DriveSetup,
    actuator: Actuator,
    effects: &'a mut ActiveEffects,
    observers: &'a mut [Observer],
    run: &'a mut Run,
    t_s: f64,
    world_from_body: Frame,
    wheel_angle_rad: Wheels<f64>,
    /// What each contact has gone over the ground, metres.
    ground_m: Wheels<f64>,
    /// What the drive's centre has gone, forward and backward, metres.
    way_m: f64,
    sensitivity: Wheels<f64>,
    streams: &'a mut DriveStreams,
    log: Option<LogClock>,
    /// When the next instrument looks by itself.
    next_look_s: f64,
    /// The instant of the last row, by the true clock.
    last_row_s: f64,
}

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
        (actuator, start): (Actuator, Start),
        streams: &'a mut DriveStreams,
        effects: &'a mut ActiveEffects,
        observers: &'a mut [Observer],
        run: &'a mut Run,
    ) -> Self {
        let next_look_s = next_look_s(observers);
        // The row at t = 0 is a standing row; the clock's first is one interval later.
        let log = setup.log_interval_s.map(|interval_s| LogClock::schedule(interval_s, 1, effects));
        Self {
            setup,
            actuator,
            effects,
            observers,
            run,
            t_s: 0.0,
            world_from_body: start.world_from_body.into(),
            wheel_angle_rad: start.counts.map(|counts| counts / setup.counts_per_rad),
            ground_m: Wheels::both(0.0),
            way_m: 0.0,
            sensitivity: Wheels::both(1.0),
            streams,
            log,
            next_look_s,
            last_row_s: f64::NEG_INFINITY,
        }
    }

    pub(crate) const fn world_from_body(&self) -> Pose {
        self.world_from_body.pose()
    }

    /// How long the run has taken, seconds, and how far the drive's centre has gone, metres.
    pub(crate) const fn so_far(&self) -> (f64, f64) {
        (self.t_s, self.way_m)
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
            PlannedMotion::Go { command, pieces } => self.go(*command, pieces.as_deref())?,
        }
        self.write_standing_row();
        Ok(())
    }

    /// The outside instruments read the standing robot.
    #[inline]
    pub(crate) fn stand(&mut self) {
        self.look_if_due();
        if self.run.point_readings.last().is_none_or(|reading| self.t_s > reading.t_s + SAME_INSTANT_S) {
            let (t_s, world_from_body) = self.sighting(self.t_s);
            for observer in &mut *self.observers {
                observer.read_standing(t_s, world_from_body, &self.setup.points, self.run);
            }
        }
        self.write_standing_row();
    }

    #[inline]
    fn go(&mut self, mut command: Command, foreseen: Option<&[Piece]>) -> Result<(), ServoError> {
        self.effects.start_motion();
        self.effects.command(&mut command);
        if self.setup.sensitivity_sigma > 0.0 {
            let stream = &mut self.streams.sensitivity;
            self.sensitivity = Wheels::from_sides(|_| 1.0 + self.setup.sensitivity_sigma * stream.normal());
        }
        match (&mut self.actuator, foreseen) {
            (Actuator::Stepping(pair), _) => {
                pair.begin(&command)?;
                self.travel();
            }
            (Actuator::ClosedForm(_), Some(pieces)) => self.travel_in(pieces),
            (Actuator::ClosedForm(_), None) => {
                let pieces = self.pieces(&command);
                self.travel_in(pieces.as_slice());
            }
        }
        Ok(())
    }

    /// The closed form drives a motion's pieces.
    #[inline]
    fn travel_in(&mut self, pieces: &[Piece]) {
        let undisturbed = self.log.is_none() && self.next_look_s == f64::INFINITY;
        for piece in pieces {
            self.actuator.begin_piece(*piece);
            if undisturbed {
                self.advance(piece.duration_s);
            } else {
                self.travel();
            }
        }
    }

    /// How the closed form turns the shafts for a command, given what the counters now see of them.
    fn pieces(&mut self, command: &Command) -> Pieces {
        let mut probe = self.step(0.0, &ShaftMotion::REST);
        self.setup.profile.pieces(command, |rate_rad_s| {
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
            let dt_s = event_s.min(log_s - self.t_s).min(self.next_look_s - self.t_s);
            if dt_s > 0.0 {
                self.advance(dt_s);
            }
            self.look_if_due();
            self.read_counters_if_due();
        }
    }

    fn step(&self, dt_s: f64, motion: &ShaftMotion) -> Step {
        Step {
            t_s: self.t_s,
            dt_s,
            world_from_body: self.world_from_body.pose(),
            nominal_radius_m: self.setup.nominal_radius_m,
            shaft_rad: motion.shaft_rad,
            rate_rad_s: motion.rate_rad_s,
            acceleration_rad_s2: motion.acceleration_rad_s2,
            wheel_angle_rad: self.wheel_angle_rad,
            wheel_rad: motion.shaft_rad,
            radius_m: self.setup.true_radius_m,
            travel_m: Wheels::both(0.0),
            wheel_separation_m: self.setup.wheel_separation_m,
            lateral_m: 0.0,
            extra_turn_rad: 0.0,
            creep_m: [0.0; 2],
            encoder_rad: motion.shaft_rad,
        }
    }

    #[inline]
    fn advance(&mut self, dt_s: f64) {
        let motion = self.actuator.turn(dt_s);
        let mut step = self.step(dt_s, &motion);
        self.effects.motor(&mut step);
        step.wheel_rad = step.shaft_rad;
        step.encoder_rad = step.shaft_rad;
        self.effects.wheel(&mut step);
        self.wheel_angle_rad = self.wheel_angle_rad.zip_with(step.wheel_rad, |angle, turn| angle + turn);
        let rolled_m = step.radius_m.zip_with(step.wheel_rad, |radius_m, turn| radius_m * turn);
        step.travel_m = rolled_m.zip_with(self.sensitivity, |rolled_m, factor| rolled_m * factor);
        self.effects.floor(&mut step);
        self.move_body(&step);
        self.effects.encoder(&mut step);
        self.actuator.count(&step);
        self.t_s += dt_s;
    }

    #[inline]
    fn move_body(&mut self, step: &Step) {
        let var_m2 = self.setup.noise.travel_var_m2(step.travel_m);
        let (mut travel_m, mut along_m, mut across_m) = (step.travel_m, 0.0, step.lateral_m);
        if var_m2.left > 0.0 || var_m2.right > 0.0 {
            let stream = &mut self.streams.wheel_noise;
            let [left, right] = if self.setup.closed_form {
                let scatter = ArcScatter::within(step.travel_m, var_m2, step.wheel_separation_m);
                let [left, right, along, across] = stream.normals();
                along_m += scatter.along_var_m2.sqrt() * along;
                across_m += scatter.across_var_m2.sqrt() * across;
                [left, right]
            } else {
                stream.normals()
            };
            travel_m.left += var_m2.left.sqrt() * left;
            travel_m.right += var_m2.right.sqrt() * right;
        }
        self.ground_m = self.ground_m.zip_with(travel_m, |sum_m, travel_m| sum_m + travel_m);
        let mut increment = Increment::from_travel(travel_m, step.wheel_separation_m);
        self.way_m += increment.distance_m.abs();
        increment.turn_rad += step.extra_turn_rad;
        let mut world_from_body = self.world_from_body * increment.scattered_arc(along_m, across_m);
        world_from_body.x_m += step.creep_m[0];
        world_from_body.y_m += step.creep_m[1];
        self.world_from_body = world_from_body.into();
    }

    /// What an instrument that looks at `t_s`, now, sees: when and where.
    #[inline]
    fn sighting(&mut self, t_s: f64) -> (f64, Frame) {
        if !self.effects.act_on_instruments() {
            return (t_s, self.world_from_body);
        }
        let mut sighting = Sighting { t_s, world_from_body: self.world_from_body.pose() };
        self.effects.instrument(&mut sighting);
        (sighting.t_s, sighting.world_from_body.into())
    }

    #[inline]
    fn look_if_due(&mut self) {
        if self.next_look_s <= self.t_s + SAME_INSTANT_S {
            self.look();
        }
    }

    fn look(&mut self) {
        for k in 0..self.observers.len() {
            let look_s = self.observers[k].next_look_s();
            if look_s <= self.t_s + SAME_INSTANT_S {
                // Stamped with its own schedule: the clock of a long run has summed the rounding of its steps.
                let (t_s, world_from_body) = self.sighting(look_s);
                self.observers[k].look(t_s, world_from_body, self.ground_m, self.run);
            }
        }
        self.next_look_s = next_look_s(self.observers);
    }

    fn read_counters_if_due(&mut self) {
        let Some(log) = &mut self.log else { return };
        let counts = self.actuator.counts();
        for side in Side::BOTH {
            if log.read[side].is_none() && log.pending.read_s[side] <= self.t_s + SAME_INSTANT_S {
                log.read[side] = Some(counts[side]);
            }
        }
        if let (Some(left), Some(right)) = (log.read.left, log.read.right) {
            let (due_s, stamp_s) = (log.due_s, log.pending.stamp_s);
            *log = LogClock::schedule(log.interval_s, log.rows + 1, self.effects);
            self.write_row(due_s, stamp_s, Wheels { left, right });
        }
    }

    /// The row of a standstill: both counters rest, so that it does not matter when each is read, but only what the clock shows.
    #[inline]
    fn write_standing_row(&mut self) {
        if self.t_s > self.last_row_s + SAME_INSTANT_S {
            let mut sample = SampleClock { stamp_s: self.t_s, read_s: Wheels::both(self.t_s) };
            self.effects.clock(&mut sample);
            let counts = self.actuator.counts();
            self.write_row(self.t_s, sample.stamp_s, counts);
        }
    }

    /// The row of an instant, unless the last row is as late.
    #[inline]
    fn write_row(&mut self, due_s: f64, stamp_s: f64, counts: Wheels<i64>) {
        if due_s <= self.last_row_s + SAME_INSTANT_S {
            return;
        }
        self.last_row_s = due_s;
        let mut readout = Readout { ticks: counts, m_per_count: self.setup.m_per_count, written: true };
        self.effects.readout(&mut readout);
        if !readout.written {
            return;
        }
        self.run.odometry.t_s.push(stamp_s);
        if let WheelLog::Ticks(ticks) = &mut self.run.odometry.wheels {
            ticks.left.push(readout.ticks.left);
            ticks.right.push(readout.ticks.right);
        }
    }
}

fn next_look_s(observers: &[Observer]) -> f64 {
    observers.iter().map(Observer::next_look_s).fold(f64::INFINITY, f64::min)
}
