//! A run in progress: from the shafts through effects, floor and counters to the records.
//!
//! Both engines share this way, command → motor → wheel → floor → encoder → clock → instrument, at each stage of which the effects act. A step is a
//! stretch of constant wheel rates; it becomes one SE(2) arc with the wheels' random walk summed over it. In the closed form a step may be a whole motion,
//! and then the noise *inside* the arc is added too: the Brownian bridge of [`kinematics::ArcScatter`], σ_θ²L²/12 across a straight of length L. Without it
//! the spread of UMBmark's results comes out too small.

use dataset::{MarkedPoint, Motion, Run, WheelLog};
use effects::{Address, Command, Forward, Readout, SampleClock, Sighting, Step, Stream, StreamName};
use kinematics::{ArcScatter, DriveGeometry, Increment, Pose, Side, WheelNoise, Wheels};
use scenario::Robot;

use crate::actuator::{Actuator, ShaftMotion};
use crate::instrument::Observer;
use crate::servo::ServoError;

const WHEEL_NOISE: StreamName = StreamName::new("wheel noise");
const SENSITIVITY: StreamName = StreamName::new("sensitivity");

/// Two instants closer than this are one: a nanosecond, far under any sample time and far over the rounding of a long run's clock.
const SAME_INSTANT_S: f64 = 1e-9;

/// An effect at work, with the name of its stream.
pub(crate) type ActiveEffect = (StreamName, Box<dyn Forward>);

/// What stays the same during a run.
pub(crate) struct DriveSetup<'a> {
    pub(crate) actuator: Actuator,
    pub(crate) robot: &'a Robot,
    pub(crate) nominal_geometry: DriveGeometry,
    pub(crate) true_geometry: DriveGeometry,
    pub(crate) noise: WheelNoise,
    pub(crate) sensitivity_sigma: f64,
    pub(crate) closed_form: bool,
    pub(crate) log_interval_s: Option<f64>,
    pub(crate) points: &'a [MarkedPoint],
}

/// A run in progress.
pub(crate) struct Drive<'a> {
    setup: DriveSetup<'a>,
    effects: &'a mut [ActiveEffect],
    observers: &'a mut [Observer],
    run: &'a mut Run,
    t_s: f64,
    world_from_body: Pose,
    wheel_angle_rad: Wheels<f64>,
    sensitivity: Wheels<f64>,
    sensitivity_stream: Stream,
    noise_stream: Stream,
    log: Option<LogClock>,
}

/// The robot's own log: which row is due and which of its two readings are done.
struct LogClock {
    interval_s: f64,
    rows: u32,
    pending: SampleClock,
    read: Wheels<Option<i64>>,
}

impl LogClock {
    fn schedule(interval_s: f64, rows: u32, effects: &mut [ActiveEffect]) -> Self {
        let t_s = f64::from(rows) * interval_s;
        let mut pending = SampleClock { stamp_s: t_s, read_s: Wheels::both(t_s) };
        for (_, effect) in effects {
            effect.clock(&mut pending);
        }
        Self { interval_s, rows, pending, read: Wheels::both(None) }
    }

    fn next_read_s(&self) -> f64 {
        let due = |side| if self.read[side].is_none() { self.pending.read_s[side] } else { f64::INFINITY };
        due(Side::Left).min(due(Side::Right))
    }
}

impl<'a> Drive<'a> {
    pub(crate) fn start(
        setup: DriveSetup<'a>,
        address: &Address,
        (world_from_body, start_counts): (Pose, Wheels<f64>),
        effects: &'a mut [ActiveEffect],
        observers: &'a mut [Observer],
        run: &'a mut Run,
    ) -> Self {
        let counts_per_rad = setup.robot.encoder.counts_per_wheel_turn() / std::f64::consts::TAU;
        // The row at t = 0 is a standing row; the clock's first is one interval later.
        let log = setup.log_interval_s.map(|interval_s| LogClock::schedule(interval_s, 1, effects));
        Self {
            setup,
            effects,
            observers,
            run,
            t_s: 0.0,
            world_from_body,
            wheel_angle_rad: start_counts.map(|counts| counts / counts_per_rad),
            sensitivity: Wheels::both(1.0),
            sensitivity_stream: address.stream(SENSITIVITY),
            noise_stream: address.stream(WHEEL_NOISE),
            log,
        }
    }

    pub(crate) const fn world_from_body(&self) -> Pose {
        self.world_from_body
    }

