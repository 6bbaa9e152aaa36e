//! Numbers for the tables beside pictures, and the signs of all numbers that are read.

use serde_json::{Value, json};

/// Significant digits: a picture of a thousand pixels shows no more.
const DIGITS: i32 = 4;

/// A number with four significant digits, without an exponent where it is readable without.
pub(crate) fn shown(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".to_owned() } else { "–".to_owned() };
    }
    let exponent = value.abs().log10().floor() as i32;
    if (-4..7).contains(&exponent) {
        let decimals = (DIGITS - 1 - exponent).max(0) as usize;
        format!("{value:.decimals$}")
    } else {
        format!("{value:.3e}")
    }
}

/// A number for a script with so many digits behind the first: pictures and cursors show fewer, and a page is
/// to be small. Null of what is no number.
pub(crate) fn rounded(value: f64, digits: usize) -> Value {
    let short = || format!("{value:.digits$e}").parse::<f64>().ok();
    value.is_finite().then(short).flatten().map_or(Value::Null, |value| json!(value))
}

/// Units that stay on the line of their number.
const UNITS: [&str; 11] = ["%", "°", "°/s", "m", "mm", "s", "ms", "min", "rad", "mrad", "m/s"];

/// Hyphens before numbers, and in their exponents, as minus signs; no line is broken between a number and its
/// unit, and no space is before a degree's sign. Hyphens in names, dates and words stay.
pub(crate) fn typeset(text: &str) -> String {
    let characters: Vec<char> = text.chars().collect();
    let is_digit = |at: usize| characters.get(at).is_some_and(char::is_ascii_digit);
    let is_number = |c: &char| c.is_ascii_digit() || *c == '.';
    // Before the sign: nothing that a name or a date would have.
    let begins = |at: usize| {
        at.checked_sub(1).is_none_or(|before| {
            let before = characters[before];
            before.is_whitespace() || "(±→[,:=<>≤≥|".contains(before)
        })
    };
    let is_exponent = |at: usize| {
        let Some(e) = at.checked_sub(1).filter(|before| characters[*before] == 'e') else { return false };
        let mantissa = characters[..e].iter().rev().take_while(|c| is_number(c)).count();
        let start = e - mantissa;
        mantissa > 0 && (begins(start) || characters[start - 1] == '-' && begins(start - 1))
    };
    let sign = |at: usize| {
        let before_number = is_digit(at + 1) || characters.get(at + 1) == Some(&'.') && is_digit(at + 2);
        characters[at] == '-' && before_number && (begins(at) || is_exponent(at))
    };
    let before_unit = |at: usize| {
        let word = characters[at + 1..].iter().take_while(|c| c.is_alphabetic() || "%°/".contains(**c));
        characters[at] == ' ' && at > 0 && is_digit(at - 1) && UNITS.contains(&word.collect::<String>().as_str())
    };
    let typeset = |at: usize| match characters[at] {
        _ if sign(at) => Some('−'),
        _ if before_unit(at) => (characters[at + 1] != '°').then_some('\u{a0}'),
        other => Some(other),
    };
    (0..characters.len()).filter_map(typeset).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn minus_signs_are_before_numbers_and_units_on_their_lines() {
        let cases = [
            ("-6.5 % to +8 %", "−6.5\u{a0}% to +8\u{a0}%"),
            ("2 m by 1.8 m/s, 3 metres, run 7 min", "2\u{a0}m by 1.8\u{a0}m/s, 3 metres, run 7\u{a0}min"),
            ("104.7 ± 0.1 ° to the right, 3 °/s, heading, °", "104.7 ± 0.1° to the right, 3°/s, heading, °"),
            ("-1.2e-6 ± 3e-7 (-.5)", "−1.2e−6 ± 3e−7 (−.5)"),
            ("run-01 of 2020-06-12, x-1e-3, --room, a1e-5", "run-01 of 2020-06-12, x-1e-3, --room, a1e-5"),
            ("clock - 3 s, 95 %-interval, 13-8", "clock - 3\u{a0}s, 95\u{a0}%-interval, 13-8"),
            ("z = -4.0; <-1", "z = −4.0; <−1"),
            ("", ""),
        ];
        for (text, expected) in cases {
            assert_eq!(typeset(text), expected);
        }
    }

    #[test]
    fn numbers_have_four_digits_on_both_sides_of_an_exponent() {
        let cases = [
            (0.0, "0"),
            (-12.34567, "-12.35"),
            (1e-4, "0.0001000"),
            (9.9e-5, "9.900e-5"),
            (123_456.0, "123456"),
            (1.5e7, "1.500e7"),
            (f64::NAN, "–"),
        ];
        for (value, expected) in cases {
            assert_eq!(shown(value), expected);
        }
    }
}
