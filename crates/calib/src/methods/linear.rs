//! `linear`: linear least squares on any path, first the headings, then the positions.
//!
//! Model: Δs = c11 φ_R + c12 φ_L and Δθ = c21 φ_R + c22 φ_L. Step 1: θ_N − θ_0 = [Σ Δφ_R, Σ Δφ_L]·[c21; c22].
//! Step 2, with the headings of step 1 along the log: p_N − p_0 = [Σ Δφ_R e(θ), Σ Δφ_L e(θ)]·[c11; c12] with
//! e(θ) the direction of the path, the chord of an exact arc between two rows. The physical form has three
//! parameters, c11 = r_R/2, c12 = r_L/2, c21 = r_R/B, c22 = −r_L/B: r_L/r_R = −c22/c21 from step 1, then r_R
//! alone, B = r_R/c21.
//! Assumptions: wheels that roll; headings without noise in step 2. Heading noise of variance σ² (of the
//! start's reading, and of the path against the log) turns the measured displacement against its regressor:
//! wheels and base come out short by σ²/2 of themselves. It does not average out over runs.
//! Observability: all parameters where paths turn both ways or both turn and go straight, and end away from
//! their start. On closed paths the physical form keeps the mean diameter and says that it is blind to the
//! common scale; the general one needs curves: on straights and whole spins c11 and c12 are one.
//! Derived here: what of a run is an equation ([`Readings`]), the refusals, the covariance (residuals of a
//! run taken together, scatter between runs), and the geometry that the general form comes nearest to.
//! Reference: Antonelli, Chiaverini, Fusco 2005 (general form); Antonelli & Chiaverini 2007 (physical form).

use dataset::{NominalRobot, RunView, Session};
use kinematics::{DriveGeometry, Pose, Side, Wheels, sinc, unwrap_near};
use motion_programs::Schedule;
use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

use crate::estimate::{CalibError, Calibration, Covariance, Method, NotObservable, Parameter, drive, nominal};
use crate::settings::{CLOSED_PATH_RATIO, COLLINEARITY_TOLERANCE, DIFFERENCE_STEP};
use estimation::WheelAngleInterpolator;

/// How many parameters the model has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Three: the robot's two radii and its wheelbase (2007).
    Physical,
    /// Four: the whole matrix of the wheels' gains (2005).
    General,
}

/// What of a run is an equation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Readings {
    /// Its last pose in the frame of its first, where the robot stands: the papers' form.
    EndPoses,
    /// Every pose in the frame of the first: for single long runs, and to determine the scale on closed
    /// paths. Differences of the clocks then enter the headings.
    All,
}

/// The method in one of its forms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Linear {
    /// Three parameters or four.
    pub form: Form,
    /// Ends of the runs or all poses.
    pub readings: Readings,
}

/// The general form's matrix: what a radian of each wheel does.
#[derive(Debug, Clone, PartialEq)]
pub struct Gains {
    /// Travel of the centre, metres a radian: c12 (left) and c11 (right).
    pub distance_m_per_rad: Wheels<f64>,
    /// Turn, radians a radian: c22 (left, negative) and c21 (right).
    pub turn_per_rad: Wheels<f64>,
    /// Covariance in the order c11, c12, c21, c22; `None` when there are too few runs to show a scatter.
    pub covariance: Option<DMatrix<f64>>,
}

impl Linear {
    /// The method as the table of contents offers it: the physical form on the runs' ends.
    pub const DEFAULT: Self = Self { form: Form::Physical, readings: Readings::EndPoses };

    const NAME: &'static str = "linear";

    fn unobservable(parameter: Parameter, why: &str) -> CalibError {
        CalibError::Unobservable { method: Self::NAME, parameter, why: why.to_owned() }
    }
}

/// One run as equations, in time order.
struct Driven {
    equations: Vec<Equation>,
}

/// A pose in the frame of the run's first.
struct Equation {
    /// How the wheels turned since the equation before, row by row, radians.
    steps_rad: Vec<Wheels<f64>>,
    /// Turns of the wheels since the first pose, radians.
    wheel_rad: Wheels<f64>,
    /// The same with every row counted forward.
    rolled_rad: Wheels<f64>,
    /// Measured turn, whole turns counted, radians.
    turn_rad: f64,
    /// Measured displacement in the frame of the first pose, metres.
    moved_m: Vector2<f64>,
}

