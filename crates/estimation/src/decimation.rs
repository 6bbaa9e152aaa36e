//! Records with longer intervals, for covariates that hardly change from one row of a fast log to the next.
//!
//! Between two measurements at 10 Hz a log at 100 Hz has ten rows. A covariate that varies within tenths of a
//! second may be evaluated for five of them together. How far the rows together go across the arc of their
//! sum is kept.

use kinematics::Wheels;
use rayon::prelude::*;

use crate::records::Records;
use crate::segment::{MeasuredPose, Segment};
use crate::settings::{COMMON, STEP_LENGTH_TOLERANCE};
use crate::thinning::{PropagationInterval, Selection};
use crate::wheel_angles::WheelInterval;

/// Records with joined intervals, and the same measurements taken of them.
pub(crate) struct Decimated<'a> {
    pub(crate) records: Records<'a>,
    pub(crate) selections: Vec<Selection>,
}

impl<'a> Decimated<'a> {
    /// Joins intervals in which both wheels keep turning, up to `longest_s` seconds; measurements stay where
    /// they are. `None` where more than half of the intervals would be left.
    pub(crate) fn of(records: &Records<'a>, selections: &[Selection], longest_s: f64) -> Option<Self> {
        let intervals = |segments: &[Segment<'_>]| segments.iter().map(|of| of.intervals.len()).sum::<usize>();
        let joined = records.segments.par_iter().map(|segment| join_intervals(segment, longest_s));
        let (segments, ends): (Vec<Segment<'a>>, Vec<Vec<usize>>) = joined.unzip();
        if intervals(&segments) > intervals(&records.segments) / COMMON.min_decimation {
            return None;
        }
        let of_segment = |(propagations, ends): (&Vec<PropagationInterval>, &Vec<usize>)| {
            let of_propagation = |propagation: &PropagationInterval| PropagationInterval {
                intervals: ends[propagation.intervals.start]..ends[propagation.intervals.end],
                ..propagation.clone()
            };
            propagations.iter().map(of_propagation).collect()
        };
        let selections = selections
            .iter()
            .map(|of| Selection {
                propagations: of.propagations.iter().zip(&ends).map(of_segment).collect(),
                partial: of.partial.clone(),
            })
            .collect();
        Some(Self { records: records.with_segments(segments), selections })
    }
}

/// A segment with its intervals joined between measurements, and for each number of intervals before the
/// number now; the latter holds at measurements only. In a log with gaps none are joined: what a row took
/// longer than the sampling period stays with its own speed.
fn join_intervals<'a>(segment: &Segment<'a>, longest_s: f64) -> (Segment<'a>, Vec<usize>) {
    let mut ends = Vec::with_capacity(segment.intervals.len() + 1);
    let mut joined: Vec<WheelInterval> = Vec::new();
    let mut measured_before = vec![false; segment.intervals.len() + 1];
    segment.measurements.iter().for_each(|measurement| measured_before[measurement.after] = true);
    for (interval, measured_before) in segment.intervals.iter().zip(measured_before) {
        ends.push(joined.len());
        match joined.last_mut() {
            Some(last)
                if segment.info.continuous
                    && !measured_before
                    && last.dt_s + interval.dt_s <= longest_s * (1.0 + STEP_LENGTH_TOLERANCE)
                    && keeps_turning(last.wheel_rad, interval.wheel_rad) =>
            {
                let (before_s, all_s) = (last.dt_s, last.dt_s + interval.dt_s);
                last.rate_rad_s = last.rate_rad_s.zip_with(interval.rate_rad_s, |last, next| {
                    if all_s > 0.0 { (last * before_s + next * interval.dt_s) / all_s } else { last }
                });
                last.rate_at_ends_rad_s[1] = interval.rate_at_ends_rad_s[1];
                last.stands &= interval.stands;
                last.dt_s = all_s;
                // Arcs that follow each other go across the arc of their sum.
                let (a, b) = (last.wheel_rad, interval.wheel_rad);
                last.chord_area_rad2 += interval.chord_area_rad2 + 0.5 * (a.right * b.left - a.left * b.right);
                last.wheel_rad = last.wheel_rad.zip_with(interval.wheel_rad, |last, rad| last + rad);
                last.late_s[1] = interval.late_s[1];
                last.interpolated_rad2[1] = interval.interpolated_rad2[1];
                last.restored_rad2 = last.restored_rad2.zip_with(interval.restored_rad2, |last, rad2| last + rad2);
            }
            _ => joined.push(*interval),
        }
    }
    ends.push(joined.len());
    joined.shrink_to_fit();
    let measurements = segment
        .measurements
        .iter()
        .map(|measurement| MeasuredPose { after: ends[measurement.after], ..*measurement })
        .collect();
    (Segment { intervals: joined, measurements, ..*segment }, ends)
}

/// Do both wheels keep their direction: neither turns back, begins or stops?
fn keeps_turning(last: Wheels<f64>, next: Wheels<f64>) -> bool {
    let as_before = last.zip_with(next, |last, next| last * next > 0.0 || (last == 0.0 && next == 0.0));
    as_before.left && as_before.right
}
