//! Random robots and what they drive: geometry, speeds, noise, calibration errors and one of several families
//! of paths.
//!
//! A robot drives one or two sessions, each at its own speed, and a held-out log on other paths of the
//! family. Loads and jitter of the log, which some effects need to show at all, are there in many cases
//! without such an effect: a record that has them says nothing.

use std::f64::consts::{FRAC_PI_2, TAU};

use dataset::{Protocol, ProtocolSettings};
use effects::{CATALOGUE, Effect, HostRobot, Needs, harmless};
use motion_programs::{DriveLimits, Motion, MotionProgram, Schedule};
use scenario::{Log, Scenario};

use super::conditions::{Conditions, Stamps, USUAL_SEPARATION_M};
use super::draw::{CaseDraws, Draw};
use super::ripple::SLACK_GAIN;

const TEMPLATE: &str = scenario::MOTION_CAPTURE;

/// What paths a case has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PathFamily {
    /// Straights in both directions, spins, squares and circles.
    Protocols,
    /// Straights, spins and arcs in any order, with reversals.
    Free,
    /// Straights and arcs, never backward and never on the spot.
    Forward,
    /// UMBmark's squares, in both directions.
    Squares,
    /// Circles of two radii, in both directions, and straights.
    Circles,
}

impl PathFamily {
    const ALL: [Self; 5] = [Self::Protocols, Self::Free, Self::Forward, Self::Squares, Self::Circles];
}

/// One session: a scenario whose effects are the calibration errors alone, and its programs.
#[derive(Debug, Clone)]
pub(crate) struct SessionPlan {
    pub(crate) scenario: Scenario,
    pub(crate) programs: Vec<MotionProgram>,
}

/// A random robot with what it drives.
#[derive(Debug, Clone)]
pub(crate) struct RandomRobot {
    pub(crate) family: PathFamily,
    pub(crate) sessions: Vec<SessionPlan>,
    pub(crate) held_out: SessionPlan,
    /// A session of other paths, speed and acceleration.
    pub(crate) other: SessionPlan,
    /// What the runs carry in turn, kilograms; empty where the record says nothing of loads.
    pub(crate) payload_kg: Vec<f64>,
    /// Jitter of the log's stamps where the readings jitter with them, seconds.
    pub(crate) jitter_s: f64,
}

/// Most rows of a log, and most measurements, of a case: fast logs are short.
const MAX_ROWS: f64 = 6_000.0;
const MAX_MEASUREMENTS: f64 = 1_500.0;
/// The held-out log is driven so long, seconds.
const HELD_OUT_S: f64 = 60.0;
/// Standing before the first motion of a run and after its last, seconds: a log is started and stopped by
/// hand.
const STANDING_S: f64 = 0.6;
/// Standing between what would be two runs and is one, seconds.
const BETWEEN_PROGRAMS_S: f64 = 1.0;

impl RandomRobot {
    pub(crate) fn draw(
        draws: CaseDraws,
        conditions: &Conditions,
        rate_hz: f64,
        needs: Needs,
    ) -> Result<Self, scenario::ScenarioError> {
        let mut draw = draws.of("robot");
        let base = scenario(conditions, &mut draw)?;
        let payload_kg = if needs.payload || draw.bernoulli(0.2) {
            // A load goes with the size.
            let load = draw.uniform(2.0, 10.0) * conditions.wheel_separation_m / USUAL_SEPARATION_M;
            if draw.bernoulli(0.5) { vec![0.0, load] } else { vec![0.0, 0.5 * load, load] }
        } else {
            Vec::new()
        };
        let jitter_s = if let Stamps::Irregular { jitter_s } = conditions.stamps { jitter_s } else { 0.0 };
        let family = PathFamily::ALL[draw.below(PathFamily::ALL.len())];
        let sessions = if conditions.runs > 1 && draw.bernoulli(0.5) { 2 } else { 1 };
        let driving_s = conditions.driving_s.min(MAX_ROWS / conditions.log_rate_hz).min(MAX_MEASUREMENTS / rate_hz)
            / f64::from(sessions);
        let mut paths = draws.of("paths");
        let sessions: Vec<SessionPlan> = (0..sessions)
            .map(|session| {
                let scenario = at_drawn_speed(base.clone(), conditions, &mut paths);
                // The first session has the odd run.
                let runs = (conditions.runs + sessions - 1 - session) / sessions;
                let programs = programs(family, &scenario, driving_s, runs, &mut paths);
                SessionPlan { programs: in_runs(&programs, runs), scenario }
            })
            .collect();
        // At the first session's speed, on other paths of the family: what was never excited is no fair
        // question.
        let scenario = sessions[0].scenario.clone();
        let held_out = SessionPlan { programs: programs(family, &scenario, HELD_OUT_S, 1, &mut paths), scenario };
        let other = other_session(family, base, conditions, &payload_kg, &mut draws.of("other session"));
        Ok(Self { family, sessions, held_out, other, payload_kg, jitter_s })
    }

