//! Spans of a run over which the counts do not tell how the robot moved, or tell it as far as they are restored.
//! No part of the format: who examines the records sets them.

use kinematics::Wheels;

use crate::record::Run;

/// A span over which the counts do not tell how the robot moved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnknownMotion {
    /// Start, seconds from the run's start.
    pub from_s: f64,
    /// End, seconds from the run's start.
    pub to_s: f64,
}

/// A span over which counts were lost, and how well they are restored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RestoredMotion {
    /// Start, seconds from the run's start: a row.
    pub from_s: f64,
    /// End, seconds from the run's start: the next row.
    pub to_s: f64,
    /// Variance of each wheel's counts over it, counts².
    pub variance_counts2: Wheels<f64>,
}

impl Run {
    /// Do the counts leave open how the robot moved, somewhere between two instants?
    #[must_use]
    pub fn is_motion_unknown(&self, from_s: f64, to_s: f64) -> bool {
        let first = self.unknown_motion.partition_point(|span| span.to_s <= from_s);
        self.unknown_motion.get(first).is_some_and(|span| span.from_s < to_s)
    }

    /// The counts do not tell how the robot moved over some more spans.
    pub fn add_unknown_motion(&mut self, spans: impl IntoIterator<Item = UnknownMotion>) {
        self.unknown_motion.extend(spans);
        self.unknown_motion.sort_by(|a, b| a.from_s.total_cmp(&b.from_s));
        // Spans that overlap are one.
        self.unknown_motion.dedup_by(|next, span| {
            let overlaps = next.from_s <= span.to_s;
            if overlaps {
                span.to_s = span.to_s.max(next.to_s);
            }
            overlaps
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_of_unknown_motion_are_in_order_and_apart() {
        let span = |from_s, to_s| UnknownMotion { from_s, to_s };
        let mut run = Run::default();
        assert!(!run.is_motion_unknown(0.0, 100.0));
        run.add_unknown_motion([span(5.0, 6.0), span(1.0, 2.0)]);
        run.add_unknown_motion([span(1.5, 3.0)]);
        assert_eq!(run.unknown_motion, [span(1.0, 3.0), span(5.0, 6.0)]);
        let is_unknown = [(0.0, 1.0), (0.0, 1.1), (2.9, 4.0), (3.0, 5.0), (5.5, 5.6), (6.0, 7.0)]
            .map(|(from_s, to_s)| run.is_motion_unknown(from_s, to_s));
        assert_eq!(is_unknown, [false, true, true, false, true, false]);
    }
}
