//! The yardstick: the paper's trial as a bare loop, to measure the library's speed against and to check its
//! numbers.
//!
//! The same experiment as one closed-form trial of `scenarios/paper.toml` (30 straights of 0.5 m, 30 spins of
//! a turn, 10 squares of 4 m) with the estimates of `direct` and `umbmark`, written out for this robot alone:
//! no effects, no records, no session, no errors, one stream of draws for everything. It draws as often from
//! the same distributions, so that its estimates scatter as the library's do, trial by trial with other
//! numbers.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use effects::{Address, Stream, StreamName};

const STRAIGHTS: usize = 30;
const SPINS: usize = 30;
const SQUARES: usize = 10;
/// What the robot believes: metres a count, counts a pulse, wheelbase.
const NOMINAL_M_PER_COUNT: f64 = 1e-3 / COUNTS_PER_PULSE;
const COUNTS_PER_PULSE: f64 = 80.0;
const COUNTS_PER_TURN: f64 = PI * 0.160 / NOMINAL_M_PER_COUNT;
const NOMINAL_BASE_M: f64 = 0.363;
/// What is true: metres a count of each wheel, wheelbase and its scatter, the wheels' noise.
const TRUE_M_PER_COUNT: [f64; 2] = [1.0334e-3 / COUNTS_PER_PULSE, 1.0322e-3 / COUNTS_PER_PULSE];
const BASE_SIGMA_M: f64 = 1e-3;
const WHEEL_VAR_M: f64 = 5e-4 * 5e-4;
/// The floor grid and the marks that it reads, at ± this beside the centre.
const GRID_M: f64 = 1e-3;
const READING_SIGMA_M: f64 = 5e-4;
const MARK_M: f64 = 0.2315;
const OUTSIDE_M: f64 = MARK_M - 0.5 * NOMINAL_BASE_M;

/// A value and its standard deviation.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Estimate {
    pub(crate) value: f64,
    pub(crate) sigma: f64,
}

/// C_L, C_R (metres a pulse) and B (metres) by each method.
pub(crate) struct Estimates {
    pub(crate) direct: [Estimate; 3],
    pub(crate) umbmark: [Estimate; 3],
}

/// Both marks as read, left first: x and y.
type Marks = [[f64; 2]; 2];

#[derive(Clone, Copy)]
struct Robot {
    x_m: f64,
    y_m: f64,
    theta_rad: f64,
    sin_cos: (f64, f64),
    counts: [f64; 2],
}

/// The experiment and its draws.
pub(crate) struct Yardstick {
    stream: Stream,
}

impl Yardstick {
    pub(crate) fn new(seed: u64) -> Self {
        let address = Address { seed, point: 0, trial: 0, run: 0 };
        Self { stream: address.stream(StreamName::new("yardstick")) }
    }

    /// One trial: drives everything and estimates.
    pub(crate) fn trial(&mut self) -> Estimates {
        let grid_sigma_m = READING_SIGMA_M.hypot(GRID_M / 12_f64.sqrt());
        // (6) to (9): each wheel's metres a pulse from every straight.
        let (mut left, mut right, mut stated) = ([0.0; STRAIGHTS], [0.0; STRAIGHTS], 0.0_f64);
        for run in 0..STRAIGHTS {
            let counts = straight(if run % 2 == 0 { 0.5 } else { -0.5 });
            let (start, end, pulses) = self.run(counts);
            let turn_rad = turn_rad(&start, &end);
            let per_sinc = 1.0 / sinc(0.5 * turn_rad);
            let arc_m = |side: usize, out_m: f64| {
                distance_m(start[side], end[side]).copysign(counts[side]) * per_sinc + out_m * turn_rad
            };
            left[run] = arc_m(0, OUTSIDE_M) / pulses[0];
            right[run] = arc_m(1, -OUTSIDE_M) / pulses[1];
            stated = stated.max(2_f64.sqrt() * grid_sigma_m / pulses[0].abs().min(pulses[1].abs()));
        }
        let wheels = [typical_mean(&left, stated), typical_mean(&right, stated)];
        // (12) to (14): the wheelbase from every spin.
        let (mut base, mut slope_left, mut slope_right, mut stated) = ([0.0; SPINS], 0.0, 0.0, 0.0_f64);
        for (run, base) in base.iter_mut().enumerate() {
            let (start, end, pulses) = self.run(spin(if run % 2 == 0 { TAU } else { -TAU }));
            let whole_rad = (pulses[1] - pulses[0]).signum() * TAU;
            let turn_rad = whole_rad + turn_rad(&start, &end);
            *base = (wheels[1].value * pulses[1] - wheels[0].value * pulses[0]) / turn_rad;
            slope_left += pulses[0] / turn_rad / SPINS as f64;
            slope_right += pulses[1] / turn_rad / SPINS as f64;
            stated = stated.max((*base / turn_rad).abs() * 2.0 * grid_sigma_m / distance_m(start[0], start[1]));
        }
        let mut base = typical_mean(&base, stated);
        base.sigma = base.sigma.hypot(slope_left * wheels[0].sigma).hypot(slope_right * wheels[1].sigma);

        // UMBmark: mean end errors of both directions.
        let (mut ends_m, mut squares) = ([[0.0; SQUARES / 2]; 2], 0);
        for run in 0..SQUARES {
            ends_m[run % 2][squares / 2] = self.square(if run % 2 == 0 { -FRAC_PI_2 } else { FRAC_PI_2 });
            squares += 1;
        }
        let [cw, ccw] = ends_m.map(|ends_m| mean(ends_m.iter().copied()));
        Estimates { direct: [wheels[0], wheels[1], base], umbmark: umbmark(cw, ccw) }
    }