    /// The robot as effects know it that are hidden in it.
    pub(crate) fn host(&self) -> HostRobot {
        let (cruise_speed_m_s, acceleration_m_s2) =
            self.sessions.iter().fold((0.0_f64, f64::INFINITY), |(v, a), session| {
                let robot = &session.scenario.robot;
                (v.max(robot.cruise_speed_m_s), a.min(robot.acceleration_m_s2))
            });
        HostRobot {
            cruise_speed_m_s,
            acceleration_m_s2,
            wheel_separation_m: self.sessions[0].scenario.robot.wheel_separation_m,
            payload_kg: self.payload_kg.clone(),
            jitter_s: self.jitter_s,
        }
    }

    /// The effects that the records need beside what is hidden: loads and jitter without any harm.
    pub(crate) fn harmless(&self, hidden: &[&str]) -> Vec<Effect> {
        let host = self.host();
        let others = CATALOGUE.iter().filter(|id| !hidden.contains(id));
        others.filter_map(|id| harmless(id, &host)).collect()
    }
}

/// The robot at the speed and acceleration of one session.
fn at_drawn_speed(mut scenario: Scenario, conditions: &Conditions, draw: &mut Draw) -> Scenario {
    scenario.robot.cruise_speed_m_s = conditions.speed_scale * draw.uniform(0.15, 0.5);
    scenario.robot.acceleration_m_s2 = conditions.speed_scale * draw.uniform(0.3, 1.0);
    scenario
}

/// A session of another family of paths, at a speed and an acceleration of its own; it carries each load of
/// the robot's for some runs.
fn other_session(
    family: PathFamily,
    base: Scenario,
    conditions: &Conditions,
    payload_kg: &[f64],
    draw: &mut Draw,
) -> SessionPlan {
    let others: Vec<PathFamily> = PathFamily::ALL.into_iter().filter(|other| *other != family).collect();
    let family = others[draw.below(others.len())];
    let scenario = at_drawn_speed(base, conditions, draw);
    let runs = payload_kg.len().max(2) as u32;
    SessionPlan { programs: programs(family, &scenario, HELD_OUT_S, runs, draw), scenario }
}

/// The robot without what is hidden; its effects are the calibration errors alone.
fn scenario(conditions: &Conditions, draw: &mut Draw) -> Result<Scenario, scenario::ScenarioError> {
    let mut base = Scenario::parse(TEMPLATE, "motion-capture.toml")?;
    base.robot.left_wheel_diameter_m = conditions.wheel_diameter_m;
    base.robot.right_wheel_diameter_m = conditions.wheel_diameter_m;
    base.robot.wheel_separation_m = conditions.wheel_separation_m;
    base.robot.encoder.gear_ratio = f64::from(conditions.counts_per_tick()) * conditions.ticks_per_turn
        / (scenario::QUADRATURE_DECODING * base.robot.encoder.lines_per_rev);
    base.robot.controller.right_phase_s = 0.0;
    if conditions.ripple.is_some() {
        base.robot.controller.gain = SLACK_GAIN;
    }
    base.noise.wheel_sigma_m_per_sqrt_m = conditions.wheel_sigma_m_per_sqrt_m;
    base.log = Some(Log { interval_s: 1.0 / conditions.log_rate_hz });
    for instrument in &mut base.instruments {
        if let scenario::Instrument::MotionCapture { sigma_xy_m, sigma_theta_rad, .. } = instrument {
            // Noise-free: what the measurements err by is added when they are chosen.
            (*sigma_xy_m, *sigma_theta_rad) = (0.0, 0.0);
        }
    }
    base.effects = vec![
        Effect::WheelScale(effects::WheelScale { scale: draw.uniform(0.985, 1.015) }),
        Effect::WheelMismatch(effects::WheelMismatch { right_over_left: draw.uniform(0.995, 1.005) }),
        Effect::Wheelbase(effects::Wheelbase { ratio: draw.uniform(0.97, 1.03) }),
    ];
    Ok(base)
}

