//! Stretches of a track that are beyond wheels.

use std::ops::Range;

use dataset::quantile;
use kinematics::{Pose, wrap_to_pi};

use crate::records::pose_windows::{CalibratedTracks, Residual, Window};
use crate::settings::RECORDS;

/// What moved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum AnomalyKind {
    /// The frame of the instrument: no robot is as fast.
    Frame,
    /// The robot or the frame of the instrument.
    RobotOrFrame,
    /// The place of the instrument on the robot.
    ExtrinsicPosition,
    /// Its heading on the robot.
    ExtrinsicHeading,
}

/// A stretch of a track that the wheels do not explain.
pub(crate) struct Event {
    /// The pose before it to the pose after it.
    pub(crate) poses: Range<usize>,
    pub(crate) kind: AnomalyKind,
    pub(crate) displacement: Residual,
    pub(crate) sigmas: f64,
}

/// What wheels may leave of windows.
pub(crate) struct Limits {
    /// Least that no wheel misses.
    least: Residual,
    /// Least distance by which an instrument is mounted elsewhere, metres.
    pub(crate) place_m: f64,
    /// Standard deviations of windows of each span, by the 90 % quantile.
    sigmas: Vec<Residual>,
}

impl Limits {
    /// By the windows of all tracks, and by what the robot moves in the time that stamps may be wrong by.
    pub(crate) fn of(calibrated: &CalibratedTracks<'_>, separation_m: f64, tick_s: f64) -> Self {
        let of_span = |span: &usize| {
            let mut all: [Vec<f64>; 3] = Default::default();
            for (track, of) in calibrated.tracks.iter().enumerate() {
                for from in 0..of.len().saturating_sub(*span) {
                    let residual = calibrated.residual(track, Window { from, to: from + span });
                    all.iter_mut().zip(residual.iter()).for_each(|(all, residual)| all.push(residual.abs()));
                }
            }
            // 0.9 of a normal variable is within 1.645 standard deviations.
            let sigma = |all: Vec<f64>| {
                quantile(all, 0.9).map_or(f64::INFINITY, |of| (of / 1.645).max(RECORDS.min_window_sigma))
            };
            let [along, across, turn] = all.map(sigma);
            Residual::new(along, across, turn)
        };
        let least = Residual::new(
            RECORDS.min_unknown_along_separations * separation_m,
            RECORDS.min_unknown_across_separations * separation_m,
            RECORDS.min_unknown_turn_rad,
        );
        let (speed_m_s, rate_rad_s) = if tick_s > 0.0 { brisk_rates(calibrated) } else { (0.0, 0.0) };
        let by_a_tick = tick_s * Residual::new(speed_m_s, speed_m_s, rate_rad_s);
        let place_m = RECORDS.min_other_extrinsics_separations * separation_m;
        Self { least: least + by_a_tick, place_m, sigmas: RECORDS.window_spans.iter().map(of_span).collect() }
    }

    /// Standard deviations of a residual that is beyond wheels.
    fn excess(&self, residual: &Residual, sigma: &Residual) -> Option<f64> {
        self.excess_of(residual, sigma, RECORDS.min_unknown_sigmas)
    }

    /// The same where it takes so many.
    fn excess_of(&self, residual: &Residual, sigma: &Residual, least: f64) -> Option<f64> {
        let exceeds = |axis: usize| {
            let z = residual[axis].abs() / sigma[axis];
            (residual[axis].abs() > self.least[axis] && z > least).then_some(z)
        };
        (0..3).filter_map(exceeds).max_by(f64::total_cmp)
    }

    /// Whether the residual of a window around a displacement has it still.
    fn shows(&self, displacement: &Residual, residual: &Residual) -> bool {
        let (left, place_m) = (residual - displacement, displacement.x.hypot(displacement.y).max(self.least.y));
        left.x.hypot(left.y) < 0.5 * place_m && left.z.abs() < 0.5 * displacement.z.abs().max(self.least.z)
    }

