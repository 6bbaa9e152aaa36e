//! `circular`: the bidirectional circular path test, circles driven both ways and their radii measured.
//!
//! Model: on a circle of signed radius R (positive counter-clockwise) the contacts go (R ± B/2)Θ, so that
//! with e = E_d = D_R/D_L and the wheels' turns φ (2R + B)/(2R − B) = e φ_R/φ_L. Both ways at one commanded
//! ratio q of the outer to the inner wheel give (2R_ccw + B)/(2R_ccw − B) = e q and (2R_cw + B)/(2R_cw − B) =
//! q/e with unsigned radii: B follows from their product, e² from their quotient ([`base_and_ratio`]).
//! Derived here: q is the run's own, from its counts, and not the command's (ρ + b/2)/(ρ − b/2); runs are cut
//! into overlapping arcs of a quarter turn or the next reading, R = chord/(2 sin Θ/2) for each; e and B are
//! the least squares of R over all arcs, which is the closed form when the arcs of a direction agree. An arc
//! within which the wheels' ratio changes is left out, so that spirals of steps serve too.
//! Assumptions: constant wheel ratio within an arc; the instrument is at the drive's centre (one that is to
//! the left makes counter-clockwise circles small and clockwise ones large, which is read as unequal wheels);
//! the mean diameter is right: D_L = 2D/(e + 1), D_R = 2D e/(e + 1).
//! Observability: e, and B in metres whatever the scale of the wheels. Blind to their common scale, which
//! changes how far round a circle goes, not its radius.
//! Reference: Abbas, Arif, Hussain 2006 (bidirectional circular path test); exact for circles of any size, no
//! small-angle form.

use dataset::{NominalRobot, Protocol, RunView, Session};
use kinematics::{DriveGeometry, Point, Wheels, unwrap_near};
use motion_programs::Schedule;
use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

use super::linear::scatter_between_runs;
use crate::conditioning::well_conditioned;
use crate::estimate::{
    CalibError, Calibration, Covariance, Method, NotObservable, Parameter, Rejected, drive, nominal,
};
use crate::settings::{CIRCULAR_MAX_STEPS, CIRCULAR_TOLERANCE, MAX_RATIO_CHANGE, MIN_ARC_RAD, MIN_ARC_SINE};
use estimation::WheelAngleInterpolator;

/// The method; it has nothing to choose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Circular;

/// An arc of constant wheel ratio.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Arc {
    /// Signed radius, metres: positive counter-clockwise.
    radius_m: f64,
    /// Turn of each wheel, radians.
    wheel_rad: Wheels<f64>,
}

impl Arc {
    /// What the radius should be, metres, with its slopes over e and B.
    fn predicted(&self, ratio: f64, separation_m: f64) -> (f64, Vector2<f64>) {
        let Wheels { left, right } = self.wheel_rad;
        let (sum, difference) = (ratio * right + left, ratio * right - left);
        let radius_m = 0.5 * separation_m * sum / difference;
        let by_ratio = -separation_m * right * left / (difference * difference);
        (radius_m, Vector2::new(by_ratio, radius_m / separation_m))
    }
}

/// Wheelbase (metres) and E_d from the mean radii of both ways (metres, unsigned) and the ratio of the outer
/// to the inner wheel's turn in each: the method's closed form. `None` when the circles are no wider than the
/// wheelbase allows.
#[must_use]
pub fn base_and_ratio(ccw: (f64, f64), cw: (f64, f64)) -> Option<(f64, f64)> {
    let ((r_ccw_m, q_ccw), (r_cw_m, q_cw)) = (ccw, cw);
    // (2R₁ + B)(2R₂ + B) = P (2R₁ − B)(2R₂ − B): the smaller root of a quadratic, in the form that does not
    // cancel.
    let product = q_ccw * q_cw;
    let (half, free) = ((r_ccw_m + r_cw_m) * (product + 1.0), product - 1.0);
    let root = (half * half - 4.0 * r_ccw_m * r_cw_m * free * free).sqrt();
    let base_m = 4.0 * r_ccw_m * r_cw_m * free / (half + root);
    let curvature = |radius_m: f64| (2.0 * radius_m + base_m) / (2.0 * radius_m - base_m);
    let ratio = (curvature(r_ccw_m) / curvature(r_cw_m) * q_cw / q_ccw).sqrt();
    (base_m > 0.0 && ratio.is_finite()).then_some((base_m, ratio))
}