    /// Performs one motion and, where the counters have moved on, writes the row of its end.
    pub(crate) fn perform(&mut self, motion: &Motion) -> Result<(), ServoError> {
        match *motion {
            Motion::Measure => self.stand(),
            Motion::Pause { duration_s } => {
                self.setup.actuator.hold(duration_s);
                self.travel();
            }
            Motion::Straight { length_m } => self.go(Increment { distance_m: length_m, turn_rad: 0.0 })?,
            Motion::Spin { turn_rad } => self.go(Increment { distance_m: 0.0, turn_rad })?,
            Motion::Arc { radius_m, turn_rad } => {
                self.go(Increment { distance_m: radius_m * turn_rad.abs(), turn_rad })?;
            }
        }
        self.write_standing_row();
        Ok(())
    }

    /// The outside instruments read the standing robot.
    pub(crate) fn stand(&mut self) {
        self.look_if_due();
        if self.run.point_readings.last().is_none_or(|reading| self.t_s > reading.t_s + SAME_INSTANT_S) {
            let sighting = self.sighting(self.t_s);
            for observer in &mut *self.observers {
                observer.read_standing(sighting, self.setup.points, self.run);
            }
        }
        self.write_standing_row();
    }

    fn go(&mut self, increment: Increment) -> Result<(), ServoError> {
        let mut command = command(self.setup.robot, &self.setup.nominal_geometry, increment);
        for (_, effect) in &mut *self.effects {
            effect.start_motion();
            effect.command(&mut command);
        }
        if self.setup.sensitivity_sigma > 0.0 {
            self.sensitivity =
                Wheels::from_sides(|_| 1.0 + self.setup.sensitivity_sigma * self.sensitivity_stream.normal());
        }
        let mut probe = self.step(
            0.0,
            &ShaftMotion {
                shaft_rad: Wheels::both(0.0),
                rate_rad_s: Wheels::both(0.0),
                acceleration_rad_s2: Wheels::both(0.0),
            },
        );
        let effects = &mut *self.effects;
        self.setup.actuator.begin(&command, |rate_rad_s| {
            probe.rate_rad_s = rate_rad_s;
            probe.encoder_rad = Wheels::both(1.0);
            for (_, effect) in &mut *effects {
                effect.encoder(&mut probe);
            }
            probe.encoder_rad
        })?;
        self.travel();
        Ok(())
    }

    /// Lets time pass until the actuator is done.
    fn travel(&mut self) {
        while let Some(event_s) = self.setup.actuator.next_event_s() {
            let log_s = self.log.as_ref().map_or(f64::INFINITY, LogClock::next_read_s);
            let look_s = self.observers.iter().map(Observer::next_look_s).fold(f64::INFINITY, f64::min);
            let dt_s = event_s.min(log_s - self.t_s).min(look_s - self.t_s);
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
            world_from_body: self.world_from_body,
            nominal_radius_m: self.setup.nominal_geometry.m_per_rad(),
            shaft_rad: motion.shaft_rad,
            rate_rad_s: motion.rate_rad_s,
            acceleration_rad_s2: motion.acceleration_rad_s2,
            wheel_angle_rad: self.wheel_angle_rad,
            wheel_rad: motion.shaft_rad,
            radius_m: self.setup.true_geometry.m_per_rad(),
            travel_m: Wheels::both(0.0),
            wheel_separation_m: self.setup.true_geometry.wheel_separation_m(),
            lateral_m: 0.0,
            extra_turn_rad: 0.0,
            creep_m: [0.0; 2],
            encoder_rad: motion.shaft_rad,
        }
    }

    fn advance(&mut self, dt_s: f64) {
        let motion = self.setup.actuator.turn(dt_s);
        let mut step = self.step(dt_s, &motion);
        for (_, effect) in &mut *self.effects {
            effect.motor(&mut step);
        }
        step.wheel_rad = step.shaft_rad;
        step.encoder_rad = step.shaft_rad;
        for (_, effect) in &mut *self.effects {
            effect.wheel(&mut step);
        }
        self.wheel_angle_rad = self.wheel_angle_rad.zip_with(step.wheel_rad, |angle, turn| angle + turn);
        let rolled_m = step.radius_m.zip_with(step.wheel_rad, |radius_m, turn| radius_m * turn);
        step.travel_m = rolled_m.zip_with(self.sensitivity, |rolled_m, factor| rolled_m * factor);
        for (_, effect) in &mut *self.effects {
            effect.floor(&mut step);
        }
        self.move_body(&step);
        for (_, effect) in &mut *self.effects {
            effect.encoder(&mut step);
        }
        self.setup.actuator.count(&step);
        self.t_s += dt_s;
    }

