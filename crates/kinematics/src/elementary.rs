//! Elementary functions as formulas take them: with branches, for one argument at a time, or without, for
//! loops over lanes that the compiler makes vectors of.
//!
//! A formula that is written over [`Elementary`] stands once and is evaluated both ways, to the same bits
//! but for the sign of a zero. Without branches a function does not hold everywhere;
//! [`BranchFree`] keeps whether it was asked outside, and [`by_lanes`] asks again there.

use std::cell::Cell;
use std::f64::consts::{FRAC_PI_4, TAU};

use crate::angle::wrap_to_pi;
use crate::trig::{self, Direction, SHIFTER};

/// Below this the sum with [`SHIFTER`], which rounds halves to even numbers, has no fractions and does not
/// leave its binade.
const SHIFTS_BELOW: f64 = 1_125_899_906_842_624.0; // 2⁵⁰

/// The functions that formulas need beside sums, products, quotients and roots.
pub trait Elementary {
    /// One of two values. The other one may be worked out too, and is not looked at then.
    fn choose<T: Copy>(condition: bool, value: impl FnOnce() -> T, otherwise: impl FnOnce() -> T) -> T;

    /// Sine and cosine.
    fn sin_cos(&self, x: f64) -> (f64, f64);

    /// Angle of the vector (x, y) from the x axis, radians in [−π, π].
    fn atan2(&self, y: f64, x: f64) -> f64;

    /// The same direction in (−π, π].
    fn wrap_to_pi(&self, angle_rad: f64) -> f64;

    /// Way of some metres into a direction, along x and y, as dead reckoning takes it.
    fn along(&self, heading_rad: f64, chord_m: f64) -> [f64; 2];

    /// The nearest whole number, halves away from zero.
    fn round(&self, x: f64) -> f64;

    /// The largest whole number not above.
    fn floor(&self, x: f64) -> f64;

    /// The cardinal sine `sin(x)/x` where the sine is at hand.
    #[inline(always)]
    fn sinc_given_sine(x: f64, sine: f64) -> f64 {
        Self::choose(x.abs() <= FRAC_PI_4, || trig::small_sinc(x), || sine / x)
    }

    /// The cardinal sine `sin(x)/x`, 1 at zero.
    #[inline(always)]
    fn sinc(&self, x: f64) -> f64 {
        Self::choose(x.abs() <= FRAC_PI_4, || trig::small_sinc(x), || self.sin_cos(x).0 / x)
    }

    /// The cardinal sine of any half turn of a step, to the bits of the shorter polynomial that loops over
    /// whole logs take where that is.
    #[inline(always)]
    fn step_sinc(&self, half_rad: f64) -> f64 {
        let is_short = half_rad * half_rad <= trig::LARGEST_SHORT_SQUARE;
        Self::choose(is_short, || trig::short_sinc(half_rad).0, || self.sinc(half_rad))
    }

    /// The angle equal to `angle_rad` modulo whole turns that lies nearest to `reference_rad`.
    #[inline(always)]
    fn unwrap_near(&self, angle_rad: f64, reference_rad: f64) -> f64 {
        reference_rad + self.wrap_to_pi(angle_rad - reference_rad)
    }
}

/// For one argument at a time.
#[derive(Debug, Clone, Copy, Default)]
pub struct Branching;

impl Elementary for Branching {
    #[inline(always)]
    fn choose<T: Copy>(condition: bool, value: impl FnOnce() -> T, otherwise: impl FnOnce() -> T) -> T {
        if condition { value() } else { otherwise() }
    }

    #[inline(always)]
    fn sin_cos(&self, x: f64) -> (f64, f64) {
        trig::sin_cos(x)
    }

    #[inline(always)]
    fn atan2(&self, y: f64, x: f64) -> f64 {
        trig::atan2(y, x)
    }

    #[inline(always)]
    fn wrap_to_pi(&self, angle_rad: f64) -> f64 {
        wrap_to_pi(angle_rad)
    }

    #[inline(always)]
    fn along(&self, heading_rad: f64, chord_m: f64) -> [f64; 2] {
        trig::along(heading_rad, chord_m)
    }

