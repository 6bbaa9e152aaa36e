//! The simulation model: the stages of one simulated step and the hooks with which an effect changes them.
//!
//! A step is a stretch of constant wheel rates: a fraction of a millisecond in the stepping engine, a whole
//! motion in the closed form. Every stage has filled its own fields and all earlier ones when its hook is
//! called; a hook changes the fields of its stage only. A hook that is exact only for short steps says so in
//! [`Forward::needs_stepping`], and the closed form then refuses the scenario.

use dataset::RunInfo;
use kinematics::{Pose, Wheels};

use crate::stream::Stream;

/// One step on its way through the stages: a stage reads what those before it left and writes its own fields.
/// The frame is the robot's, x ahead and y to the left, but for `world_from_body` and `creep_m`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Start of the step, seconds from the run's start.
    pub t_s: f64,
    /// Length of the step, seconds.
    pub dt_s: f64,
    /// Where the robot is at the start of the step.
    pub world_from_body: Pose,
    /// Nominal wheel radius, metres: turns wheel rates into contact speeds.
    pub nominal_radius_m: Wheels<f64>,
    /// *Motor.* Turn of each encoder's axis during the step, referred to the wheel, radians.
    pub shaft_rad: Wheels<f64>,
    /// *Motor.* Rate of that turn, rad/s.
    pub rate_rad_s: Wheels<f64>,
    /// *Motor.* Change of the rate during the step over its length, rad/s²; 0 in the closed form.
    pub acceleration_rad_s2: Wheels<f64>,
    /// *Wheel.* Angle of each wheel at the start of the step, radians: its phase.
    pub wheel_angle_rad: Wheels<f64>,
    /// *Wheel.* Turn of each wheel during the step, radians.
    pub wheel_rad: Wheels<f64>,
    /// *Wheel.* Rolling radius of each wheel, metres.
    pub radius_m: Wheels<f64>,
    /// *Floor.* Travel of each wheel's contact over the ground, metres; comes in as radius × turn.
    pub travel_m: Wheels<f64>,
    /// *Floor.* Effective distance between the contacts, metres.
    pub wheel_separation_m: f64,
    /// *Floor.* Sideways motion to the left, metres.
    pub lateral_m: f64,
    /// *Floor.* Turn that the wheels did not make, radians.
    pub extra_turn_rad: f64,
    /// *Floor.* Motion in the room that the robot did not make, metres along x and y.
    pub creep_m: [f64; 2],
    /// *Encoder.* Turn that each counter sees, radians at the wheel; comes in as the shaft's turn.
    pub encoder_rad: Wheels<f64>,
}

impl Step {
    /// Speed of each wheel's contact by its nominal radius, m/s.
    #[must_use]
    pub fn contact_speed_m_s(&self) -> Wheels<f64> {
        self.rate_rad_s.zip_with(self.nominal_radius_m, |rate, radius_m| rate * radius_m)
    }

    /// Acceleration of each wheel's contact by its nominal radius, m/s².
    #[must_use]
    pub fn contact_acceleration_m_s2(&self) -> Wheels<f64> {
        self.acceleration_rad_s2.zip_with(self.nominal_radius_m, |rate, radius_m| rate * radius_m)
    }
}

/// What the robot tells its wheels at the start of a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Command {
    /// Turn of each wheel by its own counter, counts.
    pub travel_counts: Wheels<f64>,
    /// Speed of each wheel, counts/s, positive.
    pub speed_counts_s: Wheels<f64>,
}

/// A row of the log as the robot's clock makes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampleClock {
    /// The time written into the row, seconds.
    pub stamp_s: f64,
    /// When each counter is read, seconds; not before the previous row's reading.
    pub read_s: Wheels<f64>,
}

/// Both counters' values as they go into a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Readout {
    /// Cumulative counts.
    pub ticks: Wheels<i64>,
    /// Nominal travel for one of the controller's counts, metres.
    pub m_per_count: Wheels<f64>,
    /// Is the row written at all?
    pub written: bool,
}

/// A run's place in its session.
#[derive(Debug)]
pub struct RunStart<'r> {
    /// Which run of the session it is, from 0.
    pub number: u32,
    /// When it starts on the session's clock, seconds.
    pub session_s: f64,
    /// How far the drive's centre went in the runs before, metres.
    pub session_m: f64,
    /// What the record will say of the run: covariates go here.
    pub info: &'r mut RunInfo,
}

/// What the outside instrument sees of the robot at an instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseReading {
    /// The instant, seconds from the run's start.
    pub t_s: f64,
    /// The robot's pose in the room as the instrument takes it.
    pub world_from_body: Pose,
}

