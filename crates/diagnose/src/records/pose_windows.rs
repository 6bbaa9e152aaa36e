//! Windows between measured poses, and what calibrated wheels leave of the motion over each: before any fit.
//!
//! With m the motion that the instrument reports from one pose to another, seen from the first, d the same by
//! dead reckoning of the wheels, θ_s and ℓ where the instrument is on the robot, and g the scale of the
//! wheels: R(θ_s) m g = d + (R(Δθ) − 1) ℓ, linear in g cos θ_s, g sin θ_s and ℓ. The turn is linear in the
//! travel of both wheels. Both are fitted by the sum of absolute residuals, to which single windows say
//! little. Reference: Censi et al. 2013, eq. 17–20 (the linear form); Holland & Welsch 1977 (iterative
//! reweighting).

use dataset::{Dataset, TruthSample, median};
use estimation::WheelAngleInterpolator;
use kinematics::{Increment, Pose, Wheels, wrap_to_pi};
use nalgebra::{Matrix2, Matrix3, Matrix4, Vector2, Vector3, Vector4};
use rayon::prelude::*;

use crate::records::log_rows::has_outlying_rows;
use crate::settings::RECORDS;

/// A window of a track, by the numbers of its first and its last pose.
#[derive(Clone, Copy)]
pub(crate) struct Window {
    pub(crate) from: usize,
    pub(crate) to: usize,
}

/// The measured poses of a run, and the travel of its wheels between them by nominal lengths.
pub(crate) struct PoseTrack {
    pub(crate) run: (usize, usize),
    pub(crate) t_s: Vec<f64>,
    measured: Vec<Pose>,
    /// Travel row by row, metres.
    steps_m: Vec<Wheels<f64>>,
    /// For each pose the number of steps before it.
    after: Vec<usize>,
    /// For each pose the number of gaps, where rows are missing, that have ended before it, and that have
    /// begun.
    gaps: Vec<(usize, usize)>,
}

