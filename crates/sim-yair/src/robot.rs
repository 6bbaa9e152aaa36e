//! The simulated robot: a scenario made ready to drive, on one trial of its randomness.

use dataset::{
    GyroNoise, LidarExtrinsics, MapDistortion, MarkedPoint, NominalRobot, Run, RunInfo, TruthNoise, WheelLog,
};
use effects::{Address, EffectError, Forward, RunStart, Stream, StreamName};
use kinematics::{DriveGeometry, GeometryError, Pose, WheelNoise, Wheels};
use motion_programs::{MotionProgram, Platform};
use scenario::{Engine, Instrument, Scenario};

use crate::active::ActiveEffects;
use crate::actuator::{Actuator, ConstantSpeed, Profile, ServoPair};
use crate::body::{DriveSetup, DriveStreams, PLACEMENT, Start, WHEEL_NOISE, WHEEL_PHASE};
use crate::drive::Drive;
use crate::instrument::Observer;
use crate::lanes::LaneDrive;
use crate::planned_motion::PlannedMotion;
use crate::precomputed_run::PrecomputedRun;
use crate::prepared_program::PreparedProgram;
use crate::servo::ServoError;

/// Why a scenario cannot be simulated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SimulationError {
    /// The closed form is not exact for an effect.
    #[error("effect {id} needs engine.kind = \"stepping\": {why}")]
    NeedsStepping {
        /// The effect.
        id: &'static str,
        /// Why.
        why: &'static str,
    },
    /// The geometry is not physical.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// An effect's size is not physical.
    #[error(transparent)]
    Effect(#[from] EffectError),
    /// The controllers cannot do what is asked of them.
    #[error(transparent)]
    Servo(#[from] ServoError),
}

const SENSITIVITY: StreamName = StreamName::new("sensitivity");

/// YAIR, or another differential drive, as a scenario describes it, on one trial of its randomness.
///
/// It implements [`Platform`]: calibrators drive it and see what it measures, and nothing else. Its hidden
/// truth is asked for by other methods.
pub struct SimulatedRobot {
    robot: scenario::Robot,
    nominal: NominalRobot,
    geometry: DriveGeometry,
    nominal_geometry: DriveGeometry,
    engine: Engine,
    placement: scenario::Placement,
    setup: DriveSetup,
    effects: ActiveEffects,
    /// Where the next run's draws are.
    address: Address,
    streams: DriveStreams,
    observers: Vec<Observer>,
    last_ends: (Pose, Pose),
    session: Session,
}

/// What has passed since the first run of a trial.
#[derive(Debug, Clone, Copy, Default)]
struct Session {
    t_s: f64,
    distance_m: f64,
}

impl SimulatedRobot {
    /// Prepares a scenario for driving.
    ///
    /// # Errors
    /// [`SimulationError`] when the closed form is asked for and not exact, or the controllers cannot reach
    /// the commanded speed.
    pub fn new(scenario: &Scenario, seed: u64, trial: u64) -> Result<Self, SimulationError> {
        Self::with_more_effects(scenario, seed, trial, Vec::new())
    }

    /// As [`Self::new`], with further effects that need not be in the catalogue, acting after the scenario's.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_more_effects(
        scenario: &Scenario,
        seed: u64,
        trial: u64,
        more: Vec<(&'static str, Box<dyn Forward>)>,
    ) -> Result<Self, SimulationError> {
        let mut listed = scenario.effects.clone();
        listed.iter().try_for_each(|effect| effect.physical().check())?;
        effects::sort_by_stage(&mut listed);
        let listed = listed.iter().filter_map(|effect| Some((effect.id(), effect.physical().forward()?)));
        let mut effects: Vec<(StreamName, Box<dyn Forward>)> = Vec::new();
        let mut ids: Vec<&str> = Vec::new();
        for (id, effect) in listed.chain(more) {
            if scenario.engine == Engine::ClosedForm
                && let Some(why) = effect.needs_stepping()
            {
                return Err(SimulationError::NeedsStepping { id, why });
            }
            // Named by id and by how often the id has come before: adding an effect disturbs no other's
            // draws.
            let before = ids.iter().filter(|other| **other == id).count();
            effects.push((StreamName::new(id).nth(before as u64), effect));
            ids.push(id);
        }
        let mut nominal = scenario.robot.nominal();
        let counts_per_tick: u32 = effects.iter().filter_map(|(_, effect)| effect.counts_per_tick()).product();
        nominal.ticks_per_rev = nominal.ticks_per_rev.map(|counts| counts / f64::from(counts_per_tick));
        let effects = ActiveEffects::new(effects);
        let address = Address { seed, point: 0, trial, run: 0 };
        let counts_per_rad = scenario.robot.encoder.counts_per_wheel_turn() / std::f64::consts::TAU;
        let (geometry, nominal_geometry) = (scenario.true_geometry()?, scenario.nominal_geometry()?);
        let robot = Self {
            nominal,
            geometry,
            nominal_geometry,
            engine: scenario.engine,
            placement: scenario.placement,
            setup: DriveSetup {
                counts_per_rad,
                m_per_count: nominal_geometry.m_per_rad().map(|m_per_rad| m_per_rad / counts_per_rad),
                nominal_radius_m: nominal_geometry.m_per_rad(),
                true_radius_m: geometry.m_per_rad(),
                wheel_separation_m: geometry.wheel_separation_m(),
                noise: WheelNoise { sigma_m_per_sqrt_m: Wheels::both(scenario.noise.wheel_sigma_m_per_sqrt_m) },
                sensitivity_sigma: scenario.noise.sensitivity_sigma,
                closed_form: scenario.engine == Engine::ClosedForm,
                profile: Profile::new(&scenario.robot, effects.depend_on_speed()),
                log_interval_s: scenario.log.map(|log| log.interval_s),
                points: scenario.robot.marked_points(),
            },
            robot: scenario.robot.clone(),
            effects,
            address,
            streams: DriveStreams {
                wheel_noise: address.stream(WHEEL_NOISE),
                sensitivity: address.stream(SENSITIVITY),
            },
            observers: (0..)
                .zip(&scenario.instruments)
                .map(|(position, &instrument)| Observer::new(instrument, position, &address))
                .collect(),
            last_ends: (Pose::IDENTITY, Pose::IDENTITY),
            session: Session::default(),
        };
        // The controllers check themselves once, before anything is driven.
        ServoPair::new(&robot.robot, Wheels::both(0.5), 1e-3)?;
        Ok(robot)
    }

    /// The same robot at another point of a sweep's design: other draws, for points that are compared to be
    /// independent.
    #[must_use]
    pub fn at_point(mut self, point: u32) -> Self {
        self.address.point = point;
        self
    }

    /// Goes to the first run of another trial.
    pub fn restart(&mut self, trial: u64) {
        self.address = Address { trial, run: 0, ..self.address };
    }

    /// The drive about which everything scatters.
    #[must_use]
    pub const fn true_geometry(&self) -> DriveGeometry {
        self.geometry
    }

    /// Where the last run began and ended, world from body.
    #[must_use]
    pub const fn last_true_ends(&self) -> (Pose, Pose) {
        self.last_ends
    }

    /// Makes a program ready: what its motions tell this robot's wheels is worked out once, and
    /// [`Self::drive_prepared_into`] does not do it again.
    #[must_use]
    pub fn prepare(&self, program: MotionProgram) -> PreparedProgram {
        let planned_segments = self.setup.closed_form && self.effects.leave_commands_and_counters_alone();
        let segments =
            |command: &_| planned_segments.then(|| self.setup.profile.segments(command, |_| Wheels::both(1.0)));
        let planned = |motion| PlannedMotion::new(motion, &self.robot, &self.nominal_geometry, segments);
        let motions: Vec<_> = program.motions.iter().map(planned).collect();
        let undisturbed = self.setup.log_interval_s.is_none()
            && !self.observers.iter().any(|of| of.free_running() || of.follows_run());
        let precomputed_run = if planned_segments && undisturbed && self.effects.leave_clocks_alone() {
            PrecomputedRun::new(&motions)
        } else {
            None
        };
        PreparedProgram { program, motions, precomputed_run }
    }

    /// The trials of these programs side by side, from any trial's first run on; `None` where trials must be
    /// driven one by one.
    #[must_use]
    pub fn lane_drive(&self, programs: &[PreparedProgram]) -> Option<LaneDrive> {
        if self.setup.sensitivity_sigma > 0.0 {
            return None;
        }
        let grids = self.observers.iter().map(|observer| Some((observer.name(), observer.floor_grid()?)));
        let mut session_s = 0.0;
        let runs = programs.iter().map(|PreparedProgram { program, precomputed_run, .. }| {
            let run = precomputed_run.clone()?;
            let info = RunInfo {
                id: program.id.clone(),
                protocol: Some(program.protocol),
                settings: program.settings,
                start_s: Some(session_s),
                ..RunInfo::default()
            };
            session_s += run.rows_s.last().copied().unwrap_or_default();
            Some((info, run))
        });
        Some(LaneDrive {
            setup: self.setup.clone(),
            placement: self.placement,
            counts_per_turn: self.robot.encoder.counts_per_wheel_turn(),
            effects: self.effects.lane_forms()?,
            grids: grids.collect::<Option<_>>()?,
            runs: runs.collect::<Option<_>>()?,
            address: Address { run: 0, ..self.address },
        })
    }

    /// Drives a program as [`Platform::drive_into`] does.
    ///
    /// # Errors
    /// [`SimulationError`] when the controllers cannot do what is asked of them.
    pub fn drive_prepared_into(&mut self, plan: &PreparedProgram, run: &mut Run) -> Result<(), SimulationError> {
        // The streams first, all at once: none waits for another's draws.
        let streams = self.address.streams();
        let number = self.address.run;
        self.address.run += 1;
        if number == 0 {
            self.session = Session::default();
        }
        empty(run, &plan.program);
        let Session { t_s: session_s, distance_m: session_m } = self.session;
        run.info.start_s = Some(session_s);
        self.effects.on_run_start(&mut RunStart { number, session_s, session_m, info: &mut run.info });
        self.effects.seed_run(|name| streams.stream(name));
        for observer in &mut self.observers {
            observer.restart(|name| streams.stream(name), number == 0);
        }
        self.streams.wheel_noise = streams.stream(WHEEL_NOISE);
        if self.setup.sensitivity_sigma > 0.0 {
            self.streams.sensitivity = streams.stream(SENSITIVITY);
        }
        let start = self.start(streams.stream(PLACEMENT), streams.stream(WHEEL_PHASE));
        if let Some(precomputed_run) = &plan.precomputed_run {
            let (effects, observers) = (&mut self.effects, &mut self.observers[..]);
            let body = precomputed_run.drive(&self.setup, &start, &mut self.streams, effects, observers, run);
            self.session.t_s += body.t_s;
            self.session.distance_m += body.distance_m;
            self.last_ends = (start.world_from_body, body.world_from_body.pose());
            return Ok(());
        }
        let actuator = match self.engine {
            Engine::ClosedForm => Actuator::ClosedForm(ConstantSpeed::new(self.setup.counts_per_rad, start.counts)),
            Engine::Stepping { step_s } => {
                Actuator::Stepping(Box::new(ServoPair::new(&self.robot, start.counts, step_s)?))
            }
        };
        let mut drive =
            Drive::start(&self.setup, actuator, start, &mut self.streams, &mut self.effects, &mut self.observers, run);
        drive.stand();
        for motion in &plan.motions {
            drive.perform(motion)?;
        }
        drive.stand();
        let (t_s, distance_m) = drive.so_far();
        self.session.t_s += t_s;
        self.session.distance_m += distance_m;
        self.last_ends = (start.world_from_body, drive.world_from_body());
        Ok(())
    }

    fn start(&self, mut placement: Stream, mut wheel_phase: Stream) -> Start {
        let counts_per_turn = self.robot.encoder.counts_per_wheel_turn();
        Start {
            world_from_body: Pose::new(
                placement.uniform_about_zero(self.placement.half_width_m),
                placement.uniform_about_zero(self.placement.half_width_m),
                placement.uniform_about_zero(self.placement.half_width_rad),
            ),
            counts: Wheels::from_sides(|_| counts_per_turn * wheel_phase.uniform()),
        }
    }
}

impl Platform for SimulatedRobot {
    type Error = SimulationError;

    fn robot(&self) -> NominalRobot {
        self.nominal
    }

    fn points(&self) -> &[MarkedPoint] {
        &self.setup.points
    }

    fn truth_noise(&self) -> TruthNoise {
        let mut noise = TruthNoise::default();
        for observer in &self.observers {
            let (xy_m, theta_rad) = match *observer.instrument() {
                Instrument::FloorGrid { resolution_m, reading_sigma_m } => {
                    (reading_sigma_m.hypot(resolution_m / 12_f64.sqrt()), 0.0)
                }
                Instrument::MotionCapture { sigma_xy_m, sigma_theta_rad, .. } => (sigma_xy_m, sigma_theta_rad),
                Instrument::Slam(slam) => {
                    // The precision of its poses is its own opinion, if anyone's: it is estimated.
                    let distorted = slam.map_sigma_xy_m > 0.0 || slam.map_sigma_theta_rad > 0.0;
                    noise.map = distorted.then_some(MapDistortion {
                        sigma_xy_m: slam.map_sigma_xy_m,
                        sigma_theta_rad: slam.map_sigma_theta_rad,
                        length_m: slam.map_length_m,
                    });
                    (0.0, 0.0)
                }
                Instrument::Gyro { noise_rad_per_sqrt_s, bias_walk_radps_per_sqrt_s, scale_sigma, .. } => {
                    let known = |sigma: f64| (sigma > 0.0).then_some(sigma);
                    noise.gyro = GyroNoise {
                        scale_sigma: known(scale_sigma),
                        noise_rad_per_sqrt_s: known(noise_rad_per_sqrt_s),
                        bias_walk_radps_per_sqrt_s: known(bias_walk_radps_per_sqrt_s),
                        is_instantaneous: false,
                    };
                    (0.0, 0.0)
                }
                Instrument::Wall(wall) => {
                    // Its place on the robot is not stated.
                    noise.lidar = wall.has_lever().then_some(LidarExtrinsics { yaw_rad: None });
                    (0.0, 0.0)
                }
                // They see no pose, or state their precision with each measurement.
                Instrument::Tachometer { .. } | Instrument::Tape { .. } | Instrument::Revisit { .. } => (0.0, 0.0),
            };
            let known = |sigma: f64| (sigma > 0.0).then_some(sigma);
            noise.sigma_xy_m = noise.sigma_xy_m.or(known(xy_m));
            noise.sigma_theta_rad = noise.sigma_theta_rad.or(known(theta_rad));
        }
        noise
    }

    fn drive_into(&mut self, program: &MotionProgram, run: &mut Run) -> Result<(), SimulationError> {
        self.drive_prepared_into(&self.prepare(program.clone()), run)
    }
}

/// Makes `run` an empty run of `program`, keeping its buffers.
fn empty(run: &mut Run, program: &MotionProgram) {
    if run.info.id != program.id {
        run.info = RunInfo { id: program.id.clone(), ..RunInfo::default() };
    }
    run.info.protocol = Some(program.protocol);
    run.info.settings = program.settings;
    run.info.covariates.clear();
    run.odometry.t_s.clear();
    if !run.odometry.extra.is_empty() {
        run.odometry.extra.clear();
    }
    match &mut run.odometry.wheels {
        WheelLog::Ticks(ticks) => {
            ticks.left.clear();
            ticks.right.clear();
        }
        other => *other = WheelLog::Ticks(Wheels::default()),
    }
    run.truth.clear();
    run.truth_sigma = None;
    run.displacements.clear();
    run.point_readings.clear();
    run.wheel_reference.clear();
    run.revisits.clear();
    run.distances.clear();
    run.walls.clear();
}
