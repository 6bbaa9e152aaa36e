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

/// A parameter in words and the unit of a workshop: name, unit, and what takes it there from SI.
fn in_workshop_units(key: &str) -> (String, &'static str, f64) {
    const UNITS: [(&str, &str, f64); 7] = [
        ("_rad_s", "°/s", 180.0 / std::f64::consts::PI),
        ("_m_per_tick", "µm per count", 1e6),
        ("_rad_m", "mrad/m", 1e3),
        ("_m_s", "mm/s", 1e3),
        ("_m", "mm", 1e3),
        ("_rad", "°", 180.0 / std::f64::consts::PI),
        ("_s", "ms", 1e3),
    ];
    let of = UNITS.iter().find_map(|(suffix, unit, scale)| Some((key.strip_suffix(suffix)?, *unit, *scale)));
    let (name, unit, scale) = of.unwrap_or((key, "", 1.0));
    let wheel = if key.ends_with("_m_per_tick") { " wheel" } else { "" };
    (name.replace('_', " ") + wheel, unit, scale)
}

/// The parameters of a calibration with the robot's nominal ones, in the units of a workshop. A wheel is
/// shown by its diameter, not by metres per count as well.
pub(super) fn parameters<'p>(
    caption: &str,
    values: impl IntoIterator<Item = (&'p String, &'p ReportedValue)>,
    nominal: impl Fn(&str) -> Option<f64>,
) -> Block {
    let values: Vec<(&String, &ReportedValue)> = values.into_iter().collect();
    let has_diameter = |key: &str| {
        let diameter = key.strip_suffix("_m_per_tick").map(|side| format!("{side}_wheel_diameter_m"));
        diameter.is_some_and(|diameter| values.iter().any(|(own, _)| **own == diameter))
    };
    let headings = ["parameter", "nominal", "calibrated ± one standard deviation", "unit", "change"];
    let mut table = Table::new(caption, &headings);
    for (key, value) in values.iter().filter(|(key, _)| !has_diameter(key)) {
        let (name, unit, scale) = in_workshop_units(key);
        let stated = nominal(key).map(|stated| scale * stated);
        let shown = value.value.map_or_else(
            || "not determined".to_owned(),
            |found| plus_minus(scale * found, value.sigma.map(|sigma| scale * sigma)),
        );
        let change =
            value.ratio_to_nominal.map_or_else(|| "–".to_owned(), |ratio| format!("{:+.3} %", 100.0 * (ratio - 1.0)));
        table.row([
            Cell::text(name),
            Cell::number(stated.map_or_else(|| "–".to_owned(), plain)),
            Cell::number(shown),
            Cell::text(unit),
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
    fn parameters_are_in_the_units_of_a_workshop_and_a_wheel_has_one_row() {
        let shown = |key| in_workshop_units(key);
        assert_eq!(shown("left_wheel_diameter_m"), ("left wheel diameter".to_owned(), "mm", 1e3));
        assert_eq!(
            (shown("truth_latency_s").1, shown("sensor_theta_rad").1, shown("gyro_bias_rad_s").1),
            ("ms", "°", "°/s")
        );
        let value = ReportedValue {
            value: Some(0.16),
            sigma: Some(1e-5),
            ratio_to_nominal: None,
            sigma_why_null: None,
            interval_95: None,
        };
        let values: Vec<(String, ReportedValue)> = ["left_m_per_tick", "left_wheel_diameter_m", "right_m_per_tick"]
            .map(|key| (key.to_owned(), value.clone()))
            .into();
        let Block::Table(table) = parameters("", values.iter().map(|(key, value)| (key, value)), |_| None) else {
            panic!("a table")
        };
        let names: Vec<&Cell> = table.rows.iter().map(|row| &row[0]).collect();
        assert_eq!(names, [&Cell::text("left wheel diameter"), &Cell::text("right wheel")]);
        assert_eq!(table.rows[0][2], Cell::number("160.000 ± 0.010"));
    }

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
