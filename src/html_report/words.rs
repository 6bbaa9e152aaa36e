//! Numbers and names as pages show them.

use calib::ReportedValue;
use report_page::{Block, Cell, Table};

/// Values below are written with an exponent: nobody counts zeros.
const SMALL: f64 = 1e-3;

/// A value with its standard deviation, with as many decimals as that is worth.
pub(super) fn plus_minus(value: f64, sigma: Option<f64>) -> String {
    match sigma.filter(|sigma| sigma.is_finite() && *sigma > 0.0) {
        Some(sigma) if value != 0.0 && value.abs() < SMALL => {
            // As engineers write it: an exponent that is a multiple of three, the same for both.
            let exponent = 3 * (value.abs().log10() / 3.0).floor() as i32;
            let scale = 10_f64.powi(-exponent);
            let decimals = (1.0 - (scale * sigma).log10().floor()).clamp(0.0, 9.0) as usize;
            format!("{:.decimals$}e{exponent} ± {:.decimals$}e{exponent}", scale * value, scale * sigma)
        }
        Some(sigma) => {
            let decimals = (1.0 - sigma.log10().floor()).clamp(0.0, 12.0) as usize;
            format!("{value:.decimals$} ± {sigma:.decimals$}")
        }
        None => plain(value),
    }
}

/// The parameters of a calibration beside the robot's nominal ones.
pub(super) fn parameters<'p>(
    caption: &str,
    values: impl IntoIterator<Item = (&'p String, &'p ReportedValue)>,
    nominal: impl Fn(&str) -> Option<f64>,
) -> Block {
    let mut table = Table::new(caption, &["parameter", "nominal", "calibrated ± one standard deviation", "change"]);
    for (key, value) in values {
        let stated = nominal(key);
        let shown = value.value.map_or_else(|| "not determined".to_owned(), |found| plus_minus(found, value.sigma));
        let change =
            value.ratio_to_nominal.map_or_else(|| "–".to_owned(), |ratio| format!("{:+.3} %", 100.0 * (ratio - 1.0)));
        table.row([
            Cell::id(key.clone()),
            Cell::number(stated.map_or_else(|| "–".to_owned(), plain)),
            Cell::number(shown),
            Cell::number(change),
        ]);
    }
    Block::Table(table)
}

/// A value without a standard deviation, with at most seven digits.
pub(super) fn plain(value: f64) -> String {
    let short: f64 = format!("{value:.6e}").parse().unwrap_or(value);
    if short != 0.0 && short.abs() < SMALL { format!("{short:e}") } else { format!("{short}") }
}

/// Lines to be copied, `key = value`, of what was determined.
pub(super) fn to_copy<'p>(values: impl IntoIterator<Item = (&'p String, &'p ReportedValue)>) -> String {
    let line = |(key, value): (&String, &ReportedValue)| {
        let found = value.value?;
        let decimals = value.sigma.filter(|sigma| *sigma > 0.0 && sigma.is_finite());
        // Two digits beyond the standard deviation: rounding adds nothing to it.
        let decimals = decimals.map_or(9, |sigma| (3.0 - sigma.log10().floor()).clamp(0.0, 15.0) as usize);
        Some(format!("{key} = {found:.decimals$}"))
    };
    values.into_iter().filter_map(line).collect::<Vec<_>>().join("\n")
}

/// A length a person can picture.
pub(super) fn of_millimetres(length_m: Option<f64>) -> String {
    length_m.map_or_else(|| "–".to_owned(), |length_m| format!("{:.2}", 1e3 * length_m))
}

/// One of several: "1 run", "2 runs".
pub(super) fn count(number: usize, what: &str) -> String {
    if number == 1 { format!("1 {what}") } else { format!("{number} {what}s") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_values_have_an_exponent_and_others_have_none() {
        let cases = [
            (0.161_588_1, Some(1.8e-5), "0.161588 ± 0.000018"),
            (1.262_41e-5, Some(1.4e-9), "12.6241e-6 ± 0.0014e-6"),
            (-9.99e-4, Some(1e-4), "-999e-6 ± 100e-6"),
            (1e-3, None, "0.001"),
            (4.658_756_466_911_947e-5, None, "4.658756e-5"),
            (0.0, Some(0.1), "0.00 ± 0.10"),
        ];
        for (value, sigma, expected) in cases {
            assert_eq!(plus_minus(value, sigma), expected);
        }
    }
}
