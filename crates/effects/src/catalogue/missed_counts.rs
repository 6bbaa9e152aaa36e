//! `missed_counts`: a counter that cannot follow fast edges loses the ones above some rate.
//!
//! Model: of the counts above the hinge speed a share is lost: counted speed = h + (1−share)(|v_w|−h) for
//! |v_w| > h.
//! Signature: a one-sided hinge in |v_w| of that wheel; the robot goes farther than it counts.
//! Observability: speeds on both sides of the hinge.
//! Alias: `slip_speed` of the other sign.
//! Reference: the HCTL-1100's input filter (a state must stand three clocks); interrupt-driven counters
//! behave alike. 0.1 to 2 %, a rule of thumb.

use kinematics::{Pose, Side, Wheels};
use model_term::{Interval, ModelTerm, TermParameter};
use serde::{Deserialize, Serialize};

use crate::benchmark::{Benchmark, ParameterLaw};
use crate::description::{Description, Statement, Summary};
use crate::effect::{EffectError, PhysicalEffect};
use crate::forward::{Forward, Hooks, Step};
use crate::hypothesis::{Hypothesis, Variant, value_of};
use crate::on_board::OnBoard;

/// What it is, in one line.
const MEANING: &str = "counts are lost at high speed";

/// The mean term in C, for a robot's own odometry.
const ON_BOARD: &str = "\
left_change_m += left_lost_share * yair_sense(left_m) * fmax(fabs(left_m_s) - hinge_speed_m_s, 0.0) * dt_s;
right_change_m += right_lost_share * yair_sense(right_m) * fmax(fabs(right_m_s) - hinge_speed_m_s, 0.0) * dt_s;";

/// Hinge speeds that are tried, m/s: indoor robots.
const HINGE_M_S: [f64; 6] = [0.05, 0.1, 0.2, 0.4, 0.8, 1.6];

/// Counts lost above a speed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MissedCounts {
    /// Contact speed above which counts are lost, m/s.
    pub hinge_speed_m_s: f64,
    /// Share of the left counts above the hinge that is lost.
    #[serde(default)]
    pub left_lost_share: f64,
    /// Share of the right counts above the hinge that is lost.
    #[serde(default)]
    pub right_lost_share: f64,
}

impl PhysicalEffect for MissedCounts {
    fn check(&self) -> Result<(), EffectError> {
        let id = "missed_counts";
        EffectError::unless_negative(id, [("hinge_speed_m_s", self.hinge_speed_m_s)])?;
        for (name, value) in [("left_lost_share", self.left_lost_share), ("right_lost_share", self.right_lost_share)] {
            EffectError::unless((0.0..1.0).contains(&value), id, name, value, "in [0, 1)")?;
        }
        Ok(())
    }

    fn forward(&self) -> Option<Box<dyn Forward>> {
        let lost_share = Wheels { left: self.left_lost_share, right: self.right_lost_share };
        Some(Box::new(State { hinge_m_s: self.hinge_speed_m_s, lost_share }))
    }

    fn hypothesis() -> Hypothesis {
        Hypothesis::Terms(Variant::along("hinge_speed_m_s", &HINGE_M_S, |hinge_m_s| Box::new(Term { hinge_m_s })))
    }

    fn description() -> Description {
        Description {
            summary: Summary::WithSize(|values| {
                let [left, right] = ["left_lost_share", "right_lost_share"].map(|name| values.shown(name, 100.0, "%"));
                let hinge = values.value("hinge_speed_m_s");
                let hinge = hinge.map_or_else(|| "some speed".to_owned(), |hinge| format!("{hinge:.2} m/s"));
                Statement::of(MEANING, format!("{left} on the left, {right} on the right above {hinge}"))
            }),
            benchmark: Benchmark {
                values: ParameterLaw::Direction {
                    fixed: |_, robot, stream| {
                        vec![("hinge_speed_m_s", stream.uniform_in(0.3, 0.8) * robot.cruise_speed_m_s)]
                    },
                    positive: true,
                },
                ..Benchmark::OF_MEAN.with_form(
                    "a hinge that is round over a tenth of the cruise speed",
                    |values, robot| {
                        let of = |name| value_of(values, name).unwrap_or(0.0);
                        Box::new(RoundHinge {
                            lost_share: Wheels { left: of("left_lost_share"), right: of("right_lost_share") },
                            hinge_m_s: of("hinge_speed_m_s"),
                            width_m_s: 0.1 * robot.cruise_speed_m_s,
                        })
                    },
                )
            },
            on_board: OnBoard::Static(ON_BOARD),
            ..Description::of(MEANING)
        }
    }

