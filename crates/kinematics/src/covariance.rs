//! Covariance of dead reckoning when each wheel's travel carries noise of variance `k²|s|` (Chong & Kleeman
//! 1997; Kelly 2004).
//!
//! The noise is a random walk along the wheel's path, so one step of any length must give what many short
//! ones give. Its sum over the step moves the end through the Jacobian of the arc; what is left when the sum
//! is held fixed (a Brownian bridge) scatters the end position within the step. For a straight of length `L`
//! whose heading varies by `σ_θ²` at the end that scatter is `σ_θ² L²/12` across the path: `L²/4` from the
//! sum and `L²/12` from the bridge make the exact `L²/3`.
//!
//! On an arc, noise of the right wheel at the fraction `u` of the path moves the end by `const −
//! s_L/(bθ)·τ(u)`, and of the left by `const + s_R/(bθ)·τ(u)`, with `τ(u)` the unit tangent there. So the
//! bridge's covariance is `(k_R²|s_R| s_L² + k_L²|s_L| s_R²)/(b²θ²)` times the covariance of `τ` over the
//! path, which is diagonal in the chord's frame: along `½(1+sinc θ) − sinc²(θ/2)`, across `½(1−sinc θ)`.

use nalgebra::{Matrix3, Matrix3x2, Vector2};

use crate::elementary::{Branching, Elementary};
use crate::trig::sin_cos;
use crate::{Increment, Pose, Wheels, sinc, sinc_derivative};

/// Random-walk noise of each wheel's travel over the ground: standard deviation per square root of travel,
/// m/√m.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WheelNoise {
    /// `k` of each wheel, m/√m: after `s` metres the travel's standard deviation is `k·√|s|`.
    pub sigma_m_per_sqrt_m: Wheels<f64>,
}

impl WheelNoise {
    /// Variance of each wheel's travel after given travels, m².
    #[inline]
    #[must_use]
    pub fn travel_var_m2(&self, travel_m: Wheels<f64>) -> Wheels<f64> {
        self.sigma_m_per_sqrt_m.zip_with(travel_m, |sigma, travel_m| sigma * sigma * travel_m.abs())
    }
}

/// Below this turn the path covariance of the tangent comes from its series: at 0.3 rad the series' first
/// neglected terms are under 1e-12 of the whole and the closed form's cancellation (1e-16/θ⁴) is about 1e-14.
const TANGENT_SERIES_BELOW_RAD: f64 = 0.3;

/// Scatter of an arc's end position when the noise sums of both wheels are held fixed, in the chord's frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BridgeCovariance {
    /// Variance along the chord, m².
    pub along_var_m2: f64,
    /// Variance across the chord, m²; `σ_θ² L²/12` for a straight of length `L`.
    pub across_var_m2: f64,
}

impl BridgeCovariance {
    /// Scatter within an arc of given wheel travels (metres) whose travels vary by `travel_var_m2` (m²) over
    /// it.
    #[inline]
    #[must_use]
    pub fn within(travel_m: Wheels<f64>, travel_var_m2: Wheels<f64>, wheel_separation_m: f64) -> Self {
        Self::within_by(&Branching, travel_m, travel_var_m2, wheel_separation_m)
    }

    /// [`Self::within`] by given elementary functions.
    #[inline(always)]
    #[must_use]
    pub fn within_by(
        elementary: &impl Elementary,
        travel_m: Wheels<f64>,
        travel_var_m2: Wheels<f64>,
        wheel_separation_m: f64,
    ) -> Self {
        let per_m = 1.0 / wheel_separation_m;
        let turn_rad = (travel_m.right - travel_m.left) * per_m;
        let weight = (travel_var_m2.right * travel_m.left * travel_m.left
            + travel_var_m2.left * travel_m.right * travel_m.right)
            * (per_m * per_m);
        let (along, across) = tangent_variance_over_turn_squared(elementary, turn_rad);
        Self { along_var_m2: weight * along, across_var_m2: weight * across }
    }
}

