//! `slip_speed`: the faster a wheel turns, the larger the share of its motion that slips.
//!
//! Model: ground speed = v_w (1 − c|v_w|) for each wheel.
//! Signature: e_dx = −c v|v|, e_dθ = −2c|v|ω; in a spin −(cb/2)ω|ω|.
//! Observability: at least two speeds.
//! Alias: `missed_counts`, load, `turn_rate_wheelbase`.
//! Reference: longitudinal slip with rolling resistance that grows with speed; sizes are rules of thumb.

use kinematics::Pose;
use model_term::{Interval, ModelTerm, TermParameter};
use serde::{Deserialize, Serialize};

use crate::benchmark::{Benchmark, FloorForm};
use crate::description::{Description, Statement, Summary};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, Step};
use crate::hypothesis::{Hypothesis, Variant, value_of};
use crate::on_board::OnBoard;

/// What it is, in one line.
const MEANING: &str = "the wheels lose distance in proportion to their speed";

/// The mean term in C, for a robot's own odometry.
const ON_BOARD: &str = "\
left_change_m -= slip_s_m * left_m * fabs(left_m_s);
right_change_m -= slip_s_m * right_m * fabs(right_m_s);";

/// Slip in proportion to speed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SlipSpeed {
    /// Share lost per m/s of wheel speed (c), s/m.
    pub slip_s_m: f64,
}

impl PhysicalEffect for SlipSpeed {
    fn check(&self) -> Result<(), EffectError> {
        EffectError::unless(self.slip_s_m.is_finite(), "slip_speed", "slip_s_m", self.slip_s_m, "finite")
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        Some(Box::new(State { effect: *self }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Terms(Variant::plain(Term))
    }

    fn description() -> Description {
        Description {
            summary: Summary::WithSize(|values| {
                let gain = "the wheels gain distance in proportion to their speed";
                let what = values.by_sign("slip_s_m", MEANING, gain);
                Statement::of(what, format!("{} for each m/s", values.magnitude("slip_s_m", 100.0, "%")))
            }),
            // Pacejka 2012: the force of a tyre saturates with its slip.
            benchmark: Benchmark::OF_MEAN.with_form(
                "the share lost saturates, as tanh of the speed",
                |values, robot| {
                    let (lost, knee_m_s) = (value_of(values, "slip_s_m").unwrap_or(0.0), 0.7 * robot.cruise_speed_m_s);
                    FloorForm::boxed(move |step| {
                        let speed_m_s = step.contact_speed_m_s();
                        let share = |v: f64| 1.0 - lost * knee_m_s * (v.abs() / knee_m_s).tanh();
                        step.travel_m = step.travel_m.zip_with(speed_m_s, |travel_m, v| travel_m * share(v));
                    })
                },
            ),
            on_board: OnBoard::Static(ON_BOARD),
            ..Description::of(MEANING)
        }
    }

    /// Contacts slip back, not ahead: found negative it is something else.
    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        let slip_s_m = value_of(values, "slip_s_m")?;
        (slip_s_m >= 0.0).then_some(Self { slip_s_m })
    }
}

struct State {
    effect: SlipSpeed,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { floor: true, ..Hooks::NONE }
    }

    fn floor(&mut self, step: &mut Step) {
        let slip = step.contact_speed_m_s().map(|speed_m_s| self.effect.slip_s_m * speed_m_s.abs());
        step.travel_m = step.travel_m.zip_with(slip, |travel_m, slip| travel_m * (1.0 - slip));
    }

    fn depends_on_speed(&self) -> bool {
        self.effect.slip_s_m != 0.0
    }
}

#[derive(Clone)]
struct Term;

impl ModelTerm for Term {
    fn parameters(&self) -> &'static [TermParameter] {
        // Plausible: 1 % at 0.5 m/s, the upper end of the rule of thumb.
        &[TermParameter { name: "slip_s_m", unit: "s/m", prior_sigma: 0.02 }]
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        let lost_m = |travel_m: f64, speed_m_s: f64| travel_m * speed_m_s.abs();
        let travel_m = interval.smooth_travel_m();
        gradient[0] = interval.change(travel_m.zip_with(interval.speed_m_s, lost_m).map(|lost_m| -lost_m));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::specimen_step;

    #[test]
    fn slip_grows_with_the_square_of_speed_and_opposes_it() {
        let mut state = State { effect: SlipSpeed { slip_s_m: 0.02 } };
        for rate_rad_s in [-6.0, 3.0] {
            let mut step = specimen_step();
            step.rate_rad_s.left = rate_rad_s;
            step.travel_m.left = rate_rad_s * 0.08 * step.dt_s;
            let before_m = step.travel_m.left;
            state.floor(&mut step);
            assert!((step.travel_m.left / before_m - (1.0 - 0.02 * (rate_rad_s * 0.08).abs())).abs() < 1e-15);
        }
    }
}
