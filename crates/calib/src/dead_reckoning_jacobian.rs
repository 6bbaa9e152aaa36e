//! Dead reckoning with its derivatives by the three geometry parameters of the drive, for methods that
//! descend on a path's error.
//!
//! Steps are exact arcs (kinematics, `Rule::ExactArc`): position `p += ΔS·sinc(Δθ/2)·u(θ + Δθ/2)`, heading `θ
//! += Δθ`, with `ΔS = (r_R φ_R + r_L φ_L)/2` and `Δθ = (r_R φ_R − r_L φ_L)/B` (paper, eq. 1 to 3) for wheel
//! turns φ. The derivatives are carried along step by step, so that they are exact too.

use kinematics::{Increment, Pose, Wheels, sinc, sinc_derivative};
use nalgebra::{Matrix3, RowVector3, Vector2, Vector3};

use crate::estimate::Parameter;
use crate::settings::MIN_COMMON_SCALE_COMPONENT;

/// The three geometry parameters of the drive by which wheel turns make a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct GeometryParameters {
    /// Travel of each wheel for a radian, metres: its radius.
    pub(crate) m_per_rad: Wheels<f64>,
    /// Distance between the wheel contacts, metres.
    pub(crate) separation_m: f64,
}

/// One step's motion and its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Step {
    /// Displacement in the frame in which the heading before the step was given, and turn.
    pub(crate) moved: Pose,
    /// ∂(displacement, turn)/∂(left radius, right radius, separation) of this step alone.
    pub(crate) by_geometry: Matrix3<f64>,
}

impl GeometryParameters {
    /// The motion of wheel turns from a heading.
    pub(crate) fn step(&self, theta_rad: f64, wheel_rad: Wheels<f64>) -> Step {
        let travel_m = self.m_per_rad.zip_with(wheel_rad, |m_per_rad, rad| m_per_rad * rad);
        let Increment { distance_m, turn_rad } = Increment::from_travel(travel_m, self.separation_m);
        let half_rad = 0.5 * turn_rad;
        let (sin, cos) = (theta_rad + half_rad).sin_cos();
        let (along, across) = (Vector2::new(cos, sin), Vector2::new(-sin, cos));
        let chord = sinc(half_rad);
        let moved = distance_m * chord * along;
        let by_turn = 0.5 * distance_m * (sinc_derivative(half_rad) * along + chord * across);
        let by_distance = RowVector3::new(0.5 * wheel_rad.left, 0.5 * wheel_rad.right, 0.0);
        let turn_by = RowVector3::new(-wheel_rad.left, wheel_rad.right, -turn_rad) / self.separation_m;
        let mut by_geometry = Matrix3::zeros();
        by_geometry.fixed_rows_mut::<2>(0).copy_from(&(chord * along * by_distance + by_turn * turn_by));
        by_geometry.set_row(2, &turn_by);
        Step { moved: Pose::new(moved.x, moved.y, turn_rad), by_geometry }
    }
}

/// A pose that is dead reckoned, and its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DeadReckoned {
    /// Where the robot is.
    pub(crate) pose: Pose,
    /// ∂(x, y, θ)/∂(left radius, right radius, separation).
    pub(crate) by_geometry: Matrix3<f64>,
}

impl DeadReckoned {
    /// At a pose that does not depend on the geometry parameters.
    pub(crate) fn at(pose: Pose) -> Self {
        Self { pose, by_geometry: Matrix3::zeros() }
    }

    /// Takes one step of the wheels, radians.
    pub(crate) fn advance(&mut self, geometry_parameters: &GeometryParameters, wheel_rad: Wheels<f64>) {
        let Step { moved, by_geometry } = geometry_parameters.step(self.pose.theta_rad, wheel_rad);
        // A heading error turns the step: the displacement's quarter turn.
        let heading = self.by_geometry.row(2).into_owned();
        let mut turned = Matrix3::zeros();
        turned.set_row(0, &(-moved.y_m * heading));
        turned.set_row(1, &(moved.x_m * heading));
        self.by_geometry += by_geometry + turned;
        self.pose =
            Pose::new(self.pose.x_m + moved.x_m, self.pose.y_m + moved.y_m, self.pose.theta_rad + moved.theta_rad);
    }
}

/// Why the scale common to all lengths is open.
pub(crate) const ON_THE_SPOT: &str =
    "the runs only turn on the spot, or close: add straight runs, or measurements along the path";
