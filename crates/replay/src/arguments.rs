//! What the command line asks for.

use std::path::PathBuf;

use clap::Parser;

/// The same logs through two builds of `yair`, in paired tables.
#[derive(Parser)]
pub(crate) struct Arguments {
    /// The build that is changed: an executable, with words for its `diagnose` behind it, or a file that
    /// --store-as wrote.
    pub(crate) old: String,
    /// The build with the change.
    pub(crate) new: Option<String>,
    /// Folders of more logs, with an answer.json beside each.
    #[arg(long, value_name = "DIR", num_args = 1..)]
    pub(crate) corpus: Vec<PathBuf>,
    /// The folder of real robots' logs: the `yair` beside this program imports them.
    #[arg(long, value_name = "DIR")]
    pub(crate) real: Option<PathBuf>,
    /// Cases of the blind benchmark for each seed; 0 for none.
    #[arg(long, value_name = "N", default_value_t = 800)]
    pub(crate) cases: u64,
    /// Robots of each kind of ordinary logs, for each seed.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) robots: u64,
    /// Mixed logs, for each seed.
    #[arg(long, value_name = "N", default_value_t = 100)]
    pub(crate) mixed: u64,
    /// Seeds of all that is drawn.
    #[arg(long, value_name = "S", num_args = 1.., default_values_t = [63_001, 63_002, 63_003])]
    pub(crate) seeds: Vec<u64>,
    /// Ask NEW drawn logs whose rows say what the wheels did and when, without rounding, loss or late stamps:
    /// what a perfect model of a log could win. Mixed logs stay as they are.
    #[arg(long, conflicts_with_all = ["store_as", "real", "corpus"])]
    pub(crate) knows_wheels: bool,
    /// Where logs and outcomes are kept.
    #[arg(long, value_name = "DIR", default_value = "target/replay")]
    pub(crate) store: PathBuf,
    /// Write the outcomes of OLD into a file, and compare nothing.
    #[arg(long, value_name = "FILE", conflicts_with = "new")]
    pub(crate) store_as: Option<PathBuf>,
    /// Logs at a time; 0 for one a core.
    #[arg(long, value_name = "J", default_value_t = 0)]
    pub(crate) jobs: usize,
    /// Print JSON in place of tables.
    #[arg(long)]
    pub(crate) json: bool,
    /// Exit with 1 where more is lost than the rule of acceptance allows, with p below 0.05.
    #[arg(long)]
    pub(crate) check: bool,
}
