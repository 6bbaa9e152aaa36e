//! The second filter: the noise of the wheels and of the instrument, from the innovations of the first.
//!
//! Martinelli's second filter takes observables of the path whose means are linear in the noise parameters.
//! Here they are the products of the first filter's innovations ν: at given gains their mean S = C + Σ q_i
//! D_i is linear in the variances q, exactly, because the covariance in Joseph's form is; the first filter
//! carries C and D along. q is a constant state measured through νν', whose scatter for normal errors gives
//! the weights: information Λ_ij = ½ tr(S⁻¹D_i S⁻¹D_j) and its share of the information vector ½ tr(S⁻¹D_i
//! S⁻¹(νν' − C)) of each measurement. This is Fisher scoring on the likelihood of the innovations (Mehra
//! 1970), one measurement at a time.

use nalgebra::{Matrix3, Vector3};

use crate::settings::{MAX_NOISE_FACTOR, MAX_NOISE_STEP, NOISE_PRIOR_MEASUREMENTS};

/// Noise variances in the order of [`NoiseSource`].
pub type Variances = Vector3<f64>;

/// What a noise variance is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoiseSource {
    /// The wheels: variance of travel a metre, m.
    Wheels,
    /// The instrument's position, m².
    Position,
    /// The instrument's heading, rad².
    Heading,
}

/// Estimate of the noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseFilter {
    variances: Variances,
    guess: Variances,
    known: [bool; 3],
    adapting: bool,
    information: Matrix3<f64>,
    information_vector: Vector3<f64>,
    gradient: Vector3<f64>,
    log_likelihood: f64,
}

/// Mean of an innovation's square, S = `fixed` + Σ q_i `slopes`[i].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Expected {
    pub(super) fixed: Matrix3<f64>,
    pub(super) slopes: [Matrix3<f64>; 3],
}

impl Expected {
    /// S for given variances.
    pub(super) fn at(&self, variances: &Variances) -> Matrix3<f64> {
        self.slopes.iter().zip(variances.iter()).fold(self.fixed, |sum, (slope, variance)| sum + slope * *variance)
    }
}

impl NoiseFilter {
    /// Variances to begin with, and which of them are known and fixed. The others are estimated measurement
    /// by measurement.
    #[must_use]
    pub fn new(variances: Variances, known: [bool; 3]) -> Self {
        Self {
            variances,
            guess: variances,
            known,
            adapting: true,
            information: Matrix3::zeros(),
            information_vector: Vector3::zeros(),
            gradient: Vector3::zeros(),
            log_likelihood: 0.0,
        }
    }

    /// The same guess with other variances, which are fixed while information is summed: for another pass
    /// over the same measurements.
    pub(super) fn fixed_at(&self, variances: Variances) -> Self {
        Self { variances, adapting: false, ..Self::new(self.guess, self.known) }
    }

    /// The current estimate of the variances.
    #[must_use]
    pub const fn variances(&self) -> &Variances {
        &self.variances
    }

    /// Takes an innovation.
    pub(super) fn measurement(&mut self, innovation: &Vector3<f64>, expected: &Expected) {
        let mean = expected.at(&self.variances);
        let Some(inverse) = mean.try_inverse() else { return };
        let square = innovation * innovation.transpose();
        let weights = expected.slopes.map(|slope| inverse * slope);
        let surprise = inverse * (square - mean);
        for i in 0..3 {
            self.gradient[i] += 0.5 * (weights[i] * surprise).trace();
            for j in 0..3 {
                let information = 0.5 * (weights[i] * weights[j]).trace();
                self.information[(i, j)] += information;
                self.information_vector[i] += information * self.variances[j];
            }
            self.information_vector[i] += 0.5 * (weights[i] * surprise).trace();
        }
        self.log_likelihood -= 0.5 * (mean.determinant().ln() + innovation.dot(&(inverse * innovation)));
        if self.adapting {
            self.solve();
        }
    }

