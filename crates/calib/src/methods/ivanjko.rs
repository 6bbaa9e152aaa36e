//! `ivanjko`: gains of the wheels from where straight runs end, the wheelbase from how far spins turn.
//!
//! Model: dead reckoning of the run's own log (exact arcs) under r_L, r_R, B. Step 1: r_L and r_R minimise Σ
//! |end measured − end dead reckoned|² over the straight runs, in the frame of the start. Step 2: with them u
//! = r_R φ_R − r_L φ_L is B θ of a spin by θ; per direction B = Σ u²/Σ u θ, the least squares of the heading
//! over the gain, and the result is the mean of the directions. The steps alternate until nothing changes (B
//! bends the straight runs a little).
//! Assumptions: the heading at the start is right: a wrong one moves a straight end sideways as unequal
//! wheels do. Wheels that roll.
//! Observability: all three parameters; needs straights and spins. Ends alone are used, of poses or of marks
//! read at standstills.
//! Derived here: Gauss–Newton in place of a general minimiser (with two numbers a run for two gains it ends
//! in the same minimum), and the covariance, from the scatter of the ends and of the spins' wheelbases, with
//! the slopes of each step over the other's result.
//! Reference: Ivanjko, Komšić, Petrović 2007, the variant of three parameters; the one of two, which leaves
//! out a wheel, is not offered.

use dataset::{NominalRobot, Protocol, RunView, Session};
use kinematics::{DriveGeometry, Pose, Wheels, unwrap_near};
use motion_programs::Schedule;
use nalgebra::{DMatrix, DVector, Matrix2, Matrix3, Vector2};

use super::linear::scatter_between_runs;
use crate::conditioning::well_conditioned;
use crate::dead_reckoning_jacobian::{DeadReckoned, GeometryParameters};
use crate::estimate::{CalibError, Calibration, Covariance, Method, Parameter, drive, nominal};
use crate::pose_measurements::{PoseMeasurement, PoseMeasurements, Spacing};
use crate::robust::Summary;
use crate::settings::{IVANJKO_MAX_ROUNDS, IVANJKO_TOLERANCE, MIN_SPIN_RAD};
use estimation::WheelAngleInterpolator;

/// The method; it has nothing to choose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ivanjko;

impl Ivanjko {
    /// The method as the table of contents offers it.
    pub const DEFAULT: Self = Self;

    const NAME: &'static str = "ivanjko";

    fn not_applicable(why: &str) -> CalibError {
        CalibError::NotApplicable { method: Self::NAME, why: why.to_owned() }
    }
}

/// A straight run with its measured end.
struct Straight {
    /// How the wheels turned, row by row, radians.
    steps_rad: Vec<Wheels<f64>>,
    /// In the frame of the start, metres.
    measured_m: Vector2<f64>,
}

impl Straight {
    /// Measured minus dead-reckoned end, metres, and the slopes of the latter over r_L and r_R and over B.
    fn missing(&self, at: &GeometryParameters) -> (Vector2<f64>, Matrix2<f64>, Vector2<f64>) {
        let mut end = DeadReckoned::at(Pose::IDENTITY);
        for step in &self.steps_rad {
            end.advance(at, *step);
        }
        let slopes = end.by_geometry.fixed_rows::<2>(0);
        let missing_m = self.measured_m - Vector2::new(end.pose.x_m, end.pose.y_m);
        (missing_m, slopes.fixed_columns::<2>(0).into_owned(), slopes.column(2).into_owned())
    }
}

/// A spin with its measured turn.
#[derive(Debug, Clone, Copy)]
struct Spin {
    wheel_rad: Wheels<f64>,
    /// Modulo whole turns, radians.
    measured_rad: f64,
}

impl Spin {
    /// B θ by the wheels (metres) and θ with its whole turns (radians).
    fn of_wheels(&self, at: &GeometryParameters) -> (f64, f64) {
        let travel_m = self.wheel_rad.right * at.m_per_rad.right - self.wheel_rad.left * at.m_per_rad.left;
        (travel_m, unwrap_near(self.measured_rad, travel_m / at.separation_m))
    }
}

/// Step 1 linearised: normal matrix over r_L and r_R, each run's score, the correction of both, and its slope
/// over B.
struct Step1 {
    normal: Matrix2<f64>,
    scores: Vec<DVector<f64>>,
    correction: Vector2<f64>,
    radii_by_base: Vector2<f64>,
}

