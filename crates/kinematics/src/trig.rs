//! Sine, cosine and arctangent without calls and tables: what dead reckoning and the closed form spend their
//! time on.
//!
//! Arguments up to [`LARGEST_RAD`] are reduced by Cody & Waite (1980), multiples of π/2 in three parts whose
//! first two multiply exactly; the rest goes through the minimax polynomials of fdlibm (Sun Microsystems
//! 1993, `k_sin.c`, `k_cos.c`, `s_atan.c`), under 2⁻⁵⁸ off. Results are within 1.5 units of the last place,
//! beyond the borders they are the C library's. [`Direction`] is what loops over columns take: no branch, a
//! third fewer operations, true to 2⁻⁵¹ of the circle. Products and sums are rounded one by one, never fused,
//! so that every instruction set, one argument or eight at a time, gives the same bits.

use std::f64::consts::{FRAC_1_PI, FRAC_2_PI, FRAC_PI_4};

/// Up to here an argument is reduced in-house, radians: its multiple of π/2 is under 2²⁰, and 2²⁰ times a
/// part of 33 bits is exact.
pub(crate) const LARGEST_RAD: f64 = 1e6;

/// π/2 in three parts, the first two of 33 bits (fdlibm, `e_rem_pio2.c`).
const HALF_PI: [f64; 3] = [1.570_796_326_734_125_6, 6.077_100_506_303_966e-11, 2.022_266_248_795_950_6e-21];

/// 1.5·2⁵²: a number under 2⁵¹ added to it is rounded to a whole one, which stands in the low bits.
pub(crate) const SHIFTER: f64 = 6_755_399_441_055_744.0;

/// π in two parts, the first of 33 bits: twice those of [`HALF_PI`].
const WHOLE_PI: [f64; 2] = [2.0 * HALF_PI[0], 2.0 * 6.077_100_506_506_192e-11];

/// A [`Direction`] is found up to so many half turns, 1.6·10⁶ rad: times the first part of [`WHOLE_PI`] they
/// are exact.
const MAX_HALF_TURNS: u64 = 1 << 19;

/// 2 sin(x/2) = x + x³·(T₀ + T₁x² + …) up to π/2, by Remez' exchange to 6e-18 of the sine.
const TWICE_HALF_SINE: [f64; 6] = [
    -0.041_666_666_666_666_61,
    0.000_520_833_333_332_729_5,
    -3.100_198_410_961_449e-6,
    1.076_457_564_655_754_4e-8,
    -2.446_360_851_435_094e-11,
    3.880_552_559_634_098e-14,
];

/// cos(x/2) = 1 + x²·(H₀ + H₁x² + …) up to π/2, by Remez' exchange to 9e-17.
const HALF_COSINE: [f64; 6] = [
    -0.124_999_999_999_999_08,
    0.002_604_166_666_657_618_6,
    -2.170_138_886_286_09e-5,
    9.688_116_779_848_215e-8,
    -2.690_943_466_149_762_3e-10,
    5.036_734_776_345_99e-13,
];

/// The square of the largest half turn of a step at which [`short_sinc`] is taken, (¼ rad)².
pub(crate) const LARGEST_SHORT_SQUARE: f64 = 0.0625;

/// sin x / x = 1 + x²·(U₀ + U₁x² + …) up to ¼ rad, by Remez' exchange to 9e-17.
const SHORT_SINC: [f64; 4] =
    [-0.166_666_666_666_642_8, 0.008_333_333_329_132_477, -0.000_198_412_490_641_875_68, 2.751_820_117_049_325e-6];

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
pub(crate) const LARGEST_TANGENT: f64 = 7.0 / 16.0;

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

/// Sine and cosine up to [`LARGEST_RAD`].
#[inline(always)]
pub(crate) fn reduced(x: f64) -> (f64, f64) {
    let shifted = x * FRAC_2_PI + SHIFTER;
    let (quarter, quarters) = (shifted.to_bits(), shifted - SHIFTER);
    // Both products are exact; the second difference rounds, and what it dropped goes in with the third part.
    let (coarse, fine) = (x - quarters * HALF_PI[0], quarters * HALF_PI[1]);
    let rest = coarse - fine;
    let (sin, cos) = small(rest + (((coarse - rest) - fine) - quarters * HALF_PI[2]));
    // Odd quarters swap sine and cosine; the second and third turn the sine's sign, the first and second the
    // cosine's.
    let (sin, cos) = (sin.to_bits(), cos.to_bits());
    let swap = (sin ^ cos) & (quarter & 1).wrapping_neg();
    let (sin_sign, cos_sign) = ((quarter & 2) << 62, (quarter.wrapping_add(1) & 2) << 62);
    (f64::from_bits((sin ^ swap) ^ sin_sign), f64::from_bits((cos ^ swap) ^ cos_sign))
}

