//! Regression of an outcome on the turns of both wheels, y = c_L·Δ_L + c_R·Δ_R, by reweighted least squares.
//! Reference: Holland & Welsch 1977 (Cauchy's weights).

use dataset::median;
use kinematics::Wheels;

use crate::settings::CHECKS;

/// A regression's answer.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Regression {
    pub(crate) per_rad: Wheels<f64>,
    pub(crate) sigma: Wheels<f64>,
    /// Mean absolute residual.
    pub(crate) left: f64,
    /// Mean absolute outcome.
    pub(crate) whole: f64,
}

/// Second moments of the wheels' turns, with weights.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Moments {
    pub(crate) ll: f64,
    pub(crate) lr: f64,
    pub(crate) rr: f64,
}

impl Moments {
    pub(crate) fn of(turns: impl Iterator<Item = (Wheels<f64>, f64)>) -> Self {
        turns.fold(Self::default(), |sum, (turn, weight)| Self {
            ll: sum.ll + weight * turn.left * turn.left,
            lr: sum.lr + weight * turn.left * turn.right,
            rr: sum.rr + weight * turn.right * turn.right,
        })
    }

    /// Eigenvalues, the larger first.
    fn eigenvalues(self) -> [f64; 2] {
        let (mean, half) = (0.5 * (self.ll + self.rr), 0.5 * (self.ll - self.rr));
        let by = half.hypot(self.lr);
        [mean + by, (mean - by).max(0.0)]
    }

    /// Whether both wheels turn in one proportion only; then the direction is (left, right) of length 1.
    pub(crate) fn direction(self) -> Option<Wheels<f64>> {
        let [larger, smaller] = self.eigenvalues();
        if larger == 0.0 || smaller > CHECKS.collinear_ratio * larger {
            return None;
        }
        let angle = 0.5 * (2.0 * self.lr).atan2(self.ll - self.rr);
        Some(Wheels { left: angle.cos(), right: angle.sin() })
    }

    fn inverse(self) -> Option<Self> {
        let determinant = self.ll * self.rr - self.lr * self.lr;
        (determinant > 1e-12 * self.ll * self.rr).then(|| Self {
            ll: self.rr / determinant,
            lr: -self.lr / determinant,
            rr: self.ll / determinant,
        })
    }
}

/// Cauchy's weight of a residual: a half at the scale.
pub(crate) fn cauchy(residual: f64, scale: f64) -> f64 {
    1.0 / (1.0 + (residual / scale).powi(2))
}

/// A value of windows without each of some groups of consecutive ones in turn; `None` where one is missing.
pub(crate) fn without_each_group<W: Clone, V>(windows: &[W], of: impl Fn(&[W]) -> Option<V>) -> Option<Vec<V>> {
    let group = windows.len().div_ceil(CHECKS.groups);
    let without = |number: usize| {
        let (from, to) = ((number * group).min(windows.len()), ((number + 1) * group).min(windows.len()));
        of(&[&windows[..from], &windows[to..]].concat())
    };
    (0..CHECKS.groups).map(without).collect()
}

/// The jackknife's standard deviation of a value, by what it is without each group.
pub(crate) fn jackknife_sigma<V>(without: &[V], of: impl Fn(&V) -> f64) -> f64 {
    let count = without.len() as f64;
    let mean = without.iter().map(&of).sum::<f64>() / count;
    let square: f64 = without.iter().map(|one| (of(one) - mean).powi(2)).sum();
    (square * (count - 1.0) / count).sqrt()
}

