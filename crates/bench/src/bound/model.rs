//! A scenario's noise, as second moments.
//!
//! Whatever an instrument reads comes down to the body's pose with a covariance. A grid's marks give it by
//! least squares, (Σ JᵀJ)⁻¹(σ² + Δ²/12) with J the slope of a mark's place in the pose; a marker on a known
//! lever gives it through that lever. Both look alike from everywhere, so that the covariance is constant in
//! the body's frame. Δ²/12 takes two readings' roundings as independent: their correlation is up to
//! exp(−4π²σ²/Δ²), 1 % at σ = Δ/3. Readings without an error of their own share their rounding between marks
//! and between ends: the bound would be beaten up to sixfold, so that there is none.

use dataset::MarkedPoint;
use kinematics::{DriveGeometry, Increment, Point, Pose, WheelNoise, Wheels};
use nalgebra::{Matrix2x3, Matrix3, Vector3};
use scenario::{Engine, Instrument, Robot, Scenario};

use super::error::NoBound;
use super::partial::PartialInstrument;

/// Readings must err by this share of what they are rounded to, for their roundings to be independent to 1 %.
const MIN_DITHER: f64 = 1.0 / 3.0;

/// Everything of a scenario that the information depends on.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Model {
    /// The true drive, at which the information is taken.
    pub(super) geometry: DriveGeometry,
    /// The wheels' random walk.
    pub(super) wheel_noise: WheelNoise,
    /// Relative scatter of each wheel's sensitivity from motion to motion.
    pub(super) sensitivity_sigma: f64,
    /// Variance of the wheel separation from motion to motion, m².
    pub(super) separation_var_m2: f64,
    /// Controller counts in a recorded tick.
    pub(super) counts_per_tick: u32,
    /// The instruments that see poses, or those that measure parts of them.
    pub(super) instruments: Vec<PoseInstrument>,
    pub(super) partial: Vec<PartialInstrument>,
    /// Standard deviation of a gyroscope's scale that the dataset states; 0 = none.
    pub(super) scale_sigma: f64,
    /// Whether speed is ramped up and down at the commanded acceleration, and not constant.
    pub(super) ramps: bool,
    robot: Robot,
    nominal_geometry: DriveGeometry,
}

impl Model {
    pub(super) fn of(scenario: &Scenario) -> Result<Self, NoBound> {
        let points = scenario.robot.marked_points();
        let (mut instruments, mut partial) = (Vec::new(), Vec::new());
        for instrument in &scenario.instruments {
            match PartialInstrument::of(instrument, scenario.log) {
                Some(of) => partial.push(of?),
                None => instruments.push(PoseInstrument::of(instrument, &points)?),
            }
        }
        if instruments.is_empty() && partial.is_empty() {
            return Err(NoBound::NoInstrument);
        }
        if !instruments.is_empty() && !partial.is_empty() {
            return Err(NoBound::PartialMeasurements);
        }
        let scale_sigma = scenario.instruments.iter().find_map(|instrument| match *instrument {
            Instrument::Gyro { scale_sigma, .. } => Some(scale_sigma),
            _ => None,
        });
        let (mut separation_var_m2, mut counts_per_tick, mut on_speed) = (0.0, 1, false);
        for effect in &scenario.effects {
            let unclosed = |why| NoBound::Effect { id: effect.id(), why };
            separation_var_m2 += effect.physical().wheel_separation_sigma_m().map_err(unclosed)?.powi(2);
            if let Some(forward) = effect.physical().forward() {
                counts_per_tick *= forward.counts_per_tick().unwrap_or(1);
                on_speed |= forward.depends_on_speed();
            }
        }
        Ok(Self {
            geometry: scenario.true_geometry()?,
            wheel_noise: WheelNoise { sigma_m_per_sqrt_m: Wheels::both(scenario.noise.wheel_sigma_m_per_sqrt_m) },
            sensitivity_sigma: scenario.noise.sensitivity_sigma,
            separation_var_m2,
            counts_per_tick,
            instruments,
            partial,
            scale_sigma: scale_sigma.unwrap_or(0.0),
            ramps: on_speed || scenario.engine != Engine::ClosedForm,
            robot: scenario.robot.clone(),
            nominal_geometry: scenario.nominal_geometry()?,
        })
    }

    /// How many instruments there are: those that see poses first.
    pub(super) const fn measurements(&self) -> usize {
        self.instruments.len() + self.partial.len()
    }

