//! The filter of one segment: innovations, their derivatives by the mean parameters, and the score of the
//! noise.
//!
//! Scalar updates, one component of a measurement after the other: along and across the robot, then heading.
//! With gain k = P h/s the sensitivities follow D⁺ = D + k·∂v/∂p, exactly: gains do not depend on the mean
//! parameters. Those of P by ln(variance) follow the same recursion, differentiated.

use kinematics::{Kernel, Pose, Rotation, Twist, Wheels, sin_cos, wrap_to_pi};
use model_term::ModelTerm;
use nalgebra::{Matrix3, Vector3};

use crate::covariances::{Covariance, Covariances};
use crate::derivatives::Derivatives;
use crate::filter_state::{FilterState, Step, Update};
use crate::innovation::{Innovation, InnovationComponent};
use crate::kinematic_samples::KinematicSample;
use crate::layout::Layout;
use crate::model::{Column, Instrument, Model};
use crate::noise::{NOISES, Noise};
use crate::noise_score::{JointUpdate, NoiseScore, TimingScore};
use crate::noise_shape::{CorrelatedErrors, Whitened};
use crate::pass_options::{OutlierGate, PassOptions};
use crate::products::{Products, Sums};
use crate::propagation::{CarriedState, Moved, PropagationSource, Propagator, SegmentCache, turned_by};
use crate::rounding::Rounding;
use crate::segment::{MeasuredPose, Segment, Start};
use crate::settings::COMMON;
use crate::thinning::PropagationInterval;

/// The filter of one segment.
pub(super) struct Filter<'f, 'a> {
    segment: &'f Segment<'a>,
    number: usize,
    model: &'f Model,
    instrument: Instrument,
    noise: &'f Noise,
    propagator: Propagator<'f, 'a>,
    layout: Layout,
    pass_options: PassOptions<'f>,
    pose: Pose,
    covariance: Covariance,
    /// ∂pose/∂column.
    by: Derivatives,
    /// ∂pose/∂latency at the start.
    start_velocity: Vector3<f64>,
    /// Derivatives of the covariance and of the pose by the logarithm of each variance.
    covariance_by: Covariances<NOISES>,
    pose_by_noise: [[f64; NOISES]; 3],
    rounding: Rounding,
    /// Derivatives of the measurement by the terms' parameters, in the room.
    by_measurement: Derivatives,
    pub(super) sums: Sums<'f>,
    pub(super) innovations: Vec<InnovationComponent>,
    pub(super) samples: Vec<KinematicSample>,
    pub(super) outliers: Vec<usize>,
    pub(super) noise_score: NoiseScore,
    pub(super) timing: TimingScore,
    /// Derivatives of a component of the measurement by each column directly, and in all of each component.
    direct: Vec<f64>,
    j: [Vec<f64>; 3],
}

/// Filters a segment's measurements at the ends of some propagation intervals, from a free start heading.
pub(super) struct FilterRun<'r, 'f, 'a> {
    pub(super) filter: &'r mut Filter<'f, 'a>,
    pub(super) propagations: &'r [PropagationInterval],
    pub(super) free_heading_rad: f64,
}

