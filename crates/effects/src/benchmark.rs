//! How the blind benchmark hides an effect in a random robot: the law of its sizes, what the records must
//! have for it to show, and another functional form.
//!
//! Sizes are drawn as a direction and scaled afterwards to what the data can show, up to the largest of a
//! real robot. The *other form* is a forward face that departs from the catalogue's, so that the world
//! differs from every hypothesis. It stands in the effect's file and shares no code with the hypothesis.
//! References: Pacejka 2012 for slip that saturates; Armstrong-Hélouvry et al. 1994 for round corners of
//! friction.

use kinematics::Wheels;

use crate::Effect;
use crate::forward::{Forward, Hooks, Step};
use crate::stream::Stream;

/// Sizes by their names.
pub type Sizes = Vec<(&'static str, f64)>;

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
}

impl Needs {
    pub(crate) const NONE: Self = Self { payload: false, jitter: false };

    /// What either needs.
    #[must_use]
    pub const fn and(self, other: Self) -> Self {
        Self { payload: self.payload || other.payload, jitter: self.jitter || other.jitter }
    }
}

/// The law of an effect's sizes.
#[derive(Debug, Clone, Copy)]
pub enum SizeLaw {
    /// A random direction in units of what is large by the hypothesis's parameters.
    Direction {
        /// What stays the same whatever the scale, from the shape parameters of the hypothesis that was
        /// drawn; off its grid where any value is possible.
        held: fn(Sizes, &HostRobot, &mut Stream) -> Sizes,
        /// A size of the wrong sign counts as none: the direction would not be what it says.
        positive: bool,
    },
    /// Sizes at scale 1, and what stays the same whatever the scale.
    Scatter(fn(&HostRobot, &mut Stream) -> (Sizes, Sizes)),
    /// A fault of the records, of one or both wheels, which has no scale.
    Fault(fn(Wheels<bool>, &mut Stream) -> Sizes),
}

/// Another functional form of an effect.
#[derive(Clone, Copy)]
pub struct OtherForm {
    /// Which one, for people: "the share lost saturates as tanh of the speed".
    pub what: &'static str,
    /// The form; sizes are those of the hypothesis, at which it does about as much.
    pub forward: fn(&[(&'static str, f64)], &HostRobot) -> Box<dyn Forward>,
}

/// How the blind benchmark draws an effect.
#[derive(Clone, Copy)]
pub struct Benchmark {
    /// What the records must have.
    pub needs: Needs,
    /// The law of its sizes.
    pub sizes: SizeLaw,
    /// Largest scale of a real robot.
    pub max_scale: f64,
    /// The effect of drawn sizes at a scale, where that is another than `of_sizes` makes of them.
    pub at_scale: Option<fn(&[(&'static str, f64)], f64, &HostRobot) -> Option<Effect>>,
    /// Another functional form, of which one robot in two is.
    pub other_form: Option<OtherForm>,
    /// Its signature is random in part: one drive with it is not like the next.
    pub has_random_signature: bool,
    /// The effect without any harm, for records that have what it needs though it is not hidden: so such
    /// records tell nothing.
    pub harmless: Option<fn(&HostRobot) -> Option<Effect>>,
}

/// Means beyond so many times what is large are no robot's.
const MAX_SCALE_OF_MEAN: f64 = 3.0;
/// The same of scatter, which shows with the square of its size.
const MAX_SCALE_OF_SCATTER: f64 = 10.0;

fn as_tried(held: Sizes, _: &HostRobot, _: &mut Stream) -> Sizes {
    held
}

impl Benchmark {
    /// A mean in a random direction.
    pub(crate) const OF_MEAN: Self = Self {
        needs: Needs::NONE,
        sizes: SizeLaw::Direction { held: as_tried, positive: false },
        max_scale: MAX_SCALE_OF_MEAN,
        at_scale: None,
        other_form: None,
        has_random_signature: false,
        harmless: None,
    };

    /// A mean whose shape parameters are drawn by a law of their own.
    pub(crate) const fn of_mean_at(held: fn(Sizes, &HostRobot, &mut Stream) -> Sizes) -> Self {
        Self { sizes: SizeLaw::Direction { held, positive: false }, ..Self::OF_MEAN }
    }

    /// A mean in another form on one robot in two.
    pub(crate) const fn with_form(
        self,
        what: &'static str,
        forward: fn(&[(&'static str, f64)], &HostRobot) -> Box<dyn Forward>,
    ) -> Self {
        Self { other_form: Some(OtherForm { what, forward }), ..self }
    }

    /// A scatter.
    pub(crate) const fn of_scatter(law: fn(&HostRobot, &mut Stream) -> (Sizes, Sizes)) -> Self {
        Self { sizes: SizeLaw::Scatter(law), max_scale: MAX_SCALE_OF_SCATTER, ..Self::OF_MEAN }
    }

    /// A fault of the records.
    pub(crate) const fn of_fault(law: fn(Wheels<bool>, &mut Stream) -> Sizes) -> Self {
        Self { sizes: SizeLaw::Fault(law), ..Self::OF_MEAN }
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
