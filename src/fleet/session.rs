//! One dataset: checked, calibrated, evaluated and diagnosed.

use std::path::Path;

use ::diagnose::Options;
use ::fleet::{ExcessDrift, GeometryEstimate, SessionDrift, SessionFinding, SessionResult};
use calib::methods::joint::{Joint, LargeCalibrationError};
use calib::{CalibrationReport, Method, MethodReport, Names, evaluate, path_kind};
use estimation::refuse_wrapped_counters;

use crate::calibrate::{large_datasets, why_no_result};
use crate::check;
use crate::terminal::folder_name;

/// What a dataset shows, or why it shows nothing.
pub(super) fn analyse(path: &Path, calibrate_only: bool) -> Result<SessionResult, String> {
    let loaded = dataset::read(path).map_err(|error| error.to_string())?;
    let mut remarks: Vec<String> = loaded.warnings.iter().map(ToString::to_string).collect();
    let mut dataset = loaded.dataset;
    dataset.provenance.name.get_or_insert_with(|| folder_name(path));
    let datasets = [dataset];
    let checked = preflight::check(&datasets);
    if let Some(why) = check::why_refused(&checked) {
        return Err(why);
    }
    remarks.extend(check::warnings(&checked));
    let [dataset] = &datasets;
    let sessions = [dataset.session()];
    refuse_wrapped_counters(&sessions).map_err(|error| error.to_string())?;
    // As yair calibrate does it: numbers of one log are the same in both.
    let outcome = match large_datasets(&[path.to_owned()]).map_err(|failure| failure.to_string())? {
        Some(mut blocks) => match Joint::DEFAULT.calibrate_large(&mut blocks, |_, _| ()) {
            Ok(found) => Ok(found),
            Err(LargeCalibrationError::Calib(error)) => Err(error),
            Err(error) => return Err(error.to_string()),
        },
        None => Joint::DEFAULT.calibrate(&sessions),
    };
    let mut report = MethodReport::new(Joint::DEFAULT.name(), &outcome, &dataset.robot);
    report.withhold_undetermined(true);
    let calibration = outcome.map_err(|error| error.to_string())?;
    if let Some(why) = why_no_result(&report) {
        return Err(why);
    }
    let is_determined = |parameter: calib::Parameter| {
        report.parameters.get(parameter.key()).is_some_and(|reported| reported.value.is_some())
    };
    let geometry = GeometryEstimate::of(&calibration, is_determined);
    let named = CalibrationReport {
        dataset: Names::One(sessions[0].name.to_owned()),
        trained_on: Vec::new(),
        methods: vec![report],
    };
    let nominal = evaluate(&sessions, None, false);
    let excess_drift = ExcessDrift::of(&sessions[0], &calibration, &geometry, nominal.drift_percent);
    let calibrated = named.calibrations().pop().map(|calibration| evaluate(&sessions, Some(&calibration), false));
    let drift_percent = SessionDrift {
        nominal: nominal.drift_percent,
        calibrated: calibrated.and_then(|drift| drift.drift_percent),
        why_null: nominal.why_null.filter(|_| nominal.drift_percent.is_none()),
    };
    let findings = if calibrate_only {
        None
    } else {
        let diagnosis = ::diagnose::diagnose(&datasets, &Options::default());
        let found = diagnosis.map_err(|error| format!("it is calibrated and cannot be diagnosed: {error}"))?;
        Some(found.document.findings.into_iter().map(finding).collect())
    };
    Ok(SessionResult {
        robot_id: dataset.provenance.robot_id.clone(),
        recorded: dataset.provenance.recorded,
        nominal: dataset.robot,
        path_kind: path_kind(&sessions[0]),
        runs: dataset.runs.len(),
        drift_percent,
        geometry,
        excess_drift,
        findings,
        remarks,
    })
}

fn finding(found: ::diagnose::Finding) -> SessionFinding {
    let ::diagnose::Finding { id, names, probability, z, sentence, .. } = found;
    SessionFinding { id, names, probability, z, sentence }
}
