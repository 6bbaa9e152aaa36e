//! Sine, cosine and arctangent without calls and tables: what dead reckoning and the closed form spend their time on.
//!
//! Arguments up to [`LARGEST_RAD`] are reduced by Cody & Waite (1980), multiples of π/2 in three parts whose first two multiply exactly; the rest goes
//! through the minimax polynomials of fdlibm (Sun Microsystems 1993, `k_sin.c`, `k_cos.c`, `s_atan.c`), under 2⁻⁵⁸ off. Results are within 1.5 units of the
//! last place, beyond the borders they are the C library's. Products and sums are rounded one by one, never fused, so that every instruction set, one
//! argument or eight at a time, gives the same bits; [`reduced`] has no branch, for loops over columns.

use std::f64::consts::{FRAC_2_PI, FRAC_PI_4};

/// Up to here an argument is reduced in-house, radians: its multiple of π/2 is under 2²⁰, and 2²⁰ times a part of 33 bits is exact.
pub(crate) const LARGEST_RAD: f64 = 1e6;

/// π/2 in three parts, the first two of 33 bits (fdlibm, `e_rem_pio2.c`).
const HALF_PI: [f64; 3] = [1.570_796_326_734_125_6, 6.077_100_506_303_966e-11, 2.022_266_248_795_950_6e-21];

/// 1.5·2⁵²: a number under 2⁵¹ added to it is rounded to a whole one, which stands in the low bits.
const SHIFTER: f64 = 6_755_399_441_055_744.0;

/// sin x = x + x³·(S₀ + S₁x² + …) up to π/4.
const SINE: [f64; 6] = [
    -0.166_666_666_666_666_32,
    0.008_333_333_333_322_49,
    -0.000_198_412_698_298_579_5,
    2.755_731_370_707_006_8e-6,
    -2.505_076_025_340_686_3e-8,
    1.589_690_995_211_55e-10,
];

/// cos x = 1 − x²/2 + x⁴·(C₀ + C₁x² + …) up to π/4.
const COSINE: [f64; 6] = [
    0.041_666_666_666_666_6,
    -0.001_388_888_888_887_411,
    2.480_158_728_947_673e-5,
    -2.755_731_435_139_066_3e-7,
    2.087_572_321_298_175e-9,
    -1.135_964_755_778_819_5e-11,
];

/// atan x = x − x³·(A₀ + A₁x² + …) up to 7/16.
const ARCTANGENT: [[f64; 6]; 2] = [
    [
        0.333_333_333_333_329_3,
        -0.199_999_999_998_764_83,
        0.142_857_142_725_034_66,
        -0.111_111_104_054_623_56,
        0.090_908_871_334_365_07,
        -0.076_918_762_050_448_3,
    ],
    [
        0.066_610_731_373_875_31,
        -0.058_335_701_337_905_735,
        0.049_768_779_946_159_324,
        -0.036_531_572_744_216_916,
        0.016_285_820_115_365_782,
        0.0,
    ],
];

/// Up to this tangent [`atan2`] is the polynomial.
const LARGEST_TANGENT: f64 = 7.0 / 16.0;

/// c₀ + c₁x + c₂x² + …, in pairs that do not wait for each other (Estrin).
#[inline(always)]
fn polynomial([c0, c1, c2, c3, c4, c5]: [f64; 6], x: f64) -> f64 {
    let xx = x * x;
    (c0 + c1 * x) + xx * ((c2 + c3 * x) + xx * (c4 + c5 * x))
}

/// sin x / x up to π/4.
#[inline(always)]
pub(crate) fn small_sinc(x: f64) -> f64 {
    let xx = x * x;
    1.0 + xx * polynomial(SINE, xx)
}

/// Sine and cosine up to π/4.
#[inline(always)]
fn small(x: f64) -> (f64, f64) {
    let xx = x * x;
    (x + x * xx * polynomial(SINE, xx), 1.0 - (0.5 * xx - xx * xx * polynomial(COSINE, xx)))
}

/// Sine and cosine up to [`LARGEST_RAD`], without a branch.
#[inline(always)]
pub(crate) fn reduced(x: f64) -> (f64, f64) {
    let shifted = x * FRAC_2_PI + SHIFTER;
    let (quarter, quarters) = (shifted.to_bits(), shifted - SHIFTER);
    // Both products are exact; the second difference rounds, and what it dropped goes in with the third part.
    let (coarse, fine) = (x - quarters * HALF_PI[0], quarters * HALF_PI[1]);
    let rest = coarse - fine;
    let (sin, cos) = small(rest + (((coarse - rest) - fine) - quarters * HALF_PI[2]));
    // Odd quarters swap sine and cosine; the second and third turn the sine's sign, the first and second the cosine's.
    let (sin, cos) = (sin.to_bits(), cos.to_bits());
    let swap = (sin ^ cos) & (quarter & 1).wrapping_neg();
    let (sin_sign, cos_sign) = ((quarter & 2) << 62, (quarter.wrapping_add(1) & 2) << 62);
    (f64::from_bits((sin ^ swap) ^ sin_sign), f64::from_bits((cos ^ swap) ^ cos_sign))
}

/// Sets the highest bit where |x| is above a limit or x is no number: the bits of positive doubles have the doubles' order, and loops can collect them.
#[inline(always)]
pub(crate) const fn exceeds(x: f64, limit: f64) -> u64 {
    x.abs().to_bits().wrapping_add((1 << 63) - 1 - limit.to_bits())
}

