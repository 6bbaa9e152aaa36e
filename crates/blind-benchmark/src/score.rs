//! A diagnosis held against what was hidden.

use dataset::Dataset;
use diagnose::{Diagnosis, Document, Options, Verdict, diagnose};
use effects::{Hypothesis, Variant, hypothesis};
use estimation::Model;
use kinematics::DriveGeometry;

use super::case::{Case, CaseKind, OracleView};
use super::hidden::{EffectKind, kind_of};
use super::instrument::{NoiseClass, TruthKind};
use super::oracle::{misfit, misfit_of_form};
use super::planned::{Planned, planned};
use super::robot::PathFamily;
use crate::error::ChallengeError;

/// One finding, as far as it is scored.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Reported {
    /// Its names, most probable first.
    pub names: Vec<String>,
    /// Stated probability of the first name.
    pub probability: f64,
    /// Its z.
    pub z: f64,
    /// Where the first name is right and of the catalogue's form: for each size, whether its stated 95 % interval holds the truth.
    pub covered: Vec<bool>,
    /// Its sentence.
    pub sentence: String,
}

/// What the case was and what came of it.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct CaseResult {
    /// The case's number: with the seed, all that it takes to drive it again.
    pub case: u64,
    /// What was asked.
    pub round: CaseKind,
    /// What was driven.
    pub paths: PathFamily,
    /// What the instrument showed.
    pub truth: TruthKind,
    /// What the measurements err by.
    pub noise: NoiseClass,
    /// Sessions, runs and measurements.
    pub counts: [usize; 3],
    /// What was hidden, as the oracle sees it.
    pub hidden: Vec<OracleView>,
    /// What was found.
    pub said: Vec<Reported>,
    /// Checks that failed at the end.
    pub failed_checks: Vec<String>,
    /// Why there is no diagnosis.
    pub refused: Option<String>,
    /// Whether the mean was extended.
    pub extended: bool,
    /// Gain in log score on the held-out log: of the tool, and of who knows the true term.
    pub gain: Option<[f64; 2]>,
    /// Where its effect was found among several names: what the planned run made of them.
    pub planned: Option<Planned>,
}

impl CaseResult {
    /// The findings that are not right anyway because of what the measurements err by.
    pub(crate) fn findings(&self) -> impl Iterator<Item = &Reported> {
        let right = self.noise.right_answers();
        let hidden = |name: &str| self.hidden.iter().any(|hidden| hidden.id == name);
        self.said
            .iter()
            .filter(move |said| !said.names.iter().any(|name| right.contains(&name.as_str()) && !hidden(name)))
    }

    /// What was said of it, in short.
    pub(crate) fn verdict(&self) -> String {
        if self.refused.is_some() {
            return "refused".to_owned();
        }
        let names: Vec<String> = self.findings().map(|said| said.names.join("|")).collect();
        if names.is_empty() { "nothing".to_owned() } else { names.join(" + ") }
    }
}

/// Diagnoses a case and scores it.
pub(crate) fn score(number: u64, case: &Case) -> Result<CaseResult, ChallengeError> {
    let without = match case.round {
        CaseKind::LeftOut => case.hidden.iter().map(|hidden| hidden.id.to_owned()).collect(),
        _ => Vec::new(),
    };
    let diagnosed = diagnose(&case.datasets, &Options { without });
    let counts = [
        case.datasets.len(),
        case.datasets.iter().map(|dataset| dataset.runs.len()).sum(),
        case.datasets
            .iter()
            .flat_map(|dataset| &dataset.runs)
            .map(|run| run.truth.len() + run.displacements.len())
            .sum(),
    ];
    let mut result = CaseResult {
        case: number,
        round: case.round,
        paths: case.robot.family,
        truth: case.instrument_model.kind,
        noise: case.instrument_model.class,
        counts,
        hidden: case.oracle.clone(),
        said: Vec::new(),
        failed_checks: Vec::new(),
        refused: None,
        extended: false,
        gain: None,
        planned: None,
    };
    match diagnosed {
        Ok(diagnosis) => {
            result.said = said(&diagnosis.document, case);
            let failed = diagnosis.document.checks.iter().filter(|check| !check.passes);
            result.failed_checks = failed.map(|check| check.name.clone()).collect();
            result.extended = !diagnosis.found.terms().is_empty();
            debug_assert_eq!(diagnosis.document.verdict == Verdict::Consistent, result.said.is_empty());
            result.gain = gain(case, Some(&diagnosis))?;
            if case.round == CaseKind::Single {
                result.planned = planned(case, &result, diagnosis.document.next_experiment.as_ref())?;
            }
        }
        Err(error) => {
            result.refused = Some(error.to_string());
            result.gain = gain(case, None)?;
        }
    }
    Ok(result)
}

