//! The formulas of `direct` and its result, for one trial and for trials side by side.

use dataset::{MarkedPoint, NominalRobot};
use kinematics::{DriveGeometry, Elementary, Point, Wheels};

use crate::estimate::{CalibError, Calibration, Covariance, Rejected, drive};
use crate::robust::{MedianMad, Summary};
use crate::settings::MAX_MARK_OFFSET_M;

/// The method's name.
pub(super) const NAME: &str = "direct";

/// What spins give, in messages.
pub(super) const WHEELBASE: &str = "wheelbase";

pub(super) fn not_applicable(why: String) -> CalibError {
    CalibError::NotApplicable { method: NAME, why }
}

/// The two marks of a run at its start and its end, in the room.
pub(super) struct Marks {
    pub(super) start: Wheels<Point>,
    pub(super) end: Wheels<Point>,
    /// Distance of each mark outside its wheel's contact, metres (m2 left, m1 right).
    pub(super) outside_m: Wheels<f64>,
}

impl Marks {
    /// Turn between start and end, the multiple of whole turns nearest to `about_rad` (paper, eq. 8 and 14).
    #[inline(always)]
    fn turn_rad(&self, elementary: &impl Elementary, about_rad: f64) -> f64 {
        let Self { start, end, .. } = self;
        let (x0, y0) = (start.left.x_m - start.right.x_m, start.left.y_m - start.right.y_m);
        let (x1, y1) = (end.left.x_m - end.right.x_m, end.left.y_m - end.right.y_m);
        elementary.unwrap_near(elementary.atan2(x0 * y1 - y0 * x1, x0 * x1 + y0 * y1), about_rad)
    }

    /// Metres per radian of each wheel on a straight run: (6) and (9), signed with the direction of travel,
    /// as backward runs have negative chords and negative counts.
    #[inline(always)]
    pub(super) fn m_per_rad(&self, elementary: &impl Elementary, wheel_rad: Wheels<f64>) -> Wheels<f64> {
        let Self { start, end, outside_m } = self;
        let turn_rad = self.turn_rad(elementary, 0.0);
        let chord_over_arc = elementary.sinc(0.5 * turn_rad);
        let left_m = start.left.distance_m(end.left) * wheel_rad.left.signum();
        let right_m = start.right.distance_m(end.right) * wheel_rad.right.signum();
        Wheels {
            left: (left_m / chord_over_arc + outside_m.left * turn_rad) / wheel_rad.left,
            right: (right_m / chord_over_arc - outside_m.right * turn_rad) / wheel_rad.right,
        }
    }

    /// The wheelbase by a spin with its slopes by each wheel's metres per radian, and the robot's turn:
    /// (14), whole turns by the counts and the sensitivities already found.
    #[inline(always)]
    pub(super) fn spin(
        &self,
        elementary: &impl Elementary,
        geometry: &DriveGeometry,
        wheel_rad: Wheels<f64>,
        m_per_rad: Wheels<f64>,
    ) -> Spin {
        let travel_m = Wheels { left: wheel_rad.left * m_per_rad.left, right: wheel_rad.right * m_per_rad.right };
        let turn_rad = self.turn_rad(elementary, geometry.increment(travel_m).turn_rad);
        Spin {
            turn_rad,
            wheel_separation_m: (travel_m.right - travel_m.left) / turn_rad,
            slope: Wheels { left: -wheel_rad.left / turn_rad, right: wheel_rad.right / turn_rad },
        }
    }
}

impl Marks {
    /// Standard deviation of the wheelbase by a spin, which moves by `by_turn_m` a radian of the robot's
    /// turn: two marks across the axle, read at both ends, give the turn to 2σ/w.
    #[inline(always)]
    pub(super) fn stated_sigma_m(&self, by_turn_m: f64, mark_sigma_m: f64) -> f64 {
        by_turn_m.abs() * 2.0 * mark_sigma_m / self.start.left.distance_m(self.start.right)
    }
}

/// What a spin gives.
pub(super) struct Spin {
    pub(super) turn_rad: f64,
    pub(super) wheel_separation_m: f64,
    pub(super) slope: Wheels<f64>,
}

/// Distance of each mark outside its wheel's contact, metres.
pub(super) fn outside_m(body: Wheels<Point>, half_m: f64) -> Wheels<f64> {
    Wheels { left: body.left.y_m - half_m, right: -body.right.y_m - half_m }
}

/// The outermost marked points, left and right: which, and where they are on the robot.
pub(super) fn outermost(points: &[MarkedPoint]) -> Option<Wheels<(usize, Point)>> {
    let points = || points.iter().map(|point| point.body).enumerate();
    let by_y = |a: &(usize, Point), b: &(usize, Point)| a.1.y_m.total_cmp(&b.1.y_m);
    let ends = points().max_by(by_y).zip(points().min_by(by_y));
    ends.map(|(left, right)| Wheels { left, right })
}

/// Refuses marks that (6) does not hold for.
pub(super) fn check_marks(body: Wheels<Point>) -> Result<(), CalibError> {
    if body.left.y_m <= 0.0 || body.right.y_m >= 0.0 {
        return Err(not_applicable("it needs one marked point on each side of the robot".to_owned()));
    }
    if body.left.x_m.abs().max(body.right.x_m.abs()) > MAX_MARK_OFFSET_M {
        return Err(not_applicable("its marked points must stand on the axle's line (x_m = 0)".to_owned()));
    }
    Ok(())
}

