//! `contact_patch_wheelbase`: the wheels touch the floor with a patch, so the distance between the contacts
//! varies.
//!
//! Model: B = B̄ + ε, with ε ~ N(0, σ_b²) drawn once a motion, and within a motion a slow part: a
//! Gauss–Markov process along the wheels' travel, corr = exp(−Δs/ℓ).
//! Signature: scatter of the heading in proportion to the turned angle, σ_θ = |Δθ| σ_b/B.
//! Observability: repeated turns.
//! Alias: wheel noise, whose heading variance grows with travel and not with the square of the turn.
//! Reference: Navarro et al., eq. (10) and (11).

use model_term::Interval;
use serde::{Deserialize, Serialize};

use crate::benchmark::Benchmark;
use crate::description::Description;
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, LaneForm, Step};
use crate::hypothesis::{Hypothesis, Sign, value_of};
use crate::on_board::{Code, IntervalScatter, OnBoard, Scatter, ScatterModel};
use crate::stream::Stream;

/// Standstill after which a robot's own odometry takes what follows for another motion, seconds: counts of a
/// creeping robot pause for less.
const STANDSTILL_S: f64 = 0.2;

/// What a robot's own odometry adds to its covariance: one draw of the separation a motion, and the slow part
/// as what it comes to over distances far beyond its length.
const ON_BOARD: OnBoard = OnBoard::CovarianceOnly(Scatter {
    of: "the separation, drawn anew after each standstill, and its slow variation",
    code: Code {
        remembers: &[("stood_s", 0.0)],
        functions: &[],
        statements: "\
separation_var_m2 += sigma_m * sigma_m;
if (left_m == 0.0 && right_m == 0.0) {
    own->stood_s += dt_s;
} else {
    const double tread_m = 0.5 * (fabs(left_m) + fabs(right_m));
    const double per_m = slow_sigma_m * turn_rad / YAIR_WHEEL_SEPARATION_M;
    motion_begins |= own->stood_s >= 0.2;
    own->stood_s = 0.0;
    turn_var_rad2 += per_m * per_m * 2.0 * slow_length_m / tread_m;
}",
    },
    model: |size| {
        Box::new(Patch {
            sigma_m: size("sigma_m"),
            slow_sigma_m: size("slow_sigma_m"),
            slow_length_m: size("slow_length_m"),
            stood_s: 0.0,
        })
    },
});

struct Patch {
    sigma_m: f64,
    slow_sigma_m: f64,
    slow_length_m: f64,
    stood_s: f64,
}

impl ScatterModel for Patch {
    fn after(&mut self, interval: &Interval<'_>, scatter: &mut IntervalScatter) {
        scatter.separation_var_m2 += self.sigma_m * self.sigma_m;
        let tread_m = 0.5 * (interval.travel_m.left.abs() + interval.travel_m.right.abs());
        if tread_m == 0.0 {
            self.stood_s += interval.dt_s;
            return;
        }
        scatter.motion_begins |= self.stood_s >= STANDSTILL_S;
        self.stood_s = 0.0;
        let turned = self.slow_sigma_m * interval.increment().turn_rad / interval.wheel_separation_m;
        scatter.turn_var_rad2 += turned * turned * 2.0 * self.slow_length_m / tread_m;
    }
}

/// Scatter of the effective wheelbase.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ContactPatchWheelbase {
    /// Standard deviation from motion to motion, metres (σ_b).
    pub sigma_m: f64,
    /// Standard deviation of the slow variation within a motion, metres.
    #[serde(default)]
    pub slow_sigma_m: f64,
    /// Wheel travel over which the slow variation forgets itself, metres; needed when `slow_sigma_m` is not
    /// 0.
    #[serde(default)]
    pub slow_length_m: f64,
}

/// Why a whole motion at once does not have the slow part.
const SLOW_PART_VARIES: &str = "its slow part varies within a motion";

impl PhysicalEffect for ContactPatchWheelbase {
    fn check(&self) -> Result<(), EffectError> {
        let id = "contact_patch_wheelbase";
        let sigma = |parameter, value: f64| {
            EffectError::unless(value.is_finite() && value >= 0.0, id, parameter, value, "0 or more")
        };
        sigma("sigma_m", self.sigma_m)?;
        sigma("slow_sigma_m", self.slow_sigma_m)?;
        let holds = self.slow_sigma_m == 0.0 || self.slow_length_m > 0.0;
        EffectError::unless(holds, id, "slow_length_m", self.slow_length_m, "positive when slow_sigma_m is not 0")
    }