impl Kernel for FilterRun<'_, '_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { filter, propagations, free_heading_rad } = self;
        filter.propagator.restart();
        let Some(first) = propagations.first() else {
            let start_s = filter.segment.intervals.first().map_or(0.0, |interval| interval.t_s);
            filter.start(Pose::IDENTITY, [0.0; 2], 0, 0, start_s);
            let intervals = 0..filter.segment.intervals.len();
            let noise = Covariances::ZERO;
            filter.predict(0, &PropagationInterval { intervals, from: 0, measurement: 0, noise, restored: None });
            return;
        };
        filter.propagator.skip(0..first.intervals.start);
        match filter.segment.start {
            Start::MeasuredPose => filter.start_at(0, first.from, first.intervals.start, free_heading_rad),
            Start::Origin => {
                let start_s = filter.segment.intervals.first().map_or(0.0, |interval| interval.t_s);
                filter.start(Pose::IDENTITY, [0.0; 2], 0, 0, start_s);
            }
        }
        let mut rejected_in_a_row = 0;
        for (number, propagation) in propagations.iter().enumerate() {
            filter.predict(number, propagation);
            if filter.update(number, propagation) {
                rejected_in_a_row = 0;
                continue;
            }
            filter.outliers.push(propagation.measurement);
            rejected_in_a_row += 1;
            // Without a heading the filter cannot start in the middle of a segment.
            let restarts = rejected_in_a_row >= COMMON.restart_after_outliers
                && filter.segment.measurements[propagation.measurement].theta_rad.is_some()
                && filter.segment.start == Start::MeasuredPose;
            if rules::Rule::RestartAfterOutliers.applies(restarts) {
                filter.start_at(number + 1, propagation.measurement, propagation.intervals.end, filter.pose.theta_rad);
                rejected_in_a_row = 0;
            }
        }
    }
}

impl<'f, 'a> Filter<'f, 'a> {
    pub(super) fn new(
        segment: &'f Segment<'a>,
        number: usize,
        model: &'f Model,
        noise: &'f Noise,
        products: &'f Products,
        terms: &'f mut [Box<dyn ModelTerm>],
        pass_options: PassOptions<'f>,
    ) -> Self {
        let layout = products.layout();
        // One more for a free heading.
        let all = layout.columns() + 1;
        let mut propagator = Propagator::new(segment, model, terms);
        if pass_options.samples {
            propagator.take_samples();
        }
        Self {
            segment,
            number,
            model,
            instrument: model.instrument(segment.run),
            noise,
            propagator,
            layout,
            pass_options,
            pose: Pose::IDENTITY,
            covariance: Covariance::ZERO,
            by: Derivatives::zeros(all),
            start_velocity: Vector3::zeros(),
            covariance_by: Covariances::ZERO,
            pose_by_noise: [[0.0; NOISES]; 3],
            rounding: Rounding::new(segment.quantum_rad, all),
            by_measurement: Derivatives::zeros(layout.parameters),
            sums: Sums::new(products),
            innovations: Vec::new(),
            samples: Vec::new(),
            outliers: Vec::new(),
            noise_score: NoiseScore::zero(),
            timing: TimingScore::default(),
            direct: vec![0.0; all],
            j: [(); 3].map(|()| vec![0.0; all]),
        }
    }

    /// Goes on where the segment before ended.
    pub(super) fn carry_on(&mut self, carried: CarriedState) {
        self.propagator.carry_on(carried);
    }

    /// Where this segment ended.
    pub(super) fn carried(&self) -> CarriedState {
        self.propagator.carried(self.pose * self.instrument.body_from_sensor)
    }

    /// Takes propagations from here instead of integrating the counts.
    pub(super) fn take_propagations(&mut self, propagations: PropagationSource<'f>) {
        self.propagator.propagations = propagations;
    }

    /// The sums of the segment, its outliers and innovations, and its propagations where they were recorded.
    pub(super) fn into_parts(
        self,
    ) -> (Sums<'f>, Vec<usize>, Vec<InnovationComponent>, NoiseScore, Option<SegmentCache>) {
        (self.sums, self.outliers, self.innovations, self.noise_score, self.propagator.propagations.into_cached())
    }

    /// Variances of position and heading of a measurement that states none of its own.
    #[inline(always)]
    const fn instrument_variance(&self) -> [f64; 2] {
        let [_, _, xy, theta] = self.noise.variance;
        [xy, theta]
    }

    /// Variances of a measurement's position and heading: the instrument's, times its row's factors.
    #[inline(always)]
    fn variance_of(&self, measured: &MeasuredPose) -> [f64; 2] {
        let [xy, theta] = self.instrument_variance();
        [xy * measured.variance_factor[0], theta * measured.variance_factor[1]]
    }

