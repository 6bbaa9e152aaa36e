//! Estimated sizes of an effect, as sentences for people show them: scaled to a handy unit, with as many
//! digits as their standard deviation is worth.

use std::collections::BTreeMap;

/// A number with its standard deviation, where that is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The value, SI.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: Option<f64>,
}

impl Estimate {
    /// The estimate times a scale, which takes it from SI to the unit shown.
    #[must_use]
    pub fn shown(self, scale: f64, unit: &str) -> String {
        plus_minus(scale * self.value, self.sigma.map(|sigma| sigma * scale.abs()), unit)
    }
}

/// The sizes of one effect by their names.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Estimates<'n>(BTreeMap<&'n str, Estimate>);

impl<'n> FromIterator<(&'n str, Estimate)> for Estimates<'n> {
    fn from_iter<I: IntoIterator<Item = (&'n str, Estimate)>>(values: I) -> Self {
        Self(values.into_iter().collect())
    }
}

impl Estimates<'_> {
    /// The value of an amplitude.
    pub(crate) fn value(&self, name: &str) -> Option<f64> {
        self.0.get(name).map(|estimate| estimate.value)
    }

    /// An amplitude times a scale, in the unit shown; a question mark where it is not known.
    pub(crate) fn shown(&self, name: &str, scale: f64, unit: &str) -> String {
        self.0.get(name).map_or_else(|| "?".to_owned(), |estimate| estimate.shown(scale, unit))
    }

    /// The size of a value without its sign, scaled, in the unit shown.
    pub(crate) fn magnitude(&self, name: &str, scale: f64, unit: &str) -> String {
        self.shown(name, if self.is_negative(name) { -scale } else { scale }, unit)
    }

    /// The first words of a value that is not negative, the second of one that is.
    pub(crate) fn by_sign(&self, name: &str, positive: &'static str, negative: &'static str) -> &'static str {
        if self.is_negative(name) { negative } else { positive }
    }

    /// The size of a value in the unit shown, with the word for its sign behind it.
    pub(crate) fn with_direction(
        &self,
        name: &str,
        scale: f64,
        unit: &str,
        positive: &'static str,
        negative: &'static str,
    ) -> String {
        format!("{} {}", self.magnitude(name, scale, unit), self.by_sign(name, positive, negative))
    }

    fn is_negative(&self, name: &str) -> bool {
        self.value(name).is_some_and(|value| value < 0.0)
    }

    /// For each wheel whose sine and cosine (`left_sin` and `left_cos`, with a suffix) are significant,
    /// `what` and their amplitude; the larger first.
    pub(crate) fn amplitudes(&self, suffix: &str, scale: f64, unit: &str, what: &str) -> String {
        let side = |side: &str| -> Option<(f64, String)> {
            let of = |part: &str| self.0.get(&format!("{side}_{part}{suffix}")[..]);
            let (sin, cos) = (of("sin")?, of("cos")?);
            let amplitude = sin.value.hypot(cos.value);
            let sigma = sin
                .sigma
                .zip(cos.sigma)
                .map(|(a, b)| ((sin.value * a).hypot(cos.value * b)) / amplitude.max(f64::MIN_POSITIVE));
            let shows = sigma.is_none_or(|sigma| amplitude > 3.0 * sigma);
            let text =
                format!("the {side} {what} by {}", plus_minus(scale * amplitude, sigma.map(|s| s * scale), unit));
            shows.then_some((amplitude, text))
        };
        let mut sides: Vec<(f64, String)> = ["left", "right"].into_iter().filter_map(side).collect();
        sides.sort_by(|a, b| b.0.total_cmp(&a.0));
        if sides.is_empty() {
            return format!("a {what}, which one is not determined");
        }
        sides.into_iter().map(|(_, text)| text).collect::<Vec<_>>().join(" and ")
    }
}

/// A value with its standard deviation, with as many digits as that is worth.
fn plus_minus(value: f64, sigma: Option<f64>, unit: &str) -> String {
    let sigma = sigma.filter(|sigma| sigma.is_finite() && *sigma > 0.0);
    let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
    match sigma {
        Some(sigma) => {
            let decimals = decimals_for(sigma);
            format!("{value:.decimals$} ± {sigma:.decimals$}{unit}")
        }
        None => {
            let decimals = decimals_for(0.1 * value.abs());
            format!("{value:.decimals$}{unit}")
        }
    }
}

/// Decimals that show two digits of a number below 1, and none of one above 10.
fn decimals_for(sigma: f64) -> usize {
    if !(sigma.is_finite() && sigma > 0.0) {
        return 2;
    }

    (1.0 - sigma.log10().floor()).clamp(0.0, 9.0) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_follow_the_standard_deviation() {
        assert_eq!(plus_minus(0.40123, Some(0.0123), "%"), "0.401 ± 0.012 %");
        assert_eq!(plus_minus(159.87, Some(23.4), "mm"), "160 ± 23 mm");
        assert_eq!(plus_minus(7.0, None, ""), "7.00");
    }

    #[test]
    fn only_a_significant_amplitude_is_shown() {
        let of = |value: f64| Estimate { value, sigma: Some(1.2e-3) };
        let values = [("left_sin", 3e-3), ("left_cos", 4e-3), ("right_sin", 1e-3), ("right_cos", 2e-3)];
        let estimates: Estimates<'_> = values.map(|(name, value)| (name, of(value))).into_iter().collect();
        assert_eq!(estimates.amplitudes("", 1e3, "‰", "radius varies"), "the left radius varies by 5.0 ± 1.2 ‰");
        assert_eq!(estimates.amplitudes("_rad", 1.0, "", "is off"), "a is off, which one is not determined");
        assert_eq!(estimates.shown("left_sin", 1e3, "mm"), "3.0 ± 1.2 mm");
        assert_eq!(estimates.shown("elsewhere", 1e3, "mm"), "?");
    }

    #[test]
    fn a_sign_becomes_a_word() {
        let of = |value: f64| Estimates::from_iter([("x_m", Estimate { value, sigma: Some(1.2e-3) })]);
        let shown = |value| of(value).with_direction("x_m", 1e3, "mm", "ahead", "behind");
        assert_eq!(
            (shown(0.025), shown(-0.025)),
            ("25.0 ± 1.2 mm ahead".to_owned(), "25.0 ± 1.2 mm behind".to_owned())
        );
    }
}
