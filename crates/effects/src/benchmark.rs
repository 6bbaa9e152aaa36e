//! How the blind benchmark hides an effect in a random robot: the law of its sizes, what the records must
//! have for it to show, and another functional form.
//!
//! Sizes are drawn as a direction and scaled afterwards to what the data can show, up to the largest of a
//! real robot. The *other form* is a simulation model that departs from the catalogue's, so that the world
//! differs from every hypothesis. It stands in the effect's file and shares no code with the hypothesis.
//! References: Pacejka 2012 for slip that saturates; Armstrong-Hélouvry et al. 1994 for round corners of
//! friction.

use kinematics::Wheels;

use crate::forward::{Forward, Hooks, Step};
use crate::stream::Stream;

/// A size by its name.
pub type ParameterValue = (&'static str, f64);

/// Sizes by their names.
pub type ParameterValues = Vec<ParameterValue>;

/// The simulation model of another form, from sizes of the hypothesis, at which it does about as much.
pub type FormOf = fn(&[ParameterValue], &HostRobot) -> Box<dyn Forward>;

/// The robot that an effect is hidden in.
#[derive(Debug, Clone, PartialEq)]
pub struct HostRobot {
    /// Its fastest cruise speed.
    pub cruise_speed_m_s: f64,
    /// Its gentlest acceleration.
    pub acceleration_m_s2: f64,
    /// Its nominal wheel separation.
    pub wheel_separation_m: f64,
    /// What the runs carry in turn; empty where the records say nothing of loads.
    pub payload_kg: Vec<f64>,
    /// Jitter of the log's stamps; 0 where the log is regular.
    pub jitter_s: f64,
}

/// What the records must have for an effect to show at all.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Needs {
    /// Runs with different payloads, and the covariate that says so.
    pub payload: bool,
    /// Stamps that jitter.
    pub jitter: bool,
    /// What its robots do not have, as a length that does not come from the instrument, or wheels that skid
    /// in turns: such effects are not hidden.
    pub others: bool,
}

impl Needs {
    pub(crate) const NONE: Self = Self { payload: false, jitter: false, others: false };

    /// What either needs.
    #[must_use]
    pub const fn and(self, other: Self) -> Self {
        Self {
            payload: self.payload || other.payload,
            jitter: self.jitter || other.jitter,
            others: self.others || other.others,
        }
    }
}

/// The law of an effect's sizes.
#[derive(Debug, Clone, Copy)]
pub enum ParameterLaw {
    /// A random direction in units of what is large by the hypothesis's parameters.
    Direction {
        /// What stays the same whatever the scale, from the shape parameters of the hypothesis that was
        /// drawn; off its grid where any value is possible.
        fixed: fn(ParameterValues, &HostRobot, &mut Stream) -> ParameterValues,
        /// A size of the wrong sign counts as none: the direction would not be what it says.
        positive: bool,
    },
    /// Sizes at scale 1, and what stays the same whatever the scale.
    Scatter(fn(&HostRobot, &mut Stream) -> (ParameterValues, ParameterValues)),
    /// A fault of the records, of one or both wheels, which has no scale.
    Fault(fn(Wheels<bool>, &mut Stream) -> ParameterValues),
}

/// Another functional form of an effect.
#[derive(Clone, Copy)]
pub struct OtherForm {
    /// Which one, for people: "the share lost saturates as tanh of the speed".
    pub what: &'static str,
    /// The form.
    pub forward: FormOf,
}

/// How the blind benchmark draws an effect.
#[derive(Clone, Copy)]
pub struct Benchmark {
    /// What the records must have.
    pub needs: Needs,
    /// The law of its sizes.
    pub values: ParameterLaw,
    /// Largest scale of a real robot, in units of what is large (`prior_sigma` of the estimation model).
    pub max_scale: f64,
    /// Another functional form, of which one robot in two is.
    pub other_form: Option<OtherForm>,
    /// Its signature is random in part: one drive with it is not like the next.
    pub has_random_signature: bool,
}

/// Means beyond so many times what is large are no robot's.
const MAX_SCALE_OF_MEAN: f64 = 3.0;
/// The same of scatter, which shows with the square of its size.
const MAX_SCALE_OF_SCATTER: f64 = 10.0;

fn as_tried(fixed: ParameterValues, _: &HostRobot, _: &mut Stream) -> ParameterValues {
    fixed
}

