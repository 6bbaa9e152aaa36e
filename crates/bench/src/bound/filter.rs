//! The Kalman filter of one run, with the slopes of its predictions in the geometry.
//!
//! State: the error of the pose dead-reckoned from the recorded counts (true minus dead-reckoned, axes of the
//! start), and what moves it and lasts: the relative errors of both wheels' sensitivities and the
//! separation's error, each drawn anew a motion and constant in it, and the rounding u of each wheel's counts
//! at each phase of a tick at which it stands still. True travel is C(ΔN + u₁ − u₀) with u = frac(u₀ + F), u₀
//! uniform: Var u = 1/12 tick² and Cov(u_i, u_j) = 1/12 − f(1−f)/2, f = frac(F_j − F_i). So equal phases
//! share their rounding, a motion of whole ticks has none, and every number of rows has its exact second
//! moments. Slopes go through prediction and update as the state does: D ← ΦD + ∂f/∂β, D ← (I − KH)D.

use kinematics::{Increment, OdometryCovariance, Pose, Side, Wheels, sinc, sinc_derivative};
use nalgebra::{DMatrix, DVector, Matrix3, Matrix3xX, Matrix4, SymmetricEigen, Vector3};

use super::error::NoBound;
use super::innovation::LinearizedInnovation;
use super::model::Model;
use super::partial::{self, Before};
use super::timeline::{Event, Timeline, Travel};

/// Where the pose's error stands in the state: three entries.
const POSE: usize = 0;
/// Relative error of each wheel's sensitivity in this motion.
const SENSITIVITY: Wheels<usize> = Wheels { left: 3, right: 4 };
/// Error of the wheel separation in this motion, metres.
const SEPARATION: usize = 5;
/// Roundings of the counts, ticks: the left wheel's phases, then the right one's.
const ROUNDING: usize = 6;

/// An innovation has no error where its variance, in shares of the largest that each axis has had, is below
/// this: a thousand roundings of a double.
const NO_ERROR_SHARE: f64 = 1e-13;

/// A run on its way.
pub(super) struct Filter<'a> {
    model: &'a Model,
    /// Nothing has looked yet: the start is unknown.
    lost: bool,
    world_from_body: Pose,
    travel: Option<Travel>,
    covariance: DMatrix<f64>,
    /// Slope of the state in both diameters and the separation.
    slope: Matrix3xX<f64>,
    first_rounding: Wheels<usize>,
    largest_var: Vector3<f64>,
    innovations: Vec<LinearizedInnovation>,
    /// Where the states of each partial instrument begin, and what it measured last.
    partial: Vec<(usize, Option<Before>)>,
    /// Slope of the state in the gyroscope's scale.
    scale_slope: DVector<f64>,
    /// What partial measurements tell of the geometry and of that scale.
    partial_information: Matrix4<f64>,
}

/// What a run tells.
pub(super) struct RunInformation {
    /// What each measurement of a pose adds.
    pub(super) innovations: Vec<LinearizedInnovation>,
    /// What partial measurements tell of both diameters, the separation and a gyroscope's scale.
    pub(super) partial: Matrix4<f64>,
}

