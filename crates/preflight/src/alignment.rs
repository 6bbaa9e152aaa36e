//! How well the wheels explain what the instrument saw, for a reading of its records and a clock.

use kinematics::Wheels;
use rayon::prelude::*;

use crate::clock::model::Clock;
use crate::regression::regress;
use crate::run_log::RunLog;
use crate::settings::CHECKS;
use crate::windows::{Measured, Window};

/// Turns of the wheels in a window's two intervals.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Paired {
    pub(crate) window: Window,
    pub(crate) moved: Wheels<f64>,
    pub(crate) turned: Option<(Wheels<f64>, f64)>,
}

/// The windows that lie within the log, with what the wheels did in them.
pub(crate) fn paired(windows: &[Window], runs: &[RunLog], clock: Clock) -> Vec<Paired> {
    let pair = |window: &Window| {
        let run = &runs[window.run];
        let log_s = |stamp_s| clock.log_s(run.start_s, stamp_s);
        let moved = run.turned(log_s(window.from_s), log_s(window.to_s))?;
        let turned = match window.turn {
            Some((from_s, to_s, turn_rad)) if (from_s, to_s) == (window.from_s, window.to_s) => Some((moved, turn_rad)),
            Some((from_s, to_s, turn_rad)) => Some((run.turned(log_s(from_s), log_s(to_s))?, turn_rad)),
            None => None,
        };
        Some(Paired { window: *window, moved, turned })
    };
    windows.iter().filter_map(pair).collect()
}

/// How well turns of the wheels explain the windows.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Explained {
    /// Negative log likelihood a window, under Laplace's distribution.
    pub(crate) cost: f64,
    pub(crate) windows: f64,
    /// Shares of turns and of displacements that are left.
    pub(crate) unexplained: [f64; 2],
}

impl Explained {
    /// Nats that it explains better than another.
    pub(crate) fn gain_over(&self, other: &Self) -> f64 {
        self.windows.min(other.windows) * (other.cost - self.cost)
    }

    /// Ratio of what is left to what another leaves, of turns and displacements in the geometric mean.
    pub(crate) fn ratio_to(&self, other: &Self) -> f64 {
        (0.5 * (self.cost - other.cost)).exp()
    }
}

/// Explains displacements and turns, each by a regression of its own.
pub(crate) fn explain(pairs: &[Paired], measured: Measured, m_per_rad: Wheels<f64>) -> Option<Explained> {
    if pairs.len() < CHECKS.min_windows {
        return None;
    }
    let turns: Vec<(Wheels<f64>, f64)> = pairs.iter().filter_map(|pair| pair.turned).collect();
    let turn = if turns.len() < CHECKS.min_windows { None } else { left_of(&turns) };
    let displacement = match measured {
        Measured::Poses => {
            let of = |value: fn(&Window) -> f64| {
                left_of(&pairs.iter().map(|pair| (pair.moved, value(&pair.window))).collect::<Vec<_>>())
            };
            let (ahead, aside) = (of(|window| window.ahead_m)?, of(|window| window.left_m)?);
            (ahead.0 + aside.0, ahead.1 + aside.1)
        }
        Measured::Positions => {
            // Of distances, the sign is not seen.
            let speeds = pairs.iter().map(|pair| {
                let travel_m = pair.moved.zip_with(m_per_rad, |rad, m| rad * m);
                (0.5 * (travel_m.left + travel_m.right).abs(), pair.window.ahead_m)
            });
            let speeds: Vec<(f64, f64)> = speeds.collect();
            let (_, _, left, whole) = crate::regression::slope(&speeds)?;
            (left, whole)
        }
    };
    // Of all, so that no reading gains by making what is measured smaller; below a micrometre and a
    // microradian nothing is compared.
    let share = |(left, whole): (f64, f64)| if whole > 0.0 { (left + 1e-6) / (whole + 1e-6) } else { 1.0 };
    let unexplained = [turn.map_or(1.0, share), share(displacement)];
    let cost = unexplained.iter().map(|share| share.ln()).sum();
    Some(Explained { cost, windows: pairs.len() as f64, unexplained })
}

