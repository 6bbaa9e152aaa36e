//! Which cases of a campaign are driven.

use crate::case_instrument::CaseInstrument;

/// Which cases of a campaign are driven, and how far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scope {
    /// All of them, with planned runs and gains.
    Whole,
    /// Nulls, the single effects of every second block, and what is said of them: all that a baseline guards.
    Guarded,
    /// Single effects of the mean at ten to a hundred of their detection limits, whatever the number; no
    /// gains and no planned runs.
    Large,
    /// Single effects of the mean in one long log, whatever the number, diagnosed as it is and cut into runs;
    /// no gains and no planned runs.
    OneLog,
    /// Nulls and single effects by turns, all seen by one instrument; no gains and no planned runs.
    Instrument(CaseInstrument),
}

impl Scope {
    /// The instrument that sees all cases; `None` where each draws its own.
    pub(crate) const fn instrument(self) -> Option<CaseInstrument> {
        match self {
            Self::Instrument(instrument) => Some(instrument),
            Self::Whole | Self::Guarded | Self::Large | Self::OneLog => None,
        }
    }
}
