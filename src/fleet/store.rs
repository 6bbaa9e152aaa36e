//! What was found in datasets, kept for the next call: a file for each, under the hash of all it depends on.

use std::fmt::Write as _;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use ::fleet::SessionResult;
use bench::{BenchError, FolderLock};
use sha2::{Digest, Sha256};

use crate::new_folders::NewFolders;
use crate::terminal::{Failure, is_dataset};

/// Counts changes of what is found and kept within a version of the program.
const GENERATION: u32 = 2;

/// Longest result that is kept, bytes; some kilobytes are usual.
const MAX_RESULT_BYTES: u64 = 64 << 20;

/// Bytes of a file that are hashed at once.
const BLOCK_BYTES: usize = 1 << 16;

/// The folder of --out, for this process alone.
pub(super) struct SessionStore {
    folder: PathBuf,
    out: PathBuf,
    lock: FolderLock,
    /// Behind the lock, whose file is taken away first.
    _new: NewFolders,
}

impl SessionStore {
    /// Takes the folder, which is made where it is not there.
    pub(super) fn open(out: &Path) -> Result<Self, Failure> {
        let new = NewFolders::to(&out.join("sessions"));
        let lock = FolderLock::take(out).map_err(|error| match error {
            BenchError::InUse { path } => {
                format!("{path}: another process writes there; wait for it, or give another folder with --out")
            }
            other => other.to_string(),
        })?;
        let folder = out.join("sessions");
        atomic_file::create_inside(out, Path::new("sessions"))
            .map_err(|error| format!("{}: {error}", folder.display()))?;
        atomic_file::remove_leftovers(out);
        atomic_file::remove_leftovers(&folder);
        Ok(Self { folder, out: out.to_owned(), lock, _new: new })
    }

    /// What to say where the lock keeps nobody out.
    pub(super) fn why_not_locked(&self) -> Option<String> {
        let why = self.lock.why_not_held()?;
        let out = self.out.display();
        Some(format!("{out}: it cannot be locked ({why}); see to it that no other process writes there"))
    }

    fn file(&self, key: &str) -> PathBuf {
        self.folder.join(format!("{key}.json"))
    }

    /// What is kept; `None` where nothing is, or what is there cannot be read: it is then found anew.
    pub(super) fn read(&self, key: &str) -> Option<SessionResult> {
        serde_json::from_slice(&atomic_file::read_at_most(&self.file(key), MAX_RESULT_BYTES).ok()?).ok()
    }

    /// Keeps what was found.
    pub(super) fn write(&self, key: &str, result: &SessionResult) -> Result<(), String> {
        let file = self.file(key);
        let bytes = serde_json::to_vec(result).map_err(|error| error.to_string())?;
        atomic_file::write_whole(&file, &bytes).map_err(|error| format!("{}: {error}", file.display()))
    }
}

/// SHA-256 of all that a result depends on: version, options, and the names, lengths and bytes of
/// dataset.toml and of every table.
pub(super) fn key(dataset: &Path, calibrate_only: bool) -> Result<String, String> {
    let failed = |path: &Path, error: std::io::Error| format!("{}: {error}", path.display());
    if !is_dataset(dataset) {
        return Err(format!("{}: the folder cannot be listed, or has no dataset.toml any more", dataset.display()));
    }
    let entries = std::fs::read_dir(dataset).map_err(|error| failed(dataset, error))?;
    let is_part = |path: &PathBuf| path.extension().is_some_and(|of| of == "csv" || of == "toml") && path.is_file();
    let mut files: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).filter(is_part).collect();
    files.sort();
    let mut hash = Sha256::new();
    hash.update(format!("{} {GENERATION} {calibrate_only}\n", env!("CARGO_PKG_VERSION")));
    let mut block = vec![0; BLOCK_BYTES];
    for path in files {
        let mut file = File::open(&path).map_err(|error| failed(&path, error))?;
        let length = file.metadata().map_err(|error| failed(&path, error))?.len();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        hash.update(format!("{} {name} {length}\n", name.len()));
        loop {
            let count = file.read(&mut block).map_err(|error| failed(&path, error))?;
            if count == 0 {
                break;
            }
            hash.update(&block[..count]);
        }
    }
    Ok(hash.finalize().iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_key_depends_on_files_and_options_and_on_nothing_else() {
        let temp = tempfile::tempdir().expect("a temporary folder");
        let [one, other] = ["one", "other"].map(|name| temp.path().join(name));
        for folder in [&one, &other] {
            std::fs::create_dir(folder).expect("made");
            std::fs::write(folder.join("dataset.toml"), "format = 1\n").expect("written");
            std::fs::write(folder.join("odometry.csv"), "run,t_s\n").expect("written");
        }
        std::fs::write(other.join("notes.txt"), "no part of a dataset").expect("written");
        let of = |folder: &Path, calibrate_only| key(folder, calibrate_only).expect("readable");
        assert_eq!(of(&one, false), of(&other, false));
        assert_eq!(of(&one, false).len(), 64);
        assert_ne!(of(&one, false), of(&one, true));
        std::fs::write(other.join("odometry.csv"), "run,t_s,\n").expect("written");
        assert_ne!(of(&one, false), of(&other, false));
        assert!(key(temp.path(), false).is_err());
    }
}