/// Where an angle points: sine and cosine but for a sign that both have.
///
/// Half turns are taken off, and sine and cosine of what is left come from those of its half, 2sc and 1 −
/// 2s²: two polynomials do without the choice between them that quarters take. Errors are of the circle's
/// radius, not of a sine next to zero.
#[derive(Clone, Copy)]
pub(crate) struct Direction {
    sin: f64,
    cos: f64,
    /// The number of half turns taken off stands in the low bits.
    half_turns: u64,
}

impl Direction {
    /// Of an angle; nonsense where [`Self::is_found`] denies it.
    #[inline(always)]
    pub(crate) fn of(x: f64) -> Self {
        let shifted = x * FRAC_1_PI + SHIFTER;
        let half_turns = shifted - SHIFTER;
        // The first product and difference are exact.
        let rest = (x - half_turns * WHOLE_PI[0]) - half_turns * WHOLE_PI[1];
        let square = rest * rest;
        let twice_half_sine = rest + rest * square * polynomial(TWICE_HALF_SINE, square);
        let half_cosine = 1.0 + square * polynomial(HALF_COSINE, square);
        Self {
            sin: twice_half_sine * half_cosine,
            cos: 1.0 - (0.5 * twice_half_sine) * twice_half_sine,
            half_turns: shifted.to_bits(),
        }
    }

    /// For [`Self::is_found`]. Loops collect these by `|`.
    #[inline(always)]
    pub(crate) const fn range(self) -> u64 {
        self.half_turns.wrapping_sub(SHIFTER.to_bits() - MAX_HALF_TURNS)
    }

    /// Were all angles within [`MAX_HALF_TURNS`]?
    #[inline(always)]
    pub(crate) const fn is_found(ranges: u64) -> bool {
        ranges < 2 * MAX_HALF_TURNS
    }

    /// Way of some metres into this direction, along x and y.
    #[inline(always)]
    pub(crate) fn along(self, chord_m: f64) -> [f64; 2] {
        // Odd half turns turn round.
        let chord_m = f64::from_bits(chord_m.to_bits() ^ (self.half_turns << 63));
        [chord_m * self.cos, chord_m * self.sin]
    }
}

/// Way of some metres into the direction of any angle, along x and y, to the bits of [`Direction`] where
/// there is one.
#[inline(always)]
pub(crate) fn along(chord_rad: f64, chord_m: f64) -> [f64; 2] {
    let direction = Direction::of(chord_rad);
    if Direction::is_found(direction.range()) {
        direction.along(chord_m)
    } else {
        let (sin, cos) = chord_rad.sin_cos();
        [chord_m * cos, chord_m * sin]
    }
}

/// The cardinal sine of a step's half turn, and what has the highest bit set where that is above ¼ rad. Loops
/// collect the latter by `|`; where the angle is no number the bit may lack.
#[inline(always)]
pub(crate) fn short_sinc(half_rad: f64) -> (f64, u64) {
    let square = half_rad * half_rad;
    let [u0, u1, u2, u3] = SHORT_SINC;
    // The bits of positive doubles have the doubles' order.
    let exceeds = square.to_bits().wrapping_add((1 << 63) - 1 - LARGEST_SHORT_SQUARE.to_bits());
    (1.0 + square * ((u0 + u1 * square) + square * square * (u2 + u3 * square)), exceeds)
}

