//! One quantity under several models, as bars on the first screen: readable without a script, and in print.

use crate::role::Role;

/// Length of the longest bar with its interval, in units of the drawing.
pub(crate) const LENGTH: f64 = 1000.0;
/// A bar shorter than this could not be seen.
const SHORTEST: f64 = 4.0;

/// Bars of one quantity, on one scale.
#[derive(Debug, Clone, PartialEq)]
pub struct Bars {
    /// What is drawn, with its unit.
    pub title: String,
    /// The bars, the first on top.
    pub bars: Vec<Bar>,
    /// What the numbers are of.
    pub note: String,
}

/// A bar.
#[derive(Debug, Clone, PartialEq)]
pub struct Bar {
    /// Whose value it is.
    pub name: String,
    /// Its colour.
    pub role: Role,
    /// The value; not negative.
    pub value: f64,
    /// Its interval, where one is known.
    pub interval: Option<(f64, f64)>,
    /// The value in words, with its unit.
    pub text: String,
}

impl Bars {
    /// Length of a value in the drawing.
    fn length(&self, value: f64) -> f64 {
        let longest = self.bars.iter().map(|bar| bar.interval.map_or(bar.value, |(_, high)| high.max(bar.value)));
        let longest = longest.filter(|value| value.is_finite()).fold(0.0, f64::max);
        let share = if longest > 0.0 && value.is_finite() { value / longest } else { 0.0 };
        (LENGTH * share.clamp(0.0, 1.0)).round()
    }

    pub(crate) fn length_of(&self, bar: &Bar) -> f64 {
        self.length(bar.value).max(SHORTEST)
    }

    /// Both ends of a bar's interval in the drawing.
    pub(crate) fn interval_of(&self, bar: &Bar) -> Option<(f64, f64)> {
        bar.interval.map(|(low, high)| (self.length(low), self.length(high)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_share_one_scale_that_has_every_interval_in_it() {
        let bar =
            |value, interval| Bar { name: String::new(), role: Role::Nominal, value, interval, text: String::new() };
        let all = vec![bar(0.6, Some((0.4, 0.8))), bar(0.2, None), bar(0.0, None)];
        let bars = Bars { title: String::new(), bars: all, note: String::new() };
        assert_eq!(bars.length_of(&bars.bars[0]), 750.0);
        assert_eq!(bars.interval_of(&bars.bars[0]), Some((500.0, 1000.0)));
        assert_eq!((bars.length_of(&bars.bars[1]), bars.length_of(&bars.bars[2])), (250.0, SHORTEST));
        let none = Bars { bars: vec![bar(f64::NAN, None)], ..bars };
        assert_eq!(none.length_of(&none.bars[0]), SHORTEST);
    }
}