impl Circular {
    /// The method as the table of contents offers it.
    pub const DEFAULT: Self = Self;

    const NAME: &'static str = "circular";
}

/// The circle's pose at an instant with what the wheels have done since the first one.
struct Reading {
    place: Point,
    /// Modulo whole turns, radians.
    theta_rad: f64,
    wheel_rad: Wheels<f64>,
    /// Heading by the nominal robot, whole turns counted, radians.
    dead_reckoned_rad: f64,
}

fn readings(run: &RunView<'_>, robot: &NominalRobot, geometry: &DriveGeometry) -> Option<Vec<Reading>> {
    let track = WheelAngleInterpolator::of(run, robot)?;
    let (mut readings, mut last_s, mut wheel_rad) = (Vec::new(), None, Wheels::both(0.0));
    for (t_s, pose) in run.observed_poses() {
        let Some(steps) = track.steps(last_s.unwrap_or(t_s), t_s) else { continue };
        last_s = Some(t_s);
        wheel_rad = steps.iter().fold(wheel_rad, |sum, step| sum.zip_with(*step, |sum, step| sum + step));
        let travel_m = wheel_rad.zip_with(geometry.m_per_rad(), |rad, m_per_rad| rad * m_per_rad);
        let dead_reckoned_rad = geometry.increment(travel_m).turn_rad;
        readings.push(Reading { place: pose.position(), theta_rad: pose.theta_rad, wheel_rad, dead_reckoned_rad });
    }
    Some(readings)
}

