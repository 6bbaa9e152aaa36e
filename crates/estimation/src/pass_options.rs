//! What a pass carries along, and which measurements it takes.

use crate::model::Column;
use crate::propagation::CachedPropagation;

/// Whether measurements whose innovation is improbable are rejected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum OutlierGate {
    /// They are.
    #[default]
    On,
    /// Every measurement is taken, however far off.
    Off,
}

impl OutlierGate {
    /// Open for every measurement.
    pub(crate) const fn of(ungated: bool) -> Self {
        if ungated { Self::Off } else { Self::On }
    }
}

/// What to carry along in a pass.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct PassOptions<'p> {
    pub(crate) noise_score: bool,
    pub(crate) innovations: bool,
    /// How the robot moved before each measurement, by the counts; not with propagation that was kept.
    pub(crate) samples: bool,
    pub(crate) gate: OutlierGate,
    /// Record the propagations, for passes at models near this one.
    pub(crate) keep: bool,
    /// Propagations recorded by a pass at another model, to be used instead of integrating.
    pub(crate) by: Option<&'p CachedPropagation>,
    /// The last columns come in parts of so many, each tested for itself: columns of two parts have no
    /// products with each other.
    pub(crate) parts: &'p [usize],
    /// The columns that the normal equations are solved for: those of two others have no products. `None`:
    /// all products are taken.
    pub(crate) free: Option<&'p [Column]>,
}
