//! Short windows of what the instrument saw: a displacement in the instrument's frame and a turn.
//!
//! Between two poses, the displacement is turned to the heading midway and divided by sinc(Δθ/2): then it is
//! linear in the wheels' turns, wherever on the robot the instrument is. Positions alone give a distance, and
//! a turn of the course from window to window.

use std::f64::consts::GOLDEN_RATIO;

use dataset::{TruthSample, quantile};
use kinematics::{sin_cos, sinc, wrap_to_pi};

use crate::run_log::RunLog;
use crate::settings::CHECKS;

/// How the instrument's records are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Reading {
    pub(crate) degrees: bool,
    pub(crate) clockwise: bool,
}

impl Reading {
    pub(crate) const AS_IS: Self = Self { degrees: false, clockwise: false };

    fn turn_rad(self, turn: f64) -> f64 {
        let turn_rad = if self.degrees { turn.to_radians() } else { turn };
        wrap_to_pi(if self.clockwise { -turn_rad } else { turn_rad })
    }

    pub(crate) fn heading_rad(self, heading: f64) -> f64 {
        let heading_rad = if self.degrees { heading.to_radians() } else { heading };
        if self.clockwise { -heading_rad } else { heading_rad }
    }
}

/// What the instrument saw of a window.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Window {
    pub(crate) run: usize,
    /// From when to when it moved.
    pub(crate) from_s: f64,
    pub(crate) to_s: f64,
    /// In the instrument's frame midway, metres; of positions alone, the distance and 0.
    pub(crate) ahead_m: f64,
    pub(crate) left_m: f64,
    /// From when to when it turned, and by what.
    pub(crate) turn: Option<(f64, f64, f64)>,
}

/// What windows are of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Measured {
    /// Poses or displacements.
    Poses,
    /// Positions.
    Positions,
}

/// All windows of the runs, at most so many; outliers of the instrument are left out.
pub(crate) fn windows(runs: &[RunLog], reading: Reading, most: usize) -> (Vec<Window>, Measured) {
    let poses = 2 * runs.iter().filter(|run| run.sees_headings()).count() >= runs.len();
    let mut all = Vec::new();
    for (number, run) in runs.iter().enumerate() {
        if poses {
            of_poses(number, run, reading, &mut all);
            of_displacements(number, run, reading, &mut all);
        } else {
            of_positions(number, run, &mut all);
        }
    }
    let usual = |of: fn(&Window) -> f64, windows: &[Window]| quantile(windows.iter().map(of), 0.9).unwrap_or(0.0);
    let speed = |window: &Window| window.ahead_m.hypot(window.left_m) / (window.to_s - window.from_s);
    let most_m_s = CHECKS.outlying_motion_ratio * usual(speed, &all);
    all.retain(|window| speed(window).is_finite() && (speed(window) <= most_m_s || most_m_s == 0.0));
    if all.len() > most {
        all = spread(all.len(), most).map(|index| all[index]).collect();
    }
    (all, if poses { Measured::Poses } else { Measured::Positions })
}

/// So many of the numbers below a length, one in each equal part, at golden sections of the parts, which fill
/// an interval most evenly (Weyl 1916). A constant stride would meet a drive that repeats itself always at
/// one phase, where a clock may not show.
fn spread(length: usize, most: usize) -> impl Iterator<Item = usize> {
    let part = length as f64 / most as f64;
    (0..most).map(move |k| ((k as f64 + (k as f64 * GOLDEN_RATIO).fract()) * part) as usize)
}

/// Pairs of samples a window apart.
fn pairs(samples: &[TruthSample]) -> impl Iterator<Item = (TruthSample, TruthSample)> {
    let mut from = 0;
    std::iter::from_fn(move || {
        while from + 1 < samples.len() {
            let start = samples[from];
            let found = samples[from + 1..].iter().position(|end| end.t_s >= start.t_s + 0.99 * CHECKS.window_s);
            let to = from + 1 + found?;
            from = to;
            if samples[to].t_s - start.t_s <= CHECKS.max_window_s {
                return Some((start, samples[to]));
            }
        }
        None
    })
}

