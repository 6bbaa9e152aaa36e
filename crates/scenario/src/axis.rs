//! An axis of a sweep: the keys that it sets, and the levels that it takes: listed for a grid, or a range for
//! Sobol points.
//!
//! Owen-scrambled Sobol points (Sobol' 1967; Owen 1995; Burley 2020) fill the ranges evenly in all their
//! projections: of 2^k points every half of every axis holds exactly half, where random points would leave
//! gaps and a grid of so many axes would need 2^k levels. The scenario's seed scrambles them.

use std::fmt;

use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use toml::{Table, Value};

/// The value that a point of a sweep takes on one axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Level {
    /// A number put at the axis' keys.
    Number(f64),
    /// The name of a case.
    Name(String),
}

impl fmt::Display for Level {
    /// The shortest text that reads back to the same value.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => number.fmt(f),
            Self::Name(name) => name.fmt(f),
        }
    }
}

/// The levels of an axis.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Levels {
    /// Every level of a grid.
    List(Vec<f64>),
    /// Where Sobol points fall.
    Range(Range),
}

impl<'de> Deserialize<'de> for Levels {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct ListOrRange;
        impl<'de> Visitor<'de> for ListOrRange {
            type Value = Levels;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a list of levels, as [0.0, 0.002], or a range, as { from = 0.0, to = 0.002 }")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<Levels, A::Error> {
                Deserialize::deserialize(SeqAccessDeserializer::new(list)).map(Levels::List)
            }

            fn visit_map<A: MapAccess<'de>>(self, range: A) -> Result<Levels, A::Error> {
                Deserialize::deserialize(MapAccessDeserializer::new(range)).map(Levels::Range)
            }
        }
        deserializer.deserialize_any(ListOrRange)
    }
}

/// A range of levels.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Range {
    /// Smallest level, in the unit of the key.
    pub from: f64,
    /// Largest level, in the same unit.
    pub to: f64,
    /// How levels are spread in between.
    #[serde(default)]
    pub scale: Scale,
}

/// How levels are spread over a range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scale {
    /// Evenly.
    #[default]
    Linear,
    /// Evenly in the logarithm.
    Log,
}

/// Levels are rounded to so many decimals after the first digit, so that they can be printed and typed back.
const LEVEL_DECIMALS: usize = 5;

impl Range {
    /// What is wrong with it for a key that is `whole`.
    pub(crate) fn check(&self, whole: bool) -> Result<(), String> {
        let (from, to) = (self.from, self.to);
        if !(from.is_finite() && to.is_finite() && from < to) {
            return Err(format!("a range from {from} to {to} is empty"));
        }
        if self.scale == Scale::Log && from <= 0.0 {
            return Err(format!("a range on a log scale starts above 0, not at {from}"));
        }
        match [from, to].into_iter().find(|end| whole && end.fract() != 0.0) {
            Some(end) => Err(format!("{end} is not a whole number, as this key asks")),
            None => Ok(()),
        }
    }

    /// The level at a share `u` in [0, 1) of the range. A whole number owns the half on either side of it, so
    /// that the ends are as likely as the others.
    pub(crate) fn level(&self, u: f64, whole: bool) -> f64 {
        let half = if whole { 0.5 } else { 0.0 };
        let (from, to) = (self.from - half, self.to + half);
        let level = match self.scale {
            Scale::Linear => from + u * (to - from),
            Scale::Log => from * (to / from).powf(u),
        };
        let level = if whole { level.round() } else { short_decimal(level) };
        level.clamp(self.from, self.to)
    }
}

/// The number nearest to `value` that prints in six significant digits.
fn short_decimal(value: f64) -> f64 {
    format!("{value:.LEVEL_DECIMALS$e}").parse().unwrap_or(value)
}

/// Share of axis number `axis` at Sobol point number `point`, in [0, 1).
pub(crate) fn sobol_share(seed: u64, point: u32, axis: u32) -> f64 {
    // Both halves of the seed in one word; the crate hashes it.
    let seed = (seed ^ (seed >> 32)) as u32;
    f64::from(sobol_burley::sample(point, axis, seed))
}

/// The dotted keys that an axis names, apart by commas.
pub(crate) fn keys(axis: &str) -> impl Iterator<Item = &str> {
    axis.split(',').map(str::trim)
}

