//! The blind benchmark of diagnosis: random robots with known imperfections, diagnosed from their records
//! alone, and scored against an oracle.
//!
//! A case is addressed by (seed, number): what is hidden, in whom, driven how, seen how, are draws of that
//! address, so that any case can be driven again alone and no number of threads changes a bit. The tool under
//! test gets datasets in memory and nothing else; the answer is looked at afterwards. Robots do effects by
//! the catalogue's simulation models or in other functional forms, and neither is the code of the hypotheses.
//! The oracle ([`OracleView`]) says what is detectable on a case's paths and which names its data cannot
//! discriminate. Blocks of twenty cases hold seven nulls, seven single effects, two pairs and four effects
//! that are left out of the catalogue in turn.

mod baseline;
mod case;
mod case_instrument;
mod case_kind;
mod conditions;
mod cut_log;
mod draw;
mod drive;
mod error;
mod fault_aliases;
mod hidden;
mod instrument;
mod log_model;
mod measure;
mod measure_value;
mod noise_free;
mod oracle;
mod oracle_view;
mod planned;
mod power;
mod power_ratio;
mod result;
mod ripple;
mod robot;
mod scope;
mod score;
mod strata;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod trial;
mod true_noise;

use std::collections::BTreeMap;
use std::ops::Range;

use rayon::prelude::*;

use case::Case;

pub use baseline::{DiagnosisBaseline, DiagnosisCheck, FALSE_ALARM_BUDGET, Guard, Guarded};
pub use case_instrument::CaseInstrument;
pub use case_kind::CaseKind;
pub use drive::Recorded;
pub use error::ChallengeError;
pub use hidden::EffectKind;
pub use instrument::{NoiseClass, TruthKind};
pub use measure_value::Measure;
pub use oracle_view::OracleView;
pub use result::{CaseResult, Planned, Reported};
pub use robot::PathFamily;
pub use scope::Scope;
pub use strata::{DrawnConditions, Strata};

/// What comes of a campaign.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ChallengeResult {
    /// Seed of every draw.
    pub seed: u64,
    /// Every measure against its bar.
    pub measures: Vec<Measure>,
    /// The same in every level of every stratum.
    pub strata: Vec<StratumMeasures>,
    /// What was hidden, what was said, and how often.
    pub confusions: Vec<Confusion>,
    /// Effects that no robot drawn for them showed: how often.
    pub never_shown: BTreeMap<String, usize>,
    /// Every case.
    pub cases: Vec<CaseResult>,
}

/// The measures over the cases of one level of a stratum.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct StratumMeasures {
    /// The stratum, by its key in a case's JSON.
    pub stratum: String,
    /// The level.
    pub level: String,
    /// How many cases are of it.
    pub cases: usize,
    /// Every measure; the bar on nulls with a finding is that of a stratum.
    pub measures: Vec<Measure>,
}

/// What was said of what.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
pub struct Confusion {
    /// What was asked.
    #[serde(rename = "round")]
    pub case_kind: String,
    /// What was hidden.
    pub hidden: String,
    /// What was said.
    #[serde(rename = "said")]
    pub reported: String,
    /// How often.
    pub count: usize,
    /// The cases.
    pub cases: Vec<u64>,
}

/// Drives one case again: what was hidden and what was said; `Err` with the id where no robot drawn for an
/// effect shows it.
///
/// # Errors
/// [`ChallengeError`] when it cannot be simulated.
pub fn challenge_case(
    scope: Scope,
    seed: u64,
    number: u64,
) -> Result<Result<CaseResult, &'static str>, ChallengeError> {
    match Case::draw(scope, seed, number)? {
        Ok(case) => Ok(Ok(score::score(number, &case, scope)?)),
        Err(id) => Ok(Err(id)),
    }
}

/// The datasets of one case, as the tool gets them; behind one long log the same cut into runs.
///
/// # Errors
/// As [`challenge_case`].
pub fn challenge_datasets(scope: Scope, seed: u64, number: u64) -> Result<Vec<dataset::Dataset>, ChallengeError> {
    let of = |case: Case| case.datasets.iter().cloned().chain(case.cut()).collect();
    Ok(Case::draw(scope, seed, number)?.map(of).unwrap_or_default())
}

/// A case's logs and what is true of them, for a tool that reads folders.
#[derive(Debug)]
pub struct CaseLogs {
    /// The sessions that are diagnosed.
    pub sessions: Vec<dataset::Dataset>,
    /// A session of the same robot on other paths, at another speed, without errors of the instrument.
    pub elsewhere: Vec<dataset::Dataset>,
    /// Everything that is known of the case; nothing is said of it yet.
    pub known: CaseResult,
    /// The geometry that a calibration should find.
    pub geometry: Option<kinematics::DriveGeometry>,
}

