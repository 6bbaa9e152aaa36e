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
//!
//! Between two rows the wheels' turns are off too, by what nobody recorded of the motion there: by nothing at
//! both rows, and most in the middle. That error is carried in the same way, to the next measurement or the
//! row's end, whichever comes first. Measurements of one row are taken to have independent ones.

use kinematics::{Pose, Rotation, Wheels};
use nalgebra::{Matrix3, Vector3};

use crate::covariances::{Covariance, Covariances};
use crate::derivatives::Derivatives;
use crate::filter_state::{FilterState, Step};
use crate::model::Model;
use crate::noise::NOISES;
use crate::quantum::variance_of_rounding;
use crate::settings::COMMON;

/// Which pose the filter carries.
#[derive(Clone, Copy)]
enum Carries {
    /// That of the counts.
    OfCounts,
    /// The robot's, since a start: nothing is known of the counts' rounding.
    SinceStart { own: OwnVariance },
    /// The robot's, since a measurement after the counts had changed. `heading` is the sine and cosine of
    /// that of the counts' pose, `None` after it has moved.
    SinceMeasurement {
        own: OwnVariance,
        pose: Pose,
        covariance: Covariance,
        heading: Option<Rotation>,
        by_noise: [[f64; NOISES]; 3],
    },
}

/// What the robot's pose is off the counts' by.
#[derive(Clone, Copy)]
struct OwnVariance {
    pose: PoseVariance,
    /// Most of it is motion within the row, which is another at each instant.
    is_of_instant: bool,
}

/// What both wheels' turns are off by makes of a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PoseVariance {
    /// Along the heading, m².
    pub(crate) along_m2: f64,
    /// Of the heading, rad².
    pub(crate) heading_rad2: f64,
    /// Of both, m rad.
    covariance_m_rad: f64,
}

impl PoseVariance {
    /// Of variances of the wheels' turns, rad².
    pub(crate) fn of(variance_rad2: Wheels<f64>, model: &Model) -> Self {
        let variance_m2 = variance_rad2.zip_with(model.m_per_rad, |rad2, m_per_rad| rad2 * m_per_rad * m_per_rad);
        let (Wheels { left, right }, separation_m) = (variance_m2, model.separation_m);
        Self {
            along_m2: 0.25 * (left + right),
            heading_rad2: (left + right) / (separation_m * separation_m),
            covariance_m_rad: 0.5 * (right - left) / separation_m,
        }
    }

    /// Of counts that stand for these angles.
    pub(crate) fn of_rounding(quantum_rad: Wheels<f64>, model: &Model) -> Self {
        Self::of(quantum_rad.map(variance_of_rounding), model)
    }

    /// Does it matter beside measurements of these variances of position and heading?
    fn matters(&self, [position_m2, heading_rad2]: [f64; 2]) -> bool {
        self.along_m2 > COMMON.min_rounding_variance_ratio * position_m2
            || self.heading_rad2 > COMMON.min_rounding_variance_ratio * heading_rad2
    }

    /// Q in the room, for a heading.
    #[inline(always)]
    pub(crate) fn in_room(&self, theta_rad: f64) -> Matrix3<f64> {
        self.turned(Rotation::by(theta_rad))
    }

    /// The same, by the heading's sine and cosine.
    #[inline(always)]
    fn turned(&self, Rotation { sin, cos }: Rotation) -> Matrix3<f64> {
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
}

/// Rounding in the filter of one segment.
pub(crate) struct Rounding {
    /// Variances of both wheels' turns at a row, rad².
    variance_rad2: Wheels<f64>,
    carries: Carries,
    /// Derivatives of the counts' pose while the robot's is carried.
    by: Derivatives,
    covariance_by: Covariances<NOISES>,
}

impl Rounding {
    /// Of counts that stand for these angles. `columns` are those of the derivatives.
    pub(crate) fn new(quantum_rad: Wheels<f64>, columns: usize) -> Self {
        Self {
            variance_rad2: quantum_rad.map(variance_of_rounding),
            carries: Carries::OfCounts,
            by: Derivatives::zeros(columns),
            covariance_by: Covariances::ZERO,
        }
    }

    /// What a pose is off by where the motion within a row adds these variances of the wheels' turns.
    fn at(&self, interpolated_rad2: Wheels<f64>, model: &Model) -> OwnVariance {
        let rounded_rad2 = self.variance_rad2;
        OwnVariance {
            pose: PoseVariance::of(rounded_rad2.zip_with(interpolated_rad2, |a, b| a + b), model),
            is_of_instant: interpolated_rad2.left + interpolated_rad2.right > rounded_rad2.left + rounded_rad2.right,
        }
    }

