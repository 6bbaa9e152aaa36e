//! `direction_asymmetry`: a wheel goes farther per count forward than backward.
//!
//! Model: k± = k (1 ± ½ε) for each wheel.
//! Signature: e_dx = ½ε|v_w|, a drift whichever way the wheel turns.
//! Observability: both directions; nothing on forward-only data, where it is a scale.
//! Alias: `backlash` where reversals are as frequent as metres.
//! Reference: treads with a grain, a slope under the test floor; 0.1 to 0.5 %, a rule of thumb.

use kinematics::{Pose, Wheels};
use model_term::{Interval, ModelTerm, TermParameter};
use serde::{Deserialize, Serialize};

use crate::description::{Description, Statement, Summary};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, Step};
use crate::hypothesis::{Hypothesis, Variant, value_of};
use crate::on_board::OnBoard;

/// What it is, in one line.
const MEANING: &str = "a count is another distance forward than backward";

/// The mean term in C, for a robot's own odometry.
const ON_BOARD: &str = "\
left_change_m += 0.5 * left_asymmetry * fabs(left_m);
right_change_m += 0.5 * right_asymmetry * fabs(right_m);";

/// Asymmetry of each wheel.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DirectionAsymmetry {
    /// Forward minus backward travel per turn of the left wheel, over their mean (ε).
    #[serde(default)]
    pub left_asymmetry: f64,
    /// The same of the right wheel.
    #[serde(default)]
    pub right_asymmetry: f64,
}

impl PhysicalEffect for DirectionAsymmetry {
    fn check(&self) -> Result<(), EffectError> {
        for (name, value) in [("left_asymmetry", self.left_asymmetry), ("right_asymmetry", self.right_asymmetry)] {
            EffectError::unless(value.abs() < 2.0, "direction_asymmetry", name, value, "between -2 and 2")?;
        }
        Ok(())
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { half: Wheels { left: 0.5 * self.left_asymmetry, right: 0.5 * self.right_asymmetry } }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Terms(Variant::plain(Term))
    }

    fn description() -> Description {
        Description {
            summary: Summary::WithSize(|values| {
                let shown = |name| values.magnitude(name, 100.0, "%");
                let word = |name| values.by_sign(name, "farther", "less far");
                let (left, right) = ("left_asymmetry", "right_asymmetry");
                let size = if word(left) == word(right) {
                    format!("{} left, {} right, {} forward", shown(left), shown(right), word(left))
                } else {
                    format!("{} {} left, {} {} right, forward", shown(left), word(left), shown(right), word(right))
                };
                Statement::of(MEANING, size)
            }),
            on_board: OnBoard::Static(ON_BOARD),
            ..Description::of(MEANING)
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        Some(Self {
            left_asymmetry: value_of(values, "left_asymmetry")?,
            right_asymmetry: value_of(values, "right_asymmetry")?,
        })
    }
}

struct State {
    half: Wheels<f64>,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { floor: true, ..Hooks::NONE }
    }

    fn floor(&mut self, step: &mut Step) {
        step.travel_m = step.travel_m.zip_with(self.half, |travel_m, half| travel_m + half * travel_m.abs());
    }
}

#[derive(Clone)]
struct Term;

impl ModelTerm for Term {
    /// Plausible: 0.5 %, the upper end of the rule of thumb.
    fn parameters(&self) -> &'static [TermParameter] {
        &[
            TermParameter { name: "left_asymmetry", unit: "1", prior_sigma: 0.005 },
            TermParameter { name: "right_asymmetry", unit: "1", prior_sigma: 0.005 },
        ]
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        let Wheels { left, right } = interval.smooth_travel_m();
        gradient[0] = interval.change(Wheels { left: 0.5 * left.abs(), right: 0.0 });
        gradient[1] = interval.change(Wheels { left: 0.0, right: 0.5 * right.abs() });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::specimen_step;

    #[test]
    fn there_and_back_drifts_by_the_asymmetry() {
        let effect = DirectionAsymmetry { left_asymmetry: 0.0, right_asymmetry: 0.004 };
        let mut state = effect.forward().expect("acts on the floor");
        let mut sum_m = Wheels::both(0.0);
        for travel_m in [1.0, -1.0] {
            let mut step = specimen_step();
            step.travel_m = Wheels::both(travel_m);
            state.floor(&mut step);
            sum_m = sum_m.zip_with(step.travel_m, |sum_m, travel_m| sum_m + travel_m);
        }
        assert!(sum_m.left == 0.0 && (sum_m.right - 0.004).abs() < 1e-15, "{sum_m:?}");
    }
}
