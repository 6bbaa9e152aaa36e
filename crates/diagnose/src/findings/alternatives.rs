//! The catalogued effects that are not in the model, and why: the first scan, effect by effect.

use serde::Serialize;

use crate::candidates::cause::Cause;
use crate::findings::finding::Finding;
use crate::fits::statistics::z_of_p;
use crate::records::stamp_errors::StampError;
use crate::search::ranking::tests_in;
use crate::search::rivals::Refusal;
use crate::search::selection::SearchResult;
use crate::settings::LEVELS;

/// An effect of the catalogue beside the calibration alone, before any effect was in the model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Alternative {
    /// The effect.
    pub id: String,
    /// Standard normal quantile of its p-value, corrected for the variants tried.
    pub z: f64,
    /// Log Bayes factor of the effect over none; to second order, before any refit.
    pub log_odds: f64,
    /// The same less that of the best, nats: 0 is as probable as the best.
    pub to_the_best: f64,
    /// What became of it.
    #[serde(rename = "fate")]
    pub status: Status,
}

/// What became of an alternative.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// The most probable cause of a finding.
    Found,
    /// Another cause of a finding.
    #[serde(rename = "not_told_apart")]
    NotDiscriminated,
    /// It is significant alone, but explains less than what was found and is not needed beside that.
    ExplainsLess,
    /// It is not significant.
    #[serde(rename = "does_not_stand_out")]
    NotSignificant,
    /// It is not detectable in these data.
    #[serde(rename = "not_shown")]
    NotDetectable,
    /// The encoders do not resolve what it goes by.
    NotResolved,
    /// It is significant alone, and refused.
    #[serde(untagged)]
    Refused(Refusal),
}

impl Status {
    /// Was it tested: is it detectable in these data, and do the encoders resolve it?
    #[must_use]
    pub const fn is_tested(self) -> bool {
        !matches!(self, Self::NotDetectable | Self::NotResolved)
    }

    /// It in words.
    #[must_use]
    pub const fn text(self) -> &'static str {
        match self {
            Self::Found => "found",
            Self::NotDiscriminated => "not discriminated from what was found",
            Self::ExplainsLess => "explains less than what was found, and is not needed with it",
            Self::Refused(Refusal::Unphysical) => "significant, but its estimates are those of no possible effect",
            Self::Refused(Refusal::Implausible) => "significant, but its size is beyond what robots have",
            Self::Refused(Refusal::OtherWheels) => {
                "significant, but with it the wheels are far from the stated ones, and without it they are not"
            }
            Self::Refused(Refusal::NotConfirmed) => "its score is significant, and a fit with it does not confirm that",
            Self::Refused(Refusal::NotOverRuns) => "significant in a few runs alone, not over all of them",
            Self::Refused(Refusal::PredictsWorse) => "significant, but it predicts held-out runs worse",
            Self::Refused(Refusal::DriftsMore) => "significant, but odometry drifts more with it on held-out runs",
            Self::Refused(Refusal::Cancels) => {
                "significant only with another effect that cancels it: together they are far less than each is"
            }
            Self::NotSignificant => "not significant",
            Self::NotDetectable => "not detectable in these data",
            Self::NotResolved => NOT_RESOLVED,
        }
    }
}

/// Why a term that the encoders do not resolve is not tested.
pub(crate) const NOT_RESOLVED: &str =
    "not resolved by these encoders: the speeds that it goes by are mostly rounding of counts";

/// The alternatives, most probable first.
pub(crate) fn alternatives(
    found: &SearchResult<'_>,
    stamps: Option<&StampError>,
    findings: &[Finding],
) -> Vec<Alternative> {
    let entries = &found.first_scan;
    let best = entries.iter().map(|entry| entry.scored.log_odds).fold(0.0, f64::max);
    let best = stamps.map_or(best, |error| best.max(error.log_odds));
    let tests = tests_in(entries);
    let mut all: Vec<Alternative> = entries
        .iter()
        .map(|entry| {
            let (id, log_odds) = (entry.scored.candidate.id(), entry.scored.log_odds);
            let z = if entry.p_value > LEVELS.min_quantile_p_value {
                z_of_p(entry.p_value)
            } else {
                entry.scored.statistic.sqrt()
            };
            let status = if findings.iter().any(|finding| *finding.first() == Cause::Effect(id)) {
                Status::Found
            } else if findings.iter().any(|finding| finding.names(&Cause::Effect(id))) {
                Status::NotDiscriminated
            } else if !entry.scored.resolved {
                Status::NotResolved
            } else if entry.scored.dimensions == 0 {
                Status::NotDetectable
            } else if entry.p_value * tests > LEVELS.scan_level {
                // By its score; refitted it may have been.
                let of_refit = found.refusals.get(id).filter(|refusal| refusal.is_for_other_runs());
                of_refit.map_or(Status::NotSignificant, |refusal| Status::Refused(*refusal))
            } else {
                found.refusals.get(id).map_or(Status::ExplainsLess, |refusal| Status::Refused(*refusal))
            };
            Alternative { id: id.to_owned(), z, log_odds, to_the_best: log_odds - best, status }
        })
        .collect();
    // What was set right before the scan is in none of its entries.
    all.extend(stamps.map(|error| {
        let (z, log_odds) = (error.test.statistic.sqrt(), error.log_odds);
        let id = error.candidate.id().to_owned();
        Alternative { id, z, log_odds, to_the_best: log_odds - best, status: Status::Found }
    }));
    all.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds).then(a.id.cmp(&b.id)));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_detectable_or_not_resolved_is_not_tested() {
        assert!(!Status::NotDetectable.is_tested() && !Status::NotResolved.is_tested());
        assert!(Status::Found.is_tested() && Status::NotSignificant.is_tested() && Status::ExplainsLess.is_tested());
        assert!(Status::Refused(Refusal::Cancels).is_tested() && Status::NotDiscriminated.is_tested());
        assert_eq!(Status::NotResolved.text(), NOT_RESOLVED);
        let words = [Refusal::OtherWheels, Refusal::Cancels, Refusal::DriftsMore].map(|of| Status::Refused(of).text());
        assert!(words.iter().all(|of| of.starts_with("significant")) && words[0] != words[1] && words[1] != words[2]);
    }
}
