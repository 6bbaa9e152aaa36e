//! The rounding of recorded rates, of robots that report speeds or a twist.
//!
//! A rate that is rounded is off by the same in each row for as long as the robot drives evenly, and by the
//! same again whenever it drives so: an error that does not average out, as a ruler's. So rows that say the
//! same of a rate, forward or backward, share its error, which is uniform over a step. Noise of the speeds is
//! a dither: of standard deviation σ in steps it leaves e^{−2π²σ²} of what rows share, and the rest is
//! another error in each (Widrow & Kollár 2008). The noise is that of fifth differences, of which smooth
//! motion has none.

use std::f64::consts::TAU;

use dataset::{NominalRobot, RunView, WheelLog};
use kinematics::{Twist, Wheels};

use crate::settings::CHI_SQUARE_1_MEDIAN;

/// What a row says of both rates, in whole steps; 0 at rest, and where nothing is rounded.
pub(crate) type RateSteps = [i32; 2];

/// The rounded rates of a run.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RecordedRates {
    /// Each rate's, by row.
    steps: [Vec<i32>; 2],
    pub(crate) rounding: RateRounding,
}

/// What an error of a whole step of each recorded rate makes of the wheels' rates, rad/s; 0 where rates are
/// not rounded.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct RateRounding {
    pub(crate) step_rad_s: [Wheels<f64>; 2],
    /// Share of an error of each rate that rows share which say the same of it.
    pub(crate) shared: [f64; 2],
}

impl RecordedRates {
    /// Of a run; `None` where its rates are not rounded.
    pub(crate) fn of(run: &RunView<'_>, robot: &NominalRobot) -> Option<Self> {
        let wheels = &run.odometry().wheels;
        let step = wheels.recorded_step()?;
        let geometry = robot.geometry().ok()?;
        let (columns, of_step_m_s) = match wheels {
            WheelLog::Speeds(speeds) => {
                ([&speeds.left, &speeds.right], [Wheels { left: step, right: 0.0 }, Wheels { left: 0.0, right: step }])
            }
            WheelLog::Twist { v_mps, omega_radps } => (
                [v_mps, omega_radps],
                [(step, 0.0), (0.0, step)]
                    .map(|(v_m_s, omega_rad_s)| geometry.wheel_speed_m_s(Twist { v_m_s, omega_rad_s })),
            ),
            WheelLog::Ticks(_) | WheelLog::Angles(_) => return None,
        };
        let steps = columns.map(|column| column.iter().map(|rate| (rate / step).round() as i32).collect());
        Some(Self {
            rounding: RateRounding {
                shared: steps.each_ref().map(|steps: &Vec<i32>| (-0.5 * TAU * TAU * noise_variance(steps)).exp()),
                step_rad_s: of_step_m_s.map(|of| of.zip_with(geometry.m_per_rad(), |m_s, m_per_rad| m_s / m_per_rad)),
            },
            steps,
        })
    }

    /// Of a row.
    pub(crate) fn at(&self, row: usize) -> RateSteps {
        self.steps.each_ref().map(|steps| steps.get(row).copied().unwrap_or_default())
    }
}

/// Variance of the noise of values that are rounded to whole numbers, beside that of the rounding: by fifth
/// differences in motion, by the median of their squares, as those of a robot that sets off are large. Speeds
/// that are made of counts have the rounding of two counts: its differences are those of nearly twice its
/// variance, and it is on a grid, which dithers less. A quarter counts.
fn noise_variance(steps: &[i32]) -> f64 {
    let in_motion = steps.windows(6).filter(|of| of.iter().any(|step| *step != 0));
    let fifth = |of: &[i32]| {
        let weights = [-1.0, 5.0, -10.0, 10.0, -5.0, 1.0];
        of.iter().zip(weights).map(|(step, weight)| weight * f64::from(*step)).sum::<f64>()
    };
    let mut squares: Vec<f64> = in_motion.map(|of| fifth(of).powi(2)).collect();
    squares.sort_unstable_by(f64::total_cmp);
    let middle = squares.get(squares.len() / 2).copied().unwrap_or(0.0);
    0.25 * f64::max(middle / CHI_SQUARE_1_MEDIAN / 252.0 - 1.0 / 12.0, 0.0)
}

/// What rows say of one of both rates, without its sign: drives and their reverses have the same wheels, and
/// opposite errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct RecordedRate {
    /// Which rate.
    pub(crate) rate: usize,
    /// In steps, not below 0.
    pub(crate) steps: i32,
}

impl RecordedRate {
    /// That of a row, and its sense, which is that of the other rate where it is 0; `None` at rest.
    pub(crate) fn of(rate: usize, steps: RateSteps) -> Option<(Self, f64)> {
        let own = steps[rate];
        let sense = if own == 0 { steps[1 - rate].signum() } else { own.signum() };
        (sense != 0).then_some((Self { rate, steps: own.abs() }, f64::from(sense)))
    }
}

impl RateRounding {
    /// Are rates rounded?
    pub(crate) fn is_any(&self) -> bool {
        *self != Self::default()
    }

    /// What errors of both recorded rates, in steps, turn the wheels by in so many seconds, radians.
    pub(crate) fn turned_rad(&self, errors: [f64; 2], dt_s: f64) -> Wheels<f64> {
        let [first, second] = self.step_rad_s;
        first.zip_with(second, |first, second| (errors[0] * first + errors[1] * second) * dt_s)
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    #[test]
    fn noise_is_what_rounding_and_smooth_motion_are_not() {
        let mut draws = Xoshiro256PlusPlus::seed_from_u64(3);
        let mut of = |sigma: f64| {
            // A ripple of 9 steps in a dozen rows, about half of a step.
            let rate = |row: i32| 150.37 + 9.0 * (0.53 * f64::from(row)).sin();
            let noise: Vec<f64> = (0..4000).map(|_| StandardNormal.sample(&mut draws)).collect();
            let rounded =
                (0..4000).zip(noise).map(|(row, noise): (i32, f64)| (rate(row) + sigma * noise).round() as i32);
            noise_variance(&rounded.collect::<Vec<i32>>())
        };
        // A quarter of the variance, which the median of 4000 squares says to a twentieth, and of dependent
        // ones to a tenth. Rejects third differences, of which the ripple has 0.05 and more.
        assert!(of(0.0) < 0.01);
        for sigma in [1.0, 3.0] {
            let share = of(sigma) / (sigma * sigma);
            assert!((share - 0.25).abs() < 0.03, "{share}");
        }
        assert_eq!(noise_variance(&[0; 400]), 0.0);
    }
}
