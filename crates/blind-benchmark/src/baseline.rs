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

use std::ops::RangeInclusive;
use std::path::Path;

use statrs::distribution::{Binomial, DiscreteCDF};

use super::case_kind::CaseKind;
use super::error::ChallengeError;
use super::measure::is_first_name_right;
use super::result::CaseResult;

/// Longest baseline, bytes.
const MAX_BASELINE_BYTES: u64 = 64 << 20;

/// Probability that a whole comparison finds an equally good tool worse.
pub const FALSE_ALARM_BUDGET: f64 = 0.01;

/// Budgets that a baseline can have: a smaller one would let anything pass.
const BUDGETS: RangeInclusive<f64> = 1e-6..=0.5;

/// What is guarded: the cases that count, and those of them that fail.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Guard {
    /// A word for scripts.
    pub id: String,
    /// What fails, for people.
    pub what: String,
    /// Numbers of the cases that count, ascending.
    pub cases: Vec<u64>,
    /// Numbers of those that fail, ascending.
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
        case.is_plain().then(|| case.findings().next().is_none())
    }),
    ("wrong_first_name", "wrong names first, of detected effects without an alias", |case| {
        is_first_name_right(case).map(|is_right| !is_right)
    }),
    ("uncovered", "effects found with an interval that does not cover", |case| {
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
        let bytes = atomic_file::read_at_most(path, MAX_BASELINE_BYTES)
            .map_err(|error| failed(format!("{error}; --update writes a baseline")))?;
        let baseline: Self =
            serde_json::from_slice(&bytes).map_err(|error| failed(format!("not a baseline: {error}")))?;
        baseline.why_none().map_or(Ok(baseline), |why| Err(failed(format!("not a baseline: {why}"))))
    }

    /// Why it is no campaign that others can be held against.
    fn why_none(&self) -> Option<String> {
        if !BUDGETS.contains(&self.false_alarm_budget) {
            let (least, most) = (BUDGETS.start(), BUDGETS.end());
            return Some(format!("false_alarm_budget = {:?}; expected {least} to {most}", self.false_alarm_budget));
        }
        let ids: Vec<&str> = GUARDS.iter().map(|(id, ..)| *id).collect();
        if !self.guards.iter().map(|guard| &guard.id[..]).eq(ids.iter().copied()) {
            return Some(format!("it does not guard {}; --update writes one that does", ids.join(", ")));
        }
        // In the order of their numbers, and none twice.
        let is_sorted = |numbers: &[u64]| numbers.is_sorted_by(|a, b| a < b);
        let is_of_cases = |guard: &&Guard| {
            let are_numbers = is_sorted(&guard.cases) && guard.cases.last().is_none_or(|last| *last < self.cases);
            let is_case = |number: &u64| guard.cases.binary_search(number).is_ok();
            are_numbers && is_sorted(&guard.failures) && guard.failures.iter().all(is_case)
        };
        let odd = self.guards.iter().find(|guard| !is_of_cases(guard))?;
        Some(format!("{}: its failures are not among its cases, or these not among {}", odd.id, self.cases))
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
        // A p-value that is no number holds nothing.
        let holds = |guarded: &&Guarded| guarded.p_value >= self.level;
        let mut worse: Vec<&Guarded> = self.guarded.iter().filter(|guarded| !holds(guarded)).collect();
        worse.sort_by(|a, b| a.p_value.total_cmp(&b.p_value));
        worse
    }
}

impl Guarded {
    fn of(was: &Guard, is: &Guard, paired: bool) -> Self {
        let counts = |guard: &Guard| (guard.failures.len(), guard.cases.len());
        let only_in = |a: &Guard, b: &Guard| -> Vec<u64> {
            let is_in = |list: &[u64], number: &u64| list.binary_search(number).is_ok();
            let is_new = |number: &&u64| is_in(&b.cases, number) && !is_in(&b.failures, number);
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
    let Some(below) = count.checked_sub(1) else { return 1.0 };
    Binomial::new(share, of as u64).map_or(f64::NAN, |binomial| binomial.sf(below as u64))
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
    fn what_is_no_campaign_is_no_baseline() {
        let guard =
            |id: &str| Guard { id: id.to_owned(), what: String::new(), cases: vec![1, 4, 7], failures: vec![4] };
        let sound = DiagnosisBaseline {
            seed: 1,
            cases: 8,
            false_alarm_budget: FALSE_ALARM_BUDGET,
            guards: GUARDS.iter().map(|(id, ..)| guard(id)).collect(),
        };
        let temp = tempfile::tempdir().expect("a temporary folder");
        let read = |change: fn(&mut DiagnosisBaseline)| {
            let mut changed = sound.clone();
            change(&mut changed);
            let path = temp.path().join("baseline.json");
            std::fs::write(&path, serde_json::to_vec(&changed).expect("JSON")).expect("written");
            DiagnosisBaseline::read(&path).map_err(|error| error.to_string())
        };
        assert_eq!(read(|_| ()), Ok(sound.clone()));
        let all: [fn(&mut DiagnosisBaseline); 9] = [
            |of| of.false_alarm_budget = f64::NAN,
            |of| of.false_alarm_budget = 5e-324,
            |of| of.false_alarm_budget = -1.0,
            |of| of.guards.clear(),
            |of| of.guards[0].id = "other".to_owned(),
            |of| of.guards[1].failures = vec![5],
            |of| of.guards[1].failures = vec![4, 4],
            |of| of.guards[1].cases.swap(0, 1),
            |of| of.cases = 7,
        ];
        for (number, change) in all.into_iter().enumerate() {
            assert!(read(change).is_err_and(|why| why.contains("not a baseline")), "change {number}");
        }
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
