//! `censi`: both wheels, the axle and the instrument's extrinsics, six parameters at once, from displacements
//! of the instrument.
//!
//! Model: the instrument at ℓ on the robot moves by s = ⊖ℓ ⊕ o ⊕ ℓ where the robot moved by o. The turn of o
//! is J₂₁ Φ_L + J₂₂ Φ_R in the wheels' turns Φ, with J₂₁ = −r_L/b and J₂₂ = r_R/b: linear least squares.
//! Given them, with x = (b, ℓ_x, ℓ_y, cos ℓ_θ, sin ℓ_θ), the rest is Q x = 0: the minimum of |Q x|² on cos² +
//! sin² = 1. It has two stationary solutions; the one of lower cost is taken. Then the worst 1 % in position
//! or heading are dropped, and the fit is repeated, four times.
//! Assumptions: the instrument's error is alike in all directions and the wheels' own is small beside it.
//! Rows of the log are arcs (the print takes the whole interval for one). Positions alone and marks without
//! poses are not enough.
//! Observability: all six, from two proportions of the wheels' turns: straights and turns. A single circle
//! and a path without turns are refused.
//! Reference: Censi, Franchi, Marchionni, Oriolo 2013 (IEEE T-RO 29, 475–492); the trimming is their
//! program's.

mod least_squares;

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;

use dataset::{RunView, Session};
use kinematics::{Pose, Wheels, unwrap_near};
use motion_programs::Schedule;
use nalgebra::{Matrix3, Matrix6, Vector3};

use crate::estimate::{CalibError, Calibration, Covariance, Extrinsics, Method, Parameter, Rejected, drive, nominal};
use crate::pose_measurements::{PoseMeasurement, PoseMeasurements, Spacing};
use crate::robust::left_of_variance;
use crate::settings::{
    DISPLACEMENT_DISTANCE_M, DISPLACEMENT_TURN_RAD, MIN_COST_RATIO, MIN_DISPLACEMENT_SIGMA, TRIMMED_SHARE,
    TRIMMING_ROUNDS,
};
use estimation::WheelAngleInterpolator;

pub use least_squares::{CensiFit, DisplacementSample, StationarySolution, solutions};

/// The method with its trimming and its limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Censi {
    /// How often the worst displacements are dropped.
    pub rounds: u32,
    /// Which share of them goes each time, for its position and for its heading.
    pub trimmed_share: f64,
    /// Where the instrument gives poses, least distance of two consecutive ones by the nominal robot, metres,
    /// …
    pub least_distance_m: f64,
    /// … or so much turn, radians: the error of a displacement does not shrink with its length.
    pub least_turn_rad: f64,
}

/// A fit after trimming, and what it rests on.
#[derive(Debug, Clone, PartialEq)]
pub struct Trimmed {
    /// The six parameters.
    pub fit: CensiFit,
    /// Which displacements were retained, in their order.
    pub retained: Vec<bool>,
    /// Shares that were dropped for their position and for their heading.
    pub dropped: (f64, f64),
}

fn not_applicable(why: impl Into<String>) -> CalibError {
    CalibError::NotApplicable { method: Censi::NAME, why: why.into() }
}

impl Censi {
    /// The method as the table of contents offers it, with the authors' trimming.
    pub const DEFAULT: Self = Self {
        rounds: TRIMMING_ROUNDS,
        trimmed_share: TRIMMED_SHARE,
        least_distance_m: DISPLACEMENT_DISTANCE_M,
        least_turn_rad: DISPLACEMENT_TURN_RAD,
    };

    const NAME: &'static str = least_squares::NAME;

