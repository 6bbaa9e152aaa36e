//! The filter of a run's partial measurements.
//!
//! Its state is the pose that the counts say, copies of it at the places that measurements are of (Mourikis &
//! Roumeliotis 2007 call it cloning), the gyroscope's bias, and each wall's direction and place. A copy holds
//! the rounding of the counts at its place. Every measurement is a scalar function of copies, bias and walls:
//! with its derivative g the update is that of [`crate::filter`], P and its derivatives by ln(variance)
//! included.

use kinematics::{Pose, sin_cos, wrap_to_pi};
use model_term::ModelTerm;
use nalgebra::{DMatrix, DVector, Vector3};

use crate::model::{Column, Model};
use crate::noise::{Noise, NoiseComponent};
use crate::noise_score::NoiseScore;
use crate::normal_equations::NormalEquations;
use crate::partial_records::{Observation, PartialSegment, Place, Quantity};
use crate::products::{Products, Sums};
use crate::propagation::{Moved, Propagator};
use crate::rounding::PoseVariance;
use crate::settings::{GYRO_BIAS_SIGMA_RADPS, MIN_DISTANCE_M, WALL_DIRECTION_SIGMA_RAD, WALL_OFFSET_SIGMA_M};
use crate::thinning::PropagationInterval;

/// Variances that the wheels' motion depends on.
const OF_MOTION: [NoiseComponent; 2] = [NoiseComponent::Wheel, NoiseComponent::Turn];

/// Where the bias stands in the state, after the pose.
const fn bias_at() -> usize {
    3
}

/// Where a wall stands, or what comes after so many walls.
const fn wall_at(wall: usize) -> usize {
    bias_at() + 1 + 2 * wall
}

struct PartialFilter<'f> {
    segment: &'f PartialSegment<'f>,
    state: DVector<f64>,
    covariance: DMatrix<f64>,
    /// ∂state/∂column.
    by: DMatrix<f64>,
    /// Derivatives of covariance and state by the logarithms of the wheels' and the turns' variance.
    covariance_by: [DMatrix<f64>; 2],
    state_by: [DVector<f64>; 2],
    /// Which place each slot holds.
    slots: Vec<Option<usize>>,
    noise_score: NoiseScore,
}

/// Filters the partial measurements of a segment; `propagations` lead to each place after the first.
pub(crate) fn filter_partial(
    segment: &PartialSegment<'_>,
    propagations: &[PropagationInterval],
    model: &Model,
    noise: &Noise,
    products: &Products,
    terms: &mut [Box<dyn ModelTerm>],
) -> (NormalEquations, NoiseScore) {
    let columns = Column::BASE.len() + terms.iter().map(|term| term.parameters().len()).sum::<usize>();
    let mut sums = Sums::new(columns, products);
    let mut filter = PartialFilter::new(segment, columns);
    let mut propagator = Propagator::new(&segment.segment, model, terms);
    propagator.restart();
    let mut observations = segment.observations.iter().enumerate().peekable();
    for (number, place) in segment.places.iter().enumerate() {
        if let Some(propagation) = number.checked_sub(1).and_then(|before| propagations.get(before)) {
            let moved = propagator.moved(filter.pose(), number - 1, propagation);
            let by_terms: Vec<Vector3<f64>> = (Column::BASE.len()..columns)
                .map(|k| propagator.propagation_by_terms.get(k - Column::BASE.len()))
                .collect();
            filter.advance(&moved, &by_terms, propagation, noise);
        }
        filter.remember(number, place, model);
        while let Some((at, of)) = observations.next_if(|(_, of)| of.to == number) {
            filter.update(of, model, columns, &mut sums);
            filter.forget(at);
        }
    }
    (sums.eliminated(segment.segment.run, columns).0, filter.noise_score)
}

impl<'f> PartialFilter<'f> {
    fn new(segment: &'f PartialSegment<'f>, columns: usize) -> Self {
        let slots = most_at_once(segment);
        let first_slot = wall_at(segment.walls.len());
        let size = first_slot + 3 * slots;
        let (mut state, mut covariance) = (DVector::zeros(size), DMatrix::zeros(size, size));
        covariance[(bias_at(), bias_at())] = GYRO_BIAS_SIGMA_RADPS.powi(2);
        for (wall, of) in segment.walls.iter().enumerate() {
            let at = wall_at(wall);
            (state[at], state[at + 1]) = (of.direction_rad, of.offset_m);
            covariance[(at, at)] = WALL_DIRECTION_SIGMA_RAD.powi(2);
            covariance[(at + 1, at + 1)] = WALL_OFFSET_SIGMA_M.powi(2);
        }
        Self {
            segment,
            state,
            covariance,
            by: DMatrix::zeros(size, columns),
            covariance_by: [DMatrix::zeros(size, size), DMatrix::zeros(size, size)],
            state_by: [DVector::zeros(size), DVector::zeros(size)],
            slots: vec![None; slots],
            noise_score: NoiseScore::zero(),
        }
    }

    fn pose(&self) -> Pose {
        Pose::new(self.state[0], self.state[1], self.state[2])
    }