impl<'a> Filter<'a> {
    pub(super) fn run(model: &'a Model, timeline: &Timeline) -> Result<RunInformation, NoBound> {
        let first_rounding = Wheels { left: ROUNDING, right: ROUNDING + timeline.phases.left.len() };
        let mut size = first_rounding.right + timeline.phases.right.len();
        let mut partial = Vec::with_capacity(model.partial.len());
        for instrument in &model.partial {
            partial.push((size, None));
            size += instrument.states();
        }
        let mut covariance = DMatrix::zeros(size, size);
        for side in Side::BOTH {
            let phases = &timeline.phases[side];
            for (i, a) in phases.iter().enumerate() {
                for (j, b) in phases.iter().enumerate() {
                    let place = (first_rounding[side] + i, first_rounding[side] + j);
                    covariance[place] = rounding_covariance(b - a, model.counts_per_tick);
                }
            }
        }
        for (instrument, (first, _)) in model.partial.iter().zip(&partial) {
            for state in 0..instrument.states() {
                covariance[(first + state, first + state)] = instrument.first_variance(state);
            }
        }
        let mut filter = Self {
            model,
            // Where partial measurements alone say something, poses count from the run's start.
            lost: model.partial.is_empty(),
            world_from_body: Pose::IDENTITY,
            travel: None,
            covariance,
            slope: Matrix3xX::zeros(size),
            first_rounding,
            largest_var: Vector3::zeros(),
            innovations: Vec::new(),
            partial,
            scale_slope: DVector::zeros(size),
            partial_information: Matrix4::zeros(),
        };
        for event in &timeline.events {
            match *event {
                Event::Motion(travel) => filter.begin(travel),
                Event::Drive { share } => filter.drive(share),
                Event::Measurement { measurement, t_s } => match measurement.checked_sub(model.instruments.len()) {
                    None => filter.measure(measurement, t_s)?,
                    Some(partial) => filter.measure_part(partial, t_s)?,
                },
            }
        }
        Ok(RunInformation { innovations: filter.innovations, partial: filter.partial_information })
    }

    /// What is drawn once a motion is drawn anew.
    fn begin(&mut self, travel: Travel) {
        self.travel = Some(travel);
        let sensitivity_var = self.model.sensitivity_sigma * self.model.sensitivity_sigma;
        let drawn = [
            (SENSITIVITY.left, sensitivity_var),
            (SENSITIVITY.right, sensitivity_var),
            (SEPARATION, self.model.separation_var_m2),
        ];
        for (place, var) in drawn {
            self.covariance.row_mut(place).fill(0.0);
            self.covariance.column_mut(place).fill(0.0);
            self.covariance[(place, place)] = var;
            self.slope.column_mut(place).fill(0.0);
        }
    }

    /// Predicts a share of the motion: one arc.
    fn drive(&mut self, share: f64) {
        let Some(travel) = self.travel else { return };
        let separation_m = self.model.geometry.wheel_separation_m();
        let m_per_count = self.model.m_per_count();
        let driven_m = travel.counts.zip_with(m_per_count, |counts, m_per_count| share * counts * m_per_count);
        let arc = ArcSlope::at(self.world_from_body, driven_m, separation_m);

        // The error at the end in the state at the start, pose rows only: all else lasts.
        let mut transition = Matrix3xX::zeros(self.slope.ncols());
        transition.fixed_view_mut::<3, 3>(0, POSE).copy_from(&arc.carried);
        transition.column_mut(SEPARATION).copy_from(&arc.separation);
        let diameter_m = self.model.geometry.wheel_diameter_m();
        let mut driven_slope = Matrix3::zeros();
        driven_slope.column_mut(2).copy_from(&arc.separation);
        for (column, side) in Side::BOTH.into_iter().enumerate() {
            transition.column_mut(SENSITIVITY[side]).copy_from(&(arc.wheel[side] * driven_m[side]));
            driven_slope.column_mut(column).copy_from(&(arc.wheel[side] * (driven_m[side] / diameter_m[side])));
            if travel.before[side] != travel.after[side] {
                let by_tick = arc.wheel[side] * (share * m_per_count[side] * f64::from(self.model.counts_per_tick));
                let place = |phase: usize| self.first_rounding[side] + phase;
                transition.column_mut(place(travel.after[side])).copy_from(&by_tick);
                transition.column_mut(place(travel.before[side])).copy_from(&-by_tick);
            }
        }

        let mut walk = OdometryCovariance::default();
        walk.propagate(self.world_from_body, driven_m, separation_m, &self.model.wheel_noise);
        let cross = &transition * &self.covariance;
        let pose = &cross * transition.transpose() + walk.matrix();
        self.covariance.rows_mut(POSE, 3).copy_from(&cross);
        self.covariance.columns_mut(POSE, 3).copy_from(&cross.transpose());
        self.covariance.fixed_view_mut::<3, 3>(POSE, POSE).copy_from(&(0.5 * (pose + pose.transpose())));
        // Row k of the state's slope is column k here.
        let pose_slope = &transition * self.slope.transpose() + driven_slope;
        self.slope.columns_mut(POSE, 3).copy_from(&pose_slope.transpose());
        let of_scale = &transition * &self.scale_slope;
        self.scale_slope.rows_mut(POSE, 3).copy_from(&of_scale);
        self.world_from_body = self.world_from_body * Increment::from_travel(driven_m, separation_m).arc();
    }

