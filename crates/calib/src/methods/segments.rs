//! `segments`: the drive that brings dead reckoning nearest to the truth all along the path, on any path.
//!
//! Model: from a run's first pose on, dead reckoning is compared with the truth at the end of every segment
//! of a given length, and at the run's end; the error is not set back in between. Minimised is Σ |p̂ − p|² +
//! d²·(θ̂ − θ)² over segments and runs, by Levenberg–Marquardt with exact derivatives, from the nominal
//! values on. The print has positions alone: d is the segment's length, over which a heading error makes a
//! position error of d·(θ̂ − θ).
//! Assumptions: the instrument is at the drive's centre. Errors need not be independent: sigma is the scatter
//! over runs.
//! Observability: all three on paths with straights and turns that are measured along the path. Without
//! heading errors in the sum, spins do not determine the separation.
//! Reference: Sousa, Petry, Costa et al. 2022 (OptiOdom; J Intell Robot Syst 105, 39), whose program descends
//! by Rprop and stops before the minimum.

use dataset::Session;
use kinematics::{DriveGeometry, Wheels};
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt, MinimizationReport};
use motion_programs::Schedule;
use nalgebra::{DVector, Dyn, Matrix3, Matrix3xX, OMatrix, Owned, U3, Vector3};

use crate::dead_reckoning_jacobian::{DeadReckoned, GeometryParameters, unobservable};
use crate::estimate::{CalibError, Calibration, Method, drive, geometry_covariance, nominal};
use crate::pose_measurements::{PoseMeasurement, PoseMeasurements, Spacing};
use crate::settings::{HEADING_WEIGHT_M, MIN_SENSITIVITY, SEGMENT_M};

/// The method with its segments.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segments {
    /// Length of a segment by the nominal robot, metres.
    pub segment_m: f64,
    /// What a radian of heading error counts beside a metre of position error, metres.
    pub heading_m: f64,
}

/// What the method minimises.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// Σ |p̂ − p|² + d²·(θ̂ − θ)² over the ends of all segments, m².
    pub value_m2: f64,
    /// Its derivatives by left diameter, right diameter and separation, metres.
    pub gradient_m: Vector3<f64>,
}

/// Errors of all paths as a function of the three geometry parameters over their nominal values.
#[derive(Debug, Clone)]
struct PathErrors<'p> {
    paths: &'p [PoseMeasurements<'p>],
    nominal: Vector3<f64>,
    heading_m: f64,
    factors: Vector3<f64>,
}

impl PathErrors<'_> {
    fn geometry_parameters(&self) -> GeometryParameters {
        let [left, right, separation_m] = self.nominal.component_mul(&self.factors).into();
        GeometryParameters { m_per_rad: Wheels { left, right }, separation_m }
    }

    fn rows(&self) -> usize {
        3 * self.paths.iter().map(|path| path.later.len()).sum::<usize>()
    }

    /// Calls `visit` with path, error (m, m, weighted rad) and its derivatives by the factors, at the end of
    /// every segment.
    fn for_each_end(&self, mut visit: impl FnMut(usize, Vector3<f64>, Matrix3<f64>)) {
        let geometry_parameters = self.geometry_parameters();
        let weight = Vector3::new(1.0, 1.0, self.heading_m);
        for (number, path) in self.paths.iter().enumerate() {
            let mut dead_reckoned = DeadReckoned::at(path.start);
            for PoseMeasurement { wheel_rad, pose: measured } in &path.later {
                wheel_rad.iter().for_each(|rad| dead_reckoned.advance(&geometry_parameters, *rad));
                let DeadReckoned { pose, by_geometry } = dead_reckoned;
                let error =
                    Vector3::new(pose.x_m - measured.x_m, pose.y_m - measured.y_m, pose.theta_rad - measured.theta_rad);
                let by_factors = by_geometry * Matrix3::from_diagonal(&self.nominal);
                visit(number, error.component_mul(&weight), Matrix3::from_diagonal(&weight) * by_factors);
            }
        }
    }
}

impl LeastSquaresProblem<f64, Dyn, U3> for PathErrors<'_> {
    type ParameterStorage = Owned<f64, U3>;
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, U3>;

    fn set_params(&mut self, factors: &Vector3<f64>) {
        self.factors = *factors;
    }

    fn params(&self) -> Vector3<f64> {
        self.factors
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let mut residuals = Vec::with_capacity(self.rows());
        self.for_each_end(|_, error, _| residuals.extend_from_slice(error.as_slice()));
        Some(DVector::from_vec(residuals))
    }

    fn jacobian(&self) -> Option<OMatrix<f64, Dyn, U3>> {
        let mut transposed = Vec::with_capacity(3 * self.rows());
        self.for_each_end(|_, _, by_factors| transposed.extend_from_slice(by_factors.transpose().as_slice()));
        Some(Matrix3xX::from_vec(transposed).transpose())
    }
}

