//! Why a case or a campaign of the blind benchmark cannot be run.

use scenario::ScenarioError;
use sim_yair::SimulationError;

/// Why the blind benchmark gives no result.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ChallengeError {
    /// A case's scenario is none.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// A case cannot be simulated.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// A baseline cannot be read, or is none.
    #[error("{path}: {why}")]
    Baseline {
        /// The file.
        path: String,
        /// Why.
        why: String,
    },
    /// The threads cannot be started.
    #[error("cannot start {jobs} threads: {why}")]
    Threads {
        /// How many were asked for.
        jobs: usize,
        /// The system's reason.
        why: String,
    },
}
