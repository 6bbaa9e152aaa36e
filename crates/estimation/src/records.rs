//! Runs as segments: how the wheels turned between measurements, and what the instrument measured.
//!
//! Poses and positions make one segment a run, with a free start at the first measurement. A gap of the log
//! between two measurements, or a motion that the counts do not tell, begins a new segment. A displacement is
//! a segment of its own, which starts at the origin of its own frame. Displacements of a run go on from each
//! other: the heading in the room and the state of terms are carried from one to the next.

use std::cell::LazyCell;

use dataset::{CovarianceScale, MapDistortion, Run, RunView, Session, TruthSample};
use kinematics::Pose;
use preflight::SessionClock;
use rayon::prelude::*;
use rules::Rule;

use crate::model::{Column, Model};
use crate::noise::NoisePrior;
use crate::noise_shape::NoiseShape;
use crate::partial_records::{GyroSettings, PartialSegment, PosesOfRun, partial_segments};
use crate::poses_between_rows::{take_one_for_each_row, take_those_near_rows};
use crate::segment::{MeasuredPose, Segment, Start};
use crate::settings::{COMMON, PARTIAL, TIME_TOLERANCE_S};
use crate::wheel_angles::{WheelAngleInterpolator, WheelInterval};

/// All that sessions hold for the likelihood.
#[derive(Debug, Clone)]
pub struct Records<'a> {
    /// The segments in the order of sessions, runs and time.
    pub segments: Vec<Segment<'a>>,
    /// Partial measurements of runs, in the order of sessions, runs and time.
    pub(crate) partial: Vec<PartialSegment<'a>>,
    /// Standard deviation of the gyroscope's relative scale, where it is stated.
    pub(crate) gyro_scale_sigma: Option<f64>,
    /// The distortion of the map in which poses are, where it is stated: sessions have one map.
    pub map: Option<MapDistortion>,
    /// Rows state their precision up to one factor of positions and headings together.
    pub(crate) common_scale: bool,
    /// Runs without wheels or with fewer than two measurements.
    pub unused: Vec<(usize, usize)>,
    /// Ids of all runs by session.
    pub ids: Vec<Vec<String>>,
    /// By session, the clock of poses and displacements, as far as it was seen before anything was fitted. A
    /// latency that is fitted is what is left.
    pub clocks: Vec<SessionClock>,
}

