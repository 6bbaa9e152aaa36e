//! A segment: counts and measurements without a gap between them.

use dataset::RunInfo;
use kinematics::{Pose, Wheels, wrap_to_pi};

use crate::model::Model;
use crate::noise_shape::NoiseShape;
use crate::recorded_rates::RateRounding;
use crate::settings::{COMMON, TIME_TOLERANCE_S};
use crate::wheel_angles::WheelInterval;
use crate::wheel_rates::RateWindow;

/// A pose that the instrument measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct MeasuredPose {
    pub(crate) t_s: f64,
    pub(crate) x_m: f64,
    pub(crate) y_m: f64,
    pub(crate) theta_rad: Option<f64>,
    /// Number of intervals of the segment before it.
    pub(crate) after: usize,
    /// Variances of position and heading, over those of a measurement that states none of its own; of a
    /// shape their lower bounds.
    pub(crate) variance_factor: [f64; 2],
    /// The covariance, where two factors do not tell it.
    pub(crate) shape: Option<NoiseShape>,
}

/// Where a segment starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Start {
    /// At its first measurement, with that measurement's errors.
    MeasuredPose,
    /// With the instrument at the origin of its own frame.
    Origin,
}

/// Counts and measurements without a gap.
#[derive(Debug, Clone)]
pub struct Segment<'a> {
    /// Which run: session and run in the order given.
    pub run: (usize, usize),
    /// The run.
    pub info: &'a RunInfo,
    pub(crate) start: Start,
    /// It starts where the segment before it ended: a displacement after a displacement.
    pub(crate) continues: bool,
    pub(crate) intervals: Vec<WheelInterval>,
    pub(crate) measurements: Vec<MeasuredPose>,
    /// Angle of each wheel at the first interval, by its counter, radians.
    pub(crate) wheel_rad: Wheels<f64>,
    /// What a count of each wheel stands for, radians; 0 where angles are not rounded.
    pub(crate) quantum_rad: Wheels<f64>,
    pub(crate) rate_window: RateWindow,
    /// The rounding of recorded rates.
    pub(crate) rate_rounding: RateRounding,
    /// Distance driven in the session before, metres, by nominal values.
    pub(crate) session_m: f64,
}

