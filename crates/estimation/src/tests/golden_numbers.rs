//! Numbers of a crate against those that it made before, which stand in a file beside its tests.
//!
//! A change that moves a number shows, whatever it moves. With YAIR_UPDATE_DOCS=1 the file is written anew.

use std::path::Path;

/// Relative: iterations that stop at 10⁻⁶ of a standard deviation amplify the roundings of other machines.
const RELATIVE_TOLERANCE: f64 = 1e-6;

/// Absolute, in each number's unit: values that are 0 but for roundings.
const ABSOLUTE_TOLERANCE: f64 = 1e-12;

/// A text cut where numbers begin and end.
fn tokens(line: &str) -> Vec<&str> {
    let is_number = |character: char| character.is_ascii_digit() || "+-.".contains(character);
    let mut tokens = Vec::new();
    let (mut begin, mut in_number) = (0, false);
    for (at, character) in line.char_indices() {
        let exponent = in_number && character == 'e';
        if (is_number(character) || exponent) != in_number {
            tokens.push(&line[begin..at]);
            (begin, in_number) = (at, !in_number);
        }
    }
    tokens.push(&line[begin..]);
    tokens
}

fn agree(one: &str, other: &str) -> bool {
    let near = |a: f64, b: f64| (a - b).abs() <= RELATIVE_TOLERANCE * a.abs().max(b.abs()) + ABSOLUTE_TOLERANCE;
    let (one, other) = (tokens(one), tokens(other));
    let same = |(one, other): (&&str, &&str)| match (one.parse(), other.parse()) {
        (Ok(a), Ok(b)) => near(a, b),
        _ => one == other,
    };
    one.len() == other.len() && one.iter().zip(&other).all(same)
}

/// A line with its numbers at nine digits.
fn rounded(line: &str) -> String {
    let short = |token: &str| match token.parse::<f64>() {
        Ok(value) if token.len() > 9 => format!("{value:.8e}"),
        _ => token.to_owned(),
    };
    tokens(line).into_iter().map(short).collect()
}

/// Refuses numbers that are not those of the file, with its line.
#[track_caller]
pub(crate) fn assert_unmoved(file: &Path, text: &str) {
    if std::env::var("YAIR_UPDATE_DOCS").is_ok_and(|value| value == "1") {
        let lines: Vec<String> = text.lines().map(|line| rounded(line) + "\n").collect();
        std::fs::write(file, lines.concat()).expect("written");
        return;
    }
    let golden = std::fs::read_to_string(file).expect("the file stands beside the tests");
    assert_eq!(text.lines().count(), golden.lines().count());
    for (number, (found, before)) in text.lines().zip(golden.lines()).enumerate() {
        let of = file.file_name().unwrap_or_default().display();
        assert!(agree(found, before), "{of}, line {}: it was\n{before}\nand is\n{found}", number + 1);
    }
}

#[test]
fn numbers_agree_within_the_tolerance_and_texts_to_the_letter() {
    assert!(agree("a: [1.0000001e-3, Some(2)]", "a: [1e-3, Some(2)]") && agree("x 1e-13", "x -1e-14"));
    assert!(!agree("a: 1.00001", "a: 1") && !agree("a: 1", "b: 1") && !agree("1, 2", "1"));
    assert_eq!(rounded("x: 0.12345678901, run 7-8"), "x: 1.23456789e-1, run 7-8");
}
