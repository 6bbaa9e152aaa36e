//! Ticks: round values (1, 2 or 5 times a power of ten) whose labels do not touch, written without rounding
//! error.

use crate::axis::{Scale, Span};

/// A mark on an axis; a minor one has no label.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Tick {
    pub(crate) value: f64,
    pub(crate) label: Option<String>,
}

/// Powers of ten with which plain numbers are still quickly read; outside, labels are written with a power.
const PLAIN: std::ops::RangeInclusive<i32> = -3..=4;

/// More ticks fit on no axis.
const MAX_TICKS: i64 = 200;

/// Powers of ten between which steps begin: a span of the smallest or largest doubles has a quotient by
/// `MAX_TICKS`, or a length, that is 0 or infinite.
const FIRST_EXPONENTS: [f64; 2] = [-300.0, 300.0];

/// The densest ticks of which neighbouring labels `fit`: it is asked with two labels and the distance between
/// them as a part of the axis.
pub(crate) fn ticks(span: &Span, fit: &dyn Fn(&str, &str, f64) -> bool) -> Vec<Tick> {
    if span.scale == Scale::Log
        && let Some(found) = log_ticks(span, fit)
    {
        return found;
    }
    linear_ticks(span, fit)
}

fn all_fit(span: &Span, ticks: &[Tick], fit: &dyn Fn(&str, &str, f64) -> bool) -> bool {
    let labelled: Vec<(&str, f64)> =
        ticks.iter().filter_map(|tick| Some((tick.label.as_deref()?, span.fraction(tick.value)))).collect();
    labelled.windows(2).all(|pair| fit(pair[0].0, pair[1].0, pair[1].1 - pair[0].1))
}

fn linear_ticks(span: &Span, fit: &dyn Fn(&str, &str, f64) -> bool) -> Vec<Tick> {
    let [least, most] = FIRST_EXPONENTS;
    let mut exponent = (span.length() / MAX_TICKS as f64).log10().floor().clamp(least, most) as i32;
    let mut best = Vec::new();
    loop {
        for digit in [1_i64, 2, 5] {
            let Some(found) = multiples(span, digit, exponent) else { continue };
            if found.len() < 2 {
                return if best.is_empty() { found } else { ends_only(best) };
            }
            if all_fit(span, &found, fit) {
                return found;
            }
            best = found;
        }
        exponent += 1;
    }
}

/// Ticks of which no two neighbours fit: the outermost keep their labels, so that the axis can still be read.
fn ends_only(mut ticks: Vec<Tick>) -> Vec<Tick> {
    let last = ticks.len() - 1;
    for tick in &mut ticks[1..last] {
        tick.label = None;
    }
    ticks
}

/// All multiples of `digit` × 10^`exponent` in the span, unless they are too many.
fn multiples(span: &Span, digit: i64, exponent: i32) -> Option<Vec<Tick>> {
    let value =
        |n: i64| if exponent < 0 { n as f64 / 10_f64.powi(-exponent) } else { n as f64 * 10_f64.powi(exponent) };
    let step = value(digit);
    // An end that is a multiple up to rounding is one.
    let slack = 1e-9 * span.length() / step;
    let (first, last) = ((span.low / step - slack).ceil() as i64, (span.high / step + slack).floor() as i64);
    if last.saturating_sub(first) > MAX_TICKS {
        return None;
    }
    let numbers: Vec<i64> = (first..=last).map(|k| k * digit).collect();
    let largest = numbers.iter().map(|n| n.abs()).max().unwrap_or(0);
    let top = if largest == 0 { 0 } else { largest.ilog10() as i32 + exponent };
    let label = |n: i64| match n {
        0 => "0".to_owned(),
        _ if PLAIN.contains(&top) => signed(&format!("{:.*}", (-exponent).max(0) as usize, value(n))),
        _ => {
            let mantissa = n as f64 / 10_f64.powi(top - exponent);
            signed(&format!("{mantissa:.*}×{}", (top - exponent).max(0) as usize, power(top)))
        }
    };
    Some(numbers.iter().map(|&n| Tick { value: value(n), label: Some(label(n)) }).collect())
}

/// Ticks at powers of ten, and between them while there is room; none if the span has fewer than two such
/// labels.
fn log_ticks(span: &Span, fit: &dyn Fn(&str, &str, f64) -> bool) -> Option<Vec<Tick>> {
    let (first, last) = (span.low.log10().floor() as i32, span.high.log10().ceil() as i32);
    let plain = (first..last).all(|exponent| PLAIN.contains(&exponent));
    let label = |digit: i32, exponent: i32| match digit {
        _ if plain => format!("{:.*}", (-exponent).max(0) as usize, decade(digit, exponent)),
        1 => power(exponent),
        _ => format!("{digit}×{}", power(exponent)),
    };
    for (digits, stride) in [(&[1, 2, 5][..], 1), (&[1, 3][..], 1), (&[1][..], 1), (&[1][..], 2), (&[1][..], 5)] {
        let mut found = Vec::new();
        for exponent in first..=last {
            for digit in 1..10 {
                let value = decade(digit, exponent);
                let labelled = digits.contains(&digit) && exponent % stride == 0;
                let shown = labelled || stride == 1 || digit == 1;
                if shown && span.contains(value) {
                    found.push(Tick { value, label: labelled.then(|| label(digit, exponent)) });
                }
            }
        }
        if all_fit(span, &found, fit) {
            return (found.iter().filter(|tick| tick.label.is_some()).count() >= 2).then_some(found);
        }
    }
    None
}

