//! The simulated robot: a scenario made ready to drive, on one trial of its randomness.

use dataset::{MarkedPoint, MotionProgram, NominalRobot, Platform, Run, RunInfo, TruthNoise, WheelLog};
use effects::{Address, EffectError, Forward, StreamName};
use kinematics::{DriveGeometry, GeometryError, Pose, WheelNoise, Wheels};
use scenario::{Engine, Instrument, Scenario};

use crate::actuator::{Actuator, ConstantSpeed, ServoPair};
use crate::drive::{ActiveEffect, Drive, DriveSetup};
use crate::instrument::Observer;
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

const PLACEMENT: StreamName = StreamName::new("placement");
const WHEEL_PHASE: StreamName = StreamName::new("wheel phase");

/// YAIR, or another differential drive, as a scenario describes it, on one trial of its randomness.
///
/// It implements [`Platform`]: calibrators drive it and see what it measures, and nothing else. Its hidden truth is asked for by other methods.
pub struct SimulatedRobot {
    robot: scenario::Robot,
    nominal: NominalRobot,
    points: Vec<MarkedPoint>,
    geometry: DriveGeometry,
    nominal_geometry: DriveGeometry,
    engine: Engine,
    noise: WheelNoise,
    sensitivity_sigma: f64,
    placement: scenario::Placement,
    log_interval_s: Option<f64>,
    instruments: Vec<Instrument>,
    effects: Vec<ActiveEffect>,
    /// Where the next run's draws are.
    address: Address,
    observers: Vec<Observer>,
    last_ends: (Pose, Pose),
}

impl SimulatedRobot {
    /// Prepares a scenario for driving.
    ///
    /// # Errors
    /// [`SimulationError`] when the closed form is asked for and not exact, or the controllers cannot reach the commanded speed.
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
        let mut effects: Vec<ActiveEffect> = Vec::new();
        let mut ids: Vec<&str> = Vec::new();
        for (id, effect) in listed.chain(more) {
            if scenario.engine == Engine::ClosedForm
                && let Some(why) = effect.needs_stepping()
            {
                return Err(SimulationError::NeedsStepping { id, why });
            }
            // Named by id and by how often the id has come before: adding an effect disturbs no other's draws.
            let before = ids.iter().filter(|other| **other == id).count();
            effects.push((StreamName::new(id).nth(before as u64), effect));
            ids.push(id);
        }
        let mut nominal = scenario.robot.nominal();
        let counts_per_tick: u32 = effects.iter().filter_map(|(_, effect)| effect.counts_per_tick()).product();
        nominal.ticks_per_rev = nominal.ticks_per_rev.map(|counts| counts / f64::from(counts_per_tick));
        let robot = Self {
            robot: scenario.robot.clone(),
            nominal,
            points: scenario.robot.marked_points(),
            geometry: scenario.true_geometry()?,
            nominal_geometry: scenario.nominal_geometry()?,
            engine: scenario.engine,
            noise: WheelNoise { sigma_m_per_sqrt_m: Wheels::both(scenario.noise.wheel_sigma_m_per_sqrt_m) },
            sensitivity_sigma: scenario.noise.sensitivity_sigma,
            placement: scenario.placement,
            log_interval_s: scenario.log.map(|log| log.interval_s),
            instruments: scenario.instruments.clone(),
            effects,
            address: Address { seed, point: 0, trial, run: 0 },
            observers: Vec::new(),
            last_ends: (Pose::IDENTITY, Pose::IDENTITY),
        };
        // The controllers check themselves once, before anything is driven.
        ServoPair::new(&robot.robot, Wheels::both(0.5), 1e-3)?;
        Ok(robot)
    }

    /// The same robot at another point of a sweep's design: other draws, for points that are compared to be independent.
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

    fn start_counts(&self, address: &Address) -> Wheels<f64> {
        let counts_per_turn = self.robot.encoder.counts_per_wheel_turn();
        let mut stream = address.stream(WHEEL_PHASE);
        Wheels::from_sides(|_| counts_per_turn * stream.uniform())
    }

    fn place(&self, address: &Address) -> Pose {
        let mut stream = address.stream(PLACEMENT);
        Pose::new(
            stream.uniform_about_zero(self.placement.half_width_m),
            stream.uniform_about_zero(self.placement.half_width_m),
            stream.uniform_about_zero(self.placement.half_width_rad),
        )
    }
}

impl Platform for SimulatedRobot {
    type Error = SimulationError;

    fn robot(&self) -> NominalRobot {
        self.nominal
    }

    fn points(&self) -> &[MarkedPoint] {
        &self.points
    }

    fn truth_noise(&self) -> TruthNoise {
        let mut noise = TruthNoise::default();
        for instrument in &self.instruments {
            let (xy_m, theta_rad) = match *instrument {
                Instrument::FloorGrid { resolution_m, reading_sigma_m } => {
                    (reading_sigma_m.hypot(resolution_m / 12_f64.sqrt()), 0.0)
                }
                Instrument::MotionCapture { sigma_xy_m, sigma_theta_rad, .. } => (sigma_xy_m, sigma_theta_rad),
            };
            let known = |sigma: f64| (sigma > 0.0).then_some(sigma);
            noise.sigma_xy_m = noise.sigma_xy_m.or(known(xy_m));
            noise.sigma_theta_rad = noise.sigma_theta_rad.or(known(theta_rad));
        }
        noise
    }

    fn drive_into(&mut self, program: &MotionProgram, run: &mut Run) -> Result<(), SimulationError> {
        let address = self.address;
        self.address.run += 1;
        for (name, effect) in &mut self.effects {
            effect.start_run(address.stream(*name));
        }
        let start_counts = self.start_counts(&address);
        let actuator = match self.engine {
            Engine::ClosedForm => {
                let ramps = self.effects.iter().any(|(_, effect)| effect.depends_on_speed());
                Actuator::ClosedForm(ConstantSpeed::new(&self.robot, start_counts, ramps))
            }
            Engine::Stepping { step_s } => {
                Actuator::Stepping(Box::new(ServoPair::new(&self.robot, start_counts, step_s)?))
            }
        };
        self.observers.clear();
        for (position, instrument) in (0..).zip(&self.instruments) {
            self.observers.push(Observer::new(*instrument, position, &address));
        }
        empty(run, program);

        let start = self.place(&address);
        let mut drive = Drive::start(
            DriveSetup {
                actuator,
                robot: &self.robot,
                nominal_geometry: self.nominal_geometry,
                true_geometry: self.geometry,
                noise: self.noise,
                sensitivity_sigma: self.sensitivity_sigma,
                closed_form: self.engine == Engine::ClosedForm,
                log_interval_s: self.log_interval_s,
                points: &self.points,
            },
            &address,
            (start, start_counts),
            &mut self.effects,
            &mut self.observers,
            run,
        );
        drive.stand();
        for motion in &program.motions {
            drive.perform(motion)?;
        }
        drive.stand();
        self.last_ends = (start, drive.world_from_body());
        Ok(())
    }
}

/// Makes `run` an empty run of `program`, keeping its buffers.
fn empty(run: &mut Run, program: &MotionProgram) {
    if run.info.id != program.id {
        run.info = RunInfo { id: program.id.clone(), ..RunInfo::default() };
    }
    run.info.protocol = Some(program.protocol);
    run.info.settings = program.settings;
    run.odometry.t_s.clear();
    run.odometry.extra.clear();
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
}