    fn measure(&mut self, measurement: usize, t_s: f64) -> Result<(), NoBound> {
        let measured = self.model.instruments[measurement].covariance(self.world_from_body);
        if std::mem::take(&mut self.lost) {
            self.covariance.fixed_view_mut::<3, 3>(POSE, POSE).copy_from(&measured);
            self.largest_var = measured.diagonal();
            return Ok(());
        }
        let covariance = self.covariance.fixed_view::<3, 3>(POSE, POSE) + measured;
        let precision = self.invert(&covariance).ok_or(NoBound::NoError { t_s })?;
        let slope: Matrix3<f64> = self.slope.fixed_columns::<3>(POSE).transpose();
        self.innovations.push(LinearizedInnovation { t_s, slope, covariance, precision });

        let by_pose = self.covariance.columns(POSE, 3).into_owned();
        let gain = &by_pose * precision;
        self.covariance -= &gain * by_pose.transpose();
        // Rounding would let the two halves drift apart over thousands of measurements.
        self.covariance = 0.5 * (&self.covariance + self.covariance.transpose());
        self.slope -= slope.transpose() * gain.transpose();
        Ok(())
    }

    /// Takes what a partial instrument measures at an instant.
    fn measure_part(&mut self, number: usize, t_s: f64) -> Result<(), NoBound> {
        let (first, before) = self.partial[number];
        let reading = self.model.partial[number].reading(t_s, self.world_from_body, before);
        if reading.walk > 0.0 {
            self.covariance[(first, first)] += reading.walk;
        }
        let states = self.model.partial[number].states();
        for scalar in &reading.scalars {
            let mut by_state = DVector::zeros(self.covariance.nrows());
            by_state.rows_mut(POSE, 3).copy_from(&scalar.by_pose);
            (0..states).for_each(|state| by_state[first + state] = scalar.by_states[state]);
            let by_covariance = &self.covariance * &by_state;
            let variance = by_state.dot(&by_covariance) + scalar.variance;
            if variance <= 0.0 {
                return Err(NoBound::NoError { t_s });
            }
            let geometry: Vector3<f64> = &self.slope * &by_state;
            let of_scale = self.scale_slope.dot(&by_state) + scalar.by_scale;
            self.partial_information += partial::information(geometry.push(of_scale), variance);
            let gain = &by_covariance / variance;
            self.covariance -= &gain * by_covariance.transpose();
            self.slope -= geometry * gain.transpose();
            self.scale_slope -= of_scale * &gain;
        }
        for (state, part) in reading.copies {
            self.copy(POSE + part, first + state);
        }
        self.partial[number].1 = Some(Before { t_s, world_from_body: self.world_from_body });
        Ok(())
    }

    /// A state becomes a copy of another one.
    fn copy(&mut self, from: usize, to: usize) {
        let row = self.covariance.row(from).into_owned();
        self.covariance.set_row(to, &row);
        let column = self.covariance.column(from).into_owned();
        self.covariance.set_column(to, &column);
        let slope = self.slope.column(from).into_owned();
        self.slope.set_column(to, &slope);
        self.scale_slope[to] = self.scale_slope[from];
    }

