//! The regression on diagnosis: a campaign's failures against stored ones, with a stated budget of false
//! positives.
//!
//! Guarded are nulls with a finding, nulls with a failed check, plain effects that are not detected, wrong
//! names first, and intervals that do not cover. The budget is divided by their number (Bonferroni).
//!
//! On the baseline's own draws each case is held against itself: of those that fail in one campaign alone, a
//! change that is neither better nor worse makes as many fail as not, so that the number that fail now is
//! binomial with ½ (McNemar 1947, exact). On other draws the failures are binomial with the baseline's share,
//! (k + 1)/(n + 2) of k in n, so that none in n does not forbid the first. Both tests are one-sided. The
//! former finds less than the latter where all cases are new, and far more where they are the same.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use statrs::distribution::{Binomial, DiscreteCDF};

use super::case_kind::CaseKind;
use super::error::ChallengeError;
use super::measure::{is_first_name_right, is_plain};
use super::result::CaseResult;

/// Longest baseline, bytes; what is longer is cut off, and then no JSON.
const MAX_BASELINE_BYTES: u64 = 64 << 20;

/// Probability that a whole comparison finds an equally good tool worse.
pub const FALSE_ALARM_BUDGET: f64 = 0.01;

/// What is guarded: the cases that count, and those of them that fail.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Guard {
    /// A word for scripts.
    pub id: String,
    /// What fails, for people.
    pub what: String,
    /// Numbers of the cases that count.
    pub cases: Vec<u64>,
    /// Numbers of those that fail.
    pub failures: Vec<u64>,
}

/// A stored campaign.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DiagnosisBaseline {
    /// Seed of every draw.
    pub seed: u64,
    /// Cases, of which [`crate::Scope::Guarded`] were driven.
    pub cases: u64,
    /// Probability that a comparison finds an equally good tool worse.
    pub false_alarm_budget: f64,
    /// What is guarded.
    pub guards: Vec<Guard>,
}

/// What is guarded beside the baseline's.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Guarded {
    /// A word for scripts.
    pub id: String,
    /// What fails, for people.
    pub what: String,
    /// Failures in the baseline, and of how many.
    pub was: (usize, usize),
    /// Failures now, and of how many.
    pub is: (usize, usize),
    /// Cases that fail now and did not, of those that count in both; `None` where the draws are others.
    pub new_failures: Option<Vec<u64>>,
    /// Cases that failed and do not now.
    pub mended: Option<Vec<u64>>,
    /// Probability of so many failures or more if the tool is as good as it was.
    pub p_value: f64,
}

/// A campaign beside its baseline.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct DiagnosisCheck {
    /// Probability that the comparison finds an equally good tool worse.
    pub false_alarm_budget: f64,
    /// What is guarded got worse below this p-value.
    pub level: f64,
    /// All that is guarded.
    pub guarded: Vec<Guarded>,
}

/// Whether a case fails; `None` where it does not count.
type Fails = fn(&CaseResult) -> Option<bool>;

/// All that is guarded.
const GUARDS: [(&str, &str, Fails); 5] = [
    ("null_findings", "nulls with a finding", |case| {
        (case.case_kind == CaseKind::Null).then(|| case.findings().next().is_some())
    }),
    ("null_checks", "nulls with a failed check, of those where no finding is exempt", |case| {
        let counts = case.case_kind == CaseKind::Null && case.has_ordinary_records() && case.refused.is_none();
        counts.then_some(!case.failed_checks.is_empty())
    }),
    ("undetected", "effects of 1.6 limits and more that are not detected", |case| {
        is_plain(case).then(|| case.findings().next().is_none())
    }),
    ("wrong_first_name", "wrong names first, of detected effects without an alias", |case| {
        is_first_name_right(case).map(|is_right| !is_right)
    }),
    ("uncovered", "effects found of which an interval does not cover", |case| {
        let mut covered = case.reported.iter().flat_map(|reported| &reported.covered).peekable();
        covered.peek().is_some().then(|| !covered.all(|covered| *covered))
    }),
];

impl DiagnosisBaseline {
    /// What is guarded of a campaign.
    #[must_use]
    pub fn of(seed: u64, cases: u64, results: &[CaseResult]) -> Self {
        let guard = |(id, what, fails): &(&str, &str, Fails)| {
            let of_cases = || results.iter().filter_map(|case| Some((case.case, fails(case)?)));
            Guard {
                id: (*id).to_owned(),
                what: (*what).to_owned(),
                cases: of_cases().map(|(number, _)| number).collect(),
                failures: of_cases().filter(|(_, fails)| *fails).map(|(number, _)| number).collect(),
            }
        };
        Self { seed, cases, false_alarm_budget: FALSE_ALARM_BUDGET, guards: GUARDS.iter().map(guard).collect() }
    }