/// Why a wheel is open.
pub(crate) const WHEEL_HARDLY_TURNS: &str = "that wheel hardly turns: add straight runs, and turns to both sides";
/// Why the separation is open.
pub(crate) const HARDLY_TURN: &str = "the runs hardly turn: add spins, arcs or squares";

/// The parameter that a direction in relative left wheel, right wheel and separation stands for, and what to
/// drive where it is not observable.
pub(crate) fn unobservable(direction: &Vector3<f64>) -> (Parameter, &'static str) {
    let sizes = direction.normalize().abs();
    // All three grow together: every turn stays, every length grows.
    if sizes.min() > MIN_COMMON_SCALE_COMPONENT {
        (Parameter::CommonScale, ON_THE_SPOT)
    } else {
        match sizes.imax() {
            0 => (Parameter::LeftWheelDiameter, WHEEL_HARDLY_TURNS),
            1 => (Parameter::RightWheelDiameter, WHEEL_HARDLY_TURNS),
            _ => (Parameter::WheelSeparation, HARDLY_TURN),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kinematics::DriveGeometry;

    const GEOMETRY: GeometryParameters =
        GeometryParameters { m_per_rad: Wheels { left: 0.0811, right: 0.0797 }, separation_m: 0.363 };

    /// Straights, arcs, spins and standing, forward and backward; 20 rad of turn of a wheel and 2 m in all.
    const PATH: [(f64, f64); 8] =
        [(3.0, 3.0), (0.0, 0.0), (-2.0, 2.5), (4.0, 3.0), (-3.0, -1.0), (1e-7, 0.0), (5.0, 5.01), (-1.0, 3.0)];

    fn dead_reckon(geometry_parameters: &GeometryParameters, steps: &[(f64, f64)]) -> DeadReckoned {
        let mut dead_reckoned = DeadReckoned::at(Pose::new(0.3, -0.2, 0.7));
        for &(left, right) in steps {
            dead_reckoned.advance(geometry_parameters, Wheels { left, right });
        }
        dead_reckoned
    }

    #[test]
    fn the_jacobian_is_the_derivative_and_would_not_pass_wrong() {
        let h = 1e-6;
        for end in 1..=PATH.len() {
            let dead_reckoned = dead_reckon(&GEOMETRY, &PATH[..end]);
            for column in 0..3 {
                let moved = |by: f64| {
                    let mut geometry_parameters = GEOMETRY;
                    *[
                        &mut geometry_parameters.m_per_rad.left,
                        &mut geometry_parameters.m_per_rad.right,
                        &mut geometry_parameters.separation_m,
                    ][column] += by;
                    let Pose { x_m, y_m, theta_rad } = dead_reckon(&geometry_parameters, &PATH[..end]).pose;
                    [x_m, y_m, theta_rad]
                };
                let (plus, minus) = (moved(h), moved(-h));
                for row in 0..3 {
                    let difference = (plus[row] - minus[row]) / (2.0 * h);
                    // Third derivatives stay under 2 m·(20/0.363)³ ≈ 3e5: truncation h²/6 of it 6e-8.
                    // Rounding 1e-15/1e-6 = 1e-9.
                    let tolerance = 1e-7;
                    let found = dead_reckoned.by_geometry[(row, column)];
                    assert!((found - difference).abs() < tolerance, "{end} {row} {column}: {found} {difference}");
                    assert!((found + 1e-3 - difference).abs() > tolerance);
                }
            }
        }
    }

    #[test]
    fn poses_are_those_of_exact_arcs() {
        let diameter_m = GEOMETRY.m_per_rad.map(|radius_m| 2.0 * radius_m);
        let geometry = DriveGeometry::new(diameter_m, GEOMETRY.separation_m).expect("valid");
        let product = PATH.iter().fold(Pose::new(0.3, -0.2, 0.7), |pose, &(left, right)| {
            pose * geometry.increment(Wheels { left: 0.0811 * left, right: 0.0797 * right }).arc()
        });
        let dead_reckoned = dead_reckon(&GEOMETRY, &PATH).pose;
        // Eight steps of half a metre at most: a few roundings each.
        assert!(dead_reckoned.position().distance_m(product.position()) < 1e-14);
        assert!((dead_reckoned.theta_rad - product.theta_rad).abs() < 1e-14);
    }
}
