//! The Python package is a member of the workspace that nothing else needs.

use crate::text;

/// The same numbers to the last bit need the same packages and the same profile; so does sharing what is
/// built. Who builds the command needs no Python.
#[test]
fn python_is_built_with_the_workspace_and_nothing_is_built_of_it() {
    let manifest = |path: &str| text(path).parse::<toml::Table>().unwrap_or_else(|error| panic!("{path}: {error}"));
    let (workspace, python) = (manifest("Cargo.toml"), manifest("python/Cargo.toml"));
    let is_of_workspace = |table: &toml::Value, key: &str| table[key]["workspace"].as_bool() == Some(true);
    for key in ["version", "edition", "rust-version", "license"] {
        assert!(is_of_workspace(&python["package"], key), "{key}");
    }
    assert_eq!(python["lints"]["workspace"].as_bool(), Some(true));
    assert_eq!(workspace["workspace"]["lints"]["rust"]["unsafe_code"].as_str(), Some("forbid"));
    assert!(
        !python.contains_key("profile")
            && !workspace["workspace"].as_table().expect("a table").contains_key("default-members")
    );
    let members = workspace["workspace"]["members"].as_array().expect("members");
    assert!(members.iter().any(|member| member.as_str() == Some("python")));
    let needs: Vec<&str> = python["dependencies"].as_table().expect("a table").keys().map(String::as_str).collect();
    assert_eq!(needs, ["numpy", "pyo3", "yair"], "Python uses the front door alone");
    // Everything that is built without --workspace.
    let lock = manifest("Cargo.lock");
    let packages = lock["package"].as_array().expect("packages");
    let users = packages.iter().filter(|package| {
        let needs = package.get("dependencies").and_then(toml::Value::as_array);
        needs.is_some_and(|needs| needs.iter().any(|need| need.as_str() == Some("pyo3")))
    });
    let users: Vec<_> = users.map(|package| package["name"].as_str().expect("a name")).collect();
    assert_eq!(users, ["numpy", "yair-python"]);
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
