//! Runs and intervals that do not belong: where the robot moved, or the instrument's frame did, as no wheel
//! says, and runs in which the instrument was mounted otherwise.
//!
//! A robot that is pushed, a wheel that is lifted, a loop closure of the instrument's map, a marker that
//! slips: one such event in a run is explained by whatever term it pays best, and that term is then found.
//! Before any fit, windows between measured poses show them ([`crate::pose_windows`]): far beyond the noise
//! of windows as long, beyond what wheels that roll can miss, and not undone by the next measurements.
//! Nothing is compared across such a window afterwards, and a run of another mounting is left out.

use std::ops::Range;

use dataset::{Dataset, UnknownMotion};
use kinematics::{Pose, wrap_to_pi};

use crate::pose_windows::{CalibratedTracks, PoseTrack, Residual};
use crate::settings::records::{
    IMPLAUSIBLE_SPEED_RATIO, MAX_UNKNOWN_EVENTS_PER_RUN, MAX_UNKNOWN_SHARE, MIN_MOUNTINGS, MIN_OTHER_MOUNTING_RAD,
    MIN_OTHER_MOUNTING_SEPARATIONS, MIN_OTHER_MOUNTING_SIGMAS, MIN_RUNS_PER_ODD_CLOCK, MIN_UNKNOWN_ACROSS_SEPARATIONS,
    MIN_UNKNOWN_ALONG_SEPARATIONS, MIN_UNKNOWN_SIGMAS, MIN_UNKNOWN_TURN_RAD, WINDOW_SPANS,
};

/// What does not belong, where, and by how much.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Anomaly {
    pub(crate) kind: AnomalyKind,
    /// Id of the run.
    pub(crate) run: String,
    /// From when to when, seconds from the run's start.
    pub(crate) span_s: [f64; 2],
    /// Displacement: of the robot seen from where it was, or of the instrument on the robot.
    pub(crate) displaced: Pose,
    /// The largest of its components over its standard deviation.
    pub(crate) sigmas: f64,
}

/// What moved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum AnomalyKind {
    /// The frame of the instrument: no robot is as fast.
    Frame,
    /// The robot or the frame of the instrument.
    RobotOrFrame,
    /// The place of the instrument on the robot.
    MountingPlace,
    /// Its heading on the robot.
    MountingHeading,
}

/// What was found, and the records without it.
pub(crate) struct UnknownMotions {
    pub(crate) anomalies: Vec<Anomaly>,
    pub(crate) records: Vec<Dataset>,
}

/// Looks for them; `None` where there are none.
pub(crate) fn unknown_motions(datasets: &[Dataset]) -> Option<UnknownMotions> {
    let separation_m = datasets.first()?.robot.wheel_separation_m;
    let tracks = PoseTrack::of_all(datasets);
    let calibrated = CalibratedTracks::of(&tracks, separation_m)?;
    let whole: Vec<(usize, Range<usize>)> = tracks.iter().enumerate().map(|(track, of)| (track, 0..of.len())).collect();
    let otherwise = other_mountings(&calibrated, &whole, separation_m);
    let is_out = |track: usize| otherwise.iter().any(|(part, ..)| whole[*part].0 == track);
    let id = |track: usize| {
        let (session, run) = tracks[track].run;
        datasets[session].runs[run].info.id.clone()
    };
    let mut events = Vec::new();
    let thresholds = thresholds(&calibrated, &is_out);
    for track in (0..tracks.len()).filter(|track| !is_out(*track)) {
        events.extend(events_of(&calibrated, track, &thresholds, separation_m));
    }
    let pairs: usize = tracks.iter().map(|track| track.len() - 1).sum();
    let minutes: f64 = tracks.iter().map(|track| (track.t_s[track.len() - 1] - track.t_s[0]) / 60.0).sum();
    let most = MAX_UNKNOWN_EVENTS_PER_RUN * minutes.max(tracks.len() as f64);
    let spoiled: usize = events.iter().map(|event| event.poses.len() - 1).sum();
    if spoiled as f64 > MAX_UNKNOWN_SHARE * pairs as f64 || events.len() as f64 > most {
        events.clear();
    }
    let mut records = datasets.to_vec();
    let mut anomalies: Vec<Anomaly> = Vec::new();
    for event in &events {
        let track = &tracks[event.track];
        let span_s = [track.t_s[event.poses.start], track.t_s[event.poses.end - 1]];
        let (session, run) = track.run;
        records[session].runs[run].add_unknown_motion([UnknownMotion { from_s: span_s[0], to_s: span_s[1] }]);
        anomalies.push(Anomaly {
            kind: event.kind,
            run: id(event.track),
            span_s,
            displaced: Pose::new(event.displaced.x, event.displaced.y, event.displaced.z),
            sigmas: event.sigmas,
        });
    }
    let mut left_out: Vec<(usize, usize)> = Vec::new();
    for (part, kind, displaced, sigmas) in otherwise {
        let track = &tracks[whole[part].0];
        left_out.push(track.run);
        anomalies.push(Anomaly {
            kind,
            run: id(whole[part].0),
            span_s: [track.t_s[0], track.t_s[track.len() - 1]],
            displaced,
            sigmas,
        });
    }
    if anomalies.is_empty() {
        return None;
    }
    left_out.sort_unstable();
    for (session, run) in left_out.into_iter().rev() {
        records[session].runs.remove(run);
    }
    Some(UnknownMotions { anomalies, records })
}

