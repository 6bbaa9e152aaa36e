//! `jung_chung`: UMBmark's squares, by their final headings instead of their final positions.
//!
//! Model: on a square driven by nominal odometry every side turns the robot by β (unequal wheels) and every
//! corner falls short by α (wrong wheelbase). The final heading, true minus odometry, is ε = 4(β + α)
//! clockwise and 4(β − α) counter-clockwise: α = (ε_cw − ε_ccw)/8, β = (ε_cw + ε_ccw)/8, with ε the mean over
//! a direction's runs. E_b = (π/2)/(π/2 − α), and R = L/β is the radius on which a side of length L bends, so
//! that E_d = (R + B/2)/(R − B/2) = (1 + q)/(1 − q) with q = B β/(2L). B = E_b b stands in q where UMBmark
//! has the nominal b: the coupling of the two errors.
//! Assumptions: the mean diameter is right; corners are turned on the spot, sides by equal turns of nominally
//! equal wheels.
//! Observability: a heading is a ratio of lengths, θ = (r_R φ_R − r_L φ_L)/B, so E_d and B over the mean
//! diameter are found exactly, with no small-angle form, and the scale common to wheels *and* base not at
//! all. It bends no heading; distances are off by it.
//! Reference: Jung & Chung 2011/2012. Theirs is R = (L/2)/sin(β/2), which takes the side for the chord: β²/24
//! of q, not kept. A published implementation (OptiOdom's) adds π b β/(4L) to α; unequal wheels do not turn a
//! corner wrongly while their mean is kept, so it is left out (docs/calibration.md).

use std::f64::consts::FRAC_PI_2;

use dataset::{Protocol, Session};
use kinematics::{Wheels, wrap_to_pi};
use motion_programs::Schedule;

use crate::estimate::{CalibError, Calibration, Covariance, Method, NotObservable, Parameter, drive, nominal};
use crate::pose_measurements::EndPoses;
use crate::robust::Summary;

/// The method; it has nothing to choose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct JungChung;

impl JungChung {
    /// The method as the table of contents offers it.
    pub const DEFAULT: Self = Self;

    const NAME: &'static str = "jung_chung";

    fn not_applicable(why: impl Into<String>) -> CalibError {
        CalibError::NotApplicable { method: Self::NAME, why: why.into() }
    }
}

