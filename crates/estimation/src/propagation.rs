//! The motion of a propagation interval by counts and terms, with its derivatives; cached from pass to pass
//! where intervals are long.
//!
//! Integrating many wheel intervals takes longer than taking the measurement at their end, and depends on the
//! model alone, not on the noise. Near the model of the cache the motion is motion + Σ ∂motion/∂p · Δp, up to
//! squares of Δp. Small steps of a fit use cached propagations; convergence is confirmed by integrated ones.

use std::ops::Range;
use std::sync::Arc;

use kinematics::{Frame, Increment, Pose, Twist, Wheels, sin_cos, sinc, sinc_derivative};
use model_term::{Interval, Measurement, ModelTerm};
use nalgebra::Vector3;

use crate::derivatives::Derivatives;
use crate::kinematic_samples::{KinematicSample, KinematicSampler};
use crate::model::Model;
use crate::segment::Segment;
use crate::segment_record::SegmentRecord;
use crate::thinning::PropagationInterval;
use crate::wheel_angles::WheelInterval;

/// A propagation interval's motion in the frame of the body at its start, and what it depends on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Moved {
    pub(crate) motion: Pose,
    pub(crate) by_geometry: [Vector3<f64>; 3],
}

/// Where a filter has its propagations from.
pub(crate) enum PropagationSource<'f> {
    /// They are integrated.
    Integrated,
    /// They are integrated, and recorded.
    Recorded(SegmentCache),
    /// They are cached, by a model that differs from that in force by this change.
    Cached(&'f SegmentCache, &'f Change),
}

/// The propagations of a segment.
#[derive(Debug, Clone)]
pub(crate) struct SegmentCache {
    moved: Vec<Moved>,
    /// Number of parameters of the terms.
    parameters: usize,
    /// Derivatives of each propagation interval by them.
    by_terms: Vec<Vector3<f64>>,
    /// What they add to the measurement at the start, and to that after each propagation, in the frame of the
    /// body.
    by_measurement: Vec<Pose>,
}

impl PropagationSource<'_> {
    /// An empty recording of a number of propagations, with terms of a number of parameters.
    pub(crate) fn cached(propagations: usize, parameters: usize) -> Self {
        Self::Recorded(SegmentCache {
            moved: Vec::with_capacity(propagations),
            parameters,
            by_terms: Vec::with_capacity(propagations * parameters),
            by_measurement: vec![Pose::IDENTITY; (propagations + 1) * parameters],
        })
    }

    /// The recording, if it is one.
    pub(crate) fn into_cached(self) -> Option<SegmentCache> {
        if let Self::Recorded(cached) = self { Some(cached) } else { None }
    }
}

impl SegmentCache {
    pub(crate) fn measurement(&self, propagations: usize) -> &[Pose] {
        &self.by_measurement[propagations * self.parameters..][..self.parameters]
    }

    pub(crate) fn keep_measurement(&mut self, propagations: usize, gradients: &[Pose]) {
        self.by_measurement[propagations * self.parameters..][..self.parameters].copy_from_slice(gradients);
    }
}

/// The propagations of all segments, phase by phase, and the model by which they were integrated.
#[derive(Debug, Clone)]
pub(crate) struct CachedPropagation {
    pub(crate) model: Model,
    pub(crate) phases: Vec<Vec<Option<Arc<SegmentCache>>>>,
}

/// Difference of a model from that of the cache.
#[derive(Debug, Clone)]
pub(crate) struct Change {
    /// Of the geometry parameters, relative: left, right, separation.
    geometry: [f64; 3],
    term_values: Vec<f64>,
}

impl CachedPropagation {
    /// Difference of a model from that of the cache.
    pub(crate) fn change_to(&self, model: &Model) -> Change {
        let geometry = |of: &Model| [of.m_per_rad.left, of.m_per_rad.right, of.separation_m];
        let (from, to) = (geometry(&self.model), geometry(model));
        Change {
            geometry: [0, 1, 2].map(|k| f64::ln(to[k] / from[k])),
            term_values: model.term_values.iter().zip(&self.model.term_values).map(|(to, from)| to - from).collect(),
        }
    }

    /// The propagations of a segment in a phase, for a model with this difference.
    pub(crate) fn reused<'k>(&'k self, phase: usize, segment: usize, change: &'k Change) -> PropagationSource<'k> {
        self.phases[phase][segment]
            .as_deref()
            .map_or(PropagationSource::Integrated, |propagations| PropagationSource::Cached(propagations, change))
    }
}

