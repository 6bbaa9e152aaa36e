//! What turns the shafts: the closed form at constant speed, or motors under their controllers in small
//! steps. One interface, so that everything from the shaft to the floor and the log is the same code in both
//! engines.

use effects::{Command, Step};
use kinematics::{Branching, Elementary, Wheels};
use scenario::Robot;

use crate::servo::{Servo, ServoError, Travel};

/// How the shafts turn over the next step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ShaftMotion {
    pub(crate) shaft_rad: Wheels<f64>,
    pub(crate) rate_rad_s: Wheels<f64>,
    pub(crate) acceleration_rad_s2: Wheels<f64>,
}

impl ShaftMotion {
    /// Standing still.
    pub(crate) const REST: Self = {
        let none = Wheels { left: 0.0, right: 0.0 };
        Self { shaft_rad: none, rate_rad_s: none, acceleration_rad_s2: none }
    };
}

/// The two wheels' drives.
#[derive(Debug)]
pub(crate) enum Actuator {
    ClosedForm(ConstantSpeed),
    Stepping(Box<ServoPair>),
}

impl Actuator {
    /// Starts a piece of a motion, which only the closed form has.
    #[inline]
    pub(crate) fn begin_segment(&mut self, segment: RateSegment) {
        if let Self::ClosedForm(drive) = self {
            drive.begin(segment);
        }
    }

    /// Holds still.
    pub(crate) fn hold(&mut self, duration_s: f64) {
        match self {
            Self::ClosedForm(drive) => {
                if let Some(segment) = RateSegment::at_rest(duration_s) {
                    drive.begin(segment);
                }
            }
            Self::Stepping(pair) => {
                pair.hold_s = duration_s;
                pair.sample_if_due();
            }
        }
    }

    /// Seconds until the actuator wants a step to end; `None` when it is done.
    #[inline]
    pub(crate) fn next_event_s(&self) -> Option<f64> {
        match self {
            Self::ClosedForm(drive) => (drive.remaining_s > 0.0).then_some(drive.remaining_s),
            Self::Stepping(pair) => pair.next_event_s(),
        }
    }

    /// Turns the shafts for `dt_s`, at most [`Self::next_event_s`].
    #[inline]
    pub(crate) fn turn(&mut self, dt_s: f64) -> ShaftMotion {
        match self {
            Self::ClosedForm(drive) => drive.turn(dt_s),
            Self::Stepping(pair) => pair.turn(dt_s),
        }
    }

    /// What the counters saw of the step, after the effects.
    #[inline]
    pub(crate) fn count(&mut self, step: &Step) {
        match self {
            Self::ClosedForm(drive) => drive.count(step),
            Self::Stepping(pair) => pair.count(step),
        }
    }

    /// The counters' values.
    #[inline]
    pub(crate) fn counts(&self) -> Wheels<i64> {
        match self {
            Self::ClosedForm(drive) => drive.counts(),
            Self::Stepping(pair) => {
                pair.servos.as_ref().map(Servo::counts).zip_with(pair.start_counts, |counts, start| counts + start)
            }
        }
    }
}

/// The counts that counters show: the largest whole numbers not above. 2⁶³ counts are beyond any run.
#[inline]
fn whole_counts(counts: Wheels<f64>) -> Wheels<i64> {
    counts.map(|counts| Branching.floor(counts) as i64)
}

/// The closed form: a piece of constant speed at a time.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ConstantSpeed {
    counts_per_rad: f64,
    counts: Wheels<f64>,
    rate_rad_s: Wheels<f64>,
    remaining_s: f64,
}

impl ConstantSpeed {
    pub(crate) const fn new(counts_per_rad: f64, start_counts: Wheels<f64>) -> Self {
        let rate_rad_s = Wheels { left: 0.0, right: 0.0 };
        Self { counts_per_rad, counts: start_counts, rate_rad_s, remaining_s: 0.0 }
    }

    const fn begin(&mut self, segment: RateSegment) {
        self.rate_rad_s = segment.rate_rad_s;
        self.remaining_s = segment.duration_s;
    }

    #[inline]
    fn turn(&mut self, dt_s: f64) -> ShaftMotion {
        self.remaining_s = if dt_s >= self.remaining_s { 0.0 } else { self.remaining_s - dt_s };
        ShaftMotion {
            shaft_rad: self.rate_rad_s.map(|rate| rate * dt_s),
            rate_rad_s: self.rate_rad_s,
            ..ShaftMotion::REST
        }
    }

