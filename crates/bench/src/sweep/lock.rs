//! A campaign's folder belongs to one process at a time.
//!
//! Two that write into one folder would each replace the state of the other, and both would end well. The
//! lock is the operating system's, on a file in the folder: a process that is killed leaves the file and
//! loses the lock.

use std::fs::{File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use atomic_file::UnderWay;
use atomic_file::lock::{is_still_at, keeps_others_out, opened};

use crate::error::BenchError;

/// The file that is locked.
const LOCK_FILE: &str = "sweep.lock";

/// Times that the file is opened anew because another process took it away as it ended.
const MAX_TURNS: usize = 16;

/// The right to write into a folder, until it is dropped.
#[derive(Debug)]
pub struct FolderLock {
    file: Option<File>,
    path: PathBuf,
    why_not_held: Option<String>,
    _under_way: UnderWay,
}

impl FolderLock {
    /// Takes a folder, which is made where it is not there.
    ///
    /// # Errors
    /// [`BenchError::InUse`] when another process has it, [`BenchError::Write`] when the folder cannot be
    /// written. A file system without locks is no error: [`Self::why_not_held`] tells.
    pub fn take(folder: &Path) -> Result<Self, BenchError> {
        let path = folder.join(LOCK_FILE);
        let unwritable = |error: io::Error| BenchError::Write {
            path: folder.display().to_string(),
            why: format!("cannot write results there: {}", error.kind()),
        };
        let in_use = || BenchError::InUse { path: folder.display().to_string() };
        atomic_file::refuse_link(folder)
            .map_err(|error| BenchError::Write { path: folder.display().to_string(), why: error.to_string() })?;
        atomic_file::create_all(folder).map_err(unwritable)?;
        for _ in 0..MAX_TURNS {
            let file = opened(&path).map_err(unwritable)?;
            let locked = file.try_lock();
            if matches!(locked, Err(TryLockError::WouldBlock)) {
                return Err(in_use());
            }
            // First, so that a signal from now on takes the file away.
            let _under_way = UnderWay::of(&path);
            let why_not_held = match locked {
                Err(error) => Some(error.to_string()),
                Ok(()) if !is_still_at(&file, &path) => continue,
                Ok(()) => keeps_others_out(&path).err().map(|error| error.to_string()),
            };
            return Ok(Self { file: Some(file), path, why_not_held, _under_way });
        }
        Err(in_use())
    }

    /// Why the lock keeps nobody out, where it does not: some network file systems know no locks.
    #[must_use]
    pub fn why_not_held(&self) -> Option<&str> {
        self.why_not_held.as_deref()
    }
}

impl Drop for FolderLock {
    fn drop(&mut self) {
        // While the lock is still held: who opened this file before sees that it is gone. Elsewhere than on
        // Unix nobody could see it, and the file stays.
        if cfg!(unix) {
            let _ = std::fs::remove_file(&self.path);
        }
        drop(self.file.take());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_has_one_owner_and_is_clean_afterwards() {
        let temporary = tempfile::tempdir().expect("a folder");
        let folder = temporary.path().join("new");
        let first = FolderLock::take(&folder).expect("nobody has it");
        assert_eq!(first.why_not_held(), None);
        let refused = FolderLock::take(&folder).expect_err("the first has it");
        assert!(matches!(refused, BenchError::InUse { .. }), "{refused}");
        drop(first);
        assert!(!cfg!(unix) || std::fs::read_dir(&folder).expect("there").next().is_none());
        // What a killed process leaves is no lock.
        std::fs::write(folder.join(LOCK_FILE), "").expect("written");
        drop(FolderLock::take(&folder).expect("nobody has it"));
    }
}