/// A stretch of a track that the wheels do not explain.
struct Event {
    track: usize,
    /// The pose before it to the pose after it.
    poses: Range<usize>,
    kind: AnomalyKind,
    displaced: Residual,
    sigmas: f64,
}

/// Standard deviations of what wheels leave of windows of each span, by the 90 % quantile.
fn thresholds(calibrated: &CalibratedTracks<'_>, is_out: &dyn Fn(usize) -> bool) -> Vec<Residual> {
    let of_span = |span: &usize| {
        let mut all: [Vec<f64>; 3] = Default::default();
        for (track, of) in calibrated.tracks.iter().enumerate().filter(|(track, _)| !is_out(*track)) {
            for from in 0..of.len().saturating_sub(*span) {
                let residual = calibrated.residual(track, (from, from + span));
                all.iter_mut().zip(residual.iter()).for_each(|(all, residual)| all.push(residual.abs()));
            }
        }
        let quantile = |mut all: Vec<f64>| {
            all.sort_by(f64::total_cmp);
            // 0.9 of a normal variable is within 1.645 standard deviations.
            all.get(all.len() * 9 / 10).map_or(f64::INFINITY, |of| (of / 1.645).max(1e-4))
        };
        let [along, across, turn] = all.map(quantile);
        Residual::new(along, across, turn)
    };
    WINDOW_SPANS.iter().map(of_span).collect()
}

