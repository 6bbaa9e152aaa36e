//! An axis as a person asks for it, and the span of values that it comes to show.

/// Values with a larger magnitude are refused: the differences of two of them must stay finite.
pub(crate) const LARGEST: f64 = 1e100;
/// Free space between the outermost value and the frame, as a part of what the values span.
const PADDING: f64 = 0.05;
/// Values that differ relatively by less are drawn as one: ticks between them would need more digits than a
/// number has.
const MIN_RELATIVE_SPAN: f64 = 1e-9;

/// How values are spread along an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    /// In proportion to the value.
    #[default]
    Linear,
    /// In proportion to the logarithm of the value, which must be positive.
    Log,
}

/// What part of an axis is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Range {
    /// All values of all series, with some space around them.
    #[default]
    Auto,
    /// Exactly this. What lies outside is cut off; points outside are counted in the legend.
    Fixed {
        /// The lower end, in the axis' unit.
        low: f64,
        /// The upper end, in the axis' unit.
        high: f64,
    },
}

/// One axis of a panel.
#[derive(Clone, Debug, PartialEq)]
#[must_use]
pub struct Axis {
    pub(crate) label: String,
    pub(crate) range: Range,
    pub(crate) scale: Scale,
    pub(crate) included: Vec<f64>,
    pub(crate) names: Vec<String>,
}

impl Axis {
    /// Its label with the unit.
    #[must_use]
    pub fn label(&self) -> &str {
        &self.label
    }

    /// Whether it is logarithmic.
    #[must_use]
    pub fn is_log(&self) -> bool {
        self.scale == Scale::Log
    }

    /// The names of the places 1, 2, …; empty for numbers.
    #[must_use]
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// A linear axis over all values, labelled `quantity (unit)`.
    pub fn new(quantity: &str, unit: &str) -> Self {
        Self::labelled(format!("{quantity} ({unit})"))
    }

    /// A linear axis over all values of a quantity that has no unit: a count, a ratio, a probability.
    pub fn dimensionless(quantity: &str) -> Self {
        Self::labelled(quantity.to_owned())
    }

    /// A horizontal axis whose places 1, 2, … bear names: every one stands below its place, on as many lines
    /// as it needs.
    pub fn named(quantity: &str, names: impl IntoIterator<Item = String>) -> Self {
        let names: Vec<String> = names.into_iter().collect();
        let high = names.len().max(1) as f64 + 0.5;
        Self { names, range: Range::Fixed { low: 0.5, high }, ..Self::labelled(quantity.to_owned()) }
    }

    fn labelled(label: String) -> Self {
        Self { label, range: Range::Auto, scale: Scale::Linear, included: Vec::new(), names: Vec::new() }
    }

    /// What part is shown.
    pub fn range(mut self, range: Range) -> Self {
        self.range = range;
        self
    }

    /// How values are spread.
    pub fn scale(mut self, scale: Scale) -> Self {
        self.scale = scale;
        self
    }

    /// A value that [`Range::Auto`] shows besides the series'. Where it is the outermost one the axis ends
    /// with it: `.include(0.0)` makes an axis of standard deviations begin at zero.
    pub fn include(mut self, value: f64) -> Self {
        self.included.push(value);
        self
    }

    /// Whether the fixed range and the included values can be on such an axis; the offending ends otherwise.
    pub(crate) fn check(&self) -> Result<(), (f64, f64)> {
        let possible = |value: f64| value.abs() <= LARGEST && (self.scale == Scale::Linear || value > 0.0);
        if let Range::Fixed { low, high } = self.range {
            let apart = high - low > MIN_RELATIVE_SPAN * low.abs().max(high.abs());
            if !(possible(low) && possible(high) && apart) {
                return Err((low, high));
            }
        }
        self.included.iter().find(|&&value| !possible(value)).map_or(Ok(()), |&value| Err((value, value)))
    }

