//! Links: results are written through none, and a bag is read from its folder alone.

use std::fs;
use std::os::unix::fs::symlink;

use crate::support::{refusal, run_in, succeed};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

#[test]
fn results_are_not_written_through_a_link() {
    let temp = tempfile::tempdir().expect("a folder");
    let here = temp.path();
    fs::create_dir(here.join("private")).expect("made");
    for (name, target) in [("linked", "private"), ("dangling", "nowhere")] {
        symlink(target, here.join(name)).expect("a link");
    }
    let robot = &format!("{ROOT}/tests/evo/robot");
    let scenario = &format!("{ROOT}/scenarios/paper.toml");
    let bag = &format!("{ROOT}/tests/ros2/zstd.mcap");
    succeed(here, &["calibrate", robot, "--out", "c.toml"]);
    let commands: &[&[&str]] = &[
        &["simulate", scenario, "--out"],
        &["import", "ros2", bag, "--wheel", "0.15", "--base", "0.3", "--out"],
        &["calibrate", robot, "--out-dir"],
        &["evaluate", robot, "--out-dir"],
        &["diagnose", robot, "--out"],
        &["correct", robot, "--calibration", "c.toml", "--out"],
        &["export", "tum", robot, "--out"],
        &["fleet", robot, "--out"],
        &["sweep", scenario, "--trials", "2", "--out"],
        &["challenge", "--cases", "2", "--shard", "1/2", "--out"],
        &["reproduce", "--out"],
        &["demo", "--out"],
        &["man", "--out"],
    ];
    for command in commands {
        for (out, target) in [("linked", "private"), ("linked/", "private"), ("dangling", "nowhere")] {
            let ended = run_in(here, &[command, &[out][..]].concat());
            let is_told = ended.stderr.contains(&format!("{out}: the folder is a link to {target}"));
            assert!(ended.code == Some(1) && is_told, "{command:?} {out}: {:?} {}", ended.code, ended.stderr);
        }
    }
    assert_eq!(here.join("private").read_dir().expect("readable").count(), 0);
    assert!(!here.join("nowhere").exists());
    // A folder behind a link of its path is the one that was named.
    succeed(here, &["calibrate", robot, "--out-dir", "linked/pages"]);
    assert!(here.join("private/pages/report.html").is_file());
}

#[test]
fn a_bag_is_read_from_its_folder_alone() {
    let temp = tempfile::tempdir().expect("a folder");
    let here = temp.path();
    let import = ["import", "ros2", "bag", "--list"];
    fs::create_dir(here.join("bag")).expect("made");
    fs::copy(format!("{ROOT}/tests/ros2/zstd.mcap"), here.join("elsewhere.mcap")).expect("copied");
    symlink("../elsewhere.mcap", here.join("bag/bag_0.mcap")).expect("a link");
    let metadata = "rosbag2_bagfile_information:\n  storage_identifier: mcap\n  relative_file_paths:\n  - bag_0.mcap\n";
    for text in [None, Some(metadata)] {
        if let Some(text) = text {
            fs::write(here.join("bag/metadata.yaml"), text).expect("written");
        }
        let message = refusal(here, &import);
        assert!(message.contains("bag_0.mcap: a link to ") && message.contains("outside of the bag"), "{message}");
    }
    // The file named by itself, and a link that stays inside.
    succeed(here, &["import", "ros2", "bag/bag_0.mcap", "--list"]);
    fs::remove_file(here.join("bag/bag_0.mcap")).expect("removed");
    fs::rename(here.join("elsewhere.mcap"), here.join("bag/data")).expect("moved");
    symlink("data", here.join("bag/bag_0.mcap")).expect("a link");
    succeed(here, &import);
    fs::rename(here.join("bag/metadata.yaml"), here.join("metadata.yaml")).expect("moved");
    symlink("../metadata.yaml", here.join("bag/metadata.yaml")).expect("a link");
    let message = refusal(here, &import);
    assert!(message.contains("metadata.yaml: a link to "), "{message}");
}