    /// Starts at a measurement, after a number of propagation intervals.
    #[inline(always)]
    fn start_at(&mut self, propagations: usize, measurement: usize, next_piece: usize, free_heading_rad: f64) {
        let measured = self.segment.measurements[measurement];
        let [xy, theta] = self.variance_of(&measured);
        let pose = Pose::new(measured.x_m, measured.y_m, measured.theta_rad.unwrap_or(free_heading_rad));
        let free = measured.theta_rad.is_none();
        self.start(pose, [xy, if free { 0.0 } else { theta }], next_piece, propagations, measured.t_s);
        if let Some(shape) = &measured.shape {
            let lever = if free { Vector3::zeros() } else { self.lever(measured.x_m, measured.y_m) };
            let [whole, position, heading] = shape.at_start(self.instrument_variance(), lever);
            self.covariance = Covariance::of([&(whole + self.of_start_instant())]);
            self.covariance_by = Covariances::of([&Matrix3::zeros(), &Matrix3::zeros(), &position, &heading]);
        }
        if free {
            // The instrument's heading is the parameter, the drive's centre follows it round the instrument.
            self.sums.free = true;
            let last = self.direct.len() - 1;
            self.by.set(last, self.lever(measured.x_m, measured.y_m));
        }
    }

    /// Covariance of the pose by the error of the instant that it starts at.
    #[inline(always)]
    fn of_start_instant(&self) -> Matrix3<f64> {
        self.start_velocity * self.start_velocity.transpose() * self.noise.timing_s2
    }

    /// How the drive's centre moves round the instrument at this place as its measured heading turns.
    #[inline(always)]
    fn lever(&self, x_m: f64, y_m: f64) -> Vector3<f64> {
        Vector3::new(-(self.pose.y_m - y_m), self.pose.x_m - x_m, 1.0)
    }

    #[inline(always)]
    fn start(&mut self, measured: Pose, [var_xy, var_theta]: [f64; 2], after: usize, propagations: usize, t_s: f64) {
        let twist = self.propagator.twist(self.segment.rate_at(after, t_s));
        let Instrument { body_from_sensor: Pose { x_m: lx, y_m: ly, theta_rad: ltheta }, latency_s: late } =
            self.instrument;
        let theta_rad = measured.theta_rad - ltheta;
        let (sin, cos) = sin_cos(theta_rad);
        let mounted = Vector3::new(cos * lx - sin * ly, sin * lx + cos * ly, 0.0);
        let velocity = |Twist { v_m_s, omega_rad_s }| Vector3::new(cos * v_m_s, sin * v_m_s, omega_rad_s);
        let [moved, by_latency] = self.twists_before(after, t_s, twist).map(velocity);
        // The measured heading is that of the beginning of what was driven since.
        let turned_rad = late * moved.z;
        let (moved, by_latency) = (turned_by(moved, 0.5 * turned_rad), turned_by(by_latency, turned_rad));
        self.pose = Pose::new(
            measured.x_m - mounted.x + late * moved.x,
            measured.y_m - mounted.y + late * moved.y,
            theta_rad + late * moved.z,
        );
        self.by.clear();
        self.start_velocity = by_latency;
        if self.layout.instruments {
            self.by.set(Column::SensorX.index(), Vector3::new(-cos, -sin, 0.0));
            self.by.set(Column::SensorY.index(), Vector3::new(sin, -cos, 0.0));
            self.by.set(Column::SensorTheta.index(), Vector3::new(-mounted.y, mounted.x, -1.0));
            self.by.set(Column::Latency.index(), by_latency);
        }
        self.measurement(propagations, t_s, twist, Rotation::by(self.pose.theta_rad));
        // What went before the start is not of the next one.
        let _ = self.propagator.sample(self.pose, self.number, 0);
        for (number, size) in self.model.term_values.iter().enumerate() {
            let measurement = self.by_measurement.get(number);
            self.by.set(self.layout.first_term() + number, -measurement);
            self.pose = Pose::new(
                self.pose.x_m - size * measurement.x,
                self.pose.y_m - size * measurement.y,
                self.pose.theta_rad - size * measurement.z,
            );
        }
        let lever = self.lever(measured.x_m, measured.y_m);
        let position = Matrix3::from_diagonal(&Vector3::new(var_xy, var_xy, 0.0));
        let heading = lever * lever.transpose() * var_theta;
        self.covariance = Covariance::of([&(position + heading + self.of_start_instant())]);
        self.covariance_by = Covariances::of([&Matrix3::zeros(), &Matrix3::zeros(), &position, &heading]);
        self.pose_by_noise = [[0.0; NOISES]; 3];
        let interpolated_rad2 =
            self.segment.intervals.get(after).map_or(Wheels::both(0.0), |first| first.interpolated_rad2[0]);
        self.rounding.start(self.instrument_variance(), interpolated_rad2, self.model);
    }

