//! The rounding of cumulative counts in the filter.
//!
//! A count c is off by up to half of a count, e. Dead reckoning from counts follows z = x + J e, the pose
//! that the counts say, without noise of rounding; the instrument sees x = z − J e. While no count changes, e
//! stays the same; each new count brings a new one. The filter therefore carries z, and for as long as the
//! counts stand it carries x instead: x is entered with P + Q, Q = J diag(q²/12) Jᵀ, measured as often as
//! there are measurements, and what these say of it is handed back to z when a wheel turns on,
//!
//! z⁺ = z + K (x⁺ − x), P⁺ = P − K (P + Q − P_x) Kᵀ, K = P (P + Q)⁻¹,
//!
//! the smoother's step of Rauch, Tung & Striebel 1965 for a state that does not move. Rounding adds nothing
//! from row to row, and a standstill does not average it out. Widrow & Kollár 2008 (q²/12).

use kinematics::{Pose, Wheels, sin_cos};
use nalgebra::{Matrix3, Vector3};

use crate::covariances::{Covariance, Covariances};
use crate::derivatives::Derivatives;
use crate::model::Model;
use crate::noise::NOISES;
use crate::settings::MIN_ROUNDING_VARIANCE_RATIO;

/// The filter's state, with its derivatives.
pub(crate) struct FilterState<'s> {
    pub(crate) pose: &'s mut Pose,
    pub(crate) covariance: &'s mut Covariance,
    pub(crate) by: &'s mut Derivatives,
    pub(crate) covariance_by: &'s mut Covariances<NOISES>,
    pub(crate) pose_by_noise: &'s mut [[f64; NOISES]; 3],
}

/// Which pose the filter carries.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Carries {
    /// That of the counts.
    OfCounts,
    /// The robot's, since a start: nothing is known of the counts' rounding.
    SinceStart,
    /// The robot's, since a measurement after the counts had changed.
    SinceMeasurement { pose: Pose, covariance: Matrix3<f64>, by_noise: [[f64; NOISES]; 3] },
}

/// What the rounding of both wheels' counts makes of a pose: variances along (m²) and of the heading (rad²),
/// and their covariance.
pub(crate) fn rounding_variances(quantum_rad: Wheels<f64>, model: &Model) -> [f64; 3] {
    let variance_m2 = quantum_rad.zip_with(model.m_per_rad, |rad, m_per_rad| (rad * m_per_rad).powi(2) / 12.0);
    let (Wheels { left, right }, separation_m) = (variance_m2, model.separation_m);
    [0.25 * (left + right), (left + right) / (separation_m * separation_m), 0.5 * (right - left) / separation_m]
}

/// Rounding in the filter of one segment.
pub(crate) struct Rounding {
    /// Variances along and of the heading, and their covariance, by both wheels' counts.
    along_m2: f64,
    heading_rad2: f64,
    covariance_m_rad: f64,
    carries: Carries,
    /// Derivatives of the counts' pose while the robot's is carried.
    by: Derivatives,
    covariance_by: Covariances<NOISES>,
}

impl Rounding {
    /// Of counts that stand for these angles. `columns` are those of the derivatives.
    pub(crate) fn new(quantum_rad: Wheels<f64>, model: &Model, columns: usize) -> Self {
        let [along_m2, heading_rad2, covariance_m_rad] = rounding_variances(quantum_rad, model);
        let is_rounded = heading_rad2 > 0.0;
        Self {
            along_m2,
            heading_rad2,
            covariance_m_rad,
            carries: Carries::OfCounts,
            by: Derivatives::zeros(if is_rounded { columns } else { 0 }),
            covariance_by: Covariances::ZERO,
        }
    }

    /// Does it matter beside measurements of these variances of position and heading?
    fn matters(&self, [position_m2, heading_rad2]: [f64; 2]) -> bool {
        self.along_m2 > MIN_ROUNDING_VARIANCE_RATIO * position_m2
            || self.heading_rad2 > MIN_ROUNDING_VARIANCE_RATIO * heading_rad2
    }

