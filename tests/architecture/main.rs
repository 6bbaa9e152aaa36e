//! The house holds itself: arrows between crates, folders and headers, scenario files, and documents that say
//! what the command prints.
//!
//! Rejected by what was tried: an edge from `calib` to `effects`, a crate that no table lists, a changed
//! digit in the README's table, a command in the README that CI does not run, an effect's parameter missing
//! in docs/scenario.md.

mod arrows;
mod commands;
mod depth;
mod documents;
mod effect_ids;
mod english;
mod examples;
mod file_graph;
mod files;
mod packages;
mod parameters;
mod pictures;
mod python;
mod settings;
mod size;
#[path = "../support/mod.rs"]
mod support;
mod words;

use std::fs;
use std::path::{Path, PathBuf};

pub(crate) fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

pub(crate) fn text(path: impl AsRef<Path>) -> String {
    let path = root().join(path);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Files under a folder of the repository, by path; what is built or belongs to version control is left out.
pub(crate) fn files(folder: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![root().join(folder)];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display())) {
            let path = entry.expect("readable").path();
            // A file, too: `.git` of a second worktree. Packages are others' sources.
            let left_out =
                ["target", ".git", "tests/browser/node_modules"].iter().any(|name| path == root().join(name));
            if path.is_dir() && !left_out {
                folders.push(path);
            } else if path.is_file() && !left_out {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}
