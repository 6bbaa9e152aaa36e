//! What the filter carries from measurement to measurement, and how it moves.

use kinematics::{Pose, Rotation};
use nalgebra::Vector3;

use crate::covariances::{Covariance, Covariances};
use crate::derivatives::Derivatives;
use crate::noise::{NOISES, NoiseComponent};

/// The filter's state, with its derivatives.
pub(crate) struct FilterState<'s> {
    pub(crate) pose: &'s mut Pose,
    pub(crate) covariance: &'s mut Covariance,
    /// ∂pose/∂column.
    pub(crate) by: &'s mut Derivatives,
    /// Derivatives of the covariance and of the pose by the logarithm of each variance.
    pub(crate) covariance_by: &'s mut Covariances<NOISES>,
    pub(crate) pose_by_noise: &'s mut [[f64; NOISES]; 3],
}

/// A motion, in the frame of the body at its start.
#[derive(Clone, Copy)]
pub(crate) struct Step<'s> {
    pub(crate) motion: Pose,
    pub(crate) by_geometry: [Vector3<f64>; 3],
    pub(crate) by_terms: &'s Derivatives,
    /// Where the columns of terms begin.
    pub(crate) first_term: usize,
    /// Covariances by the noise of wheels and turns in force.
    pub(crate) noise: &'s Covariances<2>,
    pub(crate) variance: [f64; 2],
    /// Covariance by what is restored of lost counts.
    pub(crate) restored: Option<&'s Covariance>,
    /// Whether derivatives by the variances are kept.
    pub(crate) noise_score: bool,
}

impl FilterState<'_> {
    /// Moves on.
    #[inline(always)]
    pub(crate) fn advance(&mut self, step: &Step<'_>) {
        let Step { motion, by_geometry, by_terms, first_term, noise, variance, restored, noise_score } = *step;
        let heading @ Rotation { sin, cos } = Rotation::by(self.pose.theta_rad);
        let room = |v: Vector3<f64>| Vector3::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y, v.z);
        let step = room(Vector3::new(motion.x_m, motion.y_m, motion.theta_rad));
        self.by.turn(step);
        for (column, of_propagation) in by_geometry.into_iter().enumerate() {
            self.by.set(column, self.by.get(column) + room(of_propagation));
        }
        self.by.add_turned(first_term, heading, by_terms);
        *self.pose = Pose::new(self.pose.x_m + step.x, self.pose.y_m + step.y, self.pose.theta_rad + step.z);
        let noise = noise.turned(heading).times(variance);
        self.covariance.carry(-step.y, step.x);
        self.covariance.add(0, &noise, 0);
        self.covariance.add(0, &noise, 1);
        if let Some(restored) = restored {
            self.covariance.add(0, &restored.turned(heading), 0);
        }
        if noise_score {
            self.covariance_by.carry(-step.y, step.x);
            self.covariance_by.add(NoiseComponent::Wheel as usize, &noise, 0);
            self.covariance_by.add(NoiseComponent::Turn as usize, &noise, 1);
            let [x, y, theta] = &mut *self.pose_by_noise;
            for a in 0..NOISES {
                x[a] -= step.y * theta[a];
                y[a] += step.x * theta[a];
            }
        }
    }
}

/// What one component of a measurement changes.
#[derive(Clone, Copy)]
pub(crate) struct Update {
    /// Its derivative by the pose.
    pub(crate) row: Vector3<f64>,
    pub(crate) gain: Vector3<f64>,
    /// Innovation, the components before it taken into account, and its variance.
    pub(crate) v: f64,
    pub(crate) s: f64,
}

impl Update {
    pub(crate) const NOTHING: Self =
        Self { row: Vector3::new(0.0, 0.0, 0.0), gain: Vector3::new(0.0, 0.0, 0.0), v: 0.0, s: 1.0 };
}