/// The stretches of one track, the shortest windows that show them first.
fn events_of(calibrated: &CalibratedTracks<'_>, track: usize, sigmas: &[Residual], separation_m: f64) -> Vec<Event> {
    let poses = calibrated.tracks[track].len();
    let least = Residual::new(
        MIN_UNKNOWN_ALONG_SEPARATIONS * separation_m,
        MIN_UNKNOWN_ACROSS_SEPARATIONS * separation_m,
        MIN_UNKNOWN_TURN_RAD,
    );
    let excess = |residual: &Residual, sigma: &Residual| {
        let exceeds = |axis: usize| {
            let z = residual[axis].abs() / sigma[axis];
            (residual[axis].abs() > least[axis] && z > MIN_UNKNOWN_SIGMAS).then_some(z)
        };
        (0..3).filter_map(exceeds).fold(None, |most: Option<f64>, z| Some(most.map_or(z, |most| most.max(z))))
    };
    let mut found: Vec<Event> = Vec::new();
    let mut tried: Vec<Range<usize>> = Vec::new();
    for (span, sigma) in WINDOW_SPANS.into_iter().zip(sigmas) {
        let overlaps = |tried: &[Range<usize>], from: usize| {
            tried.iter().any(|range| from < range.end - 1 && range.start < from + span)
        };
        let mut stretches: Vec<Range<usize>> = Vec::new();
        for from in 0..poses.saturating_sub(span) {
            let residual = calibrated.residual(track, (from, from + span));
            if overlaps(&tried, from) || excess(&residual, sigma).is_none() {
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
            let poses = if is_step { stretch } else { stretch.start.saturating_sub(1)..(stretch.end + 1).min(poses) };
            tried.push(poses.clone());
            let window = (poses.start, poses.end - 1);
            let displaced = calibrated.residual(track, window);
            // An outlier is undone by the next measurement.
            let Some(z) = excess(&displaced, sigma) else { continue };
            let kind = if is_step && is_too_fast(calibrated, track, window, &displaced) {
                AnomalyKind::Frame
            } else {
                AnomalyKind::RobotOrFrame
            };
            found.push(Event { track, poses, kind, displaced, sigmas: z });
        }
    }
    found.sort_by_key(|event| event.poses.start);
    found
}

/// Whether no robot moves so far in the time: by what is faster than anything in this run.
fn is_too_fast(
    calibrated: &CalibratedTracks<'_>,
    track: usize,
    (from, to): (usize, usize),
    displaced: &Residual,
) -> bool {
    let (of, poses) = (&calibrated.tracks[track], calibrated.poses(track));
    let rates = |window: (usize, usize)| {
        let moved = poses[window.0].to(poses[window.1]);
        let time_s = of.t_s[window.1] - of.t_s[window.0];
        (moved.x_m.hypot(moved.y_m) / time_s, wrap_to_pi(moved.theta_rad).abs() / time_s)
    };
    let fastest = (1..of.len())
        .map(|to| rates((to - 1, to)))
        .fold((0.0_f64, 0.0_f64), |most, of| (most.0.max(of.0), most.1.max(of.1)));
    let time_s = of.t_s[to] - of.t_s[from];
    displaced.x.hypot(displaced.y) > IMPLAUSIBLE_SPEED_RATIO * fastest.0 * time_s
        || displaced.z.abs() > IMPLAUSIBLE_SPEED_RATIO * fastest.1 * time_s
}

/// A part whose instrument is mounted otherwise than in the others: which, in what, by how much, and how many
/// standard deviations.
type OtherMounting = (usize, AnomalyKind, Pose, f64);

/// Of parts of tracks, the few in which the instrument is mounted otherwise.
fn other_mountings(
    calibrated: &CalibratedTracks<'_>,
    parts: &[(usize, Range<usize>)],
    separation_m: f64,
) -> Vec<OtherMounting> {
    let mountings: Vec<(usize, Pose, [f64; 3])> = parts
        .iter()
        .enumerate()
        .filter_map(|(number, (track, part))| {
            let (pose, covariance) = calibrated.mounting(*track, part.clone())?;
            Some((number, pose, [0, 1, 2].map(|axis| covariance[(axis, axis)].sqrt())))
        })
        .collect();
    let least = [MIN_OTHER_MOUNTING_SEPARATIONS * separation_m; 2].into_iter().chain([MIN_OTHER_MOUNTING_RAD]);
    let reference = calibrated.body_from_sensor;
    let components = |pose: &Pose| {
        [pose.x_m - reference.x_m, pose.y_m - reference.y_m, wrap_to_pi(pose.theta_rad - reference.theta_rad)]
    };
    let mut found: Vec<OtherMounting> = Vec::new();
    for (axis, least) in least.enumerate() {
        // Parts that determine it better than what would be another mounting.
        let of: Vec<(usize, f64, f64)> = mountings
            .iter()
            .map(|(number, pose, sigma)| (*number, components(pose)[axis], sigma[axis]))
            .filter(|(.., sigma)| sigma * MIN_OTHER_MOUNTING_SIGMAS < 10.0 * least)
            .collect();
        if of.len() < MIN_MOUNTINGS {
            continue;
        }
        let median = |mut all: Vec<f64>| {
            all.sort_by(f64::total_cmp);
            all[all.len() / 2]
        };
        let middle = median(of.iter().map(|(_, value, _)| *value).collect());
        // 1.4826 times the median of normal deviations is their standard deviation.
        let scatter = 1.4826 * median(of.iter().map(|(_, value, _)| (value - middle).abs()).collect());
        let odd: Vec<(usize, f64, f64)> = of
            .iter()
            .map(|(number, value, sigma)| (*number, value - middle, (value - middle).abs() / sigma.max(scatter)))
            .filter(|(_, off, z)| off.abs() > least && *z > MIN_OTHER_MOUNTING_SIGMAS)
            .collect();
        // Where many runs are odd, none is.
        if odd.len() > (of.len() / MIN_RUNS_PER_ODD_CLOCK).max(1) {
            continue;
        }
        for (number, off, z) in odd {
            let (kind, displaced) = match axis {
                0 => (AnomalyKind::MountingPlace, Pose::new(off, 0.0, 0.0)),
                1 => (AnomalyKind::MountingPlace, Pose::new(0.0, off, 0.0)),
                _ => (AnomalyKind::MountingHeading, Pose::new(0.0, 0.0, off)),
            };
            match found.iter_mut().find(|(known, ..)| *known == number) {
                None => found.push((number, kind, displaced, z)),
                Some((_, known_kind, known, known_z)) => {
                    known.x_m += displaced.x_m;
                    known.y_m += displaced.y_m;
                    known.theta_rad += displaced.theta_rad;
                    // It bears the name of what stands out most.
                    if z > *known_z {
                        (*known_kind, *known_z) = (kind, z);
                    }
                }
            }
        }
    }
    found
}