impl Segment<'_> {
    /// Is it a displacement, which measures a motion between two instants instead of a pose?
    #[must_use]
    pub fn is_displacement(&self) -> bool {
        self.start == Start::Origin
    }

    /// Does it start at a measured position without a heading, which is a parameter then?
    #[must_use]
    pub fn has_free_heading(&self) -> bool {
        self.start == Start::MeasuredPose
            && self.measurements.first().is_some_and(|measurement| measurement.theta_rad.is_none())
    }

    /// Are this segment and the next of one series, in which errors may be autocorrelated? Displacements of
    /// one run are; poses of two segments have a gap between them.
    pub(crate) fn is_in_series_with(&self, next: &Self) -> bool {
        self.is_displacement() && next.is_displacement() && self.run == next.run
    }

    /// For each measurement the time of the one before, seconds, and how far each wheel turned since,
    /// radians; no turn for a first measurement.
    #[must_use]
    pub fn since_previous_measurement(&self) -> Vec<(f64, Wheels<f64>)> {
        let start_s = match self.start {
            Start::MeasuredPose => self.measurements.first().map(|measurement| measurement.t_s),
            Start::Origin => self.intervals.first().map(|interval| interval.t_s),
        };
        let (mut before_s, mut after) = (start_s.unwrap_or(0.0), 0);
        let of = |measurement: &MeasuredPose| {
            let turned = self.intervals[after..measurement.after].iter();
            let turned = turned.fold(Wheels::both(0.0), |sum, interval| sum.zip_with(interval.wheel_rad, |a, b| a + b));
            let since = (before_s, turned);
            (before_s, after) = (measurement.t_s, measurement.after);
            since
        };
        self.measurements.iter().map(of).collect()
    }

    /// For each measurement, whether a wheel changed its speed since the measurement before, or within
    /// `speed_change_window_s` where that is longer, by more than `speed_change_ratio` of the fastest
    /// speed in the segment.
    #[must_use]
    pub fn changes_of_speed(&self) -> Vec<bool> {
        let speed = |interval: &WheelInterval| {
            interval.wheel_rad.map(|rad| if interval.dt_s > 0.0 { rad / interval.dt_s } else { 0.0 })
        };
        let fastest = self.intervals.iter().map(speed).map(|of| of.left.abs().max(of.right.abs())).fold(0.0, f64::max);
        let changes = |(measurement, (before_s, _)): (&MeasuredPose, (f64, Wheels<f64>))| {
            let from_s = (measurement.t_s - COMMON.speed_change_window_s).min(before_s);
            let near = self.intervals[..measurement.after]
                .iter()
                .rev()
                .take_while(|interval| interval.t_s + interval.dt_s > from_s);
            let (mut low, mut high) = (Wheels::both(f64::INFINITY), Wheels::both(f64::NEG_INFINITY));
            for of in near.map(speed) {
                low = low.zip_with(of, f64::min);
                high = high.zip_with(of, f64::max);
            }
            let change = high.zip_with(low, |high, low| high - low);
            change.left.max(change.right) > COMMON.speed_change_ratio * fastest
        };
        self.measurements.iter().zip(self.since_previous_measurement()).map(changes).collect()
    }

    /// Rates of the wheels at an instant near the end of some intervals, rad/s; beyond the first and the
    /// last, those there.
    pub(crate) fn rate_at(&self, after: usize, t_s: f64) -> Wheels<f64> {
        let mut at = after.min(self.intervals.len());
        while at > 0 && self.intervals[at - 1].t_s > t_s {
            at -= 1;
        }
        while at < self.intervals.len() && self.intervals[at].t_s + TIME_TOLERANCE_S < t_s {
            at += 1;
        }
        match at {
            0 => self.intervals.first().map_or(Wheels::both(0.0), |first| first.rate_at_ends_rad_s[0]),
            _ => self.intervals[at - 1].rate_at(t_s),
        }
    }

    /// The first measured pose with its time and the number of intervals before it, and the time and pose of
    /// the last; `None` where a heading is missing.
    #[allow(clippy::type_complexity)]
    pub(crate) fn ends(&self) -> Option<(Pose, (f64, usize), (f64, Pose))> {
        let pose =
            |measurement: &MeasuredPose| Some(Pose::new(measurement.x_m, measurement.y_m, measurement.theta_rad?));
        let last = self.measurements.last()?;
        let (start, first) = match self.start {
            Start::MeasuredPose => {
                let first = self.measurements.first()?;
                (pose(first)?, (first.t_s, first.after))
            }
            Start::Origin => (Pose::IDENTITY, (self.intervals.first()?.t_s, 0)),
        };
        Some((start, first, (last.t_s, pose(last)?)))
    }

    pub(crate) fn end_error(&self, model: &Model) -> Option<(f64, f64)> {
        let body_from_sensor = model.instrument(self.run).body_from_sensor;
        let pose = |measurement: &MeasuredPose| {
            Some(Pose::new(measurement.x_m, measurement.y_m, measurement.theta_rad?) * body_from_sensor.inverse())
        };
        let start = match self.start {
            Start::MeasuredPose => pose(self.measurements.first()?)?,
            Start::Origin => body_from_sensor.inverse(),
        };
        let end = pose(self.measurements.last()?)?;
        let dead_reckoned =
            self.intervals.iter().fold(start, |pose, interval| pose * model.increment(interval.wheel_rad).arc());
        let off_rad = wrap_to_pi(dead_reckoned.theta_rad - end.theta_rad).abs();
        Some((dead_reckoned.position().distance_m(end.position()), off_rad))
    }
}
