//! The `yair` command; [`yair::command`] has all of it.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(yair::command::main(std::env::args_os()))
}
