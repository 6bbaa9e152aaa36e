//! `stick_slip`: at a creep a wheel winds up before its contact lets go.
//!
//! Model: below a speed the contact sticks while the tread goes on, until the wind-up reaches a breakaway
//! distance, uniform between nothing and twice its mean; then all of it is let go at once, as it is when the
//! wheel becomes faster.
//! Signature: tails at low speed that do not add up; a creeping contact, and one at rest after a creep, is on
//! average two thirds of the mean breakaway behind its tread.
//! Observability: measurements of a creeping robot, or at rest and while it drives.
//! Alias: quantization; `backlash` and `truth_latency` where measurements are few.
//! Reference: Coulomb friction on a compliant contact, Armstrong-Hélouvry et al. 1994; the mean age of a
//! renewal process, Cox 1962.

use dataset::RunInfo;
use kinematics::{Pose, Side, Wheels};
use model_term::{Interval, ModelTerm, TermParameter};
use serde::{Deserialize, Serialize};

use crate::benchmark::Benchmark;
use crate::description::{Description, IsolatedError};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, Step};
use crate::hypothesis::{Hypothesis, Sign, Variant, value_of};
use crate::on_board::{Code, OnBoard};
use crate::stream::Stream;

/// Scales of the distance by which a contact winds up, metres: from what no instrument shows to a sill.
const WIND_UP_SCALES_M: [f64; 6] = [1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2];

/// [`Term::next`] in C.
const WIND_UP: &str = "\
/* Where a contact's mean wind-up goes, in mean breakaways, from where it is. */
static inline double yair_wind_up(double wound, double travel_m, double speed_m_s, double stick_speed_m_s) {
    const double sense = travel_m < 0.0 ? -1.0 : 1.0;
    const double unwound = fmin(sense * wound, 0.0) + fabs(travel_m) / 1e-3;
    if (fabs(speed_m_s) >= stick_speed_m_s) {
        return 0.0;
    }
    if (travel_m == 0.0) {
        return wound;
    }
    if (unwound <= 0.0) {
        return sense * unwound;
    }
    return sense * (2.0 / 3.0 + (fmax(sense * wound, 0.0) - 2.0 / 3.0) * exp(-unwound / 0.5));
}
";

/// The mean term in C, for a robot's own odometry.
const ON_BOARD: OnBoard = OnBoard::State {
    of: "the wind-up of each contact",
    lag: "none in the wind-up; the speed is that of the interval itself, so that with few counts an interval a creep near the speed of sticking lets go too often",
    code: Code {
        remembers: &[("left_wound", 0.0), ("right_wound", 0.0)],
        functions: &[WIND_UP],
        statements: "\
const double left_before = own->left_wound, right_before = own->right_wound;
own->left_wound = yair_wind_up(left_before, left_m, left_m_s, stick_speed_m_s);
own->right_wound = yair_wind_up(right_before, right_m, right_m_s, stick_speed_m_s);
left_change_m += breakaway_m * (left_before - own->left_wound);
right_change_m += breakaway_m * (right_before - own->right_wound);",
    },
};

/// Sticking contacts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StickSlip {
    /// Speed of a contact below which it sticks, m/s.
    pub stick_speed_m_s: f64,
    /// Wind-up at which it lets go, on average, metres.
    pub breakaway_m: f64,
}

impl PhysicalEffect for StickSlip {
    fn check(&self) -> Result<(), EffectError> {
        let values = [("stick_speed_m_s", self.stick_speed_m_s), ("breakaway_m", self.breakaway_m)];
        EffectError::unless_negative("stick_slip", values)
    }

    /// Of the age of a renewal process in its stationary state, `E[h³]/(3 E[h])` less the square of its mean.
    fn scatter_of_contact_m(&self) -> f64 {
        (2.0_f64 / 9.0).sqrt() * self.breakaway_m
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        let none = Wheels::both(0.0);
        Some(Box::new(State { effect: *self, stream: None, wound_m: none, holds_m: none }))
    }