/// Regresses outcomes on turns; once without reweighting where `passes` is 1.
pub(crate) fn regress(pairs: &[(Wheels<f64>, f64)], passes: usize) -> Option<Regression> {
    let mut weights = vec![1.0; pairs.len()];
    let mut found = None;
    for pass in 0..passes {
        let weighted = || pairs.iter().zip(&weights);
        let inverse = Moments::of(weighted().map(|((turn, _), weight)| (*turn, *weight))).inverse()?;
        let (mut left, mut right) = (0.0, 0.0);
        for ((turn, outcome), weight) in weighted() {
            left += weight * turn.left * outcome;
            right += weight * turn.right * outcome;
        }
        let per_rad =
            Wheels { left: inverse.ll * left + inverse.lr * right, right: inverse.lr * left + inverse.rr * right };
        let residual =
            |(turn, outcome): &(Wheels<f64>, f64)| outcome - per_rad.left * turn.left - per_rad.right * turn.right;
        let sizes: Vec<f64> = pairs.iter().map(|pair| residual(pair).abs()).collect();
        let mean = sizes.iter().sum::<f64>() / sizes.len() as f64;
        let weighted_square: f64 = weighted().map(|(pair, weight)| weight * residual(pair).powi(2)).sum();
        let freedom = (weights.iter().sum::<f64>() - 2.0).max(1.0);
        let var = weighted_square / freedom;
        let whole = pairs.iter().map(|(_, outcome)| outcome.abs()).sum::<f64>() / pairs.len() as f64;
        let sigma = Wheels { left: (var * inverse.ll).sqrt(), right: (var * inverse.rr).sqrt() };
        found = Some(Regression { per_rad, sigma, left: mean, whole });
        if pass + 1 < passes {
            let scale = CHECKS.cauchy_medians * median(sizes)? + f64::MIN_POSITIVE;
            for (weight, pair) in weights.iter_mut().zip(pairs) {
                *weight = cauchy(residual(pair), scale);
            }
        }
    }
    found
}

/// With outliers down-weighted.
pub(crate) fn robustly(pairs: &[(Wheels<f64>, f64)]) -> Option<Regression> {
    regress(pairs, CHECKS.robust_passes)
}

/// Robust slope of one variable on another, with its standard deviation, and mean absolute values of residual
/// and outcome.
pub(crate) fn slope(pairs: &[(f64, f64)]) -> Option<(f64, f64, f64, f64)> {
    let mut weights = vec![1.0; pairs.len()];
    let mut found = None;
    for pass in 0..CHECKS.robust_passes {
        let sums = pairs
            .iter()
            .zip(&weights)
            .fold((0.0, 0.0), |(xx, xy), ((x, y), weight)| (xx + weight * x * x, xy + weight * x * y));
        if sums.0 <= 0.0 {
            return None;
        }
        let slope = sums.1 / sums.0;
        let residual = |(x, y): &(f64, f64)| y - slope * x;
        let sizes: Vec<f64> = pairs.iter().map(|pair| residual(pair).abs()).collect();
        let left = sizes.iter().sum::<f64>() / sizes.len() as f64;
        let square: f64 = pairs.iter().zip(&weights).map(|(pair, weight)| weight * residual(pair).powi(2)).sum();
        let var = square / (weights.iter().sum::<f64>() - 1.0).max(1.0);
        let whole = pairs.iter().map(|(_, y)| y.abs()).sum::<f64>() / pairs.len() as f64;
        found = Some((slope, (var / sums.0).sqrt(), left, whole));
        if pass + 1 < CHECKS.robust_passes {
            let scale = CHECKS.cauchy_medians * median(sizes)? + f64::MIN_POSITIVE;
            for (weight, pair) in weights.iter_mut().zip(pairs) {
                *weight = cauchy(residual(pair), scale);
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Turns of wheels that speed up and down differently.
    fn turns() -> impl Iterator<Item = Wheels<f64>> {
        (0..200).map(|k| Wheels { left: (0.1 * f64::from(k)).sin(), right: (0.13 * f64::from(k)).cos() })
    }

    #[test]
    fn a_tenth_of_outliers_does_not_move_the_answer() {
        let outcome = |(k, turn): (usize, Wheels<f64>)| {
            let outcome = 0.075 * turn.left - 0.2 * turn.right;
            (turn, if k % 10 == 3 { outcome + 40.0 } else { outcome })
        };
        let pairs: Vec<_> = turns().enumerate().map(outcome).collect();
        let found = robustly(&pairs).expect("two directions");
        // Exact but for the outliers, whose weight vanishes with the median residual.
        assert!((found.per_rad.left - 0.075).abs() < 1e-6 && (found.per_rad.right + 0.2).abs() < 1e-6, "{found:?}");
        // Rejects least squares without weights.
        let plain = regress(&pairs, 1).expect("two directions");
        assert!((plain.per_rad.left - 0.075).abs() > 0.1, "{plain:?}");
    }

    #[test]
    fn wheels_of_one_proportion_have_a_direction_and_no_regression() {
        let straight: Vec<_> = turns().map(|turn| (Wheels::both(turn.left), turn.left)).collect();
        let direction = Moments::of(straight.iter().map(|(turn, _)| (*turn, 1.0))).direction().expect("one");
        assert!((direction.left - direction.right).abs() < 1e-12);
        assert!(robustly(&straight).is_none());
        assert!(Moments::of(turns().map(|turn| (turn, 1.0))).direction().is_none());
    }
}