    /// The displacements of all sessions: those of a run where it has them, else between consecutive poses.
    #[must_use]
    pub fn samples(&self, sessions: &[Session<'_>]) -> Vec<DisplacementSample> {
        let mut samples = Vec::new();
        for session in sessions {
            let Ok(geometry) = session.robot.geometry() else { continue };
            let nominal = CensiFit {
                radius_m: geometry.m_per_rad(),
                separation_m: geometry.wheel_separation_m(),
                body_from_sensor: Pose::IDENTITY,
            };
            for run in &session.runs {
                let Some(track) = WheelAngleInterpolator::of(run, session.robot) else { continue };
                if run.run().displacements.is_empty() {
                    let spacing = Spacing { every_m: self.least_distance_m, every_rad: self.least_turn_rad };
                    let Some(measurements) = PoseMeasurements::at(run, &track, &geometry, spacing) else { continue };
                    let mut before = measurements.start;
                    samples.extend(measurements.later.into_iter().filter_map(|PoseMeasurement { wheel_rad, pose }| {
                        let measured = before.to(pose);
                        before = pose;
                        sample(run, &nominal, wheel_rad, measured)
                    }));
                } else {
                    samples.extend(run.run().displacements.iter().filter_map(|measured| {
                        let later = Pose::new(measured.dx_m, measured.dy_m, measured.dtheta_rad);
                        sample(run, &nominal, track.steps(measured.t0_s, measured.t1_s)?, later)
                    }));
                }
            }
        }
        samples
    }

    /// Fits, drops the worst and fits again, [`Self::rounds`] times.
    ///
    /// # Errors
    /// [`CalibError`] when the displacements do not determine the parameters.
    pub fn trimmed(&self, samples: &[DisplacementSample]) -> Result<Trimmed, CalibError> {
        let mut retained = vec![true; samples.len()];
        let mut dropped = (0, 0);
        for _ in 0..self.rounds {
            let [StationarySolution { fit, .. }, _] =
                solutions(&mut retained_samples(samples, &retained).map(|(_, sample)| sample))?;
            let errors: Vec<(usize, f64, f64)> = retained_samples(samples, &retained)
                .map(|(index, sample)| {
                    let residual = fit.residual(sample);
                    (index, residual.x.hypot(residual.y), residual.z.abs())
                })
                .collect();
            let last = ((1.0 - self.trimmed_share) * errors.len() as f64).round() as usize;
            let limit = |of: fn(&(usize, f64, f64)) -> f64| {
                let mut sorted: Vec<f64> = errors.iter().map(of).collect();
                sorted.sort_by(f64::total_cmp);
                sorted.get(last).copied().unwrap_or(f64::INFINITY)
            };
            let (limit_m, limit_rad) = (limit(|error| error.1), limit(|error| error.2));
            for (index, error_m, error_rad) in errors {
                retained[index] = error_m <= limit_m && error_rad <= limit_rad;
                dropped.0 += usize::from(error_m > limit_m);
                dropped.1 += usize::from(error_rad > limit_rad);
            }
        }
        let [best, other] = solutions(&mut retained_samples(samples, &retained).map(|(_, sample)| sample))?;
        if other.cost_m2 <= MIN_COST_RATIO * best.cost_m2.max(0.0) {
            return Err(CalibError::Unobservable {
                method: Self::NAME,
                parameter: Parameter::SensorTheta,
                why: "the instrument measures no translation that exceeds its error; add straight runs".to_owned(),
            });
        }
        let share = |count: usize| count as f64 / samples.len() as f64;
        Ok(Trimmed { fit: best.fit, retained, dropped: (share(dropped.0), share(dropped.1)) })
    }
}

fn sample(
    run: &RunView<'_>,
    nominal: &CensiFit,
    wheel_rad: Vec<Wheels<f64>>,
    measured: Pose,
) -> Option<DisplacementSample> {
    let mut sample = DisplacementSample { run: run.info().id.clone(), wheel_rad, sensor_from_later: measured };
    // Standing still carries no information, and its small errors would make those of motion look like
    // outliers.
    if sample.wheel_rad.iter().all(|rad| rad.left == 0.0 && rad.right == 0.0) {
        return None;
    }
    // Whole turns come from the wheels.
    let about_rad = nominal.dead_reckon(&sample).pose.theta_rad;
    sample.sensor_from_later.theta_rad = unwrap_near(measured.theta_rad, about_rad);
    Some(sample)
}

fn retained_samples<'e>(
    samples: &'e [DisplacementSample],
    retained: &'e [bool],
) -> impl Iterator<Item = (usize, &'e DisplacementSample)> {
    samples.iter().enumerate().filter(|(index, _)| retained[*index])
}

