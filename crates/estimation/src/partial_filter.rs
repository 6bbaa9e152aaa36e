//! The filter of a run's partial measurements.
//!
//! Its state is the pose that the counts say, copies of it at the places that measurements are of (Mourikis &
//! Roumeliotis 2007 call it cloning), the gyroscope's bias, each wall's direction and place, and the place of
//! the lidar that sees them. A copy holds the rounding of the counts at its place. Every measurement is a
//! scalar function of copies, bias, walls and lidar: with its derivative g the update is that of
//! [`crate::filter`], P and its derivatives by ln(variance) included.
//!
//! Beside poses the filter starts in their room with hardly any knowledge of where, and takes them as whole
//! measurements. What the partial measurements say given the poses is then its sums with both less its sums
//! with the poses alone: ln p(partial | poses) = ln p(partial, poses) − ln p(poses). The poses themselves
//! stay with [`crate::filter`], and a measurement of no weight changes nothing.

use kinematics::{Pose, Rotation, sin_cos, wrap_to_pi};
use model_term::ModelTerm;
use nalgebra::{DMatrix, DVector, Vector3};

use crate::model::{Column, Model};
use crate::noise::{NOISES, Noise};
use crate::noise_score::NoiseScore;
use crate::normal_equations::NormalEquations;
use crate::partial_noise::{NoiseDerivatives, OF_MOTION};
use crate::partial_observation::{Observation, Place, Quantity};
use crate::partial_poses::{PartialPass, PoseUpdate, StatePose, Taking, instrument_by_terms};
use crate::partial_records::PartialSegment;
use crate::pass_options::OutlierGate;
use crate::products::Sums;
use crate::propagation::{Moved, Propagator};
use crate::quantum::variance_of_rounding;
use crate::rounding::PoseVariance;
use crate::settings::{COMMON, PARTIAL, START_HEADING_SIGMA_RAD, START_POSITION_SIGMA_M};
use crate::thinning::PropagationInterval;
use crate::wall_start::{SeenByLidar, WallDistance, WallStart};

/// Where the bias stands in the state, after the pose.
const fn bias_at() -> usize {
    3
}

/// Where a wall stands, or what comes after so many walls.
const fn wall_at(wall: usize) -> usize {
    bias_at() + 1 + 2 * wall
}

/// Where the first copy stands, behind the walls and the lidar that sees them.
fn first_slot(walls: &WallStart) -> usize {
    wall_at(walls.walls.len()) + if walls.lidar.is_some() { 3 } else { 0 }
}

/// Variances of the pose at the start of a segment beside poses.
const START_VARIANCE: [f64; 3] = [
    START_POSITION_SIGMA_M * START_POSITION_SIGMA_M,
    START_POSITION_SIGMA_M * START_POSITION_SIGMA_M,
    START_HEADING_SIGMA_RAD * START_HEADING_SIGMA_RAD,
];

struct PartialFilter<'f> {
    segment: &'f PartialSegment<'f>,
    /// For each place the last observation that is taken and needs it.
    last_use: Vec<Option<usize>>,
    state: DVector<f64>,
    covariance: DMatrix<f64>,
    /// ∂state/∂column.
    by: DMatrix<f64>,
    noise_by: NoiseDerivatives,
    /// Heading at which the filter began.
    origin_rad: f64,
    /// Which place each slot holds.
    slots: Vec<Option<usize>>,
    /// Outliers by their number.
    rejected: Vec<usize>,
    /// Readings of walls that were rejected in a row, headings and distances.
    wall_outliers_in_a_row: [u32; 2],
}

/// What a segment's partial measurements say, and which of them are outliers.
pub(crate) struct Filtered {
    pub(crate) equations: NormalEquations,
    pub(crate) score: NoiseScore,
    pub(crate) outliers: Vec<usize>,
}

