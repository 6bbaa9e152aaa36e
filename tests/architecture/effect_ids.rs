//! No source outside of `crates/effects` writes the id of an effect or matches on its type: what differs from
//! effect to effect is asked of the effect.
//!
//! Tests, scenarios and documents may name effects, and so may `plain-robot`, whose logs are for tests and
//! whose answers are no code of ours. A type may be used to make an effect of a scenario.

use std::fs;
use std::path::{Path, PathBuf};

use effects::CATALOGUE;

/// Literals that are ids by accident: the file's end, the word, and what it is there.
const OTHER_WORDS: [(&str, &str, &str); 1] =
    [("methods/direct/formulas.rs", "wheelbase", "which of a run's values an outlier rule rejected, in a message")];

/// Something that a file should not have: its line, from 1, and what.
type Complaint = (usize, String);

/// What a source is made of, as far as this test asks.
#[derive(Debug, PartialEq)]
enum Token {
    /// A literal without its quotes, escapes as written.
    Literal(String),
    /// Any other text of a line.
    Code(String),
}

/// The tokens of a source with their lines; comments are left out.
fn tokens(source: &str) -> Vec<(usize, Token)> {
    let (mut tokens, mut code) = (Vec::new(), String::new());
    let mut line = 1;
    let mut letters = source.chars().peekable();
    let mut before = ' ';
    while let Some(letter) = letters.next() {
        match letter {
            '\n' => {
                tokens.push((line, Token::Code(std::mem::take(&mut code))));
                line += 1;
            }
            '/' if letters.peek() == Some(&'/') => while letters.next_if(|next| *next != '\n').is_some() {},
            // A quote as a letter, '"' or '\"'.
            '\'' if letters.peek() == Some(&'"') => {
                letters.next();
            }
            '\\' if before == '\'' => {
                letters.next();
            }
            '"' => {
                tokens.push((line, Token::Code(std::mem::take(&mut code))));
                let (start, mut literal) = (line, String::new());
                // r#"…"# ends at its own sign; no literal here has more of them.
                let is_raw = before == '#';
                while let Some(next) = letters.next() {
                    match next {
                        '"' if !is_raw || letters.peek() == Some(&'#') => break,
                        '\\' if !is_raw => {
                            literal.push(next);
                            literal.extend(letters.next());
                        }
                        _ => literal.push(next),
                    }
                    line += usize::from(next == '\n');
                }
                tokens.push((start, Token::Literal(literal)));
            }
            _ => code.push(letter),
        }
        before = letter;
    }
    tokens.push((line, Token::Code(code)));
    tokens
}

/// A source with the items that are only compiled for tests blanked, line by line: from `#[cfg(test)]` to the
/// item's end, which `rustfmt` puts under its start.
fn without_tests(source: &str) -> String {
    let mut kept = String::new();
    let mut ends: Option<String> = None;
    for line in source.lines() {
        let indent = &line[..line.len() - line.trim_start().len()];
        if ends.is_none() && line.trim_start().starts_with("#[cfg(test)]") {
            ends = Some(indent.to_owned());
        }
        match &ends {
            Some(start) => {
                let text = line.trim_end();
                let is_last = text == format!("{start}}}") || (indent == start && text.ends_with(';'));
                if is_last {
                    ends = None;
                }
            }
            None => kept.push_str(line),
        }
        kept.push('\n');
    }
    kept
}

/// The name of an id's type: `slip_speed` is `SlipSpeed`.
fn type_of(id: &str) -> String {
    let capitalised = |word: &str| word[..1].to_uppercase() + &word[1..];
    id.split('_').map(capitalised).collect()
}

/// Whether a literal is an id, or has one in quotes as a scenario writes it.
fn names(literal: &str, id: &str) -> bool {
    literal == id || literal.contains(&format!("\\\"{id}\\\"")) || literal.contains(&format!("\"{id}\""))
}

/// Whether code takes an effect of a type apart: an arm, `matches!`, `if let` or `let … else`.
fn matches_on(code: &str, name: &str) -> bool {
    let pattern = format!("Effect::{name}(");
    let Some(at) = code.find(&pattern) else { return false };
    let (before, after) = (&code[..at], &code[at + pattern.len()..]);
    let is_bound = ["matches!(", "let ", "let Some(", "let Ok("].iter().any(|start| {
        // `let x = Effect::…` makes one.
        before.rfind(start).is_some_and(|start| !before[start..].contains('='))
    });
    is_bound
        || after
            .split_once(')')
            .is_some_and(|(_, rest)| rest.trim_start().starts_with(['|', '=']) && rest.contains("=>"))
}

