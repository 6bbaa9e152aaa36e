//! What is hidden in a robot: an effect of the catalogue with a random direction of its sizes, held shape parameters off the hypotheses' grid, and a scale.
//!
//! Directions are drawn in units of what is plausible; the scale is set by the oracle's detection limit. No size goes beyond three times what is plausible:
//! such robots do not exist, and the tool may say so.

use effects::{CATALOGUE, Effect, Forward, Hypothesis, hypothesis};

use super::draw::Draw;
use super::forms::{Around, OTHER_FORMS, other_form};
use super::robot::{Needs, RandomRobot};

/// What kind of effect an id is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum EffectKind {
    /// It adds to the mean.
    Mean,
    /// It scatters.
    Scatter,
    /// It spoils the records.
    Gross,
}

/// Ids that can be hidden, with their kinds: the catalogue without the geometry and what is silent.
pub(crate) fn hideable() -> Vec<(&'static str, EffectKind)> {
    CATALOGUE
        .iter()
        .filter_map(|id| match hypothesis(id)? {
            Hypothesis::Terms(_) => Some((*id, EffectKind::Mean)),
            Hypothesis::Scatter(_) | Hypothesis::TermsAndScatter(..) => Some((*id, EffectKind::Scatter)),
            Hypothesis::Records(_) => Some((*id, EffectKind::Gross)),
            Hypothesis::Geometry | Hypothesis::Silent => None,
        })
        .collect()
}

/// The kind of an id.
pub(crate) fn kind_of(id: &str) -> Option<EffectKind> {
    hideable().into_iter().find(|(of, _)| *of == id).map(|(_, kind)| kind)
}