/// Variances of the unit tangent over an arc of turn θ, along and across the chord, divided by θ².
#[inline(always)]
fn tangent_variance_over_turn_squared<E: Elementary>(elementary: &E, turn_rad: f64) -> (f64, f64) {
    E::choose(
        turn_rad.abs() < TANGENT_SERIES_BELOW_RAD,
        || tangent_series(turn_rad),
        || {
            let (sin, cos) = elementary.sin_cos(0.5 * turn_rad);
            tangent_closed_form::<E>(turn_rad, sin, cos)
        },
    )
}

/// Taylor: ½(1+sinc θ) − sinc²(θ/2) = θ⁴/720 − θ⁶/20160 + θ⁸/1209600 − …, ½(1−sinc θ) = θ²/12 − θ⁴/240 +
/// θ⁶/10080 − …
#[inline(always)]
fn tangent_series(turn_rad: f64) -> (f64, f64) {
    let tt = turn_rad * turn_rad;
    let along = tt * (1.0 / 720.0 - tt * (1.0 / 20_160.0 - tt * (1.0 / 1_209_600.0 - tt * (1.0 / 119_750_400.0))));
    let across =
        1.0 / 12.0 - tt * (1.0 / 240.0 - tt * (1.0 / 10_080.0 - tt * (1.0 / 725_760.0 - tt * (1.0 / 79_833_600.0))));
    (along, across)
}

/// By sine and cosine of half the turn; sinc θ = sinc(θ/2)·cos(θ/2).
#[inline(always)]
fn tangent_closed_form<E: Elementary>(turn_rad: f64, sin: f64, cos: f64) -> (f64, f64) {
    // The division first, which then is done when the sine is.
    let per_tt = 1.0 / (turn_rad * turn_rad);
    let half = E::sinc_given_sine(0.5 * turn_rad, sin);
    let whole = half * cos;
    ((0.5 * (1.0 + whole) - half * half) * per_tt, 0.5 * (1.0 - whole) * per_tt)
}

/// Covariance of a dead-reckoned pose since its start: world axes, order x, y, θ; m², m·rad and rad².
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct OdometryCovariance {
    matrix: Matrix3<f64>,
}

impl OdometryCovariance {
    /// From a covariance of the start pose (m², m·rad, rad²; order x, y, θ).
    #[must_use]
    pub const fn starting_at(matrix: Matrix3<f64>) -> Self {
        Self { matrix }
    }

    /// The covariance matrix (m², m·rad, rad²; order x, y, θ; world axes).
    #[must_use]
    pub const fn matrix(&self) -> &Matrix3<f64> {
        &self.matrix
    }

    /// Carries the covariance over one step that starts at `world_from_body` with given wheel travels,
    /// metres.
    ///
    /// Exact to first order in the noise for a step of constant curvature of any length: cutting the step in
    /// two changes nothing.
    pub fn propagate(
        &mut self,
        world_from_body: Pose,
        travel_m: Wheels<f64>,
        wheel_separation_m: f64,
        noise: &WheelNoise,
    ) {
        let increment = Increment::from_travel(travel_m, wheel_separation_m);
        let chord_heading_rad = world_from_body.theta_rad + 0.5 * increment.turn_rad;
        let arc_jacobian = arc_jacobian(increment, chord_heading_rad, wheel_separation_m);
        let travel_var_m2 = noise.travel_var_m2(travel_m);

        let displacement = world_from_body * increment.arc();
        let mut transition = Matrix3::identity();
        transition[(0, 2)] = -(displacement.y_m - world_from_body.y_m);
        transition[(1, 2)] = displacement.x_m - world_from_body.x_m;

        let scatter = BridgeCovariance::within(travel_m, travel_var_m2, wheel_separation_m);
        let (sin, cos) = sin_cos(chord_heading_rad);
        let (along, across) = (scatter.along_var_m2, scatter.across_var_m2);
        let mut within = Matrix3::zeros();
        within[(0, 0)] = cos * cos * along + sin * sin * across;
        within[(1, 1)] = sin * sin * along + cos * cos * across;
        within[(0, 1)] = sin * cos * (along - across);
        within[(1, 0)] = within[(0, 1)];

        let weighted =
            arc_jacobian * nalgebra::Matrix2::from_diagonal(&Vector2::new(travel_var_m2.left, travel_var_m2.right));
        self.matrix = transition * self.matrix * transition.transpose() + weighted * arc_jacobian.transpose() + within;
    }
}

