//! Logs of a robot whose wheels and wheelbase are known.
//!
//! The robot drives what its nominal geometry asks for, and its true wheels and wheelbase say where it gets:
//! straights, spins, squares and circles in both directions.

use dataset::{
    Dataset, MarkedPoint, NominalRobot, Odometry, PointReading, Protocol, ProtocolSettings, Provenance, Run, RunInfo,
    TruthNoise, TruthSample, WheelLog, WheelSpeed,
};
use kinematics::{DriveGeometry, Increment, Point, Pose, Wheels};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

const NOMINAL_DIAMETER_M: f64 = 0.15;
pub(crate) const NOMINAL_SEPARATION_M: f64 = 0.3;
const TICKS_PER_REV: f64 = 4096.0;

/// The mean diameter is the nominal one: three methods are blind to it.
pub(crate) const DIAMETER_M: Wheels<f64> = Wheels { left: 0.1503, right: 0.1497 };
pub(crate) const SEPARATION_M: f64 = 0.303;

/// Size of the measurements' errors in exact logs: without any, no method has a standard deviation.
const EXACT_M: f64 = 1e-5;

/// Rows of each leg of a path.
const ROWS: usize = 40;

/// Between rows, seconds.
const STEP_S: f64 = 0.05;

/// Two marks on the axle's line, outside of the wheels by different lengths.
const MARKS: [Point; 2] = [Point { x_m: 0.0, y_m: 0.21 }, Point { x_m: 0.0, y_m: -0.19 }];

/// How the logs of a robot are made.
pub(crate) struct Log {
    /// The next error, of unit size.
    pub(crate) error: Box<dyn FnMut() -> f64>,
    /// Size of the errors of measured positions, metres, and of headings, radians.
    pub(crate) sigma: f64,
    /// Standard deviation of each wheel's travel, m/√m.
    pub(crate) wheel_sigma_m_per_sqrt_m: f64,
    /// Where the instrument stands on the robot.
    pub(crate) body_from_sensor: Pose,
    /// By how much its stamps are late, seconds.
    pub(crate) latency_s: f64,
    /// Whether the wheels are logged as ticks; else as angles.
    pub(crate) is_ticks: bool,
    /// Whether marks are read at both ends in place of poses along the way.
    pub(crate) is_marks: bool,
}

/// Normal errors.
pub(crate) fn normal(seed: u64) -> Box<dyn FnMut() -> f64> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    Box::new(move || StandardNormal.sample(&mut random))
}

impl Log {
    pub(crate) fn exact() -> Self {
        let mut count = 0.0;
        // Multiples of an irrational number, folded: no two measurements err alike.
        let folded = move || {
            count += 1.0;
            (12.9898_f64 * count).sin()
        };
        Self {
            error: Box::new(folded),
            sigma: EXACT_M,
            wheel_sigma_m_per_sqrt_m: 0.0,
            body_from_sensor: Pose::IDENTITY,
            latency_s: 0.0,
            is_ticks: false,
            is_marks: false,
        }
    }

    /// Errors as of a camera above a laboratory: a millimetre and a milliradian, and wheels that slip.
    pub(crate) fn noisy(seed: u64) -> Self {
        Self { error: normal(seed), sigma: 1e-3, wheel_sigma_m_per_sqrt_m: 5e-4, ..Self::exact() }
    }

    fn measured(&mut self, pose: Pose) -> Pose {
        let mut error = || self.sigma * (self.error)();
        Pose::new(pose.x_m + error(), pose.y_m + error(), pose.theta_rad + error())
    }

