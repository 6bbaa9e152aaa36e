//! `thermal_drift`: tyres warm up and swell from the session's start on.
//!
//! Model: k(t) = 1 + α (1 − e^{−t/τ}) on the session's clock, both wheels alike.
//! Signature: a scale that settles.
//! Observability: runs early and late in a session.
//! Alias: `wear`, at 1.00 while the mean speed is steady: a long pause or a cold restart discriminates them.
//! Reference: a lumped heat capacity (Newton's law of cooling) and linear expansion; 0.2 % over 10 to 60
//! minutes for rubber.

use kinematics::{Pose, Wheels};
use model_term::{Interval, ModelTerm, TermParameter};
use serde::{Deserialize, Serialize};

use crate::benchmark::Benchmark;
use crate::description::{Description, Excitation, Statement, Summary};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, RunStart, Step};
use crate::hypothesis::{Hypothesis, Variant, value_of};
use crate::on_board::{Code, Input, OnBoard};

/// What it is, in one line.
const MEANING: &str = "the wheels' scale drifts over the session";

/// Time constants that are tried, seconds: tyres take from minutes to an hour.
const TAU_S: [f64; 5] = [150.0, 300.0, 600.0, 1200.0, 3600.0];

/// The mean term in C, for a robot's own odometry.
const ON_BOARD: OnBoard = OnBoard::Input {
    input: Input::SessionTime,
    code: Code::of(
        "\
const double grown = growth * (1.0 - exp(-(session_s + 0.5 * dt_s) / tau_s));
left_change_m += grown * left_m;
right_change_m += grown * right_m;",
    ),
};

/// Growth of the wheels.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ThermalDrift {
    /// Relative growth in the end (α).
    pub growth: f64,
    /// Time over which it comes (τ), seconds.
    pub tau_s: f64,
}

impl PhysicalEffect for ThermalDrift {
    fn check(&self) -> Result<(), EffectError> {
        let id = "thermal_drift";
        let holds = self.growth.is_finite() && self.growth > -1.0;
        EffectError::unless(holds, id, "growth", self.growth, "more than -1")?;
        EffectError::unless_positive(id, [("tau_s", self.tau_s)])
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { effect: *self, session_s: 0.0 }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Terms(Variant::along("tau_s", &TAU_S, |tau_s| Box::new(Term { tau_s })))
    }

    fn description() -> Description {
        Description {
            summary: Summary::WithSize(|values| {
                Statement::of(
                    MEANING,
                    values.with_direction("growth", 100.0, "%", "larger at the end", "smaller at the end"),
                )
            }),
            excitation: Excitation::Conditions("drive the same runs cold and an hour later"),
            benchmark: Benchmark::of_mean_at(|_, _, stream| vec![("tau_s", stream.log_uniform(60.0, 1000.0))])
                .with_form("wheels that warm up hyperbolically: t/(t + τ) for 1 − e^{−t/τ}", |values, _| {
                    let of = |name| value_of(values, name).unwrap_or(0.0);
                    Box::new(Warming { growth: of("growth"), tau_s: of("tau_s"), session_s: 0.0 })
                }),
            on_board: ON_BOARD,
            ..Description::of(MEANING)
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        Some(Self { growth: value_of(values, "growth")?, tau_s: value_of(values, "tau_s")? })
    }
}

struct State {
    effect: ThermalDrift,
    session_s: f64,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { on_run_start: true, wheel: true, ..Hooks::NONE }
    }

    fn on_run_start(&mut self, run: &mut RunStart<'_>) {
        self.session_s = run.session_s;
    }

    /// The mean over the step, exactly: e^{−t/τ} (1 − e^{−x})/x with x = Δt/τ.
    fn wheel(&mut self, step: &mut Step) {
        let ThermalDrift { growth, tau_s } = self.effect;
        let x = step.dt_s / tau_s;
        let mean = if x > 0.0 { -(-x).exp_m1() / x } else { 1.0 };
        let cold = (-(self.session_s + step.t_s) / tau_s).exp() * mean;
        step.radius_m = step.radius_m.map(|radius_m| radius_m * (1.0 + growth * (1.0 - cold)));
    }

    /// Through the time that ramps take.
    fn depends_on_speed(&self) -> bool {
        self.effect.growth != 0.0
    }
}

#[derive(Clone)]
struct Term {
    tau_s: f64,
}

impl ModelTerm for Term {
    /// Plausible: 0.2 %, derived for rubber.
    fn parameters(&self) -> &'static [TermParameter] {
        &[TermParameter { name: "growth", unit: "1", prior_sigma: 0.002 }]
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        let middle_s = interval.session_s() + 0.5 * interval.dt_s;
        let warm = 1.0 - (-middle_s / self.tau_s).exp();
        let Wheels { left, right } = interval.travel_m;
        gradient[0] = interval.change(Wheels { left: warm * left, right: warm * right });
    }
}

/// The other form: wheels that warm up hyperbolically, t/(t + τ) for 1 − e^{−t/τ}.
struct Warming {
    growth: f64,
    tau_s: f64,
    session_s: f64,
}

impl Forward for Warming {
    fn hooks(&self) -> Hooks {
        Hooks { on_run_start: true, wheel: true, ..Hooks::NONE }
    }

    fn on_run_start(&mut self, run: &mut RunStart<'_>) {
        self.session_s = run.session_s;
    }

    fn wheel(&mut self, step: &mut Step) {
        let t_s = self.session_s + step.t_s;
        let factor = 1.0 + self.growth * t_s / (t_s + self.tau_s);
        step.radius_m = step.radius_m.map(|radius_m| radius_m * factor);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::specimen_step;
    use dataset::RunInfo;

    #[test]
    fn growth_comes_with_the_sessions_time_however_it_is_cut() {
        let mut state = State { effect: ThermalDrift { growth: 0.002, tau_s: 600.0 }, session_s: 0.0 };
        let mut info = RunInfo::default();
        state.on_run_start(&mut RunStart { number: 3, session_s: 540.0, session_m: 0.0, info: &mut info });
        let mut mean_m = |from_s: f64, dt_s: f64| {
            let mut step = specimen_step();
            (step.t_s, step.dt_s) = (from_s, dt_s);
            state.wheel(&mut step);
            step.radius_m.left
        };
        let whole_m = mean_m(0.0, 120.0);
        let parts_m = (0..120).map(|part| mean_m(f64::from(part), 1.0)).sum::<f64>() / 120.0;
        assert!((whole_m - parts_m).abs() < 1e-15);
        // At ten minutes, the time constant, 1 − 1/e has come.
        let at_tau = 1.0 - (-1.0_f64).exp();
        assert!((mean_m(60.0, 0.0) / 0.08 - (1.0 + 0.002 * at_tau)).abs() < 1e-15);
    }
}