fn decade(digit: i32, exponent: i32) -> f64 {
    if exponent < 0 { f64::from(digit) / 10_f64.powi(-exponent) } else { f64::from(digit) * 10_f64.powi(exponent) }
}

/// With a minus sign, which is as wide as a plus, instead of a hyphen.
fn signed(number: &str) -> String {
    number.replacen('-', "−", 1)
}

fn power(exponent: i32) -> String {
    let raised = |c: char| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        digit => char::from_u32(u32::from('⁰') + digit.to_digit(10).unwrap_or(0)).unwrap_or(digit),
    };
    format!("10{}", exponent.to_string().chars().map(raised).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(low: f64, high: f64, scale: Scale, least: f64) -> Vec<String> {
        let fit = |_: &str, _: &str, apart: f64| apart >= least;
        ticks(&Span { low, high, scale }, &fit).into_iter().filter_map(|tick| tick.label).collect()
    }

    #[test]
    fn linear_ticks_are_the_densest_of_1_2_5_that_fit() {
        assert_eq!(labels(0.0, 1.0, Scale::Linear, 0.15), ["0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels(0.0, 1.0, Scale::Linear, 0.3), ["0", "0.5", "1.0"]);
        assert_eq!(labels(0.0, 1.05, Scale::Linear, 0.3), ["0", "0.5", "1.0"], "first tried steps are too many");
        assert_eq!(labels(-0.3, 0.31, Scale::Linear, 0.1), ["−0.3", "−0.2", "−0.1", "0", "0.1", "0.2", "0.3"]);
        assert_eq!(labels(0.95, 1.02, Scale::Linear, 0.2), ["0.96", "0.98", "1.00", "1.02"]);
    }

    #[test]
    fn small_and_large_numbers_share_one_power() {
        assert_eq!(labels(0.0, 2.1e-5, Scale::Linear, 0.2), ["0", "0.5×10⁻⁵", "1.0×10⁻⁵", "1.5×10⁻⁵", "2.0×10⁻⁵"]);
        assert_eq!(labels(0.0, 4e6, Scale::Linear, 0.2), ["0", "1×10⁶", "2×10⁶", "3×10⁶", "4×10⁶"]);
    }

    #[test]
    fn decades_lose_labels_until_they_fit() {
        assert_eq!(labels(0.009, 11.0, Scale::Log, 0.2), ["0.01", "0.1", "1", "10"]);
        assert_eq!(labels(0.9, 11.0, Scale::Log, 0.2), ["1", "2", "5", "10"]);
        assert_eq!(labels(1e-7, 1.0, Scale::Log, 0.1), ["10⁻⁷", "10⁻⁶", "10⁻⁵", "10⁻⁴", "10⁻³", "10⁻²", "10⁻¹", "10⁰"]);
        assert_eq!(labels(1e-7, 1.0, Scale::Log, 0.2), ["10⁻⁶", "10⁻⁴", "10⁻²", "10⁰"]);
        assert_eq!(
            labels(21.0, 29.0, Scale::Log, 0.2),
            ["22", "24", "26", "28"],
            "within one decade as on a linear axis"
        );
    }

    #[test]
    fn there_are_two_ticks_even_where_nothing_fits() {
        assert_eq!(labels(0.0, 1.0, Scale::Linear, 9.0), ["0", "1"]);
        assert_eq!(labels(0.0, 4.5, Scale::Linear, 9.0), ["0", "4"]);
        assert!(labels(0.0, 1e100, Scale::Linear, 0.2).len() >= 2 && labels(0.0, 1e-99, Scale::Linear, 0.2).len() >= 2);
    }

    #[test]
    fn spans_of_the_smallest_and_largest_doubles_end() {
        assert_eq!(labels(0.0, 5e-324, Scale::Linear, 0.2), ["0"]);
        assert_eq!(labels(0.0, f64::MAX, Scale::Linear, 0.2), ["0", "0.5×10³⁰⁸", "1.0×10³⁰⁸", "1.5×10³⁰⁸"]);
        assert!(labels(-f64::MAX, f64::MAX, Scale::Linear, 0.2).len() <= 1, "its length is infinite");
    }
}
