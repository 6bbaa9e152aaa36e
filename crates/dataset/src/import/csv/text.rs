//! The text of a CSV file: delimiters, fields, and numbers as people write them.

use std::io::Read;
use std::path::Path;

use crate::error::DatasetError;
use crate::settings::{FILE_LIMIT_BYTES, LINE_LIMIT_BYTES};
use crate::table::open_file;

/// A file that is not text shows it within so many bytes.
const PROBED_BYTES: usize = 64 * 1024;

const EXPECTED: &str = "a table as text: columns of time and of wheels, of time and poses, or of both";

/// What stands between two fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Delimiter {
    /// `,`
    Comma,
    /// `;`
    Semicolon,
    /// A tabulator.
    Tab,
    /// `|`
    Pipe,
    /// Any number of spaces.
    Spaces,
}

impl Delimiter {
    /// All, the usual first.
    pub const ALL: [Self; 5] = [Self::Comma, Self::Semicolon, Self::Tab, Self::Pipe, Self::Spaces];

    /// The name that flags and output use.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Comma => "comma",
            Self::Semicolon => "semicolon",
            Self::Tab => "tab",
            Self::Pipe => "pipe",
            Self::Spaces => "spaces",
        }
    }

    const fn byte(self) -> Option<u8> {
        match self {
            Self::Comma => Some(b','),
            Self::Semicolon => Some(b';'),
            Self::Tab => Some(b'\t'),
            Self::Pipe => Some(b'|'),
            Self::Spaces => None,
        }
    }

    /// Splits a line into `fields`, without blanks and quotes around them.
    pub(super) fn split<'a>(self, line: &'a str, fields: &mut Vec<&'a str>) {
        fields.clear();
        let Some(delimiter) = self.byte() else {
            fields.extend(line.split_ascii_whitespace().map(unquoted));
            return;
        };
        if !line.contains('"') {
            fields.extend(line.split(char::from(delimiter)).map(str::trim));
            return;
        }
        let (mut start, mut inside) = (0, false);
        for (at, byte) in line.bytes().enumerate() {
            if byte == b'"' {
                inside = !inside;
            } else if byte == delimiter && !inside {
                fields.push(unquoted(&line[start..at]));
                start = at + 1;
            }
        }
        fields.push(unquoted(&line[start..]));
    }
}

fn unquoted(field: &str) -> &str {
    let field = field.trim();
    field.strip_prefix('"').and_then(|field| field.strip_suffix('"')).map_or(field, str::trim)
}

/// What stands between whole and fraction of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Decimal {
    /// `1.5`
    Point,
    /// `1,5`
    Comma,
}

impl Decimal {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Point, Self::Comma];

    /// The name that flags and output use.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Point => "point",
            Self::Comma => "comma",
        }
    }

    /// A number; `None` where the field is none. NaN and infinities are numbers here.
    pub(super) fn number(self, field: &str) -> Option<f64> {
        match self {
            Self::Point => field.parse().ok(),
            Self::Comma if field.contains('.') => None,
            Self::Comma if field.contains(',') => field.replacen(',', ".", 1).parse().ok(),
            Self::Comma => field.parse().ok(),
        }
    }

    /// A decimal number in units of 10⁻¹², every digit down to there, with an exponent or without: a stamp of
    /// nanoseconds since 1970 has more digits than a double.
    pub(super) fn exact(self, field: &str) -> Option<i128> {
        let separator = if self == Self::Point { '.' } else { ',' };
        let (negative, digits) = match field.strip_prefix('-') {
            Some(rest) => (true, rest),
            None => (false, field.strip_prefix('+').unwrap_or(field)),
        };
        let (digits, exponent) = match digits.split_once(['e', 'E']) {
            Some((digits, exponent)) => (digits, exponent.parse::<i32>().ok()?),
            None => (digits, 0),
        };
        let (whole, fraction) = digits.split_once(separator).unwrap_or((digits, ""));
        let plain = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
        if (whole.is_empty() && fraction.is_empty()) || !plain(whole) || !plain(fraction) {
            return None;
        }
        // Where the last digit that counts stands among all, the point moved by the exponent.
        let count = i64::from(exponent) + whole.len() as i64 + EXACT_DIGITS as i64;
        let significant = whole.bytes().chain(fraction.bytes()).skip_while(|byte| *byte == b'0').count() as i64;
        let leading = (whole.len() + fraction.len()) as i64 - significant;
        if count - leading > MAX_EXACT_DIGITS && significant > 0 {
            return None;
        }
        let mut value: i128 = 0;
        if significant > 0 {
            let all = whole.bytes().chain(fraction.bytes()).chain(std::iter::repeat(b'0'));
            for byte in all.take(usize::try_from(count).unwrap_or(0)) {
                value = 10 * value + i128::from(byte - b'0');
            }
        }
        Some(if negative { -value } else { value })
    }
}

/// An instant that is written as a date with a time of day (ISO 8601, and with a space as pandas writes it),
/// in units of 10⁻¹² s since 1970; without an offset it counts as UTC.
pub(super) fn date_and_time(field: &str) -> Option<i128> {
    // Numbers are no dates; `20240301` might be read as one.
    if field.as_bytes().get(4).is_none_or(|byte| *byte != b'-') {
        return None;
    }
    let instant: jiff::Timestamp = field.parse().or_else(|_| format!("{field}Z").parse()).ok()?;
    Some(instant.as_nanosecond() * 1000)
}

