//! What a case asks, by its number.

use crate::scope::Scope;

/// What a case asks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CaseKind {
    /// Nothing is hidden.
    Null,
    /// One effect is hidden.
    Single,
    /// Two effects are hidden.
    Pair,
    /// One effect is hidden, and the catalogue is without it.
    LeftOut,
    /// One effect of the mean is hidden, at ten detection limits and more.
    Large,
    /// One effect of the mean is hidden in one long log.
    OneLog,
}

/// A block of cases: of each twenty, so many are nulls, singles, pairs; the others leave an effect out.
const BLOCK: u64 = 20;
const NULLS: u64 = 7;
const SINGLES: u64 = 7;
const PAIRS: u64 = 2;

impl CaseKind {
    /// The kind of a case in a campaign, and which of its kind it is.
    pub(crate) const fn in_scope(scope: Scope, number: u64) -> (Self, u64) {
        match scope {
            Scope::Large => (Self::Large, number),
            Scope::OneLog => (Self::OneLog, number),
            Scope::Instrument(_) => (if number.is_multiple_of(2) { Self::Null } else { Self::Single }, number / 2),
            Scope::Whole | Scope::Guarded => Self::of(number),
        }
    }

    /// The same where kinds mix.
    pub(crate) const fn of(number: u64) -> (Self, u64) {
        let (block, index) = (number / BLOCK, number % BLOCK);
        if index < NULLS {
            (Self::Null, block * NULLS + index)
        } else if index < NULLS + SINGLES {
            (Self::Single, block * SINGLES + index - NULLS)
        } else if index < NULLS + SINGLES + PAIRS {
            (Self::Pair, block * PAIRS + index - NULLS - SINGLES)
        } else {
            let left = NULLS + SINGLES + PAIRS;
            (Self::LeftOut, block * (BLOCK - left) + index - left)
        }
    }
}

/// Whether a case is of those that a baseline guards: the nulls, which are quick, and the single effects of
/// every second block.
pub(crate) const fn is_guarded(number: u64) -> bool {
    match CaseKind::of(number).0 {
        CaseKind::Null => true,
        CaseKind::Single => (number / BLOCK).is_multiple_of(2),
        CaseKind::Pair | CaseKind::LeftOut | CaseKind::Large | CaseKind::OneLog => false,
    }
}
