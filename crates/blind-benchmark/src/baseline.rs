//! The regression on diagnosis: a campaign's shares against stored ones, with a stated budget of false
//! positives.
//!
//! What is guarded are shares: nulls with a finding, nulls with a failed check, plain effects that are
//! detected, right names first, intervals that cover. Each is compared with the baseline's share p₀ by a
//! one-sided binomial test on the side of worse. p₀ is (k + 1)/(n + 2) of the baseline's k in n, so that none
//! in n does not forbid the first. The budget is divided by the number of shares (Bonferroni). On the
//! baseline's own seed a tool that says the same passes for certain; on another seed, or after a change that
//! draws anew, the budget is how often an equally good tool fails, up to the baseline's own sampling.

use std::path::Path;

use statrs::distribution::{Binomial, DiscreteCDF};

use super::case::CaseKind;
use super::error::ChallengeError;
use super::measure_value::Measure;
use super::result::CaseResult;

/// Probability that a whole comparison finds an equally good tool worse.
pub const FALSE_ALARM_BUDGET: f64 = 0.01;

/// The measures that are guarded, by their ids.
const GUARDED: [&str; 5] = ["null_findings", "null_checks", "detected", "first_name", "coverage_low"];

/// A share that is guarded.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Guard {
    /// The measure's id.
    pub id: String,
    /// What it is of, for people.
    pub what: String,
    /// Whether more is worse.
    pub more_is_worse: bool,
    /// How many.
    pub count: usize,
    /// Of how many.
    pub of: usize,
}

/// A stored campaign.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DiagnosisBaseline {
    /// Seed of every draw.
    pub seed: u64,
    /// Cases, of which nulls and single effects were driven.
    pub cases: u64,
    /// Probability that a comparison finds an equally good tool worse.
    pub false_alarm_budget: f64,
    /// The shares.
    pub guards: Vec<Guard>,
}

/// A share beside the baseline's.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Guarded {
    /// Now.
    pub is: Guard,
    /// In the baseline.
    pub was: Guard,
    /// Probability of a count as bad as now or worse at the baseline's share.
    pub p_value: f64,
}

/// A campaign beside its baseline.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct DiagnosisCheck {
    /// Probability that the comparison finds an equally good tool worse.
    pub false_alarm_budget: f64,
    /// A share is worse below this p-value.
    pub level: f64,
    /// Every share.
    pub guarded: Vec<Guarded>,
}

impl DiagnosisBaseline {
    /// What is guarded of a campaign's measures.
    #[must_use]
    pub fn of(seed: u64, cases: u64, measures: &[Measure], results: &[CaseResult]) -> Self {
        let of = |id: &str| {
            let measure = measures.iter().find(|measure| measure.id == id)?;
            let (what, more_is_worse, of) = (measure.what.to_owned(), measure.at_most, measure.of);
            Some(Guard { id: id.to_owned(), what, more_is_worse, count: measure.count?, of })
        };
        let guards =
            GUARDED.iter().filter_map(|id| if *id == NULL_CHECKS { Some(null_checks(results)) } else { of(id) });
        Self { seed, cases, false_alarm_budget: FALSE_ALARM_BUDGET, guards: guards.collect() }
    }

    /// Reads a baseline.
    ///
    /// # Errors
    /// [`ChallengeError::Baseline`] when it cannot be read or is none.
    pub fn read(path: &Path) -> Result<Self, ChallengeError> {
        let failed = |why: String| ChallengeError::Baseline { path: path.display().to_string(), why };
        let bytes = std::fs::read(path).map_err(|error| failed(format!("{error}; --update writes a baseline")))?;
        serde_json::from_slice(&bytes).map_err(|error| failed(format!("not a baseline: {error}")))
    }

    /// Holds a campaign against this one.
    #[must_use]
    pub fn check(&self, now: &Self) -> DiagnosisCheck {
        let pairs = self.guards.iter().filter_map(|was| Some((was, now.guards.iter().find(|is| is.id == was.id)?)));
        let guarded: Vec<Guarded> = pairs
            .map(|(was, is)| Guarded { is: is.clone(), was: was.clone(), p_value: probability_of_worse(is, was) })
            .collect();
        let level = self.false_alarm_budget / guarded.len().max(1) as f64;
        DiagnosisCheck { false_alarm_budget: self.false_alarm_budget, level, guarded }
    }
}

impl DiagnosisCheck {
    /// What got worse, the least likely first.
    #[must_use]
    pub fn worse(&self) -> Vec<&Guarded> {
        let mut worse: Vec<&Guarded> = self.guarded.iter().filter(|guarded| guarded.p_value < self.level).collect();
        worse.sort_by(|a, b| a.p_value.total_cmp(&b.p_value));
        worse
    }
}

/// The id of what is guarded and no measure.
const NULL_CHECKS: &str = "null_checks";

/// Nulls of which a check fails at the end, but for those whose findings say that some must.
fn null_checks(results: &[CaseResult]) -> Guard {
    let nulls = results
        .iter()
        .filter(|case| case.case_kind == CaseKind::Null && case.has_ordinary_records() && case.refused.is_none());
    let (count, of) =
        nulls.fold((0, 0), |(count, of), case| (count + usize::from(!case.failed_checks.is_empty()), of + 1));
    Guard {
        id: NULL_CHECKS.to_owned(),
        what: "nulls with a failed check, of those with nothing exempt".to_owned(),
        more_is_worse: true,
        count,
        of,
    }
}

fn probability_of_worse(is: &Guard, was: &Guard) -> f64 {
    let share = (was.count as f64 + 1.0) / (was.of as f64 + 2.0);
    let Ok(binomial) = Binomial::new(share, is.of as u64) else { return 1.0 };
    let count = is.count as u64;
    match (was.more_is_worse, count) {
        (true, 0) => 1.0,
        (true, _) => binomial.sf(count - 1),
        (false, _) => binomial.cdf(count),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guard(more_is_worse: bool, count: usize, of: usize) -> Guard {
        Guard { id: "a".to_owned(), what: String::new(), more_is_worse, count, of }
    }

    fn baseline(guard: Guard) -> DiagnosisBaseline {
        DiagnosisBaseline { seed: 1, cases: 1, false_alarm_budget: 0.01, guards: vec![guard] }
    }

    #[test]
    fn worse_is_worse_on_its_side_alone() {
        let is_worse = |was: Guard, is: Guard| !baseline(was).check(&baseline(is)).worse().is_empty();
        // Of 95 with 4 in the baseline, p₀ = 5/97: P(X ≥ 10) = 0.025, P(X ≥ 11) = 0.0098.
        assert!(!is_worse(guard(true, 4, 95), guard(true, 10, 95)));
        assert!(is_worse(guard(true, 4, 95), guard(true, 11, 95)));
        assert!(!is_worse(guard(true, 12, 95), guard(true, 0, 95)));
        assert!(is_worse(guard(false, 40, 42), guard(false, 32, 42)));
        assert!(!is_worse(guard(false, 32, 42), guard(false, 42, 42)));
        // The first of what never was.
        assert!(!is_worse(guard(true, 0, 95), guard(true, 1, 95)));
        assert!(!is_worse(guard(true, 0, 0), guard(true, 0, 0)));
    }
}