/// What an effect does to the runs of trials that are driven side by side, where that can be said once for
/// all motions.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum LaneForm {
    /// The wheel separation of every motion is larger by a normal draw of this standard deviation, metres;
    /// the first draw of a run is not used.
    SeparationPerMotion {
        /// One standard deviation, metres.
        sigma_m: f64,
    },
    /// Counters are read in whole ticks of so many counts.
    Ticks {
        /// Counts in a tick, at least 1.
        counts: u32,
    },
}

/// Which hooks of an effect do anything. The simulator calls no others, so that an effect costs nothing at
/// the stages that it leaves alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Hooks {
    /// [`Forward::on_run_start`].
    pub on_run_start: bool,
    /// [`Forward::seed_run`].
    pub seed_run: bool,
    /// [`Forward::start_motion`].
    pub start_motion: bool,
    /// [`Forward::command`].
    pub command: bool,
    /// [`Forward::motor`].
    pub motor: bool,
    /// [`Forward::wheel`].
    pub wheel: bool,
    /// [`Forward::floor`].
    pub floor: bool,
    /// [`Forward::encoder`].
    pub encoder: bool,
    /// [`Forward::readout`].
    pub readout: bool,
    /// [`Forward::clock`].
    pub clock: bool,
    /// [`Forward::instrument`].
    pub instrument: bool,
}

impl Hooks {
    /// Every hook.
    pub const ALL: Self = Self::each(true);

    /// No hook.
    pub const NONE: Self = Self::each(false);

    const fn each(acts: bool) -> Self {
        Self {
            on_run_start: acts,
            seed_run: acts,
            start_motion: acts,
            command: acts,
            motor: acts,
            wheel: acts,
            floor: acts,
            encoder: acts,
            readout: acts,
            clock: acts,
            instrument: acts,
        }
    }
}

/// An effect at work during one run: the simulation model. Hooks are called stage by stage, in the order
/// command, motor, wheel, floor, encoder, clock, instrument; an effect implements those at which it acts.
pub trait Forward: Send {
    /// Which of the hooks below do anything: all, unless the effect says otherwise.
    fn hooks(&self) -> Hooks {
        Hooks::ALL
    }

    /// A run begins, at its place in the session; before [`Self::seed_run`].
    fn on_run_start(&mut self, run: &mut RunStart<'_>) {
        let _ = run;
    }

    /// Draws what is drawn once a run and keeps the stream for what is drawn later.
    fn seed_run(&mut self, stream: Stream) {
        let _ = stream;
    }

    /// A motion begins: the wheels stand still.
    fn start_motion(&mut self) {}

    /// *Command*: what the wheels are told.
    fn command(&mut self, command: &mut Command) {
        let _ = command;
    }

    /// *Motor*: how the shafts turn.
    fn motor(&mut self, step: &mut Step) {
        let _ = step;
    }

    /// *Wheel*: between the encoder's axis and the tread.
    fn wheel(&mut self, step: &mut Step) {
        let _ = step;
    }

    /// *Floor*: between the tread and the room.
    fn floor(&mut self, step: &mut Step) {
        let _ = step;
    }

    /// *Encoder*: between the encoder's axis and the counter.
    fn encoder(&mut self, step: &mut Step) {
        let _ = step;
    }

    /// *Encoder*: between the counter and the log.
    fn readout(&mut self, readout: &mut Readout) {
        let _ = readout;
    }

    /// *Clock*: when counters are read and what time the row bears.
    fn clock(&mut self, sample: &mut SampleClock) {
        let _ = sample;
    }

    /// *Instrument*: what the outside sees.
    fn instrument(&mut self, reading: &mut PoseReading) {
        let _ = reading;
    }

    /// What the effect does in all its hooks, where trials are driven side by side; `None` when it must be
    /// asked trial by trial.
    fn lane_form(&self) -> Option<LaneForm> {
        None
    }

    /// Why the effect cannot be taken over a whole motion at once, or `None` when that is exact.
    fn needs_stepping(&self) -> Option<&'static str> {
        None
    }

    /// Does the effect depend on how fast the wheels turn? The closed form then takes each motion's ramps
    /// apart instead of moving at one speed.
    fn depends_on_speed(&self) -> bool {
        false
    }

    /// How many counts make one recorded tick, when the effect coarsens the record: the dataset then states
    /// that resolution.
    fn counts_per_tick(&self) -> Option<u32> {
        None
    }
}
