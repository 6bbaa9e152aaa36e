//! The documents have every key, effect and method, and their links lead somewhere.

use std::collections::BTreeSet;

use motion_programs::Schedule;
use scenario::Scenario;

use crate::{files, root, text};

/// The keys that a part of a scenario accepts, by the message with which it refuses another one.
fn keys<T: serde::de::DeserializeOwned>(kind: &str) -> Vec<String> {
    let kind = if kind.is_empty() { String::new() } else { format!("kind = \"{kind}\"\n") };
    let refusal = toml::from_str::<T>(&format!("{kind}no_such_key = 0")).err().expect("refused").to_string();
    let (_, known) = refusal.split_once("expected").unwrap_or_else(|| panic!("lists the known keys: {refusal}"));
    known.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

#[test]
fn the_scenario_document_has_every_key_and_every_effect() {
    use scenario::{
        Budget, Case, Controller, Encoder, Engine, Estimated, EstimatedTerm, Instrument, Log, Mark, Motor, Noise,
        Placement, Range, Robot, Sobol, Sweep, Wall,
    };
    let document = text("docs/scenario.md");
    let parts = [
        ("", keys::<Scenario>("")),
        ("robot", keys::<Robot>("")),
        ("robot.encoder", keys::<Encoder>("")),
        ("robot.controller", keys::<Controller>("")),
        ("robot.motor", keys::<Motor>("")),
        ("robot.point", keys::<Mark>("")),
        ("engine", keys::<Engine>("stepping")),
        ("noise", keys::<Noise>("")),
        ("placement", keys::<Placement>("")),
        ("log", keys::<Log>("")),
        ("floor_grid", keys::<Instrument>("floor_grid")),
        ("motion_capture", keys::<Instrument>("motion_capture")),
        ("gyro", keys::<Instrument>("gyro")),
        ("tape", keys::<Instrument>("tape")),
        ("revisit", keys::<Instrument>("revisit")),
        ("wall", keys::<Wall>("")),
        ("straights", keys::<Schedule>("straights")),
        ("spins", keys::<Schedule>("spins")),
        ("spins_at_speeds", keys::<Schedule>("spins_at_speeds")),
        ("squares", keys::<Schedule>("squares")),
        ("validation_path", keys::<Schedule>("validation_path")),
        ("sweep", keys::<Sweep>("")),
        ("sweep.sobol", keys::<Sobol>("")),
        ("sweep.case", keys::<Case>("")),
        ("an axis' range", keys::<Range>("")),
        ("budget", keys::<Budget>("")),
        ("estimated", keys::<Estimated>("")),
        ("estimated.term", keys::<EstimatedTerm>("")),
    ];
    for (part, keys) in parts {
        assert!(!keys.is_empty(), "{part}");
        for key in keys {
            assert!(document.contains(&format!("| `{key}` |")), "docs/scenario.md has no row for {key} of {part}");
        }
    }
    for id in effects::CATALOGUE.iter().chain([&"term"]) {
        let row = document.lines().find(|line| line.starts_with(&format!("| `{id}` |")));
        let row = row.unwrap_or_else(|| panic!("docs/scenario.md has no row for the effect {id}"));
        for key in keys::<effects::Effect>(id) {
            assert!(row.contains(&format!("`{key}`")), "docs/scenario.md: the row of {id} lacks {key}");
        }
    }
    let channels = effects::Channel::all().map(|channel| channel.name().to_owned());
    for name in effects::Covariate::NAMED.iter().map(effects::Covariate::name).chain(channels) {
        // A bar would end a table's cell.
        let name = name.replace('|', "\\|");
        assert!(document.contains(&format!("`{name}`")), "docs/scenario.md does not say what {name} is");
    }
}

#[test]
fn every_method_is_documented_and_every_link_leads_somewhere() {
    let document = text("docs/calibration.md");
    for method in calib::METHODS {
        assert!(document.contains(&format!("\n## `{}`", method.name())), "docs/calibration.md lacks {}", method.name());
    }
    let which = text("docs/methods.md");
    for method in calib::METHODS {
        assert!(which.contains(&format!("\n| `{}` |", method.name())), "docs/methods.md lacks {}", method.name());
    }
    for file in files("").into_iter().filter(|file| file.extension().is_some_and(|extension| extension == "md")) {
        for target in text(&file).split("](").skip(1).filter_map(|rest| rest.split([')', '#']).next()) {
            let here = file.parent().unwrap_or(root()).join(target);
            assert!(target.is_empty() || target.starts_with("http") || here.exists(), "{}: {target}", file.display());
        }
    }
}

/// The rows of a promise in docs/reliability.md that name no test, and the names that are no test's.
fn promises_without_a_test(document: &str, tests: &BTreeSet<String>) -> Vec<String> {
    let (_, section) = document.split_once("## Promises").expect("promises");
    let section = section.split("\n## ").next().unwrap_or_default();
    let rows = section.lines().filter(|line| line.starts_with("| ") && !line.starts_with("| promise |"));
    let wrong = rows.filter(|row| !row.starts_with("| --- ")).filter(|row| {
        let tested_by = row.trim_end_matches([' ', '|']).rsplit('|').next().unwrap_or_default();
        let mut names = tested_by.split('`').skip(1).step_by(2).filter(|name| name.contains('_')).peekable();
        names.peek().is_none() || names.any(|name| !tests.contains(name))
    });
    wrong.map(str::to_owned).collect()
}

#[test]
fn every_promise_of_reliability_names_tests_that_exist() {
    let mut tests = BTreeSet::new();
    for file in ["crates", "tests", "fuzz", "src"].iter().flat_map(|folder| files(folder)) {
        if file.extension().is_some_and(|extension| extension == "rs") {
            let source = text(&file);
            let after = source.split("#[test]").skip(1).filter_map(|rest| rest.split_once("fn ")?.1.split_once('('));
            tests.extend(after.map(|(name, _)| name.to_owned()));
        }
    }
    assert_eq!(promises_without_a_test(&text("docs/reliability.md"), &tests), [""; 0]);
    let document = "## Promises\n| promise | limit | tested by |\n| --- | --- | --- |\n| A. | – | `fuzz/` |\n\
                    | B. | – | `a_file_that_ends`, `no_such_test` |\n| C. | – | `a_file_that_ends` |\n## Fuzzing\n";
    let found = promises_without_a_test(document, &BTreeSet::from(["a_file_that_ends".to_owned()]));
    assert_eq!(found.len(), 2, "{found:?}");
}