    /// A run of legs, each of a distance and a turn that the nominal robot would drive.
    pub(crate) fn run(&mut self, number: usize, protocol: Protocol, side_m: Option<f64>, legs: &[(f64, f64)]) -> Run {
        let geometry = |diameter_m, separation_m| DriveGeometry::new(diameter_m, separation_m).expect("a drive");
        let nominal = geometry(Wheels::both(NOMINAL_DIAMETER_M), NOMINAL_SEPARATION_M);
        let truly = geometry(DIAMETER_M, SEPARATION_M);
        let mut pose = Pose::new(0.2 * number as f64, -0.1, 0.4 * number as f64);
        let mut rad = vec![Wheels::both(0.0)];
        let mut poses = vec![pose];
        let mut wheel_reference = Vec::new();
        for (distance_m, turn_rad) in legs {
            let share = 1.0 / ROWS as f64;
            let asked_m = nominal.travel_m(Increment { distance_m: distance_m * share, turn_rad: turn_rad * share });
            let step_rad = asked_m.zip_with(nominal.m_per_rad(), |travel_m, m_per_rad| travel_m / m_per_rad);
            let travel_m = step_rad.zip_with(truly.m_per_rad(), |rad, m_per_rad| rad * m_per_rad);
            for _ in 0..ROWS {
                let slip_m = |travel_m: f64, error: f64| self.wheel_sigma_m_per_sqrt_m * travel_m.abs().sqrt() * error;
                let errors = Wheels { left: (self.error)(), right: (self.error)() };
                let rolled_m = travel_m.zip_with(errors, |travel_m, error| travel_m + slip_m(travel_m, error));
                let last_rad = rad[rad.len() - 1];
                rad.push(last_rad.zip_with(step_rad, |rad, step_rad| rad + step_rad));
                pose = pose * truly.increment(rolled_m).arc();
                poses.push(pose);
                if protocol == Protocol::Straight {
                    let speed_m_s = travel_m.map(|travel_m| travel_m / STEP_S + self.sigma * (self.error)());
                    // Mid-step, where wheels turn as they do over the step.
                    wheel_reference.push(WheelSpeed { t_s: STEP_S * (poses.len() as f64 - 1.5), speed_m_s });
                }
            }
        }
        let settings = ProtocolSettings { side_m, ..ProtocolSettings::default() };
        let info = RunInfo { id: format!("{number}"), protocol: Some(protocol), settings, ..RunInfo::default() };
        let t_s: Vec<f64> = (0..poses.len()).map(|row| STEP_S * row as f64).collect();
        let (mut truth, mut point_readings) = (Vec::new(), Vec::new());
        if self.is_marks {
            for (t_s, pose) in [(t_s[0], poses[0]), (t_s[t_s.len() - 1], pose)] {
                for (point, body) in MARKS.into_iter().enumerate() {
                    let Point { x_m, y_m } = pose * body;
                    let mut error_m = || self.sigma * (self.error)();
                    let room = Point::new(x_m + error_m(), y_m + error_m());
                    point_readings.push(PointReading { t_s, point, room });
                }
            }
        } else {
            for (t_s, pose) in t_s.iter().zip(poses) {
                let Pose { x_m, y_m, theta_rad } = self.measured(pose * self.body_from_sensor);
                truth.push(TruthSample::new(t_s + self.latency_s, x_m, y_m, Some(theta_rad)));
            }
        }
        let angles = Wheels::from_sides(|side| rad.iter().map(|rad| rad[side]).collect::<Vec<f64>>());
        let ticks = |rad: &f64| (rad * TICKS_PER_REV / std::f64::consts::TAU).round() as i64;
        let wheels = match self.is_ticks {
            true => WheelLog::Ticks(angles.map(|angles| angles.iter().map(ticks).collect())),
            false => WheelLog::Angles(angles),
        };
        let odometry = Odometry { t_s: t_s.into(), wheels, ..Odometry::default() };
        Run { info, odometry, truth, point_readings, wheel_reference, ..Run::default() }
    }

    pub(crate) fn dataset(mut self) -> Dataset {
        let quarter = std::f64::consts::FRAC_PI_2;
        let mut runs = Vec::new();
        for length_m in [1.0, 1.1, -0.9, 1.05] {
            runs.push(self.run(runs.len(), Protocol::Straight, None, &[(length_m, 0.0)]));
        }
        for turn_rad in [1.0, -1.0, 0.5, -0.5] {
            runs.push(self.run(runs.len(), Protocol::Spin, None, &[(0.0, 4.0 * quarter * turn_rad)]));
        }
        for (protocol, sense) in [(Protocol::SquareCw, -1.0), (Protocol::SquareCcw, 1.0)].repeat(2) {
            let legs = [(1.0, 0.0), (0.0, sense * quarter)].repeat(4);
            runs.push(self.run(runs.len(), protocol, Some(1.0), &legs));
        }
        for (protocol, sense) in [(Protocol::CircleCw, -1.0), (Protocol::CircleCcw, 1.0)].repeat(2) {
            let legs = [(0.6 * quarter, sense * quarter)].repeat(4);
            runs.push(self.run(runs.len(), protocol, None, &legs));
        }
        let robot = NominalRobot {
            left_wheel_diameter_m: NOMINAL_DIAMETER_M,
            right_wheel_diameter_m: NOMINAL_DIAMETER_M,
            wheel_separation_m: NOMINAL_SEPARATION_M,
            ticks_per_rev: Some(TICKS_PER_REV),
            counter_bits: None,
        };
        let mark = |(number, body): (usize, Point)| MarkedPoint { id: format!("mark {number}"), body };
        let points = if self.is_marks { MARKS.into_iter().enumerate().map(mark).collect() } else { Vec::new() };
        Dataset { robot, truth_noise: TruthNoise::default(), runs, provenance: Provenance::default(), points }
    }
}