    /// [`f64::round`] without the call that it is where the processor is not known to round by an
    /// instruction (SSE 4.1).
    #[inline(always)]
    fn round(&self, x: f64) -> f64 {
        let rounded = (x + SHIFTER) - SHIFTER;
        if rounds(x, rounded) { rounded.copysign(x) } else { x.round() }
    }

    /// [`f64::floor`], as [`Self::round`].
    #[inline(always)]
    fn floor(&self, x: f64) -> f64 {
        if x.abs() < SHIFTS_BELOW { floor_below(x) } else { x.floor() }
    }
}

/// Is a number rounded to even the number rounded?
#[inline(always)]
fn rounds(x: f64, rounded: f64) -> bool {
    x.abs() < SHIFTS_BELOW && (x - rounded).abs() < 0.5
}

/// The largest whole number not above one of less than [`SHIFTS_BELOW`].
#[inline(always)]
fn floor_below(x: f64) -> f64 {
    let nearest = (x + SHIFTER) - SHIFTER;
    if nearest > x { nearest - 1.0 } else { nearest }
}

/// For loops over lanes: no function has a branch, and where one does not hold is kept.
#[derive(Debug, Default)]
pub struct BranchFree {
    outside: Cell<u64>,
}

impl BranchFree {
    /// Other than 0 where a function was asked for what it does not give.
    #[inline(always)]
    #[must_use]
    pub const fn outside(&self) -> u64 {
        self.outside.get()
    }

    #[inline(always)]
    fn holds(&self, holds: bool) {
        self.outside.set(self.outside.get() | u64::from(!holds));
    }
}

impl Elementary for BranchFree {
    #[inline(always)]
    fn choose<T: Copy>(condition: bool, value: impl FnOnce() -> T, otherwise: impl FnOnce() -> T) -> T {
        let (value, otherwise) = (value(), otherwise());
        if condition { value } else { otherwise }
    }

    #[inline(always)]
    fn sin_cos(&self, x: f64) -> (f64, f64) {
        self.holds(x.abs() <= trig::LARGEST_RAD);
        trig::reduced(x)
    }

    #[inline(always)]
    fn atan2(&self, y: f64, x: f64) -> f64 {
        let tangent = y / x;
        self.holds((x > 0.0) & (tangent.abs() <= trig::LARGEST_TANGENT));
        trig::arctangent(tangent).copysign(y)
    }

    #[inline(always)]
    fn wrap_to_pi(&self, angle_rad: f64) -> f64 {
        let turns = angle_rad / TAU;
        let whole = (turns + SHIFTER) - SHIFTER;
        // Half turns are for who looks at the interval's ends.
        self.holds((turns.abs() < SHIFTS_BELOW) & ((turns - whole).abs() < 0.499));
        angle_rad - TAU * whole
    }

    #[inline(always)]
    fn along(&self, heading_rad: f64, chord_m: f64) -> [f64; 2] {
        let direction = Direction::of(heading_rad);
        self.holds(Direction::is_found(direction.range()));
        direction.along(chord_m)
    }

    #[inline(always)]
    fn round(&self, x: f64) -> f64 {
        let rounded = (x + SHIFTER) - SHIFTER;
        self.holds((x.abs() < SHIFTS_BELOW) & ((x - rounded).abs() < 0.5));
        rounded.copysign(x)
    }

    #[inline(always)]
    fn floor(&self, x: f64) -> f64 {
        self.holds(x.abs() < SHIFTS_BELOW);
        floor_below(x)
    }
}

/// N numbers of every lane, from what the lane's own state is.
pub trait Formula<const N: usize> {
    /// Of one lane. To become vectors it must be `#[inline(always)]`, as all that it calls.
    fn of<E: Elementary>(&self, lane: usize, elementary: &E) -> [f64; N];
}

