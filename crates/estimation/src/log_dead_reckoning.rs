//! Dead reckoning with terms along the whole log of a run: at its rows, and where the instrument measured
//! between them.
//!
//! A fit goes from a run's first measurement to its last ([`crate::ModelFit::dead_reckoned`]). Evaluation and
//! corrected poses need every row, also of runs without any measurement; the motion of an interval is the
//! same.

use dataset::{NominalRobot, RunView};
use kinematics::Pose;
use model_term::ModelTerm;

use crate::model::Model;
use crate::propagation::Propagator;
use crate::segment::{Segment, Start};
use crate::settings::TIME_TOLERANCE_S;
use crate::wheel_angles::WheelAngleInterpolator;

/// A dead-reckoned pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LogPose {
    /// When, seconds from the run's start.
    pub t_s: f64,
    /// The drive's centre.
    pub world_from_body: Pose,
    /// What terms and latency add to a measurement at this instant, in the frame of the body; `None` where
    /// nothing is measured.
    pub offset: Option<Pose>,
}

/// The intervals of a run's log, cut where the instrument measured.
#[derive(Debug, Clone)]
pub struct LogDeadReckoning<'a> {
    segment: Segment<'a>,
    instants: Vec<Instant>,
    distance_m: f64,
}

#[derive(Debug, Clone, Copy)]
struct Instant {
    t_s: f64,
    /// Number of intervals before it.
    after: usize,
    is_measured: bool,
}

impl<'a> LogDeadReckoning<'a> {
    /// The log of a run with the instants of its measurements, in the order of time; those outside of the log
    /// are left out. `session_m` is the distance driven in the session before, metres. `None` without rows,
    /// or for ticks of a robot that does not say how many make a turn.
    #[must_use]
    pub fn of(run: &RunView<'a>, robot: &NominalRobot, measured_s: &[f64], session_m: f64) -> Option<Self> {
        let track = WheelAngleInterpolator::of(run, robot)?;
        let instants_s = merged(&run.odometry().t_s, measured_s);
        let (&(first_s, is_measured), others) = instants_s.split_first()?;
        let mut instants = vec![Instant { t_s: first_s, after: 0, is_measured }];
        let mut intervals = Vec::with_capacity(others.len());
        let (mut cursor, mut before_s) = (track.cursor(), first_s);
        for &(t_s, is_measured) in others {
            let _ = cursor.intervals(before_s, t_s, &mut intervals);
            instants.push(Instant { t_s, after: intervals.len(), is_measured });
            before_s = t_s;
        }
        let segment = Segment {
            run: (0, 0),
            info: run.info(),
            start: Start::Origin,
            continues: false,
            intervals,
            measurements: Vec::new(),
            wheel_rad: track.first_rad(),
            quantum_rad: track.quantum_rad(),
            rate_window: track.rate_window(),
            rate_rounding: track.rate_rounding(),
            session_m,
        };
        Some(Self { segment, instants, distance_m: track.distance_m(robot) })
    }

    /// Distance driven in the run, metres, by nominal values.
    #[must_use]
    pub const fn distance_m(&self) -> f64 {
        self.distance_m
    }

    /// The poses at all rows and measurements, from a pose at the first row on.
    #[must_use]
    pub fn poses(&self, model: &Model, terms: &mut [Box<dyn ModelTerm>], start: Pose) -> Vec<LogPose> {
        let mut propagator = Propagator::new(&self.segment, model, terms);
        propagator.restart();
        let (mut pose, mut at) = (start, 0);
        let of = |&Instant { t_s, after, is_measured }: &Instant| {
            pose = propagator.dead_reckon(pose, at..after);
            at = after;
            let offset = is_measured.then(|| propagator.measurement_offset(pose, t_s, after, model.latency_s));
            LogPose { t_s, world_from_body: pose, offset }
        };
        self.instants.iter().map(of).collect()
    }
}

/// Rows and measurements in the order of time, each instant once, with whether it is measured.
fn merged(rows_s: &[f64], measured_s: &[f64]) -> Vec<(f64, bool)> {
    let mut merged = Vec::with_capacity(rows_s.len() + measured_s.len());
    let mut measured_s = measured_s.iter().copied().peekable();
    for &row_s in rows_s {
        while let Some(t_s) = measured_s.next_if(|t_s| *t_s < row_s - TIME_TOLERANCE_S) {
            // What was measured before the first row is outside of the log.
            if !merged.is_empty() {
                merged.push((t_s, true));
            }
        }
        let mut is_measured = false;
        while measured_s.next_if(|t_s| *t_s <= row_s + TIME_TOLERANCE_S).is_some() {
            is_measured = true;
        }
        merged.push((row_s, is_measured));
    }
    merged
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measurements_are_cut_out_of_rows_and_joined_with_those_at_the_same_instant() {
        let found = merged(&[0.0, 1.0, 2.0], &[-0.5, 0.0, 0.25, 0.5, 1.0 + 1e-10, 3.0]);
        assert_eq!(found, [(0.0, true), (0.25, true), (0.5, true), (1.0, true), (2.0, false)]);
        assert_eq!(merged(&[], &[1.0]), []);
    }
}
