//! The house holds itself: arrows between crates, folders and headers, scenario files, and documents that say what the command prints.
//!
//! Rejected by what was tried: an edge from `calib` to `effects`, a crate that no table lists, a changed digit in the README's table, a command in the
//! README that CI does not run, an effect's parameter missing in docs/scenario.md.

mod support;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use motion_programs::Schedule;
use scenario::Scenario;
use sim_yair::SimulatedRobot;
use support::{real_data, succeed};

/// Who may use whom, dev- and build-dependencies too. `estimation` and `calib` never link what could tell them the truth.
const ARROWS: &[(&str, &[&str])] = &[
    ("kinematics", &[]),
    ("atomic-file", &[]),
    ("dataset", &["kinematics"]),
    ("motion-programs", &["kinematics", "dataset"]),
    ("model-term", &["kinematics", "dataset"]),
    ("effects", &["kinematics", "dataset", "model-term"]),
    ("scenario", &["kinematics", "dataset", "motion-programs", "model-term", "effects"]),
    ("sim-yair", &["kinematics", "dataset", "motion-programs", "model-term", "effects", "scenario"]),
    ("estimation", &["kinematics", "dataset", "model-term"]),
    ("calib", &["kinematics", "dataset", "motion-programs", "model-term", "estimation"]),
    (
        "diagnose",
        &["kinematics", "dataset", "motion-programs", "model-term", "effects", "scenario", "estimation", "calib"],
    ),
    ("report", &["atomic-file"]),
    (
        "bench",
        &[
            "kinematics",
            "atomic-file",
            "dataset",
            "motion-programs",
            "model-term",
            "effects",
            "scenario",
            "sim-yair",
            "estimation",
            "calib",
            "report",
        ],
    ),
    (
        "blind-benchmark",
        &[
            "kinematics",
            "dataset",
            "motion-programs",
            "model-term",
            "effects",
            "scenario",
            "sim-yair",
            "estimation",
            "calib",
            "diagnose",
        ],
    ),
    (
        "paper-reproduction",
        &[
            "kinematics",
            "atomic-file",
            "dataset",
            "motion-programs",
            "model-term",
            "effects",
            "scenario",
            "sim-yair",
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
            "dataset",
            "motion-programs",
            "model-term",
            "effects",
            "scenario",
            "sim-yair",
            "estimation",
            "calib",
            "diagnose",
            "report",
            "bench",
            "blind-benchmark",
            "paper-reproduction",
        ],
    ),
];

/// Names that say nothing of what is inside.
const NO_NOUNS: [&str; 4] = ["utils", "common", "core", "helpers"];

