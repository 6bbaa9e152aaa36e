//! A diagnosis held against what was hidden.

use dataset::Dataset;
use diagnose::{Diagnosis, Options, Verdict, diagnose};
use effects::{Hypothesis, Variant, hypothesis};
use estimation::Model;
use kinematics::DriveGeometry;

use super::case::Case;
use super::case_kind::CaseKind;
use super::hidden::{EffectKind, kind_of};
use super::oracle::{gain_of_terms, misfit, misfit_of_form};
use super::planned::planned;
use super::result::{CaseResult, reported};
use super::strata::strata;
use crate::error::ChallengeError;
use crate::scope::Scope;

/// Diagnoses a case and scores it.
pub(crate) fn score(number: u64, case: &Case, scope: Scope) -> Result<CaseResult, ChallengeError> {
    let without = match case.case_kind {
        CaseKind::LeftOut => case.hidden.iter().map(|hidden| hidden.id.to_owned()).collect(),
        _ => Vec::new(),
    };
    let diagnosed = diagnose(&case.datasets, &Options { without, limits: None, ..Options::default() });
    let mut result = undiagnosed(number, case);
    if scope == Scope::OneLog {
        let of_cut = diagnose(&case.cut(), &Options { limits: None, ..Options::default() });
        let of_cut = of_cut.map_or_else(|_| Vec::new(), |diagnosis| reported(&diagnosis.document, case));
        result.reported_of_cut = Some(of_cut);
    }
    match diagnosed {
        Ok(diagnosis) => {
            result.reported = reported(&diagnosis.document, case);
            let failed = diagnosis.document.checks.iter().filter(|check| !check.passes);
            result.failed_checks = failed.map(|check| check.name.clone()).collect();
            result.extended = !diagnosis.found.terms().is_empty();
            debug_assert_eq!(diagnosis.document.verdict == Verdict::Consistent, result.reported.is_empty());
            if scope != Scope::Whole {
                return Ok(result);
            }
            result.gain = gain(case, Some(&diagnosis))?;
            result.other_session = other_session(case, &diagnosis)?;
            if case.case_kind == CaseKind::Single {
                result.planned = planned(case, &result)?;
            }
        }
        Err(error) => {
            result.refused = Some(error.to_string());
            result.gain = if scope == Scope::Whole { gain(case, None)? } else { None };
        }
    }
    Ok(result)
}

/// What is true of a case, before anything is said of it.
pub(crate) fn undiagnosed(number: u64, case: &Case) -> CaseResult {
    let counts = [
        case.datasets.len(),
        case.datasets.iter().map(|dataset| dataset.runs.len()).sum(),
        case.datasets
            .iter()
            .flat_map(|dataset| &dataset.runs)
            .map(|run| run.truth.len() + run.displacements.len())
            .sum(),
    ];
    let (strata, drawn) = strata(case);
    CaseResult {
        case: number,
        case_kind: case.case_kind,
        paths: case.robot.family,
        truth: case.instrument_model.kind,
        noise: case.instrument_model.class,
        strata,
        drawn,
        unresolved_robots: case.unresolved_robots,
        counts,
        hidden: case.oracle.clone(),
        reported: Vec::new(),
        reported_of_cut: None,
        failed_checks: Vec::new(),
        refused: None,
        extended: false,
        gain: None,
        other_session: None,
        planned: None,
    }
}

/// What the tool's model gains on the held-out log over its calibration without what it found, and what the
/// true terms gain there over the best calibration without the effect: all of it but the random part of an
/// effect, which nobody can know before. Both models of the tool have the errors of one calibration from the
/// same data; what it gains is no more than what can be gained. Measurements without error: on average over
/// their errors the log score differs by these. Only means gain. A tool that says nothing gains nothing. The
/// held-out log has one clock and true stamps, so that a model which rightly has a latency or a drift would
/// lose there: such cases gain nothing.
fn gain(case: &Case, diagnosis: Option<&Diagnosis>) -> Result<Option<[f64; 2]>, ChallengeError> {
    let mean = case.oracle.iter().all(|hidden| kind_of(&hidden.id) == Some(EffectKind::Mean));
    let (Some((held_out, plain)), Some(best), Some(truth)) = (&case.held_out, &case.best_drive, case.truth()) else {
        return Ok(None);
    };
    if case.oracle.is_empty() || !mean || case.conditions.has_clock_offset() {
        return Ok(None);
    }
    let held_out = std::slice::from_ref(held_out);
    let floor = misfit(std::slice::from_ref(plain), &Model::of(&truth, 0), case.noise, &mut []);
    let base = misfit(held_out, best, case.noise, &mut []);
    let possible = base - floor - left_to_chance(case, &truth, floor);
    let extended = diagnosis.filter(|diagnosis| !diagnosis.found.terms().is_empty());
    let found = extended.map_or(0.0, |diagnosis| {
        let own = misfit(held_out, &diagnosis.calibrated.model, case.noise, &mut []);
        let gained = own - misfit(held_out, &diagnosis.found.model, case.noise, &mut diagnosis.found.terms());
        gained.min(possible)
    });
    Ok(Some([found, possible]))
}

/// What the model that is handed on gains on a session of other paths over the calibration alone, over its
/// standard deviation. As for [`gain`], records there are sound: cases with other clocks tell nothing.
fn other_session(case: &Case, diagnosis: &Diagnosis) -> Result<Option<f64>, ChallengeError> {
    let mut terms = diagnosis.carried.terms();
    if terms.is_empty() || case.conditions.has_clock_offset() {
        return Ok(None);
    }
    let (plain, extended) = (&diagnosis.calibrated.model, &diagnosis.carried.model);
    let gain = gain_of_terms(&case.drive_elsewhere()?, case.noise, plain, extended, &mut terms);
    Ok(gain.map(|(gain, sigma)| gain / sigma))
}

/// What is left of the effects with a random signature, each alone, with its own term and the geometry
/// parameters at the sizes and in the shape that leave least.
fn left_to_chance(case: &Case, truth: &DriveGeometry, floor: f64) -> f64 {
    let left = |(place, log): &(usize, Dataset)| {
        let hidden = &case.hidden[*place];
        let of_shape = |variant: Variant| {
            let model = Model { term_values: hidden.term_values(&*variant.term), ..Model::of(truth, 0) };
            misfit_of_form(std::slice::from_ref(log), &model, case.noise, &mut [variant.term])
        };
        let variants = hypothesis(hidden.id).and_then(Hypothesis::into_variants)?;
        Some((variants.into_iter().map(of_shape).fold(f64::INFINITY, f64::min) - floor).max(0.0))
    };
    case.held_out_random.iter().filter_map(left).sum()
}
