//! Checks of a log before anything is fitted: what is wrong with it, or would make a calibration wrong, and
//! what mends it; and the values that a fit starts from.
//!
//! The motion of the robot in short windows by its wheels is compared with that by the instrument. A
//! regression of one on the other needs no nominal value: its residual says whether clocks, headings and axes
//! are right, its four coefficients say which wheel is which, which way it counts and in which unit. A fault
//! is said where the records with it undone fit decisively better, and where a check cannot be made it is
//! silent.

mod alignment;
mod clock;
mod driven;
mod gain_change;
mod geometry_estimate;
#[cfg(test)]
mod golden;
mod kind;
mod problem;
mod problems;
mod record_fault;
mod regression;
mod run_log;
mod session_check;
pub mod settings;
mod shown_numbers;
mod stages;
mod start_values;
mod text;
mod windows;

use std::collections::{BTreeMap, BTreeSet};

use dataset::Dataset;
use kind::Kind;
use rayon::prelude::*;

pub use clock::{Clock, ClockDrift, ClockOffset, ClockOffsets, ClockSearch, SessionClock};
pub use driven::Driven;
pub use problem::{Problem, Severity};
pub use problems::remedies::{Remedy, WouldDetermine};
use session_check::SessionCheck;
pub use start_values::{DriveStart, StartValues};

/// What was found of one robot's datasets.
#[derive(Debug, Clone, PartialEq)]
pub struct Preflight {
    /// The worst first.
    pub problems: Vec<Problem>,
    /// Which parameters of the drive these runs determine.
    pub determined: BTreeMap<&'static str, bool>,
    /// What would determine the others, beside the same drives; empty where a problem is an error.
    pub would_determine: Vec<WouldDetermine>,
}

impl Preflight {
    /// Whether no problem is an error.
    #[must_use]
    pub fn is_ok(&self) -> bool {
        self.problems.iter().all(|problem| problem.severity != Severity::Error)
    }
}

impl Preflight {
    /// Takes what a fit says of the parameters that the runs determine in the place of what windows say;
    /// `open` names the others, each with the reason.
    pub fn settle(&mut self, open: &BTreeMap<&'static str, String>) {
        self.problems.retain(|problem| problem.id != NOT_DETERMINED);
        self.determined.iter_mut().for_each(|(name, is)| *is = !open.contains_key(name));
        self.would_determine.retain(|would| open.contains_key(would.parameter));
        let reasons: BTreeSet<&String> = open.values().collect();
        for why in reasons {
            let parameters = open.iter().filter(|(_, of)| *of == why).map(|(name, _)| *name).collect();
            let kind = Kind::NotDetermined { parameters, why: why.clone() };
            self.problems.push(Problem::new(&kind, Severity::Warning, None, 0.95));
        }
        self.problems.sort_by_key(|problem| problem.severity);
    }
}

/// The id of the problem that parameters are open.
pub const NOT_DETERMINED: &str = "not_determined";

/// Checks one robot's sessions.
#[must_use]
pub fn check(datasets: &[Dataset]) -> Preflight {
    let sessions: Vec<SessionCheck> = datasets.par_iter().map(stages::checked).collect();
    let mut problems: Vec<Problem> = problems::several_robots::found(&sessions).into_iter().collect();
    for session in &sessions {
        for problem in &session.problems {
            // The same of several sessions is said once.
            let mut problem = problem.clone();
            if sessions.len() > 1 && problem.runs.is_none() {
                problem.sentence = format!("{}: {}", session.name, problem.sentence);
            }
            problems.push(problem);
        }
    }
    let coverage = problems::coverage::Coverage::of(&sessions);
    let determined = problems::coverage::determined(&coverage, &mut problems);
    problems.sort_by_key(|problem| problem.severity);
    let mut found = Preflight { problems, determined, would_determine: Vec::new() };
    if found.is_ok() {
        found.would_determine = problems::remedies::found(&sessions, &coverage);
    }
    found
}
