//! Who may use whom among the crates, as Cargo has it.

use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

use crate::root;

/// Who may use whom, dev- and build-dependencies too. `estimation` and `calib` never link what could tell
/// them the truth.
pub(crate) const ARROWS: &[(&str, &[&str])] = &[
    ("speed-gate", &[]),
    ("plain-robot", &[]),
    ("rules", &[]),
    ("kinematics", &[]),
    ("atomic-file", &[]),
    ("dataset", &["kinematics", "atomic-file", "rules"]),
    ("ros-bag", &["kinematics", "atomic-file", "rules", "dataset"]),
    ("robot-files", &["kinematics"]),
    ("motion-programs", &["kinematics", "atomic-file", "rules", "dataset"]),
    ("model-term", &["kinematics", "atomic-file", "rules", "dataset"]),
    ("preflight", &["kinematics", "atomic-file", "rules", "dataset"]),
    ("effects", &["kinematics", "atomic-file", "rules", "dataset", "model-term"]),
    ("scenario", &["kinematics", "atomic-file", "rules", "dataset", "motion-programs", "model-term", "effects"]),
    (
        "sim-yair",
        &["kinematics", "atomic-file", "rules", "dataset", "motion-programs", "model-term", "effects", "scenario"],
    ),
    ("estimation", &["kinematics", "atomic-file", "rules", "dataset", "model-term", "preflight"]),
    (
        "calib",
        &["kinematics", "atomic-file", "rules", "dataset", "motion-programs", "model-term", "preflight", "estimation"],
    ),
    (
        "diagnose",
        &[
            "kinematics",
            "atomic-file",
            "rules",
            "dataset",
            "motion-programs",
            "model-term",
            "effects",
            "scenario",
            "preflight",
            "estimation",
            "calib",
        ],
    ),
    (
        "export",
        &[
            "kinematics",
            "atomic-file",
            "rules",
            "dataset",
            "motion-programs",
            "model-term",
            "effects",
            "scenario",
            "preflight",
            "estimation",
            "calib",
            "diagnose",
            "robot-files",
        ],
    ),
    (
        "fleet",
        &[
            "kinematics",
            "atomic-file",
            "rules",
            "dataset",
            "motion-programs",
            "model-term",
            "preflight",
            "estimation",
            "calib",
        ],
    ),
    ("report", &["atomic-file"]),
    ("report-page", &[]),
    (
        "bench",
        &[
            "kinematics",
            "atomic-file",
            "rules",
            "dataset",
            "motion-programs",
            "model-term",
            "effects",
            "scenario",
            "sim-yair",
            "preflight",
            "estimation",
            "calib",
            "report",
        ],
    ),
    (
        "blind-benchmark",
        &[
            "kinematics",
            "atomic-file",
            "rules",
            "dataset",
            "motion-programs",
            "model-term",
            "effects",
            "scenario",
            "sim-yair",
            "preflight",
            "estimation",
            "calib",
            "diagnose",
        ],
    ),
    (
        "replay",
        &[
            "kinematics",
            "atomic-file",
            "rules",
            "dataset",
            "motion-programs",
            "model-term",
            "effects",
            "scenario",
            "sim-yair",
            "preflight",
            "estimation",
            "calib",
            "diagnose",
            "plain-robot",
            "blind-benchmark",
        ],
    ),
    (
        "paper-reproduction",
        &[
            "kinematics",
            "atomic-file",
            "rules",
            "dataset",
            "motion-programs",
            "model-term",
            "effects",
            "scenario",
            "sim-yair",
            "preflight",
            "estimation",
            "calib",
            "report",
            "bench",
        ],
    ),
    (
        "yair",
        &[
            "kinematics",
            "atomic-file",
            "rules",
            "dataset",
            "motion-programs",
            "model-term",
            "effects",
            "scenario",
            "sim-yair",
            "preflight",
            "estimation",
            "calib",
            "diagnose",
            "report",
            "report-page",
            "robot-files",
            "ros-bag",
            "bench",
            "blind-benchmark",
            "paper-reproduction",
            "export",
            "fleet",
            "plain-robot",
            "replay",
        ],
    ),
];