impl Benchmark {
    /// A mean in a random direction.
    pub(crate) const OF_MEAN: Self = Self {
        needs: Needs::NONE,
        values: ParameterLaw::Direction { fixed: as_tried, positive: false },
        max_scale: MAX_SCALE_OF_MEAN,
        other_form: None,
        has_random_signature: false,
    };

    /// A mean whose shape parameters are drawn by a law of their own.
    pub(crate) const fn of_mean_at(fixed: fn(ParameterValues, &HostRobot, &mut Stream) -> ParameterValues) -> Self {
        Self { values: ParameterLaw::Direction { fixed, positive: false }, ..Self::OF_MEAN }
    }

    /// A mean in another form on one robot in two.
    pub(crate) const fn with_form(self, what: &'static str, forward: FormOf) -> Self {
        Self { other_form: Some(OtherForm { what, forward }), ..self }
    }

    /// A scatter.
    pub(crate) const fn of_scatter(law: fn(&HostRobot, &mut Stream) -> (ParameterValues, ParameterValues)) -> Self {
        Self { values: ParameterLaw::Scatter(law), max_scale: MAX_SCALE_OF_SCATTER, ..Self::OF_MEAN }
    }

    /// A fault of the records.
    pub(crate) const fn of_fault(law: fn(Wheels<bool>, &mut Stream) -> ParameterValues) -> Self {
        Self { values: ParameterLaw::Fault(law), ..Self::OF_MEAN }
    }
}

/// A form that acts on the floor without memory.
pub(crate) struct FloorForm<F>(F);

impl<F: Fn(&mut Step) + Send + 'static> FloorForm<F> {
    pub(crate) fn boxed(acts: F) -> Box<dyn Forward> {
        Box::new(Self(acts))
    }
}

impl<F: Fn(&mut Step) + Send> Forward for FloorForm<F> {
    fn hooks(&self) -> Hooks {
        Hooks { floor: true, ..Hooks::NONE }
    }

    fn floor(&mut self, step: &mut Step) {
        (self.0)(step);
    }
}