impl Driven {
    fn of(run: &RunView<'_>, robot: &NominalRobot, geometry: &DriveGeometry, readings: Readings) -> Option<Self> {
        let track = WheelAngleInterpolator::of(run, robot)?;
        // Poses outside of the log have no odometry to be compared with.
        let mut poses: Vec<(f64, Pose)> = run.observed_poses();
        poses.retain(|(t_s, _)| track.steps(*t_s, *t_s).is_some());
        let ((start_s, start), after) = poses.split_first()?;
        let chosen = match readings {
            Readings::EndPoses => &after[after.len().checked_sub(1)?..],
            Readings::All => after,
        };
        let (mut last_s, mut wheel_rad, mut rolled_rad) = (*start_s, Wheels::both(0.0), Wheels::both(0.0));
        let mut equations = Vec::with_capacity(chosen.len());
        for (t_s, pose) in chosen {
            let steps_rad = track.steps(last_s, *t_s)?;
            last_s = *t_s;
            for step in &steps_rad {
                wheel_rad = wheel_rad.zip_with(*step, |sum, step| sum + step);
                rolled_rad = rolled_rad.zip_with(*step, |sum, step: f64| sum + step.abs());
            }
            let travel_m = wheel_rad.zip_with(geometry.m_per_rad(), |rad, m_per_rad| rad * m_per_rad);
            let moved = start.to(*pose);
            // Whole turns come from the odometry.
            let turn_rad = unwrap_near(moved.theta_rad, geometry.increment(travel_m).turn_rad);
            let moved_m = Vector2::new(moved.x_m, moved.y_m);
            equations.push(Equation { steps_rad, wheel_rad, rolled_rad, turn_rad, moved_m });
        }
        (!equations.is_empty()).then_some(Self { equations })
    }

    /// Step 2's regressors at every equation: Σ Δφ e(θ) of each wheel, radians, in the frame of the first
    /// pose.
    fn paths(&self, turn_per_rad: Wheels<f64>) -> Vec<Wheels<Vector2<f64>>> {
        let (mut at, mut theta_rad) = (Wheels::both(Vector2::zeros()), 0.0);
        let mut after = |equation: &Equation| {
            for step in &equation.steps_rad {
                let turn_rad = turn_per_rad.left * step.left + turn_per_rad.right * step.right;
                let (sin, cos) = (theta_rad + 0.5 * turn_rad).sin_cos();
                let chord = Vector2::new(cos, sin) * sinc(0.5 * turn_rad);
                at = at.zip_with(*step, |at, step| at + chord * step);
                theta_rad += turn_rad;
            }
            at
        };
        self.equations.iter().map(&mut after).collect()
    }
}

/// The result of step 1, with what its covariance needs.
struct Headings {
    /// c22 (left, negative) and c21 (right).
    turn_per_rad: Wheels<f64>,
    /// Normal matrix, order right, left.
    normal: Matrix2<f64>,
    /// Each run's score.
    scores: Vec<Vector2<f64>>,
}

impl Headings {
    fn of(runs: &[Driven]) -> Result<Self, CalibError> {
        let row = |equation: &Equation| Vector2::new(equation.wheel_rad.right, equation.wheel_rad.left);
        let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
        for equation in runs.iter().flat_map(|run| &run.equations) {
            normal += row(equation) * row(equation).transpose();
            right += row(equation) * equation.turn_rad;
        }
        let Some(solution) = solve(&normal, &right) else {
            let why =
                "the wheels' turns keep one proportion in all runs; drive both ways round, or turn and go straight";
            return Err(Linear::unobservable(Parameter::WheelSeparation, why));
        };
        let score = |run: &Driven| {
            run.equations
                .iter()
                .map(|equation| row(equation) * (equation.turn_rad - row(equation).dot(&solution)))
                .sum()
        };
        let scores = runs.iter().map(score).collect();
        Ok(Self { turn_per_rad: Wheels { left: solution.y, right: solution.x }, normal, scores })
    }

    /// Slope of a function of c21 and c22 over both, by central differences.
    fn slopes<T>(&self, of: impl Fn(Wheels<f64>) -> T, difference: impl Fn(T, T, f64) -> T) -> [T; 2] {
        [Side::Right, Side::Left].map(|side| {
            let size = DIFFERENCE_STEP * self.turn_per_rad[side].abs();
            let (mut more, mut less) = (self.turn_per_rad, self.turn_per_rad);
            more[side] += size;
            less[side] -= size;
            difference(of(more), of(less), 2.0 * size)
        })
    }
}

