//! What can be driven: straights, spins, squares and circles that fit the floor, each at several speeds, as
//! pairs of runs in both directions.

use std::f64::consts::TAU;

use dataset::{Dataset, Displacement, Odometry, Provenance, Run, RunInfo, TruthNoise, TruthSample, WheelLog};
use estimation::{Model, ModelFit, NormalEquations, total};
use kinematics::{Increment, Pose, Wheels};
use motion_programs::{Cost, Motion, MotionProgram, Schedule};
use rayon::prelude::*;

use super::constraints::{Reading, Setting};
use crate::candidates::candidate::{Candidate, terms};
use crate::settings::PLAN;

/// A pair of runs, one in each direction, at one speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Manoeuvre {
    pub(crate) schedule: Schedule,
    pub(crate) speed_m_s: f64,
}

impl Manoeuvre {
    pub(crate) fn cost(&self, setting: &Setting) -> Cost {
        let drive_limits = setting.drive_limits(self.speed_m_s);
        self.schedule.with_pairs(1).programs().iter().map(|program| drive_limits.cost(program)).sum()
    }
}

/// Every manoeuvre that fits the floor and of which a pair of runs fits the time.
pub(crate) fn library(setting: &Setting) -> Vec<Manoeuvre> {
    let (shorter_m, longer_m) = setting.sides_m();
    let separation_m = setting.robot.wheel_separation_m;
    let mut schedules: Vec<Schedule> = Vec::new();
    for size in PLAN.size_fractions {
        let length_m = rounded(size * longer_m);
        if length_m >= PLAN.min_manoeuvre_length_m {
            schedules.push(Schedule::Straights { length_m, runs: 2 });
        }
        let side_m = rounded(size * shorter_m);
        if side_m >= PLAN.min_manoeuvre_length_m {
            schedules.push(Schedule::Squares { side_m, runs_each_way: 1 });
        }
        let radius_m = rounded(0.5 * size * shorter_m);
        // Tighter than this the inner wheel goes backward: that is nearly a spin.
        if radius_m > 0.5 * separation_m {
            schedules.push(Schedule::Circles { radius_m, turns: None, runs_each_way: 1 });
        }
    }
    schedules.extend(PLAN.spin_revolutions.map(|turns| Schedule::Spins { turn_rad: turns * TAU, runs: 2 }));
    let speeds = PLAN.speed_fractions.map(|share| significant(share * setting.top_speed_m_s));
    let all = speeds
        .into_iter()
        .flat_map(|speed_m_s| schedules.iter().map(move |schedule| Manoeuvre { schedule: *schedule, speed_m_s }));
    all.filter(|manoeuvre| manoeuvre.cost(setting).minutes <= setting.minutes).collect()
}

/// Down to a centimetre, as a person would mark it on the floor.
fn rounded(length_m: f64) -> f64 {
    (100.0 * length_m).floor() / 100.0
}

/// To three digits.
fn significant(value: f64) -> f64 {
    // By way of its digits: a product with a power of ten would end in a rounding that a person has to read.
    format!("{value:.2e}").parse().unwrap_or(value)
}

/// Rows of a log that nobody wrote yet, and when the robot stood to be read.
struct Log {
    t_s: Vec<f64>,
    angle_rad: Wheels<Vec<f64>>,
    read_s: Vec<f64>,
}

/// One motion of a program: when it begins, how it goes, and from where each wheel turns by how much.
struct Stretch {
    from_s: f64,
    profile: Trapezoid,
    from_rad: Wheels<f64>,
    turn_rad: Wheels<f64>,
}