impl<'a> Records<'a> {
    /// The segments of sessions. Standard deviations that rows state count relative to that of the
    /// instrument: the one that the first session states, or the prior.
    #[must_use]
    pub fn of(sessions: &[Session<'a>]) -> Self {
        let stated = sessions.first().and_then(|session| Some(Model::of(&session.robot.geometry().ok()?, 0)));
        Self::started(sessions, &[], stated.as_ref())
    }

    /// The same by the clock of each session, none for sessions beyond the end; and a drive to start from.
    pub(crate) fn started(sessions: &[Session<'a>], clocks: &[SessionClock], start: Option<&Model>) -> Self {
        let stated = sessions.first().map(|session| session.truth_noise).unwrap_or_default();
        Self::relative_to(sessions, NoisePrior::of(stated).measurement_sigma(), clocks, start)
    }

    /// The same relative to given standard deviations of position, metres, and heading, radians.
    pub(crate) fn relative_to(
        sessions: &[Session<'a>],
        reference: [f64; 2],
        clocks: &[SessionClock],
        start: Option<&Model>,
    ) -> Self {
        let clock = |session: usize| clocks.get(session).cloned().unwrap_or_default();
        let mut records = Self { clocks: (0..sessions.len()).map(clock).collect(), ..Self::nothing() };
        records.gyro_scale_sigma = sessions.iter().find_map(|session| session.truth_noise.gyro.scale_sigma);
        records.common_scale = sessions.iter().all(has_common_scale);
        records.map = sessions.iter().find_map(|session| session.truth_noise.map);
        for (number, session) in sessions.iter().enumerate() {
            // Its noise is sought in all rows of the session.
            let gyro = LazyCell::new(|| GyroSettings::of(session, start));
            let clock = &records.clocks[number];
            records.ids.push(session.runs.iter().map(|run| run.info().id.clone()).collect());
            let track_of = |run: &RunView<'a>| WheelAngleInterpolator::of(run, session.robot);
            let tracks: Vec<_> = session.runs.par_iter().map(track_of).collect();
            let (mut session_m, mut bases) = (0.0, Vec::with_capacity(tracks.len()));
            for (position, (run, track)) in session.runs.iter().zip(&tracks).enumerate() {
                session_m = run.run().session_m.unwrap_or(session_m);
                bases.push(track.as_ref().map(|track| (base((number, position), run, track, session_m), track)));
                session_m += track.as_ref().map_or(0.0, |track| track.distance_m(session.robot));
            }
            let of_run = |(run, base): (&RunView<'a>, &Option<(Segment<'a>, &WheelAngleInterpolator)>)| {
                let mut segments = Vec::new();
                let Some((base, track)) = base else { return segments };
                let start_s = run.info().start_s.unwrap_or(0.0);
                let Some(clock) = clock.of_run(&run.info().id) else { return segments };
                let log_s = |stamp_s: f64| clock.log_s(start_s, stamp_s);
                add_poses(&mut segments, base, track, run.run(), measured_poses(run, reference, log_s));
                for poses in &mut segments {
                    let Some(nominal) = start else { continue };
                    if !Rule::PosesBetweenRows.is_on() {
                        continue;
                    }
                    let all = poses.measurements.len();
                    take_one_for_each_row(poses, &run.odometry().t_s, nominal, reference);
                    take_those_near_rows(poses, nominal, reference);
                    let _ = Rule::PosesBetweenRows.applies(poses.measurements.len() < all);
                }
                add_displacements(&mut segments, base, track, run.run(), log_s);
                segments
            };
            let segments: Vec<Vec<Segment<'a>>> = session.runs.par_iter().zip(&bases).map(of_run).collect();
            for (position, ((run, base), segments)) in session.runs.iter().zip(&bases).zip(segments).enumerate() {
                let (before, partial_before) = (records.segments.len(), records.partial.len());
                records.segments.extend(segments);
                if let (Some((base, track)), Some(nominal)) = (base, start) {
                    let poses = PosesOfRun { segments: &records.segments[before..], first: before };
                    let lidar = session.truth_noise.lidar;
                    let partial = partial_segments(run, base, poses, track, nominal, &gyro, lidar);
                    records.partial.extend(partial);
                }
                if (records.segments.len(), records.partial.len()) == (before, partial_before) {
                    records.unused.push((number, position));
                }
            }
        }
        records
    }

    /// The same with other segments.
    pub(crate) fn with_segments(&self, segments: Vec<Segment<'a>>) -> Self {
        Self {
            segments,
            partial: self.partial.clone(),
            gyro_scale_sigma: self.gyro_scale_sigma,
            map: self.map,
            common_scale: self.common_scale,
            unused: self.unused.clone(),
            ids: self.ids.clone(),
            clocks: self.clocks.clone(),
        }
    }

    /// A copy, which takes all cores: a long log has a hundred megabytes.
    pub(crate) fn copied(&self) -> Self {
        self.with_segments(self.segments.par_iter().cloned().collect())
    }

    /// Of no run.
    pub(crate) fn nothing() -> Self {
        Self {
            segments: Vec::new(),
            partial: Vec::new(),
            gyro_scale_sigma: None,
            map: None,
            common_scale: false,
            unused: Vec::new(),
            ids: Vec::new(),
            clocks: Vec::new(),
        }
    }

    /// Does a gyroscope measure in some run?
    #[must_use]
    pub fn has_gyro(&self) -> bool {
        self.partial.iter().any(PartialSegment::has_gyro)
    }

    /// Are distances measured in some run by tape or from walls, which owe nothing to the map that poses are
    /// in?
    #[must_use]
    pub fn has_distances(&self) -> bool {
        self.partial.iter().any(PartialSegment::has_distances)
    }

    /// Standard deviation of the gyroscope's relative scale, before it is seen.
    pub(crate) fn gyro_scale_prior_sigma(&self) -> f64 {
        self.gyro_scale_sigma.unwrap_or(PARTIAL.gyro_scale_sigma)
    }

    /// Is the scale of the gyroscope stated?
    #[must_use]
    pub const fn is_gyro_scale_stated(&self) -> bool {
        self.gyro_scale_sigma.is_some()
    }

    /// Has some run partial measurements?
    #[must_use]
    pub const fn has_partial(&self) -> bool {
        !self.partial.is_empty()
    }

    /// Are partial measurements all that there is?
    #[must_use]
    pub const fn is_partial(&self) -> bool {
        self.segments.is_empty() && self.has_partial()
    }

    /// The records of a part of a run, under the indices of that run.
    pub(crate) fn belonging_to(mut self, run: (usize, usize)) -> Self {
        self.segments.iter_mut().for_each(|segment| segment.run = run);
        self.partial.iter_mut().for_each(|partial| partial.segment.run = run);
        self
    }

    /// Whether motions were measured row by row of the log: nothing but the lengths of the rows says then how
    /// long they lasted, where poses have stamps of their own clock.
    #[must_use]
    pub fn go_by_row_lengths(&self) -> bool {
        self.segments.iter().any(Segment::is_displacement)
    }

    /// How many measurements there are.
    #[must_use]
    pub fn measurements(&self) -> usize {
        let partial: usize = self.partial.iter().map(PartialSegment::partial_measurements).sum();
        partial + self.poses()
    }

    /// How many poses and displacements there are.
    fn poses(&self) -> usize {
        self.segments.iter().map(|segment| segment.measurements.len()).sum()
    }

    /// Mean distance that a wheel rolls between poses or displacements, metres, by a model.
    #[must_use]
    pub fn distance_between_measurements_m(&self, model: &Model) -> f64 {
        let of = |interval: &WheelInterval| {
            let distance_m = model.m_per_rad.zip_with(interval.wheel_rad, |m_per_rad, rad| (m_per_rad * rad).abs());
            0.5 * (distance_m.left + distance_m.right)
        };
        let distance_m: f64 = self.segments.iter().flat_map(|segment| &segment.intervals).map(of).sum();
        distance_m / self.poses().max(1) as f64
    }

    /// Time of a measurement of a segment, seconds from the run's start.
    #[must_use]
    pub fn measurement_s(&self, segment: usize, measurement: usize) -> Option<f64> {
        Some(self.segments.get(segment)?.measurements.get(measurement)?.t_s)
    }

    /// Final errors of dead reckoning in a run, from the first measurement of each segment to its last: of
    /// the position, metres, and of the heading, radians.
    pub(crate) fn end_errors(&self, run: (usize, usize), model: &Model) -> impl Iterator<Item = (f64, f64)> {
        self.segments.iter().filter(move |segment| segment.run == run).filter_map(|segment| segment.end_error(model))
    }

    /// The extrinsics that measurements depend on: without measured headings, none that turns them.
    pub(crate) fn extrinsics(&self) -> &'static [Column] {
        let mut measured = self.segments.iter().flat_map(|segment| &segment.measurements);
        let all = Column::EXTRINSICS.as_slice();
        if measured.any(|measurement| measurement.theta_rad.is_some()) { all } else { &all[..2] }
    }

    /// Largest measured distance from the start of a segment, metres; root mean square over the segments.
    #[must_use]
    pub fn extent_m(&self) -> f64 {
        let squares: f64 = self
            .segments
            .iter()
            .map(|segment| {
                let (x_m, y_m) = match (segment.start, segment.measurements.first()) {
                    (Start::MeasuredPose, Some(first)) => (first.x_m, first.y_m),
                    _ => (0.0, 0.0),
                };
                let squared_m2 = segment
                    .measurements
                    .iter()
                    .map(|measurement| (measurement.x_m - x_m).powi(2) + (measurement.y_m - y_m).powi(2));
                squared_m2.fold(0.0, f64::max)
            })
            .sum();
        let segments = self.segments.len().max(1) as f64;
        (squares / segments).sqrt()
    }

    /// Are two segments of one series, so that their errors may be autocorrelated?
    #[must_use]
    pub fn are_in_series(&self, segment: usize, next: usize) -> bool {
        let both = self.segments.get(segment).zip(self.segments.get(next));
        segment == next || both.is_some_and(|(segment, next)| segment.is_in_series_with(next))
    }

    /// Weight of a pair of innovations, `lag` measurements apart, in the test of autocorrelation. Within a
    /// segment the filter's state carries an error on, so that lag 1 shows it. Displacements have no such
    /// state, and all lags count, with falling weight.
    #[must_use]
    pub fn weight_of_pair(&self, segment: usize, next: usize, lag: i32) -> f64 {
        if segment == next {
            f64::from(u8::from(lag == 1))
        } else if self.are_in_series(segment, next) {
            COMMON.autocorrelation_decay.powi(lag - 1)
        } else {
            0.0
        }
    }

    /// Does a segment start where the one before it ended: a displacement after a displacement?
    #[must_use]
    pub fn continues(&self, segment: usize) -> bool {
        self.segments.get(segment).is_some_and(|segment| segment.continues)
    }

    /// Times between consecutive measurements, seconds; for displacements between their ends.
    pub fn times_between(&self) -> impl Iterator<Item = f64> + '_ {
        let series = self.segments.chunk_by(Segment::is_in_series_with);
        series.flat_map(|series| {
            let ends_s: Vec<f64> =
                series.iter().flat_map(|segment| &segment.measurements).map(|measurement| measurement.t_s).collect();
            // Displacements may end together, or in any order.
            let between_s = ends_s.windows(2).map(|pair| pair[1] - pair[0]).filter(|between_s| *between_s > 0.0);
            between_s.collect::<Vec<f64>>()
        })
    }
}

