//! `backlash`: play between the encoder's axis and the wheel.
//!
//! Model: the play operator: the wheel rests until the shaft has crossed the gap, then follows at its edge.
//! Signature: each reversal of a wheel loses the whole gap of travel.
//! Observability: reversals of one wheel; a corner turned on the spot reverses one wheel.
//! Alias: `castor_kick`.
//! Reference: the play operator, Krasnosel'skii & Pokrovskii 1983; 0.4 to 2.6 mm at wheels of 50 mm radius,
//! derived from teeth.

use dataset::RunInfo;
use kinematics::{Pose, Side, Wheels};
use model_term::{Interval, ModelTerm, TermParameter};
use serde::{Deserialize, Serialize};

use crate::benchmark::{Benchmark, ParameterLaw};
use crate::description::{Description, Statement, Summary};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, Step};
use crate::hypothesis::{Hypothesis, Variant, value_of};
use crate::on_board::{Code, OnBoard};
use crate::stream::Stream;

/// What it is, in one line.
const MEANING: &str = "there is play between encoder and wheel";

/// Gaps that are tried, metres at the tread.
const WIDTH_M: [f64; 3] = [0.5e-3, 1.0e-3, 2.0e-3];

/// The mean term in C, for a robot's own odometry.
const ON_BOARD: OnBoard = OnBoard::State {
    of: "where in its gap each wheel is",
    lag: "none: it goes by the past alone; where in its gap a wheel was at the start nobody knows, half of the gap at most",
    code: Code {
        remembers: &[("left_lead", 0.0), ("right_lead", 0.0)],
        functions: &[],
        statements: "\
const double left_before = own->left_lead, right_before = own->right_lead;
own->left_lead = fmin(fmax(left_before + left_m / width_m, -0.5), 0.5);
own->right_lead = fmin(fmax(right_before + right_m / width_m, -0.5), 0.5);
left_change_m += left_gap_m * (left_before - own->left_lead);
right_change_m += right_gap_m * (right_before - own->right_lead);",
    },
};

/// Play of each wheel.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Backlash {
    /// Whole width of the left gap, metres at the tread: what a reversal loses.
    #[serde(default)]
    pub left_gap_m: f64,
    /// The same of the right gap.
    #[serde(default)]
    pub right_gap_m: f64,
}

impl PhysicalEffect for Backlash {
    fn check(&self) -> Result<(), EffectError> {
        EffectError::unless_negative("backlash", [("left_gap_m", self.left_gap_m), ("right_gap_m", self.right_gap_m)])
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        let half_gap_m = Wheels { left: 0.5 * self.left_gap_m, right: 0.5 * self.right_gap_m };
        Some(Box::new(State { half_gap_m, lead_m: Wheels::both(0.0) }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Terms(Variant::over("width_m", &WIDTH_M, |width_m| Term { width_m, lead: Wheels::both(0.0) }))
    }

    fn description() -> Description {
        Description {
            summary: Summary::WithSize(|values| {
                let [left, right] = ["left_gap_m", "right_gap_m"].map(|name| values.shown(name, 1e3, "mm"));
                Statement::of(MEANING, format!("{left} on the left, {right} on the right"))
            }),
            benchmark: Benchmark {
                // No width is held: the gaps themselves are the sizes.
                values: ParameterLaw::Direction { fixed: |_, _, _| Vec::new(), positive: true },
                // Where in its gap a wheel was left.
                has_random_signature: true,
                ..Benchmark::OF_MEAN.with_form(
                    "play with a spring in it: the lead reaches its limit over the width of the gap",
                    |values, _| {
                        let half_gap_m = |name| 0.5 * value_of(values, name).unwrap_or(0.0);
                        let half_gap_m = Wheels { left: half_gap_m("left_gap_m"), right: half_gap_m("right_gap_m") };
                        Box::new(SpringyPlay { half_gap_m, lead_m: Wheels::default() })
                    },
                )
            },
            on_board: ON_BOARD,
            ..Description::of(MEANING)
        }
    }

    /// A wheel whose gap was found negative has none.
    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        let (left_gap_m, right_gap_m) = (value_of(values, "left_gap_m")?, value_of(values, "right_gap_m")?);
        (left_gap_m > 0.0 || right_gap_m > 0.0)
            .then(|| Self { left_gap_m: left_gap_m.max(0.0), right_gap_m: right_gap_m.max(0.0) })
    }
}

struct State {
    half_gap_m: Wheels<f64>,
    /// How far the shaft is ahead of the wheel, within ± half of the gap.
    lead_m: Wheels<f64>,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { seed_run: true, wheel: true, ..Hooks::NONE }
    }