    /// Longer windows around a displacement, while they would show it. Rows that are stamped late let counts
    /// fall behind over as long as they are late, and catch up at once: what came at once is undone by what
    /// was before.
    fn surrounding<'a>(
        &'a self,
        calibrated: &'a CalibratedTracks<'_>,
        track: usize,
        window: Window,
        displacement: &'a Residual,
    ) -> impl Iterator<Item = Window> + 'a {
        let of = &calibrated.tracks[track];
        let longer = move |poses| Some(Window { from: window.from.checked_sub(poses)?, to: window.to + poses });
        let within = move |Window { from, to }: &Window| {
            let around_s = (of.t_s[window.from] - of.t_s[*from]).max(of.t_s[*to] - of.t_s[window.to]);
            let sigma = RECORDS.window_spans.iter().zip(&self.sigmas).find(|(span, _)| **span >= to - from);
            around_s < RECORDS.max_undone_s
                && sigma.is_some_and(|(_, sigma)| {
                    self.excess_of(displacement, sigma, RECORDS.min_surrounding_sigmas).is_some()
                })
        };
        RECORDS.window_spans.into_iter().filter_map(longer).filter(|longer| longer.to < of.len()).take_while(within)
    }

    /// The stretches of one track that are beyond wheels, with the instrument somewhere on the robot: by the
    /// shortest windows that show them.
    pub(crate) fn events(&self, calibrated: &CalibratedTracks<'_>, track: usize, sensor: Pose) -> Vec<Event> {
        let of_track = calibrated.tracks[track].len();
        let mut found: Vec<Event> = Vec::new();
        let mut tried: Vec<Range<usize>> = Vec::new();
        for (span, sigma) in RECORDS.window_spans.into_iter().zip(&self.sigmas) {
            let mut stretches: Vec<Range<usize>> = Vec::new();
            for from in 0..of_track.saturating_sub(span) {
                let is_tried = tried.iter().any(|range| from < range.end - 1 && range.start < from + span);
                let window = Window { from, to: from + span };
                let residual = calibrated.residual_of(sensor, track, window);
                if is_tried || calibrated.tracks[track].has_gap(window) || self.excess(&residual, sigma).is_none() {
                    continue;
                }
                match stretches.last_mut() {
                    // With a pair between them they are one.
                    Some(last) if from <= last.end => last.end = from + span + 1,
                    _ => stretches.push(from..from + span + 1),
                }
            }
            for stretch in stretches {
                // What moved for a while moved a little before and after it.
                let is_step = stretch.len() == 2;
                let poses =
                    if is_step { stretch } else { stretch.start.saturating_sub(1)..(stretch.end + 1).min(of_track) };
                tried.push(poses.clone());
                let window = Window { from: poses.start, to: poses.end - 1 };
                let displacement = calibrated.residual_of(sensor, track, window);
                let Some(sigmas) = self.excess(&displacement, sigma) else { continue };
                // Outliers are undone by the next measurement: those before and after it say the same.
                let Some(from) = window.from.checked_sub(1).filter(|_| window.to + 1 < of_track) else { continue };
                let to = window.to + 1;
                let others = [Window { from, ..window }, Window { to, ..window }, Window { from, to }];
                let agrees = |other| self.shows(&displacement, &calibrated.residual_of(sensor, track, other));
                if !others.into_iter().all(agrees)
                    || !self.surrounding(calibrated, track, window, &displacement).all(agrees)
                {
                    continue;
                }
                let is_frame = is_step && is_too_fast(calibrated, track, window, &displacement);
                let kind = if is_frame { AnomalyKind::Frame } else { AnomalyKind::RobotOrFrame };
                found.push(Event { poses, kind, displacement, sigmas });
            }
        }
        found.sort_by_key(|event| event.poses.start);
        found
    }
}

/// Speed and turn rate of the robot from pose to pose of a track, m/s and rad/s.
fn rates<'c>(calibrated: &'c CalibratedTracks<'_>, track: usize) -> impl Iterator<Item = (f64, f64)> + 'c {
    let (t_s, poses) = (&calibrated.tracks[track].t_s, calibrated.poses(track));
    (1..t_s.len()).map(move |to| {
        let (moved, time_s) = (poses[to - 1].to(poses[to]), t_s[to] - t_s[to - 1]);
        (moved.x_m.hypot(moved.y_m) / time_s, wrap_to_pi(moved.theta_rad).abs() / time_s)
    })
}

/// Speed and turn rate of the robot where it is brisk, by the 90 % quantile, m/s and rad/s.
fn brisk_rates(calibrated: &CalibratedTracks<'_>) -> (f64, f64) {
    let (speeds, turn_rates) = (0..calibrated.tracks.len()).flat_map(|track| rates(calibrated, track)).unzip();
    let brisk = |all: Vec<f64>| quantile(all, 0.9).filter(|of| of.is_finite()).unwrap_or(0.0);
    (brisk(speeds), brisk(turn_rates))
}

/// Whether no robot moves so far in the time: by what is faster than anything in this run.
fn is_too_fast(calibrated: &CalibratedTracks<'_>, track: usize, window: Window, displacement: &Residual) -> bool {
    let of = &calibrated.tracks[track];
    let fastest = rates(calibrated, track).fold((0.0_f64, 0.0_f64), |most, of| (most.0.max(of.0), most.1.max(of.1)));
    let time_s = RECORDS.implausible_speed_ratio * (of.t_s[window.to] - of.t_s[window.from]);
    displacement.x.hypot(displacement.y) > fastest.0 * time_s || displacement.z.abs() > fastest.1 * time_s
}
