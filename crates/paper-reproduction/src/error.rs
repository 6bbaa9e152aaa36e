//! Why the paper's experiments cannot be repeated.

use report::ReportError;
use scenario::ScenarioError;
use sim_yair::SimulationError;

use crate::cause::CauseError;

/// Why the reproduction gives no result.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PaperError {
    /// The shipped scenario is none.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// A cause of the paper's contradictions cannot be fitted.
    #[error(transparent)]
    Cause(#[from] CauseError),
    /// An experiment cannot be simulated.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// Fewer trials than a spread needs.
    #[error("{trials} trials show no spread; ask for at least 2")]
    TooFewTrials {
        /// How many were asked for.
        trials: u64,
    },
    /// The figures cannot be drawn.
    #[error("cannot draw the paper's figures: {0}")]
    Picture(#[from] ReportError),
}
