//! Text of files in comments, and numbers as programs of robots take them.

use crate::robot::{CalibratedRobot, Length};

/// Longest text of a file in a comment, characters.
const MAX_CHARS: usize = 160;

/// Separators of lines that are no control characters, and signs that turn the direction of text: compilers
/// warn of the latter, since a reader sees another text than they do.
const BREAKS: [char; 14] = [
    '\u{200e}', '\u{200f}', '\u{2028}', '\u{2029}', '\u{202a}', '\u{202b}', '\u{202c}', '\u{202d}', '\u{202e}',
    '\u{2066}', '\u{2067}', '\u{2068}', '\u{2069}', '\u{feff}',
];

/// Text of a file as any comment may hold it: on one line, without what ends a comment of C or Java, and
/// clipped.
pub(crate) fn comment(text: &str) -> String {
    let plain = |letter: char| if letter.is_control() || BREAKS.contains(&letter) { ' ' } else { letter };
    let mut line: String = text.chars().map(plain).take(MAX_CHARS).collect();
    if text.chars().nth(MAX_CHARS).is_some() {
        line.push('…');
    }
    // A backslash would go on to the next line (C) or begin an escape (\u in Java).
    line = line.replace('\\', "/").replace("*/", "* /").replace("/*", "/ *");
    // A trigraph may be a backslash, or be warned of.
    while line.contains("??") {
        line = line.replace("??", "? ?");
    }
    line
}

/// Text wrapped into lines that begin alike; continuation lines are indented by two more columns.
pub(crate) fn wrapped(start: &str, text: &str) -> String {
    const WIDTH: usize = 100;
    let mut lines = String::new();
    let mut line = start.to_owned();
    for word in text.split_whitespace() {
        if line.chars().count() + 1 + word.chars().count() > WIDTH {
            lines.push_str(&line);
            lines.push('\n');
            line = format!("{start} ");
        }
        line.push(' ');
        line.push_str(word);
    }
    lines.push_str(&line);
    lines.push('\n');
    lines
}

/// Where a file's numbers are from: format, calibration and its file.
pub(crate) fn origin(start: &str, format: &str, robot: &CalibratedRobot) -> String {
    let (place, name) = (comment(&robot.place), comment(&robot.name));
    wrapped(start, &format!("By `yair export {format}` from {place} ({name})."))
}

/// What the calibration cautions of, and which effects of an extended model the format leaves out;
/// `runs_effects` says that those that can run on board are not left out.
pub(crate) fn limits(start: &str, robot: &CalibratedRobot, runs_effects: bool) -> String {
    let mut lines = String::new();
    for caution in &robot.cautions {
        lines.push_str(&wrapped(start, &format!("Caution: {}.", comment(caution))));
    }
    for effect in robot.left_out(runs_effects) {
        let why = if runs_effects { format!(": {}", effect.on_board.detail()) } else { String::new() };
        lines.push_str(&wrapped(start, &format!("Left out: {} ({}){why}.", effect.id, effect.meaning)));
    }
    lines
}

/// A number with a decimal point, as YAML and Java tell it from an integer: at most so many decimals, without
/// zeros at its end.
pub(crate) fn decimal(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let short = text.trim_end_matches('0');
    if short.ends_with('.') { format!("{short}0") } else { short.to_owned() }
}

/// A variance: three digits, with a decimal point and an exponent that has a sign: YAML 1.1 takes a number
/// without one for a string.
pub(crate) fn variance(value: f64) -> String {
    let text = format!("{value:.2e}");
    if text.contains("e-") { text } else { text.replace('e', "e+") }
}

/// "± 0.031 mm", or that nothing is known of it.
pub(crate) fn plus_minus_mm(length: &Length) -> String {
    let sigma_mm = length.sigma_m.map(|sigma_m| 1e3 * sigma_m).filter(|sigma_mm| sigma_mm.is_finite());
    sigma_mm.map_or_else(|| "± not known".to_owned(), |sigma_mm| format!("± {} mm", digits(sigma_mm)))
}

/// A standard deviation with two digits.
pub(crate) fn digits(sigma: f64) -> String {
    let decimals = if sigma > 0.0 { (1.0 - sigma.log10().floor()).clamp(0.0, 9.0) as usize } else { 1 };
    format!("{sigma:.decimals$}")
}

/// A length in millimetres, to the micrometre.
pub(crate) fn mm(value_m: f64) -> String {
    format!("{:.3}", 1e3 * value_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_text_of_a_file_ends_a_comment() {
        assert_eq!(comment("a */ int x; /* b\n#define C\r\tend \\"), "a * / int x; / * b #define C  end /");
        assert_eq!(comment("**/"), "** /");
        assert_eq!(comment("*??/ ???/ *\\"), "*? ?/ ? ? ?/ * /");
        assert_eq!(comment("a\u{2028}b\u{202e}c"), "a b c");
        assert_eq!(comment(&"x".repeat(1000)).chars().count(), MAX_CHARS + 1);
    }

    #[test]
    fn numbers_keep_their_point() {
        assert_eq!(
            (decimal(1.0, 9), decimal(0.1235, 9), decimal(1e-12, 9)),
            ("1.0".into(), "0.1235".into(), "0.0".into())
        );
        assert_eq!((digits(0.03123), digits(12.3), digits(0.0)), ("0.031".into(), "12".into(), "0.0".into()));
        assert_eq!((variance(1.234e-5), variance(1e6)), ("1.23e-5".into(), "1.00e+6".into()));
    }

    #[test]
    fn a_standard_deviation_beyond_numbers_is_not_known() {
        let of = |sigma_m| plus_minus_mm(&Length { value_m: 0.1, sigma_m, nominal_m: None });
        assert_eq!(of(Some(2e-5)), "± 0.020 mm");
        for none in [None, Some(f64::INFINITY), Some(f64::NAN), Some(1e306)] {
            assert_eq!(of(none), "± not known");
        }
    }

    #[test]
    fn lines_are_wrapped_behind_their_start() {
        let text = "word ".repeat(40);
        let lines = wrapped("#", &text);
        assert!(lines.lines().all(|line| line.starts_with("# ") && line.chars().count() <= 100), "{lines}");
        assert_eq!(lines.matches("word").count(), 40);
    }
}
