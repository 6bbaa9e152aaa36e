//! Which kinds of ordinary logs ([`plain_robot::KINDS`]) and how many robots of each a test asks.

use plain_robot::{KINDS, Kind};

/// Robots of each kind, and the first seed.
pub(crate) fn robots() -> (u64, u64) {
    let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse().ok());
    (number("YAIR_ROBOTS").unwrap_or(1), number("YAIR_SEED").unwrap_or(500))
}

/// Kinds that are asked where YAIR_ROBOTS or YAIR_KIND is set alone: others are like them.
const IN_CAMPAIGNS: [&str; 3] = ["rippled", "cm/s", "two decimals"];

/// Kinds whose name has the text of YAIR_KIND in it; all without.
pub(crate) fn kinds() -> impl Iterator<Item = &'static Kind> {
    let of = std::env::var("YAIR_KIND").unwrap_or_default();
    let is_campaign = ["YAIR_ROBOTS", "YAIR_KIND"].iter().any(|name| std::env::var_os(name).is_some());
    let is_asked = move |name: &str| is_campaign || !IN_CAMPAIGNS.iter().any(|part| name.contains(part));
    KINDS.iter().filter(move |(name, ..)| name.contains(&of) && is_asked(name))
}
