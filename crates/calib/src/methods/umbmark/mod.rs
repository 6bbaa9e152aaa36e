//! `umbmark`: squares driven both ways and measured at their ends.
//!
//! Model: errors of type A (wrong wheelbase: every corner turns too far by α) and of type B (unequal wheels:
//! every side bends by β). With ε the end position, true minus odometry, in the start's frame (first leg
//! along +x, counter-clockwise turns to the left), averaged over the runs of a direction: α = (x_cw +
//! x_ccw)/(−4L), β = (x_cw − x_ccw)/(−4L), and to first order also α = (y_cw − y_ccw)/(−4L), β = (y_cw +
//! y_ccw)/(−4L). Then E_b = (π/2)/(π/2 − α), R = (L/2)/sin(β/2), E_d = (R + b/2)/(R − b/2), which is
//! (1+q)/(1−q) with q = (b/L) sin(β/2) and needs no R.
//! Assumptions: the mean diameter is right (D_L = 2D/(E_d+1), D_R = 2D/(1/E_d+1)); corners are turned on the
//! spot.
//! Observability: the wheelbase and the ratio of the wheels. Blind to their common scale, which shows up as a
//! wrong wheelbase: measure the scale first.
//! Reference: Borenstein & Feng 1995 (UMBmark), 1996 (eq. for E_b and E_d; b is the nominal wheelbase).

mod formulas;
mod lanes;

use dataset::{LANES, Protocol, Replicates, Session};
use kinematics::{Pose, Rule};
use motion_programs::Schedule;

pub use formulas::Form;
use formulas::{Direction, NAME, calibration};

use crate::estimate::{CalibError, Calibration, Method, nominal};
use crate::pose_measurements::EndPoses;
use crate::robust::Summary;

/// The method in one of its two forms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Umbmark {
    /// Coordinate used.
    pub form: Form,
}

impl Umbmark {
    /// The method as the table of contents offers it: the x form.
    pub const DEFAULT: Self = Self { form: Form::X };

    fn not_applicable(why: impl Into<String>) -> CalibError {
        CalibError::NotApplicable { method: NAME, why: why.into() }
    }
}

impl Method for Umbmark {
    fn name(&self) -> &'static str {
        NAME
    }

    fn about(&self) -> &'static str {
        "squares driven both ways, measured at their ends: wheel ratio and wheelbase, blind to the common scale"
    }

    /// Five squares each way (Borenstein & Feng 1995) of the paper's 4 m.
    fn protocol(&self) -> Vec<Schedule> {
        vec![Schedule::Squares { side_m: 4.0, runs_each_way: 5 }]
    }

    fn calibrate(&self, sessions: &[Session<'_>]) -> Result<Calibration, CalibError> {
        let (robot, geometry) = nominal(NAME, sessions)?;
        let mut errors: [(Protocol, Vec<(f64, f64)>); 2] =
            [(Protocol::SquareCw, Vec::new()), (Protocol::SquareCcw, Vec::new())];
        let mut side_m = None;
        for session in sessions {
            for run in &session.runs {
                let Some((_, errors)) = errors.iter_mut().find(|(protocol, _)| run.info().protocol == Some(*protocol))
                else {
                    continue;
                };
                // Marks are read at standstills, before and after the whole log. Poses span the log from the
                // first measurement to the last.
                let by_marks = run.run().truth.is_empty();
                let ends = if by_marks { None } else { EndPoses::of(run, session.robot, &geometry) };
                let observed =
                    if by_marks { run.observed_ends() } else { ends.as_ref().map(|ends| (ends.start, ends.end)) };
                let Some((world_from_start, world_from_end)) = observed else { continue };
                let Some(run_side_m) = run.info().settings.side_m else {
                    return Err(Self::not_applicable(format!("run {} does not say its side_m", run.info().id)));
                };
                // Settings, not measurements: compared exactly.
                if *side_m.get_or_insert(run_side_m) != run_side_m {
                    return Err(Self::not_applicable(
                        "its squares must all have the same side_m; calibrate them apart",
                    ));
                }
                // In the start's frame the odometry starts at the origin and the first leg points along +x.
                let measured = world_from_start.to(world_from_end);
                let mut dead_reckoned = ends.map(|ends| ends.dead_reckoned(&geometry));
                if by_marks {
                    let visit = |_, pose| dead_reckoned = Some(pose);
                    run.dead_reckon(session.robot, &geometry, Rule::Midpoint, Pose::IDENTITY, visit);
                }
                if let Some(dead_reckoned) = dead_reckoned {
                    errors.push((measured.x_m - dead_reckoned.x_m, measured.y_m - dead_reckoned.y_m));
                }
            }
        }
        let summary = |errors: &[(f64, f64)]| {
            Some(Direction {
                x_m: Summary::of(errors.iter().map(|error| error.0))?,
                y_m: Summary::of(errors.iter().map(|error| error.1))?,
            })
        };
        let [(_, cw), (_, ccw)] = &errors;
        let (Some(side_m), Some(cw), Some(ccw)) = (side_m, summary(cw), summary(ccw)) else {
            return Err(Self::not_applicable(
                "it needs squares in both directions (protocol = \"square_cw\" and \"square_ccw\") with the pose measured at both ends",
            ));
        };
        calibration(self.form, &robot, &geometry, side_m, cw, ccw)
    }

    fn calibrate_lanes(&self, replicates: &Replicates) -> [Option<Result<Calibration, CalibError>>; LANES] {
        lanes::calibrations(self.form, replicates)
    }
}