/// A velocity in the room, along the heading of another instant: the robot has turned by so much from now to
/// then. The path of a delay is the chord of an arc, which has the heading of its middle.
#[inline(always)]
pub(crate) fn turned_by(velocity: Vector3<f64>, turn_rad: f64) -> Vector3<f64> {
    if turn_rad == 0.0 {
        return velocity;
    }
    let (sin, cos) = sin_cos(turn_rad);
    Vector3::new(cos * velocity.x - sin * velocity.y, sin * velocity.x + cos * velocity.y, velocity.z)
}

/// State at the end of a displacement: the terms of the next one go on from it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CarriedState {
    /// The next segment's frame in that of the first.
    pub(crate) run_from_chain: Pose,
    pub(crate) session_m: f64,
    pub(crate) sampler: Option<KinematicSampler>,
}

/// The mean model along one segment, for the filter and for dead reckoning: its motion by counts and terms,
/// and what the terms add to its measurements.
pub(crate) struct Propagator<'f, 'a> {
    segment: &'f Segment<'a>,
    pub(crate) model: &'f Model,
    terms: &'f mut [Box<dyn ModelTerm>],
    /// The segment's frame in that of the run's displacements; the identity for poses.
    run_from_chain: Pose,
    session_m: f64,
    wheel_rad: Wheels<f64>,
    continues: bool,
    /// Motion since the last measurement, where samples are asked for; cached propagation leaves it alone.
    sampler: Option<KinematicSampler>,
    /// The terms' latest gradients, by each of their parameters.
    pub(crate) gradients: Vec<Pose>,
    /// What the terms added to the velocity in the latest interval.
    twist_of_terms: Twist,
    /// Where propagations come from.
    pub(crate) propagations: PropagationSource<'f>,
    /// Derivatives of the propagation interval in force by the terms' parameters.
    pub(crate) propagation_by_terms: Derivatives,
}

impl<'f, 'a> Propagator<'f, 'a> {
    pub(crate) fn new(segment: &'f Segment<'a>, model: &'f Model, terms: &'f mut [Box<dyn ModelTerm>]) -> Self {
        let parameters = terms.iter().map(|term| term.parameters().len()).sum();
        let mut values = &model.term_values[..];
        for term in terms.iter_mut() {
            let (own, others) = values.split_at(term.parameters().len().min(values.len()));
            term.linearize_at(own);
            values = others;
        }
        Self {
            segment,
            model,
            terms,
            run_from_chain: Pose::IDENTITY,
            session_m: segment.session_m,
            wheel_rad: segment.wheel_rad,
            continues: false,
            sampler: None,
            gradients: vec![Pose::IDENTITY; parameters],
            twist_of_terms: Twist::default(),
            propagations: PropagationSource::Integrated,
            propagation_by_terms: Derivatives::zeros(parameters),
        }
    }

    /// Goes on where the segment before ended.
    pub(crate) fn carry_on(&mut self, carried: CarriedState) {
        let CarriedState { run_from_chain, session_m, sampler } = carried;
        (self.run_from_chain, self.session_m) = (run_from_chain, session_m);
        self.sampler = sampler;
        self.continues = true;
    }

    /// Distance driven in the session so far, metres.
    pub(crate) const fn session_m(&self) -> f64 {
        self.session_m
    }

    /// The state at the end of this segment, at a pose of the instrument in the segment's frame.
    pub(crate) fn carried(&self, chain_from_sensor: Pose) -> CarriedState {
        let run_from_chain = self.run_from_chain * chain_from_sensor;
        CarriedState { run_from_chain, session_m: self.session_m, sampler: self.sampler }
    }

    /// Resets the state of the terms, unless the segment goes on from the one before.
    #[inline(always)]
    pub(crate) fn restart(&mut self) {
        if !self.continues {
            for term in self.terms.iter_mut() {
                term.restart(self.segment.info);
            }
        }
    }

    /// Samples are asked for.
    pub(crate) fn take_samples(&mut self) {
        self.sampler.get_or_insert_with(KinematicSampler::new);
    }

    /// What the counts say of the motion since the last measurement, where it is asked for, and forgets it.
    #[inline(always)]
    pub(crate) fn sample(&mut self, pose: Pose, segment: usize, measurement: usize) -> Option<KinematicSample> {
        let world_from_body = self.run_from_chain * pose;
        self.sampler.as_mut()?.sample(segment, measurement, world_from_body)
    }

