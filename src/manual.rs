//! `yair completions SHELL` and `yair man`: the command as shells and `man` know it.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Command};
use clap_complete::Shell;

use crate::simulate::write_whole;
use crate::terminal::{Failure, Terminal};

/// Completions of `yair` for a shell, on standard output.
#[derive(Args)]
pub(crate) struct Completions {
    /// The shell.
    shell: Shell,
}

/// The manual pages of `yair`: yair.1 on standard output, or all of them into a folder.
#[derive(Args)]
pub(crate) struct Man {
    /// Folder for yair.1 and a page a subcommand.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

pub(crate) fn completions(
    arguments: &Completions,
    mut command: Command,
    terminal: &Terminal,
) -> Result<ExitCode, Failure> {
    let mut text = Vec::new();
    clap_complete::generate(arguments.shell, &mut command, "yair", &mut text);
    terminal.print(&text);
    Ok(ExitCode::SUCCESS)
}

pub(crate) fn man(arguments: &Man, mut command: Command, terminal: &Terminal) -> Result<ExitCode, Failure> {
    command.build();
    let Some(out) = &arguments.out else {
        terminal.print(&rendered(command)?);
        return Ok(ExitCode::SUCCESS);
    };
    atomic_file::create_folder(out).map_err(|error| format!("{}: {error}", out.display()))?;
    let mut written = 0;
    let mut waiting = vec![("yair".to_owned(), command)];
    while let Some((name, command)) = waiting.pop() {
        let inside = command.get_subcommands().filter(|inside| inside.get_name() != "help");
        waiting.extend(inside.map(|inside| (format!("{name}-{}", inside.get_name()), inside.clone())));
        write_whole(&out.join(format!("{name}.1")), &rendered(command)?)?;
        written += 1;
    }
    terminal.remark(&format!("{written} manual pages in {}", out.display()));
    Ok(ExitCode::SUCCESS)
}

fn rendered(command: Command) -> Result<Vec<u8>, Failure> {
    let mut page = Vec::new();
    clap_mangen::Man::new(command).render(&mut page)?;
    Ok(page)
}