/// Does a session say so, and does every row state its precision?
fn has_common_scale(session: &Session<'_>) -> bool {
    let states_all = |run: &Run| {
        let states = |sigma: &dataset::TruthSigma| {
            sigma.covariance.is_some() || (sigma.sigma_xy_m.is_some() && sigma.sigma_theta_rad.is_some())
        };
        run.truth.is_empty() || run.truth_sigma.as_ref().is_some_and(|sigmas| sigmas.iter().all(states))
    };
    let is_common = session.truth_noise.covariance_scale == CovarianceScale::Common;
    is_common && session.runs.iter().all(|run| states_all(run.run()))
}

/// What the instrument measured in a run, at the log's instants of its stamps; intervals are not counted yet.
fn measured_poses(run: &RunView<'_>, reference: [f64; 2], log_s: impl Fn(f64) -> f64) -> Vec<MeasuredPose> {
    let Run { truth, truth_sigma, .. } = run.run();
    if truth.is_empty() {
        let poses = run.observed_poses().into_iter();
        return poses
            .map(|(t_s, Pose { x_m, y_m, theta_rad })| MeasuredPose {
                t_s: log_s(t_s),
                x_m,
                y_m,
                theta_rad: Some(theta_rad),
                after: 0,
                variance_factor: [1.0; 2],
                shape: None,
            })
            .collect();
    }
    let factor = |sigma: Option<f64>, reference: f64| {
        sigma.filter(|sigma| *sigma > 0.0).map_or(1.0, |sigma| (sigma / reference).powi(2))
    };
    let noise_of = |row: usize| {
        let stated = truth_sigma.as_ref().and_then(|sigmas| sigmas.get(row)).copied().unwrap_or_default();
        let factors = [factor(stated.sigma_xy_m, reference[0]), factor(stated.sigma_theta_rad, reference[1])];
        let Some(covariance) = stated.covariance else { return (factors, None) };
        let shape = NoiseShape::of(&covariance, reference, factors);
        shape.as_factors().map_or_else(|| (shape.least_factors(), Some(shape)), |factors| (factors, None))
    };
    let of = |(row, sample): (usize, &TruthSample)| {
        let (variance_factor, shape) = noise_of(row);
        MeasuredPose {
            t_s: log_s(sample.t_s),
            x_m: sample.x_m,
            y_m: sample.y_m,
            theta_rad: sample.theta_rad(),
            after: 0,
            variance_factor,
            shape,
        }
    };
    truth.iter().enumerate().map(of).collect()
}

