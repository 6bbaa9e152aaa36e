//! `yair merge DIR... --out DIR`

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use crate::html_report::write_sweep;
use crate::sweep_table;
use crate::terminal::{Failure, Terminal};

/// Merge the shards of a sweep; the result is that of one machine, to the bit.
#[derive(Args)]
pub(crate) struct Arguments {
    /// The folders of all shards, in any order.
    #[arg(required = true)]
    shards: Vec<PathBuf>,
    /// Write report.html, sweep.json, sweep.csv, the picture and, where the shards kept them, the trials'
    /// rows into this folder.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    let merged = bench::merge(&arguments.shards)?;
    bench::can_be_written(&arguments.out, false)?;
    bench::write_merged(&merged, &arguments.out)?;
    write_sweep(&merged.result, &arguments.out)?;
    sweep_table::show(&merged.result, terminal)?;
    terminal.document(&merged.result)?;
    Ok(ExitCode::SUCCESS)
}
