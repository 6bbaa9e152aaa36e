//! Standard output, of which nothing is lost unsaid.

use std::io::{self, Write};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether the process was started without a standard output.
static IS_CLOSED: AtomicBool = AtomicBool::new(false);

/// Before Rust's runtime begins, which puts /dev/null in the place of what is closed: the one moment at which
/// it can be told.
#[cfg(unix)]
#[ctor::ctor]
fn look() {
    use std::os::fd::AsFd;
    IS_CLOSED.store(io::stdout().as_fd().try_clone_to_owned().is_err(), Ordering::Relaxed);
}

/// What the command prints, and why it is not all there.
#[derive(Default)]
pub(crate) struct StandardOutput {
    ended: OnceLock<io::Error>,
}

impl StandardOutput {
    /// Prints a text. What fails is kept: files are still written, and nothing more is printed.
    pub(crate) fn print(&self, text: &[u8]) {
        if self.ended.get().is_some() {
            return;
        }
        let written = match IS_CLOSED.load(Ordering::Relaxed) {
            true => Err(io::Error::other("it is closed")),
            false => {
                let mut stdout = io::stdout().lock();
                stdout.write_all(text).and_then(|()| stdout.flush())
            }
        };
        if let Err(error) = written {
            let _ = self.ended.set(error);
        }
    }

    /// Why not all was printed; a reader that has gone away (`| head`) has what it wanted.
    pub(crate) fn failed(&self) -> Option<String> {
        let error = self.ended.get().filter(|error| error.kind() != io::ErrorKind::BrokenPipe)?;
        Some(format!("standard output: {error}"))
    }
}
