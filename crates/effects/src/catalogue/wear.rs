//! `wear`: tyres lose a little of their radius with every metre.
//!
//! Model: k = 1 − w s with the distance s since the session's start, both wheels alike.
//! Signature: a scale that falls steadily.
//! Observability: very long sessions.
//! Alias: `thermal_drift`, at 1.00 while the mean speed is steady: a long pause discriminates them.
//! Reference: Archard 1953, wear in proportion to the distance; negligible within a session.

use kinematics::{Pose, Wheels};
use model_term::{Interval, ModelTerm, TermParameter};
use serde::{Deserialize, Serialize};

use crate::description::{Description, Excitation, Summary};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, RunStart, Step};
use crate::hypothesis::{Hypothesis, Variant, value_of};
use crate::on_board::{Code, Input, OnBoard};

/// The mean term in C, for a robot's own odometry.
const ON_BOARD: OnBoard = OnBoard::Input {
    input: Input::SessionDistance,
    code: Code::of(
        "\
const double lost = loss_per_m * (session_m + 0.5 * fabs(distance_m));
left_change_m -= lost * left_m;
right_change_m -= lost * right_m;",
    ),
};

/// Loss of radius with the distance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wear {
    /// Relative loss of both radii per metre (w), 1/m.
    pub loss_per_m: f64,
}

impl PhysicalEffect for Wear {
    fn check(&self) -> Result<(), EffectError> {
        EffectError::unless_finite("wear", [("loss_per_m", self.loss_per_m)])
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { effect: *self, distance_m: 0.0 }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Terms(Variant::plain(Term))
    }

    fn description() -> Description {
        Description {
            summary: Summary::Meaning,
            excitation: Excitation::Conditions("drive the same runs again after some kilometres"),
            on_board: ON_BOARD,
            ..Description::of("the scale drifts with the distance driven")
        }
    }

    /// A tread wears off: found negative it is something else.
    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        let loss_per_m = value_of(values, "loss_per_m")?;
        (loss_per_m >= 0.0).then_some(Self { loss_per_m })
    }
}

struct State {
    effect: Wear,
    distance_m: f64,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { on_run_start: true, wheel: true, ..Hooks::NONE }
    }

    fn on_run_start(&mut self, run: &mut RunStart<'_>) {
        self.distance_m = run.session_m;
    }

    /// Linear in the distance, so the middle of the step is its mean.
    fn wheel(&mut self, step: &mut Step) {
        let rolled_m = step.wheel_rad.zip_with(step.radius_m, |rad, radius_m| rad * radius_m);
        let ahead_m = 0.5 * (rolled_m.left + rolled_m.right).abs();
        let left_over = 1.0 - self.effect.loss_per_m * (self.distance_m + 0.5 * ahead_m);
        self.distance_m += ahead_m;
        step.radius_m = step.radius_m.map(|radius_m| radius_m * left_over);
    }
}

#[derive(Clone)]
struct Term;

impl ModelTerm for Term {
    /// Plausible: 1 mm of a 100 mm radius in 10 km; the catalogue calls it negligible within a session.
    fn parameters(&self) -> &'static [TermParameter] {
        &[TermParameter { name: "loss_per_m", unit: "1/m", prior_sigma: 1e-6 }]
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        let distance_m = interval.session_m + 0.5 * interval.increment().distance_m.abs();
        let Wheels { left, right } = interval.travel_m;
        gradient[0] = interval.change(Wheels { left: -left * distance_m, right: -right * distance_m });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::specimen_step;
    use dataset::RunInfo;

    #[test]
    fn the_way_counts_in_both_directions_and_over_runs() {
        let mut state = State { effect: Wear { loss_per_m: 1e-3 }, distance_m: 0.0 };
        let mut info = RunInfo::default();
        state.on_run_start(&mut RunStart { number: 1, session_s: 0.0, session_m: 10.0, info: &mut info });
        for (turned_m, factor) in [(2.0, 1.0 - 1e-3 * 11.0), (-2.0, 1.0 - 1e-3 * 13.0)] {
            let mut step = specimen_step();
            step.wheel_rad = Wheels::both(turned_m / 0.08);
            state.wheel(&mut step);
            assert!((step.radius_m.left / 0.08 - factor).abs() < 1e-15);
        }
    }
}