    /// Turns the shafts for a whole piece.
    #[inline]
    pub(crate) fn whole(&mut self, segment: RateSegment) -> ShaftMotion {
        self.begin(segment);
        self.turn(segment.duration_s)
    }

    #[inline]
    pub(crate) fn count(&mut self, step: &Step) {
        self.counts = self.counts.zip_with(step.encoder_rad, |sum, rad| sum + rad * self.counts_per_rad);
    }

    #[inline]
    pub(crate) fn counts(&self) -> Wheels<i64> {
        whole_counts(self.counts)
    }
}

/// How the closed form cuts motions into pieces of constant speed.
///
/// A motion is one piece at one speed, unless an effect depends on speed: then the trapezoid's ramps are two
/// pieces each, at the speeds of the two-point Gauss rule, which integrates any cubic of the speed over a
/// ramp exactly (so v², what slip costs), and the cruise is the fifth piece.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Profile {
    counts_per_rad: f64,
    /// Acceleration of the faster wheel, counts/s², when ramps matter.
    ramp_counts_s2: Option<f64>,
}

const MAX_SEGMENTS: usize = 5;

/// Nodes of the two-point Gauss–Legendre rule on [0, 1]: ½ ∓ 1/(2√3).
const GAUSS_NODES: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];

/// Rounds of the fixed point that finds the shaft's rate from the counted one; each gains the lost share's
/// order, 1e-2 to 1e-3.
const SEEN_ROUNDS: u32 = 12;

impl Profile {
    pub(crate) fn new(robot: &Robot, ramps: bool) -> Self {
        let counts_per_turn = robot.encoder.counts_per_wheel_turn();
        let m_per_count = robot.wheel_diameter_m().map(|d_m| std::f64::consts::PI * d_m / counts_per_turn);
        Self {
            counts_per_rad: counts_per_turn / std::f64::consts::TAU,
            ramp_counts_s2: ramps.then(|| robot.acceleration_m_s2 / m_per_count.left),
        }
    }

    /// The pieces of a motion. `seen` is the share of a shaft's turn that its counter sees at a given rate: a
    /// controller drives *counts* to the target, so that a counter that misses some makes the wheel go
    /// farther.
    pub(crate) fn segments(&self, command: &Command, mut seen: impl FnMut(Wheels<f64>) -> Wheels<f64>) -> RateSegments {
        let travel = command.travel_counts;
        let speed = command.speed_counts_s.left.max(command.speed_counts_s.right);
        let longest = travel.left.abs().max(travel.right.abs());
        let mut segments = RateSegments::default();
        if longest <= 0.0 {
            return segments;
        }
        let mut push = |speed: f64, duration_s: f64| {
            if duration_s > 0.0 {
                let counted_rad_s = travel.map(|counts| counts / longest * speed / self.counts_per_rad);
                segments.push(RateSegment { rate_rad_s: shaft_rate(counted_rad_s, &mut seen), duration_s });
            }
        };
        match self.ramp_counts_s2 {
            None => push(speed, longest / speed),
            Some(acceleration) => {
                let peak = speed.min((longest * acceleration).sqrt());
                let ramp_s = peak / acceleration;
                let [slow, fast] = GAUSS_NODES;
                push(slow * peak, 0.5 * ramp_s);
                push(fast * peak, 0.5 * ramp_s);
                push(peak, longest / peak - ramp_s);
                push(fast * peak, 0.5 * ramp_s);
                push(slow * peak, 0.5 * ramp_s);
            }
        }
        segments
    }
}

/// Constant rates for a while.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RateSegment {
    rate_rad_s: Wheels<f64>,
    pub(crate) duration_s: f64,
}

impl RateSegment {
    /// Standing still, if only for a while.
    pub(crate) fn at_rest(duration_s: f64) -> Option<Self> {
        (duration_s > 0.0).then_some(Self { rate_rad_s: Wheels { left: 0.0, right: 0.0 }, duration_s })
    }
}

/// A motion in pieces of constant speed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RateSegments {
    segments: [RateSegment; MAX_SEGMENTS],
    count: usize,
}

impl Default for RateSegments {
    fn default() -> Self {
        Self { segments: [RateSegment { rate_rad_s: Wheels::both(0.0), duration_s: 0.0 }; MAX_SEGMENTS], count: 0 }
    }
}

impl RateSegments {
    fn push(&mut self, segment: RateSegment) {
        self.segments[self.count] = segment;
        self.count += 1;
    }

    /// In the order in which they are driven.
    pub(crate) fn as_slice(&self) -> &[RateSegment] {
        &self.segments[..self.count]
    }
}

