//! Findings that are right in some ordinary condition of the records, whatever else is wrong with the robot:
//! that the stamps are irregular, or that measurements are outliers, is then what the records say. The blind
//! benchmark counts them neither as a false positive nor as the name of what is hidden.

/// A condition of ordinary records that a finding may rightly name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OrdinaryCondition {
    /// Measurements err with heavy tails.
    HeavyTailedErrors,
    /// Errors last from one measurement to the next.
    AutocorrelatedErrors,
    /// Rows are lost with their counts.
    RowsLostWithCounts,
    /// Stamps are off the readings by normal errors.
    JitteringStamps,
    /// Rows are stamped on receipt.
    ReceivedStamps,
    /// One clock gains on the other.
    DriftingClocks,
}

/// Findings that are right in a condition.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Exemption {
    /// The condition.
    pub condition: OrdinaryCondition,
    /// The findings, by the effects' ids.
    pub findings: &'static [&'static str],
    /// Why they are right.
    pub why: &'static str,
}

/// Every exemption. Rows that are lost while the counters go on are none: nothing of what the robot did is
/// missing then.
pub const EXEMPT: &[Exemption] = &[
    Exemption {
        condition: OrdinaryCondition::HeavyTailedErrors,
        findings: &["truth_outliers"],
        why: "one measurement in a hundred is off by more than four standard deviations",
    },
    Exemption {
        condition: OrdinaryCondition::AutocorrelatedErrors,
        findings: &["truth_correlated_noise"],
        why: "errors last from one measurement to the next",
    },
    Exemption {
        condition: OrdinaryCondition::RowsLostWithCounts,
        findings: &["dropped_samples"],
        why: "rows are lost with their counts",
    },
    Exemption {
        condition: OrdinaryCondition::JitteringStamps,
        findings: &["interval_error"],
        why: "the logged intervals are not the true ones",
    },
    Exemption {
        condition: OrdinaryCondition::ReceivedStamps,
        findings: &["interval_error", "truth_latency"],
        why: "the logged intervals are not the true ones, and the log is late against the instrument",
    },
    Exemption {
        condition: OrdinaryCondition::DriftingClocks,
        findings: &["clock_rate"],
        why: "one clock gains on the other",
    },
];

impl OrdinaryCondition {
    /// Findings that are right in it.
    pub fn right_findings(self) -> impl Iterator<Item = &'static str> {
        let exemptions = EXEMPT.iter().filter(move |exemption| exemption.condition == self);
        exemptions.flat_map(|exemption| exemption.findings.iter().copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CATALOGUE, Sign, hypothesis};

    #[test]
    fn exempt_findings_are_of_the_catalogue_and_all_that_show_by_the_sign() {
        for exemption in EXEMPT {
            assert!(exemption.findings.iter().all(|id| CATALOGUE.contains(id)), "{exemption:?}");
        }
        for (condition, sign) in [
            (OrdinaryCondition::HeavyTailedErrors, Sign::IsolatedErrors),
            (OrdinaryCondition::AutocorrelatedErrors, Sign::AutocorrelatedErrors),
        ] {
            let shows = |id: &&str| hypothesis(id).is_some_and(|hypothesis| hypothesis.signs().contains(&sign));
            let all: Vec<&str> = CATALOGUE.iter().copied().filter(shows).collect();
            assert_eq!(condition.right_findings().collect::<Vec<_>>(), all);
        }
    }
}
