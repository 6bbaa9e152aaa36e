//! What came of a case: what was found, and what the planned run made of it.

use dataset::{Number, Share, checked};
use diagnose::Document;
use effects::OrdinaryCondition;

use super::case::Case;
use super::case_kind::CaseKind;
use super::hidden::EffectKind;
use super::instrument::{NoiseClass, TruthKind};
use super::oracle_view::OracleView;
use super::robot::PathFamily;
use super::strata::{DrawnConditions, Strata};

/// One finding, as far as it is scored.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Reported {
    /// Its names, most probable first.
    pub names: Vec<String>,
    /// Stated probability of the first name.
    #[serde(deserialize_with = "checked::<Share, _>")]
    pub probability: f64,
    /// Its z.
    #[serde(deserialize_with = "checked::<Number, _>")]
    pub z: f64,
    /// Where the first name is right and of the catalogue's form: for each size, whether its stated 95 %
    /// interval holds the truth.
    pub covered: Vec<bool>,
    /// The same estimates' errors over their stated standard deviations.
    #[serde(deserialize_with = "checked::<Vec<Number>, _>")]
    pub errors: Vec<f64>,
    /// Its sentence.
    pub sentence: String,
}

/// What the case was and what came of it.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct CaseResult {
    /// The case's number: with the seed, all that it takes to drive it again.
    pub case: u64,
    /// What was asked.
    #[serde(rename = "round")]
    pub case_kind: CaseKind,
    /// What was driven.
    pub paths: PathFamily,
    /// What the instrument showed.
    pub truth: TruthKind,
    /// What the measurements err by.
    pub noise: NoiseClass,
    /// What the robot and its records are like.
    pub strata: Strata,
    /// The numbers behind the strata.
    pub drawn: DrawnConditions,
    /// Robots that were drawn before this one whose encoder does not resolve what is hidden.
    pub unresolved_robots: usize,
    /// Sessions, runs and measurements.
    pub counts: [usize; 3],
    /// What was hidden, as the oracle sees it.
    pub hidden: Vec<OracleView>,
    /// What was found.
    #[serde(rename = "said")]
    pub reported: Vec<Reported>,
    /// What was found in the same log cut into runs, where that was asked.
    #[serde(rename = "said_of_cut", default, skip_serializing_if = "Option::is_none")]
    pub reported_of_cut: Option<Vec<Reported>>,
    /// Checks that failed at the end.
    pub failed_checks: Vec<String>,
    /// Why there is no diagnosis.
    pub refused: Option<String>,
    /// Whether the mean was extended.
    pub extended: bool,
    /// Gain in log score on the held-out log: of the tool, and of who knows the true term.
    #[serde(default, deserialize_with = "checked::<Option<[Number; 2]>, _>")]
    pub gain: Option<[f64; 2]>,
    /// Of an extended model on a session of other paths, speed and acceleration: its gain in log score over
    /// the calibration alone, over the standard deviation that errors of measurements give the gain.
    #[serde(default, deserialize_with = "checked::<Option<Number>, _>")]
    pub other_session: Option<f64>,
    /// Where its effect was found among several names: what the planned run made of them.
    pub planned: Option<Planned>,
}

