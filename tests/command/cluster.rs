//! A campaign on many machines: shards as clusters name them, the shipped job files, and folders that belong
//! to one process.
//!
//! Rejected by what was tried: Kubernetes' index counted from 1, a lock that is given up before the results
//! stand, a job file whose number of shards differs from the number of its tasks.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use bench::FolderLock;
use serde_json::Value;
use yaml_rust2::{Yaml, YamlLoader};

use crate::support::{refusal, run_in, succeed};

const YAIR: &str = env!("CARGO_BIN_EXE_yair");

/// Variables that the machine running these tests may have.
const CLUSTER: [&str; 4] = ["YAIR_SHARD", "YAIR_SHARDS", "SLURM_ARRAY_TASK_ID", "JOB_COMPLETION_INDEX"];

fn scenario() -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/paper.toml").display().to_string()
}

fn example(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/cluster").join(name)
}

/// A program in a folder, with these variables of a cluster and no others.
fn with(program: &str, folder: &Path, variables: &[(&str, &str)], arguments: &[&str]) -> Output {
    let mut command = Command::new(program);
    CLUSTER.iter().for_each(|name| {
        command.env_remove(name);
    });
    command.current_dir(folder).envs(variables.iter().copied()).args(arguments).output().expect("starts")
}

#[track_caller]
fn succeeded(output: &Output) {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// The result of the whole campaign in `folder/whole`, and of its shards.
fn merged_is_whole(folder: &Path, shards: &[String]) {
    succeed(folder, &["sweep", &scenario(), "--trials", "24", "--out", "whole", "--quiet"]);
    let shards: Vec<&str> = shards.iter().map(String::as_str).collect();
    succeed(folder, &[&["merge"], &shards[..], &["--out", "merged", "--quiet"]].concat());
    for file in ["sweep.json", "sweep.csv"] {
        let [whole, merged] = ["whole", "merged"].map(|of| fs::read(folder.join(of).join(file)).expect("written"));
        assert!(whole == merged, "{file}");
    }
    assert!(!folder.join("whole/sweep.lock").exists(), "a lock is left");
}

#[cfg(unix)]
#[test]
fn the_slurm_file_computes_the_whole_campaign() {
    let temporary = tempfile::tempdir().expect("a folder");
    let folder = temporary.path();
    let script = example("slurm.sh");
    let text = fs::read_to_string(&script).expect("shipped");
    let array = text.lines().find_map(|line| line.strip_prefix("#SBATCH --array=1-")).expect("an array");
    assert!(text.contains(&format!("YAIR_SHARDS:-{array}}}")), "the array and YAIR_SHARDS differ");
    let path = format!(
        "{}:{}",
        Path::new(YAIR).parent().expect("in a folder").display(),
        std::env::var("PATH").unwrap_or_default()
    );
    for task in ["1", "2", "3"] {
        let variables = [("PATH", &path[..]), ("SLURM_ARRAY_TASK_ID", task), ("YAIR_SHARDS", "3")];
        let arguments = [&script.display().to_string(), &scenario(), "results", "--trials", "24"];
        // Again, as a task that is submitted again: it is there already.
        for _ in 0..2 {
            succeeded(&with("bash", folder, &variables, &arguments));
        }
    }
    merged_is_whole(folder, &["1", "2", "3"].map(|task| format!("results/shard-{task}")));
}

#[test]
fn the_kubernetes_file_computes_the_whole_campaign() {
    let temporary = tempfile::tempdir().expect("a folder");
    let folder = temporary.path();
    let text = fs::read_to_string(example("kubernetes.yaml")).expect("shipped");
    let job = &YamlLoader::load_from_str(&text).expect("YAML")[0];
    let spec = &job["spec"];
    let container = &spec["template"]["spec"]["containers"][0];
    assert_eq!(spec["completionMode"].as_str(), Some("Indexed"));
    let shards = spec["completions"].as_i64().expect("a number").to_string();
    assert_eq!(container["env"][0]["name"].as_str(), Some("YAIR_SHARDS"));
    assert_eq!(container["env"][0]["value"].as_str(), Some(&shards[..]));
    let command = container["command"].as_vec().expect("a list");
    let command: Vec<&str> = command.iter().filter_map(Yaml::as_str).collect();
    assert_eq!(command[0], "yair");
    let mut folders = Vec::new();
    for index in 0..2 {
        let index = index.to_string();
        let place = |word: &&str| {
            let here = word.replace("/campaign/scenario.toml", &scenario()).replace("/campaign/", "");
            here.replace("$(JOB_COMPLETION_INDEX)", &index)
        };
        let mut arguments: Vec<String> = command[1..].iter().map(place).collect();
        folders.push(arguments.last().expect("the folder").clone());
        arguments.extend(["--trials", "24"].map(str::to_owned));
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        succeeded(&with(YAIR, folder, &[("JOB_COMPLETION_INDEX", &index), ("YAIR_SHARDS", "2")], &arguments));
    }
    merged_is_whole(folder, &folders);
}

#[test]
fn a_shard_that_nothing_names_is_refused_and_one_that_is_named_is_said() {
    let temporary = tempfile::tempdir().expect("a folder");
    let arguments = ["sweep", &scenario(), "--trials", "2", "--shard", "auto", "--out", "part"];
    let stderr = |variables: &[(&str, &str)], code: i32| {
        let output = with(YAIR, temporary.path(), variables, &arguments);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{text}");
        text
    };
    let none = stderr(&[], 1);
    assert!(none.starts_with("error: --shard auto: none of YAIR_SHARD") && none.lines().count() == 1, "{none}");
    assert!(stderr(&[("JOB_COMPLETION_INDEX", "1")], 1).contains("set YAIR_SHARDS to the Job's completions"));
    assert!(!temporary.path().join("part").exists(), "nothing is made before the shard is known");
    assert!(stderr(&[("YAIR_SHARD", "2/3")], 0).contains("shard 2/3, by YAIR_SHARD"));
}

#[test]
fn a_folder_belongs_to_one_process() {
    let temporary = tempfile::tempdir().expect("a folder");
    let folder = temporary.path();
    let arguments = ["sweep", &scenario(), "--trials", "2", "--shard", "1/2", "--out", "part", "--resume"];
    // This process has it.
    let lock = FolderLock::take(&folder.join("part")).expect("free");
    let refused = refusal(folder, &arguments);
    assert!(refused.starts_with("part: another process is running a sweep there; "), "{refused}");
    drop(lock);
    succeed(folder, &arguments);
    assert_eq!(fs::read_dir(folder.join("part")).expect("there").count(), 1, "the state alone");
}

#[test]
fn of_two_processes_that_begin_at_once_one_ends_well() {
    let temporary = tempfile::tempdir().expect("a folder");
    let folder = temporary.path();
    // The later one meets the lock, or the state that the earlier one has left.
    let arguments = ["sweep", &scenario(), "--trials", "200", "--shard", "1/2", "--out", "part", "--jobs", "1"];
    let codes: Vec<Option<i32>> = std::thread::scope(|scope| {
        let both = [(); 2].map(|()| scope.spawn(|| run_in(folder, &arguments).code));
        both.into_iter().map(|one| one.join().expect("runs")).collect()
    });
    assert!(codes == [Some(0), Some(1)] || codes == [Some(1), Some(0)], "{codes:?}");
}

#[test]
fn parts_of_the_blind_benchmark_merge_to_the_bytes_of_one_machine() {
    let temporary = tempfile::tempdir().expect("a folder");
    let folder = temporary.path();
    let campaign = ["challenge", "--cases", "3", "--seed", "5", "--quiet"];
    let part = |shard: &str, out: &str| {
        succeed(folder, &[&campaign[..], &["--shard", shard, "--out", out]].concat());
    };
    part("1/2", "a");
    part("2/2", "b");
    let merge = ["challenge", "--json", "--merge"];
    let merged = succeed(folder, &[&merge[..], &["b", "a"]].concat()).stdout;
    assert_eq!(merged, succeed(folder, &[&campaign[..], &["--json"]].concat()).stdout);
    part("1/1", "whole");
    succeed(folder, &["challenge", "--cases", "1", "--seed", "6", "--shard", "2/2", "--out", "other", "--quiet"]);
    for (parts, why) in [
        (&["a"][..], "the parts after 1/2 are missing"),
        (&["b"], "part 1/2 is missing"),
        (&["a", "a"], "part 1/2 is given twice"),
        (&["a", "other"], "seed: 6"),
        (&["a", "whole"], "given twice"),
        (&["nothing"], "no challenge.shard.json"),
    ] {
        let refused = refusal(folder, &[&merge[..], parts].concat());
        assert!(refused.contains(why), "{parts:?}: {refused}");
    }
}

/// Parts are files that anybody may have written: numbers of no case and cases of no part are refused.
#[test]
fn a_part_that_no_campaign_can_have_made_is_not_merged() {
    let temporary = tempfile::tempdir().expect("a folder");
    let folder = temporary.path();
    let campaign = ["challenge", "--cases", "2", "--seed", "5", "--shard", "1/1", "--out", "part", "--quiet"];
    succeed(folder, &campaign);
    let file = folder.join("part/challenge.shard.json");
    let sound: Value = serde_json::from_slice(&fs::read(&file).expect("read")).expect("JSON");
    let merge = ["challenge", "--merge", "part"];
    let scored = |outcome: &Value| outcome.get("scored").is_some();
    let first = sound["outcomes"].as_array().expect("a list").iter().position(scored).expect("a case that was driven");
    let with = |pointer: &str, text: &str| {
        let mut changed = sound.clone();
        *changed.pointer_mut(&pointer.replace('#', &format!("/outcomes/{first}/scored"))).expect(pointer) =
            "here".into();
        let text = serde_json::to_string(&changed).expect("JSON").replace("\"here\"", text);
        fs::write(&file, text).expect("written");
        refusal(folder, &merge)
    };
    let reported = r#"[{"names":["x"],"probability":2.0,"z":1.0,"covered":[],"errors":[],"sentence":""}]"#;
    for (pointer, text) in [
        ("#/drawn/sigma_xy_m", "1e999"),
        ("#/drawn/sigma_xy_m", "1e308"),
        ("#/drawn/wheel_separation_m", "-0.3"),
        ("#/drawn/lost_row_share", "1.5"),
        ("#/drawn/ripple", "[1e61, 1.0]"),
        ("#/gain", "[0.0, -1e308]"),
        ("#/other_session", "1e61"),
        ("#/said", reported),
        ("#/said", &reported.replace("2.0", "0.5").replace("1.0", "1e61")),
        ("#/said", &reported.replace("2.0", "0.5").replace(r#""errors":[]"#, r#""errors":[-1e308]"#)),
    ] {
        let why = with(pointer, text);
        assert!(
            why.contains("part/challenge.shard.json: not a part of a blind benchmark"),
            "{pointer} = {text}: {why}"
        );
    }
    // The part of two cases has both, each once.
    for (pointer, text) in [("#/case", "7"), ("/outcomes", "[]"), ("/campaign/cases", "3"), ("/campaign/cases", "1")] {
        let why = with(pointer, text);
        assert!(why.contains("part: its cases are not those of part 1/1"), "{pointer} = {text}: {why}");
    }
    fs::write(&file, serde_json::to_vec(&sound).expect("JSON")).expect("written");
    succeed(folder, &merge);
}
