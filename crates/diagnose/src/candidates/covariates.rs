//! Covariates that depend on the records: those of runs, and cycles of a wheel's turn.

use crate::settings::SEARCH;
use effects::{Channel, Covariate, Sparse};
use estimation::ModelFit;
use kinematics::Side;

/// The covariates of runs that differ between runs.
pub(crate) fn of_runs(fit: &ModelFit<'_>) -> Vec<Covariate> {
    let segments = &fit.records.segments;
    let mut keys: Vec<&String> = segments.iter().flat_map(|segment| segment.info.covariates.keys()).collect();
    keys.sort();
    keys.dedup();
    keys.into_iter().filter_map(|key| Covariate::of_run(key, &values_of_runs(fit, key))).collect()
}

/// What each run says of a covariate, 0 where it says nothing.
pub(crate) fn values_of_runs(fit: &ModelFit<'_>, key: &str) -> Vec<f64> {
    let runs = fit.records.segments.chunk_by(|a, b| a.run == b.run);
    runs.map(|segments| segments[0].info.covariates.get(key).copied().unwrap_or(0.0)).collect()
}

/// What a wheel may do several times in each turn.
pub(crate) fn of_cycles(side: Side) -> Vec<Sparse> {
    let channel = if side == Side::Left { Channel::LeftWheel } else { Channel::RightWheel };
    let phases = |cycles| [Covariate::CosPhase(side, cycles), Covariate::SinPhase(side, cycles)];
    SEARCH.wheel_cycles.into_iter().flat_map(phases).map(|phase| Sparse { channel, covariates: vec![phase] }).collect()
}
