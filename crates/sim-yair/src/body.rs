//! The robot's body on its way from the shafts to the floor, the same in both engines.
//!
//! A step is a stretch of constant wheel rates; it becomes one SE(2) arc with the wheels' random walk summed
//! over it. In the closed form a step may be a whole motion, and then the noise *inside* the arc is added
//! too: the Brownian bridge of [`kinematics::BridgeCovariance`], σ_θ²L²/12 across a straight of length L.
//! Without it the spread of UMBmark's results comes out too small.

use dataset::MarkedPoint;
use effects::{PoseReading, Step, Stream, StreamName};
use kinematics::{BridgeCovariance, Frame, Increment, Pose, WheelNoise, Wheels};

use crate::active::ActiveEffects;
use crate::actuator::{Profile, ShaftMotion};

/// Where runs begin.
pub(crate) const PLACEMENT: StreamName = StreamName::new("placement");
/// How the wheels stand there.
pub(crate) const WHEEL_PHASE: StreamName = StreamName::new("wheel phase");
/// The wheels' random walk.
pub(crate) const WHEEL_NOISE: StreamName = StreamName::new("wheel noise");

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

/// Wheel travels with their noise, by a draw of each wheel, metres.
#[inline(always)]
pub(crate) fn with_noise_m(travel_m: Wheels<f64>, var_m2: Wheels<f64>, [left, right]: [f64; 2]) -> Wheels<f64> {
    Wheels { left: travel_m.left + var_m2.left.sqrt() * left, right: travel_m.right + var_m2.right.sqrt() * right }
}

/// How far the noise inside an arc moves its end, along its chord and across it, by a draw of each, metres.
#[inline(always)]
pub(crate) fn within_arc_m(bridge: &BridgeCovariance, [along, across]: [f64; 2]) -> [f64; 2] {
    [bridge.along_var_m2.sqrt() * along, bridge.across_var_m2.sqrt() * across]
}

/// Where the body is, and how its wheels stand.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Body {
    pub(crate) t_s: f64,
    pub(crate) world_from_body: Frame,
    /// What each contact has gone over the ground, metres.
    pub(crate) ground_m: Wheels<f64>,
    /// What the drive's centre has gone, forward and backward, metres.
    pub(crate) distance_m: f64,
    wheel_angle_rad: Wheels<f64>,
    sensitivity: Wheels<f64>,
}

impl Body {
    #[inline]
    pub(crate) fn new(setup: &DriveSetup, start: &Start) -> Self {
        Self {
            t_s: 0.0,
            world_from_body: start.world_from_body.into(),
            ground_m: Wheels::both(0.0),
            distance_m: 0.0,
            wheel_angle_rad: start.counts.map(|counts| counts / setup.counts_per_rad),
            sensitivity: Wheels::both(1.0),
        }
    }

    /// A motion begins: the wheels' sensitivities are drawn where they scatter.
    #[inline]
    pub(crate) fn start_motion(&mut self, setup: &DriveSetup, streams: &mut DriveStreams) {
        if setup.sensitivity_sigma > 0.0 {
            let stream = &mut streams.sensitivity;
            self.sensitivity = Wheels::from_sides(|_| 1.0 + setup.sensitivity_sigma * stream.normal());
        }
    }

    /// A step as the shafts make it, before any effect.
    #[inline]
    pub(crate) fn step(&self, setup: &DriveSetup, dt_s: f64, motion: &ShaftMotion) -> Step {
        Step {
            t_s: self.t_s,
            dt_s,
            world_from_body: self.world_from_body.pose(),
            nominal_radius_m: setup.nominal_radius_m,
            shaft_rad: motion.shaft_rad,
            rate_rad_s: motion.rate_rad_s,
            acceleration_rad_s2: motion.acceleration_rad_s2,
            wheel_angle_rad: self.wheel_angle_rad,
            wheel_rad: motion.shaft_rad,
            radius_m: setup.true_radius_m,
            travel_m: Wheels::both(0.0),
            wheel_separation_m: setup.wheel_separation_m,
            lateral_m: 0.0,
            extra_turn_rad: 0.0,
            creep_m: [0.0; 2],
            encoder_rad: motion.shaft_rad,
        }
    }

    /// Moves through one step; what comes back has gone through all stages up to the encoder's.
    #[inline]
    pub(crate) fn advance(
        &mut self,
        setup: &DriveSetup,
        streams: &mut DriveStreams,
        effects: &mut ActiveEffects,
        dt_s: f64,
        motion: &ShaftMotion,
    ) -> Step {
        let mut step = self.step(setup, dt_s, motion);
        effects.motor(&mut step);
        step.wheel_rad = step.shaft_rad;
        step.encoder_rad = step.shaft_rad;
        effects.wheel(&mut step);
        self.wheel_angle_rad = self.wheel_angle_rad.zip_with(step.wheel_rad, |angle, turn| angle + turn);
        let rolled_m = step.radius_m.zip_with(step.wheel_rad, |radius_m, turn| radius_m * turn);
        step.travel_m = rolled_m.zip_with(self.sensitivity, |rolled_m, factor| rolled_m * factor);
        effects.floor(&mut step);
        self.roll(setup, &mut streams.wheel_noise, &step);
        effects.encoder(&mut step);
        self.t_s += dt_s;
        step
    }

    #[inline]
    fn roll(&mut self, setup: &DriveSetup, wheel_noise: &mut Stream, step: &Step) {
        let var_m2 = setup.noise.travel_var_m2(step.travel_m);
        let (mut travel_m, mut along_m, mut across_m) = (step.travel_m, 0.0, step.lateral_m);
        if var_m2.left > 0.0 || var_m2.right > 0.0 {
            let [left, right] = if setup.closed_form {
                let [left, right, along, across] = wheel_noise.normals();
                let bridge = BridgeCovariance::within(step.travel_m, var_m2, step.wheel_separation_m);
                let [bridge_along_m, bridge_across_m] = within_arc_m(&bridge, [along, across]);
                along_m += bridge_along_m;
                across_m += bridge_across_m;
                [left, right]
            } else {
                wheel_noise.normals()
            };
            travel_m = with_noise_m(travel_m, var_m2, [left, right]);
        }
        self.ground_m = self.ground_m.zip_with(travel_m, |sum_m, travel_m| sum_m + travel_m);
        let mut increment = Increment::from_travel(travel_m, step.wheel_separation_m);
        self.distance_m += increment.distance_m.abs();
        increment.turn_rad += step.extra_turn_rad;
        let before_from_after = increment.perturbed_arc(along_m, across_m);
        let world_from_body = if setup.closed_form {
            self.world_from_body * before_from_after
        } else {
            // A run has many thousand steps, whose roundings would add up.
            (self.world_from_body * before_from_after.pose()).into()
        };
        let [x_m, y_m] = step.creep_m;
        self.world_from_body = world_from_body.moved_by(x_m, y_m);
    }

    /// What an instrument measures at `t_s`, now: when and where.
    #[inline]
    pub(crate) fn reading(&self, effects: &mut ActiveEffects, t_s: f64) -> (f64, Frame) {
        if !effects.act_on_instruments() {
            return (t_s, self.world_from_body);
        }
        let mut reading = PoseReading { t_s, world_from_body: self.world_from_body.pose() };
        effects.instrument(&mut reading);
        (reading.t_s, reading.world_from_body.into())
    }
}
