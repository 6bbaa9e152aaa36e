//! `yair reproduce [--out DIR]`

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use clap::Args;
use paper_reproduction as paper;

use crate::html_report::write_reproduction;
use crate::new_folders::NewFolders;
use crate::simulate::{refuse_filled, write_whole};
use crate::terminal::{Failure, Terminal};

/// Reproduce the paper's tables by simulation, with the published values and their contradictions.
#[derive(Args)]
pub(crate) struct Arguments {
    /// How often each experiment is repeated.
    #[arg(long, value_name = "N", default_value_t = 2000)]
    trials: u64,
    /// Seed of every random draw, in place of the shipped scenario's.
    #[arg(long)]
    seed: Option<u64>,
    /// Write the page (report.html, paper.md) and its figures (SVG and PNG) into this folder.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write into a folder that is not empty.
    #[arg(long)]
    force: bool,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<ExitCode, Failure> {
    if let Some(out) = &arguments.out {
        refuse_filled(out, arguments.force)?;
    }
    let bar = terminal.progress(paper::total_trials(arguments.trials), "experiments");
    let started = Instant::now();
    let reproduction = paper::reproduce(arguments.trials, arguments.seed, &|trials| bar.inc(trials))?;
    bar.finish_and_clear();
    let elapsed_s = started.elapsed().as_secs_f64();
    let page = reproduction.page();
    if let Some(out) = &arguments.out {
        let _new = NewFolders::to(out);
        atomic_file::create_folder(out).map_err(|error| format!("{}: {error}", out.display()))?;
        write_whole(&out.join("paper.md"), page.as_bytes())?;
        for (stem, _, figure) in reproduction.pictures() {
            figure.write(out, stem)?;
        }
        write_reproduction(&reproduction, &page, out)?;
    }
    terminal.say(page.trim_end())?;
    terminal.remark(&format!("{} experiments in {elapsed_s:.1} s", paper::total_trials(arguments.trials)));
    terminal.document(&reproduction)?;
    Ok(ExitCode::SUCCESS)
}