    #[inline(always)]
    fn add_to_sampler(&mut self, propagation: &PropagationInterval) {
        if let Some(sampler) = &mut self.sampler {
            let intervals = &self.segment.intervals[propagation.intervals.clone()];
            let start_s = self.segment.info.start_s.unwrap_or(0.0);
            sampler.add(start_s, intervals, self.model, self.wheel_rad, self.session_m);
        }
    }

    /// Velocity of the drive's centre at rates of the wheels.
    #[inline(always)]
    pub(crate) fn twist(&self, rate_rad_s: Wheels<f64>) -> Twist {
        self.model.twist(rate_rad_s)
    }

    /// What the terms add to the measurement after a number of propagations, at a pose of the drive's centre,
    /// in the frame of the body. The result is in [`Self::gradients`].
    #[inline(always)]
    pub(crate) fn measurement(&mut self, pose: Pose, propagations: usize, t_s: f64, twist: Twist) {
        if self.gradients.is_empty() {
            return;
        }
        if let PropagationSource::Cached(cached, _) = self.propagations {
            self.gradients.copy_from_slice(cached.measurement(propagations));
        } else {
            let record = SegmentRecord { intervals: &self.segment.intervals, model: self.model };
            let world_from_body = self.run_from_chain * pose;
            let (twist_of_terms, run) = (self.twist_of_terms, self.segment.info);
            let measurement = Measurement { t_s, world_from_body, twist, twist_of_terms, record: &record, run };
            self.ask_terms(|term, own| term.measurement(&measurement, own));
            self.turn_levers();
        }
        if let PropagationSource::Recorded(cached) = &mut self.propagations {
            cached.keep_measurement(propagations, &self.gradients);
        }
    }

    /// Where a term is of the body elsewhere, the point that is seen on the body turns with it.
    fn turn_levers(&mut self) {
        let Model { body_from_sensor, term_values, .. } = self.model;
        let sized = self.model.sized_terms().len();
        let (mut ahead_m, mut left_m) = (body_from_sensor.x_m, body_from_sensor.y_m);
        for (term, own) in with_columns(self.terms).take_while(|(_, own)| own.start < sized) {
            for column in own.filter(|column| *column < sized && !term.moves_body()) {
                ahead_m += term_values[column] * self.gradients[column].x_m;
                left_m += term_values[column] * self.gradients[column].y_m;
            }
        }
        if (ahead_m, left_m) == (0.0, 0.0) {
            return;
        }
        for (_, own) in with_columns(self.terms).filter(|(term, _)| term.moves_body()) {
            for column in own {
                let gradient = &mut self.gradients[column];
                let value = term_values.get(column).copied().unwrap_or(0.0);
                let (turned, shrunk) = if value == 0.0 {
                    (gradient.theta_rad, 0.0)
                } else {
                    let (sin, cos) = (value * gradient.theta_rad).sin_cos();
                    (sin / value, (cos - 1.0) / value)
                };
                gradient.x_m += shrunk * ahead_m - turned * left_m;
                gradient.y_m += shrunk * left_m + turned * ahead_m;
            }
        }
    }

    /// The motion of a propagation interval from a pose of the drive's centre; its derivatives by the terms'
    /// values are in [`Self::propagation_by_terms`].
    #[inline(always)]
    pub(crate) fn moved(&mut self, pose: Pose, number: usize, propagation: &PropagationInterval) -> Moved {
        if let PropagationSource::Cached(cached, change) = self.propagations {
            return self.reused(cached, change, number);
        }
        self.add_to_sampler(propagation);
        let moved = self.driven(pose, propagation);
        if let PropagationSource::Recorded(cached) = &mut self.propagations {
            cached.moved.push(moved);
            cached.by_terms.extend((0..cached.parameters).map(|column| self.propagation_by_terms.get(column)));
        }
        moved
    }

    #[inline(always)]
    fn reused(&mut self, cached: &SegmentCache, change: &Change, number: usize) -> Moved {
        let Moved { mut motion, by_geometry } = cached.moved[number];
        let mut add = |by: Vector3<f64>, change: f64| {
            motion.x_m += by.x * change;
            motion.y_m += by.y * change;
            motion.theta_rad += by.z * change;
        };
        by_geometry.iter().zip(change.geometry).for_each(|(by, change)| add(*by, change));
        let by_terms = &cached.by_terms[number * cached.parameters..][..cached.parameters];
        for (column, (by, change)) in by_terms.iter().zip(&change.term_values).enumerate() {
            add(*by, *change);
            self.propagation_by_terms.set(column, *by);
        }
        Moved { motion, by_geometry }
    }

