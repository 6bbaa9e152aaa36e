//! Partial measurements that a fit rejected as outliers, for people.

use crate::model_fit::ModelFit;
use crate::partial_observation::Quantity;
use crate::partial_records::PartialSegment;

/// The partial measurements that were rejected in a run: scalars, of which a reading of a wall has two.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PartialOutliers {
    /// Session and run.
    pub run: (usize, usize),
    /// How many were rejected, of each kind that has one.
    pub rejected: Vec<(&'static str, usize)>,
    /// How many partial measurements the run has.
    pub of: usize,
}

/// What a kind is called, in plural.
const fn kind(quantity: Quantity) -> &'static str {
    match quantity {
        Quantity::Displacement(_) => "components of revisits",
        Quantity::Distance => "taped distances",
        Quantity::WallDistance(_) => "distances from walls",
        Quantity::WallHeading(_) => "headings along walls",
        Quantity::GyroTurn { .. } => "turns of the gyro",
        Quantity::MeasuredPose { .. } => "poses",
    }
}

impl ModelFit<'_> {
    /// The partial measurements that the fit rejected, by run; runs without one are left out.
    #[must_use]
    pub fn partial_outliers(&self) -> Vec<PartialOutliers> {
        let mut found: Vec<PartialOutliers> = Vec::new();
        for (part, observation) in &self.solution.pass.partial_outliers {
            let Some(partial) = self.records.partial.get(*part) else { continue };
            let Some(of) = partial.observations.get(*observation) else { continue };
            let (run, kind) = (partial.segment.run, kind(of.quantity));
            if found.last().is_none_or(|last| last.run != run) {
                let of_run = self.records.partial.iter().filter(|partial| partial.segment.run == run);
                let of = of_run.map(PartialSegment::partial_measurements).sum();
                found.push(PartialOutliers { run, rejected: Vec::new(), of });
            }
            let Some(last) = found.last_mut() else { continue };
            match last.rejected.iter_mut().find(|(known, _)| *known == kind) {
                Some((_, count)) => *count += 1,
                None => last.rejected.push((kind, 1)),
            }
        }
        found
    }
}
