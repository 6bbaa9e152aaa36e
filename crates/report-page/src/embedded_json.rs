//! Data for the script: JSON inside an element, which nothing in it can end.
//!
//! A block `<script type="application/json">` ends at `</script`, whatever string that stands in, and `<!--`
//! changes how it is read on. So every `<`, `>` and `&` is written as an escape of JSON, and the two line
//! ends of Unicode as well, which older JavaScript takes for ends of lines.

use serde_json::Value;

/// JSON that can stand in an element of a page.
pub(crate) fn embedded(value: &Value) -> String {
    let plain = value.to_string();
    let mut text = String::with_capacity(plain.len());
    for character in plain.chars() {
        match character {
            '<' => text.push_str("\\u003c"),
            '>' => text.push_str("\\u003e"),
            '&' => text.push_str("\\u0026"),
            '\u{2028}' => text.push_str("\\u2028"),
            '\u{2029}' => text.push_str("\\u2029"),
            other => text.push(other),
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_ends_the_element_and_everything_is_read_back() {
        let hostile = "</script><script>alert(1)</script><!-- \u{2028}\u{2029} & \" \\ é";
        let value = serde_json::json!({ "run": hostile, "numbers": [1.5, -2, null] });
        let text = embedded(&value);
        assert!(!text.contains(['<', '>', '&', '\u{2028}', '\u{2029}']), "{text}");
        let back: Value = serde_json::from_str(&text).expect("JSON");
        assert_eq!(back, value);
        // What is to be escaped is not so by itself.
        assert!(value.to_string().contains("</script>"));
    }
}
