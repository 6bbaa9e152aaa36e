//! Angles and the cardinal sine (paper, eq. 7), exact on both sides of every branch.

use std::f64::consts::{PI, TAU};

/// Below this argument `sin(x)/x` and `1 − x²/6` are the same double: the next term, x⁴/120, is under 1e-18.
const SINC_SERIES_BELOW: f64 = 1e-4;

/// Below this argument the derivative of sinc is taken from its series; see [`sinc_derivative`].
const SINC_DERIVATIVE_SERIES_BELOW: f64 = 0.05;

/// Below this angle sine and cosine are taken from their series, see [`sin_cos`]. The first neglected terms, x⁹/9! and x¹⁰/10!, are under a fortieth of a
/// unit in the last place.
const SIN_COS_SERIES_BELOW_RAD: f64 = 1.0 / 32.0;

/// An angle of less than this is less than π by any rounding.
const CERTAINLY_WRAPPED_RAD: f64 = 3.0;

/// Sine and cosine, small angles by series.
///
/// Robots drive mostly straight ahead and stand mostly as they were put, and there the series takes a third of the time of a call of the C library. Only its
/// last addition rounds, so that it gives glibc's bits but for the last one of 1 argument in 10 000.
#[inline]
pub(crate) fn sin_cos(x: f64) -> (f64, f64) {
    if x.abs() < SIN_COS_SERIES_BELOW_RAD {
        let xx = x * x;
        let sin = x - x * xx * (1.0 / 6.0 - xx * (1.0 / 120.0 - xx * (1.0 / 5040.0)));
        let cos = 1.0 - xx * (0.5 - xx * (1.0 / 24.0 - xx * (1.0 / 720.0 - xx * (1.0 / 40_320.0))));
        (sin, cos)
    } else {
        x.sin_cos()
    }
}

/// The cardinal sine `sin(x)/x`, 1 at zero (paper, eq. 7).
///
/// The exact arc of a drive step is the midpoint chord times `sinc(Δθ/2)`.
#[inline]
#[must_use]
pub fn sinc(x: f64) -> f64 {
    sinc_given_sine(x, || sin_cos(x).0)
}

/// [`sinc`] where the sine of `x` is at hand already.
#[inline]
pub(crate) fn sinc_given_sine(x: f64, sine: impl FnOnce() -> f64) -> f64 {
    if x.abs() < SINC_SERIES_BELOW { 1.0 - x * x / 6.0 } else { sine() / x }
}

/// Derivative of [`sinc`]: `(cos x − sinc x)/x`, −x/3 near zero.
///
/// The closed form loses about `1e-16/x²` of relative accuracy to cancellation, the series (to x⁷) about `x⁸/1e5`; they cross
/// near x = 0.05.
#[must_use]
pub fn sinc_derivative(x: f64) -> f64 {
    if x.abs() < SINC_DERIVATIVE_SERIES_BELOW {
        let xx = x * x;
        x * (-1.0 / 3.0 + xx * (1.0 / 30.0 + xx * (-1.0 / 840.0 + xx / 45_360.0)))
    } else {
        (x.cos() - sinc(x)) / x
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

    /// Long double-free reference: the Taylor series summed until it stops changing (|x| ≤ 1).
    fn sinc_series(x: f64) -> f64 {
        let (mut sum, mut term, mut n) = (0.0_f64, 1.0_f64, 0.0);
        while sum + term != sum {
            sum += term;
            n += 2.0;
            term *= -x * x / (n * (n + 1.0));
        }
        sum
    }

    #[test]
    fn paper_eq_7_sinc_is_one_at_zero_and_sin_x_over_x_elsewhere() {
        assert_eq!(sinc(0.0), 1.0);
        assert_eq!(sinc(PI / 2.0), 2.0 / PI);
        assert!(sinc(PI).abs() < 1e-16);
    }

    #[test]
    fn sinc_agrees_with_its_series_on_both_sides_of_the_branch() {
        // Two roundings of the division and of the sine: 4 ulp of 1.
        for x in [1e-12, 0.99e-4, 1e-4, 1.01e-4, 1e-3, 0.3, 1.0] {
            for x in [x, -x] {
                assert!((sinc(x) - sinc_series(x)).abs() < 4.0 * f64::EPSILON, "{x}");
            }
        }
    }

    #[test]
    fn sine_and_cosine_agree_with_the_c_library_on_both_sides_of_the_branch() {
        // Each is good to its last bit, so they differ by one at most. Rejects a series without x⁷ (400 units near the branch) or without x⁶ (11).
        let n = 100_000;
        for k in -n..=n {
            let x = 1.2 * SIN_COS_SERIES_BELOW_RAD * f64::from(k) / f64::from(n);
            let ((sin, cos), (their_sin, their_cos)) = (sin_cos(x), x.sin_cos());
            for (ours, theirs) in [(sin, their_sin), (cos, their_cos)] {
                assert!([theirs, theirs.next_up(), theirs.next_down()].contains(&ours), "{x}: {ours} {theirs}");
            }
        }
        assert_eq!(sin_cos(0.0), (0.0, 1.0));
    }

    #[test]
    fn sinc_derivative_agrees_with_central_differences_across_the_branch() {
        // Step 1e-5: truncation h²/6·|sinc'''| < 2e-11·0.2, rounding 1e-16/1e-5 = 1e-11.
        let h = 1e-5;
        for x in [0.0, 1e-3, 0.0499, 0.0501, 0.5, 2.0, -0.0499, -0.0501, -2.0] {
            let difference = (sinc(x + h) - sinc(x - h)) / (2.0 * h);
            assert!((sinc_derivative(x) - difference).abs() < 3e-11, "{x}");
        }
        // The branch itself: closed form and series may differ by the closed form's cancellation, 1e-16/0.05² = 4e-14 relative.
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
