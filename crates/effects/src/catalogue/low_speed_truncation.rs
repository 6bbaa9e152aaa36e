//! `low_speed_truncation`: a firmware that keeps whole units of distance in every cycle throws the fractions
//! away.
//!
//! Model: of each wheel's travel in a cycle only whole units are kept: half a unit is lost a cycle on
//! average, whatever the speed, and all below one. Other work delays the loop: a cycle lasts from half to one
//! and a half of its mean.
//! Signature: the robot goes farther than it counts, by a constant speed: a scale error that vanishes at
//! speed.
//! Observability: two speeds.
//! Alias: `wheel_scale` at one speed. Assumption of the hypothesis: fractions of all sizes are equally
//! likely, which a speed that is a whole number of units a cycle breaks.
//! Reference: users' reports of integer odometry; the mean of a uniform fraction.

use kinematics::{Pose, Side, Wheels};
use model_term::{Interval, ModelTerm, TermParameter};
use serde::{Deserialize, Serialize};

use crate::benchmark::Benchmark;
use crate::description::{Description, Statement, Summary};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, Readout, Step};
use crate::hypothesis::{Hypothesis, Variant, value_of};
use crate::on_board::OnBoard;
use crate::stream::Stream;

/// What it is, in one line.
const MEANING: &str = "fractions of counts are thrown away step by step";

/// The mean term in C, for a robot's own odometry.
const ON_BOARD: &str = "\
left_change_m += loss_m_s * yair_sense(left_m) * dt_s;
right_change_m += loss_m_s * yair_sense(right_m) * dt_s;";

/// Fractions thrown away.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LowSpeedTruncation {
    /// Way lost per second on average, half a unit a cycle, m/s.
    pub loss_m_s: f64,
    /// The firmware's cycle on average, seconds.
    pub cycle_s: f64,
}

/// The cycle of a fitted effect, seconds: data show the loss per second alone.
const TYPICAL_CYCLE_S: f64 = 0.02;

impl PhysicalEffect for LowSpeedTruncation {
    fn check(&self) -> Result<(), EffectError> {
        EffectError::unless_negative("low_speed_truncation", [("loss_m_s", self.loss_m_s)])?;
        EffectError::unless_positive("low_speed_truncation", [("cycle_s", self.cycle_s)])
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        let none = Wheels::both(0.0);
        Some(Box::new(State { effect: *self, stream: None, cycle_ends_s: 0.0, in_cycle_m: none, lost_m: none }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Terms(Variant::plain(Term))
    }

    fn description() -> Description {
        Description {
            summary: Summary::WithSize(|values| {
                Statement::of(MEANING, format!("{} of speed lost", values.shown("loss_m_s", 1e3, "mm/s")))
            }),
            benchmark: Benchmark {
                // Which fraction of a count was lost.
                has_random_signature: true,
                ..Benchmark::of_mean_at(|_, _, stream| vec![("cycle_s", stream.log_uniform(0.005, 0.05))])
            },
            on_board: OnBoard::Static(ON_BOARD),
            ..Description::of(MEANING)
        }
    }

    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        Some(Self {
            loss_m_s: value_of(values, "loss_m_s")?,
            cycle_s: value_of(values, "cycle_s").unwrap_or(TYPICAL_CYCLE_S),
        })
    }
}

struct State {
    effect: LowSpeedTruncation,
    stream: Option<Stream>,
    cycle_ends_s: f64,
    in_cycle_m: Wheels<f64>,
    lost_m: Wheels<f64>,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { seed_run: true, encoder: true, readout: true, ..Hooks::NONE }
    }

    fn seed_run(&mut self, stream: Stream) {
        self.stream = Some(stream);
        self.cycle_ends_s = self.effect.cycle_s;
        self.in_cycle_m = Wheels::both(0.0);
        self.lost_m = Wheels::both(0.0);
    }