impl Step1 {
    fn of(straights: &[Straight], at: &GeometryParameters) -> Option<Self> {
        let (mut normal, mut correction, mut by_base) = (Matrix2::zeros(), Vector2::zeros(), Vector2::zeros());
        let mut scores = Vec::with_capacity(straights.len());
        for straight in straights {
            let (missing, slopes, base_slope) = straight.missing(at);
            normal += slopes.transpose() * slopes;
            let score = slopes.transpose() * missing;
            correction += score;
            by_base -= slopes.transpose() * base_slope;
            scores.push(DVector::from_column_slice(score.as_slice()));
        }
        let inverse: Matrix2<f64> = normal.try_inverse()?;
        Some(Self { normal, scores, correction: inverse * correction, radii_by_base: inverse * by_base })
    }
}

/// Step 2: the wheelbase of one direction, metres, by the least squares of the heading over its gain; `None`
/// without spins in that direction.
fn separation_m(spins: &[Spin], at: &GeometryParameters, sign: f64) -> Option<f64> {
    let of_direction = spins.iter().map(|spin| spin.of_wheels(at)).filter(|(_, turn_rad)| turn_rad * sign > 0.0);
    let (squares, products) = of_direction.fold((0.0, 0.0), |(squares, products), (travel_m, turn_rad)| {
        (squares + travel_m * travel_m, products + travel_m * turn_rad)
    });
    (products > 0.0).then_some(squares / products)
}

fn mean_m(spins: &[Spin], at: &GeometryParameters) -> Option<f64> {
    let directions: Vec<f64> = [1.0, -1.0].into_iter().filter_map(|sign| separation_m(spins, at, sign)).collect();
    (!directions.is_empty()).then(|| directions.iter().sum::<f64>() / directions.len() as f64)
}

/// Covariance of r_L, r_R and B. Each step has its own scatter, and its result moves with the other's.
fn covariance(step: &Step1, spins: &[Spin], at: &GeometryParameters) -> Option<Matrix3<f64>> {
    let normal = DMatrix::from_column_slice(2, 2, step.normal.as_slice());
    let radii = scatter_between_runs(&normal, &step.scores, 1)?;
    let (mut base_var, mut base_by, mut directions) = (0.0, Vector2::zeros(), 0.0);
    for sign in [1.0, -1.0] {
        let of_direction: Vec<_> = spins
            .iter()
            .map(|spin| (spin, spin.of_wheels(at)))
            .filter(|(_, (_, turn_rad))| turn_rad * sign > 0.0)
            .collect();
        if of_direction.is_empty() {
            continue;
        }
        let base: Vec<f64> = of_direction.iter().map(|(_, (travel_m, turn_rad))| travel_m / turn_rad).collect();
        base_var += Summary::of(base.iter().copied())?.mean_variance()?;
        for (spin, (_, turn_rad)) in &of_direction {
            base_by +=
                Vector2::new(-spin.wheel_rad.left, spin.wheel_rad.right) / (turn_rad * of_direction.len() as f64);
        }
        directions += 1.0;
    }
    // The mean over the directions.
    let (base_var, base_by) = (base_var / (directions * directions), base_by / directions);
    let mut coupling = Matrix3::identity();
    coupling.fixed_view_mut::<2, 1>(0, 2).copy_from(&-step.radii_by_base);
    coupling.fixed_view_mut::<1, 2>(2, 0).copy_from(&-base_by.transpose());
    let mut own = Matrix3::zeros();
    own.view_mut((0, 0), (2, 2)).copy_from(&radii);
    own[(2, 2)] = base_var;
    let inverse = coupling.try_inverse()?;
    Some(inverse * own * inverse.transpose())
}

/// The first and the last measured pose of a run within its log, and how the wheels turned in between, row by
/// row; `None` without two.
///
/// The wheels are taken at the measurements' instants: what they turn after the last one is not measured.
fn whole(run: &RunView<'_>, robot: &NominalRobot, nominal: &DriveGeometry) -> Option<(Pose, PoseMeasurement)> {
    let measurements = PoseMeasurements::at(run, &WheelAngleInterpolator::of(run, robot)?, nominal, Spacing::ENDS)?;
    let PoseMeasurements { start, mut later, .. } = measurements;
    Some((start, later.pop()?))
}