    /// A counter whose lost share was found negative loses none.
    fn from_estimates(values: &[(&str, f64)]) -> Option<Self> {
        let (left, right) = (value_of(values, "left_lost_share")?, value_of(values, "right_lost_share")?);
        let hinge_speed_m_s = value_of(values, "hinge_speed_m_s")?;
        (left > 0.0 || right > 0.0).then(|| Self {
            hinge_speed_m_s,
            left_lost_share: left.max(0.0),
            right_lost_share: right.max(0.0),
        })
    }
}

struct State {
    hinge_m_s: f64,
    lost_share: Wheels<f64>,
}

impl Forward for State {
    fn hooks(&self) -> Hooks {
        Hooks { encoder: true, ..Hooks::NONE }
    }

    fn encoder(&mut self, step: &mut Step) {
        let speed_m_s = step.contact_speed_m_s();
        for side in Side::BOTH {
            let speed_m_s = speed_m_s[side].abs();
            if speed_m_s > self.hinge_m_s {
                step.encoder_rad[side] *= 1.0 - self.lost_share[side] * (1.0 - self.hinge_m_s / speed_m_s);
            }
        }
    }

    fn depends_on_speed(&self) -> bool {
        self.lost_share != Wheels::both(0.0)
    }
}

#[derive(Clone)]
struct Term {
    hinge_m_s: f64,
}

impl ModelTerm for Term {
    /// Plausible: 2 % above the hinge, the upper end of the rule of thumb.
    fn parameters(&self) -> &'static [TermParameter] {
        &[
            TermParameter { name: "left_lost_share", unit: "1", prior_sigma: 0.02 },
            TermParameter { name: "right_lost_share", unit: "1", prior_sigma: 0.02 },
        ]
    }

    /// By the counted speed: what was lost is, to first order, the share of what is above the hinge.
    fn motion(&mut self, interval: &Interval<'_>, gradient: &mut [Pose]) {
        let above_m = interval.speed_m_s.map(|speed_m_s| {
            let above_m_s = (speed_m_s.abs() - self.hinge_m_s).max(0.0);
            speed_m_s.signum() * above_m_s * interval.dt_s
        });
        gradient[0] = interval.change(Wheels { left: above_m.left, right: 0.0 });
        gradient[1] = interval.change(Wheels { left: 0.0, right: above_m.right });
    }
}

/// The other form: counts lost above a hinge that is round.
struct RoundHinge {
    lost_share: Wheels<f64>,
    hinge_m_s: f64,
    width_m_s: f64,
}

impl Forward for RoundHinge {
    fn hooks(&self) -> Hooks {
        Hooks { encoder: true, ..Hooks::NONE }
    }

    fn encoder(&mut self, step: &mut Step) {
        let speed_m_s = step.contact_speed_m_s();
        for side in Side::BOTH {
            let v = speed_m_s[side].abs();
            if v > 0.0 {
                let over_m_s = self.width_m_s * ((v - self.hinge_m_s) / self.width_m_s).exp().ln_1p();
                step.encoder_rad[side] *= 1.0 - self.lost_share[side] * over_m_s / v;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::specimen_step;

    #[test]
    fn nothing_is_lost_below_the_hinge_and_a_share_above() {
        let mut state = State { hinge_m_s: 0.2, lost_share: Wheels { left: 0.0, right: 0.01 } };
        let mut seen = |speed_m_s: f64| {
            let mut step = specimen_step();
            step.rate_rad_s = Wheels::both(speed_m_s / 0.08);
            step.encoder_rad = Wheels::both(1.0);
            state.encoder(&mut step);
            step.encoder_rad
        };
        assert_eq!(seen(0.2).right, 1.0);
        assert_eq!(seen(-0.4).left, 1.0);
        assert!((seen(-0.4).right - (1.0 - 0.01 * 0.5)).abs() < 1e-15);
    }
}
