//! Folders that a command makes for its results, and that nobody wants where there are none.

use std::path::{Path, PathBuf};

/// The folders on a way that were not there. When this is dropped, those that have been made since and are
/// still empty are taken away: a command that fails, on a full disk, leaves none behind.
#[derive(Debug)]
#[must_use]
pub(crate) struct NewFolders(Vec<PathBuf>);

impl NewFolders {
    /// To be asked before the first of them is made.
    pub(crate) fn to(folder: &Path) -> Self {
        let is_missing = |folder: &&Path| !folder.as_os_str().is_empty() && !folder.exists();
        Self(folder.ancestors().take_while(is_missing).map(Path::to_owned).collect())
    }
}

impl Drop for NewFolders {
    fn drop(&mut self) {
        // The innermost first; one with files in it is not removed, nor those around it.
        for folder in &self.0 {
            let _ = std::fs::remove_dir(folder);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn empty_folders_are_taken_away_and_all_else_stays() {
        let temp = tempfile::tempdir().expect("a temporary folder");
        let at = |name: &str| temp.path().join(name);
        std::fs::create_dir(at("before")).expect("made");
        for (new, file) in [("a/b/c", None), ("before/d", None), ("e/f", Some("e/kept")), ("before", None)] {
            let folders = NewFolders::to(&at(new));
            std::fs::create_dir_all(at(new)).expect("made");
            file.into_iter().for_each(|file| std::fs::write(at(file), "").expect("written"));
            drop(folders);
        }
        assert!(at("before").is_dir() && !at("before/d").exists() && !at("a").exists());
        assert!(at("e/kept").is_file() && !at("e/f").exists());
    }
}
