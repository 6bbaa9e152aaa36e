//! Where an instrument that measures positions alone stands on the robot, before the first fit.
//!
//! Without headings the position of the instrument and the headings at which the runs start are found
//! together or not at all: a spin is a circle about the drive's centre, of which the start heading is any
//! where the instrument is taken to be at the centre. A fit that begins there stays in a minimum of its own.
//!
//! In the complex plane, positions r of a window are at e^{iθ} m but for the window's translation, which the
//! means take: m = q + (e^{iφ} − 1) l + Σ p ∂q/∂p, with the path q and the turn φ of dead reckoning from the
//! window's start, the instrument's position l, and corrections p of the drive and the instrument's clock. Of
//! the best rotation θ of each window (Umeyama 1991, in the plane) the cost is a function of x = (l, p)
//! alone, J(x) = Σ |r|² + |m|² − 2 |Σ r m̄|, which Newton's method minimises from several starts. The drive
//! is corrected, and its paths are found anew.

use std::f64::consts::TAU;

use kinematics::{Pose, sin_cos};
use nalgebra::{Complex, SMatrix, SVector};

use crate::model::{Column, Model};
use crate::records::Records;
use crate::segment::Segment;
use crate::settings::{DRIVE_PRIOR_SIGMA, LATENCY_PRIOR_SIGMA_S, START_HEADINGS};

/// Position of the instrument ahead of the drive's centre and to the left, metres, relative corrections of
/// the drive's geometry, and the latency, seconds: of a robot that drives steadily it is a position behind
/// the centre.
const PARAMETERS: usize = 2 + Column::GEOMETRY.len() + 1;

/// By how much a step moves what is no position of the instrument where the windows say nothing of it.
const DAMPING_SIGMAS: [f64; PARAMETERS - 2] =
    [DRIVE_PRIOR_SIGMA, DRIVE_PRIOR_SIGMA, DRIVE_PRIOR_SIGMA, LATENCY_PRIOR_SIGMA_S];

type Values = SVector<f64, PARAMETERS>;

impl Records<'_> {
    /// Position of the instrument ahead of the drive's centre and to the left, metres, by the positions of
    /// segments without headings and a nominal drive; `None` where the centre is as likely.
    pub(crate) fn sensor_position_m(&self, nominal: &Model) -> Option<[f64; 2]> {
        let windows = |model: &Model, near: Complex<f64>| -> Vec<Window> {
            let of_segments = self.segments.iter().filter(|segment| segment.has_free_heading());
            of_segments.flat_map(|segment| windows(segment, model, near)).collect()
        };
        let of_nominal = windows(nominal, Complex::default());
        let at_start: Vec<Values> = starts(&of_nominal).collect();
        let centre = PositionFit::found(&windows, nominal, of_nominal.clone(), &[Values::zeros()], Free::Others)?;
        let found = PositionFit::found(&windows, nominal, of_nominal, &at_start, Free::All)?;
        let gain = centre.cost - found.cost;
        (gain > START_HEADINGS.min_sensor_position_chi_square * found.variance()?).then_some(found.position_m)
    }
}

/// What moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Free {
    /// The instrument's position and what is beside it.
    All,
    /// What is beside it.
    Others,
}

/// A minimum of the cost.
struct PositionFit {
    position_m: [f64; 2],
    cost: f64,
    /// Coordinates, less what was fitted.
    freedom: f64,
}

impl PositionFit {
    /// The lowest minimum from some starts, `of_nominal` being the windows by the nominal drive.
    fn found(
        windows: &impl Fn(&Model, Complex<f64>) -> Vec<Window>,
        nominal: &Model,
        of_nominal: Vec<Window>,
        starts: &[Values],
        free: Free,
    ) -> Option<Self> {
        let (mut model, mut of_model) = (nominal.clone(), of_nominal);
        let mut starts = starts.to_vec();
        for step in 0.. {
            let each = starts.iter().map(|start| minimised(&of_model, *start, free));
            let (values, cost) = each.min_by(|a, b| a.1.total_cmp(&b.1))?;
            if !cost.is_finite() || values.iter().any(|value| !value.is_finite()) {
                return None;
            }
            if step == START_HEADINGS.drive_steps {
                let freedom = of_model.iter().map(|window| window.freedom).sum::<f64>() - PARAMETERS as f64;
                return Some(Self { position_m: [values[0], values[1]], cost, freedom });
            }
            for (k, column) in Column::GEOMETRY.into_iter().enumerate() {
                model.advance(column, values[2 + k]);
            }
            of_model = windows(&model, Complex::new(values[0], values[1]));
            starts = vec![values.map_with_location(|row, _, value| if row < 2 { value } else { 0.0 })];
        }
        None
    }