/// An outlier among the values of a quantity.
pub(super) fn outlier(outliers: &MedianMad, run: &str, of: &str) -> Rejected {
    let why = format!("{of}: more than {} robust standard deviations from the median", outliers.cut);
    Rejected { run: run.to_owned(), why }
}

/// A calibration by the means of each wheel's metres per radian and of the wheelbase, whose mean moves by
/// `slope` with them.
pub(super) fn calibration(
    robot: &NominalRobot,
    m_per_rad: Wheels<Summary>,
    base: Summary,
    slope: Wheels<f64>,
) -> Result<Calibration, CalibError> {
    let Wheels { left, right } = m_per_rad;
    let covariance = covariance(left.mean_variance(), right.mean_variance(), base.mean_variance(), slope);
    let geometry = drive(NAME, m_per_rad.map(|m_per_rad| 2.0 * m_per_rad.mean), base.mean)?;
    Ok(Calibration { covariance, ..Calibration::new(NAME, geometry, robot.ticks_per_rev) })
}

/// Covariance of both diameters and the base: the base inherits the radii's errors through `slope` and has
/// its own scatter.
fn covariance(left: Option<f64>, right: Option<f64>, base: Option<f64>, slope: Wheels<f64>) -> Option<Covariance> {
    let (left, right, base) = (left?, right?, base?);
    let base_var = base + slope.left * slope.left * left + slope.right * slope.right * right;
    Some(Covariance::from_row_slice(
        3,
        3,
        &[
            4.0 * left,
            0.0,
            2.0 * slope.left * left,
            0.0,
            4.0 * right,
            2.0 * slope.right * right,
            2.0 * slope.left * left,
            2.0 * slope.right * right,
            base_var,
        ],
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use kinematics::{Branching, Increment, Pose, Side, sinc};

    fn marks_after(increment: Increment, outside_m: Wheels<f64>) -> Marks {
        let half_m = 0.5 * 0.363;
        let start_pose = Pose::new(0.3, -0.2, 0.8);
        let body = Wheels {
            left: Point::new(0.0, half_m + outside_m.left),
            right: Point::new(0.0, -half_m - outside_m.right),
        };
        let end_pose = start_pose * increment.arc();
        Marks { start: body.map(|p| start_pose * p), end: body.map(|p| end_pose * p), outside_m }
    }

    #[test]
    fn paper_eq_6_the_arc_of_a_wheel_follows_from_the_chord_of_its_mark_forward_and_backward() {
        let outside_m = Wheels { left: 0.05, right: 0.07 };
        for distance_m in [0.5, -0.5] {
            for turn_rad in [0.0, 0.02, -0.02] {
                let increment = Increment { distance_m, turn_rad };
                let marks = marks_after(increment, outside_m);
                let measured_rad = marks.turn_rad(&Branching, 0.0);
                assert!((measured_rad - turn_rad).abs() < 1e-14);
                let arc_m =
                    Wheels { left: distance_m - 0.5 * 0.363 * turn_rad, right: distance_m + 0.5 * 0.363 * turn_rad };
                for side in Side::BOTH {
                    let chord_m = marks.start[side].distance_m(marks.end[side]) * distance_m.signum();
                    let outward = if side == Side::Left { 1.0 } else { -1.0 };
                    let found_m = chord_m / sinc(0.5 * measured_rad) + outward * outside_m[side] * measured_rad;
                    assert!((found_m - arc_m[side]).abs() < 1e-14, "{side:?} {distance_m} {turn_rad}");
                }
            }
        }
    }

    #[test]
    fn paper_eq_6_unsigned_is_off_backward() {
        // With chords unsigned a backward run takes the mark's offset the wrong way: 2·m·Δθ of 500 mm; ±0.03
        // % at m = 50 mm means Δθ = 1.5 mrad, the turn that the paper's wheels (1.0334 and 1.0322) make over
        // 500 pulses: 0.6/363 = 1.65 mrad.
        let marks = marks_after(Increment { distance_m: -0.5, turn_rad: 1.65e-3 }, Wheels::both(0.05));
        let arc_m: f64 = -0.5 - 0.5 * 0.363 * 1.65e-3;
        let chord_m = marks.start.left.distance_m(marks.end.left);
        let unsigned_m = chord_m / sinc(0.5 * 1.65e-3) + 0.05 * 1.65e-3;
        let error = unsigned_m / arc_m.abs() - 1.0;
        assert!((error.abs() - 3.3e-4).abs() < 1e-5, "{error}");
    }

    /// Of radii with variances l and r and a base that moves by a and b with them: 4l, 4r, 2al, 2br, and the
    /// base's own variance with a²l + b²r.
    #[test]
    fn the_base_inherits_the_errors_of_both_radii() {
        let found = covariance(Some(1.0), Some(4.0), Some(10.0), Wheels { left: -2.0, right: 3.0 });
        let expected = [[4.0, 0.0, -4.0], [0.0, 16.0, 24.0], [-4.0, 24.0, 50.0]];
        assert_eq!(found, Some(Covariance::from_fn(3, 3, |row, column| expected[row][column])));
        assert_eq!(covariance(Some(1.0), None, Some(10.0), Wheels::both(1.0)), None);
    }

    #[test]
    fn paper_eq_8_and_14_do_not_fold_and_hold_both_ways_round() {
        for turn_rad in [2.0, -2.0, 6.49, -6.49, 12.6] {
            let marks = marks_after(Increment { distance_m: 0.001, turn_rad }, Wheels::both(0.05));
            assert!((marks.turn_rad(&Branching, turn_rad * 0.97) - turn_rad).abs() < 1e-13, "{turn_rad}");
        }
    }
}