/// ∂(x, y, θ)/∂(s_L, s_R) of an exact arc whose chord points along `chord_heading_rad`.
fn arc_jacobian(increment: Increment, chord_heading_rad: f64, wheel_separation_m: f64) -> Matrix3x2<f64> {
    let half_rad = 0.5 * increment.turn_rad;
    let (sin, cos) = sin_cos(chord_heading_rad);
    let chord = sinc(half_rad);
    // p = s·sinc(θ/2)·(cos, sin)(θ₀ + θ/2)
    let by_distance = Vector2::new(chord * cos, chord * sin);
    let by_turn = 0.5
        * increment.distance_m
        * Vector2::new(sinc_derivative(half_rad) * cos - chord * sin, sinc_derivative(half_rad) * sin + chord * cos);
    let (left, right) =
        (0.5 * by_distance - by_turn / wheel_separation_m, 0.5 * by_distance + by_turn / wheel_separation_m);
    Matrix3x2::new(left.x, right.x, left.y, right.y, -1.0 / wheel_separation_m, 1.0 / wheel_separation_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    const SEPARATION_M: f64 = 0.363;

    fn noise() -> WheelNoise {
        WheelNoise { sigma_m_per_sqrt_m: Wheels { left: 1.0e-3, right: 1.7e-3 } }
    }

    fn propagate_in(parts: u32, travel_m: Wheels<f64>) -> Matrix3<f64> {
        let mut covariance = OdometryCovariance::starting_at(Matrix3::identity() * 1e-6);
        let mut pose = Pose::new(0.3, -0.1, 0.7);
        let part_m = travel_m.map(|travel_m| travel_m / f64::from(parts));
        for _ in 0..parts {
            covariance.propagate(pose, part_m, SEPARATION_M, &noise());
            pose = pose * Increment::from_travel(part_m, SEPARATION_M).arc();
        }
        *covariance.matrix()
    }

    proptest! {
        #[test]
        fn cutting_a_step_changes_nothing(left in -2.0..2.0, right in -2.0..2.0, parts in 2_u32..9) {
            let travel_m = Wheels { left, right };
            let (whole, cut) = (propagate_in(1, travel_m), propagate_in(parts, travel_m));
            // The bridge cancels down to 1e-14/θ⁴ of its size next to the series' border.
            prop_assert!((whole - cut).norm() <= 1e-9 * whole.norm(), "{whole} {cut}");
        }

        #[test]
        fn the_jacobian_is_the_derivative_and_would_not_pass_wrong(left in -1.5..1.5, right in -1.5..1.5, theta in -3.0..3.0) {
            let h = 1e-6;
            let end = |left: f64, right: f64| Pose::new(0.0, 0.0, theta) * Increment::from_travel(Wheels { left, right }, SEPARATION_M).arc();
            let increment = Increment::from_travel(Wheels { left, right }, SEPARATION_M);
            let jacobian = arc_jacobian(increment, theta + 0.5 * increment.turn_rad, SEPARATION_M);
            let columns = [(end(left + h, right), end(left - h, right)), (end(left, right + h), end(left, right - h))];
            for (column, (plus, minus)) in columns.iter().enumerate() {
                let difference = [(plus.x_m - minus.x_m) / (2.0 * h), (plus.y_m - minus.y_m) / (2.0 * h), (plus.theta_rad - minus.theta_rad) / (2.0 * h)];
                for (row, difference) in difference.into_iter().enumerate() {
                    // Third derivatives stay under s/b³ ≈ 60: truncation 1e-11, rounding 1e-16/1e-6 = 1e-10
                    // times a few metres and radians.
                    let tolerance = 2e-9;
                    prop_assert!((jacobian[(row, column)] - difference).abs() < tolerance);
                    prop_assert!((jacobian[(row, column)] + 1e-3 - difference).abs() > tolerance);
                }
            }
        }
    }

    #[test]
    fn a_straight_has_the_textbook_covariance() {
        let length_m = 4.0;
        let noise = WheelNoise { sigma_m_per_sqrt_m: Wheels::both(2e-3) };
        let mut covariance = OdometryCovariance::default();
        covariance.propagate(Pose::IDENTITY, Wheels::both(length_m), SEPARATION_M, &noise);
        let wheel_var = 4e-6 * length_m;
        let theta_var = 2.0 * wheel_var / (SEPARATION_M * SEPARATION_M);
        let matrix = covariance.matrix();
        let close = |value: f64, expected: f64| assert!((value / expected - 1.0).abs() < 1e-14, "{value} {expected}");
        close(matrix[(0, 0)], wheel_var / 2.0);
        close(matrix[(2, 2)], theta_var);
        close(matrix[(1, 2)], theta_var * length_m / 2.0);
        // L²/3, not the L²/4 of the end-point rule.
        close(matrix[(1, 1)], theta_var * length_m * length_m / 3.0);
    }

    #[test]
    fn scatter_of_a_straight_is_a_twelfth_and_of_a_full_turn_a_half() {
        let wheel_var = Wheels::both(1e-6);
        let straight = BridgeCovariance::within(Wheels::both(3.0), wheel_var, SEPARATION_M);
        let theta_var = 2e-6 / (SEPARATION_M * SEPARATION_M);
        assert!((straight.across_var_m2 / (theta_var * 9.0 / 12.0) - 1.0).abs() < 1e-14);
        assert_eq!(straight.along_var_m2, 0.0);
        // On the spot the centre's noise, (δ_R+δ_L)/2, is spread over all directions: half of its variance on
        // each axis.
        let half_m = std::f64::consts::PI * SEPARATION_M;
        let spin = BridgeCovariance::within(Wheels { left: -half_m, right: half_m }, wheel_var, SEPARATION_M);
        assert!((spin.along_var_m2 / (0.5e-6 / 2.0) - 1.0).abs() < 1e-12);
        assert!((spin.across_var_m2 / (0.5e-6 / 2.0) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_series_and_the_closed_form_meet() {
        let below = tangent_variance_over_turn_squared(&Branching, TANGENT_SERIES_BELOW_RAD * (1.0 - 1e-15));
        let above = tangent_variance_over_turn_squared(&Branching, TANGENT_SERIES_BELOW_RAD);
        // Cancellation of the closed form: ε/(θ⁴/720) relative, 2e-11 at 0.3 rad for `along`, ε/(θ²/12) for
        // `across`.
        assert!((below.0 / above.0 - 1.0).abs() < 1e-10, "{below:?} {above:?}");
        assert!((below.1 / above.1 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn many_noisy_small_steps_scatter_as_predicted() {
        // 4000 runs of 200 steps each round a 1.5 rad arc; each variance has relative standard error
        // √(2/4000) = 2.2 %; five of them for 3 numbers make a false positive of 2e-6. Leaving out the bridge
        // is off by 25 %.
        let (runs, steps) = (4000_u32, 200_u32);
        let travel_m = Wheels { left: 0.7, right: 0.7 + 1.5 * SEPARATION_M };
        let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(7);
        let mut moments = Matrix3::zeros();
        let end = Increment::from_travel(travel_m, SEPARATION_M).arc();
        for _ in 0..runs {
            let mut pose = Pose::IDENTITY;
            for _ in 0..steps {
                let step_m = travel_m.zip_with(noise().sigma_m_per_sqrt_m, |travel_m, sigma| {
                    let step_m = travel_m / f64::from(steps);
                    let draw: f64 = StandardNormal.sample(&mut rng);
                    step_m + sigma * step_m.abs().sqrt() * draw
                });
                pose = pose * Increment::from_travel(step_m, SEPARATION_M).arc();
            }
            let error = nalgebra::Vector3::new(pose.x_m - end.x_m, pose.y_m - end.y_m, pose.theta_rad - end.theta_rad);
            moments += error * error.transpose() / f64::from(runs);
        }
        let mut predicted = OdometryCovariance::default();
        predicted.propagate(Pose::IDENTITY, travel_m, SEPARATION_M, &noise());
        for axis in 0..3 {
            let ratio = moments[(axis, axis)] / predicted.matrix()[(axis, axis)];
            assert!((ratio - 1.0).abs() < 5.0 * (2.0 / f64::from(runs)).sqrt(), "axis {axis}: {ratio}");
        }
    }
}
