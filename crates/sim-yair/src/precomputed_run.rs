//! The closed form where all of a run but its draws is known beforehand: when it moves, rests and is read
//! follows from the plan, so that no clock has to be asked.
//!
//! That is so where no effect has a say in commands and counters, nothing is logged between motions and no
//! instrument measures by itself: the paper's experiments. What the body and its counters do is the same code
//! as in [`crate::drive`], and a test holds both ways to the same records.

use dataset::{Run, WheelLog};
use effects::Readout;

use crate::active::ActiveEffects;
use crate::actuator::{ConstantSpeed, RateSegment};
use crate::body::{Body, DriveSetup, DriveStreams, Start};
use crate::drive::SAME_INSTANT_S;
use crate::instrument::Observer;
use crate::planned_motion::PlannedMotion;

/// What a run does from one standstill to the next.
#[derive(Debug, Clone)]
pub(crate) struct RowInterval {
    /// Does it begin a motion, for which effects and sensitivities draw?
    pub(crate) sets_out: bool,
    pub(crate) segments: Vec<RateSegment>,
    /// Is the standing robot read?
    pub(crate) is_read: bool,
}

/// A precomputed run.
#[derive(Debug, Clone)]
pub(crate) struct PrecomputedRun {
    /// Each ends with a row.
    pub(crate) intervals: Vec<RowInterval>,
    /// When, seconds.
    pub(crate) rows_s: Vec<f64>,
}

impl PrecomputedRun {
    /// The run of a plan's motions; `None` where one of them is known only while it is driven.
    pub(crate) fn new(motions: &[PlannedMotion]) -> Option<Self> {
        let mut intervals = vec![RowInterval { sets_out: false, segments: Vec::new(), is_read: true }];
        let (mut t_s, mut rows_s) = (0.0, vec![0.0]);
        for motion in motions {
            let (sets_out, segments) = match motion {
                PlannedMotion::Measure => {
                    if let Some(last) = intervals.last_mut() {
                        last.is_read = true;
                    }
                    continue;
                }
                PlannedMotion::Pause { duration_s } => (false, RateSegment::at_rest(*duration_s).into_iter().collect()),
                PlannedMotion::Go { segments, .. } => (true, segments.clone()?),
            };
            // Added up as the body's clock is.
            let ends_s = segments.iter().fold(t_s, |t_s, segment: &RateSegment| t_s + segment.duration_s);
            if ends_s <= t_s + SAME_INSTANT_S {
                return None;
            }
            t_s = ends_s;
            intervals.push(RowInterval { sets_out, segments, is_read: false });
            rows_s.push(t_s);
        }
        if let Some(last) = intervals.last_mut() {
            last.is_read = true;
        }
        Some(Self { intervals, rows_s })
    }

    /// Drives it; the run is empty. Gives the body at its end.
    #[inline]
    pub(crate) fn drive(
        &self,
        setup: &DriveSetup,
        start: &Start,
        streams: &mut DriveStreams,
        effects: &mut ActiveEffects,
        observers: &mut [Observer],
        run: &mut Run,
    ) -> Body {
        let mut body = Body::new(setup, start);
        let mut drive = ConstantSpeed::new(setup.counts_per_rad, start.counts);
        run.odometry.t_s.extend_from_slice(&self.rows_s);
        let WheelLog::Ticks(ticks) = &mut run.odometry.wheels else { return body };
        ticks.left.resize(self.intervals.len(), 0);
        ticks.right.resize(self.intervals.len(), 0);
        let mut rows = 0;
        for (interval, due_s) in self.intervals.iter().zip(&self.rows_s) {
            if interval.sets_out {
                effects.start_motion();
                body.start_motion(setup, streams);
            }
            for &segment in &interval.segments {
                let motion = drive.whole(segment);
                let step = body.advance(setup, streams, effects, segment.duration_s, &motion);
                drive.count(&step);
            }
            let mut readout = Readout { ticks: drive.counts(), m_per_count: setup.m_per_count, written: true };
            effects.readout(&mut readout);
            // A row that is lost leaves its place to the next.
            run.odometry.t_s[rows] = *due_s;
            (ticks.left[rows], ticks.right[rows]) = (readout.ticks.left, readout.ticks.right);
            rows += usize::from(readout.written);
            if interval.is_read {
                let (t_s, world_from_body) = body.reading(effects, body.t_s);
                for observer in &mut *observers {
                    observer.read_standing(t_s, world_from_body, &setup.points, &mut run.point_readings);
                }
            }
        }
        run.odometry.t_s.truncate(rows);
        ticks.left.truncate(rows);
        ticks.right.truncate(rows);
        body
    }
}

#[cfg(test)]
mod tests {
    use dataset::{Protocol, ProtocolSettings};
    use motion_programs::{Motion, MotionProgram};
    use scenario::{Engine, Scenario};

    use super::*;
    use crate::SimulatedRobot;

    /// Both ways through programs with everything in them, with the paper's effects and with sensitivities
    /// that scatter from motion to motion.
    #[test]
    fn a_precomputed_run_gives_the_records_of_a_run_that_asks_its_clock() {
        let paper = Scenario::parse(scenario::PAPER, "paper.toml").expect("the shipped scenario");
        assert_eq!(paper.engine, Engine::ClosedForm);
        let mut scattering = paper.clone();
        scattering.noise.sensitivity_sigma = 1e-3;
        let program = |id: &str, motions: &[Motion]| MotionProgram {
            id: id.to_owned(),
            protocol: Protocol::Free,
            settings: ProtocolSettings::default(),
            motions: motions.to_vec(),
        };
        let (straight, spin) = (Motion::Straight { length_m: -0.5 }, Motion::Spin { turn_rad: 3.0 });
        let arc = Motion::Arc { radius_m: 0.4, turn_rad: -2.0 };
        let pause = Motion::Pause { duration_s: 0.2 };
        let programs = [
            program("read in between", &[Motion::Measure, straight, Motion::Measure, pause, arc, Motion::Measure]),
            program("read at the ends", &[spin, pause, straight]),
            program("read twice where it stands", &[arc, Motion::Measure, Motion::Measure]),
            program("not at all", &[]),
        ];
        for scenario in [paper, scattering] {
            let [mut precomputed, mut asking] =
                [(); 2].map(|()| SimulatedRobot::new(&scenario, 5, 7).expect("simulates"));
            // The same buffers for all, as a campaign has it.
            let (mut run, mut prepared) = (Run::default(), Run::default());
            for program in &programs {
                let plan = precomputed.prepare(program.clone());
                assert!(plan.precomputed_run.is_some(), "{}", program.id);
                precomputed.drive_prepared_into(&plan, &mut run).expect("drives");
                asking
                    .drive_prepared_into(&crate::PreparedProgram { precomputed_run: None, ..plan }, &mut prepared)
                    .expect("drives");
                assert_eq!(run, prepared);
                assert_eq!(precomputed.last_true_ends(), asking.last_true_ends());
            }
        }
    }
}