/// Normal matrix and gradient of one run over the factors.
#[derive(Debug, Clone, Copy)]
struct Share {
    normal: Matrix3<f64>,
    gradient: Vector3<f64>,
}

impl PathErrors<'_> {
    fn shares(&self) -> Vec<Share> {
        let mut shares = vec![Share { normal: Matrix3::zeros(), gradient: Vector3::zeros() }; self.paths.len()];
        self.for_each_end(|path, error, by_factors| {
            shares[path].normal += by_factors.transpose() * by_factors;
            shares[path].gradient += by_factors.transpose() * error;
        });
        shares
    }
}

impl Segments {
    /// The method as the table of contents offers it: the segments of the authors' program, and headings for
    /// their effect over one.
    pub const DEFAULT: Self = Self { segment_m: SEGMENT_M, heading_m: HEADING_WEIGHT_M };

    const NAME: &'static str = "segments";

    const fn spacing(&self) -> Spacing {
        Spacing { every_m: self.segment_m, every_rad: f64::INFINITY }
    }

    /// What the method minimises, for a drive of the caller's: segments are still those of the nominal robot.
    ///
    /// # Errors
    /// [`CalibError`] when no run has two poses.
    pub fn cost(&self, sessions: &[Session<'_>], geometry: &DriveGeometry) -> Result<Cost, CalibError> {
        let (paths, _) = PoseMeasurements::of_all(Self::NAME, sessions, self.spacing())?;
        let radius_m = geometry.m_per_rad();
        let geometry_m = Vector3::new(radius_m.left, radius_m.right, geometry.wheel_separation_m());
        let errors =
            PathErrors { paths: &paths, nominal: geometry_m, heading_m: self.heading_m, factors: Vector3::repeat(1.0) };
        let mut cost = Cost { value_m2: 0.0, gradient_m: Vector3::zeros() };
        errors.for_each_end(|_, error, by_factors| {
            cost.value_m2 += error.norm_squared();
            cost.gradient_m += 2.0 * by_factors.transpose() * error;
        });
        // A factor of a radius is one of its diameter.
        cost.gradient_m.component_div_assign(&geometry_m.component_mul(&Vector3::new(2.0, 2.0, 1.0)));
        Ok(cost)
    }
}

/// Refuses paths on which some change of the geometry parameters moves next to nothing.
fn observable(normal: &Matrix3<f64>) -> Result<(), CalibError> {
    let eigen = normal.symmetric_eigen();
    let weak = eigen.eigenvalues.imin();
    let sensitivity = (eigen.eigenvalues[weak].max(0.0) / eigen.eigenvalues.max()).sqrt();
    if sensitivity >= MIN_SENSITIVITY {
        return Ok(());
    }
    let (parameter, missing) = unobservable(&eigen.eigenvectors.column(weak).into_owned());
    // Runs in which nothing moves leave no sensitivity at all.
    let found = if sensitivity.is_finite() { format!("{sensitivity:.0e}") } else { "none".to_owned() };
    let why = format!("{missing} (relative sensitivity {found}, at least {MIN_SENSITIVITY:.0e})");
    Err(CalibError::Unobservable { method: Segments::NAME, parameter, why })
}

/// Covariance of the factors by leaving out one run at a time: the sandwich A⁻¹(Σ g gᵀ)A⁻¹ with each run's
/// leverage taken into account. `None` for a single run, and where the others do not determine the factors
/// without one.
fn covariance(shares: &[Share], normal: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let runs = shares.len() as f64;
    let without: Vec<Vector3<f64>> = shares
        .iter()
        .map(|share| {
            let others = normal - share.normal;
            observable(&others).ok()?;
            Some(others.try_inverse()? * share.gradient)
        })
        .collect::<Option<_>>()?;
    if without.len() < 2 {
        return None;
    }
    let mean = without.iter().sum::<Vector3<f64>>() / runs;
    Some(
        without.iter().map(|moved| (moved - mean) * (moved - mean).transpose()).sum::<Matrix3<f64>>()
            * ((runs - 1.0) / runs),
    )
}

impl Method for Segments {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn about(&self) -> &'static str {
        "any path with straights and turns, measured as poses: least errors of dead reckoning at the ends of its segments"
    }

