//! The `yair` command: one file a subcommand, and the only code that knows the terminal.

mod calibrate;
mod calibration_file;
mod challenge;
mod check;
mod compare;
mod correct;
mod demo;
mod diagnose;
mod diagnosis_page;
mod evaluate;
mod export;
mod export_drift;
mod export_mcap;
mod help;
mod html_report;
mod import;
mod import_csv;
mod import_robot;
mod import_ros2;
mod import_tum;
mod manual;
mod merge;
mod plan;
mod reproduce;
mod simulate;
mod sparse_lines;
mod sweep;
mod sweep_summary;
mod sweep_table;
mod terminal;

use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

use crate::terminal::Terminal;

/// Odometry of differential-drive robots: simulate, calibrate, evaluate, bench.
#[derive(Parser)]
#[command(name = "yair", version, about, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    /// Print one JSON document on standard output and nothing else there.
    #[arg(long, global = true)]
    json: bool,
    /// No progress and no remarks.
    #[arg(long, global = true)]
    quiet: bool,
}

#[derive(Subcommand)]
enum Command {
    Demo(demo::Arguments),
    Simulate(simulate::Arguments),
    Import(import::Arguments),
    Check(check::Arguments),
    Calibrate(calibrate::Arguments),
    Diagnose(diagnose::Arguments),
    Challenge(challenge::Arguments),
    Evaluate(evaluate::Arguments),
    Compare(compare::Arguments),
    Correct(correct::Arguments),
    Export(export::Arguments),
    Sweep(sweep::Arguments),
    Merge(merge::Arguments),
    Plan(plan::Arguments),
    Reproduce(reproduce::Arguments),
    Completions(manual::Completions),
    Man(manual::Man),
}

/// Exit code of bad usage, as of `clap`.
const USAGE: u8 = 2;

fn main() -> ExitCode {
    let grammar = help::with_groups_and_examples(Cli::command());
    let cli = Cli::from_arg_matches(&grammar.clone().get_matches()).unwrap_or_else(|error| error.exit());
    let terminal = Terminal::new(cli.json, cli.quiet);
    let Some(command) = &cli.command else {
        terminal.remark(help::first_steps());
        return ExitCode::from(USAGE);
    };
    let outcome = match command {
        Command::Demo(arguments) => demo::run(arguments, &terminal),
        Command::Simulate(arguments) => simulate::run(arguments, &terminal),
        Command::Import(arguments) => import::run(arguments, &terminal),
        Command::Check(arguments) => check::run(arguments, &terminal),
        Command::Calibrate(arguments) => calibrate::run(arguments, &terminal),
        Command::Diagnose(arguments) => diagnose::run(arguments, &terminal),
        Command::Challenge(arguments) => challenge::run(arguments, &terminal),
        Command::Evaluate(arguments) => evaluate::run(arguments, &terminal),
        Command::Compare(arguments) => compare::run(arguments, &terminal),
        Command::Correct(arguments) => correct::run(arguments, &terminal),
        Command::Export(arguments) => export::run(arguments, &terminal),
        Command::Sweep(arguments) => sweep::run(arguments, &terminal),
        Command::Merge(arguments) => merge::run(arguments, &terminal),
        Command::Plan(arguments) => plan::run(arguments, &terminal),
        Command::Reproduce(arguments) => reproduce::run(arguments, &terminal),
        Command::Completions(arguments) => manual::completions(arguments, grammar),
        Command::Man(arguments) => manual::man(arguments, grammar, &terminal),
    };
    outcome.unwrap_or_else(|failure| {
        terminal.failure(&failure.to_string());
        ExitCode::FAILURE
    })
}
