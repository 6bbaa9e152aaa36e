//! What all stamps are late by.
//!
//! Stamps that are late by varying times are late by some time on average, which their beat does not show:
//! against it, the instrument seems to be early. Where they hold up each other, the average is found with
//! them, to a share of it. A clock of the instrument that is off by no more is therefore no finding beside
//! them.

use dataset::Dataset;

use crate::document::Value;
use crate::findings::finding::Finding;
use crate::records::stamp_errors::StampError;
use crate::settings::RECORDS;

/// Gives what the instrument's clock seems to be off by to the error of the stamps, where that may be all of
/// it. `recorded` are the datasets with their stamps as they were recorded.
pub(crate) fn join_clock(findings: &mut Vec<Finding>, stamps: Option<&StampError>, recorded: &[Dataset]) {
    let offset = |finding: &Finding| {
        let name = effects::description(finding.first().id())?.clock_offset?;
        finding.parameters.get(name).filter(|_| finding.runs.is_none()).cloned()
    };
    let Some(of_stamps) = findings.iter().position(Finding::is_of_stamps) else { return };
    let mut offsets = findings.iter().enumerate().filter_map(|(at, finding)| Some((at, offset(finding)?)));
    let Some((clock, offset)) = offsets.next() else {
        return;
    };
    let early_s = -offset.value;
    let least =
        if stamps.is_some_and(|stamps| stamps.is_undone_roughly) { -RECORDS.max_restored_lateness_ratio } else { 0.0 };
    let lateness_s = lateness_s(recorded);
    if (least * lateness_s..=RECORDS.max_mean_lateness_ratio * lateness_s).contains(&early_s) {
        findings[of_stamps].parameters.insert("late_s".to_owned(), Value { value: early_s, ..offset });
        findings.remove(clock);
    }
}

/// By how much the stamps of all rows vary about their beat, root mean square, seconds.
fn lateness_s(recorded: &[Dataset]) -> f64 {
    let runs = recorded.iter().flat_map(|dataset| &dataset.runs).filter(|run| run.info.continuous);
    let (mut sum, mut count) = (0.0, 0.0);
    for period in runs.filter_map(|run| run.odometry.t_s.sampling_period()) {
        sum += period.late_s.iter().map(|late_s| late_s * late_s).sum::<f64>();
        count += period.late_s.len() as f64;
    }
    if count > 0.0 { (sum / count).sqrt() } else { 0.0 }
}
