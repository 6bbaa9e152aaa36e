//! Numbers of documents that are read back: calibrations, kept results, states and baselines.
//!
//! Anybody may have written a document, by hand or by a program with a fault. Each of its numbers is read
//! through one of these types, by [`checked`] as the field's `deserialize_with`, and is then in the range of
//! its kind: never NaN or infinite, and of a size whose fourth powers, quotients and other units are doubles
//! too, so that nothing which is computed or printed of it becomes either.

use serde::{Deserialize, Deserializer};

use crate::settings::{LARGEST_NUMBER, SMALLEST_POSITIVE};

/// A number that is not in the range of its kind.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{value:?} where {expected} is expected")]
pub struct OutOfRange {
    /// The number.
    pub value: f64,
    /// The range, for people.
    pub expected: &'static str,
}

/// A checked number, or several of them, and what they are as plain ones.
pub trait Checked {
    /// `f64`, or the same collection of them.
    type Plain;
    /// Without the check.
    fn plain(self) -> Self::Plain;
}

impl<C: Checked> Checked for Option<C> {
    type Plain = Option<C::Plain>;
    fn plain(self) -> Self::Plain {
        self.map(C::plain)
    }
}

impl<C: Checked, const N: usize> Checked for [C; N] {
    type Plain = [C::Plain; N];
    fn plain(self) -> Self::Plain {
        self.map(C::plain)
    }
}

impl<C: Checked> Checked for Vec<C> {
    type Plain = Vec<C::Plain>;
    fn plain(self) -> Self::Plain {
        self.into_iter().map(C::plain).collect()
    }
}

impl<A: Checked, B: Checked> Checked for (A, B) {
    type Plain = (A::Plain, B::Plain);
    fn plain(self) -> Self::Plain {
        (self.0.plain(), self.1.plain())
    }
}

/// The name before a number.
impl Checked for String {
    type Plain = Self;
    fn plain(self) -> Self {
        self
    }
}

/// Reads a plain field through its checked type: `#[serde(deserialize_with = "checked::<Positive, _>")]`. An
/// optional one needs `default` beside it.
///
/// # Errors
/// [`OutOfRange`] in the words of the format.
pub fn checked<'de, C: Checked + Deserialize<'de>, D: Deserializer<'de>>(from: D) -> Result<C::Plain, D::Error> {
    C::deserialize(from).map(C::plain)
}

macro_rules! checked_numbers {
    ($($(#[$about:meta])+ $name:ident: $expected:literal, $holds:expr;)+) => {$(
        $(#[$about])+
        #[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Deserialize)]
        #[serde(try_from = "f64")]
        pub struct $name(f64);

        impl TryFrom<f64> for $name {
            type Error = OutOfRange;
            fn try_from(value: f64) -> Result<Self, OutOfRange> {
                let holds: fn(f64) -> bool = $holds;
                if holds(value) { Ok(Self(value)) } else { Err(OutOfRange { value, expected: $expected }) }
            }
        }

        impl Checked for $name {
            type Plain = f64;
            fn plain(self) -> f64 {
                self.0
            }
        }
    )+};
}

checked_numbers! {
    /// A number of either sign.
    Number: "a number of at most 1e60", |value| value.abs() <= LARGEST_NUMBER;
    /// A number above zero: a length, a ratio.
    Positive: "a number from 1e-60 to 1e60", |value| (SMALLEST_POSITIVE..=LARGEST_NUMBER).contains(&value);
    /// Zero or a number above it: a standard deviation, a variance.
    NotNegative: "0 or a number from 1e-60 to 1e60",
        |value| value == 0.0 || (SMALLEST_POSITIVE..=LARGEST_NUMBER).contains(&value);
    /// A share or a probability.
    Share: "a number from 0 to 1", |value| (0.0..=1.0).contains(&value);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_of_its_kind_is_refused_with_the_kind() {
        // None of the kinds holds a NaN, an infinity or what overflows in other units.
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e61, f64::MAX, -f64::MAX] {
            let refused = [
                Number::try_from(value).is_err(),
                Positive::try_from(value).is_err(),
                NotNegative::try_from(value).is_err(),
                Share::try_from(value).is_err(),
            ];
            assert_eq!(refused, [true; 4], "{value}");
        }
        assert!(Number::try_from(-1e60).is_ok() && Number::try_from(5e-324).is_ok());
        assert!(Positive::try_from(1e-60).is_ok() && Positive::try_from(5e-324).is_err());
        assert!(Positive::try_from(0.0).is_err() && NotNegative::try_from(-0.0).is_ok());
        assert!(NotNegative::try_from(5e-324).is_err() && NotNegative::try_from(-1e-9).is_err());
        assert!(Share::try_from(1.0).is_ok() && Share::try_from(2.0).is_err());
        let message = Share::try_from(2.0).expect_err("no share").to_string();
        assert_eq!(message, "2.0 where a number from 0 to 1 is expected");
    }

    #[test]
    fn fields_are_plain_numbers_that_were_checked() {
        #[derive(Debug, PartialEq, Deserialize)]
        struct Document {
            #[serde(deserialize_with = "checked::<Positive, _>")]
            length_m: f64,
            #[serde(default, deserialize_with = "checked::<Option<[NotNegative; 2]>, _>")]
            sigmas: Option<[f64; 2]>,
            #[serde(default, deserialize_with = "checked::<Vec<(String, Number)>, _>")]
            named: Vec<(String, f64)>,
        }
        let read = |text: &str| serde_json::from_str::<Document>(text).map_err(|error| error.to_string());
        assert_eq!(read(r#"{"length_m": 2}"#), Ok(Document { length_m: 2.0, sigmas: None, named: Vec::new() }));
        let named = |number: &str| read(&format!(r#"{{"length_m": 2, "named": [["a", 1], ["b", {number}]]}}"#));
        assert_eq!(named("-3").map(|of| of.named), Ok(vec![("a".to_owned(), 1.0), ("b".to_owned(), -3.0)]));
        assert!(named("1e61").is_err_and(|why| why.starts_with("1e61 where a number of at most 1e60 is expected")));
        assert_eq!(read(r#"{"length_m": 2, "sigmas": [0, 1.5]}"#).map(|of| of.sigmas), Ok(Some([0.0, 1.5])));
        let why = read(r#"{"length_m": 2, "sigmas": [0, -1]}"#).expect_err("negative");
        assert!(why.starts_with("-1.0 where 0 or a number from 1e-60 to 1e60 is expected"), "{why}");
    }
}