impl PoseTrack {
    /// Of all runs that measure enough poses with headings, and whose counts are those of wheels.
    /// The instrument's poses are of so long before their stamps: a delay displaces every change of speed.
    pub(crate) fn of_all(datasets: &[Dataset], late_s: f64) -> Vec<Self> {
        let mut tracks = Vec::new();
        for (session, dataset) in datasets.iter().enumerate() {
            let of_run =
                |(position, run): (usize, &dataset::RunView<'_>)| Self::of(run, dataset, (session, position), late_s);
            tracks.par_extend(dataset.session().runs.par_iter().enumerate().filter_map(of_run));
        }
        tracks
    }

    fn of(run: &dataset::RunView<'_>, dataset: &Dataset, number: (usize, usize), late_s: f64) -> Option<Self> {
        if !run.info().continuous || run.run().truth.len() < RECORDS.min_window_poses || has_outlying_rows(run.run()) {
            return None;
        }
        let m_per_rad = dataset.robot.geometry().ok()?.m_per_rad();
        let track = WheelAngleInterpolator::of(run, &dataset.robot)?;
        let rows_s = &run.odometry().t_s;
        let (first_s, last_s) = (*rows_s.first()?, *rows_s.last()?);
        let angles = |row: usize| track.turns().as_ref().map(|turns| turns[row]);
        let between = |t_s: f64| turns_at(rows_s, track.turns(), t_s);
        let gap_s = RECORDS.min_gap_ratio * median(rows_s.windows(2).map(|pair| pair[1] - pair[0]))?;
        let mut of = Self { run: number, t_s: vec![], measured: vec![], steps_m: vec![], after: vec![], gaps: vec![] };
        let mut gaps = 0;
        let (mut last, mut row) = (Wheels::both(0.0), 0);
        let within = |sample: &&TruthSample| (first_s..=last_s).contains(&(sample.t_s - late_s));
        for sample in run.run().truth.iter().filter(within) {
            let taken_s = sample.t_s - late_s;
            let pose = Pose::new(sample.x_m, sample.y_m, sample.theta_rad()?);
            if of.t_s.is_empty() {
                last = between(taken_s);
                row = rows_s.partition_point(|row_s| *row_s <= taken_s);
            }
            let mut go = |to: Wheels<f64>| {
                let turned = to.zip_with(last, |to, last| to - last);
                of.steps_m.push(turned.zip_with(m_per_rad, |rad, m_per_rad| rad * m_per_rad));
                last = to;
            };
            while row < rows_s.len() && rows_s[row] <= taken_s {
                go(angles(row));
                gaps += usize::from(row > 0 && rows_s[row] - rows_s[row - 1] > gap_s);
                row += 1;
            }
            let within = row < rows_s.len() && row > 0 && rows_s[row] - rows_s[row - 1] > gap_s;
            go(between(taken_s));
            of.t_s.push(sample.t_s);
            of.measured.push(pose);
            of.after.push(of.steps_m.len());
            of.gaps.push((gaps, gaps + usize::from(within)));
        }
        (of.t_s.len() >= RECORDS.min_window_poses).then_some(of)
    }

    /// Are rows missing in a window? What the wheels did meanwhile may be missing with them.
    pub(crate) fn has_gap(&self, window: Window) -> bool {
        let ((ended, _), (_, begun)) = (self.gaps[window.from], self.gaps[window.to]);
        begun > ended
    }

    /// How many poses.
    pub(crate) fn len(&self) -> usize {
        self.t_s.len()
    }

    /// Travel of both wheels over a window, metres.
    fn travel_m(&self, window: Window) -> Wheels<f64> {
        let steps = &self.steps_m[self.after[window.from]..self.after[window.to]];
        steps.iter().fold(Wheels::both(0.0), |sum, step| sum.zip_with(*step, |a, b| a + b))
    }

    /// Motion over a window by the instrument, seen from its first pose.
    fn motion(&self, window: Window) -> Pose {
        self.measured[window.from].to(self.measured[window.to])
    }

    /// Poses by dead reckoning of a drive, from the first one.
    fn dead_reckoned(&self, drive: &Drive) -> Vec<Pose> {
        let (mut pose, mut done) = (Pose::IDENTITY, self.after[0]);
        let of = |after: &usize| {
            for step in &self.steps_m[done..*after] {
                let travel_m = step.zip_with(drive.scale, |m, scale| m * scale);
                pose = pose * Increment::from_travel(travel_m, drive.separation_m).arc();
            }
            done = *after;
            pose
        };
        self.after.iter().map(of).collect()
    }
}

/// Scales of both wheels over nominal, and the separation.
#[derive(Debug, Clone, Copy)]
struct Drive {
    scale: Wheels<f64>,
    separation_m: f64,
}

/// Tracks with wheels that are calibrated to what most windows say.
pub(crate) struct CalibratedTracks<'t> {
    pub(crate) tracks: &'t [PoseTrack],
    /// Numbers of measurements of the windows that calibrated them.
    pub(crate) span: usize,
    dead_reckoned: Vec<Vec<Pose>>,
    /// The instrument on the robot.
    pub(crate) body_from_sensor: Pose,
}

/// What wheels leave of the motion over a window: metres along and across the heading at its start, and
/// radians.
pub(crate) type Residual = Vector3<f64>;

impl<'t> CalibratedTracks<'t> {
    /// `None` where the windows do not determine the wheels.
    pub(crate) fn of(tracks: &'t [PoseTrack], separation_m: f64) -> Option<Self> {
        let span = span(tracks, separation_m)?;
        let of_all: Vec<(&PoseTrack, Window)> =
            tracks.iter().flat_map(|track| windows(track.len(), span).map(move |window| (track, window))).collect();
        // Turns.
        let rows: Vec<(Vector2<f64>, f64)> = of_all
            .iter()
            .map(|(track, window)| {
                let Wheels { left, right } = track.travel_m(*window);
                let nominal_rad = (right - left) / separation_m;
                (Vector2::new(left, right), wrap_to_pi(track.motion(*window).theta_rad - nominal_rad))
            })
            .collect();
        let mut per_m = Vector2::zeros();
        for _ in 0..RECORDS.reweightings {
            let (mut information, mut score) = (Matrix2::identity() * 1e-9, Vector2::zeros());
            for (row, turn_rad) in &rows {
                let weight = 1.0 / (turn_rad - row.dot(&per_m)).abs().max(1e-4);
                information += weight * row * row.transpose();
                score += weight * row * *turn_rad;
            }
            per_m = information.cholesky()?.solve(&score);
        }
        let [of_left, of_right] = [1.0 / separation_m - per_m[0], 1.0 / separation_m + per_m[1]];
        if !(of_left > 0.0 && of_right > 0.0) {
            return None;
        }
        let mean = 0.5 * (of_left + of_right);
        let mut drive =
            Drive { scale: Wheels { left: of_left / mean, right: of_right / mean }, separation_m: mean.recip() };
        // Places.
        let poses = |drive: &Drive| tracks.par_iter().map(|track| track.dead_reckoned(drive)).collect::<Vec<_>>();
        let dead_reckoned = poses(&drive);
        let rows: Vec<ExtrinsicsRow> = tracks
            .iter()
            .zip(&dead_reckoned)
            .flat_map(|(track, poses)| extrinsics_rows(track, poses, windows(track.len(), span)))
            .collect();
        let extrinsics = Extrinsics::of(&rows)?;
        let scale = extrinsics.scale();
        drive.scale = drive.scale.map(|of| of / scale);
        drive.separation_m /= scale;
        Some(Self { tracks, span, dead_reckoned: poses(&drive), body_from_sensor: extrinsics.body_from_sensor() })
    }

