//! Numbers for the tables beside pictures.

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

#[cfg(test)]
mod tests {
    use super::*;

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