    /// Asks each term for its gradients by its own parameters.
    #[inline(always)]
    fn ask_terms(&mut self, ask: impl Fn(&mut dyn ModelTerm, &mut [Pose])) {
        self.gradients.fill(Pose::IDENTITY);
        let mut rest = &mut self.gradients[..];
        for term in self.terms.iter_mut() {
            let (own, others) = rest.split_at_mut(term.parameters().len());
            ask(term.as_mut(), own);
            rest = others;
        }
    }

    /// The motion of a propagation interval by the counts and the terms.
    #[inline(always)]
    fn driven(&mut self, pose: Pose, propagation: &PropagationInterval) -> Moved {
        let Model { m_per_rad, separation_m, .. } = *self.model;
        let mut moved = Moved { motion: Pose::IDENTITY, by_geometry: [Vector3::zeros(); 3] };
        self.propagation_by_terms.clear();
        let run_from_start = Frame::from(self.run_from_chain * pose);
        let sized = self.model.sized_terms();
        for interval in &self.segment.intervals[propagation.intervals.clone()] {
            let travel_m = m_per_rad.zip_with(interval.wheel_rad, |m_per_rad, rad| m_per_rad * rad);
            let of_counts = Increment::from_travel(travel_m, separation_m);
            let before = moved.motion;
            let mut of_terms = Pose::IDENTITY;
            if !self.gradients.is_empty() {
                self.term_gradients(interval, travel_m, run_from_start * before);
                for (gradient, size) in self.gradients.iter().zip(sized) {
                    of_terms.x_m += size * gradient.x_m;
                    of_terms.y_m += size * gradient.y_m;
                    of_terms.theta_rad += size * gradient.theta_rad;
                }
                self.twist_of_terms = Twist::of_motion(of_terms, interval.dt_s);
            }
            // One arc of counts and terms together: where terms undo what stamps jitter by, their squares
            // count.
            let distance_m = of_counts.distance_m + of_terms.x_m;
            let turn_rad = of_counts.turn_rad + of_terms.theta_rad;
            let across_m = self.model.across_m(interval);
            let aside_m = across_m + of_terms.y_m;
            let half_rad = 0.5 * turn_rad;
            let (sin, cos) = sin_cos(before.theta_rad + half_rad);
            let chord = sinc(half_rad);
            let step = Vector3::new(
                distance_m * chord * cos - aside_m * sin,
                distance_m * chord * sin + aside_m * cos,
                turn_rad,
            );
            let curvature = sinc_derivative(half_rad);
            let by_turn = Vector3::new(
                0.5 * (distance_m * (curvature * cos - chord * sin) - aside_m * cos),
                0.5 * (distance_m * (curvature * sin + chord * cos) - aside_m * sin),
                1.0,
            );
            let along = Vector3::new(chord * cos, chord * sin, 0.0);
            let per_m = 1.0 / separation_m;
            // Across it is in proportion to either wheel, and inversely to the separation.
            let across = Vector3::new(-across_m * sin, across_m * cos, 0.0);
            let steps = [
                along * (0.5 * travel_m.left) - by_turn * (travel_m.left * per_m) + across,
                along * (0.5 * travel_m.right) + by_turn * (travel_m.right * per_m) + across,
                -by_turn * of_counts.turn_rad - across,
            ];
            for (by, of_step) in moved.by_geometry.iter_mut().zip(steps) {
                *by = turned(*by, step) + of_step;
            }
            moved.motion = Pose::new(before.x_m + step.x, before.y_m + step.y, before.theta_rad + step.z);
            // As if the rest of the interval led back to its start: one turn at the end then does for all
            // steps.
            let by_turn = by_turn + Vector3::new(moved.motion.y_m, -moved.motion.x_m, 0.0);
            let propagations = self
                .propagation_by_terms
                .x
                .iter_mut()
                .zip(&mut self.propagation_by_terms.y)
                .zip(&mut self.propagation_by_terms.theta);
            for (((x, y), theta), gradient) in propagations.zip(&self.gradients) {
                *x += chord * cos * gradient.x_m - sin * gradient.y_m + by_turn.x * gradient.theta_rad;
                *y += chord * sin * gradient.x_m + cos * gradient.y_m + by_turn.y * gradient.theta_rad;
                *theta += gradient.theta_rad;
            }
            self.session_m += of_counts.distance_m.abs();
            self.wheel_rad = self.wheel_rad.zip_with(interval.wheel_rad, |angle, rad| angle + rad);
        }
        let end = Vector3::new(moved.motion.x_m, moved.motion.y_m, 0.0);
        self.propagation_by_terms.turn(end);
        moved
    }