/// A segment of a run without intervals and measurements.
fn base<'a>(
    run: (usize, usize),
    view: &RunView<'a>,
    track: &WheelAngleInterpolator<'_>,
    session_m: f64,
) -> Segment<'a> {
    Segment {
        run,
        info: view.info(),
        start: Start::MeasuredPose,
        continues: false,
        intervals: Vec::new(),
        measurements: Vec::new(),
        wheel_rad: track.first_rad(),
        quantum_rad: track.quantum_rad(),
        rate_window: track.rate_window(),
        rate_rounding: track.rate_rounding(),
        session_m,
    }
}

fn add_poses<'a>(
    segments: &mut Vec<Segment<'a>>,
    base: &Segment<'a>,
    track: &WheelAngleInterpolator<'_>,
    run: &Run,
    measurements: Vec<MeasuredPose>,
) {
    let mut cursor = track.cursor();
    let mut segment: Option<Segment<'a>> = None;
    let mut close = |segment: Option<Segment<'a>>| {
        segments.extend(segment.filter(|segment| segment.measurements.len() > 1).map(|mut segment| {
            segment.intervals.shrink_to_fit();
            segment.measurements.shrink_to_fit();
            segment
        }));
    };
    for measured in measurements {
        let Some(before_s) =
            segment.as_ref().and_then(|segment| segment.measurements.last()).map(|measurement| measurement.t_s)
        else {
            segment = begin(base, &mut cursor, measured);
            continue;
        };
        let joined = segment.as_mut().is_some_and(|segment| {
            let reaches = !run.is_motion_unknown(before_s, measured.t_s)
                && cursor.intervals(before_s, measured.t_s, &mut segment.intervals);
            if reaches {
                segment.measurements.push(MeasuredPose { after: segment.intervals.len(), ..measured });
            }
            reaches
        });
        if !joined {
            close(segment.take());
            segment = begin(base, &mut cursor, measured);
        }
    }
    close(segment);
}