    fn slot_at(&self, slot: usize) -> usize {
        wall_at(self.segment.walls.len()) + 3 * slot
    }

    /// Where the copy of a place stands in the state.
    fn at_place(&self, place: usize) -> usize {
        self.slot_at(self.slots.iter().position(|held| *held == Some(place)).unwrap_or_default())
    }

    /// Moves the counts' pose on.
    fn advance(&mut self, moved: &Moved, by_terms: &[Vector3<f64>], propagation: &PropagationInterval, noise: &Noise) {
        let turn = sin_cos(self.state[2]);
        let (sin, cos) = turn;
        let room = |v: Vector3<f64>| Vector3::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y, v.z);
        let step = room(Vector3::new(moved.motion.x_m, moved.motion.y_m, moved.motion.theta_rad));
        for at in 0..3 {
            self.state[at] += step[at];
        }
        let carry_rows = |matrix: &mut DMatrix<f64>| {
            for column in 0..matrix.ncols() {
                let theta = matrix[(2, column)];
                matrix[(0, column)] -= step.y * theta;
                matrix[(1, column)] += step.x * theta;
            }
        };
        let carry = |matrix: &mut DMatrix<f64>| {
            carry_rows(matrix);
            for row in 0..matrix.nrows() {
                let theta = matrix[(row, 2)];
                matrix[(row, 0)] -= step.y * theta;
                matrix[(row, 1)] += step.x * theta;
            }
        };
        carry(&mut self.covariance);
        self.covariance_by.iter_mut().for_each(carry);
        for by in &mut self.state_by {
            let theta = by[2];
            by[0] -= step.y * theta;
            by[1] += step.x * theta;
        }
        carry_rows(&mut self.by);
        let motion = propagation.noise.turned(turn);
        for (k, component) in OF_MOTION.into_iter().enumerate() {
            let added = motion.matrix(component as usize) * noise.variance[component as usize];
            for (row, column) in (0..9).map(|at| (at / 3, at % 3)) {
                self.covariance[(row, column)] += added[(row, column)];
                self.covariance_by[k][(row, column)] += added[(row, column)];
            }
        }
        let of_terms = by_terms.iter().enumerate().map(|(k, by)| (Column::BASE.len() + k, *by));
        for (column, by) in moved.by_geometry.iter().copied().enumerate().chain(of_terms) {
            let by = room(by);
            (0..3).for_each(|row| self.by[(row, column)] += by[row]);
        }
    }

    /// Copies the pose at a place, with the rounding of the counts there.
    fn remember(&mut self, number: usize, place: &Place, model: &Model) {
        let Some(slot) = self.slots.iter().position(Option::is_none) else { return };
        self.slots[slot] = Some(number);
        let at = self.slot_at(slot);
        let copy = |matrix: &mut DMatrix<f64>| {
            for k in 0..3 {
                for column in 0..matrix.ncols() {
                    matrix[(at + k, column)] = matrix[(k, column)];
                }
            }
            for k in 0..3 {
                for row in 0..matrix.nrows() {
                    matrix[(row, at + k)] = matrix[(row, k)];
                }
            }
        };
        copy(&mut self.covariance);
        self.covariance_by.iter_mut().for_each(copy);
        for k in 0..3 {
            self.state[at + k] = self.state[k];
            self.state_by.iter_mut().for_each(|by| by[at + k] = by[k]);
            for column in 0..self.by.ncols() {
                self.by[(at + k, column)] = self.by[(k, column)];
            }
        }
        let variance_rad2 = self.segment.segment.quantum_rad.map(|rad| rad * rad / 12.0);
        let variance_rad2 = variance_rad2.zip_with(place.interpolated_rad2, |rounded, between| rounded + between);
        let rounding = PoseVariance::of(variance_rad2, model).in_room(self.state[2]);
        for (row, column) in (0..9).map(|k| (k / 3, k % 3)) {
            self.covariance[(at + row, at + column)] += rounding[(row, column)];
        }
    }

    /// Frees the slots of places that no observation after this one needs.
    fn forget(&mut self, observation: usize) {
        for slot in 0..self.slots.len() {
            if self.slots[slot].is_some_and(|place| self.segment.places[place].last_use <= observation) {
                self.slots[slot] = None;
            }
        }
    }

    /// What an observation should be, what it is off by, and its derivatives by the state.
    fn predicted(&self, of: &Observation, model: &Model) -> (f64, DVector<f64>) {
        let mut by = DVector::zeros(self.state.len());
        let (from, to) = (self.at_place(of.from), self.at_place(of.to));
        let at = |place: usize, k: usize| self.state[place + k];
        let (dx_m, dy_m) = (at(to, 0) - at(from, 0), at(to, 1) - at(from, 1));
        let off = match of.quantity {
            Quantity::Displacement(2) => {
                (by[to + 2], by[from + 2]) = (1.0, -1.0);
                wrap_to_pi(of.value - (at(to, 2) - at(from, 2)))
            }
            Quantity::Displacement(component) => {
                let (sin, cos) = sin_cos(at(from, 2));
                let [ahead, left] = [[cos, sin], [-sin, cos]];
                let (axis, by_heading) = if component == 0 { (ahead, left) } else { (left, [-cos, -sin]) };
                (by[to], by[to + 1]) = (axis[0], axis[1]);
                (by[from], by[from + 1]) = (-axis[0], -axis[1]);
                by[from + 2] = by_heading[0] * dx_m + by_heading[1] * dy_m;
                of.value - (axis[0] * dx_m + axis[1] * dy_m)
            }
            Quantity::Distance => {
                let distance_m = dx_m.hypot(dy_m);
                if distance_m > MIN_DISTANCE_M {
                    let axis = [dx_m / distance_m, dy_m / distance_m];
                    (by[to], by[to + 1]) = (axis[0], axis[1]);
                    (by[from], by[from + 1]) = (-axis[0], -axis[1]);
                }
                of.value - distance_m
            }
            Quantity::WallHeading(wall) => {
                let wall = wall_at(wall);
                (by[to + 2], by[wall]) = (1.0, -1.0);
                wrap_to_pi(of.value - (at(to, 2) - self.state[wall]))
            }
            Quantity::WallDistance(wall) => {
                let wall = wall_at(wall);
                let (sin, cos) = sin_cos(self.state[wall]);
                // n = (−sin, cos); offset − n·p.
                (by[to], by[to + 1]) = (sin, -cos);
                (by[wall], by[wall + 1]) = (cos * at(to, 0) + sin * at(to, 1), 1.0);
                of.value - (self.state[wall + 1] + sin * at(to, 0) - cos * at(to, 1))
            }
            Quantity::GyroTurn { dt_s } => {
                let scale = 1.0 + model.gyro_scale;
                // In one place both are the same: the robot stands.
                by[to + 2] += scale;
                by[from + 2] -= scale;
                by[bias_at()] = dt_s;
                of.value - scale * (at(to, 2) - at(from, 2)) - self.state[bias_at()] * dt_s
            }
        };
        (off, by)
    }

    fn update(&mut self, of: &Observation, model: &Model, columns: usize, sums: &mut Sums<'_>) {
        if let Quantity::GyroTurn { dt_s } = of.quantity {
            self.covariance[(bias_at(), bias_at())] += self.segment.bias_walk * dt_s;
        }
        let (v, row) = self.predicted(of, model);
        let ph = &self.covariance * &row;
        let s = row.dot(&ph) + of.variance;
        let gain = &ph / s;
        // ∂v/∂column, and a place for the free heading that these segments do not have.
        let mut j: Vec<f64> = (-(row.transpose() * &self.by)).iter().copied().collect();
        if let Quantity::GyroTurn { .. } = of.quantity {
            let turn_rad = self.state[self.at_place(of.to) + 2] - self.state[self.at_place(of.from) + 2];
            j[Column::GyroScale.index()] -= turn_rad;
        }
        j.resize(columns + 1, 0.0);
        sums.add(&j, v, s);
        self.score_noise(&row, &gain, v, s);
        self.state += &gain * v;
        self.covariance -= &gain * ph.transpose();
        let j = nalgebra::RowDVector::from_row_slice(&j[..columns]);
        self.by += &gain * j;
    }

    /// The recursions differentiated, as in [`crate::filter`].
    fn score_noise(&mut self, row: &DVector<f64>, gain: &DVector<f64>, v: f64, s: f64) {
        let (mut s_by, mut v_by) = ([0.0; 2], [0.0; 2]);
        for a in 0..OF_MOTION.len() {
            let ph_by = &self.covariance_by[a] * row;
            s_by[a] = row.dot(&ph_by);
            v_by[a] = -row.dot(&self.state_by[a]);
            self.state_by[a] += (&ph_by - gain * s_by[a]) * (v / s) + gain * v_by[a];
            let half = &ph_by - gain * (0.5 * s_by[a]);
            let change = gain * half.transpose();
            self.covariance_by[a] -= &change + change.transpose();
        }
        for (a, of) in OF_MOTION.into_iter().enumerate() {
            let (s_of, at) = (s_by[a] / s, of as usize);
            self.noise_score.gradient[at] += 0.5 * s_of * (1.0 - v * v / s) + v_by[a] * v / s;
            for (b, other) in OF_MOTION.into_iter().enumerate() {
                self.noise_score.information[(at, other as usize)] += 0.5 * s_of * s_by[b] / s + v_by[a] * v_by[b] / s;
            }
        }
    }
}

/// How many places are needed at once.
fn most_at_once(segment: &PartialSegment<'_>) -> usize {
    let mut observations = segment.observations.iter().enumerate().peekable();
    let (mut needed, mut most) = (Vec::new(), 1);
    for (number, place) in segment.places.iter().enumerate() {
        needed.push(place.last_use);
        most = most.max(needed.len());
        while let Some((at, _)) = observations.next_if(|(_, of)| of.to == number) {
            needed.retain(|last_use| *last_use > at);
        }
    }
    most
}
