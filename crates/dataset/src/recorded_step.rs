//! The step that recorded rates are rounded to.
//!
//! Counts are rounded once: what one row leaves out the next one has. A rate that is rounded leaves out the
//! same in each row for as long as the robot drives evenly: 0.5 mm/s, of a robot at 0.15 m/s, is 0.3 % of the
//! distance.

use std::collections::BTreeSet;

use crate::record::WheelLog;
use crate::settings::ROUNDED_RATES;

impl WheelLog {
    /// The step that recorded angles, speeds, or speed and yaw rate, are rounded to, rad, m/s or rad/s: one,
    /// two or five in the last decimal that any of them has. `None` for counts, where values have more
    /// decimals than rounded ones, and where they are so few that the robot may have driven at these.
    #[must_use]
    pub fn recorded_step(&self) -> Option<f64> {
        self.decimals().filter(Decimals::are_many).map(|decimals| decimals.step())
    }

    /// The same, however few the values are: of few, one in their last decimal.
    pub(crate) fn decimal_step(&self) -> Option<f64> {
        self.decimals().map(|decimals| if decimals.are_many() { decimals.step() } else { 1.0 / decimals.per_unit })
    }

    fn decimals(&self) -> Option<Decimals> {
        let columns = match self {
            Self::Angles(wheels) | Self::Speeds(wheels) => [&wheels.left, &wheels.right],
            Self::Twist { v_mps, omega_radps } => [v_mps, omega_radps],
            Self::Ticks(_) => return None,
        };
        let values = || columns.into_iter().flatten().copied();
        let tolerance = ROUNDED_RATES.decimal_tolerance;
        let is_whole = |value: f64| (value - value.round()).abs() <= tolerance;
        let per_unit = (0..=ROUNDED_RATES.max_decimals)
            .map(|decimals| 10_f64.powi(decimals))
            .find(|of| values().all(|value| is_whole(value * of)))?;
        Some(Decimals { per_unit, numbers: values().map(|value| (value * per_unit).round() as i64).collect() })
    }
}

/// Values that have few decimals.
struct Decimals {
    /// Of the last decimal, in one of the values' unit.
    per_unit: f64,
    /// The values, in their last decimal.
    numbers: BTreeSet<i64>,
}

impl Decimals {
    /// Are there more values than speeds that a robot is told to drive at?
    fn are_many(&self) -> bool {
        self.numbers.len() >= ROUNDED_RATES.min_distinct_rates
    }

    /// The step that they are multiples of: one, two or five in their last decimal.
    fn step(&self) -> f64 {
        let is_of_all = |step: &i64| self.numbers.iter().all(|number| number % step == 0);
        [5, 2].into_iter().find(is_of_all).unwrap_or(1) as f64 / self.per_unit
    }
}

#[cfg(test)]
mod tests {
    use kinematics::Wheels;

    use super::*;

    /// A robot that speeds up by 14 mm/s a row, its speeds rounded.
    fn speeds(step_m_s: f64) -> WheelLog {
        let of = |share: f64| {
            (0..60).map(|row| (0.013_731_9 * share * f64::from(row) / step_m_s).round() * step_m_s).collect()
        };
        WheelLog::Speeds(Wheels { left: of(1.0), right: of(-0.7) })
    }

    #[test]
    fn the_step_is_that_of_the_last_decimal_of_any_value() {
        for step_m_s in [1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 1e-4] {
            let found = speeds(step_m_s).recorded_step().expect("rounded");
            // A decimal fraction and its reciprocal are each rounded once.
            assert!((found / step_m_s - 1.0).abs() < 1e-12, "{found} {step_m_s}");
        }
    }

    #[test]
    fn values_that_are_not_rounded_or_few_and_counts_have_none() {
        assert_eq!(speeds(1e-7).recorded_step(), None);
        assert_eq!(speeds(0.5).recorded_step(), None, "two speeds forward and one back");
        assert_eq!(speeds(0.5).decimal_step(), Some(0.1));
        let WheelLog::Speeds(Wheels { left, right }) = speeds(1e-2) else { panic!("speeds") };
        let counts: [Vec<i64>; 2] = [&left, &right].map(|of| of.iter().map(|speed| (100.0 * speed) as i64).collect());
        assert_eq!(WheelLog::Ticks(Wheels { left: counts[0].clone(), right: counts[1].clone() }).recorded_step(), None);
        let third = left.iter().map(|speed| speed / 3.0).collect();
        assert_eq!(WheelLog::Twist { v_mps: third, omega_radps: right }.recorded_step(), None);
    }
}
