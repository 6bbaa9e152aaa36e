//! Derivatives of the partial measurements' filter by the logarithms of the variances, and the score that
//! they give.

use nalgebra::{DMatrix, DVector, Matrix3, MatrixXx3, Vector3};

use crate::noise::{NOISES, NoiseComponent};
use crate::noise_score::NoiseScore;
use crate::partial_poses::PoseUpdate;

/// Variances that the wheels' motion depends on; they come first.
pub(crate) const OF_MOTION: [NoiseComponent; 2] = [NoiseComponent::Wheel, NoiseComponent::Turn];

/// Derivatives of covariance and state by the logarithms of the variances: those of the motion, and beside
/// poses those of the instrument.
pub(crate) struct NoiseDerivatives {
    pub(crate) covariance_by: Vec<DMatrix<f64>>,
    pub(crate) state_by: Vec<DVector<f64>>,
    pub(crate) score: NoiseScore,
}

impl NoiseDerivatives {
    /// At a start that depends on no variance: of a state of some size, by so many variances.
    pub(crate) fn new(size: usize, variances: usize) -> Self {
        Self {
            covariance_by: vec![DMatrix::zeros(size, size); variances],
            state_by: vec![DVector::zeros(size); variances],
            score: NoiseScore::zero(),
        }
    }

    /// The recursions differentiated, as in [`crate::noise_score`].
    pub(crate) fn take_pose(&mut self, of: &PoseUpdate, gain: &MatrixXx3<f64>, inverse: &Matrix3<f64>) {
        let (h, weighted) = (&of.by_state, inverse * of.innovation);
        let (mut s_by, mut v_by) = ([Matrix3::zeros(); NOISES], [Vector3::zeros(); NOISES]);
        for a in 0..self.covariance_by.len() {
            let ph_by = &self.covariance_by[a] * h;
            s_by[a] = h.tr_mul(&ph_by);
            if let Some(own) = a.checked_sub(OF_MOTION.len()) {
                s_by[a] += of.errors_by[own];
            }
            v_by[a] = -h.tr_mul(&self.state_by[a]);
            self.state_by[a] += (&ph_by - gain * s_by[a]) * weighted + gain * v_by[a];
            let half = (&ph_by - gain * (s_by[a] * 0.5)) * gain.transpose();
            self.covariance_by[a] -= &half + half.transpose();
        }
        for a in 0..NOISES {
            self.score.gradient[a] +=
                0.5 * ((inverse * s_by[a]).trace() - weighted.dot(&(s_by[a] * weighted))) + v_by[a].dot(&weighted);
            for b in 0..NOISES {
                self.score.information[(a, b)] +=
                    0.5 * (inverse * s_by[a] * inverse * s_by[b]).trace() + v_by[a].dot(&(inverse * v_by[b]));
            }
        }
    }

    /// The recursions differentiated, as in [`crate::filter`].
    pub(crate) fn take_scalar(&mut self, row: &DVector<f64>, gain: &DVector<f64>, v: f64, s: f64) {
        let (mut s_by, mut v_by) = ([0.0; NOISES], [0.0; NOISES]);
        for a in 0..self.covariance_by.len() {
            let ph_by = &self.covariance_by[a] * row;
            s_by[a] = row.dot(&ph_by);
            v_by[a] = -row.dot(&self.state_by[a]);
            self.state_by[a] += (&ph_by - gain * s_by[a]) * (v / s) + gain * v_by[a];
            let half = &ph_by - gain * (0.5 * s_by[a]);
            let change = gain * half.transpose();
            self.covariance_by[a] -= &change + change.transpose();
        }
        for a in 0..NOISES {
            self.score.gradient[a] += 0.5 * (s_by[a] / s) * (1.0 - v * v / s) + v_by[a] * v / s;
            for b in 0..NOISES {
                self.score.information[(a, b)] += 0.5 * (s_by[a] / s) * s_by[b] / s + v_by[a] * v_by[b] / s;
            }
        }
    }
}
