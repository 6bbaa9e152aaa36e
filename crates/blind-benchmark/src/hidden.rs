//! What is hidden in a robot: an effect of the catalogue with a random direction of its sizes, held shape
//! parameters off the hypotheses' grid, and a scale.
//!
//! Directions are drawn in units of what is plausible; the scale is set by the oracle's detection limit. No
//! size goes beyond three times what is plausible: such robots do not exist, and the tool may say so.

use effects::{
    Benchmark, CATALOGUE, Effect, Forward, HostRobot, Hypothesis, Needs, ParameterLaw, ParameterValues, Stream,
    description, hypothesis,
};
use kinematics::Wheels;
use model_term::ModelTerm;

use super::draw::Draw;
use super::robot::RandomRobot;

/// What kind of effect an id is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EffectKind {
    /// It adds to the mean.
    Mean,
    /// It scatters.
    Scatter,
    /// It spoils the records.
    RecordFault,
}

/// Ids that can be hidden, with their kinds: the catalogue without the geometry, what is silent,
/// and what needs what the robots do not have.
pub(crate) fn hideable() -> Vec<(&'static str, EffectKind)> {
    let needs_others = |id: &str| description(id).is_some_and(|of| of.benchmark.needs.others);
    CATALOGUE
        .iter()
        .filter(|id| !needs_others(id))
        .filter_map(|id| match hypothesis(id)? {
            Hypothesis::Terms(_) => Some((*id, EffectKind::Mean)),
            Hypothesis::Scatter(_) | Hypothesis::TermsAndScatter(..) => Some((*id, EffectKind::Scatter)),
            Hypothesis::Records(_) => Some((*id, EffectKind::RecordFault)),
            Hypothesis::Geometry | Hypothesis::UnknownMotion { .. } | Hypothesis::Silent => None,
        })
        .collect()
}

/// The kind of an id.
pub(crate) fn kind_of(id: &str) -> Option<EffectKind> {
    hideable().into_iter().find(|(of, _)| *of == id).map(|(_, kind)| kind)
}

/// A hidden effect.
#[derive(Clone)]
pub(crate) struct Hidden {
    pub(crate) id: &'static str,
    pub(crate) kind: EffectKind,
    /// In another form than the catalogue's.
    pub(crate) other_form: bool,
    /// Sizes at scale 1, by the names of the hypothesis.
    values: ParameterValues,
    /// Shape parameters, whatever the scale.
    pub(crate) fixed: ParameterValues,
    pub(crate) scale: f64,
    /// Largest scale that a real robot may have.
    pub(crate) most: f64,
    /// How the effect is drawn.
    pub(crate) benchmark: Benchmark,
    host: HostRobot,
}

/// How a hidden effect acts.
pub(crate) enum ActingEffect {
    Catalogue(Effect),
    Other(Box<dyn Forward>),
}

impl Hidden {
    pub(crate) fn needs(id: &str) -> Needs {
        description(id).map_or(Needs::default(), |description| description.benchmark.needs)
    }

    /// A random direction of an effect; `None` where none of many is physical.
    pub(crate) fn draw(id: &'static str, robot: &RandomRobot, draw: &mut Draw) -> Option<Self> {
        let kind = kind_of(id)?;
        let benchmark = description(id)?.benchmark;
        let mut hidden = Self {
            id,
            kind,
            other_form: benchmark.other_form.is_some() && draw.bernoulli(0.5),
            values: Vec::new(),
            fixed: Vec::new(),
            scale: 1.0,
            most: benchmark.max_scale,
            benchmark,
            host: robot.host(),
        };
        match benchmark.values {
            ParameterLaw::Direction { fixed, positive } => hidden.draw_direction(fixed, positive, draw)?,
            ParameterLaw::Scatter(law) => (hidden.values, hidden.fixed) = law(&hidden.host, &mut draw.0),
            ParameterLaw::Fault(law) => {
                // The left wheel, the right one, or both.
                let either = draw.below(3);
                hidden.fixed = law(Wheels { left: either != 1, right: either != 0 }, &mut draw.0);
            }
        }
        hidden.act().is_some().then_some(hidden)
    }

    fn draw_direction(
        &mut self,
        fixed: fn(ParameterValues, &HostRobot, &mut Stream) -> ParameterValues,
        positive: bool,
        draw: &mut Draw,
    ) -> Option<()> {
        let Some(Hypothesis::Terms(variants)) = hypothesis(self.id) else { return None };
        let variant = &variants[draw.below(variants.len())];
        self.fixed = fixed(variant.fixed.clone(), &self.host, &mut draw.0);
        let parameters = variant.term.parameters();
        // Both wheels, or one of them.
        let spared_wheel = ["", "", "left_", "right_"][draw.below(4)];
        for attempt in 0..20 {
            self.values = parameters
                .iter()
                .map(|parameter| {
                    let size = draw.0.normal() * parameter.prior_sigma;
                    let spared_wheel = !spared_wheel.is_empty() && parameter.name.starts_with(spared_wheel);
                    // A loss that is a gain is no effect: after some attempts every size is positive.
                    (
                        parameter.name,
                        if spared_wheel {
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
                .zip(&self.values)
                .map(|(parameter, (_, size))| (size / parameter.prior_sigma).abs())
                .fold(0.0, f64::max);
            if largest == 0.0 {
                continue;
            }
            self.values.iter_mut().for_each(|(_, size)| *size /= largest);
            if self.act().is_some() && (!positive || self.values.iter().all(|(_, size)| *size >= 0.0)) {
                return Some(());
            }
        }
        None
    }

    /// Sizes in force, by name; shape parameters after them.
    pub(crate) fn values(&self) -> Vec<(&'static str, f64)> {
        let scaled = self.values.iter().map(|(name, size)| (*name, size * self.scale));
        scaled.chain(self.fixed.iter().copied()).collect()
    }

    /// Its sizes as the values of a term's parameters; nothing of what has another name.
    pub(crate) fn term_values(&self, term: &dyn ModelTerm) -> Vec<f64> {
        let values = self.values();
        let of = |name: &str| values.iter().find(|(own, _)| *own == name).map_or(0.0, |(_, size)| *size);
        term.parameters().iter().map(|parameter| of(parameter.name)).collect()
    }

    /// How it acts at its scale; `None` when that is not physical.
    pub(crate) fn act(&self) -> Option<ActingEffect> {
        let values = self.values();
        if self.other_form {
            // Physical where the catalogue's form is.
            effects::effect_from_estimates(self.id, &values)?;
            return self.benchmark.other_form.map(|form| ActingEffect::Other((form.forward)(&values, &self.host)));
        }
        effects::effect_at_scale(self.id, &values, self.scale, &self.host).map(ActingEffect::Catalogue)
    }
}
