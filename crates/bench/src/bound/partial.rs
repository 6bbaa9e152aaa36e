//! Partial measurements in the bound: scalars of the pose, of a copy of an earlier one, and of what is
//! unknown of an instrument.
//!
//! A gyroscope's bias, a wall's direction and distance and the places of earlier readings are states beside
//! the pose, unknown in every run. A gyroscope's scale is unknown too and the same in all runs: a fourth
//! parameter, which the bound of the geometry leaves out by Schur's complement.

use kinematics::Pose;
use nalgebra::{Matrix3, Matrix4, Vector3, Vector4};
use scenario::{Instrument, Log};
use sim_yair::{MIN_RETURN_TURN_RAD, TAPE_FROM_M};

use super::error::NoBound;

/// Standard deviation of what is unknown of an instrument before it is seen: rad/s of a bias, rad and m of a
/// wall. A thousand times what any reading errs by, so that nothing is known of it, and far from where the
/// rounding of numbers shows.
const UNKNOWN_SIGMA: f64 = 10.0;

/// An instrument that measures parts of poses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum PartialInstrument {
    Gyro { row_s: Option<f64>, noise_rad_per_sqrt_s: f64, bias_walk_radps_per_sqrt_s: f64, scale: f64 },
    Tape { sigma_m: f64 },
    Revisit { sigma_xy_m: f64, sigma_theta_rad: f64 },
    Wall(scenario::Wall),
}

impl PartialInstrument {
    /// Of an instrument; `None` where it sees whole poses.
    pub(super) fn of(instrument: &Instrument, log: Option<Log>) -> Option<Result<Self, NoBound>> {
        Some(Ok(match *instrument {
            Instrument::Gyro { noise_rad_per_sqrt_s, bias_walk_radps_per_sqrt_s, scale, .. } => Self::Gyro {
                row_s: log.map(|log| log.interval_s),
                noise_rad_per_sqrt_s,
                bias_walk_radps_per_sqrt_s,
                scale,
            },
            Instrument::Tape { sigma_m } => Self::Tape { sigma_m },
            Instrument::Revisit { sigma_xy_m, sigma_theta_rad } => Self::Revisit { sigma_xy_m, sigma_theta_rad },
            Instrument::Wall(wall) if wall.has_lever() => return Some(Err(NoBound::UnknownLever)),
            Instrument::Wall(wall) => Self::Wall(wall),
            _ => return None,
        }))
    }

    /// Measurements per second while time passes; `None` for what measures the standing robot.
    pub(super) fn rate_hz(&self) -> Option<f64> {
        match *self {
            Self::Gyro { row_s, .. } => row_s.map(f64::recip),
            Self::Wall(wall) => Some(wall.rate_hz),
            Self::Tape { .. } | Self::Revisit { .. } => None,
        }
    }

    /// Does it measure the standing robot?
    pub(super) const fn reads_standing(&self) -> bool {
        !matches!(self, Self::Wall(_))
    }

    /// How many states it adds.
    pub(super) const fn states(&self) -> usize {
        match self {
            // Bias, and the heading at the row before.
            Self::Gyro { .. } => 2,
            // Where the robot stood before; a wall's direction and distance.
            Self::Tape { .. } | Self::Wall(_) => 2,
            // A run's start is where its poses count from.
            Self::Revisit { .. } => 0,
        }
    }

    /// Variance of each of its states at the start of a run.
    pub(super) const fn first_variance(&self, state: usize) -> f64 {
        match self {
            Self::Wall(_) => UNKNOWN_SIGMA * UNKNOWN_SIGMA,
            Self::Gyro { .. } if state == 0 => UNKNOWN_SIGMA * UNKNOWN_SIGMA,
            _ => 0.0,
        }
    }
}

/// What an instrument has measured before in a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Before {
    pub(super) t_s: f64,
    pub(super) world_from_body: Pose,
}

/// A scalar that is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scalar {
    /// Slope in the pose.
    pub(super) by_pose: Vector3<f64>,
    /// Slope in the instrument's states.
    pub(super) by_states: [f64; 2],
    /// Slope in the gyroscope's scale.
    pub(super) by_scale: f64,
    pub(super) variance: f64,
}

