//! One Monte-Carlo trial, or several side by side: the protocols driven once, into buffers that the next
//! trials use again.

use dataset::{Dataset, Replicates, Run, Session};
use motion_programs::{MotionProgram, Platform};
use scenario::Scenario;
use sim_yair::{LaneDrive, PreparedProgram, SimulatedRobot, SimulationError};

/// A simulated robot with its protocols and the dataset that they fill.
pub struct Trial {
    robot: SimulatedRobot,
    prepared: Vec<PreparedProgram>,
    dataset: Dataset,
    /// Trials side by side, where they can be driven so.
    lanes: Option<(LaneDrive, Replicates)>,
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
        Ok(Self { robot, prepared, dataset, lanes: None }.with_lanes())
    }

    fn with_lanes(mut self) -> Self {
        let drive = self.robot.lane_drive(&self.prepared);
        self.lanes = drive.map(|drive| {
            let replicates = drive.replicates(&self.dataset);
            (drive, replicates)
        });
        self
    }

    /// The same trial at another point of a sweep's design: other draws.
    #[must_use]
    pub fn at_point(mut self, point: u32) -> Self {
        self.robot = self.robot.at_point(point);
        self.with_lanes()
    }

    /// Drives trial `first` and those that follow it, [`dataset::LANES`] in all, and shows what was measured:
    /// of each what [`Self::drive`] shows, to the bit. `None` where trials must be driven one by one.
    pub fn drive_side_by_side(&mut self, first: u64) -> Option<&Replicates> {
        let (drive, replicates) = self.lanes.as_mut()?;
        drive.drive_into(first, replicates);
        Some(replicates)
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

#[cfg(test)]
mod tests {
    use dataset::LANES;
    use motion_programs::Schedule;

    use super::*;

    fn paper(protocols: &[Schedule]) -> Scenario {
        let mut paper = Scenario::parse(scenario::PAPER, "paper.toml").expect("the shipped scenario");
        paper.protocols = protocols.to_vec();
        paper
    }

    /// Every method on 48 trials, with the errors of those that do not apply.
    fn check(scenario: &Scenario, what: &str) {
        let [mut alone, mut side_by_side] = [(); 2].map(|()| Trial::new(scenario, 4).expect("simulates").at_point(1));
        for first in (0..3 * LANES as u64).step_by(LANES) {
            let replicates = side_by_side.drive_side_by_side(first).expect("goes in lanes");
            for method in ["direct", "umbmark", "linear"].map(|name| calib::method(name).expect("there")) {
                let found = method.calibrate_replicates(replicates, LANES);
                assert_eq!(found.len(), LANES);
                assert_eq!(method.calibrate_replicates(replicates, 3), found[..3]);
                for (trial, found) in (first..).zip(found) {
                    let session = [alone.drive(trial).expect("drives")];
                    assert_eq!(found, method.calibrate(&session), "{what}: {} of trial {trial}", method.name());
                }
            }
        }
    }

    /// Rejects, as was tried: a sum over all values instead of those retained, outliers of the other wheel,
    /// slopes that are not averaged over the retained spins, the end's pose seen from the room.
    #[test]
    fn calibrations_side_by_side_are_those_of_each_trial() {
        let (straights, squares) =
            (Schedule::Straights { length_m: 0.5, runs: 11 }, Schedule::Squares { side_m: 4.0, runs_each_way: 3 });
        let spins = |turn_rad| Schedule::Spins { turn_rad, runs: 8 };
        check(&paper(&[straights, spins(std::f64::consts::TAU), squares]), "the paper's protocol");
        // Outliers, and turns beyond the reach of the short arctangent.
        let mut wild = paper(&[straights, spins(1.3), squares]);
        for effect in &mut wild.effects {
            if let effects::Effect::ContactPatchWheelbase(effect) = effect {
                effect.sigma_m = 0.05;
            }
        }
        wild.noise.wheel_sigma_m_per_sqrt_m = 0.03;
        check(&wild, "noisy wheels");
        // Straights of no pulse: some trials have no value.
        check(&paper(&[Schedule::Straights { length_m: 0.0007, runs: 5 }, spins(6.0)]), "no pulses");
        check(&paper(&[straights]), "straights alone");
        check(&paper(&[squares, spins(0.02)]), "spins of next to nothing");
    }
}
