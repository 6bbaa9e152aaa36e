//! What a stated distortion of the instrument's map adds to a covariance.
//!
//! The map's error at a place is the same whenever the robot is there, in every run: it does not average out,
//! and neither whiteness of innovations nor scatter over runs shows it. The fit is linear in what was
//! measured near its solution. So each wave of the distortion shifts the poses, one pass gives the gradients,
//! and I⁻¹ (Σ g gᵀ) I⁻¹ is the covariance that all waves make: that of a Gaussian process with the
//! covariance a² e^{−d²/2ℓ²} (Rahimi & Recht 2007; waves here at quantiles of its spectrum).

use std::f64::consts::TAU;

use dataset::MapDistortion;
use kinematics::sin_cos;
use nalgebra::{DMatrix, DVector};

use crate::normal_equations::{ClusterRobust, Information};
use crate::records::Records;
use crate::segment::Start;
use crate::settings::{GOLDEN_ANGLE_RAD, MAP_WAVES};

/// What of a covariance is there without the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum OwnScatter {
    /// The scatter over runs, which has what the map does to runs differently.
    Counted,
    /// The inverse information.
    NotCounted,
}

/// A shift of the poses by a place: along which coordinate, by a cosine or a sine of w·p.
#[derive(Clone, Copy)]
struct Wave {
    coordinate: usize,
    per_m: [f64; 2],
    phase_rad: f64,
    amplitude: f64,
}

impl Wave {
    fn at(&self, [x_m, y_m]: [f64; 2]) -> f64 {
        self.amplitude * sin_cos(self.per_m[0] * x_m + self.per_m[1] * y_m + self.phase_rad).1
    }
}

/// The waves of a distortion; their coefficients are independent and of variance 1.
fn waves(distortion: MapDistortion) -> Vec<Wave> {
    let MapDistortion { sigma_xy_m, sigma_theta_rad, length_m } = distortion;
    let n = f64::from(MAP_WAVES);
    let of = |(k, coordinate): (u32, usize)| {
        let sigma = if coordinate < 2 { sigma_xy_m } else { sigma_theta_rad };
        // Quantiles of the length of w: Rayleigh over ℓ.
        let length_per_m = (-2.0 * (1.0 - (f64::from(k) + 0.5) / n).ln()).sqrt() / length_m;
        let (sin, cos) = sin_cos(f64::from(k) * GOLDEN_ANGLE_RAD);
        let per_m = [length_per_m * cos, length_per_m * sin];
        [0.0, 0.25 * TAU].map(|phase_rad| Wave { coordinate, per_m, phase_rad, amplitude: sigma / n.sqrt() })
    };
    let all = (0..MAP_WAVES).flat_map(|k| (0..3).map(move |coordinate| (k, coordinate)));
    all.flat_map(of).filter(|wave| wave.amplitude > 0.0).collect()
}