    /// How the drive's centre moves in the middle of a measurement's delay, and at the instant that it is of.
    #[inline(always)]
    fn twists_before(&self, after: usize, t_s: f64, twist: Twist) -> [Twist; 2] {
        let late_s = self.instrument.latency_s;
        if late_s == 0.0 {
            return [twist; 2];
        }
        [0.5 * late_s, late_s].map(|ago_s| self.propagator.twist(self.segment.rate_at(after, t_s - ago_s)))
    }

    /// The state, with what rounding does to it.
    #[inline(always)]
    fn rounded(&mut self) -> (&mut Rounding, FilterState<'_>) {
        let Self { pose, covariance, by, covariance_by, pose_by_noise, rounding, .. } = self;
        (rounding, FilterState { pose, covariance, by, covariance_by, pose_by_noise })
    }

    /// Finds what the terms add to the measurement after so many propagation intervals at the pose in force,
    /// in the room, for each parameter; the pose has a heading of this sine and cosine.
    #[inline(always)]
    fn measurement(&mut self, propagations: usize, t_s: f64, twist: Twist, Rotation { sin, cos }: Rotation) {
        self.propagator.measurement(self.pose, propagations, t_s, twist);
        let by_measurement =
            self.by_measurement.x.iter_mut().zip(&mut self.by_measurement.y).zip(&mut self.by_measurement.theta);
        for (((x, y), theta), gradient) in by_measurement.zip(&self.propagator.gradients) {
            *x = cos * gradient.x_m - sin * gradient.y_m;
            *y = sin * gradient.x_m + cos * gradient.y_m;
            *theta = gradient.theta_rad;
        }
    }

    #[inline(always)]
    fn predict(&mut self, number: usize, propagation: &PropagationInterval) {
        // A row's error stays until the next row.
        let intervals = &self.segment.intervals[propagation.intervals.clone()];
        let is_of_row = matches!(intervals, [only] if only.starts_within_row);
        if !(is_of_row || intervals.iter().all(|interval| interval.stands)) {
            let noise_score = self.pass_options.noise_score;
            let (rounding, mut state) = self.rounded();
            rounding.leave(&mut state, noise_score);
        }
        let Moved { motion, by_geometry } = self.propagator.moved(self.pose, number, propagation);
        let [wheel, turn, ..] = self.noise.variance;
        let (layout, noise_score) = (self.layout, self.pass_options.noise_score);
        let Self { pose, covariance, by, covariance_by, pose_by_noise, rounding, propagator, .. } = self;
        let step = Step {
            motion,
            by_geometry,
            by_terms: &propagator.propagation_by_terms,
            first_term: layout.first_term(),
            noise: &propagation.noise,
            variance: [wheel, turn],
            restored: propagation.restored.as_deref(),
            noise_score,
        };
        rounding.advance(&step);
        let mut state = FilterState { pose, covariance, by, covariance_by, pose_by_noise };
        state.advance(&step);
        rounding.pass(&mut state, noise_score);
    }

