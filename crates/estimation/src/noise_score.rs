//! The score of the variances: what each measurement says of them.
//!
//! Measurements with independent components add theirs one after the other. Where
//! errors of position and heading correlate, the components depend on the variances themselves; the whole
//! measurement is taken at once, as the covariance of its errors alone depends on them.

use nalgebra::{Matrix3, Matrix4, Vector3, Vector4};

use crate::covariances::Covariances;
use crate::filter_state::Update;
use crate::noise::{NOISES, NoiseComponent};
use crate::noise_shape::CorrelatedErrors;

/// Score of the cost by the logarithms of the variances, and its information.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct NoiseScore {
    pub(crate) gradient: Vector4<f64>,
    pub(crate) information: Matrix4<f64>,
}

/// Score of the log-likelihood by the variance of the instants of measurements, and its information: of each
/// measurement with the innovation e, its covariance S and the instrument's velocity u, ½((uᵀS⁻¹e)² − uᵀS⁻¹u)
/// and ½(uᵀS⁻¹u)².
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct TimingScore {
    gradient: f64,
    information: f64,
}

impl TimingScore {
    /// Of a measurement, by uᵀS⁻¹e and uᵀS⁻¹u.
    pub(crate) fn of(error: f64, velocity: f64) -> Self {
        Self { gradient: 0.5 * (error * error - velocity), information: 0.5 * velocity * velocity }
    }

    pub(crate) fn add(&mut self, other: &Self, weight: f64) {
        self.gradient += weight * other.gradient;
        self.information += weight * other.information;
    }

    /// In standard deviations: standard normal where the variance is right.
    pub(crate) fn z(&self) -> f64 {
        if self.information > 0.0 { self.gradient / self.information.sqrt() } else { 0.0 }
    }

    /// By how much the variance is too small, s², by one step of scoring.
    pub(crate) fn step_s2(&self) -> f64 {
        if self.information > 0.0 { self.gradient / self.information } else { 0.0 }
    }
}

/// What the filter knows of a whole measurement before it takes it.
pub(crate) struct JointUpdate {
    pub(crate) errors: CorrelatedErrors,
    /// Variances of position and heading.
    pub(crate) variance: [f64; 2],
    /// Covariance of the pose.
    pub(crate) covariance: Matrix3<f64>,
    /// How the measured pose moves as the robot turns, in the room.
    pub(crate) by_heading: Vector3<f64>,
    /// What was measured less what was expected, in the room.
    pub(crate) innovation: Vector3<f64>,
    pub(crate) has_heading: bool,
}

impl NoiseScore {
    pub(crate) fn zero() -> Self {
        Self { gradient: Vector4::zeros(), information: Matrix4::zeros() }
    }

    pub(crate) fn add(&mut self, other: &Self, weight: f64) {
        self.gradient += weight * other.gradient;
        self.information += weight * other.information;
    }

    /// Adds what one component of a measurement says, of variance r, and takes the derivatives of covariance
    /// and pose over it. With the gain k = Ph/s, and ′ for a derivative by the logarithm of a variance,
    /// P′ ← P′ − P′h kᵀ − k (P′h)ᵀ + s′ k kᵀ; Gupta & Mehra 1974.
    #[inline(always)]
    pub(crate) fn add_component(
        &mut self,
        component: usize,
        update: &Update,
        r: f64,
        covariance_by: &mut Covariances<NOISES>,
        pose_by_noise: &mut [[f64; NOISES]; 3],
    ) {
        let Update { row, gain, v, s } = update;
        let per_s = 1.0 / s;
        let ph_by = covariance_by.along(row);
        let [x, y, theta] = pose_by_noise;
        let (mut s_by, mut v_by) = ([0.0; NOISES], [0.0; NOISES]);
        for a in 0..NOISES {
            s_by[a] = row.x * ph_by[0][a] + row.y * ph_by[1][a] + row.z * ph_by[2][a];
            v_by[a] = -(row.x * x[a] + row.y * y[a] + row.z * theta[a]);
        }
        s_by[if component < 2 { NoiseComponent::MeasurementPosition } else { NoiseComponent::MeasurementHeading }
            as usize] += r;
        for a in 0..NOISES {
            let of_v = v * per_s;
            x[a] += (ph_by[0][a] - gain.x * s_by[a]) * of_v + gain.x * v_by[a];
            y[a] += (ph_by[1][a] - gain.y * s_by[a]) * of_v + gain.y * v_by[a];
            theta[a] += (ph_by[2][a] - gain.z * s_by[a]) * of_v + gain.z * v_by[a];
        }
        covariance_by.lower_with_gain(gain, &ph_by, &s_by);
        let (s_by, v_by) = (Vector4::from(s_by) * per_s, Vector4::from(v_by));
        self.gradient += s_by * (0.5 * (1.0 - v * v * per_s)) + v_by * (v * per_s);
        self.information += s_by * s_by.transpose() * 0.5 + v_by * v_by.transpose() * per_s;
    }

