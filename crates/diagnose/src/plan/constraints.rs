//! Constraints of a next experiment: the robot's speed, how it is logged and measured, the floor, the time.

use dataset::{Dataset, NominalRobot, Run, WheelLog};
use kinematics::{Point, Pose, Rule};
use scenario::{Budget, Instrument, Scenario};

use crate::fits::augmented_model::AugmentedModel;
use crate::gain::extended_scenario::SamplingStatistics;
use crate::settings::plan::{HANDLING_S, MINUTES};
use crate::settings::{FINDINGS, PLAN};

/// What the user allows; `None` is taken from the data or the scenario.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Limits {
    /// Sides of the floor, metres, walls to walls.
    pub room_m: Option<[f64; 2]>,
    /// Time for driving and handling, minutes.
    pub minutes: Option<f64>,
    /// Fastest wheel that may be commanded, m/s.
    pub top_speed_m_s: Option<f64>,
}

/// When the instrument measures in a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Reading {
    /// At even intervals of so many seconds.
    Even(f64),
    /// The standing robot is read, at the start, where a program says and at the end.
    Standing,
    /// The same, at the start and at the end alone.
    AtEnds,
}

/// The setting of an experiment.
#[derive(Debug, Clone)]
pub(crate) struct Setting {
    pub(crate) robot: NominalRobot,
    pub(crate) top_speed_m_s: f64,
    pub(crate) acceleration_m_s2: f64,
    pub(crate) between_rows_s: f64,
    pub(crate) reading: Reading,
    pub(crate) sees_heading: bool,
    /// The instrument sees displacements.
    pub(crate) relative: bool,
    /// The robot reports its twist alone.
    pub(crate) twist: bool,
    /// Sides over which the centre may move, metres.
    pub(crate) free_m: [f64; 2],
    pub(crate) minutes: f64,
    pub(crate) handling_s: f64,
    /// Where floor and time come from, for people.
    pub(crate) within: String,
}

impl Setting {
    /// That of the data, as far as the user does not say otherwise.
    pub(crate) fn of_data(datasets: &[Dataset], model: &AugmentedModel<'_>, limits: &Limits) -> Option<Self> {
        let first = datasets.first()?;
        let sampling = SamplingStatistics::of(datasets, model);
        let separation_m = first.robot.wheel_separation_m;
        let (free_m, floor) = match limits.room_m {
            Some(room_m) => (room_m.map(|side| side - PLAN.clearance_separations * separation_m), of_room(room_m)),
            None => {
                let [x_m, y_m] = moved_over_m(datasets);
                ([x_m, y_m], format!("the {x_m:.1} m by {y_m:.1} m over which the robot moved so far"))
            }
        };
        let runs = || datasets.iter().flat_map(|dataset| &dataset.runs);
        let (minutes, time) = minutes(limits, MINUTES);
        let between = |run: &Run| run.truth.len() > 2 || run.displacements.len() > 1 || !run.point_readings.is_empty();
        let reading = if sampling.between_measurements_s <= FINDINGS.standing_reading_interval_s {
            Reading::Even(sampling.between_measurements_s)
        } else if runs().any(between) {
            Reading::Standing
        } else {
            Reading::AtEnds
        };
        Some(Self {
            robot: first.robot,
            top_speed_m_s: limits.top_speed_m_s.unwrap_or(sampling.speed_m_s),
            acceleration_m_s2: sampling.acceleration_m_s2.unwrap_or(PLAN.default_acceleration_m_s2),
            between_rows_s: sampling.between_rows_s,
            reading,
            sees_heading: !runs().any(|run| run.truth.iter().any(|sample| sample.theta_rad().is_none())),
            relative: runs().all(|run| run.truth.is_empty() && run.point_readings.is_empty()),
            twist: runs().any(|run| matches!(run.odometry.wheels, WheelLog::Speeds(_) | WheelLog::Twist { .. })),
            free_m,
            minutes,
            handling_s: HANDLING_S,
            within: format!("within {floor} and {time}, with {HANDLING_S:.0} s to place the robot for each run"),
        })
    }