    /// The innovation of a measurement after so many intervals, at a heading of this sine and cosine.
    #[inline(always)]
    fn innovation(
        &self,
        measured: &MeasuredPose,
        after: usize,
        twist: Twist,
        Rotation { sin, cos }: Rotation,
    ) -> Innovation {
        let Instrument { body_from_sensor: Pose { x_m: lx, y_m: ly, theta_rad: ltheta }, latency_s: late } =
            self.instrument;
        let mounted = Vector3::new(cos * lx - sin * ly, sin * lx + cos * ly, 0.0);
        // A late measurement is off by how far the instrument moved meanwhile.
        let twists = self.twists_before(after, measured.t_s, twist);
        let sensor_velocity = |Twist { v_m_s, omega_rad_s }: Twist| {
            Vector3::new(cos * v_m_s - omega_rad_s * mounted.y, sin * v_m_s + omega_rad_s * mounted.x, omega_rad_s)
        };
        let turned_back_rad = late * twists[0].omega_rad_s;
        let moved = turned_by(sensor_velocity(twists[0]), -0.5 * turned_back_rad);
        let by_latency = turned_by(sensor_velocity(twists[1]), -turned_back_rad);
        let mut sum_of_terms = Vector3::zeros();
        for (number, size) in self.model.term_values.iter().enumerate().filter(|(_, size)| **size != 0.0) {
            sum_of_terms += *size * self.by_measurement.get(number);
        }
        let ahead = mounted - late * moved + sum_of_terms;
        let error = Vector3::new(
            measured.x_m - self.pose.x_m - ahead.x,
            measured.y_m - self.pose.y_m - ahead.y,
            measured.theta_rad.map_or(0.0, |theta_rad| wrap_to_pi(theta_rad - self.pose.theta_rad - ltheta - ahead.z)),
        );
        Innovation { error, by_heading: Vector3::new(-ahead.y, ahead.x, 1.0), by_latency }
    }

