//! The whole command: its grammar, and what runs it as a process or inside of another program.
//!
//! ```
//! use std::sync::Arc;
//! use yair::command::{Watch, call};
//! let call = call(["yair", "check", "no-such-folder"], &Arc::new(Watch::default()));
//! assert_eq!(call.exit_code, 1);
//! assert!(call.failure.is_some_and(|message| message.contains("no-such-folder")));
//! ```

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use anstream::{AutoStream, ColorChoice};
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

use crate::signals::Signals;
use crate::terminal::{Printed, Terminal, import_command};
use crate::{
    ablation, calibrate, challenge, check, command_line, compare, correct, demo, diagnose_command, evaluate,
    export_command, fleet_command, help, import, manual, merge, plan, replay_case, reproduce, simulate, sweep,
};

pub use crate::watch::{Progress, Watch};

/// Odometry of differential-drive robots: simulate, calibrate, evaluate, bench.
#[derive(Parser)]
#[command(name = "yair", version, about, max_term_width = 100)]
pub(crate) struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    /// Print one JSON document on standard output and nothing else there; of a failure, one with `error`.
    #[arg(long, global = true)]
    json: bool,
    /// No progress, no remarks, and no lines on what was read or written: results and errors alone.
    #[arg(long, global = true)]
    quiet: bool,
    /// TOML of an ablation: `off`, the rules that are switched off, and `decisions`, a file for how often
    /// each rule decided.
    #[arg(long, global = true, hide = true, value_name = "FILE")]
    settings: Option<PathBuf>,
}

#[derive(Subcommand)]
enum Command {
    Demo(demo::Arguments),
    Simulate(simulate::Arguments),
    Import(import::Arguments),
    Check(check::Arguments),
    ReplayCase(replay_case::Arguments),
    Calibrate(calibrate::Arguments),
    Diagnose(diagnose_command::Arguments),
    Challenge(challenge::Arguments),
    Evaluate(evaluate::Arguments),
    Compare(compare::Arguments),
    Correct(correct::Arguments),
    Export(export_command::Arguments),
    Fleet(fleet_command::Arguments),
    Sweep(sweep::Arguments),
    Merge(merge::Arguments),
    Plan(plan::Arguments),
    Reproduce(reproduce::Arguments),
    Completions(manual::Completions),
    Man(manual::Man),
}

/// Exit code of bad usage, as of `clap`.
const USAGE: u8 = 2;

/// What a [`call`] gave: what the process would have printed, apart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Call {
    /// 0 success, 1 bad input or failure, 2 bad usage, 3 beyond a limit that was set, 130 interrupted,
    /// 143 terminated.
    pub exit_code: u8,
    /// The JSON document, byte by byte as `--json` prints it.
    pub document: Option<String>,
    /// Warnings and remarks, in order.
    pub remarks: Vec<String>,
    /// The message of a failure.
    pub failure: Option<String>,
}

/// Runs the command as a process does, which prints and answers signals, and returns its exit code. The first
/// argument is the program's name.
pub fn main(arguments: impl IntoIterator<Item = impl Into<OsString>>) -> u8 {
    let arguments: Vec<OsString> = arguments.into_iter().map(Into::into).collect();
    let signals = Signals::answered();
    let (terminal, code) = match parsed(&arguments) {
        Ok(cli) => {
            let terminal = Terminal::new(cli.json, cli.quiet, signals);
            let code = run(&cli, &arguments, &terminal);
            (terminal, code)
        }
        Err(error) if error.use_stderr() => {
            let _ = error.print();
            let is_flag =
                |of: &str| arguments.iter().take_while(|argument| *argument != "--").any(|argument| argument == of);
            let terminal = Terminal::new(is_flag("--json"), true, signals);
            terminal.usage_error(&first_paragraph(&error.render().to_string()));
            (terminal, USAGE)
        }
        Err(help) => {
            let terminal = Terminal::new(false, false, signals);
            let text = help.render();
            let has_colours = AutoStream::choice(&std::io::stdout()) != ColorChoice::Never;
            terminal.print(if has_colours { text.ansi().to_string() } else { text.to_string() }.as_bytes());
            (terminal, 0)
        }
    };
    terminal.exit_code(code)
}

