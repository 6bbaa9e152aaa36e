//! `stick_slip`: at a creep a wheel winds up before its contact lets go.
//!
//! Model: below a speed the contact sticks while the tread goes on, until the wind-up reaches a breakaway way, uniform between nothing and twice its mean;
//! then all of it is let go at once, as it is when the wheel becomes faster. Signature: tails at low speed that do not add up.
//! Observability: looks at a creeping robot. Alias: quantization. Reference: Coulomb friction on a compliant contact, Armstrong-Hélouvry et al. 1994.

use kinematics::{Side, Wheels};
use serde::{Deserialize, Serialize};

use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, Step};
use crate::hypothesis::{Hypothesis, Sign, size};
use crate::stream::Stream;

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
        let sizes = [("stick_speed_m_s", self.stick_speed_m_s), ("breakaway_m", self.breakaway_m)];
        EffectError::unless_sizes("stick_slip", sizes)
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        let none = Wheels::both(0.0);
        Some(Box::new(State { size: *self, stream: None, wound_m: none, holds_m: none }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Scatter(&[Sign::TailsAtLowSpeed])
    }

    fn of_sizes(sizes: &[(&str, f64)]) -> Option<Self> {
        Some(Self { stick_speed_m_s: size(sizes, "stick_speed_m_s")?, breakaway_m: size(sizes, "breakaway_m")? })
    }
}

struct State {
    size: StickSlip,
    stream: Option<Stream>,
    /// What each tread has gone without its contact, metres.
    wound_m: Wheels<f64>,
    /// At how much each lets go, metres.
    holds_m: Wheels<f64>,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { start_run: true, floor: true, ..Hooks::NONE }
    }

    fn start_run(&mut self, mut stream: Stream) {
        self.wound_m = Wheels::both(0.0);
        self.holds_m = Wheels::from_sides(|_| 2.0 * self.size.breakaway_m * stream.uniform());
        self.stream = Some(stream);
    }

    fn floor(&mut self, step: &mut Step) {
        let Some(stream) = &mut self.stream else { return };
        let speed_m_s = step.contact_speed_m_s();
        for side in Side::BOTH {
            let wound_m = self.wound_m[side] + step.travel_m[side];
            if speed_m_s[side].abs() < self.size.stick_speed_m_s && wound_m.abs() < self.holds_m[side] {
                self.wound_m[side] = wound_m;
                step.travel_m[side] = 0.0;
            } else if self.wound_m[side] != 0.0 {
                self.wound_m[side] = 0.0;
                step.travel_m[side] = wound_m;
                self.holds_m[side] = 2.0 * self.size.breakaway_m * stream.uniform();
            }
        }
    }

    fn needs_stepping(&self) -> Option<&'static str> {
        Some("the closed form starts and stops at once")
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
        state.start_run(Address { seed: 2, point: 0, trial: 0, run: 0 }.stream(StreamName::new("test")));
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
}
