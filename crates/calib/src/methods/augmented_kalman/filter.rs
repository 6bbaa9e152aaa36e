//! The first filter: the robot's pose and the three systematic factors of its odometry, row by row.
//!
//! State (x, y, θ, δ_L, δ_R, δ_B): a wheel travels δ times what its nominal size says, the contacts are δ_B
//! times the nominal separation apart (Martinelli's δ_R and δ_L, and the third that his robot was spared by a
//! known axle). Wheels add noise of variance k²|s| along a travel s (Chong & Kleeman 1997), poses are seen
//! with variances σ_xy² and σ_θ². The covariance is kept in parts, P = P₀ + k² P₁ + σ_xy² P₂ + σ_θ² P₃, for
//! the second filter ([`super::noise`]).

use kinematics::{Count, DriveGeometry, GeometryError, OdometryCovariance, Pose, WheelNoise, Wheels, wrap_to_pi};
use nalgebra::{Matrix3, Matrix6, Matrix6x3, Vector3, Vector6};

use super::noise::{Expected, NoiseFilter, NoiseSource, Variances};
use crate::dead_reckoning_jacobian::{DeadReckoned, GeometryParameters};
use crate::settings::{SETTLED_FACTOR_SIGMA, SETTLED_MOVE_SIGMA};

/// When the factors count as settled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settling {
    /// Largest standard deviation of a factor.
    pub factor_sigma: f64,
    /// Standard deviations, of what the later half of the measurements could determine, that a factor may
    /// have moved since.
    pub moved_sigmas: f64,
}

impl Settling {
    /// What the method uses.
    pub const DEFAULT: Self = Self { factor_sigma: SETTLED_FACTOR_SIGMA, moved_sigmas: SETTLED_MOVE_SIGMA };
}

/// The factors at an earlier measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Checkpoint {
    measurements: u64,
    factors: Vector3<f64>,
    covariance: Matrix3<f64>,
}

/// The pose and the factors of one robot, on line.
///
/// ```
/// use calib::methods::augmented_kalman::{AugmentedFilter, NoiseFilter};
/// use kinematics::{DriveGeometry, Pose, Wheels};
///
/// let nominal = DriveGeometry::new(Wheels::both(0.160), 0.363)?;
/// let m_per_count = nominal.m_per_count(2000.0)?;
/// // 1 mm/√m, 1 mm and 2 mrad to begin with, all to be estimated.
/// let noise = NoiseFilter::new([1e-6, 1e-6, 4e-6].into(), [false; 3]);
/// let counts = Wheels::both(0_i64);
/// let mut filter = AugmentedFilter::new(&nominal, m_per_count, 0.05, noise, Pose::IDENTITY, counts);
/// filter.predict(Wheels { left: 400, right: 410 });
/// let pose = filter.update(Pose::new(0.10, 0.0, 0.007));
/// assert!(pose.nis < 12.0 && !filter.is_settled());
/// # Ok::<(), kinematics::GeometryError>(())
/// ```
#[derive(Debug, Clone)]
pub struct AugmentedFilter<C> {
    nominal: Vector3<f64>,
    diameter_per_factor: Vector3<f64>,
    factors: Vector3<f64>,
    counts: Wheels<C>,
    /// P₀ and what multiplies the three variances, at the last measurement.
    spread: [Matrix6<f64>; 4],
    propagation: PropagationInterval,
    noise: NoiseFilter,
    settling: Settling,
    measurements: u64,
    half: Checkpoint,
    next_half: Checkpoint,
}

/// What happened since the last measurement: the pose with its derivatives, and the wheels' noise for k² = 1
/// m.
#[derive(Debug, Clone, Copy)]
struct PropagationInterval {
    start: Pose,
    dead_reckoned: DeadReckoned,
    wheels: OdometryCovariance,
}

impl PropagationInterval {
    fn at(pose: Pose) -> Self {
        Self { start: pose, dead_reckoned: DeadReckoned::at(pose), wheels: OdometryCovariance::default() }
    }
}

/// The innovation of a measured pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseInnovation {
    /// Measured minus predicted: x, y in metres, heading in radians.
    pub residual: Vector3<f64>,
    /// Its covariance as the filter expected it.
    pub covariance: Matrix3<f64>,
    /// Normalised innovation squared: χ² with three degrees of freedom where the model holds.
    pub nis: f64,
}