impl Method for Censi {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn about(&self) -> &'static str {
        "both wheels, wheelbase and the instrument's place on the robot, from displacements or poses along any path with turns"
    }

    /// The authors drove at random; straights and quarter turns excite the same.
    fn protocol(&self) -> Vec<Schedule> {
        vec![Schedule::Straights { length_m: 0.5, runs: 40 }, Schedule::Spins { turn_rad: FRAC_PI_2, runs: 40 }]
    }

    fn calibrate(&self, sessions: &[Session<'_>]) -> Result<Calibration, CalibError> {
        let (robot, _) = nominal(Self::NAME, sessions)?;
        let samples = self.samples(sessions);
        if samples.is_empty() {
            return Err(not_applicable(
                "no run has displacements (displacement.csv) or two poses (truth.csv with headings, or two marked points) while the wheels turn",
            ));
        }
        let Trimmed { fit, retained, dropped } = self.trimmed(&samples)?;
        let mut by_run: BTreeMap<&str, (usize, usize)> = BTreeMap::new();
        for (sample, retained) in samples.iter().zip(&retained) {
            let (all, lost) = by_run.entry(&sample.run).or_default();
            *all += 1;
            *lost += usize::from(!retained);
        }
        let runs_rejected = by_run
            .iter()
            .filter(|(_, (_, lost))| *lost > 0)
            .map(|(run, (all, lost))| Rejected {
                run: (*run).to_owned(),
                why: format!("{lost} of {all} displacements are among the worst"),
            })
            .collect();

        let covariance = covariance(&fit, &samples, &retained, dropped);
        let block = |covariance: &Matrix6<f64>| {
            let mut scale = Matrix3::identity();
            scale[(0, 0)] = 2.0; // radii to diameters
            scale[(1, 1)] = 2.0;
            let drive = scale * covariance.fixed_view::<3, 3>(0, 0) * scale;
            Covariance::from_column_slice(3, 3, drive.as_slice())
        };
        let geometry = drive(Self::NAME, fit.radius_m.map(|radius_m| 2.0 * radius_m), fit.separation_m)?;
        Ok(Calibration {
            covariance: covariance.as_ref().map(block),
            extrinsics: Some(Extrinsics {
                body_from_sensor: fit.body_from_sensor,
                covariance: covariance.map(|covariance| covariance.fixed_view::<3, 3>(3, 3).into_owned()),
            }),
            runs_used: by_run.len(),
            runs_rejected,
            ..Calibration::new(Self::NAME, geometry, robot.ticks_per_rev)
        })
    }
}

/// Inverse Fisher information, with the instrument's variance of the retained residuals, corrected for the
/// trimming.
fn covariance(
    fit: &CensiFit,
    samples: &[DisplacementSample],
    retained: &[bool],
    dropped: (f64, f64),
) -> Option<Matrix6<f64>> {
    let (sum, count) =
        retained_samples(samples, retained).fold((Vector3::zeros(), 0.0), |(sum, count), (_, sample)| {
            let residual = fit.residual(sample);
            (sum + residual.component_mul(&residual), count + 1.0)
        });
    // Three readings a displacement, six parameters.
    let degrees_of_freedom = count - 2.0;
    if degrees_of_freedom < 1.0 {
        return None;
    }
    let (plane, axis) = left_of_variance(dropped);
    let var = (sum / degrees_of_freedom).component_div(&Vector3::new(plane, plane, axis));
    let sigma = var.map(|var| var.sqrt().max(MIN_DISPLACEMENT_SIGMA));
    fit.information(retained_samples(samples, retained).map(|(_, sample)| sample), sigma).try_inverse()
}

#[cfg(test)]
mod tests {
    use super::least_squares::tests::{TRUTH, off, samples};
    use super::*;

    #[test]
    fn the_worst_in_position_or_heading_go_each_round() {
        let mut all: Vec<DisplacementSample> = (0..40).flat_map(|_| samples(&TRUTH)).collect();
        all[7].sensor_from_later.x_m += 0.3;
        all[11].sensor_from_later.theta_rad += 0.3;
        let trimmed = Censi::DEFAULT.trimmed(&all).expect("excited");
        assert!(!trimmed.retained[7] && !trimmed.retained[11]);
        assert!(off(&trimmed.fit, &TRUTH) < 1e-12, "{:?}", trimmed.fit);
        let untrimmed = Censi { rounds: 0, ..Censi::DEFAULT }.trimmed(&all).expect("excited");
        assert!(untrimmed.retained.iter().all(|retained| *retained) && off(&untrimmed.fit, &TRUTH) > 1e-4);
    }
}