/// Ids that a source writes and types that it matches on, outside of its tests.
fn complaints(source: &str, allowed: &[&str]) -> Vec<Complaint> {
    let mut complaints = Vec::new();
    for (line, token) in tokens(&without_tests(source)) {
        for id in CATALOGUE {
            match &token {
                Token::Literal(literal) if names(literal, id) && !allowed.contains(id) => {
                    complaints.push((line, format!("\"{id}\"")));
                }
                Token::Code(code) if matches_on(code, &type_of(id)) => {
                    complaints.push((line, format!("Effect::{}", type_of(id))));
                }
                _ => {}
            }
        }
    }
    complaints
}

/// Rust files under a folder; of test modules in files of their own, none.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display())) {
        let path = entry.expect("readable").path();
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|of| of == "rs") && !path.ends_with("tests.rs") {
            found.push(path);
        }
    }
    found.sort();
    found
}

#[test]
fn no_id_of_an_effect_stands_outside_of_the_catalogue() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let crates = fs::read_dir(root.join("crates")).expect("crates").map(|entry| entry.expect("readable").path());
    let folders =
        crates.filter(|path| !path.ends_with("effects") && !path.ends_with("plain-robot")).map(|path| path.join("src"));
    let files: Vec<PathBuf> = folders
        .chain([root.join("src")])
        .filter(|folder| folder.is_dir())
        .flat_map(|folder| sources(&folder))
        .collect();
    assert!(files.len() > 100, "{} files", files.len());
    let (mut found, mut used) = (Vec::new(), 0);
    for file in &files {
        let source = fs::read_to_string(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        let own = OTHER_WORDS.iter().filter(|(end, ..)| file.ends_with(end));
        let allowed: Vec<&str> = own.map(|(_, word, _)| *word).collect();
        used += usize::from(!allowed.is_empty() && !complaints(&source, &[]).is_empty());
        let shown = file.strip_prefix(root).unwrap_or(file).display().to_string();
        found.extend(complaints(&source, &allowed).into_iter().map(|(line, what)| format!("{shown}:{line}: {what}")));
    }
    assert!(
        found.is_empty(),
        "ask effects::description for a property instead, which the effect's file declares:\n{}",
        found.join("\n")
    );
    assert_eq!(used, OTHER_WORDS.len(), "a word is allowed where it does not stand any more");
}

#[test]
fn planted_ids_are_found_with_their_lines_and_innocent_ones_are_not() {
    let id = CATALOGUE[11];
    let name = type_of(id);
    let planted = [
        format!("fn f(id: &str) -> bool {{\n    id == \"{id}\"\n}}\n"),
        format!("fn f(id: &str) {{\n    match id {{ \"{id}\" => a(), _ => b() }}\n}}\n"),
        format!("const TEXT: &str =\n    \"kind = \\\"{id}\\\"\\n\";\n"),
        format!("const TEXT: &str =\n    r#\"kind = \"{id}\"\"#;\n"),
        format!("fn f(effect: &Effect) -> bool {{\n    matches!(effect, Effect::{name}(_))\n}}\n"),
        format!("match effect {{\n    Effect::{name}(mut own) => own,\n}}\n"),
        format!("fn f() {{\n    if let Effect::{name}(own) = effect {{ g(own) }}\n}}\n"),
        // After a part that is only for tests, and a letter that is a quote.
        format!("#[cfg(test)] use a::b;\nfn f() {{ ('\"', '\\\"', \"{id}\") }}\n"),
    ];
    for source in &planted {
        let found = complaints(source, &[]);
        assert!(matches!(&found[..], [(2, _)]), "{found:?} in\n{source}");
    }
    assert!(complaints(&planted[0], &[id]).is_empty(), "an allowed word");
    let innocent = [
        format!("/// `{id}` and \"{id}\"\nfn f() {{ g(); }} // \"{id}\"\n"),
        format!("#[cfg(test)]\nmod tests {{\n    const ID: &str = \"{id}\";\n}}\n"),
        format!("const TEXT: &str = \"{id}_of_something, and {id} in a sentence\";\n"),
        format!("let own = Effect::{name}({name}::default());\n"),
        format!("fn f() -> Effect {{ Effect::{name}(own) }}\n"),
    ];
    for source in &innocent {
        assert_eq!(complaints(source, &[]), [], "{source}");
    }
}

/// The rule by which an id is the name of a type holds for the whole catalogue.
#[test]
fn every_id_is_the_name_of_its_type() {
    let library =
        fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("crates/effects/src/lib.rs")).expect("read");
    for id in CATALOGUE {
        assert!(library.contains(&format!("    {id}::{},", type_of(id))), "{id}");
    }
}
