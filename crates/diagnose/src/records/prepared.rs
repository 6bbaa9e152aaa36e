//! Records as faults and effects are sought in them: stamps that the counts show to be wrong, clocks, and
//! what does not belong are set right before any fit.

use dataset::Dataset;
use rayon::prelude::*;
use rules::Rule;

use crate::candidates::candidate::Candidate;
use crate::records::clocks::Clocks;
use crate::records::log::Log;
use crate::records::stamp_errors::{StampError, stamp_error_by_counts, uncertain_tick_s};
use crate::records::unknown_motion::{Anomaly, UnknownMotions, unknown_motions};

/// The records with what was set right in them, step after step.
pub(crate) struct Prepared<'d> {
    recorded: &'d [Dataset],
    /// Stamps that the counts show to be wrong.
    pub(crate) by_counts: Option<StampError>,
    /// Clocks that are far apart, or drift.
    pub(crate) clocks: Clocks,
    odd: Option<UnknownMotions>,
}

impl<'d> Prepared<'d> {
    /// Of a log. An offset of all clocks is taken off from so many seconds on.
    pub(crate) fn of(log: Log<'d>, every_term: &[Candidate], min_common_clock_s: f64) -> Self {
        let recorded = log.datasets;
        // The sampling periods of all runs, on all cores: whoever asks for them later asks run by run.
        recorded.par_iter().flat_map(|dataset| &dataset.runs).for_each(|run| {
            let _ = run.odometry.t_s.sampling_period();
        });
        let by_counts = Rule::StampsByCounts.finds(stamp_error_by_counts(recorded, every_term));
        let datasets = by_counts.as_ref().map_or(recorded, |error| &error.records[..]);
        let clocks = Clocks::of(datasets, min_common_clock_s);
        let datasets = clocks.records.as_deref().unwrap_or(datasets);
        let odd = unknown_motions(datasets, clocks.remaining_s, uncertain_tick_s(recorded), log.cuts_events);
        Self { recorded, by_counts, clocks, odd }
    }

    /// The records after the last step that changed them.
    pub(crate) fn records(&self) -> &[Dataset] {
        let odd = self.odd.as_ref().map(|odd| &odd.records[..]);
        let by_counts = self.by_counts.as_ref().map(|error| &error.records[..]);
        odd.or(self.clocks.records.as_deref()).or(by_counts).unwrap_or(self.recorded)
    }

    /// Whether a clock was set right.
    pub(crate) fn has_clock(&self) -> bool {
        self.clocks.drift.is_some() || !self.clocks.offsets.is_empty()
    }

    /// Runs and intervals that do not belong.
    pub(crate) fn anomalies(&self) -> &[Anomaly] {
        self.odd.as_ref().map_or(&[], |odd| &odd.anomalies)
    }
}
