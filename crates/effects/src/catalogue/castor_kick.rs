//! `castor_kick`: after a reversal the castor flips over and pushes the tail aside.
//!
//! Model: e_dθ = ±K e^{−s/s₀} per s₀ of distance s since the reversal, K in all. The castor leans towards the
//! inside of the last turn and flips over on that side: the kick has that turn's sense; a castor that never
//! leaned falls to either side.
//! Signature: heading transients after reversals.
//! Observability: reversals after turns to both sides.
//! Alias: `backlash`, whose loss also comes with reversals. Needs a log finer than s₀.
//! Reference: the castor's differential equation linearised, ψ' = −sin ψ/trail; 2 to 4 trail lengths, 0.1 to
//! 2° a reversal, a rule of thumb.

use dataset::RunInfo;
use kinematics::Pose;
use model_term::{Interval, ModelTerm, TermParameter};
use serde::{Deserialize, Serialize};

use crate::benchmark::Benchmark;
use crate::description::{Description, Statement, Summary};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, Step};
use crate::hypothesis::{Hypothesis, Variant, value_of};
use crate::motion_history::{Hysteresis, Reversals, TURN_RAD};
use crate::on_board::{Code, NEVER_REVERSED_M, OnBoard};
use crate::stream::Stream;

/// What it is, in one line.
const MEANING: &str = "the castor swings round after a reversal and turns the robot";

/// Ways that are tried for a flip, metres: 2 to 4 trails of 15 to 60 mm.
const DECAY_M: [f64; 4] = [0.03, 0.06, 0.12, 0.24];

/// The mean term in C, for a robot's own odometry: [`FlipState`].
const ON_BOARD: OnBoard = OnBoard::State {
    of: "the sense of the last turn, and the distance since the last reversal",
    lag: "none: it goes by the past alone",
    code: Code {
        remembers: &[
            ("leaned_rad", 0.0),
            ("leans", 0.0),
            ("went_m", 0.0),
            ("sense", 0.0),
            ("since_m", NEVER_REVERSED_M),
        ],
        functions: &[],
        statements: "\
const double band_m = fmax(5e-4, 0.5 * (left_count_m + right_count_m)), before = own->sense;
own->went_m = fmin(fmax(own->went_m + distance_m, -band_m), band_m);
if (fabs(own->went_m) >= band_m) {
    own->sense = yair_sense(own->went_m);
}
if (own->sense * before < 0.0) {
    own->since_m = 0.0;
}
own->since_m += fabs(distance_m);
own->leaned_rad = fmin(fmax(own->leaned_rad + turn_rad, -0.03), 0.03);
if (fabs(own->leaned_rad) >= 0.03) {
    own->leans = yair_sense(own->leaned_rad);
}
turn_change_rad += kick_rad * own->leans
                   * (exp((fabs(distance_m) - own->since_m) / decay_m) - exp(-own->since_m / decay_m));",
    },
};

/// The kick of a castor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CastorKick {
    /// Turn that a reversal makes in all, with the sense of the last turn (K), radians.
    pub kick_rad: f64,
    /// Distance over which it fades by 1/e (s₀), metres.
    pub decay_m: f64,
}

impl PhysicalEffect for CastorKick {
    fn check(&self) -> Result<(), EffectError> {
        EffectError::unless_finite("castor_kick", [("kick_rad", self.kick_rad)])?;
        EffectError::unless_positive("castor_kick", [("decay_m", self.decay_m)])
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { effect: *self, flips: FlipState::NONE }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Terms(Variant::along("decay_m", &DECAY_M, |decay_m| Box::new(Term::new(decay_m))))
    }

    fn description() -> Description {
        Description {
            summary: Summary::WithSize(|values| {
                Statement::of(MEANING, format!("by {}", values.shown("kick_rad", 1e3, "mrad")))
            }),
            benchmark: Benchmark::of_mean_at(|_, _, stream| vec![("decay_m", stream.log_uniform(0.02, 0.2))])
                .with_form("a castor by its differential equation, which turns the robot as it flips", |values, _| {
                    let of = |name| value_of(values, name).unwrap_or(0.0);
                    let (gain, trail_m) = (of("kick_rad") / std::f64::consts::PI, 0.5 * of("decay_m"));
                    Box::new(RollingCastor { gain, trail_m, psi_rad: 0.0 })
                }),
            on_board: ON_BOARD,
            ..Description::of(MEANING)
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        Some(Self { kick_rad: value_of(values, "kick_rad")?, decay_m: value_of(values, "decay_m")? })
    }
}

/// Where a castor is in its flip.
#[derive(Debug, Clone, Copy)]
struct FlipState {
    /// A turn makes it lean.
    leans: Hysteresis,
    reversals: Reversals,
}

impl FlipState {
    const NONE: Self = Self { leans: Hysteresis::beyond(TURN_RAD), reversals: Reversals::NONE };