/// What the partial measurements of a segment say, given its poses; `propagations` lead to each place after
/// the first.
pub(crate) fn filter_partial(
    segment: &PartialSegment<'_>,
    propagations: &[PropagationInterval],
    pass: &PartialPass<'_>,
    terms: &mut [Box<dyn ModelTerm>],
) -> Filtered {
    let mut filtered = |taking: Taking| {
        let observations: Vec<bool> = segment.observations.iter().map(|of| pass.poses.takes(of, taking)).collect();
        filter_taken(segment, propagations, &observations, pass, terms)
    };
    let mut all = filtered(Taking::All);
    if segment.has_poses() {
        let of_poses = filtered(Taking::PosesAlone);
        all.equations.add(&of_poses.equations, -1.0);
        all.score.add(&of_poses.score, -1.0);
    }
    all
}

/// Filters the observations of a segment that are taken.
pub(crate) fn filter_taken(
    segment: &PartialSegment<'_>,
    propagations: &[PropagationInterval],
    taken: &[bool],
    pass: &PartialPass<'_>,
    terms: &mut [Box<dyn ModelTerm>],
) -> Filtered {
    let PartialPass { poses, model, noise, .. } = *pass;
    let columns = Column::BASE.len() + terms.iter().map(|term| term.parameters().len()).sum::<usize>();
    let mut sums = Sums::new(pass.products);
    let mut filter = PartialFilter::new(segment, taken, poses.start(segment, model), columns);
    let mut propagator = Propagator::new(&segment.segment, model, terms);
    propagator.restart();
    let mut observations = segment.observations.iter().zip(taken).enumerate().peekable();
    let mut rejected_in_a_row = 0;
    for (number, place) in segment.places.iter().enumerate() {
        if let Some(propagation) = number.checked_sub(1).and_then(|before| propagations.get(before)) {
            let moved = propagator.moved(filter.pose(), number - 1, propagation);
            let by_terms: Vec<Vector3<f64>> = (Column::BASE.len()..columns)
                .map(|k| propagator.propagation_by_terms.get(k - Column::BASE.len()))
                .collect();
            filter.advance(&moved, &by_terms, propagation, noise);
        }
        filter.remember(number, place, model);
        while let Some((at, (of, taken))) = observations.next_if(|(_, (of, _))| of.to == number) {
            match of.quantity {
                _ if !taken => {}
                Quantity::MeasuredPose { segment: of_segment, measurement } => {
                    let Some(measured) = poses.get(of_segment, measurement) else { continue };
                    let is_outlier = poses.is_outlier(of_segment, measurement);
                    rejected_in_a_row = if is_outlier { rejected_in_a_row + 1 } else { 0 };
                    // The poses' own filter starts anew there.
                    let restarts = rejected_in_a_row >= COMMON.restart_after_outliers && measured.theta_rad.is_some();
                    if restarts {
                        filter.start_anew(number);
                        rejected_in_a_row = 0;
                    }
                    if restarts || !is_outlier {
                        let at = filter.at_place(number);
                        let state = StatePose { pose: filter.pose_at(at), at, size: filter.state.len() };
                        let of = PoseUpdate::of(measured, segment, number, state, model, noise, &mut propagator);
                        filter.update_pose(&of, columns, &mut sums);
                    }
                }
                quantity => {
                    let by_terms = if quantity.is_of_an_instant() {
                        let pose = filter.pose_at(filter.at_place(number));
                        instrument_by_terms(segment, number, pose, of.t_s, &mut propagator)
                    } else {
                        Vec::new()
                    };
                    filter.update_gated(at, of, &by_terms, pass, columns, &mut sums);
                }
            }
            filter.forget(at);
        }
    }
    let equations = sums.eliminated(segment.segment.run).0;
    Filtered { equations, score: filter.noise_by.score, outliers: filter.rejected }
}