    /// Q in the room, for a heading.
    fn in_room(&self, theta_rad: f64) -> Matrix3<f64> {
        let (sin, cos) = sin_cos(theta_rad);
        let (along, with) = (self.along_m2, self.covariance_m_rad);
        Matrix3::new(
            along * cos * cos,
            along * cos * sin,
            with * cos,
            along * cos * sin,
            along * sin * sin,
            with * sin,
            with * cos,
            with * sin,
            self.heading_rad2,
        )
    }

    /// The filter starts at a measurement of these variances: what it carries is the robot's pose.
    #[inline(always)]
    pub(crate) fn start(&mut self, variance: [f64; 2]) {
        self.carries = if self.matters(variance) { Carries::SinceStart } else { Carries::OfCounts };
    }

    /// A measurement of these variances comes: the robot's pose is carried from here on.
    #[inline(always)]
    pub(crate) fn enter(&mut self, state: &mut FilterState<'_>, variance: [f64; 2]) {
        if self.carries != Carries::OfCounts || !self.matters(variance) {
            return;
        }
        let covariance = state.covariance.matrix(0);
        *state.covariance = Covariance::of([&(covariance + self.in_room(state.pose.theta_rad))]);
        self.by.copy_from(state.by);
        self.covariance_by = *state.covariance_by;
        self.carries = Carries::SinceMeasurement { pose: *state.pose, covariance, by_noise: *state.pose_by_noise };
    }

    /// A wheel turns on: the counts' pose is carried from here on.
    #[inline(always)]
    pub(crate) fn leave(&mut self, state: &mut FilterState<'_>, noise_score: bool) {
        let carried = std::mem::replace(&mut self.carries, Carries::OfCounts);
        match carried {
            Carries::OfCounts => {}
            // Without any knowledge before, the counts' pose is the robot's and their rounding.
            Carries::SinceStart => {
                let covariance = state.covariance.matrix(0) + self.in_room(state.pose.theta_rad);
                *state.covariance = Covariance::of([&covariance]);
            }
            Carries::SinceMeasurement { pose, covariance, by_noise } => {
                let entered = covariance + self.in_room(pose.theta_rad);
                // Nothing was rounded, or nothing is known of the pose: no measurement says anything of it.
                let Some(inverse) = entered.try_inverse() else { return };
                let gain = covariance * inverse;
                let after = state.covariance.matrix(0);
                let learnt = entered - after;
                let moved = Vector3::new(
                    state.pose.x_m - pose.x_m,
                    state.pose.y_m - pose.y_m,
                    state.pose.theta_rad - pose.theta_rad,
                );
                if noise_score {
                    self.leave_noise(state, (&gain, &inverse), (&learnt, moved), &by_noise);
                }
                let step = gain * moved;
                *state.pose = Pose::new(pose.x_m + step.x, pose.y_m + step.y, pose.theta_rad + step.z);
                *state.covariance = Covariance::of([&(covariance - gain * learnt * gain.transpose())]);
                state.by.mix(&self.by, &gain);
            }
        }
    }

    /// The same step, differentiated by the logarithm of each variance: K′ = (I − K) P′ (P + Q)⁻¹.
    fn leave_noise(
        &self,
        state: &mut FilterState<'_>,
        (gain, inverse): (&Matrix3<f64>, &Matrix3<f64>),
        (learnt, moved): (&Matrix3<f64>, Vector3<f64>),
        by_noise: &[[f64; NOISES]; 3],
    ) {
        let mut covariances = [Matrix3::zeros(); NOISES];
        for (a, covariance) in covariances.iter_mut().enumerate() {
            let (before, after) = (self.covariance_by.matrix(a), state.covariance_by.matrix(a));
            let gain_by = (Matrix3::identity() - gain) * before * inverse;
            let half = gain_by * learnt * gain.transpose();
            *covariance = before - half - half.transpose() - gain * (before - after) * gain.transpose();
            let of = |by: &[[f64; NOISES]; 3]| Vector3::new(by[0][a], by[1][a], by[2][a]);
            let (from, to) = (of(by_noise), of(state.pose_by_noise));
            let by = from + gain_by * moved + gain * (to - from);
            for (row, by) in state.pose_by_noise.iter_mut().zip(by.iter()) {
                row[a] = *by;
            }
        }
        *state.covariance_by = Covariances::of(covariances.each_ref());
    }
}
