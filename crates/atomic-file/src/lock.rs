//! Locks of the operating system on files: a process that is killed leaves the file and loses the lock.

use std::fs::{File, OpenOptions, TryLockError};
use std::io;
use std::path::Path;

/// Opens a file that is to be locked, and makes it where it is not there; a link in its place is refused.
///
/// # Errors
/// The system's, and [`io::ErrorKind::AlreadyExists`] where there is a link.
pub fn opened(path: &Path) -> io::Result<File> {
    if path.is_symlink() {
        return Err(io::Error::new(io::ErrorKind::AlreadyExists, "the lock is a link"));
    }
    // For writing, as network file systems ask of who locks.
    OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)
}

/// Why the lock that this process has on the file at `path` keeps nobody out, where it does not: some network
/// file systems know no locks, and a second handle gets the same one.
///
/// # Errors
/// That reason, or what the system says when the file is opened again.
pub fn keeps_others_out(path: &Path) -> io::Result<()> {
    match opened(path)?.try_lock() {
        Err(TryLockError::WouldBlock) => Ok(()),
        Ok(()) => Err(io::Error::other("a second lock of the same file is granted")),
        Err(TryLockError::Error(error)) => Err(error),
    }
}

/// Whether the file at the path is the one that was opened.
#[cfg(unix)]
#[must_use]
pub fn is_still_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let id = |metadata: std::fs::Metadata| (metadata.dev(), metadata.ino());
    match (file.metadata(), std::fs::symlink_metadata(path)) {
        (Ok(ours), Ok(there)) => id(ours) == id(there),
        _ => false,
    }
}

/// Nobody takes a file away that is open.
#[cfg(not(unix))]
#[must_use]
pub fn is_still_at(_: &File, path: &Path) -> bool {
    path.exists()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn a_lock_on_a_file_that_was_taken_away_is_none() {
        let temporary = tempfile::tempdir().expect("a folder");
        let path = temporary.path().join("lock");
        let before = opened(&path).expect("made");
        assert!(is_still_at(&before, &path));
        std::fs::remove_file(&path).expect("there");
        assert!(!is_still_at(&before, &path));
        let after = opened(&path).expect("made");
        assert!(!is_still_at(&before, &path) && is_still_at(&after, &path));
    }

    #[test]
    fn a_lock_that_is_not_taken_keeps_nobody_out() {
        let temporary = tempfile::tempdir().expect("a folder");
        let path = temporary.path().join("lock");
        let file = opened(&path).expect("made");
        assert!(keeps_others_out(&path).is_err());
        file.lock().expect("taken");
        keeps_others_out(&path).expect("kept out");
    }
}