    /// Poses of a track by dead reckoning.
    pub(crate) fn poses(&self, track: usize) -> &[Pose] {
        &self.dead_reckoned[track]
    }

    /// What the wheels leave of the motion over a window of a track.
    pub(crate) fn residual(&self, track: usize, window: Window) -> Residual {
        self.residual_of(self.body_from_sensor, track, window)
    }

    /// The same where the instrument is elsewhere on the robot.
    pub(crate) fn residual_of(&self, sensor: Pose, track: usize, window: Window) -> Residual {
        let poses = &self.dead_reckoned[track];
        let (dead_reckoned, measured) = (poses[window.from].to(poses[window.to]), self.tracks[track].motion(window));
        let predicted = sensor.inverse() * dead_reckoned * sensor;
        let (sin, cos) = sensor.theta_rad.sin_cos();
        let (x_m, y_m) = (measured.x_m - predicted.x_m, measured.y_m - predicted.y_m);
        Vector3::new(cos * x_m - sin * y_m, sin * x_m + cos * y_m, wrap_to_pi(measured.theta_rad - predicted.theta_rad))
    }

    /// The instrument's place on the robot in a track, with standard deviations (x, y, heading), by the
    /// windows that are taken. The wheels' scale is that of all tracks: on a circle a scale and a lever arm
    /// are one.
    pub(crate) fn extrinsics(&self, track: usize, is_taken: impl Fn(Window) -> bool) -> Option<(Pose, [f64; 3])> {
        let taken = windows(self.tracks[track].len(), self.span).filter(|window| is_taken(*window));
        let rows: Vec<ExtrinsicsRow> =
            extrinsics_rows(&self.tracks[track], &self.dead_reckoned[track], taken).collect();
        if rows.len() < RECORDS.min_windows_per_extrinsics {
            return None;
        }
        mounting(&rows, self.body_from_sensor)
    }
}

/// Windows of a span, one after the other.
fn windows(poses: usize, span: usize) -> impl Iterator<Item = Window> {
    (0..poses).step_by(span).map(move |from| Window { from, to: from + span }).take_while(move |of| of.to < poses)
}

/// The shortest span whose windows reach so far that wheels show in them, by their median.
fn span(tracks: &[PoseTrack], separation_m: f64) -> Option<usize> {
    let reaches = |span: &usize| {
        let distances_m = tracks.iter().flat_map(|track| {
            windows(track.len(), *span).map(|window| {
                let Wheels { left, right } = track.travel_m(window);
                left.abs().max(right.abs())
            })
        });
        median(distances_m).is_some_and(|m| m > RECORDS.window_distance_separations * separation_m)
    };
    RECORDS.window_spans.into_iter().find(reaches)
}

/// One window in the linear equation of the extrinsics: the motion by the instrument, that by the wheels, and
/// the turn by the wheels, whose errors are the smaller ones: what an instrument errs by in its headings
/// would count as turns that determine a lever arm.
struct ExtrinsicsRow {
    measured: Vector2<f64>,
    dead_reckoned: Vector2<f64>,
    turn_rad: f64,
}