/// Radius of the tightest arc in wheelbases: the inner wheel runs at a sixth of the outer one's speed, which
/// the controllers can still do.
const MIN_ARC_RADIUS_RATIO: f64 = 0.7;
/// Ways are shortened to this share at the least, where many runs are wanted in a short time.
const MIN_LENGTH_SHARE: f64 = 0.35;
/// In steps of this factor.
const SHORTER: f64 = 0.85;
/// Motions of a free run.
const FREE_MOTIONS: usize = 5;

/// Programs of a family that take so many seconds of driving, as many as runs are wanted where the time
/// allows it.
fn programs(family: PathFamily, scenario: &Scenario, driving_s: f64, runs: u32, draw: &mut Draw) -> Vec<MotionProgram> {
    let robot = &scenario.robot;
    let drive_limits = DriveLimits {
        wheel_separation_m: robot.wheel_separation_m,
        cruise_speed_m_s: robot.cruise_speed_m_s,
        acceleration_m_s2: robot.acceleration_m_s2,
        handling_s: 2.0 * STANDING_S,
    };
    let takes_s = |programs: &[MotionProgram]| -> f64 {
        60.0 * programs.iter().map(|program| drive_limits.cost(program).minutes).sum::<f64>()
    };
    let tightest_m = MIN_ARC_RADIUS_RATIO * robot.wheel_separation_m;
    if matches!(family, PathFamily::Free | PathFamily::Forward) {
        let mut programs: Vec<MotionProgram> = Vec::new();
        let share = (driving_s / (FREE_RUN_S * f64::from(runs))).clamp(MIN_LENGTH_SHARE, 1.0);
        while programs.len() < 2 || takes_s(&programs) < driving_s {
            programs.push(free(
                programs.len(),
                family == PathFamily::Forward,
                robot.cruise_speed_m_s,
                tightest_m,
                share,
                draw,
            ));
        }
        return programs;
    }
    // Ways in seconds of driving, so that slow robots do not drive for hours.
    let seconds = [draw.uniform(3.0, 7.0), draw.uniform(2.0, 4.0), draw.uniform(1.0, 2.5)];
    let mut share = 1.0;
    loop {
        let [straight_m, side_m, radius_m] = seconds.map(|time_s| robot.cruise_speed_m_s * time_s * share);
        let radius_m = radius_m.max(tightest_m);
        let schedules = |times: f64| programs_of(&schedules(family, straight_m, side_m, radius_m, times));
        let times = driving_s / takes_s(&schedules(1.0));
        let programs = schedules(times);
        let is_enough = programs.len() >= runs as usize && takes_s(&programs) < MAX_OVERTIME * driving_s;
        if is_enough || share * SHORTER < MIN_LENGTH_SHARE {
            return programs;
        }
        share *= SHORTER;
    }
}

/// A free run takes about so long, seconds.
const FREE_RUN_S: f64 = 18.0;
/// One pair of each kind may take longer than there is time, by this factor before ways are shortened.
const MAX_OVERTIME: f64 = 1.5;

