//! The hypothesis face: how recorded data would show an effect.
//!
//! Most effects add to the mean of a motion or of what the instrument sees, linearly in their sizes ([`Hypothesis::Terms`]); what is not linear, a hinge speed
//! or a decay length, is one of a few shapes. Gross faults rewrite the records ([`Hypothesis::Records`]). What only scatters has no mean: the checks of a fit
//! show it ([`Hypothesis::Scatter`]).

use dataset::{Dataset, ModelTerm};

/// How data would show an effect.
pub enum Hypothesis {
    /// The three lengths of the drive, which every calibration fits.
    Geometry,
    /// A mean term; several where a shape parameter is to be tried at several values, which then pay for their trials.
    Terms(Vec<Shape>),
    /// The records as they would be without the fault, one for each form that it takes; `None` where the fault is impossible in these records.
    Records(fn(&Dataset) -> Vec<Rewriting>),
    /// It scatters: it shows in these checks of a fit and in no mean.
    Scatter(&'static [Sign]),
    /// Innocent, or not told from data alone.
    Silent,
}

/// A mean term with its shape parameters held.
pub struct Shape {
    /// What is held, by the name in the effect's forward face where that has it.
    pub held: Vec<(&'static str, f64)>,
    /// The term.
    pub term: Box<dyn ModelTerm>,
}

impl Shape {
    /// A term without shape parameters.
    #[must_use]
    pub fn plain(term: impl ModelTerm + 'static) -> Vec<Self> {
        vec![Self { held: Vec::new(), term: Box::new(term) }]
    }
}

/// Records without a fault.
pub struct Rewriting {
    /// The parameters of the fault that it undoes: names and values.
    pub sizes: Vec<(&'static str, f64)>,
    /// What the fault was, for people: "the left and the right counter are swapped".
    pub sentence: String,
    /// The records as they would be without it.
    pub records: Dataset,
}

/// A size by its name.
pub(crate) fn size(sizes: &[(&str, f64)], name: &str) -> Option<f64> {
    sizes.iter().find(|(of, _)| *of == name).map(|(_, size)| *size)
}

/// What a scatter does to a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sign {
    /// Single looks of the instrument that lie far off and come back in the next.
    IsolatedLooks,
    /// Jumps of the heading that stay.
    HeadingJumps,
    /// Jumps of the way travelled that stay.
    WayJumps,
    /// Looks whose errors resemble those of the looks before.
    CorrelatedLooks,
    /// A heading that scatters in proportion to the turn, manoeuvre by manoeuvre.
    ScatterWithTurn,
    /// Errors that grow with the speed at the instant of a look.
    ScatterWithSpeed,
}