/// Drives a program by the nominal robot: the wheel that goes farther drives a trapezoid of speed, the other
/// one in proportion. Rows come at even intervals, or, where a robot writes none along the path, between
/// motions.
fn log(program: &MotionProgram, setting: &Setting, speed_m_s: f64, phase_rad: Wheels<f64>) -> Option<Log> {
    let geometry = setting.robot.geometry().ok()?;
    let m_per_rad = geometry.m_per_rad();
    let even = matches!(setting.reading, Reading::Even(_));
    let standstill_s = if even { PLAN.standstill_s } else { 0.0 };
    let (mut t_s, mut angle_rad) = (standstill_s, phase_rad);
    let (mut stretches, mut read_s): (Vec<Stretch>, Vec<f64>) = (Vec::new(), vec![0.0]);
    for motion in &program.motions {
        let increment = match *motion {
            Motion::Straight { length_m } => Increment { distance_m: length_m, turn_rad: 0.0 },
            Motion::Spin { turn_rad } | Motion::SpinAt { turn_rad, .. } => Increment { distance_m: 0.0, turn_rad },
            Motion::Arc { radius_m, turn_rad } => Increment { distance_m: radius_m * turn_rad.abs(), turn_rad },
            Motion::Pause { duration_s } => {
                t_s += duration_s;
                continue;
            }
            Motion::Measure => {
                read_s.push(t_s);
                continue;
            }
        };
        let travel_m = geometry.travel_m(increment);
        let turn_rad = travel_m.zip_with(m_per_rad, |travel_m, m_per_rad| travel_m / m_per_rad);
        let farther_m = travel_m.left.abs().max(travel_m.right.abs());
        let profile = Trapezoid::new(farther_m, speed_m_s, setting.acceleration_m_s2);
        let duration_s = profile.duration_s;
        stretches.push(Stretch { from_s: t_s, profile, from_rad: angle_rad, turn_rad });
        t_s += duration_s;
        angle_rad = angle_rad.zip_with(turn_rad, |angle, turn| angle + turn);
    }
    let end_s = t_s + standstill_s;
    read_s.push(end_s);
    let mut times: Vec<f64> = if setting.between_rows_s < end_s {
        std::iter::successors(Some(0.0), |t_s| Some(t_s + setting.between_rows_s))
            .take_while(|t_s| *t_s < end_s)
            .collect()
    } else {
        std::iter::once(0.0).chain(stretches.iter().map(|stretch| stretch.from_s).filter(|t_s| *t_s > 0.0)).collect()
    };
    if even {
        // The last row is the first at even intervals after the robot stands.
        times.push(times.last()? + setting.between_rows_s);
    } else {
        times.retain(|t_s| *t_s < end_s - 1e-9);
        times.push(end_s);
    }
    let mut rows = Wheels { left: Vec::with_capacity(times.len()), right: Vec::with_capacity(times.len()) };
    for t_s in &times {
        let at = stretches.partition_point(|stretch| stretch.from_s <= *t_s);
        let angle_rad = at.checked_sub(1).map_or(phase_rad, |at| {
            let Stretch { from_s, profile, from_rad, turn_rad } = &stretches[at];
            let share = profile.share((t_s - from_s).min(profile.duration_s));
            from_rad.zip_with(*turn_rad, |from, turn| from + share * turn)
        });
        rows.left.push(angle_rad.left);
        rows.right.push(angle_rad.right);
    }
    Some(Log { t_s: times, angle_rad: rows, read_s })
}

/// A trapezoid of speed over a way.
struct Trapezoid {
    distance_m: f64,
    top_m_s: f64,
    acceleration_m_s2: f64,
    duration_s: f64,
}

impl Trapezoid {
    fn new(distance_m: f64, speed_m_s: f64, acceleration_m_s2: f64) -> Self {
        let top_m_s = speed_m_s.min((distance_m * acceleration_m_s2).sqrt()).max(f64::MIN_POSITIVE);
        Self { distance_m, top_m_s, acceleration_m_s2, duration_s: distance_m / top_m_s + top_m_s / acceleration_m_s2 }
    }

    /// Fraction of the distance driven after a time.
    fn share(&self, t_s: f64) -> f64 {
        let ramp_s = self.top_m_s / self.acceleration_m_s2;
        let gone_m = if t_s < ramp_s {
            0.5 * self.acceleration_m_s2 * t_s * t_s
        } else if t_s < self.duration_s - ramp_s {
            self.top_m_s * (t_s - 0.5 * ramp_s)
        } else {
            self.distance_m - 0.5 * self.acceleration_m_s2 * (self.duration_s - t_s).max(0.0).powi(2)
        };
        gone_m / self.distance_m
    }
}