    fn seed_run(&mut self, mut stream: Stream) {
        // Where in its gap the wheel was left, nobody knows.
        self.lead_m = Wheels::from_sides(|side| stream.uniform_about_zero(self.half_gap_m[side]));
    }

    fn wheel(&mut self, step: &mut Step) {
        for side in Side::BOTH {
            if self.half_gap_m[side] > 0.0 {
                let m_per_rad = step.nominal_radius_m[side];
                let lead_m = self.lead_m[side] + step.wheel_rad[side] * m_per_rad;
                self.lead_m[side] = lead_m.clamp(-self.half_gap_m[side], self.half_gap_m[side]);
                step.wheel_rad[side] = (lead_m - self.lead_m[side]) / m_per_rad;
            }
        }
    }
}

/// A gap of the width tried, in its widths: what the wheel does not follow, for each unit of the true gap.
/// Reversals that do not cross it, such as the last counts before a standstill, cost what they take up.
#[derive(Clone)]
struct Term {
    width_m: f64,
    /// How far the counter is ahead of the wheel; half-way where a run begins, as nobody knows.
    lead: Wheels<f64>,
}

impl ModelTerm for Term {
    /// Plausible: 2.6 mm, the upper end of what was derived.
    fn parameters(&self) -> &'static [TermParameter] {
        &[
            TermParameter { name: "left_gap_m", unit: "m", prior_sigma: 2.6e-3 },
            TermParameter { name: "right_gap_m", unit: "m", prior_sigma: 2.6e-3 },
        ]
    }

    fn restart(&mut self, _run: &RunInfo) {
        self.lead = Wheels::both(0.0);
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        for (side, gradient) in Side::BOTH.into_iter().zip(gradient) {
            let before = self.lead[side];
            let free = before + interval.travel_m[side] / self.width_m;
            self.lead[side] = free.clamp(-0.5, 0.5);
            let mut lost = Wheels::both(0.0);
            lost[side] = before - self.lead[side];
            *gradient = interval.change(lost);
        }
    }
}

/// The other form: play with a spring in it, whose lead reaches its limit over the width of the gap instead
/// of at once.
struct SpringyPlay {
    half_gap_m: Wheels<f64>,
    lead_m: Wheels<f64>,
}

impl Forward for SpringyPlay {
    fn hooks(&self) -> Hooks {
        Hooks { seed_run: true, wheel: true, ..Hooks::NONE }
    }

    fn seed_run(&mut self, _stream: Stream) {
        self.lead_m = Wheels::default();
    }

    fn wheel(&mut self, step: &mut Step) {
        for side in Side::BOTH {
            let half_gap_m = self.half_gap_m[side];
            if half_gap_m <= 0.0 {
                continue;
            }
            let rolled_m = step.wheel_rad[side] * step.nominal_radius_m[side];
            let gained_m =
                (half_gap_m * rolled_m.signum() - self.lead_m[side]) * -(-rolled_m.abs() / half_gap_m).exp_m1();
            self.lead_m[side] += gained_m;
            step.wheel_rad[side] -= gained_m / step.nominal_radius_m[side];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::specimen_step;

    #[test]
    fn a_reversal_loses_the_gap_and_only_on_its_wheel() {
        let half_gap_m = Wheels { left: 0.8e-3, right: 0.0 };
        let mut state = State { half_gap_m, lead_m: half_gap_m };
        let gap_rad = 1.6e-3 / 0.08;
        let mut turn = |shaft_rad| {
            let mut step = specimen_step();
            step.wheel_rad = Wheels::both(shaft_rad);
            state.wheel(&mut step);
            step.wheel_rad
        };
        // Rounding of 0.08 m and back.
        assert!((turn(1.0).left - 1.0).abs() < 1e-15);
        let back = turn(-1.0);
        assert!((back.left + 1.0 - gap_rad).abs() < 1e-15, "{back:?}");
        assert_eq!(back.right, -1.0);
        assert!((turn(-1.0).left + 1.0).abs() < 1e-15);
        // In small steps the same gap is lost: the wheel rests first.
        let sum: f64 = (0..1000).map(|_| turn(1e-3).left).sum();
        assert!((sum - 1.0 + gap_rad).abs() < 1e-12, "{sum}");
    }
}