/// The logs of one case, its sessions recorded as asked; `Err` with the id where no robot drawn for an effect
/// shows it.
///
/// # Errors
/// As [`challenge_case`].
pub fn case_logs(
    scope: Scope,
    seed: u64,
    number: u64,
    recorded: Recorded,
) -> Result<Result<CaseLogs, &'static str>, ChallengeError> {
    let case = match Case::draw(scope, seed, number)? {
        Ok(case) => case,
        Err(id) => return Ok(Err(id)),
    };
    let (elsewhere, known, geometry) = (case.drive_elsewhere()?, score::undiagnosed(number, &case), case.truth());
    let sessions = if recorded == Recorded::AsLogged { case.datasets } else { case.sessions(recorded)? };
    Ok(Ok(CaseLogs { sessions, elsewhere, known, geometry }))
}

/// What came of a case.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CaseOutcome {
    /// What was hidden and what was found.
    Scored(Box<CaseResult>),
    /// The effect that no robot drawn for the case shows, by its id.
    NeverShown(String),
}

/// Whether a scope drives the case of a number.
fn is_driven(scope: Scope, number: u64) -> bool {
    scope != Scope::Guarded || case_kind::is_guarded(number)
}

/// Whether outcomes are those of a scope's cases with these numbers, one each and in their order.
#[must_use]
pub fn are_outcomes_of(outcomes: &[CaseOutcome], numbers: Range<u64>, scope: Scope) -> bool {
    let mut driven = numbers.filter(|number| is_driven(scope, *number));
    let is_next = |outcome: &CaseOutcome| match (driven.next(), outcome) {
        (Some(number), CaseOutcome::Scored(result)) => result.case == number,
        (number, CaseOutcome::NeverShown(_)) => number.is_some(),
        (None, CaseOutcome::Scored(_)) => false,
    };
    outcomes.iter().all(is_next) && driven.next().is_none()
}

/// Drives the cases of a scope on so many threads, 0 for one a core, and scores them; `done` is called after
/// each.
///
/// # Errors
/// [`ChallengeError`] when a case cannot be simulated, or the threads cannot be started.
pub fn challenge(
    seed: u64,
    cases: u64,
    scope: Scope,
    jobs: usize,
    done: &(dyn Fn() + Sync),
) -> Result<ChallengeResult, ChallengeError> {
    Ok(ChallengeResult::of(seed, challenge_outcomes(seed, 0..cases, scope, jobs, done)?))
}

/// Drives those of the numbered cases that the scope asks for, as [`challenge`] does, and gives what came of
/// each in the order of their numbers: a part of a campaign.
///
/// # Errors
/// As [`challenge`].
pub fn challenge_outcomes(
    seed: u64,
    numbers: Range<u64>,
    scope: Scope,
    jobs: usize,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<CaseOutcome>, ChallengeError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs).build();
    let pool = pool.map_err(|error| ChallengeError::Threads { jobs, why: error.to_string() })?;
    let one = |number| {
        let result = challenge_case(scope, seed, number);
        done();
        result.map(|outcome| match outcome {
            Ok(result) => CaseOutcome::Scored(Box::new(result)),
            Err(id) => CaseOutcome::NeverShown(id.to_owned()),
        })
    };
    pool.install(|| numbers.into_par_iter().filter(|number| is_driven(scope, *number)).map(one).collect())
}

impl ChallengeResult {
    /// The measures over all cases of a campaign, whose parts are given one behind the other.
    #[must_use]
    pub fn of(seed: u64, outcomes: Vec<CaseOutcome>) -> Self {
        let (mut cases, mut never_shown) = (Vec::new(), BTreeMap::new());
        for outcome in outcomes {
            match outcome {
                CaseOutcome::Scored(result) => cases.push(*result),
                CaseOutcome::NeverShown(id) => *never_shown.entry(id).or_insert(0) += 1,
            }
        }
        let measures = measure::measures(seed, &cases);
        let strata = by_stratum(seed, &cases);
        Self { seed, measures, strata, confusions: confusions(&cases), never_shown, cases }
    }
}

fn by_stratum(seed: u64, cases: &[CaseResult]) -> Vec<StratumMeasures> {
    let mut levels: BTreeMap<(String, String), Vec<CaseResult>> = BTreeMap::new();
    for case in cases {
        for level in case.levels() {
            levels.entry(level).or_default().push(case.clone());
        }
    }
    let of_level = |((stratum, level), cases): ((String, String), Vec<CaseResult>)| StratumMeasures {
        stratum,
        level,
        cases: cases.len(),
        measures: measure::measures_with(seed, &cases, measure::NULLS_IN_A_STRATUM),
    };
    levels.into_iter().map(of_level).collect()
}

fn confusions(cases: &[CaseResult]) -> Vec<Confusion> {
    let mut counts: BTreeMap<(String, String, String), Vec<u64>> = BTreeMap::new();
    for case in cases {
        let hidden: Vec<&str> = case.hidden.iter().map(|hidden| hidden.id.as_str()).collect();
        let hidden = if hidden.is_empty() { "nothing".to_owned() } else { hidden.join(" + ") };
        let case_kind = serde_json::to_value(case.case_kind).ok().and_then(|value| value.as_str().map(str::to_owned));
        counts.entry((case_kind.unwrap_or_default(), hidden, case.verdict())).or_default().push(case.case);
    }
    counts
        .into_iter()
        .map(|((case_kind, hidden, reported), cases)| Confusion {
            case_kind,
            hidden,
            reported,
            count: cases.len(),
            cases,
        })
        .collect()
}
