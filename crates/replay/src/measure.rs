//! The measures: what each says of one log and one outcome.

use crate::answer::{Answer, Cause, Question};
use crate::outcome::{Finding, Outcome};

/// A function of one log and what was said of it; `None` where the measure does not ask the log.
type Of<T> = fn(&Answer, &Outcome) -> Option<T>;

/// What a measure scores a log with, and how scores are pooled.
#[derive(Clone, Copy)]
pub enum Score {
    /// Holds or does not; pooled is the share, compared by McNemar's test.
    Share(Of<bool>),
    /// Pooled is the mean.
    Mean(Of<f64>),
    /// Pooled is the root of the mean.
    RootMean(Of<f64>),
}

/// A measure.
#[derive(Clone, Copy)]
pub struct Measure {
    /// Its key.
    pub id: &'static str,
    /// What it is.
    pub what: &'static str,
    /// What it scores a log with.
    pub score: Score,
    /// Whether more is better.
    pub is_more_better: bool,
    /// How much may be lost, in the unit of the pooled value; `None` where nothing is held to it.
    pub margin: Option<f64>,
}

impl Measure {
    /// The score of one log, 0 or 1 of a share.
    #[must_use]
    pub fn of(&self, answer: &Answer, outcome: &Outcome) -> Option<f64> {
        match self.score {
            Score::Share(holds) => holds(answer, outcome).map(|holds| f64::from(u8::from(holds))),
            Score::Mean(value) | Score::RootMean(value) => value(answer, outcome),
        }
    }

    /// Whether the measure is a share.
    #[must_use]
    pub fn is_share(&self) -> bool {
        matches!(self.score, Score::Share(_))
    }

    /// The value over many logs, from the mean of their scores.
    #[must_use]
    pub fn pooled(&self, mean: f64) -> f64 {
        if matches!(self.score, Score::RootMean(_)) { mean.sqrt() } else { mean }
    }
}

/// The worst that an extended model may do elsewhere without being counted: a tenth of the drift, or 0.01 %
/// of the distance, which a calibration's own errors move.
const HARM: (f64, f64) = (0.1, 0.01);

/// Two-sided 95 % of a normal variable.
const COVERED: f64 = 1.96;

/// Smallest drift whose logarithm is taken, per cent of the distance.
const MIN_DRIFT: f64 = 1e-3;