    /// Watches what the counters see; the controllers, which count whole, are not disturbed.
    fn encoder(&mut self, step: &mut Step) {
        let Some(stream) = &mut self.stream else { return };
        let unit_m = 2.0 * self.effect.loss_m_s * self.effect.cycle_s;
        let step_m = step.encoder_rad.zip_with(step.nominal_radius_m, |rad, radius_m| rad * radius_m);
        let (mut from_s, end_s) = (step.t_s, step.t_s + step.dt_s);
        // Cycles end between the engine's steps too: way by whole steps would make few fractions, the same
        // ones over and over.
        while self.cycle_ends_s <= end_s {
            let part = (self.cycle_ends_s - from_s) / step.dt_s;
            let in_cycle_m = self.in_cycle_m.zip_with(step_m, |distance_m, step_m| distance_m + part * step_m);
            let fraction_m = |distance_m: f64| if unit_m > 0.0 { distance_m % unit_m } else { 0.0 };
            self.lost_m = self.lost_m.zip_with(in_cycle_m, |lost_m, distance_m| lost_m + fraction_m(distance_m));
            self.in_cycle_m = Wheels::both(0.0);
            from_s = self.cycle_ends_s;
            self.cycle_ends_s += self.effect.cycle_s * (0.5 + stream.uniform());
        }
        let rest = (end_s - from_s) / step.dt_s;
        self.in_cycle_m = self.in_cycle_m.zip_with(step_m, |distance_m, step_m| distance_m + rest * step_m);
    }

    fn readout(&mut self, readout: &mut Readout) {
        for side in Side::BOTH {
            let lost = (self.lost_m[side] / readout.m_per_count[side]).round() as i64;
            readout.ticks[side] -= lost;
        }
    }

    fn needs_stepping(&self) -> Option<&'static str> {
        Some("a motion is many of its cycles")
    }
}

#[derive(Clone)]
struct Term;

impl ModelTerm for Term {
    /// Plausible: half a unit of 0.1 mm in a cycle of 10 ms; users give no figures.
    fn parameters(&self) -> &'static [TermParameter] {
        &[TermParameter { name: "loss_m_s", unit: "m/s", prior_sigma: 0.005 }]
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        let sense = |speed_m_s: f64| if speed_m_s == 0.0 { 0.0 } else { speed_m_s.signum() };
        gradient[0] = interval.change(interval.speed_m_s.map(|speed_m_s| sense(speed_m_s) * interval.dt_s));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::specimen_step;
    use crate::{Address, StreamName};

    #[test]
    fn half_a_unit_is_lost_a_cycle_in_both_directions_and_the_controller_is_left_alone() {
        for sense in [-1.0, 1.0] {
            let effect = LowSpeedTruncation { loss_m_s: 2e-3, cycle_s: 0.02 };
            let mut state = effect.forward().expect("acts on the record");
            state.seed_run(Address { seed: 7, point: 0, trial: 0, run: 0 }.stream(StreamName::new("test")));
            let (steps, dt_s) = (100_000, 1e-3); // 5000 cycles
            for k in 0..steps {
                let mut step = specimen_step();
                (step.t_s, step.dt_s) = (dt_s * f64::from(k), dt_s);
                // A simple ratio to the unit of 80 µm: cycles of whole steps would leave eighths of it only,
                // 7/16 on average.
                step.encoder_rad = Wheels::both(sense * 250e-6 / 0.08);
                let before_rad = step.encoder_rad;
                state.encoder(&mut step);
                assert_eq!(step.encoder_rad, before_rad);
            }
            let mut readout = Readout { ticks: Wheels::both(0), m_per_count: Wheels::both(1e-6), written: true };
            state.readout(&mut readout);
            let lost_m_s = -sense * 1e-6 * readout.ticks.left as f64 / (dt_s * f64::from(steps));
            // A uniform fraction has a standard deviation of 0.58 of its mean: five standard errors of 5000
            // are 4 %.
            assert!((lost_m_s / 2e-3 - 1.0).abs() < 0.04, "{lost_m_s}");
        }
    }
}
