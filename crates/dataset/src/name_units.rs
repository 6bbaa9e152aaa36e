//! Units in the names of columns.

use crate::unit::Unit;

/// Takes the unit out of `time [ms]`, `x (mm)`, `x_[m]`.
pub(crate) fn without_bracketed_unit(name: &str) -> (String, Option<Unit>) {
    for (open, close) in [('[', ']'), ('(', ')')] {
        if let Some((before, rest)) = name.split_once(open)
            && let Some((inside, after)) = rest.split_once(close)
            && let Some(unit) = Unit::named(&inside.trim().to_lowercase())
        {
            return (format!("{before}{after}"), Some(unit));
        }
    }
    (name.to_owned(), None)
}

/// Units that logs are written in and that no quantity is read in.
const OTHER_UNITS: [&str; 12] = ["ft", "feet", "foot", "yd", "km", "dm", "um", "µm", "mrad", "rps", "turns", "hz"];

/// What a name states in brackets as its unit, where that is no unit in which the quantity is read.
pub(crate) fn unreadable_unit(name: &str, accepts: impl Fn(Unit) -> bool) -> Option<&str> {
    [('[', ']'), ('(', ')')].into_iter().find_map(|(open, close)| {
        let inside = name.split_once(open)?.1.split_once(close)?.0.trim();
        let lower = inside.to_lowercase();
        let is_wrong = match Unit::named(&lower) {
            Some(unit) => !accepts(unit),
            None => lower.contains('/') || OTHER_UNITS.contains(&&lower[..]),
        };
        is_wrong.then_some(inside)
    })
}

/// Words of a name: cut at whatever is no letter or digit and where capitals begin, in lower case.
pub(crate) fn tokens_of(name: &str) -> Vec<String> {
    let mut tokens: Vec<String> = Vec::new();
    let (mut current, mut was_lower) = (String::new(), false);
    for letter in name.chars() {
        let ends = !letter.is_alphanumeric() || (letter.is_uppercase() && was_lower);
        if ends && !current.is_empty() {
            tokens.push(std::mem::take(&mut current));
        }
        if letter.is_alphanumeric() || letter == '°' {
            current.extend(letter.to_lowercase());
        }
        was_lower = letter.is_lowercase() || letter.is_ascii_digit();
    }
    if !current.is_empty() {
        tokens.push(current);
    }
    tokens
}

/// Takes the unit off the end of a name: `_ms`, `_rad_s`, `_m_per_s`.
pub(crate) fn take_unit(tokens: &mut Vec<String>) -> Option<Unit> {
    let of = |parts: &[String]| match parts {
        [one] => Unit::named(one),
        // "Zeit in s" is no speed.
        [of, per] if of != "in" => Unit::named(&format!("{of}/{per}")).filter(|unit| unit.is_rate()),
        [of, by, per] if by == "per" => Unit::named(&format!("{of}/{per}")).filter(|unit| unit.is_rate()),
        _ => None,
    };
    for count in [3, 2, 1] {
        if let Some(start) = tokens.len().checked_sub(count)
            && let Some(unit) = of(&tokens[start..])
        {
            tokens.truncate(start);
            return Some(unit);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_that_no_quantity_is_read_in_is_seen() {
        let (length, speed) = (|unit| Unit::LENGTHS.contains(&unit), Unit::is_of_contact);
        assert_eq!(unreadable_unit("v [furlong/s]", speed), Some("furlong/s"));
        assert_eq!(unreadable_unit("x (ft)", length), Some("ft"));
        assert_eq!(unreadable_unit("x [deg]", length), Some("deg"));
        assert_eq!(unreadable_unit("left [rps]", |_| true), Some("rps"));
        assert_eq!(unreadable_unit("v [cm/s]", speed), None);
        for name in ["x (world)", "pose[0]", "x [mm]", "x"] {
            assert_eq!(unreadable_unit(name, length), None, "{name}");
        }
    }
}
