//! Checks of logs whose verdict on what the runs determine is that of the fit.

use std::collections::BTreeMap;

use dataset::{Dataset, Session};
use preflight::Preflight;

use crate::estimate::{Calibration, Method, Parameter};
use crate::methods::joint::Joint;
use crate::settings::{MAX_CHECKED_ROWS, MAX_CHECKED_RUNS};

/// The checks of [`preflight::check`], and which parameters `joint` determines: none where its fit gives no
/// result. Where a check finds an error or the datasets are large, what windows say of the parameters stays.
#[must_use]
pub fn check_and_fit(datasets: &[Dataset]) -> Preflight {
    let mut found = preflight::check(datasets);
    let rows: usize = datasets.iter().flat_map(|dataset| &dataset.runs).map(|run| run.odometry.t_s.len()).sum();
    let runs: usize = datasets.iter().map(|dataset| dataset.runs.len()).sum();
    if found.is_ok() && rows <= MAX_CHECKED_ROWS && runs <= MAX_CHECKED_RUNS {
        let sessions: Vec<Session<'_>> = datasets.iter().map(Dataset::session).collect();
        let none = |why: &str| BTreeMap::from(Parameter::LENGTHS.map(|length| (length.key(), why.to_owned())));
        found.settle(&match Joint::DEFAULT.calibrate(&sessions) {
            Ok(calibration) if calibration.converged => open(&calibration),
            Ok(calibration) => {
                let mut settled = none("the fit does not converge: no lengths explain what wheels and instrument say");
                settled.extend(open(&calibration));
                settled
            }
            Err(error) => none(&error.to_string()),
        });
    }
    found
}

/// The lengths that a calibration leaves open, with the reason.
fn open(calibration: &Calibration) -> BTreeMap<&'static str, String> {
    let mut open = BTreeMap::new();
    for blind in &calibration.not_observable {
        let of_all = blind.parameter == Parameter::CommonScale;
        for length in Parameter::LENGTHS.iter().filter(|length| of_all || **length == blind.parameter) {
            open.entry(length.key()).or_insert_with(|| blind.why.to_string());
        }
    }
    open
}
