//! What this process has begun and not finished: a process that is asked to end takes it away first.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Files and folders that are no results yet.
static UNDER_WAY: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// Times that a folder is taken away anew because another thread has put a file into it meanwhile.
const MAX_TURNS: usize = 100;

/// A file or folder that [`remove_all_under_way`] takes away, until this is dropped.
#[derive(Debug)]
pub struct UnderWay(PathBuf);

impl UnderWay {
    /// Adds a file or folder of this process.
    #[must_use]
    pub fn of(path: &Path) -> Self {
        Self::listed(&mut begun(), path)
    }

    /// The same for who makes it meanwhile, so that nothing is there that is not listed.
    pub(crate) fn listed(begun: &mut Begun, path: &Path) -> Self {
        begun.insert(path.to_owned());
        Self(path.to_owned())
    }
}

impl Drop for UnderWay {
    fn drop(&mut self) {
        begun().remove(&self.0);
    }
}

/// While a thread has it, nothing is taken away.
pub(crate) type Begun = MutexGuard<'static, BTreeSet<PathBuf>>;

pub(crate) fn begun() -> Begun {
    UNDER_WAY.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Takes away all that this process has begun and not finished. It can begin and finish nothing more
/// afterwards: a thread that tries waits for the end of the process, which is for the caller to bring about.
pub fn remove_all_under_way() {
    let begun = begun();
    for path in begun.iter() {
        for _ in 0..MAX_TURNS {
            let removed = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
            if removed.is_ok() || !path.exists() {
                break;
            }
        }
    }
    std::mem::forget(begun);
}
