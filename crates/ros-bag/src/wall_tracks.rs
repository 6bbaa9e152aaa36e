//! The same wall from scan to scan: by where the nominal odometry expects it after the scan in which it was
//! seen last. A line that two walls expect, or two lines that one wall expects, are nobody's.

use dataset::WallReading;
use kinematics::{Pose, wrap_to_pi};

use crate::nominal_path::NominalPath;
use crate::settings::{
    MAX_LIDAR_LEVER_M, MAX_WALL_HEADING_TOLERANCE_RAD, MAX_WALLS_PER_RUN, MIN_WALL_DISCRIMINATION, MIN_WALL_READINGS,
    WALL_DISTANCE_TOLERANCE_M, WALL_DRIVE_SHARE, WALL_HEADING_TOLERANCE_RAD, WALL_TURN_SHARE,
};
use crate::wall_line::WallLine;

/// A wall that is followed, as it was seen last.
struct Track {
    t_s: f64,
    heading_rad: f64,
    distance_m: f64,
    readings: Vec<WallReading>,
}

/// The walls of a run.
#[derive(Debug, Default)]
pub(crate) struct FollowedWalls {
    /// In the order of time.
    pub(crate) readings: Vec<WallReading>,
    pub(crate) walls: usize,
    /// Lines that may be of two walls.
    pub(crate) ambiguous: usize,
    /// Lines of walls that were seen too seldom.
    pub(crate) seldom: usize,
}

/// Follows the walls of a run's scans, which are in the order of time: instants, and what stands there.
/// `body_from_lidar` is where the lidar is known to stand.
pub(crate) fn follow(
    scans: &[Vec<(f64, WallLine)>],
    path: &NominalPath,
    body_from_lidar: Option<Pose>,
) -> FollowedWalls {
    let mut tracks: Vec<Track> = Vec::new();
    let mut found = FollowedWalls::default();
    for lines in scans {
        let misfits: Vec<Vec<f64>> = lines
            .iter()
            .map(|(t_s, line)| tracks.iter().map(|track| misfit(track, *t_s, line, path, body_from_lidar)).collect())
            .collect();
        let known = tracks.len();
        for (number, (t_s, line)) in lines.iter().enumerate() {
            let of_line = &misfits[number];
            let best = (0..known).min_by(|a, b| of_line[*a].total_cmp(&of_line[*b]));
            let Some(best) = best.filter(|best| of_line[*best] <= 1.0) else {
                let track = Track { t_s: *t_s, heading_rad: 0.0, distance_m: 0.0, readings: Vec::new() };
                tracks.push(track);
                if let Some(track) = tracks.last_mut() {
                    track.see(*t_s, line);
                }
                continue;
            };
            let least = MIN_WALL_DISCRIMINATION * of_line[best];
            let of_others = (0..known).filter(|track| *track != best).map(|track| of_line[track]);
            let of_other_lines = misfits.iter().enumerate().filter(|(other, _)| *other != number);
            let mut rivals = of_others.chain(of_other_lines.map(|(_, of)| of[best]));
            if rivals.any(|rival| rival <= 1.0 && rival < least) {
                found.ambiguous += 1;
            } else {
                tracks[best].see(*t_s, line);
            }
        }
    }
    let (mut kept, seldom): (Vec<Track>, Vec<Track>) =
        tracks.into_iter().partition(|track| track.readings.len() >= MIN_WALL_READINGS);
    kept.sort_by_key(|track| std::cmp::Reverse(track.readings.len()));
    let beyond = kept.split_off(kept.len().min(MAX_WALLS_PER_RUN));
    found.seldom = seldom.iter().chain(&beyond).map(|track| track.readings.len()).sum();
    found.walls = kept.len();
    kept.sort_by(|a, b| a.readings[0].t_s.total_cmp(&b.readings[0].t_s));
    for (number, track) in kept.into_iter().enumerate() {
        let named =
            track.readings.into_iter().map(|reading| WallReading { wall: format!("wall-{}", number + 1), ..reading });
        found.readings.extend(named);
    }
    found.readings.sort_by(|a, b| a.t_s.total_cmp(&b.t_s));
    found
}

impl Track {
    fn see(&mut self, t_s: f64, line: &WallLine) {
        (self.t_s, self.heading_rad, self.distance_m) = (t_s, line.heading_rad, line.distance_m);
        self.readings.push(WallReading {
            t_s,
            wall: String::new(),
            distance_m: Some(line.distance_m),
            heading_rad: Some(line.heading_rad),
            sigma_m: Some(line.sigma_m),
            sigma_rad: Some(line.sigma_rad),
        });
    }
}

/// How far a line is off from where a wall is expected, in tolerances.
fn misfit(track: &Track, t_s: f64, line: &WallLine, path: &NominalPath, body_from_lidar: Option<Pose>) -> f64 {
    let motion = path.at(track.t_s).zip(path.at(t_s)).zip(path.moved(track.t_s, t_s));
    let Some(((from, to), (driven_m, turned_rad))) = motion else { return f64::INFINITY };
    let heading_rad = track.heading_rad + to.theta_rad - from.theta_rad;
    let heading_tolerance_rad = WALL_HEADING_TOLERANCE_RAD + WALL_TURN_SHARE * turned_rad;
    if heading_tolerance_rad > MAX_WALL_HEADING_TOLERANCE_RAD {
        return f64::INFINITY;
    }
    let tolerance_m = WALL_DISTANCE_TOLERANCE_M + WALL_DRIVE_SHARE * driven_m;
    let (distance_m, tolerance_m) = match body_from_lidar {
        Some(body_from_lidar) => {
            let [from, to] = [from * body_from_lidar, to * body_from_lidar];
            let (sin, cos) = (from.theta_rad - track.heading_rad).sin_cos();
            let nearer_m = cos * (to.y_m - from.y_m) - sin * (to.x_m - from.x_m);
            (track.distance_m - nearer_m, tolerance_m)
        }
        None => {
            // A lidar of unknown place swings around the drive's centre.
            let turn_rad = (to.theta_rad - from.theta_rad).abs().min(std::f64::consts::PI);
            let swing_m = 2.0 * MAX_LIDAR_LEVER_M * (0.5 * turn_rad).sin();
            (track.distance_m, tolerance_m + swing_m + driven_m)
        }
    };
    let of_heading = wrap_to_pi(line.heading_rad - heading_rad).abs() / heading_tolerance_rad;
    of_heading.max((line.distance_m - distance_m).abs() / tolerance_m)
}