/// Mean absolute values of what a regression leaves, and of all. Where the wheels turn in one proportion, the
/// regression is on one of them.
fn left_of(pairs: &[(Wheels<f64>, f64)]) -> Option<(f64, f64)> {
    if let Some(found) = regress(pairs, 3) {
        return Some((found.left, found.whole));
    }
    let on_larger: Vec<(f64, f64)> = pairs
        .iter()
        .map(|(turn, outcome)| (if turn.left.abs() > turn.right.abs() { turn.left } else { turn.right }, *outcome))
        .collect();
    crate::regression::slope(&on_larger).map(|(_, _, left, whole)| (left, whole))
}

/// The best clock, how well it explains, and the standard deviation of its offset.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BestClock {
    pub(crate) clock: Clock,
    pub(crate) explained: Explained,
    pub(crate) sigma_s: f64,
}

/// What is compared.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Comparison<'a> {
    pub(crate) windows: &'a [Window],
    pub(crate) measured: Measured,
    pub(crate) runs: &'a [RunLog],
    pub(crate) m_per_rad: Wheels<f64>,
}

impl Comparison<'_> {
    pub(crate) fn at(&self, clock: Clock) -> Option<Explained> {
        let pairs = paired(self.windows, self.runs, clock);
        if (pairs.len() as f64) < CHECKS.min_overlap * self.windows.len() as f64 {
            return None;
        }
        explain(&pairs, self.measured, self.m_per_rad)
    }

    /// The best offset: within so many seconds of the clock that is, or anywhere.
    pub(crate) fn best_offset(&self, within_s: Option<f64>) -> Option<BestClock> {
        let mut best: Option<(f64, Explained)> = None;
        let (low_s, high_s) = self.range(within_s)?;
        let (mut from_s, mut to_s) = (low_s, high_s);
        for step_s in CHECKS.clock_steps_s {
            let count = ((to_s - from_s) / step_s).ceil() as usize;
            let at = |k: usize| {
                let offset_s = from_s + step_s * k as f64;
                Some((offset_s, self.at(Clock { offset_s, ..Clock::default() })?))
            };
            let all: Vec<_> = (0..=count).into_par_iter().map(at).collect();
            for (offset_s, found) in all.into_iter().flatten() {
                if best.is_none_or(|(_, best)| found.cost < best.cost) {
                    best = Some((offset_s, found));
                }
            }
            let (at_s, _) = best?;
            (from_s, to_s) = (at_s - step_s, at_s + step_s);
        }
        let (offset_s, explained) = best?;
        // Curvature of the cost: that of a parabola through its neighbours a coarse step away.
        let step_s = CHECKS.clock_steps_s[1];
        let beside = [-step_s, step_s].map(|by_s| self.at(Clock { offset_s: offset_s + by_s, ..Clock::default() }));
        let rise = beside.iter().flatten().map(|found| explained.gain_over(found)).fold(0.0_f64, f64::max);
        let sigma_s = step_s / (2.0 * rise.max(1e-9)).sqrt();
        Some(BestClock {
            clock: Clock { offset_s, ..Clock::default() },
            explained,
            sigma_s: sigma_s.min(high_s - low_s),
        })
    }

    /// Offsets at which some records overlap.
    fn range(&self, within_s: Option<f64>) -> Option<(f64, f64)> {
        if let Some(within_s) = within_s {
            return Some((-within_s, within_s));
        }
        let (mut low_s, mut high_s) = (f64::INFINITY, f64::NEG_INFINITY);
        for (number, run) in self.runs.iter().enumerate() {
            let mut own = self.windows.iter().filter(|window| window.run == number);
            let Some(first) = own.next() else { continue };
            let last = own.next_back().unwrap_or(first);
            let (start_s, end_s) = (run.t_s.first()?, run.t_s.last()?);
            low_s = low_s.min(first.from_s - end_s);
            high_s = high_s.max(last.to_s - start_s);
        }
        let middle_s = 0.5 * (low_s + high_s);
        let half_s = (0.5 * (high_s - low_s)).min(CHECKS.max_clock_offset_s);
        (low_s <= high_s).then_some((middle_s - half_s, middle_s + half_s))
    }
}