    fn move_body(&mut self, step: &Step) {
        let var_m2 = self.setup.noise.travel_var_m2(step.travel_m);
        let noisy = var_m2.left > 0.0 || var_m2.right > 0.0;
        let travel_m = if noisy {
            let noise_m = Wheels::from_sides(|side| var_m2[side].sqrt() * self.noise_stream.normal());
            step.travel_m.zip_with(noise_m, |travel_m, noise_m| travel_m + noise_m)
        } else {
            step.travel_m
        };
        let mut increment = Increment::from_travel(travel_m, step.wheel_separation_m);
        increment.turn_rad += step.extra_turn_rad;
        let mut before_from_after = increment.arc();
        let (mut along_m, mut across_m) = (0.0, step.lateral_m);
        if noisy && self.setup.closed_form {
            let scatter = ArcScatter::within(step.travel_m, var_m2, step.wheel_separation_m);
            along_m += scatter.along_var_m2.sqrt() * self.noise_stream.normal();
            across_m += scatter.across_var_m2.sqrt() * self.noise_stream.normal();
        }
        if along_m != 0.0 || across_m != 0.0 {
            let (sin, cos) = (0.5 * increment.turn_rad).sin_cos();
            before_from_after.x_m += cos * along_m - sin * across_m;
            before_from_after.y_m += sin * along_m + cos * across_m;
        }
        self.world_from_body = self.world_from_body * before_from_after;
        self.world_from_body.x_m += step.creep_m[0];
        self.world_from_body.y_m += step.creep_m[1];
    }

    /// What an instrument that looks at `t_s`, now, sees.
    fn sighting(&mut self, t_s: f64) -> Sighting {
        let mut sighting = Sighting { t_s, world_from_body: self.world_from_body };
        for (_, effect) in &mut *self.effects {
            effect.instrument(&mut sighting);
        }
        sighting
    }

    fn look_if_due(&mut self) {
        for k in 0..self.observers.len() {
            let look_s = self.observers[k].next_look_s();
            if look_s <= self.t_s + SAME_INSTANT_S {
                // Stamped with its own schedule: the clock of a long run has summed the rounding of its steps.
                let sighting = self.sighting(look_s);
                self.observers[k].look(sighting, self.run);
            }
        }
    }

    fn read_counters_if_due(&mut self) {
        let Some(log) = &mut self.log else { return };
        let counts = self.setup.actuator.counts();
        for side in Side::BOTH {
            if log.read[side].is_none() && log.pending.read_s[side] <= self.t_s + SAME_INSTANT_S {
                log.read[side] = Some(counts[side]);
            }
        }
        if let (Some(left), Some(right)) = (log.read.left, log.read.right) {
            let stamp_s = log.pending.stamp_s;
            *log = LogClock::schedule(log.interval_s, log.rows + 1, self.effects);
            self.write_row(stamp_s, Wheels { left, right });
        }
    }

    /// The row of a standstill: both counters rest, so that neither clock nor skew matters.
    fn write_standing_row(&mut self) {
        let counts = self.setup.actuator.counts();
        self.write_row(self.t_s, counts);
    }

    fn write_row(&mut self, t_s: f64, counts: Wheels<i64>) {
        if self.run.odometry.t_s.last().is_some_and(|last_s| t_s <= last_s + SAME_INSTANT_S) {
            return;
        }
        let mut readout = Readout { ticks: counts };
        for (_, effect) in &mut *self.effects {
            effect.readout(&mut readout);
        }
        self.run.odometry.t_s.push(t_s);
        if let WheelLog::Ticks(ticks) = &mut self.run.odometry.wheels {
            ticks.left.push(readout.ticks.left);
            ticks.right.push(readout.ticks.right);
        }
    }
}

/// What the wheels are told for a motion: whole counts by the nominal geometry, both wheels done at the same time.
fn command(robot: &Robot, nominal_geometry: &DriveGeometry, increment: Increment) -> Command {
    let travel_m = nominal_geometry.travel_m(increment);
    let counts_per_rad = robot.encoder.counts_per_wheel_turn() / std::f64::consts::TAU;
    let m_per_count = nominal_geometry.m_per_rad().map(|m_per_rad| m_per_rad / counts_per_rad);
    let travel_counts = travel_m.zip_with(m_per_count, |travel_m, m_per_count| (travel_m / m_per_count).round());
    let longest = travel_counts.left.abs().max(travel_counts.right.abs()).max(1.0);
    let speed_counts_s = travel_counts
        .zip_with(m_per_count, |counts, m_per_count| robot.cruise_speed_m_s / m_per_count * (counts.abs() / longest));
    Command { travel_counts, speed_counts_s }
}