    /// The filter starts at a measurement of these variances: what it carries is the robot's pose.
    #[inline(always)]
    pub(crate) fn start(&mut self, variance: [f64; 2], interpolated_rad2: Wheels<f64>, model: &Model) {
        let own = self.at(interpolated_rad2, model);
        self.carries = if own.pose.matters(variance) { Carries::SinceStart { own } } else { Carries::OfCounts };
    }

    /// A measurement of these variances comes, at a heading of this sine and cosine: the robot's pose is
    /// carried from here on.
    #[inline(always)]
    pub(crate) fn enter(
        &mut self,
        state: &mut FilterState<'_>,
        variance: [f64; 2],
        interpolated_rad2: Wheels<f64>,
        model: &Model,
        heading: Rotation,
    ) {
        if !matches!(self.carries, Carries::OfCounts) {
            return;
        }
        let own = self.at(interpolated_rad2, model);
        if !own.pose.matters(variance) {
            return;
        }
        let covariance = *state.covariance;
        *state.covariance = Covariance::of([&(covariance.matrix(0) + own.pose.turned(heading))]);
        self.by.copy_from(state.by);
        self.covariance_by = *state.covariance_by;
        self.carries = Carries::SinceMeasurement {
            own,
            pose: *state.pose,
            covariance,
            heading: Some(heading),
            by_noise: *state.pose_by_noise,
        };
    }

    /// The robot moves within a row: what the counts say of it moves as well.
    #[inline(always)]
    pub(crate) fn advance(&mut self, step: &Step<'_>) {
        if let Carries::SinceMeasurement { pose, covariance, heading, by_noise, .. } = &mut self.carries {
            *heading = None;
            let (by, covariance_by) = (&mut self.by, &mut self.covariance_by);
            FilterState { pose, covariance, by, covariance_by, pose_by_noise: by_noise }.advance(step);
        }
    }

    /// The robot has gone on within a row: where that changes what nobody recorded of its motion there, the
    /// counts' pose is carried from here on.
    #[inline(always)]
    pub(crate) fn pass(&mut self, state: &mut FilterState<'_>, noise_score: bool) {
        let own = match self.carries {
            Carries::OfCounts => return,
            Carries::SinceStart { own } | Carries::SinceMeasurement { own, .. } => own,
        };
        if own.is_of_instant {
            self.leave(state, noise_score);
        }
    }

    /// A wheel turns on: the counts' pose is carried from here on.
    #[inline(always)]
    pub(crate) fn leave(&mut self, state: &mut FilterState<'_>, noise_score: bool) {
        let carried = std::mem::replace(&mut self.carries, Carries::OfCounts);
        match carried {
            Carries::OfCounts => {}
            // Without any knowledge before, the counts' pose is the robot's and their rounding.
            Carries::SinceStart { own } => {
                let covariance = state.covariance.matrix(0) + own.pose.in_room(state.pose.theta_rad);
                *state.covariance = Covariance::of([&covariance]);
            }
            Carries::SinceMeasurement { own, pose, covariance, heading, by_noise } => {
                let covariance = covariance.matrix(0);
                let heading = heading.unwrap_or_else(|| Rotation::by(pose.theta_rad));
                let entered = covariance + own.pose.turned(heading);
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
                    self.leave_noise(state, &gain, &inverse, &learnt, moved, &by_noise);
                }
                let step = gain * moved;
                *state.pose = Pose::new(pose.x_m + step.x, pose.y_m + step.y, pose.theta_rad + step.z);
                *state.covariance = Covariance::of([&(covariance - gain * learnt * gain.transpose())]);
                state.by.mix(&self.by, &gain);
            }
        }
    }

    /// The same step, differentiated by the logarithm of each variance: K′ = (I − K) P′ (P + Q)⁻¹, and with
    /// A = I − K, L = P + Q − P_x, M = (P + Q)⁻¹ L Kᵀ
    ///
    /// P⁺′ = P′ − A P′ M − (A P′ M)ᵀ − K (P′ − P_x′) Kᵀ.
    #[inline(always)]
    fn leave_noise(
        &self,
        state: &mut FilterState<'_>,
        gain: &Matrix3<f64>,
        inverse: &Matrix3<f64>,
        learnt: &Matrix3<f64>,
        moved: Vector3<f64>,
        by_noise: &[[f64; NOISES]; 3],
    ) {
        let left = Matrix3::identity() - gain;
        let by_gain = self.covariance_by.along(&(inverse * moved));
        let after = *state.pose_by_noise;
        for row in 0..3 {
            for a in 0..NOISES {
                let mut by = by_noise[row][a];
                for k in 0..3 {
                    by += left[(row, k)] * by_gain[k][a] + gain[(row, k)] * (after[k][a] - by_noise[k][a]);
                }
                state.pose_by_noise[row][a] = by;
            }
        }
        let right = inverse * learnt * gain.transpose();
        *state.covariance_by = self.covariance_by.smoothed(state.covariance_by, gain, &left, &right);
    }
}