    /// Variance of a coordinate, m².
    fn variance(&self) -> Option<f64> {
        (self.freedom > 0.0).then(|| self.cost / self.freedom)
    }
}

/// Sums over the positions of a window, each less its mean: of the measured r, of the dead-reckoned q, and of
/// the derivatives d of m by each parameter.
#[derive(Debug, Clone, Copy)]
struct Window {
    /// Σ |r|² + |q|².
    squares: f64,
    /// Σ Re q̄ d.
    path_by: Values,
    /// Σ Re d̄ d.
    products: SMatrix<f64, PARAMETERS, PARAMETERS>,
    /// Σ r q̄.
    measured_by_path: Complex<f64>,
    /// Σ r d̄.
    measured_by: SVector<Complex<f64>, PARAMETERS>,
    /// Coordinates, less the translation and the rotation.
    freedom: f64,
}

/// Measured position, dead-reckoned one, and its derivatives.
type Sample = [Complex<f64>; 2 + PARAMETERS];

/// Windows of a segment, each until the robot has turned once, or has gone so far that its dead reckoning
/// drifts. Derivatives are those of an instrument near a position.
fn windows(segment: &Segment<'_>, model: &Model, near: Complex<f64>) -> Vec<Window> {
    let moved = Column::GEOMETRY.map(|column| {
        let mut moved = model.clone();
        moved.advance(column, START_HEADINGS.drive_step);
        moved
    });
    let mut found = Vec::new();
    let (mut pose, mut moved_poses) = (Pose::IDENTITY, moved.each_ref().map(|_| Pose::IDENTITY));
    let (mut turned_rad, mut distance_m, mut at) = (0.0, 0.0, 0);
    let mut samples: Vec<Sample> = Vec::new();
    for measurement in &segment.measurements {
        if samples.is_empty() {
            (pose, moved_poses) = (Pose::IDENTITY, moved_poses.map(|_| Pose::IDENTITY));
            (turned_rad, distance_m, at) = (0.0, 0.0, measurement.after);
        }
        for interval in &segment.intervals[at..measurement.after] {
            let increment = model.increment(interval.wheel_rad);
            pose = pose * increment.arc();
            for (pose, model) in moved_poses.iter_mut().zip(&moved) {
                *pose = *pose * model.increment(interval.wheel_rad).arc();
            }
            turned_rad += increment.turn_rad.abs();
            distance_m += increment.distance_m.abs();
        }
        at = measurement.after;
        let (path, turn) = path_and_turn(pose);
        let [left, right, separation] = moved_poses.map(|moved| {
            let (moved, turned) = path_and_turn(moved);
            (moved - path + (turned - turn) * near).unscale(START_HEADINGS.drive_step)
        });
        let measured = Complex::new(measurement.x_m, measurement.y_m);
        let twist = model.twist(segment.rate_at(measurement.after, measurement.t_s));
        // A late measurement is of where the instrument was.
        let across = Complex::new(0.0, twist.omega_rad_s) * near;
        let by_latency = -(turn + 1.0) * (across + twist.v_m_s);
        samples.push([measured, path, turn, Complex::<f64>::i() * turn, left, right, separation, by_latency]);
        let is_whole = turned_rad > TAU || distance_m > START_HEADINGS.max_window_separations * model.separation_m;
        if is_whole && samples.len() >= START_HEADINGS.min_window_positions {
            found.push(Window::of(&samples));
            samples.clear();
        }
    }
    if samples.len() >= START_HEADINGS.min_window_positions {
        found.push(Window::of(&samples));
    }
    found
}

/// q and e^{iφ} − 1.
fn path_and_turn(pose: Pose) -> (Complex<f64>, Complex<f64>) {
    let (sin, cos) = sin_cos(pose.theta_rad);
    (Complex::new(pose.x_m, pose.y_m), Complex::new(cos - 1.0, sin))
}

