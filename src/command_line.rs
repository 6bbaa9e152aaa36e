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

/// The arguments without the program's name.
pub(crate) fn typed() -> Vec<String> {
    TYPED.with(|typed| typed.borrow().iter().skip(1).map(|argument| argument.to_string_lossy().into_owned()).collect())
}