impl CaseResult {
    /// Findings that are right in the case's conditions.
    #[must_use]
    pub fn right_findings(&self) -> Vec<&'static str> {
        self.strata.ordinary_conditions(self.noise).flat_map(OrdinaryCondition::right_findings).collect()
    }

    /// Whether no finding is right in the case's conditions but for what is hidden.
    pub(crate) fn has_ordinary_records(&self) -> bool {
        self.right_findings().is_empty()
    }

    /// The findings that are not right anyway in the case's conditions.
    pub fn findings(&self) -> impl Iterator<Item = &Reported> {
        self.not_exempt(&self.reported)
    }

    /// The same of the log cut into runs; none where that was not asked.
    pub(crate) fn findings_of_cut(&self) -> impl Iterator<Item = &Reported> {
        self.not_exempt(self.reported_of_cut.as_deref().unwrap_or_default())
    }

    fn not_exempt<'a>(&'a self, all: &'a [Reported]) -> impl Iterator<Item = &'a Reported> {
        let right = self.right_findings();
        let hidden = |name: &str| self.hidden.iter().any(|hidden| hidden.id == name);
        all.iter()
            .filter(move |reported| !reported.names.iter().any(|name| right.contains(&name.as_str()) && !hidden(name)))
    }

    /// The ratio of a single mean that the encoder resolves.
    pub(crate) fn resolved_mean(&self) -> Option<f64> {
        let hidden = self.hidden.first().filter(|_| self.case_kind == CaseKind::Single)?;
        hidden.ratio.filter(|_| hidden.kind == EffectKind::Mean && hidden.is_resolved())
    }

    /// Whether the case hides a single mean that the encoder resolves and that must be detected.
    #[must_use]
    pub fn is_plain(&self) -> bool {
        self.resolved_mean().is_some() && self.hidden[0].is_plain()
    }

    /// Every stratum with the case's level, by the words of JSON; paths, truth and noise among them.
    #[must_use]
    pub fn levels(&self) -> Vec<(String, String)> {
        let mut levels: Vec<(String, String)> = Vec::new();
        if let Ok(serde_json::Value::Object(strata)) = serde_json::to_value(self.strata) {
            levels
                .extend(strata.into_iter().filter_map(|(stratum, level)| Some((stratum, level.as_str()?.to_owned()))));
        }
        let words = [
            ("paths", serde_json::to_value(self.paths)),
            ("truth", serde_json::to_value(self.truth)),
            ("noise", serde_json::to_value(self.noise)),
        ];
        for (stratum, level) in words {
            levels.extend(level.ok().and_then(|level| Some((stratum.to_owned(), level.as_str()?.to_owned()))));
        }
        levels
    }

    /// What was said of it, in short.
    pub(crate) fn verdict(&self) -> String {
        if self.refused.is_some() {
            return "refused".to_owned();
        }
        let names: Vec<String> = self.findings().map(|reported| reported.names.join("|")).collect();
        if names.is_empty() { "nothing".to_owned() } else { names.join(" + ") }
    }
}

/// What came of the planned run of a case whose one mean effect was found among several names.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Planned {
    /// The set before.
    pub names: Vec<String>,
    /// Whether there was a plan that discriminates the candidates.
    pub planned: bool,
    /// Whether the oracle tells the right name from all others of the set after the planned runs.
    #[serde(rename = "told_by_plan")]
    pub resolved_by_plan: bool,
    /// The same after the battery.
    #[serde(rename = "told_by_battery")]
    pub resolved_by_battery: bool,
    /// What was found after the planned runs.
    #[serde(rename = "said")]
    pub reported: Vec<Reported>,
}

impl Planned {
    /// Whether somebody could have driven what tells.
    #[must_use]
    pub fn is_resolvable(&self) -> bool {
        self.resolved_by_plan || self.resolved_by_battery
    }
}

/// A diagnosis' findings, as far as they are scored.
pub(crate) fn reported(document: &Document, case: &Case) -> Vec<Reported> {
    document
        .findings
        .iter()
        .map(|finding| {
            let hidden = case.hidden.iter().find(|hidden| hidden.id == finding.id);
            let exact = hidden.filter(|hidden| hidden.kind == EffectKind::Mean && !hidden.other_form);
            let errors: Vec<f64> = exact.map_or_else(Vec::new, |hidden| {
                hidden
                    .values()
                    .iter()
                    .filter_map(|(name, truth)| {
                        let value = finding.parameters.get(*name)?;
                        Some((value.value - truth) / value.sigma?)
                    })
                    .collect()
            });
            Reported {
                names: finding.names.clone(),
                probability: finding.probability,
                z: finding.z,
                covered: errors.iter().map(|error| error.abs() < 1.96).collect(),
                errors,
                sentence: finding.sentence.clone(),
            }
        })
        .collect()
}