/// The arcs of one run; or why it has none.
fn arcs(run: &RunView<'_>, robot: &NominalRobot, geometry: &DriveGeometry) -> Result<Vec<Arc>, &'static str> {
    let readings = readings(run, robot, geometry).ok_or("the run has no odometry")?;
    let (mut arcs, mut bent, mut end) = (Vec::new(), false, 0);
    for (start, first) in readings.iter().enumerate() {
        end = end.max(start + 1);
        while readings
            .get(end)
            .is_some_and(|last| (last.dead_reckoned_rad - first.dead_reckoned_rad).abs() < MIN_ARC_RAD)
        {
            end += 1;
        }
        let Some(last) = readings.get(end) else { break };
        // Whole turns come from the odometry.
        let turn_rad = unwrap_near(last.theta_rad - first.theta_rad, last.dead_reckoned_rad - first.dead_reckoned_rad);
        let sine = (0.5 * turn_rad).sin();
        if sine.abs() < MIN_ARC_SINE {
            continue;
        }
        let turned = |a: &Reading, b: &Reading| b.wheel_rad.zip_with(a.wheel_rad, |b, a| b - a);
        let middle = &readings[usize::midpoint(start, end)];
        let (one, other) = (turned(first, middle), turned(middle, last));
        let (one, other) = (one.right * other.left, one.left * other.right);
        if (one - other).abs() > MAX_RATIO_CHANGE * one.abs().max(other.abs()) {
            bent = true;
            continue;
        }
        let wheel_rad = turned(first, last);
        let forward = (wheel_rad.left + wheel_rad.right).signum();
        arcs.push(Arc { radius_m: forward * first.place.distance_m(last.place) / (2.0 * sine), wheel_rad });
    }
    match (arcs.is_empty(), bent) {
        (false, _) => Ok(arcs),
        (true, true) => Err("its radius changes throughout: no quarter turn is an arc"),
        (true, false) => Err(
            "no two readings are 60 to 300 degrees of the circle apart: measure the pose along the circle, every half turn or sooner",
        ),
    }
}

impl Method for Circular {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn about(&self) -> &'static str {
        "circles driven in both directions and measured along the path: wheel ratio and wheelbase; the common scale is not observable"
    }

    /// Radius and numbers are ours.
    fn protocol(&self) -> Vec<Schedule> {
        vec![Schedule::Circles { radius_m: 1.0, turns: None, runs_each_way: 5 }]
    }

    fn calibrate(&self, sessions: &[Session<'_>]) -> Result<Calibration, CalibError> {
        let (robot, geometry) = nominal(Self::NAME, sessions)?;
        let (mut runs, mut runs_rejected) = (Vec::new(), Vec::new());
        for session in sessions {
            for run in &session.runs {
                if !matches!(run.info().protocol, Some(Protocol::CircleCw | Protocol::CircleCcw)) {
                    continue;
                }
                match arcs(run, session.robot, &geometry) {
                    Ok(arcs) => runs.push(arcs),
                    Err(why) => runs_rejected.push(Rejected { run: run.info().id.clone(), why: why.to_owned() }),
                }
            }
        }
        if runs.is_empty() {
            let why = runs_rejected.first().map_or_else(
                || "it needs circles in both directions (protocol = \"circle_cw\" and \"circle_ccw\") with poses measured along the path".to_owned(),
                |rejected| format!("run {}: {}", rejected.run, rejected.why),
            );
            return Err(CalibError::NotApplicable { method: Self::NAME, why });
        }
        let directions = [1.0, -1.0].map(|sign: f64| runs.iter().flatten().any(|arc| arc.radius_m * sign > 0.0));
        if directions != [true, true] {
            return Err(CalibError::Unobservable {
                method: Self::NAME,
                parameter: Parameter::WheelSeparation,
                why: "in one direction, unequal wheels and a wrong wheelbase bend a circle alike; drive the same circles in the other direction too".to_owned(),
            });
        }
        let start = Fit::start(geometry.wheel_separation_m());
        let missing =
            "its circles do not tell unequal wheels from a wrong wheelbase: drive smaller ones both ways round";
        let normal = DMatrix::from_column_slice(2, 2, start.normal(&runs).0.as_slice());
        well_conditioned(Self::NAME, Parameter::WheelSeparation, &normal, missing)?;
        let fit = start.minimised(&runs);
        let mean_m = 0.5 * (geometry.wheel_diameter_m().left + geometry.wheel_diameter_m().right);
        let Fit { ratio, separation_m, .. } = fit;
        let diameter_m = Wheels { left: 2.0 * mean_m / (ratio + 1.0), right: 2.0 * mean_m * ratio / (ratio + 1.0) };
        let covariance = fit.covariance(&runs).map(|of_fit| {
            let by_ratio = 2.0 * mean_m / ((ratio + 1.0) * (ratio + 1.0));
            let jacobian = Covariance::from_row_slice(3, 2, &[-by_ratio, 0.0, by_ratio, 0.0, 0.0, 1.0]);
            &jacobian * of_fit * jacobian.transpose()
        });
        Ok(Calibration {
            covariance,
            not_observable: vec![NotObservable {
                parameter: Parameter::CommonScale,
                why: "a factor common to both wheels changes how far round a circle goes, not its radius; \
                      the nominal mean diameter is kept, and the wheelbase is right all the same: measure a straight run of known length".into(),
            }],
            runs_used: runs.len(),
            runs_rejected,
            converged: fit.settled,
            ..Calibration::new(Self::NAME, drive(Self::NAME, diameter_m, separation_m)?, robot.ticks_per_rev)
        })
    }
}

/// Least squares of the arcs' radii over e and B.
struct Fit {
    ratio: f64,
    separation_m: f64,
    settled: bool,
}

impl Fit {
    fn start(nominal_separation_m: f64) -> Self {
        Self { ratio: 1.0, separation_m: nominal_separation_m, settled: false }
    }

    /// The minimum, from here.
    fn minimised(self, runs: &[Vec<Arc>]) -> Self {
        let mut fit = self;
        for _ in 0..CIRCULAR_MAX_STEPS {
            let (normal, right) = fit.normal(runs);
            let Some(step) = normal.try_inverse().map(|inverse| inverse * right) else { break };
            fit.ratio += step.x;
            fit.separation_m += step.y;
            if step.x.abs() < CIRCULAR_TOLERANCE && step.y.abs() < CIRCULAR_TOLERANCE * fit.separation_m.abs() {
                fit.settled = true;
                break;
            }
        }
        fit
    }

    /// The normal equations' matrix and right side.
    fn normal<'l>(&self, arcs: impl IntoIterator<Item = &'l Vec<Arc>>) -> (Matrix2<f64>, Vector2<f64>) {
        let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
        for arc in arcs.into_iter().flatten() {
            let (predicted_m, slope) = arc.predicted(self.ratio, self.separation_m);
            normal += slope * slope.transpose();
            right += slope * (arc.radius_m - predicted_m);
        }
        (normal, right)
    }

    /// Covariance of e and B from the scatter between the runs, which have one equation each for two
    /// unknowns.
    fn covariance(&self, runs: &[Vec<Arc>]) -> Option<DMatrix<f64>> {
        let dynamic = |matrix: Matrix2<f64>| DMatrix::from_column_slice(2, 2, matrix.as_slice());
        let (normal, _) = self.normal(runs);
        let scores: Vec<_> =
            runs.iter().map(|arcs| DVector::from_column_slice(self.normal([arcs]).1.as_slice())).collect();
        scatter_between_runs(&dynamic(normal), &scores, 2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arc(radius_m: f64, ratio: f64, separation_m: f64) -> Arc {
        // A quarter turn on wheels of 1/(e + 1) and e/(e + 1) metres a radian.
        let arc = |side: f64| (radius_m + side * 0.5 * separation_m) * 1.5;
        Arc { radius_m, wheel_rad: Wheels { left: arc(-1.0) * (ratio + 1.0), right: arc(1.0) * (ratio + 1.0) / ratio } }
    }

    #[test]
    fn the_closed_form_gives_the_circles_back_that_made_the_radii() {
        for (ratio, base_m, ccw_m, cw_m) in [(1.0, 0.363, 1.0, 1.0), (0.97, 0.2, 0.9, 1.1), (1.02, 0.5, 0.26, 3.0)] {
            let q = |radius_m: f64, ratio: f64| (2.0 * radius_m + base_m) / (2.0 * radius_m - base_m) / ratio;
            let (found_m, found) =
                base_and_ratio((ccw_m, q(ccw_m, ratio)), (cw_m, q(cw_m, 1.0 / ratio))).expect("circles");
            // Roundings of 1e-16, magnified by 2R/B where the bend is near 1.
            assert!((found_m - base_m).abs() < 1e-14 && (found - ratio).abs() < 1e-14, "{found_m} {found}");
            // The small-angle form, B = R (q_ccw q_cw − 1)/2 of equal radii, is off by B/2R and more.
            let small_m = 0.25 * (ccw_m + cw_m) * (q(ccw_m, ratio) * q(cw_m, 1.0 / ratio) - 1.0);
            assert!((small_m / base_m - 1.0).abs() > 0.05, "{small_m}");
        }
    }

    #[test]
    fn least_squares_is_the_closed_form_where_arcs_agree_and_takes_several_radii() {
        let (ratio, base_m) = (0.985, 0.363);
        let runs = [vec![arc(1.0, ratio, base_m); 3], vec![arc(-1.0, ratio, base_m); 2]];
        let several = [vec![arc(1.0, ratio, base_m), arc(0.5, ratio, base_m)], vec![arc(-0.7, ratio, base_m)]];
        for runs in [&runs, &several] {
            let fit = Fit::start(0.3).minimised(runs);
            assert!(fit.settled);
            assert!((fit.ratio - ratio).abs() < 1e-12 && (fit.separation_m - base_m).abs() < 1e-12);
        }
        // Backward: both turns and the sign of the path change, the radius does not.
        let backward = Arc { wheel_rad: runs[0][0].wheel_rad.map(|rad| -rad), ..runs[0][0] };
        assert_eq!(backward.predicted(ratio, base_m).0, runs[0][0].predicted(ratio, base_m).0);
    }

    #[test]
    fn slopes_are_those_of_central_differences() {
        let arc = arc(0.8, 1.01, 0.36);
        let at = |ratio: f64, base_m: f64| arc.predicted(ratio, base_m).0;
        let h = 1e-5;
        let by = [
            (at(1.01 + h, 0.36) - at(1.01 - h, 0.36)) / (2.0 * h),
            (at(1.01, 0.36 + h) - at(1.01, 0.36 - h)) / (2.0 * h),
        ];
        let (_, slope) = arc.predicted(1.01, 0.36);
        // h²/6 of a third derivative of about 6·0.8·2.8³, and rounding 1e-16/1e-5; an error of 1e-3 of the
        // slope would show.
        assert!((slope.x - by[0]).abs() < 1e-8 && (slope.y - by[1]).abs() < 1e-8, "{slope} {by:?}");
    }
}