    /// Measurements per second of an instrument while time passes; `None` for one that reads the standing
    /// robot alone.
    pub(super) fn rate_hz(&self, measurement: usize) -> Option<f64> {
        match self.instruments.get(measurement) {
            Some(of) => of.rate_hz,
            None => self.partial.get(measurement - self.instruments.len())?.rate_hz(),
        }
    }

    /// Does an instrument read the standing robot?
    pub(super) fn reads_standing(&self, measurement: usize) -> bool {
        match self.instruments.get(measurement) {
            Some(of) => of.rate_hz.is_none(),
            None => {
                self.partial.get(measurement - self.instruments.len()).is_some_and(PartialInstrument::reads_standing)
            }
        }
    }

    /// Recorded ticks of a wheel turn.
    pub(super) fn ticks_per_turn(&self) -> f64 {
        self.robot.encoder.counts_per_wheel_turn() / f64::from(self.counts_per_tick)
    }

    /// True travel of each wheel for a controller's count, metres.
    pub(super) fn m_per_count(&self) -> Wheels<f64> {
        let counts_per_turn = self.robot.encoder.counts_per_wheel_turn();
        self.geometry.wheel_diameter_m().map(|diameter_m| std::f64::consts::PI * diameter_m / counts_per_turn)
    }

    /// What the robot tells its wheels for a motion: whole counts by the nominal drive.
    pub(super) fn commanded_counts(&self, increment: Increment) -> Wheels<f64> {
        let travel_m = self.nominal_geometry.travel_m(increment);
        travel_m.zip_with(self.nominal_m_per_count(), |travel_m, m_per_count| (travel_m / m_per_count).round())
    }

    /// Speed of a wheel's contact that motions are commanded with, m/s.
    pub(super) const fn cruise_speed_m_s(&self) -> f64 {
        self.robot.cruise_speed_m_s
    }

    /// Speed and acceleration of the wheel with more counts to go, counts/s and counts/s², where its contact
    /// goes at a speed, m/s.
    pub(super) fn speed_and_acceleration_of_counts(&self, counts: Wheels<f64>, speed_m_s: f64) -> (f64, f64) {
        let m_per_count = self.nominal_m_per_count();
        let longest = counts.left.abs().max(counts.right.abs());
        let speed = |counts: f64, m_per_count: f64| speed_m_s / m_per_count * counts.abs() / longest;
        let speeds = counts.zip_with(m_per_count, speed);
        (speeds.left.max(speeds.right), self.robot.acceleration_m_s2 / m_per_count.left)
    }

    fn nominal_m_per_count(&self) -> Wheels<f64> {
        let counts_per_turn = self.robot.encoder.counts_per_wheel_turn();
        self.robot.wheel_diameter_m().map(|diameter_m| std::f64::consts::PI * diameter_m / counts_per_turn)
    }
}

/// An instrument as the pose that its readings come to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PoseInstrument {
    /// Measurements per second while time passes; `None` for one that reads the standing robot.
    pub(super) rate_hz: Option<f64>,
    /// Covariance of the pose in the body's frame, order x, y, θ.
    covariance: Matrix3<f64>,
}

impl PoseInstrument {
    fn of(instrument: &Instrument, points: &[MarkedPoint]) -> Result<Self, NoBound> {
        match *instrument {
            Instrument::FloorGrid { resolution_m, reading_sigma_m } => {
                if points.iter().all(|mark| mark.body == points[0].body) {
                    return Err(NoBound::NoHeading);
                }
                if reading_sigma_m < MIN_DITHER * resolution_m {
                    return Err(NoBound::RoundedReadings { reading_sigma_m, resolution_m });
                }
                let precision: Matrix3<f64> =
                    points.iter().map(|mark| place_slope(mark.body)).map(|j| j.transpose() * j).sum();
                let unit = precision.try_inverse().ok_or(NoBound::NoHeading)?;
                let var_m2 = reading_sigma_m * reading_sigma_m + resolution_m * resolution_m / 12.0;
                Ok(Self { rate_hz: None, covariance: unit * var_m2 })
            }
            Instrument::MotionCapture { rate_hz, sigma_xy_m, sigma_theta_rad, lever_x_m, lever_y_m, .. } => {
                // body = marker − lever turned by a heading with an error.
                let mut body_from_reading = Matrix3::identity();
                body_from_reading[(0, 2)] = lever_y_m;
                body_from_reading[(1, 2)] = -lever_x_m;
                let var = Vector3::new(sigma_xy_m, sigma_xy_m, sigma_theta_rad).map(|sigma| sigma * sigma);
                let covariance = body_from_reading * Matrix3::from_diagonal(&var) * body_from_reading.transpose();
                Ok(Self { rate_hz: Some(rate_hz), covariance })
            }
            Instrument::Slam(_) => Err(NoBound::CorrelatedErrors),
            Instrument::Tachometer { .. } => Err(NoBound::WheelSpeeds),
            Instrument::Gyro { .. } | Instrument::Tape { .. } | Instrument::Wall(_) | Instrument::Revisit { .. } => {
                Err(NoBound::PartialMeasurements)
            }
        }
    }

