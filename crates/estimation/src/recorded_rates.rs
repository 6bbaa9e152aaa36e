//! The rounding of recorded rates, of robots that report speeds or a twist.
//!
//! A rate that is rounded is off by the same in each row for as long as the robot drives evenly, and by the
//! same again whenever it drives so: an error that does not average out, as a ruler's. So rows that say the
//! same of a rate, forward or backward, share its error, which is uniform over a step. Noise of the speeds is
//! a dither: of standard deviation σ in steps it leaves e^{−2π²σ²} of what rows share, and the rest is
//! another error in each (Widrow & Kollár 2008). The noise is that of fifth differences, of which smooth
//! motion has none. The noise of speeds that are made of few counts dithers nothing: each number of counts
//! has an error of its own.

use std::f64::consts::TAU;

use dataset::{NominalRobot, RunView, WheelLog, median};
use kinematics::{Twist, Wheels};

use crate::settings::{COMMON, RECORDED_RATES};

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
        let is_twist = matches!(wheels, WheelLog::Twist { .. });
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
        let steps: [Vec<i32>; 2] =
            columns.map(|column| column.iter().map(|rate| (rate / step).round() as i32).collect());
        let step_rad_s = of_step_m_s.map(|of| of.zip_with(geometry.m_per_rad(), |m_s, m_per_rad| m_s / m_per_rad));
        let count_rad_s = count_rad_s(run, robot);
        let shared = [0, 1].map(|rate: usize| {
            let of_count = step_rad_s[rate].map(|step| if step == 0.0 { 0.0 } else { count_rad_s / step.abs() });
            let counted = if is_twist { of_count.map(|steps| 0.5 * steps) } else { of_count };
            (-0.5 * TAU * TAU * dithering_variance(&steps[rate], counted)).exp()
        });
        Some(Self { rounding: RateRounding { shared, step_rad_s }, steps })
    }

    /// Of a row.
    pub(crate) fn at(&self, row: usize) -> RateSteps {
        self.steps.each_ref().map(|steps| steps.get(row).copied().unwrap_or_default())
    }
}

/// What one count in a row's interval is of a wheel's rate, rad/s; 0 where a robot states no counts.
fn count_rad_s(run: &RunView<'_>, robot: &NominalRobot) -> f64 {
    let t_s = &run.odometry().t_s;
    let intervals = t_s.len().saturating_sub(1);
    match (robot.ticks_per_rev, t_s.first(), t_s.last()) {
        (Some(ticks), Some(first_s), Some(last_s)) if intervals > 0 => {
            TAU / ticks / ((last_s - first_s) / intervals as f64)
        }
        _ => 0.0,
    }
}

/// Weights of fifth differences, the sum of their squares, and of those of one sign.
const FIFTH: ([f64; 6], f64, f64) = ([-1.0, 5.0, -10.0, 10.0, -5.0, 1.0], 252.0, 16.0);

/// Variance of what dithers values that are rounded to whole numbers: of their noise beside that of the
/// rounding, by fifth differences in motion, by the median of their squares, as those of a robot that sets
/// off are large. `counted` is what one count of each wheel makes of a value. Where that is so much that an
/// interval of rounding has hardly two numbers of counts, their noise is no dither: one count more in every
/// other row is all that it can be. Of finer speeds that are made of counts, the rounding of two counts has
/// nearly twice its variance in fifth differences, and is on a grid, which dithers less: a quarter counts.
fn dithering_variance(steps: &[i32], counted: Wheels<f64>) -> f64 {
    let (weights, squares_of_weights, of_one_sign) = FIFTH;
    let in_motion = steps.windows(6).filter(|of| of.iter().any(|step| *step != 0));
    let fifth = |of: &[i32]| of.iter().zip(weights).map(|(step, weight)| weight * f64::from(*step)).sum::<f64>();
    let middle = median(in_motion.map(|of| fifth(of).powi(2))).unwrap_or(0.0);
    let is_coarse = f64::max(counted.left, counted.right) >= RECORDED_RATES.min_count_steps;
    let of_counts = if is_coarse { (of_one_sign * (counted.left + counted.right)).powi(2) } else { 0.0 };
    0.25 * f64::max((middle - of_counts) / COMMON.chi_square_1_median / squares_of_weights - 1.0 / 12.0, 0.0)
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
            dithering_variance(&rounded.collect::<Vec<i32>>(), Wheels::both(0.0))
        };
        // A quarter of the variance, which the median of 4000 squares says to a twentieth, and of dependent
        // ones to a tenth. Rejects third differences, of which the ripple has 0.05 and more.
        assert!(of(0.0) < 0.01);
        for sigma in [1.0, 3.0] {
            let share = of(sigma) / (sigma * sigma);
            assert!((share - 0.25).abs() < 0.03, "{share}");
        }
        assert_eq!(dithering_variance(&[0; 400], Wheels::both(0.0)), 0.0);
    }

    #[test]
    fn the_noise_of_few_counts_dithers_nothing() {
        // Speeds of 39.6 counts a row, 2.28 steps each.
        let counts: Vec<f64> = (0..4000).map(|row| (39.6 * f64::from(row)).floor()).collect();
        let speeds = counts.windows(2).map(|of| (2.28 * (of[1] - of[0])).round() as i32);
        let steps: Vec<i32> = speeds.collect();
        let one_wheel = Wheels { left: 2.28, right: 0.0 };
        assert_eq!(dithering_variance(&steps, one_wheel), 0.0);
        // Rejects noise of counts as that of speeds, which leaves e^−5 of the error.
        assert!(dithering_variance(&steps, Wheels::both(0.0)) > 0.25);
    }
}