impl<'f> PartialFilter<'f> {
    /// Starts at a pose that is hardly known; without any at the origin of the segment's own frame.
    fn new(segment: &'f PartialSegment<'f>, taken: &[bool], start: Option<Pose>, columns: usize) -> Self {
        let mut last_use = vec![None; segment.places.len()];
        for (number, (of, _)) in segment.observations.iter().zip(taken).enumerate().filter(|(_, (_, taken))| **taken) {
            last_use[of.from] = Some(number);
            last_use[of.to] = Some(number);
        }
        let slots = segment.most_places_at_once(&last_use);
        let first_slot = first_slot(&segment.walls);
        let size = first_slot + 3 * slots;
        let (mut state, mut covariance) = (DVector::zeros(size), DMatrix::zeros(size, size));
        covariance[(bias_at(), bias_at())] = PARTIAL.gyro_bias_sigma_radps.powi(2);
        let origin = start.unwrap_or(Pose::IDENTITY);
        (state[0], state[1], state[2]) = (origin.x_m, origin.y_m, origin.theta_rad);
        let yaw_rad = segment.walls.lidar.map_or(0.0, |lidar| lidar.yaw_rad);
        for (wall, of) in segment.walls.walls.iter().enumerate() {
            let at = wall_at(wall);
            let direction_rad = origin.theta_rad + of.direction_rad;
            let (sin, cos) = sin_cos(direction_rad + yaw_rad);
            (state[at], state[at + 1]) = (direction_rad, of.offset_m - sin * origin.x_m + cos * origin.y_m);
            covariance[(at, at)] = PARTIAL.wall_direction_sigma_rad.powi(2);
            covariance[(at + 1, at + 1)] = PARTIAL.wall_offset_sigma_m.powi(2);
        }
        if let Some(lidar) = segment.walls.lidar {
            let at = wall_at(segment.walls.walls.len());
            (state[at], state[at + 1], state[at + 2]) = (lidar.lever_m[0], lidar.lever_m[1], lidar.yaw_rad);
            let sigmas = [PARTIAL.lidar_place_sigma_m, PARTIAL.lidar_place_sigma_m, PARTIAL.wall_direction_sigma_rad];
            (0..3).for_each(|row| covariance[(at + row, at + row)] = sigmas[row].powi(2));
        }
        if start.is_some() {
            (0..3).for_each(|row| covariance[(row, row)] = START_VARIANCE[row]);
        }
        let noises = if start.is_some() { NOISES } else { OF_MOTION.len() };
        Self {
            segment,
            last_use,
            state,
            covariance,
            by: DMatrix::zeros(size, columns),
            noise_by: NoiseDerivatives::new(size, noises),
            origin_rad: origin.theta_rad,
            slots: vec![None; slots],
            rejected: Vec::new(),
            wall_outliers_in_a_row: [0; 2],
        }
    }

    /// What was known of the pose does not hold any more; the places before it stay as they are.
    fn start_anew(&mut self, place: usize) {
        let copy = self.at_place(place);
        for (row, variance) in START_VARIANCE.into_iter().enumerate() {
            for (a, b) in [(0, 0), (0, copy), (copy, 0), (copy, copy)] {
                self.covariance[(a + row, b + row)] += variance;
            }
        }
    }

    fn pose(&self) -> Pose {
        self.pose_at(0)
    }

    fn pose_at(&self, at: usize) -> Pose {
        Pose::new(self.state[at], self.state[at + 1], self.state[at + 2])
    }

    fn seen_by_lidar(&self, wall: usize) -> Option<SeenByLidar> {
        let WallStart { walls, lidar } = &self.segment.walls;
        let at = wall_at(walls.len());
        Some(SeenByLidar { at, start: (*lidar)?, direction_rad: self.origin_rad + walls[wall].direction_rad })
    }

    fn slot_at(&self, slot: usize) -> usize {
        first_slot(&self.segment.walls) + 3 * slot
    }

    /// Where the copy of a place stands in the state.
    fn at_place(&self, place: usize) -> usize {
        self.slot_at(self.slots.iter().position(|held| *held == Some(place)).unwrap_or_default())
    }

