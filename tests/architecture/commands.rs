//! The commands in the documents: CI runs them, and they print what the documents show.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use crate::pictures::pictures_show_what_the_pages_say;
use crate::support::real_data::real_data;
use crate::support::succeed;
use crate::{files, root, text};

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

/// The names of .ci/run's steps, each with its first command.
fn ci_steps() -> BTreeMap<String, String> {
    let script = text(".ci/run");
    let (_, steps) = script.split_once("\n  case $1 in\n").expect("steps by name");
    let names = steps.lines().zip(steps.lines().skip(1)).filter_map(|(line, next)| {
        let (name, command) = line.trim().split_once(')').filter(|(name, _)| *name != "*")?;
        let is_name = name.chars().all(|letter| letter.is_ascii_lowercase() || letter == '-');
        let command = if command.is_empty() { next } else { command };
        let command = command.trim().trim_start_matches("run ").trim_end_matches(" ;;");
        is_name.then(|| (name.to_owned(), command.to_owned()))
    });
    names.collect()
}

#[test]
fn the_readme_has_commands_of_ci_and_the_justfile_its_steps() {
    let steps = ci_steps();
    let script = text(".ci/run");
    let checks = script.lines().find_map(|line| line.strip_prefix("checks=(")?.strip_suffix(')')).expect("checks");
    let checks: Vec<&String> = checks.split(' ').map(|name| &steps[name]).collect();
    let readme = blocks(&text("README.md"));
    let mut commands = readme.iter().filter(|(language, _)| language == "sh").flat_map(|(_, lines)| lines);
    for command in [commands.next(), commands.next()].map(|command| command.expect("README's first two commands")) {
        assert!(checks.contains(&command), "README's \"{command}\" is no check of .ci/run");
    }
    let justfile = text("justfile");
    let recipes: Vec<&str> = justfile.lines().filter(|line| !line.is_empty() && !line.starts_with('#')).collect();
    let expected: BTreeSet<(String, String)> =
        steps.keys().map(|name| (format!("{name}:"), format!("    .ci/run {name}"))).collect();
    // What a recipe takes stands behind its name, and behind the step's.
    let found: BTreeSet<(String, String)> = recipes[2..]
        .chunks(2)
        .map(|recipe| {
            let name = recipe[0].split([' ', ':']).next().unwrap_or_default();
            let step = recipe[1].split_inclusive(' ').filter(|word| !word.contains(['{', '}']));
            (format!("{name}:"), step.collect::<String>().trim_end().to_owned())
        })
        .collect();
    assert_eq!(recipes[..2], ["ci:", "    .ci/run"]);
    assert_eq!(found, expected);
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

/// Runs one command line of a document and returns its standard output, or `None` when it needs data that are
/// not here.
pub(crate) fn run(line: &str, folder: &Path) -> Option<String> {
    let (_, arguments) = line.split_once("yair ").or_else(|| line.split_once("cargo run --release -- "))?;
    let mut words: Vec<String> = arguments.split_whitespace().map(str::to_owned).collect();
    for word in &mut words {
        if let Some((name, part)) = ORIGINALS.iter().find(|(name, _)| word.starts_with(name)) {
            *word = real_data("the documents' commands", part)?.join(&word[name.len()..]).display().to_string();
        } else if ["scenarios/", "baselines/", "tests/"].iter().any(|folder| word.starts_with(folder)) {
            *word = root().join(&*word).display().to_string();
        }
    }
    Some(succeed(folder, &words.iter().map(String::as_str).collect::<Vec<_>>()).stdout)
}

/// Whether a pasted output is the real one; a pasted line that begins with … stands for any number of lines,
/// and elapsed times are not compared.
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

/// A pasted output as it should be: what is printed, with the same left out at … as before. What comes after
/// … is found by its first line that is printed once, or else is as long as it was.
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

/// Code blocks whose commands take more than some seconds of processor time: `.ci/run documents` alone runs
/// them, and writes what they print.
const CAMPAIGN: &str = "sh campaign";

/// Every `sh` block that is followed by a `text` block: its `yair` commands print that text. And every
/// picture `docs/bench-NAME.svg` is the one that the sweep of NAME in `docs/bench.md` draws. With
/// YAIR_UPDATE_DOCS=1 texts and pictures are written anew. Compared are so many at the least, real data or
/// none.
fn shows_what_its_commands_print(document: &str, least: usize) {
    let update = std::env::var("YAIR_UPDATE_DOCS").is_ok_and(|value| value == "1");
    let mut compared = 0;
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut printed = None;
    let mut written = text(document);
    for (language, lines) in blocks(&text(document)) {
        let ours = |line: &&String| line.starts_with("yair ") || line.starts_with("cargo run --release -- ");
        match language.as_str() {
            CAMPAIGN if !update => printed = None,
            "sh" | CAMPAIGN => {
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
        assert!(text(document).contains(&format!("--out {name}\n")), "{stem}.svg is drawn by no command of {document}");
        let Ok(drawn) = fs::read(folder.path().join(name).join("sweep.svg")) else {
            assert!(!update, "{document}: no command draws {stem}.svg");
            continue; // of a campaign
        };
        if update {
            fs::write(&picture, &drawn).expect("written");
        }
        assert!(drawn == fs::read(&picture).expect("read"), "{stem}.svg is not what {document}'s command draws");
        compared += 1;
    }
    if update {
        fs::write(root().join(document), written).expect("written");
    } else if document == "docs/tutorial.md" {
        pictures_show_what_the_pages_say(folder.path());
    }
    assert!(compared >= least, "{document}: {compared} outputs were compared");
}

/// A test for each document, so that they run beside each other.
mod documents_show_what_commands_print {
    use super::shows_what_its_commands_print;

    #[test]
    fn readme() {
        shows_what_its_commands_print("README.md", 3);
    }

    #[test]
    fn calibration() {
        shows_what_its_commands_print("docs/calibration.md", 0);
    }

    #[test]
    fn methods() {
        shows_what_its_commands_print("docs/methods.md", 0);
    }

    #[test]
    fn bench() {
        shows_what_its_commands_print("docs/bench.md", 1);
    }

    #[test]
    fn tutorial() {
        shows_what_its_commands_print("docs/tutorial.md", 11);
    }

    #[test]
    fn faq() {
        shows_what_its_commands_print("docs/faq.md", 11);
    }

    #[test]
    fn fleet() {
        shows_what_its_commands_print("docs/fleet.md", 4);
    }

    #[test]
    fn export() {
        shows_what_its_commands_print("docs/export.md", 2);
    }

    #[test]
    fn guide_ros2_motion_capture() {
        shows_what_its_commands_print("docs/guide-ros2-motion-capture.md", 5);
    }

    #[test]
    fn guide_ros2_slam() {
        shows_what_its_commands_print("docs/guide-ros2-slam.md", 4);
    }

    #[test]
    fn guide_gyro_and_tape() {
        shows_what_its_commands_print("docs/guide-gyro-and-tape.md", 5);
    }

    #[test]
    fn guide_recordings() {
        shows_what_its_commands_print("docs/guide-recordings.md", 7);
    }

    #[test]
    fn guide_own_method() {
        shows_what_its_commands_print("docs/guide-own-method.md", 4);
    }

    #[test]
    fn real_robots() {
        shows_what_its_commands_print("docs/real-robots.md", 0);
    }
}

/// The published sessions of docs/calibration.md, "here / published": the left figures are what the commands
/// above the table find.
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
