//! The outlier rule and the summary of `robust.rs` for values of W trials side by side, to the bit.

use crate::robust::{MedianMad, Summary, is_within};
use crate::settings::MIN_VALUES_FOR_OUTLIERS;

/// Values of W trials, run by run, and which of them are no outliers.
pub(crate) struct RetainedLanes<'v, const W: usize> {
    values: &'v [[f64; W]],
    /// 1 for a value that is no outlier, 0 for one that is.
    pub(crate) keep: Vec<[f64; W]>,
    count: [f64; W],
}

/// Mean and scatter of what a trial retains.
pub(crate) struct SummaryLanes<const W: usize> {
    count: [f64; W],
    pub(crate) mean: [f64; W],
    variance: [f64; W],
}

impl<'v, const W: usize> RetainedLanes<'v, W> {
    /// All of the values.
    #[inline(always)]
    pub(crate) fn all(values: &'v [[f64; W]]) -> Self {
        Self { values, keep: vec![[1.0; W]; values.len()], count: [values.len() as f64; W] }
    }

    /// Those that [`MedianMad::keep`] keeps, of values that are all finite.
    #[inline(always)]
    pub(crate) fn of(values: &'v [[f64; W]], outliers: &MedianMad, stated_sigma: &[f64; W]) -> Self {
        let mut retained = Self::all(values);
        if values.len() < MIN_VALUES_FOR_OUTLIERS {
            return retained;
        }
        let mut sorted = values.to_vec();
        sort(&mut sorted);
        let center = median(&sorted);
        for (deviations, values) in sorted.iter_mut().zip(values) {
            for lane in 0..W {
                deviations[lane] = (values[lane] - center[lane]).abs();
            }
        }
        sort(&mut sorted);
        let deviation = median(&sorted);
        retained.count = [0.0; W];
        for (keep, values) in retained.keep.iter_mut().zip(values) {
            for lane in 0..W {
                let limit = outliers.limit(deviation[lane], stated_sigma[lane]);
                let is_kept = is_within(values[lane], center[lane], limit);
                keep[lane] = if is_kept { 1.0 } else { 0.0 };
                retained.count[lane] += keep[lane];
            }
        }
        retained
    }

    /// Mean of what is retained, of these values or of others of the same runs.
    #[inline(always)]
    pub(crate) fn mean(&self, of: &[[f64; W]]) -> [f64; W] {
        let mut sum = [0.0; W];
        for (values, keep) in of.iter().zip(&self.keep) {
            for lane in 0..W {
                sum[lane] += values[lane] * keep[lane];
            }
        }
        #[allow(clippy::needless_range_loop)] // arrays side by side
        for lane in 0..W {
            sum[lane] /= self.count[lane];
        }
        sum
    }

    #[inline(always)]
    pub(crate) fn summary(&self) -> SummaryLanes<W> {
        let mean = self.mean(self.values);
        let mut squares = [0.0; W];
        for (values, keep) in self.values.iter().zip(&self.keep) {
            for lane in 0..W {
                let deviation = values[lane] - mean[lane];
                squares[lane] += deviation * deviation * keep[lane];
            }
        }
        #[allow(clippy::needless_range_loop)] // arrays side by side
        for lane in 0..W {
            squares[lane] /= self.count[lane] - 1.0;
        }
        SummaryLanes { count: self.count, mean, variance: squares }
    }

    /// The runs whose value is an outlier in a trial, by position.
    pub(crate) fn outliers(&self, lane: usize) -> impl Iterator<Item = usize> {
        let all_kept = self.count[lane] == self.values.len() as f64;
        let runs = self.keep.iter().enumerate().filter(move |(_, keep)| !all_kept && keep[lane] == 0.0);
        runs.map(|(run, _)| run)
    }
}

impl<const W: usize> SummaryLanes<W> {
    /// Of one trial.
    pub(crate) fn of(&self, lane: usize) -> Summary {
        let count = self.count[lane] as usize;
        Summary { count, mean: self.mean[lane], variance: (count > 1).then_some(self.variance[lane]) }
    }
}

/// Sorts each lane by itself: merge exchange, whose comparisons do not depend on the values (Batcher 1968;
/// Knuth, The Art of Computer Programming 3, 5.2.2, algorithm M).
#[inline(always)]
fn sort<const W: usize>(values: &mut [[f64; W]]) {
    let half = values.len().next_power_of_two() / 2;
    let mut p = half;
    while p > 0 {
        let (mut q, mut r, mut d) = (half, 0, p);
        loop {
            for i in 0..values.len().saturating_sub(d) {
                if i & p == r {
                    exchange(values, i, i + d);
                }
            }
            if q == p {
                break;
            }
            (d, q, r) = (q - p, q / 2, p);
        }
        p /= 2;
    }
}

/// Puts the smaller value of each lane first.
#[inline(always)]
fn exchange<const W: usize>(values: &mut [[f64; W]], first: usize, second: usize) {
    let (a, b) = (values[first], values[second]);
    let (mut low, mut high) = (a, b);
    for lane in 0..W {
        low[lane] = if b[lane] < a[lane] { b[lane] } else { a[lane] };
        high[lane] = if b[lane] < a[lane] { a[lane] } else { b[lane] };
    }
    (values[first], values[second]) = (low, high);
}

/// Median of each lane, of at least one value.
#[inline(always)]
fn median<const W: usize>(sorted: &[[f64; W]]) -> [f64; W] {
    let middle = sorted.len() / 2;
    let mut median = sorted[middle];
    if sorted.len().is_multiple_of(2) {
        for lane in 0..W {
            median[lane] = 0.5 * (sorted[middle - 1][lane] + median[lane]);
        }
    }
    median
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_of_an_even_number_is_midway_between_two() {
        assert_eq!(median(&[[1.0, -3.0], [2.0, 5.0]]), [1.5, 1.0]);
        assert_eq!(median(&[[1.0], [2.0], [4.0]]), [2.0]);
    }

    /// Irregular values with ties, of every number, and a far one in some lanes. Rejects, as was tried, a
    /// network that lacks its last merge.
    #[test]
    fn lanes_retain_what_the_rule_retains_of_each_trial() {
        for count in 1..40_u32 {
            let value = |run: u32, lane: u32| {
                let far = if run == count / 2 && lane.is_multiple_of(2) { 50.0 } else { 0.0 };
                f64::from((run * run * 31 + lane * 17 + run * 7) % 23) * 0.37 - 3.0 + far
            };
            let of_run = |run| std::array::from_fn(|lane| value(run, lane as u32));
            let values: Vec<[f64; 4]> = (0..count).map(of_run).collect();
            let stated_sigma = [0.0, 0.5, 0.0, 40.0];
            let retained = RetainedLanes::of(&values, &MedianMad::default(), &stated_sigma);
            let found = retained.summary();
            for lane in 0..4 {
                let values: Vec<f64> = values.iter().map(|values| values[lane]).collect();
                let keep = MedianMad::default().keep(&values, stated_sigma[lane]);
                let outliers: Vec<usize> = (0..values.len()).filter(|run| !keep[*run]).collect();
                assert_eq!(retained.outliers(lane).collect::<Vec<_>>(), outliers, "{count} {lane}");
                let kept = values.iter().zip(&keep).filter(|(_, keep)| **keep).map(|(value, _)| *value);
                assert_eq!(Some(found.of(lane)), Summary::of(kept), "{count} {lane}");
            }
        }
    }
}