/// Every crate of the workspace with the crates of the workspace that it depends on, in any way.
fn crates() -> BTreeMap<String, BTreeSet<String>> {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--no-deps", "--offline", "--format-version", "1"])
        .current_dir(root())
        .output()
        .expect("cargo runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let list = |value: &serde_json::Value| value.as_array().cloned().unwrap_or_default();
    let name = |value: &serde_json::Value| value["name"].as_str().unwrap_or_default().to_owned();
    // `speed-gate` times things and knows none of them: every crate's benches may use it.
    let is_timing = |dependency: &serde_json::Value| dependency["name"] == "speed-gate" && dependency["kind"] == "dev";
    let ours = |dependency: &&serde_json::Value| dependency["path"].is_string() && !is_timing(dependency);
    // Python uses the front door alone (`tests/architecture/python.rs`).
    list(&metadata["packages"])
        .iter()
        .filter(|package| package["name"] != "yair-python")
        .map(|package| (name(package), list(&package["dependencies"]).iter().filter(ours).map(name).collect()))
        .collect()
}

/// What the crates do that the arrows do not allow.
fn complaints(crates: &BTreeMap<String, BTreeSet<String>>) -> Vec<String> {
    let mut complaints = Vec::new();
    for (user, used) in crates {
        let Some((_, allowed)) = ARROWS.iter().find(|(name, _)| name == user) else {
            complaints.push(format!(
                "crate {user} has no place: add it to ARROWS in tests/architecture/arrows.rs and to the rooms of ARCHITECTURE.md"
            ));
            continue;
        };
        let wrong = used.iter().filter(|used| !allowed.contains(&used.as_str()));
        complaints
            .extend(wrong.map(|used| format!("{user} must not depend on {used} (the arrows in ARCHITECTURE.md)")));
    }
    complaints
}

#[test]
fn the_arrows_between_crates_hold() {
    let crates = crates();
    assert_eq!(complaints(&crates), Vec::<String>::new());
    assert_eq!(crates.len(), ARROWS.len(), "crates and table: {:?}", crates.keys());
    // What is allowed directly is allowed through others: no arrow can be walked round.
    for (user, allowed) in ARROWS {
        for (_, further) in ARROWS.iter().filter(|(name, _)| allowed.contains(name)) {
            assert!(further.iter().all(|used| allowed.contains(used)), "{user} reaches more than it may use");
        }
    }
}

#[test]
fn the_arrows_reject_an_estimator_that_links_the_truth_and_a_room_that_nobody_knows() {
    let edge = |user: &str, used: &str| BTreeMap::from([(user.to_owned(), BTreeSet::from([used.to_owned()]))]);
    for estimator in ["estimation", "calib"] {
        for truth in ["effects", "scenario", "sim-yair", "bench"] {
            assert_eq!(complaints(&edge(estimator, truth)).len(), 1, "{estimator} {truth}");
        }
    }
    assert_eq!(complaints(&edge("diagnose", "sim-yair")).len(), 1);
    assert_eq!(complaints(&edge("kinematics", "dataset")).len(), 1);
    assert_eq!(complaints(&edge("calib", "dataset")).len(), 0);
    let unknown = complaints(&edge("attic", "kinematics"));
    assert!(unknown.len() == 1 && unknown[0].contains("add it to ARROWS"), "{unknown:?}");
}

/// Packages with their features as Cargo builds them for some arguments. Cargo may download: it asks for
/// packages of other machines too, which the build of this one did not fetch.
fn packages_with_features(arguments: &[&str]) -> BTreeSet<String> {
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--locked", "--prefix", "none", "--no-dedupe", "-f", "{p} [{f}]"])
        .args(arguments)
        .current_dir(root())
        .output()
        .expect("cargo runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).lines().map(str::to_owned).collect()
}

/// A package with fewer features than the tests' is built a second time for the command, and with it all that
/// stands on it.
#[test]
fn the_command_is_built_of_what_the_tests_are_built_of() {
    let tests = packages_with_features(&["--workspace", "-e", "normal,build,dev"]);
    let command = packages_with_features(&["-p", "yair", "-e", "normal,build"]);
    let twice: Vec<&String> = command.difference(&tests).collect();
    assert!(command.len() > 100 && twice.is_empty(), "built twice: {twice:?}");
}
