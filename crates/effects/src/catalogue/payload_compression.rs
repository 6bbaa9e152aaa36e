//! `payload_compression`: what a robot carries presses its tyres flatter.
//!
//! Model: r = r₀ (1 − c p) under a payload p, c = g/(n k r₀) for n springs of stiffness k; a load off the
//! middle presses one wheel more: c_L = c − ½m, c_R = c + ½m.
//! Signature: the scale steps with the covariate `payload_kg` of the runs, and E_d with it.
//! Observability: runs with different payloads.
//! Alias: `thermal_drift` and `wear` where the payload was changed once.
//! Reference: a linear spring; 0.1 to 1 % for a load that the robot is made for, a rule of thumb.

use kinematics::{Pose, Wheels};
use model_term::{Interval, ModelTerm, TermParameter};
use serde::{Deserialize, Serialize};

use crate::benchmark::{Benchmark, HostRobot, Needs, ParameterValue};
use crate::description::{Description, Excitation, Summary};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, RunStart, Step};
use crate::hypothesis::{Hypothesis, Variant, value_of};
use crate::on_board::{Code, Input, OnBoard, PAYLOAD};

/// The mean term in C, for a robot's own odometry.
const ON_BOARD: OnBoard = OnBoard::Input {
    input: Input::Payload,
    code: Code::of(
        "\
left_change_m -= (common_per_kg - 0.5 * mismatch_per_kg) * payload_kg * left_m;
right_change_m -= (common_per_kg + 0.5 * mismatch_per_kg) * payload_kg * right_m;",
    ),
};

/// Compression by the payload.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PayloadCompression {
    /// Relative loss of both radii per kilogram (c), 1/kg.
    pub common_per_kg: f64,
    /// What the right wheel loses more than the left one (m), 1/kg.
    #[serde(default)]
    pub mismatch_per_kg: f64,
    /// What the runs of a session carry in turn, over and over, kilograms.
    pub payload_kg: Vec<f64>,
}

impl PayloadCompression {
    fn per_kg(common: f64, mismatch: f64) -> Wheels<f64> {
        Wheels { left: common - 0.5 * mismatch, right: common + 0.5 * mismatch }
    }
}

impl PhysicalEffect for PayloadCompression {
    fn check(&self) -> Result<(), EffectError> {
        let id = "payload_compression";
        let values = [("common_per_kg", self.common_per_kg), ("mismatch_per_kg", self.mismatch_per_kg)];
        EffectError::unless_finite(id, values)?;
        EffectError::unless(!self.payload_kg.is_empty(), id, PAYLOAD, 0.0, "one payload or more")?;
        self.payload_kg.iter().try_for_each(|&payload_kg| {
            EffectError::unless_negative(id, [(PAYLOAD, payload_kg)])?;
            let most = Self::per_kg(self.common_per_kg, self.mismatch_per_kg).map(|per_kg| payload_kg * per_kg);
            EffectError::unless(most.left.max(most.right) < 1.0, id, PAYLOAD, payload_kg, "less than flattens a tyre")
        })
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { effect: self.clone(), factor: Wheels::both(1.0) }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Terms(Variant::plain(Term))
    }

    fn description() -> Description {
        Description {
            summary: Summary::Meaning,
            excitation: Excitation::Conditions("drive the same runs with another payload, its covariate stated"),
            benchmark: Benchmark { needs: Needs { payload: true, ..Needs::NONE }, ..Benchmark::OF_MEAN },
            on_board: ON_BOARD,
            ..Description::of("the payload presses the tyres flatter")
        }
    }

    /// Unloaded: what the runs carry is the experiment's.
    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        let (common_per_kg, mismatch_per_kg) =
            (value_of(values, "common_per_kg")?, value_of(values, "mismatch_per_kg")?);
        Some(Self { common_per_kg, mismatch_per_kg, payload_kg: vec![value_of(values, PAYLOAD).unwrap_or(0.0)] })
    }

    fn at_scale(values: &[ParameterValue], _: f64, robot: &HostRobot) -> Option<Self> {
        Some(Self { payload_kg: robot.payload_kg.clone(), ..Self::from_estimates(values)? })
    }

    fn harmless(robot: &HostRobot) -> Option<Self> {
        let payload_kg = robot.payload_kg.clone();
        (!payload_kg.is_empty()).then_some(Self { common_per_kg: 0.0, mismatch_per_kg: 0.0, payload_kg })
    }
}

struct State {
    effect: PayloadCompression,
    /// Of each wheel's radius in this run.
    factor: Wheels<f64>,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { on_run_start: true, wheel: true, ..Hooks::NONE }
    }

    fn on_run_start(&mut self, run: &mut RunStart<'_>) {
        let PayloadCompression { common_per_kg, mismatch_per_kg, payload_kg } = &self.effect;
        let payload_kg = payload_kg[run.number as usize % payload_kg.len()];
        if payload_kg > 0.0 {
            run.info.covariates.insert(PAYLOAD.to_owned(), payload_kg);
        }
        let per_kg = PayloadCompression::per_kg(*common_per_kg, *mismatch_per_kg);
        self.factor = per_kg.map(|per_kg| 1.0 - per_kg * payload_kg);
    }

    fn wheel(&mut self, step: &mut Step) {
        step.radius_m = step.radius_m.zip_with(self.factor, |radius_m, factor| radius_m * factor);
    }
}

#[derive(Clone)]
struct Term;

impl ModelTerm for Term {
    /// Plausible: 1 % under 10 kg, the upper end of the rule of thumb.
    fn parameters(&self) -> &'static [TermParameter] {
        &[
            TermParameter { name: "common_per_kg", unit: "1/kg", prior_sigma: 1e-3 },
            TermParameter { name: "mismatch_per_kg", unit: "1/kg", prior_sigma: 1e-3 },
        ]
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        let Some(payload_kg) = interval.run.covariates.get(PAYLOAD) else { return };
        let Wheels { left, right } = interval.travel_m.map(|travel_m| travel_m * payload_kg);
        gradient[0] = interval.change(Wheels { left: -left, right: -right });
        gradient[1] = interval.change(Wheels { left: 0.5 * left, right: -0.5 * right });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::specimen_step;
    use dataset::RunInfo;

    #[test]
    fn runs_carry_their_loads_in_turn_and_say_so() {
        let effect = PayloadCompression { common_per_kg: 1e-3, mismatch_per_kg: 2e-4, payload_kg: vec![0.0, 5.0] };
        let mut state = effect.forward().expect("acts on wheels");
        for (number, payload_kg) in [(0, 0.0), (1, 5.0), (2, 0.0), (3, 5.0)] {
            let mut info = RunInfo::default();
            state.on_run_start(&mut RunStart { number, session_s: 0.0, session_m: 0.0, info: &mut info });
            assert_eq!(info.covariates.get(PAYLOAD).copied().unwrap_or(0.0), payload_kg);
            let mut step = specimen_step();
            state.wheel(&mut step);
            assert!((step.radius_m.left - 0.08 * (1.0 - 9e-4 * payload_kg)).abs() < 1e-16);
            assert!((step.radius_m.right - 0.08 * (1.0 - 1.1e-3 * payload_kg)).abs() < 1e-16);
        }
    }
}