impl<C: Count> AugmentedFilter<C> {
    /// A filter at a measured pose and the counters' readings there.
    ///
    /// `factor_sigma` is how far diameters and separation may be from nominal, relatively (one standard
    /// deviation); `m_per_count` is the nominal travel for one unit of `counts`, metres.
    #[must_use]
    pub fn new(
        nominal: &DriveGeometry,
        m_per_count: Wheels<f64>,
        factor_sigma: f64,
        noise: NoiseFilter,
        world_from_body: Pose,
        counts: Wheels<C>,
    ) -> Self {
        let diameter_m = nominal.wheel_diameter_m();
        let separation_m = nominal.wheel_separation_m();
        let mut spread = [Matrix6::zeros(); 4];
        let covariance = Matrix3::from_diagonal_element(factor_sigma * factor_sigma);
        spread[0].fixed_view_mut::<3, 3>(3, 3).copy_from(&covariance);
        let half = Checkpoint { measurements: 0, factors: Vector3::repeat(1.0), covariance };
        let mut filter = Self {
            nominal: Vector3::new(m_per_count.left, m_per_count.right, separation_m),
            diameter_per_factor: Vector3::new(diameter_m.left, diameter_m.right, separation_m),
            factors: half.factors,
            counts,
            spread,
            propagation: PropagationInterval::at(world_from_body),
            noise,
            settling: Settling::DEFAULT,
            measurements: 0,
            half,
            next_half: half,
        };
        filter.restart(world_from_body, counts);
        filter
    }

    /// The same filter that begins with other factors than 1, and as unsure of them.
    #[must_use]
    pub(super) fn starting_from(mut self, factors: Vector3<f64>) -> Self {
        self.factors = factors;
        self.half.factors = factors;
        self.next_half.factors = factors;
        self
    }

    /// Begins the next run at a measured pose. What is known of the factors stays.
    pub fn restart(&mut self, world_from_body: Pose, counts: Wheels<C>) {
        self.counts = counts;
        self.propagation = PropagationInterval::at(world_from_body);
        for part in &mut self.spread {
            part.fixed_rows_mut::<3>(0).fill(0.0);
            part.fixed_columns_mut::<3>(0).fill(0.0);
        }
        for (part, of_pose) in self.spread[1..].iter_mut().zip(instrument()) {
            part.fixed_view_mut::<3, 3>(0, 0).copy_from(&of_pose);
        }
    }

    /// Takes new cumulative counts and returns where the robot should be.
    pub fn predict(&mut self, counts: Wheels<C>) -> Pose {
        let turned = counts.zip_with(self.counts, Count::since);
        self.counts = counts;
        self.turn(turned)
    }

    /// Takes the turn of both wheels since the last row, in units of the counts.
    fn turn(&mut self, turned: Wheels<f64>) -> Pose {
        let geometry_parameters = self.geometry_parameters();
        let travel_m = geometry_parameters.m_per_rad.zip_with(turned, |m_per_count, counts| m_per_count * counts);
        let one = WheelNoise { sigma_m_per_sqrt_m: Wheels::both(1.0) };
        self.propagation.wheels.propagate(
            self.propagation.dead_reckoned.pose,
            travel_m,
            geometry_parameters.separation_m,
            &one,
        );
        self.propagation.dead_reckoned.advance(&geometry_parameters, turned);
        self.propagation.dead_reckoned.pose
    }