    /// The inverse of an innovation's covariance, or `None` where some direction has no error.
    fn invert(&mut self, covariance: &Matrix3<f64>) -> Option<Matrix3<f64>> {
        self.largest_var = self.largest_var.sup(&covariance.diagonal());
        if self.largest_var.min() <= 0.0 {
            return None;
        }
        let unit = Matrix3::from_diagonal(&self.largest_var.map(|var| 1.0 / var.sqrt()));
        let eigen = SymmetricEigen::new(unit * covariance * unit);
        if eigen.eigenvalues.min() < NO_ERROR_SHARE {
            return None;
        }
        let inverse = eigen.eigenvalues.map(|eigenvalue| 1.0 / eigenvalue);
        Some(unit * eigen.eigenvectors * Matrix3::from_diagonal(&inverse) * eigen.eigenvectors.transpose() * unit)
    }
}

/// Cov(u_i, u_j), ticks², of two roundings between which the wheel turns `counts`: 1/12 − f(1−f)/2 with f the
/// fraction of a tick.
fn rounding_covariance(counts: i64, counts_per_tick: u32) -> f64 {
    let fraction = counts.rem_euclid(i64::from(counts_per_tick)) as f64 / f64::from(counts_per_tick);
    1.0 / 12.0 - 0.5 * fraction * (1.0 - fraction)
}

/// Slopes of the pose after an exact arc: s·sinc(θ/2) along θ₀ + θ/2 with s = (s_R + s_L)/2 and θ = (s_R −
/// s_L)/B.
struct ArcSlope {
    /// In the pose before it.
    carried: Matrix3<f64>,
    /// In each wheel's travel.
    wheel: Wheels<Vector3<f64>>,
    /// In the separation.
    separation: Vector3<f64>,
}

impl ArcSlope {
    fn at(world_from_body: Pose, travel_m: Wheels<f64>, separation_m: f64) -> Self {
        let increment = Increment::from_travel(travel_m, separation_m);
        let half_rad = 0.5 * increment.turn_rad;
        let (sin, cos) = (world_from_body.theta_rad + half_rad).sin_cos();
        let (chord, chord_slope) = (sinc(half_rad), sinc_derivative(half_rad));
        let by_distance = Vector3::new(chord * cos, chord * sin, 0.0);
        let half_m = 0.5 * increment.distance_m;
        let by_turn =
            Vector3::new(half_m * (chord_slope * cos - chord * sin), half_m * (chord_slope * sin + chord * cos), 1.0);
        let mut carried = Matrix3::identity();
        carried[(0, 2)] = -increment.distance_m * chord * sin;
        carried[(1, 2)] = increment.distance_m * chord * cos;
        Self {
            carried,
            wheel: Wheels {
                left: 0.5 * by_distance - by_turn / separation_m,
                right: 0.5 * by_distance + by_turn / separation_m,
            },
            separation: by_turn * (-increment.turn_rad / separation_m),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_roundings_vary_together_as_uniform_phases_do() {
        // The definition, over phases so fine that the sum is the integral but for 1/n².
        let phases = 8000_i32;
        for (counts, counts_per_tick) in [(0, 80), (20, 80), (-20, 80), (32, 80), (40, 80), (80, 80), (7, 1)] {
            let fraction = f64::from(counts) / f64::from(counts_per_tick);
            let product = |phase: i32| {
                let u = (f64::from(phase) + 0.5) / f64::from(phases);
                (u - 0.5) * ((u + fraction).rem_euclid(1.0) - 0.5)
            };
            let mean = (0..phases).map(product).sum::<f64>() / f64::from(phases);
            let stated = rounding_covariance(i64::from(counts), counts_per_tick);
            assert!((stated - mean).abs() < 1e-7, "{counts} of {counts_per_tick}: {stated} {mean}");
        }
    }
}