    /// One motion between two readings: both readings and each wheel's pulses.
    fn run(&mut self, counts: [f64; 2]) -> (Marks, Marks, [f64; 2]) {
        let mut robot = self.place();
        let (start, before) = (self.read(&robot), pulses(&robot));
        self.drive(&mut robot, counts);
        let after = pulses(&robot);
        (start, self.read(&robot), [after[0] - before[0], after[1] - before[1]])
    }

    /// A square: by how much its end's x, in the start's frame, differs from dead reckoning on nominal
    /// values.
    fn square(&mut self, corner_rad: f64) -> f64 {
        let (side, corner) = (straight(4.0), spin(corner_rad));
        let mut robot = self.place();
        let (start, begun) = (self.read(&robot), pulses(&robot));
        let (mut reckoned_m, mut theta_rad, mut last) = (0.0, 0.0, begun);
        for motion in 0..8 {
            self.drive(&mut robot, if motion % 2 == 0 { side } else { corner });
            let now = pulses(&robot);
            let distance_m = 0.5 * 1e-3 * ((now[1] - last[1]) + (now[0] - last[0]));
            let next_rad = 1e-3 / NOMINAL_BASE_M * ((now[1] - begun[1]) - (now[0] - begun[0]));
            reckoned_m += distance_m * (0.5 * (theta_rad + next_rad)).cos();
            (theta_rad, last) = (next_rad, now);
        }
        let end = self.read(&robot);
        let centre = |marks: &Marks, axis: usize| 0.5 * (marks[0][axis] + marks[1][axis]);
        let heading_rad = (start[1][0] - start[0][0]).atan2(start[0][1] - start[1][1]);
        let (sin, cos) = heading_rad.sin_cos();
        cos * (centre(&end, 0) - centre(&start, 0)) + sin * (centre(&end, 1) - centre(&start, 1)) - reckoned_m
    }

    fn place(&mut self) -> Robot {
        let (x_m, y_m) = (self.stream.uniform_about_zero(0.05), self.stream.uniform_about_zero(0.05));
        let theta_rad = self.stream.uniform_about_zero(0.02);
        let counts = [COUNTS_PER_TURN * self.stream.uniform(), COUNTS_PER_TURN * self.stream.uniform()];
        Robot { x_m, y_m, theta_rad, sin_cos: theta_rad.sin_cos(), counts }
    }

    /// One arc with the wheels' noise summed over it and scattered inside it (docs/effects.md; Chong &
    /// Kleeman 1997).
    fn drive(&mut self, robot: &mut Robot, counts: [f64; 2]) {
        let base_m = NOMINAL_BASE_M + BASE_SIGMA_M * self.stream.normal();
        let [l, r] = [TRUE_M_PER_COUNT[0] * counts[0], TRUE_M_PER_COUNT[1] * counts[1]];
        let (var_l, var_r) = (WHEEL_VAR_M * l.abs(), WHEEL_VAR_M * r.abs());
        let noisy_l = l + var_l.sqrt() * self.stream.normal();
        let noisy_r = r + var_r.sqrt() * self.stream.normal();
        let turn_rad = (noisy_r - noisy_l) / base_m;
        let (sin, cos) = (0.5 * turn_rad).sin_cos();
        let sinc_half = if turn_rad.abs() < 1e-4 { 1.0 } else { sin / (0.5 * turn_rad) };

        let (mean_rad, weight) = ((r - l) / base_m, (var_r * l * l + var_l * r * r) / (base_m * base_m));
        let tt = mean_rad * mean_rad;
        let (along, across) = if tt < 0.01 {
            (tt / 720.0, 1.0 / 12.0 - tt / 240.0)
        } else {
            let (half, whole) = (sinc(0.5 * mean_rad), sinc(mean_rad));
            ((0.5 * (1.0 + whole) - half * half) / tt, 0.5 * (1.0 - whole) / tt)
        };
        let along_m = 0.5 * (noisy_l + noisy_r) * sinc_half + (weight * along).sqrt() * self.stream.normal();
        let across_m = (weight * across).sqrt() * self.stream.normal();
        let (dx_m, dy_m) = (cos * along_m - sin * across_m, sin * along_m + cos * across_m);

        let (sin, cos) = robot.sin_cos;
        robot.x_m += cos * dx_m - sin * dy_m;
        robot.y_m += sin * dx_m + cos * dy_m;
        robot.theta_rad += turn_rad;
        robot.sin_cos = robot.theta_rad.sin_cos();
        robot.counts = [robot.counts[0] + counts[0], robot.counts[1] + counts[1]];
    }

