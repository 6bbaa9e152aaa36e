//! Why a campaign cannot be run, gone on with, put together or written.

use scenario::ScenarioError;
use sim_yair::SimulationError;

/// Why the bench gives no result.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BenchError {
    /// The scenario has no `[sweep]`.
    #[error("{scenario}: the scenario has no [sweep] section; add trials and methods")]
    NoSweep {
        /// The scenario's name.
        scenario: String,
    },
    /// A method that does not exist.
    #[error("unknown method \"{name}\"; known: {}", known.join(", "))]
    UnknownMethod {
        /// The name asked for.
        name: String,
        /// The names that exist.
        known: Vec<&'static str>,
    },
    /// Fewer trials than a spread needs.
    #[error("{trials} trials show no spread; ask for at least 2")]
    TooFewTrials {
        /// How many were asked for.
        trials: u64,
    },
    /// More trials than a campaign of years has.
    #[error("{trials} trials at a point; expected at most {most}")]
    TooManyTrials {
        /// How many were asked for.
        trials: u64,
        /// The limit.
        most: u64,
    },
    /// The scenario's points are not scenarios.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// A point cannot be simulated.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// The threads cannot be started.
    #[error("cannot start {jobs} threads: {why}")]
    Threads {
        /// How many were asked for.
        jobs: usize,
        /// The system's reason.
        why: String,
    },
    /// Results or the campaign's state cannot be written.
    #[error("{path}: {why}")]
    Write {
        /// The file.
        path: String,
        /// The reason.
        why: String,
    },
    /// Rows are asked of a build without the feature that writes them.
    #[error(
        "--rows: this build writes no Parquet files. Build with the feature parquet: \
         cargo install --path . --locked --features parquet"
    )]
    NoParquet,
    /// Another process works in the folder.
    #[error("{path}: another process is running a sweep there; wait for it, or give another folder with --out")]
    InUse {
        /// The folder.
        path: String,
    },
    /// The folder holds an unfinished campaign that nobody asked to go on with.
    #[error("{path}: it holds an unfinished sweep; continue it with --resume, or remove the file")]
    Unfinished {
        /// The state file.
        path: String,
    },
    /// A state file that is none, or is damaged.
    #[error("{path}: not the state of a sweep: {why}")]
    NotAState {
        /// The state file.
        path: String,
        /// What is wrong with it.
        why: String,
    },
    /// The state belongs to another campaign.
    #[error("{path}: belongs to another sweep: its {what} is {theirs}, not {ours}")]
    OtherSweep {
        /// The state file.
        path: String,
        /// What differs.
        what: &'static str,
        /// There.
        theirs: String,
        /// Here.
        ours: String,
    },
    /// Shards that do not make a whole.
    #[error("{path}: {why}")]
    Shards {
        /// The folder of the shard concerned.
        path: String,
        /// What is missing or too much.
        why: String,
    },
    /// A baseline that cannot be compared with.
    #[error("{path}: {why}")]
    Baseline {
        /// The file.
        path: String,
        /// What is wrong with it.
        why: String,
    },
    /// The results cannot be drawn.
    #[error("cannot draw the sweep: {0}")]
    Picture(#[from] report::ReportError),
}