/// The number at a dotted key, with the key spelled in positions: the same place always has the same
/// spelling.
fn number_at<'t>(table: &'t mut Table, key: &str) -> Result<(&'t mut Value, String), String> {
    let known = |table: &Table| table.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
    let mut words = key.split('.');
    let first = words.next().unwrap_or_default();
    if matches!(first, "seed" | "sweep") {
        return Err("the seed and the sweep itself are the same at every point".to_owned());
    }
    let unknown = format!("no \"{first}\" in the scenario; it has: {}", known(table));
    let mut value = table.get_mut(first).ok_or(unknown)?;
    let mut spelled = first.to_owned();
    for word in words {
        spelled.push('.');
        value = match value {
            Value::Table(table) => {
                spelled.push_str(word);
                let unknown = format!("no \"{word}\" there; known keys: {}", known(table));
                table.get_mut(word).ok_or(unknown)?
            }
            Value::Array(items) => {
                let position = position(items, word)?;
                spelled.push_str(&position.to_string());
                &mut items[position]
            }
            _ => return Err(format!("\"{word}\" asks for a part of a single value")),
        };
    }
    match value {
        Value::Float(_) | Value::Integer(_) => Ok((value, spelled)),
        _ => Err("it is not a number".to_owned()),
    }
}

/// Which element of a list is meant, by its number or by its kind or id.
fn position(items: &[Value], word: &str) -> Result<usize, String> {
    let name = |item: &Value| item.get("kind").or(item.get("id")).and_then(Value::as_str).unwrap_or("?").to_owned();
    let names: Vec<String> = items.iter().map(name).collect();
    let unknown = || format!("no \"{word}\" in that list; it has: {}", names.join(", "));
    if let Ok(position) = word.parse::<usize>() {
        return if position < items.len() { Ok(position) } else { Err(unknown()) };
    }
    let mut meant = names.iter().enumerate().filter(|(_, name)| *name == word).map(|(position, _)| position);
    match (meant.next(), meant.next()) {
        (Some(position), None) => Ok(position),
        (Some(first), Some(_)) => Err(format!("several \"{word}\" in that list; say which by number, such as {first}")),
        (None, _) => Err(unknown()),
    }
}

/// Where the keys of an axis lead, and whether any of them asks for whole numbers.
pub(crate) fn key_paths(table: &mut Table, axis: &str) -> Result<(Vec<String>, bool), String> {
    let mut key_paths = Vec::new();
    let mut whole = false;
    for key in keys(axis) {
        let (value, spelled) = number_at(table, key)?;
        whole |= value.is_integer();
        key_paths.push(spelled);
    }
    Ok((key_paths, whole))
}

