//! The outlier rule, the summary of the values that are left, and the variance that trimming leaves.

use statrs::distribution::{Continuous, ContinuousCDF, Normal};

use crate::settings::{MAD_CUT, MAD_TO_SIGMA, MIN_VALUES_FOR_OUTLIERS};

/// Rejection by median and median absolute deviation: a value is an outlier when |x − median| > cut · 1.4826
/// · MAD.
///
/// The paper says that "statistical filtering rejects atypical values" and not which; this is the rule of
/// Iglewicz & Hoaglin (1993), whose cut of 3.5 rejects a Gaussian value about once in 2000. It acts on each
/// wheel by itself, as the paper's 79 left and 82 right values show.
///
/// Readings rounded to a grid cluster on a few values, and their MAD can be far smaller than the rounding;
/// the rule would then throw out whole clusters and bias the mean. So no value is atypical that the
/// instrument's stated precision explains: the robust standard deviation is never taken below it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MedianMad {
    /// Robust standard deviations from the median beyond which a value is an outlier.
    pub cut: f64,
}

impl Default for MedianMad {
    fn default() -> Self {
        Self { cut: MAD_CUT }
    }
}

impl MedianMad {
    /// Which values are no outliers, in their order. `stated_sigma` is the standard deviation of a value by
    /// the instrument's stated precision, 0 when it is not stated.
    #[must_use]
    pub fn keep(&self, values: &[f64], stated_sigma: f64) -> Vec<bool> {
        if values.len() < MIN_VALUES_FOR_OUTLIERS {
            return vec![true; values.len()];
        }
        let sorted = sorted(values);
        let center = median(&sorted);
        let limit = self.limit(median_deviation(&sorted, center), stated_sigma);
        values.iter().map(|value| is_within(*value, center, limit)).collect()
    }

    /// Distance from the median beyond which a value is an outlier.
    #[inline(always)]
    pub(crate) fn limit(&self, median_deviation: f64, stated_sigma: f64) -> f64 {
        self.cut * (MAD_TO_SIGMA * median_deviation).max(stated_sigma)
    }
}

/// Is a value no outlier? A limit of zero: half of the values agree exactly, and nothing bounds the rest.
#[inline(always)]
pub(crate) fn is_within(value: f64, center: f64, limit: f64) -> bool {
    (limit == 0.0) | ((value - center).abs() <= limit)
}

/// The values in the order of [`f64::total_cmp`].
///
/// They are sorted as integers, without branches that a processor would predict wrongly.
fn sorted(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<i64> = values.iter().map(|value| in_total_order(value.to_bits().cast_signed())).collect();
    order.sort_unstable();
    order.into_iter().map(|bits| f64::from_bits(in_total_order(bits).cast_unsigned())).collect()
}

/// Median of at least one value.
fn median(sorted: &[f64]) -> f64 {
    let (middle, odd) = (sorted.len() / 2, sorted.len() % 2 == 1);
    if odd { sorted[middle] } else { 0.5 * (sorted[middle - 1] + sorted[middle]) }
}

/// Median of the distances from the median: they rise to both sides of the middle, so that the sides are
/// merged until half of them are passed.
fn median_deviation(sorted: &[f64], center: f64) -> f64 {
    let (below, above) = sorted.split_at(sorted.len() / 2);
    let below = below.iter().rev().map(|value| center - value);
    let above = above.iter().map(|value| value - center);
    let (mut below, mut above) = (below.chain([f64::INFINITY]), above.chain([f64::INFINITY]));
    let (mut next_below, mut next_above) = (below.next(), above.next());
    let (mut last, mut before) = (0.0, 0.0);
    for _ in 0..=sorted.len() / 2 {
        let (Some(down), Some(up)) = (next_below, next_above) else { break };
        before = last;
        if up < down {
            last = up;
            next_above = above.next();
        } else {
            last = down;
            next_below = below.next();
        }
    }
    if sorted.len() % 2 == 1 { last } else { 0.5 * (before + last) }
}

/// The bits of a double as a whole number in the order of [`f64::total_cmp`], and back.
const fn in_total_order(bits: i64) -> i64 {
    bits ^ ((bits >> 63).cast_unsigned() >> 1).cast_signed()
}

/// Mean of the values given; `None` when there is none.
pub(crate) fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (count, sum) = values.fold((0_usize, 0.0), |(count, sum), value| (count + 1, sum + value));
    (count > 0).then(|| sum / count as f64)
}

/// Mean and scatter of a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Summary {
    /// How many values.
    pub count: usize,
    /// Their mean.
    pub mean: f64,
    /// Their variance about the mean (n−1); `None` for a single value.
    pub variance: Option<f64>,
}

impl Summary {
    /// Of the values given; `None` when there is none.
    #[must_use]
    pub fn of(values: impl Iterator<Item = f64> + Clone) -> Option<Self> {
        let mean = mean(values.clone())?;
        let (count, squares) =
            values.fold((0, 0.0), |(count, sum), value| (count + 1, sum + (value - mean) * (value - mean)));
        Some(Self { count, mean, variance: (count > 1).then(|| squares / (count - 1) as f64) })
    }

    /// Variance of the mean.
    #[must_use]
    pub fn mean_variance(&self) -> Option<f64> {
        self.variance.map(|variance| variance / self.count as f64)
    }
}