/// Runs the command inside of another program, with `--json`: nothing is printed, and no signal is handled.
/// The first argument is the program's name. Another thread may look at `watch` and stop what can be stopped.
pub fn call(arguments: impl IntoIterator<Item = impl Into<OsString>>, watch: &Arc<Watch>) -> Call {
    let arguments: Vec<OsString> = arguments.into_iter().map(Into::into).collect();
    let cli = match parsed(&arguments) {
        Ok(cli) => cli,
        Err(error) => {
            let text = error.render().to_string();
            let (exit_code, failure) = (if error.use_stderr() { USAGE } else { 0 }, Some(text.trim_end().to_owned()));
            return Call { exit_code, document: None, remarks: Vec::new(), failure };
        }
    };
    let terminal = Terminal::transcript(Arc::clone(watch));
    let exit_code = run(&cli, &arguments, &terminal);
    let Printed { document, remarks, failure } = terminal.into_transcript();
    Call { exit_code, document, remarks, failure }
}

fn grammar() -> clap::Command {
    help::with_groups_and_examples(Cli::command())
}

fn parsed(arguments: &[OsString]) -> Result<Cli, clap::Error> {
    let mut grammar = grammar();
    let matches = grammar.try_get_matches_from_mut(arguments).map_err(|error| with_format(error, &mut grammar))?;
    Cli::from_arg_matches(&matches).map_err(|error| error.format(&mut grammar))
}

/// What clap says before it shows the usage.
fn first_paragraph(text: &str) -> String {
    let paragraph = text.split("\n\n").next().unwrap_or_default();
    paragraph.strip_prefix("error: ").unwrap_or(paragraph).split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The mistake of `yair import FILE` in words that say what to type.
fn with_format(error: clap::Error, grammar: &mut clap::Command) -> clap::Error {
    let named = match error.get(ContextKind::InvalidSubcommand) {
        Some(ContextValue::String(name)) => PathBuf::from(name),
        _ => return error,
    };
    if !(named.exists() || named.extension().is_some()) {
        return error;
    }
    let (place, command) = (named.display(), import_command(&named));
    let message = format!("{place} is no format but a file, and its format comes first; did you mean: {command}");
    clap::Error::raw(ErrorKind::InvalidSubcommand, message).format(grammar)
}

fn run(cli: &Cli, arguments: &[OsString], terminal: &Terminal) -> u8 {
    command_line::keep(arguments);
    let decisions = match cli.settings.as_deref().map(ablation::begin).transpose() {
        Ok(decisions) => decisions.flatten(),
        Err(failure) => {
            terminal.failure(&failure.to_string());
            return 1;
        }
    };
    let Some(command) = &cli.command else {
        terminal.remark(help::first_steps());
        terminal.usage_error("no subcommand is given; yair --help lists them");
        return USAGE;
    };
    let outcome = match command {
        Command::Demo(arguments) => demo::run(arguments, terminal),
        Command::Simulate(arguments) => simulate::run(arguments, terminal),
        Command::Import(arguments) => import::run(arguments, terminal),
        Command::Check(arguments) => check::run(arguments, terminal),
        Command::ReplayCase(arguments) => replay_case::run(arguments, terminal),
        Command::Calibrate(arguments) => calibrate::run(arguments, terminal),
        Command::Diagnose(arguments) => diagnose_command::run(arguments, terminal),
        Command::Challenge(arguments) => challenge::run(arguments, terminal),
        Command::Evaluate(arguments) => evaluate::run(arguments, terminal),
        Command::Compare(arguments) => compare::run(arguments, terminal),
        Command::Correct(arguments) => correct::run(arguments, terminal),
        Command::Export(arguments) => export_command::run(arguments, terminal),
        Command::Fleet(arguments) => fleet_command::run(arguments, terminal),
        Command::Sweep(arguments) => sweep::run(arguments, terminal),
        Command::Merge(arguments) => merge::run(arguments, terminal),
        Command::Plan(arguments) => plan::run(arguments, terminal),
        Command::Reproduce(arguments) => reproduce::run(arguments, terminal),
        Command::Completions(arguments) => manual::completions(arguments, grammar(), terminal),
        Command::Man(arguments) => manual::man(arguments, grammar(), terminal),
    };
    let ended = decisions.as_deref().map_or(Ok(()), ablation::end);
    match outcome.and_then(|code| ended.map(|()| code)) {
        Ok(code) => number(code),
        Err(failure) => {
            terminal.failure(&failure.to_string());
            1
        }
    }
}

/// An exit code as a number, which the standard library tells by comparison alone.
fn number(code: ExitCode) -> u8 {
    (0..=u8::MAX).find(|number| ExitCode::from(*number) == code).unwrap_or(1)
}
