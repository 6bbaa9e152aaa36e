//! The drives of a case: with noise, as the tool gets them, and without, as the oracle and the held-out log
//! have them.
//!
//! A drive without noise has no wheel noise, no errors of measurements, no lost rows, true stamps, one clock,
//! and the controllers' own counts, which resolve a hundredth of a millimetre. What rounding and stamps do to
//! the measurements is in the oracle's variances instead ([`crate::oracle::TrueNoise`]).

use dataset::{Dataset, Provenance, Run, WheelLog};
use effects::{Effect, Forward, Quantization, StreamName};
use motion_programs::Platform;
use scenario::{Instrument, Scenario};
use sim_yair::SimulatedRobot;

use super::case_instrument::CaseInstrument;
use super::conditions::Conditions;
use super::draw::Draw;
use super::hidden::{ActingEffect, Hidden};
use super::instrument::InstrumentModel;
use super::log_model;
use super::ripple::SpeedRipple;
use super::robot::{RandomRobot, SessionPlan};
use crate::error::ChallengeError;

/// Where the held-out log's draws are, away from the sessions'.
pub(crate) const HELD_OUT_RUN: u32 = 16;
/// Where those of the session on other paths are.
pub(crate) const OTHER_SESSION: u32 = 24;
/// Where those of planned runs are.
pub(crate) const PLANNED: u32 = 8;

/// What the drives of one case share.
pub(crate) struct DriveContext<'c> {
    pub(crate) seed: u64,
    pub(crate) number: u64,
    pub(crate) conditions: &'c Conditions,
    pub(crate) robot: &'c RandomRobot,
    pub(crate) instrument_model: &'c InstrumentModel,
    /// The instrument that sees all cases, where one does.
    pub(crate) instrument: Option<CaseInstrument>,
}

/// How a drive is recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Recorded {
    /// With noise, as the tool gets it.
    AsLogged,
    /// With noise of robot and instrument, but rows have the controllers' own counts and the instants at
    /// which they were read, none is lost, and there is one clock.
    OfTheWheels,
    /// Without noise, likewise.
    WithoutNoise,
}

/// The sessions of a robot with hidden effects.
pub(crate) fn drive(
    plans: &[SessionPlan],
    case: &DriveContext<'_>,
    hidden: &[&Hidden],
    recorded: Recorded,
    first_point: u32,
) -> Result<Vec<Dataset>, ChallengeError> {
    let ids: Vec<&str> = hidden.iter().map(|hidden| hidden.id).collect();
    (first_point..).zip(plans).map(|(point, plan)| drive_session(plan, case, hidden, &ids, recorded, point)).collect()
}

fn drive_session(
    plan: &SessionPlan,
    case: &DriveContext<'_>,
    hidden: &[&Hidden],
    ids: &[&str],
    recorded: Recorded,
    point: u32,
) -> Result<Dataset, ChallengeError> {
    let noisy = recorded != Recorded::WithoutNoise;
    let mut scenario: Scenario = plan.scenario.clone();
    for instrument in &mut scenario.instruments {
        if let Instrument::MotionCapture { rate_hz, .. } = instrument {
            *rate_hz = case.instrument_model.rate_hz;
        }
    }
    if let Some(instrument) = case.instrument {
        instrument.at_work(&mut scenario.instruments, noisy);
    }
    if !noisy {
        scenario.noise.wheel_sigma_m_per_sqrt_m = 0.0;
    }
    scenario.effects.extend(case.robot.harmless(ids));
    // Nothing is lost of the held-out log: in a gap nobody knows what was driven, whatever the model. Nor of
    // what the oracle sees.
    let is_seen_in_work = noisy && point < HELD_OUT_RUN;
    let is_logged = recorded == Recorded::AsLogged && point < HELD_OUT_RUN;
    let counts_per_tick = case.conditions.counts_per_tick();
    if is_logged && counts_per_tick > 1 {
        scenario.effects.push(Effect::Quantization(Quantization { counts_per_tick }));
    }
    if is_seen_in_work {
        scenario.effects.extend(case.instrument_model.class.effect().filter(|effect| !ids.contains(&effect.id())));
    }
    let mut more: Vec<(&'static str, Box<dyn Forward>)> = Vec::new();
    more.extend(
        case.conditions.ripple.map(|(share, frequency_hz)| (SpeedRipple::ID, SpeedRipple::boxed(share, frequency_hz))),
    );
    for hidden in hidden {
        match hidden.act() {
            Some(ActingEffect::Catalogue(effect)) => scenario.effects.push(effect),
            Some(ActingEffect::Other(forward)) => more.push((hidden.id, forward)),
            None => {}
        }
    }
    let mut robot = SimulatedRobot::with_more_effects(&scenario, case.seed, case.number, more)?.at_point(point);
    let states_its_own = case.instrument.is_some_and(CaseInstrument::states_its_own);
    let mut runs = Vec::with_capacity(plan.programs.len());
    for (number, program) in (0_u32..).zip(&plan.programs) {
        let mut run = Run::default();
        robot.drive_into(program, &mut run)?;
        // Each run's measurements and rows have draws of their own.
        let address = effects::Address { seed: case.seed, point, trial: case.number, run: number };
        let mut draw = Draw(address.stream(StreamName::new("challenge looks")));
        // What an instrument of the scenario errs by is in its readings already.
        let errs = noisy && !states_its_own;
        case.instrument_model.measurement(&mut run, errs.then_some(&mut draw));
        if is_logged {
            let mut draw = Draw(address.stream(StreamName::new("challenge log")));
            log_model::record(case.conditions, &mut run, &mut draw);
        }
        runs.push(run);
    }
    let mut dataset = Dataset {
        provenance: Provenance::default(),
        robot: robot.robot(),
        truth_noise: if states_its_own { robot.truth_noise() } else { case.instrument_model.stated() },
        points: Vec::new(),
        runs,
    };
    if let Some(instrument) = case.instrument.filter(|_| !noisy) {
        instrument.restate(&mut dataset);
    }
    Ok(dataset)
}

/// Mean squares of speed and yaw rate over some datasets, by their counts and the nominal geometry.
pub(crate) fn mean_square_motion(datasets: &[Dataset]) -> [f64; 2] {
    let (mut sums, mut time_s) = ([0.0; 2], 0.0);
    for dataset in datasets {
        let Some(ticks_per_rev) = dataset.robot.ticks_per_rev else { continue };
        let m_per_tick = std::f64::consts::PI * dataset.robot.left_wheel_diameter_m / ticks_per_rev;
        for run in &dataset.runs {
            let WheelLog::Ticks(ticks) = &run.odometry.wheels else { continue };
            let travels = |column: &[i64], row: usize| m_per_tick * (column[row + 1] - column[row]) as f64;
            for (row, pair) in run.odometry.t_s.windows(2).enumerate() {
                let dt_s = pair[1] - pair[0];
                let (left_m, right_m) = (travels(&ticks.left, row), travels(&ticks.right, row));
                let twist = [0.5 * (left_m + right_m), (right_m - left_m) / dataset.robot.wheel_separation_m];
                if dt_s > 0.0 {
                    sums.iter_mut().zip(twist).for_each(|(sum, moved)| *sum += moved * moved / dt_s);
                    time_s += dt_s;
                }
            }
        }
    }
    sums.map(|sum| if time_s > 0.0 { sum / time_s } else { 0.0 })
}