impl ExtrinsicsRow {
    /// What the instrument saw, turned as it is on the robot, and the derivatives of what the wheels say by
    /// the instrument's place and its heading.
    fn linearized_at(&self, theta_rad: f64) -> (Vector2<f64>, [Vector3<f64>; 2]) {
        let ((sin_of, cos_of), (sin, cos)) = (theta_rad.sin_cos(), self.turn_rad.sin_cos());
        let m = self.measured;
        let seen = Vector2::new(cos_of * m.x - sin_of * m.y, sin_of * m.x + cos_of * m.y);
        (seen, [Vector3::new(1.0 - cos, sin, -seen.y), Vector3::new(-sin, 1.0 - cos, seen.x)])
    }
}

fn extrinsics_rows<'t>(
    track: &'t PoseTrack,
    poses: &'t [Pose],
    windows: impl Iterator<Item = Window> + 't,
) -> impl Iterator<Item = ExtrinsicsRow> + 't {
    windows.map(|window| {
        let (measured, dead_reckoned) = (track.motion(window), poses[window.from].to(poses[window.to]));
        ExtrinsicsRow {
            measured: Vector2::new(measured.x_m, measured.y_m),
            dead_reckoned: Vector2::new(dead_reckoned.x_m, dead_reckoned.y_m),
            turn_rad: dead_reckoned.theta_rad,
        }
    })
}

/// The instrument's place on the robot by some windows, near the one that is stated, with the standard
/// deviations of x, y and heading by what is left of them. The wheels' scale is known.
///
/// On a circle any place on the same circle does, turned accordingly: along that bend the direction that is
/// not determined changes, and is no axis' alone where the search ends. What is determined is so at its
/// beginning, too.
fn mounting(rows: &[ExtrinsicsRow], near: Pose) -> Option<(Pose, [f64; 3])> {
    let mut of = near;
    let mut weights = vec![0.0; rows.len()];
    let mut squares = 0.0;
    for _ in 0..RECORDS.reweightings {
        // What the windows do not determine stays near: a metre and a radian are weak enough.
        let mut information = Matrix3::from_diagonal_element(1e-6);
        let mut score = -1e-6 * Vector3::new(of.x_m - near.x_m, of.y_m - near.y_m, of.theta_rad - near.theta_rad);
        squares = 0.0;
        for (row, weight) in rows.iter().zip(&mut weights) {
            let (seen, design) = row.linearized_at(of.theta_rad);
            let place = Vector3::new(of.x_m, of.y_m, 0.0);
            let left = row.dead_reckoned - seen - Vector2::new(design[0].dot(&place), design[1].dot(&place));
            *weight = 1.0 / left.norm().max(1e-4);
            squares += *weight * left.norm_squared();
            for (design, left) in design.into_iter().zip([left.x, left.y]) {
                information += *weight * design * design.transpose();
                score += *weight * design * left;
            }
        }
        let step = information.cholesky()?.solve(&score);
        of = Pose::new(of.x_m + step.x, of.y_m + step.y, of.theta_rad + step.z);
    }
    let variance = squares / (2 * rows.len()).saturating_sub(3).max(1) as f64;
    let variances_at = |pose: Pose| {
        let mut information = Matrix3::from_diagonal_element(1e-6);
        for (row, weight) in rows.iter().zip(&weights) {
            let designs = row.linearized_at(pose.theta_rad).1;
            information +=
                designs.into_iter().map(|design| *weight * design * design.transpose()).sum::<Matrix3<f64>>();
        }
        Some(information.try_inverse()?.diagonal() * variance)
    };
    let (first, last) = (variances_at(near)?, variances_at(of)?);
    Some((of, [0, 1, 2].map(|axis| first[axis].max(last[axis]).sqrt())))
}

/// g cos θ_s, g sin θ_s, ℓ_x, ℓ_y.
struct Extrinsics(Vector4<f64>);