fn begin<'a>(
    base: &Segment<'a>,
    cursor: &mut crate::wheel_angles::Cursor<'_, '_>,
    first: MeasuredPose,
) -> Option<Segment<'a>> {
    let wheel_rad = cursor.angle_rad(first.t_s)?.zip_with(base.wheel_rad, |turned, first| first + turned);
    Some(Segment { wheel_rad, measurements: vec![first], ..base.clone() })
}

fn add_displacements<'a>(
    segments: &mut Vec<Segment<'a>>,
    base: &Segment<'a>,
    track: &WheelAngleInterpolator<'_>,
    run: &Run,
    log_s: impl Fn(f64) -> f64,
) {
    let mut cursor = track.cursor();
    let mut last_s = f64::NEG_INFINITY;
    for measured in &run.displacements {
        let [from_s, to_s] = [measured.t0_s, measured.t1_s].map(&log_s);
        if run.is_motion_unknown(from_s, to_s) {
            continue;
        }
        let Some(turned_rad) = cursor.angle_rad(from_s) else { continue };
        let wheel_rad = turned_rad.zip_with(base.wheel_rad, |turned, first| first + turned);
        let mut intervals = Vec::new();
        if cursor.intervals(from_s, to_s, &mut intervals) {
            let pose = Pose::new(measured.dx_m, measured.dy_m, measured.dtheta_rad);
            let measurement = MeasuredPose {
                t_s: to_s,
                x_m: pose.x_m,
                y_m: pose.y_m,
                theta_rad: Some(pose.theta_rad),
                after: intervals.len(),
                variance_factor: [1.0; 2],
                shape: None,
            };
            let continues = (from_s - last_s).abs() <= TIME_TOLERANCE_S;
            last_s = to_s;
            segments.push(Segment {
                start: Start::Origin,
                continues,
                intervals,
                measurements: vec![measurement],
                wheel_rad,
                ..base.clone()
            });
        }
    }
}
