//! What an extended model gains where its effects, too, were chosen without what it is measured on: each
//! session, and each kind of path, is left out of a whole diagnosis in turn.
//!
//! Gains of a model whose effects were chosen with all runs are too good, as the choice has seen what is
//! held out (Varma and Simon 2006). Where a diagnosis adds nothing, its model is the calibration, and gains
//! nothing: such units abstain.

use calib::{AugmentedCalibration, EvaluationOptions, evaluate_runs};
use dataset::Dataset;
use estimation::{EndError, FitSettings};
use kinematics::Pose;

use crate::carry_over::{Level, Units};
use crate::diagnosis::{DiagnoseError, diagnose};
use crate::document::{Compared, GainLevel, HeldOutUnit, NestedGain};
use crate::fits::augmented_model::AugmentedModel;
use crate::gain::extended_model::ExtendedModel;
use crate::gain::{HeldOut, drift};
use crate::options::Options;
use crate::records::names::session_names;
use crate::records::record_faults::sessions;
use crate::report::Diagnosis;

/// The gains with whole kinds of path and whole sessions left out of the diagnosis, where there are several.
/// A diagnosis each costs as much as that of all data.
///
/// # Errors
/// [`DiagnoseError`] when no calibrated model can be fitted to all runs, whose paths then have no kinds, or
/// an id is unknown.
pub fn nested_gains(datasets: &[Dataset], options: &Options) -> Result<Vec<NestedGain>, DiagnoseError> {
    let fit = FitSettings::GEOMETRY_ONLY.fit(&sessions(datasets))?;
    let (model, names) = (AugmentedModel::base(&fit), session_names(datasets));
    let levels = [(Level::Kind, GainLevel::Kinds), (Level::Session, GainLevel::Sessions)];
    let units = levels.map(|(of, level)| (level, Units::of(&model, &names, of)));
    drop((model, fit));
    units
        .iter()
        .filter(|(_, units)| units.names.len() > 1)
        .map(|(level, units)| of_level(datasets, units, *level, options))
        .collect()
}

/// EndErrors of the held-out runs under the calibration alone, and under the model that is handed on.
type EndErrors = (Vec<EndError>, Vec<EndError>);

fn of_level(
    datasets: &[Dataset],
    units: &Units,
    level: GainLevel,
    options: &Options,
) -> Result<NestedGain, DiagnoseError> {
    let options = Options { limits: None, ..options.clone() };
    let (mut all, mut held_out): (EndErrors, Vec<HeldOutUnit>) = (EndErrors::default(), Vec::new());
    for (number, name) in units.names.iter().enumerate() {
        let unit = HeldOutUnit { unit: name.clone(), found: None, why_null: None, final_position_m: None };
        let sessions = datasets.iter().enumerate();
        let rest: Vec<Dataset> =
            sessions.filter_map(|(session, of)| Some(part(session, of, units, number, false)?.1)).collect();
        held_out.push(match diagnose(&rest, &options) {
            Err(error @ DiagnoseError::UnknownEffect { .. }) => return Err(error),
            Err(error) => HeldOutUnit { why_null: Some(error.to_string()), ..unit },
            Ok(diagnosis) => match end_errors(datasets, units, number, &diagnosis) {
                Err(why) => HeldOutUnit { why_null: Some(why), ..unit },
                Ok((found, (before, after))) => {
                    let final_position_m = final_position(&before, &after);
                    all.0.extend(before);
                    all.1.extend(after);
                    HeldOutUnit { found: Some(found), final_position_m, ..unit }
                }
            },
        });
    }
    let abstained = held_out.iter().filter(|unit| unit.found.as_ref().is_some_and(Vec::is_empty)).count();
    Ok(NestedGain {
        level,
        units: held_out.iter().filter(|unit| unit.found.is_some()).count(),
        abstained,
        drift_percent: drift(&all.0, &all.1, HeldOut::Units(units)),
        held_out,
    })
}

/// Mean final position errors of runs under both models.
fn final_position(before: &[EndError], after: &[EndError]) -> Option<Compared> {
    let gains: Vec<(f64, f64)> =
        before.iter().zip(after).map(|(before, after)| (before.position_m - after.position_m, 1.0)).collect();
    let mean = |ends: &[EndError]| ends.iter().map(|end| end.position_m).sum::<f64>() / ends.len() as f64;
    (gains.len() > 1).then(|| Compared::of_ratio(mean(before), mean(after), &gains))
}

/// The runs of a session that are of a unit, or those that are not: their numbers, and a dataset of them.
/// `None` where there is none.
fn part(
    session: usize,
    dataset: &Dataset,
    units: &Units,
    unit: usize,
    is_of_unit: bool,
) -> Option<(Vec<usize>, Dataset)> {
    let is_in = |run: &usize| (units.of_run.get(&(session, *run)) == Some(&unit)) == is_of_unit;
    let numbers: Vec<usize> = (0..dataset.runs.len()).filter(is_in).collect();
    let runs = numbers.iter().map(|run| dataset.runs[*run].clone()).collect();
    (!numbers.is_empty()).then(|| (numbers, Dataset { runs, ..dataset.header() }))
}

/// The effects of the model that the others' diagnosis hands on, and the ends of a unit's runs. Faults of the
/// records are undone for both models.
fn end_errors(
    datasets: &[Dataset],
    units: &Units,
    unit: usize,
    diagnosis: &Diagnosis,
) -> Result<(Vec<String>, EndErrors), String> {
    let scenario = diagnosis.extended.as_ref().map_err(Clone::clone)?;
    let model = ExtendedModel::of(scenario).map_err(|error| error.to_string())?;
    let plain = diagnosis.base.calibrations().into_iter().next().ok_or("the other runs have no calibration")?;
    let plain = AugmentedCalibration::from(plain);
    let of_mean = model.effects.iter().filter(|effect| !effect.terms.is_empty());
    let found: Vec<String> = of_mean.map(|effect| effect.id.to_owned()).collect();
    // A calibration that was fitted beside nothing is that of the base.
    let extended = if found.is_empty() { &plain } else { &model.calibration };
    let (mut before, mut after) = EndErrors::default();
    for (session, dataset) in datasets.iter().enumerate() {
        let Some((held, records)) = part(session, dataset, units, unit, true) else { continue };
        let (records, _) = model.undone(&records).map_err(|error| error.to_string())?;
        for (calibration, ends) in [(&plain, &mut before), (extended, &mut after)] {
            let runs = evaluate_runs(&records.session(), Some(calibration), &EvaluationOptions::default(), &mut 0.0);
            ends.extend(runs.iter().zip(&held).filter_map(|(drift, run)| {
                let position_m = drift.final_position_m?;
                let heading_rad = drift.final_heading_rad.unwrap_or_default();
                let end = EndError {
                    run: (session, *run),
                    position_m,
                    heading_rad,
                    length_m: drift.length_m,
                    off: Pose::IDENTITY,
                };
                Some(end)
            }));
        }
    }
    if before.is_empty() {
        return Err("its runs have no positions to be held against".to_owned());
    }
    Ok((found, (before, after)))
}
