//! Runs in which the instrument was mounted otherwise than in the others.

use dataset::median;
use kinematics::{Pose, wrap_to_pi};

use super::events::{AnomalyKind, Event, Limits};
use crate::records::pose_windows::{CalibratedTracks, Window};
use crate::settings::RECORDS;

/// How the instrument is mounted otherwise than in the other runs.
pub(super) struct OtherExtrinsics {
    pub(super) kind: AnomalyKind,
    pub(super) displacement: Pose,
    pub(super) sigmas: f64,
}

/// Of all tracks, the few in which the instrument is mounted otherwise, where that explains what is beyond
/// wheels.
pub(super) fn other_extrinsics(
    calibrated: &CalibratedTracks<'_>,
    limits: &Limits,
    events: &[Vec<Event>],
) -> Vec<(usize, OtherExtrinsics)> {
    let of_track = |track: usize| {
        let spoiled: usize = events[track].iter().map(|event| event.poses.len() - 1).sum();
        // What lasts is the mounting's or nobody's.
        let lasts = spoiled as f64 > RECORDS.lasting_share * calibrated.tracks[track].len() as f64;
        let is_taken = |Window { from, to }: Window| {
            lasts || events[track].iter().all(|event| to <= event.poses.start || from >= event.poses.end - 1)
        };
        let (pose, sigmas) = calibrated.extrinsics(track, is_taken)?;
        if lasts && !limits.events(calibrated, track, pose).is_empty() {
            return None;
        }
        // Windows of noisy headings err together; the halves of a run do not.
        let middle = calibrated.tracks[track].len() / 2;
        let half = |first: bool| {
            let is_of_half = |window: Window| is_taken(window) && (window.from < middle) == first;
            calibrated.extrinsics(track, is_of_half).map(|(pose, _)| pose)
        };
        let halves = [half(true)?, half(false)?];
        Some((track, pose, halves, sigmas))
    };
    let extrinsics: Vec<(usize, Pose, [Pose; 2], [f64; 3])> =
        (0..calibrated.tracks.len()).filter_map(of_track).collect();
    let least = [limits.place_m, limits.place_m, RECORDS.min_other_extrinsics_rad];
    let reference = calibrated.body_from_sensor;
    let components = |pose: &Pose| {
        [pose.x_m - reference.x_m, pose.y_m - reference.y_m, wrap_to_pi(pose.theta_rad - reference.theta_rad)]
    };
    let mut found: Vec<(usize, OtherExtrinsics)> = Vec::new();
    for (axis, least) in least.into_iter().enumerate() {
        // The tracks that determine it.
        let of: Vec<(usize, f64, [f64; 2], f64)> = extrinsics
            .iter()
            .map(|(track, pose, halves, sigma)| {
                (*track, components(pose)[axis], halves.map(|half| components(&half)[axis]), sigma[axis])
            })
            .filter(|(.., sigma)| RECORDS.min_other_extrinsics_sigmas * sigma < RECORDS.max_least_extrinsics * least)
            .collect();
        if of.len() < RECORDS.min_extrinsics {
            continue;
        }
        let Some(middle) = median(of.iter().map(|(_, value, ..)| *value)) else { continue };
        // 1.4826 times the median of normal deviations is their standard deviation.
        let scatter = median(of.iter().map(|(_, value, ..)| (value - middle).abs())).map_or(0.0, |of| 1.4826 * of);
        let odd: Vec<(usize, f64, f64)> = of
            .iter()
            .filter(|(_, value, halves, _)| {
                halves.iter().all(|half| (half - middle) * (value - middle).signum() > 0.5 * (value - middle).abs())
            })
            .map(|(track, value, _, sigma)| (*track, value - middle, (value - middle).abs() / sigma.max(scatter)))
            .filter(|(_, off, z)| off.abs() > least && *z > RECORDS.min_other_extrinsics_sigmas)
            .collect();
        // Where many runs are odd, none is.
        if odd.len() > (of.len() / RECORDS.min_runs_per_odd_extrinsics).max(1) {
            continue;
        }
        for (track, off, sigmas) in odd {
            let (kind, displacement) = match axis {
                0 => (AnomalyKind::ExtrinsicPosition, Pose::new(off, 0.0, 0.0)),
                1 => (AnomalyKind::ExtrinsicPosition, Pose::new(0.0, off, 0.0)),
                _ => (AnomalyKind::ExtrinsicHeading, Pose::new(0.0, 0.0, off)),
            };
            match found.iter_mut().find(|(known, _)| *known == track) {
                None => found.push((track, OtherExtrinsics { kind, displacement, sigmas })),
                Some((_, known)) => {
                    known.displacement.x_m += displacement.x_m;
                    known.displacement.y_m += displacement.y_m;
                    known.displacement.theta_rad += displacement.theta_rad;
                    // It bears the name of what stands out most.
                    if sigmas > known.sigmas {
                        (known.kind, known.sigmas) = (kind, sigmas);
                    }
                }
            }
        }
    }
    found
}