impl Extrinsics {
    /// The mounting that most windows say.
    fn of(rows: &[ExtrinsicsRow]) -> Option<Self> {
        let design = |row: &ExtrinsicsRow| {
            let (m, (sin, cos)) = (row.measured, row.turn_rad.sin_cos());
            [Vector4::new(m.x, -m.y, 1.0 - cos, sin), Vector4::new(m.y, m.x, -sin, 1.0 - cos)]
        };
        let mut of = Vector4::new(1.0, 0.0, 0.0, 0.0);
        for _ in 0..RECORDS.reweightings {
            // What the windows do not determine stays 0: a metre of lever arm is weak enough.
            let mut information = Matrix4::from_diagonal(&Vector4::new(1e-9, 1e-9, 1e-6, 1e-6));
            let mut score = Vector4::zeros();
            for row in rows {
                let [x, y] = design(row);
                let left = Vector2::new(row.dead_reckoned.x - x.dot(&of), row.dead_reckoned.y - y.dot(&of));
                let weight = 1.0 / left.norm().max(1e-4);
                for (design, value) in [(x, row.dead_reckoned.x), (y, row.dead_reckoned.y)] {
                    information += weight * design * design.transpose();
                    score += weight * design * value;
                }
            }
            of = information.cholesky()?.solve(&score);
        }
        let scale = of[0].hypot(of[1]);
        (scale > 0.0 && scale.is_finite()).then_some(Self(of))
    }

    fn scale(&self) -> f64 {
        self.0[0].hypot(self.0[1])
    }

    fn body_from_sensor(&self) -> Pose {
        Pose::new(self.0[2], self.0[3], self.0[1].atan2(self.0[0]))
    }
}

/// Turns of the wheels at an instant of the log, between rows in proportion.
pub(crate) fn turns_at(rows_s: &[f64], turns: &Wheels<Vec<f64>>, t_s: f64) -> Wheels<f64> {
    let row = rows_s.partition_point(|row_s| *row_s <= t_s).clamp(1, rows_s.len() - 1) - 1;
    let share = ((t_s - rows_s[row]) / (rows_s[row + 1] - rows_s[row])).clamp(0.0, 1.0);
    turns.as_ref().map(|turns| turns[row] + share * (turns[row + 1] - turns[row]))
}

#[cfg(test)]
mod tests {
    use dataset::{Odometry, Run, RunInfo, WheelLog};

    use super::*;
    use crate::small_robot::driven_runs::driven;

    #[test]
    fn windows_have_the_rows_between_their_poses_and_know_where_some_are_missing() {
        // A radian a second by both wheels; rows every tenth, of which those from 3.0 to 3.9 s are missing; a
        // pose every half second, 20 ms behind a row.
        let t_s: Vec<f64> = (0..=80).filter(|row| !(30..40).contains(row)).map(|row| 0.1 * f64::from(row)).collect();
        let odometry =
            Odometry { wheels: WheelLog::Angles(Wheels::both(t_s.clone())), t_s: t_s.into(), ..Odometry::default() };
        let pose = |k: u32| TruthSample::new(0.5 * f64::from(k) + 0.52, 0.0, 0.0, Some(0.0));
        let mut dataset = driven(&[0.0]);
        dataset.runs[0] = Run {
            info: RunInfo { continuous: true, ..RunInfo::default() },
            odometry,
            truth: (0..14).map(pose).collect(),
            ..Run::default()
        };
        let tracks = PoseTrack::of_all(std::slice::from_ref(&dataset), 0.0);
        let [track] = &tracks[..] else { panic!("one run") };
        assert_eq!(track.len(), 14);
        // A step each to the five rows between poses, and one to the pose; none before the first pose.
        assert_eq!(track.after[..5], [1, 7, 13, 19, 25]);
        let travel_m = track.travel_m(Window { from: 1, to: 4 });
        assert!((travel_m.left - 0.08 * 1.5).abs() < 1e-12 && (travel_m.right - 0.08 * 1.5).abs() < 1e-12);
        assert!(track.steps_m.iter().all(|step| step.left >= 0.0), "no row is driven twice");
        let has_gap = |from: usize, to: usize| track.has_gap(Window { from, to });
        // Poses at 2.52, 3.02, 3.52 and 4.02 s are numbers 4 to 7, and the gap is from 2.9 to 4.0 s. Rejects
        // gaps that count before a pose alone: of two poses within a gap, none is between them then.
        let with_gap: Vec<usize> = (0..13).filter(|&from| has_gap(from, from + 1)).collect();
        assert_eq!(with_gap, [4, 5, 6]);
        assert!(has_gap(3, 8) && !has_gap(1, 4) && !has_gap(7, 12));
    }
}