/// What the distortion adds to the covariance of parameters. `equations` gives the normal equation of each
/// run with other measured poses, `inverse` is that of the whole information.
///
/// Where the scatter over runs is counted, what it has of the map already is taken off ([`of_wave`]).
pub(crate) fn added_covariance(
    records: &Records<'_>,
    distortion: MapDistortion,
    own: OwnScatter,
    inverse: &DMatrix<f64>,
    mut equations: impl FnMut(&Records<'_>) -> Vec<Information>,
) -> DMatrix<f64> {
    let n = inverse.nrows();
    let at_rest = equations(records);
    let mut added = DMatrix::zeros(n, n);
    let mut shifted = records.clone();
    for wave in waves(distortion) {
        shift(&mut shifted, records, &wave);
        let runs: Vec<Information> = equations(&shifted)
            .into_iter()
            .zip(&at_rest)
            .map(|(moved, rest)| Information { gradient: moved.gradient - &rest.gradient, ..rest.clone() })
            .collect();
        added += of_wave(&runs, own, inverse);
    }
    let size = inverse.diagonal().map(|variance| variance.max(f64::MIN_POSITIVE).sqrt());
    // Over the standard deviations: metres, radians and ratios differ by orders of magnitude.
    let scaled = DMatrix::from_fn(n, n, |i, j| added[(i, j)] / (size[i] * size[j]));
    let mut eigen = scaled.symmetric_eigen();
    eigen.eigenvalues.apply(|value| *value = value.max(0.0));
    let positive = eigen.recompose();
    DMatrix::from_fn(n, n, |i, j| positive[(i, j)] * size[i] * size[j])
}

/// What one wave adds, by the shift g of each run's gradient.
///
/// The estimate moves by I⁻¹ Σ g. The scatter over runs is taken after the fit has moved: it sees what is
/// left of each run's shift, g − I_r I⁻¹ Σ g, and nothing of a shift that all runs have in common.
fn of_wave(runs: &[Information], own: OwnScatter, inverse: &DMatrix<f64>) -> DMatrix<f64> {
    let sum = runs.iter().fold(DVector::zeros(inverse.nrows()), |sum, run| sum + &run.gradient);
    let moved = inverse * sum;
    let whole = &moved * moved.transpose();
    if own == OwnScatter::NotCounted {
        return whole;
    }
    let left = runs
        .iter()
        .map(|run| Information { gradient: &run.gradient - &run.matrix * &moved, matrix: run.matrix.clone() });
    whole - ClusterRobust::of(inverse, left).covariance
}

/// Shifts every measured pose by a wave; displacements are in no map.
fn shift(shifted: &mut Records<'_>, records: &Records<'_>, wave: &Wave) {
    for (to, from) in shifted.segments.iter_mut().zip(&records.segments) {
        if from.start == Start::Origin {
            continue;
        }
        for (to, from) in to.measurements.iter_mut().zip(&from.measurements) {
            let by = wave.at([from.x_m, from.y_m]);
            *to = *from;
            match wave.coordinate {
                0 => to.x_m += by,
                1 => to.y_m += by,
                _ => to.theta_rad = from.theta_rad.map(|theta_rad| theta_rad + by),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_all_runs_share_is_added_whole_and_what_they_differ_by_is_in_their_scatter() {
        // One parameter, four runs of unit information: the estimate is the mean of the runs' shifts.
        let of = |gradients: [f64; 4], own| {
            let runs = gradients.map(|gradient| Information {
                matrix: DMatrix::from_element(1, 1, 1.0),
                gradient: DVector::from_element(1, gradient),
            });
            of_wave(&runs, own, &DMatrix::from_element(1, 1, 0.25))[(0, 0)]
        };
        // A shift of all runs by 1 moves the estimate by 1, and no run from the others.
        assert!((of([1.0; 4], OwnScatter::Counted) - 1.0).abs() < 1e-15);
        // What runs differ by cancels in the mean and is in their scatter: the sample variance 4/3 over four.
        assert!((of([1.0, -1.0, 1.0, -1.0], OwnScatter::Counted) + 1.0 / 3.0).abs() < 1e-15);
        assert!(of([1.0, -1.0, 1.0, -1.0], OwnScatter::NotCounted).abs() < 1e-15);
    }

    #[test]
    fn waves_make_the_stated_covariance_at_every_distance_within_two_lengths() {
        let distortion = MapDistortion { sigma_xy_m: 0.02, sigma_theta_rad: 0.0, length_m: 0.5 };
        let waves = waves(distortion);
        assert!(waves.iter().all(|wave| wave.coordinate < 2));
        let (here, mut worst) = ([3.0, -1.0], 0.0_f64);
        for k in 0..40 {
            let (distance_m, direction_rad) = (0.025 * f64::from(k), 0.7 * f64::from(k));
            let there = [here[0] + distance_m * direction_rad.cos(), here[1] + distance_m * direction_rad.sin()];
            let covariance: f64 =
                waves.iter().filter(|wave| wave.coordinate == 1).map(|wave| wave.at(here) * wave.at(there)).sum();
            let expected = (-0.5 * (distance_m / 0.5).powi(2)).exp();
            worst = worst.max((covariance / 4e-4 - expected).abs());
        }
        // The mean of 24 cosines at quantiles of the spectrum: a dozen directions for each length leave some
        // 1/24 of each. Rejected: the spectrum of e^{−d²/ℓ²}, off by 0.24, and waves along x alone.
        assert!(worst < 0.1, "{worst}");
    }
}
