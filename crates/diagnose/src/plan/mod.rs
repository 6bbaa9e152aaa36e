//! The next experiment: what to drive to tell names apart, or to see what the data could not have shown, and what each name predicts before it is driven.
//!
//! Runs along drivable programs are made up from the fitted model; their information, which needs no measured values, joins that of the data. The manoeuvre
//! that needs the least time wins. Nothing here is simulated, and no hidden truth is read.

mod apart;
mod library;
mod predict;
mod setting;
mod show;
mod weigh;
mod words;

use dataset::Dataset;
use estimation::Evidence;
use estimation::JointFit;
use estimation::total;
use motion_programs::Schedule;

use crate::candidate::{Choice, terms};
use crate::document::{Blind, NextExperiment};
use crate::search::{Extended, Found};

use library::{Manoeuvre, foreseen, library};
use setting::Setting;
pub use setting::{HANDLING_S, Limits, MINUTES, moved_over_m};
pub use show::{PlanError, ScenarioPlan, plan_scenario};

/// Runs of one manoeuvre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Part {
    pub(crate) manoeuvre: Manoeuvre,
    pub(crate) pairs: u32,
}

impl Part {
    pub(crate) fn schedule(&self) -> Schedule {
        self.manoeuvre.schedule.with_pairs(self.pairs)
    }
}

/// What to drive to tell apart the names of the first finding that has several, or else to see what would not have shown; or why there is nothing to drive.
pub(crate) fn next_experiment(
    datasets: &[Dataset],
    (base, found): (&JointFit<'_>, &Found<'_>),
    (model, catalogue, blind): (&Extended<'_>, &[Choice], &[Blind]),
    limits: &Limits,
) -> Result<NextExperiment, String> {
    let setting = Setting::of_data(datasets, model, limits).ok_or("there is no dataset")?;
    if setting.free_m.iter().any(|side_m| *side_m <= 0.0) && limits.room_m.is_some() {
        return Err("the room leaves the robot no way to move".to_owned());
    }
    let manoeuvres = library(&setting);
    if manoeuvres.is_empty() {
        return Err(format!("no run fits {}", setting.within));
    }
    let mut why = None;
    for place in (0..found.names.len()).filter(|place| found.names[*place].len() > 1) {
        match apart::tell_apart(base, found, place, &setting, &manoeuvres) {
            Ok(next) => return Ok(next),
            Err(reason) => why = Some(reason),
        }
    }
    match (why, blind) {
        (Some(why), _) => Err(why),
        (None, []) => {
            Err("no name is left to be told from another, and nothing of the catalogue is out of sight".to_owned())
        }
        (None, blind) => show::show(model, catalogue, blind, &setting, &manoeuvres),
    }
}

/// The evidence of a pair of runs of each manoeuvre for a fit's own terms and some more.
pub(crate) fn evidences(
    fit: &JointFit<'_>,
    all: &[Choice],
    setting: &Setting,
    manoeuvres: &[Manoeuvre],
) -> Vec<(Manoeuvre, Evidence)> {
    manoeuvres
        .iter()
        .filter_map(|manoeuvre| {
            let dataset = foreseen(manoeuvre, setting, &fit.fit.model);
            let foreseen = fit.foreseeing(&[dataset.session()]);
            Some((*manoeuvre, total(&foreseen.scan(&mut terms(all)).runs)?))
        })
        .collect()
}