/// Share of a normal variance that is left after the largest errors were dropped, by their shares: in the
/// plane by distance, and along one axis.
pub(crate) fn left_of_variance(dropped: (f64, f64)) -> (f64, f64) {
    let (in_plane, along) = dropped;
    // A distance: 1 − c²/2·e^(−c²/2)/(1 − e^(−c²/2)) with e^(−c²/2) the dropped share.
    let plane = if in_plane > 0.0 { 1.0 + in_plane * in_plane.ln() / (1.0 - in_plane) } else { 1.0 };
    let axis = if along > 0.0 {
        let normal = Normal::standard();
        let cut = normal.inverse_cdf(1.0 - 0.5 * along);
        1.0 - 2.0 * cut * normal.pdf(cut) / (1.0 - along)
    } else {
        1.0
    };
    (plane, axis)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_far_value_goes_and_its_neighbours_stay() {
        let mut values: Vec<f64> = (0..20).map(|k| 1.0 + 1e-3 * f64::from(k)).collect();
        values.push(1.2);
        let keep = MedianMad::default().keep(&values, 0.0);
        assert_eq!(keep.iter().filter(|keep| !**keep).count(), 1);
        assert!(!keep[20]);
    }

    #[test]
    fn the_cut_is_in_robust_standard_deviations() {
        // Median 0, MAD 1: the limit is 3.5·1.4826 = 5.189.
        let base = [-2.0, -1.0, -1.0, 0.0, 1.0, 1.0, 2.0];
        let with = |x: f64| {
            let mut values = base.to_vec();
            values.extend([x, -x]);
            MedianMad::default().keep(&values, 0.0)[7]
        };
        assert!(with(5.18));
        assert!(!with(5.20));
    }

    #[test]
    fn the_median_deviation_is_that_of_the_sorted_deviations() {
        // Irregular values with ties, of every number, in some order.
        for count in 1..40_u32 {
            for seed in 0..20_u32 {
                let value = |k: u32| f64::from((k * k * 31 + seed * 17 + k * 7) % 23) * 0.37 - 3.0;
                let values: Vec<f64> = (0..count).map(value).collect();
                let sorted = sorted(&values);
                assert!(sorted.is_sorted());
                let center = median(&sorted);
                let mut deviations: Vec<f64> = values.iter().map(|value| (value - center).abs()).collect();
                deviations.sort_by(f64::total_cmp);
                assert_eq!(median_deviation(&sorted, center), median(&deviations), "{count} {seed}");
            }
        }
    }

    #[test]
    fn few_or_equal_values_are_not_judged() {
        assert_eq!(MedianMad::default().keep(&[1.0, 1.0, 1.0, 9.0], 0.0), [true; 4]);
        assert_eq!(MedianMad::default().keep(&[1.0, 1.0, 1.0, 1.0, 9.0], 0.0), [true; 5]);
        assert!(MedianMad::default().keep(&[], 0.0).is_empty());
    }

    #[test]
    fn what_the_stated_precision_explains_is_not_atypical() {
        // Rounded readings: two clusters, the larger one with a little spread of its own.
        let mut values: Vec<f64> = (0..14).map(|k| 517.0 + 1e-3 * f64::from(k)).collect();
        values.extend([516.0; 6]);
        assert_eq!(MedianMad::default().keep(&values, 0.0).iter().filter(|keep| **keep).count(), 14);
        assert!(MedianMad::default().keep(&values, 0.29).iter().all(|keep| *keep));
        values.push(520.0);
        assert!(!MedianMad::default().keep(&values, 0.29)[20]);
    }

    #[test]
    fn summary_of_known_numbers() {
        let summary = Summary::of([2.0, 4.0, 6.0].into_iter()).expect("not empty");
        assert_eq!(summary, Summary { count: 3, mean: 4.0, variance: Some(4.0) });
        assert_eq!(Summary::of([1.0].into_iter()).expect("one").variance, None);
        assert_eq!(Summary::of(std::iter::empty::<f64>()), None);
    }

    #[test]
    fn trimming_leaves_the_variance_that_the_tails_do_not_have() {
        // By the midpoint rule over the density that is left.
        for dropped in [0.0, 0.01, 0.04, 0.3] {
            let (plane, axis) = left_of_variance((dropped, dropped));
            let cut = |tail: &dyn Fn(f64) -> f64| {
                (0..60_000).map(|k| 1e-4 * f64::from(k)).find(|c| tail(*c) <= dropped).unwrap_or(6.0)
            };
            let normal = Normal::standard();
            let density = |c: f64| normal.pdf(c);
            let integral = |upto: f64, of: &dyn Fn(f64) -> f64| {
                let steps = 20_000;
                let h = upto / f64::from(steps);
                (0..steps).map(|k| of(h * (f64::from(k) + 0.5)) * h).sum::<f64>()
            };
            let axis_cut = cut(&|c| 2.0 * normal.sf(c));
            let expected = integral(axis_cut, &|z| z * z * density(z)) / integral(axis_cut, &density);
            // The cut is found to 1e-4, and z² φ(z) is under 0.3.
            assert!((axis - expected).abs() < 2e-4, "{dropped}: {axis} {expected}");
            let plane_cut = cut(&|c| (-0.5 * c * c).exp());
            let distance = |r: f64| r * (-0.5 * r * r).exp();
            let expected = 0.5 * integral(plane_cut, &|r| r * r * distance(r)) / integral(plane_cut, &distance);
            assert!((plane - expected).abs() < 2e-4, "{dropped}: {plane} {expected}");
        }
    }
}