    /// The share of a kick that a distance and a turn bring, with the sense of the last turn.
    fn after(&mut self, distance_m: f64, turn_rad: f64, decay_m: f64) -> f64 {
        let to_m = self.reversals.after(distance_m);
        let left = |distance_m: f64| (-distance_m / decay_m).exp();
        self.leans.after(turn_rad) * (left(to_m - distance_m.abs()) - left(to_m))
    }
}

struct State {
    effect: CastorKick,
    flips: FlipState,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { seed_run: true, floor: true, ..Hooks::NONE }
    }

    fn seed_run(&mut self, _stream: Stream) {
        self.flips = FlipState::NONE;
    }

    fn floor(&mut self, step: &mut Step) {
        let distance_m = 0.5 * (step.travel_m.left + step.travel_m.right);
        let turn_rad = (step.travel_m.right - step.travel_m.left) / step.wheel_separation_m;
        step.extra_turn_rad += self.effect.kick_rad * self.flips.after(distance_m, turn_rad, self.effect.decay_m);
    }

    fn needs_stepping(&self) -> Option<&'static str> {
        Some("the heading changes within the first centimetres of a motion")
    }
}

/// By the counts: which way the robot went, where it turned round, and to which side it had turned before.
#[derive(Clone)]
struct Term {
    decay_m: f64,
    flips: FlipState,
}

impl Term {
    const fn new(decay_m: f64) -> Self {
        Self { decay_m, flips: FlipState::NONE }
    }
}

impl ModelTerm for Term {
    /// Plausible: 2°, the upper end of the rule of thumb.
    fn parameters(&self) -> &'static [TermParameter] {
        &[TermParameter { name: "kick_rad", unit: "rad", prior_sigma: 0.035 }]
    }

    fn restart(&mut self, _run: &RunInfo) {
        *self = Self::new(self.decay_m);
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        let increment = interval.increment();
        self.flips.reversals.debounce(0.5 * (interval.count_m.left + interval.count_m.right));
        gradient[0].theta_rad = self.flips.after(increment.distance_m, increment.turn_rad, self.decay_m);
    }
}

/// The other form, a castor by its differential equation: it trails at 0, stands on its head at π, and turns
/// the robot as it flips.
struct RollingCastor {
    /// Turn of the robot over the castor's.
    gain: f64,
    trail_m: f64,
    psi_rad: f64,
}

/// How far behind the axle that castor is, metres.
const CASTOR_BEHIND_M: f64 = 0.15;

impl Forward for RollingCastor {
    fn hooks(&self) -> Hooks {
        Hooks { seed_run: true, floor: true, ..Hooks::NONE }
    }

    fn seed_run(&mut self, _stream: Stream) {
        self.psi_rad = 0.0;
    }

    /// A turn of the robot leaves the castor's direction in the room where it was; rolling takes it behind.
    fn floor(&mut self, step: &mut Step) {
        let distance_m = 0.5 * (step.travel_m.left + step.travel_m.right);
        let turn_rad = (step.travel_m.right - step.travel_m.left) / step.wheel_separation_m;
        let before_rad = self.psi_rad;
        let aside_m = CASTOR_BEHIND_M * turn_rad;
        self.psi_rad -= turn_rad + (aside_m * before_rad.cos() + distance_m * before_rad.sin()) / self.trail_m;
        // Only a flip drags the tail: rolling on behind the robot does not.
        if distance_m * before_rad.cos() < 0.0 {
            step.extra_turn_rad += self.gain * (before_rad - self.psi_rad);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::specimen_step;
    use kinematics::Wheels;

    #[test]
    fn a_reversal_kicks_once_to_the_side_of_the_last_turn_and_a_new_start_does_not() {
        let effect = CastorKick { kick_rad: 0.02, decay_m: 0.05 };
        let mut state = effect.forward().expect("acts on the floor");
        let mut drive = |left_m: f64, right_m: f64| -> f64 {
            (0..1000)
                .map(|_| {
                    let mut step = specimen_step();
                    step.travel_m = Wheels { left: left_m / 1000.0, right: right_m / 1000.0 };
                    state.floor(&mut step);
                    step.extra_turn_rad
                })
                .sum()
        };
        assert_eq!(drive(1.0, 1.0), 0.0);
        assert_eq!(drive(-1.0, -1.0), 0.0, "it never leaned");
        assert_eq!(drive(-0.3, 0.3), 0.0, "a turn on the spot is no reversal");
        let kick_rad = drive(1.0, 1.0);
        assert!((kick_rad - 0.02).abs() < 0.02 * 1e-6, "20 lengths: e⁻²⁰ is left, {kick_rad}");
        assert_eq!(drive(0.3, -0.3), 0.0);
        assert!(drive(1.0, 1.0).abs() < 1e-9, "on it goes, the same way");
        assert!((drive(-1.0, -1.0) + 0.02).abs() < 0.02 * 1e-6);
    }
}
