//! Measured poses beside partial measurements: which of them a phase takes, and what each says of the state
//! of [`crate::partial_filter`], as a whole with the covariance of its errors.

use kinematics::{Pose, sin_cos, wrap_to_pi};
use nalgebra::{Matrix3, MatrixXx3, Vector3};

use crate::model::{Column, Instrument, Model};
use crate::noise::{Noise, NoiseComponent};
use crate::noise_shape::{CorrelatedErrors, NoiseShape};
use crate::partial_observation::{Observation, Quantity};
use crate::partial_records::PartialSegment;
use crate::pass_options::OutlierGate;
use crate::products::Products;
use crate::propagation::{Propagator, turned_by};
use crate::segment::{MeasuredPose, Segment};
use crate::thinning::PropagationInterval;

/// The poses that a phase takes.
pub(crate) struct TakenPoses<'p> {
    segments: &'p [Segment<'p>],
    /// Start headings that are not measured, by segment.
    free_headings: &'p [f64],
    /// Which are taken: segment and measurement, in order; and of these the outliers.
    taken: Vec<(usize, usize)>,
    rejected: &'p [(usize, usize)],
}

impl<'p> TakenPoses<'p> {
    /// Of the propagation intervals of each segment, which end at them.
    pub(crate) fn of(
        segments: &'p [Segment<'p>],
        free_headings: &'p [f64],
        propagations: &[Vec<PropagationInterval>],
        rejected: &'p [(usize, usize)],
    ) -> Self {
        let of_segment = |(segment, propagations): (usize, &Vec<PropagationInterval>)| {
            let first = propagations.first().map(|first| (segment, first.from));
            first.into_iter().chain(propagations.iter().map(|of| (segment, of.measurement))).collect::<Vec<_>>()
        };
        let taken = propagations.iter().enumerate().flat_map(of_segment).collect();
        Self { segments, free_headings, taken, rejected }
    }

    /// A pose, if it is taken.
    pub(crate) fn get(&self, segment: usize, measurement: usize) -> Option<&'p MeasuredPose> {
        self.taken.binary_search(&(segment, measurement)).ok()?;
        self.segments.get(segment)?.measurements.get(measurement)
    }
}

/// What the filters of all segments share in a pass.
#[derive(Clone, Copy)]
pub(crate) struct PartialPass<'p> {
    pub(crate) poses: &'p TakenPoses<'p>,
    pub(crate) gate: OutlierGate,
    pub(crate) model: &'p Model,
    pub(crate) noise: &'p Noise,
    pub(crate) products: &'p Products,
}

/// Which measurements of a segment a filter takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Taking {
    All,
    PosesAlone,
}

impl TakenPoses<'_> {
    /// Does it take an observation?
    pub(crate) fn takes(&self, of: &Observation, taking: Taking) -> bool {
        match of.quantity {
            Quantity::MeasuredPose { segment, measurement } => self.get(segment, measurement).is_some(),
            _ => taking == Taking::All,
        }
    }

    /// Is a pose that is taken an outlier?
    pub(crate) fn is_outlier(&self, segment: usize, measurement: usize) -> bool {
        self.rejected.binary_search(&(segment, measurement)).is_ok()
    }

    /// Where a segment starts by its first pose that is taken: near enough to linearise there.
    pub(crate) fn start(&self, partial: &PartialSegment<'_>, model: &Model) -> Option<Pose> {
        let first = |of: &Observation| match of.quantity {
            Quantity::MeasuredPose { segment, measurement } => Some((of.to, segment, self.get(segment, measurement)?)),
            _ => None,
        };
        let (place, segment, measured) = partial.observations.iter().find_map(first)?;
        let heading_rad = measured.theta_rad.or_else(|| self.free_headings.get(segment).copied());
        let measured = Pose::new(measured.x_m, measured.y_m, heading_rad.unwrap_or(0.0));
        let intervals = &partial.segment.intervals[..partial.places[place].after];
        let moved =
            intervals.iter().fold(Pose::IDENTITY, |pose, interval| pose * model.increment(interval.wheel_rad).arc());
        Some(measured * model.instrument(partial.segment.run).body_from_sensor.inverse() * moved.inverse())
    }
}

/// A pose of the drive's centre in the filter's state.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StatePose {
    pub(crate) pose: Pose,
    /// Where it stands in the state.
    pub(crate) at: usize,
    /// Of the state.
    pub(crate) size: usize,
}

/// A measured pose as the filter takes it, in the room.
pub(crate) struct PoseUpdate {
    /// Derivatives of its coordinates by the state.
    pub(crate) by_state: MatrixXx3<f64>,
    /// The same by columns that do not act through the state: those from the first of the instrument on.
    pub(crate) direct: Vec<Vector3<f64>>,
    /// What was measured less what was expected.
    pub(crate) innovation: Vector3<f64>,
    /// Covariance of its errors, and its derivatives by the logarithms of both variances.
    pub(crate) errors: Matrix3<f64>,
    pub(crate) errors_by: [Matrix3<f64>; 2],
    /// Two where the heading is not measured.
    pub(crate) components: usize,
}