    /// Takes a measurement; false, and nothing changes, when it lies too far off.
    #[inline(always)]
    fn update(&mut self, number: usize, propagation: &PropagationInterval) -> bool {
        let measured = self.segment.measurements[propagation.measurement];
        let Some(interval) = self.segment.intervals[propagation.intervals.clone()].last().copied() else { return true };
        let variance = self.variance_of(&measured);
        let model = self.model;
        let heading @ Rotation { sin, cos } = Rotation::by(self.pose.theta_rad);
        let (rounding, mut state) = self.rounded();
        rounding.enter(&mut state, variance, interval.interpolated_rad2[1], model, heading);
        let twist = self.propagator.twist(interval.rate_at_ends_rad_s[1]);
        self.measurement(number + 1, measured.t_s, twist, heading);
        let sample = self.propagator.sample(self.pose, self.number, propagation.measurement);
        let Innovation { error, by_heading, by_latency } =
            self.innovation(&measured, propagation.intervals.end, twist, heading);
        // Derivatives of a component of the measurement by the pose; rows: along, across, heading.
        let axes = [Vector3::new(cos, sin, 0.0), Vector3::new(-sin, cos, 0.0), Vector3::z()];
        let components = if measured.theta_rad.is_some() { 3 } else { 2 };
        let [xy, theta] = variance;
        let by_instant = self.noise.timing_s2.sqrt() * by_latency;
        let correlated = CorrelatedErrors::of(measured.shape, measured.variance_factor, by_instant);
        let Whitened { axes, variance: r } = match correlated {
            Some(errors) => errors.whitened(axes, self.instrument_variance()),
            None => Whitened { axes, variance: [xy, xy, theta] },
        };
        let mut rows = axes;
        for row in &mut rows {
            row.z = row.dot(&by_heading);
        }
        let (mut covariance, mut correction, mut distance) = (self.covariance, Vector3::zeros(), 0.0);
        let (mut turned, mut error_by, mut velocity_by) = (Vector3::zeros(), 0.0, 0.0);
        // A loop, and no closure over an array: that would be called, without the kernel's instructions.
        let mut measured = [Update::NOTHING; 3];
        for (component, update) in measured.iter_mut().enumerate().take(components) {
            let row = rows[component];
            let v = axes[component].dot(&error) - row.dot(&correction);
            let [[x], [y], [theta]] = covariance.along(&row);
            let ph = Vector3::new(x, y, theta);
            let s = row.dot(&ph) + r[component];
            let gain = ph * (1.0 / s);
            distance += v * v / s;
            correction += gain * v;
            let velocity = axes[component].dot(&by_latency) - row.dot(&turned);
            turned += gain * velocity;
            error_by += velocity * v / s;
            velocity_by += velocity * velocity / s;
            covariance.lower(&gain, &ph);
            *update = Update { row, gain, v, s };
        }
        if rules::Rule::OutlierGate
            .applies(self.pass_options.gate == OutlierGate::On && distance > COMMON.outlier_chi_square)
        {
            return false;
        }
        self.timing.add(&TimingScore::of(error_by, velocity_by), 1.0);
        if let Some(errors) = correlated.filter(|_| self.pass_options.noise_score) {
            let (variance, covariance) = (self.instrument_variance(), self.covariance.matrix(0));
            let has_heading = components == 3;
            let joint = JointUpdate { errors, variance, covariance, by_heading, innovation: error, has_heading };
            self.noise_score.add_joint(&joint, &mut self.covariance_by, &mut self.pose_by_noise);
        }
        self.covariance = covariance;
        self.samples.extend(sample);
        // The geometry, and a free heading in the last column, act through the pose alone.
        let mounted_by = [Vector3::new(cos, sin, 0.0), Vector3::new(-sin, cos, 0.0), Vector3::z(), -by_latency];
        for (component, update) in measured.iter().enumerate().take(components) {
            if self.pass_options.noise_score && correlated.is_none() {
                let (covariance_by, pose_by_noise) = (&mut self.covariance_by, &mut self.pose_by_noise);
                self.noise_score.add_component(component, update, r[component], covariance_by, pose_by_noise);
            }
            self.add_derivatives(component, update, axes[component], &mounted_by);
            if self.pass_options.innovations {
                let (segment, measurement, sigma) = (self.number, propagation.measurement, update.s.sqrt());
                let z = update.v / sigma;
                self.innovations.push(InnovationComponent { segment, measurement, component, z, sigma });
            }
        }
        let ([along, across, heading], [a, b, c]) = (&self.j, &measured);
        if components == 3 {
            self.sums.add([along, across, heading], [a.v, b.v, c.v], [a.s, b.s, c.s]);
        } else {
            self.sums.add([along, across], [a.v, b.v], [a.s, b.s]);
        }
        self.pose =
            Pose::new(self.pose.x_m + correction.x, self.pose.y_m + correction.y, self.pose.theta_rad + correction.z);
        true
    }

    /// Derivatives of one component by all columns, and what they add to those of the pose. `mounted_by` are
    /// those of the measurement by the instrument's columns.
    #[inline(always)]
    fn add_derivatives(
        &mut self,
        component: usize,
        Update { row, gain, .. }: &Update,
        axis: Vector3<f64>,
        mounted_by: &[Vector3<f64>; 4],
    ) {
        if self.layout.instruments {
            for (direct, by) in self.direct[Column::SensorX.index()..].iter_mut().zip(mounted_by) {
                *direct = axis.dot(by);
            }
        }
        for (direct, measurement) in
            self.direct[self.layout.first_term()..].iter_mut().zip(self.by_measurement.along(axis))
        {
            *direct = measurement;
        }
        for ((j, by), direct) in self.j[component].iter_mut().zip(self.by.along(*row)).zip(&self.direct) {
            *j = -by - direct;
        }
        self.by.add(*gain, &self.j[component]);
    }
}