impl Method for JungChung {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn about(&self) -> &'static str {
        "squares driven both ways, by their final headings: wheel ratio and wheelbase, blind to the common scale"
    }

    /// UMBmark's: five squares each way, of the paper's 4 m.
    fn protocol(&self) -> Vec<Schedule> {
        vec![Schedule::Squares { side_m: 4.0, runs_each_way: 5 }]
    }

    fn calibrate(&self, sessions: &[Session<'_>]) -> Result<Calibration, CalibError> {
        let (robot, geometry) = nominal(Self::NAME, sessions)?;
        let mut errors_rad = [(Protocol::SquareCw, Vec::new()), (Protocol::SquareCcw, Vec::new())];
        let mut side_m = None;
        for session in sessions {
            for run in &session.runs {
                let of_direction = errors_rad.iter_mut().find(|(protocol, _)| run.info().protocol == Some(*protocol));
                let Some((_, errors_rad)) = of_direction else { continue };
                let Some(ends) = EndPoses::of(run, session.robot, &geometry) else { continue };
                let Some(run_side_m) = run.info().settings.side_m else {
                    return Err(Self::not_applicable(format!("run {} does not say its side_m", run.info().id)));
                };
                // Settings, not measurements: compared exactly.
                if *side_m.get_or_insert(run_side_m) != run_side_m {
                    return Err(Self::not_applicable(
                        "its squares must all have the same side_m; calibrate them apart",
                    ));
                }
                // The wheels at the measurements' instants: what they turned after the last one was not
                // measured.
                let turned_m = ends.turned_rad().zip_with(geometry.m_per_rad(), |rad, m_per_rad| m_per_rad * rad);
                let dead_reckoned_rad = geometry.increment(turned_m).turn_rad;
                errors_rad.push(wrap_to_pi(ends.end.theta_rad - ends.start.theta_rad - dead_reckoned_rad));
            }
        }
        let [cw, ccw] = errors_rad.map(|(_, errors_rad)| Summary::of(errors_rad.iter().copied()));
        let (Some(side_m), Some(cw), Some(ccw)) = (side_m, cw, ccw) else {
            return Err(Self::not_applicable(
                "it needs squares in both directions (protocol = \"square_cw\" and \"square_ccw\") with the pose measured at both ends",
            ));
        };
        let (alpha_rad, beta_rad) = ((cw.mean - ccw.mean) / 8.0, (cw.mean + ccw.mean) / 8.0);
        let mean_m = 0.5 * (geometry.wheel_diameter_m().left + geometry.wheel_diameter_m().right);
        let separation_m = geometry.wheel_separation_m() * FRAC_PI_2 / (FRAC_PI_2 - alpha_rad);
        let q = mismatch(separation_m, side_m, beta_rad);
        let covariance = cw.mean_variance().zip(ccw.mean_variance()).map(|(cw_var, ccw_var)| {
            // Rows: left and right diameter, separation; columns: α, β. D_L = (1 − q) D and D_R = (1 + q) D,
            // of mean D and ratio (1 + q)/(1 − q).
            let by_alpha = separation_m / (FRAC_PI_2 - alpha_rad);
            let q_by = [0.5 * by_alpha * beta_rad / side_m, 0.5 * separation_m / side_m];
            let slopes = [-mean_m * q_by[0], -mean_m * q_by[1], mean_m * q_by[0], mean_m * q_by[1], by_alpha, 0.0];
            let jacobian = Covariance::from_row_slice(3, 2, &slopes);
            let (var, cov) = ((cw_var + ccw_var) / 64.0, (cw_var - ccw_var) / 64.0);
            &jacobian * Covariance::from_row_slice(2, 2, &[var, cov, cov, var]) * jacobian.transpose()
        });
        let diameter_m = Wheels { left: mean_m * (1.0 - q), right: mean_m * (1.0 + q) };
        Ok(Calibration {
            covariance,
            not_observable: vec![NotObservable {
                parameter: Parameter::CommonScale,
                why: "a heading is a ratio of lengths: wheels and wheelbase larger by one factor turn alike; \
                      the nominal mean diameter is kept: measure a straight run of known length first"
                    .into(),
            }],
            runs_used: cw.count + ccw.count,
            ..Calibration::new(Self::NAME, drive(Self::NAME, diameter_m, separation_m)?, robot.ticks_per_rev)
        })
    }
}

/// Half of the wheels' relative difference, q of E_d = (1 + q)/(1 − q): B/2 over the radius on which a side
/// bends by β.
fn mismatch(separation_m: f64, side_m: f64, beta_rad: f64) -> f64 {
    0.5 * separation_m * beta_rad / side_m
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With B in place of b the published R = (L/2)/sin(β/2) differs from L/β by β²/24 of itself: 4e-8 at a
    /// milliradian, 1e-4 at 3°.
    #[test]
    fn the_published_radius_is_the_arc_to_second_order() {
        for beta_rad in [1e-3_f64, -0.02, 0.05] {
            let (side_m, base_m) = (4.0, 0.363);
            let radius_m = (0.5 * side_m) / (0.5 * beta_rad).sin();
            let published = (radius_m + 0.5 * base_m) / (radius_m - 0.5 * base_m);
            let q = mismatch(base_m, side_m, beta_rad);
            // E_d is 1 + 2q: what is left is 2q β²/24, and the next order is under a hundredth of it.
            let gap = (1.0 + q) / (1.0 - q) - published;
            let expected = 2.0 * q * beta_rad * beta_rad / 24.0;
            assert!((gap - expected).abs() < 0.02 * expected.abs() + 1e-15, "{gap} {expected}");
        }
    }
}