/// Sine and cosine: [`f64::sin_cos`] without a call.
#[inline]
#[must_use]
pub fn sin_cos(x: f64) -> (f64, f64) {
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

/// Arctangent up to [`LARGEST_TANGENT`].
#[inline(always)]
pub(crate) fn arctangent(tangent: f64) -> f64 {
    let square = tangent * tangent;
    let [low, high] = ARCTANGENT.map(|half| polynomial(half, square));
    let sixth = square * square * square * (square * square * square);
    tangent - tangent * square * (low + sixth * high)
}

/// Angle of the vector (x, y) from the x axis, radians in [−π, π]: [`f64::atan2`], faster where the angle is
/// small.
#[inline]
#[must_use]
pub fn atan2(y: f64, x: f64) -> f64 {
    let tangent = y / x;
    if x > 0.0 && tangent.abs() <= LARGEST_TANGENT {
        // The sign is that of a zero, too.
        arctangent(tangent).copysign(y)
    } else {
        y.atan2(x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elementary::{Branching, Elementary};
    use std::f64::consts::{FRAC_PI_2, PI};

    /// How many doubles apart.
    fn ulps_between(a: f64, b: f64) -> u64 {
        let ordered = |x: f64| if x < 0.0 { -x.abs().to_bits().cast_signed() } else { x.to_bits().cast_signed() };
        ordered(a).abs_diff(ordered(b))
    }

    /// Arguments over a range, dense and irregular, both signs.
    fn arguments(largest: f64) -> impl Iterator<Item = f64> {
        const COUNT: u32 = 200_000;
        (0..=COUNT).map(move |k| largest * (f64::from(k) / f64::from(COUNT) * 1.999_999_7 - 1.0))
    }

    /// Ours is within 1.5 units of the last place and theirs within 0.55 (glibc states as much): no more than
    /// two doubles apart. Rejects polynomials that lack their last term, and a reduction by a π/2 of two
    /// parts (thousands of units next to a zero).
    #[test]
    fn sine_and_cosine_agree_with_the_c_library() {
        for largest in [1.0 / 32.0, FRAC_PI_4, 1.0, 10.0, 1e3, 1e5, LARGEST_RAD] {
            for x in arguments(largest) {
                let ((sin, cos), (their_sin, their_cos)) = (sin_cos(x), x.sin_cos());
                assert!(ulps_between(sin, their_sin) <= 2 && ulps_between(cos, their_cos) <= 2, "{x}: {sin} {cos}");
            }
        }
        // The doubles next to zeros and borders of quarters, where the reduction cancels most.
        for quarter in -600_000..=600_000 {
            for x in [FRAC_PI_4, FRAC_PI_2].map(|unit| unit * f64::from(quarter)) {
                for x in [x.next_down(), x, x.next_up()] {
                    let ((sin, cos), (their_sin, their_cos)) = (sin_cos(x), x.sin_cos());
                    assert!(ulps_between(sin, their_sin) <= 2 && ulps_between(cos, their_cos) <= 2, "{x}: {sin} {cos}");
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

    /// Relative errors of the half angle's sine (2 roundings, 2.2e-16) and cosine (1.1e-16, and 0.9e-16 of
    /// the polynomial), and a rounding: 2⁻⁵¹ at most. Along the direction and across it they must cancel to
    /// 1e-17, or 10⁵ m lose more than 1e-12 m. Rejects polynomials that lack their last term, and a π of one
    /// part.
    #[test]
    fn a_direction_agrees_with_the_c_library() {
        for largest in [1e-3, 1.0, 10.0, 1e3, 1e5, 1.6e6] {
            let (mut count, mut along_sum, mut across_sum) = (0.0, 0.0, 0.0);
            for x in arguments(largest) {
                assert!(Direction::is_found(Direction::of(x).range()), "{x}");
                let ([x_m, y_m], (sin, cos)) = (along(x, 1.0), x.sin_cos());
                let [cos_error, sin_error] = [x_m - cos, y_m - sin];
                assert!(cos_error.abs().max(sin_error.abs()) <= 2.0 * f64::EPSILON, "{x}: {cos_error:e} {sin_error:e}");
                count += 1.0;
                along_sum += cos_error * cos + sin_error * sin;
                across_sum += sin_error * cos - cos_error * sin;
            }
            let biases = [along_sum / count, across_sum / count];
            assert!(biases.iter().all(|bias| bias.abs() < 1e-17), "up to {largest} rad: {biases:?}");
        }
        for x in [f64::NAN, f64::INFINITY, -f64::INFINITY, 1.7e6, -1.7e6, 1e15, -1e300] {
            assert!(!Direction::is_found(Direction::of(x).range()), "{x}");
            assert_eq!(along(x, 2.0).map(f64::to_bits), [2.0 * x.cos(), 2.0 * x.sin()].map(f64::to_bits));
        }
        assert_eq!(along(0.0, 3.0), [3.0, 0.0]);
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
        for x in [1e-12, 1e-4, 1e-3, 0.2, 0.25, 0.25_f64.next_up(), 0.3, 0.785, FRAC_PI_4, 0.786, 1.0] {
            for x in [x, -x] {
                assert!((sinc(x) - sinc_series(x)).abs() < 4.0 * f64::EPSILON, "{x}");
                // A rounding of 1 and the polynomial's 9e-17, under an ulp of 1.
                assert!((Branching.step_sinc(x) - sinc_series(x)).abs() < 2.0 * f64::EPSILON, "{x}");
                assert_eq!(short_sinc(x).1 >> 63 == 1, x.abs() > 0.25, "{x}");
            }
        }
    }

    /// A unit and a half of rounding against half a unit, and the division's: three doubles. Rejects a
    /// polynomial that lacks its last term.
    #[test]
    fn the_arctangent_agrees_with_the_c_library_all_round() {
        for angle in arguments(PI) {
            for scale in [1e-3, 1.0, 7.3] {
                let (y, x) = (scale * angle.sin(), scale * angle.cos());
                assert!(ulps_between(atan2(y, x), y.atan2(x)) <= 3, "{y} {x}");
            }
        }
        for (y, x) in [(0.0, 1.0), (-0.0, 1.0), (0.0, -1.0), (0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (1.0, f64::INFINITY)]
        {
            assert_eq!(atan2(y, x).to_bits(), y.atan2(x).to_bits(), "{y} {x}");
        }
        assert!(atan2(f64::NAN, 1.0).is_nan());
    }
}
