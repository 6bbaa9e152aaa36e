//! The paper reproduced: its tables from simulation, beside the published values.
//!
//! This is the first case of measured data against a simulation. The data are the paper's own printed
//! numbers; its raw data are not available, and what the printed numbers cannot tell is said.

pub mod audit;
pub mod cause;
mod error;
pub mod extension;
pub mod figures;
mod page;
mod pictures;
pub mod published;
pub mod shape;
pub mod table_1;
pub mod table_2;
mod units;

use scenario::{PAPER, Scenario, ScenarioError};
use serde::Serialize;

pub use error::PaperError;

use audit::Finding;
use cause::Causes;
use figures::{Figure4, Figure7};
use table_1::{Hypothesis, Table1};
use table_2::Table2;

/// The paper's robot and protocols.
///
/// # Errors
/// Never for the shipped text; a test parses it.
pub fn scenario() -> Result<Scenario, ScenarioError> {
    Scenario::parse(PAPER, "scenarios/paper.toml")
}

/// Everything that `yair reproduce` finds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Reproduction {
    /// Seed of every draw.
    pub seed: u64,
    /// How often each experiment was repeated.
    pub trials: u64,
    /// Table 1 under each hypothesis about its scatter.
    pub table_1: Vec<Table1>,
    /// Table 2 under the measuring hypothesis.
    pub table_2: Table2,
    /// The paper against itself.
    pub audit: Vec<Finding>,
    /// What could reconcile its numbers.
    pub causes: Causes,
    /// Contacts and centre in a spin.
    pub figure_4: Figure4,
    /// Sensitivities of one experiment under the measuring hypothesis, mm/pulse.
    pub figure_6: Figure6,
    /// The validation path.
    pub figure_7: Figure7,
}

/// Figure 6: the sensitivities of one experiment, mm/pulse.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figure6 {
    /// Left wheel.
    pub left: Vec<f64>,
    /// Right wheel.
    pub right: Vec<f64>,
}

/// How many experiments [`reproduce`] drives in all, for a progress bar.
#[must_use]
pub const fn total_trials(trials: u64) -> u64 {
    (Hypothesis::ALL.len() as u64 + 2) * trials
}

/// Repeats the paper's experiments `trials` times each and holds them against what it prints; `seed` takes
/// the place of the shipped scenario's, `progress` is told of experiments done.
///
/// # Errors
/// [`PaperError`] when the experiments cannot be simulated.
pub fn reproduce(trials: u64, seed: Option<u64>, progress: &(dyn Fn(u64) + Sync)) -> Result<Reproduction, PaperError> {
    if trials < 2 {
        return Err(PaperError::TooFewTrials { trials });
    }
    let mut base = scenario()?;
    base.seed = seed.unwrap_or(base.seed);
    let table_1 = table_1::table_1(&base, trials, progress)?;
    let measuring = table_1.iter().find(|table| table.hypothesis == Hypothesis::Measuring);
    let reading_sigma_m = measuring.map_or(0.0, |table| table.reading_sigma_m);
    let table_2 = table_2::table_2(&base, reading_sigma_m, trials, progress)?;
    let audit = audit::audit(&base, &table_2)?;
    let causes = cause::causes(&base, &table_2, reading_sigma_m)?;
    let sample = table_1::sample(&base, Hypothesis::Measuring, reading_sigma_m)?;
    let figure_4 = figures::figure_4(&base.nominal_geometry().map_err(sim_yair::SimulationError::from)?);
    let figure_7 = figures::figure_7(&base, reading_sigma_m, trials, progress)?;
    let figure_6 = Figure6 { left: sample.left, right: sample.right };
    Ok(Reproduction { seed: base.seed, trials, table_1, table_2, audit, causes, figure_4, figure_6, figure_7 })
}