    /// Solves for the variances; those at a bound of their range are fixed there.
    fn solve(&mut self) {
        let mut fixed = self.known;
        loop {
            let (mut information, mut information_vector) = (self.information, self.information_vector);
            for i in 0..3 {
                let prior = 0.5 * NOISE_PRIOR_MEASUREMENTS / (self.guess[i] * self.guess[i]);
                information[(i, i)] += prior;
                information_vector[i] += prior * self.guess[i];
            }
            for i in (0..3).filter(|i| fixed[*i]) {
                for j in (0..3).filter(|j| !fixed[*j]) {
                    information_vector[j] -= information[(j, i)] * self.variances[i];
                    information[(j, i)] = 0.0;
                    information[(i, j)] = 0.0;
                }
                information.set_row(i, &nalgebra::RowVector3::zeros());
                information.set_column(i, &Vector3::zeros());
                information[(i, i)] = 1.0;
                information_vector[i] = self.variances[i];
            }
            let Some(variances) = information.lu().solve(&information_vector) else { return };
            let outside = |i: usize| {
                let (least, most) = (self.guess[i] / MAX_NOISE_FACTOR, self.guess[i] * MAX_NOISE_FACTOR);
                (!fixed[i] && !(least..=most).contains(&variances[i])).then(|| variances[i].clamp(least, most))
            };
            let beyond: Vec<(usize, f64)> = (0..3).filter_map(|i| Some((i, outside(i)?))).collect();
            if beyond.is_empty() {
                self.variances = variances;
                return;
            }
            for (i, border) in beyond {
                fixed[i] = true;
                self.variances[i] = border;
            }
        }
    }

    /// Logarithm of the likelihood of all measurements and of the guess, to a constant.
    pub(super) fn log_posterior(&self) -> f64 {
        let prior = (0..3).filter(|i| !self.known[*i]).map(|i| {
            let ratio = self.guess[i] / self.variances[i];
            0.5 * NOISE_PRIOR_MEASUREMENTS * (ratio.ln() - ratio)
        });
        self.log_likelihood + prior.sum::<f64>()
    }