/// Two normal equations; `None` when their regressors are one.
fn solve(normal: &Matrix2<f64>, right: &Vector2<f64>) -> Option<Vector2<f64>> {
    let cosine = normal[(0, 1)] / (normal[(0, 0)] * normal[(1, 1)]).sqrt();
    if cosine.is_nan() || 1.0 - cosine.abs() < COLLINEARITY_TOLERANCE {
        return None;
    }
    Some(normal.try_inverse()? * right)
}

/// Covariance of the solution of Σ g = 0 over runs from the scatter of the runs' scores g, with `slopes` −Σ
/// ∂g/∂p. `taken` is how many runs' worth of equations the parameters take: n/(n − taken) is the correction
/// of a sample's variance. `None` when nothing is left over.
///
/// Whatever is correlated inside of a run (its start's reading, its random walk) stays inside of a score:
/// only runs have to be independent.
pub(super) fn scatter_between_runs(
    slopes: &DMatrix<f64>,
    scores: &[DVector<f64>],
    taken: usize,
) -> Option<DMatrix<f64>> {
    let spare = scores.len().checked_sub(taken).filter(|spare| *spare > 0)?;
    let squares: DMatrix<f64> = scores.iter().map(|score| score * score.transpose()).sum();
    let inverse = slopes.clone().try_inverse()?;
    Some(&inverse * squares * inverse.transpose() * (scores.len() as f64 / spare as f64))
}

/// Step 2 of the physical form: the base alone, of paths that a base of one metre would drive.
struct Scale {
    separation_m: f64,
    /// Σ X².
    normal: f64,
    scores: Vec<f64>,
    /// −Σ ∂g/∂(c21, c22).
    by_turn: [f64; 2],
}

/// Paths on a base of one metre: [r_R φ_R + r_L φ_L]/2 with r = |c2|.
fn unit_paths(run: &Driven, turn_per_rad: Wheels<f64>) -> Vec<Vector2<f64>> {
    let half = |path: Wheels<Vector2<f64>>| (path.right * turn_per_rad.right - path.left * turn_per_rad.left) * 0.5;
    run.paths(turn_per_rad).into_iter().map(half).collect()
}

impl Scale {
    /// `None` when the paths are closed.
    fn of(runs: &[Driven], headings: &Headings) -> Option<Self> {
        let at = headings.turn_per_rad;
        let paths: Vec<_> = runs.iter().map(|run| unit_paths(run, at)).collect();
        let pairs = || runs.iter().zip(&paths).flat_map(|(run, paths)| run.equations.iter().zip(paths));
        let normal: f64 = pairs().map(|(_, path)| path.norm_squared()).sum();
        let travelled = |rad: Wheels<f64>| 0.5 * (rad.right * at.right - rad.left * at.left);
        let travelled: f64 = pairs().map(|(equation, _)| travelled(equation.rolled_rad).powi(2)).sum();
        if normal.is_nan() || normal <= CLOSED_PATH_RATIO * CLOSED_PATH_RATIO * travelled {
            return None;
        }
        let separation_m = pairs().map(|(equation, path)| path.dot(&equation.moved_m)).sum::<f64>() / normal;
        let score = |run: &Driven, at: Wheels<f64>| -> f64 {
            let paths = unit_paths(run, at);
            run.equations
                .iter()
                .zip(&paths)
                .map(|(equation, path)| path.dot(&(equation.moved_m - path * separation_m)))
                .sum()
        };
        let scores = runs.iter().map(|run| score(run, at)).collect();
        let all = |at: Wheels<f64>| -> f64 { runs.iter().map(|run| score(run, at)).sum() };
        let by_turn = headings.slopes(all, |more, less, step| -(more - less) / step);
        Some(Self { separation_m, normal, scores, by_turn })
    }
}