    /// The span shown, given all values along this axis.
    pub(crate) fn span(&self, values: &[f64], from_zero: bool) -> Span {
        if let Range::Fixed { low, high } = self.range {
            return Span { low, high, scale: self.scale };
        }
        let scale = self.scale;
        let ends = |values: &mut dyn Iterator<Item = f64>| {
            values
                .map(|value| scale.position(value))
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), position| {
                    (low.min(position), high.max(position))
                })
        };
        let (low, high) = ends(&mut values.iter().copied());
        let zero = from_zero.then_some(0.0);
        let (least, most) = ends(&mut self.included.iter().copied().chain(zero));
        let (whole_low, whole_high) = (low.min(least), high.max(most));
        let length = whole_high - whole_low;
        let magnitude = whole_low.abs().max(whole_high.abs());
        let padding = match scale {
            _ if length > MIN_RELATIVE_SPAN * magnitude && length > 1.0 / LARGEST => PADDING * length,
            Scale::Linear if magnitude > 1.0 / LARGEST => 0.1 * magnitude,
            Scale::Linear => 1.0,
            Scale::Log => 0.3,
        };
        let low = if least <= low { whole_low } else { whole_low - padding };
        let high = if most >= high && most > whole_low { whole_high } else { whole_high + padding };
        Span { low: scale.value(low), high: scale.value(high), scale }
    }
}

impl Scale {
    /// The coordinate that is proportional to the place on paper.
    fn position(self, value: f64) -> f64 {
        match self {
            Self::Linear => value,
            Self::Log => value.log10(),
        }
    }

    fn value(self, position: f64) -> f64 {
        match self {
            Self::Linear => position,
            // Space below the smallest doubles is none: their logarithm would be infinite.
            Self::Log => 10_f64.powf(position).max(f64::MIN_POSITIVE),
        }
    }
}

/// What an axis shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Span {
    pub(crate) low: f64,
    pub(crate) high: f64,
    pub(crate) scale: Scale,
}

impl Span {
    /// Where a value is, from 0 at the low end to 1 at the high end; outside that beyond the ends.
    pub(crate) fn fraction(&self, value: f64) -> f64 {
        let (low, high) = (self.scale.position(self.low), self.scale.position(self.high));
        (self.scale.position(value) - low) / (high - low)
    }

    pub(crate) fn contains(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }

    pub(crate) fn length(&self) -> f64 {
        self.high - self.low
    }

    /// The same middle and another length; of a linear axis.
    pub(crate) fn stretched_to(&self, length: f64) -> Self {
        let middle = f64::midpoint(self.low, self.high);
        Self { low: middle - length / 2.0, high: middle + length / 2.0, scale: self.scale }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_automatic_span_has_space_around_values_and_ends_with_an_included_one() {
        let axis = Axis::new("error", "m");
        assert_eq!(axis.span(&[2.0, 4.0], false), Span { low: 1.9, high: 4.1, scale: Scale::Linear });
        let from_zero = axis.clone().include(0.0).span(&[2.0, 4.0], false);
        assert_eq!(from_zero, Span { low: 0.0, high: 4.2, scale: Scale::Linear });
        assert_eq!(axis.span(&[2.0, 4.0], true), from_zero);
        let log = axis.scale(Scale::Log).span(&[1.0, 100.0], false);
        assert!((log.low.log10() + 0.1).abs() < 1e-12 && (log.high.log10() - 2.1).abs() < 1e-12);
        assert!((log.fraction(10.0) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn equal_values_still_span_something() {
        let axis = Axis::dimensionless("ratio");
        for values in [[0.0, 0.0], [-3.0, -3.0], [1e9, 1e9 + 1e-3]] {
            let span = axis.span(&values, false);
            assert!(span.low < values[0] && span.high > values[1], "{span:?}");
        }
        assert_eq!(axis.span(&[0.0, 0.0], true), Span { low: 0.0, high: 1.0, scale: Scale::Linear });
        let span = axis.scale(Scale::Log).span(&[5.0], false);
        assert!(span.low < 5.0 && span.high > 5.0);
    }

    #[test]
    fn a_logarithmic_span_of_the_smallest_doubles_is_positive() {
        let span = Axis::new("x", "m").scale(Scale::Log).span(&[5e-324, 1e-300], false);
        assert!(span.low >= f64::MIN_POSITIVE && span.high > 1e-300, "{span:?}");
        assert!(span.fraction(1e-300).is_finite());
    }

    #[test]
    fn impossible_ranges_are_named() {
        let axis = |low, high| Axis::new("x", "m").range(Range::Fixed { low, high });
        for (low, high) in [(1.0, 1.0), (2.0, 1.0), (0.0, f64::INFINITY), (f64::NAN, 1.0), (-2e100, 0.0)] {
            assert!(axis(low, high).check().is_err(), "{low} {high}");
        }
        assert_eq!(axis(-1.0, 1.0).check(), Ok(()));
        assert_eq!(axis(0.0, 1.0).scale(Scale::Log).check(), Err((0.0, 1.0)));
        assert_eq!(Axis::new("x", "m").include(0.0).scale(Scale::Log).check(), Err((0.0, 0.0)));
    }
}