    /// Takes a measured pose, and corrects pose, factors and noise.
    pub fn update(&mut self, world_from_body: Pose) -> PoseInnovation {
        self.spread = self.spread_now();
        let predicted = self.propagation.dead_reckoned.pose;
        let residual = Vector3::new(
            world_from_body.x_m - predicted.x_m,
            world_from_body.y_m - predicted.y_m,
            wrap_to_pi(world_from_body.theta_rad - predicted.theta_rad),
        );
        let of_pose = |part: &Matrix6<f64>| part.fixed_view::<3, 3>(0, 0).into_owned();
        let measurement_noise = instrument();
        let expected = Expected {
            fixed: of_pose(&self.spread[0]),
            slopes: std::array::from_fn(|i| of_pose(&self.spread[i + 1]) + measurement_noise[i]),
        };
        let variances = *self.noise.variances();
        let covariance = expected.at(&variances);
        let whole = self.whole(&self.spread);
        // A measurement without any error at all and a robot without any leave nothing to weigh.
        let inverse = covariance.try_inverse().unwrap_or_else(Matrix3::zeros);
        let gain: Matrix6x3<f64> = whole.fixed_columns::<3>(0) * inverse;
        let correction: Vector6<f64> = gain * residual;
        let mut joseph = Matrix6::identity();
        let mut corrected = joseph.fixed_columns_mut::<3>(0);
        corrected -= gain;
        for part in &mut self.spread {
            *part = joseph * *part * joseph.transpose();
        }
        for (part, of_measurement) in self.spread[1..].iter_mut().zip(measurement_noise) {
            *part += gain * of_measurement * gain.transpose();
        }
        self.factors += correction.fixed_rows::<3>(3);
        let pose = Pose::new(
            predicted.x_m + correction[0],
            predicted.y_m + correction[1],
            predicted.theta_rad + correction[2],
        );
        self.propagation = PropagationInterval::at(pose);
        self.noise.measurement(&residual, &expected);
        self.measurements += 1;
        if self.measurements >= 2 * self.next_half.measurements {
            self.half = self.next_half;
            self.next_half = Checkpoint {
                measurements: self.measurements,
                factors: self.factors,
                covariance: self.factor_covariance(),
            };
        }
        PoseInnovation { residual, covariance, nis: residual.dot(&(inverse * residual)) }
    }

    /// The estimated pose.
    #[must_use]
    pub const fn world_from_body(&self) -> Pose {
        self.propagation.dead_reckoned.pose
    }

    /// The three factors: left wheel, right wheel, separation.
    #[must_use]
    pub const fn factors(&self) -> &Vector3<f64> {
        &self.factors
    }

    /// Covariance of the three factors, in their order.
    #[must_use]
    pub fn factor_covariance(&self) -> Matrix3<f64> {
        self.whole(&self.spread).fixed_view::<3, 3>(3, 3).into_owned()
    }

    /// The drive that the factors make of the nominal one.
    ///
    /// # Errors
    /// [`GeometryError`] when a factor is not positive.
    pub fn geometry(&self) -> Result<DriveGeometry, GeometryError> {
        let [left, right, separation_m] = self.diameter_per_factor.component_mul(&self.factors).into();
        DriveGeometry::new(Wheels { left, right }, separation_m)
    }

    /// Covariance of [`Self::geometry`]: left diameter, right diameter, separation, m².
    #[must_use]
    pub fn covariance(&self) -> Matrix3<f64> {
        let scale = Matrix3::from_diagonal(&self.diameter_per_factor);
        scale * self.factor_covariance() * scale
    }

    /// Covariance of [`Self::world_from_body`]: x, y, heading; m², m·rad, rad².
    #[must_use]
    pub fn pose_covariance(&self) -> Matrix3<f64> {
        self.whole(&self.spread_now()).fixed_view::<3, 3>(0, 0).into_owned()
    }

    /// The noise as the second filter estimates it.
    #[must_use]
    pub const fn noise(&self) -> &NoiseFilter {
        &self.noise
    }

    /// Whether the factors are known well enough and have stopped moving ([`Settling`]).
    #[must_use]
    pub fn is_settled(&self) -> bool {
        let now = self.factor_covariance();
        let known = (0..3).all(|i| now[(i, i)] <= self.settling.factor_sigma * self.settling.factor_sigma);
        known && self.has_stopped_moving()
    }

    /// Whether the later half of the measurements, or more, moved the factors by no more than it could
    /// determine.
    ///
    /// A constant that is estimated better and better moves by as much as its variance shrinks: Var(now −
    /// then) = P_then − P_now. One that moves by more is no constant, or the noise is not what the filter
    /// takes it for.
    #[must_use]
    pub fn has_stopped_moving(&self) -> bool {
        let now = self.factor_covariance();
        (0..3).all(|i| {
            let learned_var = self.half.covariance[(i, i)] - now[(i, i)];
            let moved = (self.factors[i] - self.half.factors[i]).abs();
            moved <= self.settling.moved_sigmas * learned_var.max(now[(i, i)]).max(0.0).sqrt()
        })
    }

