//! Every crate can be packaged: it says what it is, and builds from its own folder. `.ci/run package` asks
//! Cargo itself, which takes minutes.

use std::fs;
use std::path::{Component, Path, PathBuf};

use crate::arrows::ARROWS;
use crate::{files, root, text};

/// What a package's page on a registry shows; the repository and a home page are not known.
const METADATA: [&str; 9] =
    ["description", "readme", "keywords", "categories", "version", "edition", "rust-version", "license", "publish"];

/// Lines of a crate's README: what it is and its main types, with an example; the rest is its documentation.
const README_LINES: std::ops::RangeInclusive<usize> = 10..=32;

/// Manifest keys of crates.io: at most five keywords of at most 20 letters.
const MAX_KEYWORDS: usize = 5;
const MAX_KEYWORD_LETTERS: usize = 20;

/// What the manifest states is what README promises, and what CI compiles with: a newer compiler would accept
/// what the stated one refuses.
#[test]
fn the_stated_version_of_rust_is_that_of_readme_and_of_ci() {
    let manifest: toml::Table = text("Cargo.toml").parse().expect("TOML");
    let stated = manifest["workspace"]["package"]["rust-version"].as_str().expect("a version").to_owned();
    assert!(text("README.md").contains(&format!("needs Rust {stated} ")), "README.md does not say {stated}");
    if std::env::var("CI").is_ok_and(|ci| ci == "true") {
        let output = std::process::Command::new("rustc").arg("--version").output().expect("rustc runs");
        let version = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(version.starts_with(&format!("rustc {stated}.")), "CI has {version}");
    }
}

#[test]
fn every_crate_says_what_it_is() {
    let readmes = text("src/readmes.rs");
    for (name, _) in ARROWS {
        let folder = if *name == "yair" { String::new() } else { format!("crates/{name}/") };
        let manifest: toml::Table = toml::from_str(&text(format!("{folder}Cargo.toml"))).expect("a manifest");
        let package = manifest["package"].as_table().expect("a package");
        for key in METADATA {
            assert!(package.contains_key(key), "{folder}Cargo.toml has no {key}");
        }
        let keywords: Vec<&str> =
            package["keywords"].as_array().expect("a list").iter().filter_map(toml::Value::as_str).collect();
        let fits = |word: &&str| word.len() <= MAX_KEYWORD_LETTERS && !word.contains(' ');
        assert!(keywords.len() <= MAX_KEYWORDS && keywords.iter().all(fits), "{folder}Cargo.toml: {keywords:?}");
        if *name == "yair" {
            continue;
        }
        let path = format!("{folder}README.md");
        let readme = text(&path);
        assert!(readme.starts_with(&format!("# {name}\n")), "{path} begins with the crate's name");
        assert!(README_LINES.contains(&readme.lines().count()), "{path}: {} lines", readme.lines().count());
        assert!(readme.contains("```rust\n"), "{path} has an example");
        assert!(readmes.contains(&format!("include_str!(\"../{path}\")")), "src/readmes.rs does not run {path}");
    }
}

/// Every path in a source that is read from beside it: of `include_str!`, `include_bytes!`, `#[path]`, and
/// what is joined to the manifest's folder.
fn paths_in(source: &str, file: &Path, folder: &Path) -> Vec<PathBuf> {
    let here = file.parent().expect("in a folder");
    let quoted = |rest: &str| rest.split('"').next().unwrap_or_default().to_owned();
    let beside = ["include_str!(\"", "include_bytes!(\"", "#[path = \""];
    let beside = beside.iter().flat_map(|mark| source.split(mark).skip(1).map(|rest| here.join(quoted(rest))));
    let joined = concat!("env!(\"CARGO_MANIFEST", "_DIR\")).join(\"");
    beside.chain(source.split(joined).skip(1).map(|rest| folder.join(quoted(rest)))).collect()
}

/// Whether a path with its `..` taken out lies under a folder.
fn is_under(path: &Path, folder: &Path) -> bool {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => {
                plain.pop();
            }
            part => plain.push(part),
        }
    }
    plain.starts_with(folder)
}

#[test]
fn no_source_of_a_package_reads_a_file_outside_of_it() {
    for (name, _) in ARROWS.iter().filter(|(name, _)| *name != "yair") {
        let folder = root().join("crates").join(name);
        let manifest: toml::Table = toml::from_str(&text(folder.join("Cargo.toml"))).expect("a manifest");
        let excluded: Vec<String> = manifest["package"]
            .get("exclude")
            .and_then(toml::Value::as_array)
            .map(|list| list.iter().filter_map(toml::Value::as_str).map(|of| of.trim_end_matches("/**").to_owned()))
            .into_iter()
            .flatten()
            .collect();
        for file in files(&format!("crates/{name}")) {
            let is_packaged = !excluded.iter().any(|of| file.starts_with(folder.join(of)));
            if file.extension().is_none_or(|extension| extension != "rs") || !is_packaged {
                continue;
            }
            for path in paths_in(&text(&file), &file, &folder) {
                assert!(is_under(&path, &folder), "{}: {} is in no package of {name}", file.display(), path.display());
            }
        }
    }
}

#[test]
fn a_path_that_leaves_its_package_is_found() {
    let (file, folder) = (Path::new("/crates/a/src/b/c.rs"), Path::new("/crates/a"));
    let paths = |source: &str| paths_in(source, file, folder);
    for inside in ["include_str!(\"../../data/x.toml\")", "include_bytes!(\"d.bin\")", "#[path = \"../e.rs\"]"] {
        assert!(paths(inside).iter().all(|path| is_under(path, folder)) && paths(inside).len() == 1, "{inside}");
    }
    let joined = concat!("env!(\"CARGO_MANIFEST", "_DIR\")).join(\"../b\")");
    for outside in ["include_str!(\"../../../data/x.toml\")", "#[path = \"../../../b/e.rs\"]", joined] {
        assert!(paths(outside).iter().any(|path| !is_under(path, folder)), "{outside}");
    }
}

/// Scenarios that a package has a copy of.
const COPIES: [&str; 2] = ["paper.toml", "motion-capture.toml"];

#[test]
fn copies_of_shipped_scenarios_are_equal_to_them() {
    for name in COPIES {
        let copy = format!("crates/scenario/src/shipped/{name}");
        assert!(
            fs::read(root().join(&copy)).ok() == fs::read(root().join("scenarios").join(name)).ok(),
            "{copy} is another file than scenarios/{name}; copy it again"
        );
    }
}