    /// Adds what a whole measurement says, and takes the derivatives of covariance and pose over it. With
    /// S = H P Hᵀ + R, K = P Hᵀ S⁻¹ and ′ for a derivative, P′ ← P′ − P′Hᵀ Kᵀ − K H P′ + K S′ Kᵀ; Gupta &
    /// Mehra 1974.
    #[cold]
    pub(crate) fn add_joint(
        &mut self,
        joint: &JointUpdate,
        covariance_by: &mut Covariances<NOISES>,
        pose_by_noise: &mut [[f64; NOISES]; 3],
    ) {
        let JointUpdate { errors, variance, covariance, by_heading, mut innovation, has_heading } = *joint;
        let mut h = Matrix3::identity();
        h.set_column(2, &by_heading);
        let (mut noise, mut noise_by) = (errors.covariance(variance), errors.covariance_by(variance));
        if !has_heading {
            // A component of its own that says nothing.
            h.row_mut(2).fill(0.0);
            innovation.z = 0.0;
            for noise in noise_by.iter_mut().chain([&mut noise]) {
                noise.row_mut(2).fill(0.0);
                noise.column_mut(2).fill(0.0);
            }
            noise[(2, 2)] = 1.0;
        }
        // A sum of a covariance and one that is positive definite.
        let Some(inverse) = (h * covariance * h.transpose() + noise).try_inverse() else { return };
        let gain = covariance * h.transpose() * inverse;
        let weighted = inverse * innovation;
        let (mut s_by, mut v_by) = ([Matrix3::zeros(); NOISES], [Vector3::zeros(); NOISES]);
        let mut covariances = [Matrix3::zeros(); NOISES];
        for a in 0..NOISES {
            let before = covariance_by.matrix(a);
            let ph = before * h.transpose();
            s_by[a] = h * ph;
            if a == NoiseComponent::MeasurementPosition as usize {
                s_by[a] += noise_by[0];
            } else if a == NoiseComponent::MeasurementHeading as usize {
                s_by[a] += noise_by[1];
            }
            let pose_by = Vector3::new(pose_by_noise[0][a], pose_by_noise[1][a], pose_by_noise[2][a]);
            v_by[a] = -(h * pose_by);
            let moved = pose_by + (ph - gain * s_by[a]) * weighted + gain * v_by[a];
            for (row, moved) in pose_by_noise.iter_mut().zip(moved.iter()) {
                row[a] = *moved;
            }
            let half = ph * gain.transpose();
            covariances[a] = before - half - half.transpose() + gain * s_by[a] * gain.transpose();
        }
        *covariance_by = Covariances::of(covariances.each_ref());
        self.gradient += Vector4::from_fn(|a, _| {
            0.5 * ((inverse * s_by[a]).trace() - weighted.dot(&(s_by[a] * weighted))) + v_by[a].dot(&weighted)
        });
        self.information += Matrix4::from_fn(|a, b| {
            0.5 * (inverse * s_by[a] * inverse * s_by[b]).trace() + v_by[a].dot(&(inverse * v_by[b]))
        });
    }
}
