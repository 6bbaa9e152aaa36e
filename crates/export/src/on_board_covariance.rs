//! The covariance of a pose on line: `kinematics::OdometryCovariance` along the counts, the noise of turns,
//! and what effects without a mean scatter.
//!
//! What scatters independently from interval to interval accumulates. The separation is drawn once a motion:
//! its error is σ² g gᵀ with the derivative g of the pose by it, which grows with the turn and is added to
//! the rest where the motion ends. Rounding of the first reading stays in the pose, that of the present one is
//! added for the moment.

use calib::OdometryNoise;
use effects::{IntervalScatter, OnBoard, ScatterModel};
use kinematics::{Increment, OdometryCovariance, Pose, WheelNoise, Wheels, sin_cos, sinc, sinc_derivative};
use model_term::Interval;
use nalgebra::{Matrix3, Vector3};

use crate::robot::CalibratedRobot;

pub(crate) struct OnBoardCovariance {
    noise: OdometryNoise,
    scatter: Vec<Box<dyn ScatterModel>>,
    accumulated: OdometryCovariance,
    reported: Matrix3<f64>,
    by_separation: Vector3<f64>,
    separation_m: f64,
    has_started: bool,
}

impl OnBoardCovariance {
    pub(crate) fn new(noise: OdometryNoise, robot: &CalibratedRobot, separation_m: f64) -> Self {
        let scatter = robot.effects.iter().filter_map(|effect| match effect.on_board {
            OnBoard::CovarianceOnly(scatter) => Some((scatter.model)(&|name| effect.size(name))),
            _ => None,
        });
        Self {
            noise,
            scatter: scatter.collect(),
            accumulated: OdometryCovariance::default(),
            reported: Matrix3::zeros(),
            by_separation: Vector3::zeros(),
            separation_m,
            has_started: false,
        }
    }

    /// Over an interval from a pose on, at whose end the heading is this.
    pub(crate) fn after(&mut self, before: Pose, heading_rad: f64, interval: &Interval<'_>) {
        let mut scatter = IntervalScatter::default();
        self.scatter.iter_mut().for_each(|model| model.after(interval, &mut scatter));
        if !self.has_started {
            self.has_started = true;
            self.add(&self.of_readings(before.theta_rad, scatter.reading_var_m2));
        }
        if scatter.motion_begins {
            self.add(&(scatter.separation_var_m2 * self.by_separation * self.by_separation.transpose()));
            self.by_separation = Vector3::zeros();
        }
        let Increment { distance_m, turn_rad } = interval.increment();
        let half_rad = 0.5 * turn_rad;
        let (sin, cos) = sin_cos(before.theta_rad + half_rad);
        let (chord, bend) = (sinc(half_rad), sinc_derivative(half_rad));
        let per_m = turn_rad / self.separation_m;
        let along = distance_m * chord * self.by_separation.z;
        let by_turn = 0.5 * distance_m * Vector3::new(bend * cos - chord * sin, bend * sin + chord * cos, 0.0);
        self.by_separation += along * Vector3::new(-sin, cos, 0.0) - per_m * (by_turn + Vector3::z());
        // As noise of wheels, whose variance goes with the travel.
        let sigma = Wheels::from_sides(|side| {
            let of_wheel = self.noise.wheel_sigma_m_per_sqrt_m.powi(2);
            let (var_m2, travel_m) = (scatter.travel_var_m2[side], interval.travel_m[side].abs());
            if var_m2 > 0.0 && travel_m > 0.0 { (of_wheel + var_m2 / travel_m).sqrt() } else { of_wheel.sqrt() }
        });
        let noise = WheelNoise { sigma_m_per_sqrt_m: sigma };
        self.accumulated.propagate(before, interval.travel_m, self.separation_m, &noise);
        let turn_var_rad2 = self.noise.turn_sigma_rad_per_sqrt_rad.powi(2) * turn_rad.abs() + scatter.turn_var_rad2;
        self.add(&(turn_var_rad2 * Vector3::z() * Vector3::z().transpose()));
        self.reported = self.accumulated.matrix()
            + scatter.separation_var_m2 * self.by_separation * self.by_separation.transpose()
            + self.of_readings(heading_rad, scatter.reading_var_m2);
    }

    fn add(&mut self, more: &Matrix3<f64>) {
        self.accumulated = OdometryCovariance::starting_at(self.accumulated.matrix() + more);
    }

    /// What errors of the counters' readings are in a pose of a heading.
    fn of_readings(&self, heading_rad: f64, var_m2: Wheels<f64>) -> Matrix3<f64> {
        let (sin, cos) = sin_cos(heading_rad);
        let by = |sense: f64| Vector3::new(0.5 * cos, 0.5 * sin, sense / self.separation_m);
        var_m2.left * by(-1.0) * by(-1.0).transpose() + var_m2.right * by(1.0) * by(1.0).transpose()
    }

    pub(crate) const fn matrix(&self) -> &Matrix3<f64> {
        &self.reported
    }
}