    /// Goes over intervals before the first measurement that is taken: wheels turn and terms remember, as
    /// where a run is cut into blocks or its measurements are thinned.
    pub(crate) fn skip(&mut self, intervals: Range<usize>) {
        if !matches!(self.propagations, PropagationSource::Cached(..)) {
            let _ = self.dead_reckon(Pose::IDENTITY, intervals);
        }
    }

    /// The pose of the drive's centre after some intervals, by exact arcs, without derivatives.
    pub(crate) fn dead_reckon(&mut self, mut pose: Pose, intervals: Range<usize>) -> Pose {
        let Model { m_per_rad, separation_m, .. } = *self.model;
        for interval in &self.segment.intervals[intervals] {
            let travel_m = m_per_rad.zip_with(interval.wheel_rad, |m_per_rad, rad| m_per_rad * rad);
            let Increment { distance_m, turn_rad } = Increment::from_travel(travel_m, separation_m);
            self.term_gradients(interval, travel_m, self.run_from_chain * pose);
            let of_terms @ Pose { x_m, y_m, theta_rad } = self.sum_of_terms();
            self.twist_of_terms = Twist::of_motion(of_terms, interval.dt_s);
            let arc = Increment { distance_m: distance_m + x_m, turn_rad: turn_rad + theta_rad }.arc();
            let across_m = self.model.across_m(interval);
            pose = pose * arc * Pose::new(0.0, y_m + across_m, 0.0);
            self.session_m += distance_m.abs();
            self.wheel_rad = self.wheel_rad.zip_with(interval.wheel_rad, |angle, rad| angle + rad);
        }
        pose
    }

    /// What terms and latency add to a measurement after so many intervals, in the frame of the body.
    pub(crate) fn measurement_offset(&mut self, pose: Pose, t_s: f64, after: usize, latency_s: f64) -> Pose {
        let twist = self.twist(self.segment.rate_at(after, t_s));
        self.measurement(pose, 0, t_s, twist);
        let Pose { x_m, y_m, theta_rad } = self.sum_of_terms();
        let late = self.twist(self.segment.rate_at(after, t_s - 0.5 * latency_s));
        let back = Increment { distance_m: -late.v_m_s * latency_s, turn_rad: -late.omega_rad_s * latency_s }.arc();
        Pose::new(x_m + back.x_m, y_m + back.y_m, theta_rad + back.theta_rad)
    }

    /// The sum of the terms' latest gradients, times their values.
    pub(crate) fn sum_of_terms(&self) -> Pose {
        self.gradients.iter().zip(&self.model.term_values).fold(Pose::IDENTITY, |sum, (gradient, size)| {
            Pose::new(
                sum.x_m + size * gradient.x_m,
                sum.y_m + size * gradient.y_m,
                sum.theta_rad + size * gradient.theta_rad,
            )
        })
    }

    #[inline(always)]
    fn term_gradients(&mut self, interval: &WheelInterval, travel_m: Wheels<f64>, world_from_body: Pose) {
        let m_per_rad = self.model.m_per_rad;
        let interval = Interval {
            t_s: interval.t_s,
            dt_s: interval.dt_s,
            late_s: interval.late_s,
            travel_m,
            speed_m_s: m_per_rad.zip_with(interval.rate_rad_s, |m_per_rad, rate| m_per_rad * rate),
            speed_at_ends_m_s: interval
                .rate_at_ends_rad_s
                .map(|rate_rad_s| m_per_rad.zip_with(rate_rad_s, |m_per_rad, rate| m_per_rad * rate)),
            count_m: m_per_rad.zip_with(self.segment.quantum_rad, |m_per_rad, rad| m_per_rad * rad),
            wheel_separation_m: self.model.separation_m,
            wheel_rad: self.wheel_rad,
            turned_rad: interval.wheel_rad,
            world_from_body,
            session_m: self.session_m,
            run: self.segment.info,
        };
        self.ask_terms(|term, own| term.motion(&interval, own));
    }
}

/// Terms, each with its columns of the gradients.
fn with_columns(terms: &[Box<dyn ModelTerm>]) -> impl Iterator<Item = (&dyn ModelTerm, Range<usize>)> {
    terms.iter().scan(0, |end, term| {
        let start = *end;
        *end += term.parameters().len();
        Some((&**term, start..*end))
    })
}

/// A derivative carried over a step: a heading error turns the motion after it.
#[inline(always)]
fn turned(by: Vector3<f64>, step: Vector3<f64>) -> Vector3<f64> {
    Vector3::new(by.x - step.y * by.z, by.y + step.x * by.z, by.z)
}