/// When a run that is not driven yet is looked at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Measurements<'a> {
    /// As the data's instrument measures.
    AsSoFar,
    /// At the start and at shares of the run's duration.
    At(&'a [f64]),
}

/// A run as it would be recorded if the robot were as the model says and nothing had noise.
pub(crate) fn planned_run(
    program: &MotionProgram,
    setting: &Setting,
    speed_m_s: f64,
    model: &Model,
    phase_rad: Wheels<f64>,
    measurements: Measurements<'_>,
) -> Option<Run> {
    let log = log(program, setting, speed_m_s, phase_rad)?;
    let end_s = *log.t_s.last()?;
    let times: Vec<f64> = match (measurements, setting.reading) {
        (Measurements::At(shares), Reading::Even(_)) => {
            // At rows: between rows that come rarely a pose is known too badly to be used.
            std::iter::once(0.0).chain(shares.iter().map(|share| nearest(&log.t_s, share * end_s))).collect()
        }
        (Measurements::At(shares), _) => std::iter::once(0.0).chain(shares.iter().map(|share| share * end_s)).collect(),
        (Measurements::AsSoFar, Reading::AtEnds) => vec![0.0, end_s],
        (Measurements::AsSoFar, Reading::Standing) => log.read_s.iter().map(|read_s| read_s.min(end_s)).collect(),
        (Measurements::AsSoFar, Reading::Even(between_s)) => {
            let mut times: Vec<f64> = std::iter::successors(Some(0.0), |t_s| Some(t_s + between_s))
                .take_while(|t_s| *t_s < end_s - 0.5 * between_s)
                .collect();
            times.push(end_s);
            times
        }
    };
    let poses = measured_poses(&log, &times, model);
    let info = RunInfo {
        id: program.id.clone(),
        protocol: Some(program.protocol),
        settings: program.settings,
        ..RunInfo::default()
    };
    let mut run = Run { info, ..Run::default() };
    if setting.relative && measurements == Measurements::AsSoFar {
        run.displacements = poses.windows(2).map(displacement).collect();
    } else {
        let heading =
            |pose: &Pose| (setting.sees_heading || measurements != Measurements::AsSoFar).then_some(pose.theta_rad);
        run.truth = poses.iter().map(|(t_s, pose)| TruthSample::new(*t_s, pose.x_m, pose.y_m, heading(pose))).collect();
    }
    let wheels = if setting.twist { twist(&log, setting)? } else { WheelLog::Angles(log.angle_rad) };
    run.odometry = Odometry { t_s: log.t_s.into(), wheels, ..Odometry::default() };
    Some(run)
}

/// The instant of the row that is nearest to another instant.
fn nearest(rows_s: &[f64], t_s: f64) -> f64 {
    let after = rows_s.partition_point(|row_s| *row_s < t_s).clamp(1, rows_s.len() - 1);
    let (before_s, after_s) = (rows_s[after - 1], rows_s[after]);
    if t_s - before_s < after_s - t_s { before_s } else { after_s }
}

/// The instrument's poses at some instants.
fn measured_poses(log: &Log, times: &[f64], model: &Model) -> Vec<(f64, Pose)> {
    let (mut pose, mut row) = (Pose::IDENTITY, 0);
    let step = |row: usize, share: f64| {
        let turned = |side: &Vec<f64>| share * (side[row + 1] - side[row]);
        let travel_m = log.angle_rad.as_ref().map(turned).zip_with(model.m_per_rad, |rad, m_per_rad| rad * m_per_rad);
        Increment::from_travel(travel_m, model.separation_m).arc()
    };
    times
        .iter()
        .map(|&t_s| {
            let at_s = (t_s - model.latency_s).max(0.0);
            while row + 1 < log.t_s.len() && log.t_s[row + 1] <= at_s {
                pose = pose * step(row, 1.0);
                row += 1;
            }
            let here = if row + 1 < log.t_s.len() {
                pose * step(row, (at_s - log.t_s[row]) / (log.t_s[row + 1] - log.t_s[row]))
            } else {
                pose
            };
            (t_s, here * model.body_from_sensor)
        })
        .collect()
}