    fn geometry_parameters(&self) -> GeometryParameters {
        let [left, right, separation_m] = self.nominal.component_mul(&self.factors).into();
        GeometryParameters { m_per_rad: Wheels { left, right }, separation_m }
    }

    fn whole(&self, spread: &[Matrix6<f64>; 4]) -> Matrix6<f64> {
        let variances: &Variances = self.noise.variances();
        spread[0]
            + spread[1] * variances[NoiseSource::Wheels as usize]
            + spread[2] * variances[NoiseSource::Position as usize]
            + spread[3] * variances[NoiseSource::Heading as usize]
    }

    /// ∂(state now)/∂(state at the last measurement).
    fn transition(&self) -> Matrix6<f64> {
        let PropagationInterval { start, dead_reckoned, .. } = &self.propagation;
        let mut transition = Matrix6::identity();
        // Turned by its heading's error, the whole interval swings round its start.
        transition[(0, 2)] = -(dead_reckoned.pose.y_m - start.y_m);
        transition[(1, 2)] = dead_reckoned.pose.x_m - start.x_m;
        let by_factors = dead_reckoned.by_geometry * Matrix3::from_diagonal(&self.nominal);
        transition.fixed_view_mut::<3, 3>(0, 3).copy_from(&by_factors);
        transition
    }

    /// The parts of the covariance carried over what happened since the last measurement.
    fn spread_now(&self) -> [Matrix6<f64>; 4] {
        let transition = self.transition();
        let mut spread = self.spread.map(|part| transition * part * transition.transpose());
        let mut of_pose = spread[1].fixed_view_mut::<3, 3>(0, 0);
        of_pose += self.propagation.wheels.matrix();
        spread
    }
}