impl Method for Ivanjko {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn about(&self) -> &'static str {
        "straight runs' ends give both wheels, spins the wheelbase, by least squares over the log"
    }

    /// Straight runs and half turns each way; the numbers are those of the study that published its logs
    /// (Sousa et al. 2022: 1.5 m, 5 of each kind).
    fn protocol(&self) -> Vec<Schedule> {
        vec![
            Schedule::Straights { length_m: 1.5, runs: 6 },
            Schedule::Spins { turn_rad: std::f64::consts::PI, runs: 10 },
        ]
    }

    fn calibrate(&self, sessions: &[Session<'_>]) -> Result<Calibration, CalibError> {
        let (robot, geometry) = nominal(Self::NAME, sessions)?;
        let (mut straights, mut spins) = (Vec::new(), Vec::new());
        let mut at =
            GeometryParameters { m_per_rad: geometry.m_per_rad(), separation_m: geometry.wheel_separation_m() };
        for session in sessions {
            for run in &session.runs {
                let Some((start, end)) = whole(run, session.robot, &geometry) else { continue };
                let PoseMeasurement { wheel_rad: steps_rad, pose: end } = end;
                let sum = |sum: Wheels<f64>, step: &Wheels<f64>| sum.zip_with(*step, |sum, step| sum + step);
                let wheel_rad = steps_rad.iter().fold(Wheels::both(0.0), sum);
                match run.info().protocol {
                    Some(Protocol::Straight) if wheel_rad != Wheels::both(0.0) => {
                        let measured = start.to(end);
                        straights.push(Straight { steps_rad, measured_m: Vector2::new(measured.x_m, measured.y_m) });
                    }
                    Some(Protocol::Spin) => {
                        let spin = Spin { wheel_rad, measured_rad: end.theta_rad - start.theta_rad };
                        if spin.of_wheels(&at).1.abs() >= MIN_SPIN_RAD {
                            spins.push(spin);
                        }
                    }
                    _ => {}
                }
            }
        }
        if straights.is_empty() {
            return Err(Self::not_applicable(
                "no run with protocol = \"straight\" has its ends measured: drive straight runs and read the pose, or two marks, at both ends",
            ));
        }
        if spins.is_empty() {
            return Err(CalibError::Unobservable {
                method: Self::NAME,
                parameter: Parameter::WheelSeparation,
                why: "no run with protocol = \"spin\" has its ends measured: add spins of 180 degrees or more in each direction"
                    .to_owned(),
            });
        }
        let by_radii = straights.iter().map(|straight| straight.missing(&at).1);
        let normal: Matrix2<f64> = by_radii.map(|slopes| slopes.transpose() * slopes).sum();
        let missing = "its straight runs do not tell one wheel from the other: drive them longer";
        let normal = DMatrix::from_column_slice(2, 2, normal.as_slice());
        well_conditioned(Self::NAME, Parameter::LeftWheelDiameter, &normal, missing)?;
        let (mut converged, mut last) = (false, None);
        for _ in 0..IVANJKO_MAX_ROUNDS {
            let Some(step) = Step1::of(&straights, &at) else { break };
            at.m_per_rad.left += step.correction.x;
            at.m_per_rad.right += step.correction.y;
            let Some(base_m) = mean_m(&spins, &at) else { break };
            let changed =
                (step.correction.amax() / at.m_per_rad.left).abs().max((base_m / at.separation_m - 1.0).abs());
            at.separation_m = base_m;
            last = Some(step);
            if changed < IVANJKO_TOLERANCE {
                converged = true;
                break;
            }
        }
        let Some(last) = last else {
            return Err(Self::not_applicable(
                "its straight runs do not determine the wheels' difference: drive them longer",
            ));
        };
        let of_radii = covariance(&last, &spins, &at);
        let twice = Covariance::from_diagonal(&DVector::from_vec(vec![2.0, 2.0, 1.0]));
        Ok(Calibration {
            covariance: of_radii
                .map(|of_radii| &twice * Covariance::from_column_slice(3, 3, of_radii.as_slice()) * &twice),
            runs_used: straights.len() + spins.len(),
            converged,
            ..Calibration::new(
                Self::NAME,
                drive(Self::NAME, at.m_per_rad.map(|m_per_rad| 2.0 * m_per_rad), at.separation_m)?,
                robot.ticks_per_rev,
            )
        })
    }
}
