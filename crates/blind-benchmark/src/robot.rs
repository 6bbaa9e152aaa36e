//! Random robots and what they drive: geometry, speeds, noise, calibration errors and one of several families
//! of paths.
//!
//! A robot drives one or two sessions, each at its own speed, and a held-out log on other paths of the
//! family. Loads and jitter of the log, which some effects need to show at all, are there in many cases
//! without such an effect: a record that has them says nothing.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use dataset::{Protocol, ProtocolSettings};
use effects::{CATALOGUE, Effect, HostRobot, Needs, harmless};
use motion_programs::{Motion, MotionProgram, Schedule};
use scenario::{Log, Scenario};

use super::draw::Draw;

const TEMPLATE: &str = include_str!("../../../scenarios/motion-capture.toml");

/// What paths a case has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
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
    /// What the runs carry in turn, kilograms; empty where the record says nothing of loads.
    pub(crate) payload_kg: Vec<f64>,
    /// Jitter of the log's stamps, seconds; 0 where the log keeps its beat.
    pub(crate) jitter_s: f64,
}

/// Counts per metre of the shipped robot's drive, at which its controllers are tuned.
const COUNTS_PER_M: f64 = 80_000.0;

impl RandomRobot {
    pub(crate) fn draw(draw: &mut Draw, needs: Needs) -> Result<Self, scenario::ScenarioError> {
        let mut base = Scenario::parse(TEMPLATE, "motion-capture.toml")?;
        let diameter_m = draw.uniform(0.06, 0.25);
        base.robot.left_wheel_diameter_m = diameter_m;
        base.robot.right_wheel_diameter_m = diameter_m;
        base.robot.wheel_separation_m = draw.uniform(0.2, 0.6);
        base.robot.encoder.gear_ratio =
            COUNTS_PER_M * PI * diameter_m / (scenario::QUADRATURE_DECODING * base.robot.encoder.lines_per_rev);
        base.robot.controller.right_phase_s = 0.0;
        base.noise.wheel_sigma_m_per_sqrt_m = draw.log_uniform(1e-4, 8e-4);
        base.log = Some(Log { interval_s: if draw.chance(0.5) { 0.05 } else { 0.025 } });
        for instrument in &mut base.instruments {
            if let scenario::Instrument::MotionCapture { rate_hz, sigma_xy_m, sigma_theta_rad, .. } = instrument {
                // Noise-free: what the measurements err by is added when they are chosen.
                (*rate_hz, *sigma_xy_m, *sigma_theta_rad) = (RATE_HZ, 0.0, 0.0);
            }
        }
        base.effects = vec![
            Effect::WheelScale(effects::WheelScale { scale: draw.uniform(0.985, 1.015) }),
            Effect::WheelMismatch(effects::WheelMismatch { right_over_left: draw.uniform(0.995, 1.005) }),
            Effect::Wheelbase(effects::Wheelbase { ratio: draw.uniform(0.97, 1.03) }),
        ];
        let payload_kg = if needs.payload || draw.chance(0.2) {
            let load = draw.uniform(2.0, 10.0);
            if draw.chance(0.5) { vec![0.0, load] } else { vec![0.0, 0.5 * load, load] }
        } else {
            Vec::new()
        };
        let jitter_s = if needs.jitter || draw.chance(0.2) { draw.uniform(0.001, 0.008) } else { 0.0 };
        let family = PathFamily::ALL[draw.below(PathFamily::ALL.len())];
        let two = draw.chance(0.5);
        let share = if two { 0.5 } else { 1.0 };
        let sessions: Vec<SessionPlan> =
            (0..if two { 2 } else { 1 }).map(|_| session(&base, family, share, draw)).collect();
        // At the first session's speed, on other paths of the family: what was never excited is no fair
        // question.
        let scenario = sessions[0].scenario.clone();
        let held_out = SessionPlan { programs: programs(family, &scenario, 0.5, draw), scenario };
        Ok(Self { family, sessions, held_out, payload_kg, jitter_s })
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

/// Measurements of the simulated instrument a second, of which a case takes some.
pub(crate) const RATE_HZ: f64 = 20.0;

/// Radius of the tightest arc in wheelbases: the inner wheel runs at a sixth of the outer one's speed, which
/// the controllers can still do.
const MIN_ARC_RADIUS_RATIO: f64 = 0.7;

fn session(base: &Scenario, family: PathFamily, share: f64, draw: &mut Draw) -> SessionPlan {
    let mut scenario = base.clone();
    scenario.robot.cruise_speed_m_s = draw.uniform(0.15, 0.5);
    scenario.robot.acceleration_m_s2 = draw.uniform(0.3, 1.0);
    let programs = programs(family, &scenario, share, draw);
    SessionPlan { scenario, programs }
}

/// `pairs` times a share, at least one.
fn pairs(pairs: f64, share: f64) -> u32 {
    ((pairs * share).round() as u32).max(1)
}

fn programs(family: PathFamily, scenario: &Scenario, share: f64, draw: &mut Draw) -> Vec<MotionProgram> {
    // Ways in seconds of driving, so that slow robots do not drive for hours.
    let speed_m_s = scenario.robot.cruise_speed_m_s;
    let tightest_m = MIN_ARC_RADIUS_RATIO * scenario.robot.wheel_separation_m;
    let mut distance_m = |low_s: f64, high_s: f64| speed_m_s * draw.uniform(low_s, high_s);
    let straights = Schedule::Straights { length_m: distance_m(3.0, 7.0), runs: 2 * pairs(3.0, share) };
    let squares = Schedule::Squares { side_m: distance_m(2.0, 4.0), runs_each_way: pairs(2.0, share) };
    let radius_m = distance_m(1.0, 2.5).max(tightest_m);
    let circles = Schedule::Circles { radius_m, turns: None, runs_each_way: pairs(2.0, share) };
    let schedules = match family {
        PathFamily::Protocols => {
            vec![straights, Schedule::Spins { turn_rad: TAU, runs: 2 * pairs(2.0, share) }, squares, circles]
        }
        PathFamily::Squares => vec![squares.with_pairs(pairs(4.0, share))],
        PathFamily::Circles => {
            let wider =
                Schedule::Circles { radius_m: 1.8 * radius_m, turns: Some(0.5), runs_each_way: pairs(2.0, share) };
            vec![circles, wider, straights]
        }
        PathFamily::Free | PathFamily::Forward => {
            let runs = 2 * pairs(6.0, share);
            return (0..runs)
                .map(|run| free(run, family == PathFamily::Forward, (speed_m_s, tightest_m), draw))
                .collect();
        }
    };
    programs_of(&schedules)
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

fn free(run: u32, forward: bool, (speed_m_s, tightest_m): (f64, f64), draw: &mut Draw) -> MotionProgram {
    let motions = (0..5)
        .map(|_| {
            let length_m = speed_m_s * draw.uniform(1.5, 4.0);
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
