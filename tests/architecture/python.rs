//! The Python package stands outside of the workspace, and is built of what the workspace is built of.

use std::collections::BTreeMap;

use toml::{Table, Value};

use crate::text;

fn toml(path: &str) -> Table {
    text(path).parse().unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// Versions of every package of a lock file.
fn versions(path: &str) -> BTreeMap<String, Vec<String>> {
    let lock = toml(path);
    let text_of = |package: &Value, key: &str| package[key].as_str().expect("a text").to_owned();
    let mut versions: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for package in lock["package"].as_array().expect("packages") {
        versions.entry(text_of(package, "name")).or_default().push(text_of(package, "version"));
    }
    versions
}

/// The same numbers to the last bit need the same packages and the same profile; so does sharing what is
/// built.
#[test]
fn python_is_built_of_the_packages_and_by_the_profiles_of_the_workspace() {
    let (ours, theirs) = (versions("Cargo.lock"), versions("python/Cargo.lock"));
    let differing: Vec<_> = theirs
        .iter()
        .filter(|(name, of)| ours.get(*name).is_some_and(|known| of.iter().all(|version| !known.contains(version))))
        .collect();
    assert!(theirs.len() > 100 && theirs.contains_key("pyo3"), "{} packages", theirs.len());
    assert!(differing.is_empty(), "python/Cargo.lock has other versions than Cargo.lock: {differing:?}");
    let (workspace, python) = (toml("Cargo.toml"), toml("python/Cargo.toml"));
    let release = |manifest: &Table| {
        let mut release = manifest["profile"]["release"].as_table().expect("a profile").clone();
        (release.remove("package"), release)
    };
    let ((of_ours, ours), (of_theirs, theirs)) = (release(&workspace), release(&python));
    assert_eq!(ours, theirs, "[profile.release] of Cargo.toml and of python/Cargo.toml");
    // Packages that the Python package does not have may be missing there.
    let (Some(Value::Table(of_ours)), Some(Value::Table(of_theirs))) = (of_ours, of_theirs) else {
        panic!("no [profile.release.package]")
    };
    let locked = versions("python/Cargo.lock");
    let expected: Table = of_ours.into_iter().filter(|(name, _)| locked.contains_key(name)).collect();
    assert_eq!(expected, of_theirs, "[profile.release.package] of python/Cargo.toml");
}

#[test]
fn python_has_the_workspaces_version_and_forbids_unsafe_code() {
    let (workspace, python) = (toml("Cargo.toml"), toml("python/Cargo.toml"));
    for key in ["version", "edition", "rust-version", "license"] {
        assert_eq!(python["package"][key], workspace["workspace"]["package"][key], "{key}");
    }
    assert_eq!(python["lints"]["rust"]["unsafe_code"].as_str(), Some("forbid"));
    assert_eq!(workspace["workspace"]["exclude"], Value::Array(vec!["python".into()]));
}

/// What tests in Python download is what was looked at once.
#[test]
fn every_package_that_tests_in_python_need_has_its_hashes() {
    for of in ["requirements", "requirements-cluster"] {
        let locked = text(format!("python/tests/{of}.txt")).replace("\\\n", " ");
        let packages: Vec<&str> = locked.lines().filter(|line| !line.starts_with('#')).collect();
        let is_pinned = |line: &&str| line.contains("==") && line.contains(" --hash=sha256:");
        let open: Vec<_> = packages.iter().filter(|line| !is_pinned(line)).collect();
        assert!(open.is_empty(), "{of}.txt: {open:?}");
        for asked in text(format!("python/tests/{of}.in")).lines() {
            assert!(packages.iter().any(|line| line.starts_with(&format!("{asked} "))), "{of}.txt has no {asked}");
        }
        assert!(text(".ci/run").contains(&format!("--require-hashes --requirement python/tests/{of}.txt")));
    }
}
