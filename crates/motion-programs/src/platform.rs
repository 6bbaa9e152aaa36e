//! Whatever can drive a motion program and be measured.

use crate::program::MotionProgram;
use dataset::{Dataset, MarkedPoint, NominalRobot, Provenance, Run, TruthNoise};

/// A robot with its instruments: the simulator implements it, a real robot could.
pub trait Platform {
    /// Why a program was not driven.
    type Error: std::error::Error;

    /// What the robot believes of itself.
    fn robot(&self) -> NominalRobot;

    /// The marked points that its runs may speak of.
    fn points(&self) -> &[MarkedPoint];

    /// Precision of the outside instrument, where it is known.
    fn truth_noise(&self) -> TruthNoise;

    /// Drives a program and writes what was measured into `run`, whose buffers are reused and whose old
    /// content is lost.
    ///
    /// # Errors
    /// The platform's own reasons; `run` is then not to be used.
    fn drive_into(&mut self, program: &MotionProgram, run: &mut Run) -> Result<(), Self::Error>;
}

/// Drives programs in order and returns what was measured as a dataset.
///
/// # Errors
/// The platform's first refusal.
pub fn record_session<P: Platform + ?Sized>(platform: &mut P, programs: &[MotionProgram]) -> Result<Dataset, P::Error> {
    let mut runs = Vec::with_capacity(programs.len());
    for program in programs {
        let mut run = Run::default();
        platform.drive_into(program, &mut run)?;
        runs.push(run);
    }
    Ok(Dataset {
        provenance: Provenance::default(),
        robot: platform.robot(),
        truth_noise: platform.truth_noise(),
        points: platform.points().to_vec(),
        runs,
    })
}
