//! Running moments to the fourth, mergeable (Pébay 2008): what a Monte-Carlo error of a bias, a variance and
//! an RMSE needs, in constant memory.

use dataset::{NotNegative, Number, checked};
use serde::{Deserialize, Serialize};

/// Count, mean and central moments of a sample of errors.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Moments {
    #[serde(deserialize_with = "checked::<NotNegative, _>")]
    count: f64,
    #[serde(deserialize_with = "checked::<Number, _>")]
    mean: f64,
    #[serde(deserialize_with = "checked::<NotNegative, _>")]
    m2: f64,
    #[serde(deserialize_with = "checked::<Number, _>")]
    m3: f64,
    #[serde(deserialize_with = "checked::<NotNegative, _>")]
    m4: f64,
}

/// A number with its Monte-Carlo standard error.
pub(crate) type WithError = (f64, f64);

impl Moments {
    /// Takes one error in.
    pub fn push(&mut self, error: f64) {
        self.merge(&Self { count: 1.0, mean: error, m2: 0.0, m3: 0.0, m4: 0.0 });
    }

    /// Takes another sample in. The result depends on the order of merges in its last bits: callers merge in
    /// a fixed order.
    pub fn merge(&mut self, other: &Self) {
        if other.count == 0.0 {
            return;
        }
        if self.count == 0.0 {
            *self = *other;
            return;
        }
        let (a, b) = (self.count, other.count);
        let n = a + b;
        let delta = other.mean - self.mean;
        let (d_n, d2) = (delta / n, delta * delta);
        let m4 = self.m4
            + other.m4
            + d2 * d2 * a * b * (a * a - a * b + b * b) / (n * n * n)
            + 6.0 * d_n * d_n * (a * a * other.m2 + b * b * self.m2)
            + 4.0 * d_n * (a * other.m3 - b * self.m3);
        let m3 = self.m3 + other.m3 + d2 * delta * a * b * (a - b) / (n * n) + 3.0 * d_n * (a * other.m2 - b * self.m2);
        let m2 = self.m2 + other.m2 + d2 * a * b / n;
        *self = Self { count: n, mean: self.mean + d_n * b, m2, m3, m4 };
    }

    /// How many errors.
    #[must_use]
    pub const fn count(&self) -> f64 {
        self.count
    }

    /// Mean error, with s/√n.
    #[must_use]
    pub fn bias(&self) -> Option<WithError> {
        (self.count > 1.0).then(|| (self.mean, (self.variance_value() / self.count).sqrt()))
    }

    /// Variance (n−1), with √((m₄ − (n−3)/(n−1)·s⁴)/n).
    #[must_use]
    pub fn variance(&self) -> Option<WithError> {
        (self.count > 1.0).then(|| {
            let n = self.count;
            let variance = self.variance_value();
            let of_variance = (self.m4 / n - (n - 3.0) / (n - 1.0) * variance * variance) / n;
            (variance, of_variance.max(0.0).sqrt())
        })
    }

    /// Root of the mean squared error, with the delta method's standard error.
    #[must_use]
    pub fn rmse(&self) -> Option<WithError> {
        (self.count > 1.0).then(|| {
            let n = self.count;
            let (b, c2, c3, c4) = (self.mean, self.m2 / n, self.m3 / n, self.m4 / n);
            let square = c2 + b * b;
            let fourth = c4 + 4.0 * c3 * b + 6.0 * c2 * b * b + b * b * b * b;
            let rmse = square.sqrt();
            let of_square = ((fourth - square * square).max(0.0) / n).sqrt();
            (rmse, if rmse > 0.0 { of_square / (2.0 * rmse) } else { 0.0 })
        })
    }

    fn variance_value(&self) -> f64 {
        self.m2 / (self.count - 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use effects::{Address, StreamName};

    fn sample(seed: u64, n: usize) -> Vec<f64> {
        let mut stream = Address { seed, point: 0, trial: 0, run: 0 }.stream(StreamName::new("moments"));
        (0..n).map(|_| 3.0 + stream.normal() + 0.3 * stream.normal().powi(2)).collect()
    }

    fn moments(values: &[f64]) -> Moments {
        let mut moments = Moments::default();
        values.iter().for_each(|value| moments.push(*value));
        moments
    }

    #[test]
    fn running_moments_are_those_of_the_textbook() {
        let values = sample(1, 500);
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let central = |power: i32| values.iter().map(|value| (value - mean).powi(power)).sum::<f64>();
        let running = moments(&values);
        // A few hundred roundings of sums of order n.
        let close = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-11, "{a} {b}");
        close(running.mean, mean);
        close(running.m2, central(2));
        close(running.m3, central(3));
        close(running.m4, central(4));
        close(running.variance().expect("many").0, central(2) / (n - 1.0));
        close(running.rmse().expect("many").0, (values.iter().map(|value| value * value).sum::<f64>() / n).sqrt());
    }

    #[test]
    fn merging_is_pushing() {
        let values = sample(2, 301);
        let (mut left, right) = (moments(&values[..77]), moments(&values[77..]));
        left.merge(&right);
        let whole = moments(&values);
        for (a, b) in [(left.mean, whole.mean), (left.m2, whole.m2), (left.m3, whole.m3), (left.m4, whole.m4)] {
            assert!((a / b - 1.0).abs() < 1e-11);
        }
        left.merge(&Moments::default());
        assert_eq!(left.count(), 301.0);
    }

    #[test]
    fn monte_carlo_errors_are_the_scatter_of_repeated_campaigns() {
        // 2000 campaigns of 200 draws: their scatter has a relative error of about 1/√4000 = 1.6 %; the
        // errors' own bias at n = 200 is under 2 %.
        let campaigns: Vec<Moments> = (0..2000).map(|seed| moments(&sample(100 + seed, 200))).collect();
        for of in [Moments::bias, Moments::variance, Moments::rmse] {
            let (mut found, mut stated) = (Moments::default(), 0.0);
            for campaign in &campaigns {
                let (value, error) = of(campaign).expect("many");
                found.push(value);
                stated += error * error / 2000.0;
            }
            let ratio = stated / found.variance().expect("many").0;
            assert!((ratio - 1.0).abs() < 0.12, "{ratio}");
        }
    }
}
