//! Wheels' records that run on by themselves, at a constant rate: an encoder that flickers, or a speed with
//! an offset. The motion that the instrument saw is regressed on the turns of both wheels and on time.

use kinematics::{Side, Wheels};

use crate::alignment::{Paired, explain};
use crate::gain_change::{Row, robustly};
use crate::problem::{Problem, Severity, probability};
use crate::record_fault::RecordFault;
use crate::regression::{jackknife_sigma, without_each_group};
use crate::session_check::SessionCheck;
use crate::settings::CHECKS;
use crate::windows::Measured;

/// What each wheel's records gain beside its turns, rad/s; 0 where that is not certain.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RunsOn {
    rate_rad_s: Wheels<f64>,
    /// Nats by which the windows are explained better without it.
    pub(crate) nats: f64,
}

impl RunsOn {
    /// Of windows with poses.
    pub(crate) fn of(pairs: &[Paired], m_per_rad: Wheels<f64>) -> Option<Self> {
        let whole = rates(pairs)?;
        let without = without_each_group(pairs, rates)?;
        let sigma = Wheels::from_sides(|side| jackknife_sigma(&without, |of| of[side]));
        let certain = |rate: f64, sigma: f64| if rate.abs() > CHECKS.certain_sigmas * sigma { rate } else { 0.0 };
        let rate_rad_s = whole.zip_with(sigma, certain);
        let undone = undone(pairs, rate_rad_s);
        let [as_is, then] = [pairs, &undone].map(|pairs| explain(pairs, Measured::Poses, m_per_rad));
        let (as_is, then) = (as_is?, then?);
        let found = Self { rate_rad_s, nats: then.gain_over(&as_is) };
        // Records by another clock have a part that goes by time, and are not explained by it.
        let is_explained = then.unexplained.iter().all(|share| *share < CHECKS.max_left_by_fix);
        (is_explained && found.nats > CHECKS.min_gain).then_some(found)
    }

    /// Says the rates that matter, and takes them out of the log; whether one does.
    pub(crate) fn said(self, check: &mut SessionCheck) -> bool {
        let turning = check.turning();
        let logged_s: f64 = check.runs.iter().filter_map(|run| Some(run.t_s.last()? - run.t_s.first()?)).sum();
        let shares = self.rate_rad_s.zip_with(turning, |rate, turned| rate.abs() * logged_s / turned);
        // What goes by time for the most part is motion by another clock.
        if shares.left.max(shares.right) > CHECKS.max_left_by_fix {
            return false;
        }
        let mut is_said = false;
        for side in Side::BOTH {
            let (rate_rad_s, share) = (self.rate_rad_s[side], shares[side]);
            if share < CHECKS.min_runs_on_share {
                continue;
            }
            is_said = true;
            let kind = RecordFault::RunsOn { side, rate_rad_s, share };
            check.problems.push(Problem::record(kind, Severity::Error, None, probability(self.nats)));
            for run in &mut check.runs {
                let start_s = run.t_s[0];
                let rows = run.wheels[side].iter_mut().zip(&run.t_s);
                rows.for_each(|(angle, t_s)| *angle -= rate_rad_s * (t_s - start_s));
            }
        }
        is_said
    }
}

/// The windows with the wheels' own turns.
fn undone(pairs: &[Paired], rate_rad_s: Wheels<f64>) -> Vec<Paired> {
    let own = |pair: &Paired| {
        let length_s = pair.window.to_s - pair.window.from_s;
        let moved = pair.moved.zip_with(rate_rad_s, |turned, rate| turned - rate * length_s);
        Paired { moved, turned: pair.turned.map(|(_, turn_rad)| (moved, turn_rad)), ..*pair }
    };
    pairs.iter().map(own).collect()
}

/// The constant rates of both wheels' records, rad/s: what ahead and turn go by time, in turns of wheels.
fn rates(pairs: &[Paired]) -> Option<Wheels<f64>> {
    let mean = |of: fn(&Paired) -> f64| pairs.iter().map(of).sum::<f64>() / pairs.len() as f64;
    let scale = [mean(|of| of.moved.left.abs()), mean(|of| of.moved.right.abs()), mean(length_s)];
    let none = vec![false; pairs.len()];
    let by = |outcome: &dyn Fn(&Paired) -> f64| -> Option<[f64; 3]> {
        let row = |pair: &Paired| -> Row {
            let regressors = [pair.moved.left / scale[0], pair.moved.right / scale[1], length_s(pair) / scale[2]];
            Row { regressors, outcome: outcome(pair) }
        };
        let found = robustly(&pairs.iter().map(row).collect::<Vec<_>>(), &none)?.by;
        Some([found[0] / scale[0], found[1] / scale[1], found[2] / scale[2]])
    };
    // Along the robot, however the instrument is turned on it.
    let (ahead, aside) = (by(&|pair| pair.window.ahead_m)?, by(&|pair| pair.window.left_m)?);
    let (x, y) = (ahead[0] + ahead[1], aside[0] + aside[1]);
    let length = x.hypot(y);
    let along = [0, 1, 2].map(|at| (x * ahead[at] + y * aside[at]) / length);
    let turn = by(&|pair| pair.turned.map_or(0.0, |(_, turn_rad)| turn_rad))?;
    let determinant = along[0] * turn[1] - along[1] * turn[0];
    let rates = Wheels {
        left: -(along[2] * turn[1] - along[1] * turn[2]) / determinant,
        right: -(along[0] * turn[2] - along[2] * turn[0]) / determinant,
    };
    (rates.left.is_finite() && rates.right.is_finite()).then_some(rates)
}

fn length_s(pair: &Paired) -> f64 {
    pair.window.to_s - pair.window.from_s
}
