//! Which robot a session is of, and when it was recorded: what tells the sessions of a fleet apart.

use jiff::Timestamp;

/// What is expected of an instant, for messages.
const EXPECTED: &str = "expected an instant of RFC 3339 with its offset from UTC, such as 2026-11-23T09:00:00+01:00 or 2026-11-23T08:00:00Z";

/// Reads an instant of RFC 3339, which has an offset from UTC.
///
/// # Errors
/// A message that says what is expected.
pub fn parse_recorded(text: &str) -> Result<Timestamp, String> {
    text.trim().parse().map_err(|_| format!("\"{}\" is no such instant; {EXPECTED}", text.escape_debug()))
}

/// Takes a robot's id: a text that is not empty, without control characters or space at its ends.
///
/// # Errors
/// A message that says what is expected.
pub fn parse_robot_id(text: &str) -> Result<String, String> {
    let is_id = !text.is_empty() && text.trim() == text && !text.contains(char::is_control);
    let why = "expected a text that is not empty, without space at its ends or control characters";
    if is_id { Ok(text.to_owned()) } else { Err(format!("\"{}\" is no id; {why}", text.escape_debug())) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_instant_is_the_same_in_any_offset_and_needs_one() {
        let utc = parse_recorded("2026-11-23T08:00:00Z").expect("an instant");
        assert_eq!(parse_recorded("2026-11-23T09:00:00+01:00"), Ok(utc));
        assert_eq!(utc.to_string(), "2026-11-23T08:00:00Z");
        for wrong in ["2026-11-23", "2026-11-23T08:00:00", "2026-02-30T08:00:00Z", "yesterday", ""] {
            let message = parse_recorded(wrong).expect_err(wrong);
            assert!(message.contains("RFC 3339"), "{message}");
        }
    }

    #[test]
    fn an_id_is_a_text_in_one_line() {
        assert_eq!(parse_robot_id("cart 7").as_deref(), Ok("cart 7"));
        for wrong in ["", " ", "cart\n7", "cart "] {
            assert!(parse_robot_id(wrong).is_err(), "{wrong:?}");
        }
    }
}