/// Every measure, in the order of the tables. Margins are those of the rule of acceptance (CONTRIBUTING.md).
pub const MEASURES: [Measure; 13] = [
    share("nulls_with_finding", "nulls with a finding", false, Some(0.01), |answer, outcome| {
        (answer.question == Question::Null && outcome.refused.is_none()).then(|| found(answer, outcome).is_some())
    }),
    share("detected", "plain causes: something is found", true, Some(0.01), |answer, outcome| {
        let is_plain = matches!(&answer.causes[..], [cause] if cause.is_plain);
        (answer.question == Question::One && is_plain).then(|| found(answer, outcome).is_some())
    }),
    share("first_cause", "detected, no alias: right cause first", true, Some(0.02), |answer, outcome| {
        let cause = one(answer).filter(|cause| !cause.is_aliased)?;
        found(answer, outcome).map(|finding| finding.names.first().is_some_and(|name| cause.right.contains(name)))
    }),
    share("in_set", "detected, aliased: right cause in the set", true, Some(0.04), |answer, outcome| {
        let cause = one(answer).filter(|cause| cause.is_aliased)?;
        found(answer, outcome).map(|finding| finding.names.iter().any(|name| cause.right.contains(name)))
    }),
    share("both_of_two", "two causes: both among the findings", true, None, |answer, outcome| {
        let names = |finding: &Finding| finding.names.clone();
        let found: Vec<String> = findings(answer, outcome).flat_map(names).collect();
        let is_found = |cause: &Cause| cause.right.iter().any(|name| found.contains(name));
        let is_asked = answer.question == Question::Two && answer.causes.iter().all(|cause| cause.is_plain);
        is_asked.then(|| answer.causes.iter().all(is_found))
    }),
    share("left_out", "left out, detected: no wrong name", true, Some(0.02), |answer, outcome| {
        let cause = answer.causes.first().filter(|_| answer.question == Question::LeftOut)?;
        let is_unnamed = |finding: &Finding| finding.names.iter().any(|name| name == "unlisted");
        let is_alias = |finding: &Finding| finding.names.iter().any(|name| cause.aliases.contains(name));
        let named = |outcome| findings(answer, outcome).any(|finding| !is_unnamed(finding) && !is_alias(finding));
        found(answer, outcome).map(|_| !named(outcome))
    }),
    share("harm_elsewhere", "extended: drifts more elsewhere", false, Some(0.02), |answer, outcome| {
        let drift = outcome.drift_percent.filter(|drift| drift.extended != drift.calibrated)?;
        let allowed = (HARM.0 * drift.calibrated).max(HARM.1);
        (answer.question != Question::Unknown).then_some(drift.extended - drift.calibrated > allowed)
    }),
    share("covered", "sizes of right causes: all in their 95 % intervals", true, None, |answer, outcome| {
        let mut errors = answer.causes.iter().flat_map(|cause| errors_of(cause, outcome)).peekable();
        errors.peek()?;
        Some(errors.all(|error| error.abs() < COVERED))
    }),
    share("refused", "refused", false, None, |_, outcome| Some(outcome.refused.is_some())),
    Measure {
        id: "rms_z",
        what: "nulls: RMS z of the geometry",
        score: Score::RootMean(|answer, outcome| {
            let z: Vec<f64> = answer.geometry_m.iter().filter_map(|(name, truth)| z(*truth, outcome, name)).collect();
            let mean = z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64;
            (answer.question == Question::Null && !z.is_empty()).then_some(mean)
        }),
        is_more_better: false,
        margin: Some(0.05),
    },
    mean("gain", "causes: ln of drift elsewhere, calibrated over extended", true, |answer, outcome| {
        let drift = outcome.drift_percent.filter(|_| !answer.causes.is_empty())?;
        Some((drift.calibrated.max(MIN_DRIFT) / drift.extended.max(MIN_DRIFT)).ln())
    }),
    mean("drift", "ln of the extended model's drift elsewhere, per cent", false, |_, outcome| {
        Some(outcome.drift_percent?.extended.max(MIN_DRIFT).ln())
    }),
    mean("seconds", "ln of the seconds of a diagnosis on one thread", false, |_, outcome| Some(outcome.seconds.ln())),
];

const fn share(
    id: &'static str,
    what: &'static str,
    is_more_better: bool,
    margin: Option<f64>,
    holds: Of<bool>,
) -> Measure {
    Measure { id, what, score: Score::Share(holds), is_more_better, margin }
}

const fn mean(id: &'static str, what: &'static str, is_more_better: bool, value: Of<f64>) -> Measure {
    Measure { id, what, score: Score::Mean(value), is_more_better, margin: None }
}

/// The findings that count.
fn findings<'a>(answer: &'a Answer, outcome: &'a Outcome) -> impl Iterator<Item = &'a Finding> {
    outcome.findings.iter().filter(|finding| !answer.exempts(&finding.names))
}

/// The first that counts.
fn found<'a>(answer: &'a Answer, outcome: &'a Outcome) -> Option<&'a Finding> {
    findings(answer, outcome).next()
}

/// The cause of a log that has one, which the catalogue holds.
fn one(answer: &Answer) -> Option<&Cause> {
    answer.causes.first().filter(|_| answer.question == Question::One)
}

/// The error of a length over its stated standard deviation.
fn z(truth_m: f64, outcome: &Outcome, name: &str) -> Option<f64> {
    let stated = outcome.lengths.get(name)?;
    Some((stated.value - truth_m) / stated.sigma?)
}

