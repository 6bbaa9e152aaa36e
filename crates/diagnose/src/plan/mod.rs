//! The next experiment: what to drive to discriminate causes, or to reveal what is not detectable yet,
//! and what each name predicts before it is driven.
//!
//! Runs along drivable programs are made up from the fitted model; their information, which needs no
//! measured values, joins that of the data. The manoeuvre that needs the least time wins. Nothing here is
//! simulated, and no hidden truth is read.

mod constraints;
mod coverage;
mod discriminate;
mod manoeuvres;
mod predict;
mod rival_odds;
mod text;

use dataset::Dataset;
use estimation::ModelFit;

use crate::candidates::candidate::Candidate;
use crate::document::{Blind, NextExperiment};
use crate::fits::augmented_model::AugmentedModel;
use crate::search::selection::SearchResult;

pub use crate::settings::plan::{HANDLING_S, MINUTES};
use constraints::Setting;
pub use constraints::{Limits, moved_over_m};
pub use coverage::{PlanError, ScenarioPlan, plan_scenario};
use manoeuvres::library;

/// What to drive to discriminate the causes of the first finding that has several, or else to see what would
/// not have shown; or why there is nothing to drive.
pub(crate) fn next_experiment(
    datasets: &[Dataset],
    base: &ModelFit<'_>,
    found: &SearchResult<'_>,
    model: &AugmentedModel<'_>,
    catalogue: &[Candidate],
    detectability: &[Blind],
    limits: &Limits,
) -> Result<NextExperiment, String> {
    let setting = Setting::of_data(datasets, model, limits).ok_or("there is no dataset")?;
    if setting.free_m.iter().any(|side_m| *side_m <= 0.0) && limits.room_m.is_some() {
        return Err("the room leaves the robot no space to move".to_owned());
    }
    let manoeuvres = library(&setting);
    if manoeuvres.is_empty() {
        return Err(format!("no run fits {}", setting.within));
    }
    let mut why = None;
    for index in (0..found.names.len()).filter(|index| found.names[*index].len() > 1) {
        match discriminate::discriminate(base, found, index, &setting, &manoeuvres) {
            Ok(next) => return Ok(next),
            Err(reason) => why = Some(reason),
        }
    }
    match (why, detectability) {
        (Some(why), _) => Err(why),
        (None, []) => {
            Err("no cause is left to be discriminated, and every effect of the catalogue is detectable".to_owned())
        }
        (None, detectability) => coverage::show(model, catalogue, detectability, &setting, &manoeuvres),
    }
}