pub(crate) fn said(document: &Document, case: &Case) -> Vec<Reported> {
    document
        .findings
        .iter()
        .map(|finding| {
            let hidden = case.hidden.iter().find(|hidden| hidden.id == finding.id);
            let exact = hidden.filter(|hidden| hidden.kind == EffectKind::Mean && !hidden.other_form);
            let covered = exact.map_or_else(Vec::new, |hidden| {
                hidden
                    .sizes()
                    .iter()
                    .filter_map(|(name, truth)| {
                        let value = finding.parameters.get(*name)?;
                        Some((value.value - truth).abs() < 1.96 * value.sigma?)
                    })
                    .collect()
            });
            Reported {
                names: finding.names.clone(),
                probability: finding.probability,
                z: finding.z,
                covered,
                sentence: finding.sentence.clone(),
            }
        })
        .collect()
}

/// What the tool's model gains on the held-out log over the best calibration without the effect, and what the true terms gain there: all of it but what chance makes of
/// an effect, which nobody can know before. Looks without error: on average over their errors the log score differs by these. Only means gain. A tool that says nothing gains nothing: its own base is not held against it.
fn gain(case: &Case, diagnosis: Option<&Diagnosis>) -> Result<Option<[f64; 2]>, ChallengeError> {
    let mean = case.oracle.iter().all(|hidden| kind_of(&hidden.id) == Some(EffectKind::Mean));
    let (Some((held_out, plain)), Some(best), Some(truth)) = (&case.held_out, &case.best_drive, case.truth()) else {
        return Ok(None);
    };
    if case.oracle.is_empty() || !mean {
        return Ok(None);
    }
    let held_out = std::slice::from_ref(held_out);
    let floor = misfit(std::slice::from_ref(plain), &Model::of(&truth, 0), case.noise, &mut []);
    let base = misfit(held_out, best, case.noise, &mut []);
    let possible = base - floor - left_to_chance(case, &truth, floor);
    let extended = diagnosis.filter(|diagnosis| !diagnosis.found.terms().is_empty());
    let found = extended.map_or(0.0, |diagnosis| {
        base - misfit(held_out, &diagnosis.found.model, case.noise, &mut diagnosis.found.terms())
    });
    Ok(Some([found, possible]))
}

/// What is left of the effects in which chance has a part, each alone, with its own term and the geometry parameters at the sizes and in the shape that leave least.
fn left_to_chance(case: &Case, truth: &DriveGeometry, floor: f64) -> f64 {
    let left = |(place, log): &(usize, Dataset)| {
        let hidden = &case.hidden[*place];
        let sizes = hidden.sizes();
        let of = |name: &str| sizes.iter().find(|(own, _)| *own == name).map_or(0.0, |(_, size)| *size);
        let of_shape = |variant: Variant| {
            let mut model = Model::of(truth, 0);
            model.term_values = variant.term.parameters().iter().map(|parameter| of(parameter.name)).collect();
            misfit_of_form(std::slice::from_ref(log), &model, case.noise, &mut [variant.term])
        };
        let variants = hypothesis(hidden.id).and_then(Hypothesis::into_variants)?;
        Some((variants.into_iter().map(of_shape).fold(f64::INFINITY, f64::min) - floor).max(0.0))
    };
    case.held_out_by_chance.iter().filter_map(left).sum()
}
