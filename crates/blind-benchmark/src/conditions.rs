//! What is ordinary about a robot, its log and its clock, and still differs from case to case: size, encoder,
//! rate and stamps of the log, lost rows, drift between two clocks, how rough the wheels are, how evenly they
//! turn, how long is driven and in how many runs.
//!
//! Every matter is drawn from a stream of its own name. Where a condition is what a finding would rightly
//! name ([`effects::EXEMPT`]) and that finding is what the case hides, the condition is left out: the hidden
//! size could not be told from the ordinary one.

use effects::{Needs, OrdinaryCondition};

use super::draw::CaseDraws;

/// How the rows of a log are stamped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Stamps {
    /// At the instant of the reading, on the beat.
    Exact,
    /// At the instant of the reading, which is uniform within ± this of the beat, seconds.
    Irregular { jitter_s: f64 },
    /// Off the instant of the reading by a normal error of this standard deviation, seconds.
    Jittering { sigma_s: f64 },
    /// When the row was received: late by an exponential delay of this mean, seconds. No row overtakes
    /// another.
    Received { mean_s: f64 },
}

/// What a case's robot and records are like.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Conditions {
    pub(crate) wheel_separation_m: f64,
    pub(crate) wheel_diameter_m: f64,
    /// Speeds and accelerations over those of a robot of 0.4 m.
    pub(crate) speed_scale: f64,
    /// Ticks that the log has for a turn of a wheel.
    pub(crate) ticks_per_turn: f64,
    pub(crate) log_rate_hz: f64,
    pub(crate) stamps: Stamps,
    /// Share of the rows that are missing, though the counters went on.
    pub(crate) lost_row_share: f64,
    /// By how much the instrument's clock gains on the robot's, seconds a second.
    pub(crate) clock_drift: f64,
    pub(crate) wheel_sigma_m_per_sqrt_m: f64,
    /// Share of the speed by which something outside of the controllers' reach disturbs the shafts, and how
    /// often a second.
    pub(crate) ripple: Option<(f64, f64)>,
    /// How long is driven, seconds, where rows and measurements allow it.
    pub(crate) driving_s: f64,
    /// In how many runs.
    pub(crate) runs: u32,
}

/// Counts per metre of the shipped robot's drive, at which its controllers are tuned; at another scale of
/// speed they are as many a second.
const COUNTS_PER_M: f64 = 80_000.0;
/// Wheelbases, from a toy to a vehicle, metres.
const WHEEL_SEPARATION_M: (f64, f64) = (0.05, 1.0);
/// The wheelbase with speeds of the shipped robot's kind, and how speeds grow with the size: between what
/// legs do (½) and what keeps times the same (1).
pub(crate) const USUAL_SEPARATION_M: f64 = 0.4;
const SPEED_EXPONENT: f64 = 0.6;
/// Ticks a turn, from a hobby robot's disc to an encoder on the motor's axis.
const TICKS_PER_TURN: (f64, f64) = (100.0, 50_000.0);
/// More ticks than the controllers have counts at their usual speed, by this factor at the most: beyond it
/// their velocity registers are full.
const MAX_TICKS_PER_COUNT: f64 = 1.3;
const LOG_RATE_HZ: (f64, f64) = (5.0, 200.0);
/// A stamp is off by no more of the interval than this, as a standard deviation, or as half of a width.
const MAX_JITTER_SHARE: f64 = 0.3;
/// 500 parts in a million: two quartz clocks, one of them cheap and warm.
const MAX_CLOCK_DRIFT: f64 = 5e-4;
const MAX_LOST_ROW_SHARE: f64 = 0.05;
const MAX_RUNS: f64 = 40.0;
/// Runs that effects of loads need to show.
const MIN_RUNS_WITH_LOADS: u32 = 6;