    fn hypothesis() -> Hypothesis {
        let terms = Variant::along("stick_speed_m_s", &STICK_SPEEDS_M_S, |stick_speed_m_s| {
            Box::new(Term::new(stick_speed_m_s))
        });
        Hypothesis::TermsAndScatter(terms, &[Sign::TailsAtLowSpeed])
    }

    fn description() -> Description {
        Description {
            isolated_error: Some(IsolatedError::WoundUp { scales_m: &WIND_UP_SCALES_M }),
            benchmark: Benchmark::of_scatter(|robot, _| {
                (vec![("breakaway_m", 1e-3)], vec![("stick_speed_m_s", 0.5 * robot.cruise_speed_m_s)])
            }),
            on_board: ON_BOARD,
            ..Description::of("at a creep a wheel winds up before its contact lets go")
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        Some(Self {
            stick_speed_m_s: value_of(values, "stick_speed_m_s")?,
            breakaway_m: value_of(values, "breakaway_m")?,
        })
    }
}

struct State {
    effect: StickSlip,
    stream: Option<Stream>,
    /// What each tread has gone without its contact, metres.
    wound_m: Wheels<f64>,
    /// At how much each lets go, metres.
    holds_m: Wheels<f64>,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { seed_run: true, floor: true, ..Hooks::NONE }
    }

    fn seed_run(&mut self, mut stream: Stream) {
        self.wound_m = Wheels::both(0.0);
        self.holds_m = Wheels::from_sides(|_| 2.0 * self.effect.breakaway_m * stream.uniform());
        self.stream = Some(stream);
    }

    fn floor(&mut self, step: &mut Step) {
        let Some(stream) = &mut self.stream else { return };
        let speed_m_s = step.contact_speed_m_s();
        for side in Side::BOTH {
            let wound_m = self.wound_m[side] + step.travel_m[side];
            if speed_m_s[side].abs() < self.effect.stick_speed_m_s && wound_m.abs() < self.holds_m[side] {
                self.wound_m[side] = wound_m;
                step.travel_m[side] = 0.0;
            } else if self.wound_m[side] != 0.0 {
                self.wound_m[side] = 0.0;
                step.travel_m[side] = wound_m;
                self.holds_m[side] = 2.0 * self.effect.breakaway_m * stream.uniform();
            }
        }
    }

    fn needs_stepping(&self) -> Option<&'static str> {
        Some("the closed form starts and stops at once")
    }
}

/// Speeds of a contact below which it sticks that are tried, m/s.
const STICK_SPEEDS_M_S: [f64; 6] = [0.01, 0.025, 0.05, 0.1, 0.17, 0.3];
/// Mean wind-up of a contact that creeps on and on, over the mean breakaway: `E[h²]/(2 E[h])` of a breakaway
/// h that is uniform from nothing on.
const MEAN_WIND_UP: f64 = 2.0 / 3.0;
/// Distance over which the mean wind-up comes to that, over the mean breakaway: by least squares over
/// distances of up to two breakaways.
const WIND_UP_RATIO: f64 = 0.5;
/// A breakaway that is usual, metres: the distance over which a wind-up comes about is taken from it,
/// whatever its size.
const TYPICAL_BREAKAWAY_M: f64 = 1e-3;

/// The mean wind-up for each unit of the mean breakaway.
#[derive(Clone)]
struct Term {
    stick_speed_m_s: f64,
    wound: Wheels<f64>,
}

impl Term {
    const fn new(stick_speed_m_s: f64) -> Self {
        Self { stick_speed_m_s, wound: Wheels { left: 0.0, right: 0.0 } }
    }

    /// Where a contact's mean wind-up goes from here.
    fn next(&self, wound: f64, travel_m: f64, speed_m_s: f64) -> f64 {
        if speed_m_s.abs() >= self.stick_speed_m_s {
            return 0.0;
        }
        if travel_m == 0.0 {
            return wound;
        }
        // Forward is where the tread goes: what is wound up the other way unwinds first.
        let (sense, breakaways) = (travel_m.signum(), travel_m.abs() / TYPICAL_BREAKAWAY_M);
        let unwound = (sense * wound).min(0.0) + breakaways;
        let wound = (sense * wound).max(0.0);
        if unwound <= 0.0 {
            return sense * unwound;
        }
        sense * (MEAN_WIND_UP + (wound - MEAN_WIND_UP) * (-unwound / WIND_UP_RATIO).exp())
    }
}

