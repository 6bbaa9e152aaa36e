//! When a bag was recorded, by the clock of its recorder.

use dataset::Timestamp;

/// Start of the year 2000, nanoseconds: a clock before it counts from a start of its own, as simulated time
/// does, and tells no date.
const FIRST_DATE_NS: i64 = 946_684_800_000_000_000;

/// Nanoseconds of a millisecond, to which the instant is given.
const NS_PER_MS: i64 = 1_000_000;

/// The first of the instants at which messages were received, nanoseconds; `None` where the clock tells no
/// date.
pub(crate) fn recorded(received_ns: impl Iterator<Item = i64>) -> Option<Timestamp> {
    let first_ns = received_ns.min().filter(|first_ns| *first_ns >= FIRST_DATE_NS)?;
    Timestamp::from_millisecond(first_ns / NS_PER_MS).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_receipt_is_the_instant_and_simulated_time_is_none() {
        let at = |all: &[i64]| recorded(all.iter().copied()).map(|instant| instant.to_string());
        let first = 1_700_000_000_250_000_123;
        assert_eq!(at(&[first + 9, first]).as_deref(), Some("2023-11-14T22:13:20.25Z"));
        assert_eq!((at(&[12_000_000_000, first]), at(&[])), (None, None));
    }
}
