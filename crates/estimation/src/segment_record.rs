//! What the rows of a segment say of the motion from one instant to another, for terms by which a measurement
//! is of another instant than its stamp.

use kinematics::Wheels;
use model_term::{MotionRecord, RecordedMotion};

use crate::model::Model;
use crate::wheel_angles::WheelInterval;

/// A segment's rows, by a model's lengths.
#[derive(Debug)]
pub(crate) struct SegmentRecord<'s> {
    pub(crate) intervals: &'s [WheelInterval],
    pub(crate) model: &'s Model,
}

impl MotionRecord for SegmentRecord<'_> {
    fn between(&self, from_s: f64, to_s: f64) -> Option<RecordedMotion> {
        let first = self.intervals.partition_point(|interval| interval.t_s + interval.dt_s <= from_s);
        let mut turned_rad = Wheels::both(0.0);
        let mut last = None;
        for interval in self.intervals[first..].iter().take_while(|interval| interval.t_s < to_s) {
            let (a_s, b_s) = (from_s.max(interval.t_s), to_s.min(interval.t_s + interval.dt_s));
            let (a, b) = (interval.rate_at(a_s), interval.rate_at(b_s));
            let half_s = 0.5 * (b_s - a_s);
            turned_rad = turned_rad.zip_with(a.zip_with(b, |a, b| half_s * (a + b)), |sum, of| sum + of);
            last = Some((b_s, b));
        }
        let (until_s, rate_rad_s) = last?;
        let twist = self.model.twist(rate_rad_s);
        Some(RecordedMotion { increment: self.model.increment(turned_rad), until_s, twist })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::dataset_of;

    /// Two rows of half a second: both wheels from 1 to 3 rad/s, then 3 rad/s, the left one back to 1.
    /// Between them one of no length.
    fn rows() -> Vec<WheelInterval> {
        let of = |t_s: f64, dt_s: f64, rate_at_ends_rad_s: [Wheels<f64>; 2]| WheelInterval {
            t_s,
            dt_s,
            wheel_rad: Wheels::both(0.0), // turns by counts, which are rounded, are not asked
            late_s: [0.0; 2],
            rate_rad_s: Wheels::both(0.0),
            rate_at_ends_rad_s,
            chord_area_rad2: 0.0,
            stands: false,
            starts_within_row: false,
            interpolated_rad2: [Wheels::both(0.0); 2],
            restored_rad2: Wheels::both(0.0),
            rate_steps: [0; 2],
        };
        let (slow, fast) = (Wheels::both(1.0), Wheels::both(3.0));
        let last = [fast, Wheels { left: 1.0, right: 3.0 }];
        vec![of(0.0, 0.5, [slow, fast]), of(0.5, 0.0, [fast, fast]), of(0.5, 0.5, last)]
    }

    #[test]
    fn the_motion_between_two_instants_is_the_area_under_the_rates() {
        let geometry = dataset_of(1, true).robot.geometry().expect("lengths");
        let (model, intervals) = (Model::of(&geometry, 0), rows());
        let record = SegmentRecord { intervals: &intervals, model: &model };
        // From 0.25 s, at 2 rad/s: (2 + 3)/2 · 0.25 rad, then to 0.75 s 3 · 0.25, left (3 + 2)/2 · 0.25.
        let of = record.between(0.25, 0.75).expect("rows");
        let turned_rad = Wheels { left: 1.25, right: 1.375 };
        let expected = model.increment(turned_rad);
        assert!((of.increment.distance_m - expected.distance_m).abs() < 1e-15, "{of:?}");
        assert!((of.increment.turn_rad - expected.turn_rad).abs() < 1e-15, "{of:?}");
        let end = model.increment(Wheels { left: 2.0, right: 3.0 });
        assert_eq!((of.until_s, of.twist.v_m_s, of.twist.omega_rad_s), (0.75, end.distance_m, end.turn_rad));
        // The record ends at 1 s.
        assert_eq!(record.between(0.9, 1.4).map(|of| of.until_s), Some(1.0));
        assert_eq!(record.between(1.0, 1.4), None);
    }
}
