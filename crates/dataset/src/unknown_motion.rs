//! Spans of a run over which the counts do not tell how the robot moved, or tell it as far as they were
//! restored. No part of the format: who examines the records sets them.

use kinematics::Wheels;

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

/// Does any of these spans, in time order and apart, reach into the time between two instants?
pub(crate) fn reach_into(spans: &[UnknownMotion], from_s: f64, to_s: f64) -> bool {
    let first = spans.partition_point(|span| span.to_s <= from_s);
    spans.get(first).is_some_and(|span| span.from_s < to_s)
}

/// Puts spans in time order; those that overlap are one.
pub(crate) fn join(spans: &mut Vec<UnknownMotion>) {
    spans.sort_by(|a, b| a.from_s.total_cmp(&b.from_s));
    spans.dedup_by(|next, span| {
        let overlaps = next.from_s <= span.to_s;
        if overlaps {
            span.to_s = span.to_s.max(next.to_s);
        }
        overlaps
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_of_unknown_motion_are_in_order_and_apart() {
        let span = |from_s, to_s| UnknownMotion { from_s, to_s };
        assert!(!reach_into(&[], 0.0, 100.0));
        let mut spans = vec![span(5.0, 6.0), span(1.0, 2.0), span(1.5, 3.0)];
        join(&mut spans);
        assert_eq!(spans, [span(1.0, 3.0), span(5.0, 6.0)]);
        let is_unknown = [(0.0, 1.0), (0.0, 1.1), (2.9, 4.0), (3.0, 5.0), (5.5, 5.6), (6.0, 7.0)]
            .map(|(from_s, to_s)| reach_into(&spans, from_s, to_s));
        assert_eq!(is_unknown, [false, true, true, false, true, false]);
    }
}
