//! Directions, and the slope of the cardinal sine (paper, eq. 7), exact on both sides of every branch.

use std::f64::consts::{PI, TAU};

use crate::trig::{sin_cos, sinc};

/// Below this argument the derivative of sinc is taken from its series; see [`sinc_derivative`].
const SINC_DERIVATIVE_SERIES_BELOW: f64 = 0.05;

/// An angle of less than this is less than π by any rounding.
const CERTAINLY_WRAPPED_RAD: f64 = 3.0;

/// Derivative of [`sinc`]: `(cos x − sinc x)/x`, −x/3 near zero.
///
/// The closed form loses about `1e-16/x²` of relative accuracy to cancellation, the series (to x⁷) about
/// `x⁸/1e5`; they cross near x = 0.05.
#[must_use]
pub fn sinc_derivative(x: f64) -> f64 {
    if x.abs() < SINC_DERIVATIVE_SERIES_BELOW {
        let xx = x * x;
        x * (-1.0 / 3.0 + xx * (1.0 / 30.0 + xx * (-1.0 / 840.0 + xx / 45_360.0)))
    } else {
        (sin_cos(x).1 - sinc(x)) / x
    }
}

/// The same direction in (−π, π].
#[inline]
#[must_use]
pub fn wrap_to_pi(angle_rad: f64) -> f64 {
    if angle_rad.abs() < CERTAINLY_WRAPPED_RAD {
        return angle_rad;
    }
    let wrapped = angle_rad - TAU * (angle_rad / TAU).round();
    if wrapped <= -PI {
        wrapped + TAU
    } else if wrapped > PI {
        wrapped - TAU
    } else {
        wrapped
    }
}

/// The angle equal to `angle_rad` modulo whole turns that lies nearest to `reference_rad`.
///
/// An outside instrument reports headings modulo a turn; the whole turns come from the odometry.
#[inline]
#[must_use]
pub fn unwrap_near(angle_rad: f64, reference_rad: f64) -> f64 {
    reference_rad + wrap_to_pi(angle_rad - reference_rad)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sinc_derivative_agrees_with_central_differences_across_the_branch() {
        // Step 1e-5: truncation h²/6·|sinc'''| < 2e-11·0.2, rounding 1e-16/1e-5 = 1e-11.
        let h = 1e-5;
        for x in [0.0, 1e-3, 0.0499, 0.0501, 0.5, 2.0, -0.0499, -0.0501, -2.0] {
            let difference = (sinc(x + h) - sinc(x - h)) / (2.0 * h);
            assert!((sinc_derivative(x) - difference).abs() < 3e-11, "{x}");
        }
        // The branch itself: closed form and series may differ by the closed form's cancellation, 1e-16/0.05²
        // = 4e-14 relative.
        let x = SINC_DERIVATIVE_SERIES_BELOW;
        let closed = (x.cos() - sinc(x)) / x;
        assert!((sinc_derivative(x * (1.0 - 1e-15)) - closed).abs() < 1e-14);
    }

    #[test]
    fn wrapping_keeps_the_direction_and_the_half_open_interval() {
        assert_eq!(wrap_to_pi(PI), PI);
        assert_eq!(wrap_to_pi(-PI), PI);
        for turns in [-3.0, -1.0, 0.0, 2.0, 1e3] {
            for angle in [-3.1, -1e-9, 0.0, 0.5, 3.1] {
                let wrapped = wrap_to_pi(angle + turns * TAU);
                // One rounding of the large argument.
                assert!((wrapped - angle).abs() < 1e-12, "{angle} + {turns} turns");
            }
        }
    }

    #[test]
    fn unwrapping_takes_the_whole_turns_of_the_reference() {
        assert!((unwrap_near(0.1, 2.0 * TAU) - (2.0 * TAU + 0.1)).abs() < 1e-14);
        assert!((unwrap_near(3.0, -3.0) - (3.0 - TAU)).abs() < 1e-14);
    }
}