/// The schedules of a family whose runs are protocols, so many times its usual number of each.
fn schedules(family: PathFamily, length_m: f64, side_m: f64, radius_m: f64, times: f64) -> Vec<Schedule> {
    let pairs = |usual: f64| ((usual * times).round() as u32).max(1);
    let straights = Schedule::Straights { length_m, runs: 2 * pairs(3.0) };
    let squares = Schedule::Squares { side_m, runs_each_way: pairs(2.0) };
    let circles = Schedule::Circles { radius_m, turns: None, runs_each_way: pairs(2.0) };
    match family {
        PathFamily::Squares => vec![squares.with_pairs(pairs(4.0))],
        PathFamily::Circles => {
            let wider = Schedule::Circles { radius_m: 1.8 * radius_m, turns: Some(0.5), runs_each_way: pairs(2.0) };
            vec![circles, wider, straights]
        }
        PathFamily::Protocols | PathFamily::Free | PathFamily::Forward => {
            vec![straights, Schedule::Spins { turn_rad: TAU, runs: 2 * pairs(2.0) }, squares, circles]
        }
    }
}

/// The same driving in so many runs at the most: what comes one after the other joins, with a stop in
/// between.
fn in_runs(programs: &[MotionProgram], runs: u32) -> Vec<MotionProgram> {
    let (count, runs) = (programs.len(), (runs as usize).clamp(1, programs.len().max(1)));
    let stand = |duration_s| Motion::Pause { duration_s };
    (0..runs)
        .map(|run| {
            let part = &programs[run * count / runs..(run + 1) * count / runs];
            let mut motions = vec![stand(STANDING_S)];
            for (place, program) in part.iter().enumerate() {
                if place > 0 {
                    motions.push(stand(BETWEEN_PROGRAMS_S));
                }
                motions.extend(&program.motions);
            }
            motions.push(stand(STANDING_S));
            match part {
                // Free runs have numbers, which would be those of others among runs that were joined.
                [alone] if alone.protocol != Protocol::Free => MotionProgram { motions, ..alone.clone() },
                _ => MotionProgram {
                    id: format!("run_{run:03}"),
                    protocol: Protocol::Free,
                    settings: ProtocolSettings::default(),
                    motions,
                },
            }
        })
        .collect()
}

/// The programs of some schedules, each with a name of its own.
pub(crate) fn programs_of(schedules: &[Schedule]) -> Vec<MotionProgram> {
    let mut programs: Vec<MotionProgram> = Vec::new();
    for (number, schedule) in schedules.iter().enumerate() {
        for mut program in schedule.programs() {
            // Circles of two radii have the same names.
            if programs.iter().any(|known| known.id == program.id) {
                program.id = format!("{}_{number}", program.id);
            }
            programs.push(program);
        }
    }
    programs
}

fn free(run: usize, forward: bool, speed_m_s: f64, tightest_m: f64, share: f64, draw: &mut Draw) -> MotionProgram {
    let motions = (0..FREE_MOTIONS)
        .map(|_| {
            let length_m = share * speed_m_s * draw.uniform(1.5, 4.0);
            match draw.below(3) {
                0 => Motion::Straight { length_m: if forward { length_m } else { draw.sign() * length_m } },
                1 if !forward => Motion::Spin { turn_rad: draw.sign() * draw.uniform(0.5, 1.3 * FRAC_PI_2) },
                _ => {
                    let radius_m = tightest_m * draw.uniform(1.0, 4.0);
                    Motion::Arc { radius_m, turn_rad: draw.sign() * length_m / radius_m }
                }
            }
        })
        .collect();
    let settings = ProtocolSettings::default();
    MotionProgram { id: format!("run_{run:03}"), protocol: Protocol::Free, settings, motions }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn runs_that_are_joined_and_runs_that_stay_alone_have_names_of_their_own() {
        let program = |run: usize| MotionProgram {
            id: format!("run_{run:03}"),
            protocol: Protocol::Free,
            settings: ProtocolSettings::default(),
            motions: Vec::new(),
        };
        for programs in 1..12 {
            let all: Vec<MotionProgram> = (0..programs).map(program).collect();
            for runs in 1..=programs as u32 {
                let joined = in_runs(&all, runs);
                let ids: BTreeSet<&str> = joined.iter().map(|run| run.id.as_str()).collect();
                // Rejects 7 programs in 5 runs, of which the fifth and the fourth were run_004.
                assert_eq!(ids.len(), runs as usize, "{programs} programs in {runs} runs: {ids:?}");
            }
        }
    }
}