/// The rate of the shafts at which the counters see `counted_rad_s`.
fn shaft_rate(counted_rad_s: Wheels<f64>, mut seen: impl FnMut(Wheels<f64>) -> Wheels<f64>) -> Wheels<f64> {
    let mut rate_rad_s = counted_rad_s;
    for _ in 0..SEEN_ROUNDS {
        let next = counted_rad_s.zip_with(seen(rate_rad_s), |counted, share| counted / share);
        if next == rate_rad_s {
            break;
        }
        rate_rad_s = next;
    }
    rate_rad_s
}

/// Two servos that share no clock, and when their motion is over.
#[derive(Debug)]
pub(crate) struct ServoPair {
    servos: Wheels<Servo>,
    step_s: f64,
    acceleration_counts_s2: f64,
    moving: bool,
    settling_s: f64,
    hold_s: f64,
    /// Where the counters stood when the run began; the servos count from there.
    start_counts: Wheels<i64>,
}

/// Longest wait for a wheel to settle on its target after its profile: friction may hold it a few counts away
/// for good.
const LONGEST_SETTLING_S: f64 = 1.0;

impl ServoPair {
    pub(crate) fn new(robot: &Robot, start_counts: Wheels<f64>, step_s: f64) -> Result<Self, ServoError> {
        let servo = |phase_s, start| Servo::new(&robot.controller, &robot.motor, &robot.encoder, phase_s, start);
        let nominal_m_per_count =
            robot.wheel_diameter_m().map(|d_m| std::f64::consts::PI * d_m / robot.encoder.counts_per_wheel_turn());
        Ok(Self {
            servos: Wheels {
                left: servo(0.0, start_counts.left)?,
                right: servo(robot.controller.right_phase_s, start_counts.right)?,
            },
            step_s,
            acceleration_counts_s2: robot.acceleration_m_s2 / nominal_m_per_count.left,
            moving: false,
            settling_s: 0.0,
            hold_s: 0.0,
            // Within one wheel turn.
            start_counts: start_counts.map(|counts| counts.floor() as i64),
        })
    }

    pub(crate) fn begin(&mut self, command: &Command) -> Result<(), ServoError> {
        let fastest = command.speed_counts_s.left.max(command.speed_counts_s.right);
        for side in kinematics::Side::BOTH {
            let counts = command.travel_counts[side];
            let speed_counts_s = command.speed_counts_s[side];
            if counts != 0.0 {
                self.servos[side].command(Travel {
                    // Targets are whole counts.
                    counts: counts.round() as i64,
                    speed_counts_s,
                    // Both wheels ramp for the same time, so that an arc keeps its radius while it starts and
                    // stops.
                    acceleration_counts_s2: self.acceleration_counts_s2 * speed_counts_s / fastest,
                })?;
            }
        }
        self.moving = true;
        self.settling_s = 0.0;
        self.sample_if_due();
        Ok(())
    }

    /// Lets the controllers whose instant has come take their sample.
    fn sample_if_due(&mut self) {
        self.servos.left.sample_if_due();
        self.servos.right.sample_if_due();
    }

    fn next_event_s(&self) -> Option<f64> {
        if !self.moving && self.hold_s <= 0.0 {
            return None;
        }
        let sample_s = self.servos.left.time_to_sample_s().min(self.servos.right.time_to_sample_s());
        let next_s = sample_s.min(self.step_s);
        Some(if self.moving { next_s } else { next_s.min(self.hold_s) })
    }

    fn turn(&mut self, dt_s: f64) -> ShaftMotion {
        let shaft_rad = Wheels { left: self.servos.left.turn(dt_s), right: self.servos.right.turn(dt_s) };
        ShaftMotion {
            shaft_rad,
            rate_rad_s: self.servos.as_ref().map(Servo::rate_rad_s),
            acceleration_rad_s2: self.servos.as_ref().map(Servo::acceleration_rad_s2),
        }
    }

    fn count(&mut self, step: &Step) {
        for side in kinematics::Side::BOTH {
            self.servos[side].count(step.encoder_rad[side], step.dt_s);
        }
        self.sample_if_due();
        if self.moving {
            if self.servos.left.profile_done() && self.servos.right.profile_done() {
                self.settling_s += step.dt_s;
            }
            let settled = self.servos.left.settled() && self.servos.right.settled();
            self.moving = !settled && self.settling_s < LONGEST_SETTLING_S;
        } else {
            self.hold_s -= step.dt_s;
        }
    }
}
