//! The planned run: whether what diagnosis says to drive next leaves the right name alone.
//!
//! The robot of a case drives as planned, with what it hides and under the case's noise, and all of its
//! sessions are diagnosed together. What can be resolved at all is the oracle's to say: after the planned
//! runs, or after a battery of all kinds of runs on the same floor and in the same time, it must tell the
//! right name from every other one of the set.

use std::f64::consts::TAU;

use diagnose::{HANDLING_S, MINUTES, NextExperiment, Options, diagnose};
use motion_programs::{DriveLimits, Schedule};

use super::case::{Case, FurtherRuns};
use super::hidden::EffectKind;
use super::power::DISCRIMINATION_LEVEL;
use super::result::{CaseResult, Planned, Reported, reported};
use super::robot::{SessionPlan, programs_of};
use crate::error::ChallengeError;

/// Where so many rows or measurements would be recorded, nothing more is driven: that is not affordable.
const MAX_ROWS: f64 = 20_000.0;
const MAX_MEASUREMENTS: f64 = 6_000.0;

/// Whether a case's log and instrument are slow enough for what plans drive.
fn is_affordable(case: &Case) -> bool {
    let planned_s = 60.0 * MINUTES;
    planned_s * case.conditions.log_rate_hz <= MAX_ROWS && planned_s * case.instrument_model.rate_hz <= MAX_MEASUREMENTS
}

/// Drives as planned, where names were found together and the right one is among them.
pub(crate) fn planned(case: &Case, result: &CaseResult) -> Result<Option<Planned>, ChallengeError> {
    let [hidden] = &case.oracle[..] else { return Ok(None) };
    if !is_affordable(case) {
        return Ok(None);
    }
    let among = |reported: &&Reported| {
        reported.names.contains(&hidden.id) && reported.names.iter().filter(|name| *name != "unlisted").count() > 1
    };
    let (EffectKind::Mean, Some(found)) = (hidden.kind, result.findings().find(among)) else { return Ok(None) };
    let others = |name: &str| name != hidden.id && found.names.iter().any(|of| of == name);
    let resolves = |plans: Vec<SessionPlan>| -> Result<_, ChallengeError> {
        let more = drive(case, plans)?;
        let resolved = more.as_ref().is_some_and(|more| {
            more.rivals.iter().filter(|(name, _)| others(name)).all(|(_, left)| *left >= DISCRIMINATION_LEVEL)
        });
        Ok((resolved, more))
    };
    let mut planned = Planned {
        names: found.names.clone(),
        planned: false,
        resolved_by_plan: false,
        resolved_by_battery: false,
        reported: Vec::new(),
    };
    // The case was diagnosed without a plan, which takes time and is needed by few.
    let next = diagnose(&case.datasets, &Options::default()).ok().and_then(|found| found.document.next_experiment);
    if let Some(next) = next.filter(|next| next.predicted.is_some()) {
        let (resolved, more) = resolves(sessions(case, &next))?;
        (planned.planned, planned.resolved_by_plan) = (true, resolved);
        let all =
            case.datasets.iter().cloned().chain(more.into_iter().flat_map(|more| more.datasets)).collect::<Vec<_>>();
        if let Ok(diagnosis) = diagnose(&all, &Options::default()) {
            planned.reported = reported(&diagnosis.document, case);
        }
    }
    (planned.resolved_by_battery, _) = resolves(battery(case))?;
    Ok(Some(planned))
}

/// So much faster a plan is tried again that is too slow for the controllers' steps of speed, and how often.
const SPEED_UP: f64 = 1.25;
const MAX_FASTER: usize = 6;

/// Drives plans at their speeds, or as slowly as the controllers can; `None` where they cannot.
fn drive(case: &Case, mut plans: Vec<SessionPlan>) -> Result<Option<FurtherRuns>, ChallengeError> {
    for _ in 0..MAX_FASTER {
        match case.drive_more(&plans) {
            Err(ChallengeError::Simulation(_)) => {
                plans.iter_mut().for_each(|plan| plan.scenario.robot.cruise_speed_m_s *= SPEED_UP);
            }
            driven => return driven,
        }
    }
    Ok(None)
}

/// A session of the case's robot at some speed.
fn session(case: &Case, speed_m_s: f64, schedules: &[Schedule]) -> SessionPlan {
    let mut scenario = case.robot.sessions[0].scenario.clone();
    scenario.robot.cruise_speed_m_s = speed_m_s;
    SessionPlan { scenario, programs: programs_of(schedules) }
}

fn sessions(case: &Case, next: &NextExperiment) -> Vec<SessionPlan> {
    next.sessions.iter().map(|planned| session(case, planned.speed_m_s, &planned.schedules)).collect()
}

/// All kinds of runs on the floor over which the robot moved so far, as often as they fit the time that plans
/// have where nobody says otherwise.
fn battery(case: &Case) -> Vec<SessionPlan> {
    let [x_m, y_m] = diagnose::moved_over_m(&case.datasets);
    let (shorter_m, longer_m) = (x_m.min(y_m), x_m.max(y_m));
    let robot = &case.robot.sessions[0].scenario.robot;
    let speed_m_s = case.robot.sessions.iter().map(|plan| plan.scenario.robot.cruise_speed_m_s).fold(0.0, f64::max);
    let drive_limits = DriveLimits {
        wheel_separation_m: robot.wheel_separation_m,
        cruise_speed_m_s: speed_m_s,
        acceleration_m_s2: robot.acceleration_m_s2,
        handling_s: HANDLING_S,
    };
    let radius_m = 0.5 * shorter_m;
    let mut kinds =
        vec![Schedule::Straights { length_m: longer_m, runs: 2 }, Schedule::Spins { turn_rad: TAU, runs: 2 }];
    if radius_m > 0.5 * robot.wheel_separation_m {
        kinds.push(Schedule::Squares { side_m: shorter_m, runs_each_way: 1 });
        kinds.push(Schedule::Circles { radius_m, turns: None, runs_each_way: 1 });
    }
    let once: f64 = kinds.iter().flat_map(Schedule::programs).map(|program| drive_limits.cost(&program).minutes).sum();
    let pairs = ((MINUTES / once) as u32).max(1);
    let all: Vec<Schedule> = kinds.iter().map(|kind| kind.with_pairs(pairs)).collect();
    vec![session(case, speed_m_s, &all)]
}