    /// Covariance of the seen pose in the run's frame.
    pub(super) fn covariance(&self, world_from_body: Pose) -> Matrix3<f64> {
        let (sin, cos) = world_from_body.theta_rad.sin_cos();
        let turn = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
        turn * self.covariance * turn.transpose()
    }
}

/// ∂(place of a mark)/∂(x, y, θ) of a body at heading zero.
fn place_slope(body: Point) -> Matrix2x3<f64> {
    Matrix2x3::new(1.0, 0.0, -body.y_m, 0.0, 1.0, body.x_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mark(x_m: f64, y_m: f64) -> MarkedPoint {
        MarkedPoint { id: format!("{x_m} {y_m}"), body: Point::new(x_m, y_m) }
    }

    #[test]
    fn two_marks_across_the_axle_give_the_textbook_pose() {
        let grid = Instrument::FloorGrid { resolution_m: 0.0, reading_sigma_m: 2e-3 };
        let measurement = PoseInstrument::of(&grid, &[mark(0.0, 0.2), mark(0.0, -0.2)]).expect("two marks");
        let measured = measurement.covariance(Pose::new(3.0, -1.0, 0.7));
        // Each coordinate of the middle σ²/2, the heading 2σ²/w²; one part in 1e15 a rounding, a dozen of
        // them.
        let expected = Matrix3::from_diagonal(&Vector3::new(2e-6, 2e-6, 2.0 * 4e-6 / 0.16));
        assert!((measured - expected).abs().max() < 1e-18, "{measured}");
        assert_eq!(PoseInstrument::of(&grid, &[mark(0.1, 0.2), mark(0.1, 0.2)]), Err(NoBound::NoHeading));
    }

    #[test]
    fn rounding_to_the_grid_adds_a_twelfth_of_its_square() {
        let marks = [mark(0.0, 0.2), mark(0.0, -0.2)];
        let grid = |reading_sigma_m| {
            PoseInstrument::of(&Instrument::FloorGrid { resolution_m: 1e-3, reading_sigma_m }, &marks)
        };
        let measurement = grid(4e-4).expect("dithered");
        assert!((measurement.covariance(Pose::IDENTITY)[(0, 0)] / (0.5 * (1.6e-7 + 1e-6 / 12.0)) - 1.0).abs() < 1e-14);
        assert!(matches!(grid(3e-4), Err(NoBound::RoundedReadings { .. })));
    }

    #[test]
    fn a_marker_on_a_lever_blurs_the_body_by_its_heading() {
        let capture = |lever_x_m, lever_y_m| Instrument::MotionCapture {
            rate_hz: 20.0,
            sigma_xy_m: 3e-4,
            sigma_theta_rad: 2e-3,
            latency_s: 0.0,
            lever_x_m,
            lever_y_m,
            lever_theta_rad: 0.3,
        };
        // A marker 0.5 m ahead of a body that heads north: a heading too large puts the body too far east.
        let ahead = PoseInstrument::of(&capture(0.5, 0.0), &[]).expect("always");
        let measured = ahead.covariance(Pose::new(0.0, 0.0, std::f64::consts::FRAC_PI_2));
        assert!((measured[(0, 0)] - (9e-8 + 0.25 * 4e-6)).abs() < 1e-18);
        assert!((measured[(1, 1)] - 9e-8).abs() < 1e-18);
        assert!((measured[(0, 2)] - 0.5 * 4e-6).abs() < 1e-18, "{measured}");
        // To the left of a body that heads east: the same.
        let left = PoseInstrument::of(&capture(0.0, 0.5), &[]).expect("always");
        assert!((left.covariance(Pose::IDENTITY)[(0, 2)] - 0.5 * 4e-6).abs() < 1e-18);
    }
}
