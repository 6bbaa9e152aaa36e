//! The folders are there, every source file says what it is, no file names a machine, and every scenario file
//! can be simulated.

use std::fs;
use std::path::PathBuf;

use scenario::Scenario;
use sim_yair::SimulatedRobot;

use crate::arrows::ARROWS;
use crate::{files, root, text};

/// Names that say nothing of what is inside.
const NO_NOUNS: [&str; 4] = ["utils", "common", "core", "helpers"];

/// Past this many lines a file is likely two nouns.
const LONGEST_FILE_LINES: usize = 500;

/// Columns of a comment: what is read at a glance.
const WIDEST_COMMENT: usize = 110;

#[test]
fn the_rooms_are_there_and_every_file_says_what_it_is() {
    for folder in ["src", "crates", "scenarios", "tests", "benches", "examples", "docs", ".ci"] {
        assert!(root().join(folder).is_dir(), "the house has a folder {folder}");
    }
    for (name, _) in ARROWS {
        assert!(!NO_NOUNS.contains(name), "{name} is no noun of this field");
        assert!(*name == "yair" || root().join("crates").join(name).join("src/lib.rs").is_file(), "{name}");
        assert!(text("ARCHITECTURE.md").contains(&format!("`{name}`")), "ARCHITECTURE.md does not speak of {name}");
    }
    let sources = files("crates").into_iter().chain(files("src")).chain(files("tests")).chain(files("examples"));
    for file in sources.filter(|file| file.extension().is_some_and(|extension| extension == "rs")) {
        let stem = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        assert!(!NO_NOUNS.contains(&stem.as_str()), "{}: a helper lives with its noun", file.display());
        let source = text(&file);
        assert!(source.starts_with("//! "), "{}: the first line must be a //! header", file.display());
        let lines = source.lines().count();
        assert!(lines <= LONGEST_FILE_LINES, "{}: {lines} lines; are there two nouns?", file.display());
        // A table's row, a link or a list in a comment cannot be broken.
        let is_wide = |line: &&str| {
            let comment = line.trim_start();
            let prose = comment.trim_start_matches(['/', '!']).trim_start();
            let breaks = !prose.starts_with('|') && prose.split_whitespace().count() > 1;
            comment.starts_with("//") && breaks && line.chars().count() > WIDEST_COMMENT
        };
        let wide: Vec<&str> = source.lines().filter(is_wide).collect();
        assert!(wide.is_empty(), "{}: a comment of over {WIDEST_COMMENT} columns: {}", file.display(), wide[0]);
    }
}

#[test]
fn the_repository_names_no_path_of_a_machine_and_no_registry() {
    // Written apart, so that this file does not name them itself.
    let folders = ["work", "root", "tmp", "home"].map(|name| format!("/{name}"));
    let registries = [concat!("sparse", "+http"), concat!("replace", "-with"), concat!("[registr", "ies")];
    let index = concat!("registry", "+https://github.com/rust-lang/crates.io-index");
    for file in files("") {
        let Ok(content) = fs::read_to_string(&file) else { continue };
        for folder in &folders {
            let is_part = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || "._-}$)]".contains(c));
            let named = content.match_indices(folder).find(|(at, _)| {
                let after = content[at + folder.len()..].chars().next();
                !is_part(content[..*at].chars().next_back()) && !after.is_some_and(char::is_alphanumeric)
            });
            assert!(named.is_none(), "{}: a path under {folder}", file.display());
        }
        for registry in registries {
            assert!(!content.contains(registry), "{}: {registry}", file.display());
        }
        let other =
            content.lines().find(|line| line.starts_with("source = ") && line.contains("+") && !line.contains(index));
        assert!(other.is_none() || !file.ends_with("Cargo.lock"), "{}: {other:?}", file.display());
    }
}

/// How the time of day is read.
const TIME_OF_DAY: [&str; 5] = ["SystemTime", "Timestamp::now", "Zoned::now", "clock_gettime", "Local::now"];

/// A clock that jumps changes nothing: the time of day is read nowhere, and `Instant`, which does not jump,
/// by files that show how long something took or write a state now and then.
#[test]
fn nothing_reads_the_time_of_day() {
    let reads = |source: &str| TIME_OF_DAY.into_iter().find(|name| source.contains(name));
    assert_eq!(reads("let now = jiff::Timestamp::now();"), Some("Timestamp::now"));
    let mut with_instants = Vec::new();
    let is_source = |file: &PathBuf| {
        let is_test = file.components().any(|part| part.as_os_str() == "tests");
        file.extension().is_some_and(|of| of == "rs") && !is_test
    };
    for file in files("src").into_iter().chain(files("crates")).filter(is_source) {
        let source = text(&file);
        assert_eq!(reads(&source), None, "{}", file.display());
        if source.contains("Instant::now") {
            with_instants.push(file.strip_prefix(root()).unwrap_or(&file).display().to_string());
        }
    }
    with_instants.sort();
    let known = [
        "crates/bench/src/sweep/campaign.rs",
        "crates/replay/src/build.rs",
        "crates/speed-gate/src/race.rs",
        "src/challenge.rs",
        "src/reproduce.rs",
        "src/sparse_lines.rs",
        "src/sweep.rs",
    ];
    assert_eq!(with_instants, known);
}

#[test]
fn every_scenario_file_parses_survives_writing_and_can_be_simulated() {
    let scenarios = files("scenarios");
    assert!(!scenarios.is_empty());
    for file in scenarios {
        let scenario = Scenario::read(&file).unwrap_or_else(|error| panic!("{error}"));
        let written = scenario.to_toml().expect("has a TOML form");
        assert_eq!(Scenario::parse(&written, "written").expect("readable"), scenario, "{}", file.display());
        let mut cases = vec![scenario.clone()];
        if let Some(sweep) = &scenario.sweep {
            let points = sweep.points(&scenario, "sweep").unwrap_or_else(|error| panic!("{error}"));
            cases.extend(points.into_iter().map(|point| point.scenario));
        }
        for case in cases {
            let ready = SimulatedRobot::new(&case, case.seed, 0);
            assert!(
                ready.is_ok(),
                "{}: {}",
                file.display(),
                ready.err().map(|error| error.to_string()).unwrap_or_default()
            );
        }
    }
}
