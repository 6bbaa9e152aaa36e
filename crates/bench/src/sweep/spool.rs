//! Trials' estimates as fixed records in a file that grows, which an interrupted campaign cuts back to what
//! its state knows of. At the end they become rows (`rows.rs`).

use std::fs::{File, OpenOptions};
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::tally::Outcome;
use crate::error::BenchError;

/// The spool's file in the folder of results.
const SPOOL_FILE: &str = "sweep.trials.spool";

/// Bytes of one estimate: value and sigma.
pub(super) const RECORD: usize = 16;

pub(super) fn failed(path: &Path, why: &impl ToString) -> BenchError {
    BenchError::Write { path: path.display().to_string(), why: why.to_string() }
}

/// The growing file of estimates.
pub(super) struct Spool {
    path: PathBuf,
    file: BufWriter<File>,
}

impl Spool {
    /// Opens the spool in a folder with its first `keep` bytes.
    pub(super) fn open(folder: &Path, keep: u64) -> Result<Self, BenchError> {
        let path = folder.join(SPOOL_FILE);
        let open = || {
            let mut file = OpenOptions::new().create(true).truncate(keep == 0).write(true).open(&path)?;
            let length = file.metadata()?.len();
            if length < keep {
                // Filled up it would hold estimates of 0 that no method gave.
                let why =
                    format!("it has {length} bytes and its state file counts {keep}; delete the folder and sweep anew");
                return Err(std::io::Error::other(why));
            }
            if keep > 0 {
                file.set_len(keep)?;
            }
            file.seek(SeekFrom::Start(keep))?;
            Ok(file)
        };
        let file = open().map_err(|error: std::io::Error| failed(&path, &error))?;
        Ok(Self { file: BufWriter::new(file), path })
    }

    /// Appends estimates and says how many bytes they are.
    pub(super) fn append(&mut self, outcomes: &[Outcome]) -> Result<u64, BenchError> {
        for outcome in outcomes {
            for number in [outcome.value, outcome.sigma] {
                self.file.write_all(&number.to_le_bytes()).map_err(|error| failed(&self.path, &error))?;
            }
        }
        Ok((outcomes.len() * RECORD) as u64)
    }

    /// Hands everything to the system: what the state counts must be in the file before the state is.
    pub(super) fn flush(&mut self) -> Result<(), BenchError> {
        self.file.flush().map_err(|error| failed(&self.path, &error))
    }
}

/// The spool in a folder.
pub(super) fn spool_in(folder: &Path) -> PathBuf {
    folder.join(SPOOL_FILE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spool_is_cut_back_to_its_state_and_never_filled_up() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut spool = Spool::open(folder.path(), 0).expect("made");
        let written = spool.append(&[Outcome { value: 1.0, sigma: 2.0, blind: false }; 3]).expect("appended");
        spool.flush().expect("flushed");
        drop(spool);
        drop(Spool::open(folder.path(), written - 16).expect("cut back"));
        assert_eq!(std::fs::metadata(spool_in(folder.path())).expect("there").len(), written - 16);
        let refused = Spool::open(folder.path(), written).err().expect("shorter than its state says").to_string();
        assert!(refused.contains("it has 32 bytes and its state file counts 48"), "{refused}");
    }
}
