//! Findings that are right in some condition whatever is hidden: that the stamps are irregular, or that
//! measurements are outliers, is then what the records say. They count neither as a false positive nor as
//! the name of what is hidden; where such a finding is what the case hides, it counts as usual.

use super::instrument::NoiseClass;
use super::strata::{ClockLevel, StampLevel, Strata};

/// Findings that are right in a condition.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Exemption {
    /// The stratum, by its key in JSON.
    pub stratum: &'static str,
    /// Its level.
    pub level: &'static str,
    /// The findings.
    pub findings: &'static [&'static str],
    /// Why they are right.
    pub why: &'static str,
}

/// Every exemption. Rows that are lost while the counters go on are none: nothing of what the robot did is
/// missing then.
pub const EXEMPT: &[Exemption] = &[
    Exemption {
        stratum: "noise",
        level: "heavy_tailed",
        findings: &["truth_outliers"],
        why: "one measurement in a hundred is off by more than four standard deviations",
    },
    Exemption {
        stratum: "noise",
        level: "correlated",
        findings: &["truth_correlated_noise"],
        why: "errors last from one measurement to the next",
    },
    Exemption {
        stratum: "noise",
        level: "dropouts",
        findings: &["dropped_samples"],
        why: "rows are lost with their counts",
    },
    Exemption {
        stratum: "stamps",
        level: "jittering",
        findings: &["interval_error"],
        why: "the logged intervals are not the true ones",
    },
    Exemption {
        stratum: "stamps",
        level: "received",
        findings: &["interval_error", "truth_latency"],
        why: "the logged intervals are not the true ones, and the log is late beside the instrument",
    },
    Exemption { stratum: "clock", level: "drifting", findings: &["clock_rate"], why: "one clock gains on the other" },
];

/// Findings that are right in a case's conditions.
pub(crate) fn right_findings(noise: NoiseClass, strata: &Strata) -> impl Iterator<Item = &'static str> {
    let noise = match noise {
        NoiseClass::White => None,
        NoiseClass::HeavyTailed => Some("heavy_tailed"),
        NoiseClass::Correlated => Some("correlated"),
        NoiseClass::Dropouts => Some("dropouts"),
    };
    let stamps = match strata.stamps {
        StampLevel::Exact | StampLevel::Irregular => None,
        StampLevel::Jittering => Some("jittering"),
        StampLevel::Received => Some("received"),
    };
    let clock = (strata.clock == ClockLevel::Drifting).then_some("drifting");
    let held = [("noise", noise), ("stamps", stamps), ("clock", clock)];
    let holds = move |exemption: &&Exemption| held.contains(&(exemption.stratum, Some(exemption.level)));
    EXEMPT.iter().filter(holds).flat_map(|exemption| exemption.findings.iter().copied())
}

#[cfg(test)]
mod tests {
    use effects::{CATALOGUE, Sign, hypothesis};

    use super::*;

    #[test]
    fn exempt_findings_are_of_the_catalogue_and_all_that_show_by_the_sign() {
        for exemption in EXEMPT {
            assert!(exemption.findings.iter().all(|id| CATALOGUE.contains(id)), "{exemption:?}");
        }
        for (level, sign) in [("heavy_tailed", Sign::IsolatedErrors), ("correlated", Sign::AutocorrelatedErrors)] {
            let shows = |id: &&str| hypothesis(id).is_some_and(|hypothesis| hypothesis.signs().contains(&sign));
            let all: Vec<&str> = CATALOGUE.iter().copied().filter(shows).collect();
            let exemption = EXEMPT.iter().find(|exemption| exemption.level == level).expect("listed");
            assert_eq!(exemption.findings, all);
        }
    }
}