    fn wheel_separation_sigma_m(&self) -> Result<f64, &'static str> {
        if self.slow_sigma_m > 0.0 { Err(SLOW_PART_VARIES) } else { Ok(self.sigma_m) }
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { effect: *self, stream: None, motion_m: 0.0, slow_m: 0.0 }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Scatter(&[Sign::ScatterWithTurn])
    }

    fn description() -> Description {
        Description {
            benchmark: Benchmark::of_scatter(|_, _| (vec![("sigma_m", 3e-3)], vec![])),
            on_board: ON_BOARD,
            ..Description::of("the distance between the contacts varies from motion to motion")
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        let slow = |name| value_of(values, name).unwrap_or(0.0);
        let (slow_sigma_m, slow_length_m) = (slow("slow_sigma_m"), slow("slow_length_m"));
        Some(Self { sigma_m: value_of(values, "sigma_m")?, slow_sigma_m, slow_length_m })
    }
}

struct State {
    effect: ContactPatchWheelbase,
    stream: Option<Stream>,
    motion_m: f64,
    slow_m: f64,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { seed_run: true, start_motion: true, floor: true, ..Hooks::NONE }
    }

    fn seed_run(&mut self, mut stream: Stream) {
        self.slow_m = self.effect.slow_sigma_m * stream.normal();
        self.stream = Some(stream);
    }

    fn start_motion(&mut self) {
        if let Some(stream) = &mut self.stream {
            self.motion_m = self.effect.sigma_m * stream.normal();
        }
    }

    fn floor(&mut self, step: &mut Step) {
        if self.effect.slow_sigma_m > 0.0
            && let Some(stream) = &mut self.stream
        {
            let travel_m = 0.5 * (step.travel_m.left.abs() + step.travel_m.right.abs());
            let kept = (-travel_m / self.effect.slow_length_m).exp();
            self.slow_m = kept * self.slow_m + self.effect.slow_sigma_m * (1.0 - kept * kept).sqrt() * stream.normal();
        }
        step.wheel_separation_m += self.motion_m + self.slow_m;
    }

    fn lane_form(&self) -> Option<LaneForm> {
        let is_drawn_per_motion = self.effect.slow_sigma_m == 0.0;
        is_drawn_per_motion.then_some(LaneForm::SeparationPerMotion { sigma_m: self.effect.sigma_m })
    }

    fn needs_stepping(&self) -> Option<&'static str> {
        (self.effect.slow_sigma_m > 0.0).then_some(SLOW_PART_VARIES)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::specimen_step;
    use crate::{Address, StreamName};

    #[test]
    fn paper_eq_11_the_wheelbase_is_normal_from_motion_to_motion() {
        let effect = ContactPatchWheelbase { sigma_m: 1e-3, slow_sigma_m: 0.0, slow_length_m: 0.0 };
        let mut state = effect.forward().expect("acts in steps");
        state.seed_run(Address { seed: 5, point: 0, trial: 0, run: 0 }.stream(StreamName::new("test")));
        let (n, mut sum, mut squares) = (20_000, 0.0, 0.0);
        for _ in 0..n {
            state.start_motion();
            let mut step = specimen_step();
            state.floor(&mut step);
            let excess_m = step.wheel_separation_m - specimen_step().wheel_separation_m;
            sum += excess_m;
            squares += excess_m * excess_m;
        }
        let n = f64::from(n);
        // Five standard errors of a mean and of a variance.
        assert!((sum / n).abs() < 5.0 * 1e-3 / n.sqrt());
        let stated_m = effect.wheel_separation_sigma_m().expect("no slow part");
        assert!((squares / n / (stated_m * stated_m) - 1.0).abs() < 5.0 * (2.0 / n).sqrt());
        let slow = ContactPatchWheelbase { slow_sigma_m: 1e-4, slow_length_m: 0.2, ..effect };
        assert_eq!(slow.wheel_separation_sigma_m(), Err(SLOW_PART_VARIES));
    }

    #[test]
    fn the_slow_part_has_the_same_variance_however_the_path_is_cut() {
        for parts in [1_u32, 16] {
            let effect = ContactPatchWheelbase { sigma_m: 0.0, slow_sigma_m: 1e-3, slow_length_m: 0.2 };
            let mut state = effect.forward().expect("acts in steps");
            let (runs, mut squares, mut products) = (4000_u32, 0.0, 0.0);
            for run in 0..runs {
                state.seed_run(
                    Address { seed: 6, point: 0, trial: u64::from(run), run: 0 }.stream(StreamName::new("test")),
                );
                let excess = |state: &mut Box<dyn Forward>, travel_m: f64| {
                    let mut step = specimen_step();
                    step.travel_m = kinematics::Wheels::both(travel_m);
                    state.floor(&mut step);
                    step.wheel_separation_m - specimen_step().wheel_separation_m
                };
                let before = excess(&mut state, 0.0);
                let mut after = before;
                for _ in 0..parts {
                    after = excess(&mut state, 0.2 / f64::from(parts));
                }
                squares += after * after;
                products += before * after;
            }
            let n = f64::from(runs);
            assert!((squares / n / 1e-6 - 1.0).abs() < 5.0 * (2.0 / n).sqrt(), "{parts}");
            // One length apart the correlation is 1/e.
            assert!((products / n / 1e-6 - (-1.0_f64).exp()).abs() < 5.0 * (2.0 / n).sqrt(), "{parts}");
        }
    }
}
