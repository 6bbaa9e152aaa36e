//! Which kinds of ordinary logs ([`plain_robot::KINDS`]) and how many robots of each a test asks.

use plain_robot::{KINDS, Kind};

/// Robots of each kind, and the first seed.
pub(crate) fn robots() -> (u64, u64) {
    let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse().ok());
    (number("YAIR_ROBOTS").unwrap_or(1), number("YAIR_SEED").unwrap_or(500))
}

/// One row in two of a table is asked where neither YAIR_ROBOTS nor YAIR_KIND is set: `.ci/run replay` draws
/// all kinds, and a campaign asks all.
pub(crate) const HALF: usize = 2;
/// The same where a row costs seconds.
pub(crate) const QUARTER: usize = 4;
/// The same of a long table whose rows cost seconds.
pub(crate) const EIGHTH: usize = 8;

/// Kinds whose name has the text of YAIR_KIND in it; one in so many without.
pub(crate) fn kinds(one_in: usize) -> impl Iterator<Item = &'static Kind> {
    asked(KINDS, one_in, |(name, ..)| name)
}

/// Those of a table whose name has the text of YAIR_KIND in it; one in so many without.
pub(crate) fn asked<T>(table: &'static [T], one_in: usize, name: fn(&T) -> &str) -> impl Iterator<Item = &'static T> {
    let of = std::env::var("YAIR_KIND").unwrap_or_default();
    let is_campaign = ["YAIR_ROBOTS", "YAIR_KIND"].iter().any(|name| std::env::var_os(name).is_some());
    table.iter().step_by(if is_campaign { 1 } else { one_in }).filter(move |row| name(row).contains(&of))
}
