//! How the dead reckoning of a run starts without a measured pose.

use serde::Serialize;

/// How the dead reckoning of a run starts without a measured pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum StartsBy {
    /// The positions of its first tenth. There are no headings to compare.
    FirstTenth,
    /// Displacements, one after the other.
    Chain,
}

impl StartsBy {
    /// What is said of it.
    #[must_use]
    pub const fn sentence(self) -> &'static str {
        match self {
            Self::FirstTenth => {
                "only positions were measured: each run starts with the heading that fits its first tenth"
            }
            Self::Chain => {
                "only displacements were measured: they are chained, so that their errors add up in the drift"
            }
        }
    }
}