/// What an instrument does at an instant.
#[derive(Debug, Clone, Default)]
pub(super) struct Reading {
    /// Variance that its first state gains beforehand.
    pub(super) walk: f64,
    pub(super) scalars: Vec<Scalar>,
    /// Which parts of the pose its states copy afterwards: state and part.
    pub(super) copies: Vec<(usize, usize)>,
}

impl PartialInstrument {
    /// What it measures of a pose at an instant, after what it measured before.
    pub(super) fn reading(&self, t_s: f64, pose: Pose, before: Option<Before>) -> Reading {
        let scalar = |by_pose: [f64; 3], by_states: [f64; 2], sigma: f64| Scalar {
            by_pose: by_pose.into(),
            by_states,
            by_scale: 0.0,
            variance: sigma * sigma,
        };
        match *self {
            Self::Gyro { noise_rad_per_sqrt_s, bias_walk_radps_per_sqrt_s, scale, .. } => {
                let copies = vec![(1, 2)];
                let Some(before) = before.filter(|before| t_s > before.t_s) else {
                    return Reading { copies, ..Reading::default() };
                };
                let dt_s = t_s - before.t_s;
                let scaled = 1.0 + scale;
                let by_scale = pose.theta_rad - before.world_from_body.theta_rad;
                let sigma_rad = noise_rad_per_sqrt_s * dt_s.sqrt();
                let turn = Scalar { by_scale, ..scalar([0.0, 0.0, scaled], [dt_s, -scaled], sigma_rad) };
                Reading { walk: bias_walk_radps_per_sqrt_s.powi(2) * dt_s, scalars: vec![turn], copies }
            }
            Self::Tape { sigma_m } => {
                let copies = vec![(0, 0), (1, 1)];
                let Some(Before { world_from_body: from, .. }) = before else {
                    return Reading { copies, ..Reading::default() };
                };
                let distance_m = from.position().distance_m(pose.position());
                let [x, y] = [(pose.x_m - from.x_m) / distance_m, (pose.y_m - from.y_m) / distance_m];
                let scalars =
                    (distance_m > TAPE_FROM_M).then(|| scalar([x, y, 0.0], [-x, -y], sigma_m)).into_iter().collect();
                Reading { walk: 0.0, scalars, copies }
            }
            Self::Revisit { sigma_xy_m, sigma_theta_rad } => {
                let is_back = pose.x_m.hypot(pose.y_m) <= TAPE_FROM_M && pose.theta_rad.abs() >= MIN_RETURN_TURN_RAD;
                let parts = [(0, sigma_xy_m), (1, sigma_xy_m), (2, sigma_theta_rad)];
                let of_part = |(part, sigma): (usize, f64)| {
                    let mut by_pose = [0.0; 3];
                    by_pose[part] = 1.0;
                    scalar(by_pose, [0.0; 2], sigma)
                };
                let scalars = parts.into_iter().filter(|(_, sigma)| is_back && *sigma > 0.0).map(of_part).collect();
                Reading { scalars, ..Reading::default() }
            }
            Self::Wall(wall) => {
                let (sin, cos) = wall.wall_direction_rad.sin_cos();
                let is_seen = wall.is_seen(wall.distance_m(pose));
                let along_m = cos * pose.x_m + sin * pose.y_m;
                let distance = scalar([sin, -cos, 0.0], [along_m, 1.0], wall.sigma_m);
                let heading = scalar([0.0, 0.0, 1.0], [-1.0, 0.0], wall.sigma_rad);
                let is_measured = |of: &Scalar| is_seen && of.variance > 0.0;
                Reading { scalars: [distance, heading].into_iter().filter(is_measured).collect(), ..Reading::default() }
            }
        }
    }
}

/// The information about the geometry where the gyroscope's scale is known to a standard deviation, or not
/// at all.
pub(super) fn without_scale(mut matrix: Matrix4<f64>, scale_sigma: f64) -> Matrix3<f64> {
    if scale_sigma > 0.0 {
        matrix[(3, 3)] += scale_sigma.powi(-2);
    }
    let of_geometry: Matrix3<f64> = matrix.fixed_view::<3, 3>(0, 0).into_owned();
    if matrix[(3, 3)] <= 0.0 {
        return of_geometry;
    }
    let across: Vector3<f64> = matrix.fixed_view::<3, 1>(0, 3).into_owned();
    of_geometry - across * across.transpose() / matrix[(3, 3)]
}

