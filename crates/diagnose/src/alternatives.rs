//! What else was asked of the data, and why it was not named: the first scan, effect by effect.

use serde::Serialize;

use crate::cause::Cause;
use crate::finding::Finding;
use crate::ranking::tests_in;
use crate::selection::SearchResult;
use crate::settings::levels::{MIN_QUANTILE_P_VALUE, SCAN_LEVEL};
use crate::statistics::z_of_p;

/// An effect of the catalogue beside the calibration alone, before any effect was in the model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Alternative {
    /// The effect.
    pub id: String,
    /// How far out a normal variable of its chance would be, trials of variants paid for.
    pub z: f64,
    /// Log of the chance of the data with the effect over that without; to second order, before any refit.
    pub log_odds: f64,
    /// The same less that of the best.
    pub to_the_best: f64,
    /// What became of it.
    pub fate: Status,
}

/// What became of an alternative.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// The first name of a finding.
    Found,
    /// Among the names of a finding.
    NotToldApart,
    /// It stands out alone, but explains less than what was found, beside which it is not needed.
    ExplainsLess,
    /// It does not stand out.
    DoesNotStandOut,
    /// These data could not show it.
    NotShown,
}

/// The alternatives, most probable first.
pub(crate) fn alternatives(found: &SearchResult<'_>, findings: &[Finding]) -> Vec<Alternative> {
    let entries = &found.first_scan;
    let best = entries.iter().map(|entry| entry.scored.log_odds).fold(0.0, f64::max);
    let tests = tests_in(entries);
    let mut all: Vec<Alternative> = entries
        .iter()
        .map(|entry| {
            let (id, log_odds) = (entry.scored.candidate.id(), entry.scored.log_odds);
            let z = if entry.p_value > MIN_QUANTILE_P_VALUE {
                z_of_p(entry.p_value)
            } else {
                entry.scored.statistic.sqrt()
            };
            let fate = if findings.iter().any(|finding| *finding.first() == Cause::Effect(id)) {
                Status::Found
            } else if findings.iter().any(|finding| finding.names(&Cause::Effect(id))) {
                Status::NotToldApart
            } else if entry.scored.dimensions == 0 {
                Status::NotShown
            } else if entry.p_value * tests > SCAN_LEVEL {
                Status::DoesNotStandOut
            } else {
                Status::ExplainsLess
            };
            Alternative { id: id.to_owned(), z, log_odds, to_the_best: log_odds - best, fate }
        })
        .collect();
    all.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds).then(a.id.cmp(&b.id)));
    all
}
