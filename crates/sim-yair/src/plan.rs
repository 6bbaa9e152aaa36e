//! Programs made ready to drive: what a motion tells the wheels is the same at every trial, so a campaign works it out once.

use motion_programs::MotionProgram;

use crate::foreseen::PrecomputedRun;
use crate::planned_motion::PlannedMotion;

/// A program made ready for the robot that [`crate::SimulatedRobot::plan`] was asked of.
#[derive(Debug, Clone)]
pub struct Plan {
    pub(crate) program: MotionProgram,
    pub(crate) motions: Vec<PlannedMotion>,
    /// The motions once more, where the closed form foresees all of the run.
    pub(crate) precomputed_run: Option<PrecomputedRun>,
}

impl Plan {
    /// The program.
    #[must_use]
    pub const fn program(&self) -> &MotionProgram {
        &self.program
    }
}
