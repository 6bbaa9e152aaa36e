//! What windows say of the drive by themselves, without any nominal value.
//!
//! Rigid motion gives for the displacement a_L·Δ_L + a_R·Δ_R and the turn b_L·Δ_L + b_R·Δ_R of an instrument
//! anywhere on the robot: a_R/b_R − a_L/b_L = B·u with u the robot's direction as the instrument sees it,
//! r_L = −b_L·B and r_R = b_R·B.

use kinematics::{Side, Wheels};

use crate::alignment::Paired;
use crate::regression::{Moments, jackknife_sigma, robustly, slope, without_each_group};
use crate::settings::CHECKS;

/// The drive: metres a radian of each wheel (negative: it counts backwards) and the separation (negative: the
/// robot turns the other way).
#[derive(Debug, Clone, Copy)]
pub(crate) struct GeometryEstimate {
    pub(crate) m_per_rad: Wheels<f64>,
    pub(crate) separation_m: f64,
    /// Relative standard deviations of left, right, separation, by the jackknife.
    pub(crate) sigma: [f64; 3],
    /// Noise of the wheels beside turns that are hardly larger dilutes the regression: its signs count, and
    /// its sizes do not.
    pub(crate) is_diluted: bool,
    /// Direction of the robot in the instrument's frame, radians.
    pub(crate) sensor_rad: f64,
}

/// What windows say whose wheels turn in one proportion.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OneDirection {
    /// Turns of the wheels, of length 1.
    pub(crate) direction: Wheels<f64>,
    /// Metres a radian along it, ahead and absolute; and turn a radian, with its standard deviation.
    pub(crate) ahead_m_per_rad: f64,
    pub(crate) distance_m_per_rad: f64,
    pub(crate) distance_sigma: f64,
    pub(crate) turn_per_rad: f64,
    pub(crate) turn_sigma: f64,
}

impl GeometryEstimate {
    /// Of windows with poses; `None` where they do not determine all three.
    pub(crate) fn of(pairs: &[Paired]) -> Option<Self> {
        let whole = Self::once(pairs)?;
        let without = without_each_group(pairs, Self::once)?;
        let sigma = |of: fn(&Self) -> f64| jackknife_sigma(&without, of) / of(&whole).abs();
        let sigma = [sigma(|one| one.m_per_rad.left), sigma(|one| one.m_per_rad.right), sigma(|one| one.separation_m)];
        Some(Self { sigma, ..whole })
    }

    fn once(pairs: &[Paired]) -> Option<Self> {
        if pairs.len() < CHECKS.min_windows {
            return None;
        }
        let of = |value: fn(&Paired) -> Option<f64>| {
            robustly(&pairs.iter().filter_map(|pair| Some((pair.moved, value(pair)?))).collect::<Vec<_>>())
        };
        let (ahead, aside) = (of(|pair| Some(pair.window.ahead_m))?, of(|pair| Some(pair.window.left_m))?);
        let turn = of(|pair| Some(pair.turned?.1))?;
        if Side::BOTH.iter().any(|side| turn.per_rad[*side].abs() < 4.0 * turn.sigma[*side]) {
            return None;
        }
        let ratio = |of: Wheels<f64>| of.right / turn.per_rad.right - of.left / turn.per_rad.left;
        let (x_m, y_m) = (ratio(ahead.per_rad), ratio(aside.per_rad));
        // A robot whose instrument looks ahead rather than back has a positive separation.
        let separation_m = if x_m < 0.0 { -x_m.hypot(y_m) } else { x_m.hypot(y_m) };
        let sign = separation_m.signum();
        Some(Self {
            m_per_rad: Wheels { left: -turn.per_rad.left * separation_m, right: turn.per_rad.right * separation_m },
            separation_m,
            sigma: [0.0; 3],
            is_diluted: turn.left > CHECKS.max_unexplained * turn.whole,
            sensor_rad: (sign * y_m).atan2(sign * x_m),
        })
    }
}

impl OneDirection {
    /// Of windows whose wheels turn in one proportion.
    pub(crate) fn of(pairs: &[Paired]) -> Option<Self> {
        let direction = Moments::of(pairs.iter().map(|pair| (pair.moved, 1.0))).direction()?;
        // Positive along the first wheel.
        let direction = if direction.left < 0.0 { direction.map(|part| -part) } else { direction };
        let along = |turn: Wheels<f64>| turn.left * direction.left + turn.right * direction.right;
        let of = |value: fn(&Paired) -> Option<f64>| {
            slope(&pairs.iter().filter_map(|pair| Some((along(pair.moved), value(pair)?))).collect::<Vec<_>>())
        };
        let (ahead, sigma, ..) = of(|pair| Some(pair.window.ahead_m))?;
        let (aside, ..) = of(|pair| Some(pair.window.left_m))?;
        let (turn_per_rad, turn_sigma, ..) = of(|pair| Some(pair.turned?.1))?;
        Some(Self {
            direction,
            ahead_m_per_rad: ahead,
            distance_m_per_rad: ahead.hypot(aside),
            distance_sigma: sigma / ahead.hypot(aside),
            turn_per_rad,
            turn_sigma,
        })
    }
}