    /// Reads a baseline.
    ///
    /// # Errors
    /// [`ChallengeError::Baseline`] when it cannot be read or is none.
    pub fn read(path: &Path) -> Result<Self, ChallengeError> {
        let failed = |why: String| ChallengeError::Baseline { path: path.display().to_string(), why };
        let mut bytes = Vec::new();
        let file = File::open(path).map_err(|error| failed(format!("{error}; --update writes a baseline")))?;
        file.take(MAX_BASELINE_BYTES).read_to_end(&mut bytes).map_err(|error| failed(error.to_string()))?;
        serde_json::from_slice(&bytes).map_err(|error| failed(format!("not a baseline: {error}")))
    }

    /// Holds a campaign against this one.
    #[must_use]
    pub fn check(&self, now: &Self) -> DiagnosisCheck {
        let paired = (self.seed, self.cases) == (now.seed, now.cases);
        let pairs = self.guards.iter().filter_map(|was| Some((was, now.guards.iter().find(|is| is.id == was.id)?)));
        let guarded: Vec<Guarded> = pairs.map(|(was, is)| Guarded::of(was, is, paired)).collect();
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

impl Guarded {
    fn of(was: &Guard, is: &Guard, paired: bool) -> Self {
        let counts = |guard: &Guard| (guard.failures.len(), guard.cases.len());
        let only_in = |a: &Guard, b: &Guard| -> Vec<u64> {
            let is_new = |number: &&u64| b.cases.contains(number) && !b.failures.contains(number);
            a.failures.iter().filter(is_new).copied().collect()
        };
        let (new_failures, mended) = (only_in(is, was), only_in(was, is));
        let p_value = if paired {
            at_least(new_failures.len(), new_failures.len() + mended.len(), 0.5)
        } else {
            let (k, n) = counts(was);
            at_least(is.failures.len(), is.cases.len(), (k as f64 + 1.0) / (n as f64 + 2.0))
        };
        Self {
            id: is.id.clone(),
            what: is.what.clone(),
            was: counts(was),
            is: counts(is),
            new_failures: paired.then_some(new_failures),
            mended: paired.then_some(mended),
            p_value,
        }
    }
}

/// Probability of so many or more.
fn at_least(count: usize, of: usize, share: f64) -> f64 {
    match (count.checked_sub(1), Binomial::new(share, of as u64)) {
        (Some(below), Ok(binomial)) => binomial.sf(below as u64),
        _ => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A campaign of `of` cases with these failures.
    fn campaign(seed: u64, of: u64, failures: impl Iterator<Item = u64>) -> DiagnosisBaseline {
        let guard =
            Guard { id: "a".to_owned(), what: String::new(), cases: (0..of).collect(), failures: failures.collect() };
        DiagnosisBaseline { seed, cases: of, false_alarm_budget: FALSE_ALARM_BUDGET, guards: vec![guard] }
    }

    #[test]
    fn on_the_same_draws_each_case_is_held_against_itself() {
        let was = campaign(1, 95, 0..30);
        let is_worse = |first: u64, end: u64| !was.check(&campaign(1, 95, first..end)).worse().is_empty();
        assert!(!is_worse(0, 30) && !is_worse(0, 0));
        // 2⁻⁶ = 0.016, 2⁻⁷ = 0.008.
        assert!(!is_worse(0, 36) && is_worse(0, 37));
        // As many mended as new.
        assert!(!is_worse(10, 40));
        // P(X ≥ 12 of 15) = 0.018, P(X ≥ 13 of 15) = 0.0037.
        assert!(!is_worse(3, 42) && is_worse(2, 43));
    }

    #[test]
    fn on_other_draws_a_share_is_held_against_the_baselines() {
        let is_worse = |was: u64, is: u64| !campaign(1, 95, 0..was).check(&campaign(2, 95, 0..is)).worse().is_empty();
        // p₀ = 5/97: P(X ≥ 10) = 0.025, P(X ≥ 11) = 0.0098.
        assert!(!is_worse(4, 10) && is_worse(4, 11));
        assert!(!is_worse(12, 0) && !is_worse(0, 1));
    }
}