/// Puts `level` at all keys of an axis, keeping integers integers.
pub(crate) fn set(table: &mut Table, axis: &str, level: f64) -> Result<(), String> {
    for key in keys(axis) {
        match number_at(table, key)?.0 {
            Value::Float(number) => *number = level,
            Value::Integer(number) if level.fract() == 0.0 && level.abs() < 1e15 => *number = level as i64,
            _ => return Err(format!("{level} is not a whole number, as this key asks")),
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINEAR: Range = Range { from: 0.0, to: 0.002, scale: Scale::Linear };
    const LOG: Range = Range { from: 1e-4, to: 1e-2, scale: Scale::Log };
    const WHOLE: Range = Range { from: 2.0, to: 5.0, scale: Scale::Linear };

    fn close(found: f64, expected: f64) {
        // Six digits are kept: half of the last one, 5e-6 of the value at most. A linear scale in place of
        // the log one is off by a factor 5 in the middle.
        assert!((found - expected).abs() <= 5e-6 * expected.abs(), "{found}, not {expected}");
    }

    #[test]
    fn levels_go_from_end_to_end_of_their_range() {
        for (range, middle) in [(LINEAR, 1e-3), (LOG, 1e-3)] {
            assert_eq!(range.level(0.0, false), range.from);
            close(range.level(0.5, false), middle);
            // The largest share that 24 bits hold below 1.
            close(range.level(1.0 - 2_f64.powi(-24), false), range.to);
        }
    }

    #[test]
    fn whole_levels_are_equally_likely_to_the_ends() {
        for (range, expected) in
            [(WHOLE, [2.0, 3.0, 4.0, 5.0]), (Range { from: -4.0, to: -1.0, ..WHOLE }, [-4.0, -3.0, -2.0, -1.0])]
        {
            for (quarter, level) in (0..4).zip(expected) {
                // Just inside of the ends of every quarter; plain rounding of from + u (to − from) would give
                // the ends half of the others' share.
                for u in [0.25 * f64::from(quarter) + 1e-9, 0.25 * f64::from(quarter + 1) - 1e-9] {
                    assert_eq!(range.level(u, true), level);
                }
            }
            assert_eq!((range.level(0.0, true), range.level(1.0 - 1e-16, true)), (range.from, range.to));
        }
        // On a log scale 1 owns 0.5 to 1.5, ln 3 of the ln 21 that reach to 10.5.
        let log = Range { from: 1.0, to: 10.0, scale: Scale::Log };
        let share = 3_f64.ln() / 21_f64.ln();
        assert_eq!([log.level(share - 1e-9, true), log.level(share + 1e-9, true)], [1.0, 2.0]);
    }

    #[test]
    fn levels_are_short_decimals_that_read_back_to_the_same_bits() {
        for k in 0..1000 {
            for range in [LINEAR, LOG] {
                let level = Level::Number(range.level(f64::from(k) / 997.0 % 1.0, false));
                let text = level.to_string();
                assert!(text.trim_start_matches(['0', '.']).len() <= 6, "{text}");
                assert_eq!(Level::Number(text.parse().expect("a number")), level);
            }
        }
    }

    #[test]
    fn ranges_that_hold_no_level_say_why() {
        let why = |range: Range, whole| range.check(whole).expect_err("no range");
        assert!(why(Range { from: 1.0, to: 1.0, ..LINEAR }, false).contains("from 1 to 1 is empty"));
        assert!(why(Range { from: f64::NAN, ..LINEAR }, false).contains("empty"));
        assert!(why(Range { from: 0.0, ..LOG }, false).contains("above 0"));
        assert!(why(Range { to: 7.5, ..WHOLE }, true).contains("7.5 is not a whole number"));
        for (range, whole) in [(LINEAR, false), (LOG, false), (WHOLE, true)] {
            assert_eq!(range.check(whole), Ok(()));
        }
    }

    #[test]
    fn levels_are_a_list_or_a_range_and_nothing_else() {
        #[derive(Debug, PartialEq, Deserialize, Serialize)]
        struct Text {
            axis: Levels,
        }
        let read = |text: &str| toml::from_str::<Text>(text).map(|text| text.axis);
        assert_eq!(read("axis = [1, 2.5]"), Ok(Levels::List(vec![1.0, 2.5])));
        assert_eq!(read("axis = { from = 1e-4, to = 1e-2, scale = \"log\" }"), Ok(Levels::Range(LOG)));
        let written = toml::to_string(&Text { axis: Levels::Range(LOG) }).expect("has a TOML form");
        assert_eq!(read(&written), Ok(Levels::Range(LOG)));
        let refusal = |text: &str| read(text).expect_err("neither").to_string();
        assert!(refusal("axis = 3.0").contains("[0.0, 0.002], or a range"));
        assert!(refusal("axis = { from = 1.0 }").contains("`to`"));
        assert!(refusal("axis = { from = 1.0, to = 2.0, points = 3 }").contains("`scale`"));
        assert!(refusal("axis = { from = 1.0, to = 2.0, scale = \"cubic\" }").contains("`log`"));
    }

    #[test]
    fn one_place_has_one_spelling() {
        let mut table: Table = toml::from_str(
            "seed = 1\nmark = [{ id = \"left\", y = 1 }]\npart = [{ kind = \"a\", n = 1.0 }, { kind = \"b\", n = 1.0 }, { kind = \"b\", n = 2.0 }]",
        )
        .expect("TOML");
        let mut spelled = |axis: &str| key_paths(&mut table, axis);
        assert_eq!(spelled("part.a.n , mark.left.y"), Ok((vec!["part.0.n".to_owned(), "mark.0.y".to_owned()], true)));
        assert_eq!(spelled("part.2.n"), Ok((vec!["part.2.n".to_owned()], false)));
        assert!(spelled("part.b.n").expect_err("two").contains("by number, such as 1"));
        assert!(spelled("part.3.n").expect_err("three").contains("a, b, b"));
        assert!(spelled("mark.right.y").expect_err("one").contains("left"));
        assert!(spelled("part.a.n,").expect_err("nothing after the comma").contains("no \"\""));
        assert!(spelled("seed").expect_err("fixed").contains("same at every point"));
    }
}