/// The same of the sizes of a cause whose name comes first in a finding.
fn errors_of<'a>(cause: &'a Cause, outcome: &'a Outcome) -> impl Iterator<Item = f64> + 'a {
    let is_first = |finding: &&Finding| finding.names.first().is_some_and(|name| cause.right.contains(name));
    let finding = outcome.findings.iter().find(is_first);
    let error = move |(name, truth): (&String, &f64)| {
        let stated = finding?.parameters.get(name)?;
        Some((stated.value - truth) / stated.sigma?)
    };
    cause.sizes.iter().filter_map(error)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outcome::{Drift, Stated};

    fn score(id: &str, answer: &Answer, outcome: &Outcome) -> Option<f64> {
        MEASURES.iter().find(|measure| measure.id == id).expect("a measure").of(answer, outcome)
    }

    fn answer(question: Question, causes: &[Cause]) -> Answer {
        let text = r#"{"corpus": "mine", "question": "null", "exempt": ["interval_error"]}"#;
        let answer: Answer = serde_json::from_str(text).expect("an answer");
        Answer { question, causes: causes.to_vec(), ..answer }
    }

    fn found(names: &[&[&str]]) -> Outcome {
        let finding = |names: &&[&str]| Finding {
            names: names.iter().map(|name| (*name).to_owned()).collect(),
            parameters: [("gap_m".to_owned(), Stated { value: 3e-3, sigma: Some(1e-4) })].into(),
        };
        let none = Outcome::read("log", b"{}", 1.0).expect("JSON");
        Outcome { findings: names.iter().map(finding).collect(), ..none }
    }

    fn backlash() -> Cause {
        let right = vec!["backlash".to_owned()];
        let sizes = [("gap_m".to_owned(), 3.1e-3)].into();
        Cause { right, is_plain: true, sizes, ..Cause::default() }
    }

    #[test]
    fn ordinary_findings_count_nowhere_and_a_cause_is_never_ordinary() {
        let null = answer(Question::Null, &[]);
        assert_eq!(score("nulls_with_finding", &null, &found(&[&["interval_error"]])), Some(0.0));
        assert_eq!(score("nulls_with_finding", &null, &found(&[&["interval_error"], &["bumps"]])), Some(1.0));
        let cause = Cause { right: vec!["interval_error".to_owned()], is_plain: true, ..Cause::default() };
        assert_eq!(score("detected", &answer(Question::One, &[cause]), &found(&[&["interval_error"]])), Some(1.0));
    }

    #[test]
    fn a_first_cause_is_asked_where_something_is_found_and_no_alias_is() {
        let plain = answer(Question::One, &[backlash()]);
        assert_eq!(score("first_cause", &plain, &found(&[])), None);
        assert_eq!(score("first_cause", &plain, &found(&[&["bumps", "backlash"]])), Some(0.0));
        assert_eq!(score("first_cause", &plain, &found(&[&["backlash"]])), Some(1.0));
        let aliased = answer(Question::One, &[Cause { is_aliased: true, ..backlash() }]);
        assert_eq!(score("first_cause", &aliased, &found(&[&["backlash"]])), None);
        assert_eq!(score("in_set", &aliased, &found(&[&["bumps", "backlash"]])), Some(1.0));
    }

    #[test]
    fn what_is_left_out_has_no_name_or_an_alias() {
        let left_out = answer(Question::LeftOut, &[Cause { aliases: vec!["bumps".to_owned()], ..backlash() }]);
        assert_eq!(score("left_out", &left_out, &found(&[&["unlisted", "toe"]])), Some(1.0));
        assert_eq!(score("left_out", &left_out, &found(&[&["bumps"]])), Some(1.0));
        assert_eq!(score("left_out", &left_out, &found(&[&["unlisted"], &["toe"]])), Some(0.0));
    }

    #[test]
    fn sizes_cover_by_1_96_standard_deviations() {
        let plain = answer(Question::One, &[backlash()]);
        assert_eq!(score("covered", &plain, &found(&[&["backlash"]])), Some(1.0));
        let far = Cause { sizes: [("gap_m".to_owned(), 3.3e-3)].into(), ..backlash() };
        assert_eq!(score("covered", &answer(Question::One, &[far]), &found(&[&["backlash"]])), Some(0.0));
        assert_eq!(score("covered", &plain, &found(&[&["bumps"]])), None);
    }

    #[test]
    fn an_extended_model_does_harm_by_a_tenth_of_the_drift() {
        let of = |calibrated: f64, extended: f64| {
            let drift_percent = Some(Drift { configured: 1.0, calibrated, extended });
            score("harm_elsewhere", &answer(Question::Null, &[]), &Outcome { drift_percent, ..found(&[]) })
        };
        assert_eq!(
            [of(0.5, 0.5), of(0.5, 0.54), of(0.5, 0.56), of(0.01, 0.019)],
            [None, Some(0.0), Some(1.0), Some(0.0)]
        );
    }
}