    /// Step of Fisher scoring in the logarithms of the variances, none of them by more than a factor e².
    pub(super) fn step(&self) -> Vector3<f64> {
        let (mut information, mut gradient) = (Matrix3::identity(), Vector3::zeros());
        for i in (0..3).filter(|i| !self.known[*i]) {
            for j in (0..3).filter(|j| !self.known[*j]) {
                information[(i, j)] = self.information[(i, j)] * self.variances[i] * self.variances[j];
            }
            let ratio = self.guess[i] / self.variances[i];
            information[(i, i)] += 0.5 * NOISE_PRIOR_MEASUREMENTS * ratio.max(1.0);
            gradient[i] = self.gradient[i] * self.variances[i] + 0.5 * NOISE_PRIOR_MEASUREMENTS * (ratio - 1.0);
        }
        let step = information.lu().solve(&gradient).unwrap_or_default();
        step.map(|step| step.clamp(-MAX_NOISE_STEP, MAX_NOISE_STEP))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    const TRUTH: [f64; 3] = [3e-6, 5e-7, 2e-6];

    /// Measurements after intervals of different lengths, whose innovations have the covariance of [`TRUTH`]
    /// exactly: ±√3 times the columns of its root.
    fn measurements() -> Vec<(Vector3<f64>, Expected)> {
        let mut measurements = Vec::new();
        for interval in 1..=400_u32 {
            let length_m = 0.01 * f64::from(interval);
            let wheels = Matrix3::from_diagonal(&Vector3::new(0.5, length_m * length_m, 15.0)) * length_m;
            let expected = Expected {
                fixed: Matrix3::from_diagonal_element(1e-7),
                slopes: [
                    wheels,
                    Matrix3::from_diagonal(&Vector3::new(2.0, 2.0, 0.0)),
                    Matrix3::from_diagonal(&Vector3::new(0.0, length_m * length_m, 2.0)),
                ],
            };
            let root = expected.at(&TRUTH.into()).cholesky().expect("positive").l();
            for column in 0..3 {
                for sign in [1.0, -1.0] {
                    measurements.push((root.column(column) * sign * 3_f64.sqrt(), expected));
                }
            }
        }
        measurements
    }

    fn guess() -> NoiseFilter {
        NoiseFilter::new([1e-6, 1e-6, 4e-6].into(), [false; 3])
    }

    fn relative(found: &Variances) -> f64 {
        found.component_div(&Variances::from(TRUTH)).add_scalar(-1.0).amax()
    }

    /// Variances at which the likelihood of the measurements is largest.
    fn scored(measurements: &[(Vector3<f64>, Expected)], known: [bool; 3]) -> NoiseFilter {
        let mut filter = NoiseFilter { known, ..guess() };
        for _ in 0..30 {
            filter = filter.fixed_at(*filter.variances());
            measurements.iter().for_each(|(innovation, expected)| filter.measurement(innovation, expected));
            let variances = filter.variances().zip_map(&filter.step(), |variance, step| variance * step.exp());
            filter.variances = variances;
        }
        filter
    }

    #[test]
    fn variances_come_back_from_innovations_that_have_them() {
        let measurements = measurements();
        // The guess, off by a factor of two, is worth a measurement among the hundred or so after short
        // intervals that determine the heading's error: 0.01.
        let found = scored(&measurements, [false; 3]);
        assert!(relative(found.variances()) < 0.01, "{}", found.variances());
        // What must not pass: without the part that does not depend on the noise, and with two variances
        // taken for each other.
        let blind: Vec<_> = measurements
            .iter()
            .map(|(of, expected)| (*of, Expected { fixed: Matrix3::zeros(), ..*expected }))
            .collect();
        assert!(relative(scored(&blind, [false; 3]).variances()) > 0.05);
        let swapped = |expected: &Expected| Expected {
            slopes: [expected.slopes[0], expected.slopes[2], expected.slopes[1]],
            ..*expected
        };
        let swapped: Vec<_> = measurements.iter().map(|(of, expected)| (*of, swapped(expected))).collect();
        assert!(relative(scored(&swapped, [false; 3]).variances()) > 0.5);
    }

    /// 20 seeds of 2400 measurements. Each variance is estimated to the standard deviation that the
    /// information promises; 60 deviations of five of them are a false positive of 3.4e-5.
    #[test]
    fn on_line_the_variances_come_as_near_as_the_information_allows() {
        let measurements = measurements();
        let information = scored(&measurements, [false; 3]).information;
        let covariance = information.try_inverse().expect("regular");
        let mut largest = 0.0_f64;
        for seed in 0..20 {
            let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(seed);
            let mut filter = guess();
            for number in 0..measurements.len() {
                // Short and long intervals in turn.
                let (_, expected) = &measurements[(number * 991) % measurements.len()];
                let root = expected.at(&TRUTH.into()).cholesky().expect("positive").l();
                let draws = Vector3::from_fn(|_, _| StandardNormal.sample(&mut rng));
                filter.measurement(&(root * draws), expected);
            }
            for i in 0..3 {
                largest = largest.max((filter.variances()[i] - TRUTH[i]).abs() / covariance[(i, i)].sqrt());
            }
        }
        assert!(largest < 5.0, "{largest}");
        // A filter that stayed at its guess would not pass.
        let stayed = (0..3).map(|i| (guess().guess[i] - TRUTH[i]).abs() / covariance[(i, i)].sqrt());
        assert!(stayed.fold(0.0, f64::max) > 5.0);
    }

    #[test]
    fn the_gradient_is_that_of_the_log_posterior_and_would_not_pass_wrong() {
        let measurements = measurements();
        let at = |variances: Variances| {
            let mut filter = guess().fixed_at(variances);
            measurements.iter().for_each(|(innovation, expected)| filter.measurement(innovation, expected));
            filter
        };
        let point = Vector3::new(2e-6, 8e-7, 1e-6);
        let filter = at(point);
        for i in 0..3 {
            let h = 1e-4;
            let moved = |by: f64| {
                let mut variances = point;
                variances[i] *= 1.0 + by;
                at(variances).log_posterior()
            };
            let difference = (moved(h) - moved(-h)) / (2.0 * h);
            let ratio = guess().guess[i] / point[i];
            let gradient = filter.gradient[i] * point[i] + 0.5 * NOISE_PRIOR_MEASUREMENTS * (ratio - 1.0);
            // 2400 measurements: third derivatives in the logarithm stay under a few thousand, truncation
            // 1e-8 of it; rounding 1e-16·4e4/1e-4.
            assert!((gradient - difference).abs() < 1e-3, "{i}: {gradient} {difference}");
            assert!((gradient * 1.001 + 2e-3 - difference).abs() > 1e-3);
        }
    }

    #[test]
    fn what_is_known_stays_and_what_is_absent_goes_to_the_border() {
        let measurements = measurements();
        let found = scored(&measurements, [false, true, false]);
        assert_eq!(found.variances()[NoiseSource::Position as usize], 1e-6);
        // Innovations without any scatter: every variance ends where its range does, and none is negative.
        let mut filter = guess();
        measurements.iter().for_each(|(_, expected)| filter.measurement(&Vector3::zeros(), expected));
        assert!(filter.variances().min() > 0.0 && filter.variances().max() < 1e-7, "{}", filter.variances());
    }
}