    fn read(&mut self, robot: &Robot) -> Marks {
        let (sin, cos) = robot.sin_cos;
        let mut read = |value_m: f64| ((value_m + READING_SIGMA_M * self.stream.normal()) / GRID_M).round() * GRID_M;
        [MARK_M, -MARK_M].map(|y_m| [read(robot.x_m - sin * y_m), read(robot.y_m + cos * y_m)])
    }
}

/// Whole counts of both wheels for a straight and for a turn on the spot, by nominal values.
fn straight(length_m: f64) -> [f64; 2] {
    [(length_m / NOMINAL_M_PER_COUNT).round(); 2]
}

fn spin(turn_rad: f64) -> [f64; 2] {
    let counts = (0.5 * NOMINAL_BASE_M * turn_rad / NOMINAL_M_PER_COUNT).round();
    [-counts, counts]
}

fn pulses(robot: &Robot) -> [f64; 2] {
    robot.counts.map(|counts| (counts.floor() / COUNTS_PER_PULSE).floor())
}

fn distance_m(a: [f64; 2], b: [f64; 2]) -> f64 {
    ((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1])).sqrt()
}

/// (8): turn of the axle between two readings, in (−π, π].
fn turn_rad(start: &Marks, end: &Marks) -> f64 {
    let axle = |marks: &Marks| (marks[0][0] - marks[1][0], marks[0][1] - marks[1][1]);
    let ((x0, y0), (x1, y1)) = (axle(start), axle(end));
    (x0 * y1 - y0 * x1).atan2(x0 * x1 + y0 * y1)
}

fn sinc(x: f64) -> f64 {
    if x.abs() < 1e-4 { 1.0 } else { x.sin() / x }
}

/// Mean and its standard deviation.
fn mean(values: impl Iterator<Item = f64> + Clone) -> Estimate {
    let count = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / count;
    let squares: f64 = values.map(|value| (value - mean) * (value - mean)).sum();
    Estimate { value: mean, sigma: (squares / (count - 1.0) / count).sqrt() }
}

/// Mean of the values within 3.5 robust standard deviations of their median; an even number of values.
fn typical_mean<const N: usize>(values: &[f64; N], stated_sigma: f64) -> Estimate {
    fn median<const N: usize>(mut values: [f64; N]) -> f64 {
        let (below, upper, _) = values.select_nth_unstable_by(N / 2, f64::total_cmp);
        0.5 * (*upper + below.iter().copied().fold(f64::NEG_INFINITY, f64::max))
    }
    let centre = median(*values);
    let limit = 3.5 * (1.482_602_218_505_602 * median(values.map(|value| (value - centre).abs()))).max(stated_sigma);
    mean(values.iter().copied().filter(|value| (value - centre).abs() <= limit))
}

/// Borenstein & Feng: E_b and E_d from the mean end errors.
fn umbmark(cw: Estimate, ccw: Estimate) -> [Estimate; 3] {
    let (alpha, beta) = ((cw.value + ccw.value) / -16.0, (cw.value - ccw.value) / -16.0);
    let sigma = cw.sigma.hypot(ccw.sigma) / 16.0;
    let q = NOMINAL_BASE_M / 4.0 * (0.5 * beta).sin();
    let by_beta = NOMINAL_BASE_M / 4.0 * 0.5 * (0.5 * beta).cos();
    let base_m = NOMINAL_BASE_M * FRAC_PI_2 / (FRAC_PI_2 - alpha);
    [
        Estimate { value: 1e-3 * (1.0 - q), sigma: 1e-3 * by_beta * sigma },
        Estimate { value: 1e-3 * (1.0 + q), sigma: 1e-3 * by_beta * sigma },
        Estimate { value: base_m, sigma: base_m / (FRAC_PI_2 - alpha) * sigma },
    ]
}
