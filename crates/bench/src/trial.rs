//! One Monte-Carlo trial: the protocols driven once, into buffers that the next trial uses again.

use dataset::{Dataset, Run, Session};
use motion_programs::{MotionProgram, Platform};
use scenario::Scenario;
use sim_yair::{PreparedProgram, SimulatedRobot, SimulationError};

/// A simulated robot with its protocols and the dataset that they fill.
pub struct Trial {
    robot: SimulatedRobot,
    prepared: Vec<PreparedProgram>,
    dataset: Dataset,
}

impl Trial {
    /// Prepares a scenario.
    ///
    /// # Errors
    /// [`SimulationError`] when the scenario cannot be simulated.
    pub fn new(scenario: &Scenario, seed: u64) -> Result<Self, SimulationError> {
        Self::with_programs(scenario, seed, scenario.programs())
    }

    /// Prepares a scenario's robot for programs of the caller's instead of the scenario's own.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_programs(
        scenario: &Scenario,
        seed: u64,
        programs: Vec<MotionProgram>,
    ) -> Result<Self, SimulationError> {
        let robot = SimulatedRobot::new(scenario, seed, 0)?;
        let dataset = Dataset {
            provenance: dataset::Provenance::default(),
            robot: robot.robot(),
            truth_noise: robot.truth_noise(),
            points: robot.points().to_vec(),
            runs: vec![Run::default(); programs.len()],
        };
        let prepared = programs.into_iter().map(|program| robot.prepare(program)).collect();
        Ok(Self { robot, prepared, dataset })
    }

    /// The same trial at another point of a sweep's design: other draws.
    #[must_use]
    pub fn at_point(mut self, point: u32) -> Self {
        self.robot = self.robot.at_point(point);
        self
    }

    /// Drives trial number `trial` and shows what was measured.
    ///
    /// # Errors
    /// [`SimulationError`] when a motion cannot be driven.
    pub fn drive(&mut self, trial: u64) -> Result<Session<'_>, SimulationError> {
        self.robot.restart(trial);
        for (program, run) in self.prepared.iter().zip(&mut self.dataset.runs) {
            self.robot.drive_prepared_into(program, run)?;
        }
        Ok(self.dataset.session())
    }

    /// The drive that a perfect calibration would find.
    #[must_use]
    pub const fn true_geometry(&self) -> kinematics::DriveGeometry {
        self.robot.true_geometry()
    }

    /// Ticks of a wheel turn in what is measured.
    #[must_use]
    pub const fn ticks_per_rev(&self) -> Option<f64> {
        self.dataset.robot.ticks_per_rev
    }
}