    /// That of a scenario; `None` when neither it nor the user says what floor there is.
    pub(crate) fn of_scenario(scenario: &Scenario, limits: &Limits) -> Option<Self> {
        let budget = scenario.budget.as_ref();
        let clearance_m =
            budget.map_or(PLAN.clearance_separations * scenario.robot.wheel_separation_m, |budget| budget.clearance_m);
        let stated = |budget: &Budget| [budget.room_x_m, budget.room_y_m];
        let room_m = limits.room_m.or_else(|| budget.map(stated))?;
        let of = if limits.room_m.is_some() { of_room(room_m) } else { format!("{} of [budget]", of_room(room_m)) };
        let handling_s = budget.and_then(|budget| budget.handling_s).unwrap_or(HANDLING_S);
        let (minutes, time) = minutes(limits, budget.and_then(|budget| budget.minutes).unwrap_or(MINUTES));
        let between_measurements_s = scenario.instruments.iter().find_map(|instrument| match *instrument {
            Instrument::MotionCapture { rate_hz, .. } => Some(1.0 / rate_hz),
            Instrument::Slam(slam) => Some(1.0 / slam.rate_hz),
            _ => None,
        });
        Some(Self {
            robot: scenario.robot.nominal(),
            top_speed_m_s: limits.top_speed_m_s.unwrap_or(scenario.robot.cruise_speed_m_s),
            acceleration_m_s2: scenario.robot.acceleration_m_s2,
            // Where only measurements come at intervals, a row stands beside each.
            between_rows_s: scenario.log.map_or(between_measurements_s.unwrap_or(f64::INFINITY), |log| log.interval_s),
            reading: between_measurements_s.map_or(Reading::Standing, Reading::Even),
            sees_heading: true,
            relative: false,
            twist: false,
            free_m: room_m.map(|side| side - clearance_m),
            minutes,
            handling_s,
            within: format!("within {of} and {time}, with {handling_s:.0} s to place the robot for each run"),
        })
    }

    pub(crate) fn drive_limits(&self, speed_m_s: f64) -> motion_programs::DriveLimits {
        motion_programs::DriveLimits {
            wheel_separation_m: self.robot.wheel_separation_m,
            cruise_speed_m_s: speed_m_s,
            acceleration_m_s2: self.acceleration_m_s2,
            handling_s: self.handling_s,
        }
    }

    /// The shorter and the longer side of what is free.
    pub(crate) fn sides_m(&self) -> (f64, f64) {
        let [x, y] = self.free_m;
        (x.min(y), x.max(y))
    }
}

fn of_room([x_m, y_m]: [f64; 2]) -> String {
    format!("the room of {x_m:.1} m by {y_m:.1} m")
}

fn minutes(limits: &Limits, otherwise: f64) -> (f64, String) {
    let minutes = limits.minutes.unwrap_or(otherwise);
    (minutes, format!("{minutes:.0} min"))
}

/// Over how much of the floor a robot moved, metres: of the runs that reached farthest, by what was seen,
/// or by dead reckoning where only displacements were.
#[must_use]
pub fn moved_over_m(datasets: &[Dataset]) -> [f64; 2] {
    let mut sides = [0.0_f64; 2];
    for dataset in datasets {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let mut see = |point: Point| {
            for (k, value) in [point.x_m, point.y_m].into_iter().enumerate() {
                (low[k], high[k]) = (low[k].min(value), high[k].max(value));
            }
        };
        for view in &dataset.session().runs {
            let truth = &view.run().truth;
            truth.iter().for_each(|sample| see(Point::new(sample.x_m, sample.y_m)));
            let poses = if truth.is_empty() { view.observed_poses() } else { Vec::new() };
            poses.iter().for_each(|(_, pose)| see(pose.position()));
            let between_ends = truth.len().max(poses.len()) <= 2;
            if let (true, Ok(geometry)) = (between_ends, dataset.robot.geometry()) {
                // What lies between two ends is known from the counts alone.
                let start = poses.first().map(|(_, pose)| *pose).or_else(|| {
                    let sample = truth.first()?;
                    Some(Pose::new(sample.x_m, sample.y_m, sample.theta_rad()?))
                });
                let start = start.unwrap_or(Pose::IDENTITY);
                view.dead_reckon(&dataset.robot, &geometry, Rule::Midpoint, start, |_, pose| see(pose.position()));
            }
        }
        for k in 0..2 {
            sides[k] = sides[k].max(high[k] - low[k]);
        }
    }
    sides
}