impl Window {
    fn of(samples: &[Sample]) -> Self {
        let count = samples.len() as f64;
        let mut mean = [Complex::default(); 2 + PARAMETERS];
        for sample in samples {
            mean.iter_mut().zip(sample).for_each(|(mean, of)| *mean += of.unscale(count));
        }
        let mut sums = Self {
            squares: 0.0,
            path_by: Values::zeros(),
            products: SMatrix::zeros(),
            measured_by_path: Complex::default(),
            measured_by: SVector::zeros(),
            freedom: 2.0 * count - 3.0,
        };
        for sample in samples {
            let [r, q, d @ ..]: Sample = std::array::from_fn(|k| sample[k] - mean[k]);
            sums.squares += r.norm_sqr() + q.norm_sqr();
            sums.measured_by_path += r * q.conj();
            for (row, of) in d.iter().enumerate() {
                sums.path_by[row] += (q.conj() * of).re;
                sums.measured_by[row] += r * of.conj();
                d.iter().enumerate().for_each(|(k, by)| sums.products[(row, k)] += (of.conj() * by).re);
            }
        }
        sums
    }
}

/// J(x) with its derivatives, and a bound of its curvature: of rotations that stay.
struct Cost {
    value: f64,
    gradient: Values,
    curvature: SMatrix<f64, PARAMETERS, PARAMETERS>,
    bound: SMatrix<f64, PARAMETERS, PARAMETERS>,
}

impl Cost {
    fn of(windows: &[Window], x: &Values) -> Self {
        let none = Self { value: 0.0, gradient: Values::zeros(), curvature: SMatrix::zeros(), bound: SMatrix::zeros() };
        let (mut sum, mut count) = (none, 0.0);
        for window in windows {
            let by_x = window.products * x;
            sum.value += window.squares + 2.0 * window.path_by.dot(x) + x.dot(&by_x);
            sum.gradient += 2.0 * (window.path_by + by_x);
            sum.bound += 2.0 * window.products;
            count += window.freedom;
            let product =
                window.measured_by_path + window.measured_by.iter().zip(x).map(|(by, x)| by * x).sum::<Complex<f64>>();
            let length = product.norm();
            if length > 0.0 {
                let turned = window.measured_by.map(|by| product.conj() * by / length);
                let (along, across) = (turned.map(|of| of.re), turned.map(|of| of.im));
                sum.value -= 2.0 * length;
                sum.gradient -= 2.0 * along;
                sum.curvature -= across * across.transpose() * (2.0 / length);
            }
        }
        let variance = sum.value / f64::max(count, 1.0);
        for (row, sigma) in DAMPING_SIGMAS.into_iter().enumerate() {
            sum.bound[(2 + row, 2 + row)] += variance / (sigma * sigma);
        }
        sum.curvature += sum.bound;
        sum
    }

    /// Newton's step of what moves, and that of rotations that stay, which never leads up.
    fn steps(&self, free: Free) -> impl Iterator<Item = Values> {
        let first = if free == Free::All { 0 } else { 2 };
        let count = PARAMETERS - first;
        let gradient = self.gradient.rows(first, count).into_owned();
        [&self.curvature, &self.bound].into_iter().filter_map(move |matrix| {
            let step = -matrix.view((first, first), (count, count)).into_owned().cholesky()?.solve(&gradient);
            let mut whole = Values::zeros();
            whole.rows_mut(first, count).copy_from(&step);
            Some(whole)
        })
    }
}

/// The centre, and positions all round it at the distance that the measured paths of turns tell.
fn starts(windows: &[Window]) -> impl Iterator<Item = Values> {
    let (turns, longer) = windows.iter().fold((0.0, 0.0), |(turns, longer), window| {
        (turns + window.products[(0, 0)], longer + window.measured_by[0].norm())
    });
    let distance_m = if turns > 0.0 { longer / turns } else { 0.0 };
    let round = (0..START_HEADINGS.sensor_position_starts).map(move |number| {
        let (sin, cos) = sin_cos(TAU * f64::from(number) / f64::from(START_HEADINGS.sensor_position_starts));
        Values::from_row_slice(&[distance_m * cos, distance_m * sin, 0.0, 0.0, 0.0, 0.0])
    });
    round.chain([Values::zeros()])
}

/// The minimum near some values, and its cost.
fn minimised(windows: &[Window], start: Values, free: Free) -> (Values, f64) {
    let (mut values, mut cost) = (start, Cost::of(windows, &start));
    for _ in 0..START_HEADINGS.sensor_position_steps {
        let next = cost.steps(free).map(|step| (step, Cost::of(windows, &(values + step))));
        let Some((step, next)) = next.into_iter().find(|(_, next)| next.value < cost.value) else { break };
        values += step;
        cost = next;
        if step.norm() < START_HEADINGS.sensor_position_tolerance * values.norm() {
            break;
        }
    }
    (values, cost.value)
}
