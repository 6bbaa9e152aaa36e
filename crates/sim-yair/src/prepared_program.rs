//! Programs made ready to drive: what a motion tells the wheels is the same at every trial, so a campaign
//! works it out once.

use motion_programs::MotionProgram;

use crate::planned_motion::PlannedMotion;
use crate::precomputed_run::PrecomputedRun;

/// A program made ready for the robot that [`crate::SimulatedRobot::prepare`] was asked of.
#[derive(Debug, Clone)]
pub struct PreparedProgram {
    pub(crate) program: MotionProgram,
    pub(crate) motions: Vec<PlannedMotion>,
    /// The motions once more, where the closed form knows all of the run beforehand.
    pub(crate) precomputed_run: Option<PrecomputedRun>,
}

impl PreparedProgram {
    /// The program.
    #[must_use]
    pub const fn program(&self) -> &MotionProgram {
        &self.program
    }
}