impl PoseUpdate {
    /// Of a measured pose at a place of a segment, where the drive's centre stands at a pose by the filter.
    /// What terms add comes from their state in force.
    pub(crate) fn of(
        measured: &MeasuredPose,
        partial: &PartialSegment<'_>,
        place: usize,
        StatePose { pose, at, size }: StatePose,
        model: &Model,
        noise: &Noise,
        propagator: &mut Propagator<'_, '_>,
    ) -> Self {
        let segment = &partial.segment;
        let after = partial.places[place].after;
        let Instrument { body_from_sensor, latency_s } = model.instrument(segment.run);
        let (sin, cos) = sin_cos(pose.theta_rad);
        let room = |of: Pose| Vector3::new(cos * of.x_m - sin * of.y_m, sin * of.x_m + cos * of.y_m, of.theta_rad);
        let mounted = room(body_from_sensor);
        // The instrument's velocity in the room so long before.
        let velocity = |ago_s: f64| {
            let twist = propagator.twist(segment.rate_at(after, measured.t_s - ago_s));
            let (ahead, turning) = (twist.v_m_s, twist.omega_rad_s);
            Vector3::new(cos * ahead - turning * mounted.y, sin * ahead + turning * mounted.x, turning)
        };
        let (moved, by_latency) = (velocity(0.5 * latency_s), velocity(latency_s));
        let turned_back_rad = latency_s * moved.z;
        let (moved, by_latency) = (turned_by(moved, -0.5 * turned_back_rad), turned_by(by_latency, -turned_back_rad));
        let by_terms = instrument_by_terms(partial, place, pose, measured.t_s, propagator);
        let of_terms: Vector3<f64> = model.term_values.iter().zip(&by_terms).map(|(size, by)| *by * *size).sum();
        let ahead = mounted - moved * latency_s + of_terms;
        let expected = Vector3::new(pose.x_m, pose.y_m, pose.theta_rad) + ahead;
        let has_heading = measured.theta_rad.is_some();
        let mut innovation = Vector3::new(measured.x_m, measured.y_m, measured.theta_rad.unwrap_or(0.0)) - expected;
        innovation.z = if has_heading { wrap_to_pi(innovation.z) } else { 0.0 };
        let mut by_state = MatrixXx3::zeros(size);
        (by_state[(at, 0)], by_state[(at + 1, 1)]) = (1.0, 1.0);
        by_state.set_row(at + 2, &Vector3::new(-ahead.y, ahead.x, f64::from(u8::from(has_heading))).transpose());
        let mut direct = vec![Vector3::new(cos, sin, 0.0), Vector3::new(-sin, cos, 0.0), Vector3::z(), -by_latency];
        direct.resize(Column::BASE.len() - Column::SensorX.index(), Vector3::zeros());
        direct.extend(by_terms);
        let variance = [NoiseComponent::MeasurementPosition, NoiseComponent::MeasurementHeading]
            .map(|component| noise.variance[component as usize]);
        let by_instant = by_latency * noise.timing_s2.sqrt();
        let (mut errors, mut errors_by) =
            match CorrelatedErrors::of(measured.shape, measured.variance_factor, by_instant) {
                Some(of) => (of.covariance(variance), of.covariance_by(variance)),
                None => {
                    let of = NoiseShape::independent(measured.variance_factor);
                    (of.covariance(variance), of.covariance_by(variance))
                }
            };
        if !has_heading {
            // A component of its own that says nothing.
            direct.iter_mut().for_each(|by| by.z = 0.0);
            for matrix in errors_by.iter_mut().chain([&mut errors]) {
                matrix.fill_row(2, 0.0);
                matrix.fill_column(2, 0.0);
            }
            errors[(2, 2)] = 1.0;
        }
        Self { by_state, direct, innovation, errors, errors_by, components: if has_heading { 3 } else { 2 } }
    }
}

/// What terms of unit size add to what an instrument sees of the robot's pose, at an instant and a place of a
/// segment where the drive's centre stands at `pose`, in the room. What they add comes from their state in
/// force.
pub(crate) fn instrument_by_terms(
    partial: &PartialSegment<'_>,
    place: usize,
    pose: Pose,
    t_s: f64,
    propagator: &mut Propagator<'_, '_>,
) -> Vec<Vector3<f64>> {
    let (sin, cos) = sin_cos(pose.theta_rad);
    let room = |of: &Pose| Vector3::new(cos * of.x_m - sin * of.y_m, sin * of.x_m + cos * of.y_m, of.theta_rad);
    let twist = propagator.twist(partial.segment.rate_at(partial.places[place].after, t_s));
    propagator.measurement(pose, place, t_s, twist);
    propagator.gradients.iter().map(room).collect()
}