/// What a scalar of a slope in the four parameters and a variance tells of them.
pub(super) fn information(slope: Vector4<f64>, variance: f64) -> Matrix4<f64> {
    slope * slope.transpose() / variance
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scale_that_is_not_known_takes_its_share_of_what_is_told_of_the_geometry() {
        let root = Matrix4::new(3.0, 1.0, 0.5, 2.0, 0.0, 2.0, 0.3, 1.0, 0.1, 0.0, 1.5, 0.4, 0.2, 0.1, 0.0, 1.0);
        let matrix = root.transpose() * root;
        for scale_sigma in [0.0, 0.3] {
            let mut with_prior = matrix;
            with_prior[(3, 3)] += if scale_sigma > 0.0 { f64::powi(scale_sigma, -2) } else { 0.0 };
            let covariance = with_prior.try_inverse().expect("regular").fixed_view::<3, 3>(0, 0).into_owned();
            let found = without_scale(matrix, scale_sigma).try_inverse().expect("regular");
            // The condition of the matrix, about 1e2, times the rounding of a double.
            assert!((found - covariance).abs().max() < 1e-12, "{found} {covariance}");
        }
        let mut apart = matrix;
        apart.fill_row(3, 0.0);
        apart.fill_column(3, 0.0);
        assert_eq!(without_scale(apart, 0.0), matrix.fixed_view::<3, 3>(0, 0).into_owned());
    }

    #[test]
    fn slopes_are_those_of_the_measurements() {
        let wall = scenario::Wall {
            rate_hz: 10.0,
            sigma_m: 0.01,
            sigma_rad: 0.002,
            range_m: 8.0,
            wall_distance_m: 2.0,
            wall_direction_rad: 0.4,
            lever_x_m: 0.0,
            lever_y_m: 0.0,
            lever_theta_rad: 0.0,
            still_s: 0.0,
        };
        let pose = Pose::new(0.3, -0.2, 0.7);
        let distance_m = |pose: Pose, direction_rad: f64| {
            let (sin, cos) = f64::sin_cos(direction_rad);
            2.0 + sin * pose.x_m - cos * pose.y_m
        };
        let [distance, heading] = PartialInstrument::Wall(wall).reading(0.0, pose, None).scalars[..] else {
            panic!("two scalars")
        };
        // Central differences over 1e-5: 1e-10 of the third derivative, 1e-11 of rounding.
        let h = 1e-5;
        let slope = |by: [f64; 4]| {
            let at = |sign: f64| {
                let moved = Pose::new(pose.x_m + sign * by[0], pose.y_m + sign * by[1], pose.theta_rad + sign * by[2]);
                distance_m(moved, 0.4 + sign * by[3])
            };
            (at(1.0) - at(-1.0)) / (2.0 * h)
        };
        let expected = [slope([h, 0.0, 0.0, 0.0]), slope([0.0, h, 0.0, 0.0]), slope([0.0, 0.0, h, 0.0])];
        assert!((distance.by_pose - Vector3::from(expected)).norm() < 1e-9, "{distance:?}");
        assert!((distance.by_states[0] - slope([0.0, 0.0, 0.0, h])).abs() < 1e-9, "{distance:?}");
        assert_eq!((heading.by_pose.z, heading.by_states), (1.0, [-1.0, 0.0]));
        // Beyond its range nothing is seen.
        assert!(PartialInstrument::Wall(wall).reading(0.0, Pose::new(0.0, -7.0, 0.0), None).scalars.is_empty());

        let before = Some(Before { t_s: 0.0, world_from_body: Pose::new(-0.1, 0.1, 0.0) });
        let [tape] = PartialInstrument::Tape { sigma_m: 1e-3 }.reading(1.0, pose, before).scalars[..] else {
            panic!("one scalar")
        };
        assert!((tape.by_pose - Vector3::new(0.8, -0.6, 0.0)).norm() < 1e-15, "{tape:?}");
        assert_eq!(tape.by_states, [-tape.by_pose.x, -tape.by_pose.y]);
    }
}