/// A hidden effect.
#[derive(Debug, Clone)]
pub(crate) struct Hidden {
    pub(crate) id: &'static str,
    pub(crate) kind: EffectKind,
    /// In another form than the catalogue's.
    pub(crate) other_form: bool,
    /// Sizes at scale 1, by the names of the hypothesis.
    sizes: Vec<(&'static str, f64)>,
    /// Shape parameters, whatever the scale.
    pub(crate) held: Vec<(&'static str, f64)>,
    pub(crate) scale: f64,
    /// Largest scale that a real robot may have.
    pub(crate) most: f64,
    around: Around,
    payload_kg: Vec<f64>,
}

/// How a hidden effect acts.
pub(crate) enum Act {
    Catalogue(Effect),
    Other(Box<dyn Forward>),
}

/// Sizes beyond so many times what is plausible are no robot's.
const MOST_PLAUSIBLE: f64 = 3.0;

impl Hidden {
    pub(crate) fn needs(id: &str) -> Needs {
        Needs { payload: id == "payload_compression", jitter: id == "interval_error" }
    }

    /// A random direction of an effect; `None` where none of many is physical.
    pub(crate) fn draw(id: &'static str, robot: &RandomRobot, draw: &mut Draw) -> Option<Self> {
        let kind = kind_of(id)?;
        let (speed_m_s, acceleration_m_s2) = robot.sessions.iter().fold((0.0_f64, f64::INFINITY), |(v, a), session| {
            let robot = &session.scenario.robot;
            (v.max(robot.cruise_speed_m_s), a.min(robot.acceleration_m_s2))
        });
        let wheel_separation_m = robot.sessions[0].scenario.robot.wheel_separation_m;
        let mut hidden = Self {
            id,
            kind,
            other_form: OTHER_FORMS.contains(&id) && draw.chance(0.5),
            sizes: Vec::new(),
            held: Vec::new(),
            scale: 1.0,
            most: MOST_PLAUSIBLE,
            around: Around { speed_m_s, acceleration_m_s2, wheel_separation_m },
            payload_kg: robot.payload_kg.clone(),
        };
        match kind {
            EffectKind::Mean => hidden.draw_mean(robot, draw)?,
            EffectKind::Scatter => hidden.draw_scatter(draw),
            EffectKind::Gross => hidden.draw_gross(draw),
        }
        hidden.act().is_some().then_some(hidden)
    }

    fn draw_mean(&mut self, robot: &RandomRobot, draw: &mut Draw) -> Option<()> {
        let Some(Hypothesis::Terms(shapes)) = hypothesis(self.id) else { return None };
        let shape = &shapes[draw.below(shapes.len())];
        self.held = shape.held.clone();
        for (name, value) in &mut self.held {
            *value = match *name {
                "cycles" => *value,
                "hinge_speed_m_s" => draw.uniform(0.3, 0.8) * self.around.speed_m_s,
                "tau_s" => draw.log_uniform(60.0, 1000.0),
                "decay_m" => draw.log_uniform(0.02, 0.2),
                "castor_behind_m" => draw.uniform(0.1, 0.4),
                _ => *value,
            };
        }
        self.held.retain(|(name, _)| *name != "width_m");
        if self.id == "interval_error" {
            // A share of one is all there is.
            self.most = 1.0;
        }
        match self.id {
            "interval_error" => self.held.push(("jitter_s", robot.jitter_s)),
            "low_speed_truncation" => self.held.push(("cycle_s", draw.log_uniform(0.005, 0.05))),
            _ => {}
        }
        let parameters = shape.term.parameters();
        // Both wheels, or one of them.
        let spared = ["", "", "left_", "right_"][draw.below(4)];
        for attempt in 0..20 {
            self.sizes = parameters
                .iter()
                .map(|parameter| {
                    let size = draw.0.normal() * parameter.plausible;
                    let spared = !spared.is_empty() && parameter.name.starts_with(spared);
                    // A loss that is a gain is no effect: after some attempts every size is positive.
                    (
                        parameter.name,
                        if spared {
                            0.0
                        } else if attempt < 10 {
                            size
                        } else {
                            size.abs()
                        },
                    )
                })
                .collect();
            let largest = parameters
                .iter()
                .zip(&self.sizes)
                .map(|(parameter, (_, size))| (size / parameter.plausible).abs())
                .fold(0.0, f64::max);
            if largest == 0.0 {
                continue;
            }
            self.sizes.iter_mut().for_each(|(_, size)| *size /= largest);
            if self.act().is_some() && self.signs_are_physical() {
                return Some(());
            }
        }
        None
    }

    /// A gap that is negative for one wheel counts as none: the direction would not be what it says.
    fn signs_are_physical(&self) -> bool {
        !["backlash", "missed_counts"].contains(&self.id) || self.sizes.iter().all(|(_, size)| *size >= 0.0)
    }

    fn draw_scatter(&mut self, draw: &mut Draw) {
        let Around { speed_m_s, acceleration_m_s2, .. } = self.around;
        (self.sizes, self.held) = match self.id {
            "contact_patch_wheelbase" => (vec![("sigma_m", 3e-3)], vec![]),
            "stick_slip" => (vec![("breakaway_m", 1e-3)], vec![("stick_speed_m_s", 0.5 * speed_m_s)]),
            "bumps" => (vec![("height_m", 3e-3)], vec![("per_m", draw.log_uniform(0.1, 1.0))]),
            "truth_correlated_noise" => {
                (vec![("sigma_xy_m", 1e-3), ("sigma_theta_rad", 1e-3)], vec![("tau_s", draw.log_uniform(0.3, 3.0))])
            }
            "truth_outliers" => {
                (vec![("jump_m", 0.02), ("jump_rad", 0.02)], vec![("probability", draw.log_uniform(0.003, 0.03))])
            }
            // What of the acceleration the floor does not hold.
            _ => (vec![("excess", 0.3)], vec![("needs", acceleration_m_s2 / 9.806_65), ("stribeck_speed_m_s", 0.05)]),
        };
        self.most = if self.id == "traction_loss" { 2.5 } else { 10.0 };
    }

    fn draw_gross(&mut self, draw: &mut Draw) {
        let either = draw.below(3);
        self.held = match self.id {
            "swapped_wheels" => vec![("swapped", 1.0)],
            "reversed_wheel" => {
                vec![("left", f64::from(u8::from(either != 1))), ("right", f64::from(u8::from(either != 0)))]
            }
            "wrong_counts_per_turn" => vec![("factor", [0.25, 0.5, 2.0, 4.0][draw.below(4)])],
            "counter_wrap" => vec![("bits", 16.0)],
            "torn_read" => {
                vec![("probability", draw.uniform(0.005, 0.02)), ("jump_counts", [256.0, 65_536.0][draw.below(2)])]
            }
            "dropped_samples" => vec![("probability", draw.uniform(0.01, 0.05))],
            _ => vec![("factor", [1e3, 1e6][draw.below(2)])],
        };
    }

    /// Sizes in force, by name; shape parameters after them.
    pub(crate) fn sizes(&self) -> Vec<(&'static str, f64)> {
        let scaled = self.sizes.iter().map(|(name, size)| (*name, size * self.scale));
        scaled.chain(self.held.iter().copied()).collect()
    }

    /// How it acts at its scale; `None` when that is not physical.
    pub(crate) fn act(&self) -> Option<Act> {
        let sizes = self.sizes();
        if self.other_form {
            // Physical where the catalogue's form is.
            effects::effect_of_sizes(self.id, &sizes)?;
            return other_form(self.id, &sizes, self.around).map(Act::Other);
        }
        let of = |name: &str| sizes.iter().find(|(own, _)| *own == name).map_or(0.0, |(_, size)| *size);
        let effect = match self.id {
            "traction_loss" => {
                let static_friction = of("needs") * (1.0 - of("excess"));
                let sizes = [
                    ("static_friction", static_friction),
                    ("kinetic_friction", 0.7 * static_friction),
                    ("stribeck_speed_m_s", of("stribeck_speed_m_s")),
                ];
                effects::effect_of_sizes(self.id, &sizes)?
            }
            // What a bump costs grows with the power 3/2 of its height.
            "bumps" => {
                let height_m = 3e-3 * self.scale.powf(2.0 / 3.0);
                effects::effect_of_sizes(self.id, &[("per_m", of("per_m")), ("height_m", height_m)])?
            }
            _ => effects::effect_of_sizes(self.id, &sizes)?,
        };
        Some(Act::Catalogue(match effect {
            Effect::PayloadCompression(mut compression) => {
                compression.payload_kg.clone_from(&self.payload_kg);
                let effect = Effect::PayloadCompression(compression);
                effect.physical().check().ok()?;
                effect
            }
            effect => effect,
        }))
    }
}
