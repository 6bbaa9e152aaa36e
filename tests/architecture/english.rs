//! Plain English: phrases that readers stumbled over do not come back into README, help, messages and pages,
//! and become no more in the documents.

use std::path::Path;

use crate::support::succeed;
use crate::{files, root, text};

/// A phrase as in `words.rs`, what to write instead, and how often the documents have it at most.
const PHRASES: &[(&str, &str, usize)] = &[
    (" stands ", "is", 1),
    (" stand in ", "are in", 0),
    (" stand beside ", "are next to", 0),
    (" goes with ", "depends on", 0),
    (" go with ", "depend on", 1),
    (" tells ", "shows, determines", 2),
    (" of which ", "with; of these", 0),
    (" beside ", "with, next to, given", 10),
    (" is none ", "there is no", 0),
    (" carries over ", "holds elsewhere", 7),
    (" carry over ", "hold elsewhere", 1),
    (" be told ", "be determined, be seen", 0),
    (" has not seen ", "held-out", 1),
    (" unasked ", "also", 0),
    (" mended by ", "fix", 0),
    (" mends ", "fixes", 1),
    (" whoever ", "who", 0),
    (" from an accident ", "standard deviations from zero", 0),
];

/// What looks like a phrase of the list and is none: a robot stands still.
const PLAIN: &[&str] = &[" stands still ", " while it stands ", " robot stands ", " it stands too "];

/// How often each phrase is in a text.
fn counts(prose: &str) -> Vec<usize> {
    let letters = prose.chars().map(|c| if c.is_alphanumeric() || c == '_' { c.to_ascii_lowercase() } else { ' ' });
    let words: String = letters.collect();
    let joined = format!(" {} ", words.split_whitespace().collect::<Vec<_>>().join(" "));
    let joined = PLAIN.iter().fold(joined, |joined, plain| joined.replace(plain, " "));
    PHRASES.iter().map(|(phrase, ..)| joined.matches(phrase).count()).collect()
}

/// The string literals of a source text, without those of its tests, and without names in braces.
fn messages(source: &str) -> String {
    let source = source.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    let (mut messages, mut characters) = (String::new(), source.chars().peekable());
    while let Some(character) = characters.next() {
        match character {
            '/' if characters.peek() == Some(&'/') => while characters.next_if(|c| *c != '\n').is_some() {},
            // A quotation mark as a character is no string.
            '\'' if characters.peek() == Some(&'"') => {
                characters.next();
            }
            '"' => {
                let mut depth = 0_usize;
                while let Some(character) = characters.next() {
                    match character {
                        '"' => break,
                        '\\' => {
                            characters.next();
                            messages.push(' ');
                        }
                        '{' => depth += 1,
                        '}' => depth = depth.saturating_sub(1),
                        _ if depth > 0 => {}
                        character => messages.push(character),
                    }
                }
                // A word between two messages: they make no phrase together.
                messages.push_str(" END ");
            }
            _ => {}
        }
    }
    messages
}

fn is_message(file: &Path) -> bool {
    let name = file.to_string_lossy();
    let is_source = name.contains("/src/") && file.extension().is_some_and(|extension| extension == "rs");
    is_source && !name.contains("/tests") && !name.ends_with("tests.rs") && !name.contains("/golden")
}

#[test]
fn readme_help_messages_and_pages_are_plain() {
    let mut found = Vec::new();
    let mut hold = |place: String, prose: &str| {
        for ((phrase, plain, _), count) in PHRASES.iter().zip(counts(prose)) {
            if count > 0 {
                found.push(format!("{place}: \"{}\": write {plain}", phrase.trim()));
            }
        }
    };
    hold("README.md".to_owned(), &text("README.md"));
    for file in files("crates").into_iter().chain(files("src")).filter(|file| is_message(file)) {
        hold(file.display().to_string(), &messages(&text(&file)));
    }
    let help = |arguments: &[&str]| succeed(root(), &[arguments, &["--help"]].concat()).stdout;
    let names = |help: &str| -> Vec<String> {
        let (list, _) = help.split_once("\nOptions:").unwrap_or((help, ""));
        let names = list.lines().filter_map(|line| line.strip_prefix("  ")?.split(' ').next());
        names.filter(|name| !matches!(*name, "" | "help")).map(str::to_owned).collect()
    };
    let commands = help(&[]);
    hold("yair --help".to_owned(), &commands);
    for name in names(&commands) {
        hold(format!("yair {name} --help"), &help(&[&name]));
    }
    for name in ["csv", "ros2", "tum", "motions", "optiodom", "censi"] {
        hold(format!("yair import {name} --help"), &help(&["import", name]));
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn the_documents_have_no_more_of_these_phrases() {
    let mut sums = vec![0; PHRASES.len()];
    let documents =
        files("docs").into_iter().filter(|file| file.extension().is_some_and(|extension| extension == "md"));
    // Its sentences are the catalogue's and the settings' comments.
    let generated = ["effects.md", "settings.md"];
    for file in documents.filter(|file| generated.iter().all(|name| !file.ends_with(name))) {
        sums.iter_mut().zip(counts(&text(&file))).for_each(|(sum, count)| *sum += count);
    }
    let wrong = PHRASES.iter().zip(&sums).filter(|((.., limit), sum)| *sum != limit);
    let wrong: Vec<String> = wrong.map(|((phrase, _, limit), sum)| format!("{phrase}: {sum}, limit {limit}")).collect();
    assert!(wrong.is_empty(), "more than before: write plainly; fewer: lower the limit\n{}", wrong.join("\n"));
}

#[test]
fn the_readme_is_one_screen() {
    let readme = text("README.md");
    assert!(readme.lines().count() <= 90 && readme.split_whitespace().count() <= 700);
    let long: Vec<&str> = readme.lines().filter(|line| line.chars().count() > 160).collect();
    assert!(long.is_empty(), "{long:?}");
}

#[test]
fn phrases_are_found_in_messages_alone() {
    let source = "// It stands beside.\nlet a = format!(\"{beside} tells {stands:.3}\\n more\"); let b = '\"'; let c = \"goes with\";\n#[cfg(test)]\nmod tests { \"of which\" }";
    let found: Vec<&str> = PHRASES
        .iter()
        .zip(counts(&messages(source)))
        .filter(|(_, count)| *count > 0)
        .map(|((phrase, ..), _)| *phrase)
        .collect();
    assert_eq!(found, [" goes with ", " tells "]);
    assert_eq!(counts("the robot stands still. It stands here").iter().sum::<usize>(), 1);
}
