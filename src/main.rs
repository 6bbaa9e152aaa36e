//! The `yair` command: one file a subcommand, and the only code that knows the terminal.

mod calibrate;
mod calibration_file;
mod challenge;
mod check;
mod compare;
mod correct;
mod diagnose;
mod diagnosis_page;
mod evaluate;
mod export;
mod html_report;
mod import;
mod import_csv;
mod import_robot;
mod import_ros2;
mod merge;
mod plan;
mod reproduce;
mod simulate;
mod sweep;
mod sweep_summary;
mod sweep_table;
mod terminal;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::terminal::Terminal;

/// Odometry of differential-drive robots: simulate, calibrate, evaluate, bench.
#[derive(Parser)]
#[command(name = "yair", version, about, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Print one JSON document on standard output and nothing else there.
    #[arg(long, global = true)]
    json: bool,
    /// No progress and no remarks.
    #[arg(long, global = true)]
    quiet: bool,
}

#[derive(Subcommand)]
enum Command {
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
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let terminal = Terminal::new(cli.json, cli.quiet);
    let outcome = match &cli.command {
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
    };
    outcome.unwrap_or_else(|failure| {
        terminal.failure(&failure.to_string());
        ExitCode::FAILURE
    })
}