/// Sine and cosine.
#[inline]
pub(crate) fn sin_cos(x: f64) -> (f64, f64) {
    // No quarter: what is left of `reduced`.
    if x.abs() <= FRAC_PI_4 {
        small(x)
    } else if x.abs() <= LARGEST_RAD {
        reduced(x)
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
    if x.abs() <= FRAC_PI_4 { small_sinc(x) } else { sin_cos(x).0 / x }
}

/// [`sinc`] where the sine of `x` is at hand already.
#[inline]
pub(crate) fn sinc_given_sine(x: f64, sine: f64) -> f64 {
    if x.abs() <= FRAC_PI_4 { small_sinc(x) } else { sine / x }
}

/// Angle of the vector (x, y) from the x axis, radians in [−π, π]: [`f64::atan2`], faster where the angle is small.
#[inline]
#[must_use]
pub fn atan2(y: f64, x: f64) -> f64 {
    let tangent = y / x;
    if x > 0.0 && tangent.abs() <= LARGEST_TANGENT {
        let square = tangent * tangent;
        let [low, high] = ARCTANGENT.map(|half| polynomial(half, square));
        let sixth = square * square * square * (square * square * square);
        // The sign is that of a zero, too.
        (tangent - tangent * square * (low + sixth * high)).copysign(y)
    } else {
        y.atan2(x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    /// How many doubles apart.
    fn units_apart(a: f64, b: f64) -> u64 {
        let ordered = |x: f64| if x < 0.0 { -x.abs().to_bits().cast_signed() } else { x.to_bits().cast_signed() };
        ordered(a).abs_diff(ordered(b))
    }

    /// Arguments over a range, dense and irregular, both signs.
    fn arguments(largest: f64) -> impl Iterator<Item = f64> {
        const COUNT: u32 = 200_000;
        (0..=COUNT).map(move |k| largest * (f64::from(k) / f64::from(COUNT) * 1.999_999_7 - 1.0))
    }

    /// Ours is within 1.5 units of the last place and theirs within 0.55 (glibc states as much): no more than two doubles apart. Rejects polynomials
    /// that lack their last term, and a reduction by a π/2 of two parts (thousands of units next to a zero).
    #[test]
    fn sine_and_cosine_agree_with_the_c_library() {
        for largest in [1.0 / 32.0, FRAC_PI_4, 1.0, 10.0, 1e3, 1e5, LARGEST_RAD] {
            for x in arguments(largest) {
                let ((sin, cos), (their_sin, their_cos)) = (sin_cos(x), x.sin_cos());
                assert!(units_apart(sin, their_sin) <= 2 && units_apart(cos, their_cos) <= 2, "{x}: {sin} {cos}");
            }
        }
        // The doubles next to zeros and borders of quarters, where the reduction cancels most.
        for quarter in -600_000..=600_000 {
            for x in [FRAC_PI_4, FRAC_PI_2].map(|unit| unit * f64::from(quarter)) {
                for x in [x.next_down(), x, x.next_up()] {
                    let ((sin, cos), (their_sin, their_cos)) = (sin_cos(x), x.sin_cos());
                    assert!(units_apart(sin, their_sin) <= 2 && units_apart(cos, their_cos) <= 2, "{x}: {sin} {cos}");
                }
            }
        }
    }

    #[test]
    fn sines_of_few_bits_are_exact() {
        assert_eq!(sin_cos(0.0), (0.0, 1.0));
        assert_eq!(sin_cos(FRAC_PI_2).0, 1.0);
        assert_eq!(sin_cos(PI).1, -1.0);
        assert!(sin_cos(f64::INFINITY).0.is_nan() && sin_cos(f64::NAN).1.is_nan());
        assert_eq!(sin_cos(1e300), 1e300_f64.sin_cos());
    }

    #[test]
    fn one_argument_gives_the_bits_of_the_loop_over_columns() {
        for largest in [1e-3, FRAC_PI_4, 1.0, 1e3, LARGEST_RAD] {
            for x in arguments(largest).filter(|x| *x != 0.0) {
                let ((a, b), (c, d)) = (sin_cos(x), reduced(x));
                assert_eq!((a.to_bits(), b.to_bits()), (c.to_bits(), d.to_bits()), "{x}");
            }
        }
    }

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
        assert_eq!(sinc(FRAC_PI_2), 2.0 / PI);
        assert!(sinc(PI).abs() < 1e-16);
    }

    #[test]
    fn sinc_agrees_with_its_series_on_both_sides_of_the_branch() {
        // Two roundings of the division and of the sine: 4 ulp of 1.
        for x in [1e-12, 1e-4, 1e-3, 0.3, 0.785, FRAC_PI_4, 0.786, 1.0] {
            for x in [x, -x] {
                assert!((sinc(x) - sinc_series(x)).abs() < 4.0 * f64::EPSILON, "{x}");
            }
        }
    }

    /// A unit and a half of rounding against half a unit, and the division's: three doubles. Rejects a polynomial that lacks its last term.
    #[test]
    fn the_arctangent_agrees_with_the_c_library_all_round() {
        for angle in arguments(PI) {
            for scale in [1e-3, 1.0, 7.3] {
                let (y, x) = (scale * angle.sin(), scale * angle.cos());
                assert!(units_apart(atan2(y, x), y.atan2(x)) <= 3, "{y} {x}");
            }
        }
        for (y, x) in [(0.0, 1.0), (-0.0, 1.0), (0.0, -1.0), (0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (1.0, f64::INFINITY)]
        {
            assert_eq!(atan2(y, x).to_bits(), y.atan2(x).to_bits(), "{y} {x}");
        }
        assert!(atan2(f64::NAN, 1.0).is_nan());
    }
}