    /// The authors drove what was at hand. Straights, spins and squares show all three geometry parameters by
    /// their ends alone.
    fn protocol(&self) -> Vec<Schedule> {
        vec![
            Schedule::Straights { length_m: 0.5, runs: 40 },
            Schedule::Spins { turn_rad: std::f64::consts::TAU, runs: 20 },
            Schedule::Squares { side_m: 1.0, runs_each_way: 5 },
        ]
    }

    fn calibrate(&self, sessions: &[Session<'_>]) -> Result<Calibration, CalibError> {
        let (robot, geometry) = nominal(Self::NAME, sessions)?;
        let (paths, runs_rejected) = PoseMeasurements::of_all(Self::NAME, sessions, self.spacing())?;
        let radius_m = geometry.m_per_rad();
        let nominal = Vector3::new(radius_m.left, radius_m.right, geometry.wheel_separation_m());
        let errors = PathErrors { paths: &paths, nominal, heading_m: self.heading_m, factors: Vector3::repeat(1.0) };
        let normal_of = |errors: &PathErrors<'_>| errors.shares().iter().map(|share| share.normal).sum();
        observable(&normal_of(&errors))?;
        let (errors, MinimizationReport { termination, .. }) = LevenbergMarquardt::new().minimize(errors);
        let shares = errors.shares();
        let normal: Matrix3<f64> = shares.iter().map(|share| share.normal).sum();
        observable(&normal)?;

        let geometry_m = nominal.component_mul(&Vector3::new(2.0, 2.0, 1.0)).into();
        let covariance = covariance(&shares, &normal)
            .map(|covariance| geometry_covariance(|row, column| covariance[(row, column)], geometry_m));
        let GeometryParameters { m_per_rad, separation_m } = errors.geometry_parameters();
        let geometry = drive(Self::NAME, m_per_rad.map(|m_per_rad| 2.0 * m_per_rad), separation_m)?;
        Ok(Calibration {
            covariance,
            runs_used: paths.len(),
            runs_rejected,
            converged: termination.was_successful(),
            ..Calibration::new(Self::NAME, geometry, robot.ticks_per_rev)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::Parameter;
    use kinematics::Pose;

    const NOMINAL: [f64; 3] = [0.08, 0.08, 0.363];
    const TRUTH: [f64; 3] = [0.0811, 0.0797, 0.366];

    /// Runs of a robot with the geometry parameters of [`TRUTH`], of straights and turns, measured to within
    /// `error`.
    fn runs(count: u32, turn_rad: f64, straight_rad: f64, error: f64) -> Vec<PoseMeasurements<'static>> {
        let geometry_parameters =
            GeometryParameters { m_per_rad: Wheels { left: TRUTH[0], right: TRUTH[1] }, separation_m: TRUTH[2] };
        (0..count)
            .map(|run| {
                let start = Pose::new(0.1, 0.2, f64::from(run));
                let mut dead_reckoned = DeadReckoned::at(start);
                let later = (0..6_u32)
                    .map(|interval| {
                        let turn_rad_of_run = if run % 2 == 0 { turn_rad } else { -turn_rad };
                        let wheel_rad = if interval % 2 == 0 {
                            vec![Wheels::both(straight_rad); 3]
                        } else {
                            vec![Wheels { left: -turn_rad_of_run, right: turn_rad_of_run }; 2]
                        };
                        wheel_rad.iter().for_each(|rad| dead_reckoned.advance(&geometry_parameters, *rad));
                        // No pattern that the geometry parameters could follow, and the same every time.
                        let off = |k: f64| error * (12.9898 * f64::from(7 * run + interval) + 78.233 * k).sin();
                        let Pose { x_m, y_m, theta_rad } = dead_reckoned.pose;
                        PoseMeasurement {
                            wheel_rad,
                            pose: Pose::new(x_m + off(1.0), y_m + off(2.0), theta_rad + off(3.0)),
                        }
                    })
                    .collect();
                PoseMeasurements { run: "run", start, later }
            })
            .collect()
    }

    fn errors<'p>(paths: &'p [PoseMeasurements<'p>]) -> PathErrors<'p> {
        PathErrors { paths, nominal: NOMINAL.into(), heading_m: 0.5, factors: Vector3::repeat(1.0) }
    }

    /// By the true robot only headings err, by 0.1 rad; of a weight of 0.25 m they count as 25 mm.
    #[test]
    fn a_heading_counts_by_its_weight() {
        let mut paths = runs(2, 2.0, 5.0, 0.0);
        paths.iter_mut().flat_map(|path| &mut path.later).for_each(|of| of.pose.theta_rad += 0.1);
        let errors = PathErrors { nominal: TRUTH.into(), heading_m: 0.25, ..errors(&paths) };
        let mut ends = 0;
        errors.for_each_end(|_, error, _| {
            ends += 1;
            assert!((error - Vector3::new(0.0, 0.0, -0.025)).norm() < 1e-12, "{error}");
        });
        assert_eq!(ends, 12);
    }

    fn found(paths: &[PoseMeasurements<'_>]) -> Vector3<f64> {
        let (errors, report) = LevenbergMarquardt::new().minimize(errors(paths));
        assert!(report.termination.was_successful(), "{report:?}");
        errors.factors
    }

    #[test]
    fn the_jacobian_is_the_derivative_and_would_not_pass_wrong() {
        let paths = runs(2, 2.0, 3.0, 1e-3);
        let h = 1e-6;
        let jacobian = errors(&paths).jacobian().expect("always");
        for column in 0..3 {
            let moved = |by: f64| {
                let mut errors = errors(&paths);
                errors.factors[column] += by;
                errors.residuals().expect("always")
            };
            let difference = (moved(h) - moved(-h)) / (2.0 * h);
            // 2 m and 3 rad: third derivatives by factors under 50 m, truncation 1e-11; rounding 1e-15/1e-6.
            let tolerance = 1e-8;
            assert!((jacobian.column(column) - &difference).amax() < tolerance);
            assert!((jacobian.column(column).add_scalar(1e-3) - &difference).abs().min() > tolerance);
        }
    }

    #[test]
    fn without_errors_the_geometry_comes_back() {
        let factors = found(&runs(4, 2.0, 3.0, 0.0));
        let truth = Vector3::from(TRUTH).component_div(&Vector3::from(NOMINAL));
        // Residuals of a few roundings of a metre, on derivatives of a metre and more.
        assert!((factors - truth).amax() < 1e-12, "{factors}");
        // The wheels for each other would not pass.
        assert!((factors.xy() - truth.yx()).amax() > 1e-2);
    }

    #[test]
    fn the_covariance_is_that_of_leaving_out_one_run_at_a_time() {
        let paths = runs(6, 2.0, 3.0, 2e-3);
        let (errors, _) = LevenbergMarquardt::new().minimize(errors(&paths));
        let shares = errors.shares();
        let normal: Matrix3<f64> = shares.iter().map(|share| share.normal).sum();
        let one_step = covariance(&shares, &normal).expect("six runs");
        let without: Vec<Vector3<f64>> = (0..paths.len())
            .map(|left_out| {
                let mut others = paths.clone();
                others.remove(left_out);
                found(&others)
            })
            .collect();
        let mean = without.iter().sum::<Vector3<f64>>() / 6.0;
        let refitted: Matrix3<f64> =
            without.iter().map(|factors| (factors - mean) * (factors - mean).transpose()).sum::<Matrix3<f64>>()
                * (5.0 / 6.0);
        // One step instead of a whole descent: errors of 2e-3 on paths of metres leave per mille of the
        // second order.
        let off = (one_step - refitted).norm() / refitted.norm();
        assert!(off < 0.01, "{off}");
        // The sandwich that forgets each run's leverage would not pass.
        let inverse = normal.try_inverse().expect("regular");
        let plain = shares.iter().map(|share| share.gradient * share.gradient.transpose()).sum::<Matrix3<f64>>();
        assert!((inverse * plain * inverse - refitted).norm() / refitted.norm() > 0.1);
        assert!(covariance(&shares[..1], &shares[0].normal).is_none(), "one run shows no scatter");
        assert!(covariance(&shares[..2], &(shares[0].normal + shares[1].normal)).is_some(), "two runs show one");
    }

    #[test]
    fn paths_that_do_not_show_a_length_are_refused_by_its_name() {
        let refused = |paths: &[PoseMeasurements<'_>]| {
            let normal = errors(paths).shares().iter().map(|share| share.normal).sum();
            match observable(&normal) {
                Err(CalibError::Unobservable { parameter, .. }) => Some(parameter),
                _ => None,
            }
        };
        assert_eq!(refused(&runs(2, 0.0, 3.0, 0.0)), Some(Parameter::WheelSeparation));
        assert_eq!(refused(&runs(2, 2.0, 0.0, 0.0)), Some(Parameter::CommonScale));
        assert_eq!(refused(&runs(2, 2.0, 3.0, 0.0)), None);
    }
}
