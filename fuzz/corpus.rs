//! Sound files to begin with: those of `fuzz/corpus`, and of folders of the repository.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use yair::command::{Watch, call};
use yair::dataset::{self, Existing, Timestamp};
use yair::scenario::Scenario;
use yair::sim_yair::simulate;

/// The files of one input: path in its folder, and bytes.
pub(crate) type Sample = Vec<(String, Vec<u8>)>;

/// The repository: Cargo says where it is when it starts the program. One that is started by hand has been
/// built there, or is told another place.
fn root() -> PathBuf {
    std::env::var_os("CARGO_MANIFEST_DIR").map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")), PathBuf::from)
}

pub(crate) fn files(folder: &Path) -> Vec<PathBuf> {
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

pub(crate) fn captures() -> Vec<Sample> {
    together("fuzz/corpus/capture")
}

pub(crate) fn motions() -> Vec<Sample> {
    together("fuzz/corpus/motions")
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

pub(crate) fn robot_files() -> Vec<Sample> {
    apart("fuzz/corpus/robot", "")
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

pub(crate) fn bags_in_sqlite() -> Vec<Sample> {
    apart("fuzz/corpus/db3", ".db3")
}

pub(crate) fn bags_of_ros1() -> Vec<Sample> {
    apart("fuzz/corpus/ros1", ".bag")
}

pub(crate) fn metadata() -> Vec<Sample> {
    together("fuzz/corpus/bag")
}

/// What `yair fleet --out` keeps of two sessions of one robot, with their datasets, made here.
pub(crate) fn kept_sessions() -> Vec<Sample> {
    let temporary = tempfile::tempdir().expect("a temporary folder");
    let at = temporary.path();
    let scenario = Scenario::read(&root().join("scenarios/motion-capture.toml")).expect("a scenario");
    for session in 0..2_u32 {
        let mut made = simulate(&scenario, 2, session.into()).expect("simulated").dataset;
        made.provenance.robot_id = Some("cart-1".to_owned());
        made.provenance.recorded = Some(Timestamp::constant(i64::from(86_400 * session), 0));
        dataset::write(&made, &at.join(format!("sets/{session}")), Existing::Refuse).expect("written");
    }
    let folders = ["sets", "kept"].map(|name| at.join(name).display().to_string());
    let done = call(["yair", "fleet", &folders[0], "--calibrate-only", "--out", &folders[1]], &Arc::default());
    assert_eq!(done.exit_code, 0, "{:?}", done.failure);
    let of = |folder: &str| -> Sample {
        let named_in = |path: &PathBuf| {
            let (name, bytes) = named(path);
            (format!("{folder}/{name}"), bytes)
        };
        files(&at.join(folder)).iter().map(named_in).collect()
    };
    vec![["sets/0", "sets/1", "kept/sessions"].into_iter().flat_map(of).collect()]
}

/// The result of a small sweep, which is a baseline too.
pub(crate) fn accuracy_baselines() -> Vec<Sample> {
    let scenario = root().join("scenarios/paper.toml").display().to_string();
    let done = call(["yair", "sweep", &scenario, "--trials", "16"], &Arc::default());
    vec![vec![("baseline.json".to_owned(), done.document.expect("a result").into_bytes())]]
}

pub(crate) fn diagnosis_baselines() -> Vec<Sample> {
    vec![vec![named(&root().join("baselines/diagnosis.json"))]]
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
