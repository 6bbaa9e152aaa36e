//! Sound files to begin with: those of `fuzz/corpus`, and of folders of the repository.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use yair::command::{Watch, call};

/// The files of one input: path in its folder, and bytes.
pub(crate) type Sample = Vec<(String, Vec<u8>)>;

/// The repository: Cargo says where it is when it starts the program. One that is started by hand has been
/// built there, or is told another place.
fn root() -> PathBuf {
    std::env::var_os("CARGO_MANIFEST_DIR").map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")), PathBuf::from)
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut all: Vec<PathBuf> =
        fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path()).collect();
    all.retain(|path| path.is_file());
    all.sort();
    all
}

fn named(path: &Path) -> (String, Vec<u8>) {
    (path.file_name().expect("a name").to_string_lossy().into_owned(), fs::read(path).expect("read"))
}

/// All files of a folder as one sample.
fn together(folder: &str) -> Vec<Sample> {
    vec![files(&root().join(folder)).iter().map(|path| named(path)).collect()]
}

/// Each file of a folder that ends so as a sample.
fn apart(folder: &str, end: &str) -> Vec<Sample> {
    let all = files(&root().join(folder));
    all.iter().filter(|path| path.to_string_lossy().ends_with(end)).map(|path| vec![named(path)]).collect()
}

pub(crate) fn datasets() -> Vec<Sample> {
    together("fuzz/corpus/dataset")
}

pub(crate) fn tables() -> Vec<Sample> {
    apart("fuzz/corpus/csv", ".csv")
}

pub(crate) fn trajectories() -> Vec<Sample> {
    together("fuzz/corpus/tum")
}

pub(crate) fn tuples() -> Vec<Sample> {
    apart("fuzz/corpus/censi", ".tuple")
}

pub(crate) fn optiodom() -> Vec<Sample> {
    together("fuzz/corpus/optiodom")
}

pub(crate) fn calibrations() -> Vec<Sample> {
    apart("fuzz/corpus/calibration", ".toml")
}

pub(crate) fn extended() -> Vec<Sample> {
    apart("fuzz/corpus/extended", ".toml")
}

pub(crate) fn scenarios() -> Vec<Sample> {
    apart("scenarios", ".toml")
}

pub(crate) fn bags() -> Vec<Sample> {
    ["zstd.mcap", "two_topics.mcap"].map(|name| vec![named(&root().join("tests/ros2").join(name))]).into()
}

#[cfg(feature = "db3")]
pub(crate) fn bags_in_sqlite() -> Vec<Sample> {
    apart("fuzz/corpus/db3", ".db3")
}

pub(crate) fn metadata() -> Vec<Sample> {
    together("fuzz/corpus/bag")
}

/// No files: what is odd is made by the target.
pub(crate) fn none() -> Vec<Sample> {
    Vec::new()
}

/// The states of a small sweep in two shards, made here.
pub(crate) fn states() -> Vec<Sample> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scenario = root().join("scenarios/paper.toml");
    let state = |shard: &str| {
        let out = folder.path().join(shard);
        let arguments =
            ["yair", "sweep", &scenario.to_string_lossy(), "--trials", "2", "--shard", &format!("{shard}/2"), "--out"];
        let arguments: Vec<String> =
            arguments.map(str::to_owned).into_iter().chain([out.display().to_string()]).collect();
        let done = call(arguments, &Arc::new(Watch::default()));
        assert_eq!(done.exit_code, 0, "{:?}", done.failure);
        (format!("{shard}/sweep.state.json"), fs::read(out.join("sweep.state.json")).expect("a state"))
    };
    vec![vec![state("1"), state("2")]]
}
