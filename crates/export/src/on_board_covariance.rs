//! The covariance of a pose on line: `kinematics::OdometryCovariance` along the counts, the noise of turns,
//! and what effects without a mean scatter.
//!
//! What scatters independently from interval to interval accumulates. The separation is drawn once a motion:
//! its error is σ² g gᵀ with the derivative g of the pose by it, which grows with the turn and is added to
//! the rest where the motion ends. Rounding of the first reading stays in the pose, that of the present one
//! is added for the moment.

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
        let (chord, chord_slope) = (sinc(half_rad), sinc_derivative(half_rad));
        let per_m = turn_rad / self.separation_m;
        let along = distance_m * chord * self.by_separation.z;
        let by_turn =
            0.5 * distance_m * Vector3::new(chord_slope * cos - chord * sin, chord_slope * sin + chord * cos, 0.0);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::on_board::OnBoardOdometry;
    use crate::robot::{RobotEffect, specimen};

    /// A robot whose wheels have no noise, with an effect that scatters.
    fn robot(id: &str, values: &[(&str, f64)]) -> CalibratedRobot {
        let id = effects::CATALOGUE.iter().find(|of| **of == id).expect("known");
        let effect = RobotEffect {
            id,
            meaning: "",
            on_board: effects::description(id).expect("known").on_board,
            values: values.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect(),
            terms: Vec::new(),
            is_silent: false,
        };
        let noise =
            Some(OdometryNoise { wheel_sigma_m_per_sqrt_m: 0.0, turn_sigma_rad_per_sqrt_rad: 0.0, is_assumed: false });
        CalibratedRobot { noise, effects: vec![effect], ..specimen() }
    }

    /// Counts that turn the specimen on the spot by so much, 62.2 µm a count of the right wheel.
    fn spun(odometry: &mut OnBoardOdometry, counts: &mut Wheels<i64>, steps: i64) -> f64 {
        let from_rad = odometry.pose().theta_rad;
        for _ in 0..steps.abs() {
            *counts = Wheels { left: counts.left - 99 * steps.signum(), right: counts.right + 101 * steps.signum() };
            odometry.step(*counts, 0.02);
        }
        odometry.pose().theta_rad - from_rad
    }

    /// Navarro et al., eq. (11): σ_θ = |Δθ| σ_b/B in a motion, independent from motion to motion. Rejects
    /// draws that are independent from interval to interval, which are ten times less, and a motion that
    /// turns back and keeps its error.
    #[test]
    fn the_separation_is_drawn_once_a_motion() {
        let robot = robot("contact_patch_wheelbase", &[("sigma_m", 4.08e-3)]);
        let mut counts = Wheels::both(0);
        let mut odometry = OnBoardOdometry::new(&robot, None, counts).expect("a drive");
        let variance = |odometry: &OnBoardOdometry| odometry.covariance().expect("noise")[(2, 2)];
        let turned_rad = spun(&mut odometry, &mut counts, 100);
        assert!((variance(&odometry) / (0.01 * turned_rad).powi(2) - 1.0).abs() < 1e-9);
        assert!((spun(&mut odometry, &mut counts, -100) + turned_rad).abs() < 1e-12);
        assert!(variance(&odometry) < 1e-20, "{}", variance(&odometry));
        let _ = spun(&mut odometry, &mut counts, 100);
        for _ in 0..20 {
            odometry.step(counts, 0.02);
        }
        let _ = spun(&mut odometry, &mut counts, -100);
        assert!((variance(&odometry) / (0.01 * turned_rad).powi(2) - 2.0).abs() < 1e-9);
    }

    /// Rounding of the first and of the present reading, whatever lies between: Δ²/12 each, of ticks of many
    /// counts. Rejects a rounding that accumulates.
    #[test]
    fn rounding_does_not_accumulate() {
        let robot = robot("quantization", &[("counts_per_tick", 1e6)]);
        let m_per_count = [0.202, 0.198].map(|diameter_m: f64| std::f64::consts::PI * diameter_m / 1e4);
        let expected = m_per_count.iter().map(|m| 2.0 * m * m / 12.0).sum::<f64>() / 0.408_f64.powi(2);
        let mut odometry = OnBoardOdometry::new(&robot, None, Wheels::both(0)).expect("a drive");
        for step in 1..=500 {
            odometry.step(Wheels::both(20 * step), 0.02);
            let heading_rad2 = odometry.covariance().expect("noise")[(2, 2)];
            assert!((heading_rad2 / expected - 1.0).abs() < 1e-9, "{step}: {heading_rad2} {expected}");
        }
    }

    /// A compound Poisson process: rate × loss² × travel of each wheel, however the travel is cut.
    #[test]
    fn bumps_scatter_in_proportion_to_the_travel() {
        let robot = robot("bumps", &[("per_m", 0.5), ("height_m", 2e-3)]);
        let heading_rad2 = |steps: i64| {
            let mut odometry = OnBoardOdometry::new(&robot, None, Wheels::both(0)).expect("a drive");
            (1..=steps).for_each(|step| odometry.step(Wheels::both(20_000 * step / steps), 0.02));
            odometry.covariance().expect("noise")[(2, 2)]
        };
        // 2 (r acos(1 − h/r) − √(2rh − h²)) at radii of 101 and 99 mm, 2 · 2π r of travel each.
        let of = |r: f64| {
            let lost_m = 2.0 * (r * (1.0 - 2e-3 / r).acos() - (2e-3 * (2.0 * r - 2e-3)).sqrt());
            0.5 * lost_m * lost_m * 2.0 * std::f64::consts::TAU * r
        };
        let expected = (of(0.101) + of(0.099)) / 0.408_f64.powi(2);
        for steps in [1, 100] {
            assert!((heading_rad2(steps) / expected - 1.0).abs() < 1e-6, "{steps}: {} {expected}", heading_rad2(steps));
        }
    }
}