/// Past this many lines a file is likely two nouns.
const LONGEST_FILE_LINES: usize = 600;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn text(path: impl AsRef<Path>) -> String {
    let path = root().join(path);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Files under a folder of the repository, by path; what is built or belongs to version control is left out.
fn files(folder: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![root().join(folder)];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display())) {
            let path = entry.expect("readable").path();
            // A file, too: `.git` of a second worktree.
            let left_out = ["target", ".git"].iter().any(|name| path == root().join(name));
            if path.is_dir() && !left_out {
                folders.push(path);
            } else if path.is_file() && !left_out {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

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
    let ours = |dependency: &&serde_json::Value| dependency["path"].is_string();
    list(&metadata["packages"])
        .iter()
        .map(|package| (name(package), list(&package["dependencies"]).iter().filter(ours).map(name).collect()))
        .collect()
}

/// What the crates do that the arrows do not allow.
fn complaints(crates: &BTreeMap<String, BTreeSet<String>>) -> Vec<String> {
    let mut complaints = Vec::new();
    for (user, used) in crates {
        let Some((_, allowed)) = ARROWS.iter().find(|(name, _)| name == user) else {
            complaints.push(format!(
                "crate {user} has no place: add it to ARROWS in tests/architecture.rs and to the rooms of ARCHITECTURE.md"
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

#[test]
fn the_rooms_are_there_and_every_file_says_what_it_is() {
    for folder in ["src", "crates", "scenarios", "tests", "benches", "docs", ".ci"] {
        assert!(root().join(folder).is_dir(), "the house has a folder {folder}");
    }
    for (name, _) in ARROWS {
        assert!(!NO_NOUNS.contains(name), "{name} is no noun of this field");
        assert!(*name == "yair" || root().join("crates").join(name).join("src/lib.rs").is_file(), "{name}");
        assert!(text("ARCHITECTURE.md").contains(&format!("`{name}`")), "ARCHITECTURE.md does not speak of {name}");
    }
    let sources = files("crates").into_iter().chain(files("src")).chain(files("tests"));
    for file in sources.filter(|file| file.extension().is_some_and(|extension| extension == "rs")) {
        let stem = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        assert!(!NO_NOUNS.contains(&stem.as_str()), "{}: a helper lives with its noun", file.display());
        let source = text(&file);
        assert!(source.starts_with("//! "), "{}: the first line must be a //! header", file.display());
        let lines = source.lines().count();
        assert!(lines <= LONGEST_FILE_LINES, "{}: {lines} lines; are there two nouns?", file.display());
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

/// Code blocks of a document in order: language and lines.
fn blocks(document: &str) -> Vec<(String, Vec<String>)> {
    let mut blocks = Vec::new();
    let mut open: Option<(String, Vec<String>)> = None;
    for line in document.lines() {
        match (line.strip_prefix("```"), open.as_mut()) {
            (Some(language), None) => open = Some((language.to_owned(), Vec::new())),
            (Some(_), Some(_)) => blocks.extend(open.take()),
            (None, Some((_, lines))) => lines.push(line.to_owned()),
            (None, None) => {}
        }
    }
    assert!(open.is_none(), "a code block does not end");
    blocks
}

/// `step NAME COMMAND` lines of .ci/run.
fn ci_steps() -> Vec<(String, String)> {
    let steps = text(".ci/run");
    let steps = steps.lines().filter_map(|line| line.strip_prefix("step ")?.split_once(' '));
    steps.filter(|(name, _)| *name != "()").map(|(name, command)| (name.to_owned(), command.to_owned())).collect()
}

#[test]
fn the_readme_the_justfile_and_ci_run_the_same_commands() {
    let steps = ci_steps();
    let readme = blocks(&text("README.md"));
    let commands: Vec<&String> =
        readme.iter().filter(|(language, _)| language == "sh").flat_map(|(_, lines)| lines).collect();
    for command in &commands[..2] {
        assert!(steps.iter().any(|(_, step)| step == *command), "README's \"{command}\" is no step of .ci/run");
    }
    let justfile = text("justfile");
    for (name, command) in &steps {
        assert!(justfile.contains(&format!("\n{name}:\n    {command}\n")), "justfile lacks {name}: {command}");
    }
    let recipes: BTreeSet<&str> = justfile
        .lines()
        .filter(|line| !line.starts_with([' ', '#']))
        .filter_map(|line| line.strip_suffix(':'))
        .collect();
    let expected: BTreeSet<&str> =
        steps.iter().map(|(name, _)| name.as_str()).chain(["ci", "documents", "challenge"]).collect();
    assert_eq!(recipes, expected);
}

#[test]
fn the_readme_shows_the_library_example_that_is_tested() {
    let source = text("src/lib.rs");
    let tested = source.lines().skip_while(|line| *line != "//! ```").skip(1).take_while(|line| *line != "//! ```");
    let tested: Vec<&str> = tested
        .map(|line| line.trim_start_matches("//!").trim_start_matches(' '))
        .filter(|line| !line.starts_with("# "))
        .collect();
    let readme = blocks(&text("README.md"));
    let (_, shown) = readme.iter().find(|(language, _)| language == "rust").expect("README has an example");
    assert_eq!(shown, &tested);
}

/// How a document names the originals of the real data, and which part of the data's folder they are.
const ORIGINALS: [(&str, &str); 2] = [("optiodom/data/", "optiodom"), ("calibration/reference-output/", "khepera")];

/// Runs one command line of a document and returns its standard output, or `None` when it needs data that are not here.
fn run(line: &str, folder: &Path) -> Option<String> {
    let (_, arguments) = line.split_once("yair ").or_else(|| line.split_once("cargo run --release -- "))?;
    let mut words: Vec<String> = arguments.split_whitespace().map(str::to_owned).collect();
    for word in &mut words {
        if let Some((name, part)) = ORIGINALS.iter().find(|(name, _)| word.starts_with(name)) {
            *word = real_data("the documents' commands", part)?.join(&word[name.len()..]).display().to_string();
        } else if word.starts_with("scenarios/") || word.starts_with("baselines/") {
            *word = root().join(&*word).display().to_string();
        }
    }
    Some(succeed(folder, &words.iter().map(String::as_str).collect::<Vec<_>>()).stdout)
}

/// Whether a pasted output is the real one; a pasted line that begins with … stands for any number of lines, and elapsed times are not compared.
fn agrees(pasted: &[String], real: &str) -> Result<(), String> {
    let real: Vec<&str> = real.lines().map(str::trim_end).collect();
    let pasted: Vec<&str> =
        pasted.iter().map(|line| line.trim_end()).filter(|line| !line.contains(" trials in ")).collect();
    let mut from = 0;
    let parts: Vec<&[&str]> = pasted.split(|line| line.starts_with('…')).collect();
    for (number, part) in parts.iter().enumerate() {
        let last = number + 1 == parts.len();
        let start = if last && number > 0 { real.len().saturating_sub(part.len()).max(from) } else { from };
        for (k, line) in part.iter().enumerate() {
            let found = real.get(start + k).copied().unwrap_or("(nothing)");
            if found != *line {
                return Err(format!("pasted: {line}\nprinted: {found}"));
            }
        }
        from = start + part.len();
    }
    if from == real.len() { Ok(()) } else { Err(format!("printed besides: {}", real[from])) }
}

#[test]
fn a_pasted_output_with_another_digit_does_not_agree() {
    let lines = |text: &str| text.lines().map(str::to_owned).collect::<Vec<_>>();
    assert!(agrees(&lines("a\n… two more\nd\n9 trials in 1 s"), "a  \nb\nc\nd\n").is_ok());
    for wrong in ["a\n… more\ne", "b\n… more\nd", "a\nb\nc", "a\nb\nc\nd\ne"] {
        assert!(agrees(&lines(wrong), "a\nb\nc\nd\n").is_err(), "{wrong}");
    }
}

/// The documents whose commands are run.
const DOCUMENTS: [&str; 5] =
    ["README.md", "docs/calibration.md", "docs/methods.md", "docs/bench.md", "docs/real-robots.md"];

/// A pasted output as it should be: what is printed, with the same left out at … as before. What comes after … is found by its first line that is printed once, or else is as long as it was.
fn refreshed(pasted: &[String], real: &str) -> Vec<String> {
    let real: Vec<String> = real.lines().map(|line| line.trim_end().to_owned()).collect();
    let (timing, pasted): (Vec<_>, Vec<_>) = pasted.iter().cloned().partition(|line| line.contains(" trials in "));
    let mut fresh = match pasted.iter().position(|line| line.starts_with('…')) {
        None => real,
        Some(gap) => {
            let tail = &pasted[gap + 1..];
            let found = tail.iter().enumerate().find_map(|(after, line)| {
                let mut places = (0..real.len()).filter(|place| real[*place] == *line);
                let place = places.next().filter(|_| places.next().is_none())?;
                place.checked_sub(after)
            });
            let head = gap.min(real.len());
            let begins = found.unwrap_or(real.len().saturating_sub(tail.len())).max(head);
            [&real[..head], &pasted[gap..=gap], &real[begins..]].concat()
        }
    };
    fresh.extend(timing);
    fresh
}

#[test]
fn a_refreshed_output_agrees_and_keeps_what_it_leaves_out() {
    let lines = |text: &str| text.lines().map(str::to_owned).collect::<Vec<_>>();
    let real = "a\nb\nc\nd\n";
    for (pasted, expected) in [
        ("a\nx", "a\nb\nc\nd"),
        ("x\n… more\nc\n9 trials in 1 s", "a\n… more\nc\nd\n9 trials in 1 s"),
        ("a\n… more\nx", "a\n… more\nd"),
    ] {
        let fresh = refreshed(&lines(pasted), real);
        assert_eq!(fresh, lines(expected));
        assert!(agrees(&fresh, real).is_ok() && agrees(&lines(pasted), real).is_err());
    }
}

/// Every `sh` block that is followed by a `text` block: its `yair` commands print that text. And every picture `docs/bench-NAME.svg` is the one that the sweep
/// of NAME draws. With YAIR_UPDATE_DOCS=1 texts and pictures are written anew.
#[test]
fn the_documents_show_what_the_commands_print() {
    let update = std::env::var("YAIR_UPDATE_DOCS").is_ok_and(|value| value == "1");
    let mut compared = 0;
    for document in DOCUMENTS {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut printed = None;
        let mut written = text(document);
        for (language, lines) in blocks(&text(document)) {
            let ours = |line: &&String| line.starts_with("yair ") || line.starts_with("cargo run --release -- ");
            match language.as_str() {
                "sh" => {
                    let outputs = lines.iter().filter(ours).map(|line| run(line, folder.path()));
                    printed = outputs.collect::<Option<String>>();
                }
                "text" => {
                    if let Some(printed) = printed.take().filter(|printed| !printed.is_empty()) {
                        let block = |lines: &[String]| format!("```text\n{}\n```", lines.join("\n"));
                        if update {
                            written = written.replacen(&block(&lines), &block(&refreshed(&lines, &printed)), 1);
                        } else if let Err(difference) = agrees(&lines, &printed) {
                            panic!("{document}: {difference}\nall that was printed:\n{printed}");
                        }
                        compared += 1;
                    }
                }
                _ => {}
            }
        }
        for picture in files("docs").into_iter().filter(|file| file.extension().is_some_and(|of| of == "svg")) {
            let stem = picture.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let Some(name) = stem.strip_prefix("bench-").filter(|_| document == "docs/bench.md") else { continue };
            let drawn = fs::read(folder.path().join(name).join("sweep.svg")).expect("the document draws it");
            if update {
                fs::write(&picture, &drawn).expect("written");
            }
            assert!(drawn == fs::read(&picture).expect("read"), "{stem}.svg is not what {document}'s command draws");
            compared += 1;
        }
        if update {
            fs::write(root().join(document), written).expect("written");
        }
    }
    assert!(compared >= 8, "the README's sweep and round trip, the bench's tables and pictures, the methods' table");
}

/// The published sessions of docs/calibration.md, "here / published": the left figures are what the commands above the table find.
#[test]
fn published_optiodom_squares_stand_in_the_document_as_found() {
    if real_data("published_optiodom_squares_stand_in_the_document_as_found", "optiodom").is_none() {
        return;
    }
    let document = text("docs/calibration.md");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let json = |line: &str| -> serde_json::Value {
        serde_json::from_str(&run(line, folder.path()).expect("there are data")).expect("JSON")
    };
    let mut sessions = 0;
    for row in document.lines().filter(|line| line.starts_with("| 2306")) {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let session = cells[0];
        json(&format!("yair import optiodom optiodom/data/diff/square/{session} --out {session} --json"));
        let found = json(&format!("yair calibrate {session} --method umbmark --out {session}.toml --json"));
        let drift = json(&format!("yair evaluate {session} --calibration {session}.toml --json"));
        let parameter = |key: &str| &found["methods"][0]["parameters"][key]["value"];
        let here = [
            parameter("wheel_separation_m"),
            parameter("right_wheel_diameter_m"),
            parameter("left_wheel_diameter_m"),
            &drift["calibrations"][0]["max_final_position_m"],
            &drift["calibrations"][1]["max_final_position_m"],
        ];
        for (cell, value) in cells[1..].iter().zip(here) {
            let (shown, _published) = cell.split_once(" / ").expect("here / published");
            assert_eq!(shown, format!("{:.3}", 1e3 * value.as_f64().expect("a number")), "{row}");
        }
        sessions += 1;
    }
    assert_eq!(sessions, 4);
}

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
        Budget, Case, Controller, Encoder, Engine, Instrument, Log, Mark, Motor, Noise, Placement, Range, Robot, Sobol,
        Sweep,
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
        ("straights", keys::<Schedule>("straights")),
        ("spins", keys::<Schedule>("spins")),
        ("squares", keys::<Schedule>("squares")),
        ("validation_path", keys::<Schedule>("validation_path")),
        ("sweep", keys::<Sweep>("")),
        ("sweep.sobol", keys::<Sobol>("")),
        ("sweep.case", keys::<Case>("")),
        ("an axis' range", keys::<Range>("")),
        ("budget", keys::<Budget>("")),
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