/// What each variance adds to a measurement: nothing of the wheels, both coordinates, the heading.
fn instrument() -> [Matrix3<f64>; 3] {
    [
        Matrix3::zeros(),
        Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 0.0)),
        Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, 1.0)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nominal() -> DriveGeometry {
        DriveGeometry::new(Wheels { left: 0.16, right: 0.17 }, 0.363).expect("valid")
    }

    fn filter(variances: [f64; 3]) -> AugmentedFilter<f64> {
        let noise = NoiseFilter::new(variances.into(), [true; 3]);
        AugmentedFilter::new(
            &nominal(),
            nominal().m_per_rad(),
            0.05,
            noise,
            Pose::new(0.1, 0.2, 0.3),
            Wheels::both(0.0),
        )
    }

    /// Wheel angles of a bent path with a spin in it.
    const ROWS: [(f64, f64); 5] = [(2.0, 3.0), (4.0, 4.5), (2.5, 6.0), (2.5, 6.0), (5.0, 9.0)];

    fn state(filter: &AugmentedFilter<f64>) -> [f64; 6] {
        let Pose { x_m, y_m, theta_rad } = filter.world_from_body();
        let [left, right, separation] = (*filter.factors()).into();
        [x_m, y_m, theta_rad, left, right, separation]
    }

    #[test]
    fn the_transition_is_the_derivative_and_would_not_pass_wrong() {
        let h = 1e-6;
        let end = |by: f64, column: usize| {
            let mut filter = filter([1e-6; 3]);
            let mut start = filter.world_from_body();
            match column {
                0 => start.x_m += by,
                1 => start.y_m += by,
                2 => start.theta_rad += by,
                _ => filter.factors[column - 3] += by,
            }
            filter.restart(start, Wheels::both(0.0));
            for (left, right) in ROWS {
                filter.predict(Wheels { left, right });
            }
            filter
        };
        let transition = end(0.0, 0).transition();
        for column in 0..6 {
            let (plus, minus) = (state(&end(h, column)), state(&end(-h, column)));
            for row in 0..6 {
                let difference = (plus[row] - minus[row]) / (2.0 * h);
                // 0.7 m and 0.9 rad: third derivatives by factors stay under 1 m; truncation 1e-12, rounding
                // 1e-16/1e-6 times a few.
                let tolerance = 1e-8;
                assert!((transition[(row, column)] - difference).abs() < tolerance, "{row} {column}");
                assert!((transition[(row, column)] + 1e-3 - difference).abs() > tolerance);
            }
        }
    }

    /// The filter in its textbook form, with one covariance.
    #[test]
    fn the_parts_add_up_to_the_covariance_of_a_filter_that_keeps_one() {
        let variances = [3e-6, 4e-6, 5e-6];
        let mut parts = filter(variances);
        let measurement = Matrix3::from_diagonal(&Vector3::new(4e-6, 4e-6, 5e-6));
        let mut whole = Matrix6::zeros();
        whole.fixed_view_mut::<3, 3>(0, 0).copy_from(&measurement);
        whole.fixed_view_mut::<3, 3>(3, 3).copy_from(&Matrix3::from_diagonal_element(0.05 * 0.05));
        let wheel_noise = WheelNoise { sigma_m_per_sqrt_m: Wheels::both(3e-6_f64.sqrt()) };
        for (left, right) in ROWS {
            let before = parts.world_from_body();
            let mut of_pose = OdometryCovariance::default();
            let geometry_parameters = parts.geometry_parameters();
            let turned = Wheels { left: left - parts.counts.left, right: right - parts.counts.right };
            let travel_m = geometry_parameters.m_per_rad.zip_with(turned, |m_per_rad, rad| m_per_rad * rad);
            of_pose.propagate(before, travel_m, geometry_parameters.separation_m, &wheel_noise);
            let predicted = parts.predict(Wheels { left, right });
            let transition = parts.transition();
            whole = transition * whole * transition.transpose();
            let mut block = whole.fixed_view_mut::<3, 3>(0, 0);
            block += of_pose.matrix();
            let measured = predicted * Pose::new(1e-3, -2e-3, 3e-3);
            let innovation = parts.update(measured);
            let mean = whole.fixed_view::<3, 3>(0, 0) + measurement;
            assert!((innovation.covariance - mean).norm() < 1e-12 * mean.norm());
            let gain = whole.fixed_columns::<3>(0) * mean.try_inverse().expect("regular");
            let rows = whole.fixed_rows::<3>(0).into_owned();
            whole -= gain * rows;
            // Joseph's form against the short one: roundings of 2.5e-3, the prior variance.
            assert!((parts.whole(&parts.spread) - whole).norm() < 1e-15);
        }
        // And would not pass with the wheels' part left out.
        assert!((parts.whole(&parts.spread) - parts.spread[1] * variances[0] - whole).norm() > 1e-8);
    }

    /// Intervals of half a metre with half a radian of turn to either side, measured without error; the robot
    /// has this geometry.
    fn wander(filter: &mut AugmentedFilter<f64>, geometry_parameters: GeometryParameters, intervals: u32) {
        let mut truth = DeadReckoned::at(filter.world_from_body());
        let mut wheel_rad = filter.counts;
        filter.restart(truth.pose, wheel_rad);
        for propagation in 0..intervals {
            let turn = if propagation % 4 < 2 { 1.0 } else { -1.0 };
            let step = Wheels { left: 6.0 - turn, right: 6.0 + turn };
            truth.advance(&geometry_parameters, step);
            wheel_rad = wheel_rad.zip_with(step, |sum, step| sum + step);
            filter.predict(wheel_rad);
            filter.update(truth.pose);
        }
    }

    #[test]
    fn factors_are_found_settle_and_their_change_is_detected() {
        let robot = |left: f64| GeometryParameters {
            m_per_rad: Wheels { left: 0.08 * left, right: 0.085 * 0.99 },
            separation_m: 0.363 * 1.03,
        };
        let mut filter = filter([1e-8, 1e-8, 1e-8]);
        wander(&mut filter, robot(1.01), 2);
        assert!(!filter.is_settled(), "two legs are not enough to know");
        wander(&mut filter, robot(1.01), 400);
        assert!(filter.is_settled(), "{} {}", filter.factors(), filter.factor_covariance());
        // Linearised about a start that is 3 % off; the measurements after it outweigh that.
        let error = (filter.factors() - Vector3::new(1.01, 0.99, 1.03)).amax();
        assert!(error < 1e-4, "{error}");
        // The right wheel for the left one would not pass.
        assert!((filter.factors().y - 1.01).abs() > 1e-2);
        // Another tyre: what 400 measurements agree on does not explain the next ones.
        wander(&mut filter, robot(1.02), 400);
        assert!(!filter.is_settled());
    }
}
