//! Logs with their answers in folders: `NAME/answer.json`, `NAME/training` in the project's format and, where
//! the robot drove elsewhere, `NAME/held_out`; each a dataset, or a folder of datasets.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use crate::answer::{ANSWER, Answer};

/// A log of a corpus.
#[derive(Debug, Clone)]
pub struct Log {
    /// Its folder, below the corpus.
    pub name: String,
    /// Its folder.
    pub folder: PathBuf,
    /// What is true of it.
    pub answer: Answer,
    /// SHA-256 of every file of its sessions, with their names.
    pub digest: String,
}

impl Log {
    /// Every log below a folder, in the order of their names.
    ///
    /// # Errors
    /// A sentence with the file that cannot be read, or the folder that holds no log.
    pub fn all(corpus: &Path) -> Result<Vec<Self>, String> {
        let mut files = Vec::new();
        walk(corpus, &mut files).map_err(|error| format!("{}: {error}", corpus.display()))?;
        let mut logs = Vec::new();
        for file in files.iter().filter(|file| file.file_name().is_some_and(|name| name == ANSWER)) {
            let folder = file.parent().unwrap_or(corpus).to_owned();
            let text = fs::read_to_string(file).map_err(|error| format!("{}: {error}", file.display()))?;
            let answer = serde_json::from_str(&text).map_err(|error| format!("{}: {error}", file.display()))?;
            let own = files.iter().filter(|other| other.starts_with(&folder) && *other != file);
            let name = folder.strip_prefix(corpus).unwrap_or(&folder).display().to_string();
            let digest = digest(&folder, own).map_err(|error| format!("{}: {error}", folder.display()))?;
            logs.push(Self { name, folder, answer, digest });
        }
        logs.sort_by(|a, b| a.name.cmp(&b.name));
        if logs.is_empty() {
            return Err(format!("{}: there is no {ANSWER} below it", corpus.display()));
        }
        Ok(logs)
    }

    /// The sessions that are diagnosed, in the order of their names.
    #[must_use]
    pub fn training(&self) -> Vec<PathBuf> {
        folders(&self.folder.join("training"))
    }

    /// The sessions that are driven elsewhere; none where there are none.
    #[must_use]
    pub fn held_out(&self) -> Vec<PathBuf> {
        folders(&self.folder.join("held_out"))
    }
}

fn folders(parent: &Path) -> Vec<PathBuf> {
    if parent.join("dataset.toml").exists() {
        return vec![parent.to_owned()];
    }
    let entries = fs::read_dir(parent).into_iter().flatten().filter_map(Result::ok);
    let mut folders: Vec<PathBuf> = entries.map(|entry| entry.path()).filter(|path| path.is_dir()).collect();
    folders.sort();
    folders
}

fn walk(folder: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    let mut entries = fs::read_dir(folder)?.collect::<io::Result<Vec<_>>>()?;
    entries.sort_by_key(fs::DirEntry::file_name);
    for entry in entries {
        let path = entry.path();
        if path.is_dir() { walk(&path, files)? } else { files.push(path) }
    }
    Ok(())
}

fn digest<'a>(folder: &Path, files: impl Iterator<Item = &'a PathBuf>) -> io::Result<String> {
    let mut hash = Sha256::new();
    for file in files {
        hash.update(file.strip_prefix(folder).unwrap_or(file).as_os_str().as_encoded_bytes());
        hash.update([0]);
        hash.update(fs::read(file)?);
    }
    Ok(hexadecimal(&hash.finalize()))
}

/// Bytes as hexadecimal digits.
pub(crate) fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// How many logs each corpus has.
#[must_use]
pub fn counts(logs: &[Log]) -> BTreeMap<&str, usize> {
    logs.iter().fold(BTreeMap::new(), |mut counts, log| {
        *counts.entry(log.answer.corpus.as_str()).or_default() += 1;
        counts
    })
}