    /// Moves the counts' pose on.
    fn advance(&mut self, moved: &Moved, by_terms: &[Vector3<f64>], propagation: &PropagationInterval, noise: &Noise) {
        let turn @ Rotation { sin, cos } = Rotation::by(self.state[2]);
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
        self.noise_by.covariance_by.iter_mut().for_each(carry);
        for by in &mut self.noise_by.state_by {
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
                self.noise_by.covariance_by[k][(row, column)] += added[(row, column)];
            }
        }
        if let Some(restored) = &propagation.restored {
            let added = restored.turned(turn).matrix(0);
            (0..9).map(|at| (at / 3, at % 3)).for_each(|at| self.covariance[at] += added[at]);
        }
        let of_terms = by_terms.iter().enumerate().map(|(k, by)| (Column::BASE.len() + k, *by));
        for (column, by) in moved.by_geometry.iter().copied().enumerate().chain(of_terms) {
            let by = room(by);
            (0..3).for_each(|row| self.by[(row, column)] += by[row]);
        }
    }

    /// Copies the pose at a place, with the rounding of the counts there.
    fn remember(&mut self, number: usize, place: &Place, model: &Model) {
        // A place that no measurement which is taken is of needs no copy.
        let needed = self.last_use[number].is_some();
        let Some(slot) = self.slots.iter().position(Option::is_none).filter(|_| needed) else { return };
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
        self.noise_by.covariance_by.iter_mut().for_each(copy);
        for k in 0..3 {
            self.state[at + k] = self.state[k];
            self.noise_by.state_by.iter_mut().for_each(|by| by[at + k] = by[k]);
            for column in 0..self.by.ncols() {
                self.by[(at + k, column)] = self.by[(k, column)];
            }
        }
        let variance_rad2 = self.segment.segment.quantum_rad.map(variance_of_rounding);
        let variance_rad2 = variance_rad2.zip_with(place.interpolated_rad2, |rounded, between| rounded + between);
        let rounding = PoseVariance::of(variance_rad2, model).in_room(self.state[2]);
        for (row, column) in (0..9).map(|k| (k / 3, k % 3)) {
            self.covariance[(at + row, at + column)] += rounding[(row, column)];
        }
    }

    /// Frees the slots of places that no observation after this one needs.
    fn forget(&mut self, observation: usize) {
        for slot in 0..self.slots.len() {
            if self.slots[slot].is_some_and(|place| self.last_use[place] <= Some(observation)) {
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
                if distance_m > PARTIAL.min_distance_m {
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
                let lidar = self.seen_by_lidar(wall);
                of.value - WallDistance { pose: to, wall: wall_at(wall), lidar }.predicted(&self.state, &mut by)
            }
            Quantity::GyroTurn { dt_s } => {
                let scale = 1.0 + model.gyro_scale;
                // In one place both are the same: the robot stands.
                by[to + 2] += scale;
                by[from + 2] -= scale;
                by[bias_at()] = dt_s;
                of.value - scale * (at(to, 2) - at(from, 2)) - self.state[bias_at()] * dt_s
            }
            // Taken as a whole, by `update_pose`.
            Quantity::MeasuredPose { .. } => 0.0,
        };
        (off, by)
    }

    /// Takes an observation unless it is an outlier. Where readings of a wall are so in a row, the robot is
    /// not where the filter has it, which starts anew there.
    fn update_gated(
        &mut self,
        number: usize,
        of: &Observation,
        by_terms: &[Vector3<f64>],
        pass: &PartialPass<'_>,
        columns: usize,
        sums: &mut Sums<'_>,
    ) {
        let kind = match of.quantity {
            Quantity::WallHeading(_) => Some(0),
            Quantity::WallDistance(_) => Some(1),
            _ => None,
        };
        let mut is_taken = self.update(of, by_terms, pass, columns, sums);
        if let Some(in_a_row) = kind.map(|kind| &mut self.wall_outliers_in_a_row[kind]) {
            *in_a_row = if is_taken { 0 } else { *in_a_row + 1 };
            if *in_a_row >= COMMON.restart_after_outliers {
                *in_a_row = 0;
                self.start_anew(of.to);
                is_taken = self.update(of, by_terms, pass, columns, sums);
            }
        }
        if !is_taken {
            self.rejected.push(number);
        }
    }

    /// Takes an observation, to whose pose terms add `by_terms`; says whether it passes the gate.
    fn update(
        &mut self,
        of: &Observation,
        by_terms: &[Vector3<f64>],
        pass: &PartialPass<'_>,
        columns: usize,
        sums: &mut Sums<'_>,
    ) -> bool {
        let model = pass.model;
        if let Quantity::GyroTurn { dt_s } = of.quantity {
            self.covariance[(bias_at(), bias_at())] += self.segment.bias_walk * dt_s;
        }
        let (mut v, row) = self.predicted(of, model);
        let at = self.at_place(of.to);
        let by_terms: Vec<f64> =
            by_terms.iter().map(|by| row[at] * by.x + row[at + 1] * by.y + row[at + 2] * by.z).collect();
        v -= by_terms.iter().zip(&model.term_values).map(|(by, size)| by * size).sum::<f64>();
        let ph = &self.covariance * &row;
        let s = row.dot(&ph) + of.variance;
        if pass.gate == OutlierGate::On && v * v > PARTIAL.partial_outlier_chi_square * s {
            return false;
        }
        let gain = &ph / s;
        // ∂v/∂column, and a place for the free heading that these segments do not have.
        let mut j: Vec<f64> = (-(row.transpose() * &self.by)).iter().copied().collect();
        if let Quantity::GyroTurn { .. } = of.quantity {
            let turn_rad = self.state[self.at_place(of.to) + 2] - self.state[self.at_place(of.from) + 2];
            j[Column::GyroScale.index()] -= turn_rad;
        }
        j[Column::BASE.len()..].iter_mut().zip(by_terms).for_each(|(of, by)| *of -= by);
        j.resize(columns + 1, 0.0);
        sums.add([&j], [v], [s]);
        self.noise_by.take_scalar(&row, &gain, v, s);
        self.state += &gain * v;
        self.covariance -= &gain * ph.transpose();
        let j = nalgebra::RowDVector::from_row_slice(&j[..columns]);
        self.by += &gain * j;
        true
    }

    /// Takes a measured pose. With S = L Lᵀ the components of L⁻¹ v are independent.
    fn update_pose(&mut self, of: &PoseUpdate, columns: usize, sums: &mut Sums<'_>) {
        let h = &of.by_state;
        let ph = &self.covariance * h;
        // A sum of a covariance and one that is positive definite.
        let Some(root) = (h.tr_mul(&ph) + of.errors).cholesky() else { return };
        let mut by = -h.tr_mul(&self.by);
        for (column, direct) in (Column::SensorX.index()..columns).zip(&of.direct) {
            for row in 0..3 {
                by[(row, column)] -= direct[row];
            }
        }
        let lower = root.l();
        let (Some(whitened), Some(whitened_by)) =
            (lower.solve_lower_triangular(&of.innovation), lower.solve_lower_triangular(&by))
        else {
            return;
        };
        for component in 0..of.components {
            let sigma = lower[(component, component)];
            let mut j: Vec<f64> = whitened_by.row(component).iter().map(|by| by * sigma).collect();
            j.resize(columns + 1, 0.0);
            sums.add([&j], [whitened[component] * sigma], [sigma * sigma]);
        }
        let inverse = root.inverse();
        let gain = &ph * inverse;
        self.noise_by.take_pose(of, &gain, &inverse);
        self.state += &gain * of.innovation;
        self.covariance -= &gain * ph.transpose();
        self.by += &gain * by;
    }
}