/// Most digits of [`Decimal::exact`]: as many as an `i128` holds, less the three of a sum of times.
const MAX_EXACT_DIGITS: i64 = 36;

/// Digits behind the decimal point that [`Decimal::exact`] keeps.
const EXACT_DIGITS: usize = 12;

/// Units of [`Decimal::exact`] in one.
pub(super) const EXACT_SCALE: f64 = 1e12;

/// The file as text, without a byte-order mark.
pub(super) fn read(file: &Path) -> Result<String, DatasetError> {
    let io = |source| DatasetError::Io { path: file.to_owned(), source };
    let opened = open_file(file, EXPECTED)?;
    if opened.metadata().map_err(io)?.len() > FILE_LIMIT_BYTES {
        return Err(DatasetError::FileTooLong { file: file.to_owned(), limit_bytes: FILE_LIMIT_BYTES });
    }
    // Once more while reading, as a file may grow.
    let mut bytes = Vec::new();
    opened.take(FILE_LIMIT_BYTES + 1).read_to_end(&mut bytes).map_err(io)?;
    if bytes.len() as u64 > FILE_LIMIT_BYTES {
        return Err(DatasetError::FileTooLong { file: file.to_owned(), limit_bytes: FILE_LIMIT_BYTES });
    }
    let not_text = |at: usize| DatasetError::NotUtf8 {
        file: file.to_owned(),
        line: 1 + memchr::memchr_iter(b'\n', &bytes[..at]).count() as u64,
    };
    if let Some(at) = memchr::memchr(0, &bytes[..bytes.len().min(PROBED_BYTES)]) {
        return Err(not_text(at));
    }
    let text = std::str::from_utf8(&bytes).map_err(|error| not_text(error.valid_up_to()))?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(text).to_owned();
    if text.trim().is_empty() {
        return Err(DatasetError::EmptyFile { file: file.to_owned(), expected: EXPECTED.to_owned() });
    }
    if let Some(line) = text.lines().position(|line| line.len() > LINE_LIMIT_BYTES) {
        let (file, line) = (file.to_owned(), line as u64 + 1);
        return Err(DatasetError::LineTooLong { file, line, limit_bytes: LINE_LIMIT_BYTES });
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_split_at_their_delimiter_and_not_inside_of_quotes() {
        let mut fields = Vec::new();
        Delimiter::Semicolon.split("1,5; \"a;b\" ;;2", &mut fields);
        assert_eq!(fields, ["1,5", "a;b", "", "2"]);
        Delimiter::Spaces.split("  1   2\t3 ", &mut fields);
        assert_eq!(fields, ["1", "2", "3"]);
    }

    #[test]
    fn numbers_with_decimal_commas_are_numbers_and_thousands_are_not() {
        assert_eq!(Decimal::Comma.number("-1,25"), Some(-1.25));
        assert_eq!(Decimal::Comma.number("7"), Some(7.0));
        assert_eq!(Decimal::Comma.number("1.234,5"), None);
        assert_eq!(Decimal::Point.number("1,5"), None);
    }

    #[test]
    fn stamps_keep_every_digit() {
        assert_eq!(Decimal::Point.exact("1700000000123456789"), Some(1_700_000_000_123_456_789 * 10_i128.pow(12)));
        assert_eq!(Decimal::Point.exact("1700000000.123456789"), Some(1_700_000_000_123_456_789 * 1000));
        assert_eq!(Decimal::Comma.exact("-0,5"), Some(-500_000_000_000));
        assert_eq!(Decimal::Point.exact("1e3"), Some(1000 * 10_i128.pow(12)));
        // As numpy writes stamps; the digits behind the 12th are left out.
        assert_eq!(Decimal::Point.exact("1.305031102175800085e+09"), Some(1_305_031_102_175_800_085_000));
        assert_eq!(Decimal::Point.exact("5.00e-01"), Some(500_000_000_000));
        assert_eq!(Decimal::Point.exact("0.0000000000000001e2"), Some(0));
        assert_eq!(Decimal::Point.exact("0.000000000000000000e+00"), Some(0));
        assert_eq!(Decimal::Point.exact("7e-400"), Some(0));
        for wrong in ["", ".", "x", "1,5", "NaN", "inf", "--1", "e3", "1e", "1e99", "1e9999999999"] {
            assert_eq!(Decimal::Point.exact(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn dates_are_instants_to_the_nanosecond() {
        let noon = 1_709_294_400_i128 * 10_i128.pow(12);
        assert_eq!(date_and_time("2024-03-01T12:00:00Z"), Some(noon));
        assert_eq!(date_and_time("2024-03-01 12:00:00.123456+00:00"), Some(noon + 123_456_000_000));
        assert_eq!(date_and_time("2024-03-01 13:00:00.123456789+01:00"), Some(noon + 123_456_789_000));
        assert_eq!(date_and_time("2024-03-01 12:00:00"), Some(noon));
        for wrong in ["", "2024", "20240301", "2024-03-01", "1709294400.5", "12:00:00"] {
            assert_eq!(date_and_time(wrong), None, "{wrong}");
        }
    }
}