fn displacement(pair: &[(f64, Pose)]) -> Displacement {
    let moved = pair[0].1.to(pair[1].1);
    Displacement { t0_s: pair[0].0, t1_s: pair[1].0, dx_m: moved.x_m, dy_m: moved.y_m, dtheta_rad: moved.theta_rad }
}

fn twist(log: &Log, setting: &Setting) -> Option<WheelLog> {
    let geometry = setting.robot.geometry().ok()?;
    let (mut v_mps, mut omega_radps) = (vec![0.0], vec![0.0]);
    for row in 1..log.t_s.len() {
        let dt_s = log.t_s[row] - log.t_s[row - 1];
        let travel_m = log
            .angle_rad
            .as_ref()
            .map(|side| side[row] - side[row - 1])
            .zip_with(geometry.m_per_rad(), |rad, m_per_rad| rad * m_per_rad);
        let increment = geometry.increment(travel_m);
        v_mps.push(increment.distance_m / dt_s);
        omega_radps.push(increment.turn_rad / dt_s);
    }
    Some(WheelLog::Twist { v_mps, omega_radps })
}

/// Where wheels stand at the start of run after run, radians: nobody sets them, so that they are spread
/// evenly (multiples of two irrational shares of a turn).
pub(crate) fn phase_rad(run: u32) -> Wheels<f64> {
    let at = |share: f64| TAU * (f64::from(run) * share).fract();
    Wheels { left: at(0.618_034), right: at(0.414_214) }
}

/// A pair of runs of a manoeuvre.
pub(crate) fn planned(manoeuvre: &Manoeuvre, setting: &Setting, model: &Model) -> Dataset {
    let programs = manoeuvre.schedule.with_pairs(1).programs();
    let runs = programs.iter().zip(0..).filter_map(|(program, number)| {
        planned_run(program, setting, manoeuvre.speed_m_s, model, phase_rad(number), Measurements::AsSoFar)
    });
    of_runs(setting, runs.collect())
}

/// Runs as a dataset of the setting's robot.
pub(crate) fn of_runs(setting: &Setting, runs: Vec<Run>) -> Dataset {
    Dataset {
        provenance: Provenance::default(),
        robot: setting.robot,
        truth_noise: TruthNoise::default(),
        points: Vec::new(),
        runs,
    }
}

/// Runs of one manoeuvre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Part {
    pub(crate) manoeuvre: Manoeuvre,
    pub(crate) pairs: u32,
}

impl Part {
    pub(crate) fn schedule(&self) -> Schedule {
        self.manoeuvre.schedule.with_pairs(self.pairs)
    }
}

/// The normal equations of a pair of runs of each manoeuvre for a fit's own terms and some more.
pub(crate) fn equations_of(
    fit: &ModelFit<'_>,
    all: &[Candidate],
    setting: &Setting,
    manoeuvres: &[Manoeuvre],
) -> Vec<(Manoeuvre, NormalEquations)> {
    manoeuvres
        .par_iter()
        .filter_map(|manoeuvre| {
            let dataset = planned(manoeuvre, setting, &fit.solution.model);
            let planned = fit.on_planned_runs(&[dataset.session()]);
            Some((*manoeuvre, total(&planned.scan(&mut terms(all)).runs)?))
        })
        .collect()
}

/// Where to measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Where {
    pub(super) direction: usize,
    /// Share of the run's duration.
    pub(super) share: f64,
    /// 0 along, 1 across, 2 heading.
    pub(super) component: usize,
}

#[cfg(test)]
pub(super) mod tests;