/// A formula of W lanes side by side, in lanes beyond the reach of [`BranchFree`] by itself: the same bits
/// for any W. By value, here and below: arrays that nobody has an address of the compiler knows to be apart
/// from what the formula reads, and only then it makes vectors of the loop.
#[inline(always)]
pub fn by_lanes<const W: usize, const N: usize>(formula: &impl Formula<N>) -> [[f64; W]; N] {
    let (mut values, mut outside) = ([[0.0; W]; N], [0; W]);
    for lane in 0..W {
        let elementary = BranchFree::default();
        let of = formula.of(lane, &elementary);
        for n in 0..N {
            values[n][lane] = of[n];
        }
        outside[lane] = elementary.outside();
    }
    if outside.iter().fold(0, |any, outside| any | outside) != 0 {
        values = one_by_one(formula, outside, values);
    }
    values
}

#[cold]
#[inline(never)]
fn one_by_one<const W: usize, const N: usize>(
    formula: &impl Formula<N>,
    outside: [u64; W],
    mut values: [[f64; W]; N],
) -> [[f64; W]; N] {
    for lane in (0..W).filter(|lane| outside[*lane] != 0) {
        for (values, of) in values.iter_mut().zip(formula.of(lane, &Branching)) {
            values[lane] = of;
        }
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    /// All functions of two numbers.
    struct Everything<'x>(&'x [[f64; 2]]);

    impl Formula<11> for Everything<'_> {
        fn of<E: Elementary>(&self, lane: usize, elementary: &E) -> [f64; 11] {
            let [x, y] = self.0[lane];
            let (sin, cos) = elementary.sin_cos(x);
            let [along_x, along_y] = elementary.along(x, y);
            [
                sin,
                cos,
                elementary.atan2(y, x),
                elementary.wrap_to_pi(x),
                along_x,
                along_y,
                elementary.round(x),
                elementary.floor(x),
                elementary.sinc(x),
                elementary.step_sinc(x),
                elementary.unwrap_near(x, y),
            ]
        }
    }

    /// Numbers of every size, with those at which a branch turns, and none.
    fn number() -> impl Strategy<Value = f64> {
        let special = [0.0, FRAC_PI_4, PI, 3.0 * PI, TAU, 0.5, 2.5, 1e6, SHIFTS_BELOW, 1e300, f64::INFINITY];
        let signed = special.into_iter().flat_map(|x: f64| [x, -x, x.next_up(), -x.next_down()]).collect::<Vec<_>>();
        prop_oneof![
            4 => -4.0..4.0,
            2 => -1e4..1e4,
            1 => -1e17..1e17,
            2 => prop::sample::select(signed),
            1 => Just(f64::NAN),
        ]
    }

    proptest! {
        /// Rejects, as was tried: a range of arctangents that is too wide, halves rounded to even, half turns
        /// wrapped without looking.
        #[test]
        fn lanes_have_the_values_of_one_argument_at_a_time(numbers in prop::collection::vec((number(), number()), 16)) {
            let numbers: Vec<[f64; 2]> = numbers.into_iter().map(|(x, y)| [x, y]).collect();
            let found: [[f64; 16]; 11] = by_lanes(&Everything(&numbers));
            for lane in 0..16 {
                for (found, expected) in found.iter().zip(Everything(&numbers).of(lane, &Branching)) {
                    let found = found[lane];
                    prop_assert!(found == expected || (found.is_nan() && expected.is_nan()), "{:?}", numbers[lane]);
                }
            }
        }
    }

    #[test]
    fn rounding_is_that_of_the_standard_library_to_the_bit() {
        let halves = (-9..=9).map(|half| 0.5 * f64::from(half));
        let large =
            [2_f64.powi(50), 2_f64.powi(50) - 0.5, 2_f64.powi(51) + 0.5, 2_f64.powi(52) + 1.0, 1e300, f64::INFINITY];
        let small = [0.0, f64::MIN_POSITIVE, 0.499_999_999_999_999_94, 1e-9, 0.3, 1234.567];
        for x in halves.chain(large).chain(small).flat_map(|x| [x, -x, x.next_up(), x.next_down()]) {
            assert_eq!(Branching.round(x).to_bits(), x.round().to_bits(), "{x}");
            assert_eq!(Branching.floor(x), x.floor(), "{x}");
        }
        assert!(Branching.round(f64::NAN).is_nan());
    }
}
