//! `lateral_skid`: in a bend the tyres give way sideways, so that the drive slides outwards.
//!
//! Model: v_y = −c v ω: the side force m v ω bends tyres of a cornering stiffness to a slip angle in
//! proportion.
//! Signature: e_dy = −c v ω T.
//! Observability: bends at two speeds.
//! Alias: `truth_lever_arm` (same ω, two speeds tell), `truth_yaw`, `truth_latency`: a single circle
//! discriminates none.
//! Reference: linear tyre, slip angle = side force over cornering stiffness: c = m/C_α, 3 to 10 ms; the moved
//! centre of rotation of skid steer, far more.

use kinematics::{Pose, sinc};
use model_term::{Interval, ModelTerm, TermParameter};
use serde::{Deserialize, Serialize};

use crate::benchmark::{Benchmark, FloorForm, contact_twist};
use crate::description::{Description, Statement, Summary};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, Step};
use crate::hypothesis::{Hypothesis, Variant, value_of};
use crate::on_board::OnBoard;

/// What it is, in one line.
const MEANING: &str = "the robot slides outwards in bends";

/// The mean term in C, for a robot's own odometry.
const ON_BOARD: &str = "\
across_m -= skid_s * v_m_s * turn_rad;";

/// Sideways motion in bends.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LateralSkid {
    /// Outward speed over v ω (c), seconds.
    pub skid_s: f64,
}

impl PhysicalEffect for LateralSkid {
    fn check(&self) -> Result<(), EffectError> {
        EffectError::unless_finite("lateral_skid", [("skid_s", self.skid_s)])
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
                let what = values.by_sign("skid_s", MEANING, "the robot slides inwards in bends");
                let skid = values.magnitude("skid_s", 1e3, "mm/s");
                Statement::of(what, format!("{skid} for each m/s² of centripetal acceleration"))
            }),
            // Pacejka 2012: the side force of a tyre saturates with its slip angle.
            benchmark: Benchmark::OF_MEAN.with_form(
                "skid that saturates with the centripetal acceleration",
                |values, _| {
                    let (skid_s, knee_m_s2) = (value_of(values, "skid_s").unwrap_or(0.0), 0.3);
                    FloorForm::boxed(move |step| {
                        let (v_m_s, omega_rad_s) = contact_twist(step);
                        let centripetal_m_s2 = v_m_s * omega_rad_s;
                        step.lateral_m -=
                            skid_s * centripetal_m_s2 / (1.0 + centripetal_m_s2.abs() / knee_m_s2) * step.dt_s;
                    })
                },
            ),
            on_board: OnBoard::Static(ON_BOARD),
            ..Description::of(MEANING)
        }
    }

    /// A robot slides out of its bend: found negative it is something else.
    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        let skid_s = value_of(values, "skid_s")?;
        (skid_s >= 0.0).then_some(Self { skid_s })
    }
}

struct State {
    effect: LateralSkid,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { floor: true, ..Hooks::NONE }
    }

    /// The direction "sideways" turns during the step: its mean is that of the middle, shortened by sinc of
    /// half the turn.
    fn floor(&mut self, step: &mut Step) {
        let speed_m_s = step.contact_speed_m_s();
        let v_m_s = 0.5 * (speed_m_s.left + speed_m_s.right);
        let omega_rad_s = (speed_m_s.right - speed_m_s.left) / step.wheel_separation_m;
        let shortened = sinc(0.5 * omega_rad_s * step.dt_s);
        step.lateral_m -= self.effect.skid_s * v_m_s * omega_rad_s * step.dt_s * shortened;
    }

    fn depends_on_speed(&self) -> bool {
        self.effect.skid_s != 0.0
    }
}

#[derive(Clone)]
struct Term;

impl ModelTerm for Term {
    /// Plausible: 10 ms, the upper end of what tyres give.
    fn parameters(&self) -> &'static [TermParameter] {
        &[TermParameter { name: "skid_s", unit: "s", prior_sigma: 0.01 }]
    }

    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        let increment = interval.smooth_increment();
        if interval.dt_s > 0.0 {
            gradient[0].y_m = -increment.distance_m * increment.turn_rad / interval.dt_s;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::specimen_step;
    use kinematics::Wheels;

    #[test]
    fn the_robot_slides_outwards_in_both_bends() {
        let mut state = State { effect: LateralSkid { skid_s: 5e-3 } };
        for sense in [-1.0, 1.0] {
            let mut step = specimen_step();
            let half_m_s = 0.5 * 0.5 * sense * step.wheel_separation_m;
            step.rate_rad_s = Wheels { left: 0.4 - half_m_s, right: 0.4 + half_m_s }.map(|speed| speed / 0.08);
            state.floor(&mut step);
            // v = 0.4 m/s, ω = ±0.5 rad/s; the sinc of 2.5e-4 rad is 1 − 1e-8.
            assert!((step.lateral_m + sense * 5e-3 * 0.4 * 0.5 * 1e-3).abs() < 1e-13);
        }
    }
}