impl Linear {
    fn runs(&self, sessions: &[Session<'_>]) -> Result<(NominalRobot, DriveGeometry, Vec<Driven>), CalibError> {
        let (robot, geometry) = nominal(Self::NAME, sessions)?;
        let of = |session: &Session<'_>, run: &RunView<'_>| Driven::of(run, session.robot, &geometry, self.readings);
        let runs: Vec<_> =
            sessions.iter().flat_map(|session| session.runs.iter().filter_map(|run| of(session, run))).collect();
        if runs.is_empty() {
            let why = "it needs runs with the pose measured at both ends (truth.csv with headings, or two marks in points.csv)";
            return Err(CalibError::NotApplicable { method: Self::NAME, why: why.to_owned() });
        }
        Ok((robot, geometry, runs))
    }

    /// The general form: all four gains, each free.
    ///
    /// # Errors
    /// [`CalibError`] when the paths do not determine both wheels, in headings or in positions.
    pub fn gains(&self, sessions: &[Session<'_>]) -> Result<Gains, CalibError> {
        let (_, _, runs) = self.runs(sessions)?;
        let headings = Headings::of(&runs)?;
        let regressors = |path: &Wheels<Vector2<f64>>| Matrix2::from_columns(&[path.right, path.left]);
        let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
        for run in &runs {
            for (equation, path) in run.equations.iter().zip(run.paths(headings.turn_per_rad)) {
                normal += regressors(&path).transpose() * regressors(&path);
                right += regressors(&path).transpose() * equation.moved_m;
            }
        }
        let rolled = |equation: &Equation| equation.rolled_rad.left.powi(2) + equation.rolled_rad.right.powi(2);
        let rolled: f64 = runs.iter().flat_map(|run| &run.equations).map(rolled).sum();
        let open = normal.trace() > CLOSED_PATH_RATIO * CLOSED_PATH_RATIO * rolled;
        let Some(solution) = solve(&normal, &right).filter(|_| open) else {
            let why = "the paths close, or are alike for both wheels, so that no gain is observable, or only their sum; drive open curves, or use the physical form";
            return Err(Self::unobservable(Parameter::LeftWheelDiameter, why));
        };
        let score = |run: &Driven, at: Wheels<f64>| -> Vector2<f64> {
            let of = |(equation, path): (&Equation, &Wheels<Vector2<f64>>)| {
                regressors(path).transpose() * (equation.moved_m - regressors(path) * solution)
            };
            run.equations.iter().zip(&run.paths(at)).map(of).sum()
        };
        let all = |at: Wheels<f64>| -> Vector2<f64> { runs.iter().map(|run| score(run, at)).sum() };
        let by_turn = headings.slopes(all, |more, less, step| (less - more) / step);
        // Unknowns: c11, c12, c21, c22.
        let mut slopes = DMatrix::zeros(4, 4);
        slopes.view_mut((0, 0), (2, 2)).copy_from(&normal);
        slopes.view_mut((2, 2), (2, 2)).copy_from(&headings.normal);
        slopes.view_mut((0, 2), (2, 1)).copy_from(&by_turn[0]);
        slopes.view_mut((0, 3), (2, 1)).copy_from(&by_turn[1]);
        let scores: Vec<_> = runs
            .iter()
            .zip(&headings.scores)
            .map(|(run, turn)| {
                let moved = score(run, headings.turn_per_rad);
                DVector::from_vec(vec![moved.x, moved.y, turn.x, turn.y])
            })
            .collect();
        Ok(Gains {
            distance_m_per_rad: Wheels { left: solution.y, right: solution.x },
            turn_per_rad: headings.turn_per_rad,
            covariance: scatter_between_runs(&slopes, &scores, 2),
        })
    }

    fn physical(&self, sessions: &[Session<'_>]) -> Result<Calibration, CalibError> {
        let (robot, geometry, runs) = self.runs(sessions)?;
        let headings = Headings::of(&runs)?;
        // r/B of each wheel.
        let (a_left, a_right) = (-headings.turn_per_rad.left, headings.turn_per_rad.right);
        let (separation_m, of_lengths, not_observable) = if let Some(scale) = Scale::of(&runs, &headings) {
            let mut slopes = DMatrix::zeros(3, 3);
            slopes.view_mut((0, 0), (2, 2)).copy_from(&headings.normal);
            slopes.view_mut((2, 0), (1, 2)).copy_from_slice(&scale.by_turn);
            slopes[(2, 2)] = scale.normal;
            let scores: Vec<_> = headings
                .scores
                .iter()
                .zip(&scale.scores)
                .map(|(turn, moved)| DVector::from_vec(vec![turn.x, turn.y, *moved]))
                .collect();
            let base_m = scale.separation_m;
            // D_L = −2 c22 B, D_R = 2 c21 B over c21, c22 and B.
            let by = [0.0, -2.0 * base_m, 2.0 * a_left, 2.0 * base_m, 0.0, 2.0 * a_right, 0.0, 0.0, 1.0];
            let jacobian = Covariance::from_row_slice(3, 3, &by);
            let of = |covariance: DMatrix<f64>| &jacobian * covariance * jacobian.transpose();
            (base_m, scatter_between_runs(&slopes, &scores, 2).map(of), Vec::new())
        } else {
            // D_L + D_R stays: B = (D_L + D_R)/(2(a_L + a_R)), D_i = 2 a_i B.
            let diameter_m = geometry.wheel_diameter_m();
            let sum = a_left + a_right;
            let base_m = (diameter_m.left + diameter_m.right) / (2.0 * sum);
            let (by_right, by_left) = (2.0 * base_m * a_left / sum, 2.0 * base_m * a_right / sum);
            // Over c21 = a_R and c22 = −a_L.
            let by = [-by_right, -by_left, by_right, by_left, -base_m / sum, base_m / sum];
            let jacobian = Covariance::from_row_slice(3, 2, &by);
            let normal = DMatrix::from_column_slice(2, 2, headings.normal.as_slice());
            let scores: Vec<_> =
                headings.scores.iter().map(|turn| DVector::from_column_slice(turn.as_slice())).collect();
            let of = |covariance: DMatrix<f64>| &jacobian * covariance * jacobian.transpose();
            let blind = NotObservable {
                parameter: Parameter::CommonScale,
                why: "the runs end where they began, and headings are ratios of lengths; the nominal mean diameter is kept: add straight runs".into(),
            };
            (base_m, scatter_between_runs(&normal, &scores, 2).map(of), vec![blind])
        };
        let diameter_m = Wheels { left: 2.0 * a_left * separation_m, right: 2.0 * a_right * separation_m };
        Ok(Calibration {
            covariance: of_lengths,
            not_observable,
            runs_used: runs.len(),
            ..Calibration::new(Self::NAME, drive(Self::NAME, diameter_m, separation_m)?, robot.ticks_per_rev)
        })
    }

    /// The geometry nearest to the general form: diameters of c11 and c12, and the base that turns both
    /// wheels together as c21 and c22 do.
    fn general(&self, sessions: &[Session<'_>]) -> Result<Calibration, CalibError> {
        let (robot, _) = nominal(Self::NAME, sessions)?;
        let Gains { distance_m_per_rad: c1, turn_per_rad: c2, covariance } = self.gains(sessions)?;
        let (sum_m, sum) = (2.0 * (c1.right + c1.left), c2.right - c2.left);
        let base_m = sum_m / sum;
        let by = [0.0, 4.0, 0.0, 0.0, 4.0, 0.0, 0.0, 0.0, 2.0 / sum, 2.0 / sum, -base_m / sum, base_m / sum];
        let jacobian = Covariance::from_row_slice(3, 4, &by);
        Ok(Calibration {
            covariance: covariance.map(|covariance| &jacobian * covariance * jacobian.transpose()),
            runs_used: self.runs(sessions)?.2.len(),
            ..Calibration::new(Self::NAME, drive(Self::NAME, c1.map(|gain| 4.0 * gain), base_m)?, robot.ticks_per_rev)
        })
    }
}

impl Method for Linear {
    fn name(&self) -> &'static str {
        Self::NAME
    }

    fn about(&self) -> &'static str {
        "any paths, by linear least squares over headings, then positions (poses or marks at the ends)"
    }

    /// Straights, spins and half circles, none of which closes but the spins; kinds and numbers are ours.
    fn protocol(&self) -> Vec<Schedule> {
        vec![
            Schedule::Straights { length_m: 2.0, runs: 10 },
            Schedule::Spins { turn_rad: std::f64::consts::TAU, runs: 10 },
            Schedule::Circles { radius_m: 1.0, turns: Some(0.5), runs_each_way: 5 },
        ]
    }

    fn calibrate(&self, sessions: &[Session<'_>]) -> Result<Calibration, CalibError> {
        match self.form {
            Form::Physical => self.physical(sessions),
            Form::General => self.general(sessions),
        }
    }
}
