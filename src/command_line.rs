//! The arguments of the command under way, as reports tell them.

use std::cell::RefCell;
use std::ffi::OsString;

thread_local! {
    /// Of the command that this thread runs: programs that call it have arguments of their own.
    static TYPED: RefCell<Vec<OsString>> = const { RefCell::new(Vec::new()) };
}

/// Keeps the arguments of the command that this thread is about to run.
pub(crate) fn keep(arguments: &[OsString]) {
    TYPED.with(|typed| *typed.borrow_mut() = arguments.to_vec());
}

/// What becomes of files that are there already changes no result, and is not told.
const OF_REPLACEMENT: [&str; 2] = ["--force", "--replace"];

/// The arguments that results depend on, without the program's name.
pub(crate) fn typed() -> Vec<String> {
    let text = |argument: &OsString| argument.to_string_lossy().into_owned();
    let typed: Vec<String> = TYPED.with(|typed| typed.borrow().iter().skip(1).map(text).collect());
    typed.into_iter().filter(|argument| !OF_REPLACEMENT.contains(&argument.as_str())).collect()
}