impl ModelTerm for Term {
    /// Plausible: a millimetre, what a soft tyre gives way; no one has measured it.
    fn parameters(&self) -> &'static [TermParameter] {
        &[TermParameter { name: "breakaway_m", unit: "m", prior_sigma: TYPICAL_BREAKAWAY_M }]
    }

    fn restart(&mut self, _run: &RunInfo) {
        self.wound = Wheels::both(0.0);
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        let speed_m_s = interval.speed_m_s;
        let before = self.wound;
        self.wound = Wheels::from_sides(|side| self.next(before[side], interval.travel_m[side], speed_m_s[side]));
        gradient[0] = interval.change(before.zip_with(self.wound, |before, after| before - after));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::specimen_step;
    use crate::{Address, StreamName};

    #[test]
    fn a_creeping_wheel_jumps_and_nothing_is_lost_in_the_end() {
        let mut state = StickSlip { stick_speed_m_s: 0.02, breakaway_m: 2e-3 }.forward().expect("acts on the floor");
        state.seed_run(Address { seed: 2, point: 0, trial: 0, run: 0 }.stream(StreamName::new("test")));
        let (mut tread_m, mut ground_m, mut most_m, mut at_rest) = (0.0, 0.0, 0.0_f64, 0);
        for speed_m_s in [0.01, 0.1] {
            for _ in 0..5000 {
                let mut step = specimen_step();
                step.rate_rad_s = Wheels::both(speed_m_s / 0.08);
                step.travel_m = Wheels::both(speed_m_s * step.dt_s);
                tread_m += step.travel_m.left;
                state.floor(&mut step);
                ground_m += step.travel_m.left;
                at_rest += i32::from(step.travel_m.left == 0.0);
                most_m = most_m.max(tread_m - ground_m);
            }
        }
        assert!(most_m > 1e-3 && most_m <= 4e-3, "{most_m}");
        assert!(at_rest > 4000, "it stands most of the slow time and none of the fast: {at_rest}");
        assert!((tread_m - ground_m).abs() < 1e-12, "{tread_m} {ground_m}");
    }

    #[test]
    fn the_term_is_the_mean_of_many_contacts() {
        let (breakaway_m, stick_speed_m_s, speed_m_s) = (TYPICAL_BREAKAWAY_M, 0.02, 0.01);
        let mut step = specimen_step();
        step.rate_rad_s = Wheels::both(speed_m_s / 0.08);
        let each_m = speed_m_s * step.dt_s;
        // Distances in breakaways, the last one back.
        for distances in [&[0.5][..], &[1.0], &[3.0], &[8.0], &[3.0, -1.0], &[3.0, -4.0]] {
            let term = Term::new(stick_speed_m_s);
            let expected = distances
                .iter()
                .fold(0.0, |wound, distance| term.next(wound, distance * breakaway_m, distance.signum() * speed_m_s));
            let mut wound = Vec::new();
            for run in 0..2000 {
                let mut state = StickSlip { stick_speed_m_s, breakaway_m }.forward().expect("acts on the floor");
                state.seed_run(Address { seed: 3, point: 0, trial: 0, run }.stream(StreamName::new("test")));
                let mut behind_m = 0.0;
                for distance in distances {
                    for _ in 0..(distance.abs() * breakaway_m / each_m).round() as usize {
                        let mut step = step;
                        step.travel_m = Wheels::both(each_m * distance.signum());
                        state.floor(&mut step);
                        behind_m += each_m * distance.signum() - step.travel_m.left;
                    }
                }
                wound.push(behind_m / breakaway_m);
            }
            let mean = wound.iter().sum::<f64>() / 2000.0;
            // The exponential is off by a tenth of a breakaway or so; half of the mean wind-up would be off
            // by 0.33, and its sign by 1.3.
            assert!((mean - expected).abs() < 0.15, "{distances:?}: {mean} {expected}");
        }
        assert_eq!(Term::new(0.02).next(0.5, 1e-3, 0.03), 0.0, "what is fast has let go");
    }
}