fn of_poses(number: usize, run: &RunLog, reading: Reading, windows: &mut Vec<Window>) {
    for (a, b) in pairs(&run.truth) {
        let (Some(from), Some(to)) = (a.theta_rad(), b.theta_rad()) else { continue };
        let turn_rad = reading.turn_rad(to - from);
        if turn_rad.abs() > CHECKS.max_window_turn_rad {
            continue;
        }
        let (sin, cos) = sin_cos(reading.heading_rad(from) + 0.5 * turn_rad);
        let (dx_m, dy_m) = (b.x_m - a.x_m, b.y_m - a.y_m);
        let shrunk = sinc(0.5 * turn_rad);
        windows.push(Window {
            run: number,
            from_s: a.t_s,
            to_s: b.t_s,
            ahead_m: (cos * dx_m + sin * dy_m) / shrunk,
            left_m: (cos * dy_m - sin * dx_m) / shrunk,
            turn: Some((a.t_s, b.t_s, turn_rad)),
        });
    }
}

fn of_displacements(number: usize, run: &RunLog, reading: Reading, windows: &mut Vec<Window>) {
    for displacement in &run.displacements {
        let turn_rad = reading.turn_rad(displacement.dtheta_rad);
        let length_s = displacement.t1_s - displacement.t0_s;
        if turn_rad.abs() > CHECKS.max_window_turn_rad || length_s <= 0.0 {
            continue;
        }
        let (sin, cos) = sin_cos(0.5 * turn_rad);
        let (dx_m, dy_m) = (displacement.dx_m, displacement.dy_m);
        let shrunk = sinc(0.5 * turn_rad);
        windows.push(Window {
            run: number,
            from_s: displacement.t0_s,
            to_s: displacement.t1_s,
            ahead_m: (cos * dx_m + sin * dy_m) / shrunk,
            left_m: (cos * dy_m - sin * dx_m) / shrunk,
            turn: Some((displacement.t0_s, displacement.t1_s, turn_rad)),
        });
    }
}

fn of_positions(number: usize, run: &RunLog, windows: &mut Vec<Window>) {
    let mut before: Option<(f64, f64, f64)> = None;
    for (a, b) in pairs(&run.truth) {
        let (dx_m, dy_m) = (b.x_m - a.x_m, b.y_m - a.y_m);
        let (middle_s, course_rad, distance_m) = (0.5 * (a.t_s + b.t_s), dy_m.atan2(dx_m), dx_m.hypot(dy_m));
        let turn = before.and_then(|(before_s, before_rad, before_m)| {
            let turn_rad = wrap_to_pi(course_rad - before_rad);
            // A robot that stands has no course, and one that turns back reverses it.
            let moves = distance_m > 0.5 * before_m && before_m > 0.5 * distance_m;
            (moves && turn_rad.abs() < CHECKS.max_window_turn_rad && middle_s - before_s <= CHECKS.max_window_s)
                .then_some((before_s, middle_s, turn_rad))
        });
        before = Some((middle_s, course_rad, distance_m));
        windows.push(Window { run: number, from_s: a.t_s, to_s: b.t_s, ahead_m: distance_m, left_m: 0.0, turn });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_of_the_windows_meets_every_phase_of_a_drive_that_repeats_itself() {
        // Windows of half a second, manoeuvres of 3 s, an hour: a stride of 18 meets one phase of six.
        let chosen: Vec<usize> = spread(7200, 400).collect();
        assert!(chosen.windows(2).all(|pair| pair[0] < pair[1]) && chosen[399] < 7200);
        for phase in 0..6 {
            let met = chosen.iter().filter(|index| *index % 6 == phase).count();
            assert!((60..74).contains(&met), "phase {phase}: {met} of 400");
        }
    }
}