/// Speed and yaw rate by the contacts.
pub(crate) fn contact_twist(step: &Step) -> (f64, f64) {
    let Wheels { left, right } = step.contact_speed_m_s();
    (0.5 * (left + right), (right - left) / step.wheel_separation_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hypothesis::Hypothesis;
    use crate::{Address, CATALOGUE, StreamName, description, effect_at_scale, harmless, hypothesis};

    fn host() -> HostRobot {
        HostRobot {
            cruise_speed_m_s: 0.3,
            acceleration_m_s2: 0.5,
            wheel_separation_m: 0.4,
            payload_kg: vec![0.0, 5.0],
            jitter_s: 0.005,
        }
    }

    fn stream(run: u32) -> Stream {
        Address { seed: 3, point: 0, trial: 0, run }.stream(StreamName::new("test"))
    }

    /// Sizes of an effect as the benchmark draws them, all of a mean's as large as is large; at scale 1.
    fn drawn(id: &str, run: u32) -> ParameterValues {
        let benchmark = description(id).expect("known").benchmark;
        let mut stream = stream(run);
        match benchmark.values {
            ParameterLaw::Direction { fixed, .. } => {
                let variant =
                    hypothesis(id).and_then(Hypothesis::into_variants).and_then(|variants| variants.into_iter().next());
                let Some(variant) = variant else { return Vec::new() };
                let large = variant.term.parameters().iter().map(|parameter| (parameter.name, parameter.prior_sigma));
                large.chain(fixed(variant.fixed.clone(), &host(), &mut stream)).collect()
            }
            ParameterLaw::Scatter(law) => {
                let (scaled, fixed) = law(&host(), &mut stream);
                scaled.into_iter().chain(fixed).collect()
            }
            ParameterLaw::Fault(law) => law(Wheels { left: run.is_multiple_of(2), right: true }, &mut stream),
        }
    }

    /// Whether a law is that of what a hypothesis shows.
    fn is_of(law: ParameterLaw, hypothesis: &Hypothesis) -> bool {
        match hypothesis {
            Hypothesis::Terms(_) => matches!(law, ParameterLaw::Direction { .. }),
            Hypothesis::Scatter(_) | Hypothesis::TermsAndScatter(..) => matches!(law, ParameterLaw::Scatter(_)),
            Hypothesis::Records(_) => matches!(law, ParameterLaw::Fault(_)),
            // Never hidden.
            Hypothesis::Geometry | Hypothesis::UnknownMotion { .. } | Hypothesis::Silent => {
                matches!(law, ParameterLaw::Direction { .. })
            }
        }
    }

    #[test]
    fn what_is_drawn_is_physical_and_what_its_hypothesis_is_of() {
        for id in CATALOGUE {
            let (benchmark, hypothesis) = (description(id).expect("known").benchmark, hypothesis(id).expect("known"));
            assert!(is_of(benchmark.values, &hypothesis), "{id}");
            if matches!(hypothesis, Hypothesis::Geometry | Hypothesis::UnknownMotion { .. } | Hypothesis::Silent) {
                continue;
            }
            for run in 0..20 {
                let values = drawn(id, run);
                let effect = effect_at_scale(id, &values, 1.0, &host()).unwrap_or_else(|| panic!("{id}: {values:?}"));
                assert_eq!(effect.id(), *id);
                // A size that the effect has under another name makes none.
                let renamed: ParameterValues = values.iter().map(|(_, value)| ("another", *value)).collect();
                assert!(values.is_empty() || effect_at_scale(id, &renamed, 1.0, &host()).is_none(), "{id}");
            }
        }
        let fault = Benchmark::of_fault(|_, _| Vec::new());
        assert!(!is_of(fault.values, &Hypothesis::Silent) && !is_of(fault.values, &Hypothesis::Scatter(&[])));
    }

    /// Where a step was left by a form: what differs from a step that it does not act on.
    fn departs(form: &mut dyn Forward) -> bool {
        use crate::catalogue::specimen_step;
        let hooks = form.hooks();
        if hooks.seed_run {
            form.seed_run(stream(0));
        }
        // A second ahead, and a second back, so that what follows reversals acts.
        (0..2000).any(|k| {
            let sense = if k < 1000 { 1.0 } else { -1.0 };
            let mut step = specimen_step();
            step.t_s = 1e-3 * f64::from(k);
            let speed_m_s = Wheels { left: 0.25 * sense, right: 0.35 * sense };
            step.rate_rad_s = speed_m_s.map(|speed_m_s| speed_m_s / 0.08);
            step.acceleration_rad_s2 = Wheels::both(5.0);
            step.wheel_rad = step.rate_rad_s.map(|rate_rad_s| rate_rad_s * step.dt_s);
            step.wheel_angle_rad = step.wheel_rad.map(|wheel_rad| f64::from(k) * wheel_rad);
            step.travel_m = speed_m_s.map(|speed_m_s| speed_m_s * step.dt_s);
            step.encoder_rad = step.wheel_rad;
            let before = step;
            if hooks.wheel {
                form.wheel(&mut step);
            }
            if hooks.floor {
                form.floor(&mut step);
            }
            if hooks.encoder {
                form.encoder(&mut step);
            }
            format!("{step:?}") != format!("{before:?}")
        })
    }

    #[test]
    fn another_form_acts_where_the_size_is_large_and_does_nothing_where_it_is_none() {
        let mut forms = 0;
        for id in CATALOGUE {
            let Some(form) = description(id).expect("known").benchmark.other_form else { continue };
            forms += 1;
            let mut values = drawn(id, 0);
            assert!(departs(&mut *(form.forward)(&values, &host())), "{id}");
            let variants = hypothesis(id).and_then(Hypothesis::into_variants).expect("a mean");
            for parameter in variants[0].term.parameters() {
                values.iter_mut().filter(|(name, _)| *name == parameter.name).for_each(|(_, value)| *value = 0.0);
            }
            assert!(!departs(&mut *(form.forward)(&values, &host())), "{id} of no value");
        }
        assert_eq!(forms, 9);
    }

    /// Records that have what an effect needs must not tell that it is hidden, so it can be there without any
    /// harm. An effect of parts that robots of the benchmark do not have is never hidden.
    #[test]
    fn what_needs_something_of_the_records_can_be_there_without_harm() {
        for id in CATALOGUE {
            let needs = Needs { others: false, ..description(id).expect("known").benchmark.needs };
            let found = harmless(id, &host());
            let has_records = Needs { others: false, ..needs };
            assert_eq!(has_records != Needs::NONE, found.is_some(), "{id}");
            assert!(found.is_none_or(|effect| effect.id() == *id && effect.physical().check().is_ok()), "{id}");
            let bare = HostRobot { payload_kg: Vec::new(), jitter_s: 0.0, ..host() };
            assert_eq!(harmless(id, &bare), None, "{id}");
        }
    }
}