impl Conditions {
    /// Draws them; `hidden` are the ids of what the case hides.
    pub(crate) fn draw(draws: CaseDraws, needs: Needs, hidden: &[&str]) -> Self {
        let mut size = draws.of("size");
        let wheel_separation_m = size.log_uniform(WHEEL_SEPARATION_M.0, WHEEL_SEPARATION_M.1);
        let wheel_diameter_m = (wheel_separation_m * size.uniform(0.25, 0.7)).clamp(0.02, 0.5);
        let speed_scale =
            (wheel_separation_m / USUAL_SEPARATION_M).powf(SPEED_EXPONENT) * size.log_uniform(1.0 / 1.4, 1.4);
        let most_ticks = MAX_TICKS_PER_COUNT * COUNTS_PER_M / speed_scale * std::f64::consts::PI * wheel_diameter_m;
        let ticks = draws.of("encoder").log_uniform(TICKS_PER_TURN.0, TICKS_PER_TURN.1);
        let log_rate_hz = draws.of("log rate").log_uniform(LOG_RATE_HZ.0, LOG_RATE_HZ.1);
        let mut wheels = draws.of("wheels");
        let mut ripple = draws.of("ripple");
        let mut driving = draws.of("driving");
        let runs = driving.log_uniform(1.0, MAX_RUNS + 1.0) as u32;
        Self {
            wheel_separation_m,
            wheel_diameter_m,
            speed_scale,
            ticks_per_turn: ticks.min(most_ticks).round(),
            log_rate_hz,
            stamps: stamps(draws, needs, hidden, 1.0 / log_rate_hz),
            lost_row_share: {
                let mut lost = draws.of("lost rows");
                if lost.bernoulli(0.2) { lost.uniform(0.005, MAX_LOST_ROW_SHARE) } else { 0.0 }
            },
            clock_drift: {
                let mut drift = draws.of("clock drift");
                let drifts = drift.bernoulli(0.25) && !is_hidden(OrdinaryCondition::DriftingClocks, hidden);
                if drifts { drift.uniform(-MAX_CLOCK_DRIFT, MAX_CLOCK_DRIFT) } else { 0.0 }
            },
            wheel_sigma_m_per_sqrt_m: if wheels.bernoulli(0.15) { 0.0 } else { wheels.log_uniform(3e-5, 2e-3) },
            ripple: ripple.bernoulli(0.5).then(|| (ripple.log_uniform(0.05, 0.4), ripple.log_uniform(1.0, 8.0))),
            driving_s: driving.log_uniform(60.0, 300.0),
            // One log in six, beside those that are drawn so.
            runs: match driving.bernoulli(1.0 / 6.0) {
                _ if needs.payload => runs.max(MIN_RUNS_WITH_LOADS),
                true => 1,
                false => runs,
            },
        }
    }

    /// Whether the robot's clock and the instrument's differ by something that is not random: a latency, or a
    /// rate.
    pub(crate) fn has_clock_offset(&self) -> bool {
        self.clock_drift != 0.0 || matches!(self.stamps, Stamps::Received { .. })
    }

    /// Standard deviation of a stamp's error, seconds.
    pub(crate) const fn stamp_sigma_s(&self) -> f64 {
        match self.stamps {
            Stamps::Exact | Stamps::Irregular { .. } => 0.0,
            Stamps::Jittering { sigma_s } => sigma_s,
            Stamps::Received { mean_s } => mean_s,
        }
    }

    /// Counts of the controllers, which resolve finer, in one tick of the log: as many as bring the
    /// controllers nearest to the speed at which they are tuned.
    pub(crate) fn counts_per_tick(&self) -> u32 {
        ((self.counts_per_turn() / self.ticks_per_turn).round() as u32).max(1)
    }

    /// Counts of the controllers in a turn of a wheel, at the speed at which they are tuned.
    pub(crate) fn counts_per_turn(&self) -> f64 {
        COUNTS_PER_M / self.speed_scale * std::f64::consts::PI * self.wheel_diameter_m
    }

    /// Way of a wheel between two ticks, metres.
    pub(crate) fn tick_m(&self) -> f64 {
        std::f64::consts::PI * self.wheel_diameter_m / self.ticks_per_turn
    }
}

/// Whether what would rightly be named in a condition is what the case hides.
fn is_hidden(condition: OrdinaryCondition, hidden: &[&str]) -> bool {
    condition.right_findings().any(|id| hidden.contains(&id))
}

fn stamps(draws: CaseDraws, needs: Needs, hidden: &[&str], interval_s: f64) -> Stamps {
    let mut draw = draws.of("stamps");
    let class = draw.below(10);
    let most_s = MAX_JITTER_SHARE * interval_s;
    let irregular = Stamps::Irregular { jitter_s: draw.uniform(0.001, 0.008).min(most_s) };
    let jittering = Stamps::Jittering { sigma_s: draw.log_uniform(3e-4, 5e-3).min(most_s) };
    let received = Stamps::Received { mean_s: draw.log_uniform(0.005, 0.05) };
    match class {
        _ if needs.jitter => irregular,
        0..=1 => irregular,
        2..=3 if !is_hidden(OrdinaryCondition::JitteringStamps, hidden) => jittering,
        4 if !is_hidden(OrdinaryCondition::ReceivedStamps, hidden) => received,
        _ => Stamps::Exact,
    }
}
